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
    spans = _spans(tuple(wavelets), tuple(half_cycles))
    heights = [
        np.zeros((signals, periods.size, len(span.numbers), span.kinds.size)) for span in spans
    ]
    # long periods first: they take little time, and limit the times to search at shorter ones
    for rungs in _octaves(periods)[::-1]:
        chosen = periods[rungs]
        band, within, beyond = _band(signal, math.ceil(fineness * signal.period / chosen[0]))
        share = nearly / weight[rungs].max()
        for span, filled in zip(spans, heights, strict=True):
            floor = share * (filled * weight[:, None, None]).max(axis=(1, 2)).min(axis=1)
            part, rows, times = strong_stretch(band, within, span.far * chosen[-1], floor)
            each = max(1, _TOGETHER // (2 * max(1, rows.size) * chosen.size * part.padded))
            for k in range(0, len(span.numbers) if rows.size else 0, each):
                some = (span.name, span.numbers[k : k + each])
                place = (rungs.start, k)
                largest(part, (times, beyond), chosen, some, span.kinds, rows, place, filled)
    all_heights = {
        name: Heights(periods, span.numbers, filled[..., i])
        for span, filled in zip(spans, heights, strict=True)
        for i, name in enumerate(span.served)
    }
    return {name: all_heights[name] for name in wavelets}


def _band(signal: Signal, least: int) -> tuple[Signal, int, float]:
    """Return a signal resampled to at least `least` samples, without high frequencies.

    Its samples include the zeros after the record, where it still rings. The number of samples
    within the record and the distance from the last of them to its end follow, as in `_resampled`.
    """
    count, within, beyond = _resampled(signal, least)
    step = signal.period / count
    spectrum = np.atleast_2d(signal.spectrum)[:, : count // 2]
    samples = scipy.fft.irfft(spectrum.astype(np.complex64), count)
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
    periods: Float,
    wavelets: tuple[str, tuple[float | None, ...]],
    kinds: NDArray[np.intp],
    rows: NDArray[np.intp],
    place: tuple[int, int],
    highest: Float,
) -> None:
    """Fill in the largest squared coefficients over time, with the weighting ``energy``.

    Parameters
    ----------
    signal : Signal
        The records.
    times : tuple of range and float
        Indices of the samples at whose times to search, and steps after the last of these samples
        that are searched too, less than one.
    periods : array, shape (periods,)
        T_p, ascending [s].
    wavelets : tuple
        Name of the wavelet whose parts are used, and numbers of half cycles, or None.
    kinds : array, shape (kinds,)
        For each requested result: the part, 0 or 1; or 2 for both parts.
    rows : array, shape (signals,)
        Row of `highest` of each record.
    place : tuple of int
        First period and first number of half cycles in `highest`.
    highest : array, shape (rows, periods or more, half_cycles or more, kinds)
        Filled with the squares.
    """
    shape = _shape(*wavelets, signal.weighting.of_velocity)
    count, lines = len(wavelets[1]), signal.padded // 2
    bins = min(lines, math.floor((_HIGHEST - 1.0 / _FINENESS) * signal.period / float(periods[-1])))
    sizes = (len(signal.spectrum), periods.size)
    table = np.empty((*sizes, len(shape), lines + 1), dtype=np.complex64)
    spectrum = np.ascontiguousarray(signal.spectrum[:, :bins], dtype=np.complex64)
    match_lines(spectrum, shape, periods * (_FINENESS / signal.period), table)
    products = scipy.fft.irfft(table, signal.padded, overwrite_x=True)
    products = products.reshape(*sizes, count, len(shape) // count, signal.padded)
    factors = periods / signal.time_step**2
    steps = (times[0].start, times[0].stop, times[1])
    tops(products, steps, kinds, factors, rows, place, highest)


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
def _shape(span: str, half_cycles: tuple[float | None, ...], of_velocity: bool) -> SingleComplex:
    """Return conjugate spectra of both parts of unit energy, at f T_p = 0, 1 / _FINENESS, ..."""
    lines, spectra = _HIGHEST * _FINENESS, []
    for number in half_cycles:
        energies = np.array(part_energies(span, number, of_velocity))
        parts = part_spectra(span, number, 1.0 / _FINENESS, lines, of_velocity)
        spectra.append(np.conj(parts) / np.sqrt(energies)[:, None])
    return np.concatenate(spectra).astype(np.complex64)


@dataclass(frozen=True, eq=False)
class _Span:
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
    far : array, shape (2,)
        Largest core and reach of the parts, over T_p.
    """

    name: str
    numbers: tuple[float | None, ...]
    served: tuple[str, ...]
    kinds: NDArray[np.intp]
    far: Float


@lru_cache(maxsize=64)
def _spans(wavelets: tuple[str, ...], half_cycles: tuple[float, ...]) -> list[_Span]:
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
        far = np.max([(part.core, part.reach) for part in parts], axis=0)
        kinds = np.array([*served.values()])
        spans.append(_Span(name, numbers, tuple(served), kinds, far))
    return spans
