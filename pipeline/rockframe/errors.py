"""Errors that the user can fix. Each is one line: what is wrong, where, and what is allowed.

`InternalError` is the exception: a fault of the package, to be reported.

A file that contradicts itself is such an error, which `settle` raises unless the user trusts one of
the two statements.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Final, Literal, TypeVar

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
    opening = f"Missing {quantity}" if value is None else f"Invalid {quantity} {value!r}"
    error = ParameterError(f"{opening} of {owner}. Must be {allowed}.")
    error.quantity, error.value, error.allowed = quantity, value, allowed
    return error


def require_known(quantity: str, asked: object, allowed: Iterable[object]) -> None:
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
    names = list(allowed)
    if asked not in names:
        must_be = f"Must be one of: {', '.join(map(str, names))}."
        raise ParameterError(f"Invalid {quantity} {asked!r}. {must_be}")


def meant(word: str, names: Iterable[str]) -> str:
    """Return a question with the known name that is most similar to a word; "" if none is.

    Examples
    --------
    >>> meant("hight_m", ["height_m", "width_m"])
    ' Did you mean height_m?'
    """
    from difflib import get_close_matches  # only needed for errors

    return "".join(f" Did you mean {name}?" for name in get_close_matches(word, [*names], 1, 0.7))


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


class InternalError(RuntimeError):
    """A computation violates its own bounds: a fault of this package that the user cannot fix."""


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


#: What a user can trust.
Trusted = Literal[
    "samples",
    "values",
    "sensitivity",
    "stages",
    "full-scale",
    "scale",
    "waveform",
    "header",
    "component",
    "azimuth",
]
#: What each word trusts, and over what.
TRUSTED: Final[Mapping[str, str]] = {
    "samples": "the samples as they stand, over the number or the duration that a header states",
    "values": "the values of the samples, over the peak, extremes or mean that a header states",
    "sensitivity": "the stated sensitivity, over stages, full scales and SCALE",
    "stages": "the product of the stage gains of a StationXML, over its sensitivity",
    "full-scale": "the full scale of the sensor in a COSMOS header, over its sensitivity",
    "scale": "SCALE of a SAC file, over the sensitivity of its StationXML",
    "waveform": "the time step that stands with the samples, over another in header or StationXML",
    "header": "the time step of header or StationXML, over the one that stands with the samples",
    "component": "the direction in the name of the component, over the angles of the header",
    "azimuth": "the angles of the header, over the direction in the name of the component",
}

_Value = TypeVar("_Value")

#: Words that are trusted, in order of precedence, and the contradictions settled so far. Readers
#: state contradictions deep inside their functions, so both are kept for the context of one read.
_STATE: ContextVar[tuple[tuple[Collection[str], ...], list[str]]] = ContextVar("trust")


@contextmanager
def trusting(*words: Collection[str]) -> Iterator[list[str]]:
    """Trust these words within a ``with`` block, and collect the contradictions that they settle.

    Parameters
    ----------
    words : collections of str
        Words of `TRUSTED`. Those of an earlier collection take precedence.

    Examples
    --------
    >>> with trusting(["samples"]) as settled:
    ...     settle(Path("a.AT2"), "NPTS 3 in the header, 2 in the file.", {"samples": 2})
    2
    >>> settled
    ['samples: NPTS 3 in the header, 2 in the file.']
    """
    settled: list[str] = []
    before = _STATE.set((words, settled))
    try:
        yield settled
    finally:
        _STATE.reset(before)


@contextmanager
def collecting_settled() -> Iterator[list[str]]:
    """Collect the contradictions that are settled within a ``with`` block, with the words trusted
    outside it: those of one record of a file.
    """
    words, _ = _STATE.get(((), []))
    with trusting(*words) as settled:
        yield settled


def settle(
    path: Path,
    problem: str,
    values: Mapping[str, _Value],
    line: int | None = None,
    must: str = "",
) -> _Value:
    """Return the value of the statement that the user trusts, and note the contradiction.

    Parameters
    ----------
    path : Path
        The file.
    problem : str
        The two statements and their values, as a sentence.
    values : mapping
        Value of each statement that can be trusted, by its word in `TRUSTED`.
    line : int, optional
        Line number of one of them.
    must : str
        Sentence that says what a sound file would state.

    Raises
    ------
    InputError
        If none of the words is trusted, or more than one.

    Examples
    --------
    >>> settle(Path("a.AT2"), "NPTS 3 in the header, 2 in the file.", {"samples": 2})
    Traceback (most recent call last):
    rockframe.errors.InputError: a.AT2: NPTS 3 in the header, 2 in the file. Settled by --trust ...
    """
    words, settled = _STATE.get(((), []))
    for level in words:
        named = [word for word in values if word in level]
        if len(named) > 1:
            message = f"{problem} {' and '.join(named)} are both trusted. Trust one of them."
            raise InputError(path, message, line)
        if named:
            note = f"{named[0]}: {problem}"
            if note not in settled:
                settled.append(note)
            return values[named[0]]
    options = " or ".join(f"--trust {word}" for word in values)
    said = (problem, must, f"Settled by {options}.")
    raise InputError(path, " ".join(filter(None, said)), line)


def parse_words(path: Path, text: str, line: int) -> tuple[str, ...]:
    """Return the words in a cell of a catalogue, separated by blanks.

    Examples
    --------
    >>> parse_words(Path("catalogue.csv"), "samples stages", 2)
    ('samples', 'stages')
    """
    words = tuple(text.split())
    try:
        require_words(words)
    except ParameterError as error:
        raise InputError(path, str(error), line) from None
    return words


def require_words(words: Collection[str]) -> None:
    """Raise an error if one of the words is not in `TRUSTED`.

    Examples
    --------
    >>> require_words(["sample"])
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid trust 'sample'. Must be one or more of: samples, val...
    """
    for word in words:
        if word not in TRUSTED:
            allowed = ", ".join(TRUSTED)
            raise ParameterError(f"Invalid trust {word!r}. Must be one or more of: {allowed}.")
