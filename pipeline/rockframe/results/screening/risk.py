"""The variables of screen.nc that follow from a hazard curve or a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockframe.results.schema import SCREEN_NC
from rockframe.risk import HazardCurve, OverturningRate
from rockframe.rocking import Design, Found

Float = NDArray[np.float64]


def hazard_values(curve: HazardCurve, rates: Sequence[Sequence[OverturningRate]]) -> dict[str, Any]:
    """Return the hazard of the site, and the rates of each structure and limit state."""
    return {
        "hazard_measure": curve.measure,
        "hazard_intensity": curve.intensity,
        "hazard_rate": curve.rate,
        **SCREEN_NC.filled("rate", list(rates)),
    }


def design_values(design: Design, shares: Float, found: Sequence[Found]) -> dict[str, Any]:
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
    """Return the units of the variables of a design that have two."""
    two = (one for one in SCREEN_NC.variables if one.also_units == "1")
    ratio = design.dimension == "mass_ratio"
    limit = {"design_limit": "1" if design.quantity == "rotation_ratio" else "m"}
    return {one.name: one.also_units if ratio else one.units for one in two} | limit
