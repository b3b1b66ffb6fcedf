"""Refinement of the maxima of the search: Newton's method over period and half cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.matching.loops import crests
from rockframe.matching.signal import Signal, cut_around, holds, part_energies
from rockframe.wavelets.family import WAVELETS
from rockframe.wavelets.loops import fill_lines

Float = NDArray[np.float64]
#: ln T_p and, where the wavelet has it, the number of half cycles.
Variables = list[float]
#: Least and largest variables.
Bounds = tuple[Variables, Variables]
#: Second derivatives over the first variable, over both, and over the second.
Curvature = tuple[float, float, float]


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
#: Least curvature along an axis, so that steps are finite.
_FLATTEST: Final = 1e-6
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
    bounds = [math.log(periods[0])], [math.log(periods[1])]
    if starts[0].half_cycles is not None:
        bounds = [*bounds[0], half_cycles[0]], [*bounds[1], half_cycles[1]]
    tops = [_climbed(signal, start, bounds, _FIRST_STEP, None) for start in starts]
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
        polished.append(_climbed(signal, whole, bounds, _LAST_STEP, bend)[0])
    return _highest(polished)


def _highest(tops: Sequence[Refined]) -> Refined:
    """Return the highest maximum; of equal ones the earliest, as round-off must not decide."""
    least = (1.0 - _EQUAL) * max(top.weighted for top in tops)
    return min((top for top in tops if top.weighted >= least), key=lambda top: top.time)


def _alike(first: Refined, other: Refined) -> bool:
    """Return True if two points are so close that they probably belong to the same maximum."""
    apart = _apart(_variables(first), _variables(other))
    return apart < _ALIKE and abs(first.time - other.time) < _ALIKE * first.period


def _apart(first: Variables, other: Variables) -> float:
    return max(abs(a - b) for a, b in zip(first, other, strict=True))


def _climbed(
    signal: Signal, start: Refined, bounds: Bounds, step: float, bend: Curvature | None
) -> tuple[Refined, Curvature | None]:
    """Return the maximum near a point, and the last curvature; `bend` is the curvature if known."""
    transform, x, latest = _Transform(start), _variables(start), bend
    top = [start.period, start.time, start.weighted, start.explained, *start.factors]
    before: tuple[Variables, Variables] | None = None
    for _ in range(_MOST_MOVES):
        neighbours = transform.around(x, top[1], step, bounds, axes_alone=bend is not None)
        move, before, latest = _newton_move(neighbours, x, bounds, bend, before)
        uphill = _step_uphill(transform, x, top, move, bounds)
        if uphill is None:
            if step == _LAST_STEP and bend is None:
                break
            step, bend = max(_LAST_STEP, 0.2 * step), None
            continue
        there, top = uphill
        moved, x = _apart(there, x), there
        if moved < _ARRIVED and step == _LAST_STEP:
            break
        step = max(_LAST_STEP, min(step, 0.1 * moved))
        bend = latest if moved < _NEARBY else None
    here = transform.refined(x, top)
    whose = (here.wavelet, here.period, here.time, here.half_cycles)
    if not holds(here.signal, signal, *whose):
        again = crest(signal, *whose, every=here.every)
        return _climbed(signal, again, bounds, _LAST_STEP, None)
    return here, latest


class _Transform:
    """The transform of the samples around a maximum, with its lines.

    All points have the same number of lines, because with another number the height would jump.
    """

    def __init__(self, near: Refined) -> None:
        signal, weighting = near.signal, near.signal.weighting
        close = _WHOLE_NEAR if near.every else _NEAR
        power, velocity = weighting.power_of_square, weighting.of_velocity
        numbers = (signal.period, signal.duration, signal.start, close, power)
        self._near, self._lines = near, np.asarray(signal.spectrum[: near.lines], np.complex128)
        self._numbers = np.array(numbers)
        self._gaussians, self._energies = _parts(near.wavelet, velocity)

    def tops(self, points: Float, time: float) -> Float:
        """Return period, time, height, energy and factors of the maxima over time, in rows."""
        gaussians, energies, count = self._gaussians, self._energies, len(points)
        parts = energies.shape[1]
        if gaussians.size:
            spectra = np.empty((parts, self._lines.size), dtype=np.complex128)
        else:
            spectra = np.empty((parts * count, self._lines.size), dtype=np.complex128)
            energies = np.empty((count, parts))
            signal = self._near.signal
            fill_lines(points, signal.period, signal.weighting.of_velocity, spectra, energies)
        rows = np.empty((count, 4 + parts))
        crests(self._lines, self._numbers, gaussians, spectra, energies, points, time, rows)
        return rows

    def around(
        self, x: Variables, time: float, step: float, bounds: Bounds, *, axes_alone: bool
    ) -> _Neighbours:
        """Return the logarithms of heights around a point within the bounds.

        The curvature needs the point itself too: the series of its last maximum is around another
        time.
        """
        low, high = bounds
        middle = [
            min(max(value, least + step), most - step)
            for value, least, most in zip(x, low, high, strict=True)
        ]
        axes = _AXES[len(x)]
        offsets = axes[: 2 * len(x)] if axes_alone else axes
        heights = self.tops(np.array(middle) + step * offsets, time)[:, 2].tolist()
        return _Neighbours(middle, step, [math.log(max(height, 1e-300)) for height in heights])

    def refined(self, x: Variables, top: Sequence[float]) -> Refined:
        """Return a maximum over time, of a row of `tops`."""
        period, time, weighted, explained, *factors = top
        return replace(
            self._near,
            period=period,
            time=time,
            half_cycles=x[1] if len(x) > 1 else None,
            factors=tuple(factors),
            weighted=weighted,
            explained=explained,
        )


@dataclass(frozen=True)
class _Neighbours:
    """Logarithms of heights around a point, in the order of `_AXES`."""

    middle: Variables
    step: float
    logs: list[float]

    def slope(self) -> Variables:
        count = len(self.middle)
        pairs = zip(self.logs[:count], self.logs[count : 2 * count], strict=True)
        return [(after - ahead) / (2.0 * self.step) for after, ahead in pairs]

    def curvature(self) -> Curvature:
        if len(self.middle) == 1:
            after, ahead, here = self.logs
            return (after - 2.0 * here + ahead) / self.step**2, 0.0, 0.0
        right, up, left, down, here, *diagonals = self.logs
        cross = sum(diagonals) - (right + up) - (left + down) + 2.0 * here
        bends = (right - 2.0 * here + left, 0.5 * cross, up - 2.0 * here + down)
        first, both, second = (bend / self.step**2 for bend in bends)
        return first, both, second


def _step_uphill(
    transform: _Transform, x: Variables, top: list[float], move: Variables, bounds: Bounds
) -> tuple[Variables, list[float]] | None:
    """Return the point after a step, shortened until it leads uphill, and its maximum over time.

    It is None if it never leads uphill.
    """
    share = 1.0
    for _ in range(_MOST_CUTS):
        there = _within([a + share * b for a, b in zip(x, move, strict=True)], bounds)
        [row] = transform.tops(np.array([there]), top[1]).tolist()
        if row[2] >= top[2]:
            return there, row
        share *= 0.25
    return None


def _within(x: Variables, bounds: Bounds) -> Variables:
    return [min(max(a, low), high) for a, low, high in zip(x, *bounds, strict=True)]


def _newton_move(
    neighbours: _Neighbours,
    start: Variables,
    bounds: Bounds,
    bend: Curvature | None,
    before: tuple[Variables, Variables] | None,
) -> tuple[Variables, tuple[Variables, Variables], Curvature]:
    """Return the step to the top of the parabola through neighbours, and its slope and curvature.

    The slope is returned with the point at which it was found; `before` is the pair of the last
    step. It updates a known curvature of two variables; that of one variable is reused unchanged.
    """
    x, slope = neighbours.middle, neighbours.slope()
    if bend is None:
        bend = neighbours.curvature()
    elif before is not None and len(x) == 2:
        bend = _updated(bend, x, slope, *before)
    move = uphill(slope, bend)
    if len(x) == 2:
        move = _kept_within(bounds, x, slope, bend, move)
    return [a + b - c for a, b, c in zip(move, x, start, strict=True)], (x, slope), bend


def _updated(
    bend: Curvature, x: Variables, slope: Variables, last_x: Variables, last_slope: Variables
) -> Curvature:
    """Return a curvature that explains the change of the slope, by a matrix of rank one."""
    first, both, second = bend
    a, b = x[0] - last_x[0], x[1] - last_x[1]
    rest = slope[0] - last_slope[0] - (first * a + both * b)
    other = slope[1] - last_slope[1] - (both * a + second * b)
    along = rest * a + other * b
    if abs(along) <= 1e-3 * math.hypot(rest, other) * math.hypot(a, b):
        return bend
    return first + rest**2 / along, both + rest * other / along, second + other**2 / along


def _kept_within(
    bounds: Bounds, x: Variables, slope: Variables, bend: Curvature, move: Variables
) -> Variables:
    """Return a step of two variables; one that leaves the bounds turns along them, uphill."""
    ahead = [a + b for a, b in zip(x, move, strict=True)]
    target, slides = _within(ahead, bounds), []
    for held in (0, 1):
        if target[held] != ahead[held]:
            free = 1 - held
            slide = [target[0] - x[0], target[1] - x[1]]
            rest = slope[free] + bend[1] * slide[held]
            slide[free] = _uphill_alone(rest, bend[2 * free])
            stop = _within([x[0] + slide[0], x[1] + slide[1]], bounds)
            slides.append([stop[0] - x[0], stop[1] - x[1]])

    def rise(slide: Variables) -> float:
        a, b = slide
        curve = bend[0] * a**2 + 2.0 * bend[1] * a * b + bend[2] * b**2
        return slope[0] * a + slope[1] * b + 0.5 * curve

    return max(slides, key=rise) if slides else move


def _uphill_alone(slope: float, bend: float) -> float:
    move = slope / max(abs(bend), _FLATTEST)
    return move * (_LONGEST_MOVE / max(abs(move), _LONGEST_MOVE))


def uphill(slope: Variables, bend: Curvature) -> Variables:
    """Return the step of Newton's method, uphill also along axes on which the curve is hollow.

    Parameters
    ----------
    slope : list of float
        Slope over one or two variables.
    bend : tuple of float
        Second derivatives over the first variable, over both, and over the second.
    """
    first, both, second = bend
    if len(slope) == 1:
        return [_uphill_alone(slope[0], first)]
    mean, half = 0.5 * (first + second), 0.5 * (first - second)
    angle, radius = 0.5 * math.atan2(both, half), math.hypot(half, both)
    cosine, sine = math.cos(angle), math.sin(angle)
    along = (cosine * slope[0] + sine * slope[1]) / max(abs(mean + radius), _FLATTEST)
    across = (cosine * slope[1] - sine * slope[0]) / max(abs(mean - radius), _FLATTEST)
    move = [cosine * along - sine * across, sine * along + cosine * across]
    share = _LONGEST_MOVE / max(abs(move[0]), abs(move[1]), _LONGEST_MOVE)
    return [share * move[0], share * move[1]]


@cache
def _parts(wavelet: str, of_velocity: bool) -> tuple[Float, Float]:
    """Return the spectra and the energies of a wavelet's parts, as `crests` takes them.

    The spectra are empty, and there is no row of energies, where they depend on half cycles.
    """
    if WAVELETS[wavelet].has_half_cycles:
        return np.empty((0, 3)), np.empty((0, 2))
    gaussians = np.array([part.gaussian for part in WAVELETS[wavelet].parts(None)])
    if of_velocity:  # the integral is the spectrum over 2 pi i nu
        gaussians[:, 0] *= np.where(gaussians[:, 1] == 3.0, 0.5, -0.5) / math.pi
        gaussians[:, 1] -= 1.0
    energies = np.array([part_energies(wavelet, None, of_velocity)])
    return gaussians, np.repeat(energies, len(_AXES[2]), axis=0)


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
    transform, x = _Transform(here), _variables(here)
    [top] = transform.tops(np.array([x]), time).tolist()
    return transform.refined(x, top)


def _variables(point: Refined) -> Variables:
    x = [math.log(point.period)]
    return x if point.half_cycles is None else [*x, point.half_cycles]
