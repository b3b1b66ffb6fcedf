"""The simplest model of a contact that gives: a restoring moment that grows linearly before uplift.

Corners that shorten by s under the weight at rest let the frame rotate by s / b before one of each
pair lifts. Up to there the moment of the weight grows linearly, beyond it is that of eq (26). Each
passage through zero keeps the share (43) of the velocity.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray
from tests.validation.cases import Motion

from rockframe.frame import RockingFrame
from rockframe.units import GRAVITY

#: Longest time step [s], and the rotation [rad] at which a structure has overturned.
_STEP = 5.0e-5
_OVERTURNED = 1.2


def peak_ratio(frame: RockingFrame, motion: Motion, shortening: float) -> float:
    """Return the largest |theta| over the slenderness, also after the motion [1]."""
    rest = round(3.0 / motion.time_step)
    ground = np.concatenate([motion.acceleration, np.zeros(rest)]) / GRAVITY
    steps = math.ceil(motion.time_step / _STEP)
    peak = _peak(
        ground,
        motion.time_step / steps,
        steps,
        frame.slenderness,
        frame.effective_frequency_parameter**2,
        frame.restitution,
        2.0 * shortening / frame.width,
    )
    return float(peak) / frame.slenderness


@numba.njit
def acceleration(theta, ground, slenderness, squared, uplift):  # type: ignore[no-untyped-def]
    """Return theta'' [rad s-2] under a ground acceleration [g], with uplift at a rotation [rad]."""
    share = min(max(theta / uplift, -1.0), 1.0)
    across, upwards = share * math.sin(slenderness), math.cos(slenderness)
    weight = across * math.cos(theta) - upwards * math.sin(theta)
    inertia = upwards * math.cos(theta) + across * math.sin(theta)
    return -squared * (weight + ground * inertia)


@numba.njit
def _peak(ground: NDArray[np.float64], step, steps, slenderness, squared, kept, uplift):  # type: ignore[no-untyped-def]
    """Return the largest rotation [rad], with the method of Runge and Kutta at fixed steps."""
    theta, omega, peak = 0.0, 0.0, 0.0
    for index in range(ground.size - 1):
        slope = (ground[index + 1] - ground[index]) / steps
        for part in range(steps):
            first = ground[index] + slope * part
            middle, last = first + 0.5 * slope, first + slope
            a1 = acceleration(theta, first, slenderness, squared, uplift)
            w2 = omega + 0.5 * step * a1
            a2 = acceleration(theta + 0.5 * step * omega, middle, slenderness, squared, uplift)
            w3 = omega + 0.5 * step * a2
            a3 = acceleration(theta + 0.5 * step * w2, middle, slenderness, squared, uplift)
            w4 = omega + step * a3
            a4 = acceleration(theta + step * w3, last, slenderness, squared, uplift)
            following = theta + step / 6.0 * (omega + 2.0 * w2 + 2.0 * w3 + w4)
            omega += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            if theta * following < 0.0:
                omega *= kept
            theta = following
            peak = max(peak, abs(theta))
            if peak > _OVERTURNED:
                return peak
    return peak
