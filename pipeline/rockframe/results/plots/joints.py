"""Datasets of figures of one record and structure: its rocking and its joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.declare import variable
from rockframe.rocking import (
    GroundAcceleration,
    Response,
    barrier_rate,
    column_forces,
    impact_friction_demand,
    least_spacing,
    reactions,
    respond,
    restoring_moment,
    trajectory,
)
from rockframe.rocking.response import as_ground

#: The curves of moment and barrier go to this multiple of the slenderness.
_CURVES_TO: Final = 1.3


def portrait_dataset(
    record: Record, frame: RockingFrame, motion: GroundAcceleration | None = None
) -> xr.Dataset:
    """Return the path of a frame over its rotation: moment and rate, with the jumps of impacts.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame.
    motion : GroundAcceleration, optional
        What moves it, if that is more than the record: with vertical acceleration.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> frame = RockingFrame(height=9.6, width=1.6, name="bent")
    >>> portrait_dataset(record, frame)["rate"].attrs["units"]
    'rad s-1'
    """
    ground = as_ground(motion or record)
    response = respond(frame, ground)
    theta, omega = trajectory(response)
    reach = _CURVES_TO * frame.slenderness
    edge = 1e-12 * frame.slenderness  # both sides of the jump of the moment at 0
    exact = (-frame.slenderness, -edge, edge, frame.slenderness)
    curve = np.union1d(np.linspace(-reach, reach, 401), exact)
    variables = {
        "rate": variable("obs", omega, "rad s-1", "rate of rotation"),
        "restoring_moment": variable(
            "obs", restoring_moment(frame, theta), "1", "restoring moment over that of uplift"
        ),
        "curve_moment": variable(
            "curve", restoring_moment(frame, curve), "1", "restoring moment over that of uplift"
        ),
        "curve_barrier": variable(
            "curve", barrier_rate(frame, curve), "rad s-1", "rate that overturns on still ground"
        ),
        "impact_rate": variable(
            "impact", response.impact_velocities, "rad s-1", "rate just before an impact"
        ),
    }
    coordinates = {
        "rotation": variable("obs", theta, "rad", "rotation of the columns"),
        "curve_rotation": variable("curve", curve, "rad", "rotation of the columns"),
    }
    variables |= _of_pair(record, frame, response)
    return xr.Dataset(variables, coordinates, {"vertical": int(ground.vertical is not None)})


def joints_dataset(
    record: Record,
    frame: RockingFrame,
    motion: GroundAcceleration | None = None,
    *,
    spacing: float | None = None,
    beam_centre: float = 0.0,
) -> xr.Dataset:
    """Return friction demand and vertical forces at the joints of a frame, with their extremes.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame.
    motion : GroundAcceleration, optional
        What moves it, if that is more than the record: with vertical acceleration.
    spacing : float, optional
        Distance between the axes of two columns [m]: adds the forces of each, if there is a beam.
    beam_centre : float
        Height of the beam's centre of mass above its underside [m].

    Raises
    ------
    ParameterError
        If the columns overlap.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
    >>> joints = joints_dataset(record, frame, spacing=12.0, beam_centre=1.0)
    >>> joints["column_top_vertical"].dims
    ('column', 'time')
    """
    ground = as_ground(motion or record)
    response = respond(frame, ground)
    forces = reactions(response, ground)
    weight = 1.0 + frame.mass_ratio
    variables = {
        "acceleration": variable("time", ground.acceleration(), "m s-2", "ground acceleration"),
        "theta": variable("time", response.theta, "rad", "rotation of the columns"),
        "base_friction_demand": variable(
            "time", forces.base_friction_demand, "1", "base shear over vertical base reaction"
        ),
        "top_friction_demand": variable(
            "time", forces.top_friction_demand, "1", "shear over compression under the beam"
        ),
        "base_vertical": variable(
            "time", forces.base_vertical / weight, "1", "vertical base reaction over the weight"
        ),
        "impact_friction_demand": variable(
            (), impact_friction_demand(frame), "1", "friction that each impact needs"
        ),
        "uplift_friction_demand": variable(
            (), math.tan(frame.slenderness), "1", "friction that uplift needs, tan(alpha)"
        ),
    }
    if spacing is not None and frame.mass_ratio > 0.0:
        variables |= _of_columns(response, ground, spacing, beam_centre)
    variables |= _extremes(variables) | _of_pair(record, frame, response)
    time = variable("time", response.time, "s", "time since the record's first sample")
    attributes = {"vertical": int(ground.vertical is not None)}
    return xr.Dataset(variables, {"time": time}, attributes)


def _of_columns(
    response: Response, ground: GroundAcceleration, spacing: float, beam_centre: float
) -> dict[str, xr.Variable]:
    """Return the forces of each of two columns; the half weight of the beam is gamma m_c g."""
    each = column_forces(response, ground, spacing=spacing, beam_centre=beam_centre)
    pairs = ("column", "time")
    return {
        "column_base_friction_demand": variable(
            pairs, each.base_friction_demand, "1", "base shear of a column over its reaction"
        ),
        "column_top_friction_demand": variable(
            pairs, each.top_friction_demand, "1", "shear over compression on top of a column"
        ),
        "column_top_vertical": variable(
            pairs,
            each.top_vertical / response.frame.mass_ratio,
            "1",
            "compression under the beam over its half weight",
        ),
        "spacing": variable((), spacing, "m", "distance between the axes of the columns"),
        "beam_centre": variable(
            (), beam_centre, "m", "height of the beam's centre of mass above its underside"
        ),
        "least_spacing": variable(
            (),
            least_spacing(response.frame, beam_centre),
            "m",
            "spacing at which impacts lift the beam",
        ),
    }


def _extremes(variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Return the largest demands and least vertical forces of the history; NaN if unknown."""
    found = {}
    for name, values in variables.items():
        if "time" not in values.dims or not name.endswith(("friction_demand", "vertical")):
            continue
        known = values.values[~np.isnan(values.values)]
        largest = name.endswith("friction_demand")
        extreme = np.nan if known.size == 0 else known.max() if largest else known.min()
        word = "largest" if largest else "least"
        found[f"{word}_{name}"] = variable((), extreme, "1", f"{word} {values.attrs['long_name']}")
    return found


def _of_pair(record: Record, frame: RockingFrame, response: Response) -> dict[Any, xr.Variable]:
    """Return what captions state of the record, the structure and the response."""
    values = {
        **RESPONSE_NC.filled("frame", [frame]),
        **RESPONSE_NC.filled("response", [[response]]),
        "record_id": [record.record_id],
        "structure": [frame.name],
    }
    known = RESPONSE_NC.dataset(values).isel(record=0, structure=0)
    pga = variable((), np.abs(record.acceleration).max(), "m s-2", "largest acceleration")
    return {**known.variables, "pga": pga}
