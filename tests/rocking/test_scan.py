"""The scan over amplitude finds all edges and slivers, and no line depends on the others."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rockframe.frame import RockingFrame
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import respond
from rockframe.rocking.spectra.scan import (
    _AROUND,
    Lines,
    Points,
    Scan,
    around_flips,
    concatenated,
    islands,
    scan,
    slivers,
)
from rockframe.rocking.verdict import Verdict
from rockframe.wavelets.pulse import Pulse


def column(degrees: float, mass_ratio: float) -> RockingFrame:
    return RockingFrame(
        height=4.0, width=4.0 * math.tan(math.radians(degrees)), mass_ratio=mass_ratio
    )


def ground(wavelet: str, frame: RockingFrame, frequency_ratio: float) -> GroundAcceleration:
    """Return a pulse of amplitude g tan(alpha)."""
    period = math.tau / (frequency_ratio * frame.frequency_parameter)
    return GroundAcceleration.from_pulse(
        Pulse(wavelet=wavelet, a_p=frame.uplift_acceleration, T_p=period)
    )


def one_line(
    frame: RockingFrame,
    motion: GroundAcceleration,
    amplitudes: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> Scan:
    return scan([motion], [frame], np.array([0]), np.array([0]), amplitudes, tolerance=1e-9)


def test_edges_are_edges() -> None:
    frame = column(14.0, 0.25)
    motion = ground("symmetric_ricker", frame, 2.0)
    intervals = one_line(frame, motion, np.arange(1.0, 12.0, 0.05))
    assert len(intervals.lower) == 5
    for edge, outside in [(intervals.lower, 1.0 - 3e-9), (intervals.upper[:-1], 1.0 + 3e-9)]:
        for amplitude in edge:
            assert verdict(frame, motion, amplitude) is Verdict.OVERTURNS
            assert verdict(frame, motion, amplitude * outside) is Verdict.STANDS


def verdict(frame: RockingFrame, motion: GroundAcceleration, amplitude: float) -> Verdict:
    scaled = GroundAcceleration(
        amplitude * motion.coefficients, motion.time_step, motion.start_time
    )
    return respond(frame, scaled).verdict


#: A sliver of overturning, and the step of the points between which it lies.
SLIVER, STEP = (2.5311, 2.5317), 0.1


class _Lines(Lines):
    """Lines that overturn within the sliver, and lean the more the closer they are to it."""

    def at(self, line: np.ndarray, amplitude: np.ndarray) -> Points:
        return points_of(line, amplitude, (SLIVER[0] < amplitude) & (amplitude < SLIVER[1]))


NO_INDEX = np.zeros(0, dtype=np.int64)
LINES = _Lines([], [], NO_INDEX, NO_INDEX, np.zeros(0))


def points_of(line: np.ndarray, amplitude: np.ndarray, fallen: np.ndarray) -> Points:
    lean, none = -np.abs(amplitude - np.mean(SLIVER)), np.zeros(line.size)
    return Points(line, amplitude, none.astype(np.int8), fallen, lean, none.astype(np.int32))


@pytest.mark.parametrize("place", range(6))
def test_points_around_a_flip_are_of_its_line(place: int) -> None:
    """The intervals beside the flip are divided, but not from one line to the next."""
    line, amplitude = np.repeat([0, 1, 2], 7), np.tile(np.arange(1.0, 8.0), 3)
    fallen = (line == 1) & (amplitude > place + 1.5)
    more = around_flips(LINES, points_of(line, amplitude, fallen))
    assert set(more.line.tolist()) == {1}
    divided = {*np.floor(more.amplitude).astype(int).tolist()}
    assert divided == {*range(max(1, place + 1 - _AROUND), min(6, place + 1 + _AROUND) + 1)}


@pytest.mark.parametrize("lines", [1, 3])
def test_the_search_for_slivers_goes_on_until_each_is_found(lines: int) -> None:
    amplitude = np.arange(1.0, 5.0, STEP)
    line = np.repeat(np.arange(lines), amplitude.size)
    points = LINES.at(line, np.tile(amplitude, lines))
    assert not points.fallen.any()
    flips = concatenated(slivers(LINES, points))
    assert sorted(flips.line.tolist()) == sorted([*range(lines)] * 2)
    assert ((SLIVER[0] < flips.fallen) & (flips.fallen < SLIVER[1])).all()
    for k in range(lines):
        below, above = sorted(flips.standing[flips.line == k])
        assert SLIVER[0] - STEP < below < SLIVER[0]
        assert SLIVER[1] < above < SLIVER[1] + STEP


def test_a_sliver_of_a_ten_thousandth_is_found() -> None:
    """The sliver extends from 2.31493 to 2.31504; the step of the scan is 45 times as long."""
    frame = column(10.0, 0.25)
    intervals = one_line(frame, ground("symmetric_ricker", frame, 2.0), np.arange(2.2, 2.4, 0.005))
    edges = [2.30049, 2.30192, 2.30423, 2.30519, 2.30887, 2.30943, 2.31493, 2.31504]
    slivers = np.column_stack([intervals.lower, intervals.upper])[1:]
    assert_allclose(slivers.ravel(), edges, rtol=0, atol=1e-5)


def test_an_island_thinner_than_the_step_is_found() -> None:
    """Between 2.47122 and 2.48155 the frame stands."""
    frame = column(14.0, 0.25)
    intervals = one_line(
        frame, ground("symmetric_ricker", frame, 2.0), np.arange(2.42, 3.0, 0.0301)
    )
    assert_allclose(intervals.upper[0], 2.47122, rtol=0, atol=1e-5)
    assert_allclose(intervals.lower[1], 2.48155, rtol=0, atol=1e-5)


def test_a_line_that_overturns_from_the_first_amplitude() -> None:
    frame = column(14.0, 0.0)
    intervals = one_line(frame, ground("symmetric_ricker", frame, 2.0), np.arange(3.0, 9.5, 0.1))
    assert intervals.lower[0] == 3.0
    assert_allclose(intervals.upper[0], 8.09829, rtol=0, atol=1e-5)
    assert math.isnan(intervals.upper[-1])


def test_the_same_bits_whatever_is_beside_a_line() -> None:
    frames = [column(14.0, 0.0), column(10.0, 1.0)]
    motions = [ground("antisymmetric_ricker", frame, 3.0) for frame in frames]
    amplitudes = np.arange(1.0, 6.0, 0.05)
    both = scan(motions, frames, np.array([0, 1]), np.array([0, 1]), amplitudes, tolerance=1e-9)
    for k in range(2):
        alone = one_line(frames[k], motions[k], amplitudes)
        assert_array_equal(both.verdict[k], alone.verdict[0])
        assert_array_equal(both.intervals()[k], alone.intervals()[0])


def test_a_line_that_never_overturns() -> None:
    frame = column(14.0, 0.0)
    intervals = one_line(frame, ground("symmetric_ricker", frame, 7.5), np.arange(0.9, 20.0, 0.1))
    assert intervals.intervals()[0].shape == (0, 2)
    assert set(intervals.verdict.ravel()) == {Verdict.NO_UPLIFT, Verdict.STANDS}


@pytest.mark.parametrize(
    ("intervals", "stands"),
    [
        ([[1.0, 2.0], [3.0, 4.0], [5.0, math.nan]], ((2.0, 3.0), (4.0, 5.0))),
        ([[1.0, 2.0], [3.0, 4.0]], ((2.0, 3.0), (4.0, 9.0))),
        ([[1.0, math.nan]], ()),
    ],
)
def test_islands(intervals: list[list[float]], stands: tuple[tuple[float, float], ...]) -> None:
    assert islands(np.array(intervals), 9.0) == stands


def test_no_islands_where_nothing_overturns() -> None:
    assert islands(np.empty((0, 2)), 9.0) == ()
