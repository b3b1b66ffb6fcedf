"""Corners of real records: shared by both horizontals, stated everywhere, close to gmprocess's."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rockframe.cli.main import main
from rockframe.options.ingest import IngestOptions
from rockframe.record import Record
from rockframe.results.records import open_records, write_records
from rockframe.signals.corner import UNCHANGED, CornerSource
from rockframe.stages.ingest import ingest_stage
from rockframe.stages.ingesting.acceptance import Ingested

SHARED = Path(__file__).resolve().parents[3] / "shared"


def archived(name: str) -> Path:
    """Return a file of the archive, of which the bundled record is a part."""
    path = SHARED / "records" / "ridgecrest2019" / name
    if not path.is_file():
        pytest.skip("no folder 'shared/records' beside the repository")
    return path


def ingested(paths: Sequence[Path], folder: Path, **options: object) -> Ingested:
    return ingest_stage(paths, folder / "records.nc", IngestOptions(**options), workers=0)


def exported(name: str) -> list[dict[str, str]]:
    """Return a table that gmprocess 2.8.0 exported for the same three files."""
    path = SHARED / "gmprocess_exports" / f"default_metrics_{name}.csv"
    if not path.is_file():
        pytest.skip("no folder 'shared/gmprocess_exports' beside the repository")
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """The three files of the archive."""
    folder = tmp_path_factory.mktemp("whole")
    ingested([archived(n) for n in ("CICCC.RAW", "CICLC.v1", "CITOW2.RAW")], folder)
    with xr.open_dataset(folder / "records.nc") as dataset:
        return dataset.load()


def test_corners_and_velocities_are_close_to_those_of_gmprocess(whole: xr.Dataset) -> None:
    """Both choose from noise and displacement, with other windows and criteria.

    With 0.1 Hz, as before, the corner of CLC was 2.5 times theirs, and the velocity 11 % off.
    """
    ours = whole.isel(record=whole["component"].values == "360").set_coords("station")
    for row in exported("rotd(percentile=50.0)"):
        one = ours.isel(record=ours["station"].values.tolist().index(row["StationCode"]))
        corner = float(one["filter_low"]) / float(row["H1Highpass"])
        assert 1 / 1.6 < corner < 1.6
        assert 100.0 * float(one["pgv_rotd50"]) == pytest.approx(float(row["PGV"]), rel=0.09)


def test_both_horizontals_have_the_higher_corner(whole: xr.Dataset) -> None:
    """Alone, CLC-090 would have 0.04 Hz; its rotations with CLC-360 would mix two filters."""
    corners = dict(zip(whole["record_id"].values, whole["filter_low"].values, strict=True))
    assert corners["CICLC-090"] == corners["CICLC-360"] == 0.063
    assert corners["CITOW2-090"] == corners["CITOW2-360"] < corners["CITOW2-UP"]


def test_a_component_alone_has_its_own_corner(tmp_path: Path) -> None:
    archived("CICLC.v1")
    folder = SHARED / "records" / "formats" / "miniseed"
    corner = {}
    for names in (["HNE"], ["HNN"], ["HNE", "HNN", "HNZ"]):
        files = [folder / f"CI.CLC..{name}.mseed" for name in names]
        accepted = ingested(files, tmp_path).accepted
        corner["".join(names)] = [one.passport.corner.frequency for one in accepted]
    assert corner["HNE"] == [0.04]
    assert corner["HNN"] == [0.05]
    assert corner["HNEHNNHNZ"] == [0.05, 0.05, 0.063]


def test_a_stated_corner_wins_and_is_said_to_be_stated(
    bundled_records: Path, tmp_path: Path
) -> None:
    result = ingested([bundled_records / "Ridgecrest2019-CCC.V1"], tmp_path, band_pass_hz=(0.2, 30))
    for one in result.accepted:
        assert one.passport.corner.frequency == 0.2
        assert one.passport.corner.source is CornerSource.STATED
        assert one.processing[0] == "lower corner: 0.2 Hz, as stated"
        assert "0.2 to 30 Hz" in one.processing[-1]


def test_the_samples_are_those_of_the_chosen_corner(bundled_records: Path, tmp_path: Path) -> None:
    file = bundled_records / "Ridgecrest2019-CLC.V1"
    (chosen,) = {one.passport.corner.frequency for one in ingested([file], tmp_path).accepted}
    with xr.open_dataset(tmp_path / "records.nc") as dataset:
        samples = dataset["acceleration"].values
    ingested([file], tmp_path, band_pass_hz=(chosen, 40.0))
    with xr.open_dataset(tmp_path / "records.nc") as dataset:
        np.testing.assert_array_equal(samples, dataset["acceleration"].values)


def test_tables_and_files_state_the_corner_and_its_source(
    bundled_records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "records.nc"
    names = [str(bundled_records / f"Ridgecrest2019-{name}.V1") for name in ("CCC", "TOW2")]
    main(["ingest", *names, "--output", str(output), "--json"])
    rows = json.loads(capsys.readouterr().out)["accepted"]
    expected = [(0.063, "signal_to_noise")] * 5 + [(0.08, "displacement")]
    assert [(row["corner_hz"], row["corner_source"]) for row in rows] == expected
    assert rows[0]["usable_periods_s"][1] == pytest.approx(1.0 / (1.25 * 0.063))
    with output.with_suffix(".csv").open(newline="") as stream:
        table = [(float(r["corner_hz"]), r["corner_source"]) for r in csv.DictReader(stream)]
    assert table == expected
    with xr.open_dataset(output) as dataset:
        source = dataset["corner_source"]
        meanings = source.attrs["flag_meanings"].split()
        written = [meanings[value] for value in source.values]
        stated = list(zip(dataset["corner_frequency"].values.tolist(), written, strict=True))
    assert stated == expected
    main(["ingest", *names, "--output", str(output)])
    assert "from 0.08 Hz (displacement)" in capsys.readouterr().out


def test_an_open_file_tells_the_corner_of_a_record(bundled_records: Path, tmp_path: Path) -> None:
    source = tmp_path / "shake.csv"
    source.write_text("time_s,acc_g\n0,0.1\n0.1,0.2\n0.2,-0.3\n")
    accepted = ingested([bundled_records / "Ridgecrest2019-TOW2.V1", source], tmp_path).accepted
    with open_records(tmp_path / "records.nc") as records:
        for one in accepted[:-1]:
            assert records.corner(one.record_id) == one.passport.corner
        assert records.corner("shake").source is CornerSource.NOT_CORRECTED
    write_records(
        [(accepted_record(), None)], tmp_path / "records.nc", input_sha256={}, parameters={}
    )
    with open_records(tmp_path / "records.nc") as records:
        assert records.corner("shake") is UNCHANGED


def accepted_record() -> Record:
    """Return a record for a file without passports."""
    return Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)


def test_rotated_motions_have_the_corner_of_their_components(
    bundled_records: Path, tmp_path: Path
) -> None:
    file = bundled_records / "Ridgecrest2019-TOW2.V1"
    north, *_ = ingested([file], tmp_path, azimuth_degree=30.0).accepted
    assert north.passport.corner.frequency == 0.063
    assert north.passport.corner.source is CornerSource.SIGNAL_TO_NOISE


def test_archives_that_correct_have_no_corner_of_ours(tmp_path: Path) -> None:
    source = tmp_path / "shake.csv"
    source.write_text("time_s,acc_g\n0,0.1\n0.1,0.2\n0.2,-0.3\n")
    (one,) = ingested([source], tmp_path).accepted
    assert one.passport.corner.source is CornerSource.NOT_CORRECTED
    assert np.isnan(one.passport.corner.frequency)
