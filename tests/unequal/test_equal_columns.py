"""A bent of equal columns is the paper's frame of two columns, in everything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.conftest import share_of

from rockframe import (
    Ensemble,
    GroundAcceleration,
    Pulse,
    RockingFrame,
    UnequalBent,
    Verdict,
    bent_ensemble,
    bent_forces,
    bent_positions,
    column_forces,
    respond,
    respond_bent,
    respond_bents,
    respond_many,
    respond_scenarios,
)
from rockframe.rocking.margins.ensemble import ensemble_responses
from rockframe.unequal.bent import tables
from rockframe.unequal.kernels import kernel
from rockframe.unequal.scenarios import outcomes, outcomes_of, rotations
from rockframe.units import GRAVITY

from .cases import rough_motion

FRAME = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
BENT = UnequalBent(
    heights=(9.6, 9.6), widths=(1.6, 1.6), spacing=12.0, mass_ratio=4.0, beam_depth=2.0
)
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.54 * 9.81, T_p=1.5)


def test_geometry() -> None:
    theta = np.linspace(-1.2, 1.2, 9)
    at = bent_positions(BENT, theta)
    assert_allclose(at.theta_2, theta, atol=1e-15)
    assert_allclose(at.psi, 0.0, atol=1e-15)
    assert_allclose(at.u, FRAME.horizontal_displacement(theta), atol=1e-14)
    assert_allclose(at.v, FRAME.vertical_displacement(theta), atol=1e-14)
    assert_allclose(BENT.restitutions, FRAME.restitution, rtol=1e-14)
    assert_allclose(BENT.balance_rotations, FRAME.slenderness, rtol=1e-13)
    assert_allclose(BENT.uplift_accelerations, 1.6 / 9.6, rtol=1e-14)
    assert_allclose(tables(BENT).frequency, FRAME.effective_frequency_parameter, rtol=1e-14)
    assert BENT.equal_bent.height == 9.6


@pytest.mark.parametrize(
    "start",
    [(0.0, 0.0), (0.05, 0.0), (-0.05, 0.03), (0.0, -0.1), (0.1, 0.2)],
)
def test_histories(start: tuple[float, float]) -> None:
    rotation, velocity = start
    own = respond_bent(BENT, PULSE, initial_rotation=rotation, initial_velocity=velocity)
    other = respond(FRAME, PULSE, initial_rotation=rotation, initial_velocity=velocity)
    assert own.verdict is other.verdict
    assert own.impacts == other.impacts
    for name in ("theta", "omega", "impact_times", "impact_velocities", "peak_time", "u", "v"):
        assert_allclose(getattr(own, name), getattr(other, name), rtol=0.0, atol=1e-12)
    assert_allclose(own.peak_rotation_ratio, other.peak_rotation_ratio, rtol=1e-12)
    assert_allclose(own.theta_2, own.theta, rtol=0.0, atol=1e-14)


def test_forces_of_each_column() -> None:
    own = bent_forces(respond_bent(BENT, PULSE), PULSE)
    frame = column_forces(respond(FRAME, PULSE), PULSE, spacing=12.0, beam_centre=1.0)
    for name in ("base_shear", "base_vertical", "top_shear", "top_vertical"):
        assert_allclose(getattr(own, name), getattr(frame, name), rtol=0.0, atol=1e-12)


def test_ensembles() -> None:
    spreads = Ensemble(corner=1.0)
    own = bent_ensemble(BENT, PULSE, spreads)
    [[frames]] = ensemble_responses([PULSE], [FRAME], spreads)
    assert (own.overturned, own.uplifted) == (frames.overturned, frames.uplifted)
    assert own.overturned > 0
    for name in ("peak_rotation_ratio", "peak_u", "peak_v"):
        assert_allclose(own.bands[name], frames.bands[name], rtol=1e-10)
    for name, value in own.rank_correlations.items():
        assert_allclose(value, frames.rank_correlations[name], rtol=1e-12)


@pytest.mark.parametrize("vertical", [False, True])
def test_random_cases(vertical: bool) -> None:
    """The linkage's kernel has the verdicts of the frame in all cases. Its peaks agree to 1e-9,
    except in about two of 10,000 cases with many impacts, where the two kernels of the frame itself
    differ by a share of that, too. Results are those of the frame's kernel, to the last bit.
    """
    rng = np.random.default_rng(49)
    count, motions = share_of(1000), []
    for _ in range(20):
        motion = rough_motion(rng, 2000).scaled(0.08 * GRAVITY)
        if vertical:
            motion = motion.with_vertical(rough_motion(rng, 2000).scaled(0.04 * GRAVITY))
        motions.append(motion)
    frames, bents = [], []
    for _ in range(count):
        height = rng.uniform(4.0, 12.0)
        width, ratio = height * rng.uniform(0.1, 0.3), float(rng.choice([0.0, 0.5, 1.0, 4.0]))
        frames.append(RockingFrame(height=height, width=width, mass_ratio=ratio))
        spacing = width + rng.uniform(1.0, 12.0)
        bents.append(
            UnequalBent(
                heights=(height, height), widths=(width, width), spacing=spacing, mass_ratio=ratio
            )
        )
    which, every = rng.integers(len(motions), size=count), np.arange(count)
    scales = rng.uniform(0.5, 1.6, count) * [frame.width / frame.height / 0.2 for frame in frames]
    frame = respond_scenarios(motions, frames, which, every, scales)
    table = [tables(bent) for bent in bents]
    verdicts, summaries = outcomes(motions, table, which, every, scales)
    assert np.bincount(frame.verdict, minlength=3)[1:].min() > count / 10
    np.testing.assert_array_equal(verdicts, frame.verdict)
    peaks = np.array(
        [
            rotations(numbers, summary[None, None, :2]).max()
            for numbers, summary in zip(table, summaries, strict=True)
        ]
    )
    standing = frame.verdict != Verdict.OVERTURNS
    apart = np.abs(peaks - frame.peak_rotation)[standing]
    assert np.mean(apart < 1e-9) > 0.99
    assert np.median(apart) < 1e-14
    for k in np.flatnonzero(standing)[apart >= 1e-9].tolist():
        motion = motions[which[k]].scaled(scales[k])
        scalar = respond(frames[k], motion).peak_rotation
        assert abs(peaks[k] - frame.peak_rotation[k]) < 1e3 * abs(scalar - frame.peak_rotation[k])
    np.testing.assert_allclose(summaries[:, 3], frame.uplift_time, rtol=1e-12)
    own = outcomes_of(motions, bents, which, every, scales)
    np.testing.assert_array_equal(own["verdict"], frame.verdict)
    np.testing.assert_array_equal(own["peak"], frame.peak_rotation)
    for name in ("uplift_time", "overturning_time"):
        np.testing.assert_array_equal(own[name], getattr(frame, name))


def test_continuous_pulses() -> None:
    """Their ground has six coefficients, with and without a vertical component."""
    rng = np.random.default_rng(7)
    pulse = GroundAcceleration.from_pulse(PULSE)
    upwards = GroundAcceleration.from_pulse(Pulse(wavelet="antisymmetric_ricker", a_p=2.0, T_p=1.5))
    scales = rng.uniform(0.4, 2.0, 40)
    motions, count = [pulse, pulse.with_vertical(upwards)], np.arange(2).repeat(scales.size)
    scale = np.tile(scales, 2)
    verdicts, summaries = outcomes(motions, [tables(BENT)], count, 0 * count, scale)
    frame = respond_scenarios(motions, [FRAME], count, 0 * count, scale)
    np.testing.assert_array_equal(verdicts, frame.verdict)
    assert len(np.unique(frame.verdict)) > 1
    standing = frame.verdict != Verdict.OVERTURNS
    peaks = rotations(tables(BENT), summaries[None, :, :2])[0].max(axis=-1)
    assert_allclose(peaks[standing], frame.peak_rotation[standing], rtol=1e-9)
    assert_allclose(summaries[:, kernel.OVERTURNING_TIME], frame.overturning_time, rtol=1e-8)


def test_bents_beside_each_other_keep_their_own_outcomes() -> None:
    """Equal columns are computed as frames, whatever stands beside them and where their beam is."""
    aside = replace(BENT, column_masses=(3e4, 5e4), beam_offset=2.0)
    slope = replace(BENT, heights=(10.0, 9.2))
    assert [bent.has_equal_columns for bent in (BENT, aside, slope)] == [True, True, False]
    assert not replace(BENT, widths=(1.6, 1.7)).has_equal_columns
    scales = [0.2, 0.8, 3.0]
    together = respond_bents([PULSE], [slope, aside, BENT], scales)
    frame = respond_many([PULSE], [FRAME], scales)
    for k in (1, 2):
        np.testing.assert_array_equal(together.verdict[0, k], frame.verdict[0, 0])
        np.testing.assert_array_equal(together.peak_rotation[0, k], frame.peak_rotation[0, 0])
    alone = respond_bents([PULSE], [slope], scales)
    np.testing.assert_array_equal(together.peak_rotation[:, :1], alone.peak_rotation)
    assert (alone.peak_rotation[0, 0] != frame.peak_rotation[0, 0])[1:].all()
    assert_allclose(bent_positions(aside, 0.1).psi, 0.0, atol=1e-15)
    assert_allclose(aside.restitutions, FRAME.restitution, rtol=1e-14)
