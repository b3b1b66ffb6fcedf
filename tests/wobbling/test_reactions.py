"""Forces at the joints of wobbling columns: the plane, Newton's law, and directions."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike

from rockframe import (
    Ensemble,
    GroundAcceleration,
    PairAcceleration,
    Verdict,
    reactions,
    respond,
    wobble,
    wobbling_ensemble,
)
from rockframe.errors import ParameterError
from rockframe.rocking.contact import static_vertical
from rockframe.units import GRAVITY
from rockframe.wobbling import wobbling_reactions
from rockframe.wobbling.reactions import (
    touching,
    wobbling_contact,
    wobbling_force_bands,
    wobbling_forces,
)

from .cases import random_frame, random_motion, solid, with_tendon


def pair(x: ArrayLike, y: ArrayLike, time_step: float) -> PairAcceleration:
    return PairAcceleration(np.array(x), np.array(y), time_step)


seeds = pytest.mark.parametrize("seed", range(4))


@pytest.mark.parametrize("parts", ["free", "tendons", "vertical"])
@seeds
def test_forces_of_motion_in_one_plane_are_those_of_the_planar_frame(seed: int, parts: str) -> None:
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    frame = with_tendon(frame) if parts == "tendons" else frame
    strength = 1.7 * frame.uplift_acceleration / np.abs(motion.x).max()
    motion = replace(motion, x=strength * motion.x, y=0.0 * motion.y)
    ground = GroundAcceleration.from_samples(motion.x, motion.time_step)
    if parts == "vertical":
        motion = replace(motion, z=-0.3 * motion.x)
        upwards = GroundAcceleration.from_samples(-0.3 * motion.x, motion.time_step)
        ground = ground.with_vertical(upwards)
    planar = respond(frame, ground)
    found = wobble(frame, motion)
    count = found.time.size
    moves = (np.abs(planar.theta[:count]) > 1e-3 * frame.slenderness) & ~touching(found)
    assert moves.sum() > 50
    theirs, ours = reactions(planar, ground), wobbling_reactions(found, motion)
    for name, forces in vars(ours).items():
        expected = np.abs(getattr(theirs, name)[:count])
        assert_allclose(
            forces[moves], expected[moves], rtol=0.0, atol=1e-4 * (1 + frame.mass_ratio)
        )
    friction = theirs.base_friction_demand[:count]
    assert_allclose(ours.base_friction_demand[moves], friction[moves], rtol=1e-3, atol=1e-4)


@seeds
def test_forces_are_the_rate_of_momentum(seed: int) -> None:
    """Newton: the base carries the weight and the acceleration of all masses, by differences."""
    rng = np.random.default_rng(20 + seed)
    frame = random_frame(rng)
    motion = replace(random_motion(rng, frame), z=None)
    found = wobble(frame, motion, contact_shortening=0.0)
    centre, gamma = frame.centre, frame.mass_ratio
    along = np.exp(1j * np.nan_to_num(found.phi))
    shift = (centre.shift(found.theta) + gamma * frame.horizontal_displacement(found.theta)) * along
    lift = centre.lift(found.theta) + gamma * frame.vertical_displacement(found.theta)

    def second_rate(values: Any) -> Any:
        steps = values[:-4] - 16.0 * values[1:-3] + 30.0 * values[2:-2] - 16.0 * values[3:-1]
        return -(steps + values[4:]) / (12.0 * motion.time_step**2)

    forces = wobbling_reactions(found, motion)
    inside = slice(2, -2)
    across = (1.0 + gamma) * (motion.x + 1j * motion.y)[inside] + second_rate(shift)
    upwards = (1.0 + gamma) * GRAVITY + second_rate(lift)
    smooth = np.abs(found.phi_rate) < 3.0 * frame.effective_frequency_parameter
    smooth &= found.theta > 0.05 * frame.slenderness
    smooth[1:-1] = smooth[:-2] & smooth[1:-1] & smooth[2:]
    smooth = smooth[inside]
    assert smooth.sum() > 100
    weight = (1.0 + gamma) * GRAVITY
    known = GRAVITY * forces.support_shear[inside][smooth] / weight
    assert_allclose(known, np.abs(across)[smooth] / weight, rtol=0.0, atol=2e-4)
    known = GRAVITY * forces.base_vertical[inside][smooth] / weight
    assert_allclose(known, upwards[smooth] / weight, rtol=0.0, atol=2e-4)


@seeds
def test_turning_the_motion_changes_no_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frame = random_frame(rng)
    motion, angle = random_motion(rng, frame), rng.uniform(0.0, 360.0)
    one, other = wobble(frame, motion), wobble(frame, motion.turned(angle))
    assert one.verdict is other.verdict
    turned = wobbling_forces(other, motion.turned(angle))
    for name, force in vars(wobbling_forces(one, motion)).items():
        assert_allclose(getattr(turned, name), force, rtol=1e-5, err_msg=name)


def test_at_rest_the_joints_carry_a_body_fixed_to_the_ground() -> None:
    frame = solid(7.5, 1.8, 0.5)
    weak = pair([0.0, 0.9, 0.0], [0.0, 1.2, 0.0], 0.01)
    forces = wobbling_reactions(wobble(frame, weak), weak)
    assert_allclose(forces.base_shear, 1.5 * np.array([0.0, 1.5, 0.0]) / GRAVITY)
    assert_allclose(forces.base_vertical, static_vertical(frame)[0])
    assert_allclose(forces.top_friction_demand, np.array([0.0, 1.5, 0.0]) / GRAVITY)
    demand = wobbling_contact(wobble(frame, weak), weak)
    assert demand.base_friction_demand == pytest.approx(1.5 / GRAVITY)
    assert math.isnan(demand.impact_friction_demand)


def test_an_overturned_frame_has_no_forces_and_another_motion_is_refused() -> None:
    frame = solid(7.5, 1.8)
    strong = pair([0.0, 9.0, 9.0], [0.0, 0.0, 9.0], 1.0)
    found = wobble(frame, strong)
    assert found.verdict is Verdict.OVERTURNS
    assert all(math.isnan(force) for force in vars(wobbling_forces(found, strong)).values())
    assert math.isnan(wobbling_contact(found, strong).base_friction_demand)
    with pytest.raises(ParameterError, match="Must be the motion of the response, which has 3"):
        wobbling_reactions(found, pair([0.0, 1.0], [0.0, 1.0], 1.0))


def test_bands_of_members_that_are_alike_are_the_forces_of_one() -> None:
    """Members take longer steps than single responses, so forces agree to some digits."""
    frame = solid(7.5, 1.8, 0.5)
    wave = 3.0 * np.sin(np.arange(300) / 12.0)
    motion = pair(wave, np.roll(wave, 20), 0.01)
    alike = Ensemble(
        members=16, height=0.0, width=0.0, amplitude=0.0, impact_loss=1.0, contact_shortening=1.0
    )
    response = wobble(frame, motion)
    assert response.verdict is Verdict.STANDS
    bands = wobbling_force_bands(frame, motion, alike)
    for name, force in vars(wobbling_forces(response, motion)).items():
        assert_allclose(getattr(bands, name), [force] * 3, rtol=1e-5, err_msg=name)


def test_members_that_overturn_count_as_infinite_forces() -> None:
    """The share that overturns decides which quantiles are infinite, and least forces sink."""
    frame = solid(3.0, 0.5)
    strong = pair([0.0, 9.0, 9.0, 0.0], [0.0, 0.0, 9.0, 0.0], 0.5)
    assert wobbling_ensemble(frame, strong, Ensemble(members=16)).share_overturned == 1.0
    bands = wobbling_force_bands(frame, strong, Ensemble(members=16))
    assert bands.peak_base_shear == (math.inf,) * 3
    assert bands.base_joint_vertical_least == (-math.inf,) * 3
    assert all(map(math.isnan, bands.top_key_force))  # a column alone has no joint at the top
    assert all(map(math.isnan, bands.base_impulse_vertical))
