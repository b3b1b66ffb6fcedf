"""The wavelet transform of a record, with the best match marked."""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned, tested_in, wavelet_in
from rockframe.figures.style import PRINT_WIDTH, period_ticks, styled
from rockframe.units import GRAVITY

#: Times are drawn where any coefficient is above this share of the largest [1].
_SEEN: Final = 0.25
#: Time drawn before and after that [s].
_MARGIN: Final = 2.0


def draw_scalogram(dataset: xr.Dataset) -> Captioned:
    """Draw the match index over period and time, and mark the best match.

    Parameters
    ----------
    dataset : Dataset
        As returned by `scalogram_dataset`.
    """
    centre, period = float(dataset["pulse_time"]), float(dataset["T_p"])
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        picture = axes.pcolormesh(
            dataset["time"].values,
            dataset["period"].values,
            dataset["match_index"].values,
            cmap="Greys",
            vmin=0.0,
            shading="nearest",
            rasterized=True,
        )
        axes.plot(
            centre, period, linestyle="", marker="+", markersize=11, markeredgewidth=1.6, color="C1"
        )
        axes.set_yscale("log")
        ends = float(dataset["period"][0]), float(dataset["period"][-1])
        axes.set_ylim(*ends)
        period_ticks(axes.yaxis, *ends)
        axes.set_xlim(*_span(dataset))
        axes.grid(visible=False)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("period  $T_p$ [s]")
        bar = figure.colorbar(picture, ax=axes)
        bar.set_label("match index")
    caption = (
        f"Match index of the {wavelet_in(dataset)} wavelet, by PyWavelets, at each period and "
        "time: the energy-normalised coefficient over the root of the record's energy. Cross: the "
        f"best match, a_p = {float(dataset['a_p']) / GRAVITY:.3f} g, T_p = {period:.3f} s at "
        f"{centre:.2f} s, {tested_in(dataset)}match index {float(dataset['best_match']):.3f}. "
        f"Record {dataset['record_id'].item()} (PGA {float(dataset['pga']) / GRAVITY:.2f} g)."
    )
    return Captioned(figure, "Wavelet transform", caption)


def _span(dataset: xr.Dataset) -> tuple[float, float]:
    time = dataset["time"].values
    highest = dataset["match_index"].values.max(axis=0)
    seen = time[np.flatnonzero(highest >= _SEEN * highest.max())]
    return max(time[0], seen[0] - _MARGIN), min(time[-1], seen[-1] + _MARGIN)
