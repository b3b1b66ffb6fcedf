"""Components of one motion: which records they are, and the samples that they share."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.outcome import InputOutcome
from rockframe.record import Orientation, Part, Record
from rockframe.units import utc_seconds

Float = NDArray[np.float64]

#: Tolerance of the right angle [degree]. Files state whole degrees, so larger deviations are real.
_SQUARE: Final = 0.01
#: Largest time between samples that count as simultaneous, as a share of the time step. It turns
#: the phase by 2 degrees at a tenth of the sampling rate.
_SAME_TIME: Final = 0.05
#: Largest share of a record's energy, the sum of its squared accelerations, outside the samples
#: that the components of a motion share.
_LOST: Final = 0.05
#: Largest difference in length of channels without start times, as a share of the longest. A larger
#: one means that they may not begin together.
_SPARE: Final = 0.05
#: Least share of the shorter of two records that lies within the other if they are of one motion.
_OVERLAP: Final = 0.5


class Channel(NamedTuple):
    """Metadata of a record from which `motions_of` finds the other components of its motion.

    ``samples`` is the number of samples; the other fields are those of `Record`.
    """

    event: str
    network: str
    station: str
    start_time: str
    source_format: str
    record_id: str
    orientation: Orientation
    time_step: float
    samples: int

    @classmethod
    def of(cls, record: Record) -> Self:
        """Return the metadata of a record."""
        names = (name for name in cls._fields if name != "samples")
        known = {name: getattr(record, name) for name in names}
        return cls(**known, samples=record.acceleration.size)

    @property
    def place(self) -> Hashable:
        """Event, station and format; a record without a station has a place of its own."""
        # The format is included because a raw and a corrected file of one record are two motions.
        alone = "" if self.station else self.record_id
        return self.event, self.network, self.station, self.source_format, alone

    @property
    def span(self) -> tuple[float, float]:
        """Times of the first and last sample [s]; NaN without a start time."""
        start = utc_seconds(self.start_time)
        return start, start + self.time_step * (self.samples - 1)

    def overlaps(self, other: Channel) -> bool:
        """Return whether both begin at one time, or at least half of the shorter is within the
        other.
        """
        if self.place != other.place:
            return False
        if self.start_time == other.start_time:
            return True
        (start, end), (begin, finish) = self.span, other.span
        if math.isnan(start) or math.isnan(begin):
            return False
        shorter = min(end - start, finish - begin)
        return min(end, finish) - max(start, begin) >= _OVERLAP * shorter


def motions_of(channels: Sequence[Channel]) -> list[list[int]]:
    """Return the numbers of the channels of each motion, in order of the first channels.

    Channels of one event, station and format are of one motion if they have the same start time.
    Those that overlap in time are too, if together they are no more than the two horizontals and
    the vertical of one instrument.

    Parameters
    ----------
    channels : sequence of Channel
        Channels of any number of stations and events.

    Examples
    --------
    >>> east = Channel("", "CE", "89146", "2019-07-06T03:19:40Z", "miniseed", "e",
    ...                Orientation.HORIZONTAL, 0.01, 9000)
    >>> north = east._replace(record_id="n", start_time="2019-07-06T03:19:45Z")
    >>> later = east._replace(record_id="l", start_time="2019-07-06T09:00:00Z")
    >>> motions_of([east, later, north])
    [[0, 2], [1]]
    """
    together: defaultdict[Hashable, list[int]] = defaultdict(list)
    for number, channel in enumerate(channels):
        together[channel.place, channel.start_time].append(number)
    places: defaultdict[Hashable, list[list[int]]] = defaultdict(list)
    for numbers in together.values():
        places[channels[numbers[0]].place].append(numbers)
    motions = [motion for groups in places.values() for motion in _merged(channels, groups)]
    return sorted(sorted(numbers) for numbers in motions)


def _merged(channels: Sequence[Channel], groups: Sequence[list[int]]) -> Iterator[list[int]]:
    """Yield groups of one start time, merged with those that they overlap if one instrument can
    have recorded them.
    """

    def order(numbers: list[int]) -> tuple[bool, float]:
        start, _ = channels[numbers[0]].span
        return math.isnan(start), start

    chained: list[list[list[int]]] = []
    last = channels[0]
    for numbers in sorted(groups, key=order):
        longest = max((channels[number] for number in numbers), key=lambda one: one.span[1])
        if chained and last.overlaps(longest):
            chained[-1].append(numbers)
            last = max(last, longest, key=lambda one: one.span[1])
        else:
            chained.append([numbers])
            last = longest
    for chain in chained:
        every = [number for numbers in chain for number in numbers]
        vertical = sum(channels[number].orientation.upright for number in every)
        if vertical <= 1 and len(every) - vertical <= 2:
            yield every
        else:  # several instruments, or windows of several shocks
            yield from chain


def recordings_of_channels(
    channels: Sequence[Channel], parts: Mapping[str, Sequence[Part]]
) -> list[tuple[str, ...]]:
    """Return the recording of each channel: a key that records which are not independent share.

    Components of one motion share it, whatever their format, and so do a sequence and all the
    motions that it consists of.

    Parameters
    ----------
    channels : sequence of Channel
        Channels of any number of stations and events.
    parts : mapping of str to sequence of Part
        Motions of each sequence, by its identifier.

    Examples
    --------
    >>> main = Channel("", "", "", "", "", "main", Orientation.HORIZONTAL, 0.01, 9000)
    >>> after, both = main._replace(record_id="after"), main._replace(record_id="both")
    >>> joined = {"both": (Part("main", 0.0, 90.0), Part("after", 210.0, 300.0))}
    >>> len(set(recordings_of_channels([main, after, both], joined)))
    1
    """
    named: dict[str, tuple[str, ...]] = {}
    for numbers in motions_of([channel._replace(source_format="") for channel in channels]):
        first = channels[numbers[0]]
        alone = "" if first.station else first.record_id
        key = (first.event, first.network, first.station, first.start_time, alone)
        named |= {channels[number].record_id: key for number in numbers}
    for name, motions in parts.items():
        # A part that is not among the channels is known by its name alone.
        joined = [named.get(part.record_id, (part.record_id,)) for part in motions]
        named |= {part.record_id: joined[0] for part in motions}
        shared = {*joined}
        named |= {one: joined[0] for one, key in named.items() if key in shared}
        named[name] = joined[0]
    return [named[channel.record_id] for channel in channels]


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
        one, other = self.first, self.second
        for partner in (other, self.vertical):
            if partner is not None:
                _require_same_times(one, partner)
        apart = (other.azimuth - one.azimuth) % 180.0
        if not abs(apart - 90.0) <= _SQUARE:
            raise ParameterError(
                f"azimuths {one.azimuth:g} and {other.azimuth:g} degrees of {one.record_id!r} and "
                f"{other.record_id!r}. A pair has two stated azimuths, 90 degrees apart."
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
        one, other = (
            (self.first.acceleration, self.second.acceleration) if series is None else series
        )
        toward = np.array(list(azimuths), dtype=np.float64)
        return np.outer(_cosine(toward - self.first.azimuth), one) + np.outer(
            _cosine(toward - self.second.azimuth), other
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
    for motion in _motions(records):
        known = [r for r in motion if r.orientation is Orientation.HORIZONTAL]
        unpaired += [
            _rejected(r, "direction unstated. Only horizontals of stated azimuth are paired.")
            for r in motion
            if r.orientation is Orientation.UNSTATED
        ]
        try:
            if known:
                pairs.append(_pair(known, motion))
        except ParameterError as error:
            unpaired += [_rejected(r, str(error)) for r in known]
    return tuple(pairs), tuple(unpaired)


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
        the times of that record. Records without exactly one vertical in their motion that
        satisfies the limits of `on_common_samples` are omitted.

    Examples
    --------
    >>> from rockframe import bundled_records, read_file
    >>> records = read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    >>> [vertical.component for vertical in vertical_beside(records).values()]
    ['UP', 'UP']
    """
    found: dict[str, Record] = {}
    for motion in _motions(records):
        verticals = [r for r in motion if r.orientation.upright]
        for record in motion:
            beside = [r for r in verticals if _share_samples(record, r)]
            if not record.orientation.upright and len(beside) == 1:
                found[record.record_id] = _at_times_of(record, beside[0])
    return found


def _rejected(record: Record, reason: str) -> InputOutcome:
    return InputOutcome(record.source_file, reason, record_id=record.record_id)


def _motions(records: Iterable[Record]) -> list[list[Record]]:
    given = list(records)
    numbers = motions_of([Channel.of(record) for record in given])
    return [[given[number] for number in motion] for motion in numbers]


def steps_between(one: Record, other: Record) -> int:
    """Return the number of time steps from the first sample of a record to that of another.

    Parameters
    ----------
    one, other : Record
        Records of one time step.

    Raises
    ------
    ParameterError
        If time steps differ, if start times differ and one is unknown, or if the first samples are
        not whole time steps apart, within 5 % of a time step.

    Examples
    --------
    >>> one = Record(record_id="e", acceleration=[0.0, 1.0], time_step=0.01,
    ...              start_time="2019-07-06T03:19:40Z")
    >>> steps_between(one, replace(one, start_time="2019-07-06T03:19:45.000001Z"))
    500
    """
    names = f"{one.record_id!r} and {other.record_id!r}"
    if one.time_step != other.time_step:
        raise ParameterError(
            f"time steps [s] {one.time_step!r} and {other.time_step!r} of {names}. Must be equal."
        )
    if one.start_time == other.start_time:
        return 0
    # Start times state at most microseconds.
    seconds = round(utc_seconds(other.start_time) - utc_seconds(one.start_time), 6)
    apart = seconds / one.time_step
    if math.isnan(apart):
        raise ParameterError(
            f"start times {one.start_time!r} and {other.start_time!r} of {names}. Must be equal, "
            "or times in ISO 8601."
        )
    if abs(apart - round(apart)) > _SAME_TIME:
        raise ParameterError(
            f"the first samples of {names} are {abs(seconds):g} s apart, "
            f"{abs(apart):g} time steps. Must be whole time steps, within {_SAME_TIME:g} of one."
        )
    return round(apart)


def on_common_samples(records: Sequence[Record]) -> tuple[Record, ...]:
    """Return components of one motion, cut to the samples that all of them have.

    Parameters
    ----------
    records : sequence of Record
        At least one record. Their first samples are whole time steps apart, within 5 % of a time
        step; without start times, they are taken to begin together.

    Returns
    -------
    tuple of Record
        Records of one length and start time, in the order given.

    Raises
    ------
    ParameterError
        If time steps differ, if first samples are not whole time steps apart, if more than 5 % of
        the energy of a record (the sum of its squared accelerations) is outside the common samples,
        or if lengths differ by more than 5 % without start times.

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
        energy = record.acceleration**2
        kept, total = energy[begin - start : max(end, begin) - start].sum(), energy.sum()
        if total - kept > _LOST * total or end - begin < 2:
            lost = 100.0 * (1.0 - kept / total) if total else 100.0
            raise ParameterError(
                f"{lost:.0f} % of the energy of {record.record_id!r} is outside the samples that "
                f"{names} share. Must be at most {100.0 * _LOST:g} %."
            )
    time = records[starts.index(begin)].start_time
    return tuple(
        _placed(record, begin - start, end - begin, time)
        for record, start in zip(records, starts, strict=True)
    )


def _share_samples(one: Record, other: Record) -> bool:
    """Return whether two records of a motion satisfy `on_common_samples`."""
    try:
        on_common_samples([one, other])
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
        If they do not satisfy `on_common_samples`, or are not at right angles.

    Examples
    --------
    >>> one = Record(record_id="n", acceleration=[0.0, 1.0], time_step=0.1, azimuth=0.0)
    >>> pair_with(one, replace(one, record_id="e", azimuth=90.0)).second.record_id
    'e'
    """
    on_common_samples([record, other])
    return HorizontalPair(record, _at_times_of(record, other))


def placed(series: Float, first: int, count: int) -> Float:
    """Return samples of a series from one index on; zeros where the series has none.

    Examples
    --------
    >>> placed(np.ones(3), 1, 3).tolist(), placed(np.ones(3), -1, 3).tolist()
    ([1.0, 1.0, 0.0], [0.0, 1.0, 1.0])
    """
    found = np.zeros(count)
    kept = series[max(first, 0) : max(first + count, 0)]
    found[max(-first, 0) :][: kept.size] = kept
    return found


def _at_times_of(record: Record, other: Record) -> Record:
    """Return the other record at the sample times of a record."""
    first = -steps_between(record, other)
    return _placed(other, first, record.acceleration.size, record.start_time)


def _placed(record: Record, first: int, count: int, time: str) -> Record:
    """Return `placed` samples of a record with their start time, and note it in `processing`."""
    size, steps = record.acceleration.size, []
    if first == 0 and time != record.start_time:
        steps.append(f"start: {record.start_time} taken as {time}, as of the motion")
    if first > 0 or first + count < size:
        kept = min(first + count, size) - max(first, 0)
        since = f" from sample {first + 1} on" if first > 0 else ""
        steps.append(f"length: cut to {kept} of {size} samples{since}, as of the motion")
    if first < 0 or first + count > size:
        until = f", {-first} of them before the first" if first < 0 else ""
        steps.append(f"length: continued with zeros to {count} samples{until}, as of the motion")
    if not steps:
        return record
    return replace(
        record,
        acceleration=placed(record.acceleration, first, count),
        start_time=time,
        processing=(*record.processing, *steps),
    )


def _pair(known: list[Record], motion: list[Record]) -> HorizontalPair:
    """Return the pair of a motion, or raise a ParameterError with the reason why there is none."""
    names = ", ".join(record.record_id for record in known)
    where = f"of station {known[0].station!r}" if known[0].station else "without a stated station"
    if len(known) == 1:
        raise ParameterError(
            f"{names} is the only horizontal {where} with this event at this time."
        )
    if len(known) > 2:
        raise ParameterError(f"{len(known)} horizontals {where}: {names}. A pair has two.")
    verticals = [r for r in motion if r.orientation.upright]
    beside = verticals if len(verticals) == 1 and _share_samples(known[0], verticals[0]) else []
    try:
        one, other, *vertical = on_common_samples([*known, *beside])
    except ParameterError:  # the vertical must not cost the pair
        one, other, *vertical = on_common_samples(known)
    return HorizontalPair(one, other, vertical[0] if vertical else None)


def _sampling(record: Record) -> tuple[str, float, int]:
    """Return start time, time step [s] and number of samples of a record."""
    return record.start_time, record.time_step, record.acceleration.size


def _require_same_times(one: Record, other: Record) -> None:
    for what, here, there in zip(
        ("start times", "time steps [s]", "numbers of samples"),
        _sampling(one),
        _sampling(other),
        strict=True,
    ):
        if here != there:
            raise ParameterError(
                f"{what} {here!r} and {there!r} of {one.record_id!r} and {other.record_id!r}. "
                "Must be equal."
            )


def _cosine(degrees: Float) -> Float:
    """Return the cosine, exactly zero at right angles so that components do not mix."""
    turned = np.mod(degrees, 360.0)
    cosine: Float = np.cos(np.radians(turned))
    cosine[(turned == 90.0) | (turned == 270.0)] = 0.0
    return cosine
