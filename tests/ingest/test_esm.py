from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rockframe.errors import InputError
from rockframe.ingest import read_bytes

PATH = Path("HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC")
SAMPLES = ("0.000001", "-0.250000", "0.300022")


def esm(samples: tuple[str, ...] = SAMPLES, between: str = "\n") -> str:
    peak = max(samples, key=lambda sample: abs(float(sample)))
    return "\n".join(
        [
            "EVENT_NAME: GREECE",
            "EVENT_ID: EMSC-20190728_0000106",
            "MAGNITUDE_W: ",
            "MAGNITUDE_L: 4.6",
            "NETWORK: HI",
            "STATION_CODE: ARS1",
            "EPICENTRAL_DISTANCE_KM: 88.1",
            "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS: 20190728_160919.870",
            "SAMPLING_INTERVAL_S: 0.005000",
            f"NDATA: {len(samples)}",
            f"DURATION_S: {0.005 * len(samples):.3f}",
            "STREAM: HNE",
            "UNITS: cm/s^2",
            f"PGA_CM/S^2: {peak}",
            "BASELINE_CORRECTION: BASELINE REMOVED",
            "HEADER_FORMAT: DYNA 1.2",
            "DATA_TYPE: ACCELERATION",
            "PROCESSING: manual (Paolucci et al., 2011)",
            "USER1: ",
            between.join(samples),
            "",
        ]
    )


def test_facts() -> None:
    [record] = read_bytes(PATH, esm().encode())
    assert record.record_id == PATH.stem
    assert (record.event, record.station, record.network) == ("GREECE", "ARS1", "HI")
    assert (record.component, record.azimuth, record.time_step) == ("HNE", 90.0, 0.005)
    assert (record.magnitude, record.epicentral_distance) == (4.6, 88.1)
    assert record.start_time == "2019-07-28T16:09:19.870Z"
    assert not record.uncorrected


@given(st.lists(st.floats(-2000, 2000).map(lambda value: f"{value:.6f}"), min_size=2, max_size=30))
def test_round_trip(samples: list[str]) -> None:
    [record] = read_bytes(PATH, esm(tuple(samples)).encode())
    assert np.array_equal(record.acceleration, np.array(samples, dtype=float) * 0.01)


def test_numbers_may_touch() -> None:
    data = esm(("0.100000", "-0.250000", "-0.300022"), between="").encode()
    assert read_bytes(PATH, data)[0].acceleration.tolist() == [0.001, -0.0025, -0.00300022]


def test_exponents_are_no_touching_numbers() -> None:
    [record] = read_bytes(PATH, esm(("1.000000e-01", "-2.000000e-01")).encode())
    assert record.acceleration.tolist() == [0.001, -0.002]


@pytest.mark.parametrize(
    ("processing", "baseline", "uncorrected"),
    [
        ("none", "BASELINE NOT REMOVED", True),
        ("automatic", "BASELINE REMOVED", False),
        ("", "BASELINE NOT REMOVED", True),
        ("", "BASELINE REMOVED", False),
    ],
)
def test_processing(processing: str, baseline: str, uncorrected: bool) -> None:
    text = esm().replace("manual (Paolucci et al., 2011)", processing)
    [record] = read_bytes(PATH, text.replace("BASELINE REMOVED", baseline).encode())
    assert record.uncorrected is uncorrected


def test_unknown_stays_unknown() -> None:
    text = esm().replace("MAGNITUDE_L: 4.6", "MAGNITUDE_L: ").replace("_KM: 88.1", "_KM: ")
    [record] = read_bytes(PATH, text.replace("20190728_160919.870", "").encode())
    assert math.isnan(record.magnitude)
    assert math.isnan(record.epicentral_distance)
    assert record.start_time == ""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("TYPE: ACCELERATION", "TYPE: VELOCITY", r":17: DATA_TYPE 'VELOCITY'\. Must be ACCEL"),
        ("TYPE: ACCELERATION", "TYPE: DISPLACEMENT", r":17: DATA_TYPE 'DISPLACEMENT'"),
        ("cm/s^2", "m/s^2", r":13: UNITS 'm/s\^2'\. Must be cm/s\^2"),
        ("UNITS: cm/s^2\n", "", r"no UNITS in 18 lines of header\."),
        ("DYNA 1.2", "DYNA 2.0", r":16: HEADER_FORMAT 'DYNA 2\.0'\. Must be DYNA 1\.2"),
        ("-0.250000\n", "", r":10: NDATA 3 in the header, 2 samples in the file"),
        ("NDATA: 3", "NDATA: 3.0", r":10: NDATA '3\.0'\. Must be a whole number"),
        ("-0.250000", "-1.250000", r":14: peak 0\.300022 cm/s2 stated, but -1\.25 cm/s2 in the"),
        ("-0.250000", "nan", r":21: acceleration 'nan'\. Must be a finite number"),
        ("-0.250000", "-0.2500O0", r":21: acceleration '-0\.2500O0'"),
        ("_S: 0.005000", "_S: 0.050000", r":11: DURATION_S 0\.015 in the header, 3 samples at"),
        ("_S: 0.005000", "_S: -0.005", r":9: time step -0\.005 s\. Must be positive"),
        ("_S: 0.005000", "_S: 5 ms", r":9: SAMPLING_INTERVAL_S '5 ms'\. Must be a number"),
        ("STREAM: HNE", "NETWORK: HI", r":12: key NETWORK is stated twice"),
    ],
)
def test_damaged(old: str, new: str, message: str) -> None:
    text = esm()
    assert old in text
    with pytest.raises(InputError, match=message):
        read_bytes(PATH, text.replace(old, new, 1).encode())


def test_the_quantity_may_be_in_lower_case() -> None:
    """RawAcc files of AFAD write the quantity in lower case."""
    [record] = read_bytes(PATH, esm().replace("TYPE: ACCELERATION", "TYPE: acceleration").encode())
    assert record.acceleration.size == len(SAMPLES)
