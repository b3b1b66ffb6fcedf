"""Friction and contact that the joints need for the model to hold, and the forces on them.

The impulses at the joints during an impact follow eqs (39) and (40).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.assessments import ContactDemand, JointForces
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.reactions import (
    Reactions,
    ground_at_nodes,
    reactions_under,
    until_model_ends,
    valid_reactions,
)
from rockframe.rocking.response import Response
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse


def with_contact(response: Response, motion: Record | Pulse | GroundAcceleration) -> Response:
    """Add to a response what its joints must carry until the model ends; NaN if it overturns.

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
    if _falls(response):
        return replace(response, contact=ContactDemand(*[math.nan] * len(fields(ContactDemand))))
    frame = response.frame
    across, upwards = ground_at_nodes(response.time, motion)
    few = valid = until_model_ends(response)
    across, upwards = across[: valid.time.size], upwards[: valid.time.size]
    if not frame.restrained:
        nodes = _nodes_that_count(valid, across, upwards)
        across, upwards = across[nodes], upwards[nodes]
        time, theta, omega = (history[nodes] for history in (valid.time, valid.theta, valid.omega))
        few = replace(valid, time=time, theta=theta, omega=omega)
    forces = reactions_under(few, across, upwards)
    impact = impact_friction_demand(frame) if valid.impacts else math.nan
    return replace(response, contact=demand_of(frame, forces, impact, _spacing(few, forces)))


def demand_of(
    frame: RockingFrame, forces: Reactions, impact: float = math.nan, spacing: float = math.nan
) -> ContactDemand:
    """Return the extremes of joint forces.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    forces : Reactions
        Forces at the instants that count.
    impact : float
        Coefficient of friction that each impact needs [1].
    spacing : float
        Least spacing of two columns [m].
    """
    gamma = frame.mass_ratio
    base, top = static_vertical(frame)

    def least(force: NDArray[np.float64], weight: float) -> float:
        return float(force.min()) / weight if weight > 0.0 else math.nan

    return ContactDemand(
        base_friction_demand=float(forces.base_friction_demand.max()),
        top_friction_demand=float(forces.top_friction_demand.max()) if gamma > 0.0 else math.nan,
        impact_friction_demand=impact,
        least_base_vertical=least(forces.base_vertical, base),
        least_top_vertical=least(forces.top_vertical, gamma and top),
        least_spacing=spacing,
    )


def static_vertical(frame: RockingFrame) -> tuple[float, float]:
    """Return the vertical forces at base and top of a column at rest, over the column's weight [1].

    They include the prestress of tendons.

    Examples
    --------
    >>> static_vertical(RockingFrame(height=9.6, width=1.6, mass_ratio=4.0))
    (5.0, 4.0)
    """
    pressed = 0.0
    if frame.tendon is not None and frame.column_mass is not None:
        pressed = frame.tendon.prestress / (frame.column_mass * GRAVITY)
    return 1.0 + frame.mass_ratio + pressed, frame.mass_ratio + pressed


def uplift_friction_demand(frame: RockingFrame) -> float:
    """Return the coefficient of friction that the base joints need when the frame uplifts [1].

    It is tan(alpha) without tendons. The prestress of tendons presses the joints, too.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(uplift_friction_demand(bent), 5) == round(1.6 / 9.6, 5)
    True
    """
    weight = 1.0 + frame.mass_ratio
    return frame.uplift_acceleration / GRAVITY * weight / static_vertical(frame)[0]


def _falls(response: Response) -> bool:
    """Return True if the structure overturns, or if its history is not whole."""
    return response.verdict is Verdict.OVERTURNS or bool(np.isnan(response.theta).any())


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


def joint_forces(
    response: Response, motion: Record | Pulse | GroundAcceleration
) -> JointForces[float]:
    """Return the largest forces and impulses of a response until its model ends, at its nodes.

    Parameters
    ----------
    response : Response
        A response from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The motion of the response.

    Returns
    -------
    JointForces
        All NaN if the structure overturns.

    Raises
    ------
    ParameterError
        If the nodes of the motion are not those of the response.

    Examples
    --------
    >>> from rockframe import RockingFrame, respond
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, friction_coefficient=0.1)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> forces = joint_forces(respond(bent, pulse), pulse)
    >>> round(forces.base_joint_horizontal, 4), round(forces.base_key_force, 4)
    (0.1866, 0.0826)
    """
    if _falls(response):
        return JointForces(*[math.nan] * len(fields(JointForces)))
    frame = response.frame
    valid, forces = valid_reactions(response, motion)
    strongest = np.abs(valid.impact_velocities).max(initial=0.0)
    return largest_of(frame, forces, impact_impulses(frame, strongest))


def largest_of(
    frame: RockingFrame, forces: Reactions, impulses: Impulses | None = None
) -> JointForces[float]:
    """Return the largest of the forces at joints, and the impulses of an impact; NaN without."""
    base = 1.0 / (1.0 + frame.mass_ratio)  # reactions are over the weight of the columns alone
    top = base if frame.mass_ratio > 0.0 else math.nan
    of_base = _extremes(forces.base_shear, forces.base_vertical, frame.friction_coefficient)
    of_top = _extremes(forces.top_shear, forces.top_vertical, frame.friction_coefficient)
    unknown = np.asarray(math.nan)
    pushed = impulses or Impulses(unknown, unknown, unknown, unknown)
    values = [
        base * float(np.abs(forces.support_shear).max()),
        *(base * demand for demand in of_base),
        *(top * demand for demand in of_top),
        base * float(pushed.base_horizontal) / GRAVITY,
        base * float(pushed.base_vertical) / GRAVITY,
        top * float(pushed.top_horizontal) / GRAVITY,
        top * float(pushed.top_vertical) / GRAVITY,
    ]
    return JointForces(*values)


def _extremes(
    shear: NDArray[np.float64], vertical: NDArray[np.float64], friction: float | None
) -> tuple[float, float, float, float]:
    """Return the largest horizontal, largest and least vertical force, and that on a shear key."""
    across = np.abs(shear)
    carried = (friction or 0.0) * np.maximum(vertical, 0.0)
    key = max(float((across - carried).max()), 0.0)
    return float(across.max()), float(vertical.max()), float(vertical.min()), key


Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Impulses:
    """Sums of the impulses on all columns, divided by their mass N m_c [m s-1].

    Parameters
    ----------
    base_horizontal, base_vertical : array
        Impulse of the ground on the columns, positive against the motion, and positive upwards.
    top_horizontal, top_vertical : array
        Impulse of the beam on the columns, positive with the motion, and positive downwards; eqs
        (39) and (40).
    """

    base_horizontal: Float
    base_vertical: Float
    top_horizontal: Float
    top_vertical: Float


def impact_impulses(frame: RockingFrame, velocity: ArrayLike) -> Impulses:
    """Return the impulses of impacts.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    velocity : array_like
        Rate of rotation just before each impact [rad s-1]; its sign does not matter.

    Notes
    -----
    Makris and Vassiliou (2013), eqs (39) and (40), with the rate after the impact from eq (43). At
    the base, the change of momentum of the columns is added.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> impulses = impact_impulses(bent, 0.2)
    >>> round(float(impulses.top_horizontal), 4), round(float(impulses.top_vertical), 4)
    (0.4072, 2.4921)
    """
    speed = np.abs(np.asarray(velocity, dtype=np.float64))
    loss = (1.0 - frame.restitution) * speed
    turn = (1.0 + frame.restitution) * speed
    gamma = frame.mass_ratio
    reach = 0.5 * (frame.width + frame.top_contact_width)
    return Impulses(
        base_horizontal=(frame.centre_height + gamma * frame.height) * loss,
        base_vertical=(0.5 * frame.width + gamma * reach) * turn,
        top_horizontal=gamma * frame.height * loss,
        top_vertical=gamma * reach * turn,
    )


def impact_friction_demand(frame: RockingFrame) -> float:
    """Return the coefficient of friction that base and top joints need in each impact [1].

    It is cot(alpha) (1 - sqrt(r)) / (1 + sqrt(r)) at any speed. With the restitution of eq (43) it
    is below tan(alpha), the friction needed for uplift. If the columns are not prismatic, the
    larger value of the two joints is returned.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(impact_friction_demand(bent), 5)
    0.16337
    """
    loss = (1.0 - frame.restitution) / (1.0 + frame.restitution)
    base = loss / math.tan(frame.slenderness)
    return max(base, loss / math.tan(frame.beam.angle)) if frame.mass_ratio > 0.0 else base


def least_spacing(frame: RockingFrame, beam_centre: float) -> float:
    """Return the spacing of two columns beyond which impacts do not lift the beam off a column [m].

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    beam_centre : float
        Height of the beam's centre of mass above its underside [m].

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> round(least_spacing(bent, 1.0), 3)
    1.927
    """
    loss = (1.0 - frame.restitution) / (1.0 + frame.restitution)
    return frame.top_contact_width + 2.0 * beam_centre * loss / math.tan(frame.beam.angle)
