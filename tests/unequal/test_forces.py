"""Forces at the joints of bents of two unequal columns obey the laws of momentum."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import (
    Ensemble,
    GroundAcceleration,
    Pulse,
    RespondOptions,
    RockingFrame,
    UnequalBent,
    Verdict,
    bent_ensemble,
    bent_forces,
    bent_positions,
    column_forces,
    impact_impulses,
    respond,
    respond_bent,
)
from rockframe.errors import ParameterError
from rockframe.results.response import responses_arrays
from rockframe.results.tables.forces import force_rows, forces_in_words
from rockframe.rocking import as_ground, reactions, with_contact
from rockframe.structures.contract import Shaking, respond_each
from rockframe.unequal.bent import linkage_of
from rockframe.unequal.forces import (
    base_shear,
    demand_of,
    force_bands,
    impulses_of,
    largest_forces,
)
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


def momenta(bent: UnequalBent, side: float, rate: float) -> tuple[Float, Float]:
    """Return momenta of the whole and of the beam as a bent passes rest towards or from a side.

    They are across, upwards, and clockwise about the left column's base, over the mass of columns.
    """
    step = 1e-6 * side
    at = bent_positions(bent, [step, 2.0 * step])
    slope = np.array([2.0, -0.5]) / step  # at 0, of second order: all is 0 there
    turn = np.stack([[step, 2.0 * step], at.theta_2]) @ slope
    masses, tall = np.multiply(bent.heights, bent.widths), np.array(bent.heights)
    masses = masses / masses.sum()
    foot = np.array([0.0, bent.spacing]) + 0.5 * side * np.array(bent.widths)
    level = tall[0] - tall  # of the bases, over that of the left column
    across, up = 0.5 * tall * turn, 0.5 * side * np.array(bent.widths) * turn
    x, y = foot - 0.5 * side * np.array(bent.widths), level + 0.5 * tall
    inertia = masses * (tall**2 + np.array(bent.widths) ** 2) / 12.0
    whole = [masses @ across, masses @ up, masses @ (y * across - x * up) + inertia @ turn]
    u, v, psi = (values @ slope for values in (at.u, at.v, at.psi))
    aside, above = 0.5 * bent.spacing + bent.beam_offset, tall[0] + 0.5 * bent.beam_depth
    _, own = linkage_of(bent).inertias
    beam = np.array([bent.mass_ratio * u, bent.mass_ratio * v, 0.0])
    beam[2] = above * beam[0] - aside * beam[1] + float(own.squeeze()) * psi
    return rate * (np.array(whole) + beam), rate * beam


@seeds
def test_impulses_of_impacts_change_the_momenta(seed: int) -> None:
    """Those of the ground change the momentum of the whole, those of the columns that of the beam,
    across, upwards, and about the left column's base; the ratio of speeds is that of the linkage.
    """
    bent = random_bent(np.random.default_rng(seed))
    unit = 0.5 * (1.0 + bent.mass_ratio) * GRAVITY
    sides = ((1.0, -1.0), (-1.0, 1.0))  # after, before: to the right, to the left
    for direction, (after, before) in enumerate(sides):
        kept = bent.restitutions[1 - direction]
        old, new = momenta(bent, before, after), momenta(bent, after, after * kept)
        widths, tall = np.array(bent.widths), np.array(bent.heights)
        base, top = unit * impulses_of(bent)[direction]
        for (across, up), corner, level, change in (
            (base * [[-after], [1.0]], after, tall[0] - tall, new[0] - old[0]),
            (top * [[-after], [1.0]], -after, [tall[0]] * 2, new[1] - old[1]),
        ):
            place = np.array([0.0, bent.spacing]) + 0.5 * corner * widths
            pushed = [across.sum(), up.sum(), (np.array(level) * across - place * up).sum()]
            assert_allclose(pushed, change, rtol=1e-5, atol=1e-5 * np.abs(change).max())


def test_impulses_of_equal_columns_are_those_of_the_frame() -> None:
    """On average, also with a stated loss; the column that the motion loads takes more."""
    for factor in (1.0, 0.95):
        bent = replace(EQUAL, restitution_factor=factor)
        frame = replace(FRAME, restitution_factor=factor)
        impulses = impact_impulses(frame, 1.0)
        to_right, to_left = impulses_of(bent)
        assert_allclose(to_right[..., ::-1], to_left, rtol=1e-10)
        for k, place in enumerate(("base", "top")):
            for j, direction in enumerate(("horizontal", "vertical")):
                expected = getattr(impulses, f"{place}_{direction}") / (5.0 * GRAVITY)
                assert_allclose(to_right[k, j].mean(), expected, rtol=1e-10)
        assert to_right[0, 1, 1] > to_right[0, 1, 0]


def test_bands_of_members_that_are_alike_are_the_forces_of_the_bent() -> None:
    alike = Ensemble(members=16, height=0.0, width=0.0, impact_loss=1.0, amplitude=0.0)
    response = respond_bent(BENT, WEAKER)
    forces = vars(largest_forces(response, bent_forces(response, WEAKER)))
    assert min(forces.values()) > 0.0
    for name, band in vars(force_bands(BENT, WEAKER, alike)).items():
        assert_allclose(band, forces[name], rtol=1e-12)


def test_bands_count_members_that_overturn_as_worst_and_leave_out_those_at_rest() -> None:
    few = Ensemble(members=16)
    strong = GroundAcceleration.from_samples(np.full(400, 5.0), 0.01)
    for name, band in vars(force_bands(BENT, strong, few)).items():
        assert band == (-np.inf,) * 3 if name.endswith("_least") else band == (np.inf,) * 3
    weak = GroundAcceleration.from_samples(np.full(5, 0.5), 0.01)
    assert np.isnan([*vars(force_bands(BENT, weak, few)).values()]).all()
    # so weak that some members rest: the bands are those of the others
    limit = min(BENT.uplift_accelerations) * GRAVITY
    touch = Pulse(wavelet="symmetric_ricker", a_p=1.01 * limit, T_p=1.2, time=3.0)
    spread = bent_ensemble(BENT, touch, Ensemble(members=16))
    assert spread.uplifted in range(1, 16)
    bands = force_bands(BENT, touch, Ensemble(members=16))
    assert np.isfinite([*vars(bands).values()]).all()


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
FRAME = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.54 * GRAVITY, T_p=1.5, time=3.0)
#: A weaker one, under which unequal columns stand.
WEAKER = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.2, time=3.0)


def test_largest_forces_of_equal_columns_are_those_of_the_frame() -> None:
    frame = FRAME
    response = respond(frame, PULSE)
    each = column_forces(response, PULSE, spacing=12.0, beam_centre=1.0)
    own: Any
    options = RespondOptions(forces=True, margins="none", ensemble=Ensemble(members=0))
    [own] = respond_each([EQUAL], Shaking(PULSE, options))
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
    options = RespondOptions(forces=True, margins="none", ensemble=Ensemble(members=16))
    responses = respond_each(structures, Shaking(WEAKER, options))
    file = responses_arrays({"pulse": responses}, structures)
    rows = {(row["structure"], row["force"]): row for row in force_rows(file)}
    bent: Any = responses[1]
    shear = rows["piers", "left_base_horizontal"]
    assert shear["unit"] == "kN"
    weight = 0.5 * 4.6 * 9e4 * GRAVITY / 1000.0
    column = bent.column_forces
    assert_allclose(shear["value"], weight * column.left_base_horizontal, rtol=1e-12)
    ends = [shear[f"value_{end}"] for end in (16, 50, 84)]
    expected = force_bands(heavy, WEAKER, options.ensemble).left_base_horizontal
    assert_allclose(ends, np.multiply(weight, expected), rtol=1e-12)
    assert ends[0] < ends[2]
    push = rows["piers", "right_top_impulse_vertical"]
    assert push["unit"] == "kN s"
    assert_allclose(push["value"], weight * column.right_top_impulse_vertical, rtol=1e-12)
    assert ("frame", "left_base_horizontal") not in rows
    assert ("piers", "base_joint_horizontal") not in rows
    assert ("frame", "base_joint_horizontal") in rows
    assert "forces are those of each column" in forces_in_words(rows.values())
    without = responses_arrays({"pulse": responses[:1]}, structures[:1])
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
