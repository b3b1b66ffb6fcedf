"""One step of two unequal columns, where it begins, and the motion after the end of a record.

`tables` of `linkage` fit G and H of s'' = -(1 + a_v/g) G(s) - (a/g) H(s) by polynomials in the
course s, piece by piece. The course is positive outwards on both sides, and scaled so that it ends
at pi/2; then the events of a step are those of equal columns (`rocking.kernels.steps`).
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels.steps import (
    ALOFT,
    FALLEN,
    FROM_REST,
    FROM_UPLIFT,
    HALF_PI,
    MAX_SMOOTH_STRIDE,
    MOVING,
    NEVER,
    ROOT_STEPS,
    Marker,
    Polynomial,
    first_rise,
    flight,
)

Float = NDArray[np.float64]
#: Coefficients of G or H in a piece of the course, in powers of the distance from its middle.
Curve: TypeAlias = tuple[float, float, float, float, float, float, float, float]
#: Taylor coefficients of -s''.
Bends: TypeAlias = tuple[float, float, float, float, float, float, float, float]

# A table has the numbers of the right side, then those of the left side, of one bent.
LIMIT: Final = 0  # ground acceleration that uplifts the bent to this side [g]
BOUNCE: Final = 1  # s' on the other side after an impact, over s' before it
BARRIER: Final = 2  # course of the unstable equilibrium
CREST: Final = 3  # potential energy there, zero at rest [s-2]
PIECES_FROM: Final = 4
#: Degree of the polynomials, and number of equal pieces of a course.
DEGREE: Final = 7
PIECES: Final = 16
PIECE_WIDTH: Final = HALF_PI / PIECES
# Slots of a piece: coefficients of G, of H, and the energy at its middle.
PULL: Final = 0
PUSH: Final = DEGREE + 1
ENERGY: Final = 2 * (DEGREE + 1)
PIECE_SIZE: Final = ENERGY + 1
SIDE_SIZE: Final = PIECES_FROM + PIECES * PIECE_SIZE
TABLE_SIZE: Final = 2 * SIDE_SIZE

#: Largest number of steps over still ground to the end of the course.
_MAX_TAIL: Final = 100_000
#: Most landings over still ground before the end of the course.
_MOST_LANDINGS: Final = 2
ZERO: Final = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inlined
def about(c: Curve, x: float) -> tuple[float, float, float, float, float]:
    """Return the first five coefficients of a polynomial about x (repeated synthetic division)."""
    c0, c1, c2, c3, c4, c5, c6, c7 = c
    c6 += x * c7
    c5 += x * c6
    c4 += x * c5
    c3 += x * c4
    c2 += x * c3
    c1 += x * c2
    c0 += x * c1
    c6 += x * c7
    c5 += x * c6
    c4 += x * c5
    c3 += x * c4
    c2 += x * c3
    c1 += x * c2
    c6 += x * c7
    c5 += x * c6
    c4 += x * c5
    c3 += x * c4
    c2 += x * c3
    c6 += x * c7
    c5 += x * c6
    c4 += x * c5
    c3 += x * c4
    c6 += x * c7
    c5 += x * c6
    c4 += x * c5
    return c0, c1, c2, c3, c4


@inlined
def _mixed(a: float, v: float, h: float, g: float, lifts: Marker) -> float:
    """Return a coefficient of v G + a H, above the constant terms of the ground's polynomials."""
    return a * h + v * g if len(lifts) > 0 else a * h


@inlined
def bends(  # sums written out
    x: float,
    rate: float,
    a: Polynomial,
    v: Polynomial,
    pushed: float,
    pull: Curve,
    push: Curve,
    curved: Marker,
    lifts: Marker,
) -> Bends:
    """Return Taylor coefficients f0 to f7 of -s'' = v G(s) + a H(s).

    `x` is the distance from the middle of the piece; s - s(0) = d = d1 t + d2 t^2 + .... `a` is
    the ground acceleration [g], outwards, and `v` one plus the vertical one. `pushed` is zero if
    the force is exactly zero at t = 0, else one. Of f6 and f7 the same terms are kept as for equal
    columns (`rocking.kernels.vectors`): products of at most two coefficients of d.
    """
    g0, g1, g2, g3, g4 = about(pull, x)
    h0, h1, h2, h3, h4 = about(push, x)
    p1 = v[0] * g1 + a[0] * h1
    p2 = v[0] * g2 + a[0] * h2
    p3 = v[0] * g3 + a[0] * h3
    p4 = v[0] * g4 + a[0] * h4
    r1 = _mixed(a[1], v[1], h1, g1, lifts)
    r2 = _mixed(a[1], v[1], h2, g2, lifts)
    r3 = _mixed(a[1], v[1], h3, g3, lifts)
    f0 = pushed * (v[0] * g0 + a[0] * h0)
    d1 = rate
    d2 = f0 * (-1.0 / 2.0)
    f1 = p1 * d1 + _mixed(a[1], v[1], h0, g0, lifts)
    d3 = f1 * (-1.0 / 6.0)
    q2 = d1 * d1
    f2 = p1 * d2 + p2 * q2 + r1 * d1
    if len(curved) > 0:
        f2 += _mixed(a[2], v[2], h0, g0, lifts)
    d4 = f2 * (-1.0 / 12.0)
    q3 = 2.0 * (d1 * d2)
    c3 = q2 * d1
    f3 = (p1 * d3 + r1 * d2) + (p2 * q3 + r2 * q2) + p3 * c3
    if len(curved) > 0:
        s1 = _mixed(a[2], v[2], h1, g1, lifts)
        f3 += _mixed(a[3], v[3], h0, g0, lifts) + s1 * d1
    d5 = f3 * (-1.0 / 20.0)
    q4 = 2.0 * (d1 * d3) + d2 * d2
    c4 = 3.0 * (q2 * d2)
    f4 = (p1 * d4 + r1 * d3) + (p2 * q4 + r2 * q3) + (p3 * c4 + r3 * c3) + p4 * (q2 * q2)
    if len(curved) > 0:
        s2 = _mixed(a[2], v[2], h2, g2, lifts)
        t1 = _mixed(a[3], v[3], h1, g1, lifts)
        f4 += _mixed(a[4], v[4], h0, g0, lifts) + t1 * d1 + (s1 * d2 + s2 * q2)
    d6 = f4 * (-1.0 / 30.0)
    q5 = 2.0 * (d1 * d4 + d2 * d3)
    c5 = 3.0 * (q2 * d3 + (d1 * d2) * d2)
    f5 = (p1 * d5 + r1 * d4) + (p2 * q5 + r2 * q4) + (p3 * c5 + r3 * c4) + p4 * (4.0 * (c3 * d2))
    if len(curved) > 0:
        s3 = _mixed(a[2], v[2], h3, g3, lifts)
        t2 = _mixed(a[3], v[3], h2, g2, lifts)
        u1 = _mixed(a[4], v[4], h1, g1, lifts)
        f5 += _mixed(a[5], v[5], h0, g0, lifts) + u1 * d1
        f5 += (t1 * d2 + t2 * q2) + (s1 * d3 + s2 * q3 + s3 * c3)
    d7 = f5 * (-1.0 / 42.0)
    q6 = 2.0 * (d1 * d5 + d2 * d4) + d3 * d3
    f6 = (p1 * d6 + r1 * d5) + (p2 * q6 + r2 * q5)
    f7 = (p1 * d7 + r1 * d6) + r2 * q6
    if len(curved) > 0:
        t3 = _mixed(a[3], v[3], h3, g3, lifts)
        u2 = _mixed(a[4], v[4], h2, g2, lifts)
        w1 = _mixed(a[5], v[5], h1, g1, lifts)
        f6 += w1 * d1 + (u1 * d2 + u2 * q2)
        f6 += (t1 * d3 + t2 * q3 + t3 * c3) + (s1 * d4 + s2 * q4 + s3 * c4)
        f7 += w1 * d2 + (u1 * d3 + u2 * q3) + (t1 * d4 + t2 * q4 + t3 * c4)
        f7 += s1 * d5 + s2 * q5 + s3 * c5
    return f0, f1, f2, f3, f4, f5, f6, f7


@inlined
def piece_of(course: float) -> int:
    """Return the piece that a course lies in."""
    return min(int(course / PIECE_WIDTH), PIECES - 1)


@inlined
def middle_of(piece: int) -> float:
    """Return the middle of a piece."""
    return (piece + 0.5) * PIECE_WIDTH


@inlined
def _curve(table: Float, at: int) -> Curve:
    return (
        table[at],
        table[at + 1],
        table[at + 2],
        table[at + 3],
        table[at + 4],
        table[at + 5],
        table[at + 6],
        table[at + 7],
    )


@compiled
def series(
    table: Float,
    here: int,
    sign: float,
    s: float,
    rate: float,
    a: Polynomial,
    v: Polynomial,
    start: int,
) -> Polynomial:
    """Return Taylor coefficients of the course on a side (sign 1 right, -1 left).

    `a` is the horizontal ground acceleration [g] to the right, `v` the vertical one.
    """
    out = (
        sign * a[0],
        sign * a[1],
        sign * a[2],
        sign * a[3],
        sign * a[4],
        sign * a[5],
        0.0,
        0.0,
        0.0,
        0.0,
    )
    down = (1.0 + v[0], v[1], v[2], v[3], v[4], v[5], 0.0, 0.0, 0.0, 0.0)
    piece = piece_of(s)
    at = here + PIECES_FROM + piece * PIECE_SIZE
    pushed = 0.0 if start == FROM_UPLIFT else 1.0
    f0, f1, f2, f3, f4, f5, f6, f7 = bends(
        s - middle_of(piece),
        rate,
        out,
        down,
        pushed,
        _curve(table, at + PULL),
        _curve(table, at + PUSH),
        (1,),
        (1,),
    )
    return (
        s,
        rate,
        f0 * (-1.0 / 2.0),
        f1 * (-1.0 / 6.0),
        f2 * (-1.0 / 12.0),
        f3 * (-1.0 / 20.0),
        f4 * (-1.0 / 30.0),
        f5 * (-1.0 / 42.0),
        f6 * (-1.0 / 56.0),
        f7 * (-1.0 / 72.0),
    )


@compiled
def energy(table: Float, here: int, s: float) -> float:
    """Return the potential energy at a course [s-2]; `here` is where the side's numbers begin."""
    piece = piece_of(s)
    at = here + PIECES_FROM + piece * PIECE_SIZE
    x = s - middle_of(piece)
    total = 0.0
    for k in range(DEGREE, -1, -1):
        total = total * x + table[at + PULL + k] / (k + 1)
    return float(table[at + ENERGY] + x * total)


@compiled
def turning_point(table: Float, here: int, level: float) -> float:
    """Return the course below the barrier at which the potential energy has a value."""
    low = 0.0
    high = table[here + BARRIER]
    s = 0.5 * high
    for _ in range(ROOT_STEPS):
        value = energy(table, here, s) - level
        if value > 0.0:
            high = s
        else:
            low = s
        piece = piece_of(s)
        at = here + PIECES_FROM + piece * PIECE_SIZE
        slope, _, _, _, _ = about(_curve(table, at + PULL), s - middle_of(piece))
        new = s - value / slope if slope > 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - s) <= 1e-15 * high:
            return float(new)
        s = new
    return float(s)


@compiled
def first_uplift(
    a: Polynomial, v: Polynomial, limits: tuple[float, float], span: float
) -> tuple[float, int]:
    """Return when the ground first exceeds an uplift acceleration and grows, and to which side.

    The time is NEVER if it does not within the span.
    """
    first = NEVER
    side = 0
    for j in range(2):
        sign = 2.0 * j - 1.0  # ground accelerating to the left uplifts to the right
        limit = limits[0] if j == 0 else limits[1]
        driving = (
            sign * a[0] - limit * v[0],
            sign * a[1] - limit * v[1],
            sign * a[2] - limit * v[2],
            sign * a[3] - limit * v[3],
            sign * a[4] - limit * v[4],
            sign * a[5] - limit * v[5],
            0.0,
            0.0,
            0.0,
            0.0,
        )
        t = first_rise(driving, limit, span)
        if t != NEVER and (first == NEVER or t < first):
            first = t
            side = j
    return first, side


@compiled
def pull_at_rest(table: Float, here: int, unit: float, a: float, v: float) -> float:
    """Return -s'' at s = 0, in the bits of `bends`; `unit` is the square of the unit of time."""
    at = here + PIECES_FROM
    x = 0.0 - middle_of(0)
    pull = 0.0
    push = 0.0
    for k in range(DEGREE, -1, -1):
        pull = unit * table[at + PULL + k] + x * pull
        push = unit * table[at + PUSH + k] + x * push
    return (1.0 + v) * pull + a * push


@compiled
def lift_off(
    a: Polynomial,
    v: Polynomial,
    table: Float,
    base: int,
    unit: float,
    span: float,
) -> tuple[float, int, int]:
    """Return when within the span a bent at rest uplifts (NEVER if not), how, and to which side.

    As for equal columns: where the ground exceeds the limit by round-off only, the bent uplifts
    only if the ground grows.
    """
    limits = (table[base + LIMIT], table[base + SIDE_SIZE + LIMIT])
    for j in range(2):
        sign = 2.0 * j - 1.0
        if sign * a[0] > limits[j] * (1.0 + v[0]):
            here = base + j * SIDE_SIZE
            if pull_at_rest(table, here, unit, -sign * a[0], v[0]) < 0.0:
                return 0.0, FROM_REST, j
    wait, side = first_uplift(a, v, limits, span)
    return (wait, FROM_UPLIFT, side) if wait < span else (NEVER, FROM_UPLIFT, side)


@compiled
def tail(  # noqa: C901  one loop after the energy has decided
    table: Float, base: int, side: int, s: float, rate: float, frequency: float
) -> tuple[bool, float, float, float, int]:
    """Follow a bent over still ground; the energy decides.

    Returns whether it overturns, how long after [s] (NaN if it stands or balances), the largest
    courses on the right and on the left, and the number of landings before overturning.
    """
    peaks = [0.0, 0.0]
    here = base + side * SIDE_SIZE
    total = 0.5 * rate * rate + energy(table, here, s)
    outward = rate >= 0.0
    crest = table[here + CREST]
    falls = s >= table[here + BARRIER] and (outward or total < crest)
    peaks[side] = s
    now = side
    for turn in range(_MOST_LANDINGS + 1):
        if falls:
            break
        here = base + now * SIDE_SIZE
        if turn > 0 or outward:
            falls = total >= table[here + CREST]
            if not falls:
                peaks[now] = max(peaks[now], turning_point(table, here, total))
        if not falls:
            total *= table[here + BOUNCE] ** 2
            now = 1 - now
    if not falls:
        return False, math.nan, peaks[0], peaks[1], 0
    h = MAX_SMOOTH_STRIDE / frequency
    landings = 0
    now = side
    for i in range(_MAX_TAIL):
        elapsed = 0.0
        while elapsed < h:
            here = base + now * SIDE_SIZE
            c = series(table, here, 1.0 - 2.0 * now, s, rate, ZERO, ZERO, MOVING)
            ended, t, s, rate, high, _, _ = flight(c, 1.0, h - elapsed, MOVING, peaks[now])
            peaks[now] = max(peaks[now], high)
            elapsed += t
            if ended == ALOFT:
                break
            if ended == FALLEN:
                return True, i * h + elapsed, peaks[0], peaks[1], landings
            if landings == _MOST_LANDINGS:  # it balances on the barrier
                return True, math.nan, peaks[0], peaks[1], landings
            landings += 1
            rate *= -table[base + now * SIDE_SIZE + BOUNCE]
            now = 1 - now
    return True, math.nan, peaks[0], peaks[1], landings
