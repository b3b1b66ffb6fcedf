"""The symmetric and antisymmetric Ricker wavelets: Makris and Vassiliou (2013), section 6.

Both are scaled to a peak of 1. Acceleration, velocity and displacement tend to zero at both ends,
so the ground ends where it began.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.wavelets.mother import MotherWavelet

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Normalises eq (45) to a maximum of 1: sqrt(18 - 6 sqrt 6) exp((sqrt 6 - 3) / 2) = 1.3801.
BETA: Final = math.sqrt(18.0 - 6.0 * math.sqrt(6.0)) * math.exp(0.5 * (math.sqrt(6.0) - 3.0))
#: x = _ANTISYMMETRIC_RATE tau is the variable of the antisymmetric wavelet, eq (45) corrected.
_ANTISYMMETRIC_RATE: Final = 2.0 * math.pi / math.sqrt(3.0)


def _symmetric_acceleration(tau: Float) -> Float:
    """Return the acceleration of eq (44)."""
    y = (math.pi * tau) ** 2
    return (1.0 - 2.0 * y) * np.exp(-y)


def _symmetric_velocity(tau: Float) -> Float:
    return tau * np.exp(-((math.pi * tau) ** 2))


def _symmetric_displacement(tau: Float) -> Float:
    return -np.exp(-((math.pi * tau) ** 2)) / (2.0 * math.pi**2)


def _symmetric_spectrum(nu: Float) -> Complex:
    return np.asarray(2.0 / math.sqrt(math.pi) * nu**2 * np.exp(-(nu**2)), dtype=np.complex128)


def _antisymmetric_acceleration(tau: Float) -> Float:
    """Return the acceleration of eq (45), with the factor 2 pi / (sqrt 3 T_p) missing in print."""
    x = _ANTISYMMETRIC_RATE * tau
    return (x**2 - 3.0) * x * np.exp(-0.5 * x**2) / BETA


def _antisymmetric_velocity(tau: Float) -> Float:
    x = _ANTISYMMETRIC_RATE * tau
    return (1.0 - x**2) * np.exp(-0.5 * x**2) / (BETA * _ANTISYMMETRIC_RATE)


def _antisymmetric_displacement(tau: Float) -> Float:
    x = _ANTISYMMETRIC_RATE * tau
    return x * np.exp(-0.5 * x**2) / (BETA * _ANTISYMMETRIC_RATE**2)


def _antisymmetric_spectrum(nu: Float) -> Complex:
    height = math.sqrt(2.0 * math.pi) / (BETA * _ANTISYMMETRIC_RATE**4)
    size = height * (2.0 * math.pi * nu) ** 3 * np.exp(-1.5 * nu**2)
    return np.asarray(1j * size, dtype=np.complex128)


SYMMETRIC_RICKER: Final = MotherWavelet(
    name="symmetric_ricker",
    acceleration=_symmetric_acceleration,
    velocity=_symmetric_velocity,
    displacement=_symmetric_displacement,
    spectrum=_symmetric_spectrum,
    energy=3.0 * math.sqrt(2.0) / (8.0 * math.sqrt(math.pi)),
    reach=2.1,
)
ANTISYMMETRIC_RICKER: Final = MotherWavelet(
    name="antisymmetric_ricker",
    acceleration=_antisymmetric_acceleration,
    velocity=_antisymmetric_velocity,
    displacement=_antisymmetric_displacement,
    spectrum=_antisymmetric_spectrum,
    energy=15.0 * math.sqrt(3.0) / (16.0 * math.sqrt(math.pi) * BETA**2),
    reach=2.7,
)
