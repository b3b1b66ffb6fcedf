"""A raw volume corrected here agrees with the archive's corrected volume of the same record."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rockframe.ingest import read_file
from rockframe.record import Record
from rockframe.signals.processing import BandPass, correct

Float = NDArray[np.float64]

#: Natural frequency [Hz] and damping [1] of the sensor, from the header of CE89146.
SENSOR = 1.0 / 0.0109, 0.67


def delayed(samples: Float, step: float, delay: float) -> Float:
    """Return the samples delayed by `delay` [s], a phase shift of their Fourier transform."""
    frequency = np.fft.rfftfreq(samples.size, step)
    turned = np.fft.rfft(samples) * np.exp(-2j * np.pi * frequency * delay)
    return np.fft.irfft(turned, samples.size)


def peak(samples: Float) -> float:
    return float(samples[np.abs(samples).argmax()])


def pair(shared_records: Path, channel: int) -> tuple[Float, Record]:
    """Return the raw acceleration with the archive's band-pass, and the archive's record."""
    folder = shared_records / "formats" / "csmip"
    raw = read_file(folder / "CE89146.V1")[channel]
    theirs = read_file(folder / "CE89146.V2")[channel]
    ours, *_ = correct(raw.acceleration, raw.time_step, BandPass(0.3, 40.0))
    return ours, theirs


@pytest.mark.parametrize(
    ("channel", "correlation", "difference"),
    [(0, 0.99998, 0.0009), (1, 0.99991, 0.0021), (2, 0.99993, 0.0036)],
)
def test_agree(shared_records: Path, channel: int, correlation: float, difference: float) -> None:
    ours, theirs = pair(shared_records, channel)
    # The archive removed the sensor's response, whose delay at low frequencies is
    # 2 damping / (2 pi frequency) = 2.3 ms, close to half a step; the raw volume still has it.
    frequency, damping = SENSOR
    early = delayed(ours, theirs.time_step, -damping / (np.pi * frequency))
    early = early[: theirs.acceleration.size]
    assert np.corrcoef(early, theirs.acceleration)[0, 1] > correlation
    assert peak(early) == pytest.approx(peak(theirs.acceleration), rel=difference)


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_agree_less_without_the_sensor_delay(shared_records: Path, channel: int) -> None:
    ours, theirs = pair(shared_records, channel)
    ours = ours[: theirs.acceleration.size]
    assert 0.993 < np.corrcoef(ours, theirs.acceleration)[0, 1] < 0.997


@pytest.mark.parametrize(("channel", "code"), [(0, "HNE"), (1, "HNN"), (2, "HNZ")])
def test_one_recording_from_two_archives(shared_records: Path, channel: int, code: str) -> None:
    """Only a gain differs between CI.CLC as miniSEED and as V1 with a nominal sensitivity."""
    counted = read_file(shared_records / "formats" / "miniseed" / f"CI.CLC..{code}.mseed")[0]
    nominal = read_file(shared_records / "ridgecrest2019" / "CICLC.v1")[channel]
    later = 19503  # samples: 03:19:23.0383 after 03:16:08.0, stated to a tenth of a second
    one = nominal.acceleration[later:]
    other = counted.acceleration[: one.size]
    one, other = one - one.mean(), other - other.mean()
    largest = np.abs(one).max()
    assert 0.0030 < np.abs(one - other).max() / largest < 0.00302
    gain = float(one @ other / (other @ other))
    assert gain == pytest.approx(1.00302, abs=1e-5)
    assert np.abs(one - gain * other).max() / largest < 3e-6
