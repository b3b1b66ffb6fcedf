"""The cost of an archive, stage by stage: `python -m tests.benchmarks.archive --records N`.

The study is that of docs/howto/archive.md, with synthetic records and fifty structures. The
commands of its plan run one after the other, each in its own process with its default number of
workers. For each command the wall time, the time of all processors and the memory of its largest
process are printed. With `--run`, one `rockframe run` of the study follows, in batches.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.size import sized
from tests.benchmarks.studies import ROCKFRAME, make_records

from rockframe.runs.plan import make_plan
from rockframe.runs.state import write_plan
from rockframe.study.study import read_study

STUDY = """
name = "site"
structures = "fifty.toml"

[records]
paths = ["motions"]
units = "g"
time_step_s = 0.01

[respond]
histories = "none"
margins = "none"

[respond.ensemble]
members = {members}

[screen]
scales = [0.5, 0.75, 1.0, 1.5, 2.0, 3.0]
margins = "none"
hazard = "hazard.csv"

[figures]
most = 0

[batches]
records = {batch}
"""
HAZARD = "annual_rate,pga_g\n0.1,0.05\n0.01,0.2\n0.002,0.5\n0.0004,1.0\n0.0001,2.0\n"


def make_structures(path: Path, count: int) -> None:
    """Write structures of 2 to 20 m, 7 to 14 degrees slender, with mass ratios of 0 to 4."""
    lines = []
    for k in range(count):
        height = 2.0 + 18.0 * k / max(count - 1, 1)
        lines += ["[[structure]]", f'name = "structure-{k:02d}"', f"height_m = {height:.3f}"]
        lines += [f"width_m = {height * (0.12 + 0.13 * (k % 5) / 4):.3f}"]
        lines += [f"mass_ratio = {(0.0, 0.5, 1.0, 2.0, 4.0)[k // 5 % 5]}", ""]
    path.write_text("\n".join(lines))


def cost(words: Sequence[str], folder: Path) -> dict[str, float]:
    """Run a command; return its wall and processor time [s] and largest process's memory [MB]."""
    start = time.perf_counter()
    with (folder / "said.log").open("a") as log:
        process = subprocess.Popen([*ROCKFRAME, *words], cwd=folder, stdout=log, stderr=log)
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode > 1:
        raise SystemExit((folder / "said.log").read_text()[-2000:])
    return {
        "clock_s": round(time.perf_counter() - start, 1),
        "processors_s": round(used.ru_utime + used.ru_stime, 1),
        "memory_mb": round(used.ru_maxrss / 1024.0),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=sized(1000, 1))
    parser.add_argument("--structures", type=int, default=sized(50, 1))
    parser.add_argument("--members", type=int, default=64, help="plausible structures of a pair")
    parser.add_argument("--batch", type=int, default=100, help="records of a batch, with --run")
    parser.add_argument("--run", action="store_true", help="measure `rockframe run` too")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        make_records(home / "motions", options.records)
        make_structures(home / "fifty.toml", options.structures)
        (home / "hazard.csv").write_text(HAZARD)
        study = home / "site.toml"
        study.write_text(STUDY.format(batch=10**9, members=options.members))
        bare = home / "bare"
        bare.mkdir()
        plan = make_plan(read_study(study), bare)
        write_plan(plan, bare)
        costs: dict[str, dict[str, float]] = {}
        for step in sized(plan.steps, plan.steps[:1]):
            costs[step.name] = cost(["step", str(bare), step.name], bare)
            print(step.name, costs[step.name], flush=True)
        if options.run:
            study.write_text(STUDY.format(batch=options.batch, members=options.members))
            words = ["run", str(study), "--output", str(home / "run")]
            costs["rockframe run"] = cost(words, home)
            costs["rockframe run, unchanged"] = cost(words, home)
        sizes = {p.name: round(p.stat().st_size / 1e6, 1) for p in bare.iterdir() if p.is_file()}
    print(json.dumps({**vars(options), "costs": costs, "megabytes": sizes}, indent=2))


if __name__ == "__main__":
    main()
