"""Study files: strict reading, errors with the place of the mistake, schema, template."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from tests.conftest import REPOSITORY

from rockframe.cli.main import main
from rockframe.cli.options import numbers
from rockframe.errors import InputError
from rockframe.parts import Abutment, Tendon
from rockframe.study.structures import CompareEntry, read_structures
from rockframe.study.study import (
    SCHEMA,
    SHIPPED_STUDIES,
    StudyTables,
    commented_study,
    read_study,
    schema,
    structures_text,
)
from rockframe.study.toml import parse

STUDIES = REPOSITORY / "workflows" / "studies"
GOOD = """\
name = "mine"
[records]
paths = ["motions"]
units = "g"
[respond]
vertical = true
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
"""


def written(folder: Path, text: str) -> Path:
    (folder / "motions").mkdir(exist_ok=True)
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "path",
    [*sorted(STUDIES.glob("*.toml")), *sorted(SHIPPED_STUDIES.glob("*.toml"))],
    ids=lambda path: f"{path.parents[1].name}-{path.stem}",
)
def test_shipped_studies_are_read(path: Path) -> None:
    assert read_study(path).name == path.stem


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("vertical", "verticl", r":6: unknown key 'respond.verticl'. Must be one of: structure, v"),
        ("[respond]", "[response]", r":5: unknown key 'response'. Must be one of: name, .*\[resp"),
        ('name = "mine"', "", r"key 'name' missing. State it"),
        ('name = "mine"', 'name = "a b"', r":1: name 'a b'. Must be 1 to 64 letters"),
        ('"g"', '"feet"', r":4: records.units 'feet'. Must be one of: g, gal, cm/s2, mm/s2, m/s2"),
        ("true", "1", r":6: respond.vertical 1. Must be true or false"),
        (
            "[respond]",
            "[respond]\nhistories = 'some'",
            r"histories 'some'. Must be none, selected or all",
        ),
        ('["motions"]', '"motions"', r":3: records.paths 'motions'. Must be a list"),
        ('["motions"]', '["motions", "motions"]', r":3: records.paths 'motions' is stated twice"),
        ('["motions"]', '["none"]', r":3: records.paths 'none': no such file or folder"),
        ('["motions"]', "[]", r":3: records.paths \[\]. Must be"),
        (
            "[respond]",
            "[pulse]\nperiods_s=[4.0, 0.2]\n[respond]",
            r":6: pulse.periods_s \[4, 0.2\]",
        ),
        (
            "[respond]",
            "[pulse]\nperiods_s=[1.0]\n[respond]",
            r":6: pulse.periods_s \[1.0\]. Must be a list of two",
        ),
        ("[respond]", "[filters]\nmagnitude=[7, 6]\n[respond]", r":6: filters.magnitude \[7, 6\]."),
        (
            "[respond]",
            "[screen]\nscales={ from = 1, to = 2 }\n[respond]",
            r":6: screen.scales {'from': 1, 'to': 2}. Must be a list of numbers, or { from = NUMB",
        ),
        (
            "[respond]",
            "[screen]\nscales={ from = 2, to = 1, count = 3 }\n[respond]",
            r":6: screen.scales 1.5 after 2. Must increase",
        ),
        (
            "[respond]",
            f"[screen]\nscales={{ from = 0, to = 1{400 * '0'}, count = 3 }}\n[respond]",
            r":6: a whole number must fit into 64 bits",
        ),
        (
            "[respond]",
            f"[screen]\nscales={list(range(1, 2002))}\n[respond]",
            r":6: screen.scales of 2001 numbers. Must be at most 2000",
        ),
        ("[respond]", "[batches]\nrecords=0\n[respond]", r":6: batches.records 0. Must be at leas"),
        ("height_m", "height", r":9: unknown key 'height'. Must be one of: name, kind, height_m"),
        (
            "[respond]",
            "[compare.isolated]\nperiod_s = -3.0\nstrength_ratio = 0.05\n[respond]",
            r":6: compare.isolated.period_s -3.0. Must be positive",
        ),
        ("9.6", "-9.6", r":9: height_m -9.6. Must be between"),
        ("[[structure]]", "structures = 'x.toml'\n[[structure]]", r"unknown key 'respond.structur"),
        (
            'name = "mine"',
            'name = "mine"\nstructures = "x.toml"',
            r":2: structures and .* both stated",
        ),
        ('name = "mine"', 'name = "mine"\nname = "other"', r"is not TOML: Cannot overwrite"),
        ("[records]", "[records]\n[records]", r"is not TOML: Cannot declare"),
        ('"g"', '"g"\ntime_step_s = inf', r":5: records.time_step_s inf. Must be a finite number"),
        (
            "[respond]",
            "[pulse]\nweighting='enrgy'\n[respond]",
            r":6: pulse.weighting 'enrgy'. Must ",
        ),
        (
            "[respond]",
            "[pulse]\nsurrogates=9\n[respond]",
            r":6: pulse.surrogates 9. Must be 0, or 19",
        ),
        (
            "[respond]",
            "[pulse]\nsurrogates=10_000\n[respond]",
            r":6: pulse.surrogates 10000. Must be at most 9999",
        ),
        (
            "[respond]",
            "[pulse]\nrunners_up=101\n[respond]",
            r":6: pulse.runners_up 101. Must be at most 100",
        ),
        (
            "[respond]",
            "[pulse]\nwavelet=['rickr']\n[respond]",
            r":6: pulse.wavelet 'rickr'. Must be s",
        ),
        (
            "[respond]",
            "[screen]\nscales=[-1.0, 1.0]\n[respond]",
            r":6: screen.scales with -1. Must be ",
        ),
        (
            "[respond]",
            "[screen]\nazimuths_degree={ from = 0, to = 360, count = 5 }\n[respond]",
            r":5: azimuths_degree states 0 twice, or 360 apart",
        ),
        (
            "[respond]",
            "[screen]\nazimuths_degree=[10.0]\npulse_like=true\n[respond]",
            r":5: pulse_like and azimuths_degree both stated. State only one of them",
        ),
        (
            "[respond]",
            "[screen.design]\ndimension='mass_ratio'\nrange=[-1.0, 4.0]\n[respond]",
            r"design range \[-1, 4\]. Must be zero or positive, and increase",
        ),
        (
            "[respond]",
            "[spectrum]\nwavelet=['symmetric_ricker']\nslenderness_degree=[10.0]\n"
            "frequency_ratio=[2.0]\nhalf_cycles=2.0\n[respond]",
            r":5: Invalid half_cycles 2.0. Must be None for symmetric_ricker",
        ),
        (
            "[respond]",
            "[spectrum]\nwavelet=['symmetric_ricker']\nslenderness_degree=[10.0]\n"
            "frequency_ratio=[2.0]\nphase_degree=90.0\n[respond]",
            r":5: phase_degree 90: Invalid phase 1.57.* Must be 0 or pi",
        ),
        ('"g"', '"g"\nazimuth_degree=1.0\nstrike_degree=2.0', r"State only one of them"),
        ("[respond]\nvertical = true", "respond = 3", r"unknown key 'records.respond'"),
    ],
)
def test_each_mistake_is_named_with_its_place(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    path = written(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=words) as caught:
        read_study(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = " + "[" * 5000 + "]" * 5000, "nested too deeply. Must be 16 levels"),
        ("[" + "a." * 5000 + "a]", "nested too deeply"),
        (f"[records]\ntime_step_s = {'9' * 5000}", "whole number must fit into 64 bits"),
        (f"[records]\ntime_step_s = 0x{'f' * 5000}", "whole number must fit into 64 bits"),
    ],
    ids=["lists", "tables", "digits", "hexadecimal"],
)
def test_what_python_cannot_parse_or_print_is_one_line(
    tmp_path: Path, text: str, words: str
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_study(path)
    assert len(str(caught.value)) < 300


def test_evenly_spaced_numbers_are_those_of_the_command(tmp_path: Path) -> None:
    """The 30 numbers from 0.1 to 3 are those of `0.1:3:30`; they include 1 exactly."""
    stated = "[screen]\nscales = { from = 0.1, to = 3.0, count = 30 }\n[respond]"
    study = read_study(written(tmp_path, GOOD.replace("[respond]", stated)))
    assert study.tables.screen is not None
    assert list(study.tables.screen.scales) == numbers("0.1:3:30")
    assert 1.0 in study.tables.screen.scales


def test_both_ends_are_met_to_the_last_bit() -> None:
    """The ends are taken as stated, not computed, because 0.1 * 3 / 3 is not 0.1."""
    for count in range(2, 50):
        spaced = numbers(f"0.1:2.7:{count}")
        assert (len(spaced), spaced[0], spaced[-1]) == (count, 0.1, 2.7)


def test_structures_of_a_study_are_those_of_its_file(tmp_path: Path) -> None:
    """The stages read the structures of a study from a file that is written from the study."""
    study = read_study(written(tmp_path, GOOD + "inertia_ratio = 1.4\n"))
    (tmp_path / "structures.toml").write_text(structures_text(study))
    (frame,) = read_structures(tmp_path / "structures.toml")
    assert (frame.name, frame.height, frame.width, frame.inertia_ratio) == ("bent", 9.6, 1.6, 1.4)


def test_restraints_of_a_study_reach_the_file_of_its_structures(tmp_path: Path) -> None:
    """A yield stress and a length that are not stated are not written: TOML has no null."""
    tables = "column_mass_kg = 48e3\n[structure.tendon]\narea_m2 = 1e-3\nmodulus_pa = 195e9\n"
    study = read_study(written(tmp_path, GOOD + tables + "[structure.abutment]\ngap_m = 0.2\n"))
    (tmp_path / "structures.toml").write_text(structures_text(study))
    (frame,) = read_structures(tmp_path / "structures.toml")
    assert frame.tendon == Tendon(area=1e-3, modulus=195e9, length=9.6)
    assert frame.abutment == Abutment(gap=0.2)


def test_tables_survive_the_plan_of_a_run(tmp_path: Path) -> None:
    """A plan is JSON, which has no infinity: a tendon that never yields has yield stress null."""
    text = GOOD + "[compare.restrained]\narea_m2 = 1e-3\nmodulus_pa = 195e9\n"
    stated = read_study(written(tmp_path, text)).parameters()["compare"]
    assert stated["restrained"]["yield_stress_pa"] is None
    assert CompareEntry.model_validate(stated).restrained == Tendon(area=1e-3, modulus=195e9)


def test_paths_are_beside_the_study_wherever_it_is_read_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, GOOD)
    monkeypatch.chdir(tmp_path)
    assert read_study(Path("mine.toml")).records == (tmp_path / "motions",)


def test_mass_ratio_is_looked_for_from_a_column_alone(tmp_path: Path) -> None:
    """As on the command line, a range from 0 is valid for a mass ratio but not for a height."""
    design = "[screen.design]\ndimension = 'mass_ratio'\nrange = [0, 4]\n"
    study = read_study(written(tmp_path, GOOD.replace("[respond]", f"{design}[respond]")))
    assert study.tables.screen is not None
    assert study.tables.screen.design is not None
    assert study.tables.screen.design.range == (0.0, 4.0)


def test_init_writes_what_run_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "mine"]) == 0
    assert "rockframe run mine.toml --output mine" in capsys.readouterr().out
    assert read_study(tmp_path / "mine.toml").name == "mine"
    assert main(["init", "mine"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["init", "../mine"]) == 2
    assert main(["init", "other.toml"]) == 0
    assert "rockframe run other.toml --output other" in capsys.readouterr().out
    assert main(["init", "my study.toml"]) == 2
    assert "Must be 1 to 64 letters, digits, points" in capsys.readouterr().err


def test_template_states_the_defaults_and_every_key(tmp_path: Path) -> None:
    """The template as written states the defaults, and it names every key of a study."""
    text = commented_study("mine")
    path = tmp_path / "mine.toml"
    path.write_text(text)
    stated = read_study(path).tables
    bare = StudyTables.model_validate({"name": "mine", "records": {}})
    assert stated.model_dump(exclude={"screen", "spectrum"}) == bare.model_dump(
        exclude={"screen", "spectrum"}
    )
    keys = [line.lstrip("# ").split(" = ")[0] for line in text.splitlines() if " = " in line]
    words = re.findall(r"\w+", text.partition("# Columns of other shapes:")[2])
    for model in StudyTables.model_json_schema()["$defs"].values():
        assert set(model["properties"]) <= {*keys, *words, "design", "ensemble"}


def test_schema_of_the_shipped_studies_is_the_present_one() -> None:
    assert (STUDIES / SCHEMA).read_text(encoding="utf-8") == schema()


@pytest.mark.parametrize("path", sorted(STUDIES.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_studies_have_no_key_that_the_schema_lacks(path: Path) -> None:
    described = json.loads(schema())
    stated = tomllib.loads(path.read_text(encoding="utf-8"))
    assert set(stated) <= set(described["properties"])
    assert path.read_text(encoding="utf-8").startswith(f"#:schema ./{SCHEMA}\n")


def test_study_of_the_howto_of_archives_is_one() -> None:
    page = (REPOSITORY / "docs" / "howto" / "archive.md").read_text(encoding="utf-8")
    text = page.split("```toml\n")[1].split("```")[0]
    assert parse(Path("site.toml"), text, StudyTables).name == "site"
