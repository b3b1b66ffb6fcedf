"""The Dask engine. `make test-dask` installs what it needs and runs these tests."""

from __future__ import annotations

import importlib
import logging
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.engines.clusters import distributed, local_cluster
from tests.engines.test_engines import DIES, once
from tests.screening import site, stored

from rockframe.engines.dask import DaskScheduler
from rockframe.engines.engine import OneProcess, ProcessPool, map_tasks
from rockframe.errors import EngineError, InputError
from rockframe.options.respond import ScreenOptions
from rockframe.provenance import sha256_of
from rockframe.stages.respond import respond_stage
from rockframe.stages.screen import screen_stage


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Start a cluster of two processes on this machine and yield its address."""
    with local_cluster(2, threads_per_worker=2) as cluster:
        yield cluster.scheduler_address


def test_cluster_gives_the_bits_of_one_process(address: str) -> None:
    tasks = [np.linspace(0.0, n, 50) for n in range(1, 40)]
    here = list(map_tasks(np.cumsum, tasks, engine=OneProcess()))
    there = list(map_tasks(np.cumsum, tasks, engine=DaskScheduler(address)))
    assert [array.tobytes() for array in here] == [array.tobytes() for array in there]


def test_short_batches_are_sent_together(address: str) -> None:
    """Each task costs the scheduler some milliseconds, whatever it computes."""
    task = "__import__('distributed').get_worker().get_current_task()"
    tasks = [f"({number}, {task})" for number in range(400)]
    done = list(map_tasks(eval, tasks, engine=DaskScheduler(address)))
    assert [number for number, _ in done] == list(range(400))
    assert len({name for _, name in done}) < 40


def test_stages_write_the_same_bytes(address: str, tmp_path: Path) -> None:
    """The threads of a Dask worker share the netCDF library, so no task may use it."""
    records = stored(site(12), tmp_path)
    files = []
    for engine in (OneProcess(), ProcessPool(2, patience=0.0), DaskScheduler(address)):
        respond_stage(records, tmp_path / "response.nc", engine=engine)
        screen_stage(
            records,
            tmp_path / "screen.nc",
            options=ScreenOptions(
                scales=np.linspace(0.5, 2.0, 800), margins="none", histories="none"
            ),
            engine=engine,
        )
        files.append([(tmp_path / f"{name}.nc").read_bytes() for name in ("response", "screen")])
    assert files[0] == files[1] == files[2]


def test_killed_worker_costs_its_task(address: str, tmp_path: Path) -> None:
    tasks = ["0", once(tmp_path / "killed", DIES, "1"), "2"]
    assert list(map_tasks(eval, tasks, engine=DaskScheduler(address))) == [0, 1, 2]


def test_task_that_kills_its_workers_is_named(address: str) -> None:
    """It is alone here, because Dask blames all tasks of a worker for its death."""
    with pytest.raises(EngineError, match="task 1: its worker"):
        list(map_tasks(eval, [DIES], engine=DaskScheduler(address)))


def test_results_keep_their_order_beside_a_slow_worker(address: str, tmp_path: Path) -> None:
    """The worker with the first task is slow. How tasks are divided is the scheduler's affair."""
    marker = str(tmp_path / "slow")
    me = "__import__('distributed').get_worker().address"
    begin = f"open({marker!r}, 'x').write({me}) and __import__('time').sleep(0.5)"
    slow = f"__import__('os').path.exists({marker!r}) and open({marker!r}).read() == {me}"
    wait = f"__import__('time').sleep(0.5 if {slow} else 0.05)"
    tasks = [f"({begin}, 0)[1]"] + [f"({wait}, {number})[1]" for number in range(1, 17)]
    assert list(map_tasks(eval, tasks, engine=DaskScheduler(address))) == list(range(17))


def test_a_worker_of_another_version_is_refused(address: str) -> None:
    """Before any task: results of two versions may differ."""
    change = "import rockframe.engines.dask as d; d.kept = d._code; d._code = lambda: ('', '')"
    with distributed.Client(address, set_as_default=False) as client:
        worker = min(client.nthreads())
        client.run(exec, change, workers=[worker])
        try:
            with pytest.raises(
                EngineError, match=r"another version of rockframe\. Install the same"
            ):
                list(map_tasks(eval, ["1", "2"], engine=DaskScheduler(address)))
        finally:
            client.run(
                exec, "import rockframe.engines.dask as d; d._code = d.kept", workers=[worker]
            )
    assert list(map_tasks(eval, ["1", "2"], engine=DaskScheduler(address))) == [1, 2]


def test_error_of_the_user_comes_as_it_is(address: str) -> None:
    with pytest.raises(InputError, match="no-such-file: cannot be read"):
        list(map_tasks(sha256_of, [Path("no-such-file")], engine=DaskScheduler(address)))


def test_only_the_traceback_of_a_lost_connection_is_dropped(
    address: str, caplog: pytest.LogCaptureFixture
) -> None:
    """As long as a map lasts, whichever other one ends before."""
    logger = logging.getLogger("distributed.client")

    def logs(error: Exception) -> bool:
        caplog.clear()
        try:
            try:
                raise error
            except OSError as lost:  # Dask ends its tasks because of it
                raise RuntimeError from lost
        except (RuntimeError, ValueError):
            logger.exception("")
        return bool(caplog.records)

    first, second = (map_tasks(eval, ["1"], engine=DaskScheduler(address)) for _ in range(2))
    assert (next(first), next(second)) == (1, 1)
    assert list(first) == []
    assert not logs(ConnectionRefusedError())
    assert not logs(distributed.comm.CommClosedError())
    assert logs(ValueError())
    assert logs(FileNotFoundError())
    assert list(second) == []
    assert logs(ConnectionRefusedError())


def test_scheduler_without_workers() -> None:
    with local_cluster(0) as cluster:
        engine = DaskScheduler(cluster.scheduler_address)
        with pytest.raises(EngineError, match="has no workers"):
            list(map_tasks(eval, ["1"], engine=engine))


def test_scheduler_that_loses_its_workers() -> None:
    """Without a nanny nobody replaces a worker, and Dask would wait for ever."""
    with local_cluster(1, processes=False, protocol="tcp") as cluster:
        engine = DaskScheduler(cluster.scheduler_address, patience=0.5)
        results = map_tasks(eval, ["1", *["__import__('time').sleep(5)"] * 9], engine=engine)
        assert next(results) == 1
        cluster.scale(0)
        with pytest.raises(EngineError, match=r"has had no workers for 0.5 s. Start workers"):
            list(results)


def test_a_busy_machine_does_not_keep_a_cluster_from_starting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Dask warns that a folder took more than a second; here, warnings are errors."""
    core = importlib.import_module("distributed.core")
    workspace = core.WorkSpace

    def slowly(folder: str) -> object:
        time.sleep(1.1)
        return workspace(folder)

    monkeypatch.setattr(core, "WorkSpace", slowly)
    with local_cluster(1) as cluster, distributed.Client(cluster) as client:
        assert client.submit(abs, -2).result() == 2
