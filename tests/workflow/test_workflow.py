"""The workflow gives the bytes of `rockframe run`, and does no more than it must."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.runs.small import STUDY, contents, make_study, run
from tests.workflow.snake import MARKS, WORKFLOW, jobs_done, rockframe, snakemake

from rockframe.cli.main import main
from rockframe.runs import locked

pytestmark = MARKS


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study done by Snakemake in `flow`."""
    home = tmp_path_factory.mktemp("workflow")
    study = make_study(home)
    rockframe("plan", study, "--output", home / "flow")
    ended = snakemake(home / "flow")
    assert ended.returncode == 0, ended.stderr
    return home


def results(folder: Path) -> dict[str, bytes]:
    """What both ways give; Snakemake keeps files of its own beside it."""
    return {
        name: content
        for name, content in contents(folder).items()
        if not name.startswith(".snakemake") and not Path(name).name.startswith(".snakemake")
    }


def test_hashes_are_those_of_a_run(made: Path, tmp_path: Path) -> None:
    assert run(made / "small.toml", tmp_path / "run") == 0
    assert results(made / "flow") == results(tmp_path / "run")
    assert main(["verify", str(made / "flow")]) == 0


def test_run_takes_over_what_the_workflow_has_done(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["status", str(made / "flow"), "--json"]) == 0
    assert '"manifest",\n      "state": "done"' in capsys.readouterr().out


def test_unchanged_plan_has_no_jobs(made: Path) -> None:
    rockframe("plan", made / "small.toml", "--output", made / "flow")
    ended = snakemake(made / "flow")
    assert ended.returncode == 0
    assert "Nothing to be done" in ended.stderr + ended.stdout


def test_second_run_is_refused(made: Path) -> None:
    rockframe("plan", made / "small.toml", "--output", made / "flow")
    (made / "flow" / "table.csv").unlink()
    with locked(made / "flow"):
        ended = snakemake(made / "flow")
    assert ended.returncode != 0
    assert "another run is at work here" in ended.stderr
    assert snakemake(made / "flow").returncode == 0


def test_without_a_plan_it_says_what_to_do(tmp_path: Path) -> None:
    ended = snakemake(tmp_path)
    assert ended.returncode != 0
    assert "Must be made by `rockframe plan STUDY --output FOLDER`" in ended.stderr


def test_report_of_snakemake_builds(made: Path, tmp_path: Path) -> None:
    page = tmp_path / "jobs.html"
    ended = snakemake(made / "flow", "--report", str(page))
    assert ended.returncode == 0, ended.stderr
    assert "rockframe" in page.read_text(encoding="utf-8")


def test_snakefile_is_short_and_has_no_checkpoint() -> None:
    """A workflow with checkpoints takes half-written files for whole ones after a kill."""
    snakefile = (WORKFLOW / "Snakefile").read_text(encoding="utf-8")
    assert len(snakefile.splitlines()) <= 40
    rules = "".join(path.read_text(encoding="utf-8") for path in WORKFLOW.rglob("*.smk"))
    assert "checkpoint " not in (snakefile + rules).replace("no checkpoints", "")


def test_change_of_an_option_concerns_what_follows(made: Path) -> None:
    """The last test: the run is another one after it."""
    study = made / "small.toml"
    study.write_text(STUDY + "[pulse]\nperiods_s = [0.3, 4.0]\n")
    rockframe("plan", study, "--output", made / "flow")
    done = jobs_done(snakemake(made / "flow"))
    assert {"pulse", "merge_pulse", "table", "manifest", "report", "verify"} <= done
    assert not {"ingest", "respond", "merge_respond"} & done
