"""ingest: from files to records.nc and the table of all inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import (
    CATALOGUE,
    Limits,
    ReadOptions,
    Rejection,
    Unread,
    collect,
    read_catalogue,
    sources_of,
)
from rockframe.provenance import refuse_overwriting, sha256_of
from rockframe.record import Record
from rockframe.results import (
    Entry,
    is_netcdf,
    refuse_strange_entries,
    require_ending,
    write_entries,
    write_records,
)
from rockframe.signals import BandPass, Passport, correct, passport
from rockframe.study import Filters, PassportLimits
from rockframe.units import GRAVITY


@dataclass(frozen=True)
class Accepted:
    """A record that went through; its samples are in the file.

    Parameters
    ----------
    record_id, source_format : str
        Its identifier, and the format of its file.
    samples : int
        Their number.
    time_step : float
        Interval between them [s].
    corrected_here : bool
        Whether it got a baseline and a band-pass.
    processing : tuple of str
        What was done to the samples after reading, in order.
    passport : Passport
        What was measured on it.
    """

    record_id: str
    source_format: str
    samples: int
    time_step: float
    corrected_here: bool
    processing: tuple[str, ...]
    passport: Passport


@dataclass(frozen=True)
class Ingested:
    """What became of the files.

    Parameters
    ----------
    accepted : tuple of Accepted
        The records that went through.
    rejections : tuple of Rejection
        Those that did not, and the files that gave none.
    entries : tuple of Entry
        Rows of the table, a record or a file each, with the passport where one was made: accepted
        first, then rejected, then unread.
    inputs : mapping of str to str
        Names and SHA-256 of the files that gave the records, of their StationXML, and of the
        catalogues.
    """

    accepted: tuple[Accepted, ...]
    rejections: tuple[Rejection, ...]
    entries: tuple[Entry, ...]
    inputs: Mapping[str, str]


def ingest_stage(
    paths: Sequence[Path],
    output: Path,
    *,
    options: ReadOptions | None = None,
    catalogue: Path | None = None,
    band: BandPass | None = None,
    all_uncorrected: bool = False,
    passport_limits: PassportLimits | None = None,
    progress: Callable[[str], None] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    strict: bool = False,
    listed: Callable[[Sequence[Entry]], None] | None = None,
    filters: Filters | None = None,
) -> Ingested:
    """Read record files into ``records.nc``; uncorrected ones get baseline and band-pass.

    Each record gets a passport, and one with a verdict of rejection is rejected. Beside it goes a
    CSV file of the same name: every input, accepted, rejected or unread, with the reason and the
    checks; it is written even if no record of several files went through.

    Parameters
    ----------
    paths : sequence of Path
        Files and folders.
    output : Path
        The netCDF file to write.
    options : ReadOptions, optional
        Units and time step of text files that do not state them.
    catalogue : Path, optional
        CSV of facts about the files; otherwise each folder's own ``catalogue.csv``.
    band : BandPass, optional
        Corner frequencies for uncorrected records.
    all_uncorrected : bool
        Take every record for uncorrected, whatever its format says.
    passport_limits : PassportLimits, optional
        Limits of the checks of each record.
    progress : callable, optional
        Called with the name of each file.
    workers : int, optional
        Most processes that read files, by default one for each core; 0 reads in this one, where a
        crash of a reader is a crash of the run. The output is the same.
    limits : Limits, optional
        Time and memory that reading a file may take.
    strict : bool
        Write nothing if a file is rejected.
    listed : callable, optional
        Called with the rows of the table once it is written, also if no record went through.
    filters : Filters, optional
        Which of the accepted records go on; the others stand in the table as filtered out.

    Returns
    -------
    Ingested
        Records, rejections, and the rows of the table.

    Raises
    ------
    InputError
        If a path does not exist, or an output would replace an input or a list that is not ours;
        if one was rejected and `strict`, with nothing written; or no record went through.
    """
    band, options = band or BandPass(), options or ReadOptions()
    checks = passport_limits or PassportLimits()
    beside = output.with_suffix(".csv")
    catalogues = _catalogues(paths, catalogue, (output, beside))
    chosen = filters or Filters()
    run = _Run(band, checks, all_uncorrected, strict, beside, listed, chosen)
    with closing(
        collect(
            paths,
            options,
            read_catalogue(catalogue) if catalogue else None,
            progress,
            workers=workers,
            limits=limits,
            strict=strict,
            outputs=(output, beside),
        )
    ) as outcomes:
        inputs = write_records(
            run.inspected(outcomes),
            output,
            input_sha256={name: sha256_of(path) for name, path in catalogues.items()},
            parameters={
                "all_uncorrected": all_uncorrected,
                "band_pass_hz": [band.low, band.high],
                "filters": run.filters.stated(),
                "passport": checks.stated(),
                **options.stated(),
            },
        )
    entries = run.publish()
    rejections = tuple(Rejection(e.file, e.reason, e.line) for e in entries if e.reason)
    return Ingested(tuple(run.accepted), rejections, entries, inputs)


def _catalogues(
    paths: Sequence[Path], given: Path | None, outputs: Sequence[Path]
) -> dict[str, Path]:
    """The catalogues that state facts, by name; outputs that would replace an input are refused."""
    sources = sources_of(paths, {} if given else None, outputs)
    if given:
        found = {given.name: given}
    else:
        found = {s.name: s.path for s in sources if s.path.name == CATALOGUE and s.note}
    # In a folder, what this command wrote before is no input; the list is looked at below.
    kept = [
        s.path for s in sources if s.is_read or (s.path.suffix == ".nc" and not is_netcdf(s.path))
    ]
    refuse_overwriting(outputs, [*found.values(), *kept])
    refuse_strange_entries(outputs[1])
    require_ending(outputs[0])
    return found


@dataclass(frozen=True)
class _Run:
    """How records are processed and checked, and what became of those that have been."""

    band: BandPass
    limits: PassportLimits
    all_uncorrected: bool
    strict: bool
    beside: Path
    listed: Callable[[Sequence[Entry]], None] | None
    filters: Filters
    accepted: list[Accepted] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)

    def inspected(
        self, outcomes: Iterable[Record | Rejection | Unread]
    ) -> Iterator[tuple[Record, Passport | None]]:
        """Give what goes through, one after the other, and note what became of everything."""
        for outcome in outcomes:
            if not isinstance(outcome, Record):
                self.entries.append(_entry(outcome))
                continue
            uncorrected = outcome.uncorrected or self.all_uncorrected
            record, entry = _inspected(outcome, self.band, self.limits, uncorrected)
            if self.strict and entry.reason:
                raise InputError(entry.file, entry.reason)
            entry = _filtered(record, entry, self.filters)
            self.entries.append(entry)
            if entry.passport and not (entry.reason or entry.filtered):
                self.accepted.append(_accepted(record, uncorrected, entry.passport))
                yield record, entry.passport
        if not self.accepted:
            refused = [entry for entry in self.publish() if entry.reason or entry.filtered]
            first, others = refused[0], len(refused) - 1
            more = f" ({others} more rejected.)" if others else ""
            raise InputError(first.file, (first.reason or first.note) + more, first.line)

    def publish(self) -> tuple[Entry, ...]:
        """Write the table: accepted, rejected, filtered, unread."""
        order = ("accepted", "rejected", "filtered", "unread")
        rows = tuple(sorted(self.entries, key=lambda entry: order.index(entry.status)))
        # Of one file that is refused, the error says all that a table could.
        if self.accepted or len(rows) > 1:
            write_entries(rows, self.beside)
        if self.listed is not None:
            self.listed(rows)
        return rows


def _entry(outcome: Rejection | Unread) -> Entry:
    if isinstance(outcome, Unread):
        return Entry(outcome.file, "", note=outcome.reason)
    return Entry(outcome.file, "", reason=outcome.reason, line=outcome.line)


def _accepted(record: Record, corrected_here: bool, checked: Passport) -> Accepted:
    return Accepted(
        record.record_id,
        record.source_format,
        record.acceleration.size,
        record.time_step,
        corrected_here,
        record.processing,
        checked,
    )


def _inspected(
    record: Record, band: BandPass, limits: PassportLimits, uncorrected: bool
) -> tuple[Record, Entry]:
    """Return the record after processing, and its row of the table; with a reason: rejected."""
    file, name = record.source_file, record.record_id
    try:
        processed = _processed(record, band) if uncorrected else _moving(record)
        corners = band.corners(record.time_step, record.duration) if uncorrected else None
        checked = passport(record, processed, limits, corners)
    except ParameterError as error:
        return record, Entry(file, name, reason=str(error))
    reason = " ".join(str(check) for check in checked.rejections)
    return processed, Entry(file, name, checked, f"record {name!r}: {reason}" if reason else "")


def _filtered(record: Record, entry: Entry, filters: Filters) -> Entry:
    """Return the row with the reason why the record is filtered out, if it is."""
    if entry.reason or entry.passport is None:
        return entry
    measures = entry.passport.measures
    refusal = filters.refusal(
        magnitude=record.magnitude,
        epicentral_distance_km=record.epicentral_distance,
        vs30_m_s=record.vs30,
        pga_g=measures.peak_acceleration / GRAVITY,
        pgv_m_s=measures.peak_velocity,
    )
    return replace(entry, note=f"{refusal}.", filtered=True) if refusal else entry


def _moving(record: Record) -> Record:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    return record


def _processed(record: Record, band: BandPass) -> Record:
    corrected, steps = correct(_moving(record).acceleration, record.time_step, band)
    return replace(record, acceleration=corrected, processing=(*record.processing, *steps))
