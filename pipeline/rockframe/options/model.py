"""The base class and the types of all options; options of processes, batches and figures."""

from __future__ import annotations

import ast
import inspect
import itertools
import math
import textwrap
import unicodedata
import warnings
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Final,
    Literal,
    NamedTuple,
    Self,
    TypeAlias,
    get_args,
)

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic.dataclasses import dataclass as pydantic_dataclass
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from rockframe.errors import ParameterError, RockframeWarning, Trusted
from rockframe.units import ACCELERATION_UNITS, plain_units

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
    from pydantic_core import ErrorDetails
else:
    ModelMetaclass = type(BaseModel)  # pydantic does not export this class

#: Type of an error raised by a model: a complete sentence without its full stop.
RULE: Final = "rule"
#: Type of an error of one field: a sentence that starts with the value.
VALUE: Final = "value"
#: Type of a `ParameterError` that a model raises.
REFUSED: Final = "value_error"
#: Types of the error of an unknown key: of a model, and of a dataclass.
UNKNOWN: Final = ("extra_forbidden", "unexpected_keyword_argument")
_MUST_BE: Final = {
    "bool_type": "true or false",
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text",
    "string_pattern_mismatch": "1 to 64 letters, digits, points, hyphens or underscores",
    "tuple_type": "a list",
    "too_short": "a list of one or more",
    "too_long": "a list of two numbers",
    "missing": "a list of two numbers",
    "finite_number": "a finite number",
    "path_type": "the path of a file",
}


class _OneLine(ModelMetaclass):
    """Metaclass of models whose constructor raises a one-line `ParameterError`."""

    def __call__(cls, *args: Any, **values: Any) -> Any:  # noqa: N805 -- of a metaclass
        try:
            return super().__call__(*args, **values)
        except ValidationError as invalid:
            raise ParameterError(explain(invalid.errors()[0], str)) from None


@cache
def _descriptions(model: type) -> dict[str, str]:
    """Return the text below each field of a class, read from its source.

    Pydantic would read the sources of all classes at every start of a command.
    """
    try:
        source = textwrap.dedent(inspect.getsource(model))
    except (OSError, TypeError):  # a model that the package makes from others
        return {}
    (definition,) = ast.parse(source).body
    texts = {}
    for field, below in itertools.pairwise(getattr(definition, "body", ())):
        if isinstance(field, ast.AnnAssign) and isinstance(below, ast.Expr):
            texts[ast.unparse(field.target)] = inspect.cleandoc(ast.literal_eval(below.value))
    return texts


def description(table: type, key: str) -> str:
    """Return the description of a key: that of its field, or the text below it in the class."""
    field = option_fields(table)[key]
    names = {id(field): name for name, field in getattr(table, "model_fields", {}).items()}
    name = names.get(id(field), key)
    texts = (_descriptions(base).get(name) for base in table.__mro__ if issubclass(base, Options))
    return field.description or next((text for text in texts if text), "")


def _described(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Add the descriptions of the fields to a JSON schema."""
    for name, key in schema.get("properties", {}).items():
        if text := description(model, name):
            key["description"] = text


#: Between an option and what it needs, in the error of `Options.conditions`.
NO_EFFECT: Final = " has no effect without "


class Condition(NamedTuple):
    """The need of an option that has no effect alone, in words, and its test."""

    words: str
    holds: Callable[[Any], bool]


Conditions: TypeAlias = Mapping[str, Condition]


class Options(BaseModel, metaclass=_OneLine):
    """Options of a stage; unknown names and values of another type are errors.

    Each field states its type, bounds and default, followed by its description with the unit. The
    command line, the study file, its JSON schema and its comments are derived from the fields.

    Raises
    ------
    ParameterError
        If a value is not allowed.
    """

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        serialize_by_alias=True,
        json_schema_extra=_described,
        defer_build=True,  # most commands validate few models
    )

    #: Options that have an effect only under a condition: the condition in words, and its test. The
    #: name of an option of a table within has a point, as in ``ensemble.height``.
    conditions: ClassVar[Conditions] = {}

    @model_validator(mode="after")
    def _no_idle_option(self) -> Self:
        """Reject options that differ from their default and have no effect."""
        for name, (words, holds) in type(self).conditions.items():
            owner: Any = self
            *tables, last = name.split(".")
            for table in tables:
                owner = getattr(owner, table)
            if getattr(owner, last) != type(owner).model_fields[last].default and not holds(self):
                raise rule(f"{name}{NO_EFFECT}{words}. State that, or leave it out")
        return self

    def stated(self) -> dict[str, Any]:
        """Return all values as JSON values; files are reduced to their names."""
        values = self.model_dump(mode="json")
        for name, path in self.files().items():
            values[name] = path.name
        return values

    def files(self) -> dict[str, Path]:
        """Return the stated files by the name of their option."""
        return {name: value for name, value in self if isinstance(value, Path)}

    def replaced(self, **values: Any) -> Self:
        """Return the options with some values replaced and validated."""
        return type(self)(**{**dict(self), **values})


#: The distance to the site of a hazard file matters where its place is stated.
OF_SITE: Final = Condition("hazard_site", lambda options: options.hazard_site is not None)


def rule(message: str) -> PydanticCustomError:
    """Return the error of a model: a complete sentence without its full stop."""
    return PydanticCustomError(RULE, "{message}", {"message": message})


def value_error(message: str) -> PydanticCustomError:
    """Return the error of one field: a sentence that starts with the value, without full stop."""
    return PydanticCustomError(VALUE, "{message}", {"message": message})


def require_one_site(place: tuple[float, float] | None, name: str | None) -> None:
    """Reject a site of a hazard file that is stated twice, or with invalid coordinates."""
    if place is None:
        return
    longitude, latitude = place
    if name is not None:
        raise rule("hazard_site and hazard_site_id both stated. State only one of them")
    if not (-180.0 <= longitude <= 360.0 and -90.0 <= latitude <= 90.0):
        message = f"hazard_site {longitude:g} {latitude:g}. Must be longitude, then latitude"
        raise rule(message)


def explain(error: ErrorDetails, named: Callable[[str], str]) -> str:
    """Return one line with the invalid value and what is allowed; `named` translates names."""
    kind = error["type"]
    if kind == RULE:
        return f"{error['msg']}."
    if kind == REFUSED:
        return str(error["ctx"]["error"])
    names = [part for part in error["loc"] if isinstance(part, str)]
    name = named(".".join(names))
    if kind == VALUE:
        return f"{name} {error['msg']}."
    if kind in UNKNOWN:
        return f"unknown option {name!r}."
    if kind == "missing" and not isinstance(error["loc"][-1], int):
        return f"{name} is missing."
    return f"{name} {error['input']!r}. Must be {must_be(error)}."


def must_be(error: ErrorDetails) -> str:
    """Return what is allowed in place of an invalid value."""
    kind, context = error["type"], error.get("ctx", {})
    if kind == "too_short" and context["min_length"] > 1:
        return f"a list of {context['min_length']} or more"
    if kind == "literal_error":
        return str(context["expected"]).replace("'", "")
    if kind == "greater_than":
        return f"above {context['gt']:g}"
    if kind == "greater_than_equal":
        least = context["ge"]
        return f"at least {least:g}" if least else "zero or positive"
    if kind == "less_than":
        return f"below {context['lt']:g}"
    if kind == "less_than_equal":
        return f"at most {context['le']:g}"
    return _MUST_BE.get(kind, "valid")


@cache
def option_fields(table: type) -> dict[str, FieldInfo]:
    """Return the fields of a model, or of a dataclass that is a table, by their key in files."""
    if issubclass(table, BaseModel):
        fields = table.model_fields
    else:  # only pydantic's own dataclasses tell their fields
        fields = pydantic_dataclass(frozen=True, kw_only=True)(table).__pydantic_fields__
    return {field.alias or name: field for name, field in fields.items()}


def options_within(annotation: Any) -> type | None:
    """Return the option model, or the dataclass that is a table, inside an annotation, or None."""
    if isinstance(annotation, type) and (
        issubclass(annotation, Options) or is_dataclass(annotation)
    ):
        return annotation
    within = (options_within(inner) for inner in get_args(annotation))
    return next((model for model in within if model is not None), None)


#: Largest number of values in a list; a longer list is probably a mistake.
MOST_NUMBERS: Final = 2_000
#: Limit of the ends of a span, so that values between them can be computed without overflow.
_HUGE: Final = 1e300
_SPAN: Final = (
    f"Must be a list of numbers, or {{ from = NUMBER, to = NUMBER, count = 2 to {MOST_NUMBERS} }}"
)


def evenly(first: float, last: float, count: int) -> list[float]:
    """Return evenly spaced numbers with exact ends; 30 values from 0.1 to 3 contain exactly 1.

    Parameters
    ----------
    first, last : float
        The ends.
    count : int
        Number of values, at least 2.

    Examples
    --------
    >>> evenly(1.0, 2.0, 5)
    [1.0, 1.25, 1.5, 1.75, 2.0]
    """
    within = [(first * (count - 1 - k) + last * k) / (count - 1) for k in range(1, count - 1)]
    return [first, *within, last]


def _listed(stated: Any) -> Any:
    """Return the numbers described by a table of two ends and a count; other values unchanged."""
    if not isinstance(stated, dict):
        return stated.tolist() if hasattr(stated, "tolist") else stated
    match stated:
        case {"from": int() | float() as first, "to": int() | float() as last, "count": int(count)}:
            whole = len(stated) == 3 and bool not in map(type, stated.values())
            sound = -_HUGE < first < _HUGE and -_HUGE < last < _HUGE and 2 <= count <= MOST_NUMBERS
            if whole and sound:
                return evenly(float(first), float(last), count)
    raise value_error(f"{stated}. {_SPAN}")


def _ascending(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if len(numbers) > MOST_NUMBERS:
        raise value_error(f"of {len(numbers)} numbers. Must be at most {MOST_NUMBERS}")
    for number, following in itertools.pairwise(numbers):
        if not number < following:
            raise value_error(f"{following:g} after {number:g}. Must increase")
    if not all(map(math.isfinite, numbers)):
        raise value_error("with an infinite number. Must be finite")
    return numbers


def _from_zero(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if numbers[0] < 0.0:
        raise value_error(f"with {numbers[0]:g}. Must be zero or positive")
    return numbers


def _above_zero(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if numbers[0] <= 0.0:
        raise value_error(f"with {numbers[0]:g}. Must be above 0")
    return numbers


#: Increasing numbers, at least one; or ``{ from = 1.0, to = 8.0, count = 71 }``.
Numbers = Annotated[
    tuple[float, ...],
    Field(strict=False, min_length=1),
    BeforeValidator(_listed),
    AfterValidator(_ascending),
    WithJsonSchema(
        {
            "anyOf": [
                {
                    "type": "array",
                    "items": {"type": "number"},
                    "minItems": 1,
                    "maxItems": MOST_NUMBERS,
                },
                {
                    "type": "object",
                    "properties": {
                        "from": {"type": "number"},
                        "to": {"type": "number"},
                        "count": {"type": "integer", "minimum": 2, "maximum": MOST_NUMBERS},
                    },
                    "required": ["from", "to", "count"],
                    "additionalProperties": False,
                },
            ]
        }
    ),
]
#: `Numbers` that are all zero or positive, and `Numbers` that are all positive.
NumbersFromZero = Annotated[Numbers, AfterValidator(_from_zero)]
PositiveNumbers = Annotated[Numbers, AfterValidator(_above_zero)]


def _known_units(units: str) -> str:
    if units not in ACCELERATION_UNITS:
        allowed = ", ".join(ACCELERATION_UNITS)
        raise value_error(f"{units!r}. Must be one of: {allowed}")
    return units


def _increasing(bounds: tuple[float, float]) -> tuple[float, float]:
    low, high = bounds
    if math.isnan(low) or math.isnan(high) or low > high:
        raise value_error(f"[{low:g}, {high:g}]. The lower bound must be stated first")
    return bounds


def _positive(bounds: tuple[float, float]) -> tuple[float, float]:
    if not 0.0 < bounds[0] < bounds[1] < math.inf:
        low, high = bounds
        raise value_error(f"[{low:g}, {high:g}]. Must be two positive numbers that increase")
    return bounds


def _unique(texts: tuple[str, ...]) -> tuple[str, ...]:
    for text in texts:
        if texts.count(text) > 1:
            raise value_error(f"{text!r} is stated twice")
    return texts


def warn_beyond_turn(azimuth: float) -> float:
    """Return an azimuth [degree]; warn if it is beyond 360 degrees."""
    if abs(azimuth) > 360.0:
        words = f"is beyond 360: taken modulo 360, as {azimuth % 360.0:g}."
        warnings.warn(f"azimuth {azimuth:g} degrees {words}", RockframeWarning, stacklevel=2)
    return azimuth


#: Unit of acceleration.
Units = Annotated[
    str,
    AfterValidator(plain_units),
    AfterValidator(_known_units),
    WithJsonSchema({"enum": list(ACCELERATION_UNITS), "type": "string"}),
]
#: A finite number.
Finite = Annotated[float, Field(allow_inf_nan=False)]
#: An azimuth or strike [degree].
Azimuth = Annotated[Finite, AfterValidator(warn_beyond_turn)]
#: A finite number above zero.
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
#: A closed interval.
Bounds = Annotated[tuple[float, float], Field(strict=False), AfterValidator(_increasing)]
#: A range of positive numbers.
Range = Annotated[tuple[float, float], Field(strict=False), AfterValidator(_positive)]
#: At least one text, none twice.
Texts = Annotated[tuple[str, ...], Field(strict=False, min_length=1), AfterValidator(_unique)]
#: A file; in a study relative to the folder of the study file.
File = Annotated[Path, Field(strict=False)]
#: Name of a study or a structure: letters and digits of any script (with their marks), points,
#: hyphens and underscores, starting with a letter or digit; NFC, so that equal names compare equal.
Name = Annotated[
    str,
    Field(pattern=r"^[\p{L}\p{Nd}][\p{L}\p{M}\p{Nd}._-]{0,63}$"),
    AfterValidator(lambda name: unicodedata.normalize("NFC", name)),
]
#: Seed of random numbers.
Seed = Annotated[int, Field(ge=0)]
Wavelet = Literal[
    "symmetric_ricker", "antisymmetric_ricker", "ricker_any_phase", "mavroeidis_papageorgiou"
]
#: At least one wavelet, none twice.
Wavelets = Annotated[
    tuple[Wavelet, ...], Field(strict=False, min_length=1), AfterValidator(_unique)
]
#: At least one pulse shape, none twice: the wavelets, and sines and cosines of one lobe or period.
Shapes = Annotated[
    tuple[Literal[Wavelet, "half_sine", "full_sine", "full_cosine"], ...],
    Field(strict=False, min_length=1),
    AfterValidator(_unique),
]
#: Responses whose histories are written: none, those that overturn or nearly do, or all.
Kept = Literal["none", "selected", "all"]
#: Further measures of intensity; those at the end are of both horizontals.
FurtherMeasure = Literal[
    "cav",
    "arias_intensity",
    "housner_intensity",
    "pga_rotd50",
    "pga_rotd100",
    "pgv_rotd50",
    "pgv_rotd100",
    "sa_rotd50",
    "sa_rotd100",
]
FurtherMeasures = Annotated[
    tuple[FurtherMeasure, ...], Field(strict=False, min_length=1), AfterValidator(_unique)
]
#: Site of a sensor.
Site = Literal["free-field", "structure", "borehole", "unknown"]
#: At least one site, none twice; a single site may be stated without a list.
Sites = Annotated[
    tuple[Site, ...],
    Field(strict=False, min_length=1),
    BeforeValidator(lambda stated: (stated,) if isinstance(stated, str) else stated),
    AfterValidator(_unique),
]
#: Columns of this package and their names in a table.
Names = Annotated[
    tuple[Annotated[str, Field(title="COLUMN=NAME")], ...], Field(min_length=1, strict=False)
]
#: Records that follow one another, at least two.
Motions = Annotated[tuple[str, ...], Field(strict=False, min_length=2)]
#: At least one word for contradictions, none twice; a single word may be stated without a list.
Trust = Annotated[
    tuple[Trusted, ...],
    Field(strict=False, min_length=1),
    BeforeValidator(lambda stated: (stated,) if isinstance(stated, str) else stated),
    AfterValidator(_unique),
]
#: Margins of verdicts: none, the first overturning, or also robust margins.
Margins = Literal["none", "first", "robust"]


#: Largest number of processes; no machine has more cores.
_MOST_WORKERS: Final = 4096


class ReadingOptions(Options):
    """Options of the processes that read files."""

    workers: Annotated[int, Field(ge=0, le=_MOST_WORKERS)] | None = None
    """Largest number of processes that read files at once, each protected against crashes of the
    others; 0 reads in this process, without that protection. By default one for each core."""


class ExecutionOptions(Options):
    """Options of the processes or the cluster that compute a stage."""

    workers: Annotated[int, Field(ge=1, le=_MOST_WORKERS)] | None = None
    """Largest number of processes that compute at once; by default one for each core. A single
    process uses the number of threads that OMP_NUM_THREADS states."""
    scheduler: str | None = None
    """Compute on the Dask cluster of this scheduler instead, tcp://HOST:PORT (needs the extra
    `dask`)."""


class BatchOptions(Options):
    """Batches of records in a run."""

    records: Annotated[int, Field(ge=1)] = 50
    """Number of record files of each batch. The default is larger where there would be more than
    150 batches."""


class FigureOptions(Options):
    """The figures of single records, of screenings and of spectra."""

    most: Annotated[int, Field(ge=0)] = 24
    """Largest number of figures of single records; 0 for no figures at all. If there are more
    records, those with the largest rotations without overturning are drawn."""


class ReportOptions(Options):
    """The page of the run."""

    histories: Annotated[int, Field(ge=1)] = 150
    """Largest number of histories in the page. If there are more, or if the page would be larger
    than 20 MB, the largest rotations without overturning are chosen first."""
    rows: Annotated[int, Field(ge=1)] = 5000
    """Largest number of rows of the table in the page. If there are more, they are chosen in the
    same way; the counts still include all of them. Fewer are shown if the motions of these rows
    have more than 524,288 results together."""
    company: Annotated[str, Field(max_length=80)] = ""
    """Name of the company on the client's page."""
    project: Annotated[str, Field(max_length=120)] = ""
    """Name of the project on the client's page; by default that of the run."""
    question: Annotated[str, Field(max_length=240)] = ""
    """Question that the client's page answers; by default whether the structures stand."""
    logo: Annotated[File | None, Field(examples=["logo.png"])] = None
    """Logo on the client's page: PNG, JPEG or SVG of at most 0.5 MB, relative to the current
    folder."""
