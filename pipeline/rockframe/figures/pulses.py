"""Pulses: the search over the period, the scalogram, and Figure 8 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import (
    LINES,
    PRINT_WIDTH,
    Captioned,
    plain_ticks,
    styled,
    tested_in,
    time_limits,
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
        plain_ticks(axes.xaxis, float(periods[0]), float(periods[-1]))
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
    time, highest = dataset["time"].values, dataset["match_index"].values.max(axis=0)
    with styled():
        figure = Figure(figsize=(PRINT_WIDTH, 2.6), layout="constrained")
        axes = figure.subplots()
        picture = axes.pcolormesh(
            time,
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
        plain_ticks(axes.yaxis, *ends)
        axes.set_xlim(*time_limits(time, highest >= _SEEN * highest.max(), _MARGIN))
        axes.grid(visible=False)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("period  $T_p$ [s]")
        bar = figure.colorbar(picture, ax=axes)
        bar.set_label("match index")
    caption = (
        f"Match index of the {wavelet_in(dataset)} wavelet, by PyWavelets, at each period and "
        "time: the energy-normalised coefficient divided by the root of the record's energy. "
        f"Cross: the best match, a_p = {float(dataset['a_p']) / GRAVITY:.3f} g, "
        f"T_p = {period:.3f} s at {centre:.2f} s, {tested_in(dataset)}match index "
        f"{float(dataset['best_match']):.3f}. "
        f"Record {dataset['record_id'].item()} (PGA {float(dataset['pga']) / GRAVITY:.2f} g)."
    )
    return Captioned(figure, "Wavelet transform", caption)


#: Time that is drawn before and after the pulse: as a multiple of its reach [1], and at least [s].
_AROUND: Final = 1.5
_LEAST: Final = 5.0
#: Room for the legend above the curves, as a share of their height.
_FOR_LEGEND: Final = 0.2


def draw_record_and_pulse(datasets: Sequence[xr.Dataset], titles: Mapping[str, str]) -> Captioned:
    """Draw the acceleration of each record with its pulse as a heavy line.

    Parameters
    ----------
    datasets : sequence of Dataset
        As returned by `pulse_dataset`, one for each panel.
    titles : mapping of str to str
        Title of each record, by its identifier.
    """
    with styled():
        size = (PRINT_WIDTH, 0.4 + 1.65 * len(datasets))
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(len(datasets), 1, squeeze=False)[:, 0]
        for panel, dataset in zip(panels, datasets, strict=True):
            _draw(panel, dataset)
            pulse = (
                f"{wavelet_in(dataset)}, $a_p$ = {float(dataset['a_p']) / GRAVITY:.3f} g, "
                f"$T_p$ = {float(dataset['T_p']):.3f} s"
            )
            panel.set_title(f"{titles[str(dataset['record_id'].item())]}\n{pulse}", fontsize=7)
        panels[-1].set_xlabel("time [s]")
    told = " ".join(_words(dataset) for dataset in datasets)
    caption = (
        "Ground acceleration (thin) and the pulse that explains most of it (heavy): largest "
        f"coefficient of the energy-normalised wavelet transform. {told}"
    )
    return Captioned(figure, "Figure 8: records and their acceleration pulses", caption)


def _draw(panel: Axes, dataset: xr.Dataset) -> None:
    time = dataset["time"].values
    centre, reach = float(dataset["pulse_time"]), float(dataset["reach"])
    half = max(_LEAST, _AROUND * reach)
    seen = abs(time - centre) <= half
    near = abs(time - centre) <= reach
    panel.plot(
        time[seen], dataset["acceleration"].values[seen] / GRAVITY, color="0.45", linewidth=0.6
    )
    panel.plot(
        time[near],
        dataset["pulse"].values[near] / GRAVITY,
        color="black",
        linewidth=1.6,
        label=tested_in(dataset).removesuffix(", ") or "best match",
    )
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + _FOR_LEGEND * (high - low))
    panel.legend(loc="upper right", fontsize=7)
    panel.set_xlim(max(float(time[0]), centre - half), min(float(time[-1]), centre + half))
    panel.set_ylabel("ground  [g]")


def _words(dataset: xr.Dataset) -> str:
    return (
        f"{dataset['record_id'].item()}: {wavelet_in(dataset)}, "
        f"a_p = {float(dataset['a_p']) / GRAVITY:.3f} g, "
        f"T_p = {float(dataset['T_p']):.3f} s, match index {float(dataset['best_match']):.3f}, "
        f"{tested_in(dataset)}"
        f"PGA {float(dataset['pga']) / GRAVITY:.2f} g."
    )
