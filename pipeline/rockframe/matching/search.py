"""Search over all periods, half cycles and times with the FFT, and refinement of its maxima."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from rockframe.matching.loops import crest_times, match_lines, tops
from rockframe.matching.signal import (
    Signal,
    cut_around,
    holds,
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


#: Largest value of frequency times T_p to which spectra are summed at first. Beyond it, Ricker
#: wavelets are below 1e-16; the tail of a wavelet with kinks moves flat maxima by up to a percent.
_HIGHEST_REFINED: Final = 8.0
#: Distance over T_p within which the Taylor series over time is accurate. The second value is for
#: sums over all lines, because terms of high frequency grow fast.
_NEAR: Final = 0.06
_WHOLE_NEAR: Final = 1e-3
#: First and last step of the finite differences over ln T_p and half cycles. The last one leaves
#: errors of 1e-8 in T_p.
_FIRST_STEP: Final = 4e-3
_LAST_STEP: Final = 1e-4
#: Longest step of Newton's method, and the step below which it has converged.
_LONGEST_MOVE: Final = 0.1
_ARRIVED: Final = 1e-6
#: Largest number of times that a step that leads downhill is cut to a quarter.
_MOST_CUTS: Final = 6
#: Share of the highest maximum above which other maxima are also refined with all lines; and the
#: difference of variables below which two maxima count as equal.
_OPEN: Final = 0.998
_ALIKE: Final = 0.05
#: Relative difference below which two maxima count as equally high.
_EQUAL: Final = 1e-9
#: Longest step after which the curvature is reused.
_NEARBY: Final = 0.01
_MOST_MOVES: Final = 40
#: Neighbours of a point of one or two variables: on either side, the point itself, diagonals.
_AXES: Final = {
    1: np.array([[1.0], [-1.0], [0.0]]),
    2: np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [0, 0], [1, 1], [-1, -1]], dtype=np.float64),
}


@dataclass(frozen=True)
class Refined:
    """A maximum of the transform.

    Parameters
    ----------
    signal : Signal
        The samples around the maximum.
    wavelet : str
        Name of the wavelet.
    period, time : float
        T_p and centre [s].
    half_cycles : float or None
        Number of half cycles [1].
    factors : tuple of float
        Least-squares factor of each part of the wavelet, in the unit of the signal.
    weighted : float
        Weighted square of the coefficient, which is maximised.
    explained : float
        Energy of the signal that the wavelet explains.
    lines : int
        Number of spectral lines that are summed.
    every : bool
        True if all lines are summed, False if only those below `_HIGHEST`.
    """

    signal: Signal
    wavelet: str
    period: float
    time: float
    half_cycles: float | None
    factors: tuple[float, ...]
    weighted: float
    explained: float
    lines: int
    every: bool


def refine(
    signal: Signal,
    starts: Sequence[Refined],
    periods: tuple[float, float],
    half_cycles: tuple[float, float],
) -> Refined:
    """Find the maxima near several points, and return the highest; of equally high ones the first.

    Parameters
    ----------
    signal : Signal
        The record.
    starts : sequence of Refined
        Results of `crest` at points of the grid.
    periods, half_cycles : tuple of float
        Bounds of the period [s] and of the number of half cycles [1].
    """
    count = 1 if starts[0].half_cycles is None else 2
    low = np.array([math.log(periods[0]), half_cycles[0]])[:count]
    high = np.array([math.log(periods[1]), half_cycles[1]])[:count]
    tops = [_climbed(signal, start, (low, high), _FIRST_STEP, None) for start in starts]
    tops.sort(key=lambda top: -top[0].weighted)
    if starts[0].half_cycles is None:
        return _highest([top for top, _ in tops])
    # the lines above `_HIGHEST` of a wavelet with kinks move flat maxima by up to a percent
    polished: list[Refined] = []
    for top, bend in tops:
        near = any(_alike(top, other) for other in polished)
        if near or top.weighted < _OPEN * tops[0][0].weighted:
            continue
        whole = crest(signal, top.wavelet, top.period, top.time, top.half_cycles, every=True)
        polished.append(_climbed(signal, whole, (low, high), _LAST_STEP, bend)[0])
    return _highest(polished)


def _highest(tops: Sequence[Refined]) -> Refined:
    """Return the highest maximum; of equal ones the earliest, as round-off must not decide."""
    least = (1.0 - _EQUAL) * max(top.weighted for top in tops)
    return min((top for top in tops if top.weighted >= least), key=lambda top: top.time)


def _alike(first: Refined, other: Refined) -> bool:
    """Return True if two points are so close that they probably belong to the same maximum."""
    apart = np.abs(_variables(first) - _variables(other)).max()
    return bool(apart < _ALIKE and abs(first.time - other.time) < _ALIKE * first.period)


def _climbed(
    signal: Signal,
    start: Refined,
    bounds: tuple[Float, Float],
    step: float,
    bend: Float | None,
) -> tuple[Refined, Float | None]:
    """Return the maximum near a point, and the last curvature; `bend` is the curvature if known."""
    here, latest = start, bend
    before: tuple[Float, Float] | None = None
    for _ in range(_MOST_MOVES):
        x = _variables(here)
        move, before, latest = _newton_move(here, step, bounds, bend, before)
        there = _step_uphill(here, move, bounds)
        if there is None:
            if step == _LAST_STEP and bend is None:
                break
            step, bend = max(_LAST_STEP, 0.2 * step), None
            continue
        moved = float(np.abs(_variables(there) - x).max())
        here = there
        if moved < _ARRIVED and step == _LAST_STEP:
            break
        step = max(_LAST_STEP, min(step, 0.1 * moved))
        bend = latest if moved < _NEARBY else None
    whose = (here.wavelet, here.period, here.time, here.half_cycles)
    if not holds(here.signal, signal, *whose):
        again = crest(signal, *whose, every=here.every)
        return _climbed(signal, again, bounds, _LAST_STEP, None)
    return here, latest


def _step_uphill(here: Refined, move: Float, bounds: tuple[Float, Float]) -> Refined | None:
    """Return the point after a step, shortened until it leads uphill; None if it never does."""
    x = _variables(here)
    for _ in range(_MOST_CUTS):
        there = _crest(here, np.minimum(np.maximum(x + move, bounds[0]), bounds[1]))
        if there.weighted >= here.weighted:
            return there
        move = 0.25 * move
    return None


def crest(
    signal: Signal,
    wavelet: str,
    period: float,
    time: float,
    half_cycles: float | None,
    *,
    every: bool = False,
) -> Refined:
    """Return the maximum over time and phase near a given time, at a fixed period.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name of the wavelet.
    period, time : float
        T_p and start time [s].
    half_cycles : float or None
        Number of half cycles.
    every : bool
        If true, sum over all spectral lines of the whole record; if false, over the lines below
        `_HIGHEST` of the samples around the time.
    """
    cut = signal if every else cut_around(signal, wavelet, period, time, half_cycles)
    seen = math.floor(_HIGHEST_REFINED * cut.period / period) + 1
    lines = cut.spectrum.size if every else min(cut.spectrum.size, seen)
    here = Refined(cut, wavelet, period, time, half_cycles, (), 0.0, 0.0, lines, every)
    return _crest(here, _variables(here))


def _crest(near: Refined, point: Float) -> Refined:
    """Return the maximum over time at a point, an array of variables, near the time of `near`."""
    period, time, weighted, explained, *factors = _crests(near, point[None])[0].tolist()
    number = None if near.half_cycles is None else float(point[1])
    return replace(
        near,
        period=period,
        time=time,
        half_cycles=number,
        factors=tuple(factors),
        weighted=weighted,
        explained=explained,
    )


def _crests(near: Refined, points: Float) -> Float:
    """Return period, time, height, energy and factors of the maxima over time, a row per point.

    All have the number of lines of `near`, because with another number the height would jump.
    """
    if near.every and len(points) > 1:  # arrays of all points would not fit into the cache
        return np.concatenate([_crests(near, point[None]) for point in points])
    signal, velocity, start = near.signal, near.signal.weighting.of_velocity, near.signal.start
    periods = np.exp(points[:, 0])
    numbers = None if near.half_cycles is None else points[:, 1]
    each = [None] * len(points) if numbers is None else numbers.tolist()
    energies = np.array([part_energies(near.wavelet, number, velocity) for number in each])
    step = periods / signal.period
    spectra = part_spectra(near.wavelet, numbers, step, near.lines, velocity)
    ends = np.zeros((len(points), 2))
    ends[:, 1] = signal.duration / periods
    sums = np.empty((len(points), 1 + energies.shape[1]))
    close = _WHOLE_NEAR if near.every else _NEAR
    crest_times(
        spectra, signal.spectrum, step, energies, (near.time - start) / periods, ends, close, sums
    )
    crests = np.empty((len(points), 4 + energies.shape[1]))
    crests[:, 0], crests[:, 1] = periods, start + sums[:, 0] * periods
    np.divide(sums[:, 1:], periods[:, None] * energies, out=crests[:, 4:])
    crests[:, 3] = (sums[:, 1:] * crests[:, 4:]).sum(axis=1)
    crests[:, 2] = crests[:, 3] * signal.weighting.of_square(periods)
    return crests


def _variables(point: Refined) -> Float:
    x = [math.log(point.period)]
    return np.array(x if point.half_cycles is None else [*x, point.half_cycles])


def _newton_move(
    here: Refined,
    step: float,
    bounds: tuple[Float, Float],
    bend: Float | None,
    before: tuple[Float, Float] | None,
) -> tuple[Float, tuple[Float, Float], Float]:
    """Return the step to the top of the parabola through neighbours, and its slope and curvature.

    The slope is returned with the point at which it was found; `before` is the pair of the last
    step. It updates a known curvature of two variables; that of one variable is reused unchanged.
    """
    low, high = bounds
    start = _variables(here)
    x = np.minimum(np.maximum(start, low + step), high - step)  # neighbours are within bounds
    axes = _AXES[x.size]
    # the curvature needs the point itself too: the series of `here` is around another time
    offsets = axes[: 2 * x.size if bend is not None else None]
    heights = _crests(here, x + step * offsets)[:, 2]
    logs = np.log(np.maximum(heights, 1e-300))
    after, ahead, others = logs[: x.size], logs[x.size : 2 * x.size], logs[2 * x.size :]
    slope = (after - ahead) / (2.0 * step)
    if bend is None:
        bend = np.diag(after - 2.0 * others[0] + ahead) / step**2
        if x.size == 2:
            cross = others[1:].sum() - after.sum() - ahead.sum() + 2.0 * others[0]
            bend += 0.5 * cross / step**2 * (1.0 - np.eye(2))
    elif before is not None and x.size == 2:  # the symmetric change of rank one
        moved, change = x - before[0], slope - before[1]
        rest = change - bend @ moved
        along = float(rest @ moved)
        if abs(along) > 1e-3 * math.sqrt(float(rest @ rest) * float(moved @ moved)):
            bend = bend + np.outer(rest, rest) / along
    move = _uphill(slope, bend)
    target = np.minimum(np.maximum(x + move, low), high)
    held = target != x + move
    if held.any() and x.size == 2:  # at a corner, leave it along the bound that leads uphill
        slides = [_slide(slope, bend, target - x, k) for k in np.flatnonzero(held).tolist()]
        slides = [np.minimum(np.maximum(x + slide, low), high) - x for slide in slides]
        move = max(slides, key=lambda slide: float(slide @ (slope + 0.5 * bend @ slide)))
    return move + x - start, (x, slope), bend


def _slide(slope: Float, bend: Float, target: Float, held: int) -> Float:
    """Return the step that leads one of two variables to its target, and the other uphill."""
    free, move = 1 - held, target.copy()
    rest = slope[free] + bend[free, held] * target[held]
    move[free] = _uphill(np.array([rest]), bend[[free]][:, [free]])[0]
    return move


def _uphill(slope: Float, bend: Float) -> Float:
    values, axes = np.linalg.eigh(bend) if slope.size > 1 else (bend[0], np.eye(1))
    along = axes.T @ slope
    move = axes @ (along / np.maximum(np.abs(values), 1e-6))
    return np.asarray(move * (_LONGEST_MOVE / max(float(np.abs(move).max()), _LONGEST_MOVE)))
