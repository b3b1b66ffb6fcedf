"""The workflow gives the same bytes as `rockframe run` and runs only the necessary jobs."""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import signal
import time
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from tests.conftest import REPOSITORY
from tests.faults.harness import all_gone, children, wait_until
from tests.runs.small import FEW, FURTHER, contents, make_study, run
from tests.workflow.snake import (
    MARKS,
    WORKFLOW,
    jobs_done,
    recorder,
    rockframe,
    snakemake,
    started,
)

from rockframe.cli.main import main
from rockframe.runs.state import is_locked, locked

pytestmark = MARKS
KILLS = 5


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and, in `flow`, its run by Snakemake."""
    home = tmp_path_factory.mktemp("workflow")
    study = make_study(home, text=FURTHER)
    rockframe("run", study, "--output", home / "flow", "--plan")
    ended = snakemake(home / "flow")
    assert ended.returncode == 0, ended.stderr
    return home


def results(folder: Path) -> dict[str, bytes]:
    """Return the output files of a run without those that Snakemake adds."""
    return {
        name: content
        for name, content in contents(folder).items()
        if not name.startswith(".snakemake") and not Path(name).name.startswith(".snakemake")
    }


def test_hashes_are_those_of_a_run(made: Path, tmp_path: Path) -> None:
    assert run(made / "small.toml", tmp_path / "run") == 0
    assert results(made / "flow") == results(tmp_path / "run")
    assert main(["verify", str(made / "flow")]) == 0


def test_many_record_files_are_read_by_several_jobs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The copy of the first file is in the last batch, which the index reads again."""
    monkeypatch.setattr("rockframe.runs.plan._FILES_OF_A_STEP", 2)
    study = make_study(tmp_path, 5, FEW.replace("records = 9", "records = 2"))
    (tmp_path / "motions" / "later").mkdir()
    shutil.copy(tmp_path / "motions" / "motion-0.csv", tmp_path / "motions" / "later")
    assert run(study, tmp_path / "flow", "--plan") == 0
    ended = snakemake(tmp_path / "flow")
    assert ended.returncode == 0, ended.stderr
    assert run(study, tmp_path / "run") == 1  # the copy is rejected
    assert results(tmp_path / "flow") == results(tmp_path / "run")
    assert "shards/again/records-003.nc" in results(tmp_path / "run")
    assert "Nothing to be done" in snakemake(tmp_path / "flow").stderr


def test_run_takes_over_what_the_workflow_has_done(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["status", str(made / "flow"), "--json"]) == 0
    assert '"manifest",\n      "state": "done"' in capsys.readouterr().out


def test_unchanged_plan_has_no_jobs(made: Path) -> None:
    rockframe("run", made / "small.toml", "--output", made / "flow", "--plan")
    ended = snakemake(made / "flow")
    assert ended.returncode == 0
    assert "Nothing to be done" in ended.stderr + ended.stdout


def test_second_run_is_refused(made: Path) -> None:
    rockframe("run", made / "small.toml", "--output", made / "flow", "--plan")
    (made / "flow" / "table.csv").unlink()
    with locked(made / "flow"):
        ended = snakemake(made / "flow")
    assert ended.returncode != 0
    assert "in use by another run" in ended.stderr
    assert snakemake(made / "flow").returncode == 0


def test_lock_is_held_until_the_workflow_ends(made: Path) -> None:
    """Snakemake's own lock is switched off, so the lock of the run must refuse a second run."""
    folder = made / "held"
    rockframe("run", made / "small.toml", "--output", folder, "--plan")
    process = started(folder)
    assert wait_until(lambda: logs(folder) > 0, process)
    assert is_locked(folder)
    assert main(["run", str(made / "small.toml"), "--output", str(folder)]) == 2
    process.communicate()
    assert process.returncode == 0
    assert not is_locked(folder)


@pytest.fixture(scope="module")
def rejecting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study in one batch that rejects a file and, in `run`, its run."""
    home = tmp_path_factory.mktemp("rejecting")
    study = make_study(home, 4, FEW)
    (home / "motions" / "notes.txt").write_text("Nothing of the kind.\n")
    assert run(study, home / "run") == 1
    return home


def test_rejected_records_and_workers_are_those_of_a_run(rejecting: Path, tmp_path: Path) -> None:
    """A rejected record ends a step with status 1, which is no failure; large steps get a pool."""
    rockframe("run", rejecting / "small.toml", "--output", tmp_path / "flow", "--plan")
    ended = snakemake(tmp_path / "flow", "--cores", "2", programs=recorder(tmp_path))
    assert ended.returncode == 0, ended.stderr
    assert results(tmp_path / "flow") == results(rejecting / "run")
    executed = sorted((tmp_path / "words").read_text().splitlines())
    steps = json.loads((tmp_path / "flow" / ".rockframe" / "plan.json").read_text())["steps"]
    threads = {step["name"]: min(2, step["threads"]) for step in steps}
    assert executed == sorted(f"step . {name} --workers {n}" for name, n in threads.items())
    assert {name for name, number in threads.items() if number == 2} >= {"ingest", "respond"}


def test_verify_fails_where_a_file_is_corrupted(made: Path, tmp_path: Path) -> None:
    """Status 1 of `verify` reports a fault, so it is no success."""
    folder = tmp_path / "flow"
    shutil.copytree(made / "flow", folder)
    rockframe("run", made / "small.toml", "--output", folder, "--plan")
    table = folder / "table.csv"
    kept, content = table.stat(), table.read_bytes()
    table.write_bytes(content.swapcase())
    os.utime(table, ns=(kept.st_atime_ns, kept.st_mtime_ns))  # Snakemake compares times
    (folder / ".rockframe" / "ended" / "verify").unlink()
    ended = snakemake(folder)
    assert ended.returncode != 0
    assert "table.csv" in ended.stderr


def test_interrupted_it_resumes(rejecting: Path, tmp_path: Path) -> None:
    """Ctrl-C goes to the whole process group; status 130 of a step is a failure, not a success."""
    folder = tmp_path / "flow"
    rockframe("run", rejecting / "small.toml", "--output", folder, "--plan")
    process = started(folder, "--cores", "2")
    assert wait_until(lambda: logs(folder) > 1, process)
    below = list(children(process.pid))
    os.killpg(process.pid, signal.SIGINT)
    process.communicate()
    assert process.returncode != 0
    assert all_gone(below)
    assert not (folder / "manifest.json").exists()
    ended = snakemake(folder, "--cores", "2")
    assert ended.returncode == 0, ended.stderr
    assert results(folder) == results(rejecting / "run")


def logs(folder: Path) -> int:
    """Return the number of jobs that have started."""
    return len(list(folder.glob("logs/*.log")))


def test_killed_at_random_moments_it_goes_on(made: Path) -> None:
    """kill -9 of the whole process group leaves no lock, so the same command resumes."""
    chance = random.Random(2026)  # noqa: S311 - moments, no secrets
    folder, kills = made / "killed", 0
    while kills < KILLS:
        rockframe("run", made / "small.toml", "--output", folder, "--plan")
        begun, process = logs(folder) + chance.choice((0, 1, 3)), started(folder)
        if wait_until(lambda begun=begun: logs(folder) >= begun, process):  # type: ignore[misc]
            time.sleep(chance.uniform(0.0, 5.0))
        below = list(children(process.pid))
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            kills += 1
        else:
            assert process.returncode == 0
            shutil.rmtree(folder)
        process.communicate()
        assert all_gone(below)
    rockframe("run", made / "small.toml", "--output", folder, "--plan")
    ended = snakemake(folder)
    assert ended.returncode == 0, ended.stderr
    assert results(folder) == results(made / "flow")


def test_without_a_plan_it_says_what_to_do(tmp_path: Path) -> None:
    ended = snakemake(tmp_path)
    assert ended.returncode != 0
    assert "write it with `rockframe run STUDY --output FOLDER --plan`" in ended.stderr


def test_report_of_snakemake_builds(made: Path, tmp_path: Path) -> None:
    page = tmp_path / "jobs.html"
    ended = snakemake(made / "flow", "--report", str(page))
    assert ended.returncode == 0, ended.stderr
    assert "rockframe" in page.read_text(encoding="utf-8")


def test_snakefile_is_short_and_has_no_checkpoint() -> None:
    """After a kill, a workflow with checkpoints treats partial files as complete."""
    snakefile = (WORKFLOW / "Snakefile").read_text(encoding="utf-8")
    assert len(snakefile.splitlines()) <= 40
    rules = "".join(path.read_text(encoding="utf-8") for path in WORKFLOW.rglob("*.smk"))
    assert "checkpoint " not in (snakefile + rules).replace("no checkpoints", "")


def test_lock_holds_what_the_extra_asks_for() -> None:
    lock = (WORKFLOW / "requirements.lock").read_text(encoding="utf-8")
    locked = dict(re.findall(r"^([\w.-]+)==([\w.]+)", lock, re.MULTILINE))
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for asked in map(Requirement, project["optional-dependencies"]["workflow"]):
        assert asked.specifier.contains(locked[asked.name])


def test_change_of_an_option_concerns_what_follows(made: Path) -> None:
    """This must be the last test of the file, because it changes the run."""
    study = made / "small.toml"
    study.write_text(FURTHER + "[pulse]\nperiods_s = [0.3, 4.0]\n")
    rockframe("run", study, "--output", made / "flow", "--plan")
    done = jobs_done(snakemake(made / "flow"))
    assert {"pulse", "index_pulse", "table", "manifest", "report", "verify"} <= done
    assert {"screen", "index_screen"} <= done
    assert not {"ingest", "respond", "index_respond", "compare", "index_compare"} & done
