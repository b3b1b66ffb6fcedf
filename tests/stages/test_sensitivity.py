"""Rank correlations of the spreads in response.nc, and in what `respond --sensitivity` prints."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

from rockframe import Ensemble, RespondOptions, ingest_stage, respond_stage
from rockframe.cli.main import main
from rockframe.figures.sensitivity import draw_sensitivity
from rockframe.results.records import open_records, write_records
from rockframe.results.tables.sensitivity import sensitivity_rows, sensitivity_words
from rockframe.results.versions import VersionSources
from rockframe.rocking import correlation_by_chance, ensemble_responses, spreads_of
from rockframe.study.structures import SHIPPED_STRUCTURES, read_structures
from rockframe.web import bars_svg


@pytest.fixture(scope="module")
def file(bundled_records: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sensitivity") / "records.nc"
    ingest_stage([bundled_records / "Ridgecrest2019-TOW2.V1"], path, workers=0)
    return path


def test_the_file_has_the_correlations_of_the_ensemble(file: Path, tmp_path: Path) -> None:
    options = RespondOptions(margins="none", histories="none", both_directions=False)
    respond_stage(file, tmp_path / "response.nc", options)
    frames = read_structures(SHIPPED_STRUCTURES)
    with open_records(file) as records:
        names = records.names[:2]
        motions = [records.read(name) for name in names]
        sources = VersionSources.of(records, Ensemble(), names)
        made_of = [sources.uncertain(record) for record in motions]
    versions = [
        one.versions(Ensemble(), record) if one else None
        for one, record in zip(made_of, motions, strict=True)
    ]
    expected = ensemble_responses(motions, frames, None, versions)
    with xr.open_dataset(tmp_path / "response.nc") as dataset:
        assert tuple(dataset["spread"].values) == spreads_of(Ensemble())
        for i, row in enumerate(expected):
            for k, one in enumerate(row):
                stored = dataset["rank_correlation"].values[i, k]
                assert_allclose(stored, [*one.rank_correlations.values()], rtol=1e-12)
        assert_array_equal(dataset["rank_correlation_by_chance"], correlation_by_chance(64))
        rows = list(sensitivity_rows(dataset))
    first = {name: rows[0][name] for name in spreads_of(Ensemble())}
    most = max(first, key=lambda name: abs(first[name]))
    assert rows[0]["matters_most"] == (most if abs(first[most]) > rows[0]["by_chance"] else "")


def test_without_spreads_or_members_the_file_has_none(file: Path, tmp_path: Path) -> None:
    off = Ensemble(height=0.0, width=0.0, impact_loss=1.0, amplitude=0.0, corner=1.0)
    for ensemble in (off, Ensemble(members=0)):
        options = RespondOptions(
            margins="none", histories="none", ensemble=ensemble, both_directions=False
        )
        respond_stage(file, tmp_path / "response.nc", options)
        with xr.open_dataset(tmp_path / "response.nc") as dataset:
            assert not {"spread", "rank_correlation"} & {*dataset.variables}
            assert not list(sensitivity_rows(dataset))


def test_the_command_prints_what_matters_most(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["respond", str(file), "--margins", "none", "--histories", "none"]
    words += ["--output", str(tmp_path / "response.nc"), "--structure", "apollo-column"]
    assert main([*words, "--sensitivity"]) == 0
    out = capsys.readouterr().out.split("Sensitivity in")[1]
    (line,) = [one for one in out.splitlines() if "TOW2-090" in one]
    assert line.split()[2:4] == ["impact", "loss"]
    assert "5 % exceed 0.25 by chance" in out
    assert main([*words, "--sensitivity", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["sensitivity"]
    *plane, both = found
    assert [row["matters_most"] for row in plane] == ["impact_loss"] * 2
    assert math.isfinite(both["contact_shortening"])  # and its part is small
    assert abs(both["contact_shortening"]) < 3.0 * both["by_chance"]
    assert found[0]["impact_loss"] < -found[0]["by_chance"]
    assert main(words) == 0
    assert "Rank correlation" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("stated", "lack"),
    [
        (["--ensemble-members", "0"], "--ensemble-members is 0"),
        (
            [
                *("--ensemble-height", "0", "--ensemble-width", "0", "--ensemble-amplitude", "0"),
                *("--ensemble-impact-loss", "1", "--ensemble-corner", "1"),
            ],
            "all its spreads are switched off",
        ),
    ],
)
def test_sensitivity_without_an_ensemble_is_refused(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], stated: list[str], lack: str
) -> None:
    output = tmp_path / "response.nc"
    assert main(["respond", str(file), "--output", str(output), "--sensitivity", *stated]) == 2
    assert f"--sensitivity without an ensemble: {lack}." in capsys.readouterr().err
    assert not output.exists()


def test_structures_that_all_members_overturn_show_dashes(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with open_records(file) as records:
        strong = records.read("Ridgecrest2019-TOW2-090")
    path = tmp_path / "strong.nc"
    ten_times = replace(strong, acceleration=10.0 * strong.acceleration)
    write_records([(ten_times, None)], path, input_sha256={}, parameters={})
    words = ["respond", str(path), "--margins", "none", "--structure", "slender-column"]
    assert main([*words, "--output", str(tmp_path / "r.nc"), "--sensitivity"]) == 0
    last = capsys.readouterr().out.split("Sensitivity in")[1]
    (line,) = [one for one in last.splitlines() if "slender-column" in one]
    assert line.split()[2:] == ["–"] * 6
    with xr.open_dataset(tmp_path / "r.nc") as dataset:
        (row,) = sensitivity_rows(dataset)
    assert row["matters_most"] == ""
    assert math.isnan(row["height"])


@pytest.mark.parametrize("structures", [1, 5, 7])
def test_the_figure_has_a_bar_for_each_correlation(structures: int) -> None:
    values = {"height": -0.5, "corner": 0.1, "width": math.nan}
    row = {"record_id": "shake", **values, "by_chance": 0.25, "matters_most": "height"}
    rows = [{**row, "structure": f"column-{k}"} for k in range(structures)]
    drawn = draw_sensitivity(rows, "shake")
    panels = [axes for axes in drawn.figure.axes if axes.axison]
    assert [axes.get_title(loc="left") or axes.get_title() for axes in panels] == [
        row["structure"] for row in rows
    ]
    for axes in panels:
        extents = [
            bar.get_window_extent().transformed(axes.transData.inverted()) for bar in axes.patches
        ]
        places = [(one.y0 + one.height / 2, *one.intervalx) for one in extents]
        assert_allclose(places, [(0.0, -0.5, 0.0), (1.0, 0.0, 0.1)], atol=1e-9)
        most, other = (bar.get_facecolor() for bar in axes.patches)
        assert most != other
    assert "5 % exceed 0.25 by chance" in drawn.caption


def test_the_bars_of_the_page_are_the_correlations() -> None:
    values = {"height": -0.5, "impact loss": 1.0, "corner": math.nan}
    picture = bars_svg(values, 0.25, "impact loss", "which <spread> matters")
    found = ElementTree.fromstring(picture)  # noqa: S314 -- our own picture
    bars = {
        one.get("class"): (float(one.get("x", "nan")), float(one.get("width", "nan")))
        for one in found.iter("rect")
    }
    assert bars == {"bar": (150.0 - 40.0, 40.0), "bar-most": (150.0, 80.0)}
    assert [one.text for one in found.iter("text")] == [*values]
    assert [one.text for one in found.iter("title")] == ["which <spread> matters"]


def test_words_name_the_spread_that_matters_most() -> None:
    row = {"width": 0.1, "impact_loss": -0.6, "by_chance": 0.25, "matters_most": "impact_loss"}
    assert sensitivity_words(row).startswith("Of the spreads of the ensemble, the impact loss matt")
    none = sensitivity_words({**row, "matters_most": ""})
    assert "none matters more than by chance. Rank correlation" in none
