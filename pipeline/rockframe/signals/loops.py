"""Compiled loops over the samples of a record."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined

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
            given, section = value, sections[i]
            value = section[0] * given + state[i, 0]
            state[i, 0] = section[1] * given - section[4] * value + state[i, 1]
            state[i, 1] = section[2] * given - section[5] * value
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
    motion = np.empty((2, ground.size + steps))
    x = v = motion[0, 0] = motion[1, 0] = 0.0
    earlier = ground[0]
    for k in range(1, ground.size):
        now = ground[k]
        x, v = (
            free[0, 0] * x + free[0, 1] * v + before[0] * earlier + after[0] * now,
            free[1, 0] * x + free[1, 1] * v + before[1] * earlier + after[1] * now,
        )
        motion[0, k], motion[1, k] = x, v
        earlier = now
    for k in range(ground.size, ground.size + steps):
        x, v = free[0, 0] * x + free[0, 1] * v, free[1, 0] * x + free[1, 1] * v
        motion[0, k], motion[1, k] = x, v
    return motion


#: Number of oscillators that are computed together: two of the widest vectors of processors.
LANES: Final = 16
#: Rows of a block of oscillators, a column for each: displacement, velocity, change of displacement
#: in a step, and largest displacement until now; factors of a step in 8 rows, those
#: of `through_oscillator`; and the phase of a step.
DISPLACEMENT: Final = 0
VELOCITY: Final = 1
CHANGE: Final = 2
LARGEST: Final = 3
FREE: Final = 4
BEFORE: Final = 8
AFTER: Final = 10
PHASE: Final = 12
ROWS: Final = 13
#: Directions, over half a turn, whose extremes bound an orbit from inside.
_DIRECTIONS: Final = 12
#: Distance from that bound, as a share of the size of the orbit, that counts as rounding.
_ROUNDING: Final = 1e-12


@compiled
def largest_displacements(block: Float, ground: Float, parts: int, rest: int) -> None:
    """Fill in the row `LARGEST` of a block of oscillators that are at rest at the first sample.

    The ground acceleration is linear between samples, in `parts` steps each, and `rest` steps of
    free vibration follow. The peak between two steps is that of the Hermite cubic.

    Parameters
    ----------
    block : array, shape (ROWS, LANES)
        Oscillators; columns that are zero stand for none.
    ground : array, shape (samples,)
        Ground acceleration at the samples.
    parts, rest : int
        Numbers of steps between two samples, and after the last one.
    """
    for n in range(ground.size - 1):
        here, slope = ground[n], (ground[n + 1] - ground[n]) / parts
        for part in range(1, parts + 1):
            after = ground[n] + part * slope
            _advance(block, here, after)
            here = after
    for _ in range(rest):
        _advance(block, 0.0, 0.0)


@inlined
def _advance(block: Float, here: float, after: float) -> None:
    """Advance oscillators by a step, during which the ground acceleration changes linearly."""
    for j in range(LANES):  # written out here, or the compiler does not vectorise it
        x, v, change = block[DISPLACEMENT, j], block[VELOCITY, j], block[CHANGE, j]
        ground = block[BEFORE, j] * here + block[AFTER, j] * after
        x_after = block[FREE, j] * x + block[FREE + 1, j] * v + ground
        ground = block[BEFORE + 1, j] * here + block[AFTER + 1, j] * after
        v_after = block[FREE + 2, j] * x + block[FREE + 3, j] * v + ground
        change_after = block[PHASE, j] * v_after
        between = _peak_between(x, x_after, change, change_after)
        top = between if between > abs(x_after) else abs(x_after)
        block[LARGEST, j] = top if top > block[LARGEST, j] else block[LARGEST, j]
        block[DISPLACEMENT, j], block[VELOCITY, j] = x_after, v_after
        block[CHANGE, j] = change_after


@inlined
def _peak_between(x: float, x_after: float, change: float, change_after: float) -> float:
    """Return the absolute extreme of the Hermite cubic where the rate changes its sign, or |x|."""
    at = change / (change - change_after) if change * change_after < 0.0 else 0.0
    rise = x_after - x
    cubic = at * (at - 1.0) * ((at - 1.0) * (change - rise) + at * (change_after - rise))
    return abs(x + rise * at + cubic)


@compiled
def orbit_of_oscillator(
    free: Float, before: Float, after: Float, ground: Float, parts: int, rest: int
) -> Float:
    """Return displacements and velocities of an oscillator under two components, shape (4, steps).

    The steps are those of `through_oscillator`, `parts` between two samples; `ground` has shape
    (2, samples), and `rest` steps of free vibration follow the last sample.
    """
    samples = ground.shape[1]
    path = np.zeros((4, (samples - 1) * parts + 1 + rest))
    x = y = u = v = 0.0
    step = 0
    for n in range(samples - 1):
        a, b = ground[0, n], ground[1, n]
        slope, other = (ground[0, n + 1] - a) / parts, (ground[1, n + 1] - b) / parts
        for part in range(1, parts + 1):
            a_after, b_after = ground[0, n] + part * slope, ground[1, n] + part * other
            x, u = (
                free[0, 0] * x + free[0, 1] * u + (before[0] * a + after[0] * a_after),
                free[1, 0] * x + free[1, 1] * u + (before[1] * a + after[1] * a_after),
            )
            y, v = (
                free[0, 0] * y + free[0, 1] * v + (before[0] * b + after[0] * b_after),
                free[1, 0] * y + free[1, 1] * v + (before[1] * b + after[1] * b_after),
            )
            a, b = a_after, b_after
            step += 1
            path[0, step], path[1, step], path[2, step], path[3, step] = x, y, u, v
    for k in range(step + 1, path.shape[1]):
        x, u = free[0, 0] * x + free[0, 1] * u, free[1, 0] * x + free[1, 1] * u
        y, v = free[0, 0] * y + free[0, 1] * v, free[1, 0] * y + free[1, 1] * v
        path[0, k], path[1, k], path[2, k], path[3, k] = x, y, u, v
    return path


@compiled
def largest_toward(path: Float, phase: float, directions: Float) -> Float:
    """Return the largest absolute displacement of an orbit toward each direction.

    The peak between two steps is that of the Hermite cubic. A cubic stays within the hull of its
    four Bezier points, which are the two displacements, and these moved by a third of their changes
    in the step. So no direction has its peak between two steps whose points all lie in a polygon
    of displacements, and few steps are left.

    Parameters
    ----------
    path : array, shape (4, steps)
        Result of `orbit_of_oscillator`.
    phase : float
        Phase of the free vibration per step [rad]: change in a step over velocity.
    directions : array, shape (directions, 2)
        Factors of the two components.
    """
    x, y, u, v = path[0], path[1], path[2], path[3]
    largest = np.zeros(directions.shape[0])
    corners = _corners(x, y)
    for j in range(_DIRECTIONS):
        for k in range(largest.size):
            here = directions[k, 0] * corners[j, 0] + directions[k, 1] * corners[j, 1]
            largest[k] = max(largest[k], abs(here))
    beyond = _beyond(path, phase, corners)
    for i in range(x.size - 1):
        if beyond[i] or beyond[i + 1]:
            for k in range(largest.size):
                a, b = directions[k, 0], directions[k, 1]
                here, after = a * x[i] + b * y[i], a * x[i + 1] + b * y[i + 1]
                change, change_after = a * u[i] + b * v[i], a * u[i + 1] + b * v[i + 1]
                between = _peak_between(here, after, phase * change, phase * change_after)
                largest[k] = max(largest[k], max(between, max(abs(here), abs(after))))
    return largest


@compiled
def _corners(x: Float, y: Float) -> Float:
    """Return the points of an orbit that reach furthest toward directions over half a turn; the
    last one is the first one turned by half a turn, shape (directions + 1, 2).
    """
    corners = np.empty((_DIRECTIONS + 1, 2))
    for j in range(_DIRECTIONS):
        a, b = math.cos(math.pi * j / _DIRECTIONS), math.sin(math.pi * j / _DIRECTIONS)
        top, at = -1.0, 0
        for i in range(x.size):
            here = abs(a * x[i] + b * y[i])
            if here > top:
                top, at = here, i
        sign = 1.0 if a * x[at] + b * y[at] >= 0.0 else -1.0
        corners[j, 0], corners[j, 1] = sign * x[at], sign * y[at]
    corners[_DIRECTIONS, 0], corners[_DIRECTIONS, 1] = -corners[0, 0], -corners[0, 1]
    return corners


@compiled
def _beyond(path: Float, phase: float, corners: Float) -> NDArray[np.bool_]:
    """Return True for each step with a Bezier point outside the polygon of corners and of the
    same corners turned by half a turn.
    """
    x, y, u, v = path[0], path[1], path[2], path[3]
    beyond = np.zeros(x.size, dtype=np.bool_)
    size = np.abs(corners).max()
    furthest = np.argmax(corners[:, 0] ** 2 + corners[:, 1] ** 2)
    for j in range(_DIRECTIONS + 1):
        if j < _DIRECTIONS:  # the normal of a side
            a, b = corners[j + 1, 1] - corners[j, 1], corners[j, 0] - corners[j + 1, 0]
            limit = a * corners[j, 0] + b * corners[j, 1]
        else:  # the sides of an orbit along a line do not limit its length
            a, b = corners[furthest, 0], corners[furthest, 1]
            limit = np.abs(a * corners[:, 0] + b * corners[:, 1]).max()
        limit += _ROUNDING * size * (abs(a) + abs(b))
        for i in range(x.size):
            reach = abs(a * x[i] + b * y[i]) + phase / 3.0 * abs(a * u[i] + b * v[i])
            beyond[i] |= reach > limit
    return beyond
