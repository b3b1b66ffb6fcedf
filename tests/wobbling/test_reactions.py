"""Forces at the joints of wobbling columns: the plane, Newton's law, and directions."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
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
    joint_forces,
    pair_horizontals,
    reactions,
    read_file,
    respond,
    wobble,
    wobbling_ensemble,
)
from rockframe.errors import ParameterError
from rockframe.quantities import FORCE_DURATION
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


def finer(motion: PairAcceleration, times: int) -> PairAcceleration:
    """Return the same motion, which is straight between samples, with more samples."""
    at = np.arange(times * (motion.x.size - 1) + 1) / times
    x, y = (np.interp(at, np.arange(motion.x.size), part) for part in (motion.x, motion.y))
    return replace(motion, x=x, y=y, time_step=motion.time_step / times)


@pytest.mark.parametrize("shortening", [1e-5, 1e-4])
@pytest.mark.parametrize("station", ["CCC", "CLC", "TOW2"])
def test_forces_do_not_depend_on_the_samples_of_the_motion(
    bundled_records: Path, station: str, shortening: float
) -> None:
    """Two, eight, and three times as many samples; with three the means start at other times, and
    the motion of a column that passes near upright follows the round-off of its steps.

    At the samples themselves, the largest vertical force under TOW2 grows from 3.0 to 7.3.
    """
    [components], _ = pair_horizontals(read_file(bundled_records / f"Ridgecrest2019-{station}.V1"))
    motion, column = PairAcceleration.from_pair(components), solid(7.5, 1.8)
    responses = [
        (wobble(column, ground, contact_shortening=shortening), ground)
        for ground in (motion, *(finer(motion, times) for times in (2, 8, 3)))
    ]
    assert len({response.verdict for response, _ in responses}) == 1
    assert station != "CLC" or responses[0][0].verdict is Verdict.STANDS
    first, *others, last = [wobbling_forces(*each) for each in responses]
    for name, force in vars(first).items():
        for other in others:
            assert_allclose(getattr(other, name), force, rtol=1e-4, err_msg=name)
        assert_allclose(getattr(last, name), force, rtol=2e-2, err_msg=name)


@pytest.mark.parametrize("parts", ["free", "tendons", "vertical"])
def test_forces_are_the_running_means_of_those_at_the_instants(parts: str) -> None:
    """Momentum against accelerations, far from upright, where both vary slowly."""
    rng = np.random.default_rng(5)
    frame = random_frame(rng)
    frame = with_tendon(frame) if parts == "tendons" else frame
    alpha, rate = frame.slenderness, frame.effective_frequency_parameter
    time = np.arange(801) * FORCE_DURATION / 20.0
    x, y, z = (0.3 * np.sin(turn * rate * time) for turn in (3.0, 5.0, 8.0))
    motion = PairAcceleration(x, y, time[1], z if parts == "vertical" else None)
    response = wobble(frame, motion, start=(0.3 * alpha, 0.1 * rate * alpha, 0.4, rate))
    assert response.verdict is Verdict.STANDS
    assert response.theta.min() > 0.05 * alpha
    instants = wobbling_reactions(response, motion)
    weights = np.array([0.5, *[1.0] * 19, 0.5]) / 20.0
    weight = 1.0 + frame.mass_ratio
    forces = wobbling_forces(response, motion)
    for name, values in {
        "peak_base_shear": instants.support_shear,
        "base_joint_horizontal": instants.base_shear,
        "base_joint_vertical": instants.base_vertical,
        "top_joint_horizontal": instants.top_shear,
        "top_joint_vertical": instants.top_vertical,
    }.items():
        means = np.convolve(values, weights, mode="valid") / weight
        assert_allclose(getattr(forces, name), means.max(), rtol=1e-3, err_msg=name)
        if "vertical" in name:
            assert_allclose(getattr(forces, f"{name}_least"), means.min(), rtol=1e-4, err_msg=name)


@seeds
def test_a_pass_in_one_plane_has_the_impulse_of_the_impact(seed: int) -> None:
    """The strongest impact, within one mean, adds its impulse to a force of those between them."""
    rng = np.random.default_rng(40 + seed)
    frame = random_frame(rng)
    motion = random_motion(rng, frame)
    strength = 1.7 * frame.uplift_acceleration / np.abs(motion.x).max()
    motion = replace(motion, x=strength * motion.x, y=0.0 * motion.y)
    ground = GroundAcceleration.from_samples(motion.x, motion.time_step)
    planar, response = respond(frame, ground), wobble(frame, motion)
    assert planar.impacts > 0
    assert planar.verdict is response.verdict is Verdict.STANDS
    theirs, ours = joint_forces(planar, ground), wobbling_forces(response, motion)
    for joint in ("base", "top") if frame.mass_ratio else ("base",):
        impulse = getattr(theirs, f"{joint}_impulse_vertical") / FORCE_DURATION
        largest = getattr(ours, f"{joint}_joint_vertical")
        least, most = (getattr(theirs, f"{joint}_joint_vertical{end}") for end in ("_least", ""))
        assert impulse > most - least
        assert least - 1e-3 <= largest - impulse <= most + 1e-3


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
    largest = wobbling_forces(wobble(frame, weak), weak)
    assert largest.base_joint_horizontal == pytest.approx(1.5 / GRAVITY)
    assert largest.peak_base_shear == largest.base_joint_horizontal
    assert (
        largest.top_joint_vertical == largest.top_joint_vertical_least == pytest.approx(0.5 / 1.5)
    )


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
