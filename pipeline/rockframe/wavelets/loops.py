"""Compiled loop over the lines of a spectrum."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Distance from the limits at 0 and +-1 within which the window's spectrum is a sum of three sincs.
_NEAR: Final = 1e-6


@compiled
def fill(nu: Float, gamma: Float, turned: Complex, filled: Complex) -> None:
    """Fill in spectra, shape (points, 2, lines); `nu` and `turned` have shape (points, lines).

    They are sums of the window's Fourier integral, (gamma / 2) sinc(x) / (1 - x^2), at
    x = gamma (nu - 1) and gamma (nu + 1).
    """
    for i in range(gamma.size):
        number, near = gamma[i], 0
        sine, cosine = math.sin(math.pi * number), math.cos(math.pi * number)
        for k in range(nu.shape[1]):
            x, y = number * (nu[i, k] - 1.0), number * (nu[i, k] + 1.0)
            first, second = turned[i, k].imag * cosine, turned[i, k].real * sine
            left, right = x * (1.0 - x) * (1.0 + x), y * (1.0 - y) * (1.0 + y)
            rate, at_limit = 0.5 * number * nu[i, k], min(abs(left), abs(right)) < _NEAR
            near += at_limit
            lower = (first - second) / (1.0 if at_limit else left)
            upper = (first + second) / (1.0 if at_limit else right)
            filled[i, 0, k] = complex(0.0, rate * (lower + upper))
            filled[i, 1, k] = complex(rate * (upper - lower), 0.0)
        for k in range(nu.shape[1] if near else 0):
            x, y = number * (nu[i, k] - 1.0), number * (nu[i, k] + 1.0)
            if min(abs(x * (1.0 - x) * (1.0 + x)), abs(y * (1.0 - y) * (1.0 + y))) < _NEAR:
                rate = 0.5 * math.pi * number * nu[i, k]
                filled[i, 0, k] = complex(0.0, rate * (_window(x) + _window(y)))
                filled[i, 1, k] = complex(rate * (_window(y) - _window(x)), 0.0)


@inlined
def _window(x: float) -> float:
    """Return sinc(x) / (1 - x^2) as a sum of three shifted sincs, also valid at 0 and +-1."""
    return float(np.sinc(x) + 0.5 * (np.sinc(x - 1.0) + np.sinc(x + 1.0)))
