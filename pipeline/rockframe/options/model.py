"""The base class of all option models, with one-line messages for invalid values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.dataclasses import dataclass as pydantic_dataclass
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from rockframe.errors import ParameterError

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
        use_attribute_docstrings=True,
        serialize_by_alias=True,
    )

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


def rule(message: str) -> PydanticCustomError:
    """Return the error of a model: a complete sentence without its full stop."""
    return PydanticCustomError(RULE, "{message}", {"message": message})


def value_error(message: str) -> PydanticCustomError:
    """Return the error of one field: a sentence that starts with the value, without full stop."""
    return PydanticCustomError(VALUE, "{message}", {"message": message})


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
        return f"{name} is missing. Must be stated."
    return f"{name} {error['input']!r}. Must be {must_be(error)}."


def must_be(error: ErrorDetails) -> str:
    """Return what is allowed in place of an invalid value."""
    kind, context = error["type"], error.get("ctx", {})
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
def fields_of(table: type) -> dict[str, FieldInfo]:
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
    found = (options_within(inner) for inner in get_args(annotation))
    return next((model for model in found if model is not None), None)
