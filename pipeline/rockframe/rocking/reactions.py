"""Forces at the joints of a rocking frame, and the friction that they need.

Makris and Vassiliou (2013) assume that the columns do not slide and the beam stays on them. These
functions compute the forces that the joints must then transmit. The equations are re-derived from
Newton and Euler; the paper gives only the impulses, eqs (39) and (40).

Forces of the whole frame are over the weight of all columns, N m_c g; forces of one column are over
its own weight, m_c g. So of all masses they depend only on the mass ratio.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.parts import Lever
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Motion, Response, RestraintResponse, as_ground
from rockframe.rocking.verdict import MODEL_ENDS
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


def angular_acceleration(
    frame: RockingFrame,
    theta: ArrayLike,
    omega: ArrayLike,
    horizontal: ArrayLike,
    vertical: ArrayLike = 0.0,
    tie_moment: ArrayLike = 0.0,
) -> Float:
    """Return the angular acceleration of the columns [rad s-2], eq (26).

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    theta, omega : array_like
        Rotation [rad] and its rate [rad s-1]. The arrays broadcast.
    horizontal, vertical : array_like
        Ground acceleration to the right and upwards [m s-2].
    tie_moment : array_like
        Moment of tendons and dissipaters over that of gravity, see `RockingFrame.tie_moment` [1].

    Returns
    -------
    array
        Zero where the frame is at rest and the ground is too weak to uplift it, eq (36).

    Notes
    -----
    The kernel integrates the same equation by its Taylor series. Vertical acceleration a_v changes
    gravity to g + a_v (re-derived).

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> angular_acceleration(bent, [0.0, 0.05], 0.0, 0.0).round(4)
    array([ 0.    , -0.1203])
    """
    theta, omega, across, upwards, ties = _arrays(theta, omega, horizontal, vertical, tie_moment)
    side = _side(frame, theta, omega, across, upwards, ties)
    phi = frame.slenderness * side - theta
    gravity = 1.0 + upwards / GRAVITY
    drive = gravity * np.sin(phi) + across / GRAVITY * np.cos(phi)
    if np.any(ties):
        drive = drive + ties * side * np.cos(0.5 * theta)
    rate: Float = np.where(side == 0.0, 0.0, -(frame.effective_frequency_parameter**2) * drive)
    return rate


@dataclass(frozen=True, eq=False)
class Reactions:
    """Forces on all columns together, over their weight N m_c g [1].

    Parameters
    ----------
    base_shear, base_vertical : array, shape (nodes,)
        Force of the ground on the columns: to the right, and upwards.
    top_shear, top_vertical : array, shape (nodes,)
        Force of the beam on the columns: to the right, and downwards.
    support_shear : array, shape (nodes,)
        Force of the ground on the frame to the right, through contact and tendons.
    """

    base_shear: Float
    base_vertical: Float
    top_shear: Float
    top_vertical: Float
    support_shear: Float

    @property
    def base_friction_demand(self) -> Float:
        """Coefficient of friction that the base joints together need [1]."""
        return _demand(self.base_shear, self.base_vertical)

    @property
    def top_friction_demand(self) -> Float:
        """Coefficient of friction that the joints under the beam need [1]; NaN without a beam."""
        return _demand(self.top_shear, self.top_vertical)


def reactions(response: Response, motion: Motion) -> Reactions:
    """Compute the forces at base and top of all columns together.

    Parameters
    ----------
    response : Response
        A response from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The ground motion of the response.

    Returns
    -------
    Reactions
        Forces at the nodes of the response. At rest they are those of a body fixed to the ground.

    Raises
    ------
    ParameterError
        If the nodes of the motion are not those of the response.

    Examples
    --------
    >>> from rockframe.rocking.response import respond
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> forces = reactions(respond(bent, pulse), pulse)
    >>> round(float(forces.base_friction_demand.max()), 4)
    0.1794
    """
    return reactions_under(response, *ground_at_nodes(response.time, motion))


def model_end(response: Response) -> tuple[float, str]:
    """Return when the model of a response first ends [s], and the event; inf and "" if never."""
    tied, tendon = response.restraint, response.frame.tendon
    elastic = tendon is not None and not tendon.loses_prestress
    times = {
        "gap_closed_time": response.gap_closed_time,
        "lift_exceeded_time": response.lift_exceeded_time,
        "tendon_yield_time": tied.tendon_yields if tied is not None and elastic else math.nan,
    }
    reached = ((time, MODEL_ENDS[name]) for name, time in times.items() if not math.isnan(time))
    return min(reached, default=(math.inf, ""))


def until_model_ends(response: Response) -> Response:
    """Return a response with the nodes and impacts until its model ends, at least the first node.

    The peaks are those of the whole response.
    """
    end, _ = model_end(response)
    if math.isinf(end):
        return response
    count = max(1, int(np.searchsorted(response.time, end, "right")))
    impacts = int(np.searchsorted(response.impact_times, end, "right"))
    tied = response.restraint
    return replace(
        response,
        time=response.time[:count],
        theta=response.theta[:count],
        omega=response.omega[:count],
        impacts=impacts,
        impact_times=response.impact_times[:impacts],
        impact_velocities=response.impact_velocities[:impacts],
        restraint=tied
        and replace(
            tied,
            tendon_force=tied.tendon_force[:count],
            dissipater_force=tied.dissipater_force[:count],
        ),
    )


def valid_reactions(response: Response, motion: Motion) -> tuple[Response, Reactions]:
    """Return a response until its model ends, and the joint forces at its nodes.

    Raises
    ------
    ParameterError
        If the nodes of the motion are not those of the response.
    """
    across, upwards = ground_at_nodes(response.time, motion)
    valid = until_model_ends(response)
    count = valid.time.size
    return valid, reactions_under(valid, across[:count], upwards[:count])


def reactions_under(response: Response, across: Float, upwards: Float) -> Reactions:
    """Compute `reactions` from the ground acceleration at the nodes [m s-2]."""
    gamma = response.frame.mass_ratio
    (column_across, column_upwards), (beam_across, beam_upwards) = _accelerations(
        response, across, upwards
    )
    support = ((1.0 + gamma) * across + column_across + gamma * beam_across) / GRAVITY
    lean, press = np.zeros((2, 1))
    if response.restraint is not None:  # ties compress the joints, inclined by half the rotation
        tied = _tie_forces(response.restraint, response.frame)
        lean, press = tied * np.sin(0.5 * response.theta), tied * np.cos(0.5 * response.theta)
    capped = float(gamma > 0.0)
    return Reactions(
        base_shear=support + lean,
        base_vertical=((1.0 + gamma) * (GRAVITY + upwards) + column_upwards + gamma * beam_upwards)
        / GRAVITY
        + press,
        top_shear=-gamma * (across + beam_across) / GRAVITY - capped * lean,
        top_vertical=gamma * (GRAVITY + upwards + beam_upwards) / GRAVITY + capped * press,
        support_shear=support,
    )


@dataclass(frozen=True, eq=False)
class ColumnForces:
    """Forces on the left and the right column of a frame of two, over the weight m_c g of one [1].

    Parameters
    ----------
    base_shear, base_vertical : array, shape (2, nodes)
        Force of the ground on each column: to the right, and upwards. NaN at rest, because the
        forces of closed joints depend on their stiffness.
    top_shear, top_vertical : array, shape (2, nodes)
        Force of the beam on each column: to the right, and downwards.
    """

    base_shear: Float
    base_vertical: Float
    top_shear: Float
    top_vertical: Float

    @property
    def base_friction_demand(self) -> Float:
        """Coefficient of friction that each base joint needs [1]."""
        return _demand(self.base_shear, self.base_vertical)

    @property
    def top_friction_demand(self) -> Float:
        """Coefficient of friction that each joint under the beam needs [1]; NaN without a beam."""
        return _demand(self.top_shear, self.top_vertical)


def column_forces(
    response: Response, motion: Motion, *, spacing: float, beam_centre: float
) -> ColumnForces:
    """Compute the forces on each column of a frame with two columns.

    With more columns they are statically indeterminate. Where a vertical force is not positive, the
    beam would tilt or lift off, and the frame would no longer have one degree of freedom.

    Parameters
    ----------
    response : Response
        A response from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The ground motion of the response.
    spacing : float
        Distance between the axes of the columns [m].
    beam_centre : float
        Height of the beam's centre of mass above its underside [m].

    Raises
    ------
    ParameterError
        If the spacing is not above the width of a column, the beam's centre is below zero, the
        frame has tendons or dissipaters, or the nodes of the motion are not those of the response.

    Examples
    --------
    >>> from rockframe.rocking.response import respond
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> forces = column_forces(respond(bent, pulse), pulse, spacing=12.0, beam_centre=1.0)
    >>> round(float(np.nanmin(forces.top_vertical)), 3)
    3.085
    """
    frame = response.frame
    _require_bent(frame, spacing, beam_centre)
    if frame.restrained:
        raise ParameterError(
            f"Frame {frame.name!r} has tendons or dissipaters, and their effect on the forces of "
            "each column is not modelled. Use `reactions` for the forces of all columns together."
        )
    across, upwards = ground_at_nodes(response.time, motion)
    theta, omega, across, upwards = _arrays(response.theta, response.omega, across, upwards)
    side = _side(frame, theta, omega, across, upwards)
    side = np.where(side == 0.0, np.nan, side)
    (column_across, column_upwards), (beam_across, beam_upwards) = _accelerations(
        response, across, upwards
    )
    both_shear = -2.0 * frame.mass_ratio * (across + beam_across)
    both_vertical = 2.0 * frame.mass_ratio * (GRAVITY + upwards + beam_upwards)
    shift = (
        side * 0.5 * frame.top_contact_width * both_vertical + beam_centre * both_shear
    ) / spacing
    top_vertical = np.stack([0.5 * both_vertical - shift, 0.5 * both_vertical + shift])
    centre_x, centre_z = _place(frame.centre, side, theta)
    top_x, top_z = _place(frame.beam, side, theta)
    inertia = frame.inertia_ratio * frame.size**2
    moment = inertia * angular_acceleration(frame, theta, omega, across, upwards)
    moment = moment - (GRAVITY + upwards) * centre_x + across * centre_z
    top_shear = (moment - top_vertical * top_x) / top_z
    return ColumnForces(
        base_shear=(across + column_across - top_shear) / GRAVITY,
        base_vertical=(GRAVITY + upwards + column_upwards + top_vertical) / GRAVITY,
        top_shear=top_shear / GRAVITY,
        top_vertical=top_vertical / GRAVITY,
    )


def ground_at_nodes(time: Float, motion: Motion) -> tuple[Float, Float]:
    """Return horizontal and vertical ground acceleration [m s-2] at the nodes of a response.

    Raises
    ------
    ParameterError
        If the nodes of the motion are not those of the response.
    """
    ground = as_ground(motion)
    nodes = ground.time.size
    if nodes > time.size or not np.array_equal(ground.time, time[:nodes]):
        raise ParameterError(
            f"Invalid motion of {nodes} nodes, {ground.time_step:g} s apart. Must be the motion of "
            f"the response, which has {time.size} nodes."
        )
    across, upwards = ground.at_nodes()
    rest = (0, time.size - nodes)  # free rocking after the motion
    return np.pad(across, rest), np.pad(upwards, rest)


@lru_cache(maxsize=4096)
def levers_of(frame: RockingFrame) -> tuple[float, ...]:
    """Return the numbers from which the vectorised kernel computes the largest joint forces [1].

    All masses of a frame move on circles about the pivots, so their inertia forces are those of
    one mass at the lever of the moment of gravity. The numbers fill the slots `lanes.SWINGS`.
    """
    gamma = frame.mass_ratio
    rate = frame.effective_frequency_parameter**2 / GRAVITY
    swing = rate * frame.moment_arm / (1.0 + gamma)
    tied = frame.moment_arm / frame.tie_lever if frame.tendon is not None else 0.0
    if gamma == 0.0:  # the joint at the base in place of the one under the beam
        return swing, swing, 0.0, tied, tied
    angle = frame.beam.angle - frame.slenderness
    return swing, rate * frame.beam.length, angle, tied / (1.0 + gamma), tied / gamma


def demands_at_rest(
    ground: GroundAcceleration, frames: Sequence[RockingFrame], scales: Float
) -> Float:
    """Return base shear over weight and friction demand of frames at rest, shape (frames, 2).

    Parameters
    ----------
    ground : GroundAcceleration
        The motion.
    frames : sequence of RockingFrame
        Frames that do not uplift.
    scales : array, shape (frames,)
        Scale of the motion of each [1].

    Examples
    --------
    >>> weak = GroundAcceleration.from_samples([0.0, 0.5, 0.0], 0.01)
    >>> demands_at_rest(weak, [RockingFrame(height=9.6, width=1.6)], np.array([2.0])).round(3)
    array([[0.102, 0.102]])
    """
    across, upwards = (part / GRAVITY for part in ground.at_nodes())
    demands = np.empty((len(frames), 2))
    for k, (frame, scale) in enumerate(zip(frames, scales.tolist(), strict=True)):
        pressed = 1.0
        if frame.tendon is not None:
            pressed += frame.tendon.prestress / frame.weight
        shear = demands[k, 0] = abs(scale) * np.abs(across).max()
        demands[k, 1] = shear / pressed
        if ground.vertical is not None:
            demands[k, 1] = np.max(np.abs(scale * across) / (pressed + scale * upwards))
    return demands


def _place(lever: Lever, side: Float, theta: Float) -> tuple[Float, Float]:
    """Return the position of a point of a column from its pivot: to the right, and upwards [m]."""
    phi = lever.angle * side - theta
    return -lever.length * np.sin(phi), lever.length * np.cos(phi)


def _accelerations(
    response: Response, across: Float, upwards: Float
) -> tuple[tuple[Float, Float], tuple[Float, Float]]:
    """Return the horizontal and vertical accelerations of columns' centres and of the beam."""
    frame = response.frame
    theta, omega, across, upwards = _arrays(response.theta, response.omega, across, upwards)
    moment = _tie_moment(response)
    rate = angular_acceleration(frame, theta, omega, across, upwards, moment)
    # at the instant of uplift the velocity is zero: the sign of the acceleration gives the side
    omega = np.where(omega == 0.0, np.sign(rate) * np.finfo(np.float64).tiny, omega)
    return frame.centre.acceleration(theta, omega, rate), frame.beam.acceleration(
        theta, omega, rate
    )


def _tie_moment(response: Response) -> Float:
    """Return the moment of the ties at the nodes, over that of gravity."""
    ties, frame = response.restraint, response.frame
    moment = np.zeros(response.time.size)
    if ties is None:
        return moment
    if frame.tendon is not None:
        moment = moment + frame.tie_moment(1.0, frame.tie_lever) * ties.tendon_force
    if frame.dissipater is not None:
        per_force = frame.tie_moment(frame.joints, frame.dissipater.lever_arm)
        moment = moment + per_force * ties.dissipater_force
    return moment


def _tie_forces(ties: RestraintResponse, frame: RockingFrame) -> Float:
    """Return the forces of the ties across one joint, over the weight of a column."""
    forces = np.zeros(ties.tendon_force.size)
    for tie, force in (
        (frame.tendon, ties.tendon_force),
        (frame.dissipater, ties.dissipater_force),
    ):
        if tie is not None:
            forces = forces + force / ((frame.column_mass or math.nan) * GRAVITY)
    return forces


def _side(
    frame: RockingFrame,
    theta: Float,
    omega: Float,
    across: Float,
    upwards: Float,
    tie_moment: Float | float = 0.0,
) -> Float:
    """Return sgn(theta), or at theta = 0 the side to which the frame moves; 0 at rest."""
    hold = GRAVITY * tie_moment / math.cos(frame.slenderness)
    strong = np.abs(across) > (GRAVITY + upwards) * math.tan(frame.slenderness) + hold
    pushed = np.where(strong, -np.sign(across), 0.0)
    moving = np.where(omega == 0.0, pushed, np.sign(omega))
    return np.where(theta == 0.0, moving, np.sign(theta))


def _arrays(*values: ArrayLike) -> list[Float]:
    arrays = (np.asarray(value, dtype=np.float64) for value in values)
    return [np.asarray(array) for array in np.broadcast_arrays(*arrays)]


def _demand(shear: Float, vertical: Float) -> Float:
    """Return |shear| / vertical; infinite without compression, NaN without any force."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(vertical > 0.0, np.abs(shear) / vertical, np.abs(shear) / 0.0)


def _require_bent(frame: RockingFrame, spacing: float, beam_centre: float) -> None:
    widest = max(frame.width, frame.top_contact_width)
    if not (math.isfinite(spacing) and spacing > widest):
        raise ParameterError(
            f"Invalid spacing {spacing!r} m. Must be above the width of a column, {widest:g} m."
        )
    if not (math.isfinite(beam_centre) and beam_centre >= 0.0):
        raise ParameterError(f"Invalid beam_centre {beam_centre!r} m. Must be zero or above.")
