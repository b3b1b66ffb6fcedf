"""The kernel of oscillators with one hysteretic spring, integrated to round-off.

Per mass and relative to the ground, which has the acceleration a:

u'' + c u' + k u + z = -a,   |z| <= q,   z' = k_z u' while |z| < q or u' drives it back, else 0.

So an oscillator is on one of four branches: elastic (stiffness k + k_z), yielding in the direction
+1 or -1 (stiffness k, z = +-q), or, if k_z is infinite, stuck (u' = 0). On each the equation is
linear, and the ground a polynomial in each interval. `_run` goes over whole intervals with the
exact transition of a branch, as long as bounds show that the branch is kept and that no peak lies
between the nodes. `_cross` takes the others: it follows the Taylor series, and locates changes of
branch and peaks as its roots.

The file is long because numba's cache sees no change of a function in another file.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking.kernels.compiled import compiled

Float = NDArray[np.float64]
#: k [s-2], k_z [s-2], q [m s-2] and c [s-1] of an oscillator.
Constants: TypeAlias = tuple[float, float, float, float]
#: Branch, displacement, velocity and z.
State: TypeAlias = tuple[float, float, float, float]

# Branches; +1 and -1 are the directions of yielding.
ELASTIC: Final = 0.0
STUCK: Final = 2.0

# Slots of the summary array.
PEAK: Final = 0  # largest |u| [m]
PEAK_TIME: Final = 1  # when [s], NaN if it never moves
PEAK_FORCE: Final = 2  # largest |k u + z + c u'| [m s-2]
RESIDUAL: Final = 3  # u when it has come to rest [m]
FIRST_YIELD: Final = 4  # when [s], NaN if never
YIELDS: Final = 5  # number of excursions into yielding
DISSIPATED: Final = 6  # integral of |z u'| while yielding [m2 s-2]
SUMMARY_SIZE: Final = 7

#: Columns of the bounds of the ground in an interval: of |a|, |a'| and |a''|.
BOUNDS: Final = 3
#: Largest (rate x step) of one Taylor series, and the share of its last term.
_STRIDE: Final = 0.5
_LAST_TERM: Final = 1e-17
#: Room for the coefficients of a series, and for a polynomial and its derivatives.
_TERMS: Final = 48
_TOWER: Final = 9
#: A transition is used if this share of the bound on the rates remains.
_LEAST_SHARE: Final = 0.25
#: Relative size of the last Newton step; its error is the square of it, so round-off.
_ROOT_TOLERANCE: Final = 1e-13
#: What exceeds a limit by less has reached it to round-off: without damping it comes there again
#: in each cycle.
_BEYOND: Final = 1.0 + 1e-12
#: So many changes of branch may follow each other within round-off of one instant.
_MOST_IDLE: Final = 8
#: An oscillator that still moves after so many steps is taken as it is.
_MOST_TAIL: Final = 1_000_000


@compiled
def _order(rate_step: float, degree: int) -> int:
    """Degree at which the series of a step may end."""
    order = degree + 2
    term = 1.0
    while term > _LAST_TERM and order < _TERMS - 2:
        order += 1
        term *= rate_step / (order - degree - 2)
    return order


@compiled
def _series(
    u: Float,
    ground: Float,
    start: tuple[float, float],
    rest: tuple[float, float, float],
    order: int,
) -> None:
    """Fill in the Taylor coefficients of u'' = -(ground + push + c u' + k u)."""
    push, c, k = rest
    u[0], u[1] = start
    for n in range(order - 1):
        force = c * (n + 1) * u[n + 1] + k * u[n]
        if n < ground.size:
            force += ground[n]
        if n == 0:
            force += push
        u[n + 2] = -force / ((n + 1) * (n + 2))


@compiled
def _value(p: Float, order: int, t: float) -> float:
    total = 0.0
    for n in range(order, -1, -1):
        total = total * t + p[n]
    return total


@compiled
def _differentiate(tower: Float, order: int, top: int) -> None:
    """Fill in the derivatives of the polynomial in the first row, up to the one after `top`."""
    for d in range(1, top + 2):
        for n in range(order - d + 1):
            tower[d, n] = (n + 1) * tower[d - 1, n + 1]


@compiled
def _differentiate_force(
    forces: Float, tower: Float, rest: tuple[float, float, float], order: int, top: int
) -> None:
    """Fill in push + c u' + k u and its derivatives."""
    push, c, k = rest
    for n in range(order):
        forces[0, n] = c * tower[1, n] + k * tower[0, n]
    forces[0, 0] += push
    if c > 0.0:
        _differentiate(forces, order - 1, top)


@compiled
def _root(tower: Float, d: int, order: int, level: float, a: float, b: float) -> float:
    """Root in [a, b] of the d-th derivative minus level, which changes its sign there once.

    Newton's method in a bracket, which is halved where a step would leave it or is slow.
    """
    low = _value(tower[d], order - d, a) - level
    high = _value(tower[d], order - d, b) - level
    if low == 0.0:
        return a
    if high == 0.0:
        return b
    last = b - a
    enough = _ROOT_TOLERANCE * last
    t = a + last * (low / (low - high))
    for _ in range(200):
        value = _value(tower[d], order - d, t) - level
        if value == 0.0:
            return t
        if (value > 0.0) == (high > 0.0):
            b = t
        else:
            a = t
        slope = _value(tower[d + 1], order - d - 1, t)
        new = t - value / slope if slope != 0.0 else a
        if not (a < new < b) or abs(new - t) > 0.5 * last:
            new = 0.5 * (a + b)
        last = abs(new - t)
        t = new
        if last <= enough:
            return t
    return t


@compiled
def _turns(tower: Float, order: int, top: int, h: float, marks: Float) -> int:
    """Fill in where a polynomial turns in (0, h], in order, and then h; return how many they are.

    Each derivative is monotone between the roots of the next one. That of the order `top` obeys an
    equation without the ground, or is linear: it has one root at most.
    """
    count = 1
    marks[0] = h
    for d in range(top, 0, -1):
        found = 0
        left = 0.0
        at_left = tower[d, 0]
        for k in range(count):
            right = marks[k]
            at_right = _value(tower[d], order - d, right)
            if at_left != 0.0 and (at_right == 0.0 or (at_left > 0.0) != (at_right > 0.0)):
                marks[found] = _root(tower, d, order, 0.0, left, right)
                found += 1
            left = right
            at_left = at_right
        marks[found] = h
        count = found + 1
    return count


@compiled
def _shift(row: Float, scale: float, t: float, ground: Float) -> None:
    """Fill in the ground's polynomial about t, times the scale (repeated synthetic division)."""
    ground[:] = scale * row
    if t > 0.0:
        for j in range(row.size - 1):
            for n in range(row.size - 2, j - 1, -1):
                ground[n] += t * ground[n + 1]


@compiled
def _note(summary: Float, u: float, force: float, time: float) -> None:
    if abs(u) > summary[PEAK]:
        summary[PEAK] = abs(u)
        summary[PEAK_TIME] = time
    summary[PEAK_FORCE] = max(summary[PEAK_FORCE], abs(force))


@compiled
def _yields(summary: Float, time: float) -> None:
    if summary[YIELDS] == 0.0:
        summary[FIRST_YIELD] = time
    summary[YIELDS] += 1.0


@compiled
def _stick(
    ground: Float,
    oscillator: Constants,
    u: float,
    h: float,
    time: float,
    summary: Float,
    work: Float,
) -> tuple[float, float]:
    """Wait until the ground exceeds what friction holds; return the branch and the time until."""
    k, _, q, _ = oscillator
    tower, marks = work[:_TOWER], work[2 * _TOWER]
    degree = ground.size - 1
    tower[0, : ground.size] = ground
    _differentiate(tower, degree, max(degree, 1))
    count = _turns(tower, degree, degree, h, marks)
    push = ground[0] + k * u
    left = 0.0
    for n in range(-1, count):
        if n >= 0:
            push = _value(ground, degree, marks[n]) + k * u
        if abs(push) > q:
            end = 0.0
            if n >= 0:
                level = math.copysign(q, push) - k * u
                end = _root(tower, 0, degree, level, left, marks[n])
            _note(summary, u, _value(ground, degree, end), time)
            _yields(summary, time + end)
            return -math.copysign(1.0, push), end
        _note(summary, u, push - k * u, time)
        left = marks[n] if n >= 0 else 0.0
    return STUCK, h


@compiled
def _branch(oscillator: Constants, state: State) -> tuple[float, float, float]:
    """Push, damping and stiffness of a branch: u'' = -(a + push + c u' + stiffness u)."""
    k, k_z, _, c = oscillator
    mode, u, _, z = state
    return (z - k_z * u, c, k + k_z) if mode == ELASTIC else (z, c, k)


@compiled
def _end(
    tower: Float, order: int, marks: Float, count: int, oscillator: Constants, state: State
) -> tuple[float, float]:
    """When the branch ends within its series, and the direction of yielding; 0 if it does not.

    A yielding branch ends where the velocity vanishes, an elastic one where z reaches q.
    """
    _, k_z, q, _ = oscillator
    mode, u, _, z = state
    if mode != ELASTIC:
        return marks[0], (mode if count > 1 else 0.0)
    left = 0.0
    for n in range(count):
        moved = _value(tower[0], order, marks[n]) - u
        if abs(z + k_z * moved) > q * _BEYOND:
            side = math.copysign(1.0, moved)
            level = u + (side * q - z) / k_z
            return _root(tower, 0, order, level, left, marks[n]), side
        left = marks[n]
    return left, 0.0


@compiled
def _piece(
    ground: Float,
    oscillator: Constants,
    state: State,
    h: float,
    time: float,
    search: bool,
    summary: Float,
    work: Float,
) -> tuple[State, float]:
    """Follow one branch for a time h at most, or until it ends; return the state and the time."""
    _, k_z, q, c = oscillator
    mode, u, v, z = state
    tower, forces, marks = work[:_TOWER], work[_TOWER : 2 * _TOWER], work[2 * _TOWER]
    rest = _branch(oscillator, state)
    stiffness = rest[2]
    rate = math.sqrt(stiffness) + c
    h = min(h, _STRIDE / rate) if rate > 0.0 else h
    order = _order(rate * h, ground.size - 1)
    top = ground.size
    _series(tower[0], ground, (u, v), rest, order)
    if v == 0.0 and abs(z) == q:  # a branch begins: the signs of round-off are not to end it
        towards = mode if mode != ELASTIC else -z
        if towards * tower[0, 2] < 0.0:
            tower[0, 2] = 0.0
    _differentiate(tower, order, top)
    count = _turns(tower, order, top, h, marks)
    end, side = h, 0.0
    if search:
        end, side = _end(tower, order, marks, count, oscillator, state)
    _differentiate_force(forces, tower, rest, order, top)
    for n in range(count):
        at = min(marks[n], end)
        force = _value(forces[0], order - 1, at)
        _note(summary, _value(tower[0], order, at), force, time + at)
    if c > 0.0:
        for n in range(_turns(forces, order - 1, top, end, marks)):
            _note(summary, 0.0, _value(forces[0], order - 1, marks[n]), time)
    moved = _value(tower[0], order, end) - u
    v = _value(tower[1], order - 1, end)
    if mode == ELASTIC:
        z = min(max(z + k_z * moved, -q), q)
        if side != 0.0:
            mode, z = side, side * q
            _yields(summary, time + end)
    else:
        summary[DISSIPATED] += q * abs(moved)
        if side != 0.0:
            mode, v = STUCK if k_z == math.inf else ELASTIC, 0.0
    return (mode, u + moved, v, z), end


@compiled
def _cross(
    row: Float,
    scale: float,
    h: float,
    time: float,
    oscillator: Constants,
    state: State,
    summary: Float,
    work: Float,
) -> State:
    """Go through an interval in which the branch may change, or a peak may lie."""
    ground = work[2 * _TOWER + 1, : row.size]
    t = 0.0
    idle = 0
    while t < h:
        _shift(row, scale, t, ground)
        left = h - t
        if state[0] == STUCK:
            mode, taken = _stick(ground, oscillator, state[1], left, time + t, summary, work)
            z = mode * oscillator[2] if mode != STUCK else 0.0
            state = (mode, state[1], 0.0, z)
        else:
            search = idle < _MOST_IDLE
            state, taken = _piece(ground, oscillator, state, left, time + t, search, summary, work)
        idle = idle + 1 if taken <= _ROOT_TOLERANCE * h else 0
        t = t + taken if taken < left else h
    return state


@compiled
def _holds(row: Float, bound: Float, scale: float, h: float, room: float, summary: Float) -> bool:
    """Say if friction surely holds in an interval whose peak is known; note the peak."""
    strength = abs(scale) * bound[0]
    monotone = bound[1] <= 2.0 * abs(row[1])
    if strength > room or not (monotone or strength <= summary[PEAK_FORCE]):
        return False
    if strength > summary[PEAK_FORCE]:
        _note(summary, 0.0, scale * row[0], 0.0)
        _note(summary, 0.0, scale * _value(row, row.size - 1, h), 0.0)
    return True


@compiled
def _transition(
    h: float, degree: int, stiffness: float, c: float, work: Float, out: Float
) -> float:
    """Fill in what one interval does to u and v; return 1 over the share that bounds its rates.

    The coefficients are those of the state, then those of the powers of the ground's polynomial;
    what they add up to at the interval's end are u and v there. Zero if the interval is too long.
    """
    share = 1.0 - h * (c + 0.5 * h * stiffness)
    if share < _LEAST_SHARE:
        return 0.0
    order = _order(h * (math.sqrt(stiffness) + c), degree)
    ground = work[2 * _TOWER + 1, : degree + 1]
    for n in range(degree + 3):
        ground[:] = 0.0
        if n >= 2:
            ground[n - 2] = 1.0
        start = (1.0 if n == 0 else 0.0, 1.0 if n == 1 else 0.0)
        _series(work[0], ground, start, (0.0, c, stiffness), order)
        _differentiate(work, order, 0)
        out[0, n] = _value(work[0], order, h)
        out[1, n] = _value(work[1], order - 1, h)
    return 1.0 / share


@compiled
def _sure(
    row: Float,
    bound: Float,
    scale: float,
    h: float,
    linear: tuple[float, float, float, float, float],
    limits: tuple[float, float, float],
    old: tuple[float, float],
    new: tuple[float, float],
    share: float,
) -> bool:
    """Say if on a branch nothing can happen between two nodes: closer bounds, from both of them.

    `linear` has the branch's stiffness, damping and push, k_z, and its direction; `limits` q and
    the peaks. Either u and the force are monotone, or what they reach is within the limits.
    """
    k, c, push, k_z, mode = linear
    q, peak, peak_force = limits
    u, v = old
    bend = abs(scale * row[0] + push + c * v + k * u)
    size = abs(scale)
    jerk = share * (size * bound[1] + c * bend + k * (abs(v) + h * bend))
    bend += h * jerk
    h2 = 0.125 * h * h
    spring = max(abs(push + k_z * u), abs(push + k_z * new[0]))
    monotone = v * new[1] > 0.0 and min(abs(v), abs(new[1])) > h2 * jerk
    far = max(abs(u), abs(new[0]))
    if spring > q or not (
        monotone or (mode == ELASTIC and spring + k_z * h2 * bend <= q and far + h2 * bend <= peak)
    ):
        return False
    force = push + k * new[0] + c * new[1]
    strong = max(abs(push + k * u + c * v), abs(force))
    if strong + h2 * (c * jerk + k * bend) <= peak_force:
        return True
    if c == 0.0:
        return monotone
    before = k * v - c * (scale * row[0] + push + c * v + k * u)
    after = k * new[1] - c * (scale * _value(row, row.size - 1, h) + force)
    snap = size * bound[2] + c * jerk + k * bend
    near = min(abs(before), abs(after)) if before * after > 0.0 else 0.0
    return bool(near > h2 * (c * snap + k * jerk))


@compiled
def _run(
    i: int,
    rows: Float,
    bounds: Float,
    scale: float,
    h: float,
    time: float,
    oscillator: Constants,
    state: State,
    moves: Float,
    share: float,
    summary: Float,
    histories: Float,
) -> tuple[int, State]:
    """Go over whole intervals for as long as nothing but the motion on this branch can happen.

    First with bounds from the end of the interval alone; where these do not suffice, `_sure`.
    """
    k, k_z, q, c = oscillator
    mode, u, v, z = state
    elastic = mode == ELASTIC
    if not elastic:
        k_z = 0.0
    k += k_z
    push = z - k_z * u
    peak, peak_time, peak_force = summary[PEAK], summary[PEAK_TIME], summary[PEAK_FORCE]
    u_u, u_v, u_0, u_1 = moves[0, 0], moves[0, 1], moves[0, 2], moves[0, 3]
    v_u, v_v, v_0, v_1 = moves[1, 0], moves[1, 1], moves[1, 2], moves[1, 3]
    began = u
    while i < rows.shape[0]:
        a_0, a_1 = scale * rows[i, 0] + push, scale * rows[i, 1]
        by_u, by_v = u_0 * a_0 + u_1 * a_1, v_0 * a_0 + v_1 * a_1
        for n in range(2, rows.shape[1]):
            by_u += moves[0, n + 2] * (scale * rows[i, n])
            by_v += moves[1, n + 2] * (scale * rows[i, n])
        new_u = (u_u * u + u_v * v) + by_u
        new_v = (v_u * u + v_v * v) + by_v
        force = (k * new_u + push) + c * new_v
        speed, far = abs(new_v), abs(new_u)
        bend = share * (abs(scale) * bounds[i, 0] + abs(push) + (c + k * h) * speed + k * far)
        reach = h * (speed + h * bend)
        inside = abs(push + k_z * new_u) + k_z * reach if elastic else q
        if (
            inside > q
            or (not elastic and mode * new_v <= h * bend)
            or far + reach > peak
            or abs(force) + (h * c * bend + k * reach) > peak_force
        ):
            linear, limits = (k, c, push, k_z, mode), (q, peak, peak_force)
            if not _sure(
                rows[i], bounds[i], scale, h, linear, limits, (u, v), (new_u, new_v), share
            ):
                break
            peak_force = max(peak_force, abs(force))
            if far > peak:
                peak, peak_time = far, time + (i + 1) * h
        u, v = new_u, new_v
        i += 1
        if histories.shape[1] > 0:
            histories[0, i], histories[1, i], histories[2, i] = u, v, force
    if elastic:
        z = min(max(push + k_z * u, -q), q)
    else:
        summary[DISSIPATED] += q * abs(u - began)
    summary[PEAK], summary[PEAK_TIME], summary[PEAK_FORCE] = peak, peak_time, peak_force
    return i, (mode, u, v, z)


@compiled
def _settle(time: float, oscillator: Constants, state: State, summary: Float, work: Float) -> None:
    """Let the oscillator move on over still ground until no new peak and no yielding can come."""
    k, k_z, q, c = oscillator
    still = np.zeros(1)
    until = math.inf
    for _ in range(_MOST_TAIL):
        mode, u, v, z = state
        if mode == STUCK and abs(k * u) <= q:
            summary[RESIDUAL] = u
            return
        stiffness = k + k_z if mode == ELASTIC else k
        if mode == ELASTIC:
            centre = (k_z * u - z) / stiffness + 0.0
            summary[RESIDUAL] = centre
            reach = math.hypot(u - centre, v / math.sqrt(stiffness))
            room = q - abs(z + k_z * (centre - u))
            if k_z * reach <= room * _BEYOND:
                if until == math.inf:
                    until = time + math.tau / math.sqrt(stiffness - 0.25 * c * c)
                force = stiffness * reach * (1.0 + c / math.sqrt(stiffness))
                quiet = abs(centre) + reach <= summary[PEAK] and force <= summary[PEAK_FORCE]
                if quiet or time >= until:
                    return
        rate = math.sqrt(stiffness) + c
        if rate == 0.0:
            rate = math.sqrt(k + k_z)
        step = _STRIDE / rate
        state = _cross(still, 0.0, step, time, oscillator, state, summary, work)
        time += step


@compiled
def integrate(
    rows: Float,
    bounds: Float,
    h: float,
    time: float,
    scale: float,
    oscillator: Constants,
    histories: Float,
    summary: Float,
) -> None:
    """Respond to a ground motion, from rest; fill in the histories (if any) and the summary.

    Parameters
    ----------
    rows, bounds : array, shapes (intervals, degree + 1) and (intervals, BOUNDS)
        Ground acceleration [m s-2] in powers of the time since the start of each interval, of
        degree 1 or more, and bounds of it and its first two derivatives.
    h, time, scale : float
        Length of an interval and time of the first node [s]; factor on the ground.
    oscillator : tuple
        Its constants.
    histories : array, shape (3, intervals + 1) or (3, 0)
        Displacement, velocity and k u + z + c u' at the nodes.
    summary : array, shape (SUMMARY_SIZE,)
        Its slots.
    """
    k, k_z, q, c = oscillator
    rigid = k_z == math.inf
    degree = rows.shape[1] - 1
    work = np.empty((2 * _TOWER + 2, _TERMS))
    moves = np.empty((2, 2, degree + 3))
    shares = (
        0.0 if rigid else _transition(h, degree, k + k_z, c, work, moves[0]),
        _transition(h, degree, k, c, work, moves[1]),
    )
    summary[:] = 0.0
    summary[PEAK_TIME] = summary[FIRST_YIELD] = math.nan
    state = (STUCK if rigid else ELASTIC, 0.0, 0.0, 0.0)
    if histories.shape[1] > 0:
        histories[:, 0] = 0.0
        if rigid:
            histories[2, 0] = -scale * rows[0, 0]
    i = 0
    while i < rows.shape[0]:
        mode, u, v, z = state
        branch = 0 if mode == ELASTIC else 1
        if mode == STUCK:
            done = _holds(rows[i], bounds[i], scale, h, q - abs(k * u), summary)
        else:
            done = False
            if shares[branch] > 0.0:
                i, state = _run(
                    i,
                    rows,
                    bounds,
                    scale,
                    h,
                    time,
                    oscillator,
                    state,
                    moves[branch],
                    shares[branch],
                    summary,
                    histories,
                )
                if i == rows.shape[0]:
                    break
        if not done:
            state = _cross(rows[i], scale, h, time + i * h, oscillator, state, summary, work)
        i += 1
        if histories.shape[1] > 0:
            mode, u, v, z = state
            force = k * u + z + c * v
            if mode == STUCK:
                force = -scale * _value(rows[i - 1], degree, h)
            histories[0, i], histories[1, i], histories[2, i] = u, v, force
    _settle(time + rows.shape[0] * h, oscillator, state, summary, work)


@compiled
def integrate_many(
    rows: Float, bounds: Float, h: float, time: float, scales: Float, oscillators: Float, out: Float
) -> None:
    """Respond to one ground motion at scales, shape (n,), with oscillators, shape (n, 4)."""
    histories = np.empty((3, 0))
    for n in range(scales.size):
        own = oscillators[n]
        constants = (own[0], own[1], own[2], own[3])
        integrate(rows, bounds, h, time, scales[n], constants, histories, out[n])
