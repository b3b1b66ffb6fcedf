"""Continuous refinement of the period, time and half cycles of a maximum.

The inner products are summed over the record's spectrum, where they are smooth functions of all
three for any samples. The phase follows in closed form, and the time from the Taylor series of the
products around a nearby time. This leaves one or two variables for Newton's method.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.series import taylor, top_near
from rockframe.matching.signal import Signal, part_energies, part_spectra

Float = NDArray[np.float64]

#: Largest frequency times T_p to which spectra of wavelets are summed. Beyond it, Ricker wavelets
#: are below 1e-16; the tail of a wavelet with kinks moves flat maxima by up to a percent.
_HIGHEST: Final = 8.0
#: Terms of the Taylor series over time, and the distance over T_p within which it is accurate.
_TERMS: Final = 6
_NEAR: Final = 0.06
#: The same for sums over all lines: fewer terms, because those of high frequency grow fast.
_WHOLE_TERMS: Final = 3
_WHOLE_NEAR: Final = 1e-3
_MOST_SHIFTS: Final = 30
#: Steps of the finite differences over ln T_p and half cycles: the first, and the smallest, which
#: leaves errors of 1e-8 in T_p.
_FIRST_STEP: Final = 4e-3
_LAST_STEP: Final = 1e-4
#: Longest step of Newton's method, and the step at which it has converged.
_LONGEST_MOVE: Final = 0.1
_ARRIVED: Final = 1e-6
#: How often a step that leads downhill is cut to a quarter.
_MOST_CUTS: Final = 6
#: Share of the highest maximum above which others are polished too, and the difference below
#: which they count as equal.
_OPEN: Final = 0.998
_ALIKE: Final = 0.05
#: Longest step after which the curvature is reused.
_NEARBY: Final = 0.01
_MOST_MOVES: Final = 40


@dataclass(frozen=True)
class Refined:
    """A maximum of the transform.

    Parameters
    ----------
    wavelet : str
        Name.
    period, time : float
        T_p and centre [s].
    half_cycles : float or None
        Number of half cycles [1].
    factors : tuple of float
        Least-squares factor of each part of the wavelet, in the unit of the signal.
    weighted : float
        Weighted square of the coefficient: the quantity that is maximised.
    explained : float
        Energy of the signal that the wavelet explains.
    lines : int
        Number of spectral lines summed.
    """

    wavelet: str
    period: float
    time: float
    half_cycles: float | None
    factors: tuple[float, ...]
    weighted: float
    explained: float
    lines: int


def refine(
    signal: Signal,
    starts: Sequence[Refined],
    periods: tuple[float, float],
    half_cycles: tuple[float, float],
) -> Refined:
    """Climb from several points to the maxima near them, and return the highest.

    Parameters
    ----------
    signal : Signal
        The record.
    starts : sequence of Refined
        Results of `crest` at points of the grid.
    periods, half_cycles : tuple of float
        Bounds of the two variables.
    """
    count = 1 if starts[0].half_cycles is None else 2
    low = np.array([math.log(periods[0]), half_cycles[0]])[:count]
    high = np.array([math.log(periods[1]), half_cycles[1]])[:count]
    tops = [_climbed(signal, start, (low, high), _FIRST_STEP, None) for start in starts]
    tops.sort(key=lambda top: -top[0].weighted)
    if starts[0].half_cycles is None:
        return tops[0][0]
    # the tail of a wavelet with kinks moves flat maxima by up to a percent
    polished: list[Refined] = []
    for top, bend in tops:
        near = any(_alike(top, other) for other in polished)
        if near or top.weighted < _OPEN * tops[0][0].weighted:
            continue
        whole = crest(
            signal, top.wavelet, top.period, top.time, top.half_cycles, signal.spectrum.size
        )
        polished.append(_climbed(signal, whole, (low, high), _LAST_STEP, bend)[0])
    return max(polished, key=lambda top: top.weighted)


def _alike(one: Refined, other: Refined) -> bool:
    """Return True if two points, not yet refined, probably belong to the same maximum."""
    apart = np.abs(_variables(one) - _variables(other)).max()
    return bool(apart < _ALIKE and abs(one.time - other.time) < _ALIKE * one.period)


def _climbed(
    signal: Signal,
    start: Refined,
    bounds: tuple[Float, Float],
    step: float,
    bend: Float | None,
) -> tuple[Refined, Float | None]:
    """Return the maximum near a point, and the last curvature; `bend` is a known curvature."""
    here, latest = start, bend
    for _ in range(_MOST_MOVES):
        x = _variables(here)
        move, latest = _newton_move(signal, here, step, bounds, bend)
        there = _uphill_of(signal, here, move, bounds)
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
    return here, latest


def _uphill_of(
    signal: Signal, here: Refined, move: Float, bounds: tuple[Float, Float]
) -> Refined | None:
    """Return the point after a step, shortened until it leads uphill; None if it never does."""
    x = _variables(here)
    for _ in range(_MOST_CUTS):
        there = _at(signal, here, np.clip(x + move, *bounds))
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
    lines: int | None = None,
) -> Refined:
    """Return the best time near a given one, and the phase and amplitude, at a fixed period.

    Parameters
    ----------
    signal : Signal
        The record.
    wavelet : str
        Name.
    period, time : float
        T_p and the time from which to climb [s].
    half_cycles : float or None
        Number of half cycles [1].
    lines : int, optional
        Number of spectral lines to sum. It must be the same for all points that are compared,
        because another line would make the height jump.
    """
    velocity = signal.weighting.of_velocity
    seen = math.floor(_HIGHEST * signal.period / period) + 1
    bins = min(signal.spectrum.size, seen if lines is None else lines)
    line = period / signal.period
    energies = part_energies(wavelet, half_cycles, velocity)
    spectra = part_spectra(wavelet, half_cycles, line, bins, velocity)
    matched = np.conj(np.stack(spectra)) * signal.spectrum[:bins]
    terms, near = (_TERMS, _NEAR) if bins <= seen else (_WHOLE_TERMS, _WHOLE_NEAR)
    for _ in range(_MOST_SHIFTS):
        series = taylor(matched, line, time / period, terms) * (2.0 * line)
        ends = (-time / period, (signal.duration - time) / period)
        shift = top_near(series, energies, (max(ends[0], -near), min(ends[1], near)))
        time += period * shift
        if abs(shift) < near:
            break
    powers = shift ** np.arange(terms)
    products = series @ powers
    explained = float((products**2 / (period * np.array(energies))).sum())
    return Refined(
        wavelet,
        period,
        time,
        half_cycles,
        tuple((products / (period * np.array(energies))).tolist()),
        explained * period ** (1.0 - 2.0 * signal.weighting.exponent),
        explained,
        bins,
    )


def _variables(point: Refined) -> Float:
    x = [math.log(point.period)]
    return np.array(x if point.half_cycles is None else [*x, point.half_cycles])


def _at(signal: Signal, near: Refined, x: Float) -> Refined:
    number = None if near.half_cycles is None else float(x[1])
    return crest(signal, near.wavelet, math.exp(x[0]), near.time, number, near.lines)


def _newton_move(
    signal: Signal,
    here: Refined,
    step: float,
    bounds: tuple[Float, Float],
    bend: Float | None,
) -> tuple[Float, Float]:
    """Return the step to the top of the parabola through neighbours, and its curvature."""
    low, high = bounds
    start = _variables(here)
    x = np.clip(start, low + step, high - step)  # keeps the neighbours within the bounds
    axes = np.eye(x.size)

    def height(offset: Float) -> float:
        return math.log(max(_at(signal, here, x + step * offset).weighted, 1e-300))

    after = np.array([height(axis) for axis in axes])
    before = np.array([height(-axis) for axis in axes])
    slope = (after - before) / (2.0 * step)
    if bend is None:
        middle = height(0.0 * axes[0])  # the series of `here` is around another time
        bend = np.diag(after - 2.0 * middle + before) / step**2
        if x.size == 2:
            corners = height(axes[0] + axes[1]) + height(-axes[0] - axes[1])
            cross = corners - after.sum() - before.sum() + 2.0 * middle
            bend += 0.5 * cross / step**2 * (1.0 - axes)
    move = _uphill(slope, bend)
    target = np.clip(x + move, low, high)
    held = target != x + move
    if held.any() and not held.all():  # slide along the bound
        free = ~held
        rest = slope[free] + bend[np.ix_(free, held)] @ (target - x)[held]
        move[free] = _uphill(rest, bend[np.ix_(free, free)])
        move[held] = (target - x)[held]
    return move + x - start, bend


def _uphill(slope: Float, bend: Float) -> Float:
    values, axes = np.linalg.eigh(bend)
    along = axes.T @ slope
    move = axes @ (along / np.maximum(np.abs(values), 1e-6))
    longest = float(np.abs(move).max())
    return np.asarray(move * min(1.0, _LONGEST_MOVE / longest) if longest > 0.0 else move)
