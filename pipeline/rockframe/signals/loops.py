"""Compiled loops over the samples of a record."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled

Float = NDArray[np.float64]


@compiled
def through_sections(sections: Float, series: Float) -> Float:
    """Return a series filtered by second-order sections, shape (sections, 6), with a0 = 1.

    The filter has been at rest under the first sample for ever, so a constant leaves no transient;
    its first section must not pass a constant. The operations and their order are those of
    `scipy.signal.sosfilt`, whose import takes longer than most commands.
    """
    state = np.zeros((sections.shape[0], 2))
    state[0] = -sections[0, 0] * series[0]
    filtered = np.empty_like(series)
    for k in range(series.size):
        value = series[k]
        for i in range(sections.shape[0]):
            given, one = value, sections[i]
            value = one[0] * given + state[i, 0]
            state[i, 0] = one[1] * given - one[4] * value + state[i, 1]
            state[i, 1] = one[2] * given - one[5] * value
        filtered[k] = value
    return filtered


@compiled
def through_oscillator(
    free: Float, before: Float, after: Float, ground: Float, steps: int
) -> Float:
    """Return displacement and velocity of an oscillator at each sample, shape (2, samples).

    It is at rest at the first sample. One step adds `free`, shape (2, 2), times displacement and
    velocity; `before`, shape (2,), times the ground motion before the step; and `after` times that
    after it. `steps` more of them follow the last sample, without ground motion.
    """
    found = np.empty((2, ground.size + steps))
    x = v = found[0, 0] = found[1, 0] = 0.0
    earlier = ground[0]
    for k in range(1, ground.size):
        now = ground[k]
        x, v = (
            free[0, 0] * x + free[0, 1] * v + before[0] * earlier + after[0] * now,
            free[1, 0] * x + free[1, 1] * v + before[1] * earlier + after[1] * now,
        )
        found[0, k], found[1, k] = x, v
        earlier = now
    for k in range(ground.size, ground.size + steps):
        x, v = free[0, 0] * x + free[0, 1] * v, free[1, 0] * x + free[1, 1] * v
        found[0, k], found[1, k] = x, v
    return found
