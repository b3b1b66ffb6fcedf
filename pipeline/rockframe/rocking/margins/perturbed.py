"""Verdicts that small changes of the motion, of the impacts or of the sampling would turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import IntFlag
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.batch import respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.response import Verdict

Float = NDArray[np.float64]
Int = NDArray[np.int64]

#: A verdict is undecided if it changes with the amplitude within this share of it [1].
AMPLITUDE_PERTURBATION: Final = 0.01
#: So many amplitudes on either side are tried, beside the edges that are known.
_AMPLITUDES: Final = 10
#: So it is if it changes with the velocity ratio of impacts, changed by this share [1].
RESTITUTION_PERTURBATION: Final = 0.01

#: Half the length [samples] and the shape of the window of the interpolation between samples: up
#: to 0.9 of the highest frequency that is sampled it is exact to 1e-4.
_TAPS: Final = 32
_KAISER: Final = 8.0


class Sensitivity(IntFlag):
    """What changes whether a frame overturns; the bits of the flag variable `undecided_by`."""

    AMPLITUDE = 1
    RESTITUTION = 2
    TIME_STEP = 4


def sensitivities(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    intervals: Sequence[Float],
    largest: Float,
) -> list[Sensitivity]:
    """Find the perturbations that change whether frames overturn.

    Parameters
    ----------
    grounds, frames : sequence
        What shakes, and what is shaken.
    ground, frame : array of int, shape (lines,)
        Which of them belong together.
    intervals : sequence of array, shape (intervals, 2)
        For each of these the scales between which it overturns, as far as they are known.
    largest : array, shape (lines,)
        Scales that the ground may have at most.

    Returns
    -------
    list of Sensitivity
        By the amplitude: it overturns at some scales within 1 % of 1 and not at others. By the
        restitution: with sqrt(r) 1 % smaller, or larger if eq (43) allows. By the time step: with
        the record sampled twice as finely, by band-limited interpolation.
    """
    others = [*frames, *(_duller(one) for one in frames), *(_livelier(one) for one in frames)]
    of_frame = np.concatenate([frame + k * len(frames) for k in range(3)])
    once = np.ones(ground.size)
    as_it_is, duller, livelier = _overturns(
        grounds, others, np.tile(ground, 3), of_frame, np.tile(once, 3)
    ).reshape(3, -1)
    finer = _overturns([resampled(one) for one in grounds], frames, ground, frame, once)
    steps = np.arange(-_AMPLITUDES, _AMPLITUDES + 1) / _AMPLITUDES
    near = np.minimum(1.0 + AMPLITUDE_PERTURBATION * steps[:, None], largest)
    tile = (steps.size, 1)
    beside = _overturns(
        grounds,
        frames,
        np.tile(ground, tile).ravel(),
        np.tile(frame, tile).ravel(),
        near.ravel(),
    ).reshape(near.shape)
    changed = {
        Sensitivity.AMPLITUDE: np.array([_splits(found) for found in intervals], dtype=bool)
        | (beside != as_it_is).any(axis=0),
        Sensitivity.RESTITUTION: (duller != as_it_is) | (livelier != as_it_is),
        Sensitivity.TIME_STEP: finer != as_it_is,
    }
    found = [Sensitivity(0)] * ground.size
    for bit, lines in changed.items():
        found = [one | bit if line else one for one, line in zip(found, lines, strict=True)]
    return found


def _overturns(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    scale: Float,
) -> NDArray[np.bool_]:
    found = respond_scenarios(grounds, frames, ground, frame, scale)
    return np.asarray(found.verdict == Verdict.OVERTURNED)


def _splits(intervals: Float) -> bool:
    """Whether some of the scales near 1 are within an interval, and some are not."""
    low, high = 1.0 - AMPLITUDE_PERTURBATION, 1.0 + AMPLITUDE_PERTURBATION
    near = intervals[(intervals[:, 0] <= high) & ~(intervals[:, 1] < low)]
    return len(near) > 0 and not (len(near) == 1 and near[0, 0] <= low and not near[0, 1] < high)


def _duller(frame: RockingFrame) -> RockingFrame:
    factor = (1.0 - RESTITUTION_PERTURBATION) * frame.restitution_factor
    return replace(frame, restitution_factor=factor)


def _livelier(frame: RockingFrame) -> RockingFrame:
    factor = (1.0 + RESTITUTION_PERTURBATION) * frame.restitution_factor
    return replace(frame, restitution_factor=min(1.0, factor))


def resampled(ground: GroundAcceleration) -> GroundAcceleration:
    """Return a record sampled twice as finely; a continuous function is returned as it is.

    Parameters
    ----------
    ground : GroundAcceleration
        Straight lines between samples, or polynomials of higher degree.

    Examples
    --------
    >>> import numpy as np
    >>> coarse = GroundAcceleration.from_samples(np.sin(np.arange(200.0)), 1.0)
    >>> between = resampled(coarse).acceleration()[101]
    >>> bool(abs(between - np.sin(50.5)) < 1e-5)
    True
    """
    if ground.coefficients.shape[1] != 2:
        return ground
    step = 0.5 * ground.time_step
    finer = GroundAcceleration.from_samples(
        _interleaved(ground.acceleration()), step, ground.start_time
    )
    if ground.vertical is None:
        return finer
    last = ground.vertical[-1, 0] + ground.time_step * ground.vertical[-1, 1]
    upwards = np.append(ground.vertical[:, 0], last)
    return finer.with_vertical(
        GroundAcceleration.from_samples(_interleaved(upwards), step, ground.start_time)
    )


def _interleaved(samples: Float) -> Float:
    """Samples and what lies half-way between them, by the sampling theorem with a Kaiser window."""
    distance = np.arange(-_TAPS, _TAPS) + 0.5
    window = np.i0(_KAISER * np.sqrt(1.0 - (distance / _TAPS) ** 2)) / np.i0(_KAISER)
    weights = np.sinc(distance) * window
    between = np.convolve(samples, weights / weights.sum())[_TAPS : _TAPS + samples.size - 1]
    finer = np.empty(2 * samples.size - 1)
    finer[::2] = samples
    finer[1::2] = between
    return finer
