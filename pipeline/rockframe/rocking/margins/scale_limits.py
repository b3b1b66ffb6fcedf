"""Limits of the multiples of a motion that are searched for overturning."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.units import GRAVITY

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
