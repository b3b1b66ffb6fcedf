"""Runs for the tests of the report: one with hostile names, and one of the bundled records."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.conftest import coarse, shared_folder

from rockframe.cli.main import main
from rockframe.wavelets.pulse import Pulse

EVENT = "</script><script>alert(1)</script>"
STATION = "<script>"
FILE = "<b onclick='alert(2)'>&amp;\".csv"
REJECTED = "<img src=x onerror=alert(3)>.csv"


@pytest.fixture(scope="session")
def hostile_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose names are HTML and script; one file is rejected, and of its structures one
    stands, one overturns and one never uplifts."""
    home = shared_folder(tmp_path_factory, "hostile", make_hostile_run)
    return Path(shutil.copytree(home / "run", tmp_path_factory.mktemp("hostile") / "run"))


def make_hostile_run(home: Path) -> None:
    """Make the files of `hostile_run` in a folder."""
    records = home / "records"
    records.mkdir()
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5, T_p=1.0, time=3.0)
    np.savetxt(records / FILE, pulse.acceleration(0.01 * np.arange(801)), fmt="%.8f")
    (records / REJECTED).write_text("no number\n")
    quoted = FILE.replace('"', '""')
    (records / "catalogue.csv").write_text(
        "file,event,station,network,magnitude,epicentral_distance_km,source\n"
        f'"{quoted}","{EVENT}","{STATION}",,6.0,10.0,mine\n'
    )
    structures = home / "structures.toml"
    structures.write_text(
        '[[structure]]\nname = "bent"\nheight_m = 9.6\nwidth_m = 1.6\nmass_ratio = 4.0\n'
        '[[structure]]\nname = "thin"\nheight_m = 3.0\nwidth_m = 0.4\n'
        '[[structure]]\nname = "squat"\nheight_m = 3.0\nwidth_m = 2.0\n'
    )
    words = ["--records", str(records), "--structures", str(structures), "--units", "g"]
    words += ["--time-step", "0.01", "--output", str(home / "run")]
    with coarse():
        assert main(["table1", *words]) == 1  # done, and one file rejected


@pytest.fixture(scope="session")
def bundled_run(table1: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of the bundled records on the shipped structures, with its report."""
    folder = tmp_path_factory.mktemp("bundled") / "table1"
    shutil.copytree(table1, folder)
    assert main(["report", str(folder)]) == 0
    return folder
