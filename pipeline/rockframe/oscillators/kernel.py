"""The kernel of oscillators with one hysteretic spring, integrated to round-off.

Per unit mass, with u relative to the ground, which has the acceleration a:

u'' + c u' + k u + z = -a,   |z| <= q,   z' = k_z u' while |z| < q or u' reduces |z|, else 0.

So an oscillator is on one of four branches: elastic (stiffness k + k_z), yielding in the direction
+1 or -1 (stiffness k, z = +-q), or, if k_z is infinite, stuck (u' = 0). k is negative if P-delta
exceeds hardening; k + k_z is positive. On each branch the equation is linear, and in each interval
the ground is a polynomial in time. `_run` advances by whole intervals with the exact transition of
a branch, as long as bounds show that the branch does not change and that there is no new peak
between the nodes. `_cross` advances through all other intervals: it locates changes of branch and
peaks as roots of the Taylor series.

The file is long because numba's cache does not detect changes of functions in other files.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled
from rockframe.errors import InternalError
from rockframe.rivals import Constants

Float = NDArray[np.float64]
#: Branch, displacement, velocity and z.
State: TypeAlias = tuple[float, float, float, float]

# Branches; +1 and -1 are the directions of yielding.
ELASTIC: Final = 0.0
STUCK: Final = 2.0

# Slots of the summary array.
PEAK: Final = 0  # largest |u| [m], infinite after a collapse, as is the residual
PEAK_TIME: Final = 1  # time of the largest |u| [s], NaN if the oscillator never moves
PEAK_FORCE: Final = 2  # largest |k u + z + c u'| [m s-2], NaN after a collapse
RESIDUAL: Final = 3  # u at rest after the motion [m]
FIRST_YIELD: Final = 4  # time of the first yielding [s], NaN if never
YIELDS: Final = 5  # number of excursions into yielding
DISSIPATED: Final = 6  # integral of |z u'| while yielding [m2 s-2]
SUMMARY_SIZE: Final = 7

#: Columns of the bounds of the ground in an interval: of |a|, |a'| and |a''|.
BOUNDS: Final = 3
#: Largest (rate x step) of one Taylor series, and the relative size of its last term.
_STRIDE: Final = 0.5
_LAST_TERM: Final = 1e-17
# Rows of the working memory: the series of u and its derivatives; that of the force and its
# derivatives; the ground about the present time; the ends of monotone parts; 1 / ((n + 1) (n + 2)).
# A zero follows the coefficients in each row.
_U: Final = 0
_FORCE: Final = 9
_GROUND: Final = 18
_MARKS: Final = 19
_SHARES: Final = 20
_ROWS: Final = 21
_TERMS: Final = 48
#: `_transition` is used if its share is at least this large, otherwise the interval is too long.
_LEAST_SHARE: Final = 0.25
#: Newton's method stops at this relative step; the error is about its square, which is round-off.
_ROOT_TOLERANCE: Final = 1e-13
#: A limit counts as exceeded only above this factor. Without damping it is just reached, to
#: round-off, in each cycle.
_BEYOND: Final = 1.0 + 1e-12
#: Largest number of consecutive changes of branch within round-off of one instant.
_MOST_IDLE: Final = 8
#: Largest number of changes of branch and Taylor steps in an interval, beside the steps that its
#: length needs.
_MOST_EVENTS: Final = 10_000
#: Largest number of steps to a root.
_ROOT_STEPS: Final = 200
#: Largest number of steps after the motion. An oscillator with a strength of a millionth of its
#: restoring force, and no damping, needs more to come to rest: see `_come_to_rest`.
_MOST_TAIL: Final = 1_000_000


@compiled
def _exceed_bound() -> None:
    """Report that a loop exceeds its bound."""
    raise InternalError(
        "internal error: a loop of the oscillator kernel exceeds its bound. Please report it, with "
        "the motion and the structure."
    )


@compiled
def _order(rate_step: float, degree: int) -> int:
    """Return the degree at which the series of a step can end."""
    order = degree + 2
    term = rate_step
    while term > _LAST_TERM and order < _TERMS - 3:
        order += 1
        term *= rate_step / (order - degree - 1)
    return order


@compiled
def _series(
    work: Float, degree: int, u: float, v: float, rest: tuple[float, float, float], order: int
) -> None:
    """Fill in the Taylor coefficients of u from u'' = -(ground + push + c u' + k u)."""
    push, c, k = rest
    work[_U, 0], work[_U, 1] = u, v
    for n in range(order - 1):
        push += c * (n + 1) * v + k * u
        if n <= degree:
            push += work[_GROUND, n]
        u, v = v, -push * work[_SHARES, n]
        work[_U, n + 2] = v
        push = 0.0
    work[_U, order + 1] = 0.0


@compiled
def _value(rows: Float, row: int, order: int, t: float) -> float:
    """Return the value at `t` of the polynomial whose coefficients are in this row."""
    # two sums that do not wait for each other: the even powers and the odd ones
    t2 = t * t
    even = odd = 0.0
    for n in range(order // 2, -1, -1):
        even = even * t2 + rows[row, 2 * n]
        odd = odd * t2 + rows[row, 2 * n + 1]
    return even + t * odd


@compiled
def _differentiate(work: Float, row: int, order: int, top: int) -> None:
    """Write the derivatives of a polynomial to the rows that follow it."""
    for d in range(1, top + 1):
        for n in range(order - d + 1):
            work[row + d, n] = (n + 1) * work[row + d - 1, n + 1]
        work[row + d, max(order - d + 1, 0)] = 0.0
        work[row + d, max(order - d + 2, 1)] = 0.0


@compiled
def _root(
    work: Float, row: int, order: int, level: float, a: float, b: float, low: float, high: float
) -> float:
    """Return the root in [a, b] of the polynomial in a row minus level.

    `low` and `high` are its values at a and b, of opposite signs; if their signs are equal, the
    level was reached at a, to round-off. Newton's method in a bracket, which is halved if a step
    would leave it or is slow. The next row contains the derivative.
    """
    if low == 0.0:
        return a
    if high == 0.0:
        return b
    if (low > 0.0) == (high > 0.0):
        return a
    last = b - a
    enough = _ROOT_TOLERANCE * last
    t = a + last * (low / (low - high))
    for _ in range(_ROOT_STEPS):
        value = _value(work, row, order, t) - level
        if value == 0.0:
            return t
        if (value > 0.0) == (high > 0.0):
            b = t
        else:
            a = t
        slope = _value(work, row + 1, order - 1, t)
        new = t - value / slope if slope != 0.0 else a
        if not (a < new < b) or abs(new - t) > 0.5 * last:
            new = 0.5 * (a + b)
        last = abs(new - t)
        t = new
        if last <= enough:
            return t
    if not b - a <= enough:
        _exceed_bound()
    return t


@compiled
def _turns(work: Float, row: int, order: int, top: int, h: float) -> int:
    """Fill in the times in (0, h] at which a polynomial turns, then h; return their number.

    Each derivative is monotone between the roots of the next higher one. The derivative of order
    `top` has at most one root: it is linear, or its equation does not contain the ground.
    """
    count = 1
    work[_MARKS, 0] = h
    for d in range(top, 0, -1):
        turns = 0
        left = 0.0
        at_left = work[row + d, 0]
        for k in range(count):
            right = work[_MARKS, k]
            at_right = _value(work, row + d, order - d, right)
            if at_left != 0.0 and (at_right == 0.0 or (at_left > 0.0) != (at_right > 0.0)):
                work[_MARKS, turns] = _root(
                    work, row + d, order - d, 0.0, left, right, at_left, at_right
                )
                turns += 1
            left = right
            at_left = at_right
        work[_MARKS, turns] = h
        count = turns + 1
    return count


@compiled
def _shift(work: Float, rows: Float, i: int, scale: float, t: float) -> None:
    """Fill in the ground's polynomial about t, scaled (repeated synthetic division)."""
    degree = rows.shape[1] - 1
    for n in range(degree + 1):
        work[_GROUND, n] = scale * rows[i, n]
    if t > 0.0:
        for j in range(degree):
            for n in range(degree - 1, j - 1, -1):
                work[_GROUND, n] += t * work[_GROUND, n + 1]


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
def _held_force(ground: float, spring: float, q: float) -> float:
    """Return the force on a stuck oscillator, which friction limits to q about that of its spring.

    Where it starts to slide at once, as after a reversal, the ground alone exceeds that limit.
    """
    return min(max(-ground, spring - q), spring + q)


@compiled
def _stick(
    degree: int,
    oscillator: Constants,
    u: float,
    h: float,
    time: float,
    summary: Float,
    work: Float,
) -> tuple[float, float]:
    """Return the branch after sticking and the time of the change; STUCK and h if none within h.

    A stuck oscillator starts to slide when ground and spring together exceed the friction.
    """
    k, _, q, _ = oscillator
    for n in range(degree + 1):
        work[_U, n] = work[_GROUND, n]
    work[_U, degree + 1] = 0.0
    _differentiate(work, _U, degree, degree)
    count = _turns(work, _U, degree, degree, h)
    left = before = 0.0
    for n in range(-1, count):
        right = work[_MARKS, n] if n >= 0 else 0.0
        ground = _value(work, _U, degree, right)
        push = ground + k * u
        if abs(push) > q:
            level = math.copysign(q, push) - k * u
            end = 0.0
            if n >= 0:
                low, high = before - level, ground - level
                end = _root(work, _U, degree, level, left, right, low, high)
            _note(summary, u, _held_force(_value(work, _U, degree, end), k * u, q), time)
            _yields(summary, time + end)
            return -math.copysign(1.0, push), end
        _note(summary, u, _held_force(ground, k * u, q), time)
        left, before = right, ground
    return STUCK, h


@compiled
def _branch(oscillator: Constants, state: State) -> tuple[float, float, float]:
    """Return push, damping and stiffness of a branch: u'' = -(a + push + c u' + stiffness u)."""
    k, k_z, _, c = oscillator
    mode, u, _, z = state
    return (z - k_z * u, c, k + k_z) if mode == ELASTIC else (z, c, k)


@compiled
def _end(
    work: Float, order: int, count: int, oscillator: Constants, state: State
) -> tuple[float, float]:
    """Return when the branch ends in its series, and the direction of yielding.

    The direction is 0 if the branch does not end. A yielding branch ends where the velocity is
    zero, an elastic one where |z| reaches q.
    """
    _, k_z, q, _ = oscillator
    mode, u, _, z = state
    if mode != ELASTIC:
        return work[_MARKS, 0], (mode if count > 1 else 0.0)
    left, before = 0.0, u
    for n in range(count):
        right = work[_MARKS, n]
        reached = _value(work, _U, order, right)
        if abs(z + k_z * (reached - u)) > q * _BEYOND:
            side = math.copysign(1.0, reached - u)
            level = u + (side * q - z) / k_z
            low, high = before - level, reached - level
            return _root(work, _U, order, level, left, right, low, high), side
        left, before = right, reached
    return left, 0.0


@compiled
def _note_force(
    order: int,
    degree: int,
    end: float,
    rest: tuple[float, float, float],
    summary: Float,
    work: Float,
) -> None:
    """Update the peak force with the extremes of push + c u' + k u (not those of u)."""
    push, c, k = rest
    for n in range(order + 2):
        work[_FORCE, n] = c * work[_U + 1, n] + k * work[_U, n]
    _differentiate(work, _FORCE, order, degree + 2)
    for n in range(_turns(work, _FORCE, order, degree + 1, end)):
        _note(summary, 0.0, push + _value(work, _FORCE, order, work[_MARKS, n]), 0.0)


@compiled
def _piece(  # noqa: C901  one branch, step by step
    degree: int,
    oscillator: Constants,
    state: State,
    h: float,
    time: float,
    search: bool,
    summary: Float,
    work: Float,
) -> tuple[State, float]:
    """Follow one branch for at most a time h, or until it ends; return the state and the time."""
    _, k_z, q, c = oscillator
    mode, u, v, z = state
    rest = push, _, stiffness = _branch(oscillator, state)
    rate = math.sqrt(abs(stiffness)) + c
    h = min(h, _STRIDE / rate) if rate > 0.0 else h
    order = _order(rate * h, degree)
    _series(work, degree, u, v, rest, order)
    if v == 0.0 and abs(z) == q:  # a branch begins; the sign of round-off must not end it
        towards = mode if mode != ELASTIC else -z
        if towards * work[_U, 2] < 0.0:
            work[_U, 2] = 0.0
    _differentiate(work, _U, order, degree + 2)
    count = _turns(work, _U, order, degree + 1, h)
    end, side = h, 0.0
    if search or mode != ELASTIC:
        end, side = _end(work, order, count, oscillator, state)
    there = u
    for n in range(count):
        at = min(work[_MARKS, n], end)
        there = _value(work, _U, order, at)
        v = _value(work, _U + 1, order - 1, at)
        _note(summary, there, push + stiffness * there + c * v, time + at)
        if at == end:
            break
    if c > 0.0:
        _note_force(order, degree, end, rest, summary, work)
    moved = there - u
    if mode == ELASTIC:
        z = min(max(z + k_z * moved, -q), q)
        if side != 0.0:
            z = side * q
            if side * v > 0.0 or end == v == 0.0:  # or it has stopped there, and moves on
                mode = side
                _yields(summary, time + end)
            else:  # the motion reverses just as it reaches the strength
                v = 0.0
    else:
        summary[DISSIPATED] += q * abs(moved)
        if side != 0.0:
            mode, v = STUCK if k_z == math.inf else ELASTIC, 0.0
    return (mode, there, v, z), end


@compiled
def _cross(
    rows: Float,
    i: int,
    scale: float,
    h: float,
    time: float,
    oscillator: Constants,
    state: State,
    summary: Float,
    work: Float,
) -> State:
    """Advance through an interval in which the branch may change or a peak may occur."""
    degree = rows.shape[1] - 1
    t = 0.0
    idle = 0
    k, k_z, _, c = oscillator
    rate = math.sqrt(abs(k) + (k_z if k_z < math.inf else 0.0)) + c
    most = _MOST_EVENTS + 2.0 * rate * h / _STRIDE
    events = 0
    while t < h:
        events += 1
        if events > most:
            _exceed_bound()
        _shift(work, rows, i, scale, t)
        left = h - t
        if state[0] == STUCK:
            mode, taken = _stick(degree, oscillator, state[1], left, time + t, summary, work)
            z = mode * oscillator[2] if mode != STUCK else 0.0
            state = (mode, state[1], 0.0, z)
        else:
            search = idle < _MOST_IDLE
            state, taken = _piece(degree, oscillator, state, left, time + t, search, summary, work)
        idle = idle + 1 if taken <= _ROOT_TOLERANCE * h else 0
        t = t + taken if taken < left else h
    return state


@compiled
def _holds(
    rows: Float,
    i: int,
    bounds: Float,
    scale: float,
    h: float,
    held: float,
    q: float,
    summary: Float,
) -> bool:
    """Return True if friction surely resists ground and k u in an interval; update the peak."""
    straight = rows.shape[1] == 2
    first = scale * rows[i, 0]
    last = first + h * scale * rows[i, 1]
    if straight:
        room = q - max(abs(first + held), abs(last + held))
    else:
        strength = abs(scale) * bounds[i, 0]
        room = min(q - strength - abs(held), summary[PEAK_FORCE] - strength)
    if room < 0.0:
        return False
    if straight:
        summary[PEAK_FORCE] = max(summary[PEAK_FORCE], abs(first), abs(last))
    return True


@compiled
def _transition(
    h: float, degree: int, stiffness: float, c: float, work: Float, out: Float
) -> float:
    """Fill in the linear map from one node to the next; return 1 / share, or 0 if h is too long.

    The columns of `out` are the coefficients of u, of v, and of the powers of the ground's
    polynomial; the rows give u and v at the end of the interval. The share is a lower bound used
    for the bounds of rates in `_run` and `_sure`.
    """
    share = 1.0 - h * (c + 0.5 * h * abs(stiffness))
    if share < _LEAST_SHARE:
        return 0.0
    order = _order(h * (math.sqrt(abs(stiffness)) + c), degree)
    for n in range(degree + 3):
        work[_GROUND, : degree + 1] = 0.0
        if n >= 2:
            work[_GROUND, n - 2] = 1.0
        u, v = (1.0 if n == 0 else 0.0), (1.0 if n == 1 else 0.0)
        _series(work, degree, u, v, (0.0, c, stiffness), order)
        _differentiate(work, _U, order, 1)
        out[0, n] = _value(work, _U, order, h)
        out[1, n] = _value(work, _U + 1, order - 1, h)
    return 1.0 / share


@compiled
def _sure(
    rows: Float,
    i: int,
    bounds: Float,
    scale: float,
    h: float,
    linear: tuple[float, float, float, float, bool],
    limits: tuple[float, float, float],
    old: tuple[float, float],
    new: tuple[float, float],
    share: float,
) -> bool:
    """Return True if bounds from both nodes exclude an event between them.

    `linear` contains the push, damping and stiffness of the branch, k_z, and True if it is
    elastic; `limits` contains q and the peaks. There is no event if u and the force are monotone,
    or if their bounds are within the limits.
    """
    push, c, k, k_z, elastic = linear
    q, peak, peak_force = limits
    u, v = old
    size, h2, most = abs(scale), 0.125 * h * h, abs(k)
    bend = abs(scale * rows[i, 0] + push + c * v + k * u)
    jerk = share * (size * bounds[i, 1] + c * bend + most * (abs(v) + h * bend))
    bend += h * jerk
    spring = max(abs(push + k_z * u), abs(push + k_z * new[0]))
    monotone = v * new[1] > 0.0 and min(abs(v), abs(new[1])) > h2 * jerk
    far = max(abs(u), abs(new[0]))
    if spring > q or not (
        monotone or (elastic and spring + k_z * h2 * bend <= q and far + h2 * bend <= peak)
    ):
        return False
    force = push + k * new[0] + c * new[1]
    strong = max(abs(push + k * u + c * v), abs(force))
    if strong + h2 * (c * jerk + most * bend) <= peak_force:
        return True
    if c == 0.0:
        return monotone
    before = k * v - c * (scale * rows[i, 0] + push + c * v + k * u)
    after = k * new[1] - c * (scale * _value(rows, i, rows.shape[1] - 1, h) + force)
    snap = size * bounds[i, 2] + c * jerk + most * bend
    near = min(abs(before), abs(after)) if before * after > 0.0 else 0.0
    return bool(near > h2 * (c * snap + most * jerk))


@compiled
def _run(  # noqa: C901  one loop, without calls
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
    """Advance by whole intervals as long as bounds exclude a change of branch and a hidden peak.

    Bounds from the end of the interval are tried first; if they do not suffice, `_sure` decides.
    """
    _, k_z, q, _ = oscillator
    mode, u, v, z = state
    push, c, k = _branch(oscillator, state)
    elastic = mode == ELASTIC
    k_z = k_z if elastic else 0.0
    curved = rows.shape[1] > 2
    most = abs(k)
    size, damped = abs(scale), c + h * most
    close, jerk = 1.0 / (1.0 - 0.125 * h * h * most), 0.0
    peak, peak_time, peak_force = summary[PEAK], summary[PEAK_TIME], summary[PEAK_FORCE]
    u_u, u_v, u_0, u_1 = moves[0, 0], moves[0, 1], moves[0, 2], moves[0, 3]
    v_u, v_v, v_0, v_1 = moves[1, 0], moves[1, 1], moves[1, 2], moves[1, 3]
    began = u
    while i < rows.shape[0]:
        a_0, a_1 = scale * rows[i, 0] + push, scale * rows[i, 1]
        by_u, by_v = u_0 * a_0 + u_1 * a_1, v_0 * a_0 + v_1 * a_1
        if curved:
            a_2, a_3, a_4, a_5 = rows[i, 2], rows[i, 3], rows[i, 4], rows[i, 5]
            by_u += scale * (
                (moves[0, 4] * a_2 + moves[0, 5] * a_3) + (moves[0, 6] * a_4 + moves[0, 7] * a_5)
            )
            by_v += scale * (
                (moves[1, 4] * a_2 + moves[1, 5] * a_3) + (moves[1, 6] * a_4 + moves[1, 7] * a_5)
            )
        new_u = (u_u * u + u_v * v) + by_u
        new_v = (v_u * u + v_v * v) + by_v
        force = (k * new_u + push) + c * new_v
        speed, far = abs(new_v), abs(new_u)
        spring = abs(push + k_z * new_u)
        if spring > q or not (elastic or v * new_v > 0.0):  # the branch ends in this interval
            break
        signed = size * bounds[i, 0] + abs(force) if curved else (a_0 - push) + h * a_1 + force
        at_end = abs(signed)
        if c > 0.0 or curved:
            jerk = share * (size * bounds[i, 1] + damped * at_end + most * speed)
            bend = at_end + h * jerk
        else:
            bend = close * max(abs(a_0 + k * u), at_end)
        if speed <= h * bend or (  # u or the force may not be monotone
            c > 0.0
            and (most * speed - c * at_end if curved else abs(k * new_v - c * signed))
            <= h * (most * bend + c * jerk)
        ):
            reach = h * (speed + h * bend)
            if (
                not elastic
                or spring + k_z * reach > q
                or far + reach > peak
                or abs(force) + (h * c * bend + most * reach) > peak_force
            ):
                linear, limits = (push, c, k, k_z, elastic), (q, peak, peak_force)
                old, new = (u, v), (new_u, new_v)
                if not _sure(rows, i, bounds, scale, h, linear, limits, old, new, share):
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
def _collapses(oscillator: Constants, state: State, strongest: float) -> bool:
    """Return True if no ground acceleration up to a strongest one can bring the oscillator back.

    Its negative stiffness then drives it outwards, and it does not move inwards. Numbers that have
    overflowed count too.
    """
    k, _, q, _ = oscillator
    _, u, v, _ = state
    return k < 0.0 and not (u * v < 0.0 or -k * abs(u) <= q + strongest)


@compiled
def _note_collapse(
    oscillator: Constants, strongest: float, histories: Float, summary: Float
) -> None:
    """Make the peaks infinite, and the histories NaN from the node at which collapse is sure."""
    summary[PEAK] = summary[RESIDUAL] = math.inf
    summary[PEAK_TIME] = summary[PEAK_FORCE] = math.nan
    for n in range(histories.shape[1]):
        state = (ELASTIC, histories[0, n], histories[1, n], 0.0)
        if _collapses(oscillator, state, strongest):
            histories[:, n:] = math.nan
            break


@compiled
def _come_to_rest(
    time: float, oscillator: Constants, state: State, summary: Float, work: Float
) -> bool:
    """Follow the oscillator over still ground until neither a new peak nor yielding can occur.

    Returns True if it collapses. If k is positive, the energy falls in each cycle, so the peaks are
    final long before the last step. An oscillator that still yields then loses about 2 q / k per
    half cycle, a negligible share of its amplitude, and will rest within q / k of 0: its residual
    is 0.
    """
    k, k_z, q, c = oscillator
    still = np.zeros((1, 2))
    until = math.inf
    for _ in range(_MOST_TAIL):
        mode, u, v, z = state
        if mode == STUCK and abs(k * u) <= q:
            summary[RESIDUAL] = u
            return False
        if _collapses(oscillator, state, 0.0):
            return True
        stiffness = k + k_z if mode == ELASTIC else k
        if mode == ELASTIC:
            centre = (k_z * u - z) / stiffness + 0.0
            summary[RESIDUAL] = centre
            reach = math.hypot(u - centre, v / math.sqrt(stiffness))
            room = q - abs(z + k_z * (centre - u))
            if k_z * reach <= room * _BEYOND:
                if until == math.inf:
                    swings = max(stiffness - 0.25 * c * c, 0.01 * stiffness)
                    until = time + math.tau / math.sqrt(swings)
                force = stiffness * reach * (1.0 + c / math.sqrt(stiffness))
                quiet = abs(centre) + reach <= summary[PEAK] and force <= summary[PEAK_FORCE]
                if quiet or time >= until:
                    return False
        rate = math.sqrt(abs(stiffness)) + c
        # without stiffness and damping, friction alone stops it after |v| / q
        step = _STRIDE / rate if rate > 0.0 else max(_STRIDE / math.sqrt(k + k_z), abs(v) / q)
        state = _cross(still, 0, 0.0, step, time, oscillator, state, summary, work)
        time += step
    if k <= 0.0:
        _exceed_bound()
    summary[RESIDUAL] = 0.0
    return False


@compiled
def integrate(  # noqa: C901  one loop, see above
    rows: Float,
    bounds: Float,
    h: float,
    time: float,
    scale: float,
    oscillator: Constants,
    histories: Float,
    summary: Float,
) -> None:
    """Integrate over a ground motion, from rest.

    Parameters
    ----------
    rows, bounds : array, shapes (intervals, degree + 1) and (intervals, BOUNDS)
        Ground acceleration [m s-2] in powers of the time since the start of each interval, of
        degree 1 or 5; and bounds of the acceleration and its first two derivatives.
    h, time, scale : float
        Length of an interval [s], time of the first node [s], factor of the ground [1].
    oscillator : tuple
        Constants of the oscillator.
    histories : array, shape (3, intervals + 1) or (3, 0)
        Filled with displacement, velocity and k u + z + c u' at the nodes, unless it is empty; NaN
        once collapse is sure.
    summary : array, shape (SUMMARY_SIZE,)
        Filled with the values of the named slots above.
    """
    k, k_z, q, c = oscillator
    rigid = k_z == math.inf
    degree = rows.shape[1] - 1
    work = np.empty((_ROWS, _TERMS))
    for n in range(_TERMS):
        work[_SHARES, n] = 1.0 / ((n + 1) * (n + 2))
    moves = np.empty((2, 2, degree + 3))
    shares = (
        0.0 if rigid else _transition(h, degree, k + k_z, c, work, moves[0]),
        _transition(h, degree, k, c, work, moves[1]),
    )
    strongest = abs(scale) * bounds[:, 0].max()
    summary[:] = 0.0
    summary[PEAK_TIME] = summary[FIRST_YIELD] = math.nan
    state = (STUCK if rigid else ELASTIC, 0.0, 0.0, 0.0)
    if histories.shape[1] > 0:
        histories[:, 0] = 0.0
        if rigid:
            histories[2, 0] = _held_force(scale * rows[0, 0], 0.0, q)
    i = 0
    while i < rows.shape[0] and not _collapses(oscillator, state, strongest):
        mode, u, v, z = state
        branch = 0 if mode == ELASTIC else 1
        if mode == STUCK:
            done = _holds(rows, i, bounds, scale, h, k * u, q, summary)
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
            state = _cross(rows, i, scale, h, time + i * h, oscillator, state, summary, work)
        i += 1
        if histories.shape[1] > 0:
            mode, u, v, z = state
            force = k * u + z + c * v
            if mode == STUCK:
                force = _held_force(scale * _value(rows, i - 1, degree, h), k * u, q)
            histories[0, i], histories[1, i], histories[2, i] = u, v, force
    end = time + rows.shape[0] * h
    if i < rows.shape[0] or _come_to_rest(end, oscillator, state, summary, work):
        _note_collapse(oscillator, strongest, histories, summary)


@compiled
def integrate_many(
    rows: Float, bounds: Float, h: float, time: float, scales: Float, oscillators: Float, out: Float
) -> None:
    """Integrate oscillators, shape (n, 4), over one ground motion at scales, shape (n,)."""
    histories = np.empty((3, 0))
    for n in range(scales.size):
        own = oscillators[n]
        constants = (own[0], own[1], own[2], own[3])
        integrate(rows, bounds, h, time, scales[n], constants, histories, out[n])
