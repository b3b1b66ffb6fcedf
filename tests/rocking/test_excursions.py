"""Excursions: their distances from the separatrix of the linear theory, and their selection."""

from __future__ import annotations

import math

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking import GroundAcceleration, Scenarios, Verdict, respond, respond_scenarios
from rockframe.rocking.kernels.tails import LEAST_DISTANCE, match_excursions
from rockframe.rocking.response import as_ground
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .motions import BENT, SLENDER, noise

Float = NDArray[np.float64]


def responses(
    ground: GroundAcceleration, frame: RockingFrame, scales: list[float], kept: int
) -> Scenarios:
    which = np.zeros(len(scales), dtype=int)
    return respond_scenarios([ground], [frame], which, which, scales, excursions=kept)


def test_a_push_that_begins_at_once() -> None:
    """Housner: a rectangular pulse of A alpha g and length T overturns if A (1 - exp(-p T)) > 1."""
    frame = RockingFrame(height=4.0, width=4e-3)
    p, duration, strength = frame.frequency_parameter, 1.0, 1.7
    push = strength * frame.slenderness * GRAVITY
    ground = GroundAcceleration(np.array([[push]] * 100 + [[0.0]] * 20), 0.01)
    distance = strength * (1.0 - math.exp(-p * duration)) - 1.0
    start, side, farthest = responses(ground, frame, [1.0], 4).excursions[0, 0]
    assert (start, side) == (0.0, -1.0)
    assert_allclose(farthest, distance, rtol=1e-12)


def test_a_slender_frame_overturns_in_the_excursion_that_begins_above_zero() -> None:
    """At a slenderness of 0.001 the error of the linear theory is also about 0.001."""
    frame = RockingFrame(height=4.0, width=4e-3)
    period = math.tau / (3.0 * frame.frequency_parameter)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=frame.uplift_acceleration, T_p=period)
    scenarios = responses(as_ground(pulse), frame, np.linspace(1.5, 5.0, 400).tolist(), 16)
    starts = np.where(
        np.isfinite(scenarios.excursions[:, :, 2]), scenarios.excursions[:, :, 0], -np.inf
    )
    last = scenarios.excursions[np.arange(400), starts.argmax(axis=1), 2]
    clear = np.abs(last) > 1e-3
    assert clear.sum() > 390
    fallen = scenarios.verdict[clear] == Verdict.OVERTURNS
    assert 100 < fallen.sum() < 300
    assert_array_equal(fallen, last[clear] > 0.0)


def test_the_highest_are_kept() -> None:
    """Distances agree with impacts of the scalar kernel and with an integral over fine steps."""
    ground = GroundAcceleration.from_samples(noise(5, 500, 0.6), 0.02)
    response = respond(SLENDER, ground)
    p = SLENDER.effective_frequency_parameter
    time = np.linspace(0.0, ground.time[-1], 200_001)
    pull = np.interp(time, ground.time, ground.acceleration()) / GRAVITY * np.exp(-p * time)
    parts = p * 0.5 * (pull[1:] + pull[:-1]) * np.diff(time)
    ahead = np.append(np.cumsum(parts[::-1])[::-1], 0.0)
    impacts, before = response.impact_times, response.impact_velocities
    still = np.interp(impacts, time, ahead) * np.exp(p * impacts)
    after = SLENDER.restitution * np.abs(before)
    distance = (after / p - np.sign(before) * still) / SLENDER.slenderness - 1.0
    kept = responses(ground, SLENDER, [1.0], 5).excursions[0]
    high = np.flatnonzero(distance > max(kept[-1, 2], LEAST_DISTANCE) + 0.01)
    assert high.size >= 2
    for place in high:
        nearest = np.abs(kept[:, 0] - impacts[place]).argmin()
        assert_allclose(kept[nearest, 0], impacts[place], rtol=0, atol=1e-6)
        assert_allclose(kept[nearest, 2], distance[place], rtol=0, atol=1e-4)


def test_an_excursion_has_its_counterpart_in_the_neighbour() -> None:
    """On the same side, at nearly the same time and distance; the others are alone."""
    none = (math.nan, 1.0, -math.inf)
    responses = np.array(
        [
            [(1.00, 1.0, 0.50), (2.00, -1.0, 0.30), none],
            [(1.01, 1.0, 0.52), (3.00, 1.0, 0.40), (2.00, 1.0, 0.30)],
            [(3.01, 1.0, 0.55), (1.00, -1.0, 0.50), none],
        ]
    )
    alone, paired = np.empty((2, 2))
    match_excursions(responses, 0.1, 0.2, alone, paired)
    assert_allclose(alone, [0.40, 0.52])
    assert_allclose(paired, [0.52 + 0.02, 0.55 + 0.15])


def test_intervals_of_a_curved_ground_do_not_matter() -> None:
    """Between nodes the integral has the correct curvature, also with vertical acceleration."""
    across, upwards = (
        Pulse(wavelet=name, a_p=strength * GRAVITY, T_p=1.0)
        for name, strength in (("symmetric_ricker", 0.4), ("antisymmetric_ricker", 0.1))
    )

    def kept(intervals: int) -> Float:
        first, other = (
            GroundAcceleration.from_function(
                pulse.acceleration, -3.0, 3.0, intervals=intervals, degree=5
            )
            for pulse in (across, upwards)
        )
        return responses(first.with_vertical(other), SLENDER, [0.5, 0.8, 1.0], 3).excursions

    coarse, fine = kept(200), kept(1600)
    high = coarse[:, :, 2] > LEAST_DISTANCE + 0.01
    assert high.sum() >= 3
    assert_allclose(coarse[high], fine[high], rtol=0, atol=1e-5)


def test_to_keep_them_changes_no_bits() -> None:
    ground = GroundAcceleration.from_samples(noise(7, 600, 0.9), 0.01)
    scales = np.linspace(0.2, 2.0, 64).tolist()
    first, other = (responses(ground, BENT, scales, kept) for kept in (0, 12))
    assert first.excursions.shape == (64, 0, 3)
    assert_array_equal(first.verdict, other.verdict)
    for name in ("peak_rotation", "peak_velocity", "uplift_time", "overturning_time", "impacts"):
        assert_array_equal(getattr(first, name), getattr(other, name))


def test_the_same_whatever_is_beside() -> None:
    ground = GroundAcceleration.from_samples(noise(7, 600, 0.9), 0.01)
    scales = np.linspace(0.2, 2.0, 64).tolist()
    every = responses(ground, SLENDER, scales, 12).excursions
    some = responses(ground, SLENDER, scales[::-3], 12).excursions
    assert np.isfinite(every[:, 0, 2]).sum() > 20
    assert_array_equal(some, every[::-3])
