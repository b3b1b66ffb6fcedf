"""What holds for the suite as a whole."""

from __future__ import annotations

import subprocess
import sys

import pytest
from tests.conftest import REPOSITORY


def test_another_process_collects_the_same_tests(request: pytest.FixtureRequest) -> None:
    """At another time and with other hashes: workers that differ in one name refuse to run."""
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    told = subprocess.run(
        [*words, *request.config.args],
        cwd=request.config.invocation_params.dir,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    here = [item.nodeid for item in request.session.items]
    assert len(here) == len(set(here))
    assert set(here) <= set(told.splitlines())


def test_shared_files_are_named_one_by_one() -> None:
    """A test that takes whatever lies there breaks when a file is added."""
    for path in sorted((REPOSITORY / "tests").rglob("*.py")):
        for line in path.read_text(encoding="utf-8").splitlines():
            taken = any(f".{way}(" in line for way in ("iterdir", "glob", "rglob"))
            assert not (taken and ("shared_" + "records" in line or "peer_" + "records" in line)), (
                f"{path}: {line.strip()}"
            )
