"""Strips that show the scales of one record at which structures overturn."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import blended_transform_factory

from rockframe.figures.captioned import PAGE_WIDTH, Captioned, styled
from rockframe.rocking import MARGIN_LEGEND, Strip

#: Range of multiples of the motion that is drawn; extended if a smaller multiple overturns [1].
_LEAST: Final = 0.1
#: The same colours as in the stability map.
_STANDS: Final = "#9ecae1"
_OVERTURNS: Final = "#d55e00"


def draw_margin_strips(strips: Mapping[str, Strip], title: str) -> Captioned:
    """Draw the multiples of one record that overturn each structure.

    Parameters
    ----------
    strips : mapping of str to Strip
        Strips by structure, as returned by `ResponseFile.strips`.
    title : str
        Name of the record.
    """
    largest = max(strip.largest_scale for strip in strips.values())
    critical = [strip.overturning[0][0] for strip in strips.values() if strip.overturning]
    least = min([_LEAST, *(0.8 * one for one in critical)])
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 1.25 + 0.4 * len(strips)), layout="constrained")
        axes = figure.subplots()
        for row, strip in enumerate(strips.values()):
            _draw_strip(axes, row, strip, least)
        axes.axvline(1.0, color="black", linewidth=0.9, linestyle=":")
        axes.set_xscale("log")
        axes.set_xlim(least, largest)
        axes.set_ylim(len(strips) - 0.45, -0.55)
        ticks = [tick for tick in (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10) if least <= tick <= largest]
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_yticks(range(len(strips)), [*strips])
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
        axes.set_xlabel("multiple of the motion")
        axes.set_title(title)
        _head(axes, robust=any(strip.robust for strip in strips.values()))
    return Captioned(
        figure,
        f"Margins under {title}",
        "Multiples of the motion at which each structure stands (blue) and overturns (red), as far "
        "as they were searched; the motion itself is the dotted line. Below each strip, the robust "
        f"margin. {MARGIN_LEGEND}",
    )


def _draw_strip(axes: Axes, row: int, strip: Strip, least: float) -> None:
    axes.broken_barh([(least, strip.largest_scale - least)], (row - 0.3, 0.42), facecolor=_STANDS)
    axes.broken_barh(
        [(low, high - low) for low, high in strip.overturning],
        (row - 0.3, 0.42),
        facecolor=_OVERTURNS,
        edgecolor=_OVERTURNS,  # an edge makes very narrow intervals visible
        linewidth=0.4,
    )
    known = [one for one in strip.robust if not math.isnan(one)]
    if known:
        end = known[-1] if len(known) == len(strip.robust) else strip.largest_scale
        axes.plot([known[0], end], [row + 0.26] * 2, color="black", linewidth=1.2)
        axes.plot(known, [row + 0.26] * len(known), "|", color="black", markersize=5)
    critical = f"{strip.overturning[0][0]:.2f}" if strip.overturning else "–"
    shares = ["–" if math.isnan(one) else f"{one:.2f}" for one in strip.robust]
    beside = blended_transform_factory(axes.transAxes, axes.transData)
    axes.text(1.09, row, critical, transform=beside, ha="right", va="center", fontsize=8)
    axes.text(1.14, row, "   ".join(shares), transform=beside, va="center", fontsize=8)


def _head(axes: Axes, *, robust: bool) -> None:
    """Name the columns of numbers beside the strips, and explain the marks below them."""
    axes.text(1.09, 1.02, "critical\nscale", transform=axes.transAxes, ha="right", fontsize=7)
    handles: list[Patch | Line2D] = [
        Patch(facecolor=_STANDS, label="stands"),
        Patch(facecolor=_OVERTURNS, label="overturns"),
    ]
    if robust:
        axes.text(
            1.14,
            1.02,
            "10, 25, 50 % of the\nensemble overturn",
            transform=axes.transAxes,
            fontsize=7,
        )
        handles.append(
            Line2D([], [], color="black", marker="|", label="10, 25, 50 % of the ensemble overturn")
        )
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=3)
