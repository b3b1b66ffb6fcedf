"""Weightings of the transform: the power of the period that multiplies the inner product."""

from __future__ import annotations

from enum import StrEnum
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


class Weighting(StrEnum):
    """Weighting that makes coefficients of different periods comparable.

    The coefficient is s^-q E^(-1/2) <a, psi((t - xi) / s)> with E the energy of psi.

    ``ENERGY``
        q = 1/2, as in the paper: each daughter wavelet has unit energy, and |C| is the length of
        the projection of the record on it. Only this q recovers the period of a record that is
        itself such a wavelet (Cauchy-Schwarz).
    ``AREA``
        q = 1: biased to short periods; Ricker pulses are found at 0.82 or 0.87 of their period.
    ``NONE``
        q = 0: biased to long periods; Ricker pulses are found at 1.22 or 1.15 of their period.
    ``VELOCITY``
        q = 1/2 with the velocities of record and wavelet in place of the accelerations. This equals
        the transform of the acceleration by the integrated wavelet with s^(+1/2), so that long
        periods win in records with several pulses.

    Examples
    --------
    >>> Weighting("area").exponent
    1.0
    """

    ENERGY = "energy"
    AREA = "area"
    NONE = "none"
    VELOCITY = "velocity"

    @property
    def exponent(self) -> float:
        """q, the power of 1 / period."""
        return _EXPONENTS[self]

    def of_square(self, period: Float) -> Float:
        """Return the factor on the square of a coefficient with the weighting ``energy``."""
        return np.asarray(period) ** (1.0 - 2.0 * self.exponent)

    @property
    def of_velocity(self) -> bool:
        """True if velocities are compared, not accelerations."""
        return self is Weighting.VELOCITY


_EXPONENTS: Final = MappingProxyType(
    {
        Weighting.ENERGY: 0.5,
        Weighting.AREA: 1.0,
        Weighting.NONE: 0.0,
        Weighting.VELOCITY: 0.5,
    }
)
