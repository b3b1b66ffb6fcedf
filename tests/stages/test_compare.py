"""The compare command: its file, table and figures, and structures with restraints."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal
from tests.commands import ingested, run

from rockframe.engines.engine import OneProcess
from rockframe.errors import InputError, ParameterError
from rockframe.figures.histories import draw_comparison
from rockframe.frame import RockingFrame, crushed
from rockframe.options.ingest import Filters
from rockframe.options.respond import DesignOptions
from rockframe.parts import Pivot
from rockframe.results.response import comparison_rows, furthest_pairs, read_histories
from rockframe.results.screen import read_screening
from rockframe.results.shards import opened_arrays
from rockframe.results.tables.entries import rows_of
from rockframe.results.tables.table import response_rows
from rockframe.rocking.design import Design
from rockframe.stages.common import Batch
from rockframe.stages.compare import compare_stage
from rockframe.stages.table import index_stage
from rockframe.study.structures import read_bridges, read_structures
from rockframe.units import GRAVITY

BENT = """
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
section = "circular"
density_kg_m3 = 2500.0
"""
TENDON = """
[structure.tendon]
area_m2 = 1.0e-3
modulus_pa = 195.0e9
prestress_n = 1.0e5
"""
RIVALS = """
[compare.hybrid]
stiffness_n_m = 5.0e7
yield_force_n = 1.0e5
lever_arm_m = 0.8
[compare.isolated]
period_s = 3.0
strength_ratio = 0.05
[compare.fixed]
modulus_pa = 30.0e9
"""


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    time = np.arange(0.0, 4.0, 0.01)
    path = tmp_path_factory.mktemp("one") / "shake.txt"
    np.savetxt(path, 0.4 * np.sin(4.0 * time) * np.sin(time * math.pi / 4.0))
    return ingested(path)


def structures(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "bridge.toml"
    path.write_text(text)
    return path


def test_every_model_is_in_the_file_the_table_and_the_figure(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bridge, output = structures(tmp_path, BENT + TENDON + RIVALS), tmp_path / "compare.nc"
    figures = tmp_path / "figures"
    assert run("compare", records, "--structures", bridge, "--output", output,
               "--figures", figures) == 0  # fmt: skip
    rows = comparison_rows(output)
    models = ["free", "restrained", "hybrid", "isolated", "fixed"]
    assert [row["model"] for row in rows] == models
    series = {"time", "u", "v", "base_shear", "row_size"}
    with xr.open_dataset(output, decode_times=False) as stored:  # each other variable is a column
        bands = {name for name in stored.variables if str(name).endswith("_band")}
        each = set(stored.variables) - series - bands - {"quantile"}
        in_kn = 1 + 3  # base shear and its quantiles, beside those over the weight
        assert len(rows[0]) == len(each) + 3 * len(bands) + in_kn
        share = stored["share_overturned"].values[0, 0]
        drifts = stored["peak_u_band"].values[0, 0]
    for k, row in enumerate(rows):
        assert row["share_overturned"] == share[k]
        assert [row[f"peak_u_{quantile}_m"] for quantile in (16, 50, 84)] == drifts[k].tolist()
        assert 0.0 < drifts[k][0] < drifts[k][2]
    histories = read_histories(output, rows[0]["record_id"], "bent")
    for k, row in enumerate(rows):
        assert np.nanmax(np.abs(histories["u"].values[k])) == pytest.approx(
            row["peak_u_m"], rel=1e-2
        )
    assert rows[1]["peak_tendon_force_n"] > 1.0e5
    printed = capsys.readouterr().out
    assert all(model in printed for model in models)
    assert len(list(figures.rglob("*.png"))) == 1


def test_only_the_rivals_that_are_asked_for(records: Path, tmp_path: Path) -> None:
    bridge, output = structures(tmp_path, BENT + TENDON + RIVALS), tmp_path / "compare.nc"
    assert run("compare", records, "--structures", bridge, "--against", "isolated",
               "--output", output) == 0  # fmt: skip
    assert [row["model"] for row in comparison_rows(output)] == ["free", "isolated"]


def test_base_shear_is_also_in_kilonewtons(records: Path, tmp_path: Path) -> None:
    """The column has 48.3 t, and the deck four times that."""
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    compare_stage(records, output, bridge, against=["isolated"], engine=OneProcess())
    weight = 5.0 * 2500.0 * math.pi / 4.0 * 1.6**2 * 9.6 * GRAVITY / 1000.0
    for row in comparison_rows(output):
        assert row["weight_kn"] == pytest.approx(weight)
        assert row["peak_base_shear_kn"] == pytest.approx(row["peak_base_shear"] * weight)
        assert row["peak_base_shear_84_kn"] == pytest.approx(row["peak_base_shear_84"] * weight)
    light = structures(tmp_path, BENT.replace("density_kg_m3 = 2500.0", "") + RIVALS)
    compare_stage(records, output, light, against=["isolated"], engine=OneProcess())
    assert math.isnan(comparison_rows(output)[0]["peak_base_shear_kn"])


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """Return records.nc of two motions together, and of each of them alone."""
    home = tmp_path_factory.mktemp("several")
    time, files = np.arange(0.0, 4.0, 0.01), []
    for name, size in (("first", 0.4), ("second", 0.2)):
        files.append(home / f"{name}.txt")
        np.savetxt(files[-1], size * np.sin(4.0 * time) * np.sin(time * math.pi / 4.0))
    stated = ("--units", "g", "--time-step", "0.01", "--workers", "0", "--output")
    outputs = []
    for name, motions in (("both", files), ("a", files[:1]), ("b", files[1:])):
        (home / name).mkdir()
        outputs.append(home / name / "records.nc")
        assert run("ingest", *motions, *stated, outputs[-1]) == 0
    both, first, second = outputs
    return both, first, second


def test_each_model_has_its_panel_of_the_base_shear(records: Path, tmp_path: Path) -> None:
    """The envelope reaches the extremes within the drawn time, and all panels have one scale."""
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    compare_stage(records, output, bridge, against=["isolated", "fixed"], engine=OneProcess())
    histories = read_histories(output, "shake", "bent")
    panels = draw_comparison(histories).figure.axes
    assert [panel.texts[0].get_text() for panel in panels[2:]] == ["free", "isolated", "fixed"]
    assert len({panel.get_ylim() for panel in panels[2:]}) == 1
    first, last = panels[-1].get_xlim()
    time = histories["time"].values
    drawn = (time >= first) & (time <= last)
    for panel, model in zip(panels[2:], ("free", "isolated", "fixed"), strict=True):
        shear = histories["base_shear"].values[list(histories["model"].values).index(model)]
        height = np.asarray(panel.collections[0].get_paths()[0].vertices)[:, 1]
        assert height.max() == np.nanmax(shear[drawn])
        assert height.min() == np.nanmin(shear[drawn])


def test_records_of_two_files_are_compared_as_those_of_one(
    several: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    both, first, second = several
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    found = []
    for given in (both, [first, second]):
        compare_stage(given, output, bridge, against=["isolated"], engine=OneProcess())
        with xr.open_dataset(output, decode_times=False) as stored:
            found.append(stored.load())
    assert found[0].equals(found[1])
    assert list(json.loads(found[1].attrs["input_sha256"])) == [
        *("bridge.toml", "records.nc", "records.nc (2)")
    ]
    with pytest.raises(InputError, match=r"b/records.nc: has record 'second', which .*both/"):
        compare_stage([both, second], output, bridge, against=["isolated"])


def test_batches_are_compared_as_all_records_at_once(
    several: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    """Each file of several has the records of the batch; a third batch has none."""
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    asked = partial(
        compare_stage,
        several[1:],
        structures_path=bridge,
        against=["isolated"],
        engine=OneProcess(),
    )
    asked(output)
    with opened_arrays(output, "compare") as comparison:
        expected = comparison.loaded()
    parts = [tmp_path / f"compare-{number}.nc" for number in (1, 2, 3)]
    for number, part in enumerate(parts, 1):
        asked(part, batch=Batch(number, 3))
    index_stage(parts, output)
    assert repr(comparison_rows(output)) == repr(comparison_rows(expected))
    with opened_arrays(output, "compare") as comparison:
        assert comparison.variables.keys() == expected.variables.keys()
        for name, variable in expected.variables.items():
            assert_array_equal(comparison[name].values, variable.values)
    history = read_histories(output, "second", "bent")
    samples = slice(int(expected["row_size"].values[0]), None)
    assert_array_equal(history["u"].values, expected["u"].values[0, :, samples])
    assert len(furthest_pairs(output, 1)) == 1


def test_workers_change_no_byte(several: tuple[Path, Path, Path], tmp_path: Path) -> None:
    bridge, written = structures(tmp_path, BENT + RIVALS), []
    for workers in ("1", "2"):
        output = tmp_path / "compare.nc"
        assert run("compare", several[0], "--structures", bridge, "--output", output,
                   "--against", "isolated", "--workers", workers) == 0  # fmt: skip
        written.append(output.read_bytes())
    assert written[0] == written[1]


def test_records_outside_the_filters_are_not_compared(
    several: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    asked = partial(compare_stage, several[0], output, bridge, against=["isolated"])
    asked(filters=Filters(pga_g=(0.3, 1.0)))
    assert {row["record_id"] for row in comparison_rows(output)} == {"first"}
    with xr.open_dataset(output, decode_times=False) as stored:
        assert "Must be from 0.3 to 1" in json.loads(stored.attrs["left_out"])["second"]
    with pytest.raises(ParameterError, match="no record is left to compare; 'first': pga_g 0\\.39"):
        asked(filters=Filters(pga_g=(3.0, 4.0)))


def test_a_comparison_has_tables_and_a_page(
    several: tuple[Path, Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bridge, output = structures(tmp_path, BENT + RIVALS), tmp_path / "compare.nc"
    page = tmp_path / "compare.html"
    capsys.readouterr()
    assert run("compare", several[0], "--structures", bridge, "--output", output, "--against",
               "isolated", "fixed", "--format", "csv", "--page", page) == 0  # fmt: skip
    printed = capsys.readouterr().out
    names = ["compare-designs", "compare-best", "compare", "compare-parameters"]
    assert printed.split()[-5:] == [*(str(tmp_path / f"{n}.csv") for n in names), str(page)]
    designs = list(rows_of(tmp_path / "compare-designs.csv"))
    assert [row["design"] for row in designs] == ["free", "isolated", "fixed"]
    assert {row["records"] for row in designs} == {"2"}
    worst = max(row["peak_u_50_m"] for row in comparison_rows(output) if row["model"] == "free")
    assert float(designs[0]["peak_u_worst_m"]) == worst
    assert "Designs over all 2 records" in printed
    assert "Best designs" in printed
    assert page.read_text(encoding="utf-8").count("<svg") == 7
    for said in (printed, page.read_text(encoding="utf-8")):
        assert "bent: compared in one plane, in which alone" in said


@pytest.mark.parametrize(
    ("text", "against", "said"),
    [
        (BENT, "isolated", "isolated bridge of 'bent' not stated"),
        (BENT, "hybrid", ":2: hybrid bridge of 'bent' not stated. State it in [structure.dissipat"),
        (BENT + RIVALS, "hybrid", ":2: Dissipaters of 'bent' without a tendon"),
        (BENT.replace("den", "inner_width_m = 1.2\nden") + RIVALS, "fixed", "inner_width_m 1.2"),
        (BENT.replace('"circular"', '"rectangular"\ndepth_m = 1.2') + RIVALS, "isolated", ""),
    ],
)
def test_what_is_missing_or_wrong_is_named(
    records: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    text: str,
    against: str,
    said: str,
) -> None:
    output = tmp_path / "compare.nc"
    status = run("compare", records, "--structures", structures(tmp_path, text), "--against",
                 against, "--output", output)  # fmt: skip
    error = capsys.readouterr().err
    assert (status, output.exists()) == (2, False) if said else (0, True)
    assert said in error
    assert len(error.strip().splitlines()) == (1 if said else 0)


DISSIPATER = RIVALS.partition("[compare.isolated]")[0].replace(
    "compare.hybrid", "structure.dissipater"
)
SLIDING = "[structure.isolated]\nradius_m = 2.5\nfriction = 0.05\n"
PIVOT = "[structure.pivot]\ncompressive_strength_pa = 30.0e6\ndepth_m = 1.2\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TENDON + "loses_prestress = true\n", "10: key 'structure.tendon.yield_stress_pa' missing"),
        (TENDON.replace("195.0", "-1"), "12: structure.tendon.modulus_pa -1000000000.0. Must"),
        (TENDON.replace("modulus_pa", "#"), "10: key 'modulus_pa' missing. State it in [struct"),
        (TENDON.replace("1.0e-3", "0.0"), "11: structure.tendon.area_m2 0.0. Must be positive"),
        (TENDON + "yield_stress_pa = 5.0e7\n",
         "13: structure.tendon.prestress_n 100000.0. Must be zero or above and below its yield"),
        (TENDON + "area = 1.0\n", "14: unknown key 'structure.tendon.area'. Must be one of: area_"),
        (TENDON.replace("1.0e-3", '"1.0"'), "11: structure.tendon.area_m2 '1.0'. Must be a number"),
        ("tendon = 3\n", "9: tendon 3. Must be a table, [structure.tendon]."),
        (DISSIPATER.replace("5.0e7", "-1.0"), "11: structure.dissipater.stiffness_n_m -1.0. Must"),
        (RIVALS.replace("5.0e7", "-1.0"), "11: compare.hybrid.stiffness_n_m -1.0. Must be pos"),
        (RIVALS.replace("3.0\n", "-3.0\n"), "15: compare.isolated.period_s -3.0. Must be positive"),
        (RIVALS.replace("period_s", "#"),
         "14: key 'compare.isolated.period_s' missing. Must be stated, or effective_period_s and "),
        (RIVALS.replace("3.0\n", "3.0\neffective_period_s = 2.5\n"),
         "15: compare.isolated.period_s 3.0. Must be absent where effective_period_s is stated"),
        (RIVALS + "limit_ductility = 0.5\n", "19: compare.fixed.limit_ductility 0.5. Must be at"),
        (RIVALS + "strength_ratio = 0.0\n", "19: compare.fixed.strength_ratio 0.0. Must be"),
        (RIVALS.replace("period_s", "radius_m"),
         "16: compare.isolated.strength_ratio 0.05. Must be absent where a pendulum is"),
        (SLIDING + "yield_displacement_m = 0.02\n",
         "12: structure.isolated.yield_displacement_m 0.02. Must be absent where a pendulum is"),
        (SLIDING + "design_displacement_m = 0.2\n",
         "12: structure.isolated.design_displacement_m 0.2. Must be absent where a pendulum is"),
        (SLIDING.replace("radius_m", "#"),
         "9: key 'structure.isolated.radius_m' missing. Must be stated together with friction."),
        ("top_width_m = 1e160\n", "2: a value of this table is too large or too small to"),
        ("[structure.isolated]\nstrength_ratio = 0.05\neffective_period_s = 1e-160\n"
         "design_displacement_m = 0.2\n", "9: a value of this table is too large or too small"),
        ("[structure.fixed]\nmodulus_pa = 1e-308\ncracked_stiffness_ratio = 1e-308\n",
         "9: a value of this table is too large or too small"),
        (DISSIPATER.replace("0.8", "0.01") + PIVOT,
         "13: structure.dissipater.lever_arm_m 0.01. Must be above 0.0"),
        ("[structure.abutment]\ngap_m = 0.0\n", "10: structure.abutment.gap_m 0.0. Must be pos"),
        (PIVOT.replace("30.0e6", "1.0e6"),
         "10: structure.pivot.compressive_strength_pa 1000000.0. Must be larger; 2.48e+06 Pa is "
         "enough at this depth: its block of 1.97 m is longer than half the width"),
    ],
)  # fmt: skip
def test_each_wrong_value_of_a_table_is_named_with_its_place(
    tmp_path: Path, text: str, said: str
) -> None:
    """The error states line, key, value and constraint, and is raised when the file is read."""
    with pytest.raises(InputError) as wrong:
        read_structures(structures(tmp_path, BENT + text))
    assert f"bridge.toml:{said}" in str(wrong.value)


@pytest.mark.parametrize("tendon", ["", TENDON.replace("prestress_n = 1.0e5", "prestress_n = 9e6")])
def test_the_strength_said_to_be_enough_is_enough(tmp_path: Path, tendon: str) -> None:
    """The rounded strength in the message is enough, also with the force that a tendon adds."""
    with pytest.raises(InputError) as wrong:
        read_structures(structures(tmp_path, BENT + PIVOT.replace("30.0e6", "1.0e6") + tendon))
    enough = str(wrong.value).split("larger; ")[1].split(" Pa")[0]
    read_structures(structures(tmp_path, BENT + PIVOT.replace("30.0e6", enough) + tendon))


def test_ties_without_a_mass_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r":2: key 'column_mass_kg' missing"):
        read_structures(structures(tmp_path, BENT.replace("density_kg_m3 = 2500.0", "") + TENDON))


def test_a_column_yields_where_both_its_ends_reach_their_moment(
    records: Path, tmp_path: Path
) -> None:
    """Without P-delta its shear is then 2 M / H and stays constant, because nothing hardens."""
    fixed = (
        "[compare.fixed]\nmodulus_pa = 30.0e9\ndamping_ratio = 0.0\nmoment_capacity_nm = 1.5e6\n"
        "p_delta = false\n"
    )
    output = tmp_path / "compare.nc"
    bridge = structures(tmp_path, BENT + fixed)
    assert run("compare", records, "--structures", bridge, "--output", output) == 0
    row = comparison_rows(output)[1]
    (bent,) = read_structures(bridge)
    assert bent.column_mass is not None
    of_deck = 2.0 * 1.5e6 / 9.6 / (5.0 * bent.column_mass * GRAVITY)
    assert row["ductility"] > 1.0
    assert row["peak_base_shear"] == pytest.approx(of_deck, abs=0.4 * 22.0 / 35.0 / 5.0)


def test_columns_that_buckle_are_named_with_the_modulus_of_their_own_size(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """P-delta exceeds the stiffness 12 E I / H^3 if E is below W H^2 / (12 I) of these columns."""
    bridge = structures(tmp_path, BENT + "[compare.fixed]\nmodulus_pa = 7.0\n")
    (bent,) = read_structures(bridge)
    assert bent.column_mass is not None
    weight = (bent.mass_ratio + 0.5) * bent.column_mass * GRAVITY
    least = weight * 9.6**2 / (12.0 * math.pi * 1.6**4 / 64.0)
    output = tmp_path / "compare.nc"
    assert run("compare", records, "--structures", bridge, "--output", output) == 2
    assert f":2: Invalid modulus 7.0 of 'fixed'. Must be above {least:.4g} Pa" in (
        capsys.readouterr().err
    )


def test_options_of_the_fixed_bridge_reach_its_model(tmp_path: Path) -> None:
    """P-delta is on by default, hardening off, and the ductility limited to 5."""
    options = "post_yield_ratio = 0.03\np_delta = false\nlimit_ductility = 3.0\n"
    plain, changed = (
        read_bridges(structures(tmp_path, BENT + RIVALS + text))[1].fixed for text in ("", options)
    )
    assert plain is not None
    assert changed is not None
    size = {"height": 9.6, "width": 1.6, "column_mass": 48e3, "deck_mass": 192e3}
    one, other = plain.of_columns(**size), changed.of_columns(**size)
    assert (one.post_yield_ratio, one.limit_ductility) == (0.0, 5.0)
    assert one.stability_coefficient > 0.0
    assert (other.post_yield_ratio, other.limit_ductility) == (0.03, 3.0)
    assert other.stability_coefficient == 0.0


def test_structures_with_other_rivals_do_not_share_a_table(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a shared table, models would be listed under the names of other models."""
    two = (
        BENT + TENDON + BENT.replace('"bent"', '"other"') + "[structure.isolated]\nperiod_s = 3.0\n"
    )
    both = structures(tmp_path, two + "strength_ratio = 0.05\n")
    assert run("compare", records, "--structures", both, "--output", tmp_path / "c.nc") == 2
    assert "has the models free, isolated, and 'bent' free, restrained" in capsys.readouterr().err


def test_pivots_crush_under_the_tendon_of_each_variant(records: Path, tmp_path: Path) -> None:
    """The table that states the tendon does not matter, and the free bridge has no tendon."""
    drifts = []
    for text in (TENDON, TENDON.replace("structure.tendon", "compare.restrained")):
        output = tmp_path / "compare.nc"
        bridge = structures(tmp_path, BENT + PIVOT + text)
        assert run("compare", records, "--structures", bridge, "--output", output) == 0
        drifts.append([row["peak_u_m"] for row in comparison_rows(output)])
    assert drifts[0] == drifts[1]


def test_a_verdict_names_the_event_that_ends_the_model(records: Path, tmp_path: Path) -> None:
    """A bridge that closes its gap stands, but is not called safe; `compare` states the same."""
    bridge = structures(tmp_path, BENT + "[structure.abutment]\ngap_m = 0.2\n" + RIVALS)
    response, compared = tmp_path / "response.nc", tmp_path / "c.nc"
    assert run("respond", records, "--structures", bridge, "--margins", "first",
               "--output", response) == 0  # fmt: skip
    assert run("compare", records, "--structures", bridge, "--against", "fixed",
               "--output", compared) == 0  # fmt: skip
    (row,) = response_rows(response)
    free = comparison_rows(compared)[0]
    assert (row["verdict"], free["validity"]) == ("stands", "gap_closes")
    assert row["gap_closed_time_s"] == free["valid_until_s"]
    assert row["critical_scale"] > 1.0
    assert row["share_model_ends"] == 1.0
    assert row["verdict_words"] == "stands; gap closes in 100 %"


def test_restrained_structures_are_screened(records: Path, tmp_path: Path) -> None:
    """With a tendon the frame overturns at no scale; without it, it does."""
    stiff = TENDON.replace("1.0e-3", "2.0e-3")
    both = structures(tmp_path, BENT + BENT.replace('"bent"', '"tied"') + stiff)
    output = tmp_path / "screen.nc"
    assert run("screen", records, "--structures", both, "--scales", "0.5:20:6", "--margins",
               "none", "--output", output) == 0  # fmt: skip
    found = read_screening(output)
    overturned = found["verdict_count"].sel(structure=["bent", "tied"]).values[:, :, 2].sum(axis=1)
    assert overturned[0] > 0
    assert overturned[1] == 0


def test_pivots_move_inwards_by_half_the_block(tmp_path: Path) -> None:
    """The block is N / (strength depth) long, and the column rests on its middle."""
    (bent,) = read_structures(structures(tmp_path, BENT + PIVOT))
    (whole,) = read_structures(structures(tmp_path, BENT))
    assert whole.column_mass is not None
    weight = whole.column_mass * GRAVITY
    assert bent.width == pytest.approx(1.6 - 5.0 * weight / (30.0e6 * 1.2), rel=1e-14)
    assert bent.slenderness < whole.slenderness
    assert bent.restitution > whole.restitution


def test_crushed_edges_shorten_the_lever_of_bars_as_that_of_tendons(tmp_path: Path) -> None:
    """Bars on the axis stay there: their lever is half the width, at base and top on average."""
    text = BENT + DISSIPATER + TENDON + PIVOT
    (bent,) = read_structures(structures(tmp_path, text))
    assert bent.dissipater is not None
    assert bent.dissipater.lever_arm < 0.79
    half = 0.25 * (bent.width + bent.top_contact_width)
    assert bent.dissipater.lever_arm == pytest.approx(half, rel=1e-14)
    assert bent.tie_lever == pytest.approx(2.0 * bent.dissipater.lever_arm, rel=1e-14)
    (alone,) = read_structures(structures(tmp_path, text.replace("= 4.0", "= 0.0")))
    assert alone.dissipater is not None
    assert alone.dissipater.lever_arm == pytest.approx(0.5 * alone.width, rel=1e-14)


def test_edges_that_do_not_crush_change_nothing() -> None:
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3)
    hard = crushed(bent, Pivot(compressive_strength=1e18, depth=1.0))
    for name in ("slenderness", "effective_frequency_parameter", "restitution"):
        assert getattr(hard, name) == pytest.approx(getattr(bent, name), rel=1e-9)


def test_a_file_states_what_crushing_costs(records: Path, tmp_path: Path) -> None:
    """The rows have values before and after crushing; those before are blank without crushing."""
    both = structures(tmp_path, BENT.replace('"bent"', '"whole"') + BENT + PIVOT)
    output = tmp_path / "response.nc"
    assert run("respond", records, "--structures", both, "--margins", "none",
               "--output", output) == 0  # fmt: skip
    whole, bent = read_structures(both)
    hard, crushed_row = response_rows(output)
    assert math.isnan(hard["slenderness_before_crushing_deg"])
    assert crushed_row["slenderness_before_crushing_deg"] == hard["slenderness_deg"]
    assert crushed_row["slenderness_deg"] == pytest.approx(
        math.degrees(bent.slenderness), rel=1e-15
    )
    kept = (crushed_row["restitution_before_crushing"], crushed_row["restitution"])
    assert kept == (whole.restitution, bent.restitution)


def test_crushed_columns_are_not_varied(tmp_path: Path) -> None:
    """Each height would need other pivots."""
    (bent,) = read_structures(structures(tmp_path, BENT + PIVOT))
    with pytest.raises(ParameterError, match="rocks on pivots that crush"):
        Design(dimension="height", lowest=5.0, highest=9.0).candidates(bent)


def test_a_design_has_the_defaults_of_its_options() -> None:
    design = Design(dimension="height", lowest=5.0, highest=9.0)
    options = DesignOptions(dimension="height", range=(5.0, 9.0))
    for name in ("limit", "statistic", "share", "steps", "quantity"):
        assert getattr(design, name) == getattr(options, name)


def test_ties_of_other_sizes_keep_their_sections_and_forces(tmp_path: Path) -> None:
    """A tendon is as long as the column is high; dissipaters keep their share of the width."""
    (bent,) = read_structures(structures(tmp_path, BENT + TENDON + DISSIPATER))
    larger = Design(dimension="height", lowest=9.6, highest=19.2, steps=2).candidates(bent)[1]
    wider = Design(dimension="width", lowest=1.6, highest=2.4, steps=2).candidates(bent)[1]
    assert bent.tendon is not None
    assert bent.dissipater is not None
    assert larger.tendon == replace(bent.tendon, length=19.2)
    assert wider.dissipater == replace(bent.dissipater, lever_arm=0.8 * (2.4 / 1.6))
    masses = [one.column_mass or 0.0 for one in (bent, wider)]
    # a round column is as deep as it is wide
    assert masses[1] == pytest.approx(1.5**2 * masses[0], rel=1e-15)
