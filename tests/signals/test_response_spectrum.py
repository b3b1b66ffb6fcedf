"""Spectral acceleration: a closed form, an independent solver, limits of long and short periods."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from rockframe.errors import ParameterError
from rockframe.signals.measures import (
    housner_intensity,
    oscillator_peak,
    oscillator_response,
    spectral_acceleration,
)
from rockframe.signals.processing import peak

STEP = 0.02
NOISE = np.random.default_rng(1).normal(size=300) * np.hanning(300)


@pytest.mark.parametrize("damping", [0.02, 0.05, 0.3])
def test_sudden_acceleration_has_a_closed_form(damping: float) -> None:
    """A step a gives omega^2 max x = a (1 + exp(-pi zeta / sqrt(1 - zeta^2)))."""
    spectrum = spectral_acceleration(np.full(4000, 2.0), 0.001, [0.3, 1.0], damping=damping)
    over = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert_allclose(spectrum, 2.0 * (1.0 + over), rtol=5e-5)


@pytest.mark.parametrize("period", [0.1, 0.7, 3.0])
def test_an_independent_solver_agrees(period: float) -> None:
    omega = 2.0 * math.pi / period
    at = STEP * np.arange(NOISE.size)

    def rates(time: float, state: np.ndarray) -> list[float]:
        push = np.interp(time, at, NOISE, right=0.0)
        return [state[1], -push - 0.1 * omega * state[1] - omega**2 * state[0]]

    end = at[-1] + period
    times = np.linspace(0.0, end, 9999)
    close = {"max_step": STEP / 2, "rtol": 1e-9, "atol": 1e-13}
    solved = solve_ivp(rates, (0.0, end), [0.0, 0.0], t_eval=times, **close)
    expected = omega**2 * np.abs(solved.y[0]).max()
    assert_allclose(spectral_acceleration(NOISE, STEP, [period]), expected, rtol=5e-5)


def of_lsim(ground: list[float], time_step: float, period: float) -> float:
    """Return the pseudo-acceleration, 5 % damped, by the solver of SciPy in 400 steps a sample.

    Two calls: for the record, from rest, and for the period after it, from the last state.
    """
    omega = 2.0 * math.pi / period
    system = [[0.0, 1.0], [-(omega**2), -0.1 * omega]], [[0.0], [-1.0]], [[1.0, 0.0]], [[0.0]]
    at = np.linspace(0.0, len(ground) - 1.0, 400 * (len(ground) - 1) + 1)
    during, state = lsim(system, np.interp(at, range(len(ground)), ground), time_step * at)[1:]
    free = np.linspace(0.0, period, 1001)
    after = lsim(system, np.zeros(free.size), free, X0=state[-1])[1]
    return float(omega**2 * max(np.abs(during).max(), np.abs(after).max()))


@pytest.mark.parametrize("ground", [[0.0, 1.0], [1.0, 0.0], [1.0, 1.0], [0.5, -2.0, 3.0]])
@pytest.mark.parametrize("period", [0.05, 1.0])
def test_a_record_lasts_from_its_first_sample_to_its_last(
    ground: list[float], period: float
) -> None:
    """It may begin and end with any ground acceleration, as a piece of a longer record does."""
    spectrum = spectral_acceleration(ground, STEP, [period])
    assert_allclose(spectrum, of_lsim(ground, STEP, period), rtol=5e-5)


def test_the_peak_between_steps_is_found_to_five_in_100000() -> None:
    """The ground is straight between samples, so 16 times as many describe the same motion."""
    periods = np.geomspace(STEP, 2.0, 40)
    samples, finer = np.arange(NOISE.size), np.arange(16 * (NOISE.size - 1) + 1) / 16
    for seed in (5, 7):
        noise = np.random.default_rng(seed).normal(size=NOISE.size) * np.hanning(NOISE.size)
        spectrum = spectral_acceleration(noise, STEP, periods)
        same = spectral_acceleration(np.interp(finer, samples, noise), STEP / 16, periods)
        assert_allclose(spectrum, same, rtol=5e-5)


def test_a_spectrum_does_not_depend_on_the_other_periods_of_the_request() -> None:
    """Oscillators with equal steps are computed together, 16 at a time."""
    periods = np.geomspace(0.2 * STEP, 20.0, 53)
    together = spectral_acceleration(NOISE, STEP, periods)
    alone = [spectral_acceleration(NOISE, STEP, [period])[0] for period in periods.tolist()]
    assert_array_equal(together, alone)
    assert_array_equal(spectral_acceleration(NOISE, STEP, periods[::-1]), together[::-1])


def test_a_spectrum_is_the_peak_of_each_response() -> None:
    periods = np.geomspace(0.2 * STEP, 20.0, 33)
    responses = [oscillator_response(NOISE, STEP, period) for period in periods.tolist()]
    expected = [oscillator_peak(response) for response in responses]
    assert_allclose(spectral_acceleration(NOISE, STEP, periods), expected, rtol=1e-12)


def test_whole_numbers_are_the_same_periods_as_decimal_ones() -> None:
    """A table of factors by whole numbers has other exponents in other programs."""
    whole = spectral_acceleration(NOISE, STEP, [1, 2])
    assert_array_equal(whole, spectral_acceleration(NOISE, STEP, [1.0, 2.0]))
    assert_array_equal(
        spectral_acceleration(np.array([0, 3, 0, -3, 0]), 1, [1]),
        spectral_acceleration(np.array([0.0, 3.0, 0.0, -3.0, 0.0]), 1.0, [1.0]),
    )


def test_stiff_oscillators_move_with_the_ground() -> None:
    assert_allclose(spectral_acceleration(NOISE, STEP, [1e-4]), peak(NOISE), rtol=1e-3)


def test_the_peak_after_the_end_counts() -> None:
    """An oscillator of 4 s peaks after a jolt: its peak is omega times the velocity gained."""
    jolt = np.array([0.0, 1.0, 0.0])
    spectrum = spectral_acceleration(jolt, 0.01, [4.0], damping=1e-9)
    assert_allclose(spectrum, 2.0 * math.pi / 4.0 * 0.01, rtol=1e-3)


def test_nothing_comes_in_again_at_the_beginning() -> None:
    """A pulse has one spectrum, whether rest precedes it, follows it, or neither.

    Where a spectrum is computed by FFT without padding, the vibration after the end is added at
    the beginning: 3.7 times the acceleration at 1 s, and a fifth at 5 s.
    """
    pulse, periods = np.sin(2.0 * np.pi * 0.01 * np.arange(101)), [0.5, 1.0, 2.0, 5.0, 10.0]
    alone = spectral_acceleration(pulse, 0.01, periods)
    for before, after in ((2900, 0), (0, 4000)):
        within = np.concatenate([np.zeros(before), pulse, np.zeros(after)])
        assert_allclose(spectral_acceleration(within, 0.01, periods), alone, rtol=5e-5)


def test_soft_oscillators_keep_the_velocity_that_they_gained() -> None:
    """So the pseudo-acceleration falls as 1 / T, where the relative one is that of the ground."""
    hundred, thousand = spectral_acceleration(NOISE, STEP, [100.0, 1000.0])
    assert hundred < 0.02 * peak(NOISE)
    assert thousand == pytest.approx(0.1 * hundred, rel=0.01)


@pytest.mark.parametrize(("periods", "damping"), [([0.0], 0.05), ([math.inf], 0.05), ([1.0], 1.0)])
def test_impossible_oscillators_are_refused(periods: list[float], damping: float) -> None:
    with pytest.raises(ParameterError, match="Must be above 0"):
        spectral_acceleration(NOISE, STEP, periods, damping=damping)


def test_housner_intensity_of_a_sudden_acceleration_has_a_closed_form() -> None:
    """PSV = a (1 + exp(-pi zeta / sqrt(1 - zeta^2))) T / 2 pi, whose integral is quadratic in T."""
    intensity = housner_intensity(np.full(3000, 2.0), 0.002)
    over = math.exp(-math.pi * 0.05 / math.sqrt(1.0 - 0.05**2))
    expected = 2.0 * (1.0 + over) * (2.5**2 - 0.1**2) / (4.0 * math.pi)
    assert intensity == pytest.approx(expected, rel=5e-5)


def test_housner_intensity_is_the_integral_of_the_spectrum_at_twice_as_many_periods() -> None:
    periods = np.linspace(0.1, 2.5, 241)
    velocity = spectral_acceleration(NOISE, STEP, periods) * periods / (2.0 * math.pi)
    expected = 3.0 * np.trapezoid(velocity, periods)
    assert housner_intensity(-3.0 * NOISE, STEP) == pytest.approx(expected, rel=1e-3)


def test_housner_intensity_of_a_record_that_ends_suddenly() -> None:
    """The documented example; the expected number is the integral of SciPy's spectrum."""
    ground, periods = [0.0, *[1.0] * 9], np.linspace(0.1, 2.5, 61)
    largest = np.array([of_lsim(ground, 0.1, period) for period in periods.tolist()])
    expected = np.trapezoid(largest * periods / (2.0 * math.pi), periods)
    assert housner_intensity(ground, 0.1) == pytest.approx(expected, rel=1e-3)
