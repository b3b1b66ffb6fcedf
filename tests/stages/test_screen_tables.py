"""The tables of a screening, and the formats of tables."""

from __future__ import annotations

import csv
import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.screening import sine, site, stored, structures

from rockframe.cli.main import main
from rockframe.engines.engine import OneProcess
from rockframe.errors import InputError, ParameterError
from rockframe.options.respond import DesignOptions, ScreenOptions
from rockframe.record import Record
from rockframe.results.screen import read_screening
from rockframe.results.screen_tables import fragility_rows, refuse_strange_tables, screen_rows
from rockframe.results.tables.entries import write_rows_as
from rockframe.signals.processing import peak
from rockframe.stages.screen import Screening, screen_stage
from rockframe.structures.screening import ScreeningTask
from rockframe.units import GRAVITY

ROWS: list[dict[str, Any]] = [
    {"record": "=a", "structure": "x|y_z", "theta": 0.5, "count": 3},
    {"record": "b", "structure": "", "theta": math.nan, "count": 4},
]


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def screened(folder: Path, **options: Any) -> Screening:
    return screen_stage(
        stored(site(6), folder),
        folder / "screen.nc",
        structures_path=structures(folder),
        options=ScreenOptions(scales=np.geomspace(0.5, 3.0, 5), margins="none", **options),
    )


def test_no_column_is_left_out(tmp_path: Path) -> None:
    screened(tmp_path)
    screening = read_screening(tmp_path / "screen.nc")
    motion = (
        "event station azimuth_degree magnitude epicentral_distance_km vs30_m_s pga_g pgv_m_s "
        "a_p_g T_p_s L_p_m mean_relative_rank height_m width_m mass_ratio slenderness_deg "
        "verdict_words"
    )
    pair = "record_id structure scale verdict peak_rotation_ratio peak_u_m peak_v_m demand_rank"
    assert list(next(screen_rows(screening))) == [*pair.split(), *motion.split()]
    fit = (
        "structure limit_state measure unit outcome median median_low median_high lowest highest "
        "safe_to lognormal_beta lognormal_beta_low lognormal_beta_high logistic_scale pseudo_r2 "
        "concordance brier recordings observations reached reached_from note"
    )
    assert list(next(fragility_rows(screening))) == fit.split()


@pytest.mark.parametrize("beta", [0.3, 0.6])
def test_a_known_lognormal_beta_comes_back_within_its_band(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beta: float
) -> None:
    """Motions overturn above a PGA that is drawn from a lognormal distribution of median 0.5 g."""
    median, drawn = 0.5, np.random.default_rng(11)
    records = [sine(f"s{n:03d}", 9.81 * drawn.uniform(0.2, 1.0)) for n in range(80)]
    capacity = {r.record_id: median * np.exp(beta * drawn.standard_normal()) for r in records}

    def peaks(part: ScreeningTask) -> dict[str, Any]:
        motions = [motion for motion in part.motions if isinstance(motion, Record)]
        pga = np.array([peak(motion.acceleration) / GRAVITY for motion in motions])
        least = np.array([capacity[motion.record_id] for motion in motions])
        fell = pga[:, None] * np.array(part.scales) > least[:, None]
        verdict = np.where(fell, 2, 1).astype(np.int8)[:, None].repeat(len(part.structures), axis=1)
        rotation = np.where(verdict == 2, np.pi / 2, 0.01)
        return {"verdict": verdict, "peak": rotation, "speed": 0.0 * rotation}

    monkeypatch.setattr("rockframe.stages.screening.tasks.peaks_of", peaks)
    screen_stage(
        stored(records, tmp_path),
        tmp_path / "screen.nc",
        structures_path=structures(tmp_path),
        options=ScreenOptions(scales=np.geomspace(0.2, 5.0, 12), margins="none"),
        engine=OneProcess(),
    )
    (row,) = (
        row
        for row in rows_of(tmp_path / "fragility.csv")
        if row["structure"] == "stout" and row["measure"] == "pga"
    )
    assert float(row["median_low"]) < median < float(row["median_high"])
    assert float(row["lognormal_beta_low"]) < beta < float(row["lognormal_beta_high"])
    assert_allclose(float(row["lognormal_beta"]), 1.8138 * float(row["logistic_scale"]), rtol=1e-4)
    assert (row["unit"], row["recordings"], row["observations"]) == ("g", "80", "960")


def test_tables_are_those_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tables match the file even if scenarios are read in chunks of four motions."""
    monkeypatch.setattr("rockframe.results.screen_tables._TOGETHER", 4 * 2 * 5)
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.01,1\n0.1,0.01\n1,0.0001\n", encoding="utf-8")
    design = DesignOptions(dimension="height", range=(2.0, 30.0), steps=4)
    done = screened(tmp_path, hazard=hazard, design=design, limit_peak_u_m=(0.1,))
    found = read_screening(tmp_path / "screen.nc")
    assert [path.name for path in done.tables.values()] == [
        *("screen.csv", "scenarios.csv", "fragility.csv", "rates.csv", "design.csv")
    ]
    scenarios = rows_of(tmp_path / "scenarios.csv")
    assert len(scenarios) == found["verdict"].size
    fallen = [row["verdict"] == "overturns" for row in scenarios]
    assert fallen == (found["verdict"].values.ravel() == 2).tolist()
    rates = rows_of(tmp_path / "rates.csv")
    assert [row["limit_state"] for row in rates[:2]] == ["overturning", "peak_u_0.1m"]
    for row, rate in zip(rates, found["annual_rate"].values.ravel(), strict=True):
        period = math.nan if row["return_period_years"] == "" else float(row["return_period_years"])
        assert_allclose(period, 1.0 / rate)
    shares = [float(row["share_below"]) for row in rows_of(tmp_path / "design.csv")]
    assert shares == found["design_share"].values.ravel().tolist()


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
def test_a_rate_from_outside_the_range_tried_is_noted(tmp_path: Path, curve: str) -> None:
    """With hazard as steep as x^-10, a logistic tail x^9 has most of its rate in weak motions."""
    hazard = tmp_path / "hazard.csv"
    lines = [f"{x:.6g},{1e-16 * x**-10:.6g}" for x in np.geomspace(0.02, 2.0, 20)]
    hazard.write_text("\n".join(["pga_g,annual_rate", *lines]) + "\n", encoding="utf-8")
    screened(tmp_path, hazard=hazard, fragility_curve=curve)
    found = read_screening(tmp_path / "screen.nc").sel(structure="slender")
    (row,) = (r for r in rows_of(tmp_path / "rates.csv") if r["structure"] == "slender")
    share = 100.0 * found["annual_rate_extrapolated"].item()
    assert found["fragility_curve"].item() == curve
    if curve == "lognormal":
        assert share < 10.0
        assert row["note"] == ""
    else:
        start = f"{share:.0f} % of it is from intensities outside the range tried"
        assert row["note"].startswith(start)


def test_a_return_period_before_the_hazard_curve_has_a_row_and_a_note(tmp_path: Path) -> None:
    hazard = tmp_path / "hazard.csv"
    hazard.write_text("pga_g,annual_rate\n0.05,0.05\n0.3,0.002\n3,0.000002\n", encoding="utf-8")
    periods = (10.0, 475.0)
    screened(tmp_path, hazard=hazard, return_period_years=periods)
    rows = rows_of(tmp_path / "demands.csv")
    names = {(row["structure"], row["quantity"]) for row in rows}
    assert len(rows) == len(periods) * len(names) > 0
    for row in rows:
        if row["return_period_years"] == "10.0":
            assert row["value"] == ""
            assert row["note"].endswith("the hazard curve begins at a return period of 20 years")


def test_tables_of_another_screening_have_its_name(tmp_path: Path) -> None:
    done = screen_stage(
        stored(site(2), tmp_path),
        tmp_path / "site.nc",
        ScreenOptions(scales=(1.0,), margins="none"),
    )
    names = [path.name for path in done.tables.values()]
    assert names == ["site.csv", "site-scenarios.csv", "site-fragility.csv"]


def test_a_screening_has_all_distances_of_its_records(tmp_path: Path) -> None:
    names = ("epicentral_distance", "distance_rrup", "distance_rjb", "distance_hypocentral")
    record = sine("s", 2.0, **{name: 10.0 + k for k, name in enumerate(names)})
    output = tmp_path / "screen.nc"
    screen_stage(stored([record], tmp_path), output, ScreenOptions(scales=(1.0,), margins="none"))
    found = read_screening(output)
    assert [float(found[name].item()) for name in names] == [10.0, 11.0, 12.0, 13.0]


def test_other_files_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "fragility.csv").write_text("my,own\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match="in the place of the table of the screening"):
        screened(tmp_path)
    assert not (tmp_path / "screen.nc").exists()


@pytest.mark.parametrize(
    ("kind", "begins"),
    [
        ("scenarios", "record_id,structure,scale"),
        ("fragility", "structure,limit_state"),
        ("pooled", "structures,limit_state"),
        ("rates", "structure,measure"),
        ("design", "structure,dimension"),
    ],
)
def test_a_table_that_only_begins_alike_is_not_replaced(
    tmp_path: Path, kind: str, begins: str
) -> None:
    path = tmp_path / f"{kind}.csv"
    path.write_text(f"{begins},mine\n", encoding="utf-8")
    with pytest.raises(InputError, match="in the place of the table of the screening"):
        refuse_strange_tables({kind: path})


def test_markdown_keeps_its_columns(tmp_path: Path) -> None:
    write_rows_as(tmp_path / "t.md", ROWS, "markdown")
    lines = (tmp_path / "t.md").read_text(encoding="utf-8").splitlines()
    assert lines[2:] == [r"| =a | x\|y_z | 0.5 | 3 |", "| b |  | – | 4 |"]


def test_latex_is_escaped(tmp_path: Path) -> None:
    write_rows_as(tmp_path / "t.tex", ROWS, "latex")
    text = (tmp_path / "t.tex").read_text(encoding="utf-8")
    assert r"=a & x|y\_z & 0.5 & 3 \\" in text


@pytest.mark.skipif(importlib.util.find_spec("openpyxl") is None, reason="needs the extra tables")
def test_a_sheet_runs_no_formula(tmp_path: Path) -> None:
    import openpyxl

    write_rows_as(tmp_path / "t.xlsx", ROWS, "xlsx")
    rows = list(openpyxl.load_workbook(tmp_path / "t.xlsx").active.values)
    assert rows[1] == ("'=a", "x|y_z", 0.5, 3)
    assert rows[2][2] is None


@pytest.mark.skipif(importlib.util.find_spec("pyarrow") is None, reason="needs the extra tables")
def test_parquet_keeps_the_numbers(tmp_path: Path) -> None:
    import pandas as pd

    write_rows_as(tmp_path / "t.parquet", ROWS, "parquet")
    pd.testing.assert_frame_equal(
        pd.read_parquet(tmp_path / "t.parquet"), pd.DataFrame(ROWS), check_dtype=False
    )


def test_missing_packages_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("openpyxl", "openpyxl.workbook"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ParameterError, match=r"pip install 'rockframe\[tables\]'"):
        write_rows_as(tmp_path / "t.xlsx", ROWS, "xlsx")
    assert not list(tmp_path.iterdir())


def test_an_ending_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"t.csv: name of a table as xlsx. Must end in .xlsx"):
        write_rows_as(tmp_path / "t.csv", ROWS, "xlsx")


def test_screen_writes_tables_in_a_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records, output = stored(site(2), tmp_path), tmp_path / "screen.nc"
    words = ["--structures", str(structures(tmp_path)), "--margins", "none", "--scales", "1", "2"]
    asked = ["screen", str(records), "--output", str(output), *words, "--format", "markdown"]
    assert main(asked) == 0
    assert str(tmp_path / "fragility.md") in capsys.readouterr().out
    assert not list(tmp_path.glob("*.csv"))


def test_without_members_the_words_are_the_nominal_outcome_at_the_scale(tmp_path: Path) -> None:
    """A margin on other multiples of the motion changes no word."""
    outcomes = {"no_uplift", "stands", "overturns"}
    done = screened(tmp_path)
    assert {row["verdict"] for row in rows_of(tmp_path / "scenarios.csv")} == outcomes
    rows = rows_of(done.table)
    assert {float(row["scale"]) for row in rows} != {1.0}
    assert all(row["verdict_words"] == row["verdict"].replace("_", " ") for row in rows)
    found = read_screening(tmp_path / "screen.nc")
    assert set(found["outcome"].values) == outcomes
    margins = found.assign(critical_scale=(("record", "structure"), np.full((6, 2), 0.629)))
    words = [row["verdict_words"] for row in screen_rows(margins)]
    assert words == [row["verdict_words"] for row in rows]


def test_a_screening_whose_verdicts_have_other_meanings_is_refused(tmp_path: Path) -> None:
    screened(tmp_path)
    with netCDF4.Dataset(tmp_path / "screen.nc", "a") as file:
        file["verdict"].flag_values = np.arange(4, dtype=np.int8)
        file["verdict"].flag_meanings = "no_uplift safe overturned undecided"
    with pytest.raises(InputError, match="variable 'verdict' with flag_values"):
        read_screening(tmp_path / "screen.nc")
