"""The search for pulses: match over the period, and the scalogram."""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from rockframe.figures.captioned import (
    LINES,
    PRINT_WIDTH,
    Captioned,
    period_ticks,
    styled,
    tested_in,
    wavelet_in,
)
from rockframe.units import GRAVITY

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


#: Times are drawn if a coefficient is above this share of the largest coefficient [1].
_SEEN: Final = 0.25
#: Time that is drawn before and after these times [s].
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
