"""The screening of a run on the report page: fragility, rates, ranking, design."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, starmap
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from rockframe.results.screening.table import screen_rows, screen_summary, with_its_limits
from rockframe.risk import LimitState, Outcome, measure_of

#: Size of the plotting area of a curve, and number of motions in the ranking.
WIDTH, HEIGHT = 300, 130
_MOTIONS: Final = 10


@dataclass(frozen=True)
class Plot:
    """A plot of probabilities, as paths of SVG.

    Parameters
    ----------
    title, low, high : str
        Quantity, and the ends of its axis.
    curves : tuple of (str, str)
        Name and path of each curve.
    bands : tuple of str
        Path of the confidence band of each curve, or "".
    points : tuple of tuple of (float, float)
        Centres of the observed shares of each curve.
    """

    title: str
    low: str
    high: str
    curves: tuple[tuple[str, str], ...]
    bands: tuple[str, ...] = ()
    points: tuple[tuple[tuple[float, float], ...], ...] = ()


def screening_content(screening: xr.Dataset) -> dict[str, Any]:
    """Return the content of the section on the screening.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`.
    """
    structures = [str(name) for name in screening["structure"].values]
    rows = list(islice(screen_rows(screening), _MOTIONS * len(structures)))
    width = len(structures)
    return {
        "motions": screening.sizes["record"],
        "recordings": len(np.unique(screening["cluster"].values)),
        "scales": screening.sizes["scale"],
        "reference": float(screening["reference_scale"]),
        "structures": structures,
        "summary": screen_summary(screening),
        "fragility": [
            (name, _fragility(with_its_limits(screening.sel(structure=name))))
            for name in structures
        ],
        "ranking": [rows[i : i + width] for i in range(0, len(rows), width)],
        "design": _design(screening) if "design_share" in screening else None,
        "size": (WIDTH, HEIGHT),
    }


def _fragility(one: xr.Dataset) -> list[Plot]:
    plots = []
    for name in one["measure"].values:
        fit, measure = one.sel(measure=name), measure_of(str(name))
        if int(fit["fragility_outcome"][0]) == Outcome.UNKNOWN:
            continue
        x = np.log(fit["fragility_intensity"].values)
        across = (x - x[0]) / (x[-1] - x[0])
        dots = (np.log(fit["bin_intensity"].values) - x[0]) / (x[-1] - x[0])
        curves, bands, points = [], [], []
        for limit in fit["limit_state"].values:
            state = fit.sel(limit_state=limit)
            words = LimitState.named(str(limit)).words
            low, high = state["fragility_low"].values, state["fragility_high"].values
            curves.append((words, _path(across, state["fragility"].values)))
            outline = np.append(across, across[::-1]), np.append(low, high[::-1])
            bands.append(f"{_path(*outline)}Z")
            shares = zip(dots, state["bin_share"].values, strict=True)
            points.append(tuple(_place(*share) for share in shares if np.isfinite(share).all()))
        low_end, high_end = (f"{np.exp(end) / measure.printed:.2g}" for end in (x[0], x[-1]))
        title = f"{measure.symbol} [{measure.unit}]"
        plots.append(Plot(title, low_end, high_end, tuple(curves), tuple(bands), tuple(points)))
    return plots


def _design(screening: xr.Dataset) -> dict[str, Any]:
    values, unit = screening["design_value"].values, screening["design_value"].attrs["units"]
    across = (values - values[0]) / (values[-1] - values[0])
    quantity, limit = str(screening["design_quantity"].item()), float(screening["design_limit"])
    what = str(screening["design_dimension"].item()).replace("_", " ")
    return {
        "what": what,
        "unit": "" if unit == "1" else unit,
        "limit": LimitState(quantity, limit).words.replace("≥", "<"),
        "share": float(screening["design_required_share"]),
        "plot": Plot(
            f"{what}{'' if unit == '1' else f' [{unit}]'}",
            f"{values[0]:g}",
            f"{values[-1]:g}",
            tuple(
                (str(name), _path(across, share))
                for name, share in zip(
                    screening["structure"].values, screening["design_share"].values, strict=True
                )
            ),
        ),
    }


def _path(x: ArrayLike, y: ArrayLike) -> str:
    """Return the path through points from 0 to 1; "" without a curve."""
    points: NDArray[np.float64] = np.stack([np.asarray(x), np.asarray(y)], axis=1)
    if not np.isfinite(points).all():
        return ""
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in starmap(_place, points.tolist()))


def _place(x: float, y: float) -> tuple[float, float]:
    return round(WIDTH * x, 1), round(HEIGHT * (1.0 - y), 1)
