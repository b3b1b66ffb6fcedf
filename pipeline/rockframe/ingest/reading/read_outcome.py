"""Read one file or archive into records or rejections, without raising errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rockframe.errors import InputError, OtherQuantityError, RockframeError
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.reading.containers import contents
from rockframe.ingest.reading.files import load, read_content
from rockframe.ingest.reading.members import Content, printable
from rockframe.ingest.reading.sources import note_on
from rockframe.record import Record


@dataclass(frozen=True)
class Rejection:
    """A file that was rejected.

    Parameters
    ----------
    file : str
        Name of the file.
    reason : str
        Reason for the rejection, as a sentence.
    line : int, optional
        Line number in the file, counted from 1.

    Examples
    --------
    >>> Rejection("FSD172.VT2", "is a velocity time series. Must be an acceleration.", line=3).line
    3
    """

    file: str
    reason: str
    line: int | None = None


@dataclass(frozen=True)
class Unread:
    """A file that was skipped because it contains no acceleration, such as a catalogue.

    Parameters
    ----------
    file : str
        Name of the file.
    reason : str
        What the file is, as a sentence.
    line : int, optional
        Line number in the file, counted from 1.

    Examples
    --------
    >>> Unread("catalogue.csv", "catalogue: facts about the files beside it.").file
    'catalogue.csv'
    """

    file: str
    reason: str
    line: int | None = None


Outcome = list[Record] | Rejection | Unread


def read_outcomes(path: Path, options: ReadOptions) -> Iterator[Outcome]:
    r"""Read a file; yield a rejection or a note instead of raising an error.

    Yields
    ------
    list of Record, Rejection or Unread
        One for the file, or one for each member of the archive, in order.

    Examples
    --------
    >>> from rockframe.ingest.options import NO_OPTIONS
    >>> list(read_outcomes(Path("lost.AT2"), NO_OPTIONS))
    [Rejection(file='lost.AT2', reason='no such file.', line=None)]
    """
    try:
        for content in contents(path, load(path)):
            yield _outcome(content, options)
    except RockframeError as error:
        yield rejection(printable(path.name), error)


def rejection(name: str, error: RockframeError) -> Rejection:
    """Return the rejection of a file that could not be read.

    Examples
    --------
    >>> rejection("a.csv", InputError("/records/a.csv", "empty file.", line=1))
    Rejection(file='a.csv', reason='empty file.', line=1)
    """
    if isinstance(error, InputError):
        return Rejection(name, error.reason, error.line)
    return Rejection(name, str(error))


def _outcome(content: Content, options: ReadOptions) -> Outcome:
    is_member = content.where != content.path and not content.refusal
    note = note_on(content.path) if is_member else ""
    try:
        return Unread(content.name, note) if note else read_content(content, options)
    except OtherQuantityError as error:
        return Unread(content.name, error.reason, error.line)
    except RockframeError as error:
        return rejection(content.name, error)
