"""Datasets of figures of one record: its pulse, and the rocking of a structure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.frame import RockingFrame
from rockframe.matching.curve import match_curve, scalogram
from rockframe.matching.match import PulseMatch
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.schema.declare import FileKind, variable
from rockframe.results.schema.plots import JOINTS, MATCH_CURVE, PORTRAIT, PULSE, SCALOGRAM
from rockframe.results.schema.response import RESPONSE_NC
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
from rockframe.signals.processing import peak

#: The curves of moment and barrier extend to this multiple of the slenderness.
_CURVES_TO: Final = 1.3


def portrait_dataset(
    record: Record, frame: RockingFrame, motion: GroundAcceleration | None = None
) -> xr.Dataset:
    """Return moment and rate of a frame against its rotation, with the jumps at impacts.

    Parameters
    ----------
    record : Record
        The ground motion.
    frame : RockingFrame
        The frame.
    motion : GroundAcceleration, optional
        Motion of the ground, if it includes more than the record: with vertical acceleration.

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
        "rate": omega,
        "restoring_moment": restoring_moment(frame, theta),
        "curve_moment": restoring_moment(frame, curve),
        "curve_barrier": barrier_rate(frame, curve),
        "impact_rate": response.impact_velocities,
        "rotation": theta,
        "curve_rotation": curve,
    }
    drawn = _of_pair(PORTRAIT, variables, record, response, ground)
    return drawn.set_coords(["rotation", "curve_rotation"])


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
        Motion of the ground, if it includes more than the record: with vertical acceleration.
    spacing : float, optional
        Distance between the axes of two columns [m]: adds the forces on each column, if there is a
        beam.
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
        "acceleration": ground.acceleration(),
        "theta": response.theta,
        "base_friction_demand": forces.base_friction_demand,
        "top_friction_demand": forces.top_friction_demand,
        "base_vertical": forces.base_vertical / weight,
        "impact_friction_demand": impact_friction_demand(frame),
        "uplift_friction_demand": math.tan(frame.slenderness),
        "time": response.time,
    }
    if spacing is not None and frame.mass_ratio > 0.0:
        each = column_forces(response, ground, spacing=spacing, beam_centre=beam_centre)
        variables |= {
            "column_base_friction_demand": each.base_friction_demand,
            "column_top_friction_demand": each.top_friction_demand,
            # the half weight of the beam is gamma m_c g
            "column_top_vertical": each.top_vertical / frame.mass_ratio,
            "spacing": spacing,
            "beam_centre": beam_centre,
            "least_spacing": least_spacing(frame, beam_centre),
        }
    drawn = _of_pair(JOINTS, variables, record, response, ground)
    return drawn.assign(_extremes(drawn[[name for name in variables if name != "time"]].variables))


def _extremes(variables: Mapping[Any, xr.Variable]) -> dict[str, xr.Variable]:
    """Return the largest demands and smallest vertical forces of the history; NaN if unknown."""
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


def _of_pair(
    kind: FileKind,
    variables: Mapping[str, Any],
    record: Record,
    response: Response,
    ground: GroundAcceleration,
) -> xr.Dataset:
    """Return a dataset with the values that captions state on record, structure and response."""
    frame = response.frame
    values = {
        **RESPONSE_NC.filled("frame", [frame]),
        **RESPONSE_NC.filled("response", [[response]]),
        "structure": [frame.name],
    }
    known = RESPONSE_NC.dataset(values).isel(record=0, structure=0)
    pga = np.abs(record.acceleration).max()
    drawn = kind.dataset({**variables, "record_id": record.record_id, "pga": pga})
    return drawn.assign(known.variables).assign_attrs(vertical=int(ground.vertical is not None))


#: Largest numbers of periods and times in the figure of a transform.
_PERIODS: Final = 160
_TIMES: Final = 1500


def pulse_dataset(record: Record, match: PulseMatch, tested: str = "") -> xr.Dataset:
    """Return the accelerations of a record and its pulse on ``time``.

    Parameters
    ----------
    record : Record
        The record.
    match : PulseMatch
        A pulse in it.
    tested : str
        Result of the pulse's test against noise, as `pulse_words` returns it.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=0.4, time=0.1)
    >>> match = PulseMatch(pulse=pulse, match_index=0.9, at_period_bound=False)
    >>> pulse_dataset(record, match)["pulse"].values.round(3)
    array([-0.378,  3.   , -0.378])
    """
    return PULSE.dataset(
        {
            "acceleration": record.acceleration,
            "pulse": match.pulse.acceleration(record.time),
            "time": record.time,
            **_numbers(record, match, tested),
        }
    )


def scalogram_dataset(
    record: Record, match: PulseMatch, options: PulseOptions, tested: str = ""
) -> xr.Dataset:
    """Return |C| divided by the root of the record's energy, as a function of period and time.

    Parameters
    ----------
    record : Record
        The record.
    match : PulseMatch
        The best pulse of one of the two Ricker wavelets.
    options : PulseOptions
        Range of periods.
    tested : str
        Result of the test against noise, as `pulse_words` returns it.

    Raises
    ------
    ParameterError
        If the pulse has another wavelet.
    """
    periods = np.geomspace(*options.periods_s, _PERIODS)
    step = record.time_step
    picture = np.abs(scalogram(record.acceleration, step, match.pulse.wavelet, periods))
    picture /= math.sqrt(float(record.acceleration @ record.acceleration) * step)
    stride = max(1, math.ceil(record.acceleration.size / _TIMES))
    # draw the largest of the skipped times, so that no ridge is lost
    starts = np.arange(0, record.acceleration.size, stride)
    return SCALOGRAM.dataset(
        {
            "match_index": np.maximum.reduceat(picture, starts, axis=1),
            "period": periods,
            "time": record.time[starts],
            **_numbers(record, match, tested),
        }
    )


def match_curve_dataset(
    record: Record, matches: Mapping[str, PulseMatch], options: PulseOptions
) -> xr.Dataset:
    """Return the largest match index at each period, on ``wavelet`` and ``period``.

    Parameters
    ----------
    record : Record
        The record.
    matches : mapping of str to PulseMatch
        The best pulse of each wavelet.
    options : PulseOptions
        Options of the search.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.
    """
    periods, curves = match_curve(record.acceleration, record.time_step, options)
    found = [matches[name] for name in curves]
    return MATCH_CURVE.dataset(
        {
            "match_index": np.stack(list(curves.values())),
            "record_id": record.record_id,
            "T_p": [one.pulse.T_p for one in found],
            "best_match": [one.match_index for one in found],
            "period": periods,
            "wavelet": list(curves),
        }
    ).assign_attrs(weighting=options.weighting, most_half_cycles=options.most_half_cycles)


def _numbers(record: Record, match: PulseMatch, tested: str) -> dict[str, Any]:
    pulse = match.pulse
    return {
        "record_id": record.record_id,
        "wavelet": pulse.wavelet,
        "a_p": pulse.a_p,
        "T_p": pulse.T_p,
        "pulse_time": pulse.time,
        "reach": pulse.mother.reach * pulse.T_p,
        "best_match": match.match_index,
        "tested": tested,
        "pga": peak(record.acceleration),
    }
