"""Responses agree with independently computed ones: tests/expected/README.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import PairAcceleration, Pulse, Verdict, wobble

from .cases import Float, solid

Expected = Callable[[str], Any]


@pytest.mark.parametrize("number", range(6))
def test_free_wobbling(number: int, expected: Expected) -> None:
    case = expected("wobbling")["free"][number]
    frame = solid(case["height_m"], case["width_m"], case["mass_ratio"])
    theta, rate = (
        case[name] * frame.slenderness for name in ("theta_over_alpha", "theta_rate_over_alpha")
    )
    still = PairAcceleration(np.zeros(401), np.zeros(401), time_step=0.01)
    start = (theta, rate, 0.0, case["phi_rate"])
    found = wobble(frame, still, contact_shortening=0.0, start=start)
    nodes = [round(100.0 * time) for time in case["times_s"]]
    x, y = found.theta * np.cos(found.phi), found.theta * np.sin(found.phi)
    assert_allclose(x[nodes], case["x_rad"], rtol=0.0, atol=1e-12)
    assert_allclose(y[nodes], case["y_rad"], rtol=0.0, atol=1e-12)


def sampled(pulse: dict[str, float], samples: int, time_step: float) -> Float:
    ricker = Pulse(wavelet="symmetric_ricker", **pulse)
    rounded: Float = np.round(ricker.acceleration(time_step * np.arange(samples)), 9)
    return rounded


@pytest.mark.parametrize("number", range(14))
def test_peaks_and_verdicts_under_two_pulses(number: int, expected: Expected) -> None:
    """The reference starts from a small tilt, which moves its peaks by less than 1e-5 of alpha."""
    case = expected("wobbling")["forced"][number]
    frame = solid(case["height_m"], case["width_m"], case["mass_ratio"])
    step = case["time_step_s"]
    x, y = (sampled(case[name], case["samples"], step) for name in ("x", "y"))
    found = wobble(frame, PairAcceleration(x, y, step), contact_shortening=0.0)
    assert (found.verdict is Verdict.OVERTURNS) == case["overturns"]
    assert_allclose(found.uplift_time, case["uplift_s"], rtol=1e-14)
    if not case["overturns"]:
        assert_allclose(
            found.peak_rotation_ratio, case["peak_theta_over_alpha"], rtol=0.0, atol=1e-5
        )
    else:
        assert math.isfinite(found.overturning_time)
