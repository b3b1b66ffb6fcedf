"""Mother wavelets of acceleration pulses in closed form: Makris and Vassiliou (2013), section 6.

Each is scaled so that its largest absolute value is 1, and depends on tau = (t - time) / T_p alone.
Acceleration, velocity and displacement all vanish at both ends: a physically realizable pulse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError

Float = NDArray[np.float64]

#: Normalises eq (45) to a maximum of 1: sqrt(18 - 6 sqrt 6) exp((sqrt 6 - 3) / 2) = 1.3801.
BETA: Final = math.sqrt(18.0 - 6.0 * math.sqrt(6.0)) * math.exp(0.5 * (math.sqrt(6.0) - 3.0))
#: x = _ANTISYMMETRIC_RATE tau is the variable of the antisymmetric wavelet, eq (45) corrected.
_ANTISYMMETRIC_RATE: Final = 2.0 * math.pi / math.sqrt(3.0)


@dataclass(frozen=True)
class MotherWavelet:
    """A pulse of unit amplitude and unit period, centred at tau = 0.

    Parameters
    ----------
    name : str
        Its name in datasets and on the command line.
    acceleration, velocity, displacement : callable
        Functions of tau [1]; units of a_p, a_p T_p and a_p T_p^2.
    energy : float
        Integral of acceleration squared over all tau [1].
    reach : float
        |tau| beyond which the acceleration is below 1e-16.
    """

    name: str
    acceleration: Callable[[Float], Float]
    velocity: Callable[[Float], Float]
    displacement: Callable[[Float], Float]
    energy: float
    reach: float


def _symmetric_acceleration(tau: Float) -> Float:
    """Eq (44)."""
    y = (math.pi * tau) ** 2
    return (1.0 - 2.0 * y) * np.exp(-y)


def _symmetric_velocity(tau: Float) -> Float:
    return tau * np.exp(-((math.pi * tau) ** 2))


def _symmetric_displacement(tau: Float) -> Float:
    return -np.exp(-((math.pi * tau) ** 2)) / (2.0 * math.pi**2)


def _antisymmetric_acceleration(tau: Float) -> Float:
    """Eq (45), with the factor 2 pi / (sqrt 3 T_p) that the printed equation lacks."""
    x = _ANTISYMMETRIC_RATE * tau
    return (x**2 - 3.0) * x * np.exp(-0.5 * x**2) / BETA


def _antisymmetric_velocity(tau: Float) -> Float:
    x = _ANTISYMMETRIC_RATE * tau
    return (1.0 - x**2) * np.exp(-0.5 * x**2) / (BETA * _ANTISYMMETRIC_RATE)


def _antisymmetric_displacement(tau: Float) -> Float:
    x = _ANTISYMMETRIC_RATE * tau
    return x * np.exp(-0.5 * x**2) / (BETA * _ANTISYMMETRIC_RATE**2)


SYMMETRIC_RICKER: Final = MotherWavelet(
    name="symmetric_ricker",
    acceleration=_symmetric_acceleration,
    velocity=_symmetric_velocity,
    displacement=_symmetric_displacement,
    energy=3.0 * math.sqrt(2.0) / (8.0 * math.sqrt(math.pi)),
    reach=2.1,
)
ANTISYMMETRIC_RICKER: Final = MotherWavelet(
    name="antisymmetric_ricker",
    acceleration=_antisymmetric_acceleration,
    velocity=_antisymmetric_velocity,
    displacement=_antisymmetric_displacement,
    energy=15.0 * math.sqrt(3.0) / (16.0 * math.sqrt(math.pi) * BETA**2),
    reach=2.7,
)
#: The mother wavelets by name, in the order of tables and datasets.
WAVELETS: Final[Mapping[str, MotherWavelet]] = MappingProxyType(
    {wavelet.name: wavelet for wavelet in (SYMMETRIC_RICKER, ANTISYMMETRIC_RICKER)}
)


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """An acceleration pulse: a mother wavelet with amplitude, period, time and phase.

    Parameters
    ----------
    wavelet : str
        Name of the mother wavelet, a key of ``WAVELETS``.
    a_p : float
        Amplitude: the largest absolute acceleration [m s-2].
    T_p : float
        Period, 2 pi / omega_p; the period that maximises the Fourier spectrum [s].
    time : float
        Centre of the pulse [s].
    phase : float
        0, or pi for the reversed pulse [rad].

    Raises
    ------
    ParameterError
        If the wavelet is unknown, `a_p` is negative, `T_p` not positive, `time` not finite,
        or the phase neither.

    Examples
    --------
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.5)
    >>> float(pulse.acceleration(0.0))
    3.0
    >>> pulse.length_scale
    6.75
    """

    wavelet: str
    a_p: float
    T_p: float
    time: float = 0.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        if self.wavelet not in WAVELETS:
            raise ParameterError(
                f"Invalid wavelet {self.wavelet!r}. Must be one of: {', '.join(WAVELETS)}."
            )
        if not (math.isfinite(self.a_p) and self.a_p >= 0.0):
            raise ParameterError(f"Invalid a_p {self.a_p!r}. Must be zero or positive, and finite.")
        if not (math.isfinite(self.T_p) and self.T_p > 0.0):
            raise ParameterError(f"Invalid T_p {self.T_p!r}. Must be positive and finite.")
        if not math.isfinite(self.time):
            raise ParameterError(f"Invalid time {self.time!r} of a pulse. Must be finite.")
        if self.phase not in (0.0, math.pi):
            raise ParameterError(
                f"Invalid phase {self.phase!r}. Must be 0 or pi for a Ricker pulse."
            )

    @property
    def mother(self) -> MotherWavelet:
        """The mother wavelet."""
        return WAVELETS[self.wavelet]

    @property
    def length_scale(self) -> float:
        """Length scale of the pulse, L_p = a_p T_p^2 [m]."""
        return self.a_p * self.T_p**2

    def acceleration(self, t: ArrayLike) -> Float:
        """Acceleration [m s-2] at times `t` [s], eqs (44), (45)."""
        return self._signed * self.mother.acceleration(self._tau(t))

    def velocity(self, t: ArrayLike) -> Float:
        """Velocity [m s-1] at times `t` [s]; its integral from minus infinity."""
        return self._signed * self.T_p * self.mother.velocity(self._tau(t))

    def displacement(self, t: ArrayLike) -> Float:
        """Displacement [m] at times `t` [s]."""
        return self._signed * self.T_p**2 * self.mother.displacement(self._tau(t))

    @property
    def _signed(self) -> float:
        return self.a_p if self.phase == 0.0 else -self.a_p

    def _tau(self, t: ArrayLike) -> Float:
        return (np.asarray(t, dtype=np.float64) - self.time) / self.T_p
