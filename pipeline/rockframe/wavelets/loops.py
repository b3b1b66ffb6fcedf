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
def fill(nu: Float, gamma: float, filled: Complex) -> None:
    """Fill in the spectra of the phases 0 and pi / 2, shape (2, frequencies), at frequencies nu."""
    sine, cosine = math.sin(math.pi * gamma), math.cos(math.pi * gamma)
    for k in range(nu.size):
        angle = math.pi * gamma * nu[k]
        first, second = math.sin(angle) * cosine, math.cos(angle) * sine
        even, odd = _pair(nu[k], gamma, first, second)
        filled[0, k], filled[1, k] = complex(0.0, even), complex(odd, 0.0)


@inlined
def _pair(nu: float, gamma: float, first: float, second: float) -> tuple[float, float]:
    """Return the spectra of phase 0, over i, and of phase pi / 2 at a frequency.

    They are sums of the window's Fourier integral, (gamma / 2) sinc(x) / (1 - x^2), at
    x = gamma (nu - 1) and gamma (nu + 1). The sines of pi x are `first` minus and plus `second`.
    """
    even, odd = 0.0, 0.0
    for side in (-1.0, 1.0):
        x = gamma * (nu + side)
        below = x * (1.0 - x) * (1.0 + x)
        near = abs(below) < _NEAR
        height = math.pi * _window(x) if near else (first + side * second) / below
        even += height
        odd += side * height
    rate = 0.5 * gamma * nu
    return rate * even, rate * odd


@compiled
def _sinc(x: float) -> float:
    y = math.pi * x
    return math.sin(y) / y if y != 0.0 else 1.0


@compiled
def _window(x: float) -> float:
    """Return sinc(x) / (1 - x^2) as a sum of three shifted sincs, also valid at 0 and +-1."""
    return _sinc(x) + 0.5 * (_sinc(x - 1.0) + _sinc(x + 1.0))


def window_energy(gamma: float, even: float) -> float:
    """Return the integral of the squared acceleration of a phase; `even` is cos(2 phase)."""
    # energy E(gamma, phi) in closed form, of psi with v' = -(pi / gamma) psi
    share = math.sin(2.0 * math.pi * gamma) * even / (8.0 * math.pi * (4.0 * gamma**2 - 1.0))
    return (math.pi / gamma) ** 2 * (0.25 * gamma * (1.0 + 3.0 * gamma**2) - share)


_window_energy = inlined(window_energy)


@inlined
def _fill_energies(gamma: float, of_velocity: bool, energies: Float, point: int) -> None:
    """Fill in the energies of the phases 0 and pi / 2, or those of their velocities."""
    x, sincs = 2.0 * gamma, 0.0
    for shift in range(-2, 3 if of_velocity else -2):
        share = 1.5 if shift == 0 else 0.25 if shift % 2 == 0 else 1.0
        sincs += share * _sinc(x + shift)
    for part in range(2):
        even = 1.0 - 2.0 * part
        energies[point, part] = _window_energy(gamma, even)
        if of_velocity:
            energies[point, part] = gamma * (0.1875 + 0.125 * even * sincs)


@compiled
def fill_lines(
    points: Float, whole: float, of_velocity: bool, filled: Complex, energies: Float
) -> None:
    """Fill in the spectra of the wavelet of Mavroeidis and Papageorgiou, and energies of its parts.

    Parameters
    ----------
    points : array, shape (points, 2)
        ln T_p and the number of half cycles.
    whole : float
        Distance of two lines, inverted, in the unit of T_p.
    of_velocity : bool
        True for the spectra and energies of the parts' velocities.
    filled : array, shape (2 points, lines)
        Filled with the spectra of the phases 0 and pi / 2 of each point, one after the other.
    energies : array, shape (points, 2)
        Filled with the energies.
    """
    for p in range(points.shape[0]):
        step, gamma = math.exp(points[p, 0]) / whole, points[p, 1]
        angle, end = math.pi * gamma * step, math.pi * gamma
        turn, at = complex(math.cos(angle), math.sin(angle)), complex(1.0, 0.0)
        sine, cosine = math.sin(end), math.cos(end)
        for k in range(filled.shape[1]):
            if k % FRESH == 0:
                at = complex(math.cos(angle * k), math.sin(angle * k))
            even, odd = _pair(k * step, gamma, at.imag * cosine, at.real * sine)
            filled[2 * p, k], filled[2 * p + 1, k] = complex(0.0, even), complex(odd, 0.0)
            if of_velocity and k > 0:
                share = 0.5 / (math.pi * (k * step))
                filled[2 * p, k] = complex(share * even, 0.0)
                filled[2 * p + 1, k] = complex(0.0, -share * odd)
            at *= turn
        if of_velocity:
            filled[2 * p, 0] = 0.5 * gamma * _window(gamma)
        _fill_energies(gamma, of_velocity, energies, p)
