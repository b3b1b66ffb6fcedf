"""The match index of each wavelet against its period."""

from __future__ import annotations

from typing import Final

import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import Captioned
from rockframe.figures.style import LINES, PRINT_WIDTH, period_ticks, styled

_NAMES: Final = {
    "symmetric_ricker": "symmetric Ricker",
    "antisymmetric_ricker": "antisymmetric Ricker",
    "ricker_any_phase": "Ricker, any phase",
    "mavroeidis_papageorgiou": "Mavroeidis-Papageorgiou",
}


def draw_match_curves(dataset: xr.Dataset) -> Captioned:
    """Draw the match index over the period and mark the best match of each wavelet.

    Parameters
    ----------
    dataset : Dataset
        As returned by `match_curve_dataset`.
    """
    periods = dataset["period"].values
    told = []
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 3.0), layout="constrained")
        axes = figure.subplots()
        for k, name in enumerate(str(value) for value in dataset["wavelet"].values):
            one = dataset.isel(wavelet=k)
            period, index = float(one["T_p"]), float(one["best_match"])
            color = f"C{k}"
            axes.plot(
                periods, one["match_index"].values, label=_NAMES[name], linestyle=LINES[k],
                color=color,
            )  # fmt: skip
            axes.plot(period, index, marker="o", markersize=4, linestyle="", color=color)
            told.append(f"{_NAMES[name]} {index:.3f} at T_p = {period:.3f} s")
        axes.set_xscale("log")
        period_ticks(axes.xaxis, float(periods[0]), float(periods[-1]))
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("period  $T_p$ [s]")
        axes.set_ylabel("match index")
        figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    caption = (
        "Largest match index (cosine between record and wavelet) at each period, over all times, "
        f"phases and up to {dataset.attrs['most_half_cycles']:g} half cycles. Dots: the best match "
        f"of each wavelet: {'; '.join(told)}. Record {dataset['record_id'].item()}. T_p of "
        "different wavelets cannot be compared."
    )
    return Captioned(figure, "Match index and period", caption)
