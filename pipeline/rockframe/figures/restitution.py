"""Largest coefficient of restitution over slenderness: Figure 7 of the paper."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned
from rockframe.figures.style import LINES, PRINT_WIDTH, styled


def draw_restitution(dataset: xr.Dataset) -> Captioned:
    """Draw sqrt(r) over the slenderness, with a curve for each mass ratio.

    Parameters
    ----------
    dataset : Dataset
        As returned by `restitution_dataset`.
    """
    slenderness = np.degrees(dataset["slenderness"].values)
    ends = np.degrees(dataset["slenderness_limit"].values)
    gammas = [float(gamma) for gamma in dataset["mass_ratio"]]
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.9), layout="constrained")
        axes = figure.subplots()
        for i, gamma in enumerate(gammas):
            values = dataset["restitution"].values[i]
            known = np.isfinite(values)
            axes.plot(
                np.append(slenderness[known], ends[i]),
                np.append(values[known], 0.0),
                label=f"γ = {gamma:g}".replace("inf", "∞"),
                linestyle=LINES[i % len(LINES)],
            )
        axes.set_xlim(0.0, 60.0)
        axes.set_ylim(0.0, 1.0)
        axes.set_xlabel("slenderness  α  [degrees]")
        axes.set_ylabel(r"largest restitution  $\sqrt{r}$")
        axes.legend(loc="lower left")
    stated = ", ".join(f"{gamma:g}" for gamma in gammas).replace("inf", "∞")
    caption = (
        "Largest coefficient of restitution √r, the angular velocity after an impact over that "
        "before, of frames of rectangular columns: eq (43), over the slenderness α, for mass "
        f"ratios γ = {stated}. It vanishes at {ends[0]:.2f} degrees for γ = {gammas[0]:g} and at "
        f"{ends[-1]:.2f} degrees for γ = {gammas[-1]:g}".replace("inf", "∞")
        + "; stockier frames do not rock. No record is used."
    )
    return Captioned(figure, "Figure 7: largest restitution", caption)
