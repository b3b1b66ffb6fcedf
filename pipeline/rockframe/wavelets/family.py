"""Wavelets by name, with their free parameters: phase and number of half cycles."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np

from rockframe.errors import ParameterError
from rockframe.wavelets.mavroeidis_papageorgiou import (
    NAME,
    mavroeidis_papageorgiou,
    spectra_of_lines,
)
from rockframe.wavelets.mother import Complex, Float, MotherWavelet, combined
from rockframe.wavelets.ricker import ANTISYMMETRIC_RICKER, SYMMETRIC_RICKER
from rockframe.wavelets.sines import FULL_COSINE, FULL_SINE, HALF_SINE

#: The two wavelets of Makris and Vassiliou (2013), by name.
RICKERS: Final[Mapping[str, MotherWavelet]] = MappingProxyType(
    {wavelet.name: wavelet for wavelet in (SYMMETRIC_RICKER, ANTISYMMETRIC_RICKER)}
)
_ANY_PHASE: Final = "ricker_any_phase"
#: Number of points in a search for the peak of a wavelet, and number of refinements.
_PEAK_POINTS: Final = 401
_PEAK_ROUNDS: Final = 4


@dataclass(frozen=True)
class Family:
    """All wavelets with one name. They are the weighted sums of one or two parts.

    Parameters
    ----------
    name : str
        Name in datasets and on the command line.
    parts : callable
        Function of the number of half cycles (None for wavelets without this parameter). It returns
        one wavelet, or an even and an odd one whose weighted sums have all phases.
    has_half_cycles : bool
        True if the number of half cycles is a parameter.

    Examples
    --------
    >>> [family.free_phase for family in WAVELETS.values()]
    [False, False, True, True]
    """

    name: str
    parts: Callable[[float | None], tuple[MotherWavelet, ...]]
    has_half_cycles: bool = False

    def spectra(
        self, line: float | Float, count: int, half_cycles: float | Float | None
    ) -> Complex:
        """Return the Fourier integrals of the parts, along the axis before the frequencies.

        Parameters
        ----------
        line : float, or array of shape (points,)
            Step of the frequency times T_p [1].
        count : int
            Number of frequencies, starting at 0.
        half_cycles : float, array of shape (points,), or None
            Number of half cycles [1].
        """
        if self.has_half_cycles and half_cycles is not None:
            return spectra_of_lines(line, count, half_cycles)
        nu = np.multiply.outer(line, np.arange(count, dtype=np.float64))
        spectra = [part.spectrum(nu)[..., None, :] for part in self.parts(None)]
        return spectra[0] if len(spectra) == 1 else np.concatenate(spectra, axis=-2)

    @property
    def free_phase(self) -> bool:
        """True if any phase is possible, not only 0 and pi."""
        return len(self.parts(2.0)) == 2


@cache
def _any_phase_parts(_half_cycles: float | None) -> tuple[MotherWavelet, ...]:
    """Return both Ricker wavelets with unit energy, so that all phases have equal weight."""
    return tuple(combined([part], [part.energy**-0.5]) for part in RICKERS.values())


def _mavroeidis_papageorgiou_parts(half_cycles: float | None) -> tuple[MotherWavelet, ...]:
    if half_cycles is None:
        raise ParameterError(f"Invalid half_cycles None of {NAME}. Must be a number, 1 or more.")
    return mavroeidis_papageorgiou(half_cycles)


#: The wavelets by name, in the order of tables and datasets.
WAVELETS: Final[Mapping[str, Family]] = MappingProxyType(
    {
        family.name: family
        for family in (
            Family(SYMMETRIC_RICKER.name, lambda _: (SYMMETRIC_RICKER,)),
            Family(ANTISYMMETRIC_RICKER.name, lambda _: (ANTISYMMETRIC_RICKER,)),
            Family(_ANY_PHASE, _any_phase_parts),
            Family(NAME, _mavroeidis_papageorgiou_parts, has_half_cycles=True),
        )
    }
)
#: All shapes of a pulse: the wavelets, which are searched for in records, and sines and cosines.
SHAPES: Final[Mapping[str, Family]] = MappingProxyType(
    {
        **WAVELETS,
        HALF_SINE.name: Family(HALF_SINE.name, lambda _: (HALF_SINE,)),
        FULL_SINE.name: Family(FULL_SINE.name, lambda _: (FULL_SINE,)),
        FULL_COSINE.name: Family(FULL_COSINE.name, lambda _: (FULL_COSINE,)),
    }
)


@lru_cache(maxsize=1024)
def mother_of(name: str, phase: float, half_cycles: float | None) -> MotherWavelet:
    """Return the wavelet of a phase and number of half cycles, scaled to a peak of 1.

    Raises
    ------
    ParameterError
        If the wavelet needs a number of half cycles and has none.
    """
    parts = SHAPES[name].parts(half_cycles)
    if len(parts) == 1:
        return combined(parts, [1.0 if phase == 0.0 else -1.0])
    weights = np.array([math.cos(phase), math.sin(phase)])
    return combined(parts, list(weights / _largest(combined(parts, list(weights)))))


def phase_and_amplitude(
    name: str, half_cycles: float | None, coefficients: tuple[float, ...]
) -> tuple[float, float]:
    """Return the phase and the peak of a weighted sum of a wavelet's parts.

    Parameters
    ----------
    name : str
        Name of the wavelet.
    half_cycles : float or None
        Number of half cycles.
    coefficients : tuple of float
        A factor for each part of the wavelet, in any unit.

    Returns
    -------
    phase : float
        Phase, from 0 to 2 pi [rad].
    amplitude : float
        Peak, in the unit of the coefficients.

    Examples
    --------
    >>> phase_and_amplitude("symmetric_ricker", None, (-3.0,))
    (3.141592653589793, 3.0)
    """
    if len(coefficients) == 1:
        return (0.0 if coefficients[0] >= 0.0 else math.pi), abs(coefficients[0])
    phase = math.atan2(coefficients[1], coefficients[0]) % (2.0 * math.pi)
    parts = WAVELETS[name].parts(half_cycles)
    unit = combined(parts, [math.cos(phase), math.sin(phase)])
    return phase, math.hypot(*coefficients) * _largest(unit)


def _largest(wavelet: MotherWavelet) -> float:
    """Return the largest absolute acceleration, located between sampled points."""
    low, high = -wavelet.reach, wavelet.reach
    for _ in range(_PEAK_ROUNDS):
        tau = np.linspace(low, high, _PEAK_POINTS)
        height = np.abs(wavelet.acceleration(tau))
        i = int(height.argmax())
        low, high = tau[max(i - 1, 0)], tau[min(i + 1, _PEAK_POINTS - 1)]
    return float(height[i])
