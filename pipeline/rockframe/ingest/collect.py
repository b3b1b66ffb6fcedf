"""Files and folders into records; every file ends among the records or among the rejections."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, RockframeError
from rockframe.ingest.catalogue import CATALOGUE, CatalogueEntry, read_catalogue, with_facts
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.registry import read_file
from rockframe.record import Record

#: Files of a folder that tell of records and hold none: the catalogue, and what a fetch leaves.
NO_RECORDS: Final = frozenset([CATALOGUE, "request.json", "event.quakeml", "channels.stationxml"])

Catalogue = Mapping[str, CatalogueEntry]


@dataclass(frozen=True)
class Rejection:
    """A file that gave no records.

    Parameters
    ----------
    file : str
        Name of the file.
    reason : str
        Why, in words.
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


def collect(
    paths: Iterable[str | Path],
    options: ReadOptions = NO_OPTIONS,
    catalogue: Catalogue | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[list[Record], list[Rejection]]:
    r"""Read files and folders of records.

    Parameters
    ----------
    paths : iterable of str or Path
        Files, and folders of files; of a folder, the regular files in it, by name, without hidden
        ones, its `catalogue.csv`, and what `rockframe fetch` leaves beside the records.
    options : ReadOptions
        Units and time step of files that do not state them.
    catalogue : mapping of str to CatalogueEntry, optional
        Facts by name of file. By default a folder's own `catalogue.csv`, for the files in it.
    progress : callable, optional
        Called with the name of each file before it is read.

    Returns
    -------
    records : list of Record
        In the order of the paths.
    rejections : list of Rejection
        The files that gave none: of unknown format, damaged, or with a record identifier that an
        earlier file has; and the files that a folder's own catalogue names but the folder lacks.

    Raises
    ------
    InputError
        If a path does not exist, a folder holds no files, or its catalogue cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "shake.csv").write_text("time_s,acc_g\n0.00,0.0\n0.01,0.2\n")
    ...     _ = Path(folder, "notes.md").write_text("Two samples.\n")
    ...     records, rejections = collect([folder])
    >>> [record.record_id for record in records], [rejection.file for rejection in rejections]
    (['shake'], ['notes.md'])
    """
    sources = [source for path in paths for source in _sources(Path(path), catalogue)]
    records: list[Record] = []
    rejections: list[Rejection] = []
    owners: dict[str, str] = {}
    for path, entry in sources:
        if progress is not None:
            progress(path.name)
        try:
            found = read_file(path, options)
            _require_new(path, found, owners)
        except RockframeError as error:
            rejections.append(_rejection(path, error))
            continue
        owners.update((record.record_id.casefold(), path.name) for record in found)
        records += [with_facts(record, entry) if entry else record for record in found]
    return records, rejections


def _sources(
    path: Path, catalogue: Catalogue | None
) -> Iterator[tuple[Path, CatalogueEntry | None]]:
    """The files of a path, each with what the catalogue states of it."""
    try:
        if not path.exists():
            raise InputError(path, "no such file or folder. Must exist.")
        if not path.is_dir():
            yield path, (catalogue or {}).get(path.name)
            return
        files = sorted(filter(_may_be_record, path.iterdir()), key=lambda file: file.name)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(path, f"cannot be opened ({reason}). Must be readable.") from error
    if not files:
        raise InputError(path, "a folder without files. Must hold records.")
    own: Catalogue = {}
    if catalogue is None and (path / CATALOGUE).is_file():
        own = read_catalogue(path / CATALOGUE)
        # Such a file is rejected as missing: a misspelt name must not lose its facts unseen.
        files += [path / name for name in own if not (path / name).is_file()]
    for file in files:
        yield file, (own if catalogue is None else catalogue).get(file.name)


def _may_be_record(file: Path) -> bool:
    return file.is_file() and not file.name.startswith(".") and file.name not in NO_RECORDS


def _require_new(path: Path, records: list[Record], owners: Mapping[str, str]) -> None:
    for record in records:
        owner = owners.get(record.record_id.casefold())
        if owner is not None:
            raise InputError(
                path,
                f"record identifier {record.record_id!r} is already that of a record of "
                f"{owner!r}. Must differ, in more than case.",
            )


def _rejection(path: Path, error: RockframeError) -> Rejection:
    if isinstance(error, InputError):
        return Rejection(path.name, error.reason, error.line)
    return Rejection(path.name, str(error))
