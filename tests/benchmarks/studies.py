"""The cost of a run of a study over its bare stages: `python -m tests.benchmarks.studies`.

The bare stages are the commands of the plan as a user types them, one after the other and on all
records at once. Both are measured in this call on this machine, each in its own processes. The
processor time is that of all of them, so other work on the machine does not count. The stages are
as cheap as possible, without surrogates and margins, so that the overhead weighs most.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tests.benchmarks.size import sized

from rockframe.runs.plan import make_plan
from rockframe.runs.state import write_plan
from rockframe.study.study import read_study
from rockframe.wavelets.pulse import Pulse

STUDY = """
name = "bench"

[records]
paths = ["motions"]
units = "g"
time_step_s = 0.01

[pulse]
surrogates = 0

[respond]
histories = "selected"
margins = "none"

[figures]
most = 12
"""
SAMPLES = 4000
ROCKFRAME = (sys.executable, "-m", "rockframe.cli.main")


def make_records(folder: Path, count: int) -> None:
    """Write pulses in noise as text files that all differ."""
    folder.mkdir()
    chance = np.random.default_rng(2026)
    time_axis = 0.01 * np.arange(SAMPLES)
    for k in range(count):
        pulse = Pulse(
            wavelet="symmetric_ricker",
            a_p=chance.uniform(0.1, 0.6),
            T_p=chance.uniform(0.4, 1.6),
            time=20.0,
        )
        quiet = 0.02 * chance.standard_normal(SAMPLES) * np.exp(-(((time_axis - 20.0) / 8.0) ** 2))
        np.savetxt(
            folder / f"motion-{k:05d}.csv", pulse.acceleration(time_axis) + quiet, fmt="%.6f"
        )


def cost(commands: Sequence[Sequence[object]], folder: Path) -> tuple[float, float]:
    """Return the wall time and the processor time [s] of commands run one after the other."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    for words in commands:
        ended = subprocess.run(
            [*ROCKFRAME, *map(str, words)], cwd=folder, capture_output=True, text=True, check=False
        )
        if ended.returncode > 1:
            raise SystemExit(ended.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - start, spent


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=sized(100, 1))
    parser.add_argument("--study", type=Path, help="a study file instead, for its own records")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        study = options.study and options.study.resolve()
        if study is None:
            make_records(home / "motions", options.records)
            study = home / "bench.toml"
            study.write_text(STUDY)
        whole = home / "whole.toml"  # one batch: its plan's commands are the bare stages
        text = study.read_text(encoding="utf-8")
        if options.study is None:
            whole.write_text(f"{text}\n[batches]\nrecords = 1000000\n")
            whole_study = read_study(whole)
        else:
            whole_study = read_study(study)
        bare = home / "bare"
        bare.mkdir()
        plan = make_plan(whole_study, bare)
        write_plan(plan, bare)
        steps = sized(plan.steps, plan.steps[:1])
        commands = [["step", bare, step.name] for step in steps]
        bare_clock, bare_spent = cost(commands, bare)
        run = ["run", study, "--output", home / "run"]
        run_clock, run_spent = cost([run], home)
        again_clock, _ = cost([run], home)
    print(
        json.dumps(
            {
                "records": options.records if options.study is None else str(options.study),
                "bare_s": round(bare_clock, 2),
                "run_s": round(run_clock, 2),
                "bare_processor_s": round(bare_spent, 2),
                "run_processor_s": round(run_spent, 2),
                "overhead_processor_percent": round(100.0 * (run_spent / bare_spent - 1.0), 1),
                "unchanged_s": round(again_clock, 2),
            },
            indent=2,
        )
    )


if __name__ == "__main__":
    main()
