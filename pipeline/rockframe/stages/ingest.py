"""Read record files into records.nc and the table of all inputs; rotate pairs."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from rockframe.cells import TABLE_FORMATS
from rockframe.components import HorizontalPair, pair_horizontals, rotate
from rockframe.engines.pool import Limits
from rockframe.errors import InputError, ParameterError
from rockframe.interruption import undoing
from rockframe.options.ingest import Filters, IngestOptions, PassportLimits
from rockframe.outcome import InputOutcome
from rockframe.provenance import make_folder, scratch_folder
from rockframe.record import Record, in_sequence
from rockframe.results.records import RecordsFile, open_records, write_records
from rockframe.signals.processing import AsRead
from rockframe.stages.ingesting.acceptance import (
    Acceptance,
    Ingested,
    Inspected,
    checked,
    inspected,
)
from rockframe.stages.ingesting.request import Request, warn_of_idle_options


def rotated(
    file: RecordsFile,
    outcomes: Sequence[InputOutcome],
    azimuths: Sequence[float],
    limits: PassportLimits,
    rotd: dict[str, Mapping[str, Any]],
) -> Iterator[Inspected]:
    """Yield the motion of each pair toward the azimuths, and the vertical records unchanged.

    If a pair is cut to a common length, its vertical is cut too. Unpaired records are rejected with
    the reason. Inputs that were not accepted come first, unchanged.

    Parameters
    ----------
    file : RecordsFile
        The records as recorded; one motion is in memory at a time.
    outcomes : sequence of InputOutcome
        The outcomes of all inputs, with the passports of the records in the file.
    azimuths : sequence of float
        Directions of the motions [degree].
    limits : PassportLimits
        Limits of the checks.
    rotd : dict
        Filled with the measures of both horizontals of each rotated motion (`RecordsFile.rotd`).
    """
    of_recorded = file.rotd
    recorded = {outcome.record_id: outcome for outcome in outcomes if outcome.status == "accepted"}
    yield from ((None, outcome, None) for outcome in outcomes if outcome.status != "accepted")
    for names in file.motions:
        records = [file.read(name) for name in names]
        pairs, unpaired = pair_horizontals(records)
        for alone in unpaired:
            reason = f"record {alone.record_id!r}: {alone.reason}"
            yield None, replace(recorded[alone.record_id], status="rejected", reason=reason), None
        verticals = {r.record_id: r for r in records if r.orientation.upright}
        for pair in pairs:
            for row in _toward(pair, azimuths, recorded, limits, _both_as_read(file, pair)):
                if row[0] is not None:
                    rotd[row[0].record_id] = of_recorded[pair.first.record_id]
                yield row
            if pair.vertical:
                verticals[pair.vertical.record_id] = pair.vertical
        for name, vertical in verticals.items():
            yield vertical, recorded[name], _as_read(file, vertical)


def _as_read(file: RecordsFile, record: Record) -> AsRead | None:
    """Return the samples as read of a record that was not cut; None if they are unknown."""
    samples = file.as_read(record.record_id)
    return samples if samples and samples.samples.size == record.acceleration.size else None


def _both_as_read(file: RecordsFile, pair: HorizontalPair) -> tuple[AsRead, AsRead] | None:
    """Return the samples of a pair as read; None unless both records have the same band."""
    first, other = (_as_read(file, record) for record in (pair.first, pair.second))
    return (first, other) if first and other and first.band == other.band else None


def _toward(
    pair: HorizontalPair,
    azimuths: Sequence[float],
    recorded: Mapping[str, InputOutcome],
    limits: PassportLimits,
    as_read: tuple[AsRead, AsRead] | None,
) -> Iterator[Inspected]:
    turned = [rotate(pair, azimuth) for azimuth in azimuths]
    components = [
        (component, recorded[component.record_id]) for component in (pair.first, pair.second)
    ]
    corrected = any(outcome.corrected_here for _, outcome in components)
    for record in turned:
        # A component perpendicular to the azimuth does not contribute to the motion toward it.
        passports = [
            outcome.passport
            for component, outcome in components
            if (record.azimuth - component.azimuth) % 180.0 != 90.0 and outcome.passport
        ]
        outcome = checked(record, record, limits, passports)
        unfiltered = None
        if as_read is not None:
            samples = pair.toward([record.azimuth], [component.samples for component in as_read])[0]
            unfiltered = AsRead(samples, as_read[0].band)
        yield record, replace(outcome, corrected_here=corrected), unfiltered
    into = " and ".join(repr(record.record_id) for record in turned)
    for _, outcome in components:
        yield None, replace(outcome, status="rotated", reason=f"rotated into {into}."), None


def read(*paths: str | Path, **options: Any) -> list[Record]:
    """Return the accepted records of files and folders, as `rockframe ingest` reads them.

    Parameters
    ----------
    paths : str or Path
        Record files, folders and archives, or one ``records.nc``.
    options : Any
        Fields of `IngestOptions`, such as ``units="g"``; a ``records.nc`` takes none.

    Returns
    -------
    list of Record
        The records, corrected where their files are uncorrected. `ingest_stage` also returns the
        reasons of the files that were rejected.

    Raises
    ------
    InputError
        If a path does not exist, or no record was accepted.
    ParameterError
        If an option is unknown or invalid.

    Examples
    --------
    >>> import rockframe
    >>> records = rockframe.read(rockframe.bundled_records() / "Ridgecrest2019-CLC.V1")
    >>> [record.record_id for record in records]
    ['Ridgecrest2019-CLC-090', 'Ridgecrest2019-CLC-360', 'Ridgecrest2019-CLC-UP']
    """
    if not paths:
        raise ParameterError("No path stated. Name record files or folders, or a records.nc.")
    if len(paths) == 1 and Path(paths[0]).suffix == ".nc":
        if options:
            said = f"{paths[0]} was read before: {next(iter(options))} has no effect. Leave it out."
            raise ParameterError(said)
        with open_records(paths[0]) as file:
            return list(file)
    with scratch_folder() as folder:
        ingest_stage(paths, folder / "records.nc", IngestOptions(**options), workers=0)
        with open_records(folder / "records.nc") as file:
            return list(file)


def ingest_stage(
    paths: Sequence[str | Path],
    output: str | Path,
    options: IngestOptions | None = None,
    *,
    filters: Filters | None = None,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    listed: Callable[[Sequence[InputOutcome]], None] | None = None,
    table_format: str = "csv",
) -> Ingested:
    """Read record files into ``records.nc``; uncorrected records are corrected.

    The correction is a baseline and a band-pass. Each record gets a passport, whose verdict can
    reject it. A table with the same name beside the output lists every input as accepted,
    rejected or unread, with the reason and the checks. The table is also written if all records of
    several files are rejected.

    Parameters
    ----------
    paths : sequence of str or Path
        Files and folders.
    output : str or Path
        The netCDF file to write.
    options : IngestOptions, optional
        Options of reading and processing.
    filters : Filters, optional
        Filters of accepted records; records outside the range are listed as filtered out.
    progress : callable, optional
        Called with the name of each file.
    workers : int, optional
        Largest number of processes that read files, by default one for each core; 0 reads in this
        process, where a crash of a reader ends the run. The output is the same.
    limits : Limits, optional
        Limits of time and memory for reading a file.
    listed : callable, optional
        Called with the rows of the written table, also if no record was accepted.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.

    Returns
    -------
    Ingested
        Records, rejections, and the rows of the table.

    Raises
    ------
    InputError
        If a path does not exist; if an output would replace an input or a table of other software;
        if no record was accepted; or if the options are strict and a record was rejected. In the
        last case nothing is written.

    Examples
    --------
    >>> import tempfile, rockframe
    >>> motion = rockframe.bundled_records() / "Ridgecrest2019-CLC.V1"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     done = ingest_stage([motion], Path(folder, "records.nc"), workers=0)
    >>> [record.record_id for record in done.accepted]
    ['Ridgecrest2019-CLC-090', 'Ridgecrest2019-CLC-360', 'Ridgecrest2019-CLC-UP']
    """
    options, output = options or IngestOptions(), Path(output)
    outputs = (output, output.with_suffix(TABLE_FORMATS[table_format]))
    azimuths, filters = options.azimuths, filters or Filters()
    wanted = Request.of(paths, options, filters, outputs)
    wanted.refuse(outputs)
    checks = wanted.checks
    first = partial(Acceptance, outputs[1], strict=options.strict, listed=listed)
    accepting = partial(first, factors=wanted.factors)
    # Filters of peaks and the selection are applied after the rotation: a pair needs both records.
    acceptance = first(Filters()) if azimuths else accepting(filters)
    with (
        closing(wanted.readings(progress, workers=workers, limits=limits)) as readings,
        _place(output, rotated=bool(azimuths)) as place,
    ):
        read = inspected(readings, options, checks)
        inputs, content = write_records(
            acceptance.passed(_and_sequence(read, None if azimuths else options, checks)),
            place,
            input_sha256=wanted.hashes(),
            parameters=wanted.parameters,
            spectral_periods=options.spectral_periods_s or (),
        )
        if azimuths:
            outcomes, acceptance = acceptance.outcomes, accepting(filters)
            with open_records(place) as recorded:
                rotd: dict[str, Mapping[str, Any]] = {}
                toward = rotated(recorded, outcomes, azimuths, checks, rotd)
                _, content = write_records(
                    acceptance.passed(_and_sequence(toward, options, checks)),
                    output,
                    input_sha256=inputs,
                    parameters=wanted.parameters,
                    rotd=rotd,
                    spectral_periods=options.spectral_periods_s or (),
                )
    rows = acceptance.publish()
    warn_of_idle_options(options, [record.source_format for record in acceptance.accepted], rows)
    rejections = tuple(row for row in rows if row.status == "rejected")
    return Ingested(tuple(acceptance.accepted), rejections, rows, inputs, content)


def _and_sequence(
    inputs: Iterable[Inspected], options: IngestOptions | None, limits: PassportLimits
) -> Iterator[Inspected]:
    """Yield the inputs, then the sequence of their records that the options state, if any."""
    wanted = options.sequence if options else None
    held: dict[str, tuple[Record, InputOutcome]] = {}
    accepted = []
    for record, outcome, as_read in inputs:
        if record is not None and outcome.status == "accepted":
            accepted.append(record.record_id)
            if wanted and record.record_id in wanted:
                held[record.record_id] = record, outcome
        yield record, outcome, as_read
    if not wanted or options is None:
        return
    for name in wanted:
        if name not in held:
            listed = ", ".join(accepted)
            raise ParameterError(
                f"Invalid record {name!r} of the sequence. Must be one of those accepted: {listed}."
            )
    records, outcomes = zip(*(held[name] for name in wanted), strict=True)
    joined = in_sequence(records, options.rest_s)
    passports = [outcome.passport for outcome in outcomes if outcome.passport]
    corrected = any(outcome.corrected_here for outcome in outcomes)
    outcome = replace(checked(joined, joined, limits, passports), corrected_here=corrected)
    yield joined, outcome, None


@contextmanager
def _place(output: Path, *, rotated: bool) -> Iterator[Path]:
    """Yield the path for the recorded components: a temporary path if they are rotated
    afterwards.
    """
    if not rotated:
        yield output
        return
    try:
        make_folder(output.parent)
        folder = tempfile.TemporaryDirectory(  # recognisable if the run is killed
            prefix=f".{output.stem}-", suffix=f".partial{output.suffix}", dir=output.parent
        )
    except OSError as error:
        raise InputError(output, f"cannot be written: {error.strerror}.") from None
    with folder as name, undoing(lambda: shutil.rmtree(name, ignore_errors=True)):
        yield Path(name, "recorded.nc")
