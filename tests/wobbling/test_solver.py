"""The kernel compared with scipy's DOP853, which shares no code with it: theta cos phi and theta
sin phi as variables, the derivatives of B and V by differences, one integration per sample.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from rockframe import PairAcceleration, RockingFrame, wobble
from rockframe.units import GRAVITY

from .cases import Float, random_frame, random_motion, with_tendon

#: Least theta at which no further pass near upright follows within a sample [rad].
_TINY = 1e-9
#: Step of the central differences of order 6 [rad].
_APART = 1e-3


class Model:
    """Inertia, potential and moment arm of a frame as functions of theta, per mass of a column."""

    def __init__(self, frame: RockingFrame) -> None:
        self.frame, self.gamma = frame, frame.mass_ratio
        self.b, self.z = 0.5 * frame.width, frame.centre_height
        self.reach = 0.5 * (frame.width + frame.top_contact_width)
        self.i1 = (frame.inertia_ratio - 1.0) * (self.b**2 + self.z**2)
        ratio = frame.top_contact_width / frame.width
        heights = np.linspace(0.0, 1.0, 20001)
        area = (1.0 + (ratio - 1.0) * heights) ** 2
        centre = np.trapezoid(area * heights, heights) / np.trapezoid(area, heights)
        spread = np.trapezoid(area * (heights - centre) ** 2, heights)
        along = spread / np.trapezoid(area, heights) * frame.height**2
        self.i3 = 2.0 * (self.i1 - float(along))
        self.a = self.b**2 + self.z**2 + self.i1 + self.gamma * (self.reach**2 + frame.height**2)

    def rho(self, theta: float) -> float:
        return self.b * (1.0 - math.cos(theta)) + self.z * math.sin(theta)

    def u(self, theta: float) -> float:
        return self.reach * (1.0 - math.cos(theta)) + self.frame.height * math.sin(theta)

    def arm(self, theta: float) -> float:
        return self.rho(theta) + self.gamma * self.u(theta)

    def inertia(self, theta: float) -> float:
        round_ = self.i1 * math.sin(theta) ** 2 + self.i3 * (1.0 - math.cos(theta)) ** 2
        return self.rho(theta) ** 2 + self.gamma * self.u(theta) ** 2 + round_

    def lift(self, theta: float) -> float:
        column = self.b * math.sin(theta) + self.z * (math.cos(theta) - 1.0)
        slab = self.reach * math.sin(theta) + self.frame.height * (math.cos(theta) - 1.0)
        return column + self.gamma * slab

    def tie(self, theta: float) -> float:
        tendon = self.frame.tendon
        if tendon is None:
            return 0.0
        stretch = 2.0 * self.frame.tie_lever * math.sin(0.5 * theta)
        work = tendon.prestress * stretch + 0.5 * tendon.stiffness * stretch**2
        return work / (self.frame.column_mass or math.nan)

    def slope(self, name: str, theta: float) -> float:
        """Return the derivative of one of these; all are analytic also at negative theta."""
        function, h = getattr(self, name), _APART
        sums = ((45.0, 1), (-9.0, 2), (1.0, 3))
        apart = [c * (function(theta + k * h) - function(theta - k * h)) for c, k in sums]
        return float(sum(apart)) / (60.0 * h)

    def rates(self, y: Float, ground: Float) -> Float:
        theta = math.hypot(y[0], y[1])
        cosine, sine = y[0] / theta, y[1] / theta
        theta_rate, across = cosine * y[2] + sine * y[3], cosine * y[3] - sine * y[2]
        phi_rate = across / theta
        a_r, a_t = cosine * ground[0] + sine * ground[1], cosine * ground[1] - sine * ground[0]
        turning = self.slope("inertia", theta)
        growth = 0.5 * turning * phi_rate**2 - a_r * self.slope("arm", theta)
        growth -= (GRAVITY + ground[2]) * self.slope("lift", theta) + self.slope("tie", theta)
        growth /= self.a
        swing = -(a_t * self.arm(theta) + turning * theta_rate * phi_rate) / self.inertia(theta)
        outward = growth - theta * phi_rate**2
        sideways = theta * swing + 2.0 * theta_rate * phi_rate
        return np.array(
            [y[2], y[3], cosine * outward - sine * sideways, sine * outward + cosine * sideways]
        )


def by_dop853(frame: RockingFrame, motion: PairAcceleration, uplift: float, end: float) -> Float:
    """Return theta at the samples up to a time [rad]; from rest it starts with a tilt of 1e-9."""
    model, step = Model(frame), motion.time_step
    ground = np.stack([motion.x, motion.y, 0.0 * motion.x if motion.z is None else motion.z])
    first = int(uplift / step)
    found = np.zeros(int(end / step) + 1)

    def at(time: float) -> Float:
        i = min(int(time / step), ground.shape[1] - 2)
        here: Float = ground[:, i] + (time / step - i) * (ground[:, i + 1] - ground[:, i])
        return here

    start = at(uplift)
    state = -_TINY / math.hypot(start[0], start[1]) * np.array([start[0], start[1], 0.0, 0.0])
    for i in range(first, found.size - 1):
        slope = (ground[:, i + 1] - ground[:, i]) / step
        span = (max(uplift, i * step), (i + 1) * step)

        def rates(t: float, y: Float, i: int = i, slope: Float = slope) -> Float:
            return model.rates(y, ground[:, i] + (t - i * step) * slope)

        state = solve_ivp(rates, span, state, method="DOP853", rtol=1e-10, atol=1e-14).y[:, -1]
        found[i + 1] = math.hypot(state[0], state[1])
    return found


@pytest.mark.parametrize("seed", range(6))
def test_histories_agree_with_dop853(seed: int) -> None:
    """Tapered and hollow columns, tendons and vertical motion, until two seconds after uplift."""
    rng = np.random.default_rng(100 + seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    if seed % 2:
        motion, frame = replace(motion, z=0.3 * motion.y), with_tendon(frame)
        strength = 1.8 * frame.uplift_acceleration / motion.largest
        motion = motion.scaled(strength)
    found = wobble(frame, motion, contact_shortening=0.0)
    end = found.uplift_time + 2.0 / frame.effective_frequency_parameter
    theirs = by_dop853(frame, motion, found.uplift_time, end)
    known = np.isfinite(found.theta[: theirs.size])
    assert found.theta[: theirs.size][known].max() > 0.05 * frame.slenderness
    assert_allclose(
        found.theta[: theirs.size][known],
        theirs[known],
        rtol=0.0,
        atol=1e-6 * frame.slenderness,
    )
