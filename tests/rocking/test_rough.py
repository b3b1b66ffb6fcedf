"""Rough ground: dividing the intervals of the same straight lines must not change the response.

The small bounces after an uplift magnify relative errors from one to the next, so a step that is
too long for the ground shows here first.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe import RockingFrame, read_file
from rockframe.rocking import GroundAcceleration, Response, respond
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

BRIDGE = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
COLUMN = RockingFrame(height=2.0, width=0.4)
BRICK = RockingFrame(height=0.1, width=0.03)
STOCKY = RockingFrame(height=2.0, width=1.5)


def noise(seed: int, strength_g: float) -> Float:
    """Return white noise of 400 samples [m s-2]."""
    uniform = np.random.default_rng(seed).uniform(-1.0, 1.0, 400)
    return np.asarray(strength_g * GRAVITY * uniform, dtype=np.float64)


def finer(samples: Float, times: int) -> Float:
    """Return samples of the same straight lines, with each interval divided."""
    positions = np.arange((samples.size - 1) * times + 1) / times
    return np.interp(positions, np.arange(samples.size), samples)


def largest_difference(frame: RockingFrame, samples: Float, step: float, times: int) -> float:
    """Return the largest difference of theta before impact 50, over its peak."""
    plain = respond(frame, GroundAcceleration.from_samples(samples, step))
    fine: Response = respond(
        frame, GroundAcceleration.from_samples(finer(samples, times), step / times)
    )
    assert plain.verdict is fine.verdict
    until = fine.impact_times[49] if fine.impacts > 49 else np.inf
    compared = plain.time < until
    difference = np.abs(plain.theta - fine.theta[::times])[compared]
    return float(np.nanmax(difference)) / fine.peak_rotation


@pytest.mark.parametrize(
    ("frame", "samples", "step"),
    [
        (BRIDGE, np.array([0.0, 20.0 * GRAVITY]), 0.1),
        (BRIDGE, np.array([0.0, 100.0 * GRAVITY]), 0.1),
        (BRICK, noise(11, 0.9), 0.001),
        (BRICK, noise(11, 0.39), 0.01),
        (BRIDGE, noise(11, 1.3 / 6.0), 0.01),
        (STOCKY, noise(2, 3.0), 0.005),
    ],
    ids=["ramp", "steep ramp", "brick", "brick, coarse", "bridge", "stocky"],
)
def test_finer_intervals_change_nothing(frame: RockingFrame, samples: Float, step: float) -> None:
    assert largest_difference(frame, samples, step, 8) < 1e-8


@pytest.mark.parametrize("frame", [BRIDGE, COLUMN], ids=["bridge", "column"])
def test_finer_intervals_change_nothing_in_a_record(
    frame: RockingFrame, bundled_records: Path
) -> None:
    """CI.CLC is on rock; its east component is the roughest of the bundled records."""
    record = read_file(bundled_records / "Ridgecrest2019-CLC.V1")[0]
    top = int(np.abs(record.acceleration).argmax())
    window = record.acceleration[top - 400 : top + 600]
    assert largest_difference(frame, window, record.time_step, 8) < 1e-8


def test_the_last_sample_counts_for_the_step() -> None:
    """The strongest acceleration of a ramp is at its end, where no interval begins."""
    ramp = np.array([0.0, 50.0 * GRAVITY])
    assert largest_difference(BRICK, ramp, 0.05, 4) < 1e-12
