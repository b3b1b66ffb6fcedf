"""Identities that every rocking response must satisfy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.integrate import quad
from tests.conftest import examples

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import tails
from rockframe.rocking.kernels.steps import MOVING, taylor
from rockframe.rocking.response import Response, respond
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

from .direct import integrate
from .motions import BENT, SLENDER, SMALL, STOCKY, noise, release, still

Float = NDArray[np.float64]

#: It loses a tenth of the speed that rigid bodies with contact at their edges would lose.
ELASTIC = replace(
    BENT, restitution_factor=(1.0 - 0.1 * (1.0 - BENT.restitution)) / BENT.restitution
)
ANY = [BENT, STOCKY, SLENDER, SMALL, ELASTIC]
any_frame = pytest.mark.parametrize("frame", ANY)


def energy(frame: RockingFrame, response: Response) -> Float:
    """Return the energy over the moment of inertia, zero at rest upright [s-2]."""
    p2 = frame.effective_frequency_parameter**2
    alpha = frame.slenderness
    height = np.cos(alpha - np.abs(response.theta)) - math.cos(alpha)
    return 0.5 * response.omega**2 + p2 * height


# Symmetry and scaling


@any_frame
@pytest.mark.parametrize("seed", [1, 2])
def test_polarity_symmetry(frame: RockingFrame, seed: int) -> None:
    samples = noise(seed, 600, 3.0 * frame.width / frame.height)
    response = respond(frame, GroundAcceleration.from_samples(samples, 0.01))
    other = respond(frame, GroundAcceleration.from_samples(-samples, 0.01))
    assert response.impacts == other.impacts
    assert response.verdict == other.verdict
    assert np.array_equal(response.theta, -other.theta, equal_nan=True)


@pytest.mark.parametrize("wavelet", list(RICKERS))
@pytest.mark.parametrize("scale", [0.1, 0.5, 3.0])
def test_the_same_pulse_in_time_over_frequency_gives_the_same_rotation(
    wavelet: str, scale: float
) -> None:
    model = RockingFrame(height=scale * BENT.height, width=scale * BENT.width, mass_ratio=4.0)
    full = respond(BENT, Pulse(wavelet=wavelet, a_p=5.0, T_p=1.5))
    reduced = respond(model, Pulse(wavelet=wavelet, a_p=5.0, T_p=1.5 * math.sqrt(scale)))
    assert_allclose(reduced.theta, full.theta, rtol=0, atol=1e-12)
    assert_allclose(reduced.time, full.time * math.sqrt(scale), rtol=0, atol=1e-14)


@pytest.mark.parametrize("gamma", [0.0, 0.3, 4.0, 100.0])
def test_the_frame_is_a_larger_block_with_the_restitution_of_the_frame(gamma: float) -> None:
    frame = RockingFrame(height=7.5, width=1.8, mass_ratio=gamma)
    scale = frame.effective_size / frame.size
    block = RockingFrame(height=scale * frame.height, width=scale * frame.width)
    ground = GroundAcceleration.from_samples(noise(5, 1000, 0.8), 0.01)
    expected = integrate(
        ground.coefficients / GRAVITY,
        0.01,
        alpha=block.slenderness,
        p_hat=block.frequency_parameter,
        restitution=frame.restitution,
    )
    assert_allclose(respond(frame, ground).theta, expected.theta, rtol=0, atol=1e-9)


def test_more_mass_on_top_is_not_the_same_as_a_larger_block() -> None:
    scale = BENT.effective_size / BENT.size
    block = RockingFrame(height=scale * BENT.height, width=scale * BENT.width)
    assert BENT.restitution < block.restitution
    assert respond(BENT, still(5.0), initial_rotation=0.05).impact_velocities[1] != pytest.approx(
        respond(block, still(5.0), initial_rotation=0.05).impact_velocities[1], rel=1e-3
    )


# Energy


@any_frame
def test_energy_is_kept_between_impacts_and_lost_by_r_at_them(frame: RockingFrame) -> None:
    response = release(frame, 0.6, 8.0 / frame.effective_frequency_parameter)
    total = energy(frame, response)
    passed = np.searchsorted(response.impact_times, response.time)
    kept = total[0] * frame.restitution ** (2.0 * passed)
    assert response.impacts >= 2
    assert_allclose(total, kept, rtol=1e-12, atol=1e-15 * total[0])


@pytest.mark.parametrize("pull", [0.05, -0.1, 0.08])
def test_constant_ground_acceleration_is_a_tilted_gravity(pull: float) -> None:
    ground = GroundAcceleration.from_samples(np.full(60, pull * GRAVITY), 0.01)
    response = respond(BENT, ground, initial_rotation=0.5 * BENT.slenderness)
    psi = BENT.slenderness - response.theta
    p2 = BENT.effective_frequency_parameter**2
    total = 0.5 * response.omega**2 + p2 * (np.cos(psi) - pull * np.sin(psi))
    assert response.impacts == 0
    assert_allclose(total, total[0], rtol=1e-14)


@pytest.mark.parametrize("held", [(), (0.7, 0.4)])
def test_the_series_of_a_step_satisfies_the_equation_to_its_order(
    held: tuple[()] | tuple[float, float],
) -> None:
    """Theta has the degree 9, so the residual of theta'' is 2^8 times smaller after half the time.

    One wrong coefficient makes that 2^7 at most.
    """
    alpha, p2 = 0.3, 2.0
    none = (0.0, 0.0, 0.0, 0.0)
    a, v = (0.1, -0.6, 0.9, 0.5, -0.7, 0.8, *none), (-0.2, 0.4, -0.8, 0.6, 0.9, -0.5, *none)
    theta = Polynomial(taylor(0.05, 0.6, 1.0, a, v, alpha, p2, MOVING, held))

    def residual(t: float) -> float:
        psi = alpha - theta(t)
        pull = (1.0 + Polynomial(v)(t)) * math.sin(psi) + Polynomial(a)(t) * math.cos(psi)
        if held:
            pull += held[0] * math.sin(theta(t)) + held[1] * math.cos(0.5 * theta(t))
        return float(theta.deriv(2)(t) + p2 * pull)

    assert residual(0.05) / residual(0.025) == pytest.approx(2.0**8, rel=0.1)


def test_each_impact_of_free_rocking_is_slower_by_the_restitution() -> None:
    velocities = release(BENT, 0.8, 30.0).impact_velocities
    assert_allclose(velocities[1:] / velocities[:-1], -BENT.restitution, rtol=1e-12)


@given(
    seed=st.integers(0, 10_000),
    strength=st.floats(1.5, 6.0),
    time_step=st.sampled_from([0.001, 0.01, 0.1]),
    frame=st.sampled_from(ANY),
)
@examples(150)
def test_whatever_the_motion(
    seed: int, strength: float, time_step: float, frame: RockingFrame
) -> None:
    samples = noise(seed, 300, strength * frame.width / frame.height)
    response = respond(frame, GroundAcceleration.from_samples(samples, time_step))
    standing = np.isfinite(response.theta)
    assert np.all(np.abs(response.theta[standing]) <= 0.5 * math.pi)
    assert response.peak_rotation <= 0.5 * math.pi
    assert np.array_equal(standing, np.isfinite(response.omega))
    fallen = response.overturning_time
    assert np.array_equal(standing, ~(response.time > fallen))
    assert (response.verdict is Verdict.OVERTURNS) == (response.peak_rotation == 0.5 * math.pi)
    assert np.all(np.abs(response.theta[standing]) <= response.peak_rotation)
    assert np.all(np.diff(response.impact_times) >= 0.0)


@given(seed=st.integers(0, 10_000), frame=st.sampled_from([BENT, STOCKY, SLENDER, SMALL]))
@examples(60)
def test_the_sense_of_rotation_is_kept_at_impacts(seed: int, frame: RockingFrame) -> None:
    samples = noise(seed, 300, 2.0 * frame.width / frame.height)
    response = respond(frame, GroundAcceleration.from_samples(samples, 0.02))
    before = response.impact_velocities
    at_rest = np.abs(before) * frame.restitution < (
        tails.REST_VELOCITY_RATIO * frame.effective_frequency_parameter
    )
    turned = before[1:] * before[:-1] < 0.0
    assert np.all(turned | at_rest[:-1])  # only a frame that came to rest may start either way


# Free rocking


def quarter_period(frame: RockingFrame, theta_0: float) -> float:
    """Return the exact time from rest at theta_0 to the impact: the integral of 1 / omega."""
    alpha, p_hat = frame.slenderness, frame.effective_frequency_parameter

    def integrand(x: float) -> float:  # theta = theta_0 (1 - x^2) removes the singularity
        half = 0.5 * theta_0 * x * x
        drop = 2.0 * math.sin(alpha - theta_0 + half) * math.sin(half)
        return 2.0 * theta_0 * x / math.sqrt(2.0 * drop)

    return float(quad(integrand, 0.0, 1.0, epsabs=0.0, epsrel=1e-13, limit=200)[0]) / p_hat


@any_frame
@pytest.mark.parametrize("ratio", [0.01, 0.3, 0.7, 0.95, 0.9999])
def test_quarter_period_is_the_exact_integral(frame: RockingFrame, ratio: float) -> None:
    response = release(frame, ratio, 12.0 / frame.effective_frequency_parameter)
    exact = quarter_period(frame, ratio * frame.slenderness)
    assert_allclose(response.impact_times[0], exact, rtol=1e-11)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9, 0.99])
def test_housner_s_quarter_period_of_slender_columns(ratio: float) -> None:
    slim = RockingFrame(height=10.0, width=0.01)
    response = release(slim, ratio, 8.0)
    period = 4.0 * response.impact_times[0] * slim.frequency_parameter
    assert_allclose(period, 4.0 * math.acosh(1.0 / (1.0 - ratio)), rtol=1e-5)


def test_time_runs_backwards_between_impacts() -> None:
    samples = noise(3, 60, 0.1)
    there = respond(
        BENT,
        GroundAcceleration.from_samples(samples, 0.02),
        initial_rotation=0.6 * BENT.slenderness,
        initial_velocity=-0.03,
    )
    back = respond(
        BENT,
        GroundAcceleration.from_samples(samples[::-1], 0.02),
        initial_rotation=float(there.theta[-1]),
        initial_velocity=-float(there.omega[-1]),
    )
    assert there.impacts == back.impacts == 0
    assert_allclose(back.theta[::-1], there.theta, rtol=1e-11)
    assert_allclose(-back.omega[::-1], there.omega, rtol=1e-11)


# Uplift and rest


@pytest.mark.parametrize("frame", [BENT, STOCKY, SLENDER])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_uplift_below_g_tan_alpha(frame: RockingFrame, sign: float) -> None:
    samples = np.full(500, sign * (1.0 - 1e-12) * frame.uplift_acceleration)
    response = respond(frame, GroundAcceleration.from_samples(samples, 0.01))
    assert response.verdict is Verdict.NO_UPLIFT
    assert not response.theta.any()
    assert response.peak_rotation == 0.0
    assert response.impacts == 0
    assert math.isnan(response.uplift_time)


@pytest.mark.parametrize("frame", [BENT, STOCKY, SLENDER])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_uplift_just_above_g_tan_alpha_against_the_ground(frame: RockingFrame, sign: float) -> None:
    samples = np.full(500, sign * (1.0 + 1e-6) * frame.uplift_acceleration)
    response = respond(frame, GroundAcceleration.from_samples(samples, 0.01))
    assert response.uplift_time == 0.0
    assert np.all(sign * response.theta[1:] < 0.0)


@given(peak=st.floats(1.01, 20.0))
def test_a_ramp_uplifts_when_it_passes_g_tan_alpha(peak: float) -> None:
    ground = GroundAcceleration.from_samples([0.0, peak * BENT.uplift_acceleration], 0.7)
    assert_allclose(respond(BENT, ground).uplift_time, 0.7 / peak, rtol=1e-14)


def test_after_uplift_the_rotation_grows_with_the_cube_of_time() -> None:
    ramp = np.linspace(0.0, 2.0, 2001) * BENT.uplift_acceleration
    response = respond(BENT, GroundAcceleration.from_samples(ramp, 0.001))
    tau = response.time[1050] - response.uplift_time
    rate = BENT.uplift_acceleration / GRAVITY  # of the ground acceleration [g/s]
    cube = BENT.effective_frequency_parameter**2 * math.cos(BENT.slenderness) * rate * tau**3 / 6.0
    assert_allclose(response.theta[1050], -cube, rtol=1e-3)


@pytest.mark.parametrize("frame", [STOCKY, BENT])
def test_chatter_ends_in_rest_after_the_impacts_that_the_restitution_allows(
    frame: RockingFrame,
) -> None:
    response = release(frame, 0.5, 60.0)
    slowest = tails.REST_VELOCITY_RATIO * frame.effective_frequency_parameter
    first = abs(response.impact_velocities[0])
    assert response.impacts == math.ceil(math.log(slowest / first) / math.log(frame.restitution))
    assert response.theta[-1] == 0.0
    assert response.omega[-1] == 0.0
    assert response.verdict is Verdict.STANDS


def test_a_frame_at_rest_uplifts_again_as_if_nothing_had_been() -> None:
    samples = np.zeros(9001)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=0.8, time=3.0)
    samples[:601] = pulse.acceleration(0.01 * np.arange(601))
    later = np.zeros_like(samples)
    later[6000:6601] = 1.3 * samples[:601]
    both = respond(BENT, GroundAcceleration.from_samples(samples + later, 0.01))
    alone = respond(BENT, GroundAcceleration.from_samples(later, 0.01))
    assert both.theta[5999] == 0.0
    assert both.impacts > 100 + alone.impacts / 2
    assert np.array_equal(both.theta[6000:], alone.theta[6000:])
