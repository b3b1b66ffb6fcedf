"""Engines return the same results in the same order, even if workers die."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from rockframe.engines.choice import choose_engine
from rockframe.engines.dask import DaskScheduler, _require_listening
from rockframe.engines.engine import (
    Engine,
    OneProcess,
    ProcessPool,
    map_tasks,
)
from rockframe.errors import EngineError, InputError, ParameterError
from rockframe.provenance import sha256_of

#: A pool that starts its workers even for the smallest job.
POOL = ProcessPool(2, patience=0.0)
#: A task for `eval`, a function that every worker can import; it kills its worker.
DIES = "__import__('os').kill(__import__('os').getpid(), 9)"
#: A task that returns the number of the process that computes it.
ASKS = "__import__('os').getpid()"


def once(marker: Path, then: str, value: str) -> str:
    """Return an expression that runs `then` the first time, and gives `value` the second time."""
    first = f"__import__('os').open({str(marker)!r}, {os.O_CREAT | os.O_EXCL})"
    seen = f"__import__('os').path.exists({str(marker)!r})"
    return f"({value}) if {seen} else ({first}, {then})"


@pytest.mark.parametrize("engine", [OneProcess(), POOL, ProcessPool(3, patience=0.0)])
def test_results_come_in_the_order_of_the_tasks(engine: Engine) -> None:
    tasks = ["__import__('time').sleep(0.05) or 0", "1", "2", "3", "4", "5", "6"]
    assert list(map_tasks(eval, tasks, engine=engine)) == list(range(7))


def test_pool_gives_the_bits_of_one_process() -> None:
    tasks = [np.linspace(0.0, n, 50) for n in range(1, 20)]
    here = list(map_tasks(np.cumsum, tasks, engine=OneProcess()))
    there = list(map_tasks(np.cumsum, tasks, engine=POOL))
    assert [array.tobytes() for array in here] == [array.tobytes() for array in there]


@pytest.fixture
def _clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let each task that is computed in this process take one second, on any machine."""
    monkeypatch.setattr("rockframe.engines.engine.perf_counter", count().__next__)


@pytest.mark.usefixtures("_clock")
def test_small_job_starts_no_process() -> None:
    assert set(map_tasks(eval, [ASKS] * 3)) == {os.getpid()}


def test_nothing_is_started_for_no_tasks() -> None:
    assert list(map_tasks(eval, [], engine=POOL)) == []


@pytest.mark.usefixtures("_clock")
def test_a_little_that_is_left_is_done_here() -> None:
    """After two tasks of three, 1 s of work is left; of four, 2 s: more than the patience."""
    engine = ProcessPool(2, patience=1.5)
    assert set(map_tasks(eval, [ASKS] * 3, engine=engine)) == {os.getpid()}
    there = [pid != os.getpid() for pid in map_tasks(eval, [ASKS] * 4, engine=engine)]
    assert there == [False, False, True, True]


def test_batches_are_taken_as_they_are_needed() -> None:
    taken = []

    def tasks() -> object:
        for number in range(100):
            taken.append(number)
            yield str(number)

    results = map_tasks(eval, tasks(), engine=POOL)  # type: ignore[arg-type]
    assert next(results) == 0
    results.close()
    assert len(taken) <= 5


def test_killed_worker_costs_its_task_not_the_run(tmp_path: Path) -> None:
    tasks = ["0", "1", once(tmp_path / "killed", DIES, "2"), "3", "4"]
    assert list(map_tasks(eval, tasks, engine=POOL)) == [0, 1, 2, 3, 4]
    assert (tmp_path / "killed").exists()


def counting(notes: Path, value: str) -> str:
    """Return an expression that appends a letter to a file, and then gives `value`."""
    return f"(open({str(notes)!r}, 'a').write('x'), {value})[1]"


def test_task_that_kills_its_workers_is_tried_three_times_and_named(tmp_path: Path) -> None:
    task = counting(tmp_path / "attempts", DIES)
    with pytest.raises(EngineError, match=r"task 2: its worker died 3 times .*signal 9, Killed"):
        list(map_tasks(eval, ["1", task, "3"], engine=POOL))
    assert (tmp_path / "attempts").read_text() == "xxx"


@pytest.mark.usefixtures("_clock")
def test_number_of_a_task_counts_those_done_here() -> None:
    with pytest.raises(EngineError, match="task 12: its worker died"):
        list(map_tasks(eval, [ASKS] * 11 + [DIES], engine=ProcessPool(2, patience=1.5)))


def test_error_of_the_user_comes_as_it_is() -> None:
    with pytest.raises(InputError, match="no-such-file: cannot be read") as caught:
        list(map_tasks(sha256_of, [Path("no-such-file")], engine=POOL))
    assert caught.value.path == Path("no-such-file")


def test_unforeseen_error_comes_with_its_traceback() -> None:
    with pytest.raises(RuntimeError, match=r"(?s)task 1 failed.*ValueError.*math domain|nonneg"):
        list(map_tasks(math.sqrt, [-1.0], engine=POOL))


def test_what_a_function_prints_does_not_disturb(capfd: pytest.CaptureFixture[str]) -> None:
    tasks = ["print('heard') or 1", "__import__('os').write(1, b'said') and 2"]
    assert list(map_tasks(eval, tasks, engine=POOL)) == [1, 2]
    assert capfd.readouterr().out == ""


def test_workers_have_one_thread() -> None:
    variables = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
    asked = [f"__import__('os').environ[{name!r}]" for name in variables]
    assert list(map_tasks(eval, asked, engine=POOL)) == ["1", "1", "1"]


def _run_pool(workers: int, task: str) -> subprocess.Popen[str]:
    """Start a process that starts workers, prints their process numbers, and computes."""
    program = (
        "from rockframe import ProcessPool, map_tasks\n"
        f"tasks = ['__import__(\"os\").getpid()'] * {workers} + [{task!r}] * {workers}\n"
        f"for result in map_tasks(eval, tasks, engine=ProcessPool({workers}, patience=0.0)):\n"
        "    print(result, flush=True)\n"
    )
    return subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def _alive(pid: int) -> bool:
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] != "Z"


def _gone(pids: set[int]) -> bool:
    deadline = time.monotonic() + 20.0
    while any(map(_alive, pids)) and time.monotonic() < deadline:
        time.sleep(0.02)
    return not any(map(_alive, pids))


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("how", ["SIGKILL", "SIGINT"])
def test_workers_end_with_their_parent(how: str) -> None:
    with _run_pool(2, "__import__('time').sleep(600)") as parent:
        assert parent.stdout is not None
        pids = {int(parent.stdout.readline()) for _ in range(2)}
        parent.send_signal(signal.Signals[how])
        parent.wait(timeout=20)
        assert _gone(pids)


@pytest.mark.parametrize("workers", [0, -1])
def test_number_of_workers(workers: int) -> None:
    with pytest.raises(ParameterError, match=rf"workers {workers}. Must be 1 or more"):
        choose_engine(workers)


def test_one_worker_is_this_process() -> None:
    assert choose_engine(1) == OneProcess()


def test_workers_and_scheduler_exclude_each_other() -> None:
    with pytest.raises(ParameterError, match="--workers and --scheduler both given"):
        choose_engine(2, "tcp://localhost:8786")


def test_scheduler_is_an_engine() -> None:
    assert choose_engine(None, "tcp://localhost:8786") == DaskScheduler("tcp://localhost:8786")


@pytest.mark.parametrize("wrong", ["nonsense", "", "http://127.0.0.1:80", "tcp://127.0.0.1:x"])
def test_address_that_is_none(wrong: str) -> None:
    with pytest.raises(EngineError, match=r"Invalid scheduler .*Must be the address of a running"):
        _require_listening(wrong)


def test_scheduler_that_is_not_there() -> None:
    with pytest.raises(EngineError, match=r"Invalid scheduler 'tcp://127.0.0.1:1': .*refused"):
        _require_listening("tcp://127.0.0.1:1")


def test_dask_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EngineError, match=r"Install it with: pip install 'rockframe\[dask"):
        list(map_tasks(abs, [1], engine=DaskScheduler("tcp://127.0.0.1:1")))
