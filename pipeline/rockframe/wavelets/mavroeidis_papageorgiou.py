"""The wavelet of Mavroeidis and Papageorgiou (2003): a cosine in a raised-cosine window.

With gamma half cycles, the velocity is

    v(tau) = w(tau) cos(2 pi tau + phi),  w(tau) = [1 + cos(2 pi tau / gamma)] / 2

for |tau| <= gamma / 2, and zero elsewhere. The integral of the acceleration v' is zero for any
gamma and phi, because v is zero at both ends. A Gabor wavelet, which has a Gaussian window, does
not have this property. The final displacement is zero only for integer gamma >= 2, or for
phi = pi / 2.

References
----------
Mavroeidis and Papageorgiou (2003), A mathematical representation of near-fault ground motions,
Bull. Seismol. Soc. Am. 93(3).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.wavelets.mother import MotherWavelet

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

NAME: Final = "mavroeidis_papageorgiou"
_TURN: Final = 2.0 * math.pi


@lru_cache(maxsize=256)
def mavroeidis_papageorgiou(half_cycles: float) -> tuple[MotherWavelet, MotherWavelet]:
    """Return the wavelets of phase 0 and pi / 2, whose weighted sums have all phases.

    Parameters
    ----------
    half_cycles : float
        Number of half cycles, gamma [1], 1 or more.
    """
    return _of_phase(half_cycles, 0.0), _of_phase(half_cycles, 0.5 * math.pi)


def spectra(nu: Float, half_cycles: float) -> tuple[Complex, Complex]:
    """Return the spectra of the wavelets of phase 0 and pi / 2, in the time of one spectrum.

    Parameters
    ----------
    nu : array
        Frequency times T_p [1].
    half_cycles : float
        Number of half cycles, gamma [1].
    """
    found = _spectra(nu, half_cycles, np.exp(1j * math.pi * half_cycles * nu))
    return found[..., 0, :], found[..., 1, :]


def spectra_of_lines(line: float | Float, count: int, half_cycles: float | Float) -> Complex:
    """Return `spectra` at `count` frequencies from 0, `line` apart, along the axis before last."""
    nu = np.multiply.outer(line, np.arange(count, dtype=np.float64))
    return _spectra(nu, half_cycles, phase_ramp(math.pi * half_cycles * line, count))


def _spectra(nu: Float, gamma: float | Float, turned: Complex) -> Complex:
    """Return the spectra along the axis before last; `turned` is exp(i pi gamma nu)."""
    from rockframe.wavelets.loops import (
        fill,
    )  # imports numba, which most uses of wavelets do not need

    *points, count = nu.shape
    found = np.empty((*points, 2, count), dtype=np.complex128)
    numbers = np.full(points, gamma, dtype=np.float64).ravel()
    rows = (numbers.size, count)
    fill(nu.reshape(rows), numbers, turned.reshape(rows), found.reshape(-1, 2, count))
    return found


def energy(gamma: float, phi: float) -> float:
    """Return the integral of the squared acceleration of a phase [1]; `gamma` half cycles."""
    # energy E(gamma, phi) in closed form, of psi with v' = -(pi / gamma) psi
    share = math.sin(_TURN * gamma) * math.cos(2.0 * phi) / (8.0 * math.pi * (4.0 * gamma**2 - 1.0))
    return (math.pi / gamma) ** 2 * (0.25 * gamma * (1.0 + 3.0 * gamma**2) - share)


def _of_phase(gamma: float, phi: float) -> MotherWavelet:
    end = 0.5 * gamma

    def window(tau: Float) -> Float:
        return 0.5 * (1.0 + np.cos(_TURN * tau / gamma))

    def velocity(tau: Float) -> Float:
        return np.where(np.abs(tau) <= end, window(tau) * np.cos(_TURN * tau + phi), 0.0)

    def acceleration(tau: Float) -> Float:
        slope = -0.5 * _TURN / gamma * np.sin(_TURN * tau / gamma)
        inside = slope * np.cos(_TURN * tau + phi) - _TURN * window(tau) * np.sin(_TURN * tau + phi)
        return np.where(np.abs(tau) <= end, inside, 0.0)

    def displacement(tau: Float) -> Float:
        now = np.clip(tau, -end, end)
        near, slow, fast = (
            _area_of_cosine(now, end, rate, phi)
            for rate in (_TURN, _TURN * (1.0 - 1.0 / gamma), _TURN * (1.0 + 1.0 / gamma))
        )
        return 0.5 * near + 0.25 * (slow + fast)

    def spectrum(nu: Float) -> Complex:
        even, odd = spectra(nu, gamma)
        return math.cos(phi) * even + math.sin(phi) * odd

    return MotherWavelet(
        NAME,
        acceleration,
        velocity,
        displacement,
        spectrum,
        energy(gamma, phi),
        reach=end,
        finite=True,
    )


def _area_of_cosine(tau: Float, end: float, rate: float, phi: float) -> Float:
    """Return the integral of cos(rate x + phi) over x from -end to tau; the rate may be 0."""
    length = tau + end
    middle = np.cos(phi + 0.5 * rate * (tau - end))
    return np.asarray(length * middle * np.sinc(rate * length / _TURN))


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
