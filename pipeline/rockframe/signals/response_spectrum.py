"""Spectral acceleration of an accelerogram."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError

Float = NDArray[np.float64]

#: Least number of steps per period of the oscillator. The relative error of the peak, interpolated
#: between steps, is then at most 3e-5.
_STEPS: Final = 20
#: Least number of steps between samples, because the slope of the ground jumps at each sample.
_PARTS: Final = 4


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
    The oscillators start at rest, and vibrate freely for one period after the record. The recursion
    is exact for ground acceleration that is linear between samples (Nigam and Jennings 1969). The
    peak between two steps is that of the Hermite cubic of displacement and velocity.

    Examples
    --------
    >>> import numpy as np
    >>> suddenly = np.ones(2000)
    >>> spectral_acceleration(suddenly, 0.001, [0.5]).round(3).tolist()
    [1.854]
    """
    ground = np.asarray(acceleration, dtype=np.float64)
    asked = np.atleast_1d(np.asarray(periods, dtype=np.float64))
    for label, values in (("period", asked), ("time step", [time_step]), ("damping", [damping])):
        for value in values:
            if not 0.0 < value < (1.0 if label == "damping" else math.inf):
                raise ParameterError(f"Invalid {label} {value:g}. Must be above 0 and finite.")
    return np.array([_peak(ground, time_step, float(period), damping) for period in asked])


def _peak(ground: Float, time_step: float, period: float, damping: float) -> float:
    parts = max(_PARTS, math.ceil(_STEPS * time_step / period))
    rest = math.ceil(period / time_step)
    at = np.arange((ground.size + rest - 1) * parts + 1) / parts
    finer = np.interp(at, np.arange(ground.size), ground, right=0.0)
    omega, step = 2.0 * math.pi / period, time_step / parts
    lower = [1.0, 2.0 * damping * omega, omega**2]
    x, v = (_filtered(upper, lower, step, finer) for upper in ([-(omega**2)], [-(omega**2), 0.0]))
    turns = np.flatnonzero(v[:-1] * v[1:] < 0.0)
    at = v[turns] / (v[turns] - v[turns + 1])  # place of the peak, as a share of the step
    rise = x[turns + 1] - x[turns]
    cubic = (
        at
        * (at - 1.0)
        * ((at - 1.0) * (step * v[turns] - rise) + at * (step * v[turns + 1] - rise))
    )
    between = x[turns] + rise * at + cubic
    return float(max(np.abs(x).max(), np.abs(between).max(initial=0.0)))


def _filtered(upper: list[float], lower: list[float], step: float, ground: Float) -> Float:
    """Return the output of a linear system under piecewise linear ground acceleration."""
    above, below, _ = scipy.signal.cont2discrete((upper, lower), step, method="foh")
    return np.asarray(scipy.signal.lfilter(above.ravel(), below, ground))
