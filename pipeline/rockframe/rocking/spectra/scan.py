"""Scan over the amplitude of a motion for intervals of overturning, and bisect their edges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.notebook import Shown
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.scenarios import respond_scenarios
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from _typeshed import DataclassInstance
    from matplotlib.axes import Axes

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Arrays = TypeVar("Arrays", bound="DataclassInstance")

#: Number of intervals on either side of a flip that are divided, and the number of their parts.
_AROUND: Final = 3
_FINER: Final = 5
#: A candidate for a sliver is divided this many times, each half into `_DIVISIONS` parts. Scenarios
#: of one ground are computed side by side: a few more of them cost less than another round.
_DIVISIONS: Final = 4
_ROUNDS: Final = 4
#: Number of parts in the bisection of a flip: more than two need more responses, but fewer rounds.
_PARTS: Final = 4
#: Frames whose peak rotation is below this share of their slenderness are not near overturning.
_NEAR: Final = 0.7


@dataclass(frozen=True, eq=False)
class Lines:
    """The frames and ground motions of a `scan`."""

    grounds: Sequence[GroundAcceleration]
    frames: Sequence[RockingFrame]
    ground: Int
    frame: Int
    unit: Float

    def at(self, line: Int, amplitude: Float) -> Points:
        """Return the outcome of lines at amplitudes."""
        scenarios = respond_scenarios(
            self.grounds,
            self.frames,
            self.ground[line],
            self.frame[line],
            self.unit[line] * amplitude,
        )
        fallen = scenarios.verdict == Verdict.OVERTURNS
        fall = np.where(np.isnan(scenarios.overturning_time), np.inf, scenarios.overturning_time)
        lean = np.where(
            scenarios.peak_rotation_ratio >= _NEAR, scenarios.peak_rotation_ratio, -np.inf
        )
        nearness = np.where(fallen, fall, lean)
        return Points(line, amplitude, scenarios.verdict, fallen, nearness, scenarios.impacts)

    def within(self, three: Sequence[Points]) -> list[Points]:
        """Return the outcomes at three points of each line and between them, in order."""
        shares = np.arange(1, _DIVISIONS) / _DIVISIONS
        tried = [
            (1.0 - share) * a.amplitude + share * b.amplitude
            for a, b in pairwise(three)
            for share in shares
        ]
        points = self.at(np.tile(three[0].line, len(tried)), np.concatenate(tried))
        new = [points.take(part) for part in np.split(np.arange(points.line.size), len(tried))]
        return [three[0], *new[: shares.size], three[1], *new[shares.size :], three[2]]


@dataclass(frozen=True, eq=False)
class Points:
    """Amplitudes of lines and the outcomes there, as flat arrays.

    `nearness` is larger the nearer a point is to the opposite outcome: the peak rotation of a frame
    that stands, or the time of overturning of a frame that overturns.
    """

    line: Int
    amplitude: Float
    verdict: NDArray[np.int8]
    fallen: NDArray[np.bool_]
    nearness: Float
    impacts: NDArray[np.int32]

    def take(self, chosen: NDArray[np.generic]) -> Points:
        """Return the points that an index or a mask selects."""
        return Points(*(getattr(self, name)[chosen] for name in _FIELDS))

    def and_(self, other: Points) -> Points:
        """Return the points of both, sorted by line and amplitude."""
        both = concatenated([self, other])
        return both.take(np.lexsort((both.amplitude, both.line)))


_FIELDS: Final = tuple(Points.__dataclass_fields__)


@dataclass(frozen=True, eq=False)
class Flips:
    """Pairs of neighbouring amplitudes, of which one overturns and the other does not."""

    line: Int
    fallen: Float
    standing: Float
    impacts: NDArray[np.int32]

    @classmethod
    def between(cls, points: Points, other: Points) -> Flips:
        """Return the flips between points of the same lines with opposite outcomes."""
        return cls(
            points.line,
            np.where(points.fallen, points.amplitude, other.amplitude),
            np.where(points.fallen, other.amplitude, points.amplitude),
            np.where(points.fallen, points.impacts, other.impacts),
        )


def flipped(points: Points) -> NDArray[np.bool_]:
    """Return whether each point and the next one are of one line and have opposite outcomes."""
    one_line = np.equal(points.line[1:], points.line[:-1])
    return one_line & np.not_equal(points.fallen[1:], points.fallen[:-1])


def around_flips(lines: Lines, points: Points) -> Points:
    """Return more points around the flips, because other edges are often near."""
    flips = np.flatnonzero(flipped(points))
    near = flips[:, None] + np.arange(-_AROUND, _AROUND + 1)
    near = np.clip(near, 0, points.line.size - 2)
    whose = points.line[flips][:, None]
    own = (points.line[near] == whose) & (points.line[near + 1] == whose)
    left = np.unique(near[own])
    start, end = points.amplitude[left], points.amplitude[left + 1]
    shares = np.arange(1, _FINER) / _FINER
    amplitude = start[:, None] + shares * (end - start)[:, None]
    return lines.at(np.repeat(points.line[left], shares.size), amplitude.ravel())


def slivers(lines: Lines, points: Points) -> list[Flips]:
    """Find the flips on both sides of intervals thinner than the step between points.

    A candidate is three points of the same outcome, of which the middle one has the largest
    nearness. It is divided and shrunk around the point of largest nearness until a point has the
    opposite outcome, at most `_ROUNDS` times.
    """
    line, nearness = points.line, points.nearness
    alike = (line[:-2] == line[2:]) & ~flipped(points)[1:] & ~flipped(points)[:-1]
    highest = (nearness[1:-1] >= nearness[:-2]) & (nearness[1:-1] > nearness[2:])
    left = np.flatnonzero(alike & highest)
    three = [points.take(left + k) for k in range(3)]
    flips: list[Flips] = []
    for _ in range(_ROUNDS if left.size else 0):
        nine = lines.within(three)
        for before, after in pairwise(nine):
            hit = np.flatnonzero(before.fallen != after.fallen)
            flips.append(Flips.between(before.take(hit), after.take(hit)))
        other = [point.fallen != three[1].fallen for point in nine]
        rest = np.flatnonzero(~np.any(other, axis=0))
        if rest.size == 0:
            break
        centre = np.argmax([point.nearness[rest] for point in nine[1:-1]], axis=0)
        three = [_chosen(nine[k : len(nine) - 2 + k], centre, rest) for k in range(3)]
    return flips


def _chosen(points: list[Points], which: Int, rest: Int) -> Points:
    """Return for each remaining candidate the point that `which` selects."""
    return Points(
        *(
            np.stack([getattr(point, name)[rest] for point in points])[which, np.arange(rest.size)]
            for name in _FIELDS
        )
    )


def concatenated(parts: Sequence[Arrays]) -> Arrays:
    """Concatenate dataclasses of arrays, field by field."""
    names = [field.name for field in fields(parts[0])]
    return type(parts[0])(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in names)
    )


def narrow(lines: Lines, flips: Flips, tolerance: float) -> Flips:
    """Bisect flips to a relative tolerance."""
    fallen, standing = flips.fallen.copy(), flips.standing.copy()
    impacts = flips.impacts.copy()
    shares = np.arange(_PARTS + 1) / _PARTS
    while True:
        wide = np.flatnonzero(np.abs(fallen - standing) > tolerance * fallen)
        if wide.size == 0:
            return Flips(flips.line, fallen, standing, impacts)
        start, end = standing[wide, None], fallen[wide, None]
        within = (1.0 - shares) * start + shares * end
        tried = lines.at(np.repeat(flips.line[wide], _PARTS - 1), within[:, 1:-1].ravel())
        falls = np.column_stack([tried.fallen.reshape(wide.size, -1), np.ones(wide.size, bool)])
        counts = np.column_stack([tried.impacts.reshape(wide.size, -1), impacts[wide]])
        first, here = np.argmax(falls, axis=1), np.arange(wide.size)
        fallen[wide], standing[wide] = within[here, first + 1], within[here, first]
        impacts[wide] = counts[here, first]


@dataclass(frozen=True, eq=False)
class Scan:
    """Outcome of frames at each amplitude, and the intervals in which they overturn.

    A line is one pair of a frame and a ground motion.

    Parameters
    ----------
    verdict : array of int8, shape (lines, amplitudes)
        Values of `Verdict`.
    impacts : array of int32, shape (lines, amplitudes)
        Number of impacts during the motion, or before overturning.
    line : array of int, shape (intervals,)
        The line of each interval of overturning, in ascending order.
    lower, upper : array, shape (intervals,)
        Least and largest amplitude of the interval; both overturn the frame. `upper` is NaN if the
        interval continues beyond the last amplitude of the scan.
    impacts_at_lower : array of int32, shape (intervals,)
        Number of impacts before overturning at `lower`.
    """

    verdict: NDArray[np.int8]
    impacts: NDArray[np.int32]
    line: Int
    lower: Float
    upper: Float
    impacts_at_lower: NDArray[np.int32]

    def intervals(self) -> list[Float]:
        """Return the intervals of each line, shape (intervals, 2)."""
        bounds = np.searchsorted(self.line, np.arange(len(self.verdict) + 1))
        both = np.column_stack([self.lower, self.upper])
        return [both[start:end] for start, end in pairwise(bounds)]

    def ordered(self, order: Int) -> Scan:
        """Return the lines in another order."""
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        line = place[self.line]
        by_line = np.lexsort((self.lower, line))
        return Scan(
            self.verdict[order],
            self.impacts[order],
            line[by_line],
            self.lower[by_line],
            self.upper[by_line],
            self.impacts_at_lower[by_line],
        )


def islands(intervals: Float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the intervals of amplitude above the first overturning in which a frame stands.

    Parameters
    ----------
    intervals : array, shape (intervals, 2)
        Intervals in which the frame overturns, in ascending order. The last bound is NaN if the
        interval continues beyond the scan.
    end : float
        End of the scan, which also ends the last island.

    Examples
    --------
    >>> islands(np.array([[1.0, 2.0], [2.5, np.nan]]), 10.0)
    ((2.0, 2.5),)
    >>> islands(np.array([[1.0, 2.0]]), 10.0)
    ((2.0, 10.0),)
    """
    starts = intervals[:, 1][~np.isnan(intervals[:, 1])]
    ends = np.append(intervals[1:, 0], end)
    return tuple(zip(starts.tolist(), ends.tolist(), strict=False))


def scan(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    amplitudes: Float,
    *,
    tolerance: float,
    unit: Float | None = None,
) -> Scan:
    """Find all intervals of amplitude in which frames overturn.

    Parameters
    ----------
    grounds, frames : sequence
        Ground motions and frames.
    ground, frame : array of int, shape (lines,)
        Indices of the ground motion and the frame of each line. A line is one frame under one
        ground motion.
    amplitudes : array, shape (amplitudes,) or (lines, amplitudes)
        Factors of the ground motion of each line [1], ascending.
    tolerance : float
        Relative tolerance to which edges are bisected [1].
    unit : array, shape (lines,), optional
        Number by which the ground motion of each line is multiplied at an amplitude of 1; by
        default 1.

    Returns
    -------
    Scan
        The result of a line has the same bits whichever other lines are computed.
    """
    every = np.arange(np.size(ground))
    units = np.ones(every.size) if unit is None else unit
    lines = Lines(grounds, frames, np.asarray(ground), np.asarray(frame), units)
    grid = np.broadcast_to(amplitudes, (every.size, np.shape(amplitudes)[-1]))
    coarse = lines.at(np.repeat(every, grid.shape[1]), grid.ravel())
    points = coarse.and_(around_flips(lines, coarse))
    left = np.flatnonzero(flipped(points))
    flips = [Flips.between(points.take(left), points.take(left + 1)), *slivers(lines, points)]
    edges = narrow(lines, concatenated(flips), tolerance)
    first = np.searchsorted(points.line, every)
    starting = points.take(first[points.fallen[first]])
    return Scan(
        coarse.verdict.reshape(grid.shape),
        coarse.impacts.reshape(grid.shape),
        *_intervals(edges, starting),
    )


def _intervals(edges: Flips, starting: Points) -> tuple[Int, Float, Float, NDArray[np.int32]]:
    """Combine lower and upper edges; lines in `starting` overturn at their first amplitude."""
    rising = edges.fallen > edges.standing
    line = np.concatenate([edges.line[rising], starting.line])
    lower = np.concatenate([edges.fallen[rising], starting.amplitude])
    impacts = np.concatenate([edges.impacts[rising], starting.impacts])
    order = np.lexsort((lower, line))
    line, lower, impacts = line[order], lower[order], impacts[order]
    end_line, ends = edges.line[~rising], edges.fallen[~rising]
    order = np.lexsort((ends, end_line))
    end_line, ends = end_line[order], ends[order]
    # edges alternate: the k-th upper one of a line ends its k-th interval
    rank = np.arange(end_line.size) - np.searchsorted(end_line, end_line)
    upper = np.full(line.size, np.nan)
    upper[np.searchsorted(line, end_line) + rank] = ends
    return line, lower, upper, impacts


@dataclass(frozen=True, eq=False, repr=False)
class OverturningSpectrum(Shown):
    """Verdicts over pulse, slenderness, mass ratio, frequency ratio and amplitude.

    A line is one combination of pulse, slenderness, mass ratio and frequency ratio; lines are
    sorted in the order of these dimensions.

    Parameters
    ----------
    pulses : tuple of Pulse
        The pulses. Only their forms are used, not amplitude, period or time.
    slenderness, mass_ratio, frequency_ratio, amplitude : array
        Coordinates of these dimensions [rad], [1], [1], [1].
    found : Scan
        Verdicts, impacts and intervals of the lines.
    """

    pulses: tuple[Pulse, ...]
    slenderness: Float
    mass_ratio: Float
    frequency_ratio: Float
    amplitude: Float
    found: Scan

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Number of pulses, slendernesses, mass ratios and frequency ratios."""
        sizes = (self.slenderness.size, self.mass_ratio.size, self.frequency_ratio.size)
        return len(self.pulses), *sizes

    @property
    def minimum_overturning_amplitude(self) -> Float:
        """Least amplitude that overturns, a_p / (g tan slenderness) [1]; NaN if none does."""
        least = [bounds[0, 0] if len(bounds) else math.nan for bounds in self.found.intervals()]
        return np.array(least).reshape(self.shape)

    def facts(self) -> dict[str, str]:
        """Return the sizes of the dimensions, for the table in notebooks."""
        names = ("pulses", "slendernesses", "mass ratios", "frequency ratios")
        said = {name: str(size) for name, size in zip(names, self.shape, strict=True)}
        return {**said, "amplitudes": f"{self.amplitude.size} up to {self.amplitude[-1]:g}"}

    def draw(self, axes: Axes) -> None:
        """Draw the least amplitude that overturns, for the first pulse."""
        least = self.minimum_overturning_amplitude[0]
        for k, slenderness in enumerate(self.slenderness):
            for m, ratio in enumerate(self.mass_ratio):
                label = f"{math.degrees(slenderness):.3g}°, mass ratio {ratio:g}"
                axes.plot(self.frequency_ratio, least[k, m], label=label)
        axes.set(xlabel="ω_p/p", ylabel="least a_p/(g tan α)")
        axes.legend(fontsize=8)

    def to_xarray(self) -> xr.DataArray:
        """Return the least amplitude that overturns, a_p / (g tan alpha) [1]."""
        import xarray as xr

        dims = ("slenderness", "mass_ratio", "frequency_ratio")
        return xr.DataArray(
            self.minimum_overturning_amplitude,
            {name: getattr(self, name) for name in dims},
            ("pulse", *dims),
            name="minimum_overturning_amplitude",
            attrs={"units": "1"},
        )
