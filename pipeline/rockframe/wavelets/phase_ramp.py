"""Sines and cosines at equal steps of the angle, computed by products of short rows."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def phase_ramp(angle: float | NDArray[np.float64], count: int) -> NDArray[np.complex128]:
    """Return exp(i k angle) for k = 0, 1, ..., count - 1, along a last axis.

    Parameters
    ----------
    angle : float or array
        Step [rad].
    count : int
        Number of values.

    Examples
    --------
    >>> phase_ramp(0.5 * math.pi, 3).round(9).tolist()
    [(1+0j), 1j, (-1+0j)]
    """
    side = math.isqrt(count) + 1
    ramp = 1j * np.multiply.outer(angle, np.arange(side))
    table = np.exp(side * ramp)[..., :, None] * np.exp(ramp)[..., None, :]
    return np.asarray(table.reshape(*table.shape[:-2], -1)[..., :count])
