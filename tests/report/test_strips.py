"""Strips over the multiples of a motion: what was not computed is drawn as not computed."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch

from rockframe.cli.main import main
from rockframe.figures.margins import draw_margin_strips
from rockframe.results.schema.response import ISLANDS
from rockframe.rocking import Strip
from rockframe.rocking.verdict import strip_of
from rockframe.web import STRIP_ENDS, strip_svg

scales = st.floats(0.05, 20.0)
robust_scales = st.lists(scales, min_size=0, max_size=3).map(
    lambda reached: (*sorted(reached), *[math.nan] * (3 - len(reached)))
)
strips = st.builds(Strip, st.just(()), st.floats(1.0, 10.0), st.just(()) | robust_scales)


def bars(strip: Strip) -> list[tuple[str, float, float]]:
    """Return class, start and end of each part of the upper bar, as a parser of XML reads them."""
    svg = ET.fromstring(strip_svg(strip))  # noqa: S314 -- our own picture
    upper = [one for one in svg.iter("rect") if one.get("y") == "0"]
    return [
        (str(one.get("class")), float(one.get("x", "")), float(one.get("width", "")))
        for one in upper
    ]


@given(strips)
def test_the_upper_bar_covers_the_axis_once_and_no_more_than_was_computed(strip: Strip) -> None:
    drawn = bars(strip)
    lengths = sum(width for _, _, width in drawn)
    assert lengths == pytest.approx(240.0, abs=0.1 * len(drawn))  # positions have one decimal
    assert [x for _, x, _ in drawn] == sorted(x for _, x, _ in drawn)
    end = 120.0 * (1.0 + math.log10(strip.largest_scale)) if strip.robust else 0.0
    for name, x, width in drawn:
        if name == "strip-unknown":
            assert x >= end - 0.1
        else:
            assert x + width <= end + 0.2


@pytest.mark.parametrize("robust", [(), (0.5, 0.6, math.nan)])
def test_figure_and_page_draw_the_same_parts(robust: tuple[float, ...]) -> None:
    strips = {"far": Strip((), 10.0, robust), "near": Strip(((0.9, 2.5),), 2.5, robust)}
    drawn = draw_margin_strips(strips, "shake")
    axes = drawn.figure.axes[0]
    hatched = [one for one in axes.collections if one.get_hatch()]
    from_page = [
        one for strip in strips.values() for one in bars(strip) if one[0] == "strip-unknown"
    ]
    nominal = 1  # the outcome of the second structure above 2.5
    assert len(hatched) == len(from_page) + nominal
    legend = [
        one.get_label() for one in drawn.figure.legends[0].legend_handles if isinstance(one, Patch)
    ]
    assert "not computed" in legend
    faces = [tuple(np.ravel(one.get_facecolor())[:3]) for one in axes.collections]
    assert (to_rgb("#deebf7") in faces) == bool(robust)  # the colour of "fewer than 10 %"
    assert ("not computed" in drawn.caption.partition(";")[0]) == (not robust)


def test_a_strip_says_in_words_what_was_not_computed() -> None:
    svg = strip_svg(Strip(((0.98, 2.8),), 2.8))
    assert "share of the ensemble not computed; nominally overturns from 0.98; " in svg
    assert "not computed above 2.8" in svg
    assert "not computed" not in strip_svg(Strip(((0.98, 10.0),), 10.0, (1.0, 1.1, 1.2)))


def test_the_outcome_is_not_known_beyond_the_last_island_that_a_file_keeps() -> None:
    islands = [(1.0 + 0.01 * k, 1.005 + 0.01 * k) for k in range(ISLANDS)]
    strip = strip_of(0.9, 10.0, islands, further=True)
    assert strip.overturning[-1][1] == islands[-1][0]
    assert strip.nominal_unknown(STRIP_ENDS[1]) == (islands[-1][1], 10.0)
    assert strip_of(0.9, 10.0, islands).nominal_unknown(STRIP_ENDS[1]) is None


def test_a_page_without_robust_margins_paints_no_share(tmp_path: Any) -> None:
    samples = 4.0 * np.sin(2.0 * math.pi * 0.01 * np.arange(800))
    np.savetxt(tmp_path / "shake.csv", samples, fmt="%.6f")
    (tmp_path / "column.toml").write_text(
        '[[structure]]\nname = "column"\nheight_m = 3.0\nwidth_m = 0.4\n'
    )
    words = ["table1", "--records", str(tmp_path / "shake.csv"), "--units", "m/s2"]
    words += ["--time-step", "0.01", "--structures", str(tmp_path / "column.toml")]
    words += ["--margins", "first", "--workers", "0", "--output", str(tmp_path / "run")]
    assert main(words) == 0
    assert main(["report", str(tmp_path / "run")]) == 0
    page = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert 'class=\\"strip-unknown' in page or 'class="strip-unknown' in page
    body = page.partition("</style>")[2]
    assert "strip-0" not in body.partition("<script>")[0]
    assert "share of the ensemble not computed" in body
