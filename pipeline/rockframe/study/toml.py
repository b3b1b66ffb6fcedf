"""A TOML file into a strict model: each mistake is one line with its place in the file."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar, get_origin

from pydantic import ValidationError

from rockframe.errors import InputError
from rockframe.options.model import RULE, VALUE, Options, must_be, options_within

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

_Location = tuple[str | int, ...]
File = TypeVar("File", bound=Options)
#: Levels of tables and lists within each other; no model has more than four.
_DEEPEST: Final = 16
#: Whole numbers of TOML are smaller.
_LIMIT: Final = 2**63


def parse(path: Path, text: str, model: type[File]) -> File:
    """Return the model of a TOML text.

    Parameters
    ----------
    path : Path
        The file, for the error.
    text : str
        Its contents.
    model : type
        Model of the whole file.

    Raises
    ------
    InputError
        If the text is not TOML, a key is unknown or missing, or a value is wrong.
    """
    content = _loaded(path, text)
    try:
        return model.model_validate(content)
    except ValidationError as invalid:
        # an unknown key explains the missing one beside it
        errors = sorted(invalid.errors(), key=lambda error: error["type"] != "extra_forbidden")
        message, where = _explain(errors[0], model)
        raise InputError(path, message, line_of(text, where)) from None


def _loaded(path: Path, text: str) -> dict[str, Any]:
    """Parse a TOML text; Python's parser limits neither the depth nor the size of integers."""
    try:
        content = tomllib.loads(text)
        beyond = _beyond(content)
    except RecursionError:
        raise InputError(
            path, f"is nested too deeply. Must be {_DEEPEST} levels of tables and lists at most."
        ) from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(path, f"is not TOML: {error}.") from None
    except ValueError:  # from 4,300 digits on
        beyond = ("",)
    if beyond:
        raise InputError(path, "a whole number must fit into 64 bits.", line_of(text, beyond))
    return content


def _beyond(value: Any, where: _Location = ()) -> _Location:
    """Return the place of the first whole number beyond 64 bits, if there is one."""
    if len(where) > _DEEPEST:
        raise RecursionError
    if isinstance(value, int) and not -_LIMIT <= value < _LIMIT:
        return where
    inner: Iterable[tuple[str | int, Any]] = ()
    if isinstance(value, dict | list):
        inner = value.items() if isinstance(value, dict) else enumerate(value)
    return next((place for key, part in inner if (place := _beyond(part, (*where, key)))), ())


def _explain(error: ErrorDetails, model: type[Options]) -> tuple[str, _Location]:
    """What is wrong and what it must be, and where; the model's own words are for programmers."""
    kind, where = error["type"], error["loc"]
    if kind == RULE:
        return f"{error['msg']}.", where
    names = tuple(part for part in where if isinstance(part, str))
    table, owner = _owner(model, names[:-1])
    if kind == VALUE:
        return f"{_dotted(model, names)} {error['msg']}.", where
    if kind == "extra_forbidden":
        known = ", ".join(_written(owner, key, table) for key in owner.model_fields)
        return f"unknown key {_dotted(model, names)!r}. Must be one of: {known}.", where
    if kind == "missing" and isinstance(where[-1], int):
        dotted = _dotted(model, names)
        return f"{dotted} {error['input']!r}. Must be a list of two numbers.", where
    whole = _written(owner, names[-1], table)
    if whole.startswith("[["):
        if kind in {"missing", "too_short", "tuple_type"}:
            return f"no {whole} table. Must hold one or more.", where[:1]
    elif kind == "missing":
        each = f" in {'each ' if table.startswith('[[') else ''}{table}" if table else ""
        return f"key {names[-1]!r} missing. Must be stated{each}.", where[:-1]
    if kind == "model_type":
        return f"{names[-1]} {error['input']!r}. Must be a table, [{'.'.join(names)}].", where
    return f"{_dotted(model, names)} {error['input']!r}. Must be {must_be(error)}.", where


def _owner(model: type[Options], names: tuple[str, ...]) -> tuple[str, type[Options]]:
    """The table that these names lead to, as the file writes it, and its model."""
    written = ""
    for name in names:
        inner = options_within(model.model_fields[name].annotation)
        if inner is None:
            break
        written = _written(model, name, written)
        model = inner
    return written, model


def _written(model: type[Options], key: str, table: str) -> str:
    """How a file writes a key: a table in brackets."""
    if key not in model.model_fields:
        return key
    annotation = model.model_fields[key].annotation
    if table or options_within(annotation) is None:
        return key
    return f"[[{key}]]" if get_origin(annotation) is tuple else f"[{key}]"


def _dotted(model: type[Options], names: tuple[str, ...]) -> str:
    """The name of a key, with that of its table where the file has tables of several kinds."""
    alone = len(model.model_fields) == 1 or any(
        get_origin(model.model_fields[name].annotation) is tuple
        for name in names[:-1]
        if name in model.model_fields
    )
    return names[-1] if alone else ".".join(names)


def line_of(text: str, where: _Location) -> int | None:
    """Line of a key, counted from 1; of its table if the key is not found; else None."""
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
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"is not TOML: {error.reason} at byte {error.start}.") from None
