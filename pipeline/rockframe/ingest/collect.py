"""Files and folders into records; every file ends among the records or among the rejections."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.attempt import Outcome, Rejection, attempt
from rockframe.ingest.catalogue import CATALOGUE, CatalogueEntry, read_catalogue, with_facts
from rockframe.ingest.containers import printable
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.quarantine import Limits, Served, serve, worker_count
from rockframe.ingest.stationxml import is_station_xml
from rockframe.record import Record

#: Files of a folder that tell of records and hold none: the catalogue, and what a fetch leaves.
NO_RECORDS: Final = frozenset([CATALOGUE, "request.json", "event.quakeml", "channels.stationxml"])

Catalogue = Mapping[str, CatalogueEntry]


def collect(
    paths: Iterable[str | Path],
    options: ReadOptions = NO_OPTIONS,
    catalogue: Catalogue | None = None,
    progress: Callable[[str], None] | None = None,
    *,
    workers: int | None = 0,
    limits: Limits | None = None,
    strict: bool = False,
) -> Generator[Record | Rejection, None, None]:
    r"""Read files, archives and folders of records; memory does not grow with their number.

    The records of one archive, of 1,000 members at most, are held together. Close the iterator
    (`contextlib.closing`) to end the workers early.

    Parameters
    ----------
    paths : iterable of str or Path
        Files, ZIP and gzip archives, and folders of such; of a folder, the regular files in it, by
        name, without hidden ones, its `catalogue.csv`, StationXML, and what `rockframe fetch`
        leaves beside the records.
    options : ReadOptions
        Units and time step of files that do not state them.
    catalogue : mapping of str to CatalogueEntry, optional
        Facts by name of file; an archive's are its members'. By default a folder's own
        `catalogue.csv`, for the files in it.
    progress : callable, optional
        Called with the name of each file, in the order of the paths.
    workers : int, optional
        Most worker processes that read at once, so that a crash, a hang or a lack of memory is a
        rejection; None is one for each core, 0 reads in this process. The result is the same.
    limits : Limits, optional
        Time and memory of a worker.
    strict : bool
        Let the first rejection be an error.

    Yields
    ------
    Record or Rejection
        In the order of the paths. Rejected are files of unknown format, damaged ones, those with a
        record identifier that an earlier file has, and files that a folder's own catalogue names
        but the folder lacks.

    Raises
    ------
    InputError
        If a path does not exist, a folder holds no files, or its catalogue cannot be read; and if
        `strict`, for the first file that is rejected.
    ParameterError
        If the number of workers is negative.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "shake.csv").write_text("time_s,acc_g\n0.00,0.0\n0.01,0.2\n")
    ...     _ = Path(folder, "notes.md").write_text("Two samples.\n")
    ...     [rejection, record] = collect([folder])
    >>> rejection.file, record.record_id
    ('notes.md', 'shake')
    """
    sources = [source for path in paths for source in _sources(Path(path), catalogue)]
    files = [path for path, _ in sources]
    owners: dict[str, str] = {}
    with closing(_outcomes(files, options, worker_count(workers, files), limits)) as outcomes:
        for path, entry in sources:
            if progress is not None:
                progress(printable(path.name))
            for outcome in next(outcomes):
                settled = _settled(outcome, owners)
                if not isinstance(settled, Rejection):
                    yield from (with_facts(r, entry) if entry else r for r in settled)
                elif strict:
                    raise InputError(settled.file, settled.reason, settled.line)
                else:
                    yield settled


def sorted_out(
    outcomes: Iterable[Record | Rejection],
) -> tuple[list[Record], list[Rejection]]:
    """Return the records and the rejections, each in their order.

    Parameters
    ----------
    outcomes : iterable of Record or Rejection
        As `collect` gives them; all are held in memory.

    Examples
    --------
    >>> sorted_out([Rejection("notes.md", "of no known format.")])
    ([], [Rejection(file='notes.md', reason='of no known format.', line=None)])
    """
    records: list[Record] = []
    rejections: list[Rejection] = []
    for outcome in outcomes:
        if isinstance(outcome, Rejection):
            rejections.append(outcome)
        else:
            records.append(outcome)
    return records, rejections


def _outcomes(
    files: Sequence[Path], options: ReadOptions, workers: int, limits: Limits | None
) -> Generator[list[Outcome], None, None]:
    """What became of each file, in their order."""
    if workers == 0:
        for path in files:
            yield list(attempt(path, options))
        return
    calls = [(path, options) for path in files]
    with closing(serve(attempt, calls, workers, limits or Limits())) as served:
        for path, of_file in zip(files, served, strict=True):
            yield _received(path, of_file)


def _received(path: Path, served: Served[Outcome]) -> list[Outcome]:
    # An array comes out of a pickle writable; a record makes it read-only again.
    outcomes: list[Outcome] = [
        outcome if isinstance(outcome, Rejection) else [replace(record) for record in outcome]
        for outcome in served.values
    ]
    if served.failure:
        before = f"after {len(outcomes)} members, the rest is unread: " if outcomes else ""
        outcomes.append(Rejection(printable(path.name), before + served.failure))
    return outcomes


def _settled(outcome: Outcome, owners: dict[str, str]) -> Outcome:
    """The outcome, unless another file has a record of the same name; new names are noted."""
    if isinstance(outcome, Rejection):
        return outcome
    for record in outcome:
        owner = owners.get(record.record_id.casefold())
        if owner is not None:
            return Rejection(
                record.source_file,
                f"record identifier {record.record_id!r} is already that of a record of "
                f"{owner!r}. Must differ, in more than case.",
            )
    owners.update((record.record_id.casefold(), record.source_file) for record in outcome)
    return outcome


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
    return (
        file.is_file()
        and not file.name.startswith(".")
        and file.name not in NO_RECORDS
        and not is_station_xml(file)
    )
