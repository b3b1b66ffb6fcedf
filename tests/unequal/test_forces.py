"""Forces at the joints of bents of two unequal columns obey the laws of momentum."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    GroundAcceleration,
    Pulse,
    RespondOptions,
    RockingFrame,
    UnequalBent,
    Verdict,
    bent_forces,
    column_forces,
    respond,
    respond_bent,
)
from rockframe.errors import ParameterError
from rockframe.results.response import responses_dataset
from rockframe.results.tables.forces import force_rows, forces_in_words
from rockframe.rocking import as_ground, reactions, with_contact
from rockframe.structures.contract import Shaking, respond_each
from rockframe.unequal.forces import base_shear, demand_of, largest_forces
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


EQUAL = UnequalBent(
    heights=(9.6, 9.6), widths=(1.6, 1.6), spacing=12.0, mass_ratio=4.0, beam_depth=2.0
)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.54 * GRAVITY, T_p=1.5, time=3.0)
#: A weaker one, under which unequal columns stand.
WEAKER = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.2, time=3.0)


def test_largest_forces_of_equal_columns_are_those_of_the_frame() -> None:
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    response = respond(frame, PULSE)
    each = column_forces(response, PULSE, spacing=12.0, beam_centre=1.0)
    own: Any
    [own] = respond_each([EQUAL], Shaking(PULSE, RespondOptions(forces=True, margins="none")))
    largest = own.column_forces
    for side, name in enumerate(("left", "right")):
        for place in ("base", "top"):
            shear = getattr(each, f"{place}_shear")[side] / 5.0
            vertical = getattr(each, f"{place}_vertical")[side] / 5.0
            expected = (np.nanmax(np.abs(shear)), np.nanmax(vertical), np.nanmin(vertical))
            forces = [
                getattr(largest, f"{name}_{place}_{part}")
                for part in ("horizontal", "vertical", "vertical_least")
            ]
            assert_allclose(forces, expected, rtol=1e-11)
    contact = with_contact(response, as_ground(PULSE)).contact
    assert contact is not None
    own_contact = own.contact
    assert own_contact.base_friction_demand > contact.base_friction_demand  # of one, not of both
    shear = reactions(response, PULSE).support_shear / 5.0
    assert_allclose(own.forces.peak_base_shear, np.abs(shear).max(), rtol=1e-11)


def test_both_columns_together_carry_shear_and_weight() -> None:
    """Largest forces of the columns bound those of the whole."""
    response = respond_bent(BENT, WEAKER)
    forces = largest_forces(response, bent_forces(response, WEAKER))
    shear = np.abs(base_shear(response, WEAKER)).max()
    assert 2.0 * shear <= forces.left_base_horizontal + forces.right_base_horizontal
    assert forces.left_base_vertical_least + forces.right_base_vertical_least < 2.0
    assert forces.left_base_vertical + forces.right_base_vertical > 2.0


def test_files_have_the_forces_of_each_column_of_unequal_bents_alone() -> None:
    frame = RockingFrame(name="frame", height=9.6, width=1.6, mass_ratio=4.0)
    heavy = replace(BENT, name="piers", column_masses=(5e4, 4e4))
    structures: list[Any] = [frame, heavy]
    options = RespondOptions(forces=True, margins="none")
    responses = respond_each(structures, Shaking(WEAKER, options))
    file = responses_dataset({"pulse": responses}, structures)
    rows = {(row["structure"], row["force"]): row for row in force_rows(file)}
    bent: Any = responses[1]
    shear = rows["piers", "left_base_horizontal"]
    assert shear["unit"] == "kN"
    weight = 0.5 * 4.6 * 9e4 * GRAVITY / 1000.0
    column = bent.column_forces
    assert_allclose(shear["value"], weight * column.left_base_horizontal, rtol=1e-12)
    assert np.isnan(shear["value_84"])
    assert ("frame", "left_base_horizontal") not in rows
    assert ("piers", "base_joint_horizontal") not in rows
    assert ("frame", "base_joint_horizontal") in rows
    assert "forces are those of each column" in forces_in_words(rows.values())
    without = responses_dataset({"pulse": responses[:1]}, structures[:1])
    assert "left_base_horizontal" not in without
    assert "each column" not in forces_in_words([*force_rows(without)])


def test_bents_that_stand_still_or_overturn_have_no_largest_forces() -> None:
    weak, strong = (
        GroundAcceleration.from_samples(np.full(400, size), 0.01) for size in (0.5, 5.0)
    )
    still, fallen = respond_bent(BENT, weak), respond_bent(BENT, strong)
    assert fallen.verdict is Verdict.OVERTURNS
    for response, motion in ((still, weak), (fallen, strong)):
        largest = largest_forces(response, bent_forces(response, motion))
        assert np.isnan([*vars(largest).values()]).all()
    demand = demand_of(still, weak, bent_forces(still, weak))
    assert_allclose(demand.base_friction_demand, 0.5 / GRAVITY, rtol=1e-12)
    assert_allclose(demand.peak_base_shear, 0.5 / GRAVITY, rtol=1e-12)
    assert np.isnan([*vars(demand_of(fallen, strong, bent_forces(fallen, strong))).values()]).all()
