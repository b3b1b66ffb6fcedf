"""Continuous refinement of the period, time and half cycles of a maximum.

The inner products are summed over the record's spectrum. They are then smooth functions of these
three variables for any samples. The phase follows in closed form, and the time from the Taylor
series of the products around a nearby time. This leaves one or two variables for Newton's method.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.loops import crest_times
from rockframe.matching.signal import Signal, part_energies, part_spectra
from rockframe.matching.stretch import cut_around, holds

Float = NDArray[np.float64]

#: Largest value of frequency times T_p to which spectra are summed at first. Beyond it, Ricker
#: wavelets are below 1e-16; the tail of a wavelet with kinks moves flat maxima by up to a percent.
_HIGHEST: Final = 8.0
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
    """Find the maxima near several points, and return the highest.

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
        return tops[0][0]
    # the lines above `_HIGHEST` of a wavelet with kinks move flat maxima by up to a percent
    polished: list[Refined] = []
    for top, bend in tops:
        near = any(_alike(top, other) for other in polished)
        if near or top.weighted < _OPEN * tops[0][0].weighted:
            continue
        whole = crest(signal, top.wavelet, top.period, top.time, top.half_cycles, every=True)
        polished.append(_climbed(signal, whole, (low, high), _LAST_STEP, bend)[0])
    return max(polished, key=lambda top: top.weighted)


def _alike(one: Refined, other: Refined) -> bool:
    """Return True if two points are so close that they probably belong to the same maximum."""
    apart = np.abs(_variables(one) - _variables(other)).max()
    return bool(apart < _ALIKE and abs(one.time - other.time) < _ALIKE * one.period)


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
        there = _uphill_of(here, move, bounds)
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


def _uphill_of(here: Refined, move: Float, bounds: tuple[Float, Float]) -> Refined | None:
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
    seen = math.floor(_HIGHEST * cut.period / period) + 1
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
    found = np.empty((len(points), 4 + energies.shape[1]))
    found[:, 0], found[:, 1] = periods, start + sums[:, 0] * periods
    np.divide(sums[:, 1:], periods[:, None] * energies, out=found[:, 4:])
    found[:, 3] = (sums[:, 1:] * found[:, 4:]).sum(axis=1)
    found[:, 2] = found[:, 3] * signal.weighting.of_square(periods)
    return found


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
        slides = [np.minimum(np.maximum(x + one, low), high) - x for one in slides]
        move = max(slides, key=lambda one: float(one @ (slope + 0.5 * bend @ one)))
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
    longest = float(np.abs(move).max())
    return np.asarray(move * min(1.0, _LONGEST_MOVE / longest) if longest > 0.0 else move)
