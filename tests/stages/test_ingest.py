"""Inputs of the ingest stage: it lists every file that it opened, with its hash."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe.errors import RockframeWarning
from rockframe.options.ingest import IngestOptions
from rockframe.provenance import sha256_of
from rockframe.record import Record
from rockframe.stages.ingest import ingest_stage
from rockframe.study.structures import bundled_records


@pytest.fixture
def deep(tmp_path: Path) -> Path:
    """A folder with a subfolder of miniSEED files and their StationXML, from the shared records."""
    source = Path(__file__).resolve().parents[3] / "shared" / "records" / "formats" / "miniseed"
    if not source.is_dir():
        pytest.skip("no folder 'shared/records' beside the repository")
    (tmp_path / "in").mkdir()
    shutil.copytree(source, tmp_path / "in" / "CLC")
    return tmp_path / "in"


def attributes(path: Path) -> tuple[dict[str, str], dict[str, object]]:
    with xr.open_dataset(path) as dataset:
        return json.loads(dataset.attrs["input_sha256"]), json.loads(dataset.attrs["parameters"])


def test_station_xml_and_water_level_are_inputs(deep: Path, tmp_path: Path) -> None:
    output = tmp_path / "records.nc"
    options = IngestOptions(water_level_db=60.0)
    result = ingest_stage([deep], output, options=options, workers=0)
    inputs, parameters = attributes(output)
    files = {f"CLC/{path.name}": sha256_of(path) for path in (deep / "CLC").iterdir()}
    assert inputs == files == result.inputs
    assert len(files) == 4
    assert parameters["water_level_db"] == 60.0
    assert [e.file for e in result.entries if e.status == "unread"] == ["CLC/CI.CLC.xml"]


def test_a_given_station_xml_is_an_input(deep: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "instruments.xml"
    (deep / "CLC" / "CI.CLC.xml").rename(elsewhere)
    ingest_stage(
        [deep / "CLC" / "CI.CLC..HNE.mseed"],
        tmp_path / "records.nc",
        options=IngestOptions(station_xml=elsewhere),
        workers=0,
    )
    inputs, parameters = attributes(tmp_path / "records.nc")
    assert inputs["instruments.xml"] == sha256_of(elsewhere)
    assert parameters["station_xml"] == "instruments.xml"


def test_the_offset_of_what_is_said_to_be_uncorrected_is_no_late_trigger(tmp_path: Path) -> None:
    time = 0.01 * np.arange(4001)
    motion = 0.3 * np.sin(9.0 * time) * np.exp(-(((time - 20.0) / 4.0) ** 2)) + 0.2
    lines = [f"{t:.2f},{a:.7f}\n" for t, a in zip(time, motion, strict=True)]
    source = tmp_path / "offset.csv"
    source.write_text("time_s,acc_g\n" + "".join(lines))
    output = tmp_path / "records.nc"
    [record] = ingest_stage(
        [source], output, options=IngestOptions(uncorrected=True), workers=0
    ).accepted
    assert record.corrected_here
    assert not record.passport.late_trigger


def test_changed_corners_and_azimuths_warn(tmp_path: Path) -> None:
    motion = bundled_records() / "Ridgecrest2019-CLC.V1"
    options = IngestOptions(band_pass_hz=(0.1, 200.0))
    with pytest.warns(RockframeWarning, match=r"0\.1 200: records with .* filtered up to 40 Hz\."):
        ingest_stage([motion], tmp_path / "records.nc", options, workers=0)
    with pytest.warns(RockframeWarning, match="azimuth 400 degrees .* as 40"):
        IngestOptions(azimuth_degree=400.0)


def test_catalogues_of_all_folders_are_inputs(tmp_path: Path) -> None:
    heading = "file,event,station,network,magnitude,epicentral_distance_km,source\n"
    for k, folder in enumerate(("in", "in/deeper")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{k}.csv").write_text("time_s,acc_g\n0,0.1\n0.1,0.2\n0.2,-0.3\n")
        (tmp_path / folder / "catalogue.csv").write_text(f"{heading}{k}.csv,Kobe,,,{k},,x\n")
    result = ingest_stage([tmp_path / "in"], tmp_path / "records.nc", workers=0)
    assert sorted(result.inputs) == [
        "0.csv", "catalogue.csv", "deeper/1.csv", "deeper/catalogue.csv"
    ]  # fmt: skip
    with xr.open_dataset(tmp_path / "records.nc") as dataset:
        assert dataset["magnitude"].values.tolist() == [0.0, 1.0]


def test_a_record_is_built_by_its_reader_and_once_more(
    bundled_records: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Facts, identifier and correction come in one step; both horizontals once more for RotD."""
    built: list[str] = []
    checks = Record.__post_init__

    def build(record: Record) -> None:
        built.append(record.record_id)
        checks(record)

    monkeypatch.setattr(Record, "__post_init__", build)
    motion = bundled_records / "Ridgecrest2019-CLC.V1"
    done = ingest_stage([motion], tmp_path / "records.nc", workers=0)
    assert len(built) == (2 + 1) * len(done.accepted)
    del built[:]
    upward = tmp_path / "up.csv"
    upward.write_text(
        "time_s,acc_g\n" + "".join(f"{k / 100},{0.1 * (-1) ** k}\n" for k in range(999))
    )
    ingest_stage([upward], tmp_path / "one.nc", workers=0)
    assert len(built) == 2
