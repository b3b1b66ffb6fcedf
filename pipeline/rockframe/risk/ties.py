"""Intensities that are equal but for round-off and for the digits of scale factors."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

#: Relative difference up to which two intensities are equal. Factors that scale motions to one
#: intensity have six digits, so each product differs from it by up to 5e-6.
SAME: Final = 1e-5


def merged(x: Float) -> Float:
    """Return logarithms of intensities, with one value for those that count as equal.

    Neighbours that differ by at most `SAME` are equal, in groups that are no wider than it: a
    million intensities are everywhere close to the next one, and nevertheless differ.

    Examples
    --------
    >>> merged(np.array([0.3, 1.0, 0.1 + 0.2, 1.000002])).round(7).tolist()
    [0.3, 1.000001, 0.3, 1.000001]
    """
    # the middle of equal values is exactly this value, which their mean need not be
    return 0.5 * np.add(*extremes(x))


def extremes(x: Float) -> tuple[Float, Float]:
    """Return the least and the largest of the logarithms that count as equal to each one."""
    order = np.argsort(x, axis=None)
    values = x.ravel()[order]
    begins = np.diff(values, prepend=-np.inf) > SAME
    above = values - values[begins][np.cumsum(begins) - 1]
    begins |= np.diff(np.floor(above / SAME), prepend=0.0) > 0.0
    starts = np.flatnonzero(begins)
    sizes = np.diff(starts, append=values.size)
    ends = np.empty((2, values.size))
    ends[:, order] = [
        np.repeat(values[starts], sizes),
        np.repeat(values[starts + sizes - 1], sizes),
    ]
    return ends[0].reshape(x.shape), ends[1].reshape(x.shape)
