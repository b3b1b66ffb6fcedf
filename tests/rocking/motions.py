"""Frames and simple motions that several tests use."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Response, respond
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
STOCKY = RockingFrame(height=2.0, width=1.2, mass_ratio=0.5)
SLENDER = RockingFrame(height=12.0, width=0.6)
SMALL = RockingFrame(height=0.6, width=0.2)


def noise(seed: int, samples: int, strength: float) -> Float:
    """Return white noise [m s-2]."""
    return strength * GRAVITY * np.random.default_rng(seed).uniform(-1.0, 1.0, samples)


def still(duration: float, time_step: float = 0.01) -> GroundAcceleration:
    return GroundAcceleration.from_samples(np.zeros(math.ceil(duration / time_step) + 1), time_step)


def release(
    frame: RockingFrame, ratio: float, duration: float, time_step: float = 0.01
) -> Response:
    """Release the frame from rest at a share of its slenderness."""
    return respond(frame, still(duration, time_step), initial_rotation=ratio * frame.slenderness)
