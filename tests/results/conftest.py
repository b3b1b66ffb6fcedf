"""Files of every kind, which several test files damage in copies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from tests.commands import STRUCTURE, run
from tests.conftest import coarse, shared_folder

from rockframe.wavelets.pulse import Pulse

_TENDON: Final = """
column_mass_kg = 2.0e4
[structure.tendon]
area_m2 = 1.0e-4
modulus_pa = 2.0e11
[structure.abutment]
gap_m = 0.05
uplift_allowance_m = 0.01
"""
_ISOLATED: Final = """
[compare.isolated]
period_s = 3.0
strength_ratio = 0.05
"""


@pytest.fixture(scope="module", autouse=True)
def coarse_figures() -> Iterator[None]:
    """Draw the figures of all tests here coarsely."""
    with coarse():
        yield


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one file of each kind, with all optional variables, and with a run."""
    return shared_folder(tmp_path_factory, "made", make_files)


def make_files(home: Path) -> None:
    """Make the files of `made` in a folder."""
    for name, seconds in (("one", 0.8), ("two", 1.2)):
        pulse = Pulse(wavelet="symmetric_ricker", a_p=0.4, T_p=seconds, time=2.0)
        np.savetxt(home / f"{name}.csv", pulse.acceleration(0.01 * np.arange(401)), fmt="%.8f")
    (home / "structures.toml").write_text(STRUCTURE + _TENDON + _ISOLATED)
    (home / "hazard.csv").write_text("pga_g,annual_rate\n0.05,0.05\n0.8,0.0002\n")
    units, structures = (
        ("--units", "g", "--time-step", "0.01"),
        ("--structures", home / "structures.toml"),
    )
    records, pulses = home / "records.nc", ("--pulses", home / "pulses.nc")
    run("ingest", home / "one.csv", home / "two.csv", *units, "--output", records)
    few = ("--ensemble-members", "16")
    run("pulse", records, "--surrogates", "19", "--output", home / "pulses.nc")
    run("respond", records, *pulses, *structures, *few, "--output", home / "response.nc")
    design = ("--design-dimension", "height", "--design-range", "2", "4", "--design-steps", "2")
    members = ("--scenario-members", "2", "--histories", "all")
    wanted = ("--scales", "1", "2", "--hazard", home / "hazard.csv", *design, *members)
    run("screen", records, *pulses, *structures, *wanted, "--output", home / "screen.nc")
    run("compare", records, *structures, "--output", home / "compare.nc")
    frame = ("--slenderness-deg", "14", "--mass-ratio", "0")
    pulse_of = ("--wavelet", "symmetric_ricker", "--frequency-ratio", "3", "--max-amplitude", "4")
    run("spectrum", *pulse_of, *frame, "--output", home / "spectrum.nc")
    period = ("--column-period", "5")
    run("spectrum", "--records", records, *frame, *period, "--output", home / "rocking_spectrum.nc")
    plain = ("--margins", "none", "--surrogates", "0", "--output", home / "run")
    with coarse():
        run("table1", "--records", home / "one.csv", *units, *structures, *few, *plain)
