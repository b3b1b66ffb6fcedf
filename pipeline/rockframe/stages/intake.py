"""What becomes of the files that are read: records that go through, and a row for everything."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, ParameterError
from rockframe.ingest import Rejection, Unread
from rockframe.options import Filters, IngestOptions
from rockframe.record import Record
from rockframe.results import Entry, write_entries
from rockframe.signals import BandPass, Passport, correct, passport
from rockframe.study import PassportLimits
from rockframe.units import GRAVITY

#: Status of the rows of the table, in their order.
_ORDER: Final = ("accepted", "rejected", "filtered", "rotated", "unread")

#: Checks (and measures) of what a rotation hides, and a filter and a taper before it.
_AS_RECORDED: Final = (
    "stated_peak",
    "clipped_samples",
    "constant_time",
    "opening_share",
    "closing_share",
)


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
        first, then rejected, filtered out, rotated, unread.
    inputs : mapping of str to str
        Names and SHA-256 of the files that gave the records, of their StationXML, and of the
        catalogues.
    """

    accepted: tuple[Accepted, ...]
    rejections: tuple[Rejection, ...]
    entries: tuple[Entry, ...]
    inputs: Mapping[str, str]


@dataclass(frozen=True)
class Intake:
    """How records are processed and checked, and what became of those that have been.

    Parameters
    ----------
    options : IngestOptions
        How records are processed.
    limits : PassportLimits
        Limits of the checks of each record.
    table : Path
        Where the table goes.
    listed : callable, optional
        Called with the rows of the table once it is written.
    filters : Filters
        Which of the accepted records go on.
    accepted, entries : list
        What went through, and a row for everything, so far.
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
        """Give what goes through, one after the other, and note what became of everything."""
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
        """Note what became of a record, and return whether it goes through.

        Raises
        ------
        InputError
            If it does not, and the intake is strict.
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
        """Refuse to go on with nothing, but leave the table.

        Raises
        ------
        InputError
            With the first reason, if nothing went through; that of a filter before others.
        """
        if self.accepted:
            return
        rows = self.publish()
        filtered = [entry for entry in rows if entry.filtered]
        rejected = [entry for entry in rows if entry.reason]
        first = (filtered or rejected)[0]
        more = {
            "more filtered out": len(filtered) - 1 if filtered else 0,
            "rejected" if filtered else "more rejected": len(rejected) - (not filtered),
        }
        counted = ", ".join(f"{count} {what}" for what, count in more.items() if count)
        said = (first.reason or first.note) + (f" ({counted}.)" if counted else "")
        raise InputError(first.file, said, first.line)

    def publish(self) -> tuple[Entry, ...]:
        """Write the table, by status."""
        rows = tuple(sorted(self.entries, key=lambda entry: _ORDER.index(entry.status)))
        # Of one file that is refused, the error says all that a table could.
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
    """Return the row of a record with its passport, and the reason if that rejects it.

    Parameters
    ----------
    record, before : Record
        After processing, and as its archive hands it out.
    limits : PassportLimits
        Limits of the checks.
    components : sequence of Passport
        Of the recorded components that the record is made of, if it is a rotated one: clipping,
        gaps, late trigger and the like are the worst of theirs.
    start : (float, float)
        Velocity and displacement at the first sample [m s-1], [m].
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
    """The passport of a rotated motion, with the damage of the components in it."""
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


def _entry(outcome: Rejection | Unread) -> Entry:
    if isinstance(outcome, Unread):
        return Entry(outcome.file, "", note=outcome.reason)
    return Entry(outcome.file, "", reason=outcome.reason, line=outcome.line)


def _inspected(record: Record, band: BandPass, limits: PassportLimits) -> tuple[Record, Entry]:
    """Return the record after processing, and its row of the table; with a reason: rejected."""
    try:
        if not record.uncorrected:
            return record, checked(_moving(record), record, limits)
        processed, start = _processed(record, band)
        return processed, checked(processed, record, limits, start=start)
    except ParameterError as error:
        return record, Entry(record.source_file, record.record_id, reason=str(error))


def _moving(record: Record) -> Record:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {record.record_id!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )
    return record


def _processed(record: Record, band: BandPass) -> tuple[Record, tuple[float, float]]:
    corrected, start, steps = correct(_moving(record).acceleration, record.time_step, band)
    low, high = band.corners(record.time_step, record.duration)
    return replace(
        record,
        acceleration=corrected,
        # fmax and fmin pass over what the archive does not state.
        filter_low=float(np.fmax(record.filter_low, low)),
        filter_high=float(np.fmin(record.filter_high, high)),
        processing=(*record.processing, *steps),
    ), start
