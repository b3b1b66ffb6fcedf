"""First overturnings of many frames under many motions, searched together."""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.batch import respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.sliver_search import (
    KEPT,
    FirstOverturning,
    SliverSearch,
)
from rockframe.rocking.scenario_packing import Prepared
from rockframe.rocking.stated_verdict import Verdict
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Request = TypeVar("Request")
Outcomes = TypeVar("Outcomes")
Result = TypeVar("Result")


def first_overturnings(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    least: Float,
    largest: Float,
) -> list[FirstOverturning]:
    """Find the first overturning of each pair of a frame and a ground motion.

    Parameters
    ----------
    grounds, frames : sequence
        Ground motions and frames.
    ground, frame : array of int, shape (lines,)
        Indices of the ground motion and the frame of each pair (line).
    least, largest : array, shape (lines,)
        Ends of the range of scales that is searched [1].

    Returns
    -------
    list of FirstOverturning
        The result of a line is the same, to the last bit, whichever other lines are computed.
    """
    prepared = [Prepared(one) for one in grounds]
    found: dict[int, FirstOverturning] = {}
    searches = [
        SliverSearch(float(low), float(high), frames[k].effective_frequency_parameter).search()
        for low, high, k in zip(least, largest, frame.tolist(), strict=True)
    ]
    wanted: dict[int, Float] = {}
    for line, one in enumerate(searches):
        advance(one, None, line, wanted, found)
    while wanted:
        lines = np.repeat([*wanted], [scales.size for scales in wanted.values()])
        answers = respond_scenarios(
            prepared,
            frames,
            ground[lines],
            frame[lines],
            np.concatenate([*wanted.values()]),
            excursions=KEPT,
        )
        start = 0
        for line, scales in [*wanted.items()]:
            part = slice(start, start + scales.size)
            start += scales.size
            answer = (
                answers.verdict[part] == Verdict.OVERTURNED,
                answers.peak_rotation_ratio[part],
                answers.excursions[part],
            )
            advance(searches[line], answer, line, wanted, found)
    return [found[line] for line in range(len(searches))]


def advance(
    search: Generator[Request, Outcomes, Result],
    answer: Outcomes | None,
    line: int,
    wanted: dict[int, Request],
    found: dict[int, Result],
) -> None:
    """Send an answer to a search; store its next request in `wanted` or its result in `found`."""
    try:
        wanted[line] = next(search) if answer is None else search.send(answer)
    except StopIteration as end:
        wanted.pop(line, None)
        found[line] = end.value


#: Largest multiple of the motion at which overturning is searched [1].
LARGEST_SCALE: Final = 10.0
#: Largest downward acceleration of the ground that is allowed, as a share of gravity [1].
_NEARLY: Final = 1.0 - 1e-9


def largest_scale_of(ground: GroundAcceleration, largest_scale: float) -> float:
    """Return the largest scale of a search, at which the ground falls more slowly than gravity.

    Parameters
    ----------
    ground : GroundAcceleration
        The motion.
    largest_scale : float
        Largest scale if there is no vertical motion [1].

    Raises
    ------
    ParameterError
        If the largest scale is below 1 or not finite.
    """
    if not (math.isfinite(largest_scale) and largest_scale >= 1.0):
        raise ParameterError(f"Invalid largest scale {largest_scale!r}. Must be 1 or more.")
    lowest = ground.upward_bounds()[0]
    return min(largest_scale, _NEARLY * GRAVITY / -lowest if lowest < 0.0 else math.inf)


def least_scale_of(ground: GroundAcceleration, frame: RockingFrame) -> float:
    """Return a scale below which the frame cannot uplift; infinite if the ground is still."""
    powers = ground.time_step ** np.arange(ground.coefficients.shape[1])
    strongest = float((np.abs(ground.coefficients) * powers).sum(axis=1).max())
    tangent = frame.uplift_acceleration / GRAVITY
    pull = strongest + tangent * max(abs(bound) for bound in ground.upward_bounds())
    return frame.uplift_acceleration / pull if pull > 0.0 else math.inf
