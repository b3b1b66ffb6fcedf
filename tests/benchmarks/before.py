"""Compare the processor time with that of another commit, in one run on one machine.

    python -m tests.benchmarks.before [--commit HEAD~1] [--rounds 3]

The commit's files are unpacked into a temporary folder. In each round both trees are measured one
after the other, each in its own process; the best round counts. Only public names are called, so
that older commits can be measured too.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

ROOT: Final = Path(__file__).resolve().parents[2]


def measure(only: Sequence[str] = (), *, older: bool = False) -> dict[str, float]:
    """Return the processor time [s] of each job of the imported package, or only of some jobs.

    It is NaN for a job that an older commit cannot do, because it has no such function or calls its
    arguments otherwise.
    """
    rockframe = importlib.import_module("rockframe")
    records = [
        record
        for path in sorted(rockframe.bundled_records().glob("*.V1"))
        for record in rockframe.read_file(path)
        if record.component.lower() not in ("up", "vert", "v")
    ]
    frames = [
        rockframe.RockingFrame(height=height, width=0.17 * height, mass_ratio=ratio)
        for height in (5.0, 9.6, 15.0)
        for ratio in (0.0, 4.0)
    ]
    pulse = rockframe.Pulse(wavelet="antisymmetric_ricker", a_p=9.81, T_p=1.5)
    scales = np.linspace(0.2, 3.0, 200)
    jobs: dict[str, Callable[[], object]] = {
        "responses to records": lambda: rockframe.respond_many(records, frames, scales),
        "responses to a pulse": lambda: rockframe.respond_many([pulse], frames, 20 * [*scales]),
        "spectra": lambda: [
            rockframe.spectral_acceleration(
                record.acceleration, record.time_step, np.geomspace(0.05, 5.0, 100)
            )
            for record in records
        ],
        "RotD of spectra": lambda: [
            rockframe.rotd_spectral_acceleration(pair, period)
            for pair in rockframe.pair_horizontals(records)[0]
            for period in (0.05, 0.5, 2.0)
        ],
        "margins": lambda: rockframe.margins(records, frames),
        "pulses": lambda: [rockframe.find_pulses(record) for record in records[:2]],
        "reading": lambda: [
            rockframe.read_file(path)
            for _ in range(10)
            for path in rockframe.bundled_records().glob("*.V1")
        ],
        "table1": _table1,
    }
    found = dict.fromkeys(only or jobs, math.nan)
    for name in found:
        try:
            found[name] = _best_of(jobs[name])
        except (AttributeError, TypeError):
            if not older:
                raise
    return found


def _best_of(job: Callable[[], object]) -> float:
    times = []
    for _ in range(3):  # the first one may compile
        start = _processor_time()
        job()
        times.append(_processor_time() - start)
    return min(times)


def _processor_time() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _table1() -> None:
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-m", "rockframe.cli.main", "table1", "--output", folder],
            check=True,
            stdout=subprocess.DEVNULL,
        )


def measured_in(tree: Path, only: Sequence[str] = ()) -> dict[str, float]:
    """Measure the package of a tree in its own process."""
    words = [*(f"--only={name}" for name in only), *(["--older"] if tree != ROOT else [])]
    run = subprocess.run(
        [sys.executable, __file__, "--measure", *words],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree / "pipeline")},
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    found: dict[str, float] = json.loads(run.stdout)
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print both times and their ratio for each job."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--commit", default="HEAD~1", help="the other commit (default: HEAD~1)")
    parser.add_argument("--only", action="append", default=[], help="job (default: all jobs)")
    parser.add_argument("--rounds", type=int, default=3, help="rounds of both (default: 3)")
    parser.add_argument("--measure", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--older", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.measure:
        print(json.dumps(measure(options.only, older=options.older)))
        return
    from tests.benchmarks.size import sized  # absent in the processes that measure

    only, options.commit = sized((options.only, options.commit), (["reading"], "HEAD"))
    rounds_of_both = sized(options.rounds, 1)
    files = subprocess.run(
        ["git", "archive", options.commit], cwd=ROOT, check=True, capture_output=True
    )
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        # not by tarfile, which has filters since Python 3.11.4 only
        subprocess.run(["tar", "-x", "-C", folder], input=files.stdout, check=True)
        rounds = [
            (measured_in(Path(folder), only), measured_in(ROOT, only))
            for _ in range(rounds_of_both)
        ]
    print(f"processor time [s], best of {len(rounds)} rounds, {time.perf_counter() - start:.0f} s")
    print(f"{'':24}{options.commit[:12]:>12}{'now':>12}{'ratio':>8}")
    for name in rounds[0][0]:
        before, now = (min(one[k][name] for one in rounds) for k in (0, 1))
        print(f"{name:24}{before:12.3f}{now:12.3f}{before / now:8.2f}")


if __name__ == "__main__":
    main()
