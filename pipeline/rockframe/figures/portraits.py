"""Motion in the phase plane, and the restoring moment over the rotation."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import (
    DRAWN_TO,
    PRINT_WIDTH,
    Captioned,
    of_record,
    of_structure,
    styled,
)


def draw_phase_portrait(dataset: xr.Dataset) -> Captioned:
    """Draw the rate of rotation over the rotation.

    Parameters
    ----------
    dataset : Dataset
        As returned by `portrait_dataset`.
    """
    alpha = float(dataset["slenderness"])
    scale = alpha * float(dataset["effective_frequency_parameter"])
    curve = dataset["curve_rotation"].values / alpha
    barrier = np.where(np.abs(curve) <= 1.0, dataset["curve_barrier"].values / scale, np.nan)
    rates = dataset["impact_rate"].values / scale
    after = float(dataset["restitution"]) * rates
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.1), layout="constrained")
        axes = figure.subplots()
        axes.plot(dataset["rotation"] / alpha, dataset["rate"] / scale, linewidth=0.8)
        for sign in (1.0, -1.0):
            label = "overturns beyond, on still ground" if sign > 0.0 else None
            axes.plot(curve, sign * barrier, color="0.4", linestyle="--", linewidth=0.9,
                      label=label)  # fmt: skip
        for values, face, label in ((rates, "C1", "before an impact"), (after, "w", "after it")):
            axes.plot(
                0.0 * values,
                values,
                linestyle="",
                marker="o",
                markersize=2.4,
                color="C1",
                markerfacecolor=face,
                markeredgewidth=0.6,
                label=label,
            )
        if float(dataset["peak_rotation_ratio"]) > DRAWN_TO:
            axes.set_xlim(-DRAWN_TO, DRAWN_TO)
            axes.set_ylim(-1.5, 1.5)
        axes.set_xlabel("rotation  θ/α")
        axes.set_ylabel(r"rate  $\dot\theta\,/\,(\hat p\,\alpha)$")
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        "Rate of rotation over p̂ α against rotation over the slenderness α. Dots: just before "
        "(filled) and after (open) each impact, where the rate falls by the restitution. Dashed: "
        "a frame left on still ground beyond this line and moving outwards overturns. "
        f"{of_structure(dataset)} {of_record(dataset)}"
    )
    return Captioned(figure, "Phase portrait", caption)


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
