"""Robust margins of round columns under both directions of a ground motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking.assessments import RobustMargin
from rockframe.rocking.margins.first_overturning import LARGEST_SCALE, answered
from rockframe.rocking.margins.members import draws, require_members
from rockframe.rocking.margins.robust import FamilySearch, Grid
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wobbling import kernel
from rockframe.wobbling.ensemble import Family, family_of
from rockframe.wobbling.motion import PairAcceleration, PairMotion, as_pair
from rockframe.wobbling.response import integrated, require_no_flight

Float = NDArray[np.float64]

#: The scales of motions in both directions: a quarter of those in one plane, averaged over the same
#: range. The response is so chaotic that more scales would not reduce the error of 64 members.
IN_BOTH_DIRECTIONS: Final = Grid(step=0.04, averaged=1, to_rock=2, to_fall=1, block=1)
#: Largest downward acceleration of the ground that is allowed, as a share of gravity [1].
_NEARLY: Final = 1.0 - 1e-9


def wobbling_margins(
    motions: Sequence[PairMotion],
    frames: Sequence[RockingFrame],
    ensemble: Ensemble | None = None,
    *,
    largest_scale: float = LARGEST_SCALE,
    grid: Grid = IN_BOTH_DIRECTIONS,
) -> list[list[RobustMargin]]:
    """Find the scales at which 10, 25 and 50 % of round columns overturn under both directions.

    The search is that of `robust_margins`, with fewer scales: steps of 4 %. The first overturning
    of the structure as given is not searched, because its scale would be one of chance.

    Parameters
    ----------
    motions : sequence of PairAcceleration, HorizontalPair or BothDirections
        Ground motions, as for `wobble`.
    frames : sequence of RockingFrame
        The frames as stated, as for `wobble`.
    ensemble
        As for `wobbling_ensemble`.
    largest_scale : float
        Largest scale that is searched [1]. The search ends earlier if the ground would fall faster
        than gravity at a smaller scale.
    grid : Grid
        The scales.

    Returns
    -------
    list of list of RobustMargin
        For each motion the margins of all frames.

    Raises
    ------
    ParameterError
        As `wobbling_ensemble`; if the largest scale is below 1 or not finite.

    Examples
    --------
    >>> from rockframe import PairAcceleration, Pulse
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular")
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.2, T_p=1.5)
    >>> across = Pulse(wavelet="symmetric_ricker", a_p=2.5, T_p=1.5, time=0.4)
    >>> motion = PairAcceleration.from_pulses(pulse, across)
    >>> [[margin]] = wobbling_margins([motion], [column])
    >>> round(margin.s10, 1), round(margin.s50, 1)
    (1.2, 1.3)
    """
    chosen = ensemble or Ensemble()
    require_members(chosen)
    if not (math.isfinite(largest_scale) and largest_scale >= 1.0):
        raise ParameterError(f"Invalid largest scale {largest_scale!r}. Must be 1 or more.")
    families = [family_of(frame, chosen) for frame in frames]
    results = []
    for motion in motions:
        ground = as_pair(motion)
        require_no_flight(ground)
        results.append(
            [_margin(ground, family, chosen, largest_scale, grid) for family in families]
        )
    return results


def _margin(
    ground: PairAcceleration, family: Family, ensemble: Ensemble, largest_scale: float, grid: Grid
) -> RobustMargin:
    amplitude = draws(ensemble)[:, 3]
    lowest = 0.0 if ground.z is None else float(ground.z.min())
    largest = min(largest_scale, _NEARLY * GRAVITY / -lowest if lowest < 0.0 else math.inf)
    least = min(_least_scale(ground, frame) for frame in family.frames)
    fallen, _ = _tried(ground, family, np.arange(amplitude.size), amplitude, amplitude)
    begins = 0 if fallen.any() else None
    search = FamilySearch(amplitude, least, largest, ensemble.seed, grid, begins).search()

    def answer(request: tuple[NDArray[np.int64], Float]) -> tuple[NDArray[np.bool_], Float]:
        member, scale = request
        fallen, peaks = _tried(ground, family, member, scale, amplitude)
        return fallen, peaks / family.slenderness[member]

    robust: RobustMargin = answered(search, answer)
    return replace(robust, sampling_changes=-1)


def _tried(
    ground: PairAcceleration,
    family: Family,
    member: NDArray[np.int64],
    scale: Float,
    amplitude: Float,
) -> tuple[NDArray[np.bool_], Float]:
    """Return which members overturn at scales, and their peaks [rad]; the ensemble has some."""
    verdicts, peaks = np.empty(member.size, dtype=np.int8), np.empty(member.size)
    recorded = scale == amplitude[member]
    if recorded.any():
        answers, summaries = family.under(ground, amplitude)
        verdicts[recorded] = answers[member[recorded]]
        peaks[recorded] = summaries[member[recorded], kernel.PEAK]
    if not recorded.all():
        answers, summaries = integrated(ground, family.at(member[~recorded], scale[~recorded]))
        verdicts[~recorded], peaks[~recorded] = answers, summaries[:, kernel.PEAK]
    return verdicts == Verdict.OVERTURNS, peaks


def _least_scale(ground: PairAcceleration, frame: RockingFrame) -> float:
    """Return a scale below which the frame cannot uplift; infinite if the ground is still."""
    uplift = frame.uplift_acceleration
    upwards = 0.0 if ground.z is None else float(np.abs(ground.z).max())
    pull = ground.largest + uplift / GRAVITY * upwards
    return uplift / pull if pull > 0.0 else math.inf
