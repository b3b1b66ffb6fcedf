"""Drift, lift and base shear of a rocking bridge and alternatives, in the style of Figure 11."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rockframe.figures.captioned import PAGE_WIDTH, Captioned, styled, time_limits
from rockframe.oscillators.comparison import Validity

#: Time that is drawn after the last visible drift [s], and the share of the largest drift that is
#: visible.
_MARGIN: Final = 2.0
_VISIBLE: Final = 0.1
_OSCILLATORS: Final = ("isolated", "fixed")
#: A falling bridge is drawn up to this multiple of the largest drift of the others.
_FALLING: Final = 1.3
_PANELS: Final = (
    ("u", 100.0, "drift  u [cm]"),
    ("v", 100.0, "lift  v [cm]"),
    ("base_shear", 1.0, "base shear / W"),
)


def draw_comparison(histories: xr.Dataset) -> Captioned:
    """Draw the histories of all models of one structure under one record.

    Parameters
    ----------
    histories : Dataset
        As returned by `read_histories` of a comparison.
    """
    record, structure = (str(histories[name].item()) for name in ("record_id", "structure"))
    time = histories["time"].values
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 6.0), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True, height_ratios=(1.3, 0.8, 1.2))
        handles = []
        reach = _largest_drift(histories)
        for k, model in enumerate(histories["model"].values):
            one = histories.isel(model=k)
            drawn = np.nan_to_num(np.abs(one["u"].values), nan=np.inf) <= _FALLING * reach
            last = time.size if drawn.all() else int(np.argmin(drawn))
            dashes: Literal["--", "-"] = "--" if model in _OSCILLATORS else "-"
            for panel, (name, factor, _) in zip(panels, _PANELS, strict=True):
                panel.plot(
                    time[:last], factor * one[name].values[:last], color=f"C{k}", linewidth=0.8,
                    linestyle=dashes,
                )  # fmt: skip
            ended = Validity(int(one["validity"]))
            when = float(one["valid_until"])
            if np.isfinite(when) and when <= time[-1]:
                at = min(int(np.searchsorted(time, when)), max(last - 1, 0))
                panels[0].plot(time[at], 100.0 * one["u"].values[at], "x", color=f"C{k}")
            at_time = f" at {when:.1f} s" if np.isfinite(when) else ""
            end = ended.name.lower().replace("_", " ")
            words = f"{model}: {end}{at_time}" if ended else str(model)
            handles.append(Line2D([], [], color=f"C{k}", label=words, linestyle=dashes))
        for panel, (_, _, label) in zip(panels, _PANELS, strict=True):
            panel.set_ylabel(label)
        panels[0].set_title(f"{structure} under {record}")
        panels[-1].set_xlabel("time [s]")
        panels[-1].set_xlim(*_window(histories))
        figure.align_ylabels(list(panels))
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    title = f"Bridges under {record}"
    caption = (
        f"Drift and lift of the deck of {structure} under record {record}, and the force of the "
        "ground over the weight of deck and columns. Solid: rocking frames; dashed: the same "
        "deck on isolators, and on monolithic columns. A cross marks when the "
        "assumptions of a model fail."
    )
    return Captioned(figure, title, caption)


def _largest_drift(histories: xr.Dataset) -> float:
    """Return the largest drift [m] of bridges that do not overturn, or of all if all overturn."""
    peaks = histories["peak_u"].values
    standing = peaks[np.isfinite(peaks)]
    return float(standing.max() if standing.size else np.nanmax(np.abs(histories["u"].values)))


def _window(histories: xr.Dataset) -> tuple[float, float]:
    """Return the times that are drawn: from the start to shortly after the last visible drift."""
    time = histories["time"].values
    drift = np.nan_to_num(np.abs(histories["u"].values))
    rocking = drift[[str(model) not in _OSCILLATORS for model in histories["model"].values]]
    moving = rocking if rocking.max() > 0.0 else drift
    return time_limits(time, (moving > _VISIBLE * moving.max()).any(axis=0), _MARGIN)
