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


def started(
    folder: Path, *words: str, profile: str = "default", programs: Path | None = None
) -> subprocess.Popen[str]:
    """Start the workflow in a folder that has a plan, in a process group of its own.

    `programs` is a folder of programs that take precedence over those of this environment.
    """
    profiles = WORKFLOW / "profiles" / profile
    places = [*([programs] if programs else []), Path(sys.executable).parent, os.environ["PATH"]]
    beside = os.pathsep.join(map(str, places))
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
    folder: Path, *words: str, profile: str = "default", programs: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the workflow in a folder that has a plan."""
    process = started(folder, *words, profile=profile, programs=programs)
    said, errors = process.communicate()
    return subprocess.CompletedProcess(process.args, process.returncode, said, errors)


def recorder(folder: Path) -> Path:
    """Make a program `rockframe` that records its words in `words`, then runs the package.

    It is in a folder of its own, which is returned.
    """
    programs = folder / "programs"
    programs.mkdir()
    wrapper = programs / "rockframe"
    wrapper.write_text(
        f'#!/bin/sh\necho "$*" >> "{folder / "words"}"\n'
        f'exec "{sys.executable}" -m rockframe.cli.main "$@"\n'
    )
    wrapper.chmod(0o755)
    return programs


def jobs_done(ended: subprocess.CompletedProcess[str]) -> set[str]:
    """Return the rules whose jobs were executed."""
    lines = (line.strip().split() for line in ended.stderr.splitlines())
    return {w[1].rstrip(":") for w in lines if len(w) == 2 and w[0] in {"localrule", "rule"}}
