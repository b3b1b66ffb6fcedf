"""Errors that the user can fix. Each is one line: what is wrong, where, and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

#: Longest message of an `InputError` [characters]; the middle of a longer one is left out.
_LONGEST: Final = 600


class RockframeError(Exception):
    """Base class of all errors that the user can fix; it is never raised itself."""


class ParameterError(RockframeError, ValueError):
    """An argument or option has a value that the theory or the data do not allow.

    If the error concerns one quantity, the attributes are its name, its value (None if it is
    missing) and the allowed values. Readers of files then report the key and the line.
    """

    quantity: str = ""
    value: object = None
    allowed: str = ""


def invalid(quantity: str, value: object, owner: str, allowed: str) -> ParameterError:
    """Return the error of a quantity that is missing (None) or has an invalid value.

    Examples
    --------
    >>> raise invalid("gap", -0.1, "an abutment", "positive")
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid gap -0.1 of an abutment. Must be positive.
    """
    stated = f"Missing {quantity}" if value is None else f"Invalid {quantity} {value!r}"
    error = ParameterError(f"{stated} of {owner}. Must be {allowed}.")
    error.quantity, error.value, error.allowed = quantity, value, allowed
    return error


def require_known(what: str, asked: object, known: Iterable[object]) -> None:
    """Raise an error if a value is not among the known values.

    Raises
    ------
    ParameterError
        If the value is unknown.

    Examples
    --------
    >>> require_known("section", "oval", ["circular", "rectangular"])
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid section 'oval'. Must be one of: circular, rectangular.
    """
    names = list(known)
    if asked not in names:
        must_be = f"Must be one of: {', '.join(map(str, names))}."
        raise ParameterError(f"Invalid {what} {asked!r}. {must_be}")


def meant(word: str, known: Iterable[str]) -> str:
    """Return a question with the known name that is most similar to a word; "" if none is.

    Examples
    --------
    >>> meant("hight_m", ["height_m", "width_m"])
    ' Did you mean height_m?'
    """
    from difflib import get_close_matches  # only needed for errors

    return "".join(f" Did you mean {name}?" for name in get_close_matches(word, [*known], 1, 0.7))


class InputError(RockframeError):
    """A file is missing, corrupted, or of another kind than expected.

    Parameters
    ----------
    path : str or Path
        The file.
    message : str
        What is wrong, the value, and what is allowed.
    line : int, optional
        Line number in the file, counted from 1.

    Examples
    --------
    >>> raise InputError("motion.csv", "acceleration 'abc'. Must be a number.", line=12)
    Traceback (most recent call last):
    rockframe.errors.InputError: motion.csv:12: acceleration 'abc'. Must be a number.
    """

    def __init__(self, path: str | Path, message: str, line: int | None = None) -> None:
        self._stated = path
        self.path = Path(path)
        if len(message) > _LONGEST:  # a foreign file may have a line of a million characters
            message = f"{message[: _LONGEST // 2]} ... {message[-_LONGEST // 2 :]}"
        self.reason = message
        self.line = line
        where = str(path) if line is None else f"{path}:{line}"
        super().__init__(f"{where}: {message}")

    def __reduce__(self) -> tuple[type, tuple[str | Path, str, int | None]]:
        return type(self), (self._stated, self.reason, self.line)


class RockframeWarning(UserWarning):
    """Warning of a value that is allowed but seldom intended; commands print it in one line."""


class OtherQuantityError(InputError):
    """A valid file contains a velocity, displacement or spectrum instead of an acceleration."""


class ServiceError(RockframeError):
    """A data centre did not reply, or its reply is unusable.

    Parameters
    ----------
    url : str
        URL of the request.
    message : str
        Reply of the data centre, and what to do.

    Examples
    --------
    >>> raise ServiceError("https://data.example", "answered 204: no data. Must be held there.")
    Traceback (most recent call last):
    rockframe.errors.ServiceError: https://data.example: answered 204: no data. Must be held there.
    """

    def __init__(self, url: str, message: str) -> None:
        self.url = url
        self.reason = message
        super().__init__(f"{url}: {message}")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        return type(self), (self.url, self.reason)


class EngineError(RockframeError):
    """The workers cannot be reached, or crash repeatedly."""
