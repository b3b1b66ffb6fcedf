"""Friction and contact that the joints need for the model to hold: no sliding, no lift-off."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.impulses import impact_friction_demand, least_spacing
from rockframe.rocking.reactions import Reactions, ground_at_nodes, reactions_under
from rockframe.rocking.response import Response, Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse


@dataclass(frozen=True)
class ContactDemand:
    """Extreme joint forces of all columns together, over the nodes of a response.

    Parameters
    ----------
    base_friction_demand, top_friction_demand : float
        Largest shear over vertical force at the base and under the beam [1]; NaN without a beam.
    impact_friction_demand : float
        Coefficient of friction that each impact needs [1]; NaN without impacts.
    least_base_vertical, least_top_vertical : float
        Least vertical force at the base and under the beam, over the static force [1]. If it is not
        positive, the joint would lift off.
    least_spacing : float
        Distance between two columns beyond which the beam does not lift off either column, also
        during impacts [m]; NaN without a stated depth of the beam, and for restrained frames.
    """

    base_friction_demand: float
    top_friction_demand: float
    impact_friction_demand: float
    least_base_vertical: float
    least_top_vertical: float
    least_spacing: float


def with_contact(response: Response, motion: Record | Pulse | GroundAcceleration) -> Response:
    """Add the demand on the joints to a response; NaN if it overturns.

    Parameters
    ----------
    response : Response
        A response from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The motion of the response.

    Raises
    ------
    ParameterError
        If the nodes of the motion are not those of the response.

    Examples
    --------
    >>> from rockframe import RockingFrame, respond
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> demand = with_contact(respond(bent, pulse), pulse).contact
    >>> round(demand.base_friction_demand, 4), round(demand.impact_friction_demand, 4)
    (0.1794, 0.1634)
    """
    if response.verdict is Verdict.OVERTURNED or np.isnan(response.theta).any():
        return replace(response, contact=ContactDemand(*[math.nan] * len(fields(ContactDemand))))
    frame = response.frame
    across, upwards = ground_at_nodes(response.time, motion)
    if not frame.restrained:
        nodes = _nodes_that_count(response, across, upwards)
        across, upwards = across[nodes], upwards[nodes]
        time, theta, omega = (
            history[nodes] for history in (response.time, response.theta, response.omega)
        )
        few = replace(response, time=time, theta=theta, omega=omega)
    else:
        few = response
    forces = reactions_under(few, across, upwards)
    gamma, pressed = frame.mass_ratio, 0.0
    if frame.tendon is not None and frame.column_mass is not None:
        pressed = frame.tendon.prestress / (frame.column_mass * GRAVITY)

    def least(force: NDArray[np.float64], weight: float) -> float:
        return float(force.min()) / weight if weight > 0.0 else math.nan

    demand = ContactDemand(
        base_friction_demand=float(forces.base_friction_demand.max()),
        top_friction_demand=float(forces.top_friction_demand.max()) if gamma > 0.0 else math.nan,
        impact_friction_demand=impact_friction_demand(frame) if response.impacts else math.nan,
        least_base_vertical=least(forces.base_vertical, 1.0 + gamma + pressed),
        least_top_vertical=least(forces.top_vertical, gamma and gamma + pressed),
        least_spacing=_spacing(few, forces),
    )
    return replace(response, contact=demand)


def _nodes_that_count(
    response: Response, across: NDArray[np.float64], upwards: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Return the nodes at which extremes can occur, of a frame without ties.

    They are the nodes at which the frame moves or uplifts, and two nodes at rest. At rest its
    forces are those of a body fixed to the ground: one of the two has the largest ratio of
    horizontal acceleration to g + a_v, the other the least vertical acceleration.
    """
    lean = np.abs(across) / (GRAVITY + upwards)
    moves = (response.theta != 0.0) | (response.omega != 0.0)
    moves |= lean > math.tan(response.frame.slenderness)
    rest = np.flatnonzero(~moves)
    ends = [lean[rest].argmax(), upwards[rest].argmin()] if rest.size else []
    return np.append(np.flatnonzero(moves), rest[ends])


def _spacing(response: Response, forces: Reactions) -> float:
    """Return the least spacing that keeps the resultant of the beam's forces between columns."""
    frame = response.frame
    if frame.beam_depth is None or frame.mass_ratio == 0.0 or frame.restrained:
        return math.nan
    centre = 0.5 * frame.beam_depth
    with np.errstate(divide="ignore", invalid="ignore"):
        lean = centre * forces.top_shear / forces.top_vertical
    offset = np.abs(0.5 * np.sign(response.theta) * frame.top_contact_width + lean)
    during = 2.0 * float(np.where(forces.top_vertical > 0.0, offset, math.inf).max())
    return max(during, least_spacing(frame, centre)) if response.impacts else during
