"""Responses at scale: motions x frames x scales, verdicts and peaks without histories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.record import Record
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import as_ground, refuse_flight, respond
from rockframe.wavelets import Pulse

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Peaks:
    """What became of each frame under each motion at each scale.

    Parameters
    ----------
    verdict : array of int8, shape (motions, frames, scales)
        Values of `Verdict`.
    peak_rotation : array, shape (motions, frames, scales)
        Largest absolute rotation [rad], free rocking after the end of the motion included; pi/2
        if overturned.
    peak_rotation_ratio : array, shape (motions, frames, scales)
        The same over the slenderness of the frame [1].
    uplift_time, overturning_time : array, shape (motions, frames, scales)
        First uplift and overturning [s]; NaN if there is none.
    impacts : array of int32, shape (motions, frames, scales)
        Number of impacts during the motion.
    """

    verdict: NDArray[np.int8]
    peak_rotation: Float
    peak_rotation_ratio: Float
    uplift_time: Float
    overturning_time: Float
    impacts: NDArray[np.int32]


def respond_many(
    motions: Sequence[Record | Pulse | GroundAcceleration],
    frames: Sequence[RockingFrame],
    scales: ArrayLike = (1.0,),
) -> Peaks:
    """Compute verdict and peaks of each frame under each motion at each scale.

    Parameters
    ----------
    motions : sequence of Record, Pulse or GroundAcceleration
        Ground motions, as `respond` takes them.
    frames : sequence of RockingFrame
        The frames; each with its own restitution factor.
    scales : array_like, shape (scales,)
        What horizontal and vertical acceleration are multiplied by [1].

    Returns
    -------
    Peaks
        The same bits whatever else is in the batch.

    Raises
    ------
    ParameterError
        If there is no motion, frame or scale, a scale is not finite, or a vertical acceleration at
        its scale falls faster than gravity.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=9.81, T_p=1.5)
    >>> respond_many([pulse], [bent], [0.1, 0.5, 1.0]).peak_rotation_ratio[0, 0, :2].round(4)
    array([0.    , 0.6517])
    """
    factors = np.atleast_1d(np.asarray(scales, dtype=np.float64))
    for label, number in (
        ("motions", len(motions)),
        ("frames", len(frames)),
        ("scales", factors.size),
    ):
        if number == 0:
            raise ParameterError(f"Invalid number of {label}, 0. Must be one or more.")
    if factors.ndim != 1 or not np.isfinite(factors).all():
        raise ParameterError(f"Invalid scales {factors}. Must be a row of finite numbers.")
    shape = (len(motions), len(frames), factors.size)
    verdict = np.empty(shape, dtype=np.int8)
    impacts = np.empty(shape, dtype=np.int32)
    peak, ratio, uplift, overturning = np.empty((4, *shape))
    for i, motion in enumerate(motions):
        ground = as_ground(motion)
        for k, factor in enumerate(factors):
            refuse_flight(ground, float(factor))
            scaled = ground.scaled(float(factor))
            for j, frame in enumerate(frames):
                response = respond(frame, scaled)
                where = (i, j, k)
                verdict[where] = response.verdict
                peak[where] = response.peak_rotation
                ratio[where] = response.peak_rotation_ratio
                uplift[where] = response.uplift_time
                overturning[where] = response.overturning_time
                impacts[where] = response.impacts
    return Peaks(verdict, peak, ratio, uplift, overturning, impacts)
