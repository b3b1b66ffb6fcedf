"""`run` and `status` say why each step runs again."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.runs.small import FEW, make_study, run

from rockframe import provenance
from rockframe.cli.main import main
from rockframe.runs.plan import make_plan
from rockframe.runs.state import write_plan
from rockframe.study.study import read_study

#: Two batches of records.
STUDY = FEW.replace("records = 9", "records = 1")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `run`."""
    home = tmp_path_factory.mktemp("reasons")
    assert run(make_study(home, 2, STUDY), home / "run") == 0
    return home


@pytest.fixture
def home(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder, for a test to change; the plan is of the copied study."""
    home = Path(shutil.copytree(finished, tmp_path / "home"))
    write_plan(make_plan(read_study(home / "small.toml"), home / "run"), home / "run")
    return home


def _edit(home: Path, before: str, after: str) -> None:
    study = home / "small.toml"
    assert before in study.read_text()
    study.write_text(study.read_text().replace(before, after))


def _change_record(home: Path) -> None:
    motion = home / "motions" / "motion-1.csv"
    motion.write_text(motion.read_text().replace("0.3", "0.2"))


def _add_record(home: Path) -> None:
    shutil.copyfile(home / "motions" / "motion-1.csv", home / "motions" / "motion-7.csv")


def _corrupt(home: Path) -> None:
    (home / "run" / "response.nc").write_bytes(b"half")


#: Reasons of a step with none of its own, by the step.
LAST = {
    "report": "follows from manifest",
    "verify": "follows from manifest and 1 more",
}
CHANGES: list[tuple[Callable[[Path], object], dict[str, str]]] = [
    (
        _change_record,
        {
            "ingest": "input motions/motion-1.csv changed",
            "pulse-002": "follows from ingest",
            "index-pulse": "follows from pulse-001 and 1 more",
            "table": "follows from ingest and 2 more",
            "manifest": "follows from ingest and 7 more",
            **LAST,
        },
    ),
    (
        lambda home: _edit(home, "surrogates = 0", "surrogates = 20"),
        {
            "pulse-001": "option surrogates changed from 0 to 20",
            "index-pulse": "follows from pulse-001 and 1 more",
            "table": "follows from index-pulse",
            "manifest": "study changed; follows from pulse-001 and 3 more",
        },
    ),
    (
        lambda home: _edit(home, "time_step_s = 0.01", "time_step_s = 0.02"),
        {"ingest": "option records.time_step_s changed from 0.01 to 0.02"},
    ),
    (
        lambda home: _edit(home, "mass_ratio = 4.0", "mass_ratio = 5.0"),
        {
            "respond-002": "structures.toml changed",
            "index-respond": "follows from respond-001 and 1 more",
            "table": "follows from index-respond",
        },
    ),
    (
        lambda home: (home / "run" / "table.csv").unlink(),
        {
            "table": "table.csv is missing",
            "manifest": "follows from table",
            "verify": "follows from table",
        },
    ),
    (
        _corrupt,
        {
            "index-respond": "response.nc is corrupted",
            "manifest": "follows from index-respond",
            "verify": "follows from index-respond",
        },
    ),
    (
        lambda home: shutil.rmtree(home / "run" / ".rockframe" / "steps"),
        {"report": "no stamp for report.html", "verify": "not run yet"},
    ),
]


def _told(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, str]:
    """Return the reasons that a command prints as JSON, by step."""
    capsys.readouterr()
    assert main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    if "reasons" in told:
        return dict(told["reasons"])
    return {step["name"]: step["reason"] for step in told["steps"] if step["reason"]}


@pytest.mark.parametrize(("change", "expected"), CHANGES)
def test_status_and_run_say_what_changed(
    home: Path,
    change: Callable[[Path], object],
    expected: dict[str, str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    """`status` says it before the run, from the study and the files as they are now."""
    folder = str(home / "run")
    assert _told(capsys, "status", folder) == {}
    change(home)
    before = _told(capsys, "status", folder)
    assert expected.items() <= before.items()
    words = ("run", str(home / "small.toml"), "--output", folder)
    assert _told(capsys, *words, "--plan") == before
    assert _told(capsys, "status", folder).keys() == before.keys()  # while the plan waits


def test_a_record_is_added_or_removed(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With one record there is one batch, whose step is another one than those of two."""
    status = ("status", str(home / "run"))
    _add_record(home)
    assert _told(capsys, *status)["ingest"] == "input motions/motion-7.csv added"
    for number in (1, 7):
        (home / "motions" / f"motion-{number}.csv").unlink()
    assert _told(capsys, *status)["ingest"] == "input motions/motion-1.csv removed"
    words = ("run", str(home / "small.toml"), "--output", str(home / "run"), "--plan")
    planned = _told(capsys, *words)
    assert planned["ingest"] == "input motions/motion-1.csv removed"
    assert planned["respond"] == "no stamp for response.nc"


def test_steps_without_a_reason_are_those_that_are_kept(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _edit(home, "surrogates = 0", "surrogates = 20")
    reasons = _told(capsys, "status", str(home / "run"))
    assert "ingest" not in reasons
    capsys.readouterr()
    assert run(home / "small.toml", home / "run", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["reasons"] == reasons
    assert told["steps_done"] == list(reasons)


def test_run_prints_the_reasons_by_stage(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A first run has nothing to explain."""
    _edit(home, "surrogates = 0", "surrogates = 20")
    capsys.readouterr()
    assert run(home / "small.toml", home / "run") == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "repeating" in line]
    assert said == [
        "rockframe: repeating pulse (2 steps): option surrogates changed from 0 to 20",
        "rockframe: repeating index: follows from pulse-001 and 1 more",
        "rockframe: repeating table: follows from index-pulse",
        "rockframe: repeating manifest: study changed; follows from pulse-001 and 3 more",
        "rockframe: repeating report: follows from manifest",
        "rockframe: repeating verify: follows from manifest and 1 more",
    ]
    assert run(home / "small.toml", home / "first") == 0
    assert "repeating" not in capsys.readouterr().err


def test_status_prints_the_reasons(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (home / "run" / "table.csv").unlink()
    capsys.readouterr()
    assert main(["status", str(home / "run")]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["table", "1", "damaged", "table.csv", "is", "missing"] in lines
    assert ["ingest", "1", "done"] in lines


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("source_code_hash", "0" * 64, "code changed"),
        (
            "package_versions",
            {**provenance.package_versions(), "numpy": "9.9"},
            "numpy changed from ",
        ),
    ],
)
def test_code_and_packages_outdate_every_step(
    home: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    value: object,
    reason: str,
) -> None:
    monkeypatch.setattr(f"rockframe.runs.plan.{name}", lambda: value)
    reasons = _told(capsys, "status", str(home / "run"))
    assert len(reasons) == 11
    assert all(told.startswith(reason) for told in reasons.values())


def test_a_style_sheet_outdates_the_page_alone(
    home: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rockframe.runs.plan.page_source_hash", lambda: "0" * 64)
    assert _told(capsys, "status", str(home / "run")) == {
        "report": "templates, style or scripts of the page changed",
        "verify": "follows from report",
    }
    capsys.readouterr()
    assert run(home / "small.toml", home / "run", "--json") == 0
    assert json.loads(capsys.readouterr().out)["steps_done"] == ["report", "verify"]


@pytest.mark.parametrize(
    ("name", "outdates"),
    [
        *((name, "page") for name in ("style.css", "main.js", "page.html")),
        *((name, "results") for name in ("page.py", "claims.toml", "paper.mplstyle")),
    ],
)
def test_files_of_pages_are_no_code_of_computations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, outdates: str
) -> None:
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "provenance.py"))
    hashes = {"results": provenance.source_code_hash, "page": provenance.page_source_hash}
    before = {name_of_hash: of.__wrapped__() for name_of_hash, of in hashes.items()}
    (tmp_path / name).write_text("changed")
    assert [
        name_of_hash
        for name_of_hash, of in hashes.items()
        if of.__wrapped__() != before[name_of_hash]
    ] == [outdates]
