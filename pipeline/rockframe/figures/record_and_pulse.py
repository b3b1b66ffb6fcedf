"""Records and the pulses in them: Figure 8 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import PRINT_WIDTH, Captioned, styled, tested_in, wavelet_in
from rockframe.units import GRAVITY

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
