"""The largest match index at each period, for figures."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.resolution import period_range, prepared
from rockframe.matching.search import ladder, search
from rockframe.matching.signal import require_record
from rockframe.options.pulse import PulseOptions

Float = NDArray[np.float64]

#: Times per period and periods per octave, which keep the curve within 0.1 % of the maxima.
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
