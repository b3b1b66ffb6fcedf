"""The workflow on a real Slurm cluster of one node, enabled with ROCKFRAME_SLURM=1.

Debian: apt-get install --no-install-recommends slurm-wlm munge
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.runs.small import contents, make_study, run
from tests.workflow.slurm import is_installed, one_node
from tests.workflow.snake import MARKS, rockframe, snakemake
from tests.workflow.test_workflow import results

#: Options for a node of two cores without job accounting, with frequent status checks.
WORDS = (
    *("--max-threads", "2", "--slurm-status-command", "squeue"),
    *("--slurm-init-seconds-before-status-checks", "5", "--seconds-between-status-checks", "5"),
)
pytestmark = [
    *MARKS,
    pytest.mark.skipif("ROCKFRAME_SLURM" not in os.environ, reason="set ROCKFRAME_SLURM=1"),
    pytest.mark.skipif(not is_installed(), reason="needs root, slurm-wlm and munge"),
]


def test_jobs_of_slurm_give_the_bytes_of_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = make_study(tmp_path / "home", 3)
    assert run(study, tmp_path / "run") == 0
    rockframe("run", study, "--output", tmp_path / "flow", "--plan")
    with one_node(tmp_path / "slurm") as env:
        for name, value in env.items():
            monkeypatch.setenv(name, value)
        ended = snakemake(tmp_path / "flow", *WORDS, profile="slurm")
    assert ended.returncode == 0, ended.stderr
    assert "has been submitted with SLURM jobid" in ended.stderr
    assert results(tmp_path / "flow") == results(tmp_path / "run")
    assert contents(tmp_path / "run")
