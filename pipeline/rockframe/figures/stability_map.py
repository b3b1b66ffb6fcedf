"""Stability map of a record: verdicts on frames of all sizes at all scales of the motion."""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator

from rockframe.figures.captioned import PRINT_WIDTH, Captioned, of_structure, styled
from rockframe.units import GRAVITY

#: Colours and labels in the order of the verdicts: no uplift, safe, overturned.
_COLOURS: Final = ("#ffffff", "#9ecae1", "#d55e00")
_WORDS: Final = ("no uplift", "rocks and stands", "overturns")


def draw_stability_map(dataset: xr.Dataset) -> Captioned:
    """Draw the verdict over the height of the columns and the scale of the motion.

    Parameters
    ----------
    dataset : Dataset
        As returned by `stability_dataset`.
    """
    heights, scales = dataset["column_height"].values, dataset["scale"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.1), layout="constrained")
        axes = figure.subplots()
        axes.pcolormesh(
            heights,
            scales,
            dataset["verdict"].transpose("scale", "column_height").values,
            cmap=ListedColormap(_COLOURS),
            norm=BoundaryNorm(np.arange(-0.5, len(_COLOURS)), len(_COLOURS)),
            shading="nearest",
            rasterized=True,
        )
        (cross,) = axes.plot(
            float(dataset["height"]),
            1.0,
            marker="+",
            color="black",
            markersize=9,
            linestyle="",
            label="the structure, the motion itself",
        )
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
        f"Verdict of frames of all sizes under multiples of record {dataset['record_id'].item()} "
        f"(PGA {float(dataset['pga']) / GRAVITY:.2f} g): columns from {heights[0]:.3g} to "
        f"{heights[-1]:.3g} m ({heights.size} heights), scales from {scales[0]:.3g} to "
        f"{scales[-1]:.3g} ({scales.size}), slenderness and mass ratio as the structure's; the "
        f"cross is the structure under the motion itself. {of_structure(dataset)}"
    )
    return Captioned(figure, "Stability map", caption)
