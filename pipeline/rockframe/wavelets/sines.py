"""Pulses of textbooks: half a period of a sine, and a period of a sine or a cosine.

Unlike the wavelets, they end with a kink or a jump. After a half sine the ground keeps moving, and
after a full sine it stays displaced. They are excitations with known closed-form responses, and are
not searched for in records.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.wavelets.mother import Complex, MotherWavelet

Float = NDArray[np.float64]

_TWO_PI: Final = 2.0 * math.pi


def _inside(tau: Float, reach: float) -> Float:
    return np.asarray(np.abs(tau) <= reach, dtype=np.float64)


def _half_sine_velocity(tau: Float) -> Float:
    return (np.sin(_TWO_PI * np.clip(tau, -0.25, 0.25)) + 1.0) / _TWO_PI


def _half_sine_displacement(tau: Float) -> Float:
    x = np.clip(tau, -0.25, 0.25)
    after = np.maximum(tau - 0.25, 0.0) / math.pi
    return (x + 0.25 - np.cos(_TWO_PI * x) / _TWO_PI) / _TWO_PI + after


def _full_sine_velocity(tau: Float) -> Float:
    return (np.cos(_TWO_PI * np.clip(tau, -0.5, 0.5)) + 1.0) / _TWO_PI


def _full_sine_displacement(tau: Float) -> Float:
    x = np.clip(tau, -0.5, 0.5)
    return (x + 0.5 + np.sin(_TWO_PI * x) / _TWO_PI) / _TWO_PI


def _full_cosine_velocity(tau: Float) -> Float:
    return -np.sin(_TWO_PI * np.clip(tau, -0.5, 0.5)) / _TWO_PI


def _full_cosine_displacement(tau: Float) -> Float:
    return (np.cos(_TWO_PI * np.clip(tau, -0.5, 0.5)) + 1.0) / _TWO_PI**2


def _spectrum(nu: Float, length: float, odd: bool = False) -> Complex:
    """Return the Fourier integral of cos(2 pi tau), or of sin, over a length in periods."""
    below, above = np.sinc(length * (nu - 1.0)), np.sinc(length * (nu + 1.0))
    total = -1j * (below - above) if odd else below + above
    return np.asarray(0.5 * length * total, dtype=np.complex128)


#: a_p sin(omega_p t) over half a period.
HALF_SINE: Final = MotherWavelet(
    name="half_sine",
    acceleration=lambda tau: np.cos(_TWO_PI * tau) * _inside(tau, 0.25),
    velocity=_half_sine_velocity,
    displacement=_half_sine_displacement,
    spectrum=lambda nu: _spectrum(nu, 0.5),
    energy=0.25,
    reach=0.25,
    finite=True,
)
#: a_p sin(omega_p t) over a period; the velocity does not change its sign.
FULL_SINE: Final = MotherWavelet(
    name="full_sine",
    acceleration=lambda tau: -np.sin(_TWO_PI * tau) * _inside(tau, 0.5),
    velocity=_full_sine_velocity,
    displacement=_full_sine_displacement,
    spectrum=lambda nu: -_spectrum(nu, 1.0, odd=True),
    energy=0.5,
    reach=0.5,
    finite=True,
)
#: a_p cos(omega_p t) over a period; the displacement does not change its sign.
FULL_COSINE: Final = MotherWavelet(
    name="full_cosine",
    acceleration=lambda tau: -np.cos(_TWO_PI * tau) * _inside(tau, 0.5),
    velocity=_full_cosine_velocity,
    displacement=_full_cosine_displacement,
    spectrum=lambda nu: -_spectrum(nu, 1.0),
    energy=0.5,
    reach=0.5,
    finite=True,
)
