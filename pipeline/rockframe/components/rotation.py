"""Rotation of two horizontal components, and measures over all azimuths."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.components.pairing import HorizontalPair
from rockframe.errors import ParameterError
from rockframe.record import LONGEST_ID, Orientation, Record, within_length
from rockframe.signals.measures import spectral_acceleration_toward
from rockframe.signals.processing import peak

Float = NDArray[np.float64]


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
    first, other = pair.first, pair.second
    end = f"-rotated-{azimuth:g}"
    step = (
        f"rotation: toward azimuth {azimuth:g} degrees, from {first.record_id} "
        f"({first.azimuth:g}) and {other.record_id} ({other.azimuth:g})"
    )
    same_file = first.source_sha256 == other.source_sha256
    return replace(
        first,
        record_id=within_length(first.record_id, LONGEST_ID - len(end)) + end,
        acceleration=pair.toward([azimuth])[0],
        component=f"{azimuth:g}",
        orientation=Orientation.HORIZONTAL,
        azimuth=azimuth,
        uncorrected=first.uncorrected or other.uncorrected,
        peak_ratio=math.nan,
        filter_low=float(np.fmax(first.filter_low, other.filter_low)),
        filter_high=float(np.fmin(first.filter_high, other.filter_high)),
        source_file=first.source_file if same_file else f"{first.source_file} {other.source_file}",
        source_sha256=first.source_sha256 if same_file else "",
        processing=(*first.processing, step),
        trusted=tuple(dict.fromkeys((*first.trusted, *other.trusted))),
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
#: Number of directions whose peaks are computed first.
_FEW: Final = 12


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
    if measure is None:
        components, measure = _strong(components, pair.factors(toward)), peak
    values = [
        measure(series)
        for start in range(0, toward.size, _TOGETHER)
        for series in pair.toward(toward[start : start + _TOGETHER], components)
    ]
    return Sweep(toward, np.array(values))


def _strong(components: Sequence[Float], factors: Float) -> list[Float]:
    """Return the samples of two components that can be the largest toward any direction.

    A sample cannot if it is smaller than the least of the peaks over directions. That is at least
    the least over all directions of the largest of a few samples: those largest toward some.
    """
    few = factors[:: max(1, len(factors) // _FEW)]
    both = np.array(components)
    furthest = both[:, np.abs(few @ both).argmax(axis=1)]
    least = np.abs(factors @ furthest).max(axis=1).min()
    size = np.hypot(*both) * np.hypot(*factors.T).max()
    kept = ~(size < (1.0 - 1e-9) * least)  # true of NaN
    return [series[kept] for series in both]


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
    toward = np.array(HALF_TURN)
    components = [pair.first.acceleration, pair.second.acceleration]
    values = spectral_acceleration_toward(
        components, pair.first.time_step, period, pair.factors(toward), damping=damping
    )
    return Sweep(toward, values)
