"""The summary of a screening: a row for each motion and structure."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.schema.response import ROBUST
from rockframe.risk import LimitState, Measure, Outcome, measure_of, spectral
from rockframe.rocking.response import Verdict
from rockframe.units import GRAVITY

#: Columns of the motion: variable, and what is printed is its value over this.
_OF_MOTION: Final = {
    "event": ("event", None),
    "station": ("station", None),
    "azimuth_degree": ("azimuth", 1.0),
    "magnitude": ("magnitude", 1.0),
    "epicentral_distance_km": ("epicentral_distance", 1.0),
    "vs30_m_s": ("vs30", 1.0),
    "pga_g": ("pga", GRAVITY),
    "pgv_m_s": ("pgv", 1.0),
    "a_p_g": ("a_p", GRAVITY),
    "T_p_s": ("T_p", 1.0),
    "L_p_m": ("L_p", 1.0),
    "mean_rank": ("mean_rank", 1.0),
}
#: Numbers of a fit: in the unit of the measure, and without a unit.
_INTENSITIES: Final = (
    *("median", "median_low", "median_high"),
    *("lowest", "highest", "safe_to", "overturned_from"),
)
_RATIOS: Final = (
    *("lognormal_beta", "lognormal_beta_low", "lognormal_beta_high", "logistic_scale"),
    *("pseudo_r2", "concordance", "brier"),
)


def screen_rows(screening: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Give a row for each motion and structure, at the scale nearest to 1; units in the names.

    The motions are in the order of their mean rank: the most severe first.

    Parameters
    ----------
    screening : Dataset
        What `read_screening` returned.
    """
    reference = float(screening["reference_scale"])
    at = screening
    if "scale" in screening["verdict"].dims:
        at = screening.isel(scale=int(np.flatnonzero(screening["scale"].values == reference)[0]))
    columns = {name: at[name].values for name in at.variables}
    of_motion = _OF_MOTION | {
        spectral(period).column: (f"spectral {k}", GRAVITY)
        for k, period in enumerate(columns.get("spectral_period", ()))
    }
    for k, _ in enumerate(columns.get("spectral_period", ())):
        columns[f"spectral {k}"] = columns["spectral_acceleration"][:, k]
    for i in np.argsort(columns["mean_rank"], kind="stable"):
        motion = {
            column: _value(columns[name][i], over) for column, (name, over) in of_motion.items()
        }
        for k, structure in enumerate(columns["structure"]):
            yield {
                "record_id": str(columns["record_id"][i]),
                "structure": str(structure),
                "scale": reference,
                "verdict": Verdict(int(columns["verdict"][i, k])).name.lower(),
                "peak_rotation_ratio": float(columns["peak_rotation_ratio"][i, k]),
                "u_max_m": float(columns["peak_u"][i, k]),
                "v_max_m": float(columns["peak_v"][i, k]),
                "demand_rank": float(columns["demand_rank"][i, k]),
                **_margins(columns, i, k),
                **motion,
            }


def screen_summary(screening: xr.Dataset) -> list[dict[str, Any]]:
    """Return the results of each structure: fragility, better measure, rate, design.

    Parameters
    ----------
    screening : Dataset
        What `read_screening` returned.
    """
    summary = []
    for structure in screening["structure"].values:
        one = screening.sel(structure=structure)
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


def _margins(columns: dict[Any, Any], i: int, k: int) -> dict[str, Any]:
    if "critical_scale" not in columns:
        return {}
    return {
        "critical_scale": float(columns["critical_scale"][i, k]),
        "safe_islands": int(columns["safe_islands"][i, k]),
        "undecided": bool(columns["undecided"][i, k]),
        **{name: float(columns[name][i, k]) for name in ROBUST if name in columns},
    }


def _value(value: Any, over: float | None) -> Any:
    return str(value) if over is None else float(value) / over
