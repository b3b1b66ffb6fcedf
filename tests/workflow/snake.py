"""Helpers that call Snakemake as `make study` does."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.conftest import REPOSITORY

SNAKEMAKE = REPOSITORY / ".venv-workflow" / "bin" / "snakemake"
WORKFLOW = REPOSITORY / "workflows"
#: Marks of the test modules that call Snakemake.
MARKS = [
    pytest.mark.workflow,
    pytest.mark.skipif(not SNAKEMAKE.is_file(), reason="no Snakemake: make test-workflow"),
]


def rockframe(*words: object) -> None:
    """Run a command of the package, which must succeed."""
    subprocess.run(
        [sys.executable, "-m", "rockframe.cli.main", *map(str, words)],
        check=True,
        capture_output=True,
    )


def started(folder: Path, *words: str, profile: str = "default") -> subprocess.Popen[str]:
    """Start the workflow in a folder that has a plan, in a process group of its own."""
    profiles = WORKFLOW / "profiles" / profile
    beside = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    called: list[str | Path] = [SNAKEMAKE, "-s", WORKFLOW / "Snakefile", "--directory", folder]
    return subprocess.Popen(
        [*called, "--workflow-profile", profiles, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PATH": beside},
    )


def snakemake(
    folder: Path, *words: str, profile: str = "default"
) -> subprocess.CompletedProcess[str]:
    """Run the workflow in a folder that has a plan."""
    process = started(folder, *words, profile=profile)
    said, errors = process.communicate()
    return subprocess.CompletedProcess(process.args, process.returncode, said, errors)


def jobs_done(ended: subprocess.CompletedProcess[str]) -> set[str]:
    """Return the rules whose jobs were executed."""
    lines = (line.strip().split() for line in ended.stderr.splitlines())
    return {w[1].rstrip(":") for w in lines if len(w) == 2 and w[0] in {"localrule", "rule"}}
