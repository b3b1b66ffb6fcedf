"""Verdicts that small changes of the motion, the impacts, the sampling or the dimensions turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import IntFlag
from itertools import chain
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.rocking.batch import respond_scenarios
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.robust import RobustMargin
from rockframe.rocking.response import Verdict

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

#: A verdict is undecided if it changes with the amplitude within this share of it [1].
AMPLITUDE_PERTURBATION: Final = 0.01
#: A verdict is undecided if it changes with the velocity ratio of impacts within this share [1].
RESTITUTION_PERTURBATION: Final = 0.01
#: Number of values of both that are tried on either side, beside the edges that are known.
_VALUES: Final = 10
#: Number of them where less than 1 + AMPLITUDE_PERTURBATION is known to overturn: there some
#: twentieth of the scales may stand, one here and one there.
_AMPLITUDES: Final = 50

#: Half the length [samples] and the shape of the window of the interpolation between samples: up
#: to 0.9 of the highest frequency that is sampled it is exact to 1e-4.
_TAPS: Final = 32
_KAISER: Final = 8.0


class Sensitivity(IntFlag):
    """Perturbations that change whether a frame overturns; bits of the flags `undecided_by`."""

    AMPLITUDE = 1
    RESTITUTION = 2
    SAMPLING = 4
    DIMENSIONS = 8


def sensitivities(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    intervals: Sequence[Float],
    largest: Float,
    robust: Sequence[RobustMargin | None],
) -> list[Sensitivity]:
    """Find the perturbations that change whether frames overturn.

    Parameters
    ----------
    grounds, frames : sequence
        Ground motions and frames.
    ground, frame : array of int, shape (lines,)
        Indices of the ground motion and the frame of each line.
    intervals : sequence of array, shape (intervals, 2)
        Known intervals of scales in which each line overturns.
    largest : array, shape (lines,)
        Largest scale of each line.
    robust : sequence of RobustMargin or None, shape (lines,)
        Robust margin of each line, if one was requested.

    Returns
    -------
    list of Sensitivity
        One of each line, with the flags of the perturbations that change its verdict. AMPLITUDE:
        some scales within 1 % of 1. RESTITUTION: some sqrt(r) within 1 % of the stated one and at
        most that of eq (43). SAMPLING: the record sampled twice as finely, by band-limited
        interpolation. DIMENSIONS: the robust margin contradicts the verdict.
    """
    once = np.ones(ground.size)
    as_it_is = _overturns(grounds, frames, ground, frame, once)
    finer = _overturns([resampled(one) for one in grounds], frames, ground, frame, once)
    line, near = _amplitudes(intervals, largest)
    scaled = _overturns(grounds, frames, ground[line], frame[line], near)
    others = [_with_other_impacts(one) for one in frames]
    count = np.array([len(each) for each in others])
    start = np.cumsum(count) - count
    place = np.concatenate([np.arange(count[k]) + start[k] for k in frame.tolist()])
    of = np.repeat(np.arange(ground.size), count[frame])
    duller = _overturns(grounds, [*chain(*others)], ground[of], place, np.ones(of.size))
    changed = {
        Sensitivity.AMPLITUDE: np.array([_splits(found) for found in intervals], dtype=bool)
        | _differ(scaled, as_it_is, line),
        Sensitivity.RESTITUTION: _differ(duller, as_it_is, of),
        Sensitivity.SAMPLING: finer != as_it_is,
        Sensitivity.DIMENSIONS: np.array(
            [
                one is not None and one.contradicts(overturns)
                for one, overturns in zip(robust, as_it_is.tolist(), strict=True)
            ]
        ),
    }
    found = [Sensitivity(0)] * ground.size
    for bit, lines in changed.items():
        found = [one | bit if line else one for one, line in zip(found, lines, strict=True)]
    return found


def _amplitudes(intervals: Sequence[Float], largest: Float) -> tuple[Int, Float]:
    """Lines and the scales near 1 that are tried for each."""
    known = [each.size > 0 and each[0, 0] <= 1.0 + AMPLITUDE_PERTURBATION for each in intervals]
    steps = [_steps(_AMPLITUDES if one else _VALUES) for one in known]
    line = np.repeat(np.arange(len(steps)), [each.size for each in steps])
    return line, np.minimum(1.0 + AMPLITUDE_PERTURBATION * np.concatenate(steps), largest[line])


def _steps(values: int) -> Float:
    return np.arange(-values, values + 1) / values


def _differ(overturns: Bool, as_it_is: Bool, line: Int) -> Bool:
    """Mark lines with scenarios that do not end as the motion and frame themselves do."""
    counts = np.bincount(line[overturns != as_it_is[line]], minlength=as_it_is.size)
    return np.asarray(counts > 0)


def _overturns(
    grounds: Sequence[GroundAcceleration],
    frames: Sequence[RockingFrame],
    ground: Int,
    frame: Int,
    scale: Float,
) -> Bool:
    found = respond_scenarios(grounds, frames, ground, frame, scale)
    return np.asarray(found.verdict == Verdict.OVERTURNED)


def _splits(intervals: Float) -> bool:
    """Say if some of the scales near 1 are within an interval, and some are not."""
    low, high = 1.0 - AMPLITUDE_PERTURBATION, 1.0 + AMPLITUDE_PERTURBATION
    near = intervals[(intervals[:, 0] <= high) & ~(intervals[:, 1] < low)]
    return len(near) > 0 and not (len(near) == 1 and near[0, 0] <= low and not near[0, 1] < high)


def _with_other_impacts(frame: RockingFrame) -> list[RockingFrame]:
    """Frames whose velocity ratio of impacts is within 1 %, and at most that of eq (43)."""
    factors = frame.restitution_factor * (1.0 + RESTITUTION_PERTURBATION * _steps(_VALUES))
    return [
        replace(frame, restitution_factor=factor)
        for factor in np.unique(np.minimum(factors, 1.0)).tolist()
    ]


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
