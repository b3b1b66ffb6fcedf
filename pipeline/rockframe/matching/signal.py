"""Padded records, their resolved periods, spectra of wavelets, and cuts of a record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from types import MappingProxyType
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.loops import cut_samples, strong_blocks
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import WAVELETS, energy

Float = NDArray[np.float64]


class Weighting(StrEnum):
    """Weighting of coefficients of different periods.

    The coefficient is s^-q E^(-1/2) <a, psi((t - xi) / s)>, with E the energy of psi.

    ``ENERGY``
        q = 1/2, as in the paper: each daughter wavelet has unit energy, and |C| is the length of
        the projection of the record on it. Only this q recovers the period of a record that is
        itself such a wavelet (Cauchy-Schwarz).
    ``AREA``
        q = 1: biased to short periods. Ricker pulses are found at 0.82 (symmetric) or 0.87
        (antisymmetric) of their period.
    ``NONE``
        q = 0: biased to long periods. Ricker pulses are found at 1.22 or 1.15 of their period.
    ``VELOCITY``
        q = 1/2 with the velocities of record and wavelet in place of the accelerations. This equals
        the transform of the acceleration with the integrated wavelet and s^(+1/2). In records with
        several pulses, it therefore selects long periods.

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
        """Power q of 1 / period."""
        return _EXPONENTS[self]

    @property
    def power_of_square(self) -> float:
        """Power of the period that converts squares with the weighting ``energy`` to this one."""
        return 1.0 - 2.0 * self.exponent

    def of_square(self, period: Float) -> Float:
        """Return the factor that converts squares with the weighting ``energy`` to this one."""
        return np.asarray(period) ** self.power_of_square

    @property
    def of_velocity(self) -> bool:
        """True if velocities are compared instead of accelerations."""
        return self is Weighting.VELOCITY


_EXPONENTS: Final = MappingProxyType(
    {
        Weighting.ENERGY: 0.5,
        Weighting.AREA: 1.0,
        Weighting.NONE: 0.0,
        Weighting.VELOCITY: 0.5,
    }
)


Complex = NDArray[np.complex128]
#: Samples of records are in double precision, those of surrogates in single precision.
Samples = Float | NDArray[np.float32]

#: A record is constant to round-off if its samples differ by less than this share of the peak.
_CONSTANT: Final = 1e-9
#: Largest peak of a record [m s-2]; the least is its inverse. Beyond them squares could overflow or
#: underflow in single precision.
_STRONGEST: Final = 1e15
#: Number of points of the sum for a wavelet's squared velocity, which is smooth and zero at both
#: ends.
_VELOCITY_POINTS: Final = 4001


@dataclass(frozen=True, eq=False)
class Signal:
    """A record padded and transformed for comparison with wavelets.

    Parameters
    ----------
    samples : array, shape (samples,) or (signals, samples)
        Acceleration [m s-2] or velocity [m s-1].
    time_step : float
        Interval between samples [s].
    weighting : Weighting
        Weighting of the transform.
    padded : int
        Number of samples including the zeros after them, which prevent wavelets from wrapping
        around.
    spectrum : array, shape (padded // 2 + 1,) or (signals, padded // 2 + 1)
        Fourier integral of the padded samples, at multiples of 1 / (padded time_step).
    start : float
        Time of the first sample [s].
    """

    samples: Samples
    time_step: float
    weighting: Weighting
    padded: int
    spectrum: Complex | NDArray[np.complex64]
    start: float = 0.0

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.time_step * float(self.samples.shape[-1] - 1)

    @property
    def period(self) -> float:
        """Duration including the zeros [s]."""
        return self.time_step * self.padded

    @property
    def energy(self) -> float:
        """Integral of the square of the samples."""
        return float(np.dot(self.samples, self.samples)) * self.time_step


def transform_record(
    acceleration: Samples, time_step: float, weighting: Weighting, longest_reach: float
) -> Signal:
    """Pad and transform a record.

    Parameters
    ----------
    acceleration : array, shape (samples,) or (signals, samples)
        Acceleration [m s-2], checked by `require_record`.
    time_step : float
        Interval between samples [s].
    weighting : Weighting
        Weighting; with ``VELOCITY`` the record is integrated.
    longest_reach : float
        Largest distance from the centre at which the longest wavelet is not zero [s].

    Raises
    ------
    ParameterError
        If velocities are compared and the record's velocity is zero throughout.
    """
    samples = integrate_velocity(acceleration, time_step) if weighting.of_velocity else acceleration
    if weighting.of_velocity and not samples.any():  # samples that alternate in sign
        raise ParameterError("Invalid acceleration: its velocity is zero at all samples.")
    padded = padded_size(samples.shape[-1] + math.ceil(longest_reach / time_step))
    return padded_signal(samples, time_step, weighting, padded)


def padded_signal(
    samples: Samples, time_step: float, weighting: Weighting, padded: int, start: float = 0.0
) -> Signal:
    """Pad samples of acceleration or velocity with zeros, and transform them."""
    spectrum = scipy.fft.rfft(samples, padded) * time_step
    return Signal(samples, time_step, weighting, padded, spectrum, start)


def integrate_velocity(acceleration: Samples, time_step: float) -> Float:
    """Return the velocity of a record that starts at rest [m s-1], by the trapezoidal rule.

    Examples
    --------
    >>> integrate_velocity(np.array([0.0, 1.0, 2.0]), 0.5).tolist()
    [0.0, 0.25, 1.0]
    """
    areas = 0.5 * time_step * (acceleration[..., 1:] + acceleration[..., :-1])
    start = np.zeros((*acceleration.shape[:-1], 1))
    return np.concatenate([start, np.cumsum(areas, axis=-1, dtype=np.float64)], axis=-1)


def padded_size(least: int) -> int:
    """Return one of a few padded lengths; records of similar length then share cached spectra.

    Examples
    --------
    >>> padded_size(8000), padded_size(8100)
    (8192, 8192)
    """
    step = 1 << max(1, least.bit_length() - 4)
    return -(-least // step) * step


def require_record(acceleration: Float, time_step: float) -> Float:
    """Return the samples of a record after checking that a pulse can be searched in it.

    Raises
    ------
    ParameterError
        If the samples are not one row of finite numbers, are all equal, or are too large or too
        small for their squares; or if the time step is not positive.
    """
    samples = np.asarray(acceleration, dtype=np.float64)
    if samples.ndim != 1 or samples.size < 2:
        raise ParameterError(
            f"Invalid acceleration of shape {samples.shape}. Must be one row of two samples or "
            "more."
        )
    if not (math.isfinite(time_step) and time_step > 0.0):
        raise ParameterError(f"Invalid time step {time_step!r} s. Must be positive and finite.")
    if not np.isfinite(samples).all():
        raise ParameterError("Invalid acceleration: not all samples are finite.")
    largest = float(np.abs(samples).max())
    if largest == 0.0:
        raise ParameterError("Invalid acceleration: all samples are zero, there is no pulse.")
    if float(np.ptp(samples)) <= _CONSTANT * largest:
        raise ParameterError("Invalid acceleration: all samples are equal, there is no pulse.")
    if not 1.0 / _STRONGEST < largest < _STRONGEST:
        raise ParameterError(
            f"Invalid acceleration: peak {largest:g} m/s2. Must be from {1.0 / _STRONGEST:g} to "
            f"{_STRONGEST:g}, so that squares can be computed."
        )
    return samples


@lru_cache(maxsize=4096)
def part_energies(wavelet: str, half_cycles: float | None, of_velocity: bool) -> tuple[float, ...]:
    """Return the energy of each part of a wavelet, or of its velocity [1]."""
    if half_cycles is not None and not of_velocity and WAVELETS[wavelet].has_half_cycles:
        return energy(half_cycles, 0.0), energy(half_cycles, 0.5 * math.pi)  # of many half cycles
    parts = WAVELETS[wavelet].parts(half_cycles)
    if not of_velocity:
        return tuple(part.energy for part in parts)
    energies = []
    for part in parts:
        tau, step = np.linspace(-part.reach, part.reach, _VELOCITY_POINTS, retstep=True)
        energies.append(float((part.velocity(tau) ** 2).sum() * step))
    return tuple(energies)


def part_spectra(
    wavelet: str, half_cycles: float | None, line: float, count: int, of_velocity: bool
) -> Complex:
    """Return the spectra of a wavelet's parts, or of their velocities, shape (parts, count).

    The `count` values of frequency times T_p start at 0 and are `line` apart.
    """
    spectra = WAVELETS[wavelet].spectra(line, count, half_cycles)
    if of_velocity:
        nu = line * np.arange(1, count, dtype=np.float64)
        spectra[:, 1:] /= 2j * math.pi * nu
        spectra[:, 0] = _displacements(wavelet, half_cycles)
    return spectra


@lru_cache(maxsize=4096)
def _displacements(wavelet: str, half_cycles: float | None) -> tuple[float, ...]:
    """Return the integral of the velocity of each part of a wavelet [1]."""
    parts = WAVELETS[wavelet].parts(half_cycles)
    ends = [part.displacement(np.array([-part.reach, part.reach])) for part in parts]
    return tuple(float(end - start) for start, end in ends)


#: Least number of time steps in the period of a wavelet.
_STEPS_PER_PERIOD: Final = 8


def period_range(size: int, time_step: float, options: PulseOptions) -> tuple[float, float]:
    """Return the range of periods that a record resolves [s].

    Raises
    ------
    ParameterError
        If the record resolves none of the requested periods.
    """
    shortest, longest = options.periods_s
    low = max(shortest, _STEPS_PER_PERIOD * time_step)
    high = min(longest, time_step * (size - 1))
    if high <= low:
        raise ParameterError(
            f"Invalid range of periods from {shortest:g} to {longest:g} s for a record of "
            f"{time_step * (size - 1):g} s in steps of {time_step:g} s. Must overlap with the "
            f"range from {_STEPS_PER_PERIOD} time steps to the record's duration."
        )
    return low, high


def prepared(
    samples: Samples, time_step: float, options: PulseOptions, longest_period: float
) -> Signal:
    """Return the transformed record, padded for the longest wavelet."""
    parts = [
        part for name in options.wavelet for part in WAVELETS[name].parts(options.most_half_cycles)
    ]
    reach = max(part.reach for part in parts) * longest_period
    return transform_record(samples, time_step, Weighting(options.weighting), reach)


#: Factor of the least energy, for safety: at the coarse times of the search, a few thousandths of a
#: wavelet's energy are outside the times in which it is not zero.
_SAFE: Final = 0.98
#: Number of samples kept on either side of the times of the search. Without high frequencies a
#: record that ends suddenly rings beyond its end, and wavelets there need what rings.
_RINGING: Final = 8
#: Room around a pulse, so that a maximum may move during refinement: factor of the period, shift in
#: time relative to the period, and increase of the number of half cycles.
_LONGER: Final = 1.15
_LATER: Final = 0.25
_MORE: Final = 0.5
#: Number of further samples at either end, and their taper. A sudden end would change the
#: interpolation between samples, and move flat maxima by 5e-5.
_BESIDE: Final = 64
_RISE: Final = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, _BESIDE))


def strong_stretch(
    signal: Signal, within: int, far: tuple[float, float], floor: Float
) -> tuple[Signal, NDArray[np.intp], range]:
    """Cut records to the times at which wavelets can explain at least an energy.

    Returns the cut records that have such times, all of one length; their indices; and the indices
    of their samples at these times.

    Parameters
    ----------
    signal : Signal
        The records, in single precision, at the times of the search and, cyclically, beyond.
    within : int
        Number of samples at the times of the search.
    far : tuple of float
        Two distances from the centre [s]: nearly all energy of the wavelet is within the first, and
        it is zero beyond the second.
    floor : array, shape (signals,)
        The least energy of each record.
    """
    if not floor.any():
        return signal, np.arange(floor.size), range(within)
    half = math.ceil(far[0] / signal.time_step) + 1
    block = max(1, half // 4)
    ends = np.empty((floor.size, 3), dtype=np.intp)
    least = _SAFE * floor / signal.time_step
    samples = np.asarray(signal.samples, dtype=np.float32)
    growth = np.empty(-(-within // block) + 1)
    count, longest = strong_blocks(samples, within, block, -(-half // block), least, growth, ends)
    ends = ends[:count]
    rows = ends[:, 0].copy()  # a part of a larger array would need compiled code of its own
    if count == 0:
        return signal, rows, range(0)
    times = range(_RINGING, _RINGING + longest)
    size = times.stop + _RINGING
    reach = math.ceil(far[1] / signal.time_step)
    padded = 2 * scipy.fft.next_fast_len(-(-(size + reach) // 2), real=True)
    cuts = np.zeros((count, padded), dtype=np.float32)
    cut_samples(samples, ends, within - longest, _RINGING, size, cuts)
    spectrum = scipy.fft.rfft(cuts)
    spectrum *= np.float32(signal.time_step)
    cut = Signal(cuts[:, :size], signal.time_step, signal.weighting, padded, spectrum)
    return cut, rows, times


def cut_around(
    signal: Signal, wavelet: str, period: float, time: float, half_cycles: float | None
) -> Signal:
    """Cut a record to the samples around a pulse, outside of which its wavelet is zero.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name of the wavelet.
    period, time : float
        T_p and centre of the pulse [s].
    half_cycles : float or None
        Number of half cycles.
    """
    reach = period * _reach(wavelet, half_cycles and half_cycles + _MORE) * _LONGER
    beside = (reach + _LATER * period) / signal.time_step + _BESIDE
    middle, size = time / signal.time_step, signal.samples.size
    first, last = max(0, math.floor(middle - beside)), min(size, math.ceil(middle + beside) + 1)
    samples = signal.samples[first:last].copy()
    if first > 0:
        samples[:_BESIDE] *= _RISE
    if last < size:
        samples[-_BESIDE:] *= _RISE[::-1]
    padded = padded_size(last - first + math.ceil(reach / signal.time_step))
    start = first * signal.time_step
    return padded_signal(samples, signal.time_step, signal.weighting, padded, start)


def holds(
    cut: Signal,
    signal: Signal,
    wavelet: str,
    period: float,
    time: float,
    half_cycles: float | None,
) -> bool:
    """Return True if a cut contains all of a pulse that is within the record.

    Parameters
    ----------
    cut, signal : Signal
        Result of `cut_around`, and the record.
    wavelet, period, time, half_cycles
        Parameters of the pulse, as in `cut_around`.
    """
    reach, faded = period * _reach(wavelet, half_cycles), _BESIDE * cut.time_step
    first, last = cut.start, cut.start + cut.duration
    whole = first == 0.0 or time - reach > first + faded
    whole &= last > signal.duration - 0.5 * cut.time_step or time + reach < last - faded
    return whole and cut.period - cut.duration > reach


def _reach(wavelet: str, half_cycles: float | None) -> float:
    return max(part.reach for part in WAVELETS[wavelet].parts(half_cycles))
