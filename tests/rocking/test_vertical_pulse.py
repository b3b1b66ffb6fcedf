"""The bridge under a pulse with vertical acceleration, compared with other integrators."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import GroundAcceleration, Pulse, RockingFrame, respond, respond_scenarios
from rockframe.units import GRAVITY

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)


@pytest.fixture
def case(expected: Callable[[str], Any]) -> dict[str, Any]:
    """Return the case without tendons."""
    values: dict[str, Any] = expected("a2_vertical_and_tendons")["cases"][0]
    assert "c1" not in values
    return values


@pytest.fixture(scope="module")
def ground() -> GroundAcceleration:
    """Return a pulse of 0.5 g and 1.5 s with a vertical one of 0.3 g and 0.4 s, 0.2 s later."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    upwards = Pulse(wavelet="symmetric_ricker", a_p=0.3 * GRAVITY, T_p=0.4, time=0.2)
    across, lift = (
        GroundAcceleration.from_function(p.acceleration, -4.5, 6.75, intervals=4500, degree=5)
        for p in (pulse, upwards)
    )
    return across.with_vertical(lift)


def test_histories(case: dict[str, Any], ground: GroundAcceleration) -> None:
    response = respond(BENT, ground)
    times = np.array([1.5 * row["t_over_Tp"] for row in case["theta"]])
    nodes = np.searchsorted(response.time, times - 1e-9)
    theta = [row["theta"] for row in case["theta"]]
    assert_allclose(response.theta[nodes], theta, rtol=0, atol=1e-8)
    assert_allclose(
        response.omega[nodes], [row["thetadot"] for row in case["theta"]], rtol=0, atol=1e-8
    )
    assert response.uplift_time == pytest.approx(case["t_uplift"], abs=1e-9)


def test_impacts(case: dict[str, Any], ground: GroundAcceleration) -> None:
    response = respond(BENT, ground)
    listed = [impact for impact in case["impacts"] if impact["t"] < ground.time[-1]]
    nearest = [int(np.abs(response.impact_times - impact["t"]).argmin()) for impact in listed]
    assert_allclose(
        response.impact_times[nearest], [impact["t"] for impact in listed], rtol=0, atol=1e-8
    )
    assert_allclose(
        response.impact_velocities[nearest],
        [impact["thetadot_before"] for impact in listed],
        rtol=0,
        atol=1e-8,
    )


def test_the_lanes_say_the_same(case: dict[str, Any], ground: GroundAcceleration) -> None:
    response = respond(BENT, ground)
    scenarios = respond_scenarios([ground], [BENT], [0], [0], [1.0])
    assert scenarios.verdict[0] == response.verdict
    assert scenarios.uplift_time[0] == pytest.approx(case["t_uplift"], abs=1e-9)
    assert scenarios.peak_rotation[0] == pytest.approx(response.peak_rotation, rel=1e-12)
    assert scenarios.impacts[0] == response.impacts
    assert scenarios.peak_rotation[0] >= max(abs(row["theta"]) for row in case["theta"]) - 1e-9
