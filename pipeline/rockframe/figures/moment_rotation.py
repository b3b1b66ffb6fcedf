"""Restoring moment over rotation, Figure 4 of the paper, with the path of a frame."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned, of_record, of_structure
from rockframe.figures.style import DRAWN_TO, PRINT_WIDTH, styled


def draw_moment_rotation(dataset: xr.Dataset) -> Captioned:
    """Draw the restoring moment over the rotation, and the part reached under a record.

    Parameters
    ----------
    dataset : Dataset
        As returned by `portrait_dataset`.
    """
    alpha = float(dataset["slenderness"])
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        axes.axhline(0.0, color="0.7", linewidth=0.8)
        axes.plot(
            dataset["curve_rotation"] / alpha,
            dataset["curve_moment"],
            color="0.6",
            linewidth=0.9,
            label="all rotations",
        )
        reached = dataset["restoring_moment"].sortby(dataset["rotation"])
        axes.plot(reached["rotation"] / alpha, reached, linewidth=2.4, label="reached")
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel("moment / uplift moment")
        axes.legend(loc="upper left")
        axes.set_ylim(-1.15, 1.15)
        axes.set_xlim(-DRAWN_TO, DRAWN_TO)
    caption = (
        "Restoring moment over that at uplift, N m_c g R (1 + 2γ) sin α, against the rotation θ "
        "over the slenderness α: rigid up to uplift, then falling to zero at θ = α. The path runs "
        "along one curve and encloses no area; energy is lost in the impacts alone. "
        f"{of_structure(dataset)} {of_record(dataset)}"
    )
    return Captioned(figure, "Moment and rotation", caption)
