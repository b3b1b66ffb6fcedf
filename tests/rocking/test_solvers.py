"""The kernel compared with a solver that shares no code, on real and on difficult motions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import respond
from rockframe.units import GRAVITY

from .direct import Outcome, integrate, straight_lines
from .reference import Solution, solve

Float = NDArray[np.float64]

FRAMES = {
    "bent": RockingFrame(height=9.6, width=1.6, mass_ratio=4.0),
    "stocky": RockingFrame(height=2.0, width=1.5),
    "nearly plastic": RockingFrame(height=1.0, width=1.35),
    "slender": RockingFrame(height=20.0, width=0.6, mass_ratio=1.0),
    "small": RockingFrame(height=0.1, width=0.03),
}
#: Histories are compared up to this impact, because each bounce magnifies last-bit differences.
MOST_IMPACTS = 50


@dataclass(frozen=True)
class Comparison:
    """Responses of kernel and reference solver, until impact MOST_IMPACTS or overturning."""

    kernel: Outcome
    reference: Solution

    @property
    def error(self) -> float:
        """Largest difference in theta over the largest theta."""
        standing = np.isfinite(self.reference.theta)
        difference = np.abs(self.kernel.theta - self.reference.theta)[standing]
        return float(difference.max() / np.abs(self.reference.theta[standing]).max())

    @property
    def impact_time_error(self) -> float:
        count = min(MOST_IMPACTS, self.kernel.impacts, len(self.reference.impact_times))
        difference = self.kernel.impact_times[:count] - self.reference.impact_times[:count]
        return float(np.abs(difference).max(initial=0.0))


def compare(
    frame: RockingFrame,
    coefficients: ArrayLike,
    time_step: float,
    start: tuple[float, float] = (0.0, 0.0),
) -> Comparison:
    ours = integrate(
        coefficients,
        time_step,
        alpha=frame.slenderness,
        p_hat=frame.effective_frequency_parameter,
        restitution=frame.restitution,
        start=start,
    )
    theirs = solve(
        coefficients,
        time_step,
        alpha=frame.slenderness,
        p_hat=frame.effective_frequency_parameter,
        restitution=frame.restitution,
        start=start,
        most_impacts=MOST_IMPACTS,
    )
    return Comparison(ours, theirs)


def last_bit_effect(frame: RockingFrame, samples: Float, time_step: float) -> float:
    """Return the largest relative change of theta when each sample [g] changes by its last bit.

    No solver in double precision can be more accurate.
    """

    def theta(ground: Float) -> Float:
        outcome = integrate(
            straight_lines(ground, time_step),
            time_step,
            alpha=frame.slenderness,
            p_hat=frame.effective_frequency_parameter,
            restitution=frame.restitution,
        )
        late = outcome.impacts > MOST_IMPACTS
        end = int(outcome.impact_times[MOST_IMPACTS] / time_step) if late else None
        return outcome.theta[:end]

    exact = theta(samples)
    ways = [np.random.default_rng(seed).choice([-1.0, 1.0], samples.size) for seed in range(8)]
    moved = [theta(np.nextafter(samples, samples + way)) for way in ways]
    return float(max(np.nanmax(np.abs(other - exact)) for other in moved) / np.nanmax(abs(exact)))


def noise(seed: int, samples: int, strength: float) -> Float:
    """Return white noise [g]."""
    return strength * np.random.default_rng(seed).uniform(-1.0, 1.0, samples)


def uncorrected_channel(path: Path, channel: int) -> Float:
    """Return samples [g] of a channel of a CSMIP V1 file: 8f9.6 after the line that counts them."""
    lines = path.read_text(encoding="ascii").splitlines()
    heads = [i for i, line in enumerate(lines) if "Accelerogram points" in line]
    head = heads[channel]
    count = int(lines[head].split()[0])
    rows = "".join(
        line.ljust(72)[:72] for line in lines[head + 1 : head + 1 + math.ceil(count / 8)]
    )
    return np.array([float(rows[9 * i : 9 * i + 9]) for i in range(count)])


@pytest.mark.parametrize("channel", [0, 1])
@pytest.mark.parametrize("station", ["CCC", "CLC", "TOW2"])
@pytest.mark.parametrize("name", ["bent", "slender"])
def test_real_record(bundled_records: Path, station: str, channel: int, name: str) -> None:
    samples = uncorrected_channel(bundled_records / f"Ridgecrest2019-{station}.V1", channel)
    peak = int(np.argmax(np.abs(samples)))
    lines = straight_lines(samples[max(0, peak - 200) : peak + 300], 0.01)
    differences = compare(FRAMES[name], lines, 0.01)
    assert differences.reference.impact_times
    assert differences.error <= 1e-8
    assert differences.impact_time_error <= 1e-8


@pytest.mark.parametrize("name", list(FRAMES))
@pytest.mark.parametrize("strength", [1.3, 3.0])
@pytest.mark.parametrize("step", [1e-4, 1e-3])
def test_white_noise_in_small_steps(name: str, strength: float, step: float) -> None:
    frame = FRAMES[name]
    samples = noise(11, 200, strength * math.tan(frame.slenderness))
    time_step = step / frame.effective_frequency_parameter
    differences = compare(frame, straight_lines(samples, time_step), time_step)
    assert differences.error <= max(1e-8, 4.0 * last_bit_effect(frame, samples, time_step))
    assert differences.impact_time_error <= 1e-8


@pytest.mark.parametrize("name", list(FRAMES))
@pytest.mark.parametrize("strength", [1.3, 3.0])
def test_white_noise_in_large_steps(name: str, strength: float) -> None:
    samples = noise(11, 100, strength * math.tan(FRAMES[name].slenderness))
    differences = compare(FRAMES[name], straight_lines(samples, 0.1), 0.1)
    assert differences.error <= 1e-8


@pytest.mark.parametrize("name", list(FRAMES))
@pytest.mark.parametrize("strength", [0.5, 3.0])
@pytest.mark.parametrize("time_step", [0.005, 0.1])
def test_jumps(name: str, strength: float, time_step: float) -> None:
    ground = noise(12, 120, strength)[:, np.newaxis]
    differences = compare(FRAMES[name], ground, time_step)
    if np.abs(ground).max() <= math.tan(FRAMES[name].slenderness):
        assert not differences.kernel.theta.any()
        assert not differences.reference.theta.any()
    else:
        assert differences.reference.theta[1:].any()
        assert differences.error <= 1e-8


def smooth(t: Float) -> Float:
    return 0.6 * np.sin(5.0 * t) + 0.4 * np.sin(13.0 * t + 1.0) + 0.2 * np.cos(31.0 * t)


@pytest.mark.parametrize("name", ["bent", "stocky", "slender"])
@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_any_degree(name: str, degree: int) -> None:
    ground = GroundAcceleration.from_function(smooth, 0.0, 2.0, intervals=200, degree=degree)
    differences = compare(FRAMES[name], 1.2 * ground.coefficients, ground.time_step)
    assert differences.reference.theta[1:].any()
    assert differences.error <= 1e-8


@pytest.mark.parametrize("start", [(0.1, 0.0), (-0.1, 0.3), (0.0, 0.2), (0.0, -1.5), (0.164, 0.1)])
def test_from_any_state(start: tuple[float, float]) -> None:
    differences = compare(FRAMES["bent"], straight_lines(noise(13, 300, 0.3), 0.01), 0.01, start)
    assert differences.error <= 1e-8


def test_released_at_the_balance_point_the_ground_decides() -> None:
    frame = FRAMES["bent"]
    lines = straight_lines(noise(14, 100, 0.3), 0.01)
    differences = compare(frame, lines, 0.01, (frame.slenderness, 0.0))
    mirror = compare(frame, -lines, 0.01, (-frame.slenderness, 0.0))
    assert differences.error <= 1e-8
    assert mirror.kernel.verdict == differences.kernel.verdict


@pytest.mark.parametrize("excess", [1e-12, 1e-6, 1.0])
def test_motion_that_starts_above_the_uplift_acceleration(excess: float) -> None:
    limit = math.tan(FRAMES["bent"].slenderness)
    samples = limit * np.concatenate([[1.0 + excess], np.linspace(1.0, -2.0, 100)])
    differences = compare(FRAMES["bent"], straight_lines(samples, 0.01), 0.01)
    assert differences.kernel.uplift_time == differences.reference.uplift_time == 0.0
    assert differences.error <= 1e-8


@pytest.mark.parametrize("name", list(FRAMES))
def test_overturning_time(name: str) -> None:
    frame = FRAMES[name]
    pull = np.full((400, 1), 2.0 * math.tan(frame.slenderness))
    differences = compare(frame, pull, 0.02 / frame.effective_frequency_parameter)
    assert_allclose(
        differences.kernel.overturning_time, differences.reference.overturning_time, rtol=1e-11
    )


@pytest.mark.parametrize(
    ("name", "file", "peak"),
    [
        ("Parkfield", "parkfield1966_CO2-065.csv", 0.163182619),
        ("Pacoima Dam", "sanfernando1971_PacoimaDam-164.csv", 0.273120128),
        ("San Salvador", "sansalvador1986_GIC-180.csv", 0.132357730),
        ("Erzincan", "erzincan1992_EW.csv", 0.096642664),
        ("Jensen", "northridge1994_Jensen-022.csv", 0.365857036),
        ("Takarazuka", "kobe1995_Takarazuka-000.csv", 0.266758994),
    ],
)
def test_peak_under_the_paper_s_records(
    peer_records: Path, name: str, file: str, peak: float
) -> None:
    lines = (peer_records / file).read_text(encoding="utf-8").splitlines()
    rows = [row.split(",") for row in lines if row[:1].isdigit()]
    times, samples = np.array(rows, dtype=float).T
    step = round(float(times[-1]) / (times.size - 1), 6)
    ground = GroundAcceleration.from_samples(GRAVITY * samples, step)
    response = respond(FRAMES["bent"], ground)
    assert response.peak_rotation_ratio == pytest.approx(peak, abs=1e-6), name
