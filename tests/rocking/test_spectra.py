"""Overturning spectra: edges from other solvers, identities, and the paper's statements."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from rockframe.engines.engine import ProcessPool
from rockframe.errors import ParameterError
from rockframe.rocking import GroundAcceleration, OverturningSpectrum, Verdict, overturning_spectrum
from rockframe.rocking.spectra import overturning as spectra
from rockframe.rocking.spectra.overturning import column_of
from rockframe.rocking.spectra.scan import scan
from rockframe.wavelets.pulse import Pulse

Expected = Callable[[str], Any]
Float = NDArray[np.float64]

SYMMETRIC = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
ANTISYMMETRIC = Pulse(wavelet="antisymmetric_ricker", a_p=1.0, T_p=1.0)
PULSE = {"symmetric": SYMMETRIC, "antisymmetric": ANTISYMMETRIC}


def spectrum(
    pulse: Pulse, degrees: float, mass_ratio: float, frequency_ratio: float, amplitudes: Float
) -> OverturningSpectrum:
    """Return a spectrum of one line."""
    return overturning_spectrum(
        [pulse], [math.radians(degrees)], [mass_ratio], [frequency_ratio], amplitudes
    )


@pytest.mark.parametrize("number", range(36))
def test_every_edge_of_figure_9(number: int, expected: Expected) -> None:
    """All edges from 1 to 60 g tan(alpha) agree, and the number of impacts before overturning."""
    row = expected("b_fig9")["rows"][number]
    scan_of_line = spectrum(
        PULSE[row["pulse"]],
        row["alpha_deg"],
        row["gamma"],
        row["omega_p_over_p"],
        np.arange(1.0, 60.0001, 0.02),
    ).found
    edges = row["overturning_intervals_1_to_60"]
    assert len(scan_of_line.lower) == len(edges)
    for lower, upper, impacts, k in ((*edge, k) for k, edge in enumerate(edges)):
        assert_allclose(scan_of_line.lower[k], lower, rtol=0, atol=1e-6)
        assert_allclose(
            scan_of_line.upper[k], math.nan if upper is None else upper, rtol=0, atol=1e-6
        )
        assert scan_of_line.impacts_at_lower[k] == impacts


@pytest.mark.parametrize("number", range(12))
def test_a_pulse_cut_short(number: int, expected: Expected) -> None:
    """A pulse cut at one period moves the first edge by up to 1 %; cut at two, it is complete."""
    row = expected("b3_window_truncation")[number]
    frame = column_of(math.radians(row["alpha_deg"]), row["gamma"])
    period = math.tau / row["omega_p_over_p"]
    pulse = Pulse(wavelet=PULSE[row["pulse"]].wavelet, a_p=frame.uplift_acceleration, T_p=period)
    for name, reach in (("untruncated", 3.0), ("cut_1Tp", 1.0), ("cut_1p5Tp", 1.5), ("cut_2Tp", 2)):
        ground = GroundAcceleration.from_function(
            pulse.acceleration,
            -reach * period,
            reach * period,
            intervals=int(400 * reach),
            degree=5,
        )
        zero = np.array([0])
        amplitudes = row[name] * np.linspace(0.9, 1.05, 16)
        scan_of_line = scan([ground], [frame], zero, zero, amplitudes, tolerance=1e-10)
        assert_allclose(scan_of_line.lower[0], row[name], rtol=0, atol=1e-8)


# The paper's statements, sections 6 and 7


@pytest.mark.parametrize("pulse", [SYMMETRIC, ANTISYMMETRIC])
def test_up_to_15_the_temples_column_stands(pulse: Pulse) -> None:
    computed = spectrum(pulse, 14.0, 0.0, 7.5, np.arange(1.0, 15.01, 0.05))
    assert math.isnan(computed.minimum_overturning_amplitude.item())


@pytest.mark.parametrize(("pulse", "least"), [(SYMMETRIC, 5.75652), (ANTISYMMETRIC, 6.89452)])
def test_above_5_the_temples_frame_still_stands(pulse: Pulse, least: float) -> None:
    computed = spectrum(pulse, 14.0, 0.25, 5.0, np.arange(1.0, 8.0, 0.02))
    assert_allclose(computed.minimum_overturning_amplitude.item(), least, rtol=0, atol=1e-5)


@pytest.mark.parametrize("beyond", [1, 2])
def test_an_edge_just_below_the_largest_amplitude_is_found(beyond: int) -> None:
    amplitudes = 5.75652 + 0.1 * np.arange(beyond - 40.5, beyond)
    computed = spectrum(SYMMETRIC, 14.0, 0.25, 5.0, amplitudes)
    assert_allclose(computed.minimum_overturning_amplitude.item(), 5.75652, rtol=0, atol=1e-5)


@pytest.mark.parametrize("pulse", [SYMMETRIC, ANTISYMMETRIC])
def test_the_gain_of_the_beam_grows_above_4(pulse: Pulse) -> None:
    """At mass ratio 4, the gain is below 50 % at a frequency ratio of 4 and above 100 % at 6."""
    spectrum = overturning_spectrum(
        [pulse], [math.radians(10.0)], [0.0, 4.0], [4.0, 5.0, 6.0], np.arange(1.0, 40.0, 0.05)
    )
    alone, frame = spectrum.minimum_overturning_amplitude[0, 0]
    gain = np.where(np.isnan(frame), np.inf, frame) / alone - 1.0
    assert gain[0] < 0.5
    assert gain[2] > 1.0
    assert (np.diff(gain[np.isfinite(gain)]) > 0.0).all()


# Identities


def test_the_map_is_what_the_intervals_say() -> None:
    amplitudes = np.arange(0.9, 14.0, 0.1)
    lines = overturning_spectrum([ANTISYMMETRIC], [0.2], [0.0, 1.0], [2.0, 3.0], amplitudes).found
    for line, intervals in enumerate(lines.intervals()):
        inside = np.zeros(amplitudes.size, dtype=bool)
        for lower, upper in intervals:
            inside |= (amplitudes >= lower) & ~(amplitudes > upper)
        assert_array_equal(lines.verdict[line] == Verdict.OVERTURNS, inside)
    assert (lines.verdict[:, 0] == Verdict.NO_UPLIFT).all()


def test_a_pulse_reversed_overturns_at_the_same_amplitudes() -> None:
    amplitudes = np.arange(1.0, 8.0, 0.05)
    reversed_ = Pulse(wavelet="antisymmetric_ricker", a_p=1.0, T_p=1.0, phase=math.pi)
    first, other = (
        spectrum(pulse, 14.0, 0.25, 3.0, amplitudes).found for pulse in (ANTISYMMETRIC, reversed_)
    )
    assert_array_equal(first.intervals()[0], other.intervals()[0])


def test_the_same_bits_in_a_pool(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker computes the second of two frequency ratios."""
    monkeypatch.setattr(spectra, "_TASK", 500)
    asked = ([SYMMETRIC], [0.17, 0.25], [0.0, 1.0], [2.0, 3.0], np.arange(1.0, 9.0, 0.02))
    alone, pooled = (
        overturning_spectrum(*asked, engine=engine)
        for engine in (None, ProcessPool(2, patience=1e-9))
    )
    assert_array_equal(alone.found.verdict, pooled.found.verdict)
    assert_array_equal(alone.found.lower, pooled.found.lower)
    assert_array_equal(alone.found.upper, pooled.found.upper)


def test_the_number_of_tasks_decides_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = ([SYMMETRIC], [0.25], [0.0], [1.5, 2.0, 2.5, 3.0], np.arange(1.0, 9.0, 0.1))
    spectrum = overturning_spectrum(*asked)
    monkeypatch.setattr(spectra, "_TASK", 1)
    four = overturning_spectrum(*asked)
    assert_array_equal(spectrum.minimum_overturning_amplitude, four.minimum_overturning_amplitude)
    assert_array_equal(spectrum.found.verdict, four.found.verdict)


def test_columns_of_unit_frequency() -> None:
    for degrees in (5.0, 14.0, 30.0):
        frame = column_of(math.radians(degrees), 2.0)
        assert_allclose(frame.frequency_parameter, 1.0, rtol=1e-14)
        assert_allclose(math.degrees(frame.slenderness), degrees, rtol=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"frequency_ratios": [3.0, 2.0]},
            r"Invalid frequency_ratio 2\.0 after 3\.0\. Must be inc",
        ),
        ({"frequency_ratios": []}, r"Invalid frequency_ratio of shape \(0,\)"),
        ({"mass_ratios": [-1.0]}, r"Invalid mass_ratio -1\. Must be zero or positive"),
        ({"slendernesses": [math.nan]}, r"Invalid slenderness nan\. Must be positive and finite"),
        ({"amplitudes": [1.0, 1.0]}, r"Invalid amplitude 1\.0 after 1\.0"),
        ({"pulses": []}, r"Invalid number of pulses, 0"),
        ({"pulses": [SYMMETRIC, SYMMETRIC]}, r"Invalid pulses: 'symmetric_ricker' twice"),
        ({"frequency_ratios": [1e-9]}, r"Invalid frequency_ratio 1e-09\. Must be 0\.01 or more"),
    ],
)
def test_refused(change: dict[str, Any], message: str) -> None:
    asked: dict[str, Any] = {
        "pulses": [SYMMETRIC],
        "slendernesses": [0.2],
        "mass_ratios": [0.0],
        "frequency_ratios": [3.0],
        "amplitudes": [1.0, 2.0],
    }
    with pytest.raises(ParameterError, match=message):
        overturning_spectrum(**(asked | change))
