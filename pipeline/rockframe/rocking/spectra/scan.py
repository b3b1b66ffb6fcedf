"""Scan over the amplitude of a motion for all intervals in which frames overturn.

A full scan is needed because stability is not monotone in the amplitude. Between the amplitudes of
the scan, slivers are searched for where they are likely: near other edges, at the largest rotation
of frames that stand, and at the latest overturning of frames that overturn. Every edge that is
found is then bisected.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.notebook import Shown
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.spectra.refining import (
    Flips,
    Lines,
    Points,
    around_flips,
    concatenated,
    flipped,
    narrow,
    slivers,
)
from rockframe.wavelets.pulse import Pulse

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Float = NDArray[np.float64]
Int = NDArray[np.int64]


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


@dataclass(frozen=True, eq=False)
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
