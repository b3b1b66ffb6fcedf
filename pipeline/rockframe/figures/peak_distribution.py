"""Distribution of the peak rotations of one structure under many motions."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned
from rockframe.figures.style import PRINT_WIDTH, styled


def draw_peak_distribution(screening: xr.Dataset) -> Captioned:
    """Draw the distribution of peak rotations with its confidence band.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`, for one structure.
    """
    level = screening["level"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        axes.fill_between(
            level,
            screening["peak_share_low"],
            screening["peak_share_high"],
            step="post",
            color="C0",
            alpha=0.2,
            linewidth=0,
        )
        axes.step(level, screening["peak_share"], where="post")
        axes.axvline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        axes.set_xlim(float(level[0]), float(level[-1]))
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel(r"peak rotation  $\theta\,/\,\alpha$")
        axes.set_ylabel("share of motions at or below")
    structure = str(screening["structure"].item())
    scale = float(screening["reference_scale"])
    at = int(np.flatnonzero(screening["scale"].values == scale)[0])
    fell = int(screening["verdict_count"].isel(scale=at).sel(outcome="overturned"))
    recordings = np.unique(screening["cluster"].values).size
    caption = (
        f"Share of {screening.sizes['record']} motions of {recordings} recordings, at scale "
        f"{scale:g}, under which the peak rotation of {structure} is at most θ/α; "
        f"{fell} overturn, so that the curve ends at "
        f"{1.0 - fell / screening.sizes['record']:.2f}. Shaded: 90 % confidence, by drawing "
        "recordings with replacement, and at least Wilson's interval for so many of them."
    )
    return Captioned(figure, f"Peak rotations of {structure}", caption)
