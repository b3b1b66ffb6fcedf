"""Intervals of scale at which a frame overturns, drawn as strips in figures and pages."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Strip:
    """Intervals of the scale that overturn a frame, and its robust margin.

    Parameters
    ----------
    overturning : tuple of (float, float)
        Intervals of scale that were found to overturn the frame [1], increasing.
    largest_scale : float
        Largest scale that was searched [1].
    robust : tuple of float
        Scales at which 10, 25 and 50 % of the ensemble overturn [1]; NaN if that share never
        overturns. Empty if robust margins were not requested.
    """

    overturning: tuple[tuple[float, float], ...]
    largest_scale: float
    robust: tuple[float, ...] = ()

    @property
    def words(self) -> str:
        """The strip in words.

        Examples
        --------
        >>> Strip(((0.62, 0.63), (0.9, 10.0)), 10.0, (0.95, 1.021, math.nan)).words
        'overturns from 0.62; 10, 25, 50 % overturn at 0.95, 1.02, –'
        """
        words = f"stands up to {self.largest_scale:.3g}"
        if self.overturning:
            words = f"overturns from {self.overturning[0][0]:.2f}"
        shares = ("–" if math.isnan(one) else f"{one:.2f}" for one in self.robust)
        return words + (f"; 10, 25, 50 % overturn at {', '.join(shares)}" if self.robust else "")


def strip_of(
    critical_scale: float,
    largest_scale: float,
    islands: Iterable[tuple[float, float]],
    robust: tuple[float, ...] = (),
) -> Strip:
    """Return the strip of a critical scale (NaN if none was found) and the islands above it.

    Examples
    --------
    >>> strip_of(0.5, 10.0, [(0.6, 0.7), (2.0, 10.0)]).overturning
    ((0.5, 0.6), (0.7, 2.0))
    """
    if math.isnan(critical_scale):
        return Strip((), largest_scale, robust)
    starts, ends = [critical_scale], []
    for start, end in islands:
        ends.append(start)
        starts.append(end)
    intervals = zip(starts, [*ends, largest_scale], strict=True)
    return Strip(tuple((a, b) for a, b in intervals if a < largest_scale), largest_scale, robust)
