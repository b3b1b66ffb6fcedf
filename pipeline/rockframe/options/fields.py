"""Types of option fields: bounds, lists of numbers, units, names of wavelets."""

from __future__ import annotations

import itertools
import math
import unicodedata
import warnings
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from rockframe.errors import RockframeWarning
from rockframe.options.model import value_error
from rockframe.units import ACCELERATION_UNITS, plain_units

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
        known = ", ".join(ACCELERATION_UNITS)
        raise value_error(f"{units!r}. Must be one of: {known}")
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
            raise value_error(f"{text!r}. Must not be stated twice")
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
#: Site of a sensor.
Site = Literal["free-field", "structure", "borehole", "unknown"]
#: Margins of verdicts: none, the first overturning, or also robust margins.
Margins = Literal["none", "first", "robust"]
