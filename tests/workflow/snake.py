"""Snakemake as `make study` calls it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.conftest import REPOSITORY

SNAKEMAKE = REPOSITORY / ".venv-workflow" / "bin" / "snakemake"
WORKFLOW = REPOSITORY / "workflows"
#: For modules that call it.
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


def snakemake(
    folder: Path, *words: str, profile: str = "default"
) -> subprocess.CompletedProcess[str]:
    """Run the workflow in a folder that has a plan."""
    profiles = WORKFLOW / "profiles" / profile
    beside = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    called: list[str | Path] = [SNAKEMAKE, "-s", WORKFLOW / "Snakefile", "--directory", folder]
    return subprocess.run(
        [*called, "--workflow-profile", profiles, *words],
        check=False,
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": beside},
    )


def jobs_done(ended: subprocess.CompletedProcess[str]) -> set[str]:
    """Rules of which jobs were executed."""
    lines = (line.strip().split() for line in ended.stderr.splitlines())
    return {w[1].rstrip(":") for w in lines if len(w) == 2 and w[0] in {"localrule", "rule"}}
