"""The frame in numbers: values printed in the paper, independent computations, invalid input."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.units import GRAVITY

Float = NDArray[np.float64]
Expected = Callable[[str], Any]

HEAVY = 1e9  # a mass ratio that is infinite to nine digits


@pytest.fixture
def bent() -> RockingFrame:
    return RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


def test_printed_column_of_apollo() -> None:
    column = RockingFrame(height=7.5, width=1.8)
    # The paper prints 1.4; its own dimensions and g give 1.381.
    assert round(column.frequency_parameter, 1) == 1.4
    assert round(column.frequency_parameter, 3) == 1.381
    assert round(math.degrees(column.slenderness), 1) == 13.5


def test_printed_bridge(bent: RockingFrame) -> None:
    assert round(bent.frequency_parameter, 2) == 1.23
    assert_allclose(bent.uplift_acceleration / GRAVITY, 1.0 / 6.0, rtol=1e-15)


def test_bridge_of_rectangular_columns(bent: RockingFrame, expected: Expected) -> None:
    known = expected("constants")["bridge"]
    assert_allclose(bent.slenderness, float(known["alpha_rad"]), rtol=1e-15)
    assert_allclose(bent.size, float(known["R"]), rtol=1e-15)
    assert_allclose(bent.frequency_parameter, float(known["p_rect"]), rtol=1e-15)
    assert_allclose(bent.effective_frequency_parameter, float(known["phat_rect"]), rtol=1e-15)
    assert_allclose(bent.effective_size, float(known["Rhat_rect"]), rtol=1e-15)
    assert_allclose(bent.restitution, 911.0 / 962.0, rtol=1e-15)
    assert_allclose(bent.restitution**2, float(known["r_rect"]), rtol=1e-15)


def test_bridge_of_cylindrical_columns(bent: RockingFrame, expected: Expected) -> None:
    known = expected("constants")["bridge"]
    kappa = 4.0 / 3.0 - math.sin(bent.slenderness) ** 2 / 12.0
    cylinders = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, inertia_ratio=kappa)
    assert_allclose(kappa, float(known["kappa_cyl"]), rtol=1e-15)
    assert_allclose(cylinders.frequency_parameter, float(known["p_cyl"]), rtol=1e-15)
    assert_allclose(cylinders.effective_frequency_parameter, float(known["phat_cyl"]), rtol=1e-15)
    assert_allclose(cylinders.restitution, float(known["sqrt_r_cyl"]), rtol=1e-15)


def test_column_of_apollo(expected: Expected) -> None:
    known = expected("constants")["apollo_corinth"]
    column = RockingFrame(height=7.5, width=1.8)
    assert_allclose(column.size, float(known["R"]), rtol=1e-15)
    assert_allclose(column.frequency_parameter, float(known["p"]), rtol=1e-15)
    assert_allclose(math.degrees(column.slenderness), float(known["alpha_deg"]), rtol=1e-15)


@pytest.mark.parametrize(
    ("u", "ratio", "v"),
    [
        (0.2, "theta_over_alpha_at_u_0p20", "v_at_u_0p20"),
        (0.5, "theta_over_alpha_at_u_0p50", "v_at_u_0p50"),
    ],
)
def test_lift_that_goes_with_a_sway(
    bent: RockingFrame, expected: Expected, u: float, ratio: str, v: str
) -> None:
    known = expected("constants")["geometry_check_fig11"]
    theta = float(known[ratio]) * bent.slenderness
    assert_allclose(bent.horizontal_displacement(theta), u, rtol=1e-14)
    assert_allclose(bent.vertical_displacement(theta), float(known[v]), rtol=1e-13)


@pytest.mark.parametrize("name", ["height", "width"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_dimensions_must_be_positive(name: str, value: float) -> None:
    arguments: dict[str, Any] = {"height": 9.6, "width": 1.6, "mass_ratio": 4.0, name: value}
    with pytest.raises(ParameterError) as error:
        RockingFrame(name="bent", **arguments)
    must_be = "between 0.001 and 1000 m"
    assert f"Invalid {name} {value!r} of frame 'bent'. Must be {must_be}." in str(error.value)


@pytest.mark.parametrize("value", [-1.0, 0.0, 0.9, 1.0, 100.1, math.nan, math.inf])
def test_inertia_about_a_corner_is_more_than_that_of_a_mass_in_one_point(value: float) -> None:
    """I_o = I_c + m R^2 is above m R^2, and no column extends to ten times R."""
    with pytest.raises(ParameterError, match=r"Must be above 1 and at most 100: about the corner"):
        RockingFrame(height=9.6, width=1.6, inertia_ratio=value)


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf, 1e308])
def test_mass_ratio_must_be_between_none_and_the_limit(value: float) -> None:
    with pytest.raises(ParameterError) as error:
        RockingFrame(height=9.6, width=1.6, mass_ratio=value, name="bent")
    assert f"Invalid mass_ratio {value!r} of frame 'bent'" in str(error.value)
    assert "Must be between 0 and 1e+15." in str(error.value)


@pytest.mark.parametrize("value", [1.056, 2.0, 0.0, -0.1, math.nan, math.inf])
def test_an_impact_keeps_some_of_the_speed_but_not_all(value: float) -> None:
    """(43) keeps 911/962 of it, so a factor of 962/911 would keep all."""
    bent = partial(RockingFrame, height=9.6, width=1.6, mass_ratio=4.0, name="bent")
    with pytest.raises(ParameterError) as error:
        bent(restitution_factor=value)
    assert f"Invalid restitution_factor {value!r} of frame 'bent'" in str(error.value)
    assert "below 1.05598: it multiplies the velocity ratio of eq (43), 0.947" in str(error.value)
    elastic = bent(restitution_factor=1.0559)
    assert elastic.restitution == pytest.approx(1.0559 * 911.0 / 962.0, rel=1e-14)


@pytest.mark.parametrize(
    ("width", "gamma", "limit"), [(1.42, 0.0, "54.74"), (1.01, 1e6, "45.00"), (1.2, 1.0, "46.91")]
)
def test_a_frame_too_stocky_to_rock(width: float, gamma: float, limit: str) -> None:
    with pytest.raises(ParameterError) as error:
        RockingFrame(height=1.0, width=width, mass_ratio=gamma, name="stub")
    words = str(error.value)
    assert f"Invalid slenderness {math.degrees(math.atan(width)):.2f} degrees" in words
    assert f"Must be below {limit} degrees" in words
    assert "'stub'" in words
    assert "does not rock" in words
