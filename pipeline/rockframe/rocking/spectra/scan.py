"""Overturning over amplitude: a full scan, because stability is not monotone in it.

Between its amplitudes slivers are looked for where they announce themselves: beside other edges,
and where a frame that stands leans furthest or one that falls takes longest. Every edge that is
found is then bisected.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.spectra.refining import (
    Flips,
    Lines,
    Points,
    around_flips,
    flipped,
    join,
    narrow,
    slivers,
)

Float = NDArray[np.float64]
Int = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Scan:
    """Outcome of frames at each amplitude, and the intervals in which they overturn.

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
        Indices of the ground motion and the frame of each line.
    amplitudes : array, shape (amplitudes,) or (lines, amplitudes)
        Factors of the ground motion of each line [1], ascending.
    tolerance : float
        Relative tolerance to which edges are bisected [1].
    unit : array, shape (lines,), optional
        Multiple of the ground that is an amplitude of 1 [1]; by default the ground itself.

    Returns
    -------
    Scan
        The numbers of a line do not depend on the other lines, to the last bit.
    """
    every = np.arange(np.size(ground))
    units = np.ones(every.size) if unit is None else unit
    lines = Lines(grounds, frames, np.asarray(ground), np.asarray(frame), units)
    grid = np.broadcast_to(amplitudes, (every.size, np.shape(amplitudes)[-1]))
    coarse = lines.at(np.repeat(every, grid.shape[1]), grid.ravel())
    points = coarse.and_(around_flips(lines, coarse))
    left = np.flatnonzero(flipped(points))
    flips = [Flips.between(points.take(left), points.take(left + 1)), *slivers(lines, points)]
    edges = narrow(lines, join(flips), tolerance)
    first = np.searchsorted(points.line, every)
    starting = points.take(first[points.fallen[first]])
    return Scan(
        coarse.verdict.reshape(grid.shape),
        coarse.impacts.reshape(grid.shape),
        *_intervals(edges, starting),
    )


def _intervals(edges: Flips, starting: Points) -> tuple[Int, Float, Float, NDArray[np.int32]]:
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
