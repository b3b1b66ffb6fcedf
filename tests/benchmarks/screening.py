"""The cost of screening: scenarios per second, memory over the number of scenarios, and a pool.

``python -m tests.benchmarks.screening`` prints one flat JSON object; ``--output FILE`` also
writes it. The bundled records and shipped structures are screened without margins. Each screening
is its own process: its time includes the start of Python, its memory is the peak of the parent.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.size import sized

from rockframe.options.model import MOST_NUMBERS
from rockframe.study.structures import bundled_records

COMMAND = str(Path(sys.executable).parent / "rockframe")
#: Shipped structures times bundled horizontal records.
PAIRS = 5 * 6


def timed(words: Sequence[str]) -> dict[str, float]:
    """Return wall time, processor time of all processes and peak memory of a command."""
    begin = time.perf_counter()
    process = subprocess.Popen([COMMAND, *words], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"rockframe {' '.join(words)}: status {process.returncode}")
    return {
        "s": time.perf_counter() - begin,
        "processor_s": usage.ru_utime + usage.ru_stime,
        "memory_mb": usage.ru_maxrss / 1024.0,
    }


def screened(folder: Path, scales: int, *words: str) -> dict[str, float]:
    """Screen at a number of scales; return time and memory."""
    output = ["--output", str(folder / "screen.nc"), "--margins", "none"]
    stated = ["--scales", f"0.25:3:{scales}"] if scales > 1 else ["--scales", "1"]
    return timed(["screen", str(folder / "records.nc"), *output, *stated, *words])


def measure(repeats: int = 2) -> dict[str, float]:
    """Return the least times of `repeats` runs, peak memories, and ratios."""
    found: dict[str, float] = {}
    # As many scales as `screen` allows.
    scales, of_memory = sized((MOST_NUMBERS, (20, 200, MOST_NUMBERS)), (1, ()))
    scenarios = PAIRS * scales
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        given = sized(bundled_records(), bundled_records() / "Ridgecrest2019-CCC.V1")
        timed(["ingest", str(given), "--output", str(folder / "records.nc")])
        for workers in (1, 2):
            runs = [screened(folder, scales, "--workers", str(workers)) for _ in range(repeats)]
            found[f"screen_{scenarios}_{workers}_workers_s"] = min(run["s"] for run in runs)
            found[f"screen_{scenarios}_{workers}_workers_processor_s"] = min(
                run["processor_s"] for run in runs
            )
        start = min(screened(folder, 1)["s"] for _ in range(repeats))
        found["screen_30_s"] = start
        one = found[f"screen_{scenarios}_1_workers_s"]
        found["screen_scenarios_per_s"] = scenarios / one
        found["screen_pool_over_one_process"] = one / found[f"screen_{scenarios}_2_workers_s"]
        for count in of_memory:
            found[f"screen_memory_{PAIRS * count}_mb"] = screened(folder, count)["memory_mb"]
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=sized(3, 1))
    parser.add_argument("--output", type=Path)
    options = parser.parse_args(arguments)
    text = json.dumps({k: round(v, 3) for k, v in measure(options.repeats).items()}, indent=2)
    print(text)
    if options.output:
        options.output.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
