"""Command-line options, derived from the models in `rockframe.options`, and names of outputs."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import re
import types
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, get_args, get_origin

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from rockframe.cells import decimal
from rockframe.errors import ParameterError
from rockframe.options.model import (
    MOST_NUMBERS,
    NO_EFFECT,
    Options,
    description,
    evenly,
    explain,
    options_within,
)

if TYPE_CHECKING:
    from rockframe.options.model import Options


Model = TypeVar("Model", bound=Options)
#: Placeholder of a value in help texts, by the unit in which the name of an option ends.
_METAVARS: Final = {
    "_m_s": "M/S",
    "_s": "SECONDS",
    "_hz": "HERTZ",
    "_degree": "DEGREES",
    "_db": "DECIBEL",
    "_km": "KM",
}


def add_options(
    parser: argparse.ArgumentParser,
    model: type[Options],
    *,
    title: str = "",
    prefix: str = "",
    required: bool = True,
    without: Collection[str] = (),
) -> None:
    """Add an option ``--field-name`` for each field of a model, with its help and default.

    Fields without a default are required options. If `required` is false, argparse does not check
    this, and `chosen` reports a missing value. Fields in `without` get no option; ``ensemble.seed``
    is a field of a table within.
    """
    group = parser.add_argument_group(title) if title else parser
    for name, field in model.model_fields.items():
        if f"{prefix}{name}".replace("-", ".") in without:
            continue
        within = options_within(field.annotation)
        if within is not None:
            heading = (within.__doc__ or name).split("\n")[0].rstrip(".").lower()
            add_options(parser, within, title=heading, prefix=f"{prefix}{name}-", without=without)
            continue
        try:
            action = group.add_argument(
                flag(prefix + name),
                dest=prefix + name,
                default=argparse.SUPPRESS,
                help=_help(field, description(model, name)).replace("%", "%%"),
                **_reading(_alone(field.annotation), name, field),
            )
        except argparse.ArgumentError:  # added by another model
            continue
        action.required = required and field.is_required() and not prefix


def chosen(options: argparse.Namespace, model: type[Model], **others: Any) -> Model:
    """Return the options stated on the command line.

    Parameters
    ----------
    options : argparse.Namespace
        Parsed arguments.
    model : type
        Model of the options.
    **others
        Values of fields that the command line does not state, such as defaults of a command.

    Raises
    ------
    ParameterError
        If a value is invalid. The message names the option.
    """
    try:
        return model.model_validate(others | _stated(options, model, ""))
    except ValidationError as invalid:
        error = invalid.errors()[0]
        message = explain(error, lambda name: flag(name.replace(".", "-")))
        name, idle, rest = message.partition(NO_EFFECT)
        if idle:  # the name may be that of a table within
            message = flag("-".join([*map(str, error["loc"]), *name.split(".")])) + idle + rest
        for name in model.model_fields:  # also in messages about several options
            message = re.sub(rf"\b{name} false\b", flag(f"no_{name}"), message)
            if "_" in name:
                message = re.sub(rf"\b{name}\b", flag(name), message)
        raise ParameterError(message) from None


def _stated(options: argparse.Namespace, model: type[Options], prefix: str) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        within = options_within(field.annotation)
        if within is not None:
            nested = _stated(options, within, f"{prefix}{name}-")
            if nested:
                values[name] = nested
        elif hasattr(options, prefix + name):
            value_here = getattr(options, prefix + name)
            joined = isinstance(value_here, list) and isinstance(
                value_here[0], list
            )  # ranges of numbers
            values[name] = tuple(itertools.chain(*value_here)) if joined else value_here
    return values


def flag(name: str) -> str:
    """Return the option of the command line for a field."""
    return "--" + name.replace("_", "-")


def _help(field: FieldInfo, description: str) -> str:
    text = " ".join(description.split()).rstrip(".")
    if text.split(" ")[0][1:].islower():  # keep names such as StationXML
        text = text[:1].lower() + text[1:]
    default = field.default
    if default is None or default is PydanticUndefined or isinstance(default, bool):
        return text
    if isinstance(default, tuple):
        shown = default if len(default) <= 8 else ()
        default = " ".join(f"{value:g}" if isinstance(value, float) else value for value in shown)
    return f"{text} (default: {default})" if default != "" else text


def _alone(annotation: Any) -> Any:
    """Return the type inside ``Annotated`` or ``... | None``."""
    while get_origin(annotation) not in (None, tuple, Literal):
        annotation = next(part for part in get_args(annotation) if part is not types.NoneType)
    return annotation


def _title(field: FieldInfo) -> str:
    """Return the placeholder that a field states for its value."""
    parts = [field, *get_args(field.annotation)]
    parts += [entry for part in parts[1:] for entry in getattr(part, "__metadata__", ())]
    return next((p.title for p in parts if isinstance(p, FieldInfo) and p.title), "")


def _reading(annotation: Any, name: str, field: FieldInfo) -> dict[str, Any]:
    """Return the arguments of ``add_argument`` for an option of this type."""
    unit = name.rsplit("_", 1)[-1]
    units = (word for end, word in _METAVARS.items() if name.endswith(end))
    metavar = _title(field) or next(units, "NUMBER")
    if annotation is bool:
        return {
            "action": "store_true" if field.default is False else argparse.BooleanOptionalAction
        }
    if get_origin(annotation) is Literal:
        return {"choices": get_args(annotation)}
    if get_origin(annotation) is tuple:
        inner, last = _alone(get_args(annotation)[0]), get_args(annotation)[-1]
        if last is not Ellipsis:
            ends = ("LON", "LAT") if unit == "site" else ("FROM", "TO")
            return {"type": number, "nargs": 2, "metavar": ends}
        if inner is float:
            return {"type": numbers, "nargs": "+", "metavar": metavar}
        choices = {"choices": get_args(inner)} if get_origin(inner) is Literal else {}
        return {"nargs": "+", "action": "extend", "metavar": name.upper(), **choices}
    if annotation is float:
        return {"type": number, "metavar": metavar}
    if annotation is int:
        return {"type": whole_number, "metavar": "N"}
    return (
        {"type": path, "metavar": "FILE"}
        if annotation is Path
        else {"metavar": _title(field) or "NAME", "action": Once}
    )


class Once(argparse.Action):
    """An option that may be stated only once."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,  # noqa: ARG002 -- as argparse calls it
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,  # noqa: ARG002
    ) -> None:
        """Store the value; an option that is stated twice is an error."""
        if getattr(namespace, self.dest, None) is not None:
            raise argparse.ArgumentError(self, "stated twice. State it once")
        setattr(namespace, self.dest, values)


def path(text: str) -> Path:
    """Return the path in a command-line argument, which must not be empty."""
    if not text:
        raise argparse.ArgumentTypeError("empty path. State a file or folder")
    return Path(text)


def number(text: str) -> float:
    """Return the number in a command-line argument."""
    if re.fullmatch(r"[-+]?inf", text):  # an open end of a range
        return float(text)
    try:
        return decimal(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"Invalid value {text!r}. Must be a number") from None


def whole_number(text: str) -> int:
    """Return the whole number in a command-line argument."""
    if not re.fullmatch(r"[+-]?[0-9]{1,18}", text):
        raise argparse.ArgumentTypeError(f"Invalid value {text[:30]!r}. Must be a whole number")
    return int(text)


def numbers(text: str) -> list[float]:
    """Return the numbers in a command-line argument: one number, or evenly spaced FROM:TO:COUNT."""
    parts = text.split(":")
    with contextlib.suppress(argparse.ArgumentTypeError):
        if len(parts) == 1:
            return [number(text)]
        if len(parts) == 3:
            first, last, count = number(parts[0]), number(parts[1]), whole_number(parts[2])
            if 2 <= count <= MOST_NUMBERS:
                return evenly(first, last, count)
    message = (
        f"Invalid value {text!r}. Must be a number, or FROM:TO:COUNT, count 2 to {MOST_NUMBERS}"
    )
    raise argparse.ArgumentTypeError(message)


#: File extensions; a name that ends in one of them is probably not meant for a folder.
_OF_FILES: Final = (
    *(".csv", ".html", ".json", ".nc", ".ods", ".pdf", ".png"),
    *(".svg", ".toml", ".tsv", ".txt", ".xls", ".xlsx", ".zip"),
)


def file_to_write(*endings: str) -> Callable[[str], Path]:
    """Return the argparse type of an option that names a file with one of these extensions.

    Examples
    --------
    >>> file_to_write(".csv")("table.xlsx")
    Traceback (most recent call last):
    argparse.ArgumentTypeError: 'table.xlsx'. Must end in .csv
    """

    def named(text: str) -> Path:
        if path(text).suffix.lower() not in endings:
            allowed = " or ".join(filter(None, [", ".join(endings[:-1]), endings[-1]]))
            raise argparse.ArgumentTypeError(f"{text!r}. Must end in {allowed}")
        return Path(text)

    return named


def folder_to_write(text: str) -> Path:
    """Return the folder in a command-line argument. A name that ends like a file is an error.

    Examples
    --------
    >>> folder_to_write("outputs/v1.2").name
    'v1.2'
    """
    if path(text).suffix.lower() in _OF_FILES:
        raise argparse.ArgumentTypeError(f"{text!r} is named like a file. State a folder")
    return Path(text)
