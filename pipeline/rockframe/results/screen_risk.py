"""The variables of screen.nc that follow from a hazard curve or a design."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.variables import texts, variable
from rockframe.risk import HazardCurve, OverturningRate
from rockframe.rocking import Design, Found

Float = NDArray[np.float64]


def hazard_variables(
    curve: HazardCurve, rates: Sequence[OverturningRate]
) -> dict[str, xr.Variable]:
    """Return the hazard of the site, and the rates of overturning of each structure."""

    def of_structure(part: str, units: str, long_name: str) -> xr.Variable:
        data = np.array([getattr(rate, part) for rate in rates])
        return variable("structure", data, units, long_name)

    per_year = "year-1"
    return {
        "hazard_measure": texts((), curve.measure, "measure of intensity of the hazard curve"),
        "hazard_intensity": variable(
            "hazard_point", curve.intensity, "1", "intensity, in the unit of the measure"
        ),
        "hazard_rate": variable(
            "hazard_point", curve.rate, per_year, "annual rate of exceedance of the intensity"
        ),
        "overturning_rate": of_structure("rate", per_year, "mean annual rate of overturning"),
        "overturning_rate_low": of_structure("low", per_year, "its lower bound"),
        "overturning_rate_high": of_structure("high", per_year, "its upper bound"),
        "overturning_rate_extrapolated": of_structure(
            "extrapolated", "1", "share of the rate from intensities that were not tried"
        ),
        "disaggregation": variable(
            ("structure", "hazard_point"),
            np.stack([rate.contributions for rate in rates]),
            per_year,
            "part of the rate from intensities between this point and the next; last, above it",
        ),
    }


def design_variables(
    design: Design, shares: Float, found: Sequence[Found]
) -> dict[str, xr.Variable]:
    """Return the scan of a design; shares of shape (structures, steps)."""
    units = "1" if design.dimension == "mass_ratio" else "m"
    return {
        "design_dimension": texts((), design.dimension, "what is looked for"),
        "design_limit": variable((), design.limit, "1", "limit of |theta| / slenderness"),
        "design_required_share": variable((), design.share, "1", "share of motions to stay below"),
        "design_value": variable("design_step", design.values, units, "values that were tried"),
        "design_share": variable(
            ("structure", "design_step"), shares, "1", "share of motions below the limit"
        ),
        "design_smallest": variable(
            "structure",
            np.array([one.smallest for one in found]),
            units,
            "smallest value tried that meets the share",
        ),
        "design_sure_from": variable(
            "structure",
            np.array([one.sure_from for one in found]),
            units,
            "smallest value from which on every value tried meets the share",
        ),
    }
