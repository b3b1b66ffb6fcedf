"""Figures compared with reviewed images, on the platform on which the images were drawn.

Fonts and rasterisers differ on other platforms; there, test_figures.py checks the curves. After an
intended change, draw the images again with ROCKFRAME_PICTURES=draw and review each of them.
"""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from matplotlib.image import imread

from rockframe.cli.figure import FIGURES
from rockframe.cli.main import main
from rockframe.wavelets.pulse import Pulse

PICTURES: Final = Path(__file__).parent / "pictures"
#: Largest root mean square difference of all pixels and colours, on a scale to 255.
TOLERANCE: Final = 1.0
HERE: Final = f"{platform.system()} {platform.machine()}, matplotlib {version('matplotlib')}\n"
DRAW: Final = os.environ.get("ROCKFRAME_PICTURES") == "draw"


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of one record, a pulse, which no update of an archive can change."""
    home = tmp_path_factory.mktemp("records")
    pulse = Pulse(wavelet="antisymmetric_ricker", a_p=0.45, T_p=1.0, time=3.0)
    samples = pulse.acceleration(0.01 * np.arange(801))
    np.savetxt(home / "motion.csv", samples, fmt="%.8f")
    words = ["--units", "g", "--time-step", "0.01", "--workers", "0"]
    assert main(["ingest", str(home / "motion.csv"), *words, "--output", f"{home}/records.nc"]) == 0
    return home / "records.nc"


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_looks_as_it_did(name: str, records: Path, tmp_path: Path) -> None:
    if not DRAW and (PICTURES / "drawn-by.txt").read_text(encoding="utf-8") != HERE:
        pytest.skip("the pictures were drawn on another platform")
    known = PICTURES / f"figure-{name}.png"
    drawn = tmp_path / "figure.png"
    words = ["--records", str(records), "--output", str(drawn), "--grid", "80"]
    assert main(["figure", name, *words]) == 0
    if DRAW:
        known.write_bytes(drawn.read_bytes())
        (PICTURES / "drawn-by.txt").write_text(HERE, encoding="utf-8")
    wanted, found = (np.asarray(imread(path), dtype=np.float64) for path in (known, drawn))
    assert found.shape == wanted.shape
    assert 255.0 * np.sqrt(np.mean((found - wanted) ** 2)) <= TOLERANCE
