"""The compare command: its file, table and figures, and structures with restraints."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tests.commands import ingested, run

from rockframe.errors import InputError
from rockframe.frame import RockingFrame
from rockframe.restraint import Pivot
from rockframe.results.compare import comparison_rows, read_histories
from rockframe.results.screening.screen import read_screening
from rockframe.study.structures import read_structures
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


@pytest.fixture
def records(tmp_path: Path) -> Path:
    time = np.arange(0.0, 4.0, 0.01)
    path = tmp_path / "shake.txt"
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
    histories = read_histories(output, rows[0]["record_id"], "bent")
    for k, row in enumerate(rows):
        assert np.nanmax(np.abs(histories["u"][k])) == pytest.approx(row["u_max_m"], rel=1e-2)
    assert rows[1]["tendon_n"] > 1.0e5
    printed = capsys.readouterr().out
    assert all(model in printed for model in models)
    assert len(list(figures.rglob("*.png"))) == 1


def test_only_the_rivals_that_are_asked_for(records: Path, tmp_path: Path) -> None:
    bridge, output = structures(tmp_path, BENT + TENDON + RIVALS), tmp_path / "compare.nc"
    assert run("compare", records, "--structures", bridge, "--against", "isolated",
               "--output", output) == 0  # fmt: skip
    assert [row["model"] for row in comparison_rows(output)] == ["free", "isolated"]


@pytest.mark.parametrize(
    ("text", "against", "said"),
    [
        (BENT, "isolated", "isolated bridge of 'bent' not stated"),
        (BENT, "hybrid", "Must be, in [structure.dissipater] or [compare.hybrid]"),
        (BENT + RIVALS, "hybrid", "Dissipaters of 'bent' without a tendon"),
        (BENT + TENDON + "loses_prestress = true\n", "restrained", "Missing yield_stress"),
        (
            BENT.replace("density", "inner_width_m = 1.2\ndensity") + RIVALS,
            "fixed",
            "inner_width_m",
        ),
        (BENT + RIVALS.replace("3.0\n", "-3.0\n"), "isolated", "Invalid period -3.0"),
        (BENT + TENDON.replace("1.0e-3", "0.0"), "restrained", "Invalid area 0.0 of a tendon"),
        (BENT + TENDON + "yield_stress_pa = 5.0e7\n", "restrained", "below its yield force"),
        (BENT + "[structure.abutment]\ngap_m = 0.0\n", "fixed", "Invalid gap 0.0 of an abutment"),
        (BENT.replace("density_kg_m3 = 2500.0", "") + TENDON, "restrained", "Missing column_mass"),
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
    assert (status, output.exists()) == (2, False)
    assert said in error
    assert len(error.strip().splitlines()) == 1


def test_a_column_yields_where_both_its_ends_reach_their_moment(
    records: Path, tmp_path: Path
) -> None:
    """2 M / H is the shear of a column then; it stays there, for nothing hardens."""
    fixed = (
        "[compare.fixed]\nmodulus_pa = 30.0e9\ndamping_ratio = 0.0\nmoment_capacity_nm = 1.5e6\n"
    )
    output = tmp_path / "compare.nc"
    bridge = structures(tmp_path, BENT + fixed)
    assert run("compare", records, "--structures", bridge, "--output", output) == 0
    row = comparison_rows(output)[1]
    (bent,) = read_structures(bridge)
    assert bent.column_mass is not None
    of_deck = 2.0 * 1.5e6 / 9.6 / (5.0 * bent.column_mass * GRAVITY)
    assert row["ductility"] > 1.0
    assert row["base_shear"] == pytest.approx(of_deck, abs=0.4 * 22.0 / 35.0 / 5.0)


def test_structures_with_other_rivals_do_not_share_a_table(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their models would stand under each other's names."""
    two = (
        BENT + TENDON + BENT.replace('"bent"', '"other"') + "[structure.isolated]\nperiod_s = 3.0\n"
    )
    both = structures(tmp_path, two + "strength_ratio = 0.05\n")
    assert run("compare", records, "--structures", both, "--output", tmp_path / "c.nc") == 2
    assert "has the models free, isolated, and 'bent' free, restrained" in capsys.readouterr().err


def test_pivots_crush_under_the_tendon_of_each_variant(records: Path, tmp_path: Path) -> None:
    """Where a tendon is stated does not matter, and the free bridge has none."""
    pivot = "[structure.pivot]\ncompressive_strength_pa = 30.0e6\ndepth_m = 1.2\n"
    drifts = []
    for text in (TENDON, TENDON.replace("structure.tendon", "compare.restrained")):
        output = tmp_path / "compare.nc"
        bridge = structures(tmp_path, BENT + pivot + text)
        assert run("compare", records, "--structures", bridge, "--output", output) == 0
        drifts.append([row["u_max_m"] for row in comparison_rows(output)])
    assert drifts[0] == drifts[1]


def test_restrained_structures_are_screened(records: Path, tmp_path: Path) -> None:
    """A frame that a tendon holds overturns at no scale; the free one does."""
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
    """N / (strength depth) is the length of the block; its middle bears the column."""
    pivot = "[structure.pivot]\ncompressive_strength_pa = 30.0e6\ndepth_m = 1.2\n"
    (crushed,) = read_structures(structures(tmp_path, BENT + pivot))
    (whole,) = read_structures(structures(tmp_path, BENT))
    assert whole.column_mass is not None
    weight = whole.column_mass * GRAVITY
    assert crushed.width == pytest.approx(1.6 - 5.0 * weight / (30.0e6 * 1.2), rel=1e-14)
    assert crushed.slenderness < whole.slenderness
    assert crushed.restitution > whole.restitution


def test_edges_that_do_not_crush_change_nothing() -> None:
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, column_mass=48e3)
    hard = bent.crushed(Pivot(compressive_strength=1e18, depth=1.0))
    for name in ("slenderness", "effective_frequency_parameter", "restitution"):
        assert getattr(hard, name) == pytest.approx(getattr(bent, name), rel=1e-9)


def test_a_block_longer_than_half_the_column_is_refused(tmp_path: Path) -> None:
    pivot = "[structure.pivot]\ncompressive_strength_pa = 1.0e6\ndepth_m = 1.2\n"
    with pytest.raises(InputError, match="longer than half the width"):
        read_structures(structures(tmp_path, BENT + pivot))
