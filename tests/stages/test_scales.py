"""The change with amplitude: `respond --scales`, its table, JSON and figure."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tests.screening import sine, stored, three

from rockframe import (
    Ensemble,
    RespondOptions,
    ingest_stage,
    read_structures,
    respond,
    respond_stage,
)
from rockframe.cli.main import main
from rockframe.figures.margins import draw_scales
from rockframe.results.records import open_records
from rockframe.results.tables.table import response_rows
from rockframe.results.versions import VersionSources
from rockframe.rocking import as_ground, ensemble_responses
from rockframe.stages.common import choose_structures
from rockframe.stages.respond import scaled_rows
from rockframe.study.structures import SHIPPED_STRUCTURES

STRUCTURES = """
[[structure]]
name = "stout"
height_m = 6.0
width_m = 0.8
mass_ratio = 2.0

[[structure]]
name = "slender"
height_m = 3.0
width_m = 0.35
"""
OPTIONS = RespondOptions(margins="none", histories="none", ensemble=Ensemble(members=16))
SCALES = (0.9, 1.0, 1.1, 2.0)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two records and two structures."""
    folder = tmp_path_factory.mktemp("scales")
    stored([sine("quiet", 1.4), sine("loud", 2.0)], folder)
    (folder / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def rows(home: Path) -> list[dict[str, Any]]:
    structures = home / "structures.toml"
    found, rejected = scaled_rows(home / "records.nc", SCALES, OPTIONS, structures_path=structures)
    assert not rejected
    return found


def test_at_scale_1_the_rows_are_those_of_the_stage(
    home: Path, rows: list[dict[str, Any]], tmp_path: Path
) -> None:
    output = tmp_path / "response.nc"
    structures = home / "structures.toml"
    respond_stage(home / "records.nc", output, OPTIONS, structures_path=structures)
    expected = {(row["record_id"], row["structure"]): row for row in response_rows(output)}
    at_one = [row for row in rows if row["scale"] == 1.0]
    assert len(at_one) == len(expected) == 4
    for row in at_one:
        other = expected[row["record_id"], row["structure"]]
        for key in row.keys() - {"scale"}:
            same = [row[key]], [other[key]]
            (assert_array_equal if isinstance(row[key], str) else assert_allclose)(*same)


def test_each_row_is_the_response_to_the_scaled_motion(
    home: Path, rows: list[dict[str, Any]]
) -> None:
    frames = {frame.name: frame for frame in read_structures(home / "structures.toml")}
    with open_records(home / "records.nc") as file:
        motions = {name: as_ground(file.read(name)) for name in file.names}
    assert [row["scale"] for row in rows] == [*SCALES] * 4
    for row in rows:
        frame = frames[row["structure"]]
        ground = motions[row["record_id"]].scaled(row["scale"])
        nominal = respond(frame, ground)
        [[spread]] = ensemble_responses([ground], [frame], OPTIONS.ensemble)
        assert row["verdict"] == nominal.verdict.name.lower()
        ratio = row["peak_rotation_ratio"]  # of the vectorised kernel, as those of the members
        assert_allclose(ratio, nominal.peak_rotation_ratio, rtol=1e-12)
        assert row["share_overturned"] == spread.share_overturned
        band = [row[f"peak_rotation_ratio_{part}"] for part in (16, 50, 84)]
        assert_allclose(band, spread.bands.peak_rotation_ratio, rtol=1e-12)
        assert_allclose(row["peak_u_84_m"], spread.bands.peak_u[2], rtol=1e-12)


def test_versions_of_a_record_are_scaled_with_it(bundled_records: Path, tmp_path: Path) -> None:
    """Members are shaken by versions with other corners of the band-pass, each times the scale."""
    path = tmp_path / "records.nc"
    ingest_stage([bundled_records / "Ridgecrest2019-TOW2.V1"], path, workers=0)
    name, scale = "Ridgecrest2019-TOW2-090", 1.3
    options = OPTIONS.model_copy(update={"structure": "apollo-column"})
    [row], _ = scaled_rows(path, [scale], options, records=[name])
    with open_records(path) as file:
        record = file.read(name)
        made_of = VersionSources.of(file, options.ensemble, [name]).uncertain(record)
        assert made_of is not None
        versions = made_of.versions(options.ensemble, record)
    grounds = tuple(ground.scaled(scale) for ground in versions.grounds)
    scaled = replace(versions, grounds=grounds)
    [frame] = choose_structures(SHIPPED_STRUCTURES, "apollo-column")
    motion = as_ground(record).scaled(scale)
    [[expected]] = ensemble_responses([motion], [frame], options.ensemble, [scaled])
    band = [row[f"peak_rotation_ratio_{part}"] for part in (16, 50, 84)]
    assert_allclose(band, expected.bands.peak_rotation_ratio, rtol=1e-12)


def test_without_an_ensemble_rows_are_nominal(home: Path) -> None:
    alone = RespondOptions(ensemble=Ensemble(members=0), structure="slender")
    structures = home / "structures.toml"
    found, _ = scaled_rows(
        home / "records.nc", [1.0], alone, structures_path=structures, records=["loud"]
    )
    [row] = found
    assert row["record_id"] == "loud"
    assert "share_overturned" not in row


def test_a_record_that_falls_faster_than_gravity_is_rejected(tmp_path: Path) -> None:
    """The vertical record reaches 0.6 g: twice the motion would lose contact."""
    stored(three("s", 5.9), tmp_path)
    vertical = OPTIONS.model_copy(update={"vertical": True, "structure": "bridge-bent"})
    found, rejected = scaled_rows(tmp_path / "records.nc", [1.0, 2.0], vertical)
    assert not found
    assert "lose contact" in rejected[0].reason


def command(home: Path, tmp_path: Path, *more: str) -> list[str]:
    words = ["respond", str(home / "records.nc"), "--structures", str(home / "structures.toml")]
    words += ["--margins", "none", "--ensemble-members", "16", "--output", str(tmp_path / "r.nc")]
    return [*words, *more]


def test_the_command_prints_and_draws_the_change(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], rows: list[dict[str, Any]]
) -> None:
    scaled = ["--scales", *map(str, SCALES), "--record", "quiet"]
    words = command(home, tmp_path, *scaled, "--figures", str(tmp_path / "drawn"))
    assert main(words) == 0
    printed = capsys.readouterr().out.partition("Change with the amplitude")[2]
    lines = [line.split() for line in printed.splitlines()]
    assert ["quiet", "stout", "0.9"] in [line[:3] for line in lines]
    assert ["quiet", "slender", "0.9"] in [line[:3] for line in lines]
    assert not any("loud" in line for line in lines)
    assert [line[0] for line in lines if line[:1] == ["1.1"]] == ["1.1", "1.1"]
    assert str(tmp_path / "drawn" / "scales" / "quiet.png") in printed
    assert main([*command(home, tmp_path, *scaled), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["scales"]
    quiet = [row for row in rows if row["record_id"] == "quiet"]
    assert [row["scale"] for row in found] == [row["scale"] for row in quiet]
    assert [row["share_overturned"] for row in found] == [row["share_overturned"] for row in quiet]


def test_a_long_table_leaves_out_far_scales_and_never_1(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = command(home, tmp_path, "--scales", "0.5:3:26", "--record", "quiet")
    assert main([*words, "--structure", "slender"]) == 0
    table = capsys.readouterr().out.partition("Change with the amplitude")[2]
    lines = (line.replace("quiet", "").replace("slender", "") for line in table.splitlines())
    shown = [line.split() for line in lines if line.strip()[:1].isdigit()]
    scales = [float(line[0]) for line in shown]
    assert scales == [round(0.5 + 0.1 * k, 1) for k in range(21)]
    assert 1.0 in scales
    assert "The 21 of 26 scales that are nearest to 1; --json and --figures have all." in table


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--scales", "1.05:0.95:21"], "--scales 1.045 after 1.05. Must increase."),
        (["--scales", "1:1:3"], "--scales 1 after 1. Must increase."),
        (["--scales", "0:1:5"], "--scales with 0. Must be above 0."),
        (["--scales", "1", "--record", "none"], "Invalid record 'none'. Must be one of"),
        (
            ["--record", "quiet"],
            "--record has no effect without --scales. State scales, such as 0.95:1.05:21.",
        ),
        (["--figures", "drawn"], "--figures has no effect without --forces or --scales"),
    ],
)
def test_what_cannot_be_scaled_is_one_line_and_writes_nothing(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], said: str
) -> None:
    assert main(command(home, tmp_path, *more)) == 2
    caught = capsys.readouterr().err
    assert said in caught
    assert len(caught.splitlines()) == 1
    assert not (tmp_path / "r.nc").exists()


def test_the_figure_shows_falls_at_its_edge() -> None:
    """Bands that reach members that overturn end at the edge, and crosses mark nominal falls."""

    def row(scale: float, verdict: str, peak: float, *band: float) -> dict[str, Any]:
        shares = {"share_overturned": 0.25 * scale, "share_overturned_low": 0.0}
        bands = zip((16, 50, 84), band, strict=True)
        return {
            **{"structure": "bent", "scale": scale, "verdict": verdict},
            "peak_rotation_ratio": peak,
            **shares,
            "share_overturned_high": 1.0,
            **{f"peak_rotation_ratio_{part}": one for part, one in bands},
        }

    rows = [
        row(1.0, "stands", 0.4, 0.3, 0.5, 0.8),
        row(2.0, "overturns", 9.0, 0.4, math.inf, math.inf),
    ]
    peaks, shares = draw_scales(rows, "shake").figure.axes
    edge = peaks.get_ylim()[1]
    assert_allclose(edge, 1.15 * 0.8)
    median, points, crosses, _ = (
        np.asarray(line.get_xydata(), dtype=float) for line in peaks.lines
    )
    assert_allclose(median, [[1.0, 0.5], [2.0, edge]])
    assert_allclose(points, [[1.0, 0.4], [2.0, math.nan]])
    assert_allclose(crosses, [[2.0, edge]])
    assert_allclose(np.asarray(shares.lines[0].get_ydata(), dtype=float), [25.0, 50.0])
    beyond = row(1.0, "stands", 2.0, 0.3, 0.5, 0.8)  # a rotation beyond the slenderness may return
    assert_allclose(draw_scales([beyond], "shake").figure.axes[0].get_ylim()[1], 1.15 * 2.0)
    nominal = [{k: v for k, v in one.items() if "share" not in k} for one in rows]
    assert len(draw_scales(nominal, "shake").figure.axes) == 1
