"""Internal files of a run that are corrupted, missing or manipulated must do no further harm."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from tests.runs.small import FEW, contents, make_study, run

from rockframe.cli.main import main
from rockframe.errors import InputError, ParameterError
from rockframe.provenance import sealed
from rockframe.runs.performing import Work, perform, perform_apart
from rockframe.runs.plan import Step
from rockframe.runs.state import is_locked, locked, read_plan


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and its finished run in `run`."""
    home = tmp_path_factory.mktemp("damage")
    assert run(make_study(home, 1, FEW), home / "run") == 0
    return home


@pytest.fixture
def home(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder, for a test to change."""
    return Path(shutil.copytree(finished, tmp_path / "home"))


def change(path: Path, meddle: Callable[[dict[str, Any]], object]) -> None:
    content = json.loads(path.read_text())
    meddle(content)
    path.write_bytes(sealed(content))


@pytest.mark.parametrize(
    "text",
    ["{", "[]", "[" * 100_000, '{"study": "small"}', None],
    ids=["cut", "list", "deep", "few keys", "missing"],
)
def test_damaged_plan_is_named_and_made_again(
    home: Path, text: str | None, capsys: pytest.CaptureFixture[str]
) -> None:
    """The stamps of the steps are enough to identify the run."""
    plan = home / "run" / ".rockframe" / "plan.json"
    before = read_plan(home / "run").keys
    plan.unlink() if text is None else plan.write_text(text)
    assert main(["status", str(home / "run")]) == 2
    assert run(home / "small.toml", home / "run") == 0
    said = capsys.readouterr()
    problem = "missing" if text is None else "is corrupted"
    assert f"{plan}: {problem}; made again." in said.err
    assert "nothing to do" in said.out
    assert read_plan(home / "run").keys == before


def flip(path: Path, part: bytes = b"") -> None:
    """Flip one bit in the middle of a file, or of a part of it."""
    content = bytearray(path.read_bytes())
    content[content.index(part) + len(part) // 2 if part else len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "part"),
    [
        ("manifest.json", b'"table.csv": "'),
        (".rockframe/plan.json", b"9.6"),
        (".rockframe/steps/ingest.json", b'"key": "'),
        ("structures.toml", b""),
        *(
            pytest.param(name, part, marks=pytest.mark.faults)
            for name, part in (
                *(("manifest.json", part) for part in (b"small", b"sha256_of_", b'"steps"')),
                *((".rockframe/plan.json", part) for part in (b"small", b"sha256_of_")),
                (".rockframe/steps/verify.json", b'"key": "'),
                *((name, b"") for name in ("inputs.csv", "pulses.nc", "report.html")),
            )
        ),
    ],
)
def test_verify_names_what_is_damaged_and_nothing_else(
    home: Path, name: str, part: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    """`status` must not call a run complete if `verify` finds a fault."""
    folder = home / "run"
    flip(folder / name, part)
    assert main(["verify", str(folder)]) != 0
    (said,) = capsys.readouterr().err.splitlines()
    assert f"{folder / name}: " in said
    assert main(["status", str(folder)]) in (0, 2)
    told = capsys.readouterr()
    assert f"{folder / name}: is corrupted" in told.out + told.err
    assert "\ncomplete" not in told.out
    assert run(home / "small.toml", folder) == 0
    assert f"{folder / name}: is corrupted; made again." in (capsys.readouterr().err)
    assert main(["verify", str(folder)]) == 0
    assert main(["status", str(folder)]) == 0
    assert "\ncomplete" in capsys.readouterr().out


def test_manifest_that_is_damaged_after_a_workflow_is_named(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A workflow leaves no stamps, so no other file states the hash of the manifest."""
    shutil.rmtree(home / "run" / ".rockframe" / "steps")
    flip(home / "run" / "manifest.json", b'"table.csv": "')
    assert main(["status", str(home / "run")]) == 0
    said = capsys.readouterr().out
    assert f"{home / 'run' / 'manifest.json'}: is corrupted." in said
    assert "table.csv:" not in said


def test_plan_that_is_missing_beside_its_stamps_is_a_fault(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = home / "run" / ".rockframe" / "plan.json"
    plan.unlink()
    assert main(["verify", str(home / "run")]) == 1
    assert f"{plan}: missing" in capsys.readouterr().err


def test_run_that_a_damaged_plan_keeps_out_says_so(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a manifest, nothing identifies the run, so only --replace continues in its folder."""
    (home / "run" / "manifest.json").unlink()
    flip(home / "run" / ".rockframe" / "plan.json", b"9.6")
    assert run(home / "small.toml", home / "run") == 2
    assert "plan.json: is corrupted. Use another folder, or --repl" in (capsys.readouterr().err)
    assert run(home / "small.toml", home / "run", "--replace") == 0
    assert main(["verify", str(home / "run")]) == 0


def test_damaged_plan_of_another_study_is_in_the_way(home: Path) -> None:
    """The other study has the same records, but that does not make it the same study."""
    (home / "run" / ".rockframe" / "plan.json").write_text("{")
    (home / "other.toml").write_text(FEW.replace('"small"', '"other"'))
    before = contents(home / "run")
    assert run(home / "other.toml", home / "run") == 2
    assert contents(home / "run") == before
    assert run(home / "other.toml", home / "run", "--replace") == 0


@pytest.mark.parametrize(
    "steps",
    [
        *([1, 2], {"a": 1}, [{"name": "ingest"}]),
        [{"name": "x", "stage": "x", "inputs": [], "outputs": [5]}],
    ],
)
def test_plan_of_other_types_is_one_line(
    home: Path, steps: object, capsys: pytest.CaptureFixture[str]
) -> None:
    change(
        home / "run" / ".rockframe" / "plan.json",
        lambda plan: plan.update(steps=steps, keys={"x": ""}),
    )
    assert main(["status", str(home / "run")]) == 2
    assert "plan.json: cannot be read" in capsys.readouterr().err


@pytest.mark.parametrize(
    "meddle",
    [
        lambda plan: plan["files"].update({"../precious.json": "x"}),
        lambda plan: (
            plan["steps"].append({**plan["steps"][-1], "name": "../../../precious", "outputs": []})
            or plan["origins"].update({"../../../precious": {}})
        ),
    ],
)
def test_plan_that_names_files_elsewhere_removes_none(
    home: Path, meddle: Callable[[dict[str, Any]], object]
) -> None:
    """A run removes the outputs of its former plan, which may come from somebody else."""
    precious = home / "precious.json"
    precious.write_text("mine")
    plan = home / "run" / ".rockframe" / "plan.json"
    change(plan, meddle)
    assert run(home / "small.toml", home / "run") == 0
    assert precious.exists()


@pytest.mark.parametrize("outputs", [["x"], {}, 3])
def test_stamp_of_other_types_is_none(home: Path, outputs: object) -> None:
    for name in ("respond", "verify"):
        path = home / "run" / ".rockframe" / "steps" / f"{name}.json"
        change(path, lambda stamp: stamp.update(outputs=outputs))
    (home / "run" / "response.nc").unlink()
    assert run(home / "small.toml", home / "run") == 0
    assert main(["verify", str(home / "run")]) == 0


def test_folder_in_the_place_of_an_output_is_one_line(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (home / "run" / "table.csv").unlink()
    (home / "run" / "table.csv").mkdir()
    assert run(home / "small.toml", home / "run") == 2
    assert "table.csv: is a folder, in the place of a file to write." in capsys.readouterr().err


@pytest.mark.parametrize("name", ["figures/motion-0.png", "logs/verify.log", "manifest.json"])
def test_folder_in_the_place_of_what_a_run_made_is_one_line(
    finished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The folder is the user's, and is not removed; once it is moved, the run resumes."""
    study = make_study(tmp_path, 1, FEW.replace("most = 0", "most = 1"))
    folder = Path(shutil.copytree(finished / "run", tmp_path / "run"))
    assert run(study, folder) == 0
    (folder / name).unlink()
    (folder / name).mkdir()
    (folder / ".rockframe" / "steps" / "verify.json").unlink()
    capsys.readouterr()
    assert run(study, folder) == 2
    said = capsys.readouterr().err
    wanted = f"rockframe: error: {folder / name}: is a folder, in the place of a file to write."
    assert said.splitlines()[-1].startswith(wanted)
    assert "Traceback" not in said
    (folder / name).rename(tmp_path / "moved")
    assert run(study, folder) == 0


def test_status_does_not_write(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A colleague without permission to write may ask for the status of a run."""
    assert not is_locked(home / "run")
    real = os.open

    def of_another(path: Path, flags: int, *mode: int) -> int:  # denies root too
        if flags & os.O_RDWR:
            raise PermissionError(errno.EACCES, "Permission denied")
        return real(path, flags, *mode)

    with locked(home / "run"):
        monkeypatch.setattr(os, "open", of_another)
        assert is_locked(home / "run")


def test_step_whose_options_are_of_another_version_says_why(home: Path) -> None:
    step = Step("pulse", "pulse", ("records.nc",), ("pulses.nc",), {"bogus": 1})
    with pytest.raises(ParameterError, match="unknown option 'bogus'"):
        perform(Work(step, home / "run"))
    log = (home / "run" / "logs" / "pulse.log").read_text()
    assert log == "rockframe: error: unknown option 'bogus'.\n"


def test_what_a_killed_worker_leaves_does_not_stop_the_run(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another worker repeats the step; `report` and `verify` must not fail on the partial file."""

    def repeated(work: Work) -> int:
        if work.step.name == "ingest":
            (work.folder / ".records-a1b2c3d4.partial.nc").touch()
        return perform(work)

    monkeypatch.setattr("rockframe.runs.performing.perform", repeated)
    (home / "run" / "records.nc").unlink()
    assert run(home / "small.toml", home / "run") == 0
    assert not list((home / "run").glob(".*partial*"))


def test_crash_of_a_step_apart_is_not_taken_for_rejected_records(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise an older output would be stamped as new."""
    (home / "sitecustomize.py").write_text(
        "import rockframe.stages.table as s\n\n"
        "def crash(*a, **k):\n    raise MemoryError('all gone')\n\n"
        "s.index_stage = crash\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(home))
    step = Step("index", "index", ("response.nc",), ("table.csv",))
    with pytest.raises(RuntimeError, match=r"(?s)MemoryError: all gone"):
        perform_apart(Work(step, home / "run"))


def test_a_run_on_nfs_is_seen(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """NFS locks only files that are open for writing, so a read-only check would miss the run."""
    fcntl = pytest.importorskip("fcntl")
    flock = fcntl.flock

    def on_nfs(descriptor: int, how: int) -> None:
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "Bad file descriptor")
        flock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", on_nfs)
    with locked(home / "run"):
        assert is_locked(home / "run")
    assert not is_locked(home / "run")


@pytest.mark.parametrize(("readers", "runs"), [(0, True), (4, True), (5, False)])
def test_a_run_starts_although_its_status_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, readers: int, runs: bool
) -> None:
    """Each reader holds the lock for a moment; another run holds it longer than five attempts."""
    free = iter([False] * readers + [True])
    pauses: list[float] = []
    monkeypatch.setattr("rockframe.runs.state.lock_descriptor", lambda *_, **__: next(free))
    monkeypatch.setattr("rockframe.runs.state.time.sleep", pauses.append)
    with nullcontext() if runs else pytest.raises(InputError, match="in use"), locked(tmp_path):
        assert runs
    assert len(pauses) == readers


def test_file_system_without_locks_is_no_other_run(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fcntl = pytest.importorskip("fcntl")

    def unknown(*_arguments: object) -> None:
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(fcntl, "flock", unknown)
    with locked(home / "run"):
        assert not is_locked(home / "run")
