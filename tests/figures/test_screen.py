"""Figures of a screening: curves match formulas, captions state how much was screened."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
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
    selected = screening.sel(structure="slender")
    panel = axes_of(draw_fragility(selected))[0]
    assert panel.get_xlabel() == "PGA  [g]"
    fit = selected.sel(measure="pga", limit_state="overturning")
    assert int(fit["fragility_outcome"]) == 0
    (curve,) = (line for line in panel.get_lines() if line.get_linestyle() == "-")
    x, y = (np.asarray(values, dtype=np.float64) for values in curve.get_data())
    median = float(fit["fragility_median"]) / GRAVITY
    assert_allclose(y, norm.cdf(np.log(x / median) / float(fit["fragility_lognormal_beta"])))
    caption = draw_fragility(selected).caption
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
    (told, *_) = [axes.get_title("left") for axes in axes_of(draw_fragility(stands))]
    assert told == "no curve: none overturn"


def test_distribution_ends_at_the_share_that_stands(screening: xr.Dataset) -> None:
    selected = screening.sel(structure="slender")
    drawn = draw_peak_distribution(selected)
    (axes,) = axes_of(drawn)
    share = np.asarray(axes.get_lines()[0].get_ydata(), dtype=np.float64)
    at = int(np.argmin(np.abs(np.log(screening["scale"].values))))
    verdict = selected["verdict"].isel(scale=at).values
    ratio = selected["peak_rotation_ratio"].isel(scale=at).values
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


@pytest.fixture(scope="module")
def states(screening: xr.Dataset) -> xr.Dataset:
    """The slender structure with limit states that equal, and that precede, overturning."""
    selected = screening.sel(structure="slender")
    weaker = selected.assign_coords(limit_state=["peak_u_0.1m"])
    for name in ("fragility_median", "fragility_intensity"):
        weaker[name] = selected[name] if name.endswith("intensity") else 0.5 * selected[name]
    weaker["fragility"] = 0.5 + 0.5 * selected["fragility"].assign_coords(
        limit_state=["peak_u_0.1m"]
    )
    same = selected.assign_coords(limit_state=["peak_u_0.2m"])
    return xr.concat([selected, weaker, same], dim="limit_state", data_vars="minimal")


def curves_of(axes: Axes) -> dict[object, list[float]]:
    return {
        line.get_linestyle(): np.asarray(line.get_ydata(), dtype=np.float64).tolist()
        for line in axes.get_lines()
        if line.get_linestyle() in ("-", "--")
    }


def test_each_limit_state_has_its_panels_and_overturning_is_in_all(states: xr.Dataset) -> None:
    """Two measures are known, so that each limit state has a row of two panels."""
    first, _, other, _ = axes_of(draw_fragility(states))
    fits = states.sel(measure="pga")["fragility"].values
    assert curves_of(first) == {"-": fits[0].tolist()}
    assert curves_of(other) == {"-": fits[1].tolist(), "--": fits[0].tolist()}


def test_limit_states_with_the_same_curves_share_a_row_that_says_so(states: xr.Dataset) -> None:
    drawn = draw_fragility(states)
    titles = [part.get_suptitle() for part in drawn.figure.subfigs]
    assert titles == ["overturning; u ≥ 0.2 m has the same curves", "u ≥ 0.1 m"]
    assert "Overturning; u ≥ 0.2 m has the same curves." in drawn.caption


def test_panels_name_the_median_in_the_unit_of_the_axis(screening: xr.Dataset) -> None:
    selected = screening.sel(structure="slender")
    panel = axes_of(draw_fragility(selected))[0]
    fit = selected.sel(measure="pga", limit_state="overturning")
    assert panel.get_title("left") == f"median {float(fit['fragility_median']) / GRAVITY:.3g} g"


def texts_of(figure: Figure) -> Iterator[Text]:
    """Yield the texts that are drawn; axes also have labels of ticks beyond their limits."""
    hidden: set[Text] = set()
    for axes in figure.axes:
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            beyond = [tick for tick in ticks if not low <= tick.get_loc() <= high]
            hidden |= {label for tick in beyond for label in (tick.label1, tick.label2)}
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_visible() and text.get_text() and text not in hidden:
            yield text


@pytest.mark.parametrize(("limits", "measures"), [(2, 2), (3, 7)])
def test_texts_of_a_fragility_do_not_overlap(
    states: xr.Dataset, limits: int, measures: int
) -> None:
    """Seven measures have two rows of panels for each limit state, over three decades."""
    selected = states.isel(limit_state=[0])
    selected["fragility_intensity"] = selected["fragility_intensity"] ** 2.5
    more = [selected.assign_coords(limit_state=[f"u_{k}m"]) for k in range(1, limits)]
    for k, other in enumerate(more):
        other["fragility"] = other["fragility"] * 0.9 ** (1 + k)
    several = xr.concat([selected, *more], dim="limit_state", data_vars="minimal")
    wide = xr.concat(
        [several.sel(measure=["pga"]).assign_coords(measure=[f"sa_{k}s"]) for k in range(measures)],
        dim="measure",
        data_vars="minimal",
    )
    figure = draw_fragility(wide).figure
    figure.draw_without_rendering()
    texts = list(texts_of(figure))
    boxes = [text.get_window_extent() for text in texts]
    assert len(boxes) > 5 * limits * measures
    for k, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1
        apart = box.expanded(1.2, 1.0)  # a gap between the numbers of an axis
        crossed = [texts[m].get_text() for m in range(k) if apart.overlaps(boxes[m])]
        assert not crossed, texts[k].get_text()
