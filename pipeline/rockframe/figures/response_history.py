"""Accelerogram and response histories of one record, in the style of the paper's Figure 11."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from rockframe.figures.captioned import DRAWN_TO, over_gravity, stated_in, styled, times_gravity
from rockframe.matching.match import PulseMatch
from rockframe.units import GRAVITY

#: Time that is drawn before the first and after the last visible rocking [s]; rotation over
#: slenderness above which rocking is visible [1].
_MARGIN: Final = 3.0
_VISIBLE: Final = 0.005


def draw_response_history(
    acceleration: NDArray[np.float64],
    match: PulseMatch | None,
    histories: Sequence[xr.Dataset],
    title: str,
    *,
    tested: str = "",
) -> Figure:
    """Draw accelerogram, matched pulse, theta/alpha, v and u of one record.

    Parameters
    ----------
    acceleration : array, shape (samples,)
        Ground acceleration [m s-2] at the histories' times.
    match : PulseMatch or None
        The matched pulse, if any.
    histories : sequence of Dataset
        As returned by ``open_response(...).sel``, one for each structure.
    title : str
        First line of the figure.
    tested : str
        Result of the test of the pulse against noise, as `pulse_words` returns it.

    Returns
    -------
    matplotlib.figure.Figure
        Four panels over one time axis.
    """
    with styled():
        size = (7.2, 6.2 + 0.16 * (1 + len(histories)))  # a line of the legend for each structure
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(4, 1, sharex=True, height_ratios=[1.25, 1.25, 1.0, 1.0])
        time = histories[0]["time"].values
        _draw_ground(panels[0], time, acceleration, match, tested)
        for history in histories:
            _draw_structure(panels[1:], history)
        panels[0].set_title(title)
        for panel, label in zip(
            panels[1:], ("rotation  θ/α", "uplift  v [cm]", "drift  u [cm]"), strict=True
        ):
            panel.set_ylabel(label)
        panels[1].axhline(1.0, color="0.6", linewidth=0.8, linestyle=":")
        panels[1].axhline(-1.0, color="0.6", linewidth=0.8, linestyle=":")
        panels[1].set_ylim(*_rotation_limits(histories))
        panels[-1].set_xlabel("time [s]")
        panels[-1].set_xlim(*_window(time, histories))
        figure.align_ylabels(list(panels))
        handles, _ = panels[1].get_legend_handles_labels()
        if any(np.isfinite(history["overturning_time"]) for history in histories):
            falling = f"beyond {DRAWN_TO:g} α, falling: drawn no further"
            handles.append(Line2D([], [], color="0.4", marker="x", linestyle="", label=falling))
        figure.legend(handles=handles, loc="outside lower center")
    return figure


def _draw_ground(
    panel: Axes,
    time: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    match: PulseMatch | None,
    tested: str,
) -> None:
    panel.plot(time, acceleration / GRAVITY, color="0.55", linewidth=0.7, label="ground")
    largest = float(np.abs(acceleration).max())
    if match is not None:
        _draw_pulse(panel, match, tested)
        largest = max(largest, match.pulse.a_p)
    panel.set_ylabel("ground  [g]")
    panel.legend(loc="upper right", ncols=2)
    panel.set_ylim(-1.1 * largest / GRAVITY, 1.45 * largest / GRAVITY)
    metric = panel.secondary_yaxis("right", functions=(times_gravity, over_gravity))
    metric.set_ylabel("[m s$^{-2}$]")


def _draw_pulse(panel: Axes, match: PulseMatch, tested: str) -> None:
    pulse = match.pulse
    reach = pulse.mother.reach * pulse.T_p
    near = np.linspace(pulse.time - reach, pulse.time + reach, 400)
    name = pulse.wavelet.replace("_", " ").replace("ricker", "Ricker")
    label = f"{name}:  $a_p$ = {pulse.a_p / GRAVITY:.2f} g,  $T_p$ = {pulse.T_p:.2f} s, "
    if match.at_period_bound:
        label += "end of range"
    else:
        label += f"match {match.match_index:.2f}" + (f"\n{tested}" if tested else "")
    panel.plot(near, pulse.acceleration(near) / GRAVITY, color="black", linewidth=1.8, label=label)


def _draw_structure(panels: Sequence[Axes], history: xr.Dataset) -> None:
    time = history["time"].values
    ratio = history["theta"].values / float(history["slenderness"])
    drawn = np.isfinite(ratio) & (np.abs(np.nan_to_num(ratio, nan=np.inf)) <= DRAWN_TO)
    end = int(np.argmin(drawn)) if not drawn.all() else drawn.size
    stated = stated_in(history)
    parts = [f"{history['structure'].item()}: {stated.words}"]
    if not stated.overturns:
        parts.append(f"peak θ/α {float(history['peak_rotation_ratio']):.2f}")
    if "critical_scale" in history:
        parts.append(_margin(history))
    label = "; ".join(parts)
    series = (ratio, 100.0 * history["v"].values, 100.0 * history["u"].values)
    for panel, values in zip(panels, series, strict=True):
        (line,) = panel.plot(time[:end], values[:end], label=label)
        if stated.overturns and end > 0:
            panel.plot(time[end - 1], values[end - 1], marker="x", color=line.get_color())


def _margin(history: xr.Dataset) -> str:
    critical = float(history["critical_scale"])
    if np.isfinite(critical):
        return f"critical scale {critical:.2f}"
    return f"critical scale > {float(history['largest_scale']):.3g}"


def _rotation_limits(histories: Sequence[xr.Dataset]) -> tuple[float, float]:
    furthest = max(min(float(h["peak_rotation_ratio"]), DRAWN_TO) for h in histories)
    furthest = max(1.08 * furthest, 0.02)
    return -furthest, furthest


def _window(time: NDArray[np.float64], histories: Sequence[xr.Dataset]) -> tuple[float, float]:
    moving = np.zeros(time.size, dtype=bool)
    for history in histories:
        ratio = np.abs(history["theta"].values) / float(history["slenderness"])
        moving |= np.nan_to_num(ratio) > _VISIBLE
    if not moving.any():
        return float(time[0]), float(time[-1])
    first, last = np.flatnonzero(moving)[[0, -1]]
    return max(float(time[0]), time[first] - _MARGIN), min(float(time[-1]), time[last] + _MARGIN)
