"""Motions in both directions, from the records of a station to the rows of the responses."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from rockframe import (
    Ensemble,
    PairAcceleration,
    Record,
    RespondOptions,
    index_stage,
    respond_stage,
    wobble,
    wobbling_ensemble,
)
from rockframe.record import Orientation
from rockframe.results.records import write_records
from rockframe.results.response import open_response
from rockframe.results.tables.envelope import force_envelope, of_motions_that_count
from rockframe.results.tables.forces import force_rows, forces_in_words
from rockframe.results.tables.notes import summary_notes, with_directions
from rockframe.results.tables.summary import summary_rows
from rockframe.results.tables.table import response_rows
from rockframe.stages.common import Batch
from rockframe.structures.contract import Structure
from rockframe.study.structures import read_structures
from rockframe.wobbling.reactions import wobbling_force_bands

FEW = Ensemble(members=16)
PLAIN = RespondOptions(margins="none", ensemble=FEW)
STRUCTURES = """
[[structure]]
name = "round"
height_m = 3.0
width_m = 0.5
section = "circular"

[[structure]]
name = "square"
height_m = 3.0
width_m = 0.5

[[structure]]
name = "both"
height_m = 3.0
width_m = 0.5
section_both = "circular"
"""


def component(station: str, azimuth: float, size: float, **facts: object) -> Record:
    time = 0.01 * np.arange(600)
    known = {
        "record_id": f"{station}-{azimuth:03.0f}",
        "component": f"{azimuth:03.0f}",
        "acceleration": size * np.sin(7.0 * time + math.radians(azimuth)) * np.exp(-0.5 * time),
        "azimuth": azimuth,
    }
    return Record(
        time_step=0.01,
        station=station,
        event="shake",
        orientation=Orientation.HORIZONTAL,
        **known | facts,
    )


EAST, NORTH = component("AAA", 90.0, 3.0), component("AAA", 0.0, 2.0)
OTHERS = [component("BBB", 10.0, 2.5), component("BBB", 100.0, 2.0)]
ALONE = component("CCC", 0.0, 2.5)


def responded(folder: Path, records: list[Record], options: RespondOptions = PLAIN) -> Path:
    return write(folder, records, options)[0]


def write(
    folder: Path, records: list[Record], options: RespondOptions = PLAIN
) -> tuple[Path, tuple[str, ...]]:
    """Return the file of responses, and the reasons of rejected motions."""
    rows = ((record, None) for record in records)
    write_records(rows, folder / "records.nc", input_sha256={}, parameters={})
    (folder / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    rejected = respond_stage(
        folder / "records.nc",
        folder / "response.nc",
        options,
        structures_path=folder / "structures.toml",
    )
    return folder / "response.nc", tuple(f"{one.file}: {one.reason}" for one in rejected)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return responded(tmp_path_factory.mktemp("both"), [EAST, NORTH, *OTHERS, ALONE])


def structures(path: Path) -> dict[str, Structure]:
    return {frame.name: frame for frame in read_structures(path.with_name("structures.toml"))}


def test_each_station_with_both_components_has_one_more_row(path: Path) -> None:
    rows = [row for row in response_rows(path) if row["structure"] == "round"]
    names = [row["record_id"] for row in rows]
    assert names == ["AAA-090", "AAA-000", "AAA-both", "BBB-010", "BBB-100", "BBB-both", "CCC-000"]
    stated = [row["components"] for row in rows]
    assert stated == ["", "", "AAA-090 AAA-000", "", "", "BBB-010 BBB-100", ""]


def test_the_row_is_that_of_both_components(path: Path) -> None:
    """Peaks, share and histories are those of `wobble` and `wobbling_ensemble`."""
    motion = PairAcceleration(EAST.acceleration, NORTH.acceleration, 0.01)
    for name in ("round", "both"):
        frame = structures(path)[name]
        expected = wobble(frame, motion)  # type: ignore[arg-type]
        spread = wobbling_ensemble(frame, motion, FEW)  # type: ignore[arg-type]
        with open_response(path) as file:
            found = file.sel(record="AAA-both", structure=name)
        for history in ("theta", "phi", "u_x", "u_y", "u", "v"):
            assert_array_equal(found[history], getattr(expected, history))
        assert found["peak_rotation_ratio"] == expected.peak_rotation_ratio > 0.0
        assert found["share_overturned"] == spread.share_overturned
        assert_array_equal(found["peak_u_band"], spread.bands.peak_u)
        assert np.nanmax(np.hypot(found["u_x"], found["u_y"])) <= float(found["peak_u"]) + 1e-12


def test_rectangular_columns_are_not_computed_and_keep_their_plane(path: Path) -> None:
    rows = {(row["record_id"], row["structure"]): row for row in response_rows(path)}
    square = rows["AAA-both", "square"]
    assert square["verdict_words"] == "not computed"
    assert square["not_computed"] == "not computed for both directions: columns not circular"
    assert math.isnan(square["peak_u_m"])
    assert rows["AAA-090", "square"]["peak_u_m"] == rows["AAA-090", "both"]["peak_u_m"]
    with open_response(path) as file:
        plane = file.sel(record="AAA-090", structure="both")
    assert np.isnan(plane["phi"]).all()


def test_both_directions_count_for_round_columns(path: Path) -> None:
    summary = summary_rows(response_rows(path))
    assert [(row["structure"], row["directions"], row["records"]) for row in summary] == [
        ("round", 2, 2),
        ("square", 1, 5),
        ("both", 2, 2),
    ]
    first, lone, second, *_ = summary_notes(summary)
    assert first.startswith("round, both: only motions in both directions count")
    assert lone == "In no motion in both directions, so not counted for round columns: CCC-000."
    assert second.startswith("square: in one plane; not computed for both directions")


def test_the_rows_in_one_plane_do_not_depend_on_those_in_both(path: Path, tmp_path: Path) -> None:
    options = PLAIN.model_copy(update={"both_directions": False})
    alone = responded(tmp_path, [EAST, NORTH, *OTHERS, ALONE], options)
    with xr.open_dataset(alone) as plane, xr.open_dataset(path) as both:
        assert "components" not in plane
        rows = both["components"].values == ""
        for name, values in plane.variables.items():
            if values.dims[:1] == ("record",) and "spread" not in values.dims:
                assert_array_equal(values, both[name].values[rows], err_msg=str(name))


@pytest.mark.parametrize("count", [2, 5])
def test_batches_together_are_the_whole(path: Path, tmp_path: Path, count: int) -> None:
    """The components may be in different batches, and a batch may have no pair."""
    parts = []
    for number in range(1, count + 1):
        parts.append(tmp_path / f"{number}.nc")
        respond_stage(
            path.with_name("records.nc"),
            parts[-1],
            PLAIN,
            structures_path=path.with_name("structures.toml"),
            batch=Batch(number, count),
        )
    index_stage(parts, tmp_path / "index.nc")
    opened = partial(xr.open_dataset, engine="rockframe")
    with (
        opened(tmp_path / "index.nc") as index,
        opened(path) as whole,
    ):
        assert index.equals(whole)


def test_a_pair_that_cannot_be_combined_is_rejected_with_the_reason(tmp_path: Path) -> None:
    slow = replace(NORTH, time_step=0.02)
    (tmp_path / "slow").mkdir()
    (reason,) = write(tmp_path / "slow", [EAST, slow])[1]
    assert reason.startswith("AAA-both: time steps [s] 0.01 and 0.02 of 'AAA-090' and 'AAA-000'.")
    (tmp_path / "near").mkdir()
    (reason,) = write(tmp_path / "near", [EAST, replace(NORTH, azimuth=93.0)])[1]
    assert "3 degrees from parallel. Must be at least 5." in reason


def test_what_was_assumed_of_components_is_stated(tmp_path: Path) -> None:
    oblique = replace(NORTH, azimuth=30.0, component="030", record_id="AAA-030")
    unknown = [replace(one, azimuth=math.nan) for one in OTHERS]
    path = responded(tmp_path, [EAST, oblique, *unknown])
    with xr.open_dataset(path) as file:
        remarks = dict(zip(file["record_id"].values, file["components_remark"].values, strict=True))
    assert remarks["AAA-both"].startswith("components 60 degrees apart: 'AAA-030' resolved at")
    assert remarks["BBB-both"].endswith("unknown: taken as at right angles")
    assert remarks["AAA-090"] == ""


def test_without_round_columns_or_a_second_component_there_is_no_row(tmp_path: Path) -> None:
    square = PLAIN.model_copy(update={"structure": "square"})
    for records, options in (([EAST, NORTH], square), ([EAST, ALONE], PLAIN)):
        with xr.open_dataset(responded(tmp_path, records, options)) as file:
            assert "components" not in file
            assert "not_computed" not in file


def test_without_any_second_component_one_line_says_what_is_missing(tmp_path: Path) -> None:
    """Only for structures of round columns, and only if both directions are wanted."""
    plane = PLAIN.model_copy(update={"both_directions": False})
    for options, said in ((PLAIN, True), (plane, False)):
        path = responded(tmp_path, [EAST, ALONE], options)
        with xr.open_dataset(path) as file:
            rows = with_directions(summary_rows(response_rows(path)), file.attrs)
        notes = [note for note in summary_notes(rows) if "no station has both" in note]
        assert len(notes) == said
        assert not said or notes[0].startswith("round, both: in one plane; no station has both")
        assert {row["structure"]: row.get("directions", 1) for row in rows}["square"] == 1


def test_margins_and_forces_are_in_the_row(tmp_path: Path) -> None:
    options = RespondOptions(ensemble=FEW, forces=True)
    strong = [replace(one, acceleration=1.5 * one.acceleration) for one in (EAST, NORTH)]
    path = responded(tmp_path, strong, options)
    row = next(row for row in response_rows(path) if row["components"])
    assert row["robust_scale_10"] <= row["robust_scale_50"]
    assert math.isnan(row["critical_scale"])
    assert math.isnan(row["largest_scale"])
    assert math.isnan(row["safe_islands"])
    assert row["largest_robust_scale"] == 10.0
    with xr.open_dataset(path) as file:
        both = file["components"].values != ""
        assert (file["sampling_changes"].values[both] <= 0).all()


def test_the_envelope_of_forces_counts_motions_in_both_directions_of_round_columns(
    tmp_path: Path,
) -> None:
    options = PLAIN.model_copy(update={"forces": True})
    path = responded(tmp_path, [EAST, NORTH], options)
    with xr.open_dataset(path) as file:
        rows = list(force_rows(file))
    counted = of_motions_that_count(rows, list(response_rows(path)))
    governing: dict[str, set[str]] = {}
    for row in force_envelope(counted):
        governing.setdefault(row["structure"], set()).add(row["record_id"])
    assert governing["round"] == {"AAA-both"}
    assert governing["square"] <= {"AAA-090", "AAA-000"}
    round_rows = [row for row in rows if row["structure"] == "round"]
    assert {row["record_id"] for row in round_rows} == {"AAA-090", "AAA-000", "AAA-both"}
    # columns that roll on their rims hit nothing, and say nothing of an impulse
    rolling = [row for row in round_rows if row["record_id"] == "AAA-both"]
    assert not any("impulse" in row["force"] for row in rolling)
    assert all(math.isfinite(row["value"]) for row in rolling)
    assert "means over 0.01 s" in forces_in_words(rows)
    planar = [row for row in rows if row["record_id"] != "AAA-both"]
    assert "means over" not in forces_in_words(planar)
    assert all(row["value_16"] <= row["value_50"] <= row["value_84"] for row in rolling)
    shear = next(row for row in rolling if row["force"] == "peak_base_shear")
    motion = PairAcceleration(EAST.acceleration, NORTH.acceleration, 0.01)
    bands = wobbling_force_bands(structures(path)["round"], motion, FEW)  # type: ignore[arg-type]
    assert (shear["value_16"], shear["value_50"], shear["value_84"]) == bands.peak_base_shear
