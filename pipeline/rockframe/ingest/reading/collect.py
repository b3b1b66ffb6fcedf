"""Read files and folders; each file gives records, a rejection, or a note that it was skipped."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

from rockframe.engines.pool import Limits
from rockframe.errors import InputError
from rockframe.ingest.metadata.catalogue import facts_of
from rockframe.ingest.metadata.identify import other_ids
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.ingest.reading.isolation import Served, serve, worker_count
from rockframe.ingest.reading.members import printable
from rockframe.ingest.reading.read_outcome import ReadOutcome, Rejection, Unread, read_outcomes
from rockframe.ingest.reading.sources import Catalogue, Source, sources_of
from rockframe.record import Record

#: File and SHA-256 of the record, by identifier in lower case.
Owners = dict[str, tuple[str, str]]


def collect(
    paths: Iterable[str | Path],
    options: ReadOptions = NO_OPTIONS,
    catalogue: Catalogue | None = None,
    progress: Callable[[str], None] | None = None,
    *,
    workers: int | None = 0,
    limits: Limits | None = None,
    strict: bool = False,
) -> Generator[Record | Rejection | Unread, None, None]:
    r"""Read files, archives and folders; memory does not grow with the number of files.

    The records of one archive (at most 1,000 members) are held in memory together. Close the
    iterator (`contextlib.closing`) to end the workers early.

    Parameters
    ----------
    paths : iterable of str or Path
        Files, archives, and folders, which are searched recursively.
    options : ReadOptions
        Values that the files do not state, such as units and time step.
    catalogue : mapping of str to CatalogueEntry, optional
        Metadata by file name; the entry of an archive applies to its members (default: the
        catalogues of each folder and archive, for the files in it).
    progress : callable, optional
        Called with the name of each file, in the order of the paths.
    workers : int, optional
        Number of worker processes. A crash, a timeout or lack of memory in a worker rejects only
        the file. None means one per core, 0 reads in this process. The result does not depend on
        this number.
    limits : Limits, optional
        Time and memory limits of a worker.
    strict : bool
        True to raise an error at the first rejection.

    Yields
    ------
    Record, Rejection or Unread
        In the order of the paths. A file is rejected if its format is unknown, if it is corrupted,
        if its record identifier is already in use, or if a catalogue of a folder or an archive
        names it but it is missing. Catalogues, StationXML, other files of `rockframe fetch`, hidden
        files and outputs are skipped. If two files differ only in their extensions or folders, the
        identifiers of the second file contain its whole name.

    Raises
    ------
    InputError
        If a path does not exist, if a folder contains no files or its catalogue cannot be read, or
        if `strict` is set and a file is rejected.
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
    yield from collect_sources(
        sources_of(paths, catalogue),
        options,
        progress,
        workers=workers,
        limits=limits,
        strict=strict,
    )


def collect_sources(
    sources: Sequence[Source],
    options: ReadOptions = NO_OPTIONS,
    progress: Callable[[str], None] | None = None,
    *,
    workers: int | None = 0,
    limits: Limits | None = None,
    strict: bool = False,
) -> Generator[Record | Rejection | Unread, None, None]:
    """Read the files of `sources_of`; the other parameters are those of `collect`.

    Parameters
    ----------
    sources : sequence of Source
        Files to read.
    """
    files = [source.path for source in sources if source.is_read]
    owners: Owners = {}
    with closing(_outcomes(files, options, worker_count(workers, files), limits)) as outcomes:
        for source in sources:
            if progress is not None and source.is_read:
                progress(source.name)
            for outcome in next(outcomes) if source.is_read else [_not_read(source)]:
                yield from _assign_ids(outcome, source, owners, strict=strict)


def sorted_out(
    outcomes: Iterable[Record | Rejection | Unread],
) -> tuple[list[Record], list[Rejection]]:
    """Return the records and the rejections, each in their order.

    Parameters
    ----------
    outcomes : iterable of Record, Rejection or Unread
        Output of `collect`; all of it is held in memory.

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
        elif isinstance(outcome, Record):
            records.append(outcome)
    return records, rejections


def _outcomes(
    files: Sequence[Path], options: ReadOptions, workers: int, limits: Limits | None
) -> Generator[list[ReadOutcome], None, None]:
    """Yield the outcomes of each file, in order."""
    if workers == 0:
        for path in files:
            yield list(read_outcomes(path, options))
        return
    calls = [(path, options) for path in files]
    with closing(serve(read_outcomes, calls, workers, limits or Limits())) as served:
        for path, of_file in zip(files, served, strict=True):
            yield _from_worker(path, of_file)


def _from_worker(path: Path, served: Served[ReadOutcome]) -> list[ReadOutcome]:
    outcomes = list(served.values)
    if served.failure:
        before = f"after {len(outcomes)} members, the rest is unread: " if outcomes else ""
        outcomes.append(Rejection(printable(path.name), before + served.failure))
    return outcomes


def _not_read(source: Source) -> Rejection | Unread:
    name = printable(source.path.name)
    return Rejection(name, source.refusal) if source.refusal else Unread(name, source.note)


def _assign_ids(
    outcome: ReadOutcome, source: Source, owners: Owners, *, strict: bool
) -> list[Record] | list[Rejection | Unread]:
    """Return the records of a file with unique identifiers, or its rejection."""
    if not isinstance(outcome, Rejection | Unread):
        records = [record for record, _ in outcome]
        named = _changed_since_fetch(records, source) or _unused_ids(records, source, owners)
        if not isinstance(named, Rejection):
            return [_finished(*r, n, source) for r, n in zip(outcome, named, strict=True)]
        outcome = named
    elif isinstance(outcome, Unread) and source.asked and outcome.file == source.name:
        outcome = Rejection(outcome.file, outcome.reason, outcome.line)
    else:
        outcome = replace(outcome, file=_display_name(outcome.file, source))
    if strict and isinstance(outcome, Rejection):
        raise InputError(outcome.file, outcome.reason, outcome.line)
    return [outcome]


def _changed_since_fetch(records: list[Record], source: Source) -> Rejection | None:
    """Return a rejection if the file differs from the one that was fetched."""
    if not source.sha256 or all(record.source_sha256 == source.sha256 for record in records):
        return None
    found = records[0].source_sha256[:12]
    return Rejection(
        source.name,
        f"changed since it was fetched: SHA-256 {found}..., but {source.sha256[:12]}... in "
        "request.json.",
    )


def _display_name(file: str, source: Source) -> str:
    """Return the display name of a file or archive member, relative to the requested folder."""
    return source.name + file.removeprefix(printable(source.path.name))


def _finished(record: Record, own: dict[str, Any], record_id: str, source: Source) -> Record:
    """Return the record with its identifier, display names and metadata from catalogues.

    Later sources override earlier ones: catalogues of archives, then the `catalogue.csv` in an
    archive, then the `catalogue.csv` beside it.
    """
    folder, _, _ = source.name.rpartition("/")
    instrument = record.instrument_file
    within = instrument.startswith(f"{printable(source.path.name)}:")
    if folder and instrument and (within or (source.path.parent / instrument).is_file()):
        instrument = f"{folder}/{instrument}"
    file = record.source_file.rpartition(":")[2].split("/")[-1]
    names = dict.fromkeys([source.path.name, file])
    facts = facts_of(source.others, record, names) | own
    return replace(
        record,
        record_id=record_id,
        source_file=_display_name(record.source_file, source),
        instrument_file=instrument,
        **(facts | facts_of(source.catalogue, record, names)),
    )


def _unused_ids(records: list[Record], source: Source, owners: Owners) -> list[str] | Rejection:
    """Return and register unused identifiers, or a rejection if all are in use."""
    names = [record.record_id for record in records]
    file, digest = _display_name(records[0].source_file, source), records[0].source_sha256
    taken = next((owners[n.casefold()] for n in names if n.casefold() in owners), None)
    if taken is None:
        return _register(names, file, digest, owners)
    if taken[1] != digest:
        same_name = _file_name(taken[0]) == _file_name(file)
        for ids in [*other_ids(names, file)][same_name:]:
            if not any(name.casefold() in owners for name in ids):
                return _register(ids, file, digest, owners)
    same = next(name for name in names if name.casefold() in owners)
    why = "Rename one of the files." if taken[1] != digest else "This file is a copy of it."
    return Rejection(file, f"record identifier {same!r} is in use by {taken[0]!r}. {why}")


def _register(ids: list[str], file: str, digest: str, owners: Owners) -> list[str]:
    owners.update((name.casefold(), (file, digest)) for name in ids)
    return ids


def _file_name(file: str) -> str:
    return file.rpartition("/")[2].casefold()
