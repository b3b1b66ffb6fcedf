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
_TOGETHER: Final = 1 << 17
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
    spans = _spans(tuple(wavelets), tuple(half_cycles))
    heights = [
        np.zeros((signals, periods.size, len(span.numbers), span.kinds.size)) for span in spans
    ]
    highest = [np.zeros((signals, span.kinds.size)) for span in spans]
    # long periods first: they take little time, and limit the times to search at shorter ones
    spectra = np.atleast_2d(signal.spectrum).astype(np.complex64)
    for rungs in _octaves(periods)[::-1]:
        chosen, weights = periods[rungs], weight[rungs]
        least = math.ceil(fineness * signal.period / float(chosen[0]))
        band, within, beyond = _band(signal, spectra, least)
        share, longest = nearly / float(weights.max()), float(chosen[-1])
        for span, filled, best in zip(spans, heights, highest, strict=True):
            floor, far = share * best.min(axis=1), (span.core * longest, span.reach * longest)
            part, rows, times = strong_stretch(band, within, far, floor)
            filling = (rows, rungs.start, best, filled)
            largest(part, (times, beyond), (chosen, weights), span, filling)
    all_heights = {
        name: Heights(periods, span.numbers, filled[..., i])
        for span, filled in zip(spans, heights, strict=True)
        for i, name in enumerate(span.served)
    }
    return {name: all_heights[name] for name in wavelets}


def _band(signal: Signal, spectra: SingleComplex, least: int) -> tuple[Signal, int, float]:
    """Return a signal resampled to at least `least` samples, without high frequencies.

    Its samples include the zeros after the record, where it still rings. The number of samples
    within the record and the distance from the last of them to its end follow, as in `_resampled`.
    """
    count, within, beyond = _resampled(signal, least)
    step = signal.period / count
    spectrum = np.ascontiguousarray(spectra[:, : count // 2])
    samples = scipy.fft.irfft(spectrum, count)
    samples /= np.float32(step)
    return Signal(samples, step, signal.weighting, count, spectrum), within, beyond


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
    octaves = np.floor(np.log2(periods / periods[0]) + 1e-9)
    starts = np.flatnonzero(np.diff(octaves, prepend=-1.0)).tolist()
    return [slice(*pair) for pair in itertools.pairwise([*starts, periods.size])]


def largest(
    signal: Signal,
    times: tuple[range, float],
    periods: tuple[Float, Float],
    span: Span,
    filling: tuple[NDArray[np.intp], int, Float, Float],
) -> None:
    """Fill in the largest squared coefficients over time, with the weighting ``energy``.

    Parameters
    ----------
    signal : Signal
        The records.
    times : tuple of range and float
        Indices of the samples at whose times to search, and steps after the last of these samples
        that are searched too, less than one.
    periods : tuple of array, shape (periods,)
        T_p, ascending [s], and their weights.
    span : Span
        The wavelet whose parts are used.
    filling : tuple
        Rows of the records and first period in the following arrays: the largest weighted squares,
        shape (rows, kinds), which are raised, and an array of shape (rows, periods or more,
        half_cycles, kinds), filled with the squares.
    """
    shape, (chosen, weights) = _shape(span, signal.weighting.of_velocity), periods
    spectrum = np.asarray(signal.spectrum, dtype=np.complex64)
    rows, first, best, filled = filling
    count, lines, numbers = len(shape) // len(span.numbers), signal.padded // 2, len(span.numbers)
    highest_line = (_HIGHEST - 1.0 / _FINENESS) * signal.period / float(chosen[-1])
    bins = min(lines, math.floor(highest_line))
    row, indices = np.empty(bins, dtype=np.complex64), np.empty(bins, dtype=np.intp)
    scales = chosen * (_FINENESS / signal.period)
    factors = np.array((chosen / signal.time_step**2, weights))
    power = np.empty(len(times[0]) + 1, dtype=np.float32)
    work, start = (power, power.view(np.int32)), (times[0].start, times[1])
    each = max(1, _TOGETHER // (chosen.size * count * signal.padded))
    together, signals = min(each, numbers), max(1, each // numbers)
    for k in range(0, numbers, together):
        some = shape[k * count : (k + together) * count]
        for i in range(0, rows.size, signals):
            spectra, place = spectrum[i : i + signals], rows[i : i + signals]
            table = np.empty((len(spectra), chosen.size, len(some), lines + 1), dtype=np.complex64)
            match_lines(spectra, some, scales, indices, row, table)
            products = scipy.fft.irfft(table, signal.padded, overwrite_x=True)
            products = products.reshape(-1, count, signal.padded)
            where = (place, first, k, len(some) // count)
            tops(products, work, start, span.kinds, factors, where, best, filled)


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
    tops, step = [], signal.period / count
    for top in [*_local_maxima(np.abs(heights[:within]), nearly), None]:
        # up to half a step from a time, but from the first to the end of the record; and that end
        last = top == within - 1 or top is None
        least = beyond if top is None else -1.0 if top == 0 else -0.5
        middle = max(within - 1 if top is None else top, 1)
        before, here, after = heights[middle - 1 : middle + 2].tolist()
        slope, bend = 0.5 * (after - before), before - 2.0 * here + after
        shift = -slope / bend if bend * here < 0.0 else float((top or 0) - middle)
        shift = min(max(shift, least), beyond if last else 0.5)
        value = here + shift * (slope + 0.5 * shift * bend)
        tops.append((value**2 if alone else value, (middle + shift) * step))
    least_square = nearly * max(square for square, _ in tops)
    return [(square, time) for square, time in tops if square >= least_square]


def _local_maxima(sizes: Float, nearly: float) -> list[int]:
    """Return the indices of the local maxima that may be nearly the highest between samples.

    Of a parabola through a sample and two lower ones the top is at most half as high again. At the
    start, the parabola is around the second sample.
    """
    high = np.flatnonzero(sizes[1:] >= nearly / 1.5 * sizes.max()) + 1
    padded = [0.0, *sizes.tolist(), 0.0]
    return [k for k in (0, *high.tolist()) if padded[k] < padded[k + 1] >= padded[k + 2]]


@lru_cache(maxsize=64)
def _shape(span: Span, of_velocity: bool) -> SingleComplex:
    """Return conjugate spectra of both parts of unit energy, at f T_p = 0, 1 / _FINENESS, ..."""
    lines, spectra = _HIGHEST * _FINENESS, []
    for number in span.numbers:
        energies = np.array(part_energies(span.name, number, of_velocity))
        parts = part_spectra(span.name, number, 1.0 / _FINENESS, lines, of_velocity)
        spectra.append(np.conj(parts) / np.sqrt(energies)[:, None])
    return np.concatenate(spectra).astype(np.complex64)


@dataclass(frozen=True, eq=False)
class Span:
    """A wavelet whose parts serve some of the requested wavelets.

    Parameters
    ----------
    name : str
        Name of the wavelet.
    numbers : tuple of float, or of None
        Numbers of half cycles.
    served : tuple of str
        Names of the requested wavelets.
    kinds : array, shape (served,)
        The part of which each of these consists, 0 or 1; or 2 for both parts.
    core, reach : float
        Largest core and reach of the parts, over T_p.
    """

    name: str
    numbers: tuple[float | None, ...]
    served: tuple[str, ...]
    kinds: NDArray[np.intp]
    core: float
    reach: float


@lru_cache(maxsize=64)
def _spans(wavelets: tuple[str, ...], half_cycles: tuple[float, ...]) -> list[Span]:
    """Return wavelets that have all parts needed; the parts of the Rickers serve three wavelets."""
    rickers = [name for name in wavelets if name in RICKERS or name == _ANY_PHASE]
    names = [name for name in wavelets if name not in rickers]
    names = rickers + names if len(rickers) == 1 else ([_ANY_PHASE] if rickers else []) + names
    spans = []
    for name in names:
        served = {name: 0 if name in RICKERS else 2}
        if name == _ANY_PHASE:
            served = {one: k for k, one in enumerate((*RICKERS, name)) if one in wavelets}
        numbers = half_cycles if WAVELETS[name].has_half_cycles else (None,)
        parts = [part for number in numbers for part in WAVELETS[name].parts(number)]
        core, reach = max(part.core for part in parts), max(part.reach for part in parts)
        kinds = np.array([*served.values()])
        spans.append(Span(name, numbers, tuple(served), kinds, core, reach))
    return spans
