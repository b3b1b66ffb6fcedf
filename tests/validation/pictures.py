"""The figures of docs/validation.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

#: Resolution [dots per inch], and colours of the main structures.
_DOTS: Final = 110
_COLOURS: Final = ("#1f5fa8", "#c4622d")


def draw_motions(
    peaks: Mapping[str, NDArray[np.float64]],
    classes: Sequence[tuple[float, float, float, float]],
    path: Path,
) -> None:
    """Draw quantiles of peaks against quantiles, and outcomes against shares.

    Parameters
    ----------
    peaks : mapping of str to array, shape (pairs, 2)
        Peaks of |theta| over the slenderness in OpenSees and in the package [1], by structure.
    classes : sequence of tuple
        Mean share here, share that overturns in OpenSees, and its interval, of each class [1].
    path : Path
        File of the figure.
    """
    figure = Figure(figsize=(7.6, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    for (name, values), colour in zip(peaks.items(), _COLOURS, strict=False):
        theirs, ours = np.sort(values[:, 0]), np.sort(values[:, 1])
        left.loglog(theirs, ours, "o", color=colour, markersize=3.0, label=name)
    ends = (0.01, 12.0)
    left.plot(ends, ends, color="0.5", linewidth=0.8)
    left.set(
        xlim=ends,
        ylim=ends,
        xlabel="quantiles of the peak |θ|/α, OpenSees\n(overturned: 10)",
        ylabel="the same, rockframe",
    )
    left.legend(frameon=False)
    share, count, low, high = np.array(classes).T
    right.errorbar(
        100.0 * share,
        100.0 * count,
        yerr=100.0 * np.array([count - low, high - count]),
        fmt="o",
        color=_COLOURS[0],
        capsize=3.0,
    )
    right.plot((0.0, 100.0), (0.0, 100.0), color="0.5", linewidth=0.8)
    right.set(
        xlabel="mean share that overturns, rockframe [%]",
        ylabel="overturn in OpenSees [%]",
    )
    figure.savefig(path, dpi=_DOTS, metadata={"Software": None})


def draw_contact(
    shortenings: Sequence[float],
    ratios: Mapping[str, NDArray[np.float64]],
    restitutions: Mapping[str, NDArray[np.float64]],
    rigid: float,
    path: Path,
) -> None:
    """Draw peaks and restitution of the bent over the shortening of the contact.

    Parameters
    ----------
    shortenings : sequence of float
        Shortenings [m].
    ratios, restitutions : mapping of str to array, shape (pulses, shortenings)
        Peaks over those of the package, and velocity ratios of impacts [1], by kind of contact.
    rigid : float
        Velocity ratio of eq (43) [1].
    path : Path
        File of the figure.
    """
    figure = Figure(figsize=(7.6, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, values in ((left, ratios), (right, restitutions)):
        for (label, rows), colour in zip(values.items(), _COLOURS, strict=False):
            _band(axes, 1e3 * np.array(shortenings), rows, colour, label)
        axes.set(xscale="log", xlabel="shortening of the contact [mm]")
    left.axhline(1.0, color="0.5", linewidth=0.8)
    left.set(ylabel="peak |θ|, OpenSees over rockframe")
    right.axhline(rigid, color="0.5", linewidth=0.8)
    right.set(ylabel="velocity ratio of impacts")
    left.legend(frameon=False)
    figure.savefig(path, dpi=_DOTS, metadata={"Software": None})


def _band(
    axes: Axes, across: NDArray[np.float64], rows: NDArray[np.float64], colour: str, label: str
) -> None:
    known = np.isfinite(rows).any(axis=0)
    across, rows = across[known], rows[:, known]
    axes.plot(across, np.nanmedian(rows, axis=0), "o-", color=colour, label=label, markersize=4.0)
    axes.fill_between(
        across, np.nanmin(rows, axis=0), np.nanmax(rows, axis=0), color=colour, alpha=0.15
    )
