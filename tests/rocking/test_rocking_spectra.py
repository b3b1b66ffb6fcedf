"""Rocking spectra: known peaks, similarity, and the largest rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from rockframe.engines.engine import ProcessPool
from rockframe.errors import ParameterError
from rockframe.rocking import RockingSpectrum, Verdict, respond, rocking_spectrum
from rockframe.rocking.spectra.overturning import column_of
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

WAVELET = {"symmetric": "symmetric_ricker", "antisymmetric": "antisymmetric_ricker"}
PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.4 * GRAVITY, T_p=1.0)


def spectrum(pulse: Pulse = PULSE, **changed: Any) -> RockingSpectrum:
    asked = {"slendernesses": [0.2], "mass_ratios": [0.0, 4.0], "column_periods": [3.0, 4.0, 6.0]}
    return rocking_spectrum([pulse], **(asked | changed))


@pytest.mark.parametrize("number", range(48))
def test_known_peaks(number: int, expected: Callable[[str], Any]) -> None:
    row = expected("h_rocking_spectra")["rows"][number]
    computed = spectrum(
        Pulse(wavelet=WAVELET[row["pulse"]], a_p=row["a_p_g"] * GRAVITY, T_p=row["T_p_s"]),
        slendernesses=[math.radians(row["alpha_deg"])],
        mass_ratios=[row["gamma"]],
        column_periods=[row["two_pi_over_p"]],
    )
    verdict = Verdict(int(computed.verdict.item())).name.lower()
    in_their_words = {"no_uplift": "safe", "stands": "safe", "overturns": "overturned"}
    assert in_their_words[verdict] == row["verdict"]
    if row["verdict"] == "safe":
        peak = float(row["peak_theta_over_alpha"])
        assert_allclose(computed.peak_rotation_ratio.item(), peak, rtol=0, atol=1e-9)


def test_the_largest_rate_is_that_of_the_history() -> None:
    computed = spectrum()
    for j, gamma in enumerate(computed.mass_ratio):
        for k, period in enumerate(computed.column_period):
            frame = column_of(0.2, float(gamma), float(period))
            history = respond(frame, PULSE, free_rocking=20.0)
            sampled = np.abs(history.omega).max()
            largest = max(sampled, np.abs(history.impact_velocities).max())
            assert_allclose(computed.peak_velocity[0, 0, j, k], largest, rtol=1e-5)


def test_time_scales_with_the_period_of_the_columns() -> None:
    """Doubling the pulse's period and 2 pi / p keeps the rotation and halves the rate."""
    once = spectrum()
    slow = Pulse(wavelet=PULSE.wavelet, a_p=PULSE.a_p, T_p=2.0)
    twice = spectrum(slow, column_periods=[6.0, 8.0, 12.0])
    assert_allclose(twice.peak_rotation_ratio, once.peak_rotation_ratio, rtol=1e-9)
    assert_allclose(2.0 * twice.peak_velocity, once.peak_velocity, rtol=1e-9)


def test_larger_columns_turn_less() -> None:
    peaks = spectrum(column_periods=np.linspace(4.0, 20.0, 9)).peak_rotation_ratio[0, 0]
    assert (np.diff(peaks, axis=-1) < 0.0).all()


def test_the_same_bits_in_a_pool() -> None:
    """A worker computes the second of two motions."""
    motions = [PULSE, Pulse(wavelet="antisymmetric_ricker", a_p=4.0, T_p=0.8)]
    asked = ([0.1, 0.2], [0.0], np.linspace(2.0, 9.0, 8))
    alone = rocking_spectrum(motions, *asked)
    pooled = rocking_spectrum(motions, *asked, engine=ProcessPool(2, patience=1e-9))
    assert_array_equal(alone.peak_rotation_ratio, pooled.peak_rotation_ratio)
    assert_array_equal(alone.peak_velocity, pooled.peak_velocity)
    second = rocking_spectrum(motions[1:], *asked)
    assert_array_equal(alone.peak_velocity[1:], second.peak_velocity)
    assert (alone.peak_velocity[0] != second.peak_velocity[0]).any()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"column_periods": [4.0, 3.0]}, r"Invalid column_period 3\.0 after 4\.0\. Must be incr"),
        ({"column_periods": [1e4]}, r"Invalid height .* Must be between 0\.001 and 1000 m"),
        ({"slendernesses": [1.2]}, r"Invalid slenderness 68\.75 degrees"),
        ({"mass_ratios": []}, r"Invalid mass_ratio of shape \(0,\)"),
    ],
)
def test_refused(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        spectrum(**changed)


def test_refused_without_motions() -> None:
    with pytest.raises(ParameterError, match=r"Invalid number of motions, 0"):
        rocking_spectrum([], [0.2], [0.0], [3.0])
