"""Largest forces at the joints: static limits, momentum, shear keys, bands of separate members."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from rockframe import Ensemble, GroundAcceleration, ParameterError, Pulse, RockingFrame, respond
from rockframe.parts import Dissipater, Tendon
from rockframe.rocking import JointForces, draws, joint_forces, members, reactions, with_forces
from rockframe.units import GRAVITY

from .motions import noise

NAMES = [field.name for field in dataclasses.fields(JointForces)]
BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3, name="bent")
TAPERED = RockingFrame(
    height=9.6, width=1.6, top_width=1.2, centre_of_gravity=4.4, mass_ratio=2.0, name="tapered"
)
COLUMN = RockingFrame(height=9.6, width=1.6, name="column")
STRONG = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
FALLS = Pulse(wavelet="symmetric_ricker", a_p=2.0 * GRAVITY, T_p=1.5)
SMALL = Ensemble(members=16, seed=2)
ROUGH = GroundAcceleration.from_samples(noise(3, 800, 0.3), 0.01).followed_by_rest(10.0)


def with_friction(frame: RockingFrame, coefficient: float) -> RockingFrame:
    return dataclasses.replace(frame, friction_coefficient=coefficient)


# Limits


def test_at_rest_the_forces_are_the_weight_times_gravity_and_the_motion_of_the_ground() -> None:
    """A frame that does not uplift moves with the ground: V = W a / g, Z = W (1 + a_v / g)."""
    time = 0.01 * np.arange(100.0)
    across, upwards = 0.1 * GRAVITY * np.sin(9.0 * time), 0.3 * GRAVITY * np.sin(7.0 * time)
    weak = GroundAcceleration.from_samples(across, 0.01).with_vertical(
        GroundAcceleration.from_samples(upwards, 0.01)
    )
    forces = joint_forces(respond(with_friction(BENT, 0.05), weak), weak)
    g = GRAVITY
    expected = {
        "peak_base_shear": np.abs(across).max() / g,
        "base_joint_horizontal": np.abs(across).max() / g,
        "base_joint_vertical": 1.0 + upwards.max() / g,
        "base_joint_vertical_least": 1.0 + upwards.min() / g,
        "base_key_force": (np.abs(across) / g - 0.05 * (1.0 + upwards / g)).max(),
    }
    share = 0.8  # the beam has 4/5 of the weight
    expected |= {
        f"top{name.removeprefix('base')}": share * force
        for name, force in expected.items()
        if name.startswith("base")
    }
    expected |= dict.fromkeys((name for name in NAMES if "impulse" in name), 0.0)
    assert expected.keys() == {*NAMES}
    for name, force in expected.items():
        assert_allclose(getattr(forces, name), force, rtol=1e-12, err_msg=name)


def test_the_weight_is_that_of_a_column_and_its_share_of_the_beam() -> None:
    assert math.isclose(BENT.weight, 5.0 * 48e3 * GRAVITY)
    assert math.isnan(COLUMN.weight)


@given(st.floats(0.1, 10.0))
def test_the_density_scales_all_forces_alike(factor: float) -> None:
    """Masses cancel in rocking: the forces over the weight stay, and the weight scales."""
    other = dataclasses.replace(BENT, column_mass=factor * 48e3)
    assert joint_forces(respond(other, STRONG), STRONG) == joint_forces(
        respond(BENT, STRONG), STRONG
    )
    assert_allclose(other.weight, factor * BENT.weight, rtol=1e-14)


def test_the_top_joint_of_a_column_alone_and_forces_of_a_fall_are_not_known() -> None:
    alone = dataclasses.asdict(joint_forces(respond(COLUMN, ROUGH), ROUGH))
    assert {name for name, force in alone.items() if math.isnan(force)} == {
        name for name in NAMES if name.startswith("top")
    }
    fallen = joint_forces(respond(BENT, FALLS), FALLS)
    assert np.isnan(dataclasses.astuple(fallen)).all()


# Impacts


@pytest.mark.parametrize("frame", [BENT, TAPERED, COLUMN])
def test_the_impulses_of_the_strongest_impact_change_the_momentum(frame: RockingFrame) -> None:
    """Velocities of beam and columns' centres before and after the impact, from the kinematics."""
    response = respond(frame, ROUGH)
    forces = joint_forces(response, ROUGH)
    before = np.abs(response.impact_velocities).max()
    after = frame.restitution * before
    change = {}
    for place, lever in (("beam", frame.beam), ("centre", frame.centre)):
        across, upwards = (
            lever.length * math.cos(lever.angle),
            lever.length * math.sin(lever.angle),
        )
        # at theta = 0 the horizontal velocity falls, and the vertical one is reversed
        change[place] = np.array([across * (before - after), upwards * (before + after)])
    gamma = frame.mass_ratio
    whole = (change["centre"] + gamma * change["beam"]) / ((1.0 + gamma) * GRAVITY)
    base = [forces.base_impulse_horizontal, forces.base_impulse_vertical]
    assert_allclose(base, whole, rtol=1e-12)
    if gamma > 0.0:
        top = [forces.top_impulse_horizontal, forces.top_impulse_vertical]
        assert_allclose(top, gamma * change["beam"] / ((1.0 + gamma) * GRAVITY), rtol=1e-12)


# Shear keys


@pytest.mark.parametrize("frame", [BENT, TAPERED])
def test_a_key_carries_all_of_the_shear_without_friction_and_nothing_with_enough(
    frame: RockingFrame,
) -> None:
    response = respond(frame, ROUGH)
    forces = reactions(response, ROUGH)
    unstated, none = (
        joint_forces(respond(bent, ROUGH), ROUGH) for bent in (frame, with_friction(frame, 0.0))
    )
    assert unstated == none
    assert none.base_key_force == none.base_joint_horizontal
    assert none.top_key_force == none.top_joint_horizontal
    base, top = forces.base_friction_demand.max(), forces.top_friction_demand.max()
    enough = joint_forces(respond(with_friction(frame, max(base, top)), ROUGH), ROUGH)
    assert max(enough.base_key_force, enough.top_key_force) < 1e-15
    ample = joint_forces(respond(with_friction(frame, 10.0), ROUGH), ROUGH)
    assert ample.base_key_force == ample.top_key_force == 0.0
    less = joint_forces(respond(with_friction(frame, 0.99 * min(base, top)), ROUGH), ROUGH)
    assert min(less.base_key_force, less.top_key_force) > 0.0


def test_a_joint_that_lifts_off_has_no_friction() -> None:
    """Friction acts under compression only: a negative vertical force must not reduce the key."""
    pulled = dataclasses.replace(with_friction(BENT, 0.5), width=9.0, restitution_factor=0.1)
    response = respond(pulled, ROUGH)
    spinning = dataclasses.replace(
        response,
        theta=np.full_like(response.theta, 0.1),
        omega=np.full_like(response.omega, 3.0),
    )
    forces, largest = reactions(spinning, ROUGH), joint_forces(spinning, ROUGH)
    assert forces.base_vertical.max() < 0.0
    assert_allclose(largest.base_key_force, np.abs(forces.base_shear).max() / 5.0, rtol=1e-14)


@pytest.mark.parametrize("wrong", [-0.1, math.inf, math.nan])
def test_an_impossible_friction_is_refused(wrong: float) -> None:
    with pytest.raises(ParameterError, match=r"friction_coefficient .* Must be zero or above"):
        with_friction(BENT, wrong)


# Bands


TIED = dataclasses.replace(
    with_friction(BENT, 0.1),
    tendon=Tendon(area=1e-3, modulus=195e9, prestress=2e5),
    dissipater=Dissipater(stiffness=5e7, yield_force=1e5, lever_arm=0.8),
)


@pytest.mark.parametrize("frame", [with_friction(BENT, 0.1), TAPERED, COLUMN, TIED])
def test_bands_are_quantiles_of_separate_members(frame: RockingFrame) -> None:
    response = with_forces(respond(frame, ROUGH), ROUGH, SMALL)
    assert response.forces is not None
    given, alone = (
        dataclasses.astuple(one) for one in (response.forces, joint_forces(response, ROUGH))
    )
    assert_allclose(given, alone, rtol=0.0)
    scales = draws(SMALL)[:, 3].tolist()
    each = []
    for member, scale in zip(members(SMALL, frame), scales, strict=True):
        ground = ROUGH.scaled(scale)
        each.append(dataclasses.astuple(joint_forces(respond(member, ground), ground)))
    for name, forces in zip(NAMES, np.transpose(each), strict=True):
        band = getattr(response.force_bands, name)
        assert_allclose(band, np.quantile(forces, (0.16, 0.50, 0.84)), rtol=1e-13, err_msg=name)


def test_without_members_there_are_no_bands() -> None:
    response = respond(BENT, ROUGH)
    for ensemble in (None, Ensemble(members=0)):
        assert with_forces(response, ROUGH, ensemble).force_bands is None


def test_members_that_overturn_are_beyond_all_others() -> None:
    """The largest forces of a fall are above those of all others, its least force below them."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.55 * GRAVITY, T_p=1.5)
    bands = with_forces(respond(BENT, pulse), pulse, SMALL).force_bands
    assert bands is not None
    assert bands.base_joint_vertical[0] < bands.base_joint_vertical[2] == math.inf
    assert bands.base_joint_vertical_least[0] == -math.inf < bands.base_joint_vertical_least[2]
    all_fall = with_forces(respond(COLUMN, FALLS), FALLS, SMALL).force_bands
    assert all_fall is not None
    assert all_fall.base_key_force == (math.inf,) * 3
    assert np.isnan(all_fall.top_key_force).all()


def test_the_dissipater_force_grows_with_the_stretch_up_to_yielding() -> None:
    assert TIED.bar_force(0.0) == 0.0
    assert_allclose(TIED.bar_force(-1e-3), 5e7 * 2.0 * 0.8 * math.sin(5e-4), rtol=1e-14)
    assert TIED.bar_force(0.1) == 1e5
    assert BENT.bar_force(0.1) == 0.0
    response = respond(TIED, ROUGH)
    assert response.restraint is not None
    force = np.abs(response.restraint.dissipater_force).max()
    assert_allclose(response.restraint.peak_dissipater_force, force, rtol=1e-3)
