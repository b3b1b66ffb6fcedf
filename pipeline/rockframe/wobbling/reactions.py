"""Forces at the joints of round columns that wobble, and the friction that they need.

The accelerations of a column's centre and of the slab follow from the equations of motion in
`rockframe.wobbling.response` (re-derived from Newton and Euler). All forces are over the weight of
the columns, as in `rockframe.rocking.reactions`, and are equal to those in one plane if the motion
stays in it.

A column that passes near upright turns within a time far below that between two samples, and the
force of rigid bodies grows without bound as the least tilt vanishes, while its impulse does not.
Therefore the largest forces of a motion are means over `FORCE_DURATION`, from the changes of
momentum, which are exact and do not depend on the samples of the motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, fields, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.quantities import FORCE_DURATION
from rockframe.rocking.assessments import Band, ContactDemand, JointForces
from rockframe.rocking.contact import demand_of, largest_of, static_vertical
from rockframe.rocking.margins.ensemble import force_bands
from rockframe.rocking.margins.members import draws, require_members
from rockframe.rocking.reactions import Reactions
from rockframe.rocking.verdict import Verdict
from rockframe.units import GRAVITY
from rockframe.wobbling import kernel
from rockframe.wobbling.ensemble import family_of
from rockframe.wobbling.motion import PairAcceleration, PairMotion, as_pair
from rockframe.wobbling.response import (
    TOUCHING,
    WobblingResponse,
    axial_inertia,
    constants,
    integrated,
    polar,
    require_no_flight,
    rolling,
    state_of,
)

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Starts of means within their duration: each pass is whole within one of the means.
_STARTS: Final = 8
#: Means that are computed at a time, and states that are kept: bounds of the memory.
_MEANS: Final = 4096
_STATES: Final = 1_000_000
#: Share of a time step that is round-off [1].
_ROUND_OFF: Final = 1e-6


def wobbling_reactions(response: WobblingResponse, motion: PairMotion) -> Reactions:
    """Compute the forces at base and top of all columns together.

    Parameters
    ----------
    response : WobblingResponse
        A response from `wobble`.
    motion : PairAcceleration, HorizontalPair or BothDirections
        The motion of the response.

    Returns
    -------
    Reactions
        Forces at the samples; the shears are the lengths of the horizontal vectors. At rest they
        are those of a body fixed to the ground; NaN after overturning.

    Raises
    ------
    ParameterError
        If the samples of the motion are not those of the response.

    Notes
    -----
    While a column passes upright so closely that the far rim touches, its direction turns within
    the time constant of the contact, and forces of rigid bodies exceed those of any real contact.
    `touching` returns these samples; the forces of their impacts are impulses, as in one plane.

    Examples
    --------
    >>> from rockframe import PairAcceleration, Pulse
    >>> from rockframe.wobbling.response import wobble
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, section="circular")
    >>> along = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.5)
    >>> across = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=1.5, time=0.4)
    >>> motion = PairAcceleration.from_pulses(along, across)
    >>> response = wobble(bent, motion)
    >>> forces = wobbling_reactions(response, motion)
    >>> round(float(forces.base_friction_demand[~touching(response)].max()), 2)
    0.18
    """
    ground = _motion_of(response, motion)
    motions = (response.theta, response.phi, response.theta_rate, response.phi_rate)
    found = reactions_of([response.frame], ground, np.ones(1), *(one[None] for one in motions))
    return Reactions(**{name: forces[0] for name, forces in vars(found).items()})


def _motion_of(response: WobblingResponse, motion: PairMotion) -> PairAcceleration:
    """Return the motion of a response; an error if its samples are others."""
    ground = as_pair(motion)
    if not np.array_equal(ground.time, response.time):
        raise ParameterError(
            f"Invalid motion of {ground.x.size} samples, {ground.time_step:g} s apart. Must be the "
            f"motion of the response, which has {response.time.size} samples."
        )
    return ground


def touching(response: WobblingResponse) -> NDArray[np.bool_]:
    """Return the samples at which the far rim of the columns touches, shape (samples,).

    There the tilt is below theta_c of the loss near upright, at the speed of the sample.
    """
    contact = TOUCHING * math.sqrt(response.contact_shortening / GRAVITY)
    cone, theta = np.sqrt(_Numbers.of([response.frame]).near_upright[0]), response.theta
    speed = np.hypot(response.theta_rate, cone * theta * np.nan_to_num(response.phi_rate))
    return np.asarray((theta > 0.0) & (theta < contact * speed))


def counted_reactions(response: WobblingResponse, motion: PairMotion) -> Reactions | None:
    """Return `wobbling_reactions` at the samples that count; None if the frame overturns.

    Samples at which the far rim touches do not count: see `wobbling_reactions`.
    """
    if response.verdict is Verdict.OVERTURNS:
        return None
    counted = ~touching(response)
    found = wobbling_reactions(response, motion)
    return Reactions(**{name: forces[counted] for name, forces in vars(found).items()})


def wobbling_contact(response: WobblingResponse, motion: PairMotion) -> ContactDemand:
    """Return the demand on the joints; NaN if the frame overturns.

    Parameters and errors are those of `wobbling_reactions`. The friction that impacts need and the
    least spacing are NaN, because the impulses of passes near upright are not computed.

    Examples
    --------
    >>> from rockframe import PairAcceleration
    >>> from rockframe.wobbling.response import wobble
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular")
    >>> weak = PairAcceleration([0.0, 0.3, 0.0], [0.0, 0.4, 0.0], 0.01)
    >>> round(9.81 * wobbling_contact(wobble(column, weak), weak).base_friction_demand, 9)
    0.5
    """
    forces = counted_reactions(response, motion)
    if forces is None:
        return ContactDemand(*[math.nan] * len(fields(ContactDemand)))
    return demand_of(response.frame, forces)


def wobbling_forces(response: WobblingResponse, motion: PairMotion) -> JointForces[float]:
    """Return the largest forces at the joints, averaged over `FORCE_DURATION`; NaN if it overturns.

    Parameters and errors are those of `wobbling_reactions`. The impulses are NaN: a pass near
    upright is within the means.

    Notes
    -----
    At rest the forces are those of each instant. While the columns move they are means over 0.01 s,
    from the change of the momentum of columns and beam during this time: a force that lasts longer
    is itself, and one that lasts less counts by its impulse over 0.01 s. The motion is computed
    again for them in finer steps, so that they do not depend on its samples. The force of rigid
    bodies at an instant has no bound: it grows as the least tilt of a pass vanishes.

    Examples
    --------
    >>> from rockframe import PairAcceleration
    >>> from rockframe.wobbling.response import wobble
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular")
    >>> weak = PairAcceleration([0.0, 0.3, 0.0], [0.0, 0.4, 0.0], 0.01)
    >>> round(9.81 * wobbling_forces(wobble(column, weak), weak).base_joint_horizontal, 9)
    0.5
    """
    ground, frame = _motion_of(response, motion), rolling(response.frame)
    if response.verdict is Verdict.OVERTURNS:
        return JointForces(*_NO_FORCES)
    histories = (response.theta, response.theta_rate, response.phi, response.phi_rate)
    start = state_of([float(np.nan_to_num(history[0])) for history in histories])
    slots = constants(frame, contact_shortening=response.contact_shortening)
    return JointForces(*_largest_forces([frame], ground, slots[None], start[None])[0])


def wobbling_force_bands(
    frame: RockingFrame, motion: PairMotion, ensemble: Ensemble | None = None
) -> JointForces[Band]:
    """Return the bands of the largest forces at the joints over an ensemble.

    Parameters
    ----------
    frame : RockingFrame
        The frame as stated, as for `wobble`.
    motion : PairAcceleration, HorizontalPair or BothDirections
        The ground motion.
    ensemble : Ensemble, optional
        Number of members, spreads and seed; the members are those of `wobbling_ensemble`.

    Returns
    -------
    JointForces
        Quantiles of the forces of `wobbling_forces`, infinite where one falls on a member that
        overturns. Those of impulses are NaN.

    Raises
    ------
    ParameterError
        As `wobbling_ensemble`.

    Examples
    --------
    >>> from rockframe import PairAcceleration
    >>> column = RockingFrame(height=7.5, width=1.8, section="circular")
    >>> weak = PairAcceleration([0.0, 0.3, 0.0], [0.0, 0.4, 0.0], 0.01)
    >>> bands = wobbling_force_bands(column, weak, Ensemble(members=16))
    >>> [round(9.81 * force, 3) for force in bands.base_joint_horizontal]
    [0.497, 0.5, 0.503]
    """
    chosen, ground = ensemble or Ensemble(), as_pair(motion)
    require_members(chosen)
    scales = draws(chosen)[:, 3]
    require_no_flight(ground, float(scales.max()))
    family = family_of(frame, chosen)
    slots = family.at(np.arange(chosen.members), scales)
    each = _largest_forces(family.frames, ground, slots, np.zeros((chosen.members, 4)))
    bands = vars(force_bands(np.array(each), family.frames[0]))
    unknown = (math.nan,) * 3
    return JointForces(**{n: unknown if "impulse" in n else band for n, band in bands.items()})


_FORCES: Final = [field.name for field in fields(JointForces)]
_NO_FORCES: Final = (math.nan,) * len(_FORCES)


def _largest_forces(
    frames: Sequence[RockingFrame], ground: PairAcceleration, slots: Float, starts: Float
) -> list[tuple[float, ...]]:
    """Return the values of `wobbling_forces` of members of the kernel, NaN if they overturn."""
    fine, each = _finely(ground), list[tuple[float, ...]]()
    together = max(1, min(kernel.WIDTH, _STATES // fine.x.size))
    for first in range(0, len(frames), together):
        some = slice(first, first + together)
        history = np.zeros((len(frames[some]), fine.x.size, 4))
        verdicts, _ = integrated(fine, slots[some], starts[some], history)
        for member, states, row, verdict in zip(
            frames[some], history, slots[some], verdicts, strict=True
        ):
            if verdict == Verdict.OVERTURNS:
                each.append(_NO_FORCES)
            else:
                each.append(_largest_means(member, fine, float(row[kernel.SCALE]), states))
    return each


def _finely(ground: PairAcceleration) -> PairAcceleration:
    """Return the same motion, straight between samples, with as many samples as means need."""
    times = math.ceil(ground.time_step / FORCE_DURATION * _STARTS - _ROUND_OFF)
    if times <= 1:
        return ground
    shares = np.arange(times) / times

    def between(samples: Float) -> Float:
        within = samples[:-1, None] + np.diff(samples)[:, None] * shares
        return np.append(within, samples[-1])

    upwards = None if ground.z is None else between(ground.z)
    step, x, y = ground.time_step / times, between(ground.x), between(ground.y)
    return replace(ground, x=x, y=y, z=upwards, time_step=step)


def _largest_means(
    frame: RockingFrame, ground: PairAcceleration, scale: float, states: Float
) -> tuple[float, ...]:
    """Return the values of `wobbling_forces` from the states at the samples of a fine motion."""
    steps = min(FORCE_DURATION / ground.time_step, states.shape[0] - 1.0)
    longest = math.ceil(steps - _ROUND_OFF)
    largest = []
    for first in range(0, states.shape[0] - longest, _MEANS):
        some = slice(first, min(first + _MEANS + longest, states.shape[0]))
        shaken = [scale * part[some] for part in (ground.x, ground.y, _upwards(ground))]
        forces = [_at_rest(frame, shaken, states[some])]
        if states[some].any():
            forces.append(_mean_reactions(frame, shaken, states[some], ground.time_step, steps))
        joined = {
            name: np.concatenate([vars(part)[name] for part in forces]) for name in vars(forces[0])
        }
        largest.append(astuple(largest_of(frame, Reactions(**joined))))
    least = np.array([name.endswith("_least") for name in _FORCES])
    extremes = np.where(least, np.min(largest, axis=0), np.max(largest, axis=0))
    return tuple(extremes.tolist())


def _upwards(ground: PairAcceleration) -> Float:
    return np.zeros_like(ground.x) if ground.z is None else ground.z


def _at_rest(frame: RockingFrame, ground: Sequence[Float], states: Float) -> Reactions:
    """Return the forces at the samples at which the columns rest on the ground."""
    rests, gamma = ~states[:, :2].any(axis=1), frame.mass_ratio
    x, y, z = (part[rests] / GRAVITY for part in ground)
    (base, top), shear = static_vertical(frame), np.hypot(x, y)
    return Reactions(
        base_shear=(1.0 + gamma) * shear,
        base_vertical=base + (1.0 + gamma) * z,
        top_shear=gamma * shear,
        top_vertical=(top if gamma > 0.0 else 0.0) + gamma * z,
        support_shear=(1.0 + gamma) * shear,
    )


def _mean_reactions(
    frame: RockingFrame, ground: Sequence[Float], states: Float, time_step: float, steps: float
) -> Reactions:
    """Return means of the forces over a number of time steps, from each of the first samples on.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    ground : sequence of array, shape (samples,)
        Ground accelerations along x, along y and upwards [m s-2].
    states : array, shape (samples, 4)
        States of the kernel.
    time_step : float
        Time between samples [s].
    steps : float
        Length of a mean over the time step; between samples impulses are taken as straight.
    """
    n = _Numbers(*(part[0] for part in _Numbers.of([frame])))
    theta, _, theta_rate, phi_rate = polar(states)
    tilt = states[:, 0] + 1j * states[:, 1]
    toward = tilt / np.where(tilt == 0.0, 1.0, np.abs(tilt))
    turning = 1j * np.where(tilt == 0.0, 0.0, phi_rate)
    bodies = [
        _lift(*place, np.sin(theta), np.cos(theta)) for place in ((n.b, n.z), (n.reach, n.height))
    ]
    moved, slab_moved = (
        toward * (body.shift_1 * theta_rate + body.shift * turning) for body in bodies
    )
    lifted, slab_lifted = (body.lift_1 * theta_rate for body in bodies)
    tension = _ties([frame], theta[None])[0][0]

    def impulse(force: Float | Complex) -> Complex:
        added = 0.5 * time_step * (force[1:] + force[:-1])
        return np.append(0.0j, np.cumsum(added))

    shaken, weighed = impulse(ground[0] + 1j * ground[1]), impulse(GRAVITY + ground[2])
    lean = GRAVITY * impulse(tension * np.sin(0.5 * theta) * toward)
    press = GRAVITY * impulse(tension * np.cos(0.5 * theta))
    capped, whole = float(frame.mass_ratio > 0.0), 1.0 + n.gamma
    support = whole * shaken + moved + n.gamma * slab_moved
    impulses = (
        support + lean,
        whole * weighed + lifted + n.gamma * slab_lifted + press,
        n.gamma * (shaken + slab_moved) + capped * lean,
        n.gamma * (weighed + slab_lifted) + capped * press,
        support,
    )
    means = _increments(np.array(impulses), steps) / (GRAVITY * steps * time_step)
    base, base_vertical, top, top_vertical, support = means
    return Reactions(abs(base), base_vertical.real, abs(top), top_vertical.real, abs(support))


def _increments(values: Complex, steps: float) -> Complex:
    """Return by how much values grow in a number of steps, from each of the first samples on."""
    whole = math.floor(steps + _ROUND_OFF)
    later: Complex = values[:, whole:]
    if (share := steps - whole) > _ROUND_OFF:
        later = later[:, :-1] + share * (later[:, 1:] - later[:, :-1])
    return np.asarray(later - values[:, : later.shape[1]], dtype=np.complex128)


class _Numbers(NamedTuple):
    """Dimensions and inertias of frames, each of shape (frames, 1); those of masses are over that
    of a column.
    """

    b: Float
    z: Float
    reach: Float
    height: Float
    gamma: Float
    transverse: Float
    axial: Float

    @classmethod
    def of(cls, frames: Sequence[RockingFrame]) -> _Numbers:
        rows = [
            (
                0.5 * frame.width,
                frame.centre_height,
                0.5 * (frame.width + frame.top_contact_width),
                frame.height,
                frame.mass_ratio,
                (frame.inertia_ratio - 1.0) * frame.size**2,
                axial_inertia(frame),
            )
            for frame in frames
        ]
        return cls(*np.array(rows).T[:, :, None])

    @property
    def planar(self) -> Float:
        """Moment of inertia A of a column with its share of the slab [m2]."""
        slab = self.gamma * (self.reach**2 + self.height**2)
        return self.b**2 + self.z**2 + self.transverse + slab

    @property
    def near_upright(self) -> Float:
        """Inertia B over A theta^2 near upright [1]."""
        return (self.z**2 + self.gamma * self.height**2 + self.transverse) / self.planar


class _Lift(NamedTuple):
    """Horizontal and vertical displacement of a body in the direction of the tilt, over theta."""

    shift: Float
    shift_1: Float
    shift_2: Float
    lift_1: Float
    lift_2: Float


def _lift(across: Float, upwards: Float, sine: Float, cosine: Float) -> _Lift:
    """Return the displacements of a point at a distance across and above the rim."""
    rise = across * sine + upwards * cosine
    fall = across * cosine - upwards * sine
    return _Lift(across * (1.0 - cosine) + upwards * sine, rise, fall, fall, -rise)


def reactions_of(
    frames: Sequence[RockingFrame],
    ground: PairAcceleration,
    scales: Float,
    theta: Float,
    phi: Float,
    theta_rate: Float,
    phi_rate: Float,
) -> Reactions:
    """Compute the forces of frames from their motions at the samples of the ground motion.

    Parameters
    ----------
    frames : sequence of RockingFrame
        Frames with round columns.
    ground : PairAcceleration
        The ground motion.
    scales : array, shape (frames,)
        Its multiple for each frame [1].
    theta, phi, theta_rate, phi_rate : array, shape (frames, samples)
        Motions of the frames [rad], [rad s-1].
    """
    n = _Numbers.of(frames)
    scale = scales[:, None]
    rests = theta == 0.0
    turn, turn_rate = (np.where(rests, 0.0, angle) for angle in (phi, phi_rate))
    upwards = 0.0 if ground.z is None else scale * ground.z
    ex, ey = np.cos(turn), np.sin(turn)
    radial = scale * (ex * ground.x + ey * ground.y)
    sideways = scale * (ex * ground.y - ey * ground.x)
    sine, cosine = np.sin(theta), np.cos(theta)
    column = _lift(n.b, n.z, sine, cosine)
    slab = _lift(n.reach, n.height, sine, cosine)
    tension, moment = _ties(frames, theta)
    rates = _accelerations(n, column, slab, (sine, cosine), theta_rate, turn_rate, radial, sideways)
    growth, swing = rates
    weighing = column.lift_1 + n.gamma * slab.lift_1
    growth = growth - ((GRAVITY + upwards) * weighing + moment) / n.planar
    growth, swing = (np.where(rests, 0.0, rate) for rate in (growth, swing))
    moving = [_moving(body, theta_rate, turn_rate, growth, swing) for body in (column, slab)]
    (own_r, own_t, own_v), (slab_r, slab_t, slab_v) = moving
    lean, press = tension * np.sin(0.5 * theta), tension * np.cos(0.5 * theta)
    whole = 1.0 + n.gamma
    support_r = (whole * radial + own_r + n.gamma * slab_r) / GRAVITY
    support_t = (whole * sideways + own_t + n.gamma * slab_t) / GRAVITY
    vertical = (whole * (GRAVITY + upwards) + own_v + n.gamma * slab_v) / GRAVITY
    top_r, top_t = n.gamma * (radial + slab_r) / GRAVITY, n.gamma * (sideways + slab_t) / GRAVITY
    capped = np.asarray(n.gamma > 0.0, dtype=np.float64)
    return Reactions(
        base_shear=np.hypot(support_r + lean, support_t),
        base_vertical=vertical + press,
        top_shear=np.hypot(top_r + capped * lean, top_t),
        top_vertical=n.gamma * (GRAVITY + upwards + slab_v) / GRAVITY + capped * press,
        support_shear=np.hypot(support_r, support_t),
    )


def _accelerations(
    n: _Numbers,
    column: _Lift,
    slab: _Lift,
    angle: tuple[Float, Float],
    theta_rate: Float,
    turn_rate: Float,
    radial: Float,
    sideways: Float,
) -> tuple[Float, Float]:
    """Return theta'' without gravity and ties, and phi'' [rad s-2]."""
    sine, cosine = angle
    inertia = column.shift**2 + n.gamma * slab.shift**2
    inertia = inertia + n.transverse * sine**2 + n.axial * (1.0 - cosine) ** 2
    bend = column.shift * column.shift_1 + n.gamma * slab.shift * slab.shift_1
    bend = bend + sine * (n.transverse * cosine + n.axial * (1.0 - cosine))  # B' / 2
    arm, arm_1 = column.shift + n.gamma * slab.shift, column.shift_1 + n.gamma * slab.shift_1
    with np.errstate(invalid="ignore", divide="ignore"):
        swing = -(sideways * arm + 2.0 * bend * theta_rate * turn_rate) / inertia
    return (bend * turn_rate**2 - radial * arm_1) / n.planar, swing


def _moving(
    body: _Lift, theta_rate: Float, turn_rate: Float, growth: Float, swing: Float
) -> tuple[Float, Float, Float]:
    """Return the accelerations of a body along and across the tilt and upwards [m s-2]."""
    along = body.shift_1 * growth + body.shift_2 * theta_rate**2 - body.shift * turn_rate**2
    across = body.shift * swing + 2.0 * body.shift_1 * theta_rate * turn_rate
    return along, across, body.lift_1 * growth + body.lift_2 * theta_rate**2


def _ties(frames: Sequence[RockingFrame], theta: Float) -> tuple[Float, Float]:
    """Return the tension of tendons over the weight of a column, and their moment over its mass."""
    tension, moment = np.zeros((2, *theta.shape))
    for k, frame in enumerate(frames):
        if frame.tendon is not None:
            stretch = 2.0 * frame.tie_lever * np.sin(0.5 * theta[k])
            mass = frame.column_mass or math.nan
            force = frame.tendon.prestress + frame.tendon.stiffness * stretch
            tension[k] = force / (mass * GRAVITY)
            moment[k] = force * frame.tie_lever * np.cos(0.5 * theta[k]) / mass
    return tension, moment
