"""A velocity-pulse classifier for comparison: the ratios and indicator of Baker (2007).

References
----------
Baker (2007), Quantitative classification of near-fault ground motions using wavelet analysis,
Bull. Seismol. Soc. Am. 97(5), 1486-1501. Baker extracts a Daubechies wavelet. This module extracts
the Ricker pulse that explains most of the velocity, so its indicator is an approximation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.match import best_ricker, match_pulses
from rockframe.matching.signal import velocity_of
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

#: Constant, factor of the peak ratio and factor of the energy ratio in the published regression.
_INDICATOR: Final = (-23.3, 14.6, 20.5)


@dataclass(frozen=True, kw_only=True)
class VelocityPulse:
    """The pulse in a record's velocity, and the residual velocity without it.

    Parameters
    ----------
    pulse : Pulse
        The Ricker pulse whose velocity explains most of the velocity of the record.
    peak_ratio : float
        Peak velocity of the residual record over that of the record [1].
    energy_ratio : float
        Integral of the squared velocity of the residual record over that of the record [1].
    indicator : float
        1 / (1 + exp(-23.3 + 14.6 peak_ratio + 20.5 energy_ratio)) [1]. Baker (2007) classifies
        records above 0.85 as pulse-like, and records below 0.15 as not pulse-like.
    """

    pulse: Pulse
    peak_ratio: float
    energy_ratio: float
    indicator: float


def velocity_pulse(acceleration: Float, time_step: float, options: PulseOptions) -> VelocityPulse:
    """Find the pulse in a record's velocity, and compare the velocity with and without it.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    options : PulseOptions
        Options of the search, of which only the range of periods is used.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.

    Examples
    --------
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=2.0, T_p=0.8, time=5.0)
    >>> record = pulse.acceleration(0.01 * np.arange(1000))
    >>> round(velocity_pulse(record, 0.01, PulseOptions()).indicator, 6)
    1.0
    """
    chosen = options.replaced(wavelet=tuple(RICKERS), pulse_wavelet=None, weighting="velocity")
    matches = match_pulses(acceleration, time_step, chosen)
    pulse = matches[best_ricker(matches)].pulse
    whole = velocity_of(acceleration, time_step)
    time = time_step * np.arange(acceleration.size)
    rest = velocity_of(acceleration - pulse.acceleration(time), time_step)
    peak_ratio = float(np.abs(rest).max() / np.abs(whole).max())
    energy_ratio = float((rest @ rest) / (whole @ whole))
    constant, of_peak, of_energy = _INDICATOR
    exponent = constant + of_peak * peak_ratio + of_energy * energy_ratio
    return VelocityPulse(
        pulse=pulse,
        peak_ratio=peak_ratio,
        energy_ratio=energy_ratio,
        indicator=1.0 / (1.0 + math.exp(min(exponent, 700.0))),
    )
