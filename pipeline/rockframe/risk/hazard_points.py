"""From the points of a file to a hazard curve: bounds of rounded values, and refusals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.risk.hazard import HazardCurve
from rockframe.risk.measures import Measure

Float = NDArray[np.float64]

#: Column of the annual rates.
RATE: Final = "annual_rate"
#: A curve contains probabilities if it starts between `_NEAR_ONE` and 1 and falls with a smaller
#: power of the intensity than `_LEVEL`. Rates may level off too, but seldom just below 1 per year.
_NEAR_ONE: Final = 0.9
_LEVEL: Final = 0.5
#: The largest accepted rate is once a year at `Measure.yearly`, and falls with this power of the
#: intensity. It is several times the rate at the most active sites.
_FALL: Final = 2.0
_CONVERT: Final = (
    "If these are probabilities in 50 years, name the column probability_in_50_years: they are "
    "then converted"
)


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a curve in a file: intensities in the unit of the measure's column, and rates or
    probabilities.

    `years` is the time of the probabilities, or 0 for annual rates. `rounding` is half of the last
    printed digit of each value.
    """

    measure: Measure
    lines: Sequence[int]
    intensity: Float
    values: Float
    years: float
    rounding: Float


def curve_of(path: Path, points: Points, site: str = "") -> HazardCurve:
    """Return the curve of rates, without points that have no information."""
    measure, rates = points.measure, points.values
    printed, note = points.intensity, ""
    if points.years:
        wrong = np.flatnonzero(~((rates >= 0.0) & (rates <= 1.0)))
        if wrong.size:
            message = f"probability {rates[wrong[0]]:g}. Must be from 0 to 1."
            raise InputError(path, message, line=points.lines[wrong[0]])
    kept = np.ones(rates.size, dtype=bool)
    if points.years or len(set(points.lines)) < rates.size:  # written by a hazard program
        rates, note = _bounded(points)
        # of equal rates the largest intensity is kept
        kept = (rates > 0.0) & np.isfinite(rates) & (np.append(rates[1:], -1.0) != rates)
        if kept.sum() < 2:
            raise InputError(
                path,
                f"{kept.sum()} different rates at this site. Must be two or more.",
                line=points.lines[-1] if points.lines else 1,
            )
    for line, x, rate in zip(np.array(points.lines)[kept], printed[kept], rates[kept], strict=True):
        _require_possible(path, int(line), measure, float(x), float(rate))
    lines = np.array(points.lines, dtype=int)[kept]
    _require_monotone(path, lines, measure.column, printed[kept], rates[kept])
    if not points.years:
        _refuse_probabilities(path, lines, np.stack([printed[kept], rates[kept]], axis=1))
    return HazardCurve(measure.name, printed[kept] * measure.printed, rates[kept], site, note)


def _bounded(points: Points) -> tuple[Float, str]:
    """Return the rates of points, and what is uncertain about them in words.

    A probability of 1 has no rate, and one of 0 none above 0, but both are rounded. At the last 1
    the rate is at least, and at the first 0 at most, the one that the printed digits leave: this
    bound is used, unless a neighbour is beyond it. The other such points have no information (NaN).
    """
    values, noun = points.values, "probability" if points.years else "rate"
    bounds, notes = values.copy(), []
    ones = np.flatnonzero((values == 1.0) & (points.years > 0.0))
    zeros = np.flatnonzero(values == 0.0)
    bounds[ones] = bounds[zeros] = math.nan
    for ends, place, sign in ((ones, ones[-1:], -1.0), (zeros, zeros[:1], 1.0)):
        for k in place:
            bound = values[k] + sign * points.rounding[k]
            neighbour = max(k - 1, 0) if sign > 0.0 else min(k + 1, values.size - 1)
            beside = values[neighbour]
            above, below = (bound, beside) if sign < 0.0 else (beside, bound)
            used = above > below and ends.size < values.size
            bounds[k] = bound if used else math.nan
            at = f"{points.intensity[k]:g} {points.measure.unit}"
            reading = f"{noun} {values[k]:g} {'from' if sign > 0.0 else 'up to'} {at}"
            rate = f"{float(_annual(bound, points.years)):.2g} a year is used there"
            most = "most" if sign > 0.0 else "least"
            bounded = f"{rate}, the {most} that the printed digits leave"
            near = f"{points.intensity[neighbour]:g} {points.measure.unit}"
            order, change = ("below", f"above {near} count as {near}")
            if sign < 0.0:
                order, change = ("above", f"below {near} are not counted")
            leave = f"the printed digits leave a {noun} not {order} that at {near}"
            beyond = f"left out, because {leave}; motions {change}"
            notes.append(f"{reading}: {bounded if used else beyond}")
    return _annual(bounds, points.years), "; ".join(notes)


def _annual(values: Float | float, years: float) -> Float:
    """Return the annual rates of probabilities in a number of years; rates as they are."""
    return np.asarray(-np.log1p(-np.asarray(values)) / years if years else values)


def _require_monotone(
    path: Path, lines: NDArray[np.int_], column: str, intensity: Float, rates: Float
) -> None:
    """Require two points or more, with increasing intensities and decreasing, positive rates."""
    if rates.size < 2:
        line = int(lines[-1]) if lines.size else 1
        raise InputError(path, f"{rates.size} points. Must be two or more.", line=line)
    for values, name, sign, must in (
        (intensity, column, 1.0, "larger"),
        (rates, RATE, -1.0, "smaller"),
    ):
        wrong = np.flatnonzero(sign * np.diff(values) <= 0.0)
        if wrong.size:
            former, other = values[wrong[0] : wrong[0] + 2]
            raise InputError(
                path,
                f"{name} {other:g} after {former:g}. Must be {must}.",
                line=int(lines[wrong[0] + 1]),
            )
    if rates[-1] <= 0.0:
        raise InputError(path, f"{RATE} {rates[-1]:g}. Must be above 0.", line=int(lines[-1]))


def _require_possible(
    path: Path, line: int, measure: Measure, intensity: float, rate: float
) -> None:
    if not 0.0 < intensity <= measure.largest:
        message = (
            f"{measure.column} {intensity:g}. Must be above 0 and at most {measure.largest:g}."
        )
        raise InputError(path, message, line=line)
    if rate * (intensity / measure.yearly) ** _FALL > 1.0:
        most = (measure.yearly / intensity) ** _FALL
        raise InputError(
            path,
            f"{RATE} {rate:g} at {measure.column} {intensity:g}. Must be at most {most:.2g}: the "
            f"most active sites have less. {_CONVERT}.",
            line=line,
        )


def _refuse_probabilities(path: Path, lines: NDArray[np.int_], values: Float) -> None:
    """Reject a curve that starts just below 1 and stays there."""
    (weak, often), (strong, less) = values[:2]
    if _NEAR_ONE <= often <= 1.0 and often / less < (strong / weak) ** _LEVEL:
        raise InputError(
            path,
            f"{RATE} {often:g}, then {less:g}: level near 1, as if they were probabilities in many "
            f"years. {_CONVERT}.",
            line=int(lines[1]),
        )


def rounding_of(text: str) -> float:
    """Return half of the unit of the last digit of a printed number: the most that it is rounded.

    Examples
    --------
    >>> rounding_of("1.000000E+00"), rounding_of("0.10")
    (5e-07, 0.005)
    """
    digits = Decimal(text.strip()).as_tuple().exponent
    return 0.5 * 10.0 ** int(digits)
