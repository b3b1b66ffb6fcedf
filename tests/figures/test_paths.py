"""The path of the deck in plan, as a figure and in the page."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr
from numpy.testing import assert_allclose

from rockframe.figures.paths import draw_paths
from rockframe.web import path_svg

TURN = np.linspace(0.0, 2.0 * np.pi, 50)


def history(name: str, size: float) -> xr.Dataset:
    """Return an ellipse after rest, and then overturning."""
    x, y = (np.r_[0.0, size * part, 9.0, np.nan] for part in (np.cos(TURN), 0.5 * np.sin(TURN)))
    theta = np.r_[0.0, 0.1 + 0.0 * TURN, 1.0, np.nan]
    values = {"u_x": ("time", x), "u_y": ("time", y), "theta": ("time", theta)}
    return xr.Dataset({**values, "slenderness": 0.2}, {"structure": name})


def test_paths_are_drawn_in_centimetres_on_equal_axes() -> None:
    drawn = draw_paths([history("bent", 0.4), history("column", 0.1)], "CCC/both")
    panels = drawn.figure.axes
    assert [panel.get_title(loc="left") for panel in panels] == ["bent", "column"]
    for panel, size in zip(panels, (40.0, 10.0), strict=True):
        path, rest, furthest = panel.lines
        x, y = (np.asarray(part) for part in path.get_data())
        assert_allclose(x[1:-2], size * np.cos(TURN))
        assert_allclose(y[1:-2], 0.5 * size * np.sin(TURN))
        assert np.isnan(x[-2:]).all()  # it falls
        assert [float(part[0]) for part in map(np.asarray, rest.get_data())] == [0.0, 0.0]
        assert_allclose(np.hypot(*furthest.get_data()), size)
        assert panel.get_aspect() == 1.0
        assert panel.get_xlim() == panel.get_ylim()
    assert "CCC/both" in drawn.title


def test_the_path_of_the_page_ends_before_the_fall_and_north_is_up() -> None:
    path = history("bent", 0.4)
    standing = path["theta"].values < 0.5
    drawn = path_svg(*(np.where(standing, path[name].values, np.nan) for name in ("u_x", "u_y")))
    assert "nan" not in drawn
    assert "a radius of 40.0 cm" in drawn
    (points,) = re.findall(r'points="(.*?)"', drawn)
    x, y = np.array([point.split(",") for point in points.split()], dtype=float).T
    assert_allclose(x, 100.0 * np.cos(TURN), atol=0.06)
    assert_allclose(y, -50.0 * np.sin(TURN), atol=0.06)  # in pictures y points downwards


def test_a_deck_that_does_not_move_has_no_path() -> None:
    assert path_svg(np.zeros(9), np.zeros(9)) == ""
