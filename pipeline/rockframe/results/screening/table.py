"""The summary of a screening: a row for each motion and structure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.schema.response import ROBUST
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.risk import LimitState, Measure, Outcome, measure_of, spectral

#: Columns of a row with their variables; margins only if the file has them.
_OF_PAIR: Final = columns_of(
    "record_id structure scale=reference_scale verdict peak_rotation_ratio u_max_m=peak_u",
    "v_max_m=peak_v demand_rank",
)
_MARGINS: Final = ("critical_scale", "safe_islands", "undecided", *ROBUST)
_OF_MOTION: Final = columns_of(
    "event station azimuth_degree=azimuth magnitude epicentral_distance_km=epicentral_distance",
    "vs30_m_s=vs30 pga_g=pga pgv_m_s=pgv a_p_g=a_p T_p_s=T_p L_p_m=L_p mean_rank",
)
#: Numbers of a fit, in the unit of the measure and without a unit.
_INTENSITIES: Final = (
    *("median", "median_low", "median_high"),
    *("lowest", "highest", "safe_to", "overturned_from"),
)
_RATIOS: Final = (
    *("lognormal_beta", "lognormal_beta_low", "lognormal_beta_high", "logistic_scale"),
    *("pseudo_r2", "concordance", "brier"),
)


def screen_rows(screening: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Return a row for each motion and structure, at the scale nearest to 1; units in the names.

    Motions are ordered by mean rank, the most severe first.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    if "scale" in screening["verdict"].dims:
        reference = float(screening["reference_scale"])
        at = int(np.flatnonzero(screening["scale"].values == reference)[0])
        screening = screening.isel(scale=at)
    ranked = screening.isel(record=np.argsort(screening["mean_rank"].values, kind="stable"))
    columns = _OF_PAIR | {name: name for name in _MARGINS if name in screening} | _OF_MOTION
    for k, period in enumerate(screening.get("spectral_period", ())):
        column = spectral(float(period)).column
        ranked[column] = ranked["spectral_acceleration"].isel(spectral_period=k)
        columns[column] = column
    return rows_along(ranked, "record structure", columns)


def with_its_limits(one: xr.Dataset) -> xr.Dataset:
    """Return one structure of a screening, without limits of restraints that it does not have."""
    has = (one["fragility_outcome"] != Outcome.ABSENT).all("measure")
    return one.isel(limit_state=np.flatnonzero(has))


def screen_summary(screening: xr.Dataset) -> list[dict[str, Any]]:
    """Return the results of each structure: fragility, better measure, rate, design.

    Parameters
    ----------
    screening : Dataset
        Result of `read_screening`.
    """
    summary = []
    for structure in screening["structure"].values:
        one = with_its_limits(screening.sel(structure=structure))
        said: dict[str, Any] = {
            "structure": str(structure),
            "fragility": [
                _fit(one, str(limit), measure_of(str(measure)))
                for limit in one["limit_state"].values
                for measure in one["measure"].values
            ],
            "better_measure": str(one["better_measure"].item()),
            "better_measure_reason": str(one["better_measure_reason"].item()),
        }
        if "annual_rate" in one:
            said["rates"] = [_rate(one, str(limit)) for limit in one["limit_state"].values]
        if "design_smallest" in one:
            names = ("design_smallest", "design_sure_from")
            said |= {name: float(one[name]) for name in names}
        summary.append(said)
    return summary


def _fit(one: xr.Dataset, limit: str, measure: Measure) -> dict[str, Any]:
    fit = one.sel(measure=measure.name, limit_state=limit)
    outcome = Outcome(int(fit["fragility_outcome"]))
    state = LimitState.named(limit)
    words = state.words if state.quantity else ""
    said = "" if outcome is Outcome.FITTED else outcome.sentence_of(words)
    if outcome is Outcome.SEPARATED:
        safe, fell = (
            float(fit[f"fragility_{name}"]) / measure.printed
            for name in ("safe_to", "overturned_from")
        )
        said += f" ({safe:.3g} to {fell:.3g} {measure.unit})"
    return {
        "limit_state": limit,
        "words": state.words,
        "measure": measure.name,
        "symbol": measure.symbol,
        "unit": measure.unit,
        "outcome": outcome.name.lower(),
        "said": said,
        **{name: float(fit[f"fragility_{name}"]) / measure.printed for name in _INTENSITIES},
        **{name: float(fit[f"fragility_{name}"]) for name in _RATIOS},
        **{
            name: int(fit[f"fragility_{name}"])
            for name in ("motions", "observations", "overturned")
        },
    }


def _rate(structure: xr.Dataset, limit: str) -> dict[str, Any]:
    one = structure.sel(limit_state=limit)
    measure = measure_of(str(one["hazard_measure"].item()))
    rate = float(one["annual_rate"])
    intensity = one["hazard_intensity"].values / measure.printed
    parts = one["disaggregation"].values
    main = "" if np.isnan(parts).any() else _range(intensity, int(parts.argmax()), measure)
    return {
        "limit_state": limit,
        "words": LimitState.named(limit).words,
        "rate_per_year": rate,
        "rate_low_per_year": float(one["annual_rate_low"]),
        "rate_high_per_year": float(one["annual_rate_high"]),
        "return_period_years": 1.0 / rate if rate > 0.0 else math.nan,
        "extrapolated_share": float(one["annual_rate_extrapolated"]),
        "main_intensity": main,
        "disaggregation": [
            {"intensity": _range(intensity, k, measure), "rate_per_year": float(part)}
            for k, part in enumerate(parts)
        ],
    }


def _range(intensity: NDArray[np.float64], k: int, measure: Measure) -> str:
    if k + 1 == intensity.size:
        return f"above {intensity[k]:.3g} {measure.unit}"
    return f"{intensity[k]:.3g} to {intensity[k + 1]:.3g} {measure.unit}"
