"""Responses agree with other integrators and with closed forms: tests/expected/README.md."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking import kernels
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Response, respond
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .direct import integrate
from .reference import solve

Expected = Callable[[str], Any]
Float = NDArray[np.float64]

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
WAVELET = {"symmetric": "symmetric_ricker", "antisymmetric": "antisymmetric_ricker"}

bridge_cases = pytest.mark.parametrize("number", range(13))


@pytest.fixture
def case(number: int, expected: Expected) -> dict[str, Any]:
    """Return one pulse on the paper's bridge."""
    values: dict[str, Any] = expected("a_bridge")["cases"][number]
    return values


def pulse_of(case: dict[str, Any]) -> Pulse:
    return Pulse(
        wavelet=WAVELET[case["pulse"]],
        a_p=float(case["a_p_g"]) * GRAVITY,
        T_p=float(case["T_p_s"]),
    )


def histories(case: dict[str, Any]) -> tuple[Float, Float, Float]:
    rows = [(float(r["t_over_Tp"]), float(r["theta"]), float(r["thetadot"])) for r in case["theta"]]
    times, theta, omega = np.array(rows).T
    return float(case["T_p_s"]) * times, theta, omega


def at(response: Response, times: Float) -> NDArray[np.intp]:
    """Return the nodes at given times; the times must be nodes."""
    nodes = np.searchsorted(response.time, times - 1e-9)
    assert_allclose(response.time[nodes], times, rtol=0, atol=1e-12)
    return nodes


# The paper's bridge under continuous pulses


def test_every_bridge_case_is_tested(expected: Expected) -> None:
    assert len(expected("a_bridge")["cases"]) == 13


@bridge_cases
def test_bridge_rotation(case: dict[str, Any]) -> None:
    pulse = pulse_of(case)
    times, theta, omega = histories(case)
    response = respond(BENT, pulse, free_rocking=10.0 * pulse.T_p)
    standing = np.abs(theta) < 0.5 * math.pi  # one expected value lies beyond it
    nodes = at(response, times[standing])
    assert_allclose(response.theta[nodes], theta[standing], rtol=0, atol=1e-9)
    assert_allclose(response.omega[nodes], omega[standing], rtol=0, atol=1e-9)


@bridge_cases
def test_bridge_impacts(case: dict[str, Any]) -> None:
    response = respond(BENT, pulse_of(case), free_rocking=30.0)
    impacts = np.array([[float(i["t"]), float(i["thetadot_before"])] for i in case["impacts"]])
    assert_allclose(response.impact_times[: len(impacts)], impacts[:, 0], rtol=0, atol=1e-9)
    assert_allclose(response.impact_velocities[: len(impacts)], impacts[:, 1], rtol=0, atol=1e-9)


@bridge_cases
def test_bridge_uplift(case: dict[str, Any]) -> None:
    response = respond(BENT, pulse_of(case))
    assert_allclose(response.uplift_time, float(case["t_uplift"]), rtol=0, atol=1e-12)


@bridge_cases
def test_bridge_verdict_and_peak(case: dict[str, Any]) -> None:
    response = respond(BENT, pulse_of(case))
    if case["verdict"] == "overturned":
        assert response.verdict is Verdict.OVERTURNS
        assert response.peak_rotation == 0.5 * math.pi
        assert response.impacts == case["n_impacts_before_overturn"]
        return
    assert response.verdict is Verdict.STANDS
    peak = float(case["peak_abs_theta_over_alpha"])
    assert_allclose(response.peak_rotation_ratio, peak, rtol=0, atol=1e-9)
    assert_allclose(response.peak_time, float(case["t_peak"]), rtol=0, atol=1e-7)


@pytest.mark.parametrize("number", [4, 5, 6, 11, 12])
def test_bridge_overturning_time_against_dop853(case: dict[str, Any]) -> None:
    ground = GroundAcceleration.from_pulse(pulse_of(case)).followed_by_rest(3.0)
    solution = solve(
        ground.coefficients / GRAVITY,
        ground.time_step,
        alpha=BENT.slenderness,
        p_hat=BENT.effective_frequency_parameter,
        restitution=BENT.restitution,
        start_time=ground.start_time,
    )
    response = respond(BENT, pulse_of(case))
    assert_allclose(response.overturning_time, solution.overturning_time, rtol=0, atol=1e-9)


# The same pulses as samples


@pytest.mark.parametrize("number", [0, 1])
def test_sampled_pulse(number: int, expected: Expected) -> None:
    case = expected("a3_sampled_piecewise_linear")[number]
    period, step = case["T_p_s"], case["dt"]
    centred = Pulse(
        wavelet=WAVELET[case["pulse"]],
        a_p=case["a_p_g"] * GRAVITY,
        T_p=period,
        time=2.0 * period,
    )
    samples = centred.acceleration(step * np.arange(case["n_samples"]))
    response = respond(BENT, GroundAcceleration.from_samples(samples, step), free_rocking=9.0)
    times, theta, omega = histories(case)
    on_node = np.abs(times / step - np.round(times / step)) < 1e-6
    nodes = at(response, times[on_node])
    assert_allclose(response.theta[nodes], theta[on_node], rtol=0, atol=1e-9)
    assert_allclose(response.omega[nodes], omega[on_node], rtol=0, atol=1e-9)
    impacts = np.array([[float(i["t"]), float(i["thetadot_before"])] for i in case["impacts"]])
    assert_allclose(response.impact_times[:5], impacts[:, 0], rtol=0, atol=1e-9)
    assert_allclose(response.impact_velocities[:5], impacts[:, 1], rtol=0, atol=1e-9)
    assert_allclose(response.uplift_time, float(case["t_uplift"]), rtol=0, atol=1e-12)
    assert_allclose(
        response.peak_rotation_ratio, float(case["peak_abs_theta_over_alpha"]), rtol=0, atol=1e-9
    )


# Free rocking of the bridge


@pytest.fixture
def swing(row: int, expected: Expected) -> tuple[dict[str, Any], Response]:
    """Return one release from rest, and the response to it."""
    values = expected("d_free_rocking_bridge")["rows"][row]
    still = GroundAcceleration.from_samples(np.zeros(1601), 0.01)
    start = float(values["theta0_over_alpha"]) * BENT.slenderness
    return values, respond(BENT, still, initial_rotation=start)


releases = pytest.mark.parametrize("row", range(5))


@releases
def test_free_rocking_impacts(swing: tuple[dict[str, Any], Response]) -> None:
    values, response = swing
    times = np.array(values["impact_times"], dtype=float)
    velocities = np.array(values["thetadot_before"], dtype=float)
    assert_allclose(response.impact_times[: times.size], times, rtol=1e-12)
    assert_allclose(response.impact_velocities[: times.size], velocities, rtol=1e-12)


@releases
def test_free_rocking_quarter_period(swing: tuple[dict[str, Any], Response]) -> None:
    values, response = swing
    exact = float(values["p_hat_times_quarter_period_exact_integral"])
    first = response.impact_times[0] * BENT.effective_frequency_parameter
    assert_allclose(first, exact, rtol=1e-12)
    assert_allclose(4.0 * first, float(values["p_hat_T_linear_eq_4acosh"]), rtol=2e-3)


@releases
def test_free_rocking_amplitudes(swing: tuple[dict[str, Any], Response]) -> None:
    values, response = swing
    amplitudes = np.array(values["amplitude_after_n_impacts_exact_over_alpha"], dtype=float)
    after = response.impact_velocities * BENT.restitution
    p2 = BENT.effective_frequency_parameter**2
    alpha = BENT.slenderness
    turning = alpha - np.arccos(math.cos(alpha) + after**2 / (2.0 * p2))
    assert_allclose(turning[: amplitudes.size] / alpha, amplitudes, rtol=1e-11)
    between = np.searchsorted(response.time, response.impact_times[:4])
    for i, amplitude in enumerate(amplitudes):  # nodes are 0.01 s apart, but peaks are flat
        reached = np.abs(response.theta[between[i] : between[i + 1]]).max()
        assert_allclose(reached / alpha, amplitude, rtol=1e-3)


# Overturning in closed form, for columns so slender that their equation is linear

ALPHA = 1e-4  # the equation differs from the linear one by terms of order alpha^2
MARGIN = 1e-6  # relative distance from the edge at which the verdict must have changed


def overturns(ground: GroundAcceleration, amplitude: float, restitution: float) -> bool:
    """Return True if it overturns; the amplitude is in g tan(alpha), the time in 1/p."""
    scaled = amplitude * math.tan(ALPHA) * ground.coefficients
    outcome = integrate(scaled, ground.time_step, alpha=ALPHA, restitution=restitution)
    return outcome.verdict == kernels.OVERTURNS


def sine(frequency: float, half_cycles: int) -> GroundAcceleration:
    """Return a sine of unit amplitude that starts at time 0."""
    return GroundAcceleration.from_function(
        lambda t: np.sin(frequency * t),
        0.0,
        half_cycles * math.pi / frequency,
        intervals=400 * half_cycles,
        degree=5,
    )


@pytest.mark.parametrize("row", range(5))
def test_full_sine(row: int, expected: Expected) -> None:
    row_of_table = expected("c_linear_full_sine")["rows"][row]
    ground = sine(row_of_table["omega_p_over_p"], 2)
    e = row_of_table["sqrt_r"]
    lower, upper = row_of_table["with_one_impact_lower"], row_of_table["with_one_impact_upper"]
    alone = float(row_of_table["no_impact"])
    assert not overturns(ground, lower * (1.0 - MARGIN), e)
    assert overturns(ground, lower * (1.0 + MARGIN), e)
    assert overturns(ground, upper * (1.0 - MARGIN), e)
    assert not overturns(ground, upper * (1.0 + MARGIN), e)
    assert not overturns(ground, alone * (1.0 - MARGIN), e)
    assert overturns(ground, alone * (1.0 + MARGIN), e)


@pytest.mark.parametrize("ratio", ["0.5", "1", "2", "3", "4", "5", "6", "7.5", "8"])
def test_half_sine(ratio: str, expected: Expected) -> None:
    edge = float(expected("c2_linear_half_sine")["rows"][ratio])
    ground = sine(float(ratio), 1)
    assert not overturns(ground, edge * (1.0 - MARGIN), 0.9)
    assert overturns(ground, edge * (1.0 + MARGIN), 0.9)


@pytest.mark.parametrize("amplitude", ["1.1", "1.5", "2", "3", "5"])
def test_rectangular_pulse(amplitude: str, expected: Expected) -> None:
    duration = float(expected("c3_linear_rect_pulse")["rows"][amplitude])
    shorter = GroundAcceleration(np.ones((1, 1)), duration * (1.0 - MARGIN))
    longer = GroundAcceleration(np.ones((1, 1)), duration * (1.0 + MARGIN))
    assert not overturns(shorter, float(amplitude), 0.9)
    assert overturns(longer, float(amplitude), 0.9)


# First overturning of blocks and frames


@pytest.mark.parametrize("number", range(8))
def test_first_overturning(number: int, expected: Expected) -> None:
    edge_of_table = expected("b4_criterion_alpha_vs_overturn")["first_edges"][number]
    frame = RockingFrame(
        height=4.0,
        width=4.0 * math.tan(math.radians(edge_of_table["alpha_deg"])),
        mass_ratio=edge_of_table["gamma"],
    )
    period = 2.0 * math.pi / (edge_of_table["omega_p_over_p"] * frame.frequency_parameter)

    def verdict(factor: float) -> Verdict:
        a_p = factor * edge_of_table["first_overturn"] * frame.uplift_acceleration
        return respond(
            frame, Pulse(wavelet=WAVELET[edge_of_table["pulse"]], a_p=a_p, T_p=period)
        ).verdict

    assert verdict(1.0 - 1e-9) is Verdict.STANDS
    assert verdict(1.0 + 1e-9) is Verdict.OVERTURNS


# The same with a frame and with the pulses of textbooks

#: A column so large and slender that the linear theory holds: p of 1 rad/s, alpha of 1e-4.
BLOCK = RockingFrame(
    height=2.0 * 0.75 * 9.81, width=2.0 * 0.75 * 9.81 * ALPHA, restitution_factor=0.9
)


def falls(wavelet: str, ratio: float, amplitude: float) -> bool:
    period = 2.0 * math.pi / (ratio * BLOCK.frequency_parameter)
    a_p = amplitude * BLOCK.uplift_acceleration
    return respond(BLOCK, Pulse(wavelet=wavelet, a_p=a_p, T_p=period)).verdict is Verdict.OVERTURNS


@pytest.mark.parametrize("ratio", ["0.5", "2", "5", "8"])
def test_half_sine_as_a_pulse(ratio: str, expected: Expected) -> None:
    edge = float(expected("c2_linear_half_sine")["rows"][ratio])
    assert not falls("half_sine", float(ratio), edge * (1.0 - MARGIN))
    assert falls("half_sine", float(ratio), edge * (1.0 + MARGIN))


@pytest.mark.parametrize("row", range(5))
def test_full_sine_as_a_pulse(row: int, expected: Expected) -> None:
    row_of_table = expected("c_linear_full_sine")["rows"][row]
    ratio, alone = row_of_table["omega_p_over_p"], float(row_of_table["no_impact"])
    for edge, falls_above in (
        (row_of_table["with_one_impact_lower"], True),
        (row_of_table["with_one_impact_upper"], False),
        (alone, True),
    ):
        assert falls("full_sine", ratio, edge * (1.0 + MARGIN)) is falls_above
        assert falls("full_sine", ratio, edge * (1.0 - MARGIN)) is not falls_above
