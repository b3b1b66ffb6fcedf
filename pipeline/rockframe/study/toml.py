"""Read TOML files into strict models; each error is one line with the line number."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar, get_origin

from pydantic import ValidationError

from rockframe.errors import InputError, ParameterError, meant
from rockframe.options.ingest import PassportLimits
from rockframe.options.model import (
    REFUSED,
    RULE,
    UNKNOWN,
    VALUE,
    Options,
    explain,
    option_fields,
    options_within,
)

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

#: Endings of keys that state their unit.
_UNIT: Final = "(_(m|m2|s|pa|n|nm|n_m|kg|kg_m3))?"
#: Keys that people try for structures that the model does not have, and the subject.
_BEYOND: Final = {
    "drums": r"drums?|blocks?",
    "soil and footings": r".*(soil|footing|foundation).*",
    "flexible columns": r".*(flexib|column_modulus|column_stiffness|period).*",
    "sliding": r".*sliding.*",
    "pedestals": r".*(pedestal|support).*",
}
#: Page of the documentation about structures that the model does not have.
_LIMITS_PAGE: Final = "See the page 'What it cannot do, and what to use instead'."
_Location = tuple[str | int, ...]
File = TypeVar("File", bound=Options)
#: Largest depth of nested tables and lists; no model has more than four levels.
_DEEPEST: Final = 16
#: Bound of integers in TOML.
_LIMIT: Final = 2**63


def parse(path: Path, text: str, model: type[File]) -> File:
    """Return the model of the text of a TOML file.

    Raises
    ------
    InputError
        If the text is not TOML, a key is unknown or missing, or a value is invalid.
    """
    content = _loaded(path, text)
    try:
        return model.model_validate(content)
    except ValidationError as invalid:
        # unknown keys first: an unknown key is often a missing key misspelt
        errors = sorted(invalid.errors(), key=lambda error: error["type"] not in UNKNOWN)
        message, where = _explain(errors[0], model, content)
        raise InputError(path, message, line_of(text, where)) from None


def _loaded(path: Path, text: str) -> dict[str, Any]:
    """Parse a TOML text, with limits on depth and integers, which Python's parser does not have."""
    try:
        content = tomllib.loads(text)
        beyond = _too_large(content)
    except RecursionError:
        raise InputError(
            path, f"is nested too deeply. Must be {_DEEPEST} levels of tables and lists at most."
        ) from None
    except tomllib.TOMLDecodeError as error:
        comma = re.search(r"=\s*\d+,\d", text)
        hint = " Decimal numbers need a point, as in 9.6." if comma else ""
        raise InputError(path, f"is not TOML: {error}.{hint}") from None
    except ValueError:  # integers of more than 4300 digits
        beyond = ("",)
    if beyond:
        raise InputError(path, "a whole number must fit into 64 bits.", line_of(text, beyond))
    return content


def _too_large(value: Any, where: _Location = ()) -> _Location:
    """Return the place of the first integer beyond 64 bits, or ()."""
    if len(where) > _DEEPEST:
        raise RecursionError
    if isinstance(value, int) and not -_LIMIT <= value < _LIMIT:
        return where
    inner: Iterable[tuple[str | int, Any]] = ()
    if isinstance(value, dict | list):
        inner = value.items() if isinstance(value, dict) else enumerate(value)
    return next((place for key, part in inner if (place := _too_large(part, (*where, key)))), ())


def _explain(
    error: ErrorDetails, model: type[Options], content: dict[str, Any]
) -> tuple[str, _Location]:
    """Return the message and place of an error; pydantic's own text is for programmers."""
    kind, where = error["type"], error["loc"]
    if kind == REFUSED:
        owner = _owner(model, where, content)[1]
        return _invalid_quantity(error["ctx"]["error"], model, owner, where)
    names = tuple(part for part in where if isinstance(part, str))
    of_value = explain(error, lambda _: _dotted(model, names)), where
    if kind in (RULE, VALUE) or (kind == "missing" and isinstance(where[-1], int)):
        return of_value
    table, owner = _owner(model, where[:-1], content)
    if kind in UNKNOWN:
        keys_here = [_written(owner, key, table) for key in option_fields(owner)]
        hint = meant(names[-1], option_fields(owner))
        key = _dotted(model, names)
        if "structure" in names and not hint and (subject := _beyond(names[-1])):
            return f"unknown key {key!r}. Not modelled: {subject}. {_LIMITS_PAGE}", where
        return f"unknown key {key!r}. Must be one of: {', '.join(keys_here)}.{hint}", where
    whole = _written(owner, names[-1], table)
    if whole.startswith("[["):
        if kind in {"missing", "too_short", "tuple_type"}:
            return f"no {whole} table. State at least one.", where[:1]
    elif kind == "missing":
        each = f" in {'each ' if table.startswith('[[') else ''}{table}" if table else ""
        return f"key {names[-1]!r} missing. State it{each}.", where[:-1]
    if kind in {"model_type", "dataclass_type"}:
        return f"{names[-1]} {error['input']!r}. Must be a table, [{'.'.join(names)}].", where
    if kind == "float_type" and "structure" in names and isinstance(error["input"], list):
        return f"{of_value[0]} {_equal_columns(names[-1], error['input'])}", where
    return of_value


def _equal_columns(key: str, sizes: list[Any]) -> str:
    """Return what to state instead of several sizes of the columns of a frame."""
    kind = ""
    if key in ("height_m", "width_m") and len(sizes) == 2:
        keys = "heights_m, widths_m and spacing_m"
        kind = f' Two columns of unequal size are kind = "unequal", with {keys}.'
    return f"Columns are equal.{kind} {_LIMITS_PAGE}"


def _beyond(key: str) -> str:
    """Return the subject of a key if the model lacks it, or ""."""
    return next((name for name, keys in _BEYOND.items() if re.fullmatch(keys, key)), "")


def _invalid_quantity(
    error: ParameterError, model: type[Options], owner: type, where: _Location
) -> tuple[str, _Location]:
    """Return the message about an invalid quantity of a table, and the place of its key."""
    names = tuple(part for part in where if isinstance(part, str))
    keys = _keys(owner, error.quantity)
    if not keys:
        return str(error), where
    dotted = _dotted(model, (*names, *keys))
    if error.value is None:
        return f"key {dotted!r} missing. Must be {error.allowed}.", where
    return f"{dotted} {error.value!r}. Must be {error.allowed}.", (*where, *keys)


def _keys(model: type, quantity: str) -> tuple[str, ...]:
    """Return the path to the key of a quantity; a key is the quantity's name with its unit.

    A quantity of a certain table is preceded by its name, as in ``fixed.modulus``.
    """
    for name, field in option_fields(model).items():
        inner = options_within(field.annotation)
        below = () if inner is None else _keys(inner, quantity.removeprefix(f"{name}."))
        if below or (quantity and re.fullmatch(f"{re.escape(quantity)}{_UNIT}", name)):
            return name, *below
    return ()


def _owner(model: type, where: _Location, content: Any) -> tuple[str, type]:
    """Return the header of the table at this path, as written in the file, and its model."""
    written = ""
    for name in where:
        content = _at(content, name)
        if isinstance(name, str):
            inner = options_within(option_fields(model)[name].annotation)
            if inner is None:
                break
            written = _written(model, name, written)
            model = inner
        # some tables are of one of several models, which the table itself states
        model = model.for_value(content) if hasattr(model, "for_value") else model
    return written, model


def _at(content: Any, name: str | int) -> Any:
    """Return the part of a content with a key or a number; None if there is none."""
    if isinstance(content, dict):
        return content.get(name)
    return content[name] if isinstance(content, list) and isinstance(name, int) else None


def _written(model: type, key: str, table: str) -> str:
    """Return a key as written in the file; a table is in brackets."""
    if key not in option_fields(model):
        return key
    annotation = option_fields(model)[key].annotation
    if options_within(annotation) is None:
        return key
    if table:
        return f"[{table.strip('[]')}.{key}]"
    return f"[[{key}]]" if get_origin(annotation) is tuple else f"[{key}]"


def _dotted(model: type[Options], names: tuple[str, ...]) -> str:
    """Return the name of a key, preceded by its table if the file has several kinds of table."""
    alone = len(model.model_fields) == 1 or any(
        get_origin(model.model_fields[name].annotation) is tuple
        for name in names[:-1]
        if name in model.model_fields
    )
    return names[-1] if alone and len(names) < 3 else ".".join(names)


def line_of(text: str, where: _Location) -> int | None:
    """Return the line of a key (from 1), or of its table if the key is not found, or None."""
    tables: Counter[str] = Counter()
    table: _Location = ()
    found, deepest = None, 0
    for number, line in enumerate(text.splitlines(), 1):
        heading = re.match(r"\s*(\[{1,2})\s*([\w.\"-]+)\s*\]", line)
        key = re.match(r"\s*([\w\"-]+)\s*=", line)
        if heading:
            name = heading[2].replace('"', "")
            table = tuple(name.split("."))
            if heading[1] == "[[":
                table = (*table, tables[name])
                tables[name] += 1
            elif name.split(".")[0] in tables:  # a sub-table of the last table in a list of tables
                first, *inner = name.split(".")
                table = (first, tables[first] - 1, *inner)
            here = table
        elif key:
            here = (*table, key[1].strip('"'))
        else:
            continue
        if len(here) > deepest and here == where[: len(here)]:
            found, deepest = number, len(here)
        elif heading and not deepest and len(where) == 1 and here[:1] == where:
            found = number
    return found


def read_text(path: Path) -> str:
    """Return the text of a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read or is not UTF-8.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        missing = isinstance(error, FileNotFoundError)
        reason = "no such file" if missing else f"cannot be read: {error.strerror}"
        raise InputError(path, f"{reason}.") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"is not TOML: {error.reason} at byte {error.start}.") from None


class _LimitsFile(Options):
    passport: PassportLimits = PassportLimits()


def read_limits(path: Path) -> PassportLimits:
    r"""Read the limits of the record passport.

    Parameters
    ----------
    path : Path
        TOML file with a ``[passport]`` table; missing keys keep their defaults.

    Raises
    ------
    InputError
        If the file is missing, is not TOML, has an unknown key or an invalid value, or a
        rejection limit that is stricter than the warning limit.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "limits.toml")
    ...     _ = path.write_text("[passport]\nend_velocity_share_reject = 0.5\n")
    ...     read_limits(path).end_velocity_share_reject
    0.5
    """
    return parse(path, read_text(path), _LimitsFile).passport
