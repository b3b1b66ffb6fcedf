"""Match index over the period, and scalogram."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import pywt
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.search import ladder, search
from rockframe.matching.signal import period_range, prepared, require_record
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.ricker import ANTISYMMETRIC_RICKER, SYMMETRIC_RICKER

Float = NDArray[np.float64]

#: Number of times per period and of periods per octave. The curve is then within 0.1 % of the
#: maxima.
_FINENESS: Final = 24
_PER_OCTAVE: Final = 28


def match_curve(
    acceleration: Float, time_step: float, options: PulseOptions
) -> tuple[Float, dict[str, Float]]:
    """Return the largest match index of each wavelet at each period, over all times and phases.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    options : PulseOptions
        Wavelets, periods and weighting of the search.

    Returns
    -------
    periods : array, shape (periods,)
        T_p [s].
    indices : dict of str to array, shape (periods,)
        Match indices by wavelet [1].

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> record = pulse.acceleration(0.01 * np.arange(1000))
    >>> periods, indices = match_curve(record, 0.01, PulseOptions())
    >>> round(float(periods[indices["symmetric_ricker"].argmax()]), 2)
    0.8
    """
    samples = require_record(acceleration, time_step)
    low, high = period_range(samples.size, time_step, options)
    signal = prepared(samples, time_step, options, high)
    periods = ladder(low, high, _PER_OCTAVE)
    found = search(signal, periods, options.wavelet, options.half_cycles, _FINENESS)
    return periods, {
        name: np.sqrt(np.minimum(1.0, heights.power[0].max(axis=1) / signal.energy))
        for name, heights in found.items()
    }


#: Name of each wavelet in PyWavelets, and its variable divided by tau.
_PYWAVELETS: Final = {
    SYMMETRIC_RICKER.name: ("mexh", math.sqrt(2.0) * math.pi),
    ANTISYMMETRIC_RICKER.name: ("gaus3", 2.0 * math.pi / math.sqrt(6.0)),
}


def scalogram(
    acceleration: Float, time_step: float, wavelet: str, periods: Float
) -> NDArray[np.float64]:
    """Return C(s, xi) at the samples and the given periods, computed with PyWavelets.

    This computation is independent of the search; it is used for figures and as a check. ``mexh``
    and ``gaus3`` have unit energy over the variables x = sqrt(2) pi tau and 2 pi tau / sqrt(6), and
    ``pywt.cwt`` divides by the square root of the scale in samples. Times the square root of the
    time step, the result is the transform with the weighting ``energy``. PyWavelets samples its
    wavelets coarsely: the error is half a sample in time and about half a percent in height.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        ``symmetric_ricker`` or ``antisymmetric_ricker``; PyWavelets does not have the others.
    periods : array, shape (periods,)
        Periods T_p [s].

    Returns
    -------
    array, shape (periods, samples)
        Coefficients [m s-3/2].

    Raises
    ------
    ParameterError
        If the wavelet is not one of these.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> t = np.arange(1000) * 0.01
    >>> record = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0).acceleration(t)
    >>> picture = scalogram(record, 0.01, "symmetric_ricker", np.array([0.4, 0.8, 1.6]))
    >>> [int(i) for i in np.unravel_index(abs(picture).argmax(), picture.shape)]
    [1, 500]
    """
    if wavelet not in _PYWAVELETS:
        known = ", ".join(_PYWAVELETS)
        raise ParameterError(f"Invalid wavelet {wavelet!r}. Must be one of: {known}.")
    name, rate = _PYWAVELETS[wavelet]
    scales = np.asarray(periods) / (rate * time_step)
    coefficients, _ = pywt.cwt(acceleration, scales, name, method="fft", precision=14)
    return np.asarray(coefficients * math.sqrt(time_step), dtype=np.float64)
