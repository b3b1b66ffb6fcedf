"""Inputs on which other programs go wrong (docs/howto/formats-of-others.md) are read right here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.ingest.test_geonet import PATH as GEONET
from tests.ingest.test_geonet import geonet
from tests.ingest.test_miniseed import Write, channel_xml, mseed, station_xml, trace, write
from tests.ingest.test_recorders import COUNTS, miniseed3
from tests.ingest.test_sac import SAMPLES, sac
from tests.ingest.test_trust import FLAT

from rockframe.components import pair_horizontals, rotate
from rockframe.errors import InputError
from rockframe.ingest import ReadOptions, read_bytes, read_file
from rockframe.record import Orientation, Record
from rockframe.signals.processing import integrate
from rockframe.units import utc_seconds

__all__ = ["write"]  # a fixture

# obspy 1.5 looks up its entry points in a way that Python 3.11 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

WAVE = np.sin(0.1 * np.arange(2000.0)) * np.hanning(2000)


#: A pulse of acceleration in counts: the ends of the record are still.
PULSE = (1e6 * WAVE).astype(int)


@pytest.mark.parametrize("units", ["m/s2", "M/S^2", "m/s/s", "cm/s**2", "furlong/s**2"])
def test_a_response_in_any_spelling_of_units_is_removed_to_the_same_motion_or_refused(
    write: Write, units: str
) -> None:
    """obspy 1.5.1 multiplies by omega where it does not know the unit."""
    full, waves = ReadOptions(water_level=60.0), mseed(trace(PULSE))
    usual = station_xml(channel_xml(value="4000.0", stages=FLAT))
    path = write(waves, usual)
    [removed], [divided] = read_file(path, full), read_file(path)
    write(waves, usual.replace(">M/S**2<", f">{units}<"))
    size = 0.01 if units.startswith("cm") else 1.0
    try:
        [record] = read_file(path, full)
        expected = size * removed.acceleration
        np.testing.assert_allclose(record.acceleration, expected, rtol=1e-9, atol=1e-12)
    except InputError as error:
        assert "unit" in error.reason.lower() or "per 'furlong" in error.reason  # noqa: PT017
    if units != "furlong/s**2":
        [record] = read_file(path)
        np.testing.assert_allclose(record.acceleration, size * divided.acceleration, rtol=1e-12)


@pytest.mark.parametrize("level", [None, 60.0])
@pytest.mark.parametrize("period", [0.5, 1.0, 2.0, 4.0])
def test_displacements_of_a_flat_accelerometer_are_those_of_the_ground(
    write: Write, level: float | None, period: float
) -> None:
    """Asked for displacement, obspy has 0.8 to 47 % of it: the water level cuts all below 3 Hz."""
    times = 0.01 * np.arange(8000)
    phase = (times - 40.0) / period
    ground = np.where(np.abs(phase) < 0.5, 0.1 * np.cos(np.pi * phase) ** 4, 0.0)  # [m]
    acceleration = np.gradient(np.gradient(ground, 0.01), 0.01)
    counts = np.round(4000.0 * 1e3 * acceleration).astype(int)  # 1000 times the motion
    path = write(mseed(trace(counts)), station_xml(channel_xml(value="4000.0", stages=FLAT)))
    [record] = read_file(path, ReadOptions(water_level=level))
    displacement = integrate(integrate(1e-3 * record.acceleration, 0.01), 0.01)
    assert np.abs(displacement[3500:4500]).max() == pytest.approx(0.1, rel=0.01)


def test_a_polynomial_response_is_refused(write: Write) -> None:
    """obspy ignores the requested output of such a response."""
    before, _, rest = station_xml(channel_xml(stages=FLAT)).partition("<InstrumentSensitivity>")
    path = write(xml=before + rest.partition("</InstrumentSensitivity>")[2])
    with pytest.raises(InputError, match="has no sensitivity"):
        read_file(path, ReadOptions(water_level=60.0))


def test_poles_and_zeros_of_sac_beside_a_file_are_not_guessed_from(tmp_path: Path) -> None:
    """Two such files of one accelerometer differ by two zeros: one is of displacement."""
    (tmp_path / "a.sac").write_bytes(sac(fields={12: 1000.0}))
    (tmp_path / "SAC_PZs_CJ_T001230_HNE").write_text("ZEROS 0\nPOLES 0\nCONSTANT 1000.0\n")
    with pytest.raises(InputError, match=r"SCALE 1000\. Must be 1 .*--sensitivity-counts-s2-m"):
        read_file(tmp_path / "a.sac", ReadOptions("m/s2"))
    [record] = read_file(tmp_path / "a.sac", ReadOptions(sensitivity=1000.0))
    np.testing.assert_allclose(1000.0 * record.acceleration, SAMPLES, rtol=1e-6)


def horizontals(*azimuths: float, late: float = 0.0) -> list[Record]:
    return [
        Record(
            record_id=f"a{azimuth:g}",
            acceleration=(k + 1.0) * WAVE,
            time_step=0.01,
            azimuth=azimuth,
            orientation=Orientation.HORIZONTAL,
            station="A",
            event="E",
            start_time=f"2019-07-06T03:19:53.{round(1000.0 * late * k):03d}Z",
        )
        for k, azimuth in enumerate(azimuths)
    ]


def test_horizontals_whose_samples_differ_in_time_are_not_combined_by_index() -> None:
    """obspy's `rotate` adds samples that are 2 ms apart."""
    pairs, unpaired = pair_horizontals(horizontals(0.0, 90.0, late=0.002))
    assert not pairs
    assert len(unpaired) == 2
    pairs, unpaired = pair_horizontals(horizontals(0.0, 90.0))
    assert len(pairs) == 1


@pytest.mark.parametrize("toward", [0.0, 45.0, 90.0, 300.0])
def test_horizontals_at_045_and_315_are_both_used(toward: float) -> None:
    """hvsrpy 2.1 uses one of them twice."""
    [pair], _ = pair_horizontals(horizontals(45.0, 315.0))
    angles = np.radians([toward - 45.0, toward - 315.0])
    expected = np.cos(angles[0]) * WAVE + np.cos(angles[1]) * 2.0 * WAVE
    np.testing.assert_allclose(rotate(pair, toward).acceleration, expected, atol=1e-12)


def test_a_gap_is_refused_instead_of_integrated_over() -> None:
    """obspy's `integrate` drops the mask of a gap."""
    first, later = (
        miniseed3(np.arange(9, dtype="<i4").tobytes(), 3, 9, start=(2019, 187, 3, 19, second))
        for second in (53, 58)
    )
    with pytest.raises(InputError, match=r"gap in XX\.A\.\.HNE"):
        read_bytes("a.ms3", first + later, COUNTS)


def test_the_start_of_a_geonet_file_keeps_its_fraction() -> None:
    """gmprocess 2.8 loses the half second."""
    record = read_bytes(GEONET, geonet())[0]
    assert utc_seconds(record.start_time) % 1.0 == 0.5


@pytest.mark.parametrize("count", [5, 6, 7, 9])
def test_the_last_line_of_an_at2_file_is_read(at2: Callable[..., bytes], count: int) -> None:
    """quakeio 0.1.21 drops it."""
    values = [f".{k + 1}" for k in range(count)]
    [record] = read_bytes("a.AT2", at2(values, f"NPTS= {count}, DT= .0050 SEC"))
    np.testing.assert_allclose(record.acceleration, [9.81 * float(value) for value in values])


@pytest.mark.parametrize(
    ("rate", "step"), [(0.1, 10.0), (-10.0, 10.0), (-0.25, 0.25), (50.0, 0.02)]
)
def test_a_rate_below_one_sample_a_second_keeps_its_sign(rate: float, step: float) -> None:
    """The header of miniSEED states a period as a negative factor; simplemseed drops the sign."""
    data = miniseed3(np.arange(9, dtype="<i4").tobytes(), 3, 9, rate=rate)
    assert read_bytes("a.ms3", data, COUNTS)[0].time_step == pytest.approx(step, rel=1e-12)


def test_the_day_of_a_sac_file_counts_from_one() -> None:
    """Day 187 of 2019 is 6 July; pysmo dates one day late."""
    [record] = read_bytes("a.sac", sac(), ReadOptions("m/s2"))
    assert record.start_time.startswith("2019-07-06T03:19:52")
