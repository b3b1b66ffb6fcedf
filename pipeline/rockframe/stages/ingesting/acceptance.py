"""Acceptance of records: processing, checks, filters, and a table row for every input."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from rockframe.components import Channel, motions_of
from rockframe.errors import InputError, ParameterError, RockframeWarning
from rockframe.ingest import Reading
from rockframe.options.ingest import Filters, IngestOptions, PassportLimits
from rockframe.outcome import STATUSES, InputOutcome
from rockframe.record import Record
from rockframe.results.tables.entries import write_entries
from rockframe.signals.corner import UNCHANGED, Corner, CornerSource, choose_corner
from rockframe.signals.passport import Measures, Passport, passport
from rockframe.signals.processing import AsRead, BandPass, correct
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.schema.arrays import Arrays

T = TypeVar("T")

#: A record, if it can be read and processed; the outcome of its input, with its passport; and the
#: samples before the correction, if it was corrected here.
Inspected = tuple[Record | None, InputOutcome, AsRead | None]

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
    trusted : tuple of str
        Contradictions in the file that the user settled.
    passport : Passport
        Results of the checks.
    """

    record_id: str
    source_format: str
    samples: int
    time_step: float
    corrected_here: bool
    processing: tuple[str, ...]
    trusted: tuple[str, ...]
    passport: Passport


@dataclass(frozen=True)
class Ingested:
    """Result of the ingest stage.

    Parameters
    ----------
    accepted : tuple of Accepted
        The accepted records.
    rejections : tuple of InputOutcome
        The rejected records, and the files without a readable record.
    entries : tuple of InputOutcome
        Rows of the table, one for each record or unread file, with the passport if there is one:
        accepted, rejected, filtered out, rotated, unread.
    inputs : mapping of str to str
        Names and SHA-256 of the record files, of their StationXML, and of the catalogues.
    content : Arrays
        What was written, without the samples.
    """

    accepted: tuple[Accepted, ...]
    rejections: tuple[InputOutcome, ...]
    entries: tuple[InputOutcome, ...]
    inputs: Mapping[str, str]
    content: Arrays

    @property
    def dataset(self) -> xr.Dataset:
        """The content as a dataset of xarray."""
        return self.content.dataset()


class Acceptance:
    """The outcomes of the inputs so far, and the accepted records.

    Parameters
    ----------
    table : Path
        Path of the table.
    filters : Filters
        Filters of accepted records.
    strict : bool
        True to raise an error at the first rejection.
    listed : callable, optional
        Called with the rows of the written table.
    factors : mapping of str to float, optional
        Records to accept, by identifier, with the factor on each; by default all, as recorded.
    whole : bool
        False if the inputs are a batch of all: then nothing is required of them together.
    """

    def __init__(
        self,
        table: Path,
        filters: Filters,
        *,
        strict: bool,
        listed: Callable[[Sequence[InputOutcome]], None] | None,
        factors: Mapping[str, float] | None = None,
        whole: bool = True,
    ) -> None:
        self._whole = whole
        self._table = table
        self._filters = filters
        self._strict = strict
        self._listed = listed
        self._factors = factors
        self.accepted: list[Accepted] = []
        self.outcomes: list[InputOutcome] = []

    def passed(
        self, inspected: Iterable[Inspected]
    ) -> Iterator[tuple[Record, Passport | None, AsRead | None]]:
        """Yield the accepted records one at a time, and note the outcome of every input.

        Raises
        ------
        InputError
            If a record or file is rejected and the options are strict, or if none is accepted.
        ParameterError
            If a record of the selection is not accepted.
        """
        for record, outcome, as_read in inspected:
            if self._strict and outcome.status == "rejected":
                raise InputError(outcome.file, outcome.reason, outcome.line)
            noted = outcome if record is None else _filtered(record, outcome, self._filters)
            if record is not None and self._factors is not None:
                record, noted, as_read = _scaled(record, noted, as_read, self._factors)
            self.outcomes.append(noted)
            if record is not None and noted.status == "accepted" and noted.passport is not None:
                self.accepted.append(
                    Accepted(
                        record.record_id,
                        record.source_format,
                        record.acceleration.size,
                        record.time_step,
                        noted.corrected_here,
                        record.processing,
                        record.trusted,
                        noted.passport,
                    )
                )
                yield record, noted.passport, as_read
        if self._whole:
            self._require_some()
            require_selected(self._factors, self.outcomes)

    def _require_some(self) -> None:
        """Raise an error if no record was accepted, after writing the table.

        Raises
        ------
        InputError
            If no record was accepted. The message has the first reason, preferably of a filter.
        """
        if not self.accepted:
            raise nothing_accepted(self.publish())

    def publish(self) -> tuple[InputOutcome, ...]:
        """Write the table, sorted by status, and return its rows."""
        rows = in_order(self.outcomes)
        # For a single rejected file, the error already says everything.
        if self.accepted or len(rows) > 1:
            write_entries(rows, self._table)
        if self._listed is not None:
            self._listed(rows)
        return rows


def in_order(outcomes: Iterable[InputOutcome]) -> tuple[InputOutcome, ...]:
    """Return outcomes in the order of the table: sorted by status."""
    return tuple(sorted(outcomes, key=lambda outcome: STATUSES.index(outcome.status)))


def nothing_accepted(rows: Sequence[InputOutcome]) -> InputError:
    """Return the error of inputs without an accepted record, from the rows of their table.

    The message has the first reason, preferably of a filter.
    """
    first = min(rows, key=lambda row: row.status != "filtered")  # or the first of all
    statuses: list[str] = [row.status for row in rows]
    counted = ", ".join(
        f"{count} {'more ' if status == first.status else ''}{words}"
        for status, words in (("filtered", "filtered out"), ("rejected", "rejected"))
        if (count := statuses.count(status) - (status == first.status)) > 0
    )
    said = first.reason + (f" ({counted}.)" if counted else "")
    return InputError(first.file, said, first.line)


def require_selected(factors: Mapping[str, float] | None, rows: Sequence[InputOutcome]) -> None:
    """Raise an error if a record of the selection was not accepted.

    Raises
    ------
    ParameterError
        If a record is not among the accepted ones of these rows.
    """
    accepted = {row.record_id for row in rows if row.status == "accepted"}
    for name in {*(factors or ())} - accepted:
        reasons = [row.reason for row in rows if row.record_id == name]
        why = f"was not accepted: {reasons[0].rstrip('.')}" if reasons else "is not in the files"
        advice = "Change files and filters, or remove it from the selection."
        raise ParameterError(f"record {name!r} of the selection {why}. {advice}")


@dataclass(frozen=True)
class CornerOf:
    """The lower corner of a record, and the channel, which tells its other horizontal.

    Parameters
    ----------
    channel : Channel
        The channel of the record, with the metadata that the user states.
    upright : bool
        True if the record is vertical.
    own, used : Corner, optional
        The corner that follows from the record alone, and the one that it got; None if it is not
        corrected here.
    """

    channel: Channel
    upright: bool
    own: Corner | None
    used: Corner | None


#: Each input in order: the corner of a record, or None for another input.
Order = list[CornerOf | None]


def inspected(
    readings: Iterable[Reading | InputOutcome],
    options: IngestOptions,
    limits: PassportLimits,
    *,
    stated: Mapping[str, Corner | None] | None = None,
    order: Order | None = None,
) -> Iterator[Inspected]:
    """Yield each record, complete and corrected if necessary, with its passport.

    The records of one motion that follow one another are in memory together, because its two
    horizontals get the same band-pass.

    Parameters
    ----------
    readings : iterable of Reading or InputOutcome
        The output of `collect_sources`.
    options : IngestOptions
        Options of processing.
    limits : PassportLimits
        Limits of the checks.
    stated : mapping of str to Corner, optional
        Corners of records whose other horizontal is in another batch, by identifier.
    order : list, optional
        Each input is appended to it, with the corner of a record.
    """
    order = [] if order is None else order
    for together in _consecutive(
        readings, lambda item: _channel(item) if isinstance(item, Reading) else None
    ):
        records = [reading for reading in together if isinstance(reading, Reading)]
        if not records:
            order.append(None)
            yield from ((None, outcome, None) for outcome in together)  # type: ignore[misc]
            continue
        own = _corners(records, options, limits.signal_to_noise_ratio)
        channels = [_channel(reading) for reading in records]
        upright = [reading.record.orientation.upright for reading in records]
        used = _shared(channels, upright, own)
        for place, reading in enumerate(records):
            corner = (stated or {}).get(reading.facts["record_id"], used[place])
            order.append(CornerOf(channels[place], upright[place], own[place], corner))
            yield _inspected(reading, corner, options.band_pass_hz, limits)


def _consecutive(
    inputs: Iterable[T], channel_of: Callable[[T], Channel | None]
) -> Iterator[list[T]]:
    """Yield records that follow one another and overlap in time together, and other inputs alone.

    Other inputs have no channel.
    """
    together: list[T] = []
    last: Channel | None = None
    for item in inputs:
        channel = channel_of(item)
        if together and not (last and channel and last.overlaps(channel)):
            yield together
            together = []
        together.append(item)
        last = channel
    if together:
        yield together


def _channel(reading: Reading) -> Channel:
    """Return the channel of a record with the metadata that the user states."""
    fields = Channel.of(reading.record)._asdict()
    return Channel(**{name: reading.facts.get(name, value) for name, value in fields.items()})


def _corners(
    together: Sequence[Reading], options: IngestOptions, ratio: float
) -> list[Corner | None]:
    """Return the lower corner for each record by itself; None if it is not corrected here."""
    return [
        _corner(reading.record, options.band_pass_hz, ratio)
        if options.uncorrected or reading.record.uncorrected
        else None
        for reading in together
    ]


def _shared(
    channels: Sequence[Channel], upright: Sequence[bool], corners: list[Corner | None]
) -> list[Corner | None]:
    """Return the corners of records that follow one another.

    The two horizontals of one motion get the higher one of theirs, because their rotations mix
    them.
    """
    for motion in motions_of(channels):
        across = [place for place in motion if not upright[place]]
        both = [corner for corner in (corners[place] for place in across) if corner is not None]
        if len(across) == len(both) == 2:
            higher = max(both, key=lambda corner: corner.frequency)
            corners = [
                higher if place in across else corner for place, corner in enumerate(corners)
            ]
    return corners


def other_corners(order: Order) -> dict[int, Corner | None]:
    """Return the corners that records of several batches get if all are read in one, by their
    places, where they differ from those that they got.

    Parameters
    ----------
    order : list of CornerOf or None
        The inputs of all batches in order.
    """
    others: dict[int, Corner | None] = {}
    for together in _consecutive(
        enumerate(order), lambda item: item[1].channel if item[1] else None
    ):
        records = [record for _, record in together if record is not None]
        corners = _shared(
            [record.channel for record in records],
            [record.upright for record in records],
            [record.own for record in records],
        )
        for (place, _), record, corner in zip(together, records, corners, strict=False):
            if corner != record.used:
                others[place] = corner
    return others


def _corner(record: Record, corners: tuple[float, float] | None, ratio: float) -> Corner:
    if corners is not None:
        return Corner(corners[0], CornerSource.STATED)
    return choose_corner(record.acceleration, record.time_step, ratio)


def checked(
    record: Record,
    before: Record,
    limits: PassportLimits,
    components: Sequence[Passport] = (),
    start: tuple[float, float] = (0.0, 0.0),
    corner: Corner = UNCHANGED,
    measures: Measures | None = None,
) -> InputOutcome:
    """Return the outcome of a record with its passport, and the reason if it is rejected.

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
    corner : Corner
        Lower corner with which this package corrected the record.
    measures : Measures, optional
        Measures of the record, if they are known.
    """
    result = replace(passport(before, record, limits, start, measures), corner=corner)
    if components:
        result = _as_recorded(result, components)
    reasons = " ".join(str(check) for check in result.rejections)
    return InputOutcome(
        record.source_file,
        f"record {record.record_id!r}: {reasons}" if reasons else "",
        status="rejected" if reasons else "accepted",
        record_id=record.record_id,
        passport=result,
        corrected_here=record.uncorrected,
    )


def _as_recorded(passport: Passport, components: Sequence[Passport]) -> Passport:
    """Return the passport of a rotated motion with the faults of its components."""
    worst = {
        name: max(
            components,
            key=lambda component: np.nan_to_num(getattr(component.measures, name), nan=-1.0),
        )
        for name in _AS_RECORDED
    }
    measures = {name: getattr(item.measures, name) for name, item in worst.items()}
    checks = {name: {c.name: c for c in item.checks}[name] for name, item in worst.items()}
    return replace(
        passport,
        measures=replace(passport.measures, **measures),
        checks=tuple(checks.get(c.name, c) for c in passport.checks),
        corner=max(
            (component.corner for component in components), key=lambda corner: corner.source
        ),
    )


def _filtered(record: Record, outcome: InputOutcome, filters: Filters) -> InputOutcome:
    """Return the outcome, with the reason if the record is filtered out."""
    if outcome.status != "accepted" or outcome.passport is None:
        return outcome
    measures = outcome.passport.measures
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
    return replace(outcome, status="filtered", reason=f"{refusal}.") if refusal else outcome


def _scaled(
    record: Record, outcome: InputOutcome, as_read: AsRead | None, factors: Mapping[str, float]
) -> tuple[Record, InputOutcome, AsRead | None]:
    """Return an accepted record times its factor, or the outcome of one that is not selected.

    Its checks remain those of the record as it was recorded.
    """
    if outcome.status != "accepted" or outcome.passport is None:
        return record, outcome, as_read
    if record.record_id not in factors:
        return record, replace(outcome, status="filtered", reason="not in the selection."), as_read
    factor = factors[record.record_id]
    measured = replace(outcome.passport, measures=outcome.passport.measures.scaled(factor))
    unfiltered = None if as_read is None else as_read.scaled(factor)
    return record.scaled(factor), replace(outcome, passport=measured), unfiltered


def _inspected(
    reading: Reading,
    corner: Corner | None,
    corners: tuple[float, float] | None,
    limits: PassportLimits,
) -> Inspected:
    """Return the complete record and its outcome, which has a reason if it is rejected."""
    raw, name = reading.record, reading.facts["record_id"]
    try:
        _require_motion(raw, name)
        if corner is not None:
            changes, start, band = _correction(raw, corner, corners)
            record = reading.completed(uncorrected=True, **changes)
            outcome = checked(record, raw, limits, start=start, corner=corner)
            return record, outcome, AsRead(raw.acceleration, band)
        record = reading.completed()
        return record, checked(record, raw, limits, measures=reading.measures), None
    except ParameterError as error:
        outcome = InputOutcome(reading.facts["source_file"], str(error), record_id=name)
        return None, outcome, None


def _require_motion(record: Record, name: str) -> None:
    if np.ptp(record.acceleration) == 0.0:
        raise ParameterError(
            f"all {record.acceleration.size} samples of {name!r} are "
            f"{record.acceleration[0]:g} m/s2. Must be a record of motion."
        )


def _correction(
    raw: Record, corner: Corner, corners: tuple[float, float] | None
) -> tuple[dict[str, Any], tuple[float, float], BandPass]:
    """Return the fields that correction changes, velocity and displacement at its start, and the
    band in effect.
    """
    band = BandPass(*corners) if corners else BandPass(corner.frequency)
    corrected, start, steps = correct(raw.acceleration, raw.time_step, band)
    low, high = band.corners(raw.time_step, raw.duration)
    if corners and high < band.high:
        words = f"with time step {raw.time_step:g} s are filtered up to {high:g} Hz"
        message = f"band_pass_hz {band.low:g} {band.high:g}: records {words}."
        warnings.warn(message, RockframeWarning, stacklevel=2)
    return (
        {
            "acceleration": corrected,
            # fmax and fmin ignore NaN, for values that the archive does not state.
            "filter_low": float(np.fmax(raw.filter_low, low)),
            "filter_high": float(np.fmin(raw.filter_high, high)),
            "processing": (*raw.processing, str(corner), *steps),
        },
        start,
        BandPass(low, high),
    )
