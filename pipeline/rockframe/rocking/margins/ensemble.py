"""Responses of ensembles of plausible structures to the motion itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from functools import lru_cache
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.parts import Lever
from rockframe.quantities import QUANTILES
from rockframe.rocking.assessments import Band, Bands, EnsembleResponse, JointForces
from rockframe.rocking.contact import impact_friction_demand, joint_forces
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.members import (
    Versions,
    draws,
    members,
    rank_correlations,
    require_members,
    require_motion,
)
from rockframe.rocking.reactions import valid_reactions
from rockframe.rocking.response import Motion, Response, as_ground, require_some, respond
from rockframe.rocking.scenarios import Prepared, Scenarios, respond_scenarios
from rockframe.rocking.verdict import MODEL_ENDS, ModelEnd, Verdict

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MemberPeaks:
    """Peaks of each member of an ensemble, shape (motions, frames, members).

    Peaks of members that overturn are infinite.

    Parameters
    ----------
    verdict : array of int8
        Values of `Verdict`.
    limits_reached : array of bool, shape (len(MODEL_ENDS), motions, frames, members)
        True where an event of `MODEL_ENDS` ends the model, see `EnsembleResponse`.
    peaks : mapping of str to array
        The quantities of `quantities.BANDED` by name; NaN for structures without them.
    """

    verdict: NDArray[np.int8]
    limits_reached: NDArray[np.bool_]
    peaks: Mapping[str, Float]


def ensemble_responses(
    motions: Sequence[Motion],
    frames: Sequence[RockingFrame],
    ensemble: Ensemble | None = None,
    versions: Sequence[Versions | None] | None = None,
) -> list[list[EnsembleResponse]]:
    """Compute the responses of the ensemble of each frame to each motion itself.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames as stated.
    ensemble : Ensemble, optional
        Number of members, spreads and seed. The draws are the same for all motions and frames.
    versions : sequence of Versions or None, optional
        For each motion its versions, one of which shakes each member, or None to shake all members
        by the motion. By default there are none.

    Returns
    -------
    list of list of EnsembleResponse
        For each motion the responses of the ensembles of all frames. They do not depend on the
        other motions and frames.

    Raises
    ------
    ParameterError
        If the ensemble has no members, a member cannot rock, or a vertical acceleration falls
        faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.54 * 9.81, T_p=1.5)
    >>> [[found]] = ensemble_responses([pulse], [bent])
    >>> found.overturned, [round(ratio, 2) for ratio in found.bands.peak_rotation_ratio]
    (3, [0.83, 0.87, 0.91])
    """
    chosen = ensemble or Ensemble()
    peaks = member_peaks(motions, frames, chosen, versions)
    uplifted = (peaks.verdict != Verdict.NO_UPLIFT).sum(axis=2)
    overturned = (peaks.verdict == Verdict.OVERTURNS).sum(axis=2)
    ended = peaks.limits_reached.any(axis=0).sum(axis=2)
    each = peaks.limits_reached.sum(axis=3)
    bands = {name: quantiles(values).tolist() for name, values in peaks.peaks.items()}
    limited = [_has_limit(frame) for frame in frames]
    return [
        [
            EnsembleResponse(
                chosen.members,
                int(uplifted[i, k]),
                int(overturned[i, k]),
                int(ended[i, k]) if limited[k] else None,
                Bands({name: tuple(bounds[i][k]) for name, bounds in bands.items()}),
                rank_correlations(
                    peaks.peaks["peak_rotation_ratio"][i, k],
                    chosen,
                    versions[i] if versions else None,
                ),
                ModelEnd(1 + int(each[:, i, k].argmax())) if ended[i, k] else ModelEnd.NONE,
            )
            for k in range(len(frames))
        ]
        for i in range(len(motions))
    ]


def with_ensemble(
    responses: Sequence[Response],
    motion: Motion,
    ensemble: Ensemble | None = None,
    versions: Versions | None = None,
) -> list[Response]:
    """Add the response of an ensemble of plausible structures to each response.

    Parameters
    ----------
    responses : sequence of Response
        Responses from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The motion of all of them.
    ensemble : Ensemble, optional
        Number of members, spreads and seed.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Raises
    ------
    ParameterError
        If the ensemble has no members, a member cannot rock, or the vertical acceleration falls
        faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.55 * 9.81, T_p=1.5)
    >>> [response] = with_ensemble([respond(bent, pulse)], pulse)
    >>> response.verdict.label, response.spread_verdict.kind.label
    ('overturns', 'may overturn')
    """
    frames = [response.frame for response in responses]
    [ensembles] = ensemble_responses([motion], frames, ensemble, [versions])
    return [
        replace(response, ensemble=each)
        for response, each in zip(responses, ensembles, strict=True)
    ]


def with_envelope(
    response: Response,
    motion: Motion,
    ensemble: Ensemble | None = None,
    versions: Versions | None = None,
) -> Response:
    """Add the 16 and 84 % quantiles of the members' rotations over time to a response.

    Parameters and errors are those of `with_ensemble`. A member that has overturned counts as a
    rotation of infinity, to the side to which it fell.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=5.0, T_p=1.5)
    >>> response = with_envelope(respond(bent, pulse), pulse)
    >>> bool((response.theta_low <= response.theta_high).all())
    True
    """
    chosen = ensemble or Ensemble()
    require_members(chosen)
    each = _member_responses(response.frame, motion, chosen, versions)
    rotations = np.stack([_until_fallen(history.theta) for history, _ in each], axis=-1)
    low, _, high = np.moveaxis(quantiles(rotations), -1, 0)
    return replace(response, theta_low=low, theta_high=high)


def _member_responses(
    frame: RockingFrame, motion: Motion, ensemble: Ensemble, versions: Versions | None
) -> Iterator[tuple[Response, GroundAcceleration]]:
    """Yield the response of each member with its history, and the ground motion of the member."""
    grounds, [of_member] = shaken([motion], ensemble, [versions])
    require_motion(ensemble, grounds[0])  # the vertical motion of all versions is the same
    scales = draws(ensemble)[:, 3].tolist()
    family = members(ensemble, frame)
    for member, version, scale in zip(family, of_member.tolist(), scales, strict=True):
        ground = grounds[version].scaled(scale)
        yield respond(member, ground), ground


def with_forces(
    response: Response,
    motion: Motion,
    ensemble: Ensemble | None = None,
    versions: Versions | None = None,
) -> Response:
    """Add the largest forces at the joints to a response, with their bands if there is an ensemble.

    Parameters
    ----------
    response : Response
        A response from `respond`.
    motion : Record, Pulse or GroundAcceleration
        The motion of the response.
    ensemble : Ensemble, optional
        Number of members, spreads and seed; without it or without members, there are no bands.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Raises
    ------
    ParameterError
        If a member cannot rock, the vertical acceleration falls faster than gravity, or the nodes
        of the motion are not those of the response.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5)
    >>> response = with_forces(respond(bent, pulse), pulse, Ensemble(members=16))
    >>> [round(force, 3) for force in response.force_bands.peak_base_shear]
    [0.186, 0.186, 0.188]
    """
    response = replace(response, forces=joint_forces(response, motion))
    if ensemble is None or not ensemble.members:
        return response
    each = [
        astuple(joint_forces(member, ground))
        for member, ground in _member_responses(response.frame, motion, ensemble, versions)
    ]
    return replace(response, force_bands=force_bands(np.array(each), response.frame))


def force_bands(each: Float, frame: RockingFrame) -> JointForces[Band]:
    """Return the bands of forces, shape (members, forces); those of members that overturn are NaN.

    Forces are in the order of `JointForces`. A member that overturns counts as beyond all others:
    above the largest, below the least force.
    """
    names = [field.name for field in fields(JointForces)]
    fallen = np.isnan(each[:, names.index("peak_base_shear")])
    bands = {}
    for name, forces in zip(names, each.T, strict=True):
        worse = -1.0 if name.endswith("_least") else 1.0
        there = frame.mass_ratio > 0.0 or not name.startswith("top")
        bounds = worse * quantiles(np.where(fallen & there, math.inf, worse * forces))
        bands[name] = tuple(sorted(bounds.tolist()))
    return JointForces(**bands)


def _until_fallen(theta: Float) -> Float:
    """Return rotations with infinity, to the side of the last one, in place of NaN."""
    fallen = np.isnan(theta)
    if not fallen.any():
        return theta
    side = theta[max(int(fallen.argmax()) - 1, 0)]
    return np.where(fallen, math.copysign(math.inf, side), theta)


def quantiles(peaks: Float) -> Float:
    """Return the `QUANTILES` along the last axis, interpolated linearly between members.

    A quantile is infinite if it falls on a member with an infinite peak, or next to one.

    Examples
    --------
    >>> quantiles(np.array([1.0, 2.0, 3.0, math.inf, math.inf]))
    array([1.64, 3.  ,  inf])
    """
    ordered = np.sort(peaks, axis=-1)
    place = np.array(QUANTILES) * (peaks.shape[-1] - 1)
    below = np.floor(place).astype(int)
    share = place - below
    low, high = ordered[..., below], ordered[..., np.ceil(place).astype(int)]
    with np.errstate(invalid="ignore"):
        between = np.where(share > 0.0, low + share * (high - low), low)
    quantile: Float = np.where(np.isinf(low), low, between)
    return quantile


def member_peaks(
    motions: Sequence[Motion],
    frames: Sequence[RockingFrame],
    ensemble: Ensemble,
    versions: Sequence[Versions | None] | None = None,
) -> MemberPeaks:
    """Compute the peaks of each member of the ensemble of each frame under each motion.

    Parameters and errors are those of `ensemble_responses`.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> from rockframe import Pulse
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.54 * 9.81, T_p=1.5)
    >>> member_peaks([pulse], [bent], Ensemble()).peaks["peak_u"].shape
    (1, 1, 64)
    """
    require_some(motions=motions, frames=frames)
    require_members(ensemble)
    grounds, of_member = shaken(motions, ensemble, versions)
    for ground in grounds:
        require_motion(ensemble, ground)
    family = [*chain(*(members(ensemble, frame) for frame in frames))]
    shape = (len(motions), len(frames), ensemble.members)
    motion = np.tile(of_member, len(frames)).ravel()
    whose = np.tile(np.arange(len(family)), len(motions))
    scale = np.tile(draws(ensemble)[:, 3], len(motions) * len(frames))
    scenarios = respond_scenarios(
        [Prepared(ground) for ground in grounds], family, motion, whose, scale, demands=True
    )
    shear, friction = scenarios.base_shear.copy(), scenarios.friction_demand.copy()
    for k in np.flatnonzero(np.isnan(shear)).tolist():
        ground = grounds[motion[k]].scaled(float(scale[k]))
        shear[k], friction[k] = _demands_one_by_one(family[whose[k]], ground)
    peaks = _peaks(scenarios, ensemble, frames, shear.reshape(shape), friction.reshape(shape))
    ended = peaks.limits_reached.any(axis=0) & (peaks.verdict != Verdict.OVERTURNS)
    for place in np.argwhere(ended).tolist():
        row = int(np.ravel_multi_index(place, shape))
        ground = grounds[motion[row]].scaled(float(scale[row]))
        demands = _demands_one_by_one(family[whose[row]], ground)
        for name, demand in zip(("peak_base_shear", "friction_demand"), demands, strict=True):
            peaks.peaks[name][*place] = demand
    return peaks


def shaken(
    motions: Sequence[Motion], ensemble: Ensemble, versions: Sequence[Versions | None] | None
) -> tuple[list[GroundAcceleration], NDArray[np.int64]]:
    """Return all versions of the motions, and the index of that of each member.

    The indices have the shape (motions, members). Without `versions`, each motion has only one.
    """
    grounds: list[GroundAcceleration] = []
    of_member = np.empty((len(motions), ensemble.members), dtype=np.int64)
    for i, motion in enumerate(motions):
        own = None if versions is None else versions[i]
        of_member[i] = len(grounds) + (0 if own is None else own.of_member)
        grounds += [as_ground(motion)] if own is None else own.grounds
    return grounds, of_member


def _demands_one_by_one(frame: RockingFrame, ground: GroundAcceleration) -> tuple[float, float]:
    """Return base shear and friction demand of a frame until its model ends, from its history."""
    response = respond(frame, ground)
    if response.verdict is Verdict.OVERTURNS:
        return math.inf, math.inf
    valid, forces = valid_reactions(response, ground)
    demands = [forces.base_friction_demand]
    demands += [forces.top_friction_demand] if frame.mass_ratio > 0.0 else []
    impact = impact_friction_demand(frame) if valid.impacts else 0.0
    shear = np.abs(forces.support_shear).max() / (1.0 + frame.mass_ratio)
    return float(shear), max(float(np.max(demands)), impact)


def _peaks(
    scenarios: Scenarios,
    ensemble: Ensemble,
    frames: Sequence[RockingFrame],
    shear: Float,
    friction: Float,
) -> MemberPeaks:
    """Return the peaks of members, in the shape of the shears."""
    verdict = scenarios.verdict.reshape(shear.shape)
    rotation = scenarios.peak_rotation.reshape(shear.shape)
    speed = scenarios.impact_velocity.reshape(shear.shape)
    length, angle, impact = np.stack([_levers(ensemble, frame) for frame in frames], axis=1)
    beam = Lever(length, angle)
    u, v = beam.shift(rotation), beam.lift(np.minimum(rotation, angle))
    tendon, dissipater = np.full((2, *shear.shape), math.nan)
    ended = np.zeros((len(MODEL_ENDS), *shear.shape), dtype=bool)
    for k, frame in enumerate(frames):
        if frame.restrained:
            family = members(ensemble, frame)
            tendon[:, k], dissipater[:, k] = _tie_forces(family, rotation[:, k])
        for event, (limit, peak) in _limits(frame, u[:, k], v[:, k], tendon[:, k]).items():
            ended[event - 1, :, k] = peak >= limit
        if frame.restrained and frame.abutment is not None:
            valid = np.minimum(rotation[:, k], [member.abutment_rotation for member in family])
            tendon[:, k], dissipater[:, k] = _tie_forces(family, valid)
    fallen = verdict == Verdict.OVERTURNS
    of_members = {
        "peak_rotation_ratio": scenarios.peak_rotation_ratio.reshape(shear.shape),
        "peak_u": u,
        "peak_v": v,
        "peak_impact_velocity": speed,
        "friction_demand": np.maximum(friction, np.where(speed > 0.0, impact, 0.0)),
        "peak_base_shear": shear,
        "peak_tendon_force": tendon,
        "peak_dissipater_force": dissipater,
    }
    peaks = {
        name: np.where(fallen & ~np.isnan(values), np.inf, values)
        for name, values in of_members.items()
    }
    return MemberPeaks(verdict=verdict, limits_reached=ended, peaks=peaks)


@lru_cache(maxsize=1024)
def _levers(ensemble: Ensemble, frame: RockingFrame) -> Float:
    """Return length [m] and angle [rad] of the beam's lever and the friction demand of impacts."""
    levers = [member.beam for member in members(ensemble, frame)]
    impacts = [impact_friction_demand(member) for member in members(ensemble, frame)]
    return np.array(
        [[lever.length for lever in levers], [lever.angle for lever in levers], impacts]
    )


def _tie_forces(family: Sequence[RockingFrame], rotation: Float) -> tuple[Float, Float]:
    """Return the forces of tendon and dissipaters [N] at peak rotations, shape (..., members).

    They grow with the rotation up to yielding; NaN without a tendon, or without dissipaters.
    """
    tendon, dissipater = np.full((2, *rotation.shape), math.nan)
    for k, frame in enumerate(family):
        if frame.tendon is not None:
            tendon[:, k] = [frame.tension(angle) for angle in rotation[:, k].tolist()]
        if frame.dissipater is not None:
            dissipater[:, k] = [frame.bar_force(angle) for angle in rotation[:, k].tolist()]
    return tendon, dissipater


def _limits(
    frame: RockingFrame, u: Float, v: Float, tendon: Float
) -> dict[ModelEnd, tuple[float, Float]]:
    """Return each limit of the model of a frame, with the peaks that it limits."""
    limits: dict[ModelEnd, tuple[float, Float]] = {}
    if frame.abutment is not None:
        limits[ModelEnd.GAP_CLOSES] = frame.abutment.gap, u
        limits[ModelEnd.LIFT_EXCEEDED] = frame.abutment.uplift_allowance, v
    if frame.tendon is not None and not frame.tendon.loses_prestress:
        limits[ModelEnd.TENDON_YIELDS] = frame.tendon.yield_force, tendon
    return limits


def _has_limit(frame: RockingFrame) -> bool:
    nothing = np.zeros(0)
    limits = _limits(frame, nothing, nothing, nothing).values()
    return any(math.isfinite(limit) for limit, _ in limits)
