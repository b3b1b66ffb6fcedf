"""Forces at the joints of bents of two unequal columns obey the laws of momentum."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    GroundAcceleration,
    RockingFrame,
    bent_forces,
    respond,
    respond_bent,
)
from rockframe.errors import ParameterError
from rockframe.units import GRAVITY

from .cases import BENT, Float, random_bent, random_pulse

seeds = pytest.mark.parametrize("seed", range(6))


def differences(values: Float, step: float) -> Float:
    """Return second derivatives, from differences of fourth order; NaN near the ends."""
    inner = -values[4:] + 16.0 * (values[3:-1] + values[1:-3]) - 30.0 * values[2:-2] - values[:-4]
    return np.pad(inner / (12.0 * step**2), 2, constant_values=np.nan)


@seeds
def test_the_joints_under_the_beam_accelerate_it(seed: int) -> None:
    """Both components of the force on the beam are its mass times its acceleration in space.

    The horizontal one is not among the equations from which the forces are computed.
    """
    rng = np.random.default_rng(seed)
    bent = random_bent(rng)
    ground = random_pulse(rng, bent, 1.6)
    lift = GroundAcceleration(0.3 * ground.coefficients, ground.time_step, ground.start_time)
    ground = ground.with_vertical(lift)
    response = respond_bent(bent, ground)
    forces = bent_forces(response, ground)
    across, upwards = ground.at_nodes()
    step = ground.time_step
    flying = np.isfinite(forces.top_shear[0])
    flying[[0, 1, -2, -1]] = False
    for impact in (response.uplift_time, *response.impact_times):
        flying &= np.abs(response.time - impact) > 3.0 * step
    assert flying.sum() > 100
    mass = 2.0 * bent.mass_ratio / GRAVITY
    shear = -mass * (differences(response.u, step) + across)
    press = mass * (differences(response.v, step) + GRAVITY + upwards)
    size = bent.mass_ratio * 1e-6
    assert_allclose(forces.top_shear.sum(axis=0)[flying], shear[flying], rtol=0.0, atol=size)
    assert_allclose(forces.top_vertical.sum(axis=0)[flying], press[flying], rtol=0.0, atol=size)


@seeds
def test_moments_about_the_left_base_corner_balance(seed: int) -> None:
    """Each column turns about its corner by the moments of its weight and of the beam."""
    rng = np.random.default_rng(seed)
    bent = random_bent(rng)
    ground = random_pulse(rng, bent, 1.6)
    response = respond_bent(bent, ground)
    forces = bent_forces(response, ground)
    across, _ = ground.at_nodes()
    step = ground.time_step
    masses = np.multiply(bent.heights, bent.widths)
    masses = 2.0 * masses / masses.sum()
    flying = np.isfinite(forces.top_shear[0])
    flying[[0, 1, -2, -1]] = False
    for impact in (response.uplift_time, *response.impact_times):
        flying &= np.abs(response.time - impact) > 3.0 * step
    for k, theta in enumerate((response.theta, response.theta_2)):
        side, turned = np.sign(theta), np.abs(theta)
        height, width = bent.heights[k], bent.widths[k]
        x = side * (height * np.sin(turned) - width * np.cos(turned))
        y = height * np.cos(turned) + width * np.sin(turned)
        inertia = masses[k] / GRAVITY * (height**2 + width**2) / 3.0
        weight = 0.5 * masses[k] * (x + y * -across / GRAVITY)
        # clockwise moments; the beam pushes with its shear, and presses downwards
        moment = weight + y * forces.top_shear[k] + x * forces.top_vertical[k]
        assert_allclose(
            moment[flying], inertia * differences(theta, step)[flying], rtol=0.0, atol=1e-6
        )


def test_the_columns_carry_all_that_weighs_at_the_balance() -> None:
    """There the bent hardly accelerates."""
    still = GroundAcceleration.from_samples(np.zeros(3), 1e-6)
    at = 0.999999 * BENT.balance_rotations[0]
    forces = bent_forces(respond_bent(BENT, still, initial_rotation=at), still)
    assert_allclose(forces.top_vertical[:, 0].sum(), 2.0 * BENT.mass_ratio, rtol=1e-5)
    assert_allclose(forces.base_vertical[:, 0].sum(), 2.0 * (1.0 + BENT.mass_ratio), rtol=1e-5)
    assert_allclose(forces.base_shear[:, 0].sum(), 0.0, atol=1e-4)


def test_there_are_no_forces_at_rest_and_the_motion_must_fit() -> None:
    weak = GroundAcceleration.from_samples(np.full(5, 0.5), 0.01)
    response = respond_bent(BENT, weak)
    assert np.isnan(bent_forces(response, weak).base_shear).all()
    with pytest.raises(ParameterError, match="Must be the motion of the response"):
        bent_forces(response, GroundAcceleration.from_samples(np.zeros(9), 0.01))
    with pytest.raises(ParameterError, match="Invalid response of type Response"):
        bent_forces(respond(RockingFrame(height=9.0, width=1.4), weak), weak)  # type: ignore[arg-type]
