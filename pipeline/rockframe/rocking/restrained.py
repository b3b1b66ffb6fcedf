"""Tendons, dissipaters and abutments: the input of the kernel, and their response."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.rocking.kernels import ties

Float = NDArray[np.float64]

#: Largest moment of ties over that of gravity. The stronger the ties, the smaller the kernel's
#: steps.
_STRONGEST: Final = 1e4
_NONE: Final = (0.0, 0.0, math.inf, -math.inf, ties.ELASTIC)


@dataclass(frozen=True, eq=False)
class RestraintResponse:
    """Forces, yielding and energy of the tendons and dissipaters of a frame.

    Parameters
    ----------
    tendon_force : array, shape (nodes,)
        Force of one tendon [N]; NaN after overturning, or without tendons.
    dissipater_force : array, shape (nodes,)
        Force of the dissipaters across one joint [N]; NaN after overturning, or without them.
    peak_tendon_force : float
        Largest force of a tendon, also after the end of the motion [N].
    tendon_yields, dissipater_yields : float
        Time at which the yield force is first reached [s]; NaN if never.
    tendon_force_left : float
        Force of a tendon when the frame has come to rest [N]: less than the prestress if the tendon
        has yielded, more if dissipaters keep the joints open; NaN if the frame overturns.
    dissipated_energy : float
        Energy dissipated by yielding in one column, over the weight of the column [m].
    residual_rotation : float
        The |theta| at which the frame comes to rest [rad]; above zero if dissipaters keep the
        joints open. The moments of gravity, tendon and yielded dissipaters then balance.
    """

    tendon_force: Float
    dissipater_force: Float
    peak_tendon_force: float
    tendon_yields: float
    dissipater_yields: float
    tendon_force_left: float
    dissipated_energy: float
    residual_rotation: float


def ties_of(frame: RockingFrame) -> ties.Ties:
    """Return the ties of a frame for the kernel, as moments over the moment of gravity.

    Raises
    ------
    ParameterError
        If a tie is so strong that the kernel would never end.
    """
    if not frame.restrained:
        return ()
    tendon, dissipater = _NONE, _NONE
    if frame.tendon is not None:
        lever = frame.tie_lever
        tendon = (
            frame.tie_moment(frame.tendon.stiffness * lever, lever),
            frame.tie_moment(frame.tendon.prestress, lever),
            frame.tie_moment(frame.tendon.yield_force, lever),
            *((0.0, ties.CABLE) if frame.tendon.loses_prestress else (-math.inf, ties.ELASTIC)),
        )
    if frame.dissipater is not None:
        lever = frame.dissipater.lever_arm
        highest = frame.joints * frame.tie_moment(frame.dissipater.yield_force, lever)
        dissipater = (
            frame.joints * frame.tie_moment(frame.dissipater.stiffness * lever, lever),
            *(0.0, highest, -highest, ties.PLASTIC),
        )
    for name, tie in (("tendon", tendon), ("dissipater", dissipater)):
        moment = max(one for one in tie[:3] if math.isfinite(one))
        if moment > _STRONGEST:
            raise ParameterError(
                f"Invalid {name} of frame {frame.name!r}: its stiffness or force has {moment:.3g} "
                f"times the moment of gravity. Must be {_STRONGEST:g} times at most."
            )
    return tendon, dissipater


def restraint_response(
    frame: RockingFrame, forces: Float, log: Float, peak_rotation: float
) -> RestraintResponse:
    """Convert the kernel's results on the ties to forces.

    Parameters
    ----------
    frame : RockingFrame
        The frame.
    forces, log : array
        The arrays `forces` and `tie_log` that `kernel.integrate` filled.
    peak_rotation : float
        Largest |theta| [rad].
    """
    tendon, dissipater = frame.tendon, frame.dissipater
    nothing = np.full(forces.shape[0], math.nan)
    left = math.nan
    peak = frame.tension(peak_rotation) if tendon is not None else math.nan
    tendon_force = dissipater_force = nothing
    if tendon is not None:
        tendon_force = forces[:, 0] / frame.tie_moment(1.0, frame.tie_lever)
        rest = float(log[0, ties.REST])
        if not math.isnan(rest):
            stretched = ties.stretch(rest) - float(log[0, ties.PLASTIC_STRETCH])
            left = max(0.0, tendon.prestress + tendon.stiffness * frame.tie_lever * stretched)
    if dissipater is not None:
        dissipater_force = forces[:, 1] / frame.tie_moment(frame.joints, dissipater.lever_arm)
    return RestraintResponse(
        tendon_force=tendon_force,
        dissipater_force=dissipater_force,
        peak_tendon_force=peak,
        tendon_yields=float(log[0, ties.YIELD_TIME]),
        dissipater_yields=float(log[1, ties.YIELD_TIME]),
        tendon_force_left=left,
        dissipated_energy=float(log[:, ties.WORK].sum()) * frame.moment_arm,
        residual_rotation=float(log[0, ties.REST]),
    )


def first_crossing(time: Float, u: Float, velocity: Float, level: float) -> tuple[float, float]:
    """Return when and how fast |u| first reaches a level; between nodes u is a Hermite cubic.

    Returns
    -------
    (float, float)
        Time [s] and speed [m s-1]; NaN if the level is never reached.

    Examples
    --------
    >>> time = np.array([0.0, 1.0])
    >>> first_crossing(time, time**2, 2.0 * time, 0.25)
    (0.5, 1.0)
    """
    if level <= 0.0:
        return math.nan, math.nan
    if abs(u[0]) >= level:
        return float(time[0]), abs(float(velocity[0]))
    size, speed = np.abs(u), np.abs(velocity)
    # no Hermite cubic exceeds its larger end by more than 4/27 of this
    within = (speed[1:] + speed[:-1]) * np.diff(time)
    near = np.flatnonzero(np.maximum(size[1:], size[:-1]) + 4.0 / 27.0 * within >= level)
    if not near.size:
        return math.nan, math.nan
    from scipy.interpolate import CubicHermiteSpline  # takes long to import

    for k in near:
        piece = slice(k, k + 2)
        path = CubicHermiteSpline(time[piece], u[piece], velocity[piece])
        side = u[k] if size[k] > size[k + 1] else u[k + 1]
        roots = path.solve(math.copysign(level, side), extrapolate=False)
        if roots.size or size[k + 1] >= level:
            when = float(roots[0]) if roots.size else float(time[k + 1])
            return when, abs(float(path(when, 1)))
    return math.nan, math.nan
