"""The share of a run that its own process computes: `python -m tests.benchmarks.cluster`.

It needs the extra dask. The study is that of tests/benchmarks/archive.py without a screening. One
`rockframe run` computes it on a Dask cluster of this machine that does not share its folder.
Printed are the processor time of that process and of the workers, less that of a study of one
record and structure, which is imports and start, and the transitions of tasks in the scheduler.

With ``--simulated N`` a real scheduler has workers of N threads together, whose tasks only sleep:
each stands for a record and 1,000 structures, with as many bytes. Printed are the processor times
of the process that asks and of the scheduler, for each task.
"""

from __future__ import annotations

import argparse
import json
import resource
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter, process_time, sleep
from typing import Any, Final

import psutil
from distributed import Client, LocalCluster
from tests.benchmarks.archive import STUDY, make_structures
from tests.benchmarks.size import sized
from tests.benchmarks.studies import ROCKFRAME, make_records

from rockframe.engines.dask import DaskScheduler
from rockframe.engines.engine import map_tasks

#: Processes of the workers whose tasks sleep.
_PROCESSES: Final = 4


def make_study(home: Path, records: int, structures: int, members: int) -> Path:
    """Write the records and the study."""
    home.mkdir()
    make_records(home / "motions", records)
    make_structures(home / "fifty.toml", structures)
    text = STUDY.format(batch=10**9, members=members)
    start, end = text.index("[screen]"), text.index("[figures]")
    study = home / "site.toml"
    study.write_text(text[:start] + "[pulse]\nsurrogates = 0\n\n" + text[end:])
    return study


def spent_by_workers(client: Client) -> float:
    """Return the processor time of all workers so far [s]."""
    return float(sum(client.run(process_time).values()))


def cost(study: Path, client: Client) -> dict[str, Any]:
    """Run a study on the cluster; return processor times [s], tasks, and bytes of all results."""
    address = client.scheduler.address
    words = ["run", str(study), "--output", str(study.parent / "run")]
    words += ["--scheduler", address, "--no-shared-folder"]
    before, children = spent_by_workers(client), resource.getrusage(resource.RUSAGE_CHILDREN)
    counted = client.run_on_scheduler(_counters)
    ended = subprocess.run([*ROCKFRAME, *words], capture_output=True, text=True, check=False)
    if ended.returncode > 1:
        raise SystemExit(ended.stderr)
    after, workers = resource.getrusage(resource.RUSAGE_CHILDREN), spent_by_workers(client)
    now = client.run_on_scheduler(_counters)
    own = after.ru_utime + after.ru_stime - children.ru_utime - children.ru_stime
    return {
        "own_s": round(own, 2),
        "workers_s": round(workers - before, 2),
        "transitions": now - counted,
    }


def _counters(dask_scheduler: Any) -> int:
    return int(dask_scheduler.transition_counter)


def _pretend(task: tuple[bytes, float, int]) -> bytes:
    """Sleep, and return as many bytes as asked for."""
    _, seconds, size = task
    sleep(seconds)
    return bytes(size)


def simulated(threads: int, tasks: int, task_bytes: int, result_bytes: int) -> dict[str, Any]:
    """Return the processor times of the process that asks and of the scheduler, for each task."""
    python = [sys.executable, "-m"]
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    quiet = ["--no-dashboard"]
    worker = [*python, "distributed.cli.dask_worker", address, "--no-nanny", *quiet]
    worker += ["--nthreads", str(threads // _PROCESSES)]
    scheduler_words = [*python, "distributed.cli.dask_scheduler", "--port", str(port), *quiet]
    commands = [scheduler_words, *_PROCESSES * [worker]]
    with tempfile.TemporaryDirectory() as home, ExitStack() as stack:
        processes = [
            subprocess.Popen(words, cwd=home, stderr=subprocess.DEVNULL) for words in commands
        ]
        for process in processes:
            stack.callback(process.wait)
            stack.callback(process.terminate)
        with Client(address, timeout=60) as client:
            client.wait_for_workers(_PROCESSES, timeout=120)
            scheduler = psutil.Process(processes[0].pid)
            spent, own = sum(scheduler.cpu_times()[:2]), process_time()
            start = perf_counter()
            asked = ((bytes(task_bytes), 1.0, result_bytes) for _ in range(tasks))
            answers = map_tasks(_pretend, asked, engine=DaskScheduler(address))
            received = sum(map(len, answers))
            own, clock = process_time() - own, perf_counter() - start
            spent = sum(scheduler.cpu_times()[:2]) - spent
    return {
        "threads": threads,
        "tasks": tasks,
        "megabytes_received": round(received / 1e6, 1),
        "clock_s": round(clock, 1),
        "own_ms_a_task": round(1e3 * own / tasks, 3),
        "scheduler_ms_a_task": round(1e3 * spent / tasks, 3),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=sized(60, 1))
    parser.add_argument("--structures", type=int, default=sized(50, 1))
    parser.add_argument("--members", type=int, default=sized(64, 0))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--simulated", type=int, help="number of threads whose tasks sleep")
    parser.add_argument("--tasks", type=int, default=4000, help="tasks that sleep")
    parser.add_argument("--bytes", type=int, default=800_000, help="bytes that each returns")
    options = parser.parse_args(arguments)
    if options.simulated:
        sizes = options.tasks, 32_000, options.bytes
        print(json.dumps(simulated(options.simulated, *sizes), indent=2))
        return
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        smallest = make_study(home / "smallest", 1, 1, 0)
        study = make_study(home / "study", options.records, options.structures, options.members)
        cluster = LocalCluster(
            n_workers=options.workers, threads_per_worker=1, dashboard_address=":0"
        )
        with cluster, Client(cluster) as client:
            cost(smallest, client)  # kernels are compiled and loaded
            (smallest.parent / "run").rename(smallest.parent / "first")
            start, whole = cost(smallest, client), cost(study, client)
    own = whole["own_s"] - start["own_s"]
    share = {"own_over_workers": round(own / whole["workers_s"], 4)}
    print(json.dumps({**vars(options), "start": start, "whole": whole, **share}, indent=2))


if __name__ == "__main__":
    main()
