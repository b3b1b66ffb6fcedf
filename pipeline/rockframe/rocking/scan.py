"""Overturning over amplitude: a full scan, because stability is not monotone in it.

Between its amplitudes slivers are looked for where they announce themselves: beside other edges,
and where a frame that stands leans furthest or one that falls takes longest. Every edge that is
found is then bisected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.batch import respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Verdict

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: So many intervals on both sides of a flip are divided into so many.
_AROUND: Final = 3
_FINER: Final = 5
#: Halvings of the amplitudes around a furthest lean or a longest fall.
_HALVINGS: Final = 8
#: Frames that lean less than this share of their slenderness are not near their overturning.
_NEAR: Final = 0.7


@dataclass(frozen=True, eq=False)
class Scan:
    """What becomes of frames at each amplitude, and the intervals in which they overturn.

    A line is one frame on one ground.

    Parameters
    ----------
    verdict : array of int8, shape (lines, amplitudes)
        Values of `Verdict`.
    impacts : array of int32, shape (lines, amplitudes)
        Impacts during the motion; of what overturns those before it.
    line : array of int, shape (intervals,)
        The line of each interval of overturning, in ascending order.
    lower, upper : array, shape (intervals,)
        Least and largest amplitude of the interval, both of which overturn; `upper` is NaN if the
        interval goes on beyond the last amplitude of the scan.
    impacts_at_lower : array of int32, shape (intervals,)
        Impacts before overturning, at `lower`.
    """

    verdict: NDArray[np.int8]
    impacts: NDArray[np.int32]
    line: Int
    lower: Float
    upper: Float
    impacts_at_lower: NDArray[np.int32]

    def intervals(self) -> list[Float]:
        """Return for each line its intervals, shape (intervals, 2)."""
        bounds = np.searchsorted(self.line, np.arange(len(self.verdict) + 1))
        both = np.column_stack([self.lower, self.upper])
        return [both[start:end] for start, end in pairwise(bounds)]


def islands(intervals: Float, end: float) -> tuple[tuple[float, float], ...]:
    """Return the amplitudes between which a frame stands above its first overturning.

    Parameters
    ----------
    intervals : array, shape (intervals, 2)
        Where it overturns, in ascending order; NaN as the last bound if it goes on.
    end : float
        Where the scan ends, and with it an island that it leaves unfinished.

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


@dataclass(frozen=True, eq=False)
class _Lines:
    """Frames on grounds, as `scan` was asked for them."""

    grounds: Sequence[GroundAcceleration]
    frames: Sequence[RockingFrame]
    ground: Int
    frame: Int

    def at(self, line: Int, amplitude: Float) -> _Points:
        found = respond_scenarios(
            self.grounds, self.frames, self.ground[line], self.frame[line], amplitude
        )
        fallen = found.verdict == Verdict.OVERTURNED
        fall = np.where(np.isnan(found.overturning_time), np.inf, found.overturning_time)
        lean = np.where(found.peak_rotation_ratio >= _NEAR, found.peak_rotation_ratio, -np.inf)
        nearness = np.where(fallen, fall, lean)
        return _Points(line, amplitude, found.verdict, fallen, nearness, found.impacts)


@dataclass(frozen=True, eq=False)
class _Points:
    """Amplitudes and what becomes of the lines there; flat arrays.

    `nearness` grows towards what is of the other kind: the largest rotation of what stands, the
    time of the fall of what does not.
    """

    line: Int
    amplitude: Float
    verdict: NDArray[np.int8]
    fallen: NDArray[np.bool_]
    nearness: Float
    impacts: NDArray[np.int32]

    def take(self, chosen: NDArray[np.generic]) -> _Points:
        return _Points(*(getattr(self, name)[chosen] for name in _FIELDS))

    def and_(self, other: _Points) -> _Points:
        """Both, by line and amplitude."""
        both = _Points(
            *(np.concatenate([getattr(self, name), getattr(other, name)]) for name in _FIELDS)
        )
        return both.take(np.lexsort((both.amplitude, both.line)))


_FIELDS: Final = tuple(_Points.__dataclass_fields__)


@dataclass(frozen=True, eq=False)
class _Flips:
    """Neighbours of which one overturns and the other does not; flat arrays."""

    line: Int
    fallen: Float
    standing: Float
    impacts: NDArray[np.int32]

    @classmethod
    def between(cls, one: _Points, other: _Points) -> _Flips:
        """Points of the same lines, of the other kind each."""
        return cls(
            one.line,
            np.where(one.fallen, one.amplitude, other.amplitude),
            np.where(one.fallen, other.amplitude, one.amplitude),
            np.where(one.fallen, one.impacts, other.impacts),
        )


def scan(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    amplitudes: Float,
    *,
    tolerance: float,
) -> Scan:
    """Find all intervals of amplitude in which frames overturn.

    Parameters
    ----------
    grounds, frames : sequence
        What shakes, and what is shaken.
    ground, frame : array of int, shape (lines,)
        Which of them make a line.
    amplitudes : array, shape (amplitudes,) or (lines, amplitudes)
        What each ground is multiplied by [1], ascending.
    tolerance : float
        Edges are bisected until they are known to so much, relative to themselves.

    Returns
    -------
    Scan
        The same bits whatever the other lines are.
    """
    lines = _Lines(grounds, frames, np.asarray(ground), np.asarray(frame))
    every = np.arange(lines.ground.size)
    grid = np.broadcast_to(amplitudes, (every.size, np.shape(amplitudes)[-1]))
    coarse = lines.at(np.repeat(every, grid.shape[1]), grid.ravel())
    points = coarse.and_(_around_flips(lines, coarse))
    left = np.flatnonzero(_flipped(points))
    flips = [_Flips.between(points.take(left), points.take(left + 1)), *_slivers(lines, points)]
    edges = _bisect(lines, _join(flips), tolerance)
    first = np.searchsorted(points.line, every)
    starting = points.take(first[points.fallen[first]])
    return Scan(
        coarse.verdict.reshape(grid.shape),
        coarse.impacts.reshape(grid.shape),
        *_intervals(edges, starting),
    )


def _flipped(points: _Points) -> NDArray[np.bool_]:
    """Whether each point and the next one are of one line and of two kinds."""
    one_line = np.equal(points.line[1:], points.line[:-1])
    return one_line & np.not_equal(points.fallen[1:], points.fallen[:-1])


def _around_flips(lines: _Lines, points: _Points) -> _Points:
    """Where one edge is, others are near: more points between those around each flip."""
    flipped = _flipped(points).astype(np.float64)
    near = np.convolve(flipped, np.ones(2 * _AROUND + 1), "same") > 0.5
    near &= (points.line[1:] == points.line[:-1]) & (points.amplitude[1:] > points.amplitude[:-1])
    left = np.flatnonzero(near)
    start, end = points.amplitude[left], points.amplitude[left + 1]
    shares = np.arange(1, _FINER) / _FINER
    amplitude = start[:, None] + shares * (end - start)[:, None]
    return lines.at(np.repeat(points.line[left], shares.size), amplitude.ravel())


def _slivers(lines: _Lines, points: _Points) -> list[_Flips]:
    """Flips on both sides of what is thinner than the step between points.

    Each candidate is three points of one kind, the middle one the nearest to the other kind. It
    shrinks around its nearest point until that is of the other kind.
    """
    line, nearness = points.line, points.nearness
    alike = (line[:-2] == line[2:]) & ~_flipped(points)[1:] & ~_flipped(points)[:-1]
    highest = (nearness[1:-1] >= nearness[:-2]) & (nearness[1:-1] > nearness[2:])
    left = np.flatnonzero(alike & highest & (nearness[1:-1] > -np.inf))
    three = [points.take(left + k) for k in range(3)]
    found: list[_Flips] = []
    for _ in range(_HALVINGS):
        between = [lines.at(a.line, 0.5 * (a.amplitude + b.amplitude)) for a, b in pairwise(three)]
        five = [three[0], between[0], three[1], between[1], three[2]]
        other = np.stack([point.fallen != three[1].fallen for point in between])
        for k in (0, 1):
            hit = np.flatnonzero(other[k])
            found += [
                _Flips.between(five[2 * k + 1].take(hit), five[side].take(hit))
                for side in (2 * k, 2 * k + 2)
            ]
        rest = np.flatnonzero(~other.any(axis=0))
        if rest.size == 0:
            break
        centre = np.argmax([point.nearness[rest] for point in five[1:4]], axis=0)
        three = [_chosen(five[k : k + 3], centre, rest) for k in range(3)]
    return found


def _chosen(points: list[_Points], which: Int, rest: Int) -> _Points:
    """Of each of the rest the point that is asked for."""
    return _Points(
        *(
            np.stack([getattr(point, name)[rest] for point in points])[which, np.arange(rest.size)]
            for name in _FIELDS
        )
    )


def _join(parts: Sequence[_Flips]) -> _Flips:
    return _Flips(
        np.concatenate([part.line for part in parts]),
        np.concatenate([part.fallen for part in parts]),
        np.concatenate([part.standing for part in parts]),
        np.concatenate([part.impacts for part in parts]),
    )


def _bisect(lines: _Lines, flips: _Flips, tolerance: float) -> _Flips:
    fallen, standing = flips.fallen.copy(), flips.standing.copy()
    impacts = flips.impacts.copy()
    while True:
        wide = np.flatnonzero(np.abs(fallen - standing) > tolerance * fallen)
        if wide.size == 0:
            return _Flips(flips.line, fallen, standing, impacts)
        middle = lines.at(flips.line[wide], 0.5 * (fallen[wide] + standing[wide]))
        inward, outward = wide[middle.fallen], wide[~middle.fallen]
        fallen[inward] = middle.amplitude[middle.fallen]
        impacts[inward] = middle.impacts[middle.fallen]
        standing[outward] = middle.amplitude[~middle.fallen]


def _intervals(edges: _Flips, starting: _Points) -> tuple[Int, Float, Float, NDArray[np.int32]]:
    """Lower and upper edges put together; a line may overturn at its first amplitude already."""
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
