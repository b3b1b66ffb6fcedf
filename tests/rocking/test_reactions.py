"""Forces at the joints: limits, identities, Newton and Euler of each part, expected numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.contact import impact_friction_demand, impact_impulses, least_spacing
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.portrait import barrier_rate, restoring_moment, trajectory
from rockframe.rocking.reactions import (
    ColumnForces,
    Reactions,
    angular_acceleration,
    column_forces,
    reactions,
)
from rockframe.rocking.response import Response, respond
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .motions import BENT, STOCKY, noise, release, still

Float = NDArray[np.float64]
Expected = Callable[[str], Any]

SPACING, BEAM_CENTRE = 12.0, 1.0


def state(
    frame: RockingFrame, theta: float, omega: float, across: float, upwards: float
) -> tuple[Response, GroundAcceleration]:
    """Return a frame in one state at two nodes, and the ground motion."""
    ground = GroundAcceleration.from_samples([across, across], 0.01).with_vertical(
        GroundAcceleration.from_samples([upwards, upwards], 0.01)
    )
    at_rest = respond(frame, still(0.01))
    both = np.ones(2)
    return replace(at_rest, theta=theta * both, omega=omega * both), ground


# Limits and identities


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_beyond_uplift_a_frame_at_rest_accelerates_against_the_ground(sign: float) -> None:
    """Both terms of eq (26) at theta = 0: with twice the uplift acceleration one remains."""
    angular = angular_acceleration(BENT, 0.0, 0.0, sign * 2.0 * BENT.uplift_acceleration)
    p = BENT.effective_frequency_parameter
    assert angular == pytest.approx(-sign * p**2 * math.sin(BENT.slenderness), rel=1e-12)


def test_the_friction_demand_has_no_sign() -> None:
    """It is infinite without compression, and unknown without any force."""
    shear, vertical = np.array([-0.3, 0.3, -0.3, 0.0]), np.array([2.0, 2.0, -1.0, 0.0])
    forces = Reactions(shear, vertical, -shear, vertical, shear)
    for demand in (forces.base_friction_demand, forces.top_friction_demand):
        assert_allclose(demand, [0.15, 0.15, math.inf, math.nan], rtol=1e-15)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_ties_hold_a_frame_at_rest_beyond_the_uplift_of_a_free_one(sign: float) -> None:
    """By their moment over cos(alpha): what is left beyond it accelerates the frame."""
    cosine, tied = math.cos(BENT.slenderness), 0.1
    for share in (0.5, 0.99, 1.01, 1.5):
        across = sign * (BENT.uplift_acceleration + share * tied * GRAVITY / cosine)
        angular = float(angular_acceleration(BENT, 0.0, 0.0, across, tie_moment=tied))
        left = max(0.0, share - 1.0) * tied if share > 1.0 else 0.0
        expected = -sign * BENT.effective_frequency_parameter**2 * left
        assert angular == pytest.approx(expected, rel=1e-9, abs=1e-15)


@given(st.floats(0.02, 0.6), st.floats(0.0, 50.0), st.sampled_from([-1.0, 1.0]))
def test_at_uplift_both_joints_need_tan_alpha(tangent: float, gamma: float, sign: float) -> None:
    frame = RockingFrame(height=5.0, width=5.0 * tangent, mass_ratio=gamma)
    forces = reactions(*state(frame, 0.0, 0.0, sign * frame.uplift_acceleration, 0.0))
    assert_allclose(forces.base_friction_demand, tangent, rtol=1e-12)
    if gamma > 1e-12:
        assert_allclose(forces.top_friction_demand, tangent, rtol=1e-12)


def test_at_rest_the_frame_follows_the_ground_and_columns_are_not_told_apart() -> None:
    response, ground = state(BENT, 0.0, 0.0, 0.5 * BENT.uplift_acceleration, 0.2 * GRAVITY)
    forces = reactions(response, ground)
    assert_allclose(forces.base_shear, 5.0 * 0.5 / 6.0, rtol=1e-14)
    assert_allclose(forces.base_vertical, 5.0 * 1.2, rtol=1e-14)
    each = column_forces(response, ground, spacing=SPACING, beam_centre=BEAM_CENTRE)
    assert np.isnan(each.base_shear).all()


def test_without_a_beam_nothing_acts_on_the_top() -> None:
    column = RockingFrame(height=9.6, width=1.6)
    ground = GroundAcceleration.from_samples(noise(3, 300, 0.5), 0.01)
    response = respond(column, ground)
    forces = reactions(response, ground)
    assert not forces.top_shear.any()
    assert not forces.top_vertical.any()
    assert np.isnan(forces.top_friction_demand).all()
    each = column_forces(response, ground, spacing=SPACING, beam_centre=BEAM_CENTRE)
    moving = ~np.isnan(each.base_shear[0])
    assert moving.any()
    for own in each.base_shear:
        assert_allclose(own[moving], forces.base_shear[moving], atol=1e-13)
    assert_allclose(each.top_shear[:, moving], 0.0, atol=1e-13)


def test_a_frame_balanced_on_its_corners_needs_no_friction() -> None:
    forces = reactions(*state(BENT, BENT.slenderness, 0.0, 0.0, 0.0))
    assert_allclose(forces.base_shear, 0.0, atol=1e-15)
    assert_allclose(forces.base_vertical, 5.0, rtol=1e-15)


def test_the_mirror_image_swaps_the_columns() -> None:
    column = column_forces(
        *state(BENT, 0.05, -0.1, 2.0, 0.3), spacing=SPACING, beam_centre=BEAM_CENTRE
    )
    other = column_forces(
        *state(BENT, -0.05, 0.1, -2.0, 0.3), spacing=SPACING, beam_centre=BEAM_CENTRE
    )
    assert_allclose(column.base_shear, -other.base_shear[::-1], rtol=1e-13)
    assert_allclose(column.top_vertical, other.top_vertical[::-1], rtol=1e-13)


def test_restoring_moment_is_the_slope_of_the_potential() -> None:
    theta = np.linspace(0.01, 2.0 * BENT.slenderness, 50)
    step = 1e-5
    lift = BENT.vertical_displacement(theta + step) - BENT.vertical_displacement(theta - step)
    weight = BENT.mass_ratio + 0.5  # the columns rise half as much as the beam
    slope = weight * lift / (2.0 * step)
    uplift = (1.0 + 2.0 * BENT.mass_ratio) * BENT.size * math.sin(BENT.slenderness)
    assert_allclose(restoring_moment(BENT, theta), slope / uplift, atol=1e-9)


def test_within_the_barrier_the_frame_comes_back_and_beyond_it_overturns() -> None:
    rotation = 0.3 * BENT.slenderness
    rate = float(barrier_rate(BENT, rotation))
    for factor, verdict in ((1.0 - 1e-9, Verdict.STANDS), (1.0 + 1e-9, Verdict.OVERTURNS)):
        response = respond(
            BENT, still(1.0), initial_rotation=rotation, initial_velocity=factor * rate
        )
        assert response.verdict == verdict


def test_the_barrier_is_the_same_on_both_sides() -> None:
    assert barrier_rate(BENT, -0.3 * BENT.slenderness) == barrier_rate(BENT, 0.3 * BENT.slenderness)


def test_trajectory_jumps_at_impacts_by_the_restitution() -> None:
    response = release(BENT, 0.5, 10.0)
    theta, omega = trajectory(response)
    jumps = np.flatnonzero((theta[:-1] == 0.0) & (theta[1:] == 0.0) & (omega[:-1] != 0.0))
    assert jumps.size == response.impacts > 3
    assert_allclose(omega[jumps + 1], BENT.restitution * omega[jumps], rtol=1e-15)


def test_angular_acceleration_is_the_one_the_kernel_integrates() -> None:
    step = 1e-4
    response = release(BENT, 0.6, 1.0, step)  # before the first impact, at 1.4 s
    rate = np.gradient(response.omega, step)[1:-1]
    angular = angular_acceleration(BENT, response.theta, response.omega, 0.0)[1:-1]
    assert_allclose(angular, rate, atol=1e-9)


# Newton and Euler of each part; its momentum is the sum over four mass points


def placed(frame: RockingFrame, axis: float, theta: float) -> tuple[Float, Float, Float]:
    """Return four mass points of a column, its pivot, and the corner that carries the beam.

    Points at 1/sqrt(3) of the half sides have the mass, centre and inertia of the rectangle.
    """
    side = math.copysign(1.0, theta)
    b, h = 0.5 * frame.width, 0.5 * frame.height
    local = np.array([(x * b, h + z * h) for x in (-1.0, 1.0) for z in (-1.0, 1.0)])
    points = (local - [0.0, h]) / math.sqrt(3.0) + [0.0, h]
    pivot = np.array([side * b, 0.0])
    corner = np.array([-side * b, 2.0 * h])
    turn = np.array([[math.cos(theta), math.sin(theta)], [-math.sin(theta), math.cos(theta)]])
    shift = np.array([axis, 0.0])
    moved = pivot + (np.vstack([points, corner]) - pivot) @ turn.T + shift
    return moved[:4], pivot + shift, moved[4]


def rates(frame: RockingFrame, axis: float, theta: float, omega: float, rate: float) -> Float:
    """Return accelerations of the four points and the corner, by differences of their positions."""
    step = 1e-3

    def at(t: float) -> Float:
        points, _, corner = placed(frame, axis, theta + omega * t + 0.5 * rate * t**2)
        return np.vstack([points, corner])

    near, far = at(step) + at(-step), at(2.0 * step) + at(-2.0 * step)
    return np.asarray((16.0 * near - far - 30.0 * at(0.0)) / (12.0 * step**2))


def moment(place: Float, force: Float) -> float:
    return float(np.sum(place[..., 0] * force[..., 1] - place[..., 1] * force[..., 0]))


states = st.tuples(
    st.floats(0.02, 1.4), st.sampled_from([-1.0, 1.0]), st.floats(-1.0, 1.0),
    st.floats(-8.0, 8.0), st.floats(-4.0, 4.0),
)  # fmt: skip


@given(st.sampled_from([BENT, STOCKY]), states)
def test_momentum_of_the_parts(
    frame: RockingFrame, drawn: tuple[float, float, float, float, float]
) -> None:
    ratio, sign, omega, across, upwards = drawn
    theta = sign * ratio * frame.slenderness
    response, ground = state(frame, theta, omega, across, upwards)
    total = reactions(response, ground)
    each = column_forces(response, ground, spacing=SPACING, beam_centre=BEAM_CENTRE)
    rate = float(angular_acceleration(frame, theta, omega, across, upwards))
    felt = np.array([across, upwards + GRAVITY])  # acceleration of the ground and of gravity
    corners, loads = [], []
    for i, axis in enumerate((-0.5 * SPACING, 0.5 * SPACING)):
        points, pivot, corner = placed(frame, axis, theta)
        inertia = 0.25 * (rates(frame, axis, theta, omega, rate)[:4] + felt) / GRAVITY
        base = np.array([each.base_shear[i, 0], each.base_vertical[i, 0]])
        load = np.array([each.top_shear[i, 0], -each.top_vertical[i, 0]])
        assert_allclose(inertia.sum(axis=0), base + load, atol=1e-6)
        about = moment(pivot, base) + moment(corner, load)
        assert_allclose(moment(points, inertia), about, atol=1e-5)
        corners.append(corner)
        loads.append(load)
    beam = 2.0 * frame.mass_ratio * (rates(frame, 0.0, theta, omega, rate)[4] + felt) / GRAVITY
    assert_allclose(-np.sum(loads, axis=0), beam, atol=1e-5)
    # The beam does not turn, so its centre moves as the contact points do.
    middle = placed(frame, 0.0, theta)[2]
    moved = frame.horizontal_displacement(theta)
    beam_centre = np.array([float(moved), middle[1] + BEAM_CENTRE])
    turning = sum(moment(c - beam_centre, -f) for c, f in zip(corners, loads, strict=True))
    assert_allclose(turning, 0.0, atol=1e-5)
    summed = each.base_shear[:, 0].sum() / 2.0, each.base_vertical[:, 0].sum() / 2.0
    assert_allclose(summed, (total.base_shear[0], total.base_vertical[0]), rtol=1e-12, atol=1e-12)


# Impacts


def test_impulses_are_the_change_of_momentum_of_the_beam() -> None:
    impulses = impact_impulses(BENT, -0.3)
    before, after = -0.3, -0.3 * BENT.restitution
    u = BENT.horizontal_velocity(0.0, before) - BENT.horizontal_velocity(0.0, after)
    v = BENT.vertical_velocity(1e-15, before) - BENT.vertical_velocity(-1e-15, after)
    assert_allclose(impulses.top_horizontal, BENT.mass_ratio * abs(u), rtol=1e-12)
    assert_allclose(impulses.top_vertical, BENT.mass_ratio * abs(v), rtol=1e-12)
    assert_allclose(
        impulses.base_horizontal / impulses.base_vertical, impact_friction_demand(BENT), rtol=1e-12
    )


def test_impulses_turn_each_column_as_eq_41_says() -> None:
    """The angular momentum of a column about its new pivot follows eq (41), at any mass ratio."""
    for frame in (BENT, STOCKY, RockingFrame(height=3.0, width=0.4)):
        omega = 0.7
        b, h = 0.5 * frame.width, 0.5 * frame.height
        inertia = frame.inertia_ratio * frame.size**2
        impulses = impact_impulses(frame, omega)
        before = (inertia - 2.0 * b * frame.size * math.sin(frame.slenderness)) * omega
        turned = 2.0 * h * impulses.top_horizontal - 2.0 * b * impulses.top_vertical
        assert_allclose(before + turned, inertia * frame.restitution * omega, rtol=1e-12)


@given(st.floats(0.02, 0.9), st.floats(0.0, 50.0))
def test_an_impact_needs_less_friction_than_uplift(tangent: float, gamma: float) -> None:
    frame = RockingFrame(height=5.0, width=5.0 * tangent, mass_ratio=gamma)
    assert impact_friction_demand(frame) < tangent * (1.0 + 1e-12)


def test_a_beam_on_its_underside_stays_on_columns_that_do_not_touch() -> None:
    assert least_spacing(BENT, 0.0) == BENT.width
    assert least_spacing(BENT, 2.0) > least_spacing(BENT, 1.0) > BENT.width


# Expected numbers

cases = pytest.mark.parametrize("number", [0, 1])


@pytest.fixture
def case(number: int, expected: Expected) -> dict[str, Any]:
    values: dict[str, Any] = expected("e_reactions_bridge")["cases"][number]
    return values


def computed(case: dict[str, Any]) -> tuple[Response, GroundAcceleration, ColumnForces]:
    """Return response, ground and forces at thousandths of the period, from -3 to 6 periods."""
    pulse = Pulse(wavelet=f"{case['pulse']}_ricker", a_p=case["a_p_g"] * GRAVITY, T_p=case["T_p_s"])
    ground = GroundAcceleration.from_function(
        pulse.acceleration, -3.0 * pulse.T_p, 6.0 * pulse.T_p, intervals=9000, degree=5
    )
    response = respond(BENT, ground)
    each = column_forces(response, ground, spacing=SPACING, beam_centre=BEAM_CENTRE)
    return response, ground, each


@cases
def test_bridge_forces(case: dict[str, Any]) -> None:
    response, ground, each = computed(case)
    total = reactions(response, ground)
    for row in case["rows"]:
        node = round(1000 * (row["t_over_Tp"] + 3.0))
        forces_at_node = (total.base_shear[node], total.base_vertical[node])
        expected_forces = (row["V_total_over_2mcg"], row["N_total_over_2mcg"])
        assert_allclose(forces_at_node, expected_forces, atol=1e-13)
        for own, name in (
            (each.top_shear, "X_over_mcg"), (each.top_vertical, "Z_over_mcg"),
            (each.base_shear, "V_over_mcg"), (each.base_vertical, "N_over_mcg"),
        ):  # fmt: skip
            assert_allclose(own[:, node], row[name], atol=1e-13)


@cases
def test_bridge_demands(case: dict[str, Any]) -> None:
    response, ground, each = computed(case)
    largest = case["max_demands_on_grid_1e_3Tp"]
    total = reactions(response, ground).base_friction_demand.max()
    assert_allclose(total, largest["mu_total"], rtol=1e-12)
    for i in (0, 1):
        base, top = each.base_friction_demand[i], each.top_friction_demand[i]
        assert_allclose(np.nanmax(base), largest[f"mu_base_{i + 1}"], rtol=1e-12)
        assert_allclose(np.nanmax(top), largest[f"mu_top_{i + 1}"], rtol=1e-12)
    assert_allclose(np.nanmin(each.top_vertical), largest["minZ"], rtol=1e-12)
    assert_allclose(np.nanmin(each.base_vertical), largest["minN"], rtol=1e-12)


def test_bridge_impact_demand(expected: Expected) -> None:
    demand = expected("e_reactions_bridge")["impulse_friction_demand_cot_alpha_1me_over_1pe"]
    assert_allclose(impact_friction_demand(BENT), demand, rtol=1e-13)


def test_free_rocking_after_the_motion_is_on_still_ground() -> None:
    """The forces are those of a motion that continues with zeros, except at its jump to zero."""
    ground = GroundAcceleration.from_samples(noise(4, 300, 0.5), 0.01)
    longer = reactions(respond(BENT, ground, free_rocking=1.0), ground)
    padded = ground.followed_by_rest(1.0)
    still_then = reactions(respond(BENT, padded), padded)
    for name in ("base_shear", "base_vertical"):
        first, other = (np.delete(getattr(each, name), 299) for each in (longer, still_then))
        assert_allclose(first, other, rtol=1e-9, atol=1e-9)


# What is refused


def test_a_motion_of_another_response_is_refused() -> None:
    with pytest.raises(ParameterError, match="Must be the motion of the response"):
        reactions(respond(BENT, still(1.0)), still(2.0))


@pytest.mark.parametrize("geometry", [(1.6, 1.0), (math.nan, 1.0), (12.0, -0.1)])
def test_an_impossible_bent_is_refused(geometry: tuple[float, float]) -> None:
    spacing, beam_centre = geometry
    with pytest.raises(ParameterError, match=r"Invalid (spacing|beam_centre)"):
        column_forces(
            respond(BENT, still(1.0)), still(1.0), spacing=spacing, beam_centre=beam_centre
        )
