"""Values of the variables of screen.nc, except the scenarios: motions, statistics, hazard,
design.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockframe.results.schema import SCREEN_NC
from rockframe.results.schema.screen import OUTCOMES, UNITS_OF_MEASURES
from rockframe.risk import Band, Fragility, HazardCurve, OverturningRate, period_of
from rockframe.risk.limits import QUANTITIES
from rockframe.rocking import Design, DesignResult

Float = NDArray[np.float64]


def motion_values(
    names: Sequence[str],
    sources: Sequence[tuple[str, str]],
    clusters: NDArray[np.int64],
    numbers: Mapping[str, Float],
) -> dict[str, Any]:
    """Return the metadata and measures of each motion, along ``record``.

    Parameters
    ----------
    names : sequence of str
        Identifiers.
    sources : sequence of (str, str)
        Event and station of each.
    clusters : array of int, shape (motions,)
        Motions with the same number belong to one recording, so they are not independent.
    numbers : mapping of str to array, shape (motions,)
        As in `RecordMetadata.numbers`, and spectral accelerations by the names of their measures.
    """
    spectra = {period_of(name): values for name, values in numbers.items() if period_of(name)}
    spectrum = {
        "spectral_acceleration": np.array([*spectra.values()]).T,
        "spectral_period": [*spectra],
    }
    return {
        "record_id": names,
        "event": [event for event, _ in sources],
        "station": [station for _, station in sources],
        "cluster": clusters,
        **{name: values for name, values in numbers.items() if not period_of(name)},
        **(spectrum if spectra else {}),
    }


def demand_values(
    reference: float, ranks: Float, levels: Float, bands: Sequence[Band], counts: NDArray[np.int64]
) -> dict[str, Any]:
    """Return ranks, distributions of peaks and counts of verdicts.

    Parameters
    ----------
    reference : float
        Scale at which ranks and distributions are computed [1].
    ranks : array, shape (motions, structures)
        Ranks; 1 is the most severe motion.
    levels : array, shape (levels,)
        Levels of |theta| / alpha [1].
    bands : sequence of Band
        Distribution of each structure.
    counts : array of int, shape (structures, scales, verdicts)
        Numbers of motions by verdict.
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
        First motion of each recording.
    percentiles : array, shape (3, recordings, structures)
        RotD00, RotD50 and RotD100 of |theta| / alpha [1]; infinite for structures that overturn.
    """
    parts = ("rotd00", "rotd50", "rotd100")
    return {
        "recording": names,
        **{
            f"{name}_peak_rotation_ratio": row for name, row in zip(parts, percentiles, strict=True)
        },
    }


def fragility_values(
    fits: Sequence[Sequence[Mapping[str, Fragility]]],
    better: Sequence[tuple[str, str]],
    points: Mapping[str, Float],
) -> dict[str, Any]:
    """Return fragility curves of each structure over each measure.

    Parameters
    ----------
    fits : sequence of sequence of mapping of str to Fragility
        Fits for each structure and limit state, by measure.
    better : sequence of (str, str)
        For each structure, the better measure (or "") and the reason.
    points : mapping of str to array, shape (points,)
        Intensities of each measure at which the curves are given; NaN if the measure is unknown.
    """
    rows = [[[fit[name] for name in points] for fit in each] for each in fits]
    return {
        "measure": list(points),
        "measure_units": [UNITS_OF_MEASURES.get(name, "m s-2") for name in points],
        **SCREEN_NC.filled("fit", rows),
        "log_likelihood": [[[_total(fit) for fit in row] for row in each] for each in rows],
        **_bounds(rows, "median"),
        **_bounds(rows, "lognormal_beta"),
        **_curves(rows, [*points.values()]),
        "better_measure": [name for name, _ in better],
        "better_measure_reason": [why for _, why in better],
    }


def _bounds(rows: list[list[list[Fragility]]], name: str) -> dict[str, Any]:
    both = np.array([[[getattr(f, f"{name}_band") for f in row] for row in s] for s in rows])
    return {f"fragility_{name}_low": both[..., 0], f"fragility_{name}_high": both[..., 1]}


def _curves(rows: list[list[list[Fragility]]], grid: list[Float]) -> dict[str, Any]:
    curves = np.array(
        [
            [[(f.probability(x), *f.band(x)) for f, x in zip(row, grid, strict=True)] for row in s]
            for s in rows
        ]
    )
    names = ("fragility", "fragility_low", "fragility_high")
    values = {name: curves[..., k, :] for k, name in enumerate(names)}
    return {"fragility_intensity": grid, **values}


def observed_values(
    observed: Sequence[Sequence[Mapping[str, tuple[Float, Float]]]],
) -> dict[str, Any]:
    """Return the shares that reach each limit state in classes of intensity, by measure."""
    both = np.array([[[*row.values()] for row in each] for each in observed])
    return {"bin_intensity": both[:, 0, :, 0], "bin_share": both[:, :, :, 1]}


def _total(fit: Fragility) -> float:
    return float(fit.log_likelihood.sum()) if fit.log_likelihood.size else float("nan")


def hazard_values(curve: HazardCurve, rates: Sequence[Sequence[OverturningRate]]) -> dict[str, Any]:
    """Return the hazard of the site, and the rates of each structure and limit state."""
    return {
        "hazard_measure": curve.measure,
        "hazard_intensity": curve.intensity,
        "hazard_rate": curve.rate,
        **SCREEN_NC.filled("rate", list(rates)),
    }


def design_values(design: Design, shares: Float, found: Sequence[DesignResult]) -> dict[str, Any]:
    """Return the scan of a design; shares of shape (structures, steps)."""
    return {
        "design_dimension": design.dimension,
        "design_quantity": design.quantity,
        "design_limit": design.limit,
        "design_required_share": design.share,
        "design_value": design.values,
        "design_share": shares,
        **SCREEN_NC.filled("found", list(found)),
    }


def design_units(design: Design) -> dict[str, str]:
    """Return the units of the variables of a design that allow two units."""
    two = (one for one in SCREEN_NC.variables if one.also_units == "1")
    ratio = design.dimension == "mass_ratio"
    limit = {"design_limit": QUANTITIES[design.quantity][2].replace("/s", " s-1") or "1"}
    return {one.name: one.also_units if ratio else one.units for one in two} | limit
