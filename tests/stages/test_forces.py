"""Forces at the joints in response.nc, table.csv, the terminal, the figure and the report."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from numpy.testing import assert_allclose
from tests.commands import run
from tests.screening import sine, stored

from rockframe import (
    Ensemble,
    RespondOptions,
    RockingFrame,
    read_structures,
    respond,
    respond_stage,
)
from rockframe.cells import number
from rockframe.cli.main import main
from rockframe.figures.joints import draw_forces, draw_joints
from rockframe.report.page import payload
from rockframe.results.records import open_records
from rockframe.results.run import read_histories, read_run
from rockframe.results.schema.response import FORCES
from rockframe.results.tables.forces import (
    FORCE_CELLS,
    FORCE_VALUES,
    STATE_FRICTION,
    STATE_MASS,
    force_rows,
    force_text,
    forces_in_words,
    kilonewtons,
)
from rockframe.rocking import joint_forces, with_forces
from rockframe.study.frames import StructureEntry
from rockframe.units import GRAVITY

STRUCTURES = """
[[structure]]
name = "bent"
height_m = 4.0
width_m = 0.25
section = "circular"
mass_ratio = 2.0
density_kg_m3 = 2500.0
friction_coefficient = 0.02
[structure.tendon]
area_m2 = 1.0e-5
modulus_pa = 195.0e9
[structure.dissipater]
stiffness_n_m = 1.0e6
yield_force_n = 50.0
lever_arm_m = 0.125

[[structure]]
name = "column"
height_m = 3.0
width_m = 0.25
"""
SMALL = Ensemble(members=16)
OPTIONS = RespondOptions(margins="none", histories="none", forces=True, ensemble=SMALL)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with records, structures and a response file with forces.

    The quiet record makes the bent rock, the loud one overturns both structures.
    """
    folder = tmp_path_factory.mktemp("forces")
    stored([sine("quiet", 0.7), sine("loud", 4.0)], folder)
    (folder / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    respond_stage(
        folder / "records.nc",
        folder / "response.nc",
        OPTIONS,
        structures_path=folder / "structures.toml",
    )
    return folder


def rows_of(home: Path) -> list[dict[str, Any]]:
    with xr.open_dataset(home / "response.nc") as dataset:
        return list(force_rows(dataset))


def test_the_file_has_the_forces_of_the_responses(home: Path) -> None:
    frames = read_structures(home / "structures.toml")
    with open_records(home / "records.nc") as file, xr.open_dataset(home / "response.nc") as made:
        assert_allclose(made["weight"], [frame.weight for frame in frames])
        assert_allclose(made["friction_coefficient"], [0.02, math.nan])
        for i, name in enumerate(file.names):
            record = file.read(name)
            for k, frame in enumerate(frames):
                one = with_forces(respond(frame, record), record, SMALL)
                assert one.forces is not None
                assert one.force_bands is not None
                for force in dataclasses.asdict(one.forces):
                    assert force in FORCES
                    band = f"{force}_band"
                    assert_allclose(made[force][i, k], getattr(one.forces, force), rtol=1e-12)
                    expected = getattr(one.force_bands, force)
                    # two kernels, whose last bits a rocking response amplifies
                    assert_allclose(made[band][i, k], expected, rtol=1e-6)


def test_newtons_are_ratios_times_the_weight(home: Path) -> None:
    [frame, _] = read_structures(home / "structures.toml")
    mass = 2500.0 * math.pi / 4.0 * 0.25**2 * 4.0
    assert math.isclose(frame.weight, 3.0 * mass * GRAVITY)
    rows = [row for row in rows_of(home) if row["structure"] == "bent"]
    with open_records(home / "records.nc") as file:
        record = file.read(rows[0]["record_id"])
    found = {row["force"]: row for row in rows if row["record_id"] == record.record_id}
    response = respond(frame, record)
    nominal, tied = dataclasses.asdict(joint_forces(response, record)), response.restraint
    assert tied is not None
    for name, ratio in nominal.items():
        assert_allclose(found[name]["value"], ratio * 3.0 * mass * GRAVITY / 1000.0, rtol=1e-12)
        assert found[name]["unit"] == ("kN s" if "impulse" in name else "kN")
        assert_allclose(found[name]["weight_kn"], frame.weight / 1000.0)
    assert_allclose(found["peak_tendon_force"]["value"], tied.peak_tendon_force / 1000.0)
    assert_allclose(found["peak_dissipater_force"]["value"], tied.peak_dissipater_force / 1000.0)
    assert found.keys() == {*nominal, "peak_tendon_force", "peak_dissipater_force"}


def test_forces_of_a_fall_are_not_known(home: Path) -> None:
    """The largest force of a tendon, too, would only describe the fall."""
    fallen = [row for row in rows_of(home) if row["record_id"] == "loud"]
    assert {row["structure"] for row in fallen} == {"bent", "column"}
    assert any(row["force"] == "peak_tendon_force" for row in fallen)
    assert all(math.isnan(row["value"]) for row in fallen)
    least = [row["value_16"] for row in fallen if row["force"].endswith("_least")]
    assert set(least) == {-math.inf}


def test_without_mass_rows_are_ratios_and_words_say_what_to_state(home: Path) -> None:
    rows = [row for row in rows_of(home) if row["structure"] == "column"]
    assert {row["unit"] for row in rows} == {"W", "W s"}
    assert not any(row["force"].startswith(("top", "tendon", "dissipater")) for row in rows)
    assert forces_in_words(rows).endswith(f"{STATE_MASS} {STATE_FRICTION}")
    both = forces_in_words([row for row in rows_of(home) if row["structure"] == "bent"])
    assert STATE_MASS not in both
    assert STATE_FRICTION not in both


def test_forces_cost_nothing_unless_they_are_requested(home: Path, tmp_path: Path) -> None:
    output = tmp_path / "response.nc"
    options = OPTIONS.model_copy(update={"forces": False})
    structures = home / "structures.toml"
    respond_stage(home / "records.nc", output, options, structures_path=structures)
    with xr.open_dataset(output) as made:
        bands = {f"{name}_band" for name in FORCES} - {"peak_base_shear_band"}  # of all ensembles
        assert not ({*FORCES} | bands) & {*made.variables}
        assert "weight" in made
        assert not list(force_rows(made))


def test_the_command_prints_forces_in_kilonewtons(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["respond", str(home / "records.nc"), "--structures", str(home / "structures.toml")]
    words += ["--margins", "none", "--ensemble-members", "16", "--output", str(tmp_path / "r.nc")]
    assert main([*words, "--forces"]) == 0
    printed = capsys.readouterr().out.partition("Forces in")[2]
    shown = [line.split() for line in printed.splitlines()]
    key = next(row for row in rows_of(home) if row["force"] == "base_key_force")
    values = [force_text(key, name) for name in ("value", "value_16", "value_50", "value_84")]
    assert ["base", "joint,", "shear", "key", "[kN]", *values] in [line[-9:] for line in shown]
    weight = f"{key['weight_kn']:.0f}"
    assert [line[-1] for line in shown if line[:2] == ["quiet", "bent"]] == [weight]
    assert " ".join(STATE_MASS.split()) in " ".join(printed.split())
    assert "Without the vertical motion" in printed
    assert main([*words, "--forces", "--json"]) == 0
    (first, *_) = json.loads(capsys.readouterr().out)["responses"]
    assert_allclose(first["base_key_force_kn"], key["value"])
    assert main(words) == 0
    assert "Forces in" not in capsys.readouterr().out


def test_without_an_ensemble_the_table_has_no_quantiles(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a narrow terminal too, the values stay: what is left out first is the weight."""
    monkeypatch.setenv("COLUMNS", "46")
    words = ["respond", str(home / "records.nc"), "--structures", str(home / "structures.toml")]
    words += ["--margins", "none", "--ensemble-members", "0", "--output", str(tmp_path / "r.nc")]
    assert main([*words, "--forces"]) == 0
    printed = capsys.readouterr().out.partition("Forces in")[2]
    assert " 50 %" not in printed
    assert "16, 50, 84 %" not in printed
    assert "nominal" in printed.partition("columns left out")[0]
    assert "overturns" in printed


def test_figures_need_forces_and_are_drawn_for_each_record(
    home: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["respond", str(home / "records.nc"), "--structures", str(home / "structures.toml")]
    words += ["--margins", "none", "--ensemble-members", "16", "--output", str(tmp_path / "r.nc")]
    words += ["--figures", str(tmp_path / "drawn")]
    assert main(words) == 2
    assert (
        "--figures has no effect without --forces or --scales: there is nothing to draw."
        in capsys.readouterr().err
    )
    assert not (tmp_path / "r.nc").exists()
    assert main([*words, "--forces"]) == 0
    names = {row["record_id"] for row in rows_of(home)}
    printed = capsys.readouterr().out
    assert all(str(tmp_path / "drawn" / "forces" / f"{name}.png") in printed for name in names)
    assert {file.stem for file in (tmp_path / "drawn" / "forces").glob("*.png")} == names


def test_a_run_draws_forces_and_its_report_lists_them(motion: Path, tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    (tmp_path / "structures.toml").write_text(STRUCTURES, encoding="utf-8")
    study.write_text(
        f'name = "forces"\nstructures = "structures.toml"\n[records]\npaths = ["{motion}"]\n'
        'units = "g"\ntime_step_s = 0.01\n[pulse]\nsurrogates = 0\n'
        '[respond]\nforces = true\nmargins = "none"\nensemble = { members = 16 }\n',
        encoding="utf-8",
    )
    assert run("run", study, "--output", tmp_path / "run") == 0
    assert (tmp_path / "run" / "figures" / "forces" / "motion.png").is_file()
    content = read_run(tmp_path / "run")
    pair = ("motion", "bent")
    facts, _ = payload(content, read_histories(tmp_path / "run", [pair]))
    [shown] = facts["pairs"]
    rows = content.forces[pair]
    key = next(row for row in rows if row["force"] == "base_key_force")
    words = [force_text(key, name) for name in FORCE_VALUES]
    assert ["base joint, shear key [kN]", *words] in shown["forces"]["rows"]
    assert len(shown["forces"]["rows"]) == len(rows)
    assert not {fact[0] for fact in shown["facts"] if "over the weight" in fact[0]}


def test_the_table_has_forces_over_the_weight_and_in_kilonewtons(home: Path) -> None:
    run("pulse", home / "records.nc", "--surrogates", "0", "--output", home / "p.nc")
    names = ("records.nc", "p.nc", "response.nc")
    run("table", *(home / name for name in names), "--output", home / "table.csv")
    with (home / "table.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert {*FORCE_CELLS} < rows[0].keys()
    weight = 1000.0 * number(rows[0]["weight_kn"])
    for name in FORCE_CELLS:
        head = name.removesuffix("_s")
        if "_kn" not in name:
            in_kn = number(rows[0][f"{head}_kn{name.removeprefix(head)}"])
            assert_allclose(in_kn, kilonewtons(number(rows[0][name]), weight), err_msg=name)
    assert rows[1]["structure"] == "column"
    assert rows[1]["base_key_force"]
    assert not rows[1]["base_key_force_kn"] + rows[1]["weight_kn"]


def test_a_key_for_the_friction_is_checked_like_others() -> None:
    entry = StructureEntry(name="bent", height_m=4.0, width_m=0.5, friction_coefficient=0.4)
    assert entry.made().friction_coefficient == 0.4


# Figures


def row(force: str, *values: float, unit: str = "kN") -> dict[str, Any]:
    keys = ("value", "value_16", "value_50", "value_84")
    shared = {"record_id": "shake", "structure": "bent", "friction_coefficient": 0.3}
    return {**shared, "force": force, "unit": unit, **dict(zip(keys, values, strict=True))}


def bar_ends(axes: Axes) -> list[tuple[float, float]]:
    """Return the ends of the bars along the horizontal axis."""
    back = axes.transData.inverted()
    return [tuple(bar.get_window_extent().transformed(back).intervalx) for bar in axes.patches]


def test_the_figure_has_a_bar_from_quantile_to_quantile_of_each_force() -> None:
    rows = [
        row("peak_base_shear", 5.0, 4.0, 6.0, 8.0),
        row("base_key_force", 1.0, 0.5, 2.0, math.inf),
        row("base_joint_vertical_least", 9.0, -math.inf, 9.5, 9.9),
        row("base_impulse_vertical", math.nan, math.inf, math.inf, math.inf, unit="kN s"),
    ]
    drawn = draw_forces(rows, "shake")
    across, down, impulses = drawn.figure.axes
    assert [axes.get_xlabel().rpartition("[")[2] for axes in drawn.figure.axes] == [
        "kN]",
        "kN]",
        "kN s]",
    ]
    ends = bar_ends(across)
    assert_allclose(ends, [(4.0, 8.0), (0.5, across.get_xlim()[1])])
    assert_allclose(bar_ends(down), [(0.0, 9.9)], atol=1e-12)
    assert [line.get_marker() for line in impulses.lines] == [">", "D"]
    assert [line.get_marker() for line in down.lines] == ["<", "None", "D"]
    nominal = [np.asarray(one.get_xdata()) for one in across.lines if one.get_marker() == "D"]
    assert_allclose(nominal, [[5.0], [1.0]])


def test_the_figure_of_joints_is_in_kilonewtons_where_the_mass_is_known(home: Path) -> None:
    """In the same motion, each curve is the ratio times its static force."""
    heavy = RockingFrame(height=4.0, width=0.25, mass_ratio=2.0, column_mass=2000.0)
    plain = dataclasses.replace(heavy, column_mass=None)
    with open_records(home / "records.nc") as file:
        record = file.read(file.names[0])
    ratios, forces = (draw_joints(record, one, spacing=6.0) for one in (plain, heavy))
    over, loads = (one.figure.axes[2] for one in (ratios, forces))
    assert over.get_ylabel() == "vertical force / static"
    assert loads.get_ylabel() == "vertical force [kN]"
    statics = (heavy.weight, heavy.weight * 2.0 / 3.0, heavy.weight * 2.0 / 3.0)
    for one, other, static in zip(over.lines, loads.lines, statics, strict=False):
        drawn = [np.asarray(line.get_ydata(), dtype=float) for line in (one, other)]
        assert_allclose(drawn[1], drawn[0] * static / 1000.0, rtol=1e-12)
    assert f"weighs {heavy.weight / 1000.0:.0f} kN" in forces.caption
    assert "kN" not in ratios.caption


def test_the_figure_of_joints_assumes_the_friction_of_the_structure(home: Path) -> None:
    """A stated friction replaces that of the structure, which replaces 0.5."""
    with open_records(home / "records.nc") as file:
        record = file.read(file.names[0])
    plain = RockingFrame(height=4.0, width=0.25, mass_ratio=2.0)
    rough = dataclasses.replace(plain, friction_coefficient=0.7)
    assert "a coefficient of 0.5," in draw_joints(record, plain).caption
    assert "a coefficient of 0.7," in draw_joints(record, rough).caption
    assert "a coefficient of 0.3," in draw_joints(record, rough, friction=0.3).caption


def test_the_joints_of_a_frame_at_rest_are_drawn_without_its_columns(home: Path) -> None:
    """At rest the forces of single columns are not known; this was a warning of numpy."""
    with open_records(home / "records.nc") as file:
        record = file.read(file.names[0])
    stocky = RockingFrame(height=1.0, width=0.8, mass_ratio=2.0)
    drawn = draw_joints(record, stocky, spacing=6.0)
    assert "no lift-off holds" in drawn.caption
