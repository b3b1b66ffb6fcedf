"""The transform as an image, computed with PyWavelets."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import pywt
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.wavelets.ricker import ANTISYMMETRIC_RICKER, SYMMETRIC_RICKER

Float = NDArray[np.float64]

#: Name of each wavelet in PyWavelets, and its variable divided by tau.
_PYWAVELETS: Final = {
    SYMMETRIC_RICKER.name: ("mexh", math.sqrt(2.0) * math.pi),
    ANTISYMMETRIC_RICKER.name: ("gaus3", 2.0 * math.pi / math.sqrt(6.0)),
}


def scalogram(
    acceleration: Float, time_step: float, wavelet: str, periods: Float
) -> NDArray[np.float64]:
    """Return C(s, xi) at the samples and the given periods, computed with PyWavelets.

    An independent computation of the same numbers, for figures and as a check. ``mexh`` and
    ``gaus3`` have unit energy over their own variable, x = sqrt(2) pi tau and 2 pi tau / sqrt(6),
    and ``pywt.cwt`` divides by the root of the scale in samples. Multiplied by the root of the time
    step, this is the transform with the weighting ``energy``. PyWavelets samples its wavelets
    coarsely: the result is accurate to half a sample in time and about half a percent in height.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Acceleration [m s-2].
    time_step : float
        Interval between samples [s].
    wavelet : str
        ``symmetric_ricker`` or ``antisymmetric_ricker``; PyWavelets lacks the other wavelets.
    periods : array, shape (periods,)
        Periods T_p [s].

    Returns
    -------
    array, shape (periods, samples)
        Coefficients [m s-3/2].

    Raises
    ------
    ParameterError
        If the wavelet is another.

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
