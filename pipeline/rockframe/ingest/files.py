"""Read files, plain or in archives, from disk: records, or the reason why there are none."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rockframe.errors import InputError, OtherQuantityError, RockframeError
from rockframe.ingest.catalogue import CATALOGUE, facts_of, read_catalogue
from rockframe.ingest.containers import ARCHIVE_HEAD, contents, is_archive
from rockframe.ingest.flatfiles import CatalogueEntry
from rockframe.ingest.members import LARGEST, Content, printable
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import unreadable
from rockframe.ingest.registry import Format, read_as_stated
from rockframe.ingest.sources import describes_records, note_on
from rockframe.ingest.stationxml import is_station_xml
from rockframe.outcome import InputOutcome
from rockframe.record import Record


@dataclass(frozen=True)
class Reading:
    """A record as its reader returned it, and what is known of it besides.

    Parameters
    ----------
    record : Record
        The record.
    facts : mapping
        Fields that replace those of the record: identifier, source, and facts from catalogues.
    own : mapping
        Fields from the ``catalogue.csv`` of its archive, which override other catalogues but that
        beside the archive.
    """

    record: Record
    facts: Mapping[str, Any]
    own: Mapping[str, Any] = field(default_factory=dict)

    def completed(self, **changes: Any) -> Record:
        """Return the record with the facts, and with these other changes.

        Examples
        --------
        >>> shake = Record(record_id="shake", acceleration=[0.0, 1.0], time_step=0.01)
        >>> Reading(shake, {"station": "PUL"}).completed(magnitude=6.6).station
        'PUL'
        """
        return replace(self.record, **self.facts, **changes)


#: Catalogues in an archive, by the folder or inner archive whose files they describe.
_Catalogues = dict[str, dict[str, CatalogueEntry]]


def read_content(
    content: Content,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
) -> list[Reading]:
    r"""Read the records of a file or an archive member; the parameters are those of `read_bytes`.

    Raises
    ------
    InputError
        If the member was rejected or cannot be read.

    Examples
    --------
    >>> inside = Content(Path("a.zip:b.csv"), "a.zip:b.csv", Path("b.csv"), b"t,acc_g\n0,0\n1,2\n")
    >>> [reading] = read_content(inside)
    >>> reading.record.record_id, reading.facts["source_file"]
    ('b', 'a.zip:b.csv')
    """
    if content.refusal:
        raise InputError(content.where, content.refusal)
    try:
        records, source = read_as_stated(content.path, content.data, options, file_format)
    except InputError as error:
        raise type(error)(content.where, error.reason, error.line) from None
    return [Reading(record, {"source_file": content.name, **source}) for record in records]


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
        reading.completed()
        for content in contents(path, data)
        if not note_of_member(content)
        for reading in read_content(content, options, file_format)
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


def read_outcomes(path: Path, options: ReadOptions) -> Iterator[list[Reading] | InputOutcome]:
    r"""Read a file; yield an outcome with the reason instead of raising an error.

    Yields
    ------
    list of Reading, or InputOutcome
        One for the file, or one for each member of the archive, in order.

    Examples
    --------
    >>> from rockframe.ingest.options import NO_OPTIONS
    >>> [outcome] = read_outcomes(Path("lost.AT2"), NO_OPTIONS)
    >>> outcome.reason
    'no such file.'
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


def _catalogues(within: Iterable[Content]) -> tuple[_Catalogues, dict[str, InputOutcome]]:
    """Return the catalogues in an archive in order of precedence, and the corrupted catalogues."""
    found: _Catalogues = {}
    faults: dict[str, InputOutcome] = {}
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


def _missing(catalogues: _Catalogues, names: Iterable[str]) -> Iterator[InputOutcome]:
    """Yield a rejection for each missing file that the `catalogue.csv` of an archive names."""
    for folder, entries in catalogues.items():
        within = [name.removeprefix(folder) for name in names if name.startswith(folder)]
        present = {part for name in within for part in re.split("[:/]", name)}
        for missing in entries if folder else ():
            if missing not in present:
                yield InputOutcome(folder + printable(missing), "no such file.")


def _rejection(name: str, error: RockframeError) -> InputOutcome:
    if isinstance(error, InputError):
        return InputOutcome(name, error.reason, error.line)
    return InputOutcome(name, str(error))


def _outcome(
    content: Content, options: ReadOptions, catalogues: _Catalogues
) -> list[Reading] | InputOutcome:
    try:
        if note := note_of_member(content):
            return InputOutcome(content.name, note, status="unread")
        readings = read_content(content, options)
    except OtherQuantityError as error:
        return InputOutcome(content.name, error.reason, error.line, "unread")
    except RockframeError as error:
        return _rejection(content.name, error)
    own: dict[str, CatalogueEntry] = {}
    for folder, entries in catalogues.items():
        own |= entries if folder and content.name.startswith(folder) else {}
    names, others = dict.fromkeys(re.split("[:/]", content.name)), catalogues.get("", {})
    return [
        Reading(
            one.record,
            {**one.facts, **facts_of(others, one.record, names)},
            facts_of(own, one.record, names),
        )
        for one in readings
    ]
