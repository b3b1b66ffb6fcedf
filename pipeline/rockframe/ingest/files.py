"""Read files, plain or in archives, from disk: records, rejections, or notes on skipped files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rockframe.errors import InputError, OtherQuantityError, RockframeError
from rockframe.ingest.catalogue import CATALOGUE, facts_of, read_catalogue
from rockframe.ingest.containers import ARCHIVE_HEAD, contents, is_archive
from rockframe.ingest.flatfiles import CatalogueEntry
from rockframe.ingest.members import LARGEST, Content, printable
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import unreadable
from rockframe.ingest.registry import Format, read_bytes
from rockframe.ingest.sources import describes_records, note_on
from rockframe.ingest.stationxml import is_station_xml
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


#: Records, each with the fields from the `catalogue.csv` of its archive; or a reason without
#: records.
ReadOutcome = list[tuple[Record, dict[str, Any]]] | Rejection | Unread
#: Catalogues in an archive, by the folder or inner archive whose files they describe.
_Catalogues = dict[str, dict[str, CatalogueEntry]]


def read_content(
    content: Content,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
) -> list[Record]:
    r"""Return the records of a file or an archive member; the parameters are those of `read_bytes`.

    Raises
    ------
    InputError
        If the member was rejected or cannot be read.

    Examples
    --------
    >>> inside = Content(Path("a.zip:b.csv"), "a.zip:b.csv", Path("b.csv"), b"t,acc_g\n0,0\n1,2\n")
    >>> [record] = read_content(inside)
    >>> record.record_id, record.source_file
    ('b', 'a.zip:b.csv')
    """
    if content.refusal:
        raise InputError(content.where, content.refusal)
    try:
        return read_bytes(
            content.path, content.data, options, file_format, source_file=content.name
        )
    except InputError as error:
        raise type(error)(content.where, error.reason, error.line) from None


def read_file(
    path: str | Path,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
    *,
    units: str | None = None,
    time_step: float | None = None,
) -> list[Record]:
    r"""Return the records of a file, one per channel; for an archive, the records of all members.

    In an archive, catalogues and documents are skipped, and StationXML is used.

    Parameters
    ----------
    path : str or Path
        A regular file of at most 256 MB, or an archive of record files.
    options : ReadOptions
        Values that the file does not state, such as units and time step.
    file_format : Format, optional
        Format of the file (default: identified from its contents).
    units : str, optional
        Acceleration units of a file that does not state them; a shortcut for `options`.
    time_step : float, optional
        Interval between samples [s] of a file that does not state it.

    Raises
    ------
    InputError
        If the file is missing, empty, too large, corrupted, or of unknown format.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "shake.csv")
    ...     _ = path.write_text("time_s,acc_g\n0.00,0.0\n0.01,0.2\n")
    ...     [record] = read_file(path)
    >>> record.time_step, record.acceleration
    (0.01, array([0.   , 1.962]))
    """
    path = Path(path)
    options = replace(
        options, units=units or options.units, time_step=time_step or options.time_step
    )
    data = load(path)
    options = with_archived(options, path, companions(path, data))
    return [
        record
        for content in contents(path, data)
        if not note_of_member(content)
        for record in read_content(content, options, file_format)
    ]


def note_of_member(content: Content) -> str:
    """Return the reason why a member of an archive is skipped, or ""."""
    is_member = content.where != content.path and not content.refusal
    return note_on(content.path, content.data) if is_member else ""


def companions(path: Path, data: bytes) -> list[Content]:
    r"""Return the catalogues and StationXML files in an archive; none in other files.

    Examples
    --------
    >>> import gzip
    >>> [c.name for c in companions(Path("a.gz"), gzip.compress(b"<FDSNStationXML"))]
    []
    """
    found: list[Content] = []
    if is_archive(data[:ARCHIVE_HEAD]):
        with suppress(InputError):  # reading the records reports what is wrong with the archive
            found += (c for c in contents(path, data) if describes_records(c.path, c.data))
    return found


def with_archived(options: ReadOptions, path: Path, within: list[Content]) -> ReadOptions:
    """Return options that find the StationXML in an archive and beside it."""
    stations = tuple(c for c in within if is_station_xml(c.path, c.data))
    return replace(options, archived=stations, folder=options.folder or path.parent)


def load(path: Path) -> bytes:
    """Return the bytes of a regular file of at most 256 MB.

    Parameters
    ----------
    path : Path
        File to load.

    Raises
    ------
    InputError
        If the file is missing, not a regular file, too large, or cannot be read.

    Examples
    --------
    >>> load(Path("lost.AT2"))
    Traceback (most recent call last):
    rockframe.errors.InputError: lost.AT2: no such file.
    """
    try:
        if not path.exists():
            raise InputError(path, "no such file.")
        if not path.is_file():
            raise InputError(path, "not a regular file.")
        size = path.stat().st_size
        if size > LARGEST:
            raise InputError(path, f"{size} bytes. Must be at most {LARGEST}.")
        return path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error


def read_outcomes(path: Path, options: ReadOptions) -> Iterator[ReadOutcome]:
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
        data = load(path)
        within = companions(path, data)
        options = with_archived(options, path, within)
        catalogues, faults = _catalogues(within)
        names = []
        for content in contents(path, data):
            names.append(content.name)
            yield faults.get(content.name) or _outcome(content, options, catalogues)
        yield from _missing(catalogues, names)
    except RockframeError as error:
        yield _rejection(printable(path.name), error)


def _catalogues(within: Iterable[Content]) -> tuple[_Catalogues, dict[str, Rejection]]:
    """Return the catalogues in an archive in order of precedence, and the corrupted catalogues."""
    found: _Catalogues = {}
    faults: dict[str, Rejection] = {}
    for content in within:
        if not is_station_xml(content.path, content.data):
            is_own = content.path.name == CATALOGUE
            folder = content.name.removesuffix(CATALOGUE) if is_own else ""
            try:
                entries = read_catalogue(content.where, content.data)
            except InputError as error:
                faults[content.name] = _rejection(content.name, error)
            else:
                found[folder] = {**found.get(folder, {}), **entries}
    return dict(sorted(found.items())), faults


def _missing(catalogues: _Catalogues, names: Iterable[str]) -> Iterator[Rejection]:
    """Yield a rejection for each missing file that the `catalogue.csv` of an archive names."""
    for folder, entries in catalogues.items():
        within = [name.removeprefix(folder) for name in names if name.startswith(folder)]
        present = {part for name in within for part in re.split("[:/]", name)}
        for missing in entries if folder else ():
            if missing not in present:
                yield Rejection(folder + printable(missing), "no such file.")


def _rejection(name: str, error: RockframeError) -> Rejection:
    if isinstance(error, InputError):
        return Rejection(name, error.reason, error.line)
    return Rejection(name, str(error))


def _outcome(content: Content, options: ReadOptions, catalogues: _Catalogues) -> ReadOutcome:
    try:
        if note := note_of_member(content):
            return Unread(content.name, note)
        records = read_content(content, options)
    except OtherQuantityError as error:
        return Unread(content.name, error.reason, error.line)
    except RockframeError as error:
        return _rejection(content.name, error)
    own: dict[str, CatalogueEntry] = {}
    for folder, entries in catalogues.items():
        own |= entries if folder and content.name.startswith(folder) else {}
    names, others = dict.fromkeys(re.split("[:/]", content.name)), catalogues.get("", {})
    return [
        (replace(record, **facts_of(others, record, names)), facts_of(own, record, names))
        for record in records
    ]
