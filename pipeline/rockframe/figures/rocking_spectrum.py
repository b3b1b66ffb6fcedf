"""Rocking spectra of a record: peak rotation and rate over 2 pi / p of the columns."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned
from rockframe.figures.style import LINES, PRINT_WIDTH, styled
from rockframe.rocking import Verdict


def draw_rocking_spectrum(dataset: xr.Dataset) -> Captioned:
    """Draw peaks over 2 pi / p for each slenderness; curves have gaps where the frame overturns.

    Parameters
    ----------
    dataset : Dataset
        As returned by `rocking_spectrum_dataset`, for one record and mass ratio.
    """
    one = dataset.squeeze(("record", "mass_ratio"))
    period = one["column_period"].values
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.8), layout="constrained")
        panels = figure.subplots(2, 1, sharex=True)
        _draw(panels[0], one, "peak_rotation_ratio")
        _draw(panels[1], one, "peak_velocity")
        panels[0].axhline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        panels[0].set_ylabel("largest |θ|/α")
        panels[1].set_ylabel(r"largest $|\dot\theta|$ [rad s$^{-1}$]")
        panels[1].set_xlabel(r"$2\pi/p$ of a column [s]")
        panels[1].set_xlim(period[0], period[-1])
        for panel in panels:
            panel.set_ylim(bottom=0.0)
        figure.align_ylabels(list(panels))
        handles, _ = panels[0].get_legend_handles_labels()
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        f"Largest rotation over the slenderness, and largest rate, under record "
        f"{one['record_id'].item()}, free rocking after its end included, over 2π/p of the columns "
        f"from {period[0]:g} to {period[-1]:g} s ({period.size} values), for the slendernesses α "
        f"named and mass ratio γ = {float(one['mass_ratio']):g}; rectangular columns, restitution "
        "by eq (43). A curve has gaps where the frame overturns."
    )
    return Captioned(figure, "Rocking spectra", caption)


def _draw(panel: Axes, one: xr.Dataset, name: str) -> None:
    stands = one["verdict"] != Verdict.OVERTURNED
    for i, alpha in enumerate(one["slenderness"].values):
        peaks = np.where(stands.isel(slenderness=i), one[name].isel(slenderness=i), np.nan)
        panel.plot(
            one["column_period"],
            peaks,
            label=f"α = {math.degrees(alpha):.3g}°",
            linestyle=LINES[i % len(LINES)],
        )
