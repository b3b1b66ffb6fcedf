"""The workflow with the profile of Slurm and programs that stand in for those of Slurm.

The programs accept what those of Slurm accept of the options used, run each job on this machine,
and keep what was submitted. `test_slurm` uses a real Slurm, where it is installed.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from tests.runs.small import FURTHER, make_study, run
from tests.workflow.snake import MARKS, rockframe, snakemake
from tests.workflow.test_workflow import results

pytestmark = MARKS

#: Stands in for sbatch: checks the options, starts the job, and prints its number.
SBATCH = """
import argparse, json, os, pathlib, subprocess, sys
home = pathlib.Path({home!r})
parser = argparse.ArgumentParser(allow_abbrev=False)
for words in (["--job-name"], ["--output"], ["--export"], ["--comment"], ["-A"], ["-p"],
              ["-t"], ["--mem"], ["--ntasks"], ["--cpus-per-task"], ["-D"], ["--wrap"]):
    parser.add_argument(*words)
parser.add_argument("--parsable", action="store_true", required=True)
job, others = parser.parse_known_args()
number = len(list(home.glob("*.json"))) + 1
(home / f"{{number}}.json").write_text(json.dumps(vars(job) | {{"others": others}}))
script = f"( {{job.wrap}} ); echo $? > {{home / str(number)}}.status"
log = open(pathlib.Path(str(job.output).replace("%j", str(number))), "w")
environment = {{**os.environ, "SLURM_JOB_ID": str(number)}}
subprocess.Popen(["sh", "-c", script], stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                 env=environment, cwd=job.D, start_new_session=True)
print(number)
"""
#: Stands in for squeue: the state of each job.
SQUEUE = """
import pathlib
home = pathlib.Path({home!r})
for job in home.glob("*.json"):
    status = job.with_suffix(".status")
    ended = status.is_file() and status.read_text().strip()
    print(job.stem, {{"": "RUNNING", "0": "COMPLETED"}}.get(ended or "", "FAILED"), sep="|")
"""
#: Stands in for srun: the command, without the options.
SRUN = """
import os, sys
words = sys.argv[1:]
while words[0].startswith("-"):
    words.pop(0)
os.execvp(words[0], words)
"""
SINFO = "print('PARTITION\\nhere*')"
#: Otherwise squeue would not be asked for the state of jobs, but sacct.
CONFIGURATION = "print('MinJobAge = 300 sec')"
ACCOUNT = "print('nobody')"


def programs(folder: Path) -> Path:
    """Write the programs into a folder, and return it."""
    home, place = folder / "jobs", folder / "programs"
    home.mkdir()
    place.mkdir()
    texts = {"sbatch": SBATCH, "squeue": SQUEUE, "srun": SRUN}
    texts |= {
        "sinfo": SINFO,
        "sacct": ACCOUNT,
        "sacctmgr": ACCOUNT,
        "scontrol": CONFIGURATION,
        "scancel": "",
    }
    for name, text in texts.items():
        program = place / name
        program.write_text(f"#!{sys.executable}\n{text.format(home=str(home))}")
        program.chmod(0o755)
    return place


@pytest.mark.skipif(sys.platform == "win32", reason="needs sh")
def test_jobs_are_submitted_with_the_resources_of_their_steps(tmp_path: Path) -> None:
    study = make_study(tmp_path / "home", 3, FURTHER)
    assert run(study, tmp_path / "run") == 0
    rockframe("run", study, "--output", tmp_path / "flow", "--plan")
    words = ["--max-threads", "2", "--slurm-status-command", "squeue"]
    words += ["--slurm-init-seconds-before-status-checks", "1"]
    words += ["--seconds-between-status-checks", "1"]
    ended = snakemake(tmp_path / "flow", *words, profile="slurm", programs=programs(tmp_path))
    assert ended.returncode == 0, ended.stderr
    assert results(tmp_path / "flow") == results(tmp_path / "run")
    jobs = [json.loads(job.read_text()) for job in (tmp_path / "jobs").glob("*.json")]
    plan = json.loads((tmp_path / "flow" / ".rockframe" / "plan.json").read_text())
    assert len(jobs) == len(plan["steps"])
    assert {job["comment"].partition("_wildcards")[0] for job in jobs} == {
        f"rule_{step['stage'] if step['batch'][1] > 1 else step['name'].replace('-', '_')}"
        for step in plan["steps"]
    }
    for job in jobs:
        (step,) = [
            step
            for step in plan["steps"]
            if job["comment"].removeprefix("rule_").replace("_wildcards_", "-").replace("_", "-")
            == step["name"]
        ]
        assert job["others"] == []
        assert int(job["mem"]) == step["memory"]
        assert int(job["t"]) == step["minutes"]
        assert int(job["cpus_per_task"]) == min(2, step["threads"])
