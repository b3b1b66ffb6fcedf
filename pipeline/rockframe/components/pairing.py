"""Components of one motion: pairs of horizontals, and the samples that they share."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockframe.components.motions import SAME_TIME, Channel, motions_of, reasons_alone
from rockframe.errors import ParameterError, RockframeWarning
from rockframe.outcome import InputOutcome
from rockframe.record import SAME_STEP, Orientation, Record
from rockframe.units import utc_seconds

Float = NDArray[np.float64]

#: Tolerance of the right angle [degree]. Files state whole degrees, so larger deviations are real.
_SQUARE: Final = 0.01
#: Largest share of the energy of a horizontal, the sum of its squared accelerations, outside the
#: samples that both horizontals of a motion have.
_LOST: Final = 0.5
#: The same for a vertical beside a horizontal, and for a cut that a warning states.
_LOST_UNSAID: Final = 0.05
#: Least angle between horizontals that are resolved into two at right angles [degree].
_APART: Final = 5.0
#: Largest difference in length of channels without start times, as a share of the longest. A larger
#: one means that they may not begin together.
_SPARE: Final = 0.05


@dataclass(frozen=True)
class HorizontalPair:
    """The two horizontal components of one motion, and its vertical if there is one.

    Parameters
    ----------
    first, second : Record
        Horizontal components at right angles, sampled at the same times.
    vertical : Record, optional
        Vertical component, sampled at the same times; rotation leaves it unchanged.

    Raises
    ------
    ParameterError
        If time steps, lengths or start times differ, an azimuth is unknown, or the azimuths are not
        90 degrees apart.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> HorizontalPair(east, north).first.record_id
    'e'
    """

    first: Record
    second: Record
    vertical: Record | None = None

    def __post_init__(self) -> None:
        first, other = self.first, self.second
        for partner in (other, self.vertical):
            if partner is not None:
                _require_same_times(first, partner)
        apart = (other.azimuth - first.azimuth) % 180.0
        if not abs(apart - 90.0) <= _SQUARE:
            raise ParameterError(
                f"azimuths {first.azimuth:g} and {other.azimuth:g} degrees of {first.record_id!r} "
                f"and {other.record_id!r}. A pair has two stated azimuths, 90 degrees apart."
            )

    def toward(self, azimuths: Iterable[float], series: Sequence[Float] | None = None) -> Float:
        """Return the motion toward each azimuth, positive in that direction.

        Parameters
        ----------
        azimuths : iterable of float
            Azimuths, clockwise from north [degree].
        series : two arrays, shape (samples,), optional
            Series to rotate instead of the accelerations [m s-2], for example the velocities. Each
            must be a linear function of its component.

        Returns
        -------
        array, shape (azimuths, samples)
        """
        first, other = (
            (self.first.acceleration, self.second.acceleration) if series is None else series
        )
        factors = self.factors(azimuths)
        return np.outer(factors[:, 0], first) + np.outer(factors[:, 1], other)

    def factors(self, azimuths: Iterable[float]) -> Float:
        """Return the factors of both components in the motion toward each azimuth.

        Parameters
        ----------
        azimuths : iterable of float
            Azimuths, clockwise from north [degree].

        Returns
        -------
        array, shape (azimuths, 2)
        """
        toward = np.array(list(azimuths), dtype=np.float64)
        return np.stack(
            [_cosine(toward - self.first.azimuth), _cosine(toward - self.second.azimuth)], axis=1
        )


def pair_horizontals(
    records: Iterable[Record],
) -> tuple[tuple[HorizontalPair, ...], tuple[InputOutcome, ...]]:
    """Return the pairs of horizontal records that are components of one motion.

    Parameters
    ----------
    records : iterable of Record
        Records of any number of stations and events. Two form a pair if they are components of one
        motion (`motions_of`) with the same time step, and their azimuths are 90 degrees apart. They
        are cut to the samples that they share, with the vertical, see `on_common_samples`.

    Returns
    -------
    pairs : tuple of HorizontalPair
        Pairs in the order of their first records, with the vertical of the same motion if there is
        exactly one.
    unpaired : tuple of InputOutcome
        All other records that are not vertical, rejected with the reason.

    Examples
    --------
    >>> from rockframe import bundled_records, read_file
    >>> pairs, unpaired = pair_horizontals(
    ...     read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    ... )
    >>> [(pair.first.component, pair.second.component) for pair in pairs], unpaired
    ([('090', '360')], ())
    """
    pairs: list[HorizontalPair] = []
    unpaired: list[InputOutcome] = []
    given = list(records)
    alone = reasons_alone([Channel.of(record) for record in given])
    for motion in _motions(given):
        horizontals = [r for r in motion if r.orientation is Orientation.HORIZONTAL]
        unpaired += [
            _rejected(r, "direction unstated. Only horizontals of stated azimuth are paired.")
            for r in motion
            if r.orientation is Orientation.UNSTATED
        ]
        try:
            if len(horizontals) == 1:
                raise ParameterError(alone[horizontals[0].record_id])
            if horizontals:
                pairs.append(_pair(horizontals, motion))
        except ParameterError as error:
            unpaired += [_rejected(r, str(error)) for r in horizontals]
    return tuple(pairs), tuple(unpaired)


class BothDirections(NamedTuple):
    """Two horizontal components of one motion at right angles, and its vertical if there is one.

    ``remark`` states how they differ from two recorded components of stated azimuths that are 90
    degrees apart; it is empty if they do not. The azimuths may be unknown.
    """

    first: Record
    second: Record
    vertical: Record | None = None
    remark: str = ""


def both_directions(
    records: Iterable[Record],
) -> tuple[tuple[BothDirections, ...], tuple[InputOutcome, ...]]:
    """Return the motions of which both horizontal directions are recorded.

    Unlike `pair_horizontals`, horizontals that are not at right angles are resolved, and those of
    unknown azimuth are accepted, because the response of a round column depends on neither the
    azimuths nor the sense of a component.

    Parameters
    ----------
    records : iterable of Record
        Records of any number of stations and events. They are grouped and cut as by
        `pair_horizontals`.

    Returns
    -------
    motions : tuple of BothDirections
        In the order of their first records. The first component is as recorded.
    unpaired : tuple of InputOutcome
        All other records that are not vertical, rejected with the reason.

    Examples
    --------
    >>> east, other = (
    ...     Record(record_id=name, station="CCC", acceleration=samples, time_step=0.01,
    ...            azimuth=azimuth, orientation=Orientation.HORIZONTAL)
    ...     for name, samples, azimuth in (("e", [0.0, 3.0], 90.0), ("n", [0.0, 4.0], 30.0))
    ... )
    >>> [motion], unpaired = both_directions([east, other])
    >>> motion.second.acceleration.round(4).tolist(), motion.second.azimuth
    ([0.0, 2.8868], 0.0)
    >>> motion.remark
    "components 60 degrees apart: 'n' resolved at right angles to 'e'"
    """
    motions: list[BothDirections] = []
    unpaired: list[InputOutcome] = []
    given = list(records)
    alone = reasons_alone([Channel.of(record) for record in given])
    for motion in _motions(given):
        level = [record for record in motion if not record.orientation.upright]
        try:
            if len(level) == 1:
                raise ParameterError(alone[level[0].record_id])
            if level:
                first, other, vertical = _together(level, motion)
                crossing, remark = resolved(first, other)
                motions.append(BothDirections(first, crossing, vertical, remark))
        except ParameterError as error:
            unpaired += [_rejected(record, str(error)) for record in level]
    return tuple(motions), tuple(unpaired)


def vertical_beside(records: Iterable[Record]) -> dict[str, Record]:
    """Return the vertical record of the same motion for each record that is not vertical.

    Parameters
    ----------
    records : iterable of Record
        Records of any number of stations and events.

    Returns
    -------
    dict of str to Record
        Vertical records by the identifier of the other record. Each is cut or padded with zeros to
        the times of that record. Records are omitted without exactly one vertical in their motion
        that shares samples with 95 % of the energy of both.

    Examples
    --------
    >>> from rockframe import bundled_records, read_file
    >>> records = read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    >>> [vertical.component for vertical in vertical_beside(records).values()]
    ['UP', 'UP']
    """
    vertical_of: dict[str, Record] = {}
    for motion in _motions(records):
        verticals = [r for r in motion if r.orientation.upright]
        for record in motion:
            beside = [r for r in verticals if _share_samples(record, r)]
            if not record.orientation.upright and len(beside) == 1:
                vertical_of[record.record_id] = _at_times_of(record, beside[0])
    return vertical_of


def resolved(one: Record, other: Record) -> tuple[Record, str]:
    """Return the component of a motion at right angles to a horizontal record.

    Parameters
    ----------
    one, other : Record
        Horizontals of one motion, sampled at the same times.

    Returns
    -------
    record : Record
        The other record, if it is at right angles or an azimuth is unknown; else the component that
        follows from both, positive toward the side of the other record.
    remark : str
        How it differs from a record at a stated right angle; "" if it does not.

    Raises
    ------
    ParameterError
        If the azimuths are within 5 degrees of parallel: the component would be mostly noise.

    Notes
    -----
    With an angle d between them, the other record is cos(d) times the first plus sin(d) times the
    component across it.

    Examples
    --------
    >>> one = Record(record_id="e", acceleration=[0.0, 3.0], time_step=0.01, azimuth=90.0)
    >>> other = replace(one, record_id="n", azimuth=math.nan)
    >>> resolved(one, other)[1]
    "azimuth of 'n' unknown: taken as at right angles"
    """
    lost = [f"{record.record_id!r}" for record in (one, other) if math.isnan(record.azimuth)]
    if lost:
        unknown = f"azimuth{'s' * (len(lost) - 1)} of {' and '.join(lost)} unknown"
        return other, f"{unknown}: taken as at right angles"
    turn = (other.azimuth - one.azimuth + 180.0) % 360.0 - 180.0  # clockwise from the first
    if abs(abs(turn) - 90.0) <= _SQUARE:
        return other, ""
    angle = min(abs(turn), 180.0 - abs(turn))
    if angle < _APART:
        raise ParameterError(
            f"azimuths {one.azimuth:g} and {other.azimuth:g} degrees of {one.record_id!r} and "
            f"{other.record_id!r}, {angle:g} degrees from parallel. Must be at least {_APART:g}."
        )
    cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    across = (other.acceleration - cosine * one.acceleration) / abs(sine)
    words = f"components {abs(turn):g} degrees apart"
    remark = f"{words}: {other.record_id!r} resolved at right angles to {one.record_id!r}"
    component = replace(
        other,
        acceleration=across,
        azimuth=(one.azimuth + math.copysign(90.0, turn)) % 360.0,
        processing=(*other.processing, f"direction: {remark}"),
    )
    return component, remark


def _rejected(record: Record, reason: str) -> InputOutcome:
    return InputOutcome(record.source_file, reason, record_id=record.record_id)


def _motions(records: Iterable[Record]) -> list[list[Record]]:
    given = list(records)
    numbers = motions_of([Channel.of(record) for record in given])
    return [[given[number] for number in motion] for motion in numbers]


def steps_between(record: Record, other: Record) -> int:
    """Return the number of time steps from the first sample of a record to that of another.

    Parameters
    ----------
    record, other : Record
        Records of one time step.

    Raises
    ------
    ParameterError
        If time steps differ by more than 1e-9, if start times differ and one is unknown, or if the
        first samples are not whole time steps apart, within 5 % of a time step.

    Examples
    --------
    >>> one = Record(record_id="e", acceleration=[0.0, 1.0], time_step=0.01,
    ...              start_time="2019-07-06T03:19:40Z")
    >>> steps_between(one, replace(one, start_time="2019-07-06T03:19:45.000001Z"))
    500
    """
    names = f"{record.record_id!r} and {other.record_id!r}"
    if not _same_step(record, other):
        raise ParameterError(
            f"time steps [s] {record.time_step!r} and {other.time_step!r} of {names}. "
            "Must be equal."
        )
    if record.start_time == other.start_time:
        return 0
    # Start times state at most microseconds.
    seconds = round(utc_seconds(other.start_time) - utc_seconds(record.start_time), 6)
    apart = seconds / record.time_step
    if math.isnan(apart):
        raise ParameterError(
            f"start times {record.start_time!r} and {other.start_time!r} of {names}. "
            "Must be equal, "
            "or times in ISO 8601."
        )
    if abs(apart - round(apart)) > SAME_TIME:
        raise ParameterError(
            f"the first samples of {names} are {abs(seconds):g} s apart, "
            f"{abs(apart):g} time steps. Must be whole time steps, within {SAME_TIME:g} of one."
        )
    return round(apart)


def on_common_samples(records: Sequence[Record], lost: float = _LOST) -> tuple[Record, ...]:
    """Return components of one motion, cut to the samples that all of them have.

    Parameters
    ----------
    records : sequence of Record
        At least one record. Their first samples are whole time steps apart, within 5 % of a time
        step; without start times, they are taken to begin together.
    lost : float
        Largest share of the energy of a record, the sum of its squared accelerations, outside the
        common samples [1].

    Returns
    -------
    tuple of Record
        Records of one length and start time, in the order given. Their `processing` states the
        seconds and the share of energy cut off.

    Raises
    ------
    ParameterError
        If time steps differ, if first samples are not whole time steps apart, if more energy is
        lost, or if lengths differ by more than 5 % without start times.

    Examples
    --------
    >>> one = Record(record_id="e", acceleration=[0.0, 1.0, 2.0], time_step=0.5,
    ...              start_time="2019-07-06T03:19:40Z")
    >>> other = Record(record_id="n", acceleration=[3.0, 4.0, 0.0], time_step=0.5,
    ...                start_time="2019-07-06T03:19:40.5Z")
    >>> [record.acceleration.tolist() for record in on_common_samples([one, other])]
    [[1.0, 2.0], [3.0, 4.0]]
    """
    first = records[0]
    starts = [steps_between(first, record) for record in records]
    sizes = [record.acceleration.size for record in records]
    begin, end = max(starts), min(start + size for start, size in zip(starts, sizes, strict=True))
    names = " and ".join(repr(record.record_id) for record in records)
    if not first.start_time and min(sizes) < (1.0 - _SPARE) * max(sizes):
        raise ParameterError(
            f"numbers of samples {min(sizes)} and {max(sizes)} of {names}, without start times. "
            f"Must be equal within {100.0 * _SPARE:g} %."
        )
    for record, start in zip(records, starts, strict=True) if first.start_time else ():
        away = _energy_outside(record, begin - start, end - begin)
        if away > lost or end - begin < 2:
            raise ParameterError(
                f"{100.0 * away:.0f} % of the energy of {record.record_id!r} is outside the "
                f"samples that {names} share. Must be at most {100.0 * lost:g} %."
            )
    time = records[starts.index(begin)].start_time
    return tuple(
        _placed(record, begin - start, end - begin, first, time)
        for record, start in zip(records, starts, strict=True)
    )


def _energy_outside(record: Record, first: int, count: int) -> float:
    """Return the share of the energy of a record outside some of its samples [1]."""
    energy = record.acceleration**2
    total = energy.sum()
    kept = energy[max(first, 0) : max(first + count, 0)].sum()
    return max(float(1.0 - kept / total), 0.0) if total else 0.0


def _share_samples(*records: Record) -> bool:
    """Return whether nearly all of the energy of these records of a motion is in common samples."""
    try:
        on_common_samples(records, _LOST_UNSAID)
    except ParameterError:
        return False
    return True


def pair_with(record: Record, other: Record) -> HorizontalPair:
    """Return a horizontal record and the other horizontal of its motion as a pair.

    The other one is cut or padded with zeros to the times of the record.

    Parameters
    ----------
    record, other : Record
        Two components of one motion.

    Raises
    ------
    ParameterError
        If more than 5 % of the energy of one is outside their common samples, or if they are not
        components of one motion at right angles.

    Examples
    --------
    >>> one = Record(record_id="n", acceleration=[0.0, 1.0], time_step=0.1, azimuth=0.0)
    >>> pair_with(one, replace(one, record_id="e", azimuth=90.0)).second.record_id
    'e'
    """
    on_common_samples([record, other], _LOST_UNSAID)
    return HorizontalPair(record, _at_times_of(record, other))


def placed(series: Float, first: int, count: int) -> Float:
    """Return samples of a series from one index on; zeros where the series has none.

    Examples
    --------
    >>> placed(np.ones(3), 1, 3).tolist(), placed(np.ones(3), -1, 3).tolist()
    ([1.0, 1.0, 0.0], [0.0, 1.0, 1.0])
    """
    samples = np.zeros(count)
    kept = series[max(first, 0) : max(first + count, 0)]
    samples[max(-first, 0) :][: kept.size] = kept
    return samples


def _at_times_of(record: Record, other: Record) -> Record:
    """Return the other record at the sample times of a record."""
    first = -steps_between(record, other)
    return _placed(other, first, record.acceleration.size, record, record.start_time)


def _placed(record: Record, first: int, count: int, beside: Record, time: str) -> Record:
    """Return `placed` samples of a record with their start time and the time step of the record
    beside it, and note it in `processing`.
    """
    size, steps = record.acceleration.size, []
    if first == 0 and time != record.start_time:
        steps.append(f"start: {record.start_time} taken as {time}, as of the motion")
    if first > 0 or first + count < size:
        kept = min(first + count, size) - max(first, 0)
        since = f" from sample {first + 1} on" if first > 0 else ""
        seconds = (size - kept) * record.time_step
        energy = 100.0 * _energy_outside(record, first, count)
        steps.append(
            f"length: cut to {kept} of {size} samples{since}, as of the motion: without "
            f"{seconds:g} s and {energy:.2g} % of the energy"
        )
    if first < 0 or first + count > size:
        until = f", {-first} of them before the first" if first < 0 else ""
        steps.append(f"length: continued with zeros to {count} samples{until}, as of the motion")
    if not steps and record.time_step == beside.time_step:
        return record
    return replace(
        record,
        time_step=beside.time_step,
        acceleration=placed(record.acceleration, first, count),
        start_time=time,
        processing=(*record.processing, *steps),
    )


def _pair(records: list[Record], motion: list[Record]) -> HorizontalPair:
    """Return the pair of a motion, or raise a ParameterError with the reason why there is none."""
    return HorizontalPair(*_together(records, motion))


def _together(records: list[Record], motion: list[Record]) -> tuple[Record, Record, Record | None]:
    """Return two horizontals and the vertical of a motion, if it has one, at common samples.

    Raises
    ------
    ParameterError
        If there are more than two horizontals, or they have too few samples in common.
    """
    if len(records) > 2:
        names = ", ".join(record.record_id for record in records)
        raise ParameterError(
            f"{len(records)} horizontals of station {records[0].station!r}: {names}. "
            "A pair has two."
        )
    verticals = [r for r in motion if r.orientation.upright]
    first, other = on_common_samples(records)
    _warn_of_cut(records, first)
    vertical: list[Record] = []
    if len(verticals) == 1 and _share_samples(first, other, verticals[0]):
        # the vertical must not cost the pair
        first, other, *vertical = on_common_samples([*records, *verticals], 1.0)
    return first, other, vertical[0] if vertical else None


def _warn_of_cut(records: Sequence[Record], cut: Record) -> None:
    """Warn if a pair is without much of the energy of its records."""
    for record in records:
        first, count = steps_between(record, cut), cut.acceleration.size
        lost = _energy_outside(record, first, count)
        if lost > _LOST_UNSAID:
            seconds = (record.acceleration.size - count) * record.time_step
            names = " and ".join(repr(record.record_id) for record in records)
            warnings.warn(
                f"the pair of {names} is without {seconds:g} s and {100.0 * lost:.0f} % of the "
                f"energy of {record.record_id!r}, which are outside their common samples.",
                RockframeWarning,
                stacklevel=5,
            )


def _same_step(record: Record, other: Record) -> bool:
    return math.isclose(record.time_step, other.time_step, rel_tol=SAME_STEP)


def _require_same_times(record: Record, other: Record) -> None:
    here, there = record.acceleration.size, other.acceleration.size
    for quantity, value, another, same in (
        ("start times", record.start_time, other.start_time, record.start_time == other.start_time),
        ("time steps [s]", record.time_step, other.time_step, _same_step(record, other)),
        ("numbers of samples", here, there, here == there),
    ):
        if not same:
            raise ParameterError(
                f"{quantity} {value!r} and {another!r} of {record.record_id!r} and "
                f"{other.record_id!r}"
                ". Must be equal."
            )


def _cosine(degrees: Float) -> Float:
    """Return the cosine, exactly zero at right angles so that components do not mix."""
    turned = np.mod(degrees, 360.0)
    cosine: Float = np.cos(np.radians(turned))
    cosine[(turned == 90.0) | (turned == 270.0)] = 0.0
    return cosine
