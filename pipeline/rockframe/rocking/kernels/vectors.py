"""Operations on all lanes of a block at once: loops that the compiler vectorises.

A lane contains one scenario while its frame rocks. Theta and omega are positive outwards, on the
side that has lifted. `A` is the horizontal acceleration [g] times p_hat^2 and the scale, with the
sign of that side. The unit of time is the length of an interval of the ground motion, in which the
acceleration is a polynomial. A block is one array with a row of WIDTH numbers for each quantity, so
that the compiler knows that nothing overlaps.

These loops have no branches, so the result of a lane does not depend on other lanes. A lane in
which an event happens is left unchanged, and marked.

The file is long because the compiler vectorises only operations that are written out in one loop.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels.steps import FROM_UPLIFT, HALF_PI, MOVING, Marker, Polynomial, shift

Float = NDArray[np.float64]
#: Taylor coefficients of psi''.
Bends: TypeAlias = tuple[float, float, float, float, float, float, float, float]

#: Number of lanes in a block: two of the widest vectors of current processors.
WIDTH: Final = 16

# Rows of a block.
THETA: Final = 0 * WIDTH
OMEGA: Final = 1 * WIDTH
ALPHA: Final = 2 * WIDTH
P2: Final = 3 * WIDTH  # p_hat^2
PEAK: Final = 4 * WIDTH  # largest theta until now at which omega changed its sign
FASTEST: Final = 5 * WIDTH  # largest |omega| until now
ELAPSED: Final = 6 * WIDTH  # time within the interval; zero unless theta is zero
START: Final = 7 * WIDTH  # how the next flight starts, as in the scalar kernel
A: Final = 8 * WIDTH  # coefficients of the ground, six rows
V: Final = 14 * WIDTH  # p_hat^2 times (1 + vertical acceleration [g]), six rows
AT: Final = 20 * WIDTH  # current row of the ground
END: Final = 21 * WIDTH  # row after the last one of the motion
SEEN: Final = 22 * WIDTH  # 1 if the last stride was taken or the lane was pending
PENDING: Final = 23 * WIDTH  # 1 if the lane waits for a hop, or is empty
TIE: Final = 24 * WIDTH  # p_hat^2 times the force of the ties at theta = 0
# Rows for the demands on the joints, see `_demands`.
SHEAR: Final = 25 * WIDTH  # largest base shear until now, times p_hat^2
FRICTION: Final = 26 * WIDTH  # largest friction demand at the base until now
SWING: Final = 27 * WIDTH  # acceleration of the whole mass over theta'', times p_hat^2 / g
SWING_TOP: Final = 28 * WIDTH  # the same of the beam
COSINE_TOP: Final = 29 * WIDTH  # cosine of the angle of the beam's lever less alpha
SINE_TOP: Final = 30 * WIDTH
SHARE: Final = 31 * WIDTH  # length of a row of the ground over that between two samples
TURNED: Final = 32 * WIDTH  # term that the ties add to the row A
LIGHTER: Final = 33 * WIDTH  # term that they subtract from the row V
STIFF: Final = 34 * WIDTH  # twice p_hat^2 times their stiffness
TIED: Final = 35 * WIDTH  # force of the ties over their moment and the weight on the base
TIED_TOP: Final = 36 * WIDTH  # force over their moment and the weight of the beam
TOP_MOST: Final = 37 * WIDTH  # largest force on the beam over the vertical force under it until now
TOP_LEAST: Final = 38 * WIDTH  # least of it; the force is positive towards the lifted side
PRESS: Final = 39 * WIDTH  # smallest vertical force at the base until now, times p_hat^2
PRESS_TOP: Final = 40 * WIDTH  # the same under the beam
HOT_ROWS: Final = 41

# Rows that a pack has and a block does not.
TAU: Final = 25 * WIDTH  # time of the landing
OPEN: Final = 26 * WIDTH  # 1 while this time is being iterated
KIND: Final = 27 * WIDTH  # how the hop ends
THETA_AFTER: Final = 28 * WIDTH
OMEGA_AFTER: Final = 29 * WIDTH
SERIES: Final = 28 * WIDTH  # coefficients 2 to 9 of theta, in rows 30 to 37
TURN: Final = 38 * WIDTH  # time of a new peak
TURNING: Final = 39 * WIDTH  # 1 if there is a new peak
STEP: Final = 40 * WIDTH  # last Newton step towards the time of the peak
PACK_SIZE: Final = 42 * WIDTH

# Ends of a hop.
HOP_ALONE: Final = 0.0  # to be computed by the scalar kernel
HOP_ALOFT: Final = 1.0
HOP_LANDED: Final = 2.0

_LANDING_STEPS: Final = 12
#: Newton steps to the time of a peak. They start from the top of a parabola, and the error of theta
#: is the square of the error in time.
_TURNING_STEPS: Final = 4


@compiled
def zeros(numbers: int) -> Float:
    """Return zeros that begin at a multiple of 64 bytes: no vector then lies on two cache lines."""
    space = np.zeros(numbers + 8)
    first = -space.ctypes.data % 64 // 8
    return space[first : first + numbers]


@compiled
def close_block(
    pool: Float, last: int, block: int, who: int, pending: NDArray[np.uint32], waiting: int
) -> None:
    """Move the scenarios of the block at `last` to empty lanes of the blocks before it.

    A block has `block` numbers; its row `who` is negative in empty lanes. The first `waiting` of
    the lanes in `pending` are renamed.
    """
    to = 0
    for q in range(last, last + WIDTH):
        if pool[q + who] >= 0.0:
            while pool[to + who] >= 0.0:
                to += 1 if to % block < WIDTH - 1 else block - WIDTH + 1
            for r in range(0, block, WIDTH):
                pool[to + r] = pool[q + r]
            for k in range(waiting):
                if pending[k] == q:
                    pending[k] = to


@inlined
def _sine_cosine(x: float) -> tuple[float, float]:
    """Return polynomials equal to sine and cosine to round-off between -pi/2 and pi/2."""
    y = x * x
    y2 = y * y
    y4 = y2 * y2
    s = (
        (-0.16666666666666666 + y * 0.008333333333333316)
        + y2 * (-0.00019841269841254974 + y * 2.7557319219163234e-06)
    ) + y4 * (
        (-2.5052107616996182e-08 + y * 1.6058977312464087e-10)
        + y2 * (-7.643970296798572e-13 + y * 2.7314447669863995e-15)
    )
    k = (
        (-0.5 + y * 0.04166666666666634)
        + y2 * (-0.0013888888888860709 + y * 2.4801587292446213e-05)
    ) + y4 * (
        (-2.755731776732053e-07 + y * 2.0876630867422994e-09)
        + y2 * (-1.1464689885720029e-11 + y * 4.6276759850181716e-14)
    )
    return x + (x * y) * s, 1.0 + y * k


@inlined
def _pushed(pool: Float, j: int, curved: Marker, lifts: Marker) -> tuple[Polynomial, Polynomial]:
    """Return the ground's polynomials in the interval of lane j, from the rows A and V."""
    a0 = pool[j + A]
    a1 = pool[j + A + WIDTH]
    if len(curved) > 0:
        a = (
            a0,
            a1,
            pool[j + A + 2 * WIDTH],
            pool[j + A + 3 * WIDTH],
            pool[j + A + 4 * WIDTH],
            pool[j + A + 5 * WIDTH],
            0.0,
            0.0,
            0.0,
            0.0,
        )
    else:
        a = (a0, a1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if len(lifts) == 0:
        v = (pool[j + P2], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    elif len(curved) > 0:
        v = (
            pool[j + V],
            pool[j + V + WIDTH],
            pool[j + V + 2 * WIDTH],
            pool[j + V + 3 * WIDTH],
            pool[j + V + 4 * WIDTH],
            pool[j + V + 5 * WIDTH],
            0.0,
            0.0,
            0.0,
            0.0,
        )
    else:
        v = (pool[j + V], pool[j + V + WIDTH], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return a, v


@inlined
def _push(a: float, v: float, s: float, k: float, lifts: Marker) -> float:
    """Return a coefficient of v s + a k."""
    return a * k + v * s if len(lifts) > 0 else a * k


@inlined
def _turned(a: float, v: float, s: float, k: float, lifts: Marker) -> float:
    """Return a coefficient of v k - a s."""
    return v * k - a * s if len(lifts) > 0 else -(a * s)


@inlined
def least_of(a: float, b: float) -> float:
    """Return the smaller number; min() also handles NaN, which takes longer."""
    return a if a < b else b


@inlined
def most_of(a: float, b: float) -> float:
    """Return the larger number."""
    return a if a > b else b


@inlined
def _turn(  # noqa: C901  sums written out
    psi: float,
    omega: float,
    a: Polynomial,
    v: Polynomial,
    pushed: float,
    curved: Marker,
    lifts: Marker,
    tie: tuple[()] | tuple[float, float],
) -> Bends:
    """Return Taylor coefficients f0, g1 to g7 of psi'' from eq (26), with psi' = -omega.

    Psi changes by d = d1 t + d2 t^2 + .... With s and k the sine and cosine of psi at t = 0,
    psi'' = (v s + a k) cos(d) + (v k - a s) sin(d).
    The coefficients of cos(d) and sin(d) are written out as products of the coefficients of d,
    which is half the work of the recurrences of the scalar kernel. `pushed` is zero if the force is
    exactly zero at t = 0, else one.

    Psi then has degree 9. With x = rate times step (see MAX_STRIDE), a series of degree 7 would
    omit x^8 / 8! (2e-17 at x = 0.03). But in a flight that begins at theta = 0 the relative error
    counts, because bounces magnify it. The terms of g6 and g7 that matter then are kept: products
    of at most two coefficients of d. On curved ground, where steps are longer (MAX_SMOOTH_STRIDE),
    the terms with its higher coefficients are kept too.

    `tie` is empty, or contains the force of the ties at theta = 0 times sin(theta/2) and
    cos(theta/2) at t = 0. The angle of these changes by d/2: cos(d/2) is replaced by
    3/4 + cos(d)/4 and sin(d/2) by 3 d/8 + sin(d)/8, which is exact up to d^3.
    """
    s, k = _sine_cosine(psi)
    f0 = pushed * (v[0] * s + a[0] * k)
    f1 = _push(a[1], v[1], s, k, lifts)
    r0 = v[0] * k - a[0] * s
    fc = f0
    straight = 0.0
    if len(tie) > 0:
        f0 = pushed * (v[0] * s + a[0] * k + tie[1])
        fc = f0 - 0.75 * tie[1]
        r0 += 0.125 * tie[0]
        straight = 0.375 * tie[0]
    r1 = _turned(a[1], v[1], s, k, lifts)
    d1 = -omega
    d2 = f0 * (1.0 / 2.0)
    g1 = f1 + r0 * d1
    if len(tie) > 0:
        g1 += straight * d1
    d3 = g1 * (1.0 / 6.0)
    q = d1 * d1
    g2 = d2 * (r0 - q) + r1 * d1
    if len(tie) > 0:
        g2 = d2 * (r0 + straight) - 0.5 * fc * q + r1 * d1
    if len(curved) > 0:
        f2 = _push(a[2], v[2], s, k, lifts)
        r2 = _turned(a[2], v[2], s, k, lifts)
        g2 += f2
    d4 = g2 * (1.0 / 12.0)
    q2 = q * (1.0 / 2.0)
    q6 = q * (1.0 / 6.0)
    e = d1 * d2
    s3 = d3 - q6 * d1
    g3 = r0 * s3 + r1 * d2 - f1 * q2 - fc * e
    if len(tie) > 0:
        g3 += straight * d3
    if len(curved) > 0:
        f3 = _push(a[3], v[3], s, k, lifts)
        r3 = _turned(a[3], v[3], s, k, lifts)
        g3 += f3 + r2 * d1
    d5 = g3 * (1.0 / 20.0)
    half = d2 * (1.0 / 2.0)
    c4 = q * (q * (1.0 / 24.0)) - half * d2 - d1 * d3
    s4 = d4 - q2 * d2
    g4 = r0 * s4 + r1 * s3 - f1 * e + fc * c4
    if len(tie) > 0:
        g4 += straight * d4 - tie[1] * (q * (q * (1.0 / 128.0)))
    if len(curved) > 0:
        f4 = _push(a[4], v[4], s, k, lifts)
        r4 = _turned(a[4], v[4], s, k, lifts)
        g4 += f4 + r3 * d1 + r2 * d2 - f2 * q2
    c5 = q6 * e - d1 * d4 - d2 * d3
    s5 = d5 - q2 * d3 - e * half
    g5 = r0 * s5 + r1 * s4 + f1 * c4 + fc * c5
    if len(tie) > 0:
        g5 += straight * d5
    if len(curved) > 0:
        f5 = _push(a[5], v[5], s, k, lifts)
        r5 = _turned(a[5], v[5], s, k, lifts)
        rest = d1 * (q * (q * (1.0 / 120.0)))
        s5 += rest
        g5 += r0 * rest + f5 + r4 * d1 + r3 * d2 + r2 * s3 - f3 * q2 - f2 * e
    d6 = g4 * (1.0 / 30.0)
    d7 = g5 * (1.0 / 42.0)
    c6 = d1 * d5 + d2 * d4 + d3 * (d3 * (1.0 / 2.0))
    g6 = r0 * d6 + r1 * s5 + f1 * c5 - fc * c6
    g7 = r0 * d7 + r1 * d6 - f1 * c6
    if len(tie) > 0:
        g6 += straight * d6
        g7 += straight * d7
    if len(curved) > 0:
        g6 += r5 * d1 + r4 * d2 + r3 * s3 + r2 * s4 - f4 * q2 - f3 * e + f2 * c4
        g7 += r5 * d2 + r4 * s3 + r3 * s4 + r2 * s5 - f5 * q2 - f4 * e + f3 * c4 + f2 * c5
    return f0, g1, g2, g3, g4, g5, g6, g7


@inlined
def demands(
    pool: Float,
    j: int,
    psi: float,
    omega: float,
    f0: float,
    a0: float,
    v0: float,
    tied: Marker,
    theta: float,
) -> tuple[float, float, float, float, float]:
    """Return the forces on the joints of a lane (see `reactions`).

    They are the base shear, the friction demand at the base, shear over vertical force under the
    beam, and the vertical forces at the base and under the beam; forces times p_hat^2.

    `a0`, `v0` and `f0` are the horizontal and vertical pull and psi'' at this time. All points of
    the columns move on circles, so all masses together move like one at the equivalent lever.
    """
    s, k = _sine_cosine(psi)
    across, upwards = a0, v0
    lean, press = 0.0, 0.0
    if len(tied) > 0:
        across -= pool[j + TURNED]
        upwards += pool[j + LIGHTER]
        sine, cosine = _sine_cosine(0.5 * theta)
        moment = pool[j + TIE] + pool[j + STIFF] * sine
        lean, press = moment * sine, moment * cosine
    square = omega * omega
    shear = across + pool[j + SWING] * (s * square - k * f0)
    down = upwards - pool[j + SWING] * (k * square + s * f0)
    s_top = s * pool[j + COSINE_TOP] + k * pool[j + SINE_TOP]
    k_top = k * pool[j + COSINE_TOP] - s * pool[j + SINE_TOP]
    shear_top = across + pool[j + SWING_TOP] * (s_top * square - k_top * f0)
    down_top = upwards - pool[j + SWING_TOP] * (k_top * square + s_top * f0)
    force = abs(shear)
    if len(tied) > 0:
        shear += pool[j + TIED] * lean
        down += pool[j + TIED] * press
        shear_top += pool[j + TIED_TOP] * lean
        down_top += pool[j + TIED_TOP] * press
    base = abs(shear) / down if down > 0.0 else math.inf
    top = shear_top / down_top if down_top > 0.0 else math.inf
    return force, base, top, down, down_top


@inlined
def advance(
    pool: Float, j: int, theta: float, omega: float, bends: Bends, floor: float, top: float
) -> None:
    """Take a lane to the end of its interval, if no event happens in it and theta stays within.

    `bends` are the coefficients of psi'' = -theta'' at the start. At the end of the interval theta
    must be above `floor`, and until then below `top`.
    """
    f0, g1, g2, g3, g4, g5, g6, g7 = bends
    theta_h = theta - (
        (f0 * (1.0 / 2.0) - omega)
        + (
            (g1 * (1.0 / 6.0) + g2 * (1.0 / 12.0))
            + (
                (g3 * (1.0 / 20.0) + g4 * (1.0 / 30.0))
                + (g5 * (1.0 / 42.0) + (g6 * (1.0 / 56.0) + g7 * (1.0 / 72.0)))
            )
        )
    )
    omega_h = omega - (
        (f0 + g1 * (1.0 / 2.0))
        + (
            (g2 * (1.0 / 3.0) + g3 * (1.0 / 4.0))
            + ((g4 * (1.0 / 5.0) + g5 * (1.0 / 6.0)) + (g6 * (1.0 / 7.0) + g7 * (1.0 / 8.0)))
        )
    )
    pull_h = (f0 + g1) + ((g2 + g3) + ((g4 + g5) + (g6 + g7)))
    least = least_of(theta, theta_h)
    most = most_of(theta, theta_h)
    slow = least_of(omega, omega_h)
    quick = most_of(omega, omega_h)
    speed = most_of(quick, -slow)
    bend = abs(f0) + abs(pull_h)
    wave = 0.125 * bend
    swing = 0.5 * bend
    peak = pool[j + PEAK]
    fast = pool[j + FASTEST]
    falling = least_of(f0, pull_h)
    onward = slow - swing
    aloft = most_of(least - wave, most_of(falling, onward))
    lower = most_of(peak - (most + wave), most_of(onward, -swing - quick))
    slower = most_of(most_of(falling, -most_of(f0, pull_h)), fast - (speed + wave))
    below = least_of(top - (most + wave), pool[j + END] - pool[j + AT])
    within = least_of(least_of(slower, below), least - floor)
    good = least_of(least_of(aloft, lower), within) > 0.0
    pool[j + THETA] = theta_h if good else theta
    pool[j + OMEGA] = omega_h if good else omega
    pool[j + FASTEST] = most_of(speed, fast) if good else fast
    on = 1.0 if good else 0.0
    pool[j + AT] = pool[j + AT] + on
    pool[j + SEEN] = pool[j + PENDING] + on


@inlined
def stride(
    pool: Float, b: int, curved: Marker, lifts: Marker, tied: Marker, weighed: Marker
) -> None:
    """Take each lane of the block at b to the end of its interval, if no event happens in it.

    An event is a landing, overturning, or a peak of theta or omega within the interval that exceeds
    the earlier ones. Within the interval theta differs from its chord by at most `wave`, an eighth
    of the bound of its second derivative. Theta can have a maximum or minimum only if its rate at
    one end is at most `swing`, half of that bound.
    """
    for j in range(b, b + WIDTH):
        theta = pool[j + THETA]
        omega = pool[j + OMEGA]
        a, v = _pushed(pool, j, curved, lifts)
        psi = pool[j + ALPHA] - theta
        if len(tied) > 0:
            sine, cosine = _sine_cosine(0.5 * theta)
            tie = (pool[j + TIE] * sine, pool[j + TIE] * cosine)
            f0, g1, g2, g3, g4, g5, g6, g7 = _turn(psi, omega, a, v, 1.0, curved, lifts, tie)
        else:
            tie = ()  # type: ignore[assignment]  # of another kernel
            f0, g1, g2, g3, g4, g5, g6, g7 = _turn(psi, omega, a, v, 1.0, curved, lifts, tie)
        if len(weighed) > 0:
            force, friction, top, down, down_top = demands(
                pool, j, psi, omega, f0, a[0], v[0], tied, theta
            )
            left = (pool[j + END] - pool[j + AT]) * pool[j + SHARE]
            counts = (pool[j + PENDING] == 0.0) & (left > 0.0) & (np.floor(left) == left)
            pool[j + SHEAR] = most_of(force, pool[j + SHEAR]) if counts else pool[j + SHEAR]
            most = most_of(friction, pool[j + FRICTION])
            pool[j + FRICTION] = most if counts else pool[j + FRICTION]
            most = most_of(top, pool[j + TOP_MOST])
            pool[j + TOP_MOST] = most if counts else pool[j + TOP_MOST]
            least = least_of(top, pool[j + TOP_LEAST])
            pool[j + TOP_LEAST] = least if counts else pool[j + TOP_LEAST]
            least = least_of(down, pool[j + PRESS])
            pool[j + PRESS] = least if counts else pool[j + PRESS]
            least = least_of(down_top, pool[j + PRESS_TOP])
            pool[j + PRESS_TOP] = least if counts else pool[j + PRESS_TOP]
        advance(pool, j, theta, omega, (f0, g1, g2, g3, g4, g5, g6, g7), 0.0, HALF_PI)


@inlined
def _value(pack: Float, j: int, t: float) -> tuple[float, float]:
    """Return theta and its rate at t within a hop."""
    p = pack[j + SERIES + 9 * WIDTH]
    d = p
    for k in range(8, 1, -1):
        p = p * t + pack[j + SERIES + k * WIDTH]
        d = d * t + p
    omega = pack[j + OMEGA]
    p = p * t + omega
    return p * t + pack[j + THETA], d * t + p


@inlined
def _locate_peaks(pack: Float) -> None:
    """Locate the new peaks of a pack's lanes by Newton's method on the rate."""
    turning = 0.0
    for j in range(WIDTH):
        turning += pack[j + TURNING]
    if turning > 0.0:
        for _ in range(_TURNING_STEPS):
            for j in range(WIDTH):
                t = pack[j + TURN]
                rate = 9.0 * pack[j + SERIES + 9 * WIDTH]
                bend = rate
                for k in range(8, 1, -1):
                    rate = rate * t + k * pack[j + SERIES + k * WIDTH]
                    bend = bend * t + rate
                rate = rate * t + pack[j + OMEGA]
                pack[j + STEP] = rate / bend if pack[j + TURNING] > 0.0 else 0.0
                pack[j + TURN] = t - pack[j + STEP]
        for j in range(WIDTH):
            t = pack[j + TURN]
            theta, _ = _value(pack, j, t)
            located = (
                (pack[j + TURNING] > 0.0)
                & (abs(pack[j + STEP]) <= 1e-6 * t)
                & (t <= 1.0 - pack[j + ELAPSED])
            )
            missed = (pack[j + TURNING] > 0.0) & (not located)
            pack[j + PEAK] = most_of(theta, pack[j + PEAK]) if located else pack[j + PEAK]
            pack[j + KIND] = HOP_ALONE if missed else pack[j + KIND]
            pack[j + OPEN] = 0.0 if missed else pack[j + OPEN]


@inlined
def _locate_landings(pack: Float) -> None:
    """Locate the landings of a pack's lanes by Newton's method on theta."""
    for _ in range(_LANDING_STEPS):
        active = 0.0
        for j in range(WIDTH):
            active += pack[j + OPEN]
        if active == 0.0:
            break
        for j in range(WIDTH):
            t = pack[j + TAU]
            value, slope = _value(pack, j, t)
            new = t - value / slope
            on = pack[j + OPEN] > 0.0
            pack[j + TAU] = new if on else t
            pack[j + OPEN] = 1.0 if on & (abs(new - t) > 1e-8 * t) else 0.0
    for j in range(WIDTH):
        t = pack[j + TAU]
        _, slope = _value(pack, j, t)
        kind = pack[j + KIND]
        fast = pack[j + FASTEST]
        sure = (pack[j + OPEN] == 0.0) & (t > 0.0) & (t <= 1.0 - pack[j + ELAPSED]) & (slope < 0.0)
        down_here = kind == HOP_LANDED
        landed = down_here & sure
        pack[j + KIND] = HOP_ALONE if down_here & (not sure) else kind
        pack[j + FASTEST] = most_of(-slope, fast) if landed else fast
        pack[j + OMEGA_AFTER] = slope if landed else pack[j + OMEGA_AFTER]


@inlined
def locate(pack: Float) -> None:
    """Locate the new peaks and the landings of a pack's lanes after `take_off`."""
    _locate_peaks(pack)
    _locate_landings(pack)


@inlined
def _bends(pack: Float, j: int, curved: Marker, lifts: Marker, tied: Marker) -> Bends:
    """Return the Taylor coefficients of psi'' of a lane in its hop (see `_turn`)."""
    elapsed = pack[j + ELAPSED]
    a, v = _pushed(pack, j, curved, lifts)
    if len(curved) > 0:
        a = shift(a, elapsed)
        if len(lifts) > 0:
            v = shift(v, elapsed)
    else:
        a = (a[0] + elapsed * a[1], a[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if len(lifts) > 0:
            v = (v[0] + elapsed * v[1], v[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    theta, omega = pack[j + THETA], pack[j + OMEGA]
    psi = pack[j + ALPHA] - theta
    pushed = 0.0 if pack[j + START] == FROM_UPLIFT else 1.0
    if len(tied) > 0:
        sine, cosine = _sine_cosine(0.5 * theta)
        tie = (pack[j + TIE] * sine, pack[j + TIE] * cosine)
        return _turn(psi, omega, a, v, pushed, curved, lifts, tie)
    return _turn(psi, omega, a, v, pushed, curved, lifts, ())


@inlined
def take_off(pack: Float, j: int, bends: Bends) -> None:
    """Compute the series of a lane's hop, how it ends, and first guesses of peak and landing."""
    theta = pack[j + THETA]
    omega = pack[j + OMEGA]
    start = pack[j + START]
    h = 1.0 - pack[j + ELAPSED]
    f0, g1, g2, g3, g4, g5, g6, g7 = bends
    c2 = f0 * (-1.0 / 2.0)
    c3 = g1 * (-1.0 / 6.0)
    c4 = g2 * (-1.0 / 12.0)
    c5 = g3 * (-1.0 / 20.0)
    c6 = g4 * (-1.0 / 30.0)
    c7 = g5 * (-1.0 / 42.0)
    c8 = g6 * (-1.0 / 56.0)
    c9 = g7 * (-1.0 / 72.0)
    pack[j + SERIES + 2 * WIDTH] = c2
    pack[j + SERIES + 3 * WIDTH] = c3
    pack[j + SERIES + 4 * WIDTH] = c4
    pack[j + SERIES + 5 * WIDTH] = c5
    pack[j + SERIES + 6 * WIDTH] = c6
    pack[j + SERIES + 7 * WIDTH] = c7
    pack[j + SERIES + 8 * WIDTH] = c8
    pack[j + SERIES + 9 * WIDTH] = c9
    theta_h = theta + h * (
        omega + h * (c2 + h * (c3 + h * (c4 + h * (c5 + h * (c6 + h * (c7 + h * (c8 + h * c9)))))))
    )
    tail = g4 * (1.0 / 5.0) + h * (
        g5 * (1.0 / 6.0) + h * (g6 * (1.0 / 7.0) + h * (g7 * (1.0 / 8.0)))
    )
    omega_h = omega - h * (
        f0 + h * (g1 * (1.0 / 2.0) + h * (g2 * (1.0 / 3.0) + h * (g3 * (1.0 / 4.0) + h * tail)))
    )
    pull_h = f0 + h * (g1 + h * (g2 + h * (g3 + h * (g4 + h * (g5 + h * (g6 + h * g7))))))
    moving = start == MOVING
    out_0 = omega if moving else 1.0
    pull_0 = -1.0 if start == FROM_UPLIFT else f0
    most = most_of(theta, theta_h)
    weakest = least_of(pull_0, pull_h)
    falling = weakest > 0.0
    even = falling | (most_of(pull_0, pull_h) < 0.0)
    rises = omega > 0.0
    crest = theta + (omega * omega / (2.0 * weakest) if falling & rises else 0.0)
    peak = pack[j + PEAK]
    fast = pack[j + FASTEST]
    turns = moving & falling & rises & (crest > peak) & (omega_h < 0.0)
    pack[j + TURN] = least_of(omega / (f0 if turns else 1.0), h)
    pack[j + TURNING] = 1.0 if turns else 0.0
    low = turns | (crest <= peak)
    # also allowed: a bend that changes sign but cannot reverse the motion or raise its top rate
    bend = (abs(f0) + abs(pull_h)) * h
    quick = most_of(omega, omega_h)
    slow = least_of(omega, omega_h)
    slower = moving & (most_of(quick, -slow) + 0.125 * bend <= fast)
    up = (
        (theta_h > 0.0)
        & (most + 0.125 * bend * h < HALF_PI)
        & ((even & ((out_0 * omega_h > 0.0) | (falling & low))) | (slower & (slow > 0.5 * bend)))
    )
    landing = moving & (theta_h < 0.0) & ((falling & low) | (slower & (quick < -0.5 * bend)))
    # first guess: the landing of a parabola, then one Newton step on the cubic
    root = math.sqrt(most_of(omega * omega + 2.0 * theta * f0, 0.0))
    guess = (omega + root if rises else 2.0 * theta) / (
        f0 if rises else most_of(root - omega, 1e-300)
    )
    slope = omega + guess * (2.0 * c2 + guess * (3.0 * c3))
    guess -= (theta + guess * (omega + guess * (c2 + guess * c3))) / slope
    guess = least_of(guess, h)
    guess = guess if guess > 0.0 else h
    pack[j + TAU] = guess
    on = 1.0 if landing else 0.0
    pack[j + OPEN] = on
    pack[j + KIND] = HOP_ALOFT if up else (HOP_LANDED if landing else HOP_ALONE)
    pack[j + FASTEST] = most_of(abs(omega_h), fast) if up else fast  # |omega| is not above
    pack[j + THETA_AFTER] = theta_h
    pack[j + OMEGA_AFTER] = omega_h


@inlined
def hop(pack: Float, curved: Marker, lifts: Marker, tied: Marker) -> None:
    """Take each lane of a pack from within its interval to its landing or the interval's end.

    Lanes that the scalar kernel must compute are marked: the second derivative changes its sign, a
    peak exceeds the earlier ones and is not located, or the frame overturns. In all other hops
    theta is monotone, or concave from the start to the landing.
    """
    for j in range(WIDTH):
        take_off(pack, j, _bends(pack, j, curved, lifts, tied))
    locate(pack)
