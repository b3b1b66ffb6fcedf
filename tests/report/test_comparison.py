"""The comparison in a page: its chart, its tables, and the page of its own."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest
from tests.results.test_designs import row

from rockframe.report.comparison import comparison_content, render_comparison


@pytest.fixture
def rows() -> list[dict[str, Any]]:
    both = ((0.1, 0.2), (0.5, 0.1), (0.3, 0.3))
    free = [row(f"r{k}", "free", *one) for k, one in enumerate(both)]
    return [*free, *(row(f"r{k}", "fixed", 0.05, 0.4, share_model_ends=0.5) for k in range(3))]


def test_each_design_has_a_mark_in_each_panel(rows: Any) -> None:
    content = comparison_content(rows, {}, most=2)
    titles = [panel.title for panel in content["panels"]]
    assert titles[:4] == [
        *("u [cm]", "residual u [cm]"),
        *("base shear [W]", "base shear [kN]"),
    ]
    assert {len(panel.marks) for panel in content["panels"]} == {2}
    drift = content["panels"][0]
    (free, fixed), width = drift.marks, content["size"][1]
    assert drift.end == "50.0"  # the worst record
    assert (free.dot, free.far) == (pytest.approx(0.6 * width), width)
    assert (fixed.text, fixed.dot) == ("5.0", pytest.approx(0.1 * width))
    assert (len(content["rows"]), content["total"]) == (2, 6)
    ends = content["panels"][-1]
    assert (ends.title, ends.end) == ("model ends in [%]", "100")
    assert [mark.dot for mark in ends.marks] == [0.0, 0.5 * width]


def test_a_design_that_overturns_has_an_open_bar_and_a_long_name_is_cut(rows: Any) -> None:
    fallen = [{**one, "structure": 30 * "x", "peak_u_50_m": u} for one, u in
              zip(rows[:3], (0.1, 0.2, math.inf), strict=True)]  # fmt: skip
    mark = comparison_content([*rows, *fallen], {})["panels"][0].marks[-1]
    assert (mark.high, mark.far, mark.text) == (None, None, "overturns")
    assert mark.low is not None
    assert len(mark.label) == 24
    assert mark.label.endswith("x free")


def test_the_page_has_no_script_and_escapes_names(rows: Any) -> None:
    named = [{**one, "record_id": "<b>r</b>"} for one in rows]
    page = render_comparison("<site>", named, {})
    assert "<script" not in page
    assert "&lt;site&gt;" in page
    assert "<b>r" not in page
    assert re.search(r"default-src 'none'|default-src &#39;none&#39;", page)
    assert page.count("<figure>") == 6
