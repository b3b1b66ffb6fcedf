"""Search over all periods, numbers of half cycles and times with the FFT.

For each period, one inverse transform gives the inner products with one part of a wavelet at all
times. A wavelet of period T_p has no content beyond a few times 1 / T_p, so only that part of the
spectrum is transformed back, to a few samples per period: each longer octave needs half the
samples. The parts are even and odd, so their cross term is zero and the best phase at each time
follows in closed form, by projection on their span: c1^2 / E1 + c2^2 / E2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.signal import Signal, padded_size, part_energies, part_spectra
from rockframe.wavelets.family import RICKERS, WAVELETS

Float = NDArray[np.float64]
Single = NDArray[np.float32]
SingleComplex = NDArray[np.complex64]

#: Periods of the ladder per octave: |C| is within 2e-3 of its maximum between two rungs.
PERIODS_PER_OCTAVE: Final = 14
#: A period that every ladder contains [s], so that records share their wavelets.
_ANCHOR: Final = 0.2
#: Smallest number of samples in the shortest period of an octave.
_SAMPLES_PER_PERIOD: Final = 8
#: Largest frequency times T_p of the tabulated spectra, and their lines per unit of it.
_HIGHEST: Final = 8
_FINENESS: Final = 2048
#: The three wavelets whose parts are the two Ricker wavelets.
_ANY_PHASE: Final = "ricker_any_phase"


@dataclass(frozen=True, eq=False)
class Heights:
    """The largest coefficient over time and phase at each period of the ladder.

    Parameters
    ----------
    periods : array, shape (periods,)
        T_p [s].
    half_cycles : tuple of float, or of None
        Numbers of half cycles searched [1].
    power : array, shape (signals, periods, half_cycles)
        Largest square of the coefficient with the weighting ``energy``.
    times : array, shape (signals, periods, half_cycles)
        Time of the largest coefficient [s].
    """

    periods: Float
    half_cycles: tuple[float | None, ...]
    power: Float
    times: Float


def ladder(low: float, high: float, per_octave: int = PERIODS_PER_OCTAVE) -> Float:
    """Return the periods of the search [s], in equal ratios; at least one.

    Examples
    --------
    >>> ladder(0.2, 0.5, 2).round(3)
    array([0.2  , 0.283, 0.4  ])
    """
    first = math.ceil(per_octave * math.log2(low / _ANCHOR) - 1e-9)
    last = math.floor(per_octave * math.log2(high / _ANCHOR) + 1e-9)
    if last < first:
        return np.array([math.sqrt(low * high)])
    return np.asarray(_ANCHOR * 2.0 ** (np.arange(first, last + 1) / per_octave))


def search(
    signal: Signal,
    periods: Float,
    wavelets: Sequence[str],
    half_cycles: Sequence[float],
    fineness: int = _SAMPLES_PER_PERIOD,
) -> dict[str, Heights]:
    """Return the largest coefficients of each wavelet over periods and numbers of half cycles.

    Parameters
    ----------
    signal : Signal
        The records.
    periods : array, shape (periods,)
        T_p in ascending order [s].
    wavelets : sequence of str
        Names of wavelets.
    half_cycles : sequence of float
        Numbers of half cycles to search, for wavelets with that parameter.
    fineness : int
        Number of times per shortest period of an octave.
    """
    spans = [(span, number) for span in _spans(wavelets) for number in _numbers(span, half_cycles)]
    found: dict[str, list[Float]] = {name: [] for name in wavelets}
    for octave in octaves(signal, periods, fineness):
        columns: dict[str, list[Float]] = {name: [] for name in wavelets}
        for span, number in spans:
            products = correlations(octave, span, number)[..., : octave.within]
            for name, power in _powers(products, span, wavelets):
                columns[name].append(_largest(power, octave))
        for name, parts in columns.items():
            found[name].append(np.stack(parts, axis=-1))
    heights = {}
    for name, rows in found.items():
        power, times = np.concatenate(rows, axis=2)
        heights[name] = Heights(periods, tuple(_numbers(name, half_cycles)), power, times)
    return heights


@dataclass(frozen=True, eq=False)
class Octave:
    """Periods within a factor of two, and the part of the spectrum that their wavelets need.

    Parameters
    ----------
    periods : array, shape (periods,)
        T_p, ascending [s].
    spectrum : array, shape (signals, lines)
        Spectrum of the signals, in single precision.
    lines : array, shape (periods, lines)
        Position of each line in the tabulated spectra of the wavelets.
    count, within : int
        Number of time points of the inverse transform, and how many lie within the signal.
    step : float
        Interval between the times, the first of which is 0 [s].
    of_velocity : bool
        True if velocities are compared.
    """

    periods: Float
    spectrum: SingleComplex
    lines: NDArray[np.intp]
    count: int
    within: int
    step: float
    of_velocity: bool


def octaves(signal: Signal, periods: Float, fineness: int) -> Iterator[Octave]:
    """Divide the periods into octaves, each with the part of the spectrum that it needs."""
    numbers = np.floor(np.log2(periods / periods[0]) + 1e-9).astype(int)
    for number in range(int(numbers[-1]) + 1):
        chosen = periods[numbers == number]
        if chosen.size == 0:
            continue
        wanted = padded_size(math.ceil(fineness * signal.period / float(chosen[0])))
        count = min(wanted, signal.padded)
        highest = math.floor((_HIGHEST - 1.0 / _FINENESS) * signal.period / float(chosen[-1]))
        bins = min(count // 2, highest)
        lines = np.outer(chosen * (_FINENESS / signal.period), np.arange(bins))
        step = signal.period / count
        yield Octave(
            periods=chosen,
            spectrum=np.atleast_2d(signal.spectrum)[:, :bins].astype(np.complex64),
            lines=np.rint(lines, out=lines).astype(np.intp),
            count=count,
            within=int(signal.duration / step) + 1,
            step=step,
            of_velocity=signal.weighting.of_velocity,
        )


def correlations(octave: Octave, span: str, half_cycles: float | None) -> Single:
    """Return the inner products with the parts of a wavelet at all times, up to a factor.

    Parameters
    ----------
    octave : Octave
        Periods and spectrum.
    span : str
        Name of a wavelet with these parts.
    half_cycles : float or None
        Number of half cycles.

    Returns
    -------
    array, shape (signals, periods, parts, times)
        Multiply by the square root of the period and divide by `step` to get the coefficients
        with the weighting ``energy``.
    """
    shape = _shape(span, half_cycles, octave.of_velocity)
    rows, bins = octave.lines.shape
    sizes = (octave.spectrum.shape[0], rows, shape.shape[0], octave.count // 2 + 1)
    table = np.empty(sizes, dtype=np.complex64)
    table[..., bins:] = 0.0
    for i, part in enumerate(shape):
        seen = np.take(part, octave.lines, mode="clip")
        np.multiply(seen, octave.spectrum[:, None, :], out=table[:, :, i, :bins])
    return np.asarray(scipy.fft.irfft(table, octave.count, overwrite_x=True))


@lru_cache(maxsize=64)
def _shape(span: str, half_cycles: float | None, of_velocity: bool) -> SingleComplex:
    """Return conjugate spectra of the parts with unit energy, at nu in steps of 1 / _FINENESS."""
    energies = np.array(part_energies(span, half_cycles, of_velocity))
    lines = _HIGHEST * _FINENESS
    spectra = np.stack(part_spectra(span, half_cycles, 1.0 / _FINENESS, lines, of_velocity))
    return np.asarray(np.conj(spectra) / np.sqrt(energies)[:, None], dtype=np.complex64)


def _spans(wavelets: Sequence[str]) -> list[str]:
    """Return wavelets that provide all parts: the two Ricker wavelets serve three wavelets."""
    rickers = [name for name in wavelets if name in RICKERS or name == _ANY_PHASE]
    others = [name for name in wavelets if name not in rickers]
    if len(rickers) == 1:
        return rickers + others
    return ([_ANY_PHASE] if rickers else []) + others


def _numbers(wavelet: str, half_cycles: Sequence[float]) -> list[float | None]:
    return [*half_cycles] if WAVELETS[wavelet].has_half_cycles else [None]


def _powers(products: Single, span: str, wavelets: Sequence[str]) -> Iterator[tuple[str, Single]]:
    """Give the squared coefficients of the wavelets in a span; overwrites `products`."""
    squares = np.square(products, out=products)
    if span in RICKERS:
        yield span, squares[:, :, 0]
        return
    if span == _ANY_PHASE:
        for i, name in enumerate(RICKERS):
            if name in wavelets:
                yield name, squares[:, :, i]
    if span in wavelets:
        yield span, np.add(squares[:, :, 0], squares[:, :, 1], out=squares[:, :, 0])


def _largest(power: Single, octave: Octave) -> Float:
    """Return the largest value over time and its time, from a parabola through its neighbours.

    The shape is (2, signals, periods): heights and times.
    """
    scale = octave.periods / octave.step**2
    rows = power.reshape(-1, power.shape[-1])
    every = np.arange(rows.shape[0])
    top = rows.argmax(axis=-1)

    def beside(offset: int) -> Float:
        return np.asarray(rows[every, inner + offset], dtype=np.float64)

    def shaped(height: Float, time: Float) -> Float:
        shape = power.shape[:-1]
        return np.stack([height.reshape(shape) * scale, time.reshape(shape) * octave.step])

    if octave.within < 3:
        inner = top
        return shaped(beside(0), top)
    inner = np.minimum(np.maximum(top, 1), octave.within - 2)
    before, here, after = beside(-1), beside(0), beside(1)
    bend = 2.0 * here - before - after
    located = (top == inner) & (bend > 0.0)
    shift = np.where(located, 0.5 * (after - before) / np.where(located, bend, 1.0), top - inner)
    raised = here + np.where(located, 0.25 * (after - before) * shift, 0.0)
    ends = np.where(top < inner, before, after)
    return shaped(np.where(located | (top == inner), raised, ends), inner + shift)
