"""Compiled loops over the lines of spectra, and energies."""

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
#: Number of lines after which sine and cosine are computed directly, not by rotation of the last.
FRESH: Final = 32


@compiled
def fill(nu: Float, gamma: float, turned: Complex, filled: Complex) -> None:
    """Fill in spectra, shape (2, lines); `nu` and `turned` have shape (lines,).

    They are sums of the window's Fourier integral, (gamma / 2) sinc(x) / (1 - x^2), at
    x = gamma (nu - 1) and gamma (nu + 1).
    """
    near, sine, cosine = 0, math.sin(math.pi * gamma), math.cos(math.pi * gamma)
    for k in range(nu.size):
        x, y = gamma * (nu[k] - 1.0), gamma * (nu[k] + 1.0)
        first, second = turned[k].imag * cosine, turned[k].real * sine
        left, right = x * (1.0 - x) * (1.0 + x), y * (1.0 - y) * (1.0 + y)
        rate, at_limit = 0.5 * gamma * nu[k], min(abs(left), abs(right)) < _NEAR
        near += at_limit
        lower = (first - second) / (1.0 if at_limit else left)
        upper = (first + second) / (1.0 if at_limit else right)
        filled[0, k] = complex(0.0, rate * (lower + upper))
        filled[1, k] = complex(rate * (upper - lower), 0.0)
    for k in range(nu.size if near else 0):
        x, y = gamma * (nu[k] - 1.0), gamma * (nu[k] + 1.0)
        if min(abs(x * (1.0 - x) * (1.0 + x)), abs(y * (1.0 - y) * (1.0 + y))) < _NEAR:
            rate = 0.5 * math.pi * gamma * nu[k]
            filled[0, k] = complex(0.0, rate * (_window(x) + _window(y)))
            filled[1, k] = complex(rate * (_window(y) - _window(x)), 0.0)


@inlined
def _window(x: float) -> float:
    """Return sinc(x) / (1 - x^2) as a sum of three shifted sincs, also valid at 0 and +-1."""
    return float(np.sinc(x) + 0.5 * (np.sinc(x - 1.0) + np.sinc(x + 1.0)))


def window_energy(gamma: float, even: float) -> float:
    """Return the integral of the squared acceleration of a phase; `even` is cos(2 phase)."""
    # energy E(gamma, phi) in closed form, of psi with v' = -(pi / gamma) psi
    share = math.sin(2.0 * math.pi * gamma) * even / (8.0 * math.pi * (4.0 * gamma**2 - 1.0))
    return (math.pi / gamma) ** 2 * (0.25 * gamma * (1.0 + 3.0 * gamma**2) - share)


_window_energy = inlined(window_energy)


@inlined
def window_energies(gamma: float, of_velocity: bool, energies: Float) -> None:
    """Fill in the energies of the phases 0 and pi / 2, or those of their velocities."""
    x = 2.0 * gamma
    sincs = 1.5 * np.sinc(x) + np.sinc(x - 1.0) + np.sinc(x + 1.0)
    sincs += 0.25 * (np.sinc(x - 2.0) + np.sinc(x + 2.0))
    for part in range(2):
        even = 1.0 - 2.0 * part
        energies[part] = _window_energy(gamma, even)
        if of_velocity:
            energies[part] = gamma * (0.1875 + 0.125 * even * sincs)


@compiled
def fill_lines(
    step: float, gamma: float, gaussians: Float, of_velocity: bool, filled: Complex
) -> None:
    """Fill in the spectra of a wavelet's parts, shape (parts, lines), at multiples of a step.

    `gaussians` has the height, the power, 2 or 3, and the rate of each part, whose spectrum is
    height nu^power exp(-rate nu^2), times i if the power is odd. If it is empty, `gamma` is the
    number of half cycles of the wavelet of Mavroeidis and Papageorgiou.
    """
    nu = np.empty(filled.shape[1])
    for k in range(nu.size):
        nu[k] = k * step
    if gaussians.size == 0:
        turned = np.empty(nu.size, dtype=np.complex128)
        _fill_turns(math.pi * gamma * step, turned)
        fill(nu, gamma, turned, filled)
    for part in range(gaussians.shape[0]):
        height, odd, rate = gaussians[part, 0], gaussians[part, 1] == 3.0, gaussians[part, 2]
        for k in range(nu.size):
            square = nu[k] * nu[k]
            size = height * square * math.exp(-rate * square)
            filled[part, k] = complex(0.0, size * nu[k]) if odd else complex(size, 0.0)
    for part in range(filled.shape[0] if of_velocity else 0):
        for k in range(1, nu.size):
            share = 0.5 / (math.pi * nu[k])
            filled[part, k] = complex(share * filled[part, k].imag, -share * filled[part, k].real)
        filled[part, 0] = 0.0
        if gaussians.size == 0 and part == 0:
            filled[part, 0] = 0.5 * gamma * _window(gamma)


@inlined
def _fill_turns(angle: float, turned: Complex) -> None:
    """Fill in exp(i k angle) for k = 0, 1, ..., by rotation."""
    turn, at = complex(math.cos(angle), math.sin(angle)), complex(1.0, 0.0)
    for k in range(turned.size):
        if k % FRESH == 0:
            at = complex(math.cos(angle * k), math.sin(angle * k))
        turned[k] = at
        at *= turn
