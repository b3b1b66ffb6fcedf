"""Histories of one structure under several records: Figure 11 of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rockframe.figures.captioned import (
    DRAWN_TO,
    PAGE_WIDTH,
    Captioned,
    of_structure,
    over_gravity,
    stated_in,
    styled,
    times_gravity,
)
from rockframe.units import GRAVITY

#: Number of records side by side; further records are drawn below.
_ACROSS: Final = 3
#: Share of the largest rotation above which rotation is visible [1], and time that is drawn before
#: and after visible rotation [s].
_VISIBLE: Final = 0.01
_MARGIN: Final = 1.5
_LABELS: Final = ("ground [g]", "θ/α", "v [cm]", "u [cm]")
_HEIGHTS: Final = (0.8, 1.0, 0.8, 1.0)


def draw_response_grid(
    accelerations: Mapping[str, NDArray[np.float64]],
    histories: Sequence[xr.Dataset],
    titles: Mapping[str, str],
    *,
    vertical: bool = False,
) -> Captioned:
    """Draw ground acceleration, theta/alpha, v and u of one structure, with a column per record.

    Parameters
    ----------
    accelerations : mapping
        Ground acceleration [m s-2] at the times of the history, by record identifier.
    histories : sequence of Dataset
        As returned by ``open_response(...).sel``, one for each record, of one structure.
    titles : mapping
        Title of each column, by record identifier.
    vertical : bool
        True if the motions include vertical components.
    """
    bands = -(-len(histories) // _ACROSS)
    across = min(_ACROSS, len(histories))
    with styled():
        figure = Figure(figsize=(PAGE_WIDTH, 0.3 + 4.2 * bands), layout="constrained")
        above = None
        for band, part in enumerate(figure.subfigures(bands, 1, squeeze=False)[:, 0]):
            shown = histories[band * across : (band + 1) * across]
            panels = part.subplots(
                4, across, sharex="col", sharey="row", squeeze=False, height_ratios=_HEIGHTS
            )
            if above is not None:  # panels of one kind share one scale
                for panel, other in zip(panels[:, 0], above[:, 0], strict=True):
                    panel.sharey(other)
            above = panels
            for column in range(across):
                if column >= len(shown):
                    for panel in panels[:, column]:
                        panel.set_visible(False)
                    continue
                name = str(shown[column]["record_id"].item())
                _draw_column(panels[:, column], accelerations[name], shown[column])
                panels[0, column].set_title(titles[name], fontsize=8)
                panels[-1, column].set_xlabel("time [s]")
            metric = panels[0, len(shown) - 1].secondary_yaxis(
                "right", functions=(times_gravity, over_gravity)
            )
            metric.set_ylabel("[m s$^{-2}$]")
            for panel, label in zip(panels[:, 0], _LABELS, strict=True):
                panel.set_ylabel(label)
            part.align_ylabels(list(panels[:, 0]))
    return Captioned(
        figure, "Figure 11: histories of the rocking frame", _caption(histories, vertical)
    )


def _draw_column(
    panels: NDArray[np.object_], acceleration: NDArray[np.float64], history: xr.Dataset
) -> None:
    time = history["time"].values
    ratio = history["theta"].values / float(history["slenderness"])
    drawn = np.nan_to_num(np.abs(ratio), nan=np.inf) <= DRAWN_TO
    end = time.size if drawn.all() else int(np.argmin(drawn))
    panels[0].plot(time, acceleration / GRAVITY, color="0.45", linewidth=0.5)
    series = (ratio, 100.0 * history["v"].values, 100.0 * history["u"].values)
    for panel, values in zip(panels[1:], series, strict=True):
        panel.plot(time[:end], values[:end], linewidth=0.9)
    panels[1].annotate(_outcome_words(history), (0.97, 0.96), xycoords="axes fraction", fontsize=7,
                       ha="right", va="top")  # fmt: skip
    _set_window(panels[0], time[:end], np.abs(ratio[:end]))


def _outcome_words(history: xr.Dataset) -> str:
    stated = stated_in(history)
    if stated.overturns:
        return stated.words
    return f"max {float(history['peak_rotation_ratio']):.3f}"


def _set_window(panel: Axes, time: NDArray[np.float64], ratio: NDArray[np.float64]) -> None:
    """Limit the time to that of visible rotation, with a margin."""
    visible = np.flatnonzero(ratio > _VISIBLE * ratio.max(initial=0.0))
    if visible.size:
        first, last = time[visible[0]], time[visible[-1]]
        panel.set_xlim(max(time[0], first - _MARGIN), min(time[-1], last + _MARGIN))


def _caption(histories: Sequence[xr.Dataset], vertical: bool) -> str:
    ground = "Horizontal and vertical" if vertical else "Horizontal"
    parts = []
    for history in histories:
        stated = stated_in(history)
        fate = stated.words
        if not stated.overturns:
            fate += (
                f", θ/α {float(history['peak_rotation_ratio']):.3f}, "
                f"u {100.0 * float(history['peak_u']):.1f} cm, "
                f"v {100.0 * float(history['peak_v']):.2f} cm"
            )
        parts.append(f"{history['record_id'].item()}: {fate}")
    return (
        "Ground acceleration, rotation θ over slenderness α, uplift v and drift u of the beam; "
        "panels of one kind have one scale. "
        f"{of_structure(histories[0])} {ground} ground motion; eq (26), with the "
        "restitution of eq (43) at each impact. Largest values, free rocking after the record "
        f"included: {'; '.join(parts)}."
    )
