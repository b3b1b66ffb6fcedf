"""The variables of screen.nc besides the scenarios: of motions and statistics of verdicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockframe.results.schema import SCREEN_NC
from rockframe.results.schema.screen import OUTCOMES, UNITS_OF_MEASURES
from rockframe.risk import MEASURES, Band, Fragility

Float = NDArray[np.float64]


def motion_values(
    names: Sequence[str],
    sources: Sequence[tuple[str, str]],
    clusters: NDArray[np.int64],
    numbers: Mapping[str, Float],
) -> dict[str, Any]:
    """Return what is known of each motion, along ``record``.

    Parameters
    ----------
    names : sequence of str
        Identifiers.
    sources : sequence of (str, str)
        Event and station of each.
    clusters : array of int, shape (motions,)
        Motions of one number are not independent.
    numbers : mapping of str to array, shape (motions,)
        As in `Facts.numbers`.
    """
    return {
        "record_id": names,
        "event": [event for event, _ in sources],
        "station": [station for _, station in sources],
        "cluster": clusters,
        **numbers,
    }


def demand_values(
    reference: float, ranks: Float, levels: Float, bands: Sequence[Band], counts: NDArray[np.int64]
) -> dict[str, Any]:
    """Return ranks, distributions of peaks and counts of verdicts.

    Parameters
    ----------
    reference : float
        Scale that ranks and distributions are of [1].
    ranks : array, shape (motions, structures)
        1 is the most severe.
    levels : array, shape (levels,)
        Of |theta| / alpha [1].
    bands : sequence of Band
        Of each structure.
    counts : array of int, shape (structures, scales, verdicts)
        How many motions have each verdict.
    """
    return {
        "reference_scale": reference,
        "demand_rank": ranks,
        "mean_rank": ranks.mean(axis=1),
        "level": levels,
        **SCREEN_NC.filled("band", list(bands)),
        "verdict_count": counts,
        "outcome": OUTCOMES,
    }


def azimuth_values(names: Sequence[str], percentiles: Float) -> dict[str, Any]:
    """Return the percentiles over azimuths of each recording.

    Parameters
    ----------
    names : sequence of str
        Its first motion.
    percentiles : array, shape (3, recordings, structures)
        RotD00, RotD50 and RotD100 of |theta| / alpha [1]; infinite where it overturns.
    """
    parts = ("rotd00", "rotd50", "rotd100")
    return {
        "recording": names,
        **{
            f"{name}_peak_rotation_ratio": row for name, row in zip(parts, percentiles, strict=True)
        },
    }


def fragility_values(
    fits: Sequence[Mapping[str, Fragility]],
    better: Sequence[tuple[str, str]],
    points: Mapping[str, Float],
) -> dict[str, Any]:
    """Return fragility curves of each structure over each measure.

    Parameters
    ----------
    fits : sequence of mapping of str to Fragility
        Of each structure, by measure.
    better : sequence of (str, str)
        The better measure for each structure, if one can be named, and why (not).
    points : mapping of str to array, shape (points,)
        Intensities of each measure at which the curves are given; NaN if it is unknown.
    """
    rows = [[fit[name] for name in MEASURES] for fit in fits]
    return {
        "measure": list(MEASURES),
        "measure_units": [UNITS_OF_MEASURES[name] for name in MEASURES],
        **SCREEN_NC.filled("fit", rows),
        "log_likelihood": [[_total(fit) for fit in row] for row in rows],
        **_curves(rows, [points[name] for name in MEASURES]),
        "better_measure": [name for name, _ in better],
        "better_measure_reason": [why for _, why in better],
    }


def _curves(rows: list[list[Fragility]], grid: list[Float]) -> dict[str, Any]:
    bands = [[fit.band(x) for fit, x in zip(row, grid, strict=True)] for row in rows]
    return {
        "fragility_intensity": grid,
        "fragility": [
            [fit.probability(x) for fit, x in zip(row, grid, strict=True)] for row in rows
        ],
        "fragility_low": [[low for low, _ in row] for row in bands],
        "fragility_high": [[high for _, high in row] for row in bands],
    }


def observed_values(
    observed: Sequence[Mapping[str, tuple[Float, Float]]],
) -> dict[str, Any]:
    """Return the shares that overturn in classes of intensity, of each structure, by measure."""
    centre, share = (
        [[row[name][part] for name in MEASURES] for row in observed] for part in (0, 1)
    )
    return {"bin_intensity": centre, "bin_share": share}


def _total(fit: Fragility) -> float:
    return float(fit.log_likelihood.sum()) if fit.log_likelihood.size else float("nan")
