"""Signal processing: properties of the baseline correction and the band-pass."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.signals.processing import AsRead, BandPass, correct, integrate, peak

TIME: NDArray[np.float64] = 0.01 * np.arange(6000, dtype=np.float64)


def burst(frequency: float) -> NDArray[np.float64]:
    envelope = np.exp(-(((TIME - 30.0) / 6.0) ** 2))
    return np.asarray(np.sin(2 * np.pi * frequency * TIME) * envelope, dtype=np.float64)


def test_a_line_is_removed_entirely() -> None:
    corrected, *_ = correct(0.3 + 0.01 * TIME, 0.01, BandPass())
    assert peak(corrected) < 1e-12


def test_inside_the_band_nothing_changes() -> None:
    signal = burst(2.0)
    corrected, *_ = correct(signal, 0.01, BandPass())
    assert peak(corrected - signal) < 1e-4


@pytest.mark.parametrize("frequency", [0.2, 45.0])
def test_outside_the_band_little_is_left(frequency: float) -> None:
    corrected, *_ = correct(burst(frequency), 0.01, BandPass(1.0, 20.0))
    assert peak(corrected) < 1e-3


def test_phase_is_kept() -> None:
    signal = burst(1.0)
    corrected, *_ = correct(signal, 0.01, BandPass())
    assert int(np.correlate(corrected, signal, "same").argmax()) == signal.size // 2


@pytest.mark.parametrize(
    ("low", "high", "step"), [(0.1, 40.0, 0.005), (0.05, 0.2, 0.01), (0.1, 20.0, 0.002)]
)
def test_the_correction_is_that_of_scipy(low: float, high: float, step: float) -> None:
    noise = np.random.default_rng(1).normal(0.2, 1.0, 9000)
    corrected, *_ = correct(noise, step, BandPass(low, high))
    tapered = scipy.signal.detrend(noise) * scipy.signal.windows.tukey(noise.size, 0.04)
    pad = round(3.0 / (low * step))
    sections = scipy.signal.butter(4, (low, high), "bandpass", fs=1.0 / step, output="sos")
    expected = scipy.signal.sosfiltfilt(sections, np.pad(tapered, pad), padtype=None)[pad:-pad]
    np.testing.assert_allclose(corrected, expected, rtol=0.0, atol=1e-9 * peak(expected))


@pytest.mark.parametrize("low", [0.05, 0.2])
def test_displacements_of_a_fine_record_are_those_of_a_coarse_one(low: float) -> None:
    """As one ratio of polynomials, this filter has 374 times the PGD at 500 samples/s."""
    peaks = []
    for step in (0.01, 0.002):
        time = step * np.arange(round(60.0 / step) + 1)
        pulse = np.where(np.abs(time - 30.0) < 1.0, np.sin(np.pi * time), 0.0)
        corrected, *_ = correct(pulse, step, BandPass(low, 40.0))
        peaks.append(peak(integrate(integrate(corrected, step), step)))
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-3)


def test_the_bits_of_corrected_records_and_scales_do_not_depend_on_the_processor() -> None:
    """Switches of numpy and OpenBLAS stand for an older processor."""
    code = (
        "import numpy as np\n"
        "from rockframe.rocking.margins.first_overturning import powers\n"
        "from rockframe.signals.corner import choose_corner\n"
        "from rockframe.signals.processing import BandPass, correct\n"
        "noise = np.random.default_rng(1).normal(size=6000)\n"
        "corrected = correct(noise, 0.01, BandPass())[0]\n"
        "scales = powers(1.0001, np.arange(5000))\n"
        "loud = noise * np.where(np.arange(6000) < 2500, 1e-4, 1.0)\n"
        "pairs = [(loud + 3e-5 * np.roll(noise, 7 * k)) for k in range(1, 9)]\n"
        "corners = np.array([choose_corner(one, 0.01, 3.0).frequency for one in pairs])\n"
    )
    names: dict[str, NDArray[np.float64]] = {}
    exec(code, names)  # noqa: S102
    expected = [
        hashlib.sha256(names[name].tobytes()).hexdigest()
        for name in ("corrected", "scales", "corners")
    ]
    code += "import hashlib\n"
    code += "print(*(hashlib.sha256(x).hexdigest() for x in (corrected, scales, corners)))"
    older = " ".join(np.show_config(mode="dicts")["SIMD Extensions"]["found"])
    switches = {"NPY_DISABLE_CPU_FEATURES": older, "OPENBLAS_CORETYPE": "Nehalem"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **switches},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == expected


@pytest.mark.parametrize(
    ("corner", "factor", "allowed"), [(0.03, 0.5, 1.0 / 59.99), (15.0, 2.0, 20.0)]
)
def test_the_nearest_corner_that_a_record_allows_is_taken(
    corner: float, factor: float, allowed: float
) -> None:
    """59.99 s allow one period of the lower corner, and 40 Hz the lower corner an octave below."""
    noise = np.random.default_rng(1).standard_normal(TIME.size)
    shake = AsRead(noise, BandPass(corner, 40.0))
    nearest, *_ = correct(noise, 0.01, BandPass(allowed * (1.0 + 1e-9 * (factor < 1)), 40.0))
    np.testing.assert_allclose(shake.corrected(0.01, factor), nearest, rtol=0, atol=1e-7)
    again, *_ = correct(shake.samples, 0.01, shake.band)
    np.testing.assert_array_equal(shake.corrected(0.01, 1.0), again)


def test_velocity_returns_to_rest() -> None:
    corrected, *_ = correct(burst(0.5) + 0.05, 0.01, BandPass())
    velocity = integrate(corrected, 0.01)
    assert abs(velocity[-1]) < 1e-3 * peak(velocity)


def test_processing_states_the_corners_used() -> None:
    *_, steps = correct(burst(1.0), 0.02, BandPass(0.2, 40.0))
    assert "0.2 to 20 Hz" in steps[-1]


def test_reversed_corners_are_refused() -> None:
    with pytest.raises(
        ParameterError, match=r"band-pass from 40.0 to 0.1 Hz. Must be two positive"
    ):
        BandPass(40.0, 0.1)


def test_a_record_too_coarse_for_the_band_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"Invalid time step 8 s .* Must be at most 2 s"):
        BandPass(0.1, 40.0).corners(8.0, 80.0)


def test_a_record_too_short_for_the_band_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"Invalid duration 5 s .* Must be 10 s or more"):
        BandPass(0.1, 40.0).corners(0.01, 5.0)


def test_a_band_that_leaves_nothing_is_refused() -> None:
    with pytest.raises(ParameterError, match="at least an octave apart"):
        BandPass(39.99, 40.0)


def test_integral_of_a_cosine_is_its_sine() -> None:
    integral = integrate(np.cos(TIME), 0.01)
    assert peak(integral - np.sin(TIME)) < 1e-5
