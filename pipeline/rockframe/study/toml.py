"""A TOML file into a strict model: each mistake is one line with its place in the file."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Final, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from rockframe.errors import InputError

_Location = tuple[str | int, ...]
_MUST_BE: Final = {
    "float_type": "a number",
    "literal_error": "rectangular or circular, in quotes",
    "string_type": "text in quotes",
    "string_pattern_mismatch": "1 to 64 letters, digits, points, hyphens or underscores",
    "greater_than_equal": "zero or positive, and a number",
    "greater_than": "above 1",
}


class Strict(BaseModel):
    """A model that takes no unknown key and no value of another type."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


File = TypeVar("File", bound=Strict)


def parse(path: Path, text: str, model: type[File], table: str, keys: tuple[str, ...]) -> File:
    """Return the model of a TOML text.

    Parameters
    ----------
    path : Path
        The file, for the error.
    text : str
        Its contents.
    model : type
        Model of the whole file.
    table : str
        How the file writes its one kind of table, ``[[structure]]`` or ``[passport]``.
    keys : tuple of str
        The keys of that table.

    Raises
    ------
    InputError
        If the text is not TOML, a key is unknown or missing, or a value is wrong.
    """
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(path, f"is not TOML: {error}.") from None
    try:
        return model.model_validate(content)
    except ValidationError as invalid:
        # an unknown key explains the missing one beside it
        errors = sorted(invalid.errors(), key=lambda error: error["type"] != "extra_forbidden")
        kind, where = errors[0]["type"], errors[0]["loc"]
        if kind == "limits":
            message = f"{errors[0]['msg']}."
        else:
            message, where = _explain(kind, where, errors[0]["input"], table, keys)
        raise InputError(path, message, line_of(text, where)) from None


def _explain(
    kind: str, where: _Location, value: object, table: str, keys: tuple[str, ...]
) -> tuple[str, _Location]:
    """What is wrong and what it must be, and where; the model's own words are for programmers."""
    key = where[-1]
    inside = len(where) > (2 if table.startswith("[[") else 1)
    if kind == "extra_forbidden":
        known = ", ".join(keys) if inside else table
        return f"unknown key {key!r}. Must be one of: {known}.", where
    if kind == "missing" and inside:
        return f"key {key!r} missing. Must be stated in each {table}.", where[:-1]
    if not inside:
        return f"no {table} table. Must hold one or more.", where[:1]
    return f"{key} {value!r}. Must be {_MUST_BE.get(kind, 'valid')}.", where


def line_of(text: str, where: _Location) -> int | None:
    """Line of a key, counted from 1; of its table if the key is not found; else None."""
    wanted = where[1] if len(where) > 1 and isinstance(where[1], int) else None
    table, count, key = None, -1, str(where[-1]) if where else ""
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(r"\s*\[\[", line):
            count += 1
            table = number if count == wanted else table
        if re.match(rf"\s*\[*\s*\"?{re.escape(key)}\"?\s*[=\]]", line) and (
            wanted is None or (count == wanted and len(where) > 2)
        ):
            return number
    return table


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
