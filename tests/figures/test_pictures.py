"""Figures compared with reviewed pictures (`tests/pictures.py` explains how to draw them again).

On platforms other than that of the pictures, test_figures.py checks the curves.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from tests.pictures import TOLERANCE, comparable, difference, for_page, pixels_of

from rockframe.cli.main import main
from rockframe.figures.captioned import LINES, save, styled
from rockframe.stages.named_figures import FIGURES
from rockframe.wavelets.pulse import Pulse

PICTURES: Final = Path(__file__).parent / "pictures"


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
    if not comparable():
        pytest.skip("the pictures were drawn on another platform")
    drawn = tmp_path / "figure.png"
    grid = "32" if name == "9" else "80"  # figure 9 has four maps, with five curves each
    given = {"records": ["--records", str(records)], "grid": ["--grid", grid]}
    words = [word for option in given if FIGURES[name].takes(option) for word in given[option]]
    assert main(["figure", name, "--output", str(drawn), *words]) == 0
    assert difference(PICTURES / f"figure-{name}.png", drawn) <= TOLERANCE


def test_a_picture_for_a_page_has_the_colours_of_all_lines(tmp_path: Path) -> None:
    time = np.linspace(0.0, 10.0, 2000)
    with styled():
        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        axes = figure.subplots()
        for k in range(10):
            wave, line = np.sin((1.0 + 0.1 * k) * time), LINES[k % len(LINES)]
            axes.plot(time, wave, linewidth=0.8, label=str(k), color=f"C{k}", linestyle=line)
            axes.fill_between(time, -0.1 * k, 0.1 * k, color=f"C{k}", alpha=0.05, linewidth=0.0)
        axes.legend()
        drawn = {to_rgb(line.get_color()) for line in axes.get_lines()}
    save(figure, tmp_path / "figure.png")
    page = for_page(tmp_path / "figure.png", tmp_path / "page.png")
    shown = np.unique(pixels_of(page)[..., :3].reshape(-1, 3), axis=0)
    nearest = {
        tuple(shown[np.abs(shown - 255.0 * np.array(colour)).max(axis=1).argmin()])
        for colour in drawn
    }
    assert len(nearest) == len(drawn) >= 5
