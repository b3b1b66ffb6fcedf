"""Overturning spectra of round columns under two pulses: the plane, turning, and proportions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from rockframe import (
    PairAcceleration,
    ParameterError,
    Pulse,
    RockingFrame,
    Verdict,
    respond,
    wobble,
    wobbling_spectrum,
)

COLUMN = RockingFrame(height=7.5, width=1.8, section="circular")
ALONG = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
ACROSS = replace(ALONG, a_p=0.7, T_p=1.2, time=0.3)
AMPLITUDES = np.linspace(0.5, 4.5, 17)


def verdict_in_the_plane(ratio: float, amplitude: float) -> Verdict:
    """Return the verdict of the planar column under one pulse."""
    period = math.tau / (ratio * COLUMN.frequency_parameter)
    pulse = replace(ALONG, a_p=amplitude * COLUMN.uplift_acceleration, T_p=period)
    return respond(COLUMN, pulse).verdict


@pytest.mark.parametrize("angle", [0.0, 90.0])
def test_one_pulse_gives_the_spectrum_of_the_plane(angle: float) -> None:
    """The second pulse is a billionth, too weak to turn the motion out of the plane."""
    still = replace(ALONG, a_p=1e-9)
    ratios = [1.0, 2.5]
    found = wobbling_spectrum(COLUMN, ALONG, still, ratios, AMPLITUDES, angle_degree=angle)
    expected = [[verdict_in_the_plane(r, a) for a in AMPLITUDES.tolist()] for r in ratios]
    assert_array_equal(found.verdict, expected)
    assert {*found.verdict.ravel().tolist()} == {0, 1, 2}


def test_each_point_is_the_response_to_both_pulses() -> None:
    found = wobbling_spectrum(COLUMN, ALONG, ACROSS, [2.0], AMPLITUDES, angle_degree=60.0)
    period = math.tau / (2.0 * COLUMN.frequency_parameter)
    uplift = COLUMN.uplift_acceleration
    for amplitude, verdict in zip(AMPLITUDES.tolist(), found.verdict[0].tolist(), strict=True):
        first = replace(ALONG, a_p=amplitude * uplift, T_p=period)
        second = replace(first, a_p=0.7 * first.a_p, T_p=1.2 * period, time=0.3 * period)
        motion = PairAcceleration.from_pulses(first, second, angle_degree=60.0)
        assert wobble(COLUMN, motion).verdict == verdict
    least = found.minimum_overturning_amplitude[0]
    assert least == AMPLITUDES[found.verdict[0].tolist().index(Verdict.OVERTURNS)]


def test_mirrored_directions_and_units_of_the_pulses_change_nothing() -> None:
    arguments = ([1.5, 3.0], AMPLITUDES)
    one = wobbling_spectrum(COLUMN, ALONG, ACROSS, *arguments, angle_degree=70.0)
    mirrored = wobbling_spectrum(COLUMN, ALONG, ACROSS, *arguments, angle_degree=-70.0)
    assert_array_equal(one.verdict, mirrored.verdict)
    along, across = (
        replace(pulse, a_p=4.0 * pulse.a_p, T_p=2.0 * pulse.T_p, time=2.0 * pulse.time)
        for pulse in (ALONG, ACROSS)
    )
    scaled = wobbling_spectrum(COLUMN, along, across, *arguments, angle_degree=70.0)
    assert_array_equal(one.verdict, scaled.verdict)


def test_none_overturns_and_input_is_checked() -> None:
    weak = wobbling_spectrum(COLUMN, ALONG, ACROSS, [4.0], [0.2, 0.4])
    assert np.isnan(weak.minimum_overturning_amplitude).all()
    with pytest.raises(ParameterError, match=r"Invalid amplitude 0\. Must be positive"):
        wobbling_spectrum(COLUMN, ALONG, ACROSS, [4.0], [0.0])
    with pytest.raises(ParameterError, match="Must be circular"):
        wobbling_spectrum(RockingFrame(height=7.5, width=1.8), ALONG, ACROSS, [4.0], [1.0])


@pytest.mark.parametrize("excess", [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 2e-7])
def test_a_motion_as_strong_as_uplift_ends(excess: float) -> None:
    """The pull of the ground exceeds that of gravity by round-off, or hardly: nothing moves."""
    peak = (1.0 + excess) * COLUMN.uplift_acceleration
    wave = peak * np.array([0.0, 0.5, 1.0, 0.5, 0.0, 0.0])
    found = wobble(COLUMN, PairAcceleration(0.6 * wave, 0.8 * wave, 0.01))
    assert found.verdict in (Verdict.NO_UPLIFT, Verdict.STANDS)
    assert found.peak_rotation < 1e-12
