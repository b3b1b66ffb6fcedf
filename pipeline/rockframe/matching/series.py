"""Taylor series over time of the inner products, which are sums over a record's spectrum."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.wavelets.phase_ramp import phase_ramp

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Largest number of terms, and the signs of the real and imaginary parts of the powers of i.
_MOST_TERMS: Final = 6
_SIGNS: Final = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])


def taylor(matched: Complex, line: float, tau: float, terms: int) -> Float:
    """Return the coefficients of the products in powers of the time around tau, over T_p.

    The shape is (parts, terms). The lines of the spectrum are `line` apart, over 1 / T_p.
    """
    count = matched.shape[1]
    turned = matched * phase_ramp(2.0 * math.pi * tau * line, count)
    powers = _powers(1 << count.bit_length())[:, :count]
    # powers of i alternate between the real part (even terms) and the imaginary part (odd terms)
    series = np.empty((matched.shape[0], terms))
    series[:, 0::2] = np.ascontiguousarray(turned.real) @ powers[0:terms:2].T
    series[:, 1::2] = np.ascontiguousarray(turned.imag) @ powers[1:terms:2].T
    return np.asarray(series * (_SIGNS * line ** np.arange(_MOST_TERMS))[:terms])


@lru_cache(maxsize=16)
def _powers(count: int) -> Float:
    """Return (2 pi k)^n / n! for k from 0, a row for each n."""
    rate = 2.0 * math.pi * np.arange(count)
    return np.stack([rate**n / math.factorial(n) for n in range(_MOST_TERMS)])


def top_near(series: Float, energies: tuple[float, ...], bounds: tuple[float, float]) -> float:
    """Return the time of the maximum of the sum of squares near 0, over T_p, within bounds."""
    terms = series.shape[1]
    total = np.zeros(2 * terms - 1)
    for row, energy in zip(series, energies, strict=True):
        total += np.convolve(row, row) / energy
    slope = [k * c for k, c in enumerate(total[:terms].tolist())][1:]
    bend = [k * c for k, c in enumerate(slope)][1:]
    low, high = bounds
    x = 0.0
    for _ in range(8):
        rise, curve = _polynomial(slope, x), _polynomial(bend, x)
        move = -rise / curve if curve < 0.0 else math.copysign(high - low, rise)
        x, last = min(max(x + move, low), high), x
        if abs(x - last) < 1e-14:
            break
    return x


def _polynomial(coefficients: list[float], x: float) -> float:
    value = 0.0
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value
