"""Figures of a screening: curves match formulas, captions state how much was screened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from numpy.testing import assert_allclose
from scipy.stats import norm
from tests.screening import sine, stored, structures

from rockframe.figures.captioned import Captioned, save_captioned
from rockframe.figures.fragility import draw_fragility, draw_peak_distribution
from rockframe.options.respond import ScreenOptions
from rockframe.results.screen import read_screening
from rockframe.stages.screen import screen_stage
from rockframe.units import GRAVITY


@pytest.fixture(scope="module")
def screening(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """A screening of twelve motions that do not overturn in the order of their peaks."""
    folder = tmp_path_factory.mktemp("screened")
    longer = np.random.default_rng(2).uniform(0.5, 2.0, 12)
    time = 0.01 * np.arange(600)
    records = [
        sine(f"s{n:02d}", 0.0, acceleration=(1.0 + 0.4 * n) * np.sin(2.0 * np.pi * time / long))
        for n, long in enumerate(longer)
    ]
    screen_stage(
        stored(records, folder),
        folder / "screen.nc",
        structures_path=structures(folder),
        options=ScreenOptions(scales=np.geomspace(0.5, 3.0, 8), margins="none"),
    )
    return read_screening(folder / "screen.nc")


def axes_of(drawn: Captioned) -> list[Axes]:
    return [axes for axes in drawn.figure.axes if axes.get_visible()]


def test_curve_is_the_lognormal_one_of_the_caption(screening: xr.Dataset) -> None:
    one = screening.sel(structure="slender")
    panel = axes_of(draw_fragility(one))[0]
    assert panel.get_xlabel() == "PGA  [g]"
    fit = one.sel(measure="pga", limit_state="overturning")
    assert int(fit["fragility_outcome"]) == 0
    (curve,) = (line for line in panel.get_lines() if line.get_linestyle() == "-")
    x, y = (np.asarray(values, dtype=np.float64) for values in curve.get_data())
    median = float(fit["fragility_median"]) / GRAVITY
    assert_allclose(y, norm.cdf(np.log(x / median) / float(fit["fragility_lognormal_beta"])))
    caption = draw_fragility(one).caption
    assert "lognormal in the intensity" in caption
    assert "logistic" not in caption


def test_curves_of_older_files_are_logistic(screening: xr.Dataset) -> None:
    """Files without the form of the curves are of versions that knew only logistic ones."""
    older = screening.sel(structure="slender").drop_vars("fragility_curve")
    caption = draw_fragility(older).caption
    assert "logistic in the intensity" in caption
    assert "(logistic scale " in caption


def test_dots_are_shares_of_all_observations(screening: xr.Dataset) -> None:
    panel = axes_of(draw_fragility(screening.sel(structure="slender")))[0]
    (dots,) = (line for line in panel.get_lines() if line.get_marker() == "o")
    share = np.asarray(dots.get_ydata(), dtype=np.float64)
    overturned = (screening["verdict"].sel(structure="slender") == 2).values.mean()
    assert_allclose(share.mean(), overturned, rtol=1e-12)


def test_measures_that_are_not_known_have_no_panel(screening: xr.Dataset) -> None:
    drawn = draw_fragility(screening.sel(structure="slender"))
    assert [axes.get_xlabel() for axes in axes_of(drawn)] == ["PGA  [g]", "PGV  [m/s]"]
    assert "12 motions of 12 recordings at 8 scales from 0.5 to 3" in drawn.caption


def test_without_a_curve_the_panel_says_so(screening: xr.Dataset) -> None:
    stands = screening.sel(structure="stout").copy(deep=True)
    outcome = stands["fragility_outcome"].values
    stands["fragility_outcome"][:] = np.where(outcome == 5, 5, 1)  # 5: unknown, 1: none overturn
    (told, *_) = [axes.texts[0].get_text() for axes in axes_of(draw_fragility(stands))]
    assert told == "no curve: none overturn"


def test_distribution_ends_at_the_share_that_stands(screening: xr.Dataset) -> None:
    one = screening.sel(structure="slender")
    drawn = draw_peak_distribution(one)
    (axes,) = axes_of(drawn)
    share = np.asarray(axes.get_lines()[0].get_ydata(), dtype=np.float64)
    at = int(np.argmin(np.abs(np.log(screening["scale"].values))))
    verdict = one["verdict"].isel(scale=at).values
    ratio = one["peak_rotation_ratio"].isel(scale=at).values
    assert_allclose(share[-1], ((verdict != 2) & (ratio <= 1.5)).mean())
    assert "12 motions of 12 recordings" in drawn.caption


@pytest.mark.parametrize("draw", [draw_fragility, draw_peak_distribution])
def test_the_same_screening_gives_the_same_picture(
    screening: xr.Dataset, tmp_path: Path, draw: object
) -> None:
    assert callable(draw)
    for name in ("one.png", "other.png"):
        save_captioned(draw(screening.sel(structure="slender")), tmp_path / name)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "other.png").read_bytes()


def test_equal_curves_of_two_limit_states_are_both_visible(screening: xr.Dataset) -> None:
    one = screening.sel(structure="slender")
    other = one.assign_coords(limit_state=["u_0.2m"])
    both = xr.concat([one, other], dim="limit_state", data_vars="minimal")
    lines = axes_of(draw_fragility(both))[0].get_lines()
    assert {line.get_linestyle() for line in lines if line.get_marker() != "o"} == {"-", "--"}
