"""Geometry and responses agree with independently computed ones (../shared/expected)."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import SHARED

from rockframe import GroundAcceleration, Pulse, UnequalBent, bent_positions, respond_bent

#: Step of the grid on which the reference begins each motion after rest [s].
GRID = 6.99 / 13999


@pytest.fixture(scope="module")
def reference() -> Any:
    """The reference values of bents of two unequal columns."""
    path = SHARED / "expected" / "unequal.json"
    if not path.is_file():
        pytest.skip("no reference values of unequal columns: ../shared/expected/unequal.json")
    return json.loads(path.read_text(encoding="utf-8"))


def bent_of(case: dict[str, Any]) -> UnequalBent:
    return UnequalBent(
        heights=case["heights_m"],
        widths=case["widths_m"],
        spacing=case["spacing_m"],
        mass_ratio=case["mass_ratio"],
        beam_depth=case["beam_depth_m"],
    )


@pytest.mark.parametrize("number", range(8))
def test_geometry(number: int, reference: Any) -> None:
    case = reference["geometry"][number]
    bent, states = bent_of(case), case["states"]
    right, left = bent.uplift_accelerations
    assert_allclose((left, -right), case["uplift_g"], rtol=1e-13)
    kept = (case["restitution_from_plus"], case["restitution_from_minus"])
    assert_allclose(bent.restitutions, kept, rtol=1e-13)
    at = bent_positions(bent, [state["rotation_1"] for state in states])
    for name, values in {
        "rotation_2": at.theta_2,
        "beam_rotation": at.psi,
        "beam_u_m": at.u,
        "beam_v_m": at.v,
        "inertia": at.inertia,
        "gravity": at.pull,
        "ground": at.push,
    }.items():
        assert_allclose(values, [state[name] for state in states], rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("number", range(6))
def test_responses(number: int, reference: Any) -> None:
    """The reference starts up to a step of its grid after uplift, which delays later impacts, and
    moves its peaks by up to 2e-7: started at its times, the kernel agrees to 1e-8.
    """
    case = reference["responses"][number]
    bent, step = bent_of(reference["geometry"][case["geometry"]]), case["time_step_s"]
    size, period, centre = (case[name] for name in ("a_p", "T_p", "time"))
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=period, time=centre)
    samples = np.round(size * pulse.acceleration(step * np.arange(case["samples"])), 9)
    response = respond_bent(bent, GroundAcceleration.from_samples(samples, step))
    assert (response.verdict.label == "overturns") == case["overturns"]
    assert 0.0 < case["uplift_s"] - response.uplift_time < GRID
    impacts = case["first_impacts_s"]
    assert_allclose(response.impact_times[: len(impacts)], impacts, rtol=0.0, atol=2e-5)
    if not case["overturns"]:
        assert_allclose(response.peak_rotation, case["peak_rotation_1"], rtol=0.0, atol=1e-6)
