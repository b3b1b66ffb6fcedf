"""A run on a Dask cluster, given by its address; `make test-dask` installs the requirements."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.engines.clusters import distributed, local_cluster
from tests.faults.harness import all_gone, can_mount, children, small_disk, wait_until
from tests.runs.small import FEW, FURTHER, contents, make_study, run

from rockframe.cli.main import main


@pytest.fixture(scope="module", autouse=True)
def coarse_figures() -> None:
    """Draw all dots here, as the workers of a cluster do."""


def test_cluster_gives_the_bytes_of_one_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The workers do not run in the folder in which the command is typed."""
    study = make_study(tmp_path, 3, FURTHER)
    assert run(study, tmp_path / "here") == 0
    monkeypatch.chdir(tmp_path)
    with local_cluster(2, threads_per_worker=2) as cluster:
        words = ["run", "small.toml", "--output", "there"]
        assert main([*words, "--scheduler", cluster.scheduler_address]) == 0
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


#: Lets a worker open no file in a folder, as if it were on another machine.
_HIDES = """
def refuse(event, found):
    if event == "open" and str(found[0]).startswith({folder!r}):
        raise FileNotFoundError(found[0])
__import__("sys").addaudithook(refuse)
"""


def test_workers_without_the_folder_give_the_same_bytes(tmp_path: Path) -> None:
    """They get their records from the run: it writes each file itself, and no step runs on them."""
    study, folder = make_study(tmp_path, 3, FURTHER), tmp_path / "apart"
    assert run(study, tmp_path / "here") == 0
    with local_cluster(2, threads_per_worker=1) as cluster, distributed.Client(cluster) as client:
        client.run(exec, _HIDES.format(folder=str(tmp_path)))
        words = ["run", str(study), "--output", str(folder), "--no-shared-folder"]
        assert main([*words, "--scheduler", cluster.scheduler_address]) == 0
        tasks = client.run_on_scheduler(lambda dask_scheduler: dask_scheduler.transition_counter)
    assert contents(folder) == contents(tmp_path / "here")
    assert tasks > 0


def test_no_shared_folder_needs_a_scheduler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path, 1)
    assert main(["run", str(study), "--output", str(tmp_path / "x"), "--no-shared-folder"]) == 2
    assert "--no-shared-folder without --scheduler" in capsys.readouterr().err


def _worker(address: str, home: Path) -> subprocess.Popen[str]:
    """Start a worker without a nanny, so that nothing restarts it."""
    words = [address, "--no-nanny", "--nthreads", "1", "--no-dashboard"]
    with (home / "worker.log").open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_worker", *words],
            stdout=log,
            stderr=log,
            text=True,
        )


def at_work(worker: subprocess.Popen[str]) -> bool:
    """Return True while the worker performs a step, in a process of its own."""
    return any("rockframe.engines.worker" in words for words in children(worker.pid).values())


def test_killed_worker_costs_its_step_and_its_process(tmp_path: Path) -> None:
    """Another worker repeats the step; the processes of the first attempt must end."""
    study, folder = make_study(tmp_path, 1, FEW), tmp_path / "run"
    with local_cluster(0) as cluster, distributed.Client(cluster) as client:
        killed = _worker(cluster.scheduler_address, tmp_path)
        client.wait_for_workers(1)
        words = [sys.executable, "-m", "rockframe.cli.main", "run", str(study)]
        words += ["--output", str(folder), "--scheduler", cluster.scheduler_address]
        command = subprocess.Popen(words, text=True)
        try:
            assert wait_until(lambda: at_work(killed), command)
            below = list(children(killed.pid))
            killed.kill()
            killed.wait()
            assert all_gone(below)
            other = _worker(cluster.scheduler_address, tmp_path)
            assert command.wait() == 0
        finally:
            command.kill()
            killed.kill()
        other.kill()
        other.wait()
    assert main(["verify", str(folder)]) == 0


def test_scheduler_that_is_not_there_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = make_study(tmp_path, 1)
    words = ["run", str(study), "--output", str(tmp_path / "run")]
    assert main([*words, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    assert "Must be the address of a running Dask" in capsys.readouterr().err


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study, and a run of it in one process."""
    home = tmp_path_factory.mktemp("whole")
    assert run(make_study(home, 1, FEW), home / "here") == 0
    return home


@contextmanager
def scheduler_at(port: int, home: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Start a scheduler and a worker in processes of their own; kill both at the end."""
    words = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--no-dashboard"]
    with (home / "scheduler.log").open("ab") as log:
        scheduler = subprocess.Popen(
            [*words, "--host", "127.0.0.1", "--port", str(port)], stdout=log, stderr=log
        )
    address = f"tcp://127.0.0.1:{port}"
    worker = _worker(address, home)
    try:
        with distributed.Client(address, timeout=60) as client:
            client.wait_for_workers(1, timeout=60)
        yield scheduler
    finally:
        worker.kill()
        worker.wait()
        scheduler.kill()
        scheduler.wait()


def command_of(study: Path, folder: Path, address: str) -> list[str]:
    words = [sys.executable, "-m", "rockframe.cli.main", "run", str(study)]
    return [*words, "--output", str(folder), "--scheduler", address]


def test_a_restarted_scheduler_costs_what_had_not_ended(whole: Path, tmp_path: Path) -> None:
    """The run ends with one line; the same command, with a new scheduler, gives the same bytes."""
    study, folder = whole / "small.toml", tmp_path / "run"
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    words = command_of(study, folder, f"tcp://127.0.0.1:{port}")
    with scheduler_at(port, tmp_path) as scheduler:
        command = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        steps = folder / ".rockframe" / "steps"
        assert wait_until(lambda: len(list(steps.glob("*.json"))) >= 1, command)
        scheduler.kill()
        _, said = command.communicate()
    assert command.returncode == 2
    lost = f"tcp://127.0.0.1:{port}: lost the connection to the scheduler before the end."
    assert said == f"rockframe: error: {lost} Start it again and repeat the command.\n"
    kept = {path.name: path.stat().st_mtime_ns for path in steps.glob("*.json")}
    with scheduler_at(port, tmp_path):
        assert subprocess.run(words, check=False, stderr=subprocess.PIPE).returncode == 0
    assert kept
    assert all((steps / name).stat().st_mtime_ns == time for name, time in kept.items())
    assert contents(folder) == contents(whole / "here")


def test_a_full_disk_of_the_workers_is_one_line(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With more space, the same command resumes."""
    if not can_mount(tmp_path / "probe"):
        pytest.skip("may not mount a disk: needs root")
    with small_disk(tmp_path / "disk", "120k") as remount, local_cluster(1) as cluster:
        words = ["run", str(whole / "small.toml"), "--output", str(tmp_path / "disk" / "run")]
        words += ["--scheduler", cluster.scheduler_address]
        capsys.readouterr()
        assert main(words) == 2
        said = capsys.readouterr().err
        assert said.startswith("rockframe: error: ")
        assert said.count("\n") == 1
        assert "No space left" in said
        remount("size=64m")
        assert main(words) == 0
        assert contents(tmp_path / "disk" / "run") == contents(whole / "here")
