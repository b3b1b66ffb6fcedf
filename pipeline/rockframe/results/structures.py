"""What is known of each structure, along ``structure``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr

from rockframe.frame import RockingFrame
from rockframe.results.variables import variable

#: Numbers of a structure, by variable: unit, long name.
_OF_FRAME: Final = {
    "height": ("m", "height of a column"),
    "width": ("m", "width of a column"),
    "slenderness": ("rad", "slenderness of a column, alpha"),
    "size": ("m", "semi-diagonal of a column, R"),
    "mass_ratio": ("1", "mass of the beam over that of all columns"),
    "frequency_parameter": ("rad s-1", "frequency parameter of a column, p"),
    "effective_frequency_parameter": ("rad s-1", "frequency parameter of the frame, p-hat"),
    "restitution": ("1", "angular velocity after an impact over that before, sqrt(r)"),
    "uplift_acceleration": ("m s-2", "ground acceleration that starts uplift"),
}


def structure_variables(frames: Sequence[RockingFrame]) -> dict[str, xr.Variable]:
    """Return what is known of each structure, along ``structure``."""
    return {
        name: variable(
            "structure", np.array([getattr(frame, name) for frame in frames]), units, long_name
        )
        for name, (units, long_name) in _OF_FRAME.items()
    }
