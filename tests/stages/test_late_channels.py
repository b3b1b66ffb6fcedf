"""Channels of one station that begin at different times, through the stages."""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe import HorizontalPair, rotd
from rockframe.cli.main import main
from rockframe.record import Record
from rockframe.results.records import read_records
from rockframe.results.response import open_response
from rockframe.results.screen import read_screening

STEP = 0.005


def esm(folder: Path, component: str, first: int, later: float = 0.0, before: str = "") -> None:
    """Write an ESM file of 30 s with a motion at 15 s, which begins at this sample or later [s].
    The text before the component in the file's name may state the location.
    """
    time = STEP * np.arange(6000)
    noise = np.random.default_rng(sum(component.encode())).standard_normal(time.size)
    samples = [f"{a:.6f}" for a in (100.0 * noise * np.exp(-(((time - 15.0) / 3.0) ** 2)))[first:]]
    header = {
        "EVENT_NAME": "GREECE",
        "NETWORK": "HI",
        "STATION_CODE": "ARS1",
        "DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS": f"20190728_1609{first * STEP + later:09.6f}",
        "SAMPLING_INTERVAL_S": STEP,
        "NDATA": len(samples),
        "DURATION_S": STEP * len(samples),
        "STREAM": component,
        "UNITS": "cm/s^2",
        "PGA_CM/S^2": max(samples, key=lambda sample: abs(float(sample))),
        "BASELINE_CORRECTION": "BASELINE REMOVED",
        "HEADER_FORMAT": "DYNA 1.2",
        "DATA_TYPE": "ACCELERATION",
        "PROCESSING": "manual (Paolucci et al., 2011)",
    }
    lines = [f"{key}: {value}" for key, value in header.items()]
    (folder / f"{before}{component}.ASC").write_text("\n".join([*lines, "USER1: ", *samples, ""]))


def ingested(folder: Path, *words: str) -> Path:
    output = folder / "records.nc"
    assert main(["ingest", str(folder / "in"), "--output", str(output), *words]) == 0
    return output


def station(folder: Path, later: float = 0.0) -> Path:
    """Write the east component from its first sample on, and others 5 s and some time later."""
    (folder / "in").mkdir()
    esm(folder / "in", "HNE", 0)
    for component in ("HNN", "HNZ"):
        esm(folder / "in", component, 1000, later)
    return folder


@pytest.mark.parametrize("later", [0.0, 1e-6, 2e-4])
def test_channels_that_begin_later_are_a_pair_with_its_vertical(
    tmp_path: Path, later: float
) -> None:
    path = ingested(station(tmp_path, later=later))
    east, north, _ = records = read_records(path)
    assert [record.acceleration.size for record in records] == [6000, 5000, 5000]
    cut = Record(
        record_id="cut", acceleration=east.acceleration[1000:], time_step=STEP, azimuth=90.0
    )
    whole = Record(record_id="n", acceleration=north.acceleration, time_step=STEP, azimuth=0.0)
    with xr.open_dataset(path) as written:
        found = written["pga_rotd100"].values
    assert found[0] == found[1] == rotd(HorizontalPair(cut, whole)).percentile(100)
    output = ("--output", str(tmp_path / "out.nc"), "--structure", "bridge-bent")
    assert main(["respond", str(path), *output, "--vertical", "--margins", "none"]) == 0
    with open_response(tmp_path / "out.nc") as response:
        assert len(response.records) == 3  # each component, and both together
    quick = ("--margins", "none", "--scales", "1:2:2")
    assert main(["screen", str(path), *output, *quick]) == 0
    assert read_screening(tmp_path / "out.nc")["cluster"].values.tolist() == [0, 0, 0]
    turned = read_records(ingested(tmp_path, "--azimuth-degree", "0"))
    assert [record.acceleration.size for record in turned] == [5000, 5000]
    np.testing.assert_array_equal(turned[0].acceleration, north.acceleration)


def test_channels_between_samples_are_no_pair_and_one_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = ingested(station(tmp_path, later=0.002))
    reason = (
        "the first samples of 'HNE' and 'HNN' are 5.002 s apart, 1000.4 time steps. Must be whole "
        "time steps, within 0.05 of one."
    )
    assert f"no RotD: HNE, HNN: {reason}\n" in capsys.readouterr().out
    ingested(tmp_path, "--json")
    assert json.loads(capsys.readouterr().out)["unpaired"] == {"HNE": reason, "HNN": reason}
    with xr.open_dataset(path) as written:
        assert np.isnan(written["pga_rotd100"].values).all()
        assert written["unpaired"].values.tolist() == [reason, reason, ""]
    words = ("--output", str(tmp_path / "out.nc"), "--structure", "bridge-bent")
    assert main(["screen", str(path), *words, "--margins", "none", "--scales", "1:2:2"]) == 1
    assert f"rejected: HNE-both: {reason}\n" in capsys.readouterr().err
    assert read_screening(tmp_path / "out.nc")["cluster"].values.tolist() == [0, 0]


@pytest.mark.parametrize("later", [0.0, 1e-6])
def test_two_instruments_of_a_station_are_two_pairs_and_one_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], later: float
) -> None:
    (tmp_path / "in").mkdir()
    for k, (location, component) in enumerate(product(("00", "10"), ("HNE", "HNN", "HNZ"))):
        esm(tmp_path / "in", component, 0, k * later, f"HI.ARS1.{location}.")
    path = ingested(tmp_path)
    assert "no RotD" not in capsys.readouterr().out
    with xr.open_dataset(path) as written:
        assert (written["unpaired"] == "").all()
        assert np.isfinite(written["pga_rotd100"].values[written["azimuth"] >= 0.0]).all()
    turned = read_records(ingested(tmp_path, "--azimuth-degree", "30"))
    assert [one.record_id for one in turned if one.azimuth == 30.0] == [
        f"HI.ARS1.{location}.HNE-rotated-30" for location in ("00", "10")
    ]
    words = ("--output", str(tmp_path / "out.nc"), "--structure", "bridge-bent", "--vertical")
    for path in (ingested(tmp_path), ingested(tmp_path, "--azimuth-degree", "30")):
        assert main(["screen", str(path), *words, "--margins", "none", "--scales", "1:2:2"]) == 0
        assert set(read_screening(tmp_path / "out.nc")["cluster"].values.tolist()) == {0}
