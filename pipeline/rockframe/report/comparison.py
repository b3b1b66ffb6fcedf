"""A comparison of bridges in a page: a chart of the designs over all records, and its tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from rockframe.quantities import Quantity
from rockframe.results.tables.designs import (
    BEST,
    COMPARISON,
    DESIGN_LEGEND,
    DESIGN_QUANTITIES,
    best_rows,
    design_columns,
    design_name,
    design_rows,
)
from rockframe.results.tables.notes import left_out_words
from rockframe.web import render_still

Row = Mapping[str, Any]
#: Width of the plotting area, of a character of a label and of the texts beside it, height of a
#: row, largest length of a label [units of the picture, characters].
_WIDTH, _CHARACTER, _BESIDE, _LINE, _LONGEST = 150.0, 6.2, 62.0, 19.0, 24


@dataclass(frozen=True)
class Mark:
    """One design in a panel: places from 0 to the width of the plotting area.

    Parameters
    ----------
    label, text, title : str
        Name of the design, the value beside its row, and all values in words.
    hue : int
        Number of the model, for its colour.
    y : float
        Middle of the row.
    dot, low, high, far : float or None
        Median or share, ends of the bar, and worst record; None if infinite or unknown.
    """

    label: str
    text: str
    title: str
    hue: int
    y: float
    dot: float | None
    low: float | None
    high: float | None
    far: float | None


@dataclass(frozen=True)
class Panel:
    """One quantity of all designs; its axis runs from 0 to `end`, a text."""

    title: str
    end: str
    marks: tuple[Mark, ...]


def comparison_content(
    rows: Sequence[Row],
    recordings: Mapping[str, Hashable],
    most: int | None = None,
    left_out: Mapping[str, str] | None = None,
    note: str = "",
) -> dict[str, Any]:
    """Return the content of the section on a comparison.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of `comparison_rows`.
    recordings : mapping of str to hashable
        As for `design_rows`.
    most : int, optional
        Largest number of rows to list; by default all.
    left_out : mapping of str to str, optional
        Reasons why other records were not computed, by identifier.
    note : str
        A note below the chart, see `comparison_note`.
    """
    designs = design_rows(rows, recordings)
    panels = _panels(designs)
    longest = max(len(mark.label) for mark in panels[0].marks)
    return {
        "records": designs[0]["records"],
        "left_out_words": left_out_words(left_out or {}, designs[0]["records"]),
        "designs": designs,
        "design_columns": design_columns(designs),
        "best": best_rows(designs),
        "best_columns": BEST,
        "legend": DESIGN_LEGEND,
        "note": note,
        "panels": panels,
        "size": (_CHARACTER * longest + 8.0, _WIDTH, _BESIDE, _LINE * len(designs)),
        "rows": rows[:most],
        "columns": COMPARISON,
        "total": len(rows),
    }


def render_comparison(
    title: str,
    rows: Sequence[Row],
    recordings: Mapping[str, Hashable],
    left_out: Mapping[str, str] | None = None,
    note: str = "",
) -> str:
    """Return the page of a comparison: HTML without scripts, which sends no requests.

    Parameters
    ----------
    title : str
        Title of the page.
    rows, recordings, left_out, note
        As for `comparison_content`.
    """
    content = comparison_content(rows, recordings, left_out=left_out, note=note)
    return render_still(Path(__file__).parent, "still.html", title=title, comparison=content)


def _panels(designs: Sequence[Row]) -> list[Panel]:
    models = list(dict.fromkeys(str(row["design"]) for row in designs))
    several = len({row["structure"] for row in designs}) > 1
    named = [
        (_short(design_name(row, several)), models.index(str(row["design"])), row)
        for row in designs
    ]
    shares = [
        _panel("overturn [%]", named, _percent, *(f"share_overturned{end}" for end in _ENDS)),
        _panel("model ends in [%]", named, _percent, *(["share_model_ends"] * 3)),
    ]
    panels = []
    for quantity in DESIGN_QUANTITIES:
        keys = [quantity.column(part) for part in (0.5, 0.5, 0.84, "worst")]
        if any(not math.isnan(row[keys[2]]) for row in designs):
            panels.append(_panel(quantity.heading, named, partial(_outcome, quantity), *keys))
    return [*panels, *shares]


_ENDS: Final = ("", "_low", "_high")


def _outcome(quantity: Quantity, row: Row, key: str) -> str:
    return quantity.outcome(row[key])


def _percent(row: Row, key: str) -> str:
    return f"{100.0 * row[key]:.0f}"


def _short(label: str) -> str:
    return label if len(label) <= _LONGEST else f"…{label[1 - _LONGEST :]}"


def _panel(
    title: str,
    named: Sequence[tuple[str, int, Row]],
    cell: Callable[[Row, str], str],
    *keys: str,
) -> Panel:
    """Return the panel of a quantity; `keys` are its dot, the ends of its bar, and its far end."""
    values = [row[key] for _, _, row in named for key in keys]
    reach = max(filter(math.isfinite, values), default=0.0)
    if cell is _percent:
        reach = 1.0
    marks = []
    for place, (label, hue, row) in enumerate(named):
        at = [_place(row[key], reach) for key in keys]
        words = " to ".join(dict.fromkeys(cell(row, key) for key in keys))
        text = cell(row, keys[2] if len(keys) == 4 else keys[0])
        dot, low, high, far = [*at, None][:4]
        marks.append(
            Mark(label, text, f"{label}: {words}", hue, (place + 0.5) * _LINE, dot, low, high, far)
        )
    return Panel(title, cell({keys[0]: reach}, keys[0]), tuple(marks))


def _place(value: float, reach: float) -> float | None:
    if not math.isfinite(value):
        return None
    return round(_WIDTH * value / reach, 1) if reach else 0.0
