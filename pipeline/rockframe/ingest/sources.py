"""List the files of paths and, recursively, of folders."""

from __future__ import annotations

import re
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.catalogue import (
    CATALOGUE,
    CatalogueEntry,
    catalogue_kind,
    is_catalogue,
    read_catalogue,
)
from rockframe.ingest.members import folder_names, printable
from rockframe.ingest.parsing.lines import head_of, unreadable
from rockframe.ingest.stationxml import is_station_xml
from rockframe.provenance import read_json

Catalogue = Mapping[str, CatalogueEntry]

_REQUEST: Final = "request.json"
#: Notes on files that accompany records and are not read as records.
_CATALOGUE: Final = "catalogue: states metadata of the files in its folder."
_BESIDE: Final = {
    _REQUEST: "request of a fetch: not needed to read the records.",
    "event.quakeml": "event from a data centre: the catalogue contains its metadata.",
    "channels.stationxml": "channels from a data centre: not needed to read the records.",
}
_STATION_XML: Final = "StationXML: the instruments of the miniSEED files beside it."
_HIDDEN: Final = "hidden file: not read."
_DOCUMENT: Final = "document: not a record."
_DOCUMENTS: Final = re.compile(
    r"^_?read_?me\b|^disclaimer|^(thumbs\.db|desktop\.ini)$"
    r"|\.(pdf|md|html?|docx?|tex|png|jpe?g|gif|svg|toml|xlsx?|parquet|nc)$",
    re.I,
)
#: First columns of the tables that rockframe writes.
_TABLE: Final = re.compile(rb"(file,)?record_id,|structure,(limit_state|measure|dimension),")
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

    @property
    def is_read(self) -> bool:
        """True if the file is to be read."""
        return not (self.note or self.refusal)


def sources_of(
    paths: Iterable[str | Path],
    catalogue: Catalogue | None = None,
    outputs: Collection[Path] = (),
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
    found: list[Source] = []
    for path, called in zip(requested, folder_names(requested), strict=True):
        if not _exists(path):
            raise InputError(path, "no such file or folder.")
        if not path.is_dir():
            found.append(Source(path, printable(path.name), catalogue or {}, requested=True))
            continue
        within = list(_files_in(path, _entries(path), "", catalogue, replaced))
        if not any(source.is_read or source.refusal for source in within):
            raise InputError(path, "the folder contains no record files.")
        before = f"{called}/" if len(requested) > 1 else ""
        found += [replace(source, name=before + source.name) for source in within]
    return found


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
    known = {**own, **(catalogue or {})}
    received = _fetched_sha256(folder / _REQUEST)
    folders = []
    for path in entries:
        name = before + printable(path.name)
        note, refusal = ("", faults[path]) if path in faults else _note_and_refusal(path, replaced)
        if not (note or refusal) and path.is_dir():
            folders.append(path)
        else:
            yield Source(
                path, name, known, note, refusal, received.get(path.name, ""), others=others
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
    """Return note and refusal of an entry in a folder; both empty if the entry is read."""
    if path.name.startswith("."):
        return _HIDDEN, ""
    refusal = _refusal(path)
    if refusal or path.is_dir():
        return "", refusal
    if path.resolve() in replaced:
        return _OUTPUT, ""
    if is_catalogue(path):
        return _CATALOGUE, ""
    if path.suffix == ".csv" and _TABLE.match(head_of(path)):
        return _DOCUMENT, ""
    return note_on(Path(path.name)) or (_STATION_XML if is_station_xml(path) else ""), ""


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
