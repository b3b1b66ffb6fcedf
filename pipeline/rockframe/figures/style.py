"""The style of all figures, and saving them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from rockframe.provenance import whole_file
from rockframe.units import GRAVITY

#: Widths of a printed column and of a page [inch]: 85 mm and 178 mm.
PRINT_WIDTH: Final = 3.35
PAGE_WIDTH: Final = 7.0
#: Line styles: curves must also differ when printed in grey.
LINES: Final = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))

#: Rotations are drawn up to this multiple of the slenderness [1]: drawing the fall would flatten
#: the histories of frames that stand.
DRAWN_TO: Final = 1.3

_PERIOD_TICKS: Final = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
_STYLE: Final = Path(__file__).parent / "style.mplstyle"


@contextmanager
def styled() -> Iterator[None]:
    """Apply the style while a figure is drawn or saved."""
    with mpl.rc_context(fname=_STYLE), warnings.catch_warnings():
        # Letters that the font lacks are drawn as boxes; the file of the caption has them.
        warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font", UserWarning)
        yield


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, completely or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with styled(), whole_file(path) as partial:
        figure.savefig(partial, format="png", metadata={"Software": None})


def times_gravity(acceleration: ArrayLike) -> ArrayLike:
    """Convert accelerations from g to m s-2, for the second axis of a panel."""
    return np.asarray(acceleration) * GRAVITY


def over_gravity(acceleration: ArrayLike) -> ArrayLike:
    """Convert accelerations from m s-2 to g."""
    return np.asarray(acceleration) / GRAVITY


def period_ticks(axis: Axis, low: float, high: float) -> None:
    """Set plain ticks on a logarithmic axis of periods [s]."""
    ticks = [tick for tick in _PERIOD_TICKS if low <= 1.001 * tick and tick <= 1.001 * high]
    axis.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    axis.minorticks_off()
