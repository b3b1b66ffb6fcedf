"""Wavelets by name: Ricker, Mavroeidis and Papageorgiou, sines; and their weighted sums."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.wavelets.loops import fill, fill_lines, window_energy

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class MotherWavelet:
    """A pulse of unit period, centred at tau = 0.

    Parameters
    ----------
    name : str
        Name in datasets and on the command line.
    acceleration, velocity, displacement : callable
        Functions of tau = time / T_p [1], in units of a_p, a_p T_p and a_p T_p^2.
    spectrum : callable
        Fourier integral of the acceleration with exp(-2 pi i nu tau), a function of
        nu = frequency times T_p [1].
    energy : float
        Integral of the squared acceleration over all tau [1].
    reach : float
        |tau| beyond which the acceleration is below 1e-16.
    finite : bool
        True if the pulse ends at its reach with a kink; False if it decays smoothly.
    gaussian : tuple of float
        Height, power and rate of a spectrum height nu^power exp(-rate nu^2), times i if the power
        is odd; empty if the spectrum is another.
    """

    name: str
    acceleration: Callable[[Float], Float]
    velocity: Callable[[Float], Float]
    displacement: Callable[[Float], Float]
    spectrum: Callable[[Float], Complex]
    energy: float
    reach: float
    finite: bool = False
    gaussian: tuple[float, ...] = ()

    @property
    def extent(self) -> int | float:
        """Half-length of the pulse: its reach, in whole periods if the pulse decays smoothly."""
        return self.reach if self.finite else math.ceil(self.reach)

    @property
    def core(self) -> float:
        """The |tau| beyond which less than 1e-6 of the energy lies."""
        return self.reach if self.finite else 0.5 * self.reach


def combined(parts: Sequence[MotherWavelet], weights: Sequence[float]) -> MotherWavelet:
    """Return the weighted sum of an even and an odd wavelet, or one wavelet times its weight.

    Parameters
    ----------
    parts : sequence of MotherWavelet
        One wavelet, or an even and an odd one. The integral of the product of these is zero, so
        their energies add up.
    weights : sequence of float
        Factor of each wavelet.
    """

    def total(quantity: str) -> Callable[[Float], Any]:
        functions = [getattr(part, quantity) for part in parts]
        return lambda x: sum(w * f(x) for w, f in zip(weights, functions, strict=True))

    gaussian = parts[0].gaussian if len(parts) == 1 else ()
    return MotherWavelet(
        name=parts[0].name,
        acceleration=total("acceleration"),
        velocity=total("velocity"),
        displacement=total("displacement"),
        spectrum=total("spectrum"),
        energy=sum(w**2 * part.energy for w, part in zip(weights, parts, strict=True)),
        reach=max(part.reach for part in parts),
        finite=parts[0].finite,
        gaussian=(weights[0] * gaussian[0], *gaussian[1:]) if gaussian else (),
    )


def _gaussian(nu: Float, gaussian: tuple[float, ...]) -> Complex:
    """Return a spectrum height nu^power exp(-rate nu^2), times i if the power is odd."""
    height, power, rate = gaussian
    turn = 1j if power % 2 else 1.0
    return np.asarray(turn * (height * nu**power * np.exp(-rate * nu**2)), dtype=np.complex128)


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


_SYMMETRIC_GAUSSIAN: Final = (2.0 / math.sqrt(math.pi), 2.0, 1.0)


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


_ANTISYMMETRIC_GAUSSIAN: Final = (
    math.sqrt(2.0 * math.pi) / (BETA * _ANTISYMMETRIC_RATE**4) * (2.0 * math.pi) ** 3,
    3.0,
    1.5,
)


SYMMETRIC_RICKER: Final = MotherWavelet(
    name="symmetric_ricker",
    acceleration=_symmetric_acceleration,
    velocity=_symmetric_velocity,
    displacement=_symmetric_displacement,
    spectrum=lambda nu: _gaussian(nu, _SYMMETRIC_GAUSSIAN),
    energy=3.0 * math.sqrt(2.0) / (8.0 * math.sqrt(math.pi)),
    reach=2.1,
    gaussian=_SYMMETRIC_GAUSSIAN,
)
ANTISYMMETRIC_RICKER: Final = MotherWavelet(
    name="antisymmetric_ricker",
    acceleration=_antisymmetric_acceleration,
    velocity=_antisymmetric_velocity,
    displacement=_antisymmetric_displacement,
    spectrum=lambda nu: _gaussian(nu, _ANTISYMMETRIC_GAUSSIAN),
    energy=15.0 * math.sqrt(3.0) / (16.0 * math.sqrt(math.pi) * BETA**2),
    reach=2.7,
    gaussian=_ANTISYMMETRIC_GAUSSIAN,
)


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
    both = np.empty((2, nu.size), dtype=np.complex128)
    fill(nu, half_cycles, both)
    return both[0], both[1]


def spectra_of_lines(line: float, count: int, half_cycles: float) -> Complex:
    """Return `spectra`, shape (2, count), at `count` frequencies from 0, `line` apart."""
    both = np.empty((2, count), dtype=np.complex128)
    point = np.array([[math.log(line), half_cycles]])
    fill_lines(point, 1.0, False, both, np.empty((1, 2)))
    return both


def energy(gamma: float, phi: float) -> float:
    """Return the integral of the squared acceleration of a phase [1]; `gamma` half cycles."""
    return window_energy(gamma, math.cos(2.0 * phi))


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

    def spectra(self, line: float, count: int, half_cycles: float | None) -> Complex:
        """Return the Fourier integrals of the parts, shape (parts, count).

        Parameters
        ----------
        line : float
            Step of the frequency times T_p [1].
        count : int
            Number of frequencies, starting at 0.
        half_cycles : float or None
            Number of half cycles [1].
        """
        if self.has_half_cycles and half_cycles is not None:
            return spectra_of_lines(line, count, half_cycles)
        nu = line * np.arange(count, dtype=np.float64)
        return np.stack([part.spectrum(nu) for part in self.parts(None)])

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
def mother_wavelet(name: str, phase: float, half_cycles: float | None) -> MotherWavelet:
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
