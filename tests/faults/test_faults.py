"""Faults during a run: kills, full disks, corrupted files. A resumed run gives the same results.

`make test-faults`. No kill is set by the clock: it waits for a step of the run to end, and then for
a random time, so that it can happen anywhere.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
from tests.faults.harness import (
    all_gone,
    can_mount,
    children,
    finished,
    kill,
    small_disk,
    stamps,
    start,
    wait_for_stamps,
    wait_until,
)
from tests.runs.small import STUDY, contents, make_study

from rockframe.cli.main import main

pytestmark = [
    pytest.mark.faults,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see processes"),
]
KILLS = 30
#: Interruptions of runs in one process, and as many of runs in a pool.
INTERRUPTIONS = 100


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study and, in `whole`, a run of it without faults."""
    home = tmp_path_factory.mktemp("faults")
    study = make_study(home, 6)
    status, said = finished(start(study, home / "whole"))
    assert status == 0
    assert "compiling the kernels" in said or not said  # the first run in a clean clone says so
    return home


def require_whole(folder: Path, home: Path) -> None:
    """Assert that a run has the same bytes as one without faults, and no partial files."""
    assert contents(folder) == contents(home / "whole")
    assert not list(folder.rglob("*partial*"))
    assert main(["verify", str(folder)]) == 0


def resumed(study: Path, folder: Path) -> None:
    status, said = finished(start(study, folder))
    assert status == 0, said


def test_killed_thirty_times_at_random_moments(home: Path, tmp_path: Path) -> None:
    """kill -9 stops the whole process group; the same command resumes and is killed again."""
    chance = random.Random(2026)  # noqa: S311 - moments, no secrets
    study, kills, runs = home / "small.toml", 0, 0
    folder = tmp_path / "run-0"
    while kills < KILLS:
        process = start(study, folder, pool=kills % 3 == 2)
        below: list[int] = []
        if wait_for_stamps(folder, stamps(folder) + chance.choice((0, 0, 1, 2, 4)), process):
            time.sleep(chance.uniform(0.0, 1.0))
        if process.poll() is None:
            below = kill(process, group=True)
            kills += 1
        else:
            assert finished(process)[0] == 0
            require_whole(folder, home)
            shutil.rmtree(folder)
            runs += 1
            folder = tmp_path / f"run-{runs}"
        assert all_gone(below)
    resumed(study, folder)
    require_whole(folder, home)


@pytest.mark.parametrize("module", ["engines.worker", "engines.worker 60.0"])
def test_killed_worker_costs_no_result(home: Path, tmp_path: Path, module: str) -> None:
    """The killed worker is one that computes, or one that reads files under limits."""
    process = start(home / "small.toml", tmp_path / "run", pool=True)
    victims: list[int] = []

    def is_there() -> bool:
        victims[:] = [pid for pid, words in children(process.pid).items() if module in words]
        return bool(victims)

    assert wait_until(is_there, process)
    os.kill(victims[0], signal.SIGKILL)
    assert finished(process) == (0, "")
    require_whole(tmp_path / "run", home)


def test_killed_run_leaves_no_worker(home: Path, tmp_path: Path) -> None:
    """Only the main process is killed; its workers notice and end."""
    process = start(home / "small.toml", tmp_path / "run", pool=True)
    assert wait_until(lambda: "engines.worker" in str(children(process.pid)), process)
    below = kill(process, group=False)
    assert below
    assert all_gone(below)
    resumed(home / "small.toml", tmp_path / "run")
    require_whole(tmp_path / "run", home)


@pytest.mark.parametrize("pool", [False, True])
def test_interrupt_is_one_line(home: Path, tmp_path: Path, pool: bool) -> None:
    """As with Ctrl-C in a terminal, SIGINT goes to the whole process group."""
    process = start(home / "small.toml", tmp_path / "run", pool=pool)
    assert wait_for_stamps(tmp_path / "run", 1, process)
    below = list(children(process.pid))
    os.killpg(process.pid, signal.SIGINT)
    status, said = finished(process)
    assert status == 130
    assert said.splitlines() == [
        "rockframe: interrupted; finished steps are kept; the same command resumes."
    ]
    assert all_gone(below)
    assert not list((tmp_path / "run").rglob("*partial*"))
    assert not (tmp_path / "run" / "manifest.json").exists()
    resumed(home / "small.toml", tmp_path / "run")
    require_whole(tmp_path / "run", home)


@pytest.mark.parametrize("pool", [False, True], ids=["one process", "pool"])
def test_interrupted_a_hundred_times_at_random_moments(
    home: Path, tmp_path: Path, pool: bool
) -> None:
    """Each interruption ends the run with status 130 and one line, after the reasons why steps run
    again; resumed, the bytes are equal.
    """
    chance = random.Random(2027)  # noqa: S311 - moments, no secrets
    study, interrupted, runs = home / "small.toml", 0, 0
    folder = tmp_path / "run-0"
    while interrupted < INTERRUPTIONS:
        lock = folder / ".rockframe" / "lock"
        lock.unlink(missing_ok=True)  # of the run before
        process = start(study, folder, pool=pool)
        wait_until(lock.exists, process)  # before it, Python itself starts and may be interrupted
        if wait_for_stamps(folder, stamps(folder) + chance.choice((0, 0, 1, 2, 4)), process):
            time.sleep(chance.uniform(0.0, 1.0))
        if process.poll() is None:
            below = list(children(process.pid))
            os.killpg(process.pid, signal.SIGINT)
            status, said = finished(process)
            interrupted += 1
            if status == 0:  # Python was ending already
                continue
            *reasons, last = said.splitlines()
            assert (status, last.startswith("rockframe: interrupted; ")) == (130, True), said
            assert all(line.startswith("rockframe: repeating ") for line in reasons)
            assert all_gone(below)
            assert not list(folder.rglob("*partial*"))
        else:
            status, said = finished(process)
            assert status == 0, said
            assert all(line.startswith("rockframe: repeating ") for line in said.splitlines())
            require_whole(folder, home)
            shutil.rmtree(folder)
            runs += 1
            folder = tmp_path / f"run-{runs}"
    resumed(study, folder)
    require_whole(folder, home)


def test_second_run_is_refused_while_the_first_lives(home: Path, tmp_path: Path) -> None:
    first = start(home / "small.toml", tmp_path / "run")
    assert wait_for_stamps(tmp_path / "run", 1, first)
    first.send_signal(signal.SIGSTOP)
    status, said = finished(start(home / "small.toml", tmp_path / "run"))
    first.send_signal(signal.SIGCONT)
    assert status == 2
    assert said.count("\n") == 1
    assert "in use by another run. Wait until it ends." in said
    assert finished(first) == (0, "")
    require_whole(tmp_path / "run", home)


@pytest.fixture
def disk(tmp_path: Path) -> Path:
    """A path where a disk can be mounted."""
    if not can_mount(tmp_path / "probe"):
        pytest.skip("may not mount a disk: needs root")
    return tmp_path / "disk"


@pytest.mark.parametrize("size", ["64k", "200k", "440k"])
def test_full_disk_is_one_line(home: Path, disk: Path, size: str) -> None:
    """The plan, a stage or a late stage finds no space; with more space, the run resumes."""
    with small_disk(disk, size) as remount:
        status, said = finished(start(home / "small.toml", disk / "run"))
        assert status == 2
        assert said.count("\n") == 1
        assert said.startswith("rockframe: error: ")
        assert "No space left" in said
        assert not (disk / "run" / "manifest.json").exists()
        remount("size=64m")
        resumed(home / "small.toml", disk / "run")
        require_whole(disk / "run", home)


def test_folder_that_cannot_be_written_is_one_line(home: Path, disk: Path) -> None:
    with small_disk(disk, "64m") as remount:
        remount("ro")
        status, said = finished(start(home / "small.toml", disk / "run"))
        assert status == 2
        assert said.count("\n") == 1
        assert "Read-only file system" in said


@pytest.mark.parametrize("state", ["full", "read-only"])
def test_cache_of_compiled_code_is_not_needed(
    home: Path, disk: Path, tmp_path: Path, state: str
) -> None:
    with small_disk(disk, "64k") as remount:
        if state == "full":
            fill = ["dd", "if=/dev/zero", f"of={disk / 'filler'}", "bs=4k"]
            subprocess.run(fill, check=False, stderr=subprocess.DEVNULL)
        else:
            remount("ro")
        process = start(home / "small.toml", tmp_path / "run", NUMBA_CACHE_DIR=str(disk / "cache"))
        status, said = finished(process)
        assert status == 0
        assert "compiling the kernels" in said  # again: nothing is kept
    require_whole(tmp_path / "run", home)


@pytest.mark.parametrize("change", ["changed", "vanished"])
def test_record_that_changes_while_the_run_is_stopped(
    tmp_path: Path, home: Path, change: str
) -> None:
    """No manifest is written for a changed record; once it is restored, the run resumes."""
    study = make_study(tmp_path, 6)
    process = start(study, tmp_path / "run")
    assert wait_for_stamps(tmp_path / "run", 1, process)
    process.send_signal(signal.SIGSTOP)
    motion = tmp_path / "motions" / "motion-5.csv"
    before = motion.read_bytes()
    motion.write_bytes(before + b"0.0\n") if change == "changed" else motion.unlink()
    process.send_signal(signal.SIGCONT)
    status, said = finished(process)
    assert status == 2
    assert f"{motion}: {change} since the run began" in said
    assert not (tmp_path / "run" / "manifest.json").exists()
    motion.write_bytes(before)
    resumed(study, tmp_path / "run")
    require_whole(tmp_path / "run", home)


@pytest.mark.parametrize("damage", ["truncated", "flipped"])
def test_damaged_batch_of_a_killed_run_is_made_again(
    home: Path, tmp_path: Path, damage: str
) -> None:
    """The corrupted file is from a step that had finished when the run was killed."""
    folder = tmp_path / "run"
    process = start(home / "small.toml", folder)
    stamp = folder / ".rockframe" / "steps" / "respond-001.json"
    assert wait_until(stamp.is_file, process)
    kill(process, group=True)
    batch = folder / "shards" / "response-001.nc"
    content = bytearray(batch.read_bytes())
    content[len(content) // 2] ^= 1
    batch.write_bytes(content if damage == "flipped" else content[: len(content) // 2])
    status, said = finished(start(home / "small.toml", folder))
    assert status == 0
    assert f"{batch}: is corrupted; made again." in said
    require_whole(folder, home)


def test_study_that_rejects_is_resumed_too(tmp_path: Path) -> None:
    """A run that rejects a file is complete with exit status 1; repeated, it prints the same."""
    study = make_study(tmp_path, 2, STUDY)
    (tmp_path / "motions" / "notes.txt").write_text("Nothing of the kind.\n")
    first = finished(start(study, tmp_path / "run"))
    assert first[0] == 1
    assert finished(start(study, tmp_path / "run")) == first
