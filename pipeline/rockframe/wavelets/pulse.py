"""An acceleration pulse: a wavelet with amplitude, period, time, phase and half cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError, require_known
from rockframe.wavelets.family import SHAPES, MotherWavelet, mother_wavelet

Float = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """An acceleration pulse: a wavelet with amplitude, period, time, phase and half cycles.

    Parameters
    ----------
    wavelet : str
        Name of the wavelet, a key of ``WAVELETS``; or ``half_sine``, which lasts half a period;
        or ``full_sine`` or ``full_cosine``, which last one period.
    a_p : float
        Amplitude: the largest absolute acceleration [m s-2].
    T_p : float
        Period, 2 pi / omega_p [s]. The Fourier spectrum of a Ricker wavelet of any phase has its
        maximum at this period. For ``mavroeidis_papageorgiou`` it is the period of the cosine.
    time : float
        Centre of the pulse [s].
    phase : float
        Phase, from 0 to 2 pi [rad]. Rickers of fixed phase, sines and cosine: 0, or pi for the
        reversed pulse. ``ricker_any_phase``: 0 is the symmetric wavelet and pi / 2 the
        antisymmetric one. ``mavroeidis_papageorgiou``: phase of the cosine in the velocity.
    half_cycles : float, optional
        Number of half cycles of ``mavroeidis_papageorgiou``, 1 or more [1]; None for the others.

    Raises
    ------
    ParameterError
        If the wavelet is unknown, `a_p` is negative, `T_p` is not positive, `time` is not finite,
        or the wavelet does not allow the phase or the number of half cycles.

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
    half_cycles: float | None = None

    def __post_init__(self) -> None:
        require_known("wavelet", self.wavelet, SHAPES)
        if not (math.isfinite(self.a_p) and self.a_p >= 0.0):
            raise ParameterError(f"Invalid a_p {self.a_p!r}. Must be zero or positive, and finite.")
        if not (math.isfinite(self.T_p) and self.T_p > 0.0):
            raise ParameterError(f"Invalid T_p {self.T_p!r}. Must be positive and finite.")
        if not math.isfinite(self.time):
            raise ParameterError(f"Invalid time {self.time!r} of a pulse. Must be finite.")
        self._require_shape()

    def _require_shape(self) -> None:
        family = SHAPES[self.wavelet]
        if not family.free_phase and self.phase not in (0.0, math.pi):
            raise ParameterError(
                f"Invalid phase {self.phase!r}. Must be 0 or pi for a pulse of {self.wavelet}."
            )
        if not 0.0 <= self.phase <= 2.0 * math.pi:
            raise ParameterError(f"Invalid phase {self.phase!r}. Must be from 0 to 2 pi.")
        if not family.has_half_cycles and self.half_cycles is not None:
            raise ParameterError(
                f"Invalid half_cycles {self.half_cycles!r}. Must be None for {self.wavelet}."
            )
        if family.has_half_cycles and not (
            self.half_cycles is not None and 1.0 <= self.half_cycles < math.inf
        ):
            raise ParameterError(
                f"Invalid half_cycles {self.half_cycles!r} of {self.wavelet}. "
                "Must be a number, 1 or more."
            )

    @property
    def mother(self) -> MotherWavelet:
        """The wavelet of this phase and number of half cycles, with a peak of 1."""
        return mother_wavelet(self.wavelet, self.phase, self.half_cycles)

    @property
    def length_scale(self) -> float:
        """Length scale of the pulse, L_p = a_p T_p^2 [m]."""
        return self.a_p * self.T_p**2

    def acceleration(self, t: ArrayLike) -> Float:
        """Return the acceleration [m s-2] at times `t` [s]; eqs (44), (45) for Ricker wavelets."""
        return self.a_p * self.mother.acceleration(self._tau(t))

    def velocity(self, t: ArrayLike) -> Float:
        """Return the velocity [m s-1] at times `t` [s], integrated from minus infinity."""
        return self.a_p * self.T_p * self.mother.velocity(self._tau(t))

    def displacement(self, t: ArrayLike) -> Float:
        """Return the displacement [m] at times `t` [s]."""
        return self.a_p * self.T_p**2 * self.mother.displacement(self._tau(t))

    def _tau(self, t: ArrayLike) -> Float:
        return (np.asarray(t, dtype=np.float64) - self.time) / self.T_p
