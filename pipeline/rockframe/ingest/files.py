"""List the files of paths and folders, and read them, plain or in archives."""

from __future__ import annotations

import re
import stat
import warnings
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.errors import InputError, OtherQuantityError, RockframeError, RockframeWarning
from rockframe.ingest.catalogue import (
    CATALOGUE,
    CatalogueEntry,
    catalogue_kind,
    facts_for_record,
    is_catalogue,
    read_catalogue,
)
from rockframe.ingest.containers import (
    ARCHIVE_HEAD,
    Content,
    contents,
    folder_names,
    is_archive,
    is_of_tables,
    load,
    printable,
)
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.parsing.lines import read_head, unreadable
from rockframe.ingest.stationxml import is_station_xml
from rockframe.outcome import InputOutcome
from rockframe.provenance import read_json
from rockframe.record import Record
from rockframe.signals.passport import Measures

if TYPE_CHECKING:
    from rockframe.ingest.registry import Format

Catalogue = Mapping[str, CatalogueEntry]

_REQUEST: Final = "request.json"
#: Notes on files that accompany records and are not read as records.
_CATALOGUE: Final = "catalogue: states metadata of the files in its folder."
_BESIDE: Final = {
    _REQUEST: "request of a fetch: not needed to read the records.",
    "event.quakeml": "event from a data centre: the catalogue contains its metadata.",
    "channels.stationxml": "channels from a data centre: not needed to read the records.",
}
_STATION_XML: Final = "StationXML, dataless SEED or RESP: the instruments of the files beside it."
_HIDDEN: Final = "hidden file: not read."
_DOCUMENT: Final = "document: not a record."
_DOCUMENTS: Final = re.compile(
    r"^_?read_?me\b|^disclaimer|^(thumbs\.db|desktop\.ini)$"
    r"|\.(pdf|md|html?|docx?|tex|png|jpe?g|gif|svg|toml|xlsx?|parquet|nc)$",
    re.I,
)
#: First columns of the tables that rockframe and gmprocess write.
_TABLE: Final = re.compile(
    rb"(file,)?record_id,|structure,(limit_state|measure|dimension),"
    rb"|EarthquakeId,EarthquakeTime,|Column header,Description|Failure Reason,"
)
_OUTPUT: Final = "output of this command: about to be replaced."
_IRREGULAR: Final = "not a regular file."
_LINK: Final = "a link to a folder, which is not followed. Name the folder itself to read it."


@dataclass(frozen=True)
class Source:
    """A requested file, or a file in a requested folder.

    Parameters
    ----------
    path : Path
        The file.
    name : str
        Display name with escaped unprintable characters: the path within the requested folder,
        preceded by the name of that folder if several paths were requested.
    catalogue : mapping of str to CatalogueEntry
        Metadata of the file, and of other files.
    others : mapping of str to CatalogueEntry
        Metadata of the catalogues of archives, which every `catalogue.csv` overrides.
    pending : bool
        True if its name or first bytes may still tell that it is skipped (`looked_into`).
    note : str
        Reason why the file is skipped, or "".
    refusal : str
        Reason why the file is rejected without opening it, or "".
    requested : bool
        True if the file was requested by its own path, and not found in a folder.
    sha256 : str
        Expected SHA-256, if the file was received by `rockframe fetch`; otherwise empty.
    """

    path: Path
    name: str
    catalogue: Catalogue = field(default_factory=dict)
    note: str = ""
    refusal: str = ""
    sha256: str = ""
    requested: bool = False
    others: Catalogue = field(default_factory=dict)
    pending: bool = False

    @property
    def is_read(self) -> bool:
        """True if the file is to be read."""
        return not (self.note or self.refusal)


def sources_of(
    paths: Iterable[str | Path],
    catalogue: Catalogue | None = None,
    outputs: Collection[Path] = (),
    *,
    look: bool = True,
) -> list[Source]:
    r"""Return the requested files, and all files in requested folders and their subfolders.

    Parameters
    ----------
    paths : iterable of str or Path
        Files and folders.
    catalogue : mapping of str to CatalogueEntry, optional
        Metadata by file name (default: the `catalogue.csv` of each folder, for the files in it).
    outputs : collection of Path
        Files that are about to be written; they are skipped in folders.
    look : bool
        False to leave files in folders pending, without opening them.

    Returns
    -------
    list of Source
        The files in the order of the paths; within a folder in the order of names, files before
        subfolders. Files that are skipped or rejected, and missing files that a catalogue names,
        have a note or refusal.

    Raises
    ------
    InputError
        If a path does not exist or cannot be listed, if a folder contains no record files, or if
        its catalogue cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     Path(folder, "event").mkdir()
    ...     for name in ("b.AT2", "event/a.AT2", ".hidden"):
    ...         _ = Path(folder, name).write_text("...")
    ...     [(source.name, source.is_read) for source in sources_of([folder])]
    [('.hidden', False), ('b.AT2', True), ('event/a.AT2', True)]
    """
    requested = [Path(path) for path in paths]
    replaced = {path.resolve() for path in outputs}
    sources: list[Source] = []
    for path, called in zip(requested, folder_names(requested), strict=True):
        if not _exists(path):
            raise InputError(path, "no such file or folder.")
        if not path.is_dir():
            sources.append(Source(path, printable(path.name), catalogue or {}, requested=True))
            continue
        within = list(_files_in(path, _entries(path), "", catalogue, replaced))
        if not any(looked_into(source).is_read or source.refusal for source in within):
            raise InputError(path, "the folder contains no record files.")
        before = f"{called}/" if len(requested) > 1 else ""
        sources += [replace(source, name=before + source.name) for source in within]
    return [*map(looked_into, sources)] if look else sources


def looked_into(source: Source) -> Source:
    """Return a file with a note if its name or its first bytes tell that it is skipped."""
    note = _note_of_content(source.path) if source.pending else source.note
    return replace(source, note=note, pending=False)


def _files_in(
    folder: Path,
    entries: list[Path],
    before: str,
    catalogue: Catalogue | None,
    replaced: Collection[Path],
) -> Iterator[Source]:
    """Yield the files of a folder, then those of its subfolders."""
    present = {path.name for path in entries}
    own, others, faults = _catalogues(entries if catalogue is None else [])
    listed = {**own, **(catalogue or {})}
    received = _fetched_sha256(folder / _REQUEST)
    folders = []
    for path in entries:
        name = before + printable(path.name)
        note, refusal = ("", faults[path]) if path in faults else _note_and_refusal(path, replaced)
        if not (note or refusal) and path.is_dir():
            folders.append(path)
        else:
            yield Source(
                *(path, name, listed, note, refusal, received.get(path.name, "")),
                others=others,
                pending=not (note or refusal),
            )
    # Metadata under a misspelt file name must not be lost silently.
    for missing in {**own, **received}:
        if missing not in present:
            path = folder / missing
            yield Source(path, before + printable(missing), refusal="no such file.")
    for path in folders:
        name = before + printable(path.name)
        try:
            deeper = _entries(path)
        except InputError as error:
            yield Source(path, name, refusal=error.reason)
        else:
            yield from _files_in(path, deeper, f"{name}/", catalogue, replaced)


def _catalogues(
    entries: list[Path],
) -> tuple[dict[str, CatalogueEntry], dict[str, CatalogueEntry], dict[Path, str]]:
    """Return the entries of all catalogues in a folder, and the errors of corrupted catalogues."""
    faults: dict[Path, str] = {}
    own: dict[str, CatalogueEntry] = {}
    others: dict[str, CatalogueEntry] = {}
    for path in entries:
        if not _refusal(path) and not path.is_dir() and is_catalogue(path):
            try:
                (own if path.name == CATALOGUE else others).update(read_catalogue(path))
            except InputError as error:
                if path.name == CATALOGUE:
                    raise
                faults[path] = error.reason
    return own, others, faults


def _note_and_refusal(path: Path, replaced: Collection[Path]) -> tuple[str, str]:
    """Return note and refusal of an entry in a folder before its contents are looked at."""
    if path.name.startswith("."):
        return _HIDDEN, ""
    refusal = _refusal(path)
    if refusal or path.is_dir():
        return "", refusal
    return _OUTPUT if replaced and path.resolve() in replaced else "", ""


def _note_of_content(path: Path) -> str:
    """Return the reason why a file in a folder is skipped, from its name and first bytes, or ""."""
    if is_catalogue(path):
        return _CATALOGUE
    if path.suffix == ".csv" and _TABLE.match(read_head(path)):
        return _DOCUMENT
    return note_on(Path(path.name)) or (_STATION_XML if is_station_xml(path) else "")


def _refusal(path: Path) -> str:
    """Return the reason why an entry of a folder cannot be opened, or ""."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:  # broken link
        return _IRREGULAR
    except OSError as error:  # link to itself, or no permission
        return unreadable(path, error).reason
    if stat.S_ISDIR(mode):
        return _LINK if path.is_symlink() else ""
    return "" if stat.S_ISREG(mode) else _IRREGULAR


def _fetched_sha256(request: Path) -> dict[str, str]:
    """Return the SHA-256 of fetched files by name, from request.json."""
    try:
        document = read_json(request.read_bytes())
        files = document["files"]
        return {str(name): str(file["sha256"]) for name, file in files.items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return {}  # missing, or written by another program


def describes_records(path: Path, head: bytes) -> bool:
    """Return True if a file with this name and beginning is a catalogue or StationXML."""
    return note_on(path, head) in (_CATALOGUE, _STATION_XML)


def note_on(path: Path, head: bytes = b"") -> str:
    """Return the reason why a file with this name and beginning is skipped, or "".

    Examples
    --------
    >>> note_on(Path("__MACOSX/._a.AT2"))[:6], note_on(Path("README.txt")), note_on(Path("a.AT2"))
    ('hidden', 'document: not a record.', '')
    """
    if any(part.startswith(".") or part == "__MACOSX" for part in path.parts):
        return _HIDDEN
    if path.name == CATALOGUE or catalogue_kind(path, head):
        return _CATALOGUE
    if is_station_xml(path, head):
        return _STATION_XML
    return _BESIDE.get(path.name) or (_DOCUMENT if _DOCUMENTS.search(path.name) else "")


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError as error:
        raise unreadable(path, error) from error


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir(), key=lambda path: path.name)
    except OSError as error:
        raise unreadable(folder, error) from error


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
    measures : Measures, optional
        Measures of the record as it was read, if the process that read it measured it.
    """

    record: Record
    facts: Mapping[str, Any]
    own: Mapping[str, Any] = field(default_factory=dict)
    measures: Measures | None = None

    def completed(self, **changes: Any) -> Record:
        """Return the record with the facts filled in, and with other fields replaced.

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
    content: Content, options: ReadOptions = NO_OPTIONS, file_format: Format | None = None
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
    readings, left_out = _read(content, options, file_format)
    if not readings:
        shown = f"{left_out[0].file}: {left_out[0].reason}"
        raise InputError(content.where, f"no stream can be used. {shown}")
    return readings


def _read(
    content: Content, options: ReadOptions, file_format: Format | None = None
) -> tuple[list[Reading], list[InputOutcome]]:
    """Return the records of a file or member, and the outcomes of its streams without records."""
    if content.refusal:
        raise InputError(content.where, content.refusal)
    from rockframe.ingest.registry import identified, read_format  # every reader: workers load them

    try:
        names = dict.fromkeys(re.split("[:/]", content.name))
        options = options.of_file(names)
        chosen, source = identified(content.path, content.data, file_format, options)
        records, left_out = read_format(chosen, content.path, content.data, options, names)
    except InputError as error:
        raise type(error)(content.where, error.reason, error.line) from None
    readings = [Reading(record, {"source_file": content.name, **source}) for record in records]
    return readings, [replace(row, file=f"{content.name}:{row.file}") for row in left_out]


def read_file(
    path: str | Path,
    options: ReadOptions = NO_OPTIONS,
    file_format: Format | None = None,
    *,
    units: str | None = None,
    time_step: float | None = None,
) -> list[Record]:
    r"""Return the records of a file, one per channel; for an archive, the records of all members.

    In an archive, catalogues and documents are skipped, and StationXML is used. Of a workbook or a
    MATLAB file, a warning names the tables that are no records, if another one is.

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
    data = load(path)
    if units or time_step:
        given = {"units": units or options.units, "time_step": time_step or options.time_step}
        options = replace(options, **given)  # type: ignore[arg-type]
    options = with_archived(options, path, companions(path, data))
    records: list[Record] = []
    refused: list[InputError] = []
    for content in contents(path, data):
        try:
            if not note_of_member(content):
                readings = read_content(content, options, file_format)
                records += [reading.completed() for reading in readings]
        except InputError as error:
            if not is_of_tables(data):
                raise
            refused.append(error)
    if refused and not records:
        raise refused[0]
    for table in refused:  # of a workbook or MATLAB file
        warnings.warn(f"{table} The table is left out.", RockframeWarning, stacklevel=2)
    return records


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
    beside: list[Content] = []
    if is_archive(data[:ARCHIVE_HEAD]):
        with suppress(InputError):  # reading the records reports what is wrong with the archive
            beside += (c for c in contents(path, data) if describes_records(c.path, c.data))
    return beside


def with_archived(options: ReadOptions, path: Path, within: list[Content]) -> ReadOptions:
    """Return options that find the StationXML in an archive and beside it."""
    stations = tuple(c for c in within if is_station_xml(c.path, c.data))
    return replace(options, archived=stations, folder=options.folder or path.parent)


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
        catalogues, faults = _catalogues_within(within)
        names = []
        for content in contents(path, data):
            names.append(content.name)
            if content.name in faults:
                yield faults[content.name]
            else:
                yield from _outcomes(content, options, catalogues)
        yield from _missing(catalogues, names)
    except RockframeError as error:
        yield _rejection(printable(path.name), error)


def _catalogues_within(within: Iterable[Content]) -> tuple[_Catalogues, dict[str, InputOutcome]]:
    """Return the catalogues in an archive in order of precedence, and the corrupted catalogues."""
    catalogues: _Catalogues = {}
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
                catalogues[folder] = {**catalogues.get(folder, {}), **entries}
    return dict(sorted(catalogues.items())), faults


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


def _outcomes(
    content: Content, options: ReadOptions, catalogues: _Catalogues
) -> Iterator[list[Reading] | InputOutcome]:
    """Yield the records of a file or member together, and the outcome of each stream without."""
    try:
        if note := note_of_member(content):
            yield InputOutcome(content.name, note, status="unread")
            return
        readings, left_out = _read(content, _trusting(content.name, options, catalogues))
    except OtherQuantityError as error:
        yield InputOutcome(content.name, error.reason, error.line, "unread")
        return
    except RockframeError as error:
        yield _rejection(content.name, error)
        return
    own: dict[str, CatalogueEntry] = {}
    for folder, entries in catalogues.items():
        own |= entries if folder and content.name.startswith(folder) else {}
    names, others = dict.fromkeys(re.split("[:/]", content.name)), catalogues.get("", {})
    if readings:
        yield [
            Reading(
                reading.record,
                {**reading.facts, **facts_for_record(others, reading.record, names)},
                facts_for_record(own, reading.record, names),
            )
            for reading in readings
        ]
    yield from left_out


def _trusting(name: str, options: ReadOptions, catalogues: _Catalogues) -> ReadOptions:
    """Return options with the words of catalogues in an archive, which others override."""
    within: dict[str, CatalogueEntry] = {}
    for folder, entries in catalogues.items():
        if folder and name.startswith(folder):
            within |= entries
    words = {file: entry.trust for file, entry in within.items() if entry.trust}
    reading = {file: entry.reading for file, entry in within.items() if entry.reading}
    if not (words or reading):
        return options
    return replace(
        options,
        trust_of={**words, **options.trust_of},
        of_files={**reading, **options.of_files},
    )
