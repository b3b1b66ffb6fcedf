"""Intensity measures, response spectrum, and indicators of clipping, gaps and late triggers."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.signals.loops import (
    AFTER,
    BEFORE,
    DISPLACEMENT,
    FREE,
    LANES,
    LARGEST,
    PHASE,
    ROWS,
    largest_displacements,
    largest_toward,
    orbit_of_oscillator,
    through_oscillator,
)
from rockframe.signals.processing import Float, integrate, peak
from rockframe.units import GRAVITY

#: Length of the windows at the beginning and end of a record [s]. It contains several samples at
#: any usual rate, so that one sample near zero does not matter, and is short compared with the
#: motion.
OPENING: Final = 0.1
#: Smallest distance of an extreme from the median, as a share of that of the other extreme, at
#: which it can be clipped. The rest level of a one-sided motion is an extreme too, but is not
#: clipped.
_COMPARABLE: Final = 0.5
#: Least number of steps per period of the oscillator. The relative error of the peak, interpolated
#: between steps, is then below 5e-5.
_STEPS: Final = 20
#: Terms of a series in the phase per step, at most 2 pi / 20: the next one is below 1e-20.
_TERMS: Final = 16
#: Least number of steps between samples, because the slope of the ground jumps at each sample.
_PARTS: Final = 4
#: Periods of the Housner intensity [s]. With five times as many, the intensities of the bundled
#: records change by at most 0.1 %.
_HOUSNER: Final = np.linspace(0.1, 2.5, 121)


def arias_intensity(acceleration: Float, time_step: float) -> float:
    """Return I_A = pi / (2 g) times the integral of the squared acceleration [m s-1].

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2].
    time_step : float
        Interval between samples [s].

    References
    ----------
    Arias (1970), A measure of earthquake intensity, in Seismic Design for Nuclear Power Plants,
    MIT Press, 438-483.

    Examples
    --------
    >>> print(f"{arias_intensity(np.full(101, 1.0), 0.01):.4f}")
    0.1601
    """
    return math.pi / (2.0 * GRAVITY) * float(integrate(acceleration**2, time_step)[-1])


def cumulative_absolute_velocity(acceleration: Float, time_step: float) -> float:
    """Return CAV, the integral of |a| over the record [m s-1].

    This is the plain definition, without a threshold and without windows of one second.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2].
    time_step : float
        Interval between samples [s].

    References
    ----------
    EPRI (1988), A criterion for determining exceedance of the operating basis earthquake, report
    NP-5930.

    Examples
    --------
    >>> cumulative_absolute_velocity(np.array([0.0, 2.0, -2.0, 0.0]), 0.5)
    2.0
    """
    return float(integrate(np.abs(acceleration), time_step)[-1])


def significant_duration(
    acceleration: Float, time_step: float, start: float = 0.05, end: float = 0.95
) -> tuple[float, float]:
    """Return the times at which the Arias intensity passes two shares of its final value.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    start, end : float
        The two shares [1]: 0.05 and 0.95 for D5-95, 0.05 and 0.75 for D5-75.

    Returns
    -------
    start, end : float
        Times since the first sample [s]; the significant duration is their difference.

    Raises
    ------
    ParameterError
        Unless 0 < start < end < 1, or if all samples are zero.

    References
    ----------
    Trifunac and Brady (1975), A study on the duration of strong earthquake ground motion,
    BSSA 65(3), 581-626.

    Examples
    --------
    >>> begin, finish = significant_duration(np.ones(1001), 0.01)
    >>> print(f"{begin:.3f} {finish:.3f}")
    0.500 9.500
    """
    if not 0.0 < start < end < 1.0:
        raise ParameterError(
            f"Invalid shares {start!r} and {end!r} of the Arias intensity. "
            "Must be between 0 and 1, the lower one first."
        )
    growth = integrate((acceleration / _peak_of_motion(acceleration)) ** 2, time_step)
    times = []
    for target in (start * growth[-1], end * growth[-1]):
        after = int(np.searchsorted(growth, target))
        before = growth[after - 1]
        times.append(time_step * (after - 1 + float((target - before) / (growth[after] - before))))
    return times[0], times[1]


def spectral_acceleration(
    acceleration: ArrayLike, time_step: float, periods: ArrayLike, *, damping: float = 0.05
) -> Float:
    """Return the pseudo-spectral acceleration (2 pi / T)^2 max |x| [m s-2].

    Parameters
    ----------
    acceleration : array_like, shape (samples,)
        Ground acceleration [m s-2], linear between samples.
    time_step : float
        Interval between samples [s].
    periods : array_like, shape (periods,)
        Periods T of the oscillators [s].
    damping : float
        Share of critical damping [1].

    Raises
    ------
    ParameterError
        Unless periods, damping and time step are positive and finite, and the damping is below 1.

    Notes
    -----
    The oscillators are at rest at the first sample, whatever the ground acceleration is there, and
    vibrate freely for one period after the last one. The recursion is exact for ground acceleration
    that is linear between samples (Nigam and Jennings 1969). The peak between two steps is that of
    the Hermite cubic of displacement and velocity.

    Examples
    --------
    >>> import numpy as np
    >>> suddenly = np.ones(2000)
    >>> spectral_acceleration(suddenly, 0.001, [0.5]).round(3).tolist()
    [1.854]
    """
    natural = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    return _largest_of_oscillators(acceleration, time_step, natural, damping, _PARTS)


def spectral_acceleration_toward(
    components: ArrayLike,
    time_step: float,
    period: float,
    directions: ArrayLike,
    *,
    damping: float = 0.05,
) -> Float:
    """Return the pseudo-spectral acceleration of a motion toward each direction [m s-2].

    Parameters
    ----------
    components : array_like, shape (2, samples)
        Two components of the ground acceleration [m s-2], linear between samples.
    time_step, damping
        As in `spectral_acceleration`.
    period : float
        Period T of the oscillator [s].
    directions : array_like, shape (directions, 2)
        The motion toward a direction is the sum of the two components times these factors [1].

    Raises
    ------
    ParameterError
        As in `spectral_acceleration`.

    Examples
    --------
    >>> north, east = np.ones(2000), np.zeros(2000)
    >>> toward = [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]
    >>> spectral_acceleration_toward([north, east], 0.001, 0.5, toward).round(3).tolist()
    [1.854, 0.927, 0.0]
    """
    _require_oscillator(time_step, period, damping)
    ground = np.ascontiguousarray(components, dtype=np.float64)
    toward = np.ascontiguousarray(directions, dtype=np.float64)
    parts, rest = _steps_of(time_step, period, _PARTS)
    phase = 2.0 * math.pi * (time_step / parts) / period
    free, before, after = (factors[0] for factors in _step_factors(np.array([phase]), damping))
    path = orbit_of_oscillator(free, before, after, ground, parts, rest)
    if not np.isfinite(path[:, -1]).all():
        return np.full(toward.shape[0], math.nan)
    return largest_toward(path, phase, toward)


def oscillator_response(
    acceleration: ArrayLike,
    time_step: float,
    period: float,
    *,
    damping: float = 0.05,
    parts: int = _PARTS,
) -> Float:
    """Return the pseudo-acceleration of an oscillator at each step, and then its changes.

    It is a linear function of the ground acceleration, so responses to two components can be
    rotated. `oscillator_peak` returns its largest value.

    Parameters
    ----------
    acceleration, time_step, damping
        As in `spectral_acceleration`.
    period : float
        Period T of the oscillator [s].
    parts : int
        Least number of steps between two samples.

    Returns
    -------
    array, shape (2 steps,)
        (2 pi / T)^2 x, and its rate times the step [m s-2].

    Raises
    ------
    ParameterError
        As in `spectral_acceleration`.

    Examples
    --------
    >>> oscillator_response([0.0, 1.0], 0.1, 1.0).shape
    (90,)
    """
    _require_oscillator(time_step, period, damping)
    ground = np.asarray(acceleration, dtype=np.float64)
    parts, rest = _steps_of(time_step, period, parts)
    at = np.arange((ground.size - 1) * parts + 1) / parts
    finer = np.interp(at, np.arange(ground.size), ground)
    phase = 2.0 * math.pi * (time_step / parts) / period
    free, before, after = (factors[0] for factors in _step_factors(np.array([phase]), damping))
    x, v = through_oscillator(free, before, after, finer, rest)
    return np.concatenate((x, phase * v))


def oscillator_peak(response: Float) -> float:
    """Return the largest absolute value of an oscillator's pseudo-acceleration [m s-2].

    The peak between two steps is that of the Hermite cubic of the values and their rates.

    Parameters
    ----------
    response : array, shape (2 steps,)
        Result of `oscillator_response`.

    Examples
    --------
    >>> oscillator_peak(np.array([0.0, 1.0, 1.0, -1.0]))
    1.0
    """
    x, change = np.split(response, 2)
    turns = np.flatnonzero(change[:-1] * change[1:] < 0.0)
    # place of the peak, as a share of the step
    at = change[turns] / (change[turns] - change[turns + 1])
    rise = x[turns + 1] - x[turns]
    cubic = (
        at * (at - 1.0) * ((at - 1.0) * (change[turns] - rise) + at * (change[turns + 1] - rise))
    )
    between = x[turns] + rise * at + cubic
    return float(max(np.abs(x).max(), np.abs(between).max(initial=0.0)))


def housner_intensity(acceleration: ArrayLike, time_step: float) -> float:
    """Return the Housner (spectrum) intensity [m].

    It is the integral of the pseudo-spectral velocity, 5 % damped, over the periods from 0.1 to
    2.5 s: the trapezoidal rule with 121 periods.

    Parameters
    ----------
    acceleration : array_like, shape (samples,)
        Ground acceleration [m s-2], linear between samples.
    time_step : float
        Interval between samples [s].

    References
    ----------
    Housner (1952), Spectrum intensities of strong-motion earthquakes, Proc. Symposium on Earthquake
    and Blast Effects on Structures, EERI, 20-36. He had 20 % of critical damping, too.

    Examples
    --------
    >>> print(f"{housner_intensity(np.r_[0.0, np.ones(9)], 0.1):.3f}")
    0.887
    """
    # One step between samples is enough for these periods, and takes a third of the time.
    largest = _largest_of_oscillators(acceleration, time_step, _HOUSNER, 0.05, parts=1)
    return float(np.trapezoid(largest * _HOUSNER / (2.0 * math.pi), _HOUSNER))


def clipped_samples(acceleration: Float) -> int:
    """Return the longest run of equal samples at the largest or the smallest value.

    A clipped instrument repeats its last value; an unclipped record gives 1. An extreme that is
    less than half as far from the median as the other one is ignored.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration as recorded, before any filter, in any unit.

    Examples
    --------
    >>> clipped_samples(np.array([0.0, 2.0, 2.0, 2.0, 0.0, -2.0, 0.0]))
    3
    """
    middle = float(np.median(acceleration))
    extremes = {float(acceleration.min()), float(acceleration.max())}
    furthest = max(abs(extreme - middle) for extreme in extremes)
    return max(
        _longest_run(acceleration == extreme)
        for extreme in extremes
        if abs(extreme - middle) >= _COMPARABLE * furthest
    )


def longest_constant(series: Float, time_step: float) -> float:
    """Return the longest time during which a series is constant [s].

    Gaps that were filled with zeros or with the last value are constant.

    Parameters
    ----------
    series : array, shape (samples,)
        Samples as recorded, in any unit.
    time_step : float
        Interval between samples [s].

    Examples
    --------
    >>> longest_constant(np.array([1.0, 0.0, 0.0, 0.0, 2.0]), 0.5)
    1.0
    """
    return time_step * _longest_run(np.diff(series) == 0.0)


def opening_share(acceleration: Float, time_step: float) -> float:
    """Return the peak of the first 0.1 s divided by the peak of the record [1].

    A large value means that the record was triggered late, during the motion; for the reversed
    record, that it was cut off during the motion.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration without offset, before any taper, in any unit.
    time_step : float
        Interval between samples [s].

    Raises
    ------
    ParameterError
        If all samples are zero.

    Examples
    --------
    >>> opening_share(np.r_[np.full(100, 0.25), 1.0], 0.01)
    0.25
    """
    opening = acceleration[: max(1, round(OPENING / time_step))]
    return peak(opening) / _peak_of_motion(acceleration)


def _peak_of_motion(acceleration: Float) -> float:
    largest = peak(acceleration)
    if largest == 0.0:
        raise ParameterError(f"all {acceleration.size} samples are zero.")
    return largest


def _longest_run(flags: NDArray[np.bool_]) -> int:
    """Return the length of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False]))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _require_oscillator(time_step: float, period: float, damping: float) -> None:
    for label, value in (("period", period), ("time step", time_step), ("damping", damping)):
        if not 0.0 < value < (1.0 if label == "damping" else math.inf):
            raise ParameterError(f"Invalid {label} {value:g}. Must be above 0 and finite.")


def _steps_of(time_step: float, period: float, parts: int) -> tuple[int, int]:
    """Return the number of steps between samples, and of those in a period after the last one."""
    parts = max(parts, math.ceil(_STEPS * time_step / period))
    return parts, math.ceil(period / time_step) * parts


def _largest_of_oscillators(
    acceleration: ArrayLike, time_step: float, periods: Float, damping: float, parts: int
) -> Float:
    """Return (2 pi / T)^2 max |x| at each period [m s-2], with at least `parts` steps between two
    samples.
    """
    for period in periods.tolist():
        _require_oscillator(time_step, period, damping)
    ground = np.ascontiguousarray(acceleration, dtype=np.float64)
    steps = [_steps_of(time_step, period, parts) for period in periods.tolist()]
    largest = np.empty(periods.size)
    for number in {number for number, _ in steps}:
        alike = [k for k, (other, _) in enumerate(steps) if other == number]
        phases = 2.0 * math.pi * (time_step / number) / periods[alike]
        free, before, after = _step_factors(phases, damping)
        for start in range(0, len(alike), LANES):
            chosen = alike[start : start + LANES]
            lanes, rows = slice(0, len(chosen)), slice(start, start + len(chosen))
            block = np.zeros((ROWS, LANES))
            block[FREE:BEFORE, lanes] = free[rows].reshape(-1, 4).T
            block[BEFORE:AFTER, lanes] = before[rows].T
            block[AFTER:PHASE, lanes] = after[rows].T
            block[PHASE, lanes] = phases[rows]
            largest_displacements(block, ground, number, max(steps[k][1] for k in chosen))
            ended = np.isfinite(block[DISPLACEMENT, lanes])
            largest[chosen] = np.where(ended, block[LARGEST, lanes], math.nan)
    return largest


def _step_factors(phases: Float, damping: float) -> tuple[Float, Float, Float]:
    """Return the factors of a step of oscillators, see `through_oscillator`.

    The state is (2 pi / T)^2 x and its derivative by the phase.

    Parameters
    ----------
    phases : array, shape (oscillators,)
        Phase w h of the free oscillation per step h [rad], at most 2 pi / `_STEPS`.
    damping : float
        Share of critical damping [1].

    Returns
    -------
    free : array, shape (oscillators, 2, 2)
    before, after : array, shape (oscillators, 2)
    """
    system = np.array([[0.0, 1.0], [-1.0, -2.0 * damping]])
    powers = np.cumprod(np.vstack([np.ones_like(phases), *[phases] * _TERMS]), axis=0)
    matrices = [np.eye(2)]
    for _ in range(_TERMS):
        matrices.append(matrices[-1] @ system)
    # series of the matrix times the phase: that of the exponential for free motion, and those of
    # its first two integrals for constant and for growing ground acceleration
    free, constant, slope = (
        np.einsum(
            "kn,kab->nab",
            powers,
            [matrix / math.factorial(k + j) for k, matrix in enumerate(matrices)],
        )
        for j in range(3)
    )
    after, both = (-phases[:, None] * of[:, :, 1] for of in (slope, constant))
    return free, both - after, after
