"""Search over all periods, half cycles and times with the FFT."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.loops import match_lines, tops
from rockframe.matching.signal import (
    Signal,
    padded_size,
    part_energies,
    part_spectra,
    strong_stretch,
)
from rockframe.wavelets.family import RICKERS, WAVELETS

Float = NDArray[np.float64]
SingleComplex = NDArray[np.complex64]

#: Number of periods per octave. The largest |C| at these periods is within 2e-3 of the maximum.
PERIODS_PER_OCTAVE: Final = 14
#: A period that every series of periods would contain [s], so that all records use the same ones.
_ANCHOR: Final = 0.2
#: Least number of samples in the shortest period of an octave.
_SAMPLES_PER_PERIOD: Final = 8
#: Largest value of frequency times T_p in the tabulated spectra, and number of lines per unit.
_HIGHEST: Final = 8
_FINENESS: Final = 2048
#: Largest number of values that are transformed together.
_TOGETHER: Final = 1 << 20
#: The three wavelets whose parts are the two Ricker wavelets.
_ANY_PHASE: Final = "ricker_any_phase"


@dataclass(frozen=True, eq=False)
class Heights:
    """The largest coefficient over time and phase at each period of a search.

    Parameters
    ----------
    periods : array, shape (periods,)
        T_p [s].
    half_cycles : tuple of float, or of None
        Numbers of half cycles searched [1].
    power : array, shape (signals, periods, half_cycles)
        Largest square of the coefficient with the weighting ``energy``.
    """

    periods: Float
    half_cycles: tuple[float | None, ...]
    power: Float


def ladder(low: float, high: float, per_octave: int = PERIODS_PER_OCTAVE) -> Float:
    """Return the periods of a search [s], a geometric series of at least one.

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
    nearly: float = 0.0,
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
        Numbers of half cycles to search, for wavelets with this parameter.
    fineness : int
        Number of times in the shortest period of an octave.
    nearly : float
        Share of the largest weighted square below which heights are not needed. They are 0 if no
        coefficient of an octave can reach this share.
    """
    weight = signal.weighting.of_square(periods)
    signals = np.atleast_2d(signal.samples).shape[0]
    spectra = {}
    for span in _spans(wavelets):
        numbers, served = _numbers(span, half_cycles), _served(span, wavelets)
        parts = [part for number in numbers for part in WAVELETS[span].parts(number)]
        far = np.max([(part.core, part.reach) for part in parts], axis=0)
        heights = np.zeros((signals, periods.size, len(numbers), len(served)))
        spectra[span] = (numbers, served, far, heights)
    # long periods first: they take little time, and limit the times to search at shorter ones
    for rungs in _octaves(periods)[::-1]:
        chosen = periods[rungs]
        least = math.ceil(fineness * signal.period / float(chosen[0]))
        band, (_, within, beyond) = _band(signal, least), _resampled(signal, least)
        for span, (numbers, served, far, heights) in spectra.items():
            best = (heights * weight[:, None, None]).max(axis=(1, 2)).min(axis=1)
            floor = nearly * best / weight[rungs].max()
            part, rows, times = strong_stretch(band, within, far * chosen[-1], floor)
            kinds = np.array([*served.values()])
            each = max(1, _TOGETHER // (2 * max(1, rows.size) * chosen.size * part.padded))
            for k in range(0, len(numbers) if rows.size else 0, each):
                some = tuple(numbers[k : k + each])
                crests = largest(part, times, beyond, chosen, span, some, kinds)
                heights[rows, rungs, k : k + each] = crests
    all_heights = {
        name: Heights(periods, tuple(numbers), heights[..., i])
        for numbers, served, _, heights in spectra.values()
        for i, name in enumerate(served)
    }
    return {name: all_heights[name] for name in wavelets}


def _band(signal: Signal, least: int) -> Signal:
    """Return a signal resampled to at least `least` samples, without high frequencies.

    Its samples include the zeros after the record, where it still rings.
    """
    count, _, _ = _resampled(signal, least)
    step = signal.period / count
    spectrum = np.atleast_2d(signal.spectrum)[:, : count // 2]
    samples = scipy.fft.irfft(spectrum.astype(np.complex64), count) / np.float32(step)
    return Signal(samples, step, signal.weighting, count, spectrum)


def _resampled(signal: Signal, least: int) -> tuple[int, int, float]:
    """Return how many samples a resampled signal has, how many are within the record, and the rest.

    The rest is the distance from the last sample within the record to its end, in steps, below 1.
    """
    count = min(padded_size(least), signal.padded)
    end = signal.duration * count / signal.period
    last = math.floor(end + 1e-9)
    return count, last + 1, max(0.0, end - last)


def _octaves(periods: Float) -> list[slice]:
    """Return slices of ascending periods, divided at each doubling of the first."""
    starts = np.searchsorted(np.floor(np.log2(periods / periods[0]) + 1e-9), np.arange(64))
    ends = sorted({*starts.tolist(), periods.size})
    return [slice(*pair) for pair in itertools.pairwise(ends)]


def largest(
    signal: Signal,
    times: range,
    beyond: float,
    periods: Float,
    span: str,
    half_cycles: tuple[float | None, ...],
    kinds: NDArray[np.intp],
) -> Float:
    """Return the largest squared coefficients over time, with the weighting ``energy``.

    Parameters
    ----------
    signal : Signal
        The records.
    times : range
        Indices of the samples at whose times to search.
    beyond : float
        Steps after the last of these samples that are searched too, less than one.
    periods : array, shape (periods,)
        T_p, ascending [s].
    span : str
        Name of the wavelet whose parts are used.
    half_cycles : tuple of float, or of None
        Numbers of half cycles.
    kinds : array, shape (kinds,)
        For each requested result: the part, 0 or 1; or 2 for both parts.

    Returns
    -------
    array, shape (signals, periods, half_cycles, kinds)
        Squares.
    """
    shape = _shape(span, half_cycles, signal.weighting.of_velocity)
    highest = math.floor((_HIGHEST - 1.0 / _FINENESS) * signal.period / float(periods[-1]))
    bins = min(signal.padded // 2, highest)
    lines = np.outer(periods * (_FINENESS / signal.period), np.arange(bins))
    lines = np.rint(lines, out=lines).astype(np.intp)
    spectrum = signal.spectrum[:, :bins].astype(np.complex64)
    sizes = (spectrum.shape[0], periods.size)
    table = np.empty((*sizes, shape.shape[0], signal.padded // 2 + 1), dtype=np.complex64)
    match_lines(spectrum, shape, lines, table)
    products = scipy.fft.irfft(table, signal.padded, overwrite_x=True)
    count = len(half_cycles)
    of_tops = np.empty((sizes[0], periods.size * count, kinds.size))
    split = (sizes[0], periods.size * count, shape.shape[0] // count, signal.padded)
    tops(products.reshape(split), times.start, times.stop, beyond, kinds, of_tops)
    squares = of_tops.reshape(*sizes, count, kinds.size)
    return squares * (periods[:, None, None] / signal.time_step**2)


def summits(
    signal: Signal, wavelet: str, period: float, half_cycles: float | None, nearly: float
) -> list[tuple[float, float]]:
    """Return the maxima over time at one period that are nearly as high as the highest.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name of the wavelet.
    period : float
        T_p [s].
    half_cycles : float or None
        Number of half cycles.
    nearly : float
        Least share of the largest square.

    Returns
    -------
    list of tuple of float
        The square with the weighting ``energy`` and the time [s] of each maximum, in the order of
        times. The end of the record counts as one, as a maximum may lie just before it.
    """
    count, within, beyond = _resampled(
        signal, math.ceil(_SAMPLES_PER_PERIOD * signal.period / period)
    )
    velocity = signal.weighting.of_velocity
    energies = np.array(part_energies(wavelet, half_cycles, velocity))
    parts = part_spectra(wavelet, half_cycles, period / signal.period, count // 2, velocity)
    parts = np.conj(parts) / np.sqrt(energies)[:, None]
    products = scipy.fft.irfft(signal.spectrum[: count // 2] * parts, count)
    products *= count * math.sqrt(period) / signal.period
    # a parabola fits the product of one part better than its square
    alone = len(products) == 1
    heights = products[0] if alone else (products**2).sum(axis=0)
    sizes = np.zeros(within + 2)  # of times within the record, between two zeros
    sizes[1:-1] = np.abs(heights[:within])
    tops = np.flatnonzero((sizes[1:-1] > sizes[:-2]) & (sizes[1:-1] >= sizes[2:]))
    # up to half a step from a time, but from the first to the end of the record; and that end
    least, most = np.where(tops == 0, -1.0, -0.5), np.where(tops == within - 1, beyond, 0.5)
    tops, least, most = (
        np.append(tops, within - 1),
        np.append(least, beyond),
        np.append(most, beyond),
    )
    middle = np.maximum(tops, 1)
    before, here, after = heights[middle - 1], heights[middle], heights[middle + 1]
    slope, bend = 0.5 * (after - before), before - 2.0 * here + after
    hollow = bend * here >= 0.0
    shift = np.where(hollow, tops - middle, -slope / np.where(hollow, 1.0, bend))
    shift = np.clip(shift, least, most)
    values = here + shift * (slope + 0.5 * shift * bend)
    squares = values**2 if alone else values
    times = (middle + shift) * signal.period / count
    chosen = np.flatnonzero(squares >= nearly * squares.max())
    return [(float(squares[k]), float(times[k])) for k in chosen]


@lru_cache(maxsize=64)
def _shape(span: str, half_cycles: tuple[float | None, ...], of_velocity: bool) -> SingleComplex:
    """Return conjugate spectra of both parts of unit energy, at f T_p = 0, 1 / _FINENESS, ..."""
    lines, spectra = _HIGHEST * _FINENESS, []
    for number in half_cycles:
        energies = np.array(part_energies(span, number, of_velocity))
        parts = part_spectra(span, number, 1.0 / _FINENESS, lines, of_velocity)
        spectra.append(np.conj(parts) / np.sqrt(energies)[:, None])
    return np.concatenate(spectra).astype(np.complex64)


def _spans(wavelets: Sequence[str]) -> list[str]:
    """Return wavelets that have all parts needed; the parts of the Rickers serve three wavelets."""
    rickers = [name for name in wavelets if name in RICKERS or name == _ANY_PHASE]
    others = [name for name in wavelets if name not in rickers]
    if len(rickers) == 1:
        return rickers + others
    return ([_ANY_PHASE] if rickers else []) + others


def _served(span: str, wavelets: Sequence[str]) -> dict[str, int]:
    """Return for each wavelet the part of `span` that it consists of, or 2 for both parts."""
    if span != _ANY_PHASE:
        return {span: 0 if span in RICKERS else 2}
    return {name: kind for kind, name in enumerate((*RICKERS, span)) if name in wavelets}


def _numbers(wavelet: str, half_cycles: Sequence[float]) -> list[float | None]:
    return [*half_cycles] if WAVELETS[wavelet].has_half_cycles else [None]
