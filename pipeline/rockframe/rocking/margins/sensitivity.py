"""Small changes of motion, impacts, sampling or dimensions that change a verdict."""

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
from rockframe.rocking.stated_verdict import Verdict

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

#: Largest relative change of the amplitude that is tried [1].
AMPLITUDE_PERTURBATION: Final = 0.01
#: Largest relative change of the velocity ratio of impacts that is tried [1].
RESTITUTION_PERTURBATION: Final = 0.01
#: Number of values tried above the stated amplitude or velocity ratio, and the same number below.
_VALUES: Final = 10
#: Number of amplitudes tried on either side if an amplitude below 1 + AMPLITUDE_PERTURBATION is
#: known to overturn the frame: near it, scattered scales that stand may be as few as 1 in 20.
_AMPLITUDES: Final = 50

#: Half length [samples] and shape parameter of the Kaiser window of the interpolation. Its error
#: is at most 1e-4 up to 0.9 of the Nyquist frequency.
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
        Indices of the ground motion and the frame of each pair (line).
    intervals : sequence of array, shape (intervals, 2)
        Known intervals of scales in which each line overturns.
    largest : array, shape (lines,)
        Largest scale of each line.
    robust : sequence of RobustMargin or None, shape (lines,)
        Robust margin of each line, if one was requested.

    Returns
    -------
    list of Sensitivity
        For each line, the flags of the perturbations that change its verdict. AMPLITUDE: a scale
        within 1 % of 1. RESTITUTION: a velocity ratio sqrt(r) within 1 % of the stated one and not
        above eq (43). SAMPLING: the record, sampled twice as finely by band-limited interpolation.
        DIMENSIONS: the robust margin contradicts the verdict.
    """
    once = np.ones(ground.size)
    unperturbed = _overturns(grounds, frames, ground, frame, once)
    finer = _overturns([resampled(one) for one in grounds], frames, ground, frame, once)
    line, near = _amplitudes(intervals, largest)
    rescaled = _overturns(grounds, frames, ground[line], frame[line], near)
    others = [_with_other_impacts(one) for one in frames]
    count = np.array([len(each) for each in others])
    start = np.cumsum(count) - count
    place = np.concatenate([np.arange(count[k]) + start[k] for k in frame.tolist()])
    of = np.repeat(np.arange(ground.size), count[frame])
    other_impacts = _overturns(grounds, [*chain(*others)], ground[of], place, np.ones(of.size))
    changed = {
        Sensitivity.AMPLITUDE: np.array([_splits(found) for found in intervals], dtype=bool)
        | _differ(rescaled, unperturbed, line),
        Sensitivity.RESTITUTION: _differ(other_impacts, unperturbed, of),
        Sensitivity.SAMPLING: finer != unperturbed,
        Sensitivity.DIMENSIONS: np.array(
            [
                one is not None and one.contradicts(overturns)
                for one, overturns in zip(robust, unperturbed.tolist(), strict=True)
            ]
        ),
    }
    found = [Sensitivity(0)] * ground.size
    for bit, lines in changed.items():
        found = [one | bit if line else one for one, line in zip(found, lines, strict=True)]
    return found


def _amplitudes(intervals: Sequence[Float], largest: Float) -> tuple[Int, Float]:
    """Return the scales near 1 that are tried, and the index of the pair of each."""
    known = [each.size > 0 and each[0, 0] <= 1.0 + AMPLITUDE_PERTURBATION for each in intervals]
    steps = [_steps(_AMPLITUDES if one else _VALUES) for one in known]
    line = np.repeat(np.arange(len(steps)), [each.size for each in steps])
    return line, np.minimum(1.0 + AMPLITUDE_PERTURBATION * np.concatenate(steps), largest[line])


def _steps(values: int) -> Float:
    return np.arange(-values, values + 1) / values


def _differ(overturns: Bool, unperturbed: Bool, line: Int) -> Bool:
    """Return which lines have a perturbed scenario whose outcome differs from the unperturbed."""
    counts = np.bincount(line[overturns != unperturbed[line]], minlength=unperturbed.size)
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
    """Return True if some of the scales near 1 are within an interval and others are not."""
    low, high = 1.0 - AMPLITUDE_PERTURBATION, 1.0 + AMPLITUDE_PERTURBATION
    near = intervals[(intervals[:, 0] <= high) & ~(intervals[:, 1] < low)]
    return len(near) > 0 and not (len(near) == 1 and near[0, 0] <= low and not near[0, 1] < high)


def _with_other_impacts(frame: RockingFrame) -> list[RockingFrame]:
    """Return frames with velocity ratios within 1 % of the frame's and not above eq (43)."""
    factors = frame.restitution_factor * (1.0 + RESTITUTION_PERTURBATION * _steps(_VALUES))
    return [
        replace(frame, restitution_factor=factor)
        for factor in np.unique(np.minimum(factors, 1.0)).tolist()
    ]


def resampled(ground: GroundAcceleration) -> GroundAcceleration:
    """Return a sampled motion with half the time step; return a continuous motion unchanged.

    Parameters
    ----------
    ground : GroundAcceleration
        The motion. Only a piecewise linear one is resampled.

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
    """Return samples and values half-way between them, by Kaiser-windowed sinc interpolation."""
    distance = np.arange(-_TAPS, _TAPS) + 0.5
    window = np.i0(_KAISER * np.sqrt(1.0 - (distance / _TAPS) ** 2)) / np.i0(_KAISER)
    weights = np.sinc(distance) * window
    between = np.convolve(samples, weights / weights.sum())[_TAPS : _TAPS + samples.size - 1]
    finer = np.empty(2 * samples.size - 1)
    finer[::2] = samples
    finer[1::2] = between
    return finer
