"""Checks of the test suite itself; part of ``make check``."""

from __future__ import annotations

import subprocess
import sys
import time

from tests.conftest import REPOSITORY


def collected() -> subprocess.Popen[str]:
    """Start a process that lists the names of all tests."""
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    return subprocess.Popen(words, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)


def test_two_processes_collect_the_same_tests() -> None:
    """Names must not depend on time or string hashes: pytest-xdist needs equal names everywhere."""
    first = collected()
    time.sleep(2.0)
    one, other = [process.communicate()[0] for process in (first, collected())]
    names = [line for line in one.splitlines() if "::" in line]
    assert len(names) == len(set(names)) > 1000
    assert names == [line for line in other.splitlines() if "::" in line]


def test_shared_files_are_named_one_by_one() -> None:
    """A test that reads every file of a shared folder breaks when a file is added."""
    for path in sorted((REPOSITORY / "tests").rglob("*.py")):
        for line in path.read_text(encoding="utf-8").splitlines():
            taken = any(f".{way}(" in line for way in ("iterdir", "glob", "rglob"))
            assert not (taken and ("shared_" + "records" in line or "peer_" + "records" in line)), (
                f"{path}: {line.strip()}"
            )
