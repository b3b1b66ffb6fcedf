"""Runs: interruption, resuming, repetition, status and the removal of partial files."""

from __future__ import annotations

import csv
import json
import re
import shutil
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from filelock import lock_descriptor, unlock_descriptor
from tests.runs.small import FEW, contents, make_study, run
from tests.runs.small import STUDY as FIVE

from rockframe.cli.main import main
from rockframe.provenance import sealed
from rockframe.runs import performing
from rockframe.runs.plan import make_plan, steps_of
from rockframe.runs.state import is_locked, locked, read_plan, states_of, write_plan
from rockframe.study.study import read_study

#: Each record is a batch.
STUDY = FIVE.replace("records = 2", "records = 1")
PLAIN = STUDY.replace("most = 1", "most = 0")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `run`."""
    home = tmp_path_factory.mktemp("made")
    assert run(make_study(home, 3, STUDY), home / "run") == 0
    return home


@pytest.fixture
def home(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder, for a test to change."""
    return Path(shutil.copytree(finished, tmp_path / "home"))


def states(folder: Path) -> dict[str, str]:
    return {state.step.name: state.state for state in states_of(read_plan(folder), folder)}


def steps_done(home: Path, capsys: pytest.CaptureFixture[str], *words: str) -> set[str]:
    """Run again and return the names of the steps that were executed."""
    capsys.readouterr()
    run(home / "small.toml", home / "run", "--json", *words)
    return set(json.loads(capsys.readouterr().out)["steps_done"])


def test_a_run_without_a_terminal_says_each_step_and_the_summary(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (home / "run" / "table.csv").unlink()
    capsys.readouterr()
    assert run(home / "small.toml", home / "run") == 0
    said = capsys.readouterr()
    lines = [line for line in said.err.splitlines() if " s" in line and "made again" not in line]
    assert re.fullmatch(r"rockframe: 1/\d+ table, \d+\.\d s", lines[0])
    assert said.out.splitlines()[0].strip() == "Over all records"
    assert main(["verify", str(home / "run")]) == 0
    files = re.findall(r"(\d+) files", said.out + capsys.readouterr().out)
    assert files[0] == files[1]  # both count the files that the manifest lists
    assert main(["status", str(home / "run")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "complete"


def test_a_step_prints_json_as_other_commands_do(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["step", str(home / "run"), "table", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content == {"step": "table", "outputs": ["table.csv", "summary.csv"], "rejected": False}


def test_a_run_is_whole(finished: Path) -> None:
    assert main(["verify", str(finished / "run")]) == 0
    assert set(states(finished / "run").values()) == {"done"}
    assert len([*(finished / "run" / "shards").iterdir()]) == 6


@pytest.mark.faults
def test_run_elsewhere_gives_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    """The outputs of a run do not depend on its location."""
    study = make_study(tmp_path / "elsewhere", 3, STUDY)
    assert run(study, tmp_path / "elsewhere" / "deep" / "run") == 0
    assert contents(tmp_path / "elsewhere" / "deep" / "run") == contents(finished / "run")


def test_run_in_a_pool_gives_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    study = make_study(tmp_path / "pool", 3, STUDY)
    words = ["run", str(study), "--output", str(tmp_path / "run"), "--workers", "2"]
    assert main(words) == 0
    assert contents(tmp_path / "run") == contents(finished / "run")


def test_unchanged_study_is_left_alone(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = {path: path.stat().st_mtime_ns for path in (home / "run").glob("[a-z]*.*")}
    assert steps_done(home, capsys) == set()
    after = {path: path.stat().st_mtime_ns for path in (home / "run").glob("[a-z]*.*")}
    assert after == before


def test_option_of_a_stage_concerns_what_follows_it(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (home / "small.toml").write_text(PLAIN + "[pulse]\nperiods_s = [0.3, 4.0]\n")
    done = steps_done(home, capsys)
    assert "ingest" not in done
    assert "respond-001" not in done
    assert {"pulse-001", "pulse-003", "index-pulse", "table", "manifest", "report"} <= done


def test_tables_do_not_depend_on_batches(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Other batches are other files with the same rows; the former files are removed."""
    tables = {name: value for name, value in contents(home / "run").items() if ".csv" in name}
    (home / "small.toml").write_text(STUDY.replace("records = 1", "records = 2"))
    done = steps_done(home, capsys)
    assert {"pulse-001", "respond-002", "index-respond"} <= done
    assert "ingest" not in done
    assert {name: contents(home / "run")[name] for name in tables} == tables
    shards = sorted(path.name for path in (home / "run" / "shards").iterdir())
    assert shards == [f"{kind}-00{k}.nc" for kind in ("pulses", "response") for k in (1, 2)]


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("response.nc", "truncated"),
        *(
            pytest.param(name, damage, marks=pytest.mark.faults)
            for name in ("records.nc", "pulses.nc", "response.nc", "table.csv")
            for damage in ("truncated", "flipped", "gone")
        ),
    ],
)
def test_damaged_file_is_named_and_made_again(
    home: Path, name: str, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = contents(home / "run")
    path = home / "run" / name
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    if damage == "gone":
        path.unlink()
    else:
        path.write_bytes(content if damage == "flipped" else content[: len(content) // 2])
    assert main(["verify", str(home / "run")]) == 1
    assert str(path) in capsys.readouterr().err
    assert "damaged" in states(home / "run").values()
    assert run(home / "small.toml", home / "run") == 0
    assert f"{path}: {'missing' if damage == 'gone' else 'is corrupted'}" in capsys.readouterr().err
    assert contents(home / "run") == before


def test_changed_record_is_read_again(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    motion = home / "motions" / "motion-2.csv"
    motion.write_text(motion.read_text().replace("0.3", "0.2"))
    (home / "small.toml").write_text(PLAIN.replace("records = 1", "records = 9"))
    assert "ingest" in steps_done(home, capsys)
    assert main(["verify", str(home / "run")]) == 0


@pytest.mark.faults
@pytest.mark.parametrize("change", ["changed", "vanished"])
def test_record_that_changes_under_way_spoils_the_manifest(
    tmp_path: Path, change: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The record changes between ingest and manifest, so the outputs are not those of the file."""
    from rockframe.results.tables.entries import write_rows_as

    study, motion = make_study(tmp_path), tmp_path / "motions" / "motion-1.csv"
    original, write = motion.read_bytes(), write_rows_as

    def meddle(*arguments: Any) -> int:
        if change == "changed":
            motion.write_bytes(original + b"0.0\n")
        else:
            motion.unlink(missing_ok=True)  # each of several tables is written so
        return write(*arguments)

    monkeypatch.setattr("rockframe.stages.table.write_rows_as", meddle)
    assert run(study, tmp_path / "run") == 2
    assert f"{motion}: {change} since the run began" in capsys.readouterr().err
    assert not (tmp_path / "run" / "manifest.json").exists()
    monkeypatch.undo()
    motion.write_bytes(original)
    assert run(study, tmp_path / "run") == 0


def test_a_lost_shard_is_computed_alone(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = contents(home / "run")
    shard = home / "run" / "shards" / "response-002.nc"
    shard.unlink()
    assert main(["verify", str(home / "run")]) == 1
    said = capsys.readouterr().err
    assert f"{shard}: missing, although the manifest lists it" in said
    assert steps_done(home, capsys) == {"respond-002", "manifest", "verify"}
    assert contents(home / "run") == before


def test_a_run_of_an_earlier_version_is_resumed(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its steps said whether their files were temporary, and its batches were elsewhere."""
    plan = home / "run" / ".rockframe" / "plan.json"
    content = json.loads(plan.read_text())
    del content[next(iter(content))]  # its own hash
    for step in content["steps"]:
        step["temporary"] = step["name"].startswith("respond-")
        step["outputs"] = [name.replace("shards/", "batches/") for name in step["outputs"]]
    plan.write_bytes(sealed(content))
    (home / "run" / "shards").rename(home / "run" / "batches")
    assert "respond-001" in steps_done(home, capsys)
    assert not (home / "run" / "batches").exists()
    assert main(["verify", str(home / "run")]) == 0


def test_a_page_is_made_of_indexes(home: Path, tmp_path: Path) -> None:
    files = [str(home / "run" / f"{kind}.nc") for kind in ("records", "pulses", "response")]
    assert main(["report", *files, "--output", str(tmp_path / "page.html")]) == 0
    assert (tmp_path / "page.html").stat().st_size > 10_000


def test_the_default_size_of_batches_makes_150_at_most(home: Path) -> None:
    for size, batches in ((50, 150), (49, 205), (10_000, 1)):
        (home / "small.toml").write_text(STUDY.replace("records = 1", f"records = {size}"))
        steps = steps_of(read_study(home / "small.toml"), 10_000)
        assert max(step.batch[1] for step in steps) == batches


def test_half_written_files_are_swept_and_those_of_others_stay(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ours = home / "run" / ".response-abcd1234.partial.nc"
    partial = [home / "run" / name for name in (".mine-abcd1234.partial.nc", "notes.partial.txt")]
    for path in (ours, *partial):
        path.write_text("half")
    steps_done(home, capsys)
    assert not ours.exists()
    assert all(path.exists() for path in partial)


@pytest.mark.parametrize(
    "left",
    [
        ".records-abcd1234.partial.nc/recorded.nc",
        ".screen-0123456789abcdef.batches/.peaks-1-abcd1234.partial.npz",
        "shards/.screen-009-0123456789abcdef.batches/peaks-1.npz",
    ],
)
def test_folder_left_by_a_kill_is_swept(
    home: Path, left: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The folders are from records being rotated and from a screening no longer in the study."""
    (home / "run" / left).parent.mkdir()
    (home / "run" / left).write_bytes(b"half")
    (home / "run" / "table.csv").unlink()
    assert {"table", "verify"} <= steps_done(home, capsys)
    assert not (home / "run" / left).parent.exists()


def test_records_that_are_turned_are_half_written_under_a_name_that_is_swept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from rockframe.stages import ingest

    names: list[str] = []

    def kill(_recorded: object, output: Path, **_options: object) -> None:
        names.extend(path.name for path in output.parents[1].iterdir())
        raise KeyboardInterrupt

    monkeypatch.setattr(ingest, "write_records", kill)
    study = make_study(tmp_path, 1, STUDY.replace('units = "g"', 'units = "g"\nazimuth_degree = 9'))
    assert run(study, tmp_path / "run") == 130
    (half,) = (name for name in names if "partial" in name)
    (tmp_path / "run" / half).mkdir()
    monkeypatch.undo()
    assert run(study, tmp_path / "run") == 2  # one motion alone cannot be rotated
    assert not (tmp_path / "run" / half).exists()


def test_second_run_is_refused(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with locked(home / "run"):
        assert run(home / "small.toml", home / "run") == 2
        assert main(["status", str(home / "run"), "--json"]) == 0
    printed = capsys.readouterr()
    assert "in use by another run. Wait until it ends." in printed.err
    assert json.loads(printed.out)["running"] is True


def test_a_look_at_the_lock_keeps_no_run_out(home: Path) -> None:
    """`status` holds the lock for a moment, and a run waits for it."""
    with (home / "run" / ".rockframe" / "lock").open() as look:
        assert lock_descriptor(look.fileno(), blocking=False)
        gone = threading.Timer(0.02, unlock_descriptor, (look.fileno(),))
        gone.start()
        with locked(home / "run"):
            assert is_locked(home / "run")
        gone.join()


@pytest.mark.parametrize(
    ("step", "moment"),
    [("ingest", "before"), ("pulse", "after"), ("draw", "before"), ("manifest", "after")],
)
def test_folder_that_is_renamed_under_way_is_one_line_and_not_made_anew(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    step: str,
    moment: str,
) -> None:
    study = make_study(tmp_path, 1, FEW.replace("most = 0", "most = 1"))
    folder = tmp_path / "run"
    perform = performing.do

    def do(work: performing.Work) -> object:
        if work.step.name == step and moment == "before":
            folder.rename(tmp_path / "elsewhere")
        done = perform(work)
        if work.step.name == step and moment == "after":
            folder.rename(tmp_path / "elsewhere")
        return done

    monkeypatch.setattr(performing, "do", do)
    assert run(study, folder) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if " error: " in line]
    assert said == [
        f"rockframe: error: {folder}: was renamed or removed during this command. "
        "Restore its name, or repeat the command."
    ]
    assert not folder.exists()
    (tmp_path / "elsewhere").rename(folder)
    monkeypatch.undo()
    assert step != "manifest" or run(study, folder) == 0


def test_folder_of_another_study_is_refused_unless_asked(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = home / "other.toml"
    other.write_text(PLAIN.replace('"small"', '"other"').replace("records = 1", "records = 9"))
    assert run(other, home / "run") == 2
    assert "holds the run of the study 'small'" in capsys.readouterr().err
    assert run(other, home / "run", "--replace") == 0
    assert main(["verify", str(home / "run")]) == 0


def test_command_keeps_the_run_of_a_study_that_has_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It would not write the outputs of further stages, and would remove them."""
    study, folder = make_study(tmp_path, 1, FEW.replace('"small"', '"table1"')), tmp_path / "run"
    assert run(study, folder, "--plan") == 0
    written, response = contents(folder), folder / "response.nc"
    response.write_text("of the study")
    words = ["--records", str(tmp_path / "motions"), "--output", str(folder)]
    assert main(["table1", *words]) == 2
    said = capsys.readouterr().err
    assert f"{folder}: holds the run of the study 'table1'. Use another folder.\n" in said
    assert contents(folder) == {**written, "response.nc": b"of the study"}
    write_plan(replace(read_plan(folder), of_command=True), folder)
    assert run(study, folder) == 2
    assert "holds the run of the command table1. Use another folder, or --replace" in (
        capsys.readouterr().err
    )
    assert response.read_text() == "of the study"
    assert run(study, folder, "--plan", "--replace") == 0


def test_folder_of_something_else_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "table.csv").write_text("mine")
    assert run(study, tmp_path / "run") == 2
    assert "holds table.csv. Use another folder, or --replace" in capsys.readouterr().err
    assert (tmp_path / "run" / "table.csv").read_text() == "mine"


def test_folder_among_the_records_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path)
    assert run(study, tmp_path / "motions" / "run") == 2
    assert "lies among the records" in capsys.readouterr().err


def test_manifest_alone_says_what_is_done(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A workflow leaves no stamps; then only the report and `verify` are repeated."""
    shutil.rmtree(home / "run" / ".rockframe" / "steps")
    assert steps_done(home, capsys) == {"report", "verify"}


def test_list_of_inputs_names_every_file(finished: Path) -> None:
    with (finished / "run" / "inputs.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["file"] for row in rows] == [f"motions/motion-{k}.csv" for k in range(3)]
    manifest = json.loads((finished / "run" / "manifest.json").read_text())
    assert manifest["inputs"] == {row["file"]: row["sha256"] for row in rows}


def test_subfolders_and_station_files_are_inputs(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    deeper = tmp_path / "motions" / "deeper"
    deeper.mkdir()
    for name in ("more.csv", "station.xml"):
        (deeper / name).write_text("x")
    (tmp_path / "motions" / ".hidden").write_text("x")
    plan = make_plan(read_study(study), tmp_path / "run")
    names = [file.name for file in plan.inputs]
    assert {"motions/deeper/more.csv", "motions/deeper/station.xml"} <= set(names)
    assert "motions/.hidden" not in names


def test_plan_is_read_as_it_was_written(tmp_path: Path) -> None:
    plan = make_plan(read_study(make_study(tmp_path)), tmp_path / "run")
    write_plan(plan, tmp_path / "run")
    assert read_plan(tmp_path / "run") == plan


def test_status_of_half_a_run(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A run is complete only if every step is done, including `report` and `verify`."""
    (home / "run" / ".rockframe" / "steps" / "verify.json").unlink()
    capsys.readouterr()
    assert main(["status", str(home / "run"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["complete"] is False
    assert {"name": "verify", "state": "to do", "fault": "", "reason": "not run yet"} in told[
        "steps"
    ]
    assert main(["status", str(home / "run")]) == 0
    assert "not complete" in capsys.readouterr().out


def test_status_tells_of_inputs_that_are_not_as_they_were(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The run is intact, but its records have changed since it was planned."""
    plan = read_plan(home / "run")
    write_plan(make_plan(read_study(home / "small.toml"), home / "run"), home / "run")
    assert plan.keys == read_plan(home / "run").keys
    (home / "motions" / "motion-1.csv").write_text("0.1\n")
    (home / "motions" / "motion-2.csv").unlink()
    assert main(["status", str(home / "run"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told["inputs_changed"].values()) == ["changed", "vanished"]
    assert main(["status", str(home / "run")]) == 0
    told = capsys.readouterr().out
    assert "2 of 5 inputs changed or are missing since the run was planned" in told
    assert "`rockframe run` would repeat the steps that depend on them" in told
    assert told.endswith("complete for the inputs as planned\n")


def test_status_notices_a_changed_study_file(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = home / "small.toml"
    write_plan(make_plan(read_study(study), home / "run"), home / "run")
    study.write_text(study.read_text() + "# a remark\n")
    capsys.readouterr()
    assert main(["status", str(home / "run")]) == 0
    assert f"1 of 5 inputs changed or are missing since the run was planned: {study} changed." in (
        capsys.readouterr().out
    )


def test_status_tells_that_the_program_has_changed(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = read_plan(home / "run")
    write_plan(replace(plan, source="0" * 64), home / "run")
    assert main(["status", str(home / "run")]) == 0
    assert "made by another version of the source code" in capsys.readouterr().out
    write_plan(plan, home / "run")
    assert main(["status", str(home / "run")]) == 0
    assert "another version" not in capsys.readouterr().out


def test_step_that_fails_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    study = make_study(tmp_path, text=STUDY.replace('units = "g"\n', ""))
    assert run(study, tmp_path / "run") == 2
    said = capsys.readouterr().err
    assert "rockframe: error: " in said
    assert said.splitlines()[-1] in (tmp_path / "run" / "logs" / "ingest.log").read_text()
    assert not (tmp_path / "run" / "manifest.json").exists()


def test_upgrade_of_a_library_makes_everything_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise the manifest would state library versions that did not make the files."""
    study = read_study(make_study(tmp_path))
    before = make_plan(study, tmp_path / "run").keys
    assert make_plan(study, tmp_path / "run").keys == before
    monkeypatch.setattr("rockframe.runs.plan.package_versions", lambda: {"numpy": "99.0"})
    after = make_plan(study, tmp_path / "run").keys
    assert all(after[name] != before[name] for name in before)
