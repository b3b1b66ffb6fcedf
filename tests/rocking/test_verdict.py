"""The form of the ground motion, and the verdict."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels.tails import tail
from rockframe.rocking.response import respond
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .direct import integrate, straight_lines
from .motions import BENT, SLENDER, STOCKY, noise, release, still

# The ground motion


@pytest.mark.parametrize("frame", [BENT, STOCKY, SLENDER])
def test_a_line_cut_in_two_is_the_same_line(frame: RockingFrame) -> None:
    samples = noise(7, 200, 2.0 * frame.width / frame.height)
    finer = np.interp(np.arange(0.0, 199.25, 0.5), np.arange(200.0), samples)
    coarse = respond(frame, GroundAcceleration.from_samples(samples, 0.01))
    fine = respond(frame, GroundAcceleration.from_samples(finer, 0.005))
    standing = np.isfinite(coarse.theta)
    assert_allclose(
        fine.theta[::2][standing], coarse.theta[standing], rtol=0, atol=1e-8 * coarse.peak_rotation
    )


def test_a_record_is_its_samples_joined_by_lines() -> None:
    samples = noise(8, 400, 0.4)
    record = Record(record_id="noise", acceleration=samples, time_step=0.01)
    ground = GroundAcceleration.from_samples(samples, 0.01)
    assert np.array_equal(respond(BENT, record).theta, respond(BENT, ground).theta)


def test_a_delay_delays() -> None:
    samples = noise(9, 400, 0.4)
    now = respond(BENT, GroundAcceleration.from_samples(samples, 0.01))
    late = respond(BENT, GroundAcceleration.from_samples(samples, 0.01, start_time=50.0))
    assert np.array_equal(late.theta, now.theta)
    assert_allclose(late.impact_times, now.impact_times + 50.0, rtol=1e-13)
    assert_allclose(late.peak_time, now.peak_time + 50.0, rtol=1e-13)


def test_sampling_a_pulse_finer_leads_to_the_pulse() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.5)
    exact = respond(BENT, pulse).peak_rotation
    errors = []
    for step in (0.04, 0.02, 0.01):
        times = np.arange(-4.0, 4.0 + step, step)
        ground = GroundAcceleration.from_samples(pulse.acceleration(times), step, -4.0)
        errors.append(abs(respond(BENT, ground).peak_rotation / exact - 1.0))
    assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 4.0, rtol=0.03)


# Verdict


@pytest.mark.parametrize("strength", np.linspace(0.2, 1.2, 21))
def test_the_verdict_at_the_end_is_that_of_a_long_still_tail(strength: float) -> None:
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=strength * GRAVITY, T_p=2.0)
    cut = GroundAcceleration.from_samples(pulse.acceleration(np.arange(-3.0, 1.0, 0.01)), 0.01)
    short = respond(BENT, cut)
    long = respond(BENT, cut, free_rocking=60.0)
    assert short.verdict is long.verdict
    assert_allclose(short.peak_rotation, long.peak_rotation, rtol=1e-12)
    assert_allclose(short.overturning_time, long.overturning_time, rtol=1e-10)
    assert np.array_equal(short.theta, long.theta[: short.theta.size], equal_nan=True)


def test_a_frame_that_passes_alpha_and_comes_back_is_safe() -> None:
    block = RockingFrame(height=4.0, width=4.0 * math.tan(math.radians(14.0)))
    pulse = Pulse(
        wavelet="symmetric_ricker",
        a_p=2.259 * block.uplift_acceleration,
        T_p=math.pi / block.frequency_parameter,
    )
    response = respond(block, pulse)
    assert response.verdict is Verdict.STANDS
    assert 1.0 < response.peak_rotation_ratio < 2.81
    assert math.isnan(response.overturning_time)


@pytest.mark.parametrize("excess", [1e-9, 1e-3])
def test_free_rocking_overturns_beyond_alpha(excess: float) -> None:
    tipped = release(BENT, 1.0 + excess, 0.5)
    assert tipped.verdict is Verdict.OVERTURNS
    assert tipped.peak_rotation == 0.5 * math.pi
    assert release(BENT, 1.0 - excess, 0.5).verdict is Verdict.STANDS


@pytest.mark.parametrize("margin", [1e-9, 1e-3])
def test_a_push_overturns_when_its_energy_passes_the_barrier(margin: float) -> None:
    barrier = 2.0 * BENT.effective_frequency_parameter * math.sin(0.5 * BENT.slenderness)
    falls = respond(BENT, still(0.5), initial_velocity=(1.0 + margin) * barrier)
    stands = respond(BENT, still(0.5), initial_velocity=(1.0 - margin) * barrier)
    assert falls.verdict is Verdict.OVERTURNS
    assert stands.verdict is Verdict.STANDS
    assert stands.peak_rotation < BENT.slenderness


def test_time_of_a_free_fall_is_the_exact_integral() -> None:
    start = 1.2 * BENT.slenderness
    p_hat, alpha = BENT.effective_frequency_parameter, BENT.slenderness

    def integrand(x: float) -> float:  # theta = start + x^2
        half = 0.5 * x * x
        return 2.0 * x / math.sqrt(4.0 * math.sin(start - alpha + half) * math.sin(half))

    exact = float(quad(integrand, 0.0, math.sqrt(0.5 * math.pi - start), epsrel=1e-13)[0]) / p_hat
    assert_allclose(release(BENT, 1.2, 0.5).overturning_time, exact, rtol=1e-12)
    assert_allclose(release(BENT, 1.2, 9.0).overturning_time, exact, rtol=1e-12)


def test_after_overturning_nothing_is_known() -> None:
    response = release(BENT, 1.2, 9.0)
    after = response.time > response.overturning_time
    assert after.any()
    assert np.isnan(response.theta[after]).all()
    assert np.isnan(response.u[after]).all()
    assert np.isfinite(response.theta[~after]).all()


def test_peak_after_the_end_has_no_time() -> None:
    upward = respond(BENT, still(0.1), initial_rotation=0.05, initial_velocity=0.05)
    assert math.isnan(upward.peak_time)
    assert upward.peak_rotation > float(np.abs(upward.theta).max())


def test_peaks_of_u_and_v() -> None:
    response = respond(BENT, Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.5))
    assert_allclose(response.peak_u, np.abs(response.u).max(), rtol=1e-4)
    assert_allclose(response.peak_v, response.v.max(), rtol=1e-4)
    fallen = respond(BENT, Pulse(wavelet="symmetric_ricker", a_p=10.0, T_p=1.5))
    assert_allclose(fallen.peak_v, 2.0 * BENT.size - BENT.height, rtol=1e-12)


def test_the_kernel_takes_a_ground_that_is_constant_in_each_interval() -> None:
    steps = np.array([[0.3], [-0.2], [0.1]])
    slopes = np.column_stack([steps, np.zeros(3)])
    constant = integrate(steps, 0.3, alpha=0.2, restitution=0.9)
    sloped = integrate(slopes, 0.3, alpha=0.2, restitution=0.9)
    assert constant.theta[-1] != 0.0
    assert np.array_equal(constant.theta, sloped.theta)


def test_more_impacts_than_are_kept_are_counted() -> None:
    response = release(SLENDER, 0.5, 800.0)
    assert response.impact_times.size == 4096
    assert response.impacts > 4096
    lines = straight_lines(np.zeros(80001), 0.01)
    alpha, p_hat = SLENDER.slenderness, SLENDER.effective_frequency_parameter
    every = integrate(
        lines,
        0.01,
        alpha=alpha,
        p_hat=p_hat,
        restitution=SLENDER.restitution,
        start=(0.5 * alpha, 0.0),
    )
    assert every.impact_times.size == response.impacts
    assert np.array_equal(every.impact_times[:4096], response.impact_times)


def test_nothing_is_written_behind_the_impacts_that_are_kept() -> None:
    """Compiled code does not check the ends of arrays."""
    memory = np.full((4, 2), np.nan)
    start, alpha = (0.5 * SLENDER.slenderness, 0.0), SLENDER.slenderness
    history = integrate(
        np.zeros((400, 2)), 0.1, alpha=alpha, restitution=0.9, start=start, impacts=memory[:3]
    )
    assert history.impacts > 4
    assert np.isfinite(memory[:3]).all()
    assert np.isnan(memory[3]).all()


def test_reversed_pulse_is_the_mirror() -> None:
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=5.0, T_p=1.5)
    mirrored = respond(BENT, replace(pulse, phase=math.pi))
    assert np.array_equal(mirrored.theta, -respond(BENT, pulse).theta)


def test_the_largest_rate_has_no_direction() -> None:
    """It occurs where the ground acceleration jumps, and brakes the frame before it lands."""
    steps = noise(4, 40, 0.5)[:, None] / GRAVITY
    first, other = (
        integrate(side * steps, 0.1, alpha=0.2, restitution=0.9) for side in (1.0, -1.0)
    )
    assert first.peak_velocity == other.peak_velocity > 1.1 * np.abs(first.impact_velocities).max()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_frame_thrown_back_from_far_out_is_fastest_at_the_start(side: float) -> None:
    """At three times its slenderness it is further below the barrier than where it lands."""
    start = (side * 3.0 * 0.165, -side * 0.5)
    history = integrate(np.zeros((20, 1)), 0.1, alpha=0.165, restitution=0.3, start=start)
    assert history.verdict == Verdict.STANDS
    assert history.peak_velocity == 0.5 > np.abs(history.impact_velocities).max()


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_however_slow_its_landing_strong_ground_sets_a_frame_in_motion(side: float) -> None:
    """The ground pushes it back to where it came from, so it lands twice before it leaves."""
    push = np.full((20, 1), -side * 0.5)
    start = (side * 1e-25, -side * 1e-11)
    history = integrate(push, 0.01, alpha=0.165, restitution=0.93, start=start)
    assert history.impacts == 2
    assert side * history.theta[-1] > 0.0


def test_balanced_to_round_off_a_frame_overturns_at_no_time() -> None:
    """To round-off the frame only balances: it must not overturn soon, nor bounce for ever."""
    alpha, p_hat = BENT.slenderness, BENT.effective_frequency_parameter
    for theta in np.linspace(0.0, 0.999, 400) * alpha:
        rate = 2.0 * p_hat * math.sin(0.5 * (alpha - theta))
        fallen, after, *_ = tail(theta, rate, 1.0, alpha, p_hat, BENT.restitution)
        assert not fallen or math.isnan(after) or after > 15.0 / p_hat
