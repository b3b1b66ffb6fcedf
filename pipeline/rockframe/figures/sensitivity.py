"""Figure of the spreads of the ensemble that matter: bars of rank correlations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import PAGE_WIDTH, Captioned, label_of, styled
from rockframe.results.tables.sensitivity import SENSITIVITY_LEGEND, spread_words, spreads_of_rows

#: Colours of the spread that matters most, and of the others.
_MOST: Final = "#d55e00"
_OTHER: Final = "#9ecae1"
#: Largest number of structures beside one another.
_COLUMNS: Final = 5


def draw_sensitivity(rows: Sequence[Mapping[str, Any]], title: str) -> Captioned:
    """Draw the rank correlation of each spread with the peaks of each structure, one bar each.

    Parameters
    ----------
    rows : sequence of mapping
        The rows of one record, as `sensitivity_rows` yields them; at least one.
    title : str
        Name of the record.
    """
    names = spreads_of_rows(rows)
    columns = min(len(rows), _COLUMNS)
    lines = math.ceil(len(rows) / columns)
    with styled():
        size = (PAGE_WIDTH, 0.5 + lines * (0.5 + 0.17 * len(names)))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, row in zip(panels, rows, strict=False):
            _draw_bars(axes, row, names)
        for axes in panels[len(rows) :]:
            axes.set_axis_off()
        panels[0].set_yticks(range(len(names)), [spread_words(name) for name in names])
        panels[0].set_ylim(len(names) - 0.4, -0.6)
        figure.supxlabel("rank correlation with the peak rotation", fontsize=8)
        figure.suptitle(label_of(title), fontsize=9)
    return Captioned(
        figure,
        f"Sensitivity under {title}",
        f"{SENSITIVITY_LEGEND.format(chance=rows[0]['by_chance'])} Dotted: this value. Members "
        "that overturn have the largest ranks. Orange: the spread that matters most. Without bars: "
        "all members have the same peak, or all overturn.",
    )


def _draw_bars(axes: Axes, row: Mapping[str, Any], names: Sequence[str]) -> None:
    measured = [name for name in names if math.isfinite(row[name])]
    axes.barh(
        [names.index(name) for name in measured],
        [row[name] for name in measured],
        height=0.7,
        color=[_MOST if name == row["matters_most"] else _OTHER for name in measured],
    )
    for chance in (-row["by_chance"], row["by_chance"]):
        axes.axvline(chance, color="black", linewidth=0.7, linestyle=":")
    axes.axvline(0.0, color="black", linewidth=0.7)
    axes.set_xlim(-1.0, 1.0)
    axes.set_xticks([-1.0, 0.0, 1.0], ["−1", "0", "1"])
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.set_title(label_of(row["structure"]), fontsize=8)
