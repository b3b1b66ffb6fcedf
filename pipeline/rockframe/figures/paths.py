"""The path of the deck in plan, under both horizontal directions of a ground motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rockframe.figures.captioned import DRAWN_TO, PAGE_WIDTH, Captioned, label_of, styled

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: Structures side by side.
_ACROSS = 3


def draw_paths(histories: Sequence[Dataset], title: str) -> Captioned:
    """Draw the path of the deck of each structure, seen from above.

    Parameters
    ----------
    histories : sequence of Arrays or xarray.Dataset
        As returned by ``open_response(...).history`` or ``.sel`` for a motion in both directions,
        one for each structure.
    title : str
        Name of the motion.
    """
    columns = min(_ACROSS, len(histories))
    rows = -(-len(histories) // columns)
    with styled():
        size = PAGE_WIDTH, 0.5 + rows * PAGE_WIDTH / _ACROSS
        figure = Figure(figsize=size, layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for panel, history in zip(panels, histories, strict=False):
            _draw_path(panel, history)
        for panel in panels[len(histories) :]:
            panel.set_visible(False)
        figure.suptitle(label_of(title), x=0.01, ha="left", fontsize=10, fontweight="bold")
    return Captioned(
        figure,
        f"Path of the deck under {title}",
        "Displacement of the deck relative to the ground, seen from above, of each structure as "
        "given (nominal), until it falls or the record ends: u_x along the first component of "
        "the motion, u_y along the second. The dot is where it stands at rest, the cross the "
        "largest displacement. Axes have one scale in both directions.",
    )


def _draw_path(panel: Axes, history: Dataset) -> None:
    falling = history["theta"].values > DRAWN_TO * float(history["slenderness"].values)
    x, y = (np.where(falling, np.nan, 100.0 * history[name].values) for name in ("u_x", "u_y"))
    panel.plot(x, y, linewidth=0.7)
    panel.plot(0.0, 0.0, ".", color="black")
    length = np.hypot(x, y)
    if np.isfinite(length).any():
        furthest = int(np.nanargmax(length))
        panel.plot(x[furthest], y[furthest], "x", color="C3")
        reach = 1.08 * float(max(length[furthest], 0.1))
        panel.set(xlim=(-reach, reach), ylim=(-reach, reach))
    panel.set_aspect("equal")
    panel.set_title(label_of(str(history["structure"].values)), fontsize=9)
    panel.set(xlabel="$u_x$ [cm]", ylabel="$u_y$ [cm]")
