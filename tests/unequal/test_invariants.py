"""Identities that hold exactly for bents of two unequal columns, over random bents and motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rockframe import (
    GroundAcceleration,
    UnequalBent,
    Verdict,
    bent_positions,
    respond_bent,
    respond_bents,
)
from rockframe.unequal.bent import linkage_of, tables
from rockframe.unequal.kernels import steps
from rockframe.unequal.linkage import moments_along
from rockframe.units import GRAVITY

from .cases import Float, mirrored, random_bent, random_pulse, rough_motion

seeds = pytest.mark.parametrize("seed", range(12))


def potential(bent: UnequalBent, theta: Float) -> Float:
    """Return the mass-weighted height over that at rest, per mass of both columns [m]."""
    at = bent_positions(bent, theta)
    masses = np.array(bent.column_masses or np.multiply(bent.heights, bent.widths))
    masses = masses / masses.sum()
    turned = np.abs(np.stack([theta, at.theta_2]))
    risen = 0.5 * (
        np.array(bent.heights)[:, None] * (np.cos(turned) - 1.0)
        + np.array(bent.widths)[:, None] * np.sin(turned)
    )
    return np.asarray(masses @ risen + bent.mass_ratio * at.v)


@seeds
def test_free_motion_conserves_energy_until_an_impact(seed: int) -> None:
    """A q'^2 / 2 + g V is constant; an impact keeps the stated share of the speed."""
    rng = np.random.default_rng(seed)
    bent = random_bent(rng)
    side = int(rng.integers(2))
    start = (1.0, -1.0)[side] * rng.uniform(0.3, 0.9) * bent.balance_rotations[side]
    still = GroundAcceleration.from_samples(np.zeros(1501), 0.01)
    response = respond_bent(bent, still, initial_rotation=start)
    at = bent_positions(bent, response.theta)
    energy = 0.5 * at.inertia * response.omega**2 + GRAVITY * potential(bent, response.theta)
    first, second = np.searchsorted(response.time, response.impact_times[:2])
    assert first > 5
    assert_allclose(energy[:first], energy[0], rtol=1e-12)
    at_rest = bent_positions(bent, [0.0, -0.0]).inertia
    share = bent.restitutions[side] ** 2 * at_rest[1 - side] / at_rest[side]
    assert_allclose(energy[first:second], share * energy[0], rtol=1e-12)
    kept = response.impact_velocities[1] / response.impact_velocities[0]
    assert_allclose(-kept, bent.restitutions[side], rtol=1e-9)  # between impacts it is conserved


@seeds
def test_a_mirrored_bent_under_a_mirrored_motion_moves_mirrored(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bent = random_bent(rng)
    pulse = random_pulse(rng, bent, rng.uniform(1.5, 3.0))
    response = respond_bent(bent, pulse)
    behind = respond_bent(mirrored(bent), pulse.scaled(-1.0))
    assert behind.verdict is response.verdict
    assert response.impacts > 0
    assert_allclose(behind.theta_2, -response.theta, rtol=0.0, atol=1e-9)
    assert_allclose(behind.psi, -response.psi, rtol=0.0, atol=1e-10)
    assert_allclose(behind.v, response.v, rtol=0.0, atol=1e-8)
    assert_allclose(behind.bent.uplift_accelerations[::-1], bent.uplift_accelerations, rtol=1e-13)


@seeds
def test_size_and_time_scale(seed: int) -> None:
    """A bent of n times the size moves alike under a motion that lasts sqrt(n) times as long."""
    rng = np.random.default_rng(seed)
    bent, size = random_bent(rng), rng.uniform(0.3, 3.0)
    larger = replace(
        bent,
        heights=[size * height for height in bent.heights],
        widths=[size * width for width in bent.widths],
        spacing=size * bent.spacing,
        beam_depth=size * bent.beam_depth,
        beam_offset=size * bent.beam_offset,
    )
    motion = rough_motion(rng).scaled(0.4 * GRAVITY * min(bent.uplift_accelerations))
    samples = motion.acceleration()
    slower = GroundAcceleration.from_samples(samples, 0.01 * np.sqrt(size))
    response, other = respond_bent(bent, motion), respond_bent(larger, slower)
    assert other.verdict is response.verdict
    assert response.impacts > 0
    assert_allclose(other.peaks, response.peaks, rtol=1e-7)
    assert_allclose(other.uplift_time, np.sqrt(size) * response.uplift_time, rtol=1e-10)


@seeds
def test_constant_vertical_acceleration_changes_gravity(seed: int) -> None:
    """Under (1 + c) g and (1 + c) times the motion, time passes sqrt(1 + c) times as fast."""
    rng = np.random.default_rng(seed)
    bent, more = random_bent(rng), rng.uniform(-0.5, 1.0)
    motion = rough_motion(rng).scaled(0.4 * GRAVITY * min(bent.uplift_accelerations))
    step = 0.01 / np.sqrt(1.0 + more)
    samples = motion.acceleration()
    up = GroundAcceleration.from_samples(np.full(samples.size, more * GRAVITY), step)
    lifted = GroundAcceleration.from_samples((1.0 + more) * samples, step).with_vertical(up)
    # both end alike: after the motion gravity is that of still ground, so compare histories
    response, other = respond_bent(bent, motion), respond_bent(bent, lifted)
    assert response.impacts > 0
    assert_allclose(other.theta, response.theta, rtol=0.0, atol=1e-7)
    [fast] = respond_bents([lifted], [bent]).peak_rotation.ravel()
    assert_allclose(fast, other.peak_rotation, rtol=1e-8)


@seeds
def test_polynomials_of_the_kernel_fit_the_linkage(seed: int) -> None:
    """To 1e-13 up to twice the barrier; near a dead centre, far beyond it, to 1e-3."""
    bent = random_bent(np.random.default_rng(seed))
    table = tables(bent)
    course = np.linspace(0.0, 0.5 * np.pi, 2001)
    piece = np.minimum((course / steps.PIECE_WIDTH).astype(int), steps.PIECES - 1)
    x = course - (piece + 0.5) * steps.PIECE_WIDTH
    powers = x[:, None] ** np.arange(steps.DEGREE + 1)
    within = course / table.stretch[..., None]
    exact = np.stack(moments_along(table.courses, within), axis=2) * table.stretch[:, :, None, None]
    sides = table.numbers.reshape(2, -1)
    pieces = sides[:, steps.PIECES_FROM :].reshape(2, steps.PIECES, steps.PIECE_SIZE)
    for k, first in enumerate((steps.PULL, steps.PUSH)):
        fitted = (pieces[:, piece, first : first + steps.DEGREE + 1] * powers).sum(axis=-1)
        error = np.abs(fitted - exact[0, :, k]) / table.frequency[0] ** 2
        for side in range(2):
            near = course < 2.0 * sides[side, steps.BARRIER]
            assert error[side, near].max() < 1e-12
        assert error.max() < 1e-3


@seeds
def test_both_kernels_agree(seed: int) -> None:
    """Under rough motions, with hundreds of impacts, and with and without vertical motion."""
    rng = np.random.default_rng(seed)
    bents = [random_bent(rng) for _ in range(3)]
    motions = []
    for _ in range(2):
        motion = rough_motion(rng).scaled(0.08 * GRAVITY)
        motions += [motion, motion.with_vertical(rough_motion(rng).scaled(0.03 * GRAVITY))]
    motions.append(random_pulse(rng, bents[0], 2.5))
    peaks = respond_bents(motions, bents)
    for i, motion in enumerate(motions):
        for k, bent in enumerate(bents):
            response = respond_bent(bent, motion)
            assert peaks.verdict[i, k, 0] == response.verdict
            assert_allclose(peaks.uplift_time[i, k, 0], response.uplift_time, rtol=1e-12)
            if response.verdict is Verdict.OVERTURNS:
                fallen = peaks.overturning_time[i, k, 0]
                assert_allclose(fallen, response.overturning_time, rtol=0.0, atol=1e-4)
            else:
                ratio = peaks.peak_rotation_ratio[i, k, 0]
                assert_allclose(ratio, response.peak_rotation_ratio, rtol=0.0, atol=1e-6)


def test_a_scenario_has_the_same_bits_beside_others() -> None:
    rng = np.random.default_rng(5)
    bents = [random_bent(rng) for _ in range(7)]
    motions = [rough_motion(rng, 600).scaled(0.1 * GRAVITY) for _ in range(5)]
    every = respond_bents(motions, bents, [0.5, 1.0, 2.0])
    alone = respond_bents(motions[3:4], bents[2:3], [2.0])
    assert_array_equal(alone.peak_rotation[0, 0, 0], every.peak_rotation[3, 2, 2])
    assert_array_equal(alone.overturning_time[0, 0, 0], every.overturning_time[3, 2, 2])
    assert len(np.unique(every.verdict)) == 3


def test_the_model_ends_at_a_dead_centre() -> None:
    """There a column turns back: its rate along the course is zero."""
    bent = UnequalBent(
        heights=(11.15, 7.82), widths=(2.24, 2.57), spacing=7.1, mass_ratio=1.0, beam_depth=1.5
    )
    assert bent.locks == (False, True)
    courses, linkage = tables(bent).courses, linkage_of(bent)
    theta = courses.rotations(courses.ends[..., None])
    gains = linkage.gains(linkage.pose(theta))[:, 0, :, 0]
    assert_allclose(theta[:, 0, 0, 0].max(), 0.5 * np.pi, rtol=1e-14)
    assert gains[:, 0].min() > 0.1
    assert theta[:, 0, 1, 0].max() < 0.5 * np.pi
    assert_allclose(gains[:, 1].min(), 0.0, atol=1e-12)
    falls = respond_bent(bent, GroundAcceleration.from_samples(np.full(400, 5.0), 0.01))
    assert falls.verdict is Verdict.OVERTURNS
    assert_allclose(falls.peaks[1], theta[0, 0, 1, 0], rtol=1e-9)
