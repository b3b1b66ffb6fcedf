"""The frame: limits and identities of eqs (7)-(12), (27)-(29), (36) and (43)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.parts import Tendon
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Expected = Callable[[str], Any]

HEAVY = 1e9  # a mass ratio that is infinite to nine digits

heights = st.floats(1.0, 50.0)
width_ratios = st.floats(0.02, 0.9)
mass_ratios = st.floats(0.0, 100.0)
frames = st.builds(
    lambda height, ratio, mass_ratio: RockingFrame(
        height=height, width=ratio * height, mass_ratio=mass_ratio
    ),
    heights,
    width_ratios,
    mass_ratios,
)


@pytest.fixture
def bent() -> RockingFrame:
    return RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


def block_of_size(size: float, slenderness: float) -> RockingFrame:
    return RockingFrame(
        height=2.0 * size * math.cos(slenderness), width=2.0 * size * math.sin(slenderness)
    )


# Limits and identities


@given(frames)
def test_frame_without_beam_is_the_block(frame: RockingFrame) -> None:
    block = RockingFrame(height=frame.height, width=frame.width, mass_ratio=0.0)
    assert block.effective_size == block.size
    assert block.effective_frequency_parameter == block.frequency_parameter


@given(frames)
def test_the_frequency_follows_from_the_energies(frame: RockingFrame) -> None:
    """p^2 is the moment of gravity over the inertia of a column and its beam share (m_c = 1)."""
    theta, step, gamma = 0.5 * frame.slenderness, 1e-4 * frame.slenderness, frame.mass_ratio
    du, dv = (
        (place(theta + step) - place(theta - step)) / (2.0 * step)
        for place in (frame.horizontal_displacement, frame.vertical_displacement)
    )
    lever = frame.size * math.sin(frame.slenderness - theta)
    inertia = 4.0 / 3.0 * frame.size**2 + gamma * (du**2 + dv**2)
    squared = GRAVITY * (lever + gamma * dv) / (inertia * lever / frame.size)
    assert_allclose(frame.effective_frequency_parameter**2, squared, rtol=1e-7)
    assert_allclose(0.75 * GRAVITY / frame.effective_size, squared, rtol=1e-7)


def test_a_heavy_beam_slows_the_frame_by_sqrt_two_thirds() -> None:
    frame = RockingFrame(height=6.0, width=1.0, mass_ratio=HEAVY)
    ratio = frame.effective_frequency_parameter / frame.frequency_parameter
    assert_allclose(ratio, math.sqrt(2.0 / 3.0), rtol=1e-8)


def test_a_heavy_beam_makes_the_block_half_as_large_again() -> None:
    frame = RockingFrame(height=6.0, width=1.0, mass_ratio=HEAVY)
    assert_allclose(frame.effective_size, 1.5 * frame.size, rtol=1e-8)


@pytest.mark.parametrize("inertia_ratio", [1.01, 4.0 / 3.0, 1.9])
def test_under_a_heavy_beam_the_columns_inertia_does_not_matter(inertia_ratio: float) -> None:
    frame = RockingFrame(height=6.0, width=1.0, mass_ratio=HEAVY, inertia_ratio=inertia_ratio)
    pendulum = math.sqrt(GRAVITY / (2.0 * frame.size))
    assert_allclose(frame.effective_frequency_parameter, pendulum, rtol=1e-8)


@pytest.mark.parametrize("gamma", [0.0, 0.25, 1.0, 4.0, 60.0])
def test_eq_27_as_printed(gamma: float) -> None:
    frame = RockingFrame(height=7.5, width=1.8, mass_ratio=gamma)
    printed = math.sqrt((1.0 + 2.0 * gamma) / (1.0 + 3.0 * gamma)) * frame.frequency_parameter
    assert_allclose(frame.effective_frequency_parameter, printed, rtol=1e-14)


@pytest.mark.parametrize("gamma", [0.0, 0.25, 1.0, 4.0, 60.0])
def test_eq_29_as_printed(gamma: float) -> None:
    frame = RockingFrame(height=7.5, width=1.8, mass_ratio=gamma)
    printed = (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma) * frame.size
    assert_allclose(frame.effective_size, printed, rtol=1e-14)


@given(frames, st.floats(0.1, 10.0))
def test_froude_scaling(frame: RockingFrame, scale: float) -> None:
    larger = RockingFrame(
        height=scale * frame.height, width=scale * frame.width, mass_ratio=frame.mass_ratio
    )
    assert_allclose(larger.restitution, frame.restitution, rtol=1e-9)
    assert_allclose(
        larger.effective_frequency_parameter * math.sqrt(scale),
        frame.effective_frequency_parameter,
        rtol=1e-13,
    )


@given(frames, mass_ratios)
def test_uplift_does_not_depend_on_the_mass_ratio(frame: RockingFrame, other: float) -> None:
    twin = RockingFrame(height=frame.height, width=frame.width, mass_ratio=other)
    assert twin.uplift_acceleration == frame.uplift_acceleration
    assert_allclose(frame.uplift_acceleration, GRAVITY * math.tan(frame.slenderness), rtol=1e-14)


@given(st.floats(0.001, 0.9))
def test_restitution_of_a_block(slenderness: float) -> None:
    block = block_of_size(3.0, slenderness)
    housner = 1.0 - 1.5 * math.sin(slenderness) ** 2
    assert_allclose(block.restitution, housner, rtol=0, atol=1e-15)


@given(st.floats(0.001, 0.75))
def test_restitution_under_a_heavy_beam(slenderness: float) -> None:
    frame = RockingFrame(height=1.0, width=math.tan(slenderness), mass_ratio=HEAVY)
    assert_allclose(frame.restitution, math.cos(2.0 * slenderness), rtol=0, atol=1e-8)


@given(frames)
def test_eq_43_as_printed(frame: RockingFrame) -> None:
    alpha, gamma = frame.slenderness, frame.mass_ratio
    loss = 1.0 - 1.5 * math.sin(alpha) ** 2 + 3.0 * gamma * math.cos(2.0 * alpha)
    assert_allclose(frame.restitution, loss / (1.0 + 3.0 * gamma), rtol=0, atol=1e-14)


@given(frames)
def test_the_beam_never_raises_the_restitution(frame: RockingFrame) -> None:
    block = RockingFrame(height=frame.height, width=frame.width)
    assert frame.restitution <= block.restitution


def test_impact_of_a_block_is_plastic_at_the_paper_s_slenderness() -> None:
    limit = RockingFrame(height=6.0, width=1.0).slenderness_limit
    assert_allclose(limit, math.asin(math.sqrt(2.0 / 3.0)), rtol=1e-15)
    assert abs(math.degrees(limit) - 54.73) < 0.01  # 54.7356: the paper truncates


def test_impact_under_a_heavy_beam_is_plastic_at_45_degrees() -> None:
    frame = RockingFrame(height=6.0, width=1.0, mass_ratio=HEAVY)
    assert_allclose(math.degrees(frame.slenderness_limit), 45.0, rtol=1e-8)


@pytest.mark.parametrize("gamma", [0.0, 0.3, 4.0])
@pytest.mark.parametrize("inertia_ratio", [1.2, 4.0 / 3.0])
def test_restitution_vanishes_at_the_limit(gamma: float, inertia_ratio: float) -> None:
    slim = RockingFrame(height=6.0, width=1.0, mass_ratio=gamma, inertia_ratio=inertia_ratio)
    width = 6.0 * math.tan(slim.slenderness_limit - 1e-9)
    frame = RockingFrame(height=6.0, width=width, mass_ratio=gamma, inertia_ratio=inertia_ratio)
    assert 0.0 < frame.restitution < 1e-8


# Kinematics


@given(frames, st.floats(-1.57, 1.57))
def test_columns_keep_their_length(frame: RockingFrame, theta: float) -> None:
    u = abs(float(frame.horizontal_displacement(theta)))
    v = float(frame.vertical_displacement(theta))
    diagonal = 2.0 * frame.size
    across = diagonal * math.sin(frame.slenderness) - u
    up = diagonal * math.cos(frame.slenderness) + v
    assert_allclose(math.hypot(across, up), diagonal, rtol=1e-14)


@given(frames, st.floats(-1.57, 1.57))
def test_mirror_symmetry(frame: RockingFrame, theta: float) -> None:
    assert frame.horizontal_displacement(-theta) == -frame.horizontal_displacement(theta)
    assert frame.vertical_displacement(-theta) == frame.vertical_displacement(theta)


@given(frames)
def test_balanced_frame_is_highest_and_a_width_away(frame: RockingFrame) -> None:
    alpha = frame.slenderness
    assert_allclose(frame.horizontal_displacement(alpha), frame.width, rtol=1e-13)
    rise = 2.0 * frame.size - frame.height
    assert_allclose(frame.vertical_displacement(alpha), rise, rtol=0, atol=1e-13 * frame.height)
    assert frame.vertical_displacement(0.999 * alpha) < frame.vertical_displacement(alpha)
    assert frame.vertical_displacement(1.001 * alpha) < frame.vertical_displacement(alpha)


@pytest.mark.parametrize("theta", [1e-3, 1e-6, 1e-9, 1e-12, 1e-300])
def test_small_displacements_keep_all_their_digits(bent: RockingFrame, theta: float) -> None:
    # 2R [sin a - sin(a - theta)] = 2R [theta cos a + theta^2/2 sin a - theta^3/6 cos a - ...]
    b, h = bent.width, bent.height
    u = (
        h * theta
        + b * theta**2 / 2.0
        - h * theta**3 / 6.0
        - b * theta**4 / 24.0
        + h * theta**5 / 120.0
    )
    v = (
        b * theta
        - h * theta**2 / 2.0
        - b * theta**3 / 6.0
        + h * theta**4 / 24.0
        + b * theta**5 / 120.0
    )
    assert_allclose(bent.horizontal_displacement(theta), u, rtol=4e-15)
    assert_allclose(bent.vertical_displacement(theta), v, rtol=4e-15)


def swing(t: Float) -> tuple[Float, Float, Float]:
    """Return a rotation over time that does not reach 0, and its first and second derivative."""
    return 0.1 + 0.05 * np.sin(3.0 * t), 0.15 * np.cos(3.0 * t), -0.45 * np.sin(3.0 * t)


def slope(function: Callable[[Float], Float], t: Float, h: float = 0.02) -> Float:
    """Return the derivative by a central difference of order 8."""
    weights = (4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0)
    total = np.zeros_like(t)
    for k, weight in enumerate(weights, start=1):
        total += weight * (function(t + k * h) - function(t - k * h))
    return total / h


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("height", [9.6, 1.7])
def test_rates_are_the_derivatives(sign: float, height: float) -> None:
    frame = RockingFrame(height=height, width=1.6, mass_ratio=0.5)
    t = np.linspace(0.0, 2.0, 41)
    theta, omega, rate = (sign * x for x in swing(t))
    atol = 1e-11 * height
    assert_allclose(
        frame.horizontal_velocity(theta, omega),
        slope(lambda x: frame.horizontal_displacement(sign * swing(x)[0]), t),
        rtol=0,
        atol=atol,
    )
    assert_allclose(
        frame.vertical_velocity(theta, omega),
        slope(lambda x: frame.vertical_displacement(sign * swing(x)[0]), t),
        rtol=0,
        atol=atol,
    )
    assert_allclose(
        frame.horizontal_acceleration(theta, omega, rate),
        slope(lambda x: frame.horizontal_velocity(sign * swing(x)[0], sign * swing(x)[1]), t),
        rtol=0,
        atol=atol,
    )
    assert_allclose(
        frame.vertical_acceleration(theta, omega, rate),
        slope(lambda x: frame.vertical_velocity(sign * swing(x)[0], sign * swing(x)[1]), t),
        rtol=0,
        atol=atol,
    )


@pytest.mark.parametrize("omega", [0.2, -0.2])
def test_the_beam_rises_after_an_impact(bent: RockingFrame, omega: float) -> None:
    assert_allclose(bent.vertical_velocity(0.0, omega), bent.width * abs(omega), rtol=1e-14)


def test_displacements_follow_the_shape_of_the_rotation(bent: RockingFrame) -> None:
    theta = np.linspace(-0.1, 0.1, 6).reshape(2, 3)
    assert bent.horizontal_displacement(theta).shape == (2, 3)
    assert bent.vertical_velocity(theta, 0.1).shape == (2, 3)


def test_a_tendon_without_a_length_is_as_long_as_the_columns() -> None:
    """It passes through them from end to end; alone it has no stiffness."""
    tendon = Tendon(area=1e-3, modulus=195e9)
    frame = RockingFrame(height=9.6, width=1.6, column_mass=48e3, tendon=tendon)
    assert frame.tendon == Tendon(area=1e-3, modulus=195e9, length=9.6)
    with pytest.raises(ParameterError, match="Missing length of a tendon"):
        _ = tendon.stiffness


def test_displacements_of_an_overturned_frame_are_unknown(bent: RockingFrame) -> None:
    assert np.isnan(bent.horizontal_displacement(math.nan))
    assert np.isnan(bent.vertical_displacement(math.nan))


@given(frames)
def test_a_frame_is_printed_as_it_is_made(frame: RockingFrame) -> None:
    assert eval(repr(frame)) == frame  # noqa: S307
