"""Motion of points of a column that rocks about the corners of its base, eqs (7) to (12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Lever:
    """The line from the pivot of a column to a point of the column.

    Parameters
    ----------
    length : float
        Length of the line [m].
    angle : float
        Angle of the line from the vertical at rest [rad]. The point is highest at this |theta|.

    Examples
    --------
    >>> float(Lever(2.0, 0.1).lift(0.1).round(6))
    0.009992
    """

    length: float
    angle: float

    def shift(self, theta: ArrayLike) -> Float:
        """Return the horizontal displacement at a rotation [m]."""
        theta = np.asarray(theta, dtype=np.float64)
        # sin(angle) - sin(angle - |theta|) without cancellation at small theta
        half = 0.5 * np.abs(theta)
        u: Float = np.sign(theta) * np.sin(half) * np.cos(self.angle - half)
        return 2.0 * self.length * u

    def lift(self, theta: ArrayLike) -> Float:
        """Return the vertical displacement at a rotation [m]."""
        half = 0.5 * np.abs(np.asarray(theta, dtype=np.float64))
        v: Float = np.sin(half) * np.sin(self.angle - half)
        return 2.0 * self.length * v

    def shift_rate(self, theta: ArrayLike, omega: ArrayLike) -> Float:
        """Return the horizontal velocity [m s-1] at a rotation and its rate."""
        phi = self.angle - np.abs(np.asarray(theta, dtype=np.float64))
        rate: Float = self.length * np.cos(phi) * np.asarray(omega)
        return rate

    def lift_rate(self, theta: ArrayLike, omega: ArrayLike) -> Float:
        """Return the vertical velocity [m s-1] at a rotation and its rate."""
        theta, omega = np.asarray(theta, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        side = _side(theta, omega)
        rate: Float = self.length * side * np.sin(self.angle - np.abs(theta)) * omega
        return rate

    def acceleration(
        self, theta: ArrayLike, omega: ArrayLike, omega_rate: ArrayLike
    ) -> tuple[Float, Float]:
        """Return the horizontal and vertical acceleration relative to the ground [m s-2]."""
        theta, omega = np.asarray(theta, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        growth = np.asarray(omega_rate, dtype=np.float64)
        phi = self.angle - np.abs(theta)
        sine, cosine, square = _side(theta, omega) * np.sin(phi), np.cos(phi), omega**2
        return (
            self.length * (cosine * growth + sine * square),
            self.length * (sine * growth - cosine * square),
        )


def _side(theta: Float, omega: Float) -> Float:
    """Return sgn(theta), or at theta = 0 the side to which the frame starts to rotate."""
    return np.where(theta == 0.0, np.sign(omega), np.sign(theta))
