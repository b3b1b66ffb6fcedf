"""A command imports what it uses, and no more: each import delays every start of the command."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from tests.runs.small import FEW, make_study, run

#: Packages that only other commands need; each takes as long to import as these commands run.
OTHERS = {"numba", "scipy.signal", "matplotlib", "obspy"}
#: Packages of datasets, which take a third of the time of these commands to import.
DATASETS = {"xarray", "pandas"}
SCRIPT = """
import json, sys
from rockframe.cli.main import main
for words in json.loads(sys.argv[1]):
    status = main(words)
    print("imported", *sys.modules)
    if status:
        sys.exit(status)
"""


def imported(*commands: Sequence[object]) -> list[tuple[set[str], list[str]]]:
    """Return all modules, and the package's, that are loaded after each command of a process."""
    given = json.dumps([[str(word) for word in words] for words in commands])
    command = [sys.executable, "-c", SCRIPT, given]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = [set(x.split()) for x in done.stdout.splitlines() if x.startswith("imported ")]
    return [
        (modules, sorted(m for m in modules if m.split(".")[0] == "rockframe"))
        for modules in loaded
    ]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loading")
    assert run(make_study(folder, 1, FEW), folder / "run") == 0
    return folder


def test_ingest_imports_no_computation_and_no_package_of_filters(home: Path) -> None:
    """The package's own loop filters a file that is uncorrected."""
    samples = np.random.default_rng(1).normal(0.0, 0.1, 2000)
    np.savetxt(home / "raw.csv", samples * np.hanning(2000))
    options = ("--units", "g", "--time-step-s", "0.01", "--output", home / "records.nc")
    (modules, own), (filtering, _) = imported(
        ("ingest", home / "motions", *options),
        ("ingest", home / "raw.csv", "--uncorrected", *options),
    )
    assert not modules & (OTHERS | DATASETS)
    assert not [name for name in own if name.split(".")[1:2] in (["rocking"], ["matching"])]
    assert len(own) <= 93
    assert filtering & OTHERS == {"numba"}


def test_responding_imports_numba_and_no_package_of_statistics(home: Path) -> None:
    """Numba would import `scipy.linalg`, and SciPy's quantiles `scipy.special`: 0.15 s. Figures
    alone need PyWavelets.
    """
    words = ("respond", home / "run" / "records.nc", "--margins", "none", "--output")
    ((modules, _),) = imported((*words, home / "response.nc"))
    assert modules & OTHERS == {"numba"}
    assert not modules & DATASETS
    assert not modules & {
        "rockframe.matching.match",
        "pywt",
        "scipy.linalg",
        "scipy.special",
        "scipy.stats",
        "scipy.interpolate",
    }


def test_showing_a_record_and_the_page_import_no_dataset_and_no_kernel(home: Path) -> None:
    """They read variables and show them."""
    showing, reporting = imported(("show", home / "run", "motion-0"), ("report", home / "run"))
    assert not showing[0] & (OTHERS | DATASETS)
    assert not reporting[0] & (OTHERS | DATASETS)


def test_a_run_with_nothing_to_do_imports_no_stage_and_verifying_it_draws_nothing(
    home: Path,
) -> None:
    again = ("run", home / "small.toml", "--output", home / "run")
    (modules, own), (verifying, _) = imported(again, ("verify", home / "run"))
    others = {"xarray", "scipy", "rockframe.stages", "rockframe.engines"}
    assert not modules & (OTHERS | others)
    assert len(own) <= 64
    assert not verifying & (OTHERS | DATASETS)
