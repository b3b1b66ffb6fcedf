"""Acceptance of records: processing, checks, filters, and a table row for every input."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, ParameterError, RockframeWarning
from rockframe.ingest import Rejection, Unread
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.passport import PassportLimits
from rockframe.record import Record
from rockframe.results.tables.entries import Entry, write_entries
from rockframe.signals.passport import Passport, passport
from rockframe.signals.processing import BandPass, correct
from rockframe.units import GRAVITY

#: Status of the rows of the table, in the order of the table.
_ORDER: Final = ("accepted", "rejected", "filtered", "rotated", "unread")

#: Checks and measures of faults that rotation, filter or taper would hide.
_AS_RECORDED: Final = (
    "stated_peak",
    "clipped_samples",
    "constant_time",
    "opening_share",
    "closing_share",
)


@dataclass(frozen=True)
class Accepted:
    """An accepted record, without its samples; the file has them.

    Parameters
    ----------
    record_id, source_format : str
        Identifier, and format of its file.
    samples : int
        Number of samples.
    time_step : float
        Interval between samples [s].
    corrected_here : bool
        True if the record was corrected here.
    processing : tuple of str
        Processing steps after reading, in order.
    passport : Passport
        Results of the checks.
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
    """Result of the ingest stage.

    Parameters
    ----------
    accepted : tuple of Accepted
        The accepted records.
    rejections : tuple of Rejection
        The rejected records, and the files without a readable record.
    entries : tuple of Entry
        Rows of the table, one for each record or unread file, with the passport if there is one:
        accepted, rejected, filtered out, rotated, unread.
    inputs : mapping of str to str
        Names and SHA-256 of the record files, of their StationXML, and of the catalogues.
    """

    accepted: tuple[Accepted, ...]
    rejections: tuple[Rejection, ...]
    entries: tuple[Entry, ...]
    inputs: Mapping[str, str]


@dataclass(frozen=True)
class Acceptance:
    """Processing and checking of records, with the results so far.

    Parameters
    ----------
    options : IngestOptions
        Options of processing.
    limits : PassportLimits
        Limits of the checks of each record.
    table : Path
        Path of the table.
    listed : callable, optional
        Called with the rows of the written table.
    filters : Filters
        Filters of accepted records.
    accepted, entries : list
        Accepted records, and the rows of all inputs.
    """

    options: IngestOptions
    limits: PassportLimits
    table: Path
    listed: Callable[[Sequence[Entry]], None] | None
    filters: Filters
    accepted: list[Accepted] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)

    def inspected(
        self, outcomes: Iterable[Record | Rejection | Unread]
    ) -> Iterator[tuple[Record, Passport | None]]:
        """Yield the accepted records one at a time, and add a row for every input."""
        for outcome in outcomes:
            if isinstance(outcome, Record):
                known = replace(outcome, uncorrected=True) if self.options.uncorrected else outcome
                band = BandPass(*self.options.band_pass_hz)
                record, entry = _inspected(known, band, self.limits)
                if self.let_through(record, entry, corrected_here=known.uncorrected):
                    yield record, entry.passport
            else:
                self.entries.append(_entry(outcome))
        self.require_some()

    def let_through(self, record: Record, entry: Entry, *, corrected_here: bool) -> bool:
        """Add the row of a record, and return True if the record is accepted.

        Raises
        ------
        InputError
            If the record is rejected and the options are strict.
        """
        if self.options.strict and entry.reason:
            raise InputError(entry.file, entry.reason)
        entry = _filtered(record, entry, self.filters)
        self.entries.append(entry)
        if entry.reason or entry.filtered or entry.passport is None:
            return False
        self.accepted.append(
            Accepted(
                record.record_id,
                record.source_format,
                record.acceleration.size,
                record.time_step,
                corrected_here,
                record.processing,
                entry.passport,
            )
        )
        return True

    def require_some(self) -> None:
        """Raise an error if no record was accepted, after writing the table.

        Raises
        ------
        InputError
            If no record was accepted. The message has the first reason, preferably of a filter.
        """
        if self.accepted:
            return
        rows = self.publish()
        filtered = [entry for entry in rows if entry.filtered]
        rejected = [entry for entry in rows if entry.reason]
        first = (filtered or rejected or rows)[0]
        more = {
            "more filtered out": len(filtered) - 1 if filtered else 0,
            "rejected" if filtered else "more rejected": len(rejected) - (not filtered),
        }
        counted = ", ".join(f"{count} {what}" for what, count in more.items() if count)
        said = (first.reason or first.note) + (f" ({counted}.)" if counted else "")
        raise InputError(first.file, said, first.line)

    def publish(self) -> tuple[Entry, ...]:
        """Write the table, sorted by status, and return its rows."""
        rows = tuple(sorted(self.entries, key=lambda entry: _ORDER.index(entry.status)))
        # For a single rejected file, the error already says everything.
        if self.accepted or len(rows) > 1:
            write_entries(rows, self.table)
        if self.listed is not None:
            self.listed(rows)
        return rows


def checked(
    record: Record,
    before: Record,
    limits: PassportLimits,
    components: Sequence[Passport] = (),
    start: tuple[float, float] = (0.0, 0.0),
) -> Entry:
    """Return the row of a record with its passport, and the reason if it is rejected.

    Parameters
    ----------
    record, before : Record
        The processed record, and the record before processing.
    limits : PassportLimits
        Limits of the checks.
    components : sequence of Passport
        Passports of the recorded components of a rotated record. For clipping, gaps, late trigger
        and similar faults, the rotated record takes the worst value of its components.
    start : (float, float)
        Velocity [m s-1] and displacement [m] at the first sample.
    """
    result = passport(before, record, limits, start)
    if components:
        result = _as_recorded(result, components)
    reason = " ".join(str(check) for check in result.rejections)
    name = record.record_id
    return Entry(
        record.source_file, name, result, reason=f"record {name!r}: {reason}" if reason else ""
    )


def _as_recorded(made: Passport, components: Sequence[Passport]) -> Passport:
    """Return the passport of a rotated motion with the faults of its components."""
    worst = {
        name: max(components, key=lambda one: np.nan_to_num(getattr(one.measures, name), nan=-1.0))
        for name in _AS_RECORDED
    }
    measures = {name: getattr(one.measures, name) for name, one in worst.items()}
    checks = {name: {c.name: c for c in one.checks}[name] for name, one in worst.items()}
    return Passport(
        replace(made.measures, **measures), tuple(checks.get(c.name, c) for c in made.checks)
    )


def _filtered(record: Record, entry: Entry, filters: Filters) -> Entry:
    """Return the row, with the reason if the record is filtered out."""
    if entry.reason or entry.passport is None:
        return entry
    measures = entry.passport.measures
    refusal = filters.refusal(
        site=record.site_type.words,
        magnitude=record.magnitude,
        epicentral_distance_km=record.epicentral_distance,
        distance_rrup_km=record.distance_rrup,
        distance_rjb_km=record.distance_rjb,
        distance_hypocentral_km=record.distance_hypocentral,
        vs30_m_s=record.vs30,
        pga_g=measures.peak_acceleration / GRAVITY,
        pgv_m_s=measures.peak_velocity,
    )
    return replace(entry, note=f"{refusal}.", filtered=True) if refusal else entry


def _entry(outcome: Rejection | Unread) -> Entry:
    if isinstance(outcome, Unread):
        return Entry(outcome.file, "", note=outcome.reason)
    return Entry(outcome.file, "", reason=outcome.reason, line=outcome.line)


def _inspected(record: Record, band: BandPass, limits: PassportLimits) -> tuple[Record, Entry]:
    """Return the processed record and its table row, which has a reason if it is rejected."""
    try:
        if not record.uncorrected:
            return record, checked(_require_motion(record), record, limits)
        processed, start = _processed(record, band)
        return processed, checked(processed, record, limits, start=start)
    except ParameterError as error:
        return record, Entry(record.source_file, record.record_id, reason=str(error))


def _require_motion(record: Record) -> Record:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    return record


def _processed(record: Record, band: BandPass) -> tuple[Record, tuple[float, float]]:
    corrected, start, steps = correct(_require_motion(record).acceleration, record.time_step, band)
    low, high = band.corners(record.time_step, record.duration)
    if high < band.high and band != BandPass():
        words = f"with time step {record.time_step:g} s are filtered up to {high:g} Hz"
        message = f"band_pass_hz {band.low:g} {band.high:g}: records {words}."
        warnings.warn(message, RockframeWarning, stacklevel=2)
    return replace(
        record,
        acceleration=corrected,
        # fmax and fmin ignore NaN, for values that the archive does not state.
        filter_low=float(np.fmax(record.filter_low, low)),
        filter_high=float(np.fmin(record.filter_high, high)),
        processing=(*record.processing, *steps),
    ), start
