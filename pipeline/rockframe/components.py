"""Horizontal components of a motion: pairing, rotation, and measures over all azimuths."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.outcome import InputOutcome
from rockframe.record import LONGEST_ID, Orientation, Record, within_length
from rockframe.signals.measures import oscillator_peak, oscillator_response

Float = NDArray[np.float64]

#: Tolerance of the right angle [degree]. Files state whole degrees, so larger deviations are real.
_SQUARE: Final = 0.01
#: Largest difference in length of channels of one motion, as a share of the longest. They are cut
#: or padded with zeros to one length; a larger difference means that they do not belong together.
_SPARE: Final = 0.05

#: Fields of a record that identify its motion, as `motion_key` takes them.
MOTION_FIELDS: Final = ("event", "network", "station", "start_time", "source_format", "record_id")


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
        Records of any number of stations and events. Two form a pair if they have the same event,
        station, network, start time, format and time step, and their azimuths are 90 degrees apart.
        Channels whose lengths differ by at most 5 %, including the vertical, are cut to the
        shortest.

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
        the length of that record, by at most 5 %. Records without exactly one vertical of the same
        event, station, network, start time, format and time step are omitted.

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
            beside = [r for r in verticals if _fits(r, record)]
            if not record.orientation.upright and len(beside) == 1:
                found[record.record_id] = _of_length(beside[0], record.acceleration.size)
    return found


def motion_key(
    event: str, network: str, station: str, start_time: str, source_format: str, record_id: str
) -> Hashable:
    """Return the key of a motion from the `MOTION_FIELDS` of one of its records.

    Examples
    --------
    >>> along, across = (("", "CE", "89146", "", "cosmos-v1", name) for name in ("90", "360"))
    >>> motion_key(*along) == motion_key(*across)
    True
    """
    # A record without a station has a key of its own: it cannot be matched. The format is part of
    # the key because a raw and a corrected file of one record are two motions.
    return event, network, station, start_time, source_format, "" if station else record_id


def _rejected(record: Record, reason: str) -> InputOutcome:
    return InputOutcome(record.source_file, reason, record_id=record.record_id)


def _motions(records: Iterable[Record]) -> list[list[Record]]:
    motions: defaultdict[Hashable, list[Record]] = defaultdict(list)
    for record in records:
        motions[motion_key(*(getattr(record, name) for name in MOTION_FIELDS))].append(record)
    return list(motions.values())


def _fits(one: Record, other: Record) -> bool:
    """Return whether time steps are equal and lengths within 5 % of each other."""
    sizes = one.acceleration.size, other.acceleration.size
    return one.time_step == other.time_step and min(sizes) >= (1.0 - _SPARE) * max(sizes)


def pair_with(record: Record, other: Record) -> HorizontalPair | None:
    """Return a horizontal record and the other horizontal of its motion as a pair.

    The other one is cut or padded with zeros to the length of the record, by at most 5 %.

    Parameters
    ----------
    record, other : Record
        Two components of one motion.

    Returns
    -------
    HorizontalPair or None
        None if they are not sampled at the same times, or not at right angles.

    Examples
    --------
    >>> one = Record(record_id="n", acceleration=[0.0, 1.0], time_step=0.1, azimuth=0.0)
    >>> pair_with(one, replace(one, record_id="e", azimuth=90.0)).second.record_id
    'e'
    """
    if not _fits(record, other):
        return None
    try:
        return HorizontalPair(record, _of_length(other, record.acceleration.size))
    except ParameterError:
        return None


def fitted(series: Float, count: int) -> Float:
    """Return a series cut, or padded with zeros, to a number of samples.

    Examples
    --------
    >>> fitted(np.ones(2), 3).tolist(), fitted(np.ones(2), 1).tolist()
    ([1.0, 1.0, 0.0], [1.0])
    """
    return np.concatenate([series[:count], np.zeros(max(count - series.size, 0))])


def _of_length(record: Record, count: int) -> Record:
    """Cut a record or pad it with zeros to a length, and note it in `processing`."""
    size = record.acceleration.size
    if size == count:
        return record
    what = f"cut to {count} of {size}" if size > count else f"continued with zeros to {count}"
    return replace(
        record,
        acceleration=fitted(record.acceleration, count),
        processing=(*record.processing, f"length: {what} samples, as of the motion"),
    )


def _pair(known: list[Record], motion: list[Record]) -> HorizontalPair:
    """Return the pair of a motion, or raise a ParameterError with the reason why there is none."""
    names = ", ".join(record.record_id for record in known)
    where = f"of station {known[0].station!r}" if known[0].station else "without a stated station"
    if len(known) == 1:
        raise ParameterError(
            f"{names} is the only horizontal {where} with this event and start time."
        )
    if len(known) > 2:
        raise ParameterError(f"{len(known)} horizontals {where}: {names}. A pair has two.")
    if not _fits(*known):
        return HorizontalPair(*known)  # raises an error that states the difference
    verticals = [r for r in motion if r.orientation.upright]
    beside = verticals if len(verticals) == 1 and _fits(verticals[0], known[0]) else []
    count = min(record.acceleration.size for record in (*known, *beside))
    one, other, *vertical = (_of_length(record, count) for record in (*known, *beside))
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


def rotate(pair: HorizontalPair, azimuth: float) -> Record:
    """Return the component of a motion toward an azimuth.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    azimuth : float
        Direction of positive acceleration, clockwise from north [degree]; 450 is the same as 90.

    Returns
    -------
    Record
        The rotated component with the metadata of both.

    Raises
    ------
    ParameterError
        If the azimuth is not finite.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> southeast = rotate(HorizontalPair(east, north), 135.0)
    >>> southeast.record_id, southeast.acceleration.round(3).tolist()
    ('e-rotated-135', [-0.707, -0.707])
    """
    if not np.isfinite(azimuth):
        raise ParameterError(f"Invalid azimuth {azimuth!r} degrees. Must be finite.")
    azimuth %= 360.0
    one, other = pair.first, pair.second
    end = f"-rotated-{azimuth:g}"
    step = (
        f"rotation: toward azimuth {azimuth:g} degrees, from {one.record_id} "
        f"({one.azimuth:g}) and {other.record_id} ({other.azimuth:g})"
    )
    same_file = one.source_sha256 == other.source_sha256
    return replace(
        one,
        record_id=within_length(one.record_id, LONGEST_ID - len(end)) + end,
        acceleration=pair.toward([azimuth])[0],
        component=f"{azimuth:g}",
        orientation=Orientation.HORIZONTAL,
        azimuth=azimuth,
        uncorrected=one.uncorrected or other.uncorrected,
        peak_ratio=math.nan,
        filter_low=float(np.fmax(one.filter_low, other.filter_low)),
        filter_high=float(np.fmin(one.filter_high, other.filter_high)),
        source_file=one.source_file if same_file else f"{one.source_file} {other.source_file}",
        source_sha256=one.source_sha256 if same_file else "",
        processing=(*one.processing, step),
        trusted=tuple(dict.fromkeys((*one.trusted, *other.trusted))),
    )


def fault_components(pair: HorizontalPair, strike: float) -> tuple[Record, Record]:
    """Return the components normal and parallel to a fault.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    strike : float
        Azimuth of the fault, clockwise from north [degree].

    Returns
    -------
    normal, parallel : Record
        Components that are positive toward strike + 90 degrees, and toward the strike.

    Raises
    ------
    ParameterError
        If the strike is not finite.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [4.0, 1.0], 0.0))
    ... )
    >>> normal, parallel = fault_components(HorizontalPair(east, north), strike=320.0)
    >>> normal.azimuth, parallel.azimuth
    (50.0, 320.0)
    """
    return rotate(pair, (strike + 90.0) % 360.0), rotate(pair, strike)


#: Default azimuths [degree]; from 180 degrees on, the motion only changes sign.
HALF_TURN: Final = tuple(float(azimuth) for azimuth in range(180))
#: Number of azimuths that are rotated at a time, to limit memory.
_TOGETHER: Final = 16


@dataclass(frozen=True)
class Sweep:
    """Values of a measure at each azimuth.

    Parameters
    ----------
    azimuths : array, shape (azimuths,)
        Azimuths, clockwise from north [degree].
    values : array, shape (azimuths,)
        Values of the measure, in the unit of the measure.

    Examples
    --------
    >>> sweep = Sweep(np.array([0.0, 60.0, 120.0]), np.array([1.0, 2.0, 5.0]))
    >>> sweep.percentile(50), sweep.strongest_azimuth
    (2.0, 120.0)
    """

    azimuths: Float
    values: Float = field(repr=False)

    def percentile(self, share: float) -> float:
        """Return RotDnn of the measure: 0 is the minimum, 50 the median, 100 the maximum."""
        return float(np.percentile(self.values, share))

    @property
    def strongest_azimuth(self) -> float:
        """Azimuth of the largest value [degree]."""
        return float(self.azimuths[self.values.argmax()])


def rotd(
    pair: HorizontalPair,
    *,
    transform: Callable[[Float, float], Float] | None = None,
    measure: Callable[[Float], float] | None = None,
    azimuths: Sequence[float] = HALF_TURN,
) -> Sweep:
    """Return a measure of the motion at each azimuth; its percentiles are RotD00, RotD50, RotD100.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    transform : callable, optional
        Linear function of a component and its time step, evaluated once for each component. An
        example is `integrate` of `rockframe.signals.processing`, for PGV. The default is the
        acceleration itself.
    measure : callable, optional
        Function that returns the measure of the motion toward an azimuth, shape (samples,). The
        default is the largest absolute value. If the measure depends on the sign of the motion,
        pass azimuths over 360 degrees.
    azimuths : sequence of float
        Azimuths, clockwise from north [degree]; by default 0 to 179.

    Raises
    ------
    ParameterError
        If there are no azimuths.

    References
    ----------
    Boore (2010), Orientation-independent, nongeometric-mean measures of seismic intensity from two
    horizontal components of motion, BSSA 100(4).

    Examples
    --------
    >>> from rockframe import Record
    >>> east, north = (
    ...     Record(record_id=name, acceleration=samples, time_step=0.01, azimuth=azimuth)
    ...     for name, samples, azimuth in (("e", [3.0, 0.0], 90.0), ("n", [3.0, 0.0], 0.0))
    ... )
    >>> sweep = rotd(HorizontalPair(east, north))
    >>> print(f"{sweep.percentile(100):.3f} m/s2 toward {sweep.strongest_azimuth:g} degrees")
    4.243 m/s2 toward 45 degrees
    """
    if not len(azimuths):
        raise ParameterError("no azimuth to sweep. State at least one.")
    toward = np.array(azimuths, dtype=np.float64)
    components = [
        record.acceleration
        if transform is None
        else transform(record.acceleration, record.time_step)
        for record in (pair.first, pair.second)
    ]
    values: list[float] = []
    for start in range(0, toward.size, _TOGETHER):
        rotated = pair.toward(toward[start : start + _TOGETHER], components)
        if measure is None:
            values += np.abs(rotated).max(axis=1).tolist()
        else:
            values += [measure(series) for series in rotated]
    return Sweep(toward, np.array(values))


def rotd_spectral_acceleration(
    pair: HorizontalPair, period: float, *, damping: float = 0.05
) -> Sweep:
    """Return the pseudo-spectral acceleration at each azimuth [m s-2], from 0 to 179 degrees.

    Toward the azimuth of a component it is that of `spectral_acceleration`.

    Parameters
    ----------
    pair : HorizontalPair
        The two recorded components.
    period : float
        Period of the oscillator [s].
    damping : float
        Share of critical damping [1].

    Raises
    ------
    ParameterError
        Unless period and damping are positive and finite, and the damping is below 1.

    Examples
    --------
    >>> east, north = (
    ...     Record(record_id=name, acceleration=[0.0, 3.0, 0.0], time_step=0.01, azimuth=azimuth)
    ...     for name, azimuth in (("e", 90.0), ("n", 0.0))
    ... )
    >>> sweep = rotd_spectral_acceleration(HorizontalPair(east, north), 1.0)
    >>> print(f"{sweep.percentile(100):.3f} m/s2 toward {sweep.strongest_azimuth:g} degrees")
    0.247 m/s2 toward 45 degrees
    """
    response = partial(oscillator_response, period=period, damping=damping)
    return rotd(pair, transform=response, measure=oscillator_peak)
