"""Verdicts and peaks of many scenarios, without histories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.engines.threads import on_threads, threads
from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.kernels import kernel
from rockframe.rocking.kernels.excursions import DISTANCE
from rockframe.rocking.response import as_ground, refuse_flight, require_some
from rockframe.rocking.scenario_packing import (
    AT_A_TIME,
    Prepared,
    Results,
    ScenarioPacker,
    constants_of,
)
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]
Index = NDArray[np.intp]
Motion = Record | Pulse | GroundAcceleration | Prepared

#: Number of scenarios for which another thread pays off.
_WORTH_A_THREAD: Final = 256


@dataclass(frozen=True, eq=False)
class Scenarios:
    """Outcome of each scenario, in the order of the request.

    Parameters
    ----------
    verdict : array of int8, shape (scenarios,)
        Values of `Verdict`.
    peak_rotation : array, shape (scenarios,)
        Largest absolute rotation [rad], including free rocking after the end of the motion; pi/2
        if overturned.
    peak_rotation_ratio : array, shape (scenarios,)
        Largest absolute rotation over the slenderness of the frame [1].
    peak_velocity : array, shape (scenarios,)
        Largest absolute angular velocity [rad s-1], including free rocking; for a frame that
        overturns, until overturning.
    impact_velocity : array, shape (scenarios,)
        Largest velocity [m s-1] at which the lifted corner of a column's base meets the ground,
        2 b |theta'| just before an impact, including free rocking; 0 if there is no impact.
    uplift_time, overturning_time : array, shape (scenarios,)
        Times of the first uplift and of overturning [s]; NaN if there is none.
    impacts : array of int32, shape (scenarios,)
        Number of impacts during the motion, or until overturning.
    excursions : array, shape (scenarios, kept, 3)
        Excursions with the largest distances from the separatrix of the linear theory, the largest
        first: start [s], side (+1 or -1), and distance [alpha], positive beyond the separatrix and
        minus infinity if a scenario has fewer excursions. An excursion that overturns is the last
        one of its scenario in time.
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    peak_velocity: Float
    impact_velocity: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]
    excursions: Float


@dataclass(frozen=True, eq=False)
class Peaks:
    """Outcome of each frame under each motion at each scale.

    Parameters
    ----------
    verdict : array of int8, shape (motions, frames, scales)
        Values of `Verdict`.
    peak_rotation : array, shape (motions, frames, scales)
        Largest absolute rotation [rad], including free rocking after the end of the motion; pi/2
        if overturned.
    peak_rotation_ratio : array, shape (motions, frames, scales)
        Largest absolute rotation over the slenderness of the frame [1].
    peak_velocity : array, shape (motions, frames, scales)
        Largest absolute angular velocity [rad s-1], until overturning.
    impact_velocity : array, shape (motions, frames, scales)
        Largest velocity [m s-1] at which the lifted corner of a column's base meets the ground,
        2 b |theta'| just before an impact, including free rocking; 0 if there is no impact.
    uplift_time, overturning_time : array, shape (motions, frames, scales)
        Times of the first uplift and of overturning [s]; NaN if there is none.
    impacts : array of int32, shape (motions, frames, scales)
        Number of impacts during the motion, or until overturning.
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    peak_velocity: Float
    impact_velocity: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]


def respond_scenarios(
    grounds: Sequence[Motion],
    frames: Sequence[RockingFrame],
    ground: ArrayLike,
    frame: ArrayLike,
    scale: ArrayLike,
    *,
    excursions: int = 0,
) -> Scenarios:
    """Compute verdict and peaks of scenarios. A scenario is a frame under a motion at a scale.

    Parameters
    ----------
    grounds : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames; each with its own restitution factor.
    ground, frame : array_like of int, shape (scenarios,)
        Scenario k is ``frames[frame[k]]`` under ``grounds[ground[k]]``.
    scale : array_like, shape (scenarios,)
        Factor of the horizontal and vertical acceleration [1].
    excursions : int
        Largest number of excursions to keep for each scenario. Above 0, the computation takes a
        sixth longer.

    Returns
    -------
    Scenarios
        The result of a scenario has the same bits whichever other scenarios are computed, in
        whichever order.

    Raises
    ------
    ParameterError
        If the three arrays differ in length, an index is out of range, a scale is not finite, or a
        scaled vertical acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> column = RockingFrame(height=9.6, width=1.6)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.5)
    >>> found = respond_scenarios([pulse], [bent, column], [0, 0, 0], [0, 0, 1], [0.1, 0.5, 0.5])
    >>> found.peak_rotation_ratio.round(4)
    array([0.    , 0.6517, 9.5114])
    """
    which, whose, factors = _checked(len(grounds), len(frames), ground, frame, scale)
    constants = np.array([constants_of(frame) for frame in frames]).reshape(len(frames), -1)
    widths = np.array([frame.width for frame in frames])
    _refuse_flights(grounds, which, factors)
    order = np.argsort(which, kind="stable")
    results = Results(factors.size, excursions)

    def compute(part: Index) -> None:
        packer = ScenarioPacker(results)
        for chosen in np.split(part, np.flatnonzero(np.diff(which[part])) + 1):
            motion = grounds[which[chosen[0]]]
            ready = motion if isinstance(motion, Prepared) else Prepared(as_ground(motion))
            packer.add(chosen, ready, factors[chosen], constants[whose[chosen]])
        packer.complete()

    on_threads(compute, _parts(order))
    return Scenarios(
        verdict=results.verdicts,
        peak_rotation=results.summaries[:, kernel.PEAK].copy(),
        peak_rotation_ratio=results.summaries[:, kernel.PEAK] / constants[whose, 0],
        peak_velocity=results.summaries[:, kernel.PEAK_VELOCITY].copy(),
        impact_velocity=results.summaries[:, kernel.IMPACT_VELOCITY] * widths[whose],
        uplift_time=results.summaries[:, kernel.UPLIFT_TIME].copy(),
        overturning_time=results.summaries[:, kernel.OVERTURNING_TIME].copy(),
        impacts=results.summaries[:, kernel.IMPACTS].astype(np.int32),
        excursions=_highest_first(results.excursions),
    )


def respond_many(
    motions: Sequence[Motion],
    frames: Sequence[RockingFrame],
    scales: ArrayLike = (1.0,),
) -> Peaks:
    """Compute verdict and peaks of each frame under each motion at each scale.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as for `respond`.
    frames : sequence of RockingFrame
        The frames; each with its own restitution factor.
    scales : array_like, shape (scales,)
        Factor of the horizontal and vertical acceleration [1].

    Returns
    -------
    Peaks
        The result of a scenario has the same bits whichever other scenarios are computed.

    Raises
    ------
    ParameterError
        If there is no motion, frame or scale, a scale is not finite, or a scaled vertical
        acceleration falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.5)
    >>> respond_many([pulse], [bent], [0.1, 0.5, 1.0]).peak_rotation_ratio[0, 0, :2].round(4)
    array([0.    , 0.6517])
    """
    factors = scales_of(scales, motions=motions, frames=frames)
    shape = (len(motions), len(frames), factors.size)
    ground, frame, scale = (axis.ravel() for axis in np.indices(shape))
    found = respond_scenarios(motions, frames, ground, frame, factors[scale])
    return Peaks(*(getattr(found, field.name).reshape(shape) for field in fields(Peaks)))


def scales_of(scales: ArrayLike, **others: Sequence[object]) -> Float:
    """Return scales as an array, after checking them and the others with `require_some`.

    Raises
    ------
    ParameterError
        If a sequence is empty or none, or a scale is not finite.
    """
    factors = np.atleast_1d(np.asarray(scales, dtype=np.float64))
    require_some(**others, scales=factors)  # type: ignore[arg-type]
    if factors.ndim != 1 or not np.isfinite(factors).all():
        raise ParameterError(f"Invalid scales {factors}. Must be a row of finite numbers.")
    return factors


def _refuse_flights(grounds: Sequence[Motion], which: Index, factors: Float) -> None:
    """Raise an error if a motion falls faster than gravity at one of its scales."""
    for k, motion in enumerate(grounds):
        ground = motion.ground if isinstance(motion, Prepared) else motion
        if isinstance(ground, GroundAcceleration) and ground.vertical is not None:
            scales = factors[which == k]
            for scale in (scales.min(), scales.max()) if scales.size else ():
                refuse_flight(ground, float(scale))


def _highest_first(excursions: Float) -> Float:
    order = np.argsort(-excursions[:, :, DISTANCE], axis=1, kind="stable")
    return np.take_along_axis(excursions, order[:, :, None], axis=1)


def _parts(order: Index) -> list[Index]:
    """Divide scenarios among threads, into parts that the kernel can take at a time."""
    if not order.size:
        return []
    worth = min(threads(), math.ceil(order.size / _WORTH_A_THREAD))
    return np.array_split(order, max(worth, math.ceil(order.size / AT_A_TIME)))


def _checked(
    grounds: int, frames: int, ground: ArrayLike, frame: ArrayLike, scale: ArrayLike
) -> tuple[Index, Index, Float]:
    """Return the checked indices and scales of the requested scenarios."""
    factors = np.asarray(scale, dtype=np.float64)
    indices = []
    for label, values, number in (("ground", ground, grounds), ("frame", frame, frames)):
        index = np.asarray(values)
        if index.size == 0:
            index = index.astype(np.intp)
        if index.shape != factors.shape or factors.ndim != 1:
            raise ParameterError(
                f"Invalid {label} indices of shape {index.shape}. Must be one row, as long as that "
                f"of the scales, {factors.shape}."
            )
        if not np.issubdtype(index.dtype, np.integer):
            raise ParameterError(f"Invalid {label} indices of {index.dtype}. Must be integers.")
        outside = np.flatnonzero((index < 0) | (index >= number))
        if outside.size:
            raise ParameterError(
                f"Invalid {label} index {index[outside[0]]} of scenario {outside[0]}. Must be 0 to "
                f"{number - 1}."
            )
        indices.append(index.astype(np.intp))
    wrong = np.flatnonzero(~np.isfinite(factors))
    if wrong.size:
        raise ParameterError(
            f"Invalid scale {factors[wrong[0]]} of scenario {wrong[0]}. Must be finite."
        )
    return indices[0], indices[1], factors
