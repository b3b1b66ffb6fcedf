"""Multiples of a record that overturn: strips of structures, and the stability map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.figures.captioned import (
    DRAWN_TO,
    PAGE_WIDTH,
    PRINT_WIDTH,
    Captioned,
    label_of,
    of_motion,
    of_structure,
    plain_ticks,
    styled,
)
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking import STRIP_LEGEND, GroundAcceleration, Strip, as_ground, respond_many
from rockframe.rocking.response import ties_of

#: Range of multiples of the motion that is drawn; extended if a smaller multiple overturns [1].
_LEAST: Final = 0.1
#: Colours of multiples at which a structure stands, and overturns.
_STANDS: Final = "#9ecae1"
_OVERTURNS: Final = "#d55e00"
#: Colours of the share of the ensemble that overturns: below 10 %, and above 10, 25 and 50 %.
_SHADES: Final = ("#deebf7", "#fdd0a2", "#f4a261", _OVERTURNS)
_SHARES: Final = ("fewer than 10 %", "10 % reached", "25 % reached", "50 % reached")
#: Look of multiples that were not computed.
_UNKNOWN: Final[dict[str, Any]] = {
    "facecolor": "none", "edgecolor": "0.6", "hatch": "////", "linewidth": 0.5
}  # fmt: skip


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
    least = min([_LEAST, *(0.8 * scale for scale in critical)])
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 1.25 + 0.4 * len(strips)), layout="constrained")
        axes = figure.subplots()
        for row, strip in enumerate(strips.values()):
            _draw_strip(axes, row, strip, (least, largest))
        axes.axvline(1.0, color="black", linewidth=0.9, linestyle=":")
        axes.set_xscale("log")
        axes.set_xlim(least, largest)
        axes.set_ylim(len(strips) - 0.45, -0.55)
        plain_ticks(axes.xaxis, least, largest)
        axes.set_yticks(range(len(strips)), [label_of(name) for name in strips])
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False)
        axes.spines["left"].set_visible(False)
        axes.set_xlabel("multiple of the motion")
        axes.set_title(label_of(title))
        _head(axes, [*strips.values()], (least, largest))
    shares = (
        "Least multiples of the motion at which 10, 25 and 50 % of the ensemble overturn; no share "
        "was computed above that of 50 %; "
        if any(strip.robust for strip in strips.values())
        else "The share of an ensemble that overturns was not computed (hatched); "
    )
    return Captioned(
        figure,
        f"Margins under {title}",
        f"{shares}the motion itself is the dotted line. The line below "
        "each strip is black where the multiple overturns the structure as given, as far as they "
        f"were searched, up to {largest:.3g}; islands thinner than 1.3 % of the multiple are "
        f"missed. {STRIP_LEGEND}",
    )


def _draw_strip(axes: Axes, row: int, strip: Strip, ends: tuple[float, float]) -> None:
    """Draw the shares of the ensemble and the nominal outcome between the ends of the axis."""
    for reached, low, high in strip.shares_between(*ends):
        look = _UNKNOWN if reached is None else {"facecolor": _SHADES[reached]}
        axes.broken_barh([(low, high - low)], (row - 0.3, 0.42), **look)
    unknown = strip.nominal_unknown(ends[1])
    if unknown:
        axes.broken_barh([(unknown[0], unknown[1] - unknown[0])], (row + 0.2, 0.14), **_UNKNOWN)
    known_to = unknown[0] if unknown else ends[1]
    axes.plot([ends[0], known_to], [row + 0.27] * 2, color=_STANDS, linewidth=1.0, zorder=0.5)
    axes.broken_barh(
        [(low, high - low) for low, high in strip.overturning],
        (row + 0.2, 0.14),
        facecolor="black",
        edgecolor="black",  # an edge makes very narrow intervals visible
        linewidth=0.4,
    )
    critical = strip.in_words(strip.overturning[0][0] if strip.overturning else math.nan)
    shares = [strip.in_words(share) for share in strip.robust]
    _beside(axes, row, "   ".join(shares), critical)


#: Distance from the strips of the robust margin and of the critical scale [points].
_AT: Final = (8.0, 150.0)


def _beside(axes: Axes, row: float, shares: str, critical: str, **style: Any) -> None:
    """Write the robust margin and the critical scale beside a row of the strips."""
    placed: dict[str, Any] = {"va": "center", "fontsize": 8} | style
    for text, at, side in ((shares, _AT[0], "left"), (critical, _AT[1], "right")):
        axes.annotate(
            text,
            (1.0, row),
            xytext=(at, 0.0),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            ha=side,
            **placed,
        )


def _head(axes: Axes, strips: Sequence[Strip], ends: tuple[float, float]) -> None:
    """Name the columns of numbers beside the strips, and explain the colours below them."""
    robust = any(strip.robust for strip in strips)
    head = "10, 25, 50 % of the\nensemble overturn at" if robust else ""
    _beside(axes, -0.6, head, "nominal\ncritical scale", va="bottom", fontsize=7)
    handles: list[Patch | Line2D] = []
    if robust:
        handles = [
            Patch(facecolor=shade, label=share)
            for shade, share in zip(_SHADES, _SHARES, strict=True)
        ]
    handles.append(Line2D([], [], color="black", linewidth=3.0, label="nominally overturns"))
    shares = (part[0] for strip in strips for part in strip.shares_between(*ends))
    if None in shares or any(strip.nominal_unknown(ends[1]) for strip in strips):
        handles.append(Patch(**_UNKNOWN, label="not computed"))
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=7)


#: Colours and labels in the order of the verdicts: no uplift, stands, overturns.
_COLOURS: Final = ("#ffffff", _STANDS, _OVERTURNS)
_WORDS: Final = ("no uplift", "rocks and stands", "overturns")


#: Heights of the map, relative to the height of the structure, and the largest scale.
_HEIGHTS: Final = (0.1, 4.0)
_LARGEST_SCALE: Final = 4.0
#: Factor by which the map is coarser than Figure 9: responses to records take longer.
_COARSER: Final = 4


def draw_stability_map(
    record: Record,
    frame: RockingFrame,
    motion: GroundAcceleration | None = None,
    *,
    grid: int = 400,
) -> Captioned:
    """Draw the verdict over the height of the columns and the scale of the motion.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame; all sizes have its slenderness, mass ratio, section and restitution factor, and
        restraints of its sections and forces. Sizes whose restraints are too strong are left out.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.
    grid : int
        Four times the number of points along each side.

    Raises
    ------
    ParameterError
        If a column is not between 1 mm and 1 km, or a vertical acceleration at its scale falls
        faster than gravity.
    """
    points = max(2, grid // _COARSER)
    heights = frame.height * np.geomspace(*_HEIGHTS, points)
    scales = np.linspace(_LARGEST_SCALE / points, _LARGEST_SCALE, points)
    frames = _possible_sizes(frame, heights)
    heights = heights[-len(frames) :]
    verdicts = respond_many([motion or record], frames, scales).verdict[0]
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.1), layout="constrained")
        axes = figure.subplots()
        axes.pcolormesh(
            heights,
            scales,
            verdicts.T,
            cmap=ListedColormap(_COLOURS),
            norm=BoundaryNorm(np.arange(-0.5, len(_COLOURS)), len(_COLOURS)),
            shading="nearest",
            rasterized=True,
        )
        label = "the structure, the motion itself"
        (cross,) = axes.plot(frame.height, 1.0, "+", color="black", markersize=9, label=label)
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.minorticks_off()
        axes.set_xlabel("height of the columns [m]")
        axes.set_ylabel("multiple of the motion")
        axes.grid(visible=False)
        handles = [
            Patch(facecolor=colour, edgecolor="0.6", linewidth=0.5, label=word)
            for colour, word in zip(_COLOURS, _WORDS, strict=True)
        ]
        figure.legend(handles=[*handles, cross], loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        f"Nominal verdict of frames of all sizes under multiples of "
        f"{of_motion(record, as_ground(motion or record))}: columns from {heights[0]:.3g} to "
        f"{heights[-1]:.3g} m ({heights.size} heights), scales from {scales[0]:.3g} to "
        f"{scales[-1]:.3g} ({scales.size}), slenderness and mass ratio as the structure's"
        f"{_of_sizes(frame, points - heights.size)}; the "
        f"cross is the structure under the motion itself. {of_structure(frame)}"
    )
    return Captioned(figure, "Stability map", caption)


def _possible_sizes(frame: RockingFrame, heights: NDArray[np.float64]) -> list[RockingFrame]:
    """Return the frame at these heights, without small ones whose restraints are too strong."""
    frames = [frame.resized(h, h * frame.width / frame.height) for h in heights.tolist()]
    for first, smaller in enumerate(frames):
        with suppress(ParameterError):
            ties_of(smaller)
            return frames[first:]
    ties_of(frames[-1])  # raises the error of the largest frame
    return frames


def _of_sizes(frame: RockingFrame, too_small: int) -> str:
    """Return what a caption says about the sections and restraints of other sizes."""
    words = ""
    if frame.column_section is None:
        words += "; the section of its columns is not known: they keep their inertia ratio"
        words += ", and their mass grows with the square of the height" * frame.restrained
    if frame.restrained:
        words += "; tendons and dissipaters keep their sections and forces"
    if frame.before_crushing is not None:
        words += "; edges crush in proportion to the width"
    if too_small:
        words += f"; smaller heights ({too_small}) are left out, as their restraints are too strong"
    return words


def draw_scales(rows: Sequence[Mapping[str, Any]], title: str) -> Captioned:
    """Draw how the peak rotation and the share that overturns change with the amplitude.

    Parameters
    ----------
    rows : sequence of mapping
        The rows of one record, as `scaled_rows` of the respond stage returns them; at least one.
    title : str
        Name of the record.
    """
    structures = list(dict.fromkeys(str(row["structure"]) for row in rows))
    spread = "share_overturned" in rows[0]
    with styled():
        size = (PAGE_WIDTH, 0.7 + 1.5 * len(structures))
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(len(structures), 1 + spread, sharex=True, squeeze=False)
        for name, panels in zip(structures, grid, strict=True):
            of_this = [row for row in rows if row["structure"] == name]
            _draw_scaled_peaks(panels[0], of_this)
            panels[0].set_title(label_of(name), loc="left", fontsize=8)
            if spread:
                _draw_scaled_shares(panels[1], of_this)
        for axes in grid[-1]:
            axes.set_xlabel("multiple of the motion")
        figure.suptitle(label_of(title), fontsize=9)
    nominal = "Points: the structure as given; crosses at the upper edge: it overturns."
    ensemble = (
        " Band and dashed line: 16 to 84 % and median of an ensemble of plausible structures, at "
        "the upper edge where they fall on members that overturn. Right: share of the ensemble "
        "that overturns, with its 90 % interval. Dotted: the motion itself."
    )
    return Captioned(
        figure,
        f"Change with amplitude under {title}",
        f"Largest rotation θ/α against the multiple of the motion. {nominal}{ensemble * spread}",
    )


def _draw_scaled_peaks(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw theta / alpha of the structure as given and of the ensemble; a fall is at the edge."""
    scale = np.array([row["scale"] for row in rows])
    fallen = np.array([row["verdict"] == "overturns" for row in rows])
    peak = np.array([row["peak_rotation_ratio"] for row in rows])
    bands = [
        np.array([row.get(f"peak_rotation_ratio_{part}", math.nan) for row in rows])
        for part in (16, 50, 84)
    ]
    ratios = np.concatenate([peak[~fallen], *bands])
    ratios = ratios[np.isfinite(ratios)]
    top = 1.15 * max(float(ratios.max()), 0.01) if ratios.size else DRAWN_TO
    low, median, high = (np.minimum(ratio, top) for ratio in bands)
    axes.fill_between(scale, low, high, color=_STANDS, alpha=0.7, linewidth=0.0)
    axes.plot(scale, median, color="C0", linestyle="--", linewidth=0.9)
    axes.plot(scale, np.where(fallen, np.nan, peak), color="black", marker="o", markersize=2.5,
              linewidth=0.8)  # fmt: skip
    (crosses,) = axes.plot(scale[fallen], np.full(fallen.sum(), top), color=_OVERTURNS, marker="x",
                           markersize=4, linestyle="", clip_on=False)  # fmt: skip
    crosses.set_in_layout(False)
    axes.axvline(1.0, color="black", linewidth=0.7, linestyle=":")
    axes.set_ylim(0.0, top)
    if scale.size > 1:
        axes.set_xlim(scale[0], scale[-1])
    axes.set_ylabel("θ/α")


def _draw_scaled_shares(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    scale = [row["scale"] for row in rows]
    share, low, high = (
        [100.0 * row[f"share_overturned{end}"] for row in rows] for end in ("", "_low", "_high")
    )
    axes.fill_between(scale, low, high, color=_SHADES[1], linewidth=0.0)
    axes.plot(scale, share, color=_OVERTURNS, marker="o", markersize=2.5, linewidth=0.9)
    axes.axvline(1.0, color="black", linewidth=0.7, linestyle=":")
    axes.set_ylim(0.0, 100.0)
    axes.set_ylabel("overturn [%]")
