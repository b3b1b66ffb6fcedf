"""A command imports what it uses, and no more: each import delays every start of the command."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.runs.small import FEW, make_study, run

#: Packages that only other commands need; each takes as long to import as these commands run.
OTHERS = {"numba", "scipy.signal", "matplotlib", "obspy"}
SCRIPT = """
import sys
from rockframe.cli.main import main
status = main(sys.argv[1:])
print("imported", *sys.modules)
sys.exit(status)
"""


def imported(*words: object) -> tuple[set[str], list[str]]:
    """Return all modules that a command imports in a process of its own, and the package's."""
    command = [sys.executable, "-c", SCRIPT, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    modules = set(done.stdout.splitlines()[-1].split())
    return modules, sorted(name for name in modules if name.split(".")[0] == "rockframe")


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loading")
    assert run(make_study(folder, 1, FEW), folder / "run") == 0
    return folder


def test_ingest_imports_no_computation(home: Path) -> None:
    words = ("--units", "g", "--time-step-s", "0.01", "--output", home / "records.nc")
    modules, own = imported("ingest", home / "motions", *words)
    assert not modules & OTHERS
    assert not [name for name in own if name.split(".")[1:2] in (["rocking"], ["matching"])]
    assert len(own) <= 85


def test_a_filter_needs_no_package_of_filters(bundled_records: Path, tmp_path: Path) -> None:
    """This file is uncorrected: the package's own loop filters it."""
    record = bundled_records / "Ridgecrest2019-CCC.V1"
    modules, _ = imported("ingest", record, "--output", tmp_path / "records.nc")
    assert modules & OTHERS == {"numba"}


def test_verifying_a_run_computes_and_draws_nothing_and_makes_no_dataset(home: Path) -> None:
    modules, _ = imported("verify", home / "run")
    assert not modules & (OTHERS | {"xarray", "pandas"})


def test_a_run_with_nothing_to_do_imports_no_stage(home: Path) -> None:
    modules, own = imported("run", home / "small.toml", "--output", home / "run")
    others = {"xarray", "scipy", "rockframe.stages", "rockframe.engines"}
    assert not modules & (OTHERS | others)
    assert len(own) <= 48
