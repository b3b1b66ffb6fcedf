"""Runs of many record files read them in several steps, whose index is `records.nc`."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path

import pytest
from tests.runs.small import FEW, contents, make_study, run

from rockframe.cli.main import main
from rockframe.engines.engine import ProcessPool
from rockframe.results.records import read_records
from rockframe.runs.performing import _parallel_work, unreported
from rockframe.runs.plan import _FILES_OF_A_STEP as FILES_OF_A_STEP
from rockframe.runs.plan import make_plan, steps_of
from rockframe.study.study import read_study

#: Batches of two of six files; the copy of the first file is in the last batch.
TWO = FEW.replace("records = 9", "records = 2").replace(
    'margins = "none"', 'margins = "none"\nhistories = "none"'
)


@pytest.fixture(autouse=True)
def _small_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rockframe.runs.plan._FILES_OF_A_STEP", 2)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study with a run in three steps of ingest, and one in a single step."""
    home = tmp_path_factory.mktemp("steps")
    study = make_study(home, 5, TWO)
    (home / "motions" / "later").mkdir()
    shutil.copy(home / "motions" / "motion-0.csv", home / "motions" / "later")
    assert run(study, home / "one") == 1  # the copy is rejected
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("rockframe.runs.plan._FILES_OF_A_STEP", 2)
        assert run(study, home / "run") == 1
    return home


def steps_done(home: Path, capsys: pytest.CaptureFixture[str]) -> set[str]:
    capsys.readouterr()
    run(home / "small.toml", home / "run", "--json")
    return set(json.loads(capsys.readouterr().out)["steps_done"])


def test_the_steps_of_ingest_do_not_change_the_results(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    several, one = contents(finished / "run"), contents(finished / "one")
    shards = {f"shards/records-00{k}.nc" for k in (1, 2, 3)}
    assert several.keys() - one.keys() == {*shards, "shards/again/records-003.nc"}
    for name in ("records.csv", "table.csv", "summary.csv", "inputs.csv"):
        assert several[name] == one[name]
    assert b"This file is a copy of it." in several["records.csv"]
    assert main(["verify", str(finished / "run")]) == 0
    assert "records.nc: 5 records" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("lost", "steps"),
    [
        ("shards/records-002.nc", {"ingest-002"}),
        ("shards/again/records-003.nc", {"index-ingest"}),
        ("records.csv", {"index-ingest"}),
    ],
)
def test_only_what_is_lost_is_read_again(
    finished: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    lost: str,
    steps: set[str],
) -> None:
    home = Path(shutil.copytree(finished, tmp_path / "home"))
    (home / "run" / lost).unlink()
    assert main(["verify", str(home / "run")]) == 1
    assert f"{lost}: missing" in capsys.readouterr().err
    before = contents(finished / "run")
    of_ingest = {name for name in steps_done(home, capsys) if "ingest" in name}
    assert of_ingest == steps
    after = contents(home / "run")
    same = {name for name in before if not name.endswith(("manifest.json", "report.html"))}
    assert {name for name in same if after[name] != before[name]} == set()


def test_steps_of_ingest_are_long_enough_for_processes(finished: Path) -> None:
    """Two steps would be performed one after the other, while it is found out if they are long."""
    plan = make_plan(read_study(finished / "small.toml"), finished / "run")
    groups = _parallel_work(plan, plan.steps, finished / "run", ProcessPool(2), unreported)
    works, _, engine = next(groups)
    assert [work.step.name for work in works] == ["ingest-001", "ingest-002", "ingest-003"]
    assert engine == ProcessPool(2, patience=0.0)
    assert [where for works, _, where in groups if len(works) > 1] == [ProcessPool(2)] * 2


def test_a_changed_file_is_read_again(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    home = Path(shutil.copytree(finished, tmp_path / "home"))
    motion = home / "motions" / "motion-3.csv"
    motion.write_text(motion.read_text().replace("0.0000", "0.0001", 1))
    done = steps_done(home, capsys)
    every = {f"ingest-{k:03d}" for k in (1, 2, 3)}  # the list of all files has changed
    assert {name for name in done if "ingest" in name} == {*every, "index-ingest"}
    assert "pulse-001" in done
    assert len(read_records(home / "run" / "records.nc")) == 5


def test_few_files_an_archive_and_rotations_are_read_in_one_step(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step takes a second to start and lists all files, so that they are few and large."""
    (tmp_path / "small.toml").write_text(TWO.replace("records = 2", "records = 50"))
    (tmp_path / "motions").mkdir()
    study = read_study(tmp_path / "small.toml")

    def steps(files: int, opened: int) -> int:
        planned = steps_of(study, files, None, opened)
        return sum(step.stage == "ingest" for step in planned)

    monkeypatch.setattr("rockframe.runs.plan._FILES_OF_A_STEP", FILES_OF_A_STEP)
    assert [steps(n, n) for n in (1, 1999, 2000, 9000, 10**6)] == [1, 1, 2, 9, 32]
    assert steps(10**4, 1) == 1
    monkeypatch.setattr("rockframe.runs.plan._FILES_OF_A_STEP", 2)
    with zipfile.ZipFile(tmp_path / "motions" / "all.zip", "w") as archive:
        for path in sorted((finished / "motions").glob("*.csv")):
            archive.write(path, path.name)
    rotated = finished / "rotated.toml"
    rotated.write_text(TWO.replace('units = "g"', 'units = "g"\nazimuth_degree = 0.0'))
    (tmp_path / "small.toml").write_text(TWO)
    for folder in ("a", "b"):  # the hash of one of two files of a name would stand for both
        shutil.copytree(finished / "motions", tmp_path / folder)
    listed = [f"{folder}/motion-{k}.csv" for folder in ("a", "b") for k in range(5)]
    named = tmp_path / "named.toml"
    named.write_text(TWO.replace('paths = ["motions"]', f"paths = {listed}"))
    for path in (tmp_path / "small.toml", rotated, named):
        plan = make_plan(read_study(path), tmp_path / "run")
        assert [step.name for step in plan.steps[:2]] == ["ingest", "pulse-001"]
