"""Invariants of every oscillator: continuity, energy, times within the motion, and roots."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.conftest import examples

from rockframe import FixedFrame, GroundAcceleration, IsolatedDeck, respond_oscillator
from rockframe.oscillators import kernel
from rockframe.units import GRAVITY

Oscillator = IsolatedDeck | FixedFrame

every_kind = given(
    kind=st.sampled_from(["rubber", "pendulum", "fixed"]),
    motion=st.sampled_from(["lines", "record", "pulse"]),
    seed=st.integers(0, 10**6),
)
few = examples(60)


def model_of(kind: str, seed: int) -> Oscillator:
    rng = np.random.default_rng([seed, 1])
    strength = rng.uniform(0.02, 0.3)
    if kind == "rubber":
        return IsolatedDeck.lead_rubber(strength_ratio=strength, period=rng.uniform(1.5, 4.0))
    if kind == "pendulum":
        return IsolatedDeck.friction_pendulum(radius=rng.uniform(1.0, 4.0), friction=strength)
    return FixedFrame(period=rng.uniform(0.2, 1.5), strength_ratio=strength, damping_ratio=0.0)


def ground_of(motion: str, seed: int) -> GroundAcceleration:
    """Return a motion of constants in its intervals, of up to 0.8 g."""
    rng = np.random.default_rng([seed, 2])
    step, count = 0.01, 400
    if motion == "pulse":
        phase = np.linspace(-4.0, 4.0, count)
        shape = (1.0 - phase**2) * np.exp(-0.5 * phase**2)
    elif motion == "record":
        shape = np.convolve(rng.normal(size=count), np.hanning(rng.integers(3, 60)), "same")
        shape /= np.abs(shape).max()
    else:
        step, count = rng.uniform(0.02, 0.3), 80
        shape = rng.uniform(-1.0, 1.0, count)
    return GroundAcceleration(rng.uniform(0.1, 0.8) * GRAVITY * shape[:, None], step)


@every_kind
@few
def test_displacement_is_continuous_and_within_its_peak(kind: str, motion: str, seed: int) -> None:
    """Displacement changes by the velocity, the velocity by ground and spring."""
    ground = ground_of(motion, seed)
    response = respond_oscillator(model_of(kind, seed), ground)
    step, rate = ground.time_step, np.abs(response.velocity)
    pull = np.abs(ground.coefficients).max() + GRAVITY * response.peak_force_ratio
    assert np.all(np.abs(np.diff(response.velocity)) <= pull * step * (1.0 + 1e-12))
    assert np.all(np.abs(np.diff(response.u)) <= (rate[1:] + pull * step) * step)
    assert np.abs(response.u).max() <= response.peak_displacement * (1.0 + 1e-12)
    yields_in_motion = response.first_yield_time <= response.time[-1]
    assert (
        math.isnan(response.first_yield_time)
        or response.first_yield_time > 0.0
        or kind == "pendulum"
    )
    assert (response.yields > 0) == (response.dissipated_energy > 0.0)
    assert yields_in_motion or np.abs(response.force_ratio).max() <= response.peak_force_ratio


@every_kind
@few
def test_energy_is_lost_only_in_yielding(kind: str, motion: str, seed: int) -> None:
    """The work of a constant ground acceleration in an interval is -a (u_2 - u_1)."""
    ground = ground_of(motion, seed)
    model = model_of(kind, seed)
    response = respond_oscillator(model, ground)
    k, k_z, _, _ = model.constants
    spring = 0.5 * k * response.u**2
    if math.isfinite(k_z):
        spring += 0.5 * (GRAVITY * response.force_ratio - k * response.u) ** 2 / k_z
    stored = spring + 0.5 * response.velocity**2
    lost = -ground.coefficients[:, 0] * np.diff(response.u) - np.diff(stored)
    left = GRAVITY * response.dissipated_energy - lost.sum()
    round_off = 1e-11 * (1e-6 + stored.max() + np.abs(lost).sum())
    assert np.all(lost > -round_off)
    assert -100.0 * round_off < left < stored[-1] + 100.0 * round_off


@pytest.mark.parametrize("low", [1e-17, 0.5, 1.0])
def test_a_level_reached_before_the_bracket_is_reached_at_its_start(low: float) -> None:
    """Round-off may place the level just before the bracket, but an event is never before it."""
    work = np.zeros((3, 48))
    work[0, :2] = low, 1.0  # rises from `low` at 0 to the value at 1, both above the level
    assert kernel._root(work, 0, 1, 0.0, 0.0, 1.0, low, low + 1.0) == 0.0  # noqa: SLF001
