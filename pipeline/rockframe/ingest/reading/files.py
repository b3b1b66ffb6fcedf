"""Read files, plain or in archives, from disk."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from rockframe.errors import InputError
from rockframe.ingest.metadata.stationxml import is_station_xml
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import unreadable
from rockframe.ingest.reading.containers import ARCHIVE_HEAD, contents, is_archive
from rockframe.ingest.reading.members import LARGEST, Content
from rockframe.ingest.reading.registry import Format, read_bytes
from rockframe.ingest.reading.sources import describes_records, note_on
from rockframe.record import Record


def read_content(
    content: Content,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
) -> list[Record]:
    r"""Return the records of a file or an archive member.

    Parameters
    ----------
    content : Content
        An item of `rockframe.ingest.reading.containers.contents`.
    options, file_format
        As in `read_bytes`.

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
