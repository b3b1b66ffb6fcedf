"""The kernel of two unequal columns: their motion over a ground motion, with histories.

`linkage` derives the equation, and `steps` has one step of it. An impact at s = 0 takes a share of
s' that depends on the side. The functions take and return plain arrays and check nothing. This is
the reference for the vectorised kernel in `lanes`.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels import NO_UPLIFT, OVERTURNS, STANDS
from rockframe.rocking.kernels.steps import (
    ALOFT,
    FALLEN,
    MAX_SMOOTH_STRIDE,
    MAX_STRIDE,
    MOVING,
    NEVER,
    Polynomial,
    derivatives,
    exceed_bound,
    flight,
    most_events,
    shift,
)
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO, touches
from rockframe.unequal.kernels.steps import (
    BOUNCE,
    LIMIT,
    SIDE_SIZE,
    ZERO,
    lift_off,
    series,
    tail,
)

Float = NDArray[np.float64]

# Slots of the summary array.
PEAK_RIGHT: Final = 0  # largest course on the right
PEAK_LEFT: Final = 1
PEAK_TIME: Final = 2  # time of the larger course [s]; NaN if after the end of the motion
UPLIFT_TIME: Final = 3  # first uplift [s], NaN if none
OVERTURNING_TIME: Final = 4  # end of the course [s], NaN if never
IMPACTS: Final = 5  # number of impacts
SUMMARY_SIZE: Final = 6


@inlined
def _bound(ground: Float, vertical: Float, i: int, time_step: float, share: float) -> float:
    """Return an upper bound of |a_h| + share |a_v| in an interval [g]."""
    largest = 0.0
    for j in range(ground.shape[1] - 1, -1, -1):
        largest = largest * time_step + abs(ground[i, j])
        if vertical.shape[0] > 0:
            largest += share * abs(vertical[i, j])
    return largest


@inlined
def _polynomial(rows: Float, i: int, scale: float) -> Polynomial:
    """Return the acceleration in an interval, times a factor."""
    count = rows.shape[1] if rows.shape[0] > 0 else 0
    return (
        scale * rows[i, 0] if count > 0 else 0.0,
        scale * rows[i, 1] if count > 1 else 0.0,
        scale * rows[i, 2] if count > 2 else 0.0,
        scale * rows[i, 3] if count > 3 else 0.0,
        scale * rows[i, 4] if count > 4 else 0.0,
        scale * rows[i, 5] if count > 5 else 0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )


@inlined
def _follow(  # noqa: C901  one loop, event by event
    a: Polynomial,
    v: Polynomial,
    time: float,
    span: tuple[float, float],
    table: Float,
    frequency: float,
    state: tuple[float, float, int],
    impacts: Float,
    summary: Float,
) -> tuple[float, float, int]:
    """Follow a bent through a part of an interval, or until its course ends.

    `a` and `v` are the ground accelerations [g] in powers of the time since `time`; the part begins
    and ends at the times `span` after it. The side is 0 right, 1 left, -1 at rest.
    """
    s, rate, side = state
    elapsed, end = span
    start = MOVING
    events = 0
    most = most_events(math.sqrt(table[BOUNCE] * table[SIDE_SIZE + BOUNCE]))
    while elapsed < end:
        events += 1
        if events > most:
            exceed_bound()
        now, lift = shift(a, elapsed), shift(v, elapsed)
        if side < 0:
            wait, start, side = lift_off(now, lift, table, 0, 1.0, end - elapsed)
            if wait == NEVER:
                side = -1
                break
            elapsed += wait
            now, lift = shift(a, elapsed), shift(v, elapsed)
            if math.isnan(summary[UPLIFT_TIME]):
                summary[UPLIFT_TIME] = time + elapsed
        c = series(table, side * SIDE_SIZE, 1.0 - 2.0 * side, s, rate, now, lift, start)
        ended, t, s, rate, high, high_time, _ = flight(
            c, 1.0, end - elapsed, start, summary[PEAK_RIGHT + side]
        )
        if high > summary[PEAK_RIGHT + side]:
            if high > max(summary[PEAK_RIGHT], summary[PEAK_LEFT]):
                summary[PEAK_TIME] = time + elapsed + high_time
            summary[PEAK_RIGHT + side] = high
        elapsed += t
        start = MOVING
        if ended == ALOFT:
            break
        if ended == FALLEN:
            summary[OVERTURNING_TIME] = time + elapsed
            break
        if touches(s, rate, frequency):
            if summary[IMPACTS] == 0.0:
                summary[PEAK_RIGHT] = summary[PEAK_LEFT] = 0.0
                summary[PEAK_TIME] = summary[UPLIFT_TIME] = math.nan
            s, rate, side = 0.0, 0.0, -1
            continue
        count = int(summary[IMPACTS])
        if count < impacts.shape[0]:
            impacts[count, 0] = time + elapsed
            impacts[count, 1] = rate
            impacts[count, 2] = side
        summary[IMPACTS] = count + 1
        s = 0.0
        rate *= -table[side * SIDE_SIZE + BOUNCE]
        side = 1 - side
        if rate < REST_VELOCITY_RATIO * frequency:
            across, up = derivatives(a, elapsed)[0], 1.0 + derivatives(v, elapsed)[0]
            still = -across <= table[LIMIT] * up and across <= table[SIDE_SIZE + LIMIT] * up
            if rate == 0.0 or still:
                s, rate, side = 0.0, 0.0, -1
    return s, rate, side


@compiled
def integrate(
    ground: Float,
    vertical: Float,
    time_step: float,
    start_time: float,
    table: Float,
    frequency: float,
    start: tuple[float, float, int],
    histories: Float,
    impacts: Float,
    summary: Float,
) -> int:
    """Integrate the motion of a bent over a ground motion, and return the verdict.

    Parameters
    ----------
    ground : array, shape (intervals, degree + 1)
        Horizontal ground acceleration [g] as a polynomial, of degree 5 at most, in the time since
        each interval's start [s].
    vertical : array, shape (intervals, degree + 1) or (0, degree + 1)
        Vertical ground acceleration [g] in the same form, above -1 g; no rows if there is none.
    time_step, start_time : float
        Length of an interval, time of the first node [s].
    table : array, shape (TABLE_SIZE,)
        The bent, see the named slots.
    frequency : float
        Rate at which the motion changes at most, p-hat of equal columns [s-1].
    start : tuple
        Course, its rate, and side (0 right, 1 left, -1 at rest) at the start.
    histories : array, shape (intervals + 1, 3)
        Filled with course, rate and side at the nodes; NaN after overturning.
    impacts : array, shape (kept, 3)
        Filled with times of the first impacts [s], rates just before them, and sides left.
    summary : array, shape (SUMMARY_SIZE,)
        Filled with the values of the named slots.

    Returns
    -------
    int
        NO_UPLIFT, STANDS or OVERTURNS.
    """
    intervals = ground.shape[0]
    strongest = 0.0
    for i in range(intervals):
        strongest = max(strongest, _bound(ground, vertical, i, time_step, 1.0))
    speed = frequency * math.sqrt(1.0 + strongest)
    stride = MAX_SMOOTH_STRIDE if ground.shape[1] > 2 else MAX_STRIDE
    pieces = max(1, math.ceil(speed * time_step / stride))
    h = time_step / pieces
    s, rate, side = start
    summary[:] = 0.0
    summary[PEAK_TIME] = summary[UPLIFT_TIME] = summary[OVERTURNING_TIME] = math.nan
    if side >= 0:
        summary[PEAK_RIGHT + side] = s
        summary[PEAK_TIME] = summary[UPLIFT_TIME] = start_time
    histories[0] = np.array([s, rate, float(side)])
    least = min(table[LIMIT], table[SIDE_SIZE + LIMIT])
    v = ZERO
    for i in range(intervals):
        if side >= 0 or _bound(ground, vertical, i, time_step, least) > least:
            a = _polynomial(ground, i, 1.0)
            if vertical.shape[0] > 0:
                v = _polynomial(vertical, i, 1.0)
            for k in range(pieces):
                s, rate, side = _follow(
                    a,
                    v,
                    start_time + i * time_step,
                    (k * h, k * h + h),
                    table,
                    frequency,
                    (s, rate, side),
                    impacts,
                    summary,
                )
                if not math.isnan(summary[OVERTURNING_TIME]):
                    histories[i + 1 :] = math.nan
                    return OVERTURNS
        histories[i + 1, 0] = s
        histories[i + 1, 1] = rate
        histories[i + 1, 2] = side
    return _finish(start_time + intervals * time_step, table, frequency, (s, rate, side), summary)


@inlined
def _finish(
    time: float, table: Float, frequency: float, state: tuple[float, float, int], summary: Float
) -> int:
    """Follow a bent over still ground after the motion; return the verdict."""
    s, rate, side = state
    if side >= 0 and not touches(s, rate, frequency):
        falls, after, right, left, landings = tail(table, 0, side, s, rate, frequency)
        if max(right, left) > max(summary[PEAK_RIGHT], summary[PEAK_LEFT]):
            summary[PEAK_TIME] = math.nan
        summary[PEAK_RIGHT] = max(summary[PEAK_RIGHT], right)
        summary[PEAK_LEFT] = max(summary[PEAK_LEFT], left)
        summary[IMPACTS] += landings
        if falls:
            summary[OVERTURNING_TIME] = summary[PEAK_TIME] = time + after
            return OVERTURNS
    elif side >= 0 and summary[IMPACTS] == 0.0:
        summary[PEAK_RIGHT] = summary[PEAK_LEFT] = 0.0
        summary[PEAK_TIME] = summary[UPLIFT_TIME] = math.nan
    return NO_UPLIFT if math.isnan(summary[UPLIFT_TIME]) else STANDS
