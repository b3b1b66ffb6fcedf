"""Read files and folders, also in worker processes, of which a crash costs one file."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.engines.engine import cores, in_order
from rockframe.engines.pool import Limits, WorkerDiedError, WorkerPool, awaited
from rockframe.errors import ParameterError
from rockframe.ingest.catalogue import facts_for_record
from rockframe.ingest.containers import printable
from rockframe.ingest.files import Catalogue, Reading, Source, read_outcomes, sources_of
from rockframe.ingest.identify import other_ids
from rockframe.ingest.options import NO_OPTIONS, ReadOptions
from rockframe.interruption import raise_if_interrupted
from rockframe.outcome import InputOutcome
from rockframe.record import Record
from rockframe.signals.passport import measured

#: Reads a file, as `read_outcomes` does.
Read = Callable[[Path, ReadOptions], Iterable[list[Reading] | InputOutcome]]
#: File and SHA-256 of the record, by identifier in lower case.
Owners = dict[str, tuple[str, str]]


@dataclass(frozen=True)
class Claim:
    """The identifiers that the records of a file, or of a member of an archive, ask for.

    Parameters
    ----------
    names : tuple of str
        Identifiers that the records have by themselves.
    file : str
        Display name of the file or member.
    sha256 : str
        Its hash.

    Examples
    --------
    >>> owners: Owners = {}
    >>> Claim(("shake",), "a/shake.csv", "1f").granted(owners)
    ['shake']
    >>> Claim(("shake",), "b/shake.csv", "1f").granted(owners)
    "record identifier 'shake' is in use by 'a/shake.csv'. This file is a copy of it."
    """

    names: tuple[str, ...]
    file: str
    sha256: str

    def granted(self, owners: Owners) -> list[str] | str:
        """Return and register unused identifiers, or the reason if all are in use."""
        names, file, digest = [*self.names], self.file, self.sha256
        same = next((name for name in names if name.casefold() in owners), "")
        owner, of_owner = owners.get(same.casefold(), ("", digest))
        possible = [names]
        if of_owner != digest:
            same_name = Path(owner).name.casefold() == Path(file).name.casefold()
            possible += [*other_ids(names, file)][same_name:]
        for ids in possible:
            if not any(name.casefold() in owners for name in ids):
                owners.update((name.casefold(), (file, digest)) for name in ids)
                return ids
        why = "Rename one of the files." if of_owner != digest else "This file is a copy of it."
        return f"record identifier {same!r} is in use by {owner!r}. {why}"


#: Claims in the order of the files, each with its identifiers, or the reason why it got none.
Claims = list[tuple[Claim, list[str] | str]]

#: Amount of text per worker that makes another worker worthwhile [bytes]; a start takes 0.2 s.
_BYTES_A_WORKER: Final = 16 << 20
#: Number of calls per worker that are computed in advance; limits memory.
_AHEAD: Final = 4


def collect(
    paths: Iterable[str | Path],
    options: ReadOptions = NO_OPTIONS,
    catalogue: Catalogue | None = None,
    progress: Callable[[str], None] | None = None,
    *,
    workers: int | None = 0,
    limits: Limits | None = None,
) -> Generator[Record | InputOutcome, None, None]:
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

    Yields
    ------
    Record or InputOutcome
        In the order of the paths. A file is rejected if its format is unknown, if it is corrupted,
        if its record identifier is already in use, or if a catalogue of a folder or an archive
        names it but it is missing. Catalogues, StationXML, other files of `rockframe fetch`,
        documents, hidden files and outputs are skipped. If two files differ only in their
        extensions or folders, the identifiers of the second file contain its whole name.

    Raises
    ------
    InputError
        If a path does not exist, or if a folder contains no files or its catalogue cannot be read.
    ParameterError
        If the number of workers is negative.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "shake.csv").write_text("time_s,acc_g\n0.00,0.0\n0.01,0.2\n")
    ...     _ = Path(folder, "notes.dat").write_text("Two samples.\n")
    ...     [rejection, record] = collect([folder])
    >>> rejection.file, record.record_id
    ('notes.dat', 'shake')
    """
    sources = sources_of(paths, catalogue)
    with closing(
        collect_sources(sources, options, progress, workers=workers, limits=limits)
    ) as readings:
        for reading in readings:
            yield reading.completed() if isinstance(reading, Reading) else reading


def collect_sources(
    sources: Sequence[Source],
    options: ReadOptions = NO_OPTIONS,
    progress: Callable[[str], None] | None = None,
    *,
    workers: int | None = 0,
    limits: Limits | None = None,
    read: Read | None = None,
    owners: Owners | None = None,
    claims: Claims | None = None,
) -> Generator[Reading | InputOutcome, None, None]:
    """Read the files of `sources_of`; the other parameters are those of `collect`.

    The facts of a reading are complete: with a unique identifier, and those from catalogues.

    Parameters
    ----------
    sources : sequence of Source
        Files to read.
    read : callable, optional
        Reads one file (default: `read_outcomes`); workers must be able to import it.
    owners : dict, optional
        Identifiers in use by files that were read before.
    claims : list, optional
        The claims of the files are appended to it.
    """
    calls = [(source.path, _trusting(source, options)) for source in sources if source.is_read]
    count = worker_count(workers, [path for path, _ in calls])
    owners = {} if owners is None else dict(owners)
    with closing(_outcomes(calls, count, limits, read or read_outcomes)) as outcomes:
        for source in sources:
            if progress is not None and source.is_read:
                progress(source.name)
            for outcome in next(outcomes) if source.is_read else [_not_read(source)]:
                yield from _assign_ids(outcome, source, owners, [] if claims is None else claims)


def sorted_out(
    outcomes: Iterable[Record | InputOutcome],
) -> tuple[list[Record], list[InputOutcome]]:
    """Return the records and the rejections in the output of `collect`, each in their order.

    Examples
    --------
    >>> records, [rejection] = sorted_out([InputOutcome("notes.md", "of no known format.")])
    >>> records, rejection.file
    ([], 'notes.md')
    """
    records: list[Record] = []
    rejections: list[InputOutcome] = []
    for outcome in outcomes:
        if isinstance(outcome, Record):
            records.append(outcome)
        elif outcome.status == "rejected":
            rejections.append(outcome)
    return records, rejections


def read_and_measured(
    path: Path, options: ReadOptions, *, uncorrected: bool, ratio: float
) -> Iterator[list[Reading] | InputOutcome]:
    """Read a file as `read_outcomes` does, and measure its records that need no correction.

    Measuring takes a fifth of the time of `ingest`; processes that read have that time left.

    Parameters
    ----------
    uncorrected : bool
        True to correct all records; the correction of a record depends on other files.
    ratio : float
        Limit of the signal-to-noise ratio.
    """
    for outcome in read_outcomes(path, options):
        if isinstance(outcome, list) and not uncorrected:
            yield [_with_measures(reading, ratio) for reading in outcome]
        else:
            yield outcome


def _with_measures(reading: Reading, ratio: float) -> Reading:
    """Return a reading with measures, unless it is corrected later or is no record of motion."""
    record = reading.record
    if record.uncorrected or np.ptp(record.acceleration) == 0.0:
        return reading
    return replace(reading, measures=measured(record, record, ratio))


def _trusting(source: Source, options: ReadOptions) -> ReadOptions:
    """Return options with what the catalogues beside a file say of reading it."""
    entries = {**source.others, **source.catalogue}
    words = {name: entry.trust for name, entry in entries.items() if entry.trust}
    reading = {name: entry.reading for name, entry in entries.items() if entry.reading}
    if not (words or reading):
        return options
    return replace(options, trust_of=words, of_files=reading)


def _outcomes(
    calls: Sequence[tuple[Path, ReadOptions]], workers: int, limits: Limits | None, read: Read
) -> Generator[list[list[Reading] | InputOutcome], None, None]:
    """Yield the outcomes of each file, in order."""
    if workers == 0:
        for path, options in calls:
            raise_if_interrupted()
            yield list(read(path, options))
        return
    with closing(serve(read, calls, workers, limits or Limits())) as served:
        for (path, _), of_file in zip(calls, served, strict=True):
            outcomes = list(of_file.values)
            if of_file.failure:
                rest = f"after {len(outcomes)} members, the rest is unread: " if outcomes else ""
                outcomes.append(InputOutcome(printable(path.name), rest + of_file.failure))
            yield outcomes


def worker_count(workers: int | None, paths: Sequence[Path]) -> int:
    """Return the number of workers to start: at most `workers`, fewer for few or small files.

    None means one per core, 0 means that this process reads the files.

    Raises
    ------
    ParameterError
        If `workers` is negative.
    """
    if workers is None:
        workers = cores()
    if workers < 0:
        raise ParameterError(f"Invalid number of workers {workers}. Must be 0 or more.")
    size = sum(path.stat().st_size for path in paths if path.is_file())
    return min(workers, len(paths), 1 + size // _BYTES_A_WORKER)


@dataclass(frozen=True)
class Served:
    """Values of a call in a worker, and the reason if it ended early."""

    values: Sequence[Any]
    failure: str = ""


def serve(
    function: Callable[..., Iterable[Any]],
    calls: Sequence[tuple[Any, ...]],
    workers: int,
    limits: Limits,
) -> Generator[Served, None, None]:
    """Yield the values of each call of a function in worker processes, in the order of the calls.

    Close the iterator (`contextlib.closing`) to end the workers early. The time limit holds for
    each value of a call.

    Examples
    --------
    >>> import os
    >>> with closing(serve(os._exit, [(3,)], 1, Limits())) as served:
    ...     next(served).failure
    'the reader crashed (exit status 3).'
    """
    with WorkerPool(workers, limits) as pool:
        for future in in_order(partial(pool.submit, function), calls, workers * _AHEAD):
            try:
                yield Served(tuple(awaited(future)))
            except WorkerDiedError as death:
                yield Served(death.values, death.reason(limits))


def _not_read(source: Source) -> InputOutcome:
    name = printable(source.path.name)
    if source.refusal:
        return InputOutcome(name, source.refusal)
    return InputOutcome(name, source.note, status="unread")


def _assign_ids(
    outcome: list[Reading] | InputOutcome, source: Source, owners: Owners, claims: Claims
) -> Sequence[Reading | InputOutcome]:
    """Return the readings of a file with unique identifiers, or the outcome of the file."""
    if isinstance(outcome, list):
        if changed := _changed_since_fetch(outcome, source):
            return [changed]
        facts = outcome[0].facts
        claim = Claim(
            tuple(reading.record.record_id for reading in outcome),
            _display_name(facts["source_file"], source),
            facts["source_sha256"],
        )
        named = claim.granted(owners)
        claims.append((claim, named))
        if isinstance(named, str):
            return [InputOutcome(claim.file, named)]
        return [
            _finished(reading, name, source) for reading, name in zip(outcome, named, strict=True)
        ]
    if outcome.status == "unread":
        if source.requested and outcome.file == source.name:
            return [replace(outcome, status="rejected")]
        outcome = replace(outcome, line=None)
    return [replace(outcome, file=_display_name(outcome.file, source))]


def _changed_since_fetch(readings: Sequence[Reading], source: Source) -> InputOutcome | None:
    """Return a rejection if the file differs from the one that was fetched."""
    digests = [reading.facts["source_sha256"] for reading in readings]
    if not source.sha256 or {*digests} == {source.sha256}:
        return None
    now, fetched = digests[0][:12], source.sha256[:12]
    reason = f"changed since it was fetched: SHA-256 {now}..., but {fetched}... in request.json."
    return InputOutcome(source.name, reason)


def _display_name(file: str, source: Source) -> str:
    """Return the display name of a file or archive member, relative to the requested folder."""
    return source.name + file.removeprefix(printable(source.path.name))


def _finished(reading: Reading, record_id: str, source: Source) -> Reading:
    """Return the reading with its identifier, display names and metadata from catalogues.

    Later sources override earlier ones: catalogues of archives, then the `catalogue.csv` in an
    archive, then the `catalogue.csv` beside it.
    """
    record, facts = reading.record, reading.facts
    folder, _, _ = source.name.rpartition("/")
    instrument = record.instrument_file
    within = instrument.startswith(f"{printable(source.path.name)}:")
    if folder and instrument and (within or (source.path.parent / instrument).is_file()):
        instrument = f"{folder}/{instrument}"
    file = facts["source_file"].rpartition(":")[2].split("/")[-1]
    names = dict.fromkeys([source.path.name, file])
    return Reading(
        record,
        {
            **facts,
            "record_id": record_id,
            "source_file": _display_name(facts["source_file"], source),
            "instrument_file": instrument,
            **facts_for_record(source.others, record, names, facts),
            **reading.own,
            **facts_for_record(source.catalogue, record, names, facts),
        },
        measures=reading.measures,
    )
