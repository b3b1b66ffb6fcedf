"""The rocking kernel: eq (26) with eq (43) at each impact, integrated to round-off.

With vertical ground acceleration a_v eq (26) becomes (re-derived: gravity is g + a_v)
theta'' = -p_hat^2 [(1 + a_v/g) sin(alpha s - theta) + (a_h/g) cos(alpha s - theta)].

Plain arrays in, plain arrays out, no checks: `rockframe.rocking.response` is the shell around it.
This is the kernel to read, and the reference for the one in lanes, which calls its functions for
whatever happens seldom.

Within an interval the ground acceleration is a polynomial in time, so the rotation has a Taylor
series whose coefficients follow from a recurrence. Uplift, impact, peak and overturning are roots
of these polynomials, found to round-off.

Symbols are those of the paper: theta [rad], omega its rate [rad s-1], s = sgn(theta), 0 at rest;
alpha the slenderness [rad], p_hat the frequency parameter [rad s-1].

Only `integrate` and the loop around it touch arrays. The other functions pass numbers and tuples:
an array passed down costs two atomic operations a call, which at first took 80 % of the time.

The file is long because numba's cache sees no change of a function in another file, and because
the series is written out.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking.kernels.compiled import compiled, inlined

Float = NDArray[np.float64]
#: Coefficients of a polynomial of degree 9, the constant term first.
Polynomial: TypeAlias = tuple[float, float, float, float, float, float, float, float, float, float]

#: A switch that is known when a function is compiled: on if it is not empty.
Marker: TypeAlias = tuple[()] | tuple[int]
NO: Final = ()
YES: Final = (1,)

# Outcomes, the values of the flag variable `verdict`.
NO_UPLIFT: Final = 0
SAFE: Final = 1
OVERTURNED: Final = 2

# Slots of the summary array.
PEAK: Final = 0  # largest |theta| [rad]
PEAK_TIME: Final = 1  # when [s]; NaN if after the end of the motion
UPLIFT_TIME: Final = 2  # first uplift [s], NaN if none
OVERTURNING_TIME: Final = 3  # |theta| = pi/2 [s], NaN if never
IMPACTS: Final = 4  # their number
PEAK_VELOCITY: Final = 5  # largest |omega| [rad s-1]
SUMMARY_SIZE: Final = 6

#: After an impact slower than this share of p_hat, with the ground too weak to uplift, the frame
#: is at rest. Impacts follow each other in a geometric series, so their number depends on it.
REST_VELOCITY_RATIO: Final = 1e-10
#: Highest degree of the ground acceleration that the series of theta can follow.
MAX_GROUND_DEGREE: Final = 5

#: Largest (rate x step) of one Taylor step; longer intervals are divided. What is left out of the
#: series of degree 9 matters most in the first small bounces after an uplift, whose relative error
#: the next ones magnify: with this stride it stays below 1e-8 after 50 impacts in rough motions.
MAX_STRIDE: Final = 0.03
#: Relative size of the last Newton step; its error is the square of it, so round-off.
_ROOT_TOLERANCE: Final = 1e-13
#: A frame balanced on the barrier to round-off is left falling after so many steps, no time given.
_MAX_TAIL: Final = 100_000
HALF_PI: Final = math.pi / 2.0
NEVER: Final = -1.0

# How a step starts: what vanishes exactly at its first instant.
MOVING: Final = 0  # nothing, or the rotation alone, after an impact
FROM_REST: Final = 1  # rotation and rate; the ground is already beyond the uplift acceleration
FROM_UPLIFT: Final = 2  # their derivative too; the ground passes the uplift acceleration now

# How a step ends.
ALOFT: Final = 0
LANDED: Final = 1
FALLEN: Final = 2


@compiled
def derivatives(c: Polynomial, t: float) -> tuple[float, float, float, float]:
    """Value and first three derivatives of a polynomial at t.

    Estrin's scheme: half the waiting of Horner's, where each product needs the one before.
    """
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = c
    t2 = t * t
    t4 = t2 * t2
    value = ((c0 + t * c1) + t2 * (c2 + t * c3)) + t4 * (
        ((c4 + t * c5) + t2 * (c6 + t * c7)) + t4 * (c8 + t * c9)
    )
    d1 = ((c1 + t * (2.0 * c2)) + t2 * (3.0 * c3 + t * (4.0 * c4))) + t4 * (
        ((5.0 * c5 + t * (6.0 * c6)) + t2 * (7.0 * c7 + t * (8.0 * c8))) + t4 * 9.0 * c9
    )
    d2 = ((2.0 * c2 + t * (6.0 * c3)) + t2 * (12.0 * c4 + t * (20.0 * c5))) + t4 * (
        (30.0 * c6 + t * (42.0 * c7)) + t2 * (56.0 * c8 + t * (72.0 * c9))
    )
    d3 = ((6.0 * c3 + t * (24.0 * c4)) + t2 * (60.0 * c5 + t * (120.0 * c6))) + t4 * (
        (210.0 * c7 + t * (336.0 * c8)) + t2 * 504.0 * c9
    )
    return value, d1, d2, d3


@inlined
def shift(a: Polynomial, t: float) -> Polynomial:
    """The ground's polynomial, of degree 5 at most, about t (repeated synthetic division)."""
    a0, a1, a2, a3, a4, a5, _, _, _, _ = a
    a4 += t * a5
    a3 += t * a4
    a2 += t * a3
    a1 += t * a2
    a0 += t * a1
    a4 += t * a5
    a3 += t * a4
    a2 += t * a3
    a1 += t * a2
    a4 += t * a5
    a3 += t * a4
    a2 += t * a3
    a4 += t * a5
    a3 += t * a4
    a4 += t * a5
    return a0, a1, a2, a3, a4, a5, 0.0, 0.0, 0.0, 0.0


@compiled
def _root(c: Polynomial, derivative: int, level: float, a: float, b: float, guess: float) -> float:
    """Root in (a, b] of the derivative-th derivative minus level; its sign changes in between.

    Newton's method from a guess, kept inside a bracket that bisection shrinks whenever a step
    would leave it or converges too slowly.
    """
    end = derivatives(c, b)[derivative] - level
    if end == 0.0:
        return b
    t = guess if a < guess < b else 0.5 * (a + b)
    last = b - a
    for _ in range(200):
        at_t = derivatives(c, t)
        value = at_t[derivative] - level
        if value == 0.0:
            return t
        if (value > 0.0) == (end > 0.0):
            b = t
        else:
            a = t
        slope = at_t[derivative + 1]
        new = t - value / slope if slope != 0.0 else a
        step = abs(new - t)
        if not (a <= new <= b) or step > 0.5 * last:
            new = 0.5 * (a + b)
            step = abs(new - t)
        t = new
        last = step
        if step <= _ROOT_TOLERANCE * t:
            return t
    return t


@compiled
def _inflexion(c: Polynomial, h: float, bend_0: float, bend_h: float) -> float:
    """Where in [0, h] the second derivative changes its sign; h if nowhere.

    It is taken to do so at most once in so short an interval. `bend_0` gives its sign just after 0.
    """
    return _root(c, 2, 0.0, 0.0, h, NEVER) if bend_0 * bend_h < 0.0 else h


@compiled
def _marks(
    c: Polynomial, h: float, slope_0: float, slope_h: float, bend_0: float, middle: float
) -> tuple[float, float, float, float]:
    """Ends of the pieces of [0, h] on which a polynomial is monotone; an empty piece ends at 0.

    `slope_0` and `bend_0` give the signs of the first and second derivatives just after 0;
    `middle` is the inflexion, or h.
    """
    slope_middle = slope_h if middle == h else derivatives(c, middle)[1]
    one = 0.0
    two = 0.0
    if slope_0 * slope_middle < 0.0:
        one = _root(c, 1, 0.0, 0.0, middle, -slope_0 / bend_0)
    if slope_middle * slope_h < 0.0:
        two = _root(c, 1, 0.0, middle, h, NEVER)
    return one, two, h, h


@compiled
def _first_rise(a: Polynomial, limit: float, h: float) -> float:
    """First time in [0, h] at which a polynomial exceeds limit, given that it does not at 0."""
    _, slope_0, bend_0, _ = derivatives(a, 0.0)
    _, slope_h, bend_h, _ = derivatives(a, h)
    left = 0.0
    middle = _inflexion(a, h, bend_0, bend_h)
    for right in _marks(a, h, slope_0, slope_h, bend_0, middle):
        if right > left:
            if derivatives(a, right)[0] > limit:
                return _root(a, 0, limit, left, right, NEVER)
            left = right
    return NEVER


@compiled
def _driving(sign: float, a: Polynomial, limit: float, v: Polynomial) -> Polynomial:
    """What must exceed limit for uplift against a ground of this sign: sign a - limit v."""
    a0, a1, a2, a3, a4, a5, _, _, _, _ = a
    v0, v1, v2, v3, v4, v5, _, _, _, _ = v
    return (
        sign * a0 - limit * v0,
        sign * a1 - limit * v1,
        sign * a2 - limit * v2,
        sign * a3 - limit * v3,
        sign * a4 - limit * v4,
        sign * a5 - limit * v5,
        0.0,
        0.0,
        0.0,
        0.0,
    )


@compiled
def first_exceedance(a: Polynomial, v: Polynomial, limit: float, h: float) -> float:
    """First time in [0, h] at which |a| exceeds limit (1 + v), given that it does not at 0."""
    first = NEVER
    for sign in (1.0, -1.0):
        t = _first_rise(_driving(sign, a, limit, v), limit, h)
        if t != NEVER and (first == NEVER or t < first):
            first = t
    return first


@inlined
def _push(a: float, v: float, s: float, k: float, lifts: Marker) -> float:
    """One term of the right-hand side, of a coefficient of the ground and one of sin and cos."""
    return a * k + v * s if len(lifts) > 0 else a * k


@inlined
def series(
    w0: float,
    w1: float,
    s0: float,
    k0: float,
    a: Polynomial,
    v: Polynomial,
    curved: Marker,
    lifts: Marker,
) -> tuple[float, float, float, float, float, float, float]:
    """Taylor coefficients w2 to w8 of the rate omega = w0 + w1 t + ..., from eq (26).

    With psi = alpha s - theta, omega, sin(psi) and cos(psi) have the coefficients w, s and k:
    omega' = -(v sin + a cos), sin' = -cos omega, cos' = sin omega; a and v are p_hat^2 times the
    horizontal and one plus the vertical ground acceleration [g]. Written out so that all of it
    stays in registers; in each sum the newest terms come last, so that none waits for another.
    `curved` marks a ground of a degree above 1, `lifts` one with vertical acceleration.
    """
    a0, a1, a2, a3, a4, a5, _, _, _, _ = a
    v0, v1, v2, v3, v4, v5, _, _, _, _ = v
    s1 = -k0 * w0
    k1 = s0 * w0
    x = _push(a1, v1, s0, k0, lifts)
    w2 = -1.0 / 2.0 * (x + a0 * k1 + v0 * s1)
    s2 = -1.0 / 2.0 * (k0 * w1 + k1 * w0)
    k2 = 1.0 / 2.0 * (s0 * w1 + s1 * w0)
    x = _push(a1, v1, s1, k1, lifts)
    if len(curved) > 0:
        x += _push(a2, v2, s0, k0, lifts)
    w3 = -1.0 / 3.0 * (x + a0 * k2 + v0 * s2)
    s3 = -1.0 / 3.0 * (k1 * w1 + k0 * w2 + k2 * w0)
    k3 = 1.0 / 3.0 * (s1 * w1 + s0 * w2 + s2 * w0)
    x = _push(a1, v1, s2, k2, lifts)
    if len(curved) > 0:
        x += _push(a3, v3, s0, k0, lifts) + _push(a2, v2, s1, k1, lifts)
    w4 = -1.0 / 4.0 * (x + a0 * k3 + v0 * s3)
    s4 = -1.0 / 4.0 * (k1 * w2 + k2 * w1 + k0 * w3 + k3 * w0)
    k4 = 1.0 / 4.0 * (s1 * w2 + s2 * w1 + s0 * w3 + s3 * w0)
    x = _push(a1, v1, s3, k3, lifts)
    if len(curved) > 0:
        x += (
            _push(a4, v4, s0, k0, lifts)
            + _push(a3, v3, s1, k1, lifts)
            + _push(a2, v2, s2, k2, lifts)
        )
    w5 = -1.0 / 5.0 * (x + a0 * k4 + v0 * s4)
    s5 = -1.0 / 5.0 * (k2 * w2 + k1 * w3 + k3 * w1 + k0 * w4 + k4 * w0)
    k5 = 1.0 / 5.0 * (s2 * w2 + s1 * w3 + s3 * w1 + s0 * w4 + s4 * w0)
    x = _push(a1, v1, s4, k4, lifts)
    if len(curved) > 0:
        x += (
            _push(a5, v5, s0, k0, lifts)
            + _push(a4, v4, s1, k1, lifts)
            + _push(a3, v3, s2, k2, lifts)
            + _push(a2, v2, s3, k3, lifts)
        )
    w6 = -1.0 / 6.0 * (x + a0 * k5 + v0 * s5)
    s6 = -1.0 / 6.0 * (k2 * w3 + k3 * w2 + k1 * w4 + k4 * w1 + k0 * w5 + k5 * w0)
    k6 = 1.0 / 6.0 * (s2 * w3 + s3 * w2 + s1 * w4 + s4 * w1 + s0 * w5 + s5 * w0)
    x = _push(a1, v1, s5, k5, lifts)
    if len(curved) > 0:
        x += (
            _push(a5, v5, s1, k1, lifts)
            + _push(a4, v4, s2, k2, lifts)
            + _push(a3, v3, s3, k3, lifts)
            + _push(a2, v2, s4, k4, lifts)
        )
    w7 = -1.0 / 7.0 * (x + a0 * k6 + v0 * s6)
    s7 = -1.0 / 7.0 * (k3 * w3 + k2 * w4 + k4 * w2 + k1 * w5 + k5 * w1 + k0 * w6 + k6 * w0)
    k7 = 1.0 / 7.0 * (s3 * w3 + s2 * w4 + s4 * w2 + s1 * w5 + s5 * w1 + s0 * w6 + s6 * w0)
    x = _push(a1, v1, s6, k6, lifts)
    if len(curved) > 0:
        x += (
            _push(a5, v5, s2, k2, lifts)
            + _push(a4, v4, s3, k3, lifts)
            + _push(a3, v3, s4, k4, lifts)
            + _push(a2, v2, s5, k5, lifts)
        )
    w8 = -1.0 / 8.0 * (x + a0 * k7 + v0 * s7)
    return w2, w3, w4, w5, w6, w7, w8


@compiled
def taylor(
    theta: float,
    omega: float,
    s: float,
    a: Polynomial,
    v: Polynomial,
    alpha: float,
    p2: float,
    start: int,
) -> Polynomial:
    """Taylor coefficients of theta from eq (26), the ground accelerations a, v [g] polynomials."""
    a = (p2 * a[0], p2 * a[1], p2 * a[2], p2 * a[3], p2 * a[4], p2 * a[5], 0.0, 0.0, 0.0, 0.0)
    v = (p2 + p2 * v[0], p2 * v[1], p2 * v[2], p2 * v[3], p2 * v[4], p2 * v[5], 0.0, 0.0, 0.0, 0.0)
    s0 = math.sin(alpha * s - theta)
    k0 = math.sqrt(1.0 - s0 * s0)  # psi is within +-pi/2
    w1 = -(v[0] * s0 + a[0] * k0)
    if start == FROM_UPLIFT:
        w1 = 0.0  # the two terms cancel at this instant; keep round-off from starting it
    w2, w3, w4, w5, w6, w7, w8 = series(omega, w1, s0, k0, a, v, YES, YES)
    return (
        theta,
        omega,
        w1 * (1.0 / 2.0),
        w2 * (1.0 / 3.0),
        w3 * (1.0 / 4.0),
        w4 * (1.0 / 5.0),
        w5 * (1.0 / 6.0),
        w6 * (1.0 / 7.0),
        w7 * (1.0 / 8.0),
        w8 * (1.0 / 9.0),
    )


@compiled
def flight(
    c: Polynomial, s: float, h: float, start: int, peak_so_far: float
) -> tuple[int, float, float, float, float, float, float]:
    """Follow one Taylor step to its first impact or overturning, or else to its end h.

    Returns how it ends, when within the step, theta and omega then, the largest |theta| on the way
    and when, the latter only if it may exceed `peak_so_far`; and the largest |omega|. Theta is
    monotone on each piece between marks, so that a change of sign there is the one root.
    """
    theta_h, omega_h, bend_h, _ = derivatives(c, h)
    omega_0 = c[1] if start == MOVING else s
    bend_0 = s if start == FROM_UPLIFT else c[2]
    if (
        s * theta_h > 0.0
        and abs(theta_h) < HALF_PI
        and omega_0 * omega_h > 0.0
        and bend_0 * bend_h > 0.0
    ):
        return ALOFT, h, theta_h, omega_h, abs(theta_h), h, abs(omega_h)
    if start == MOVING and c[0] == 0.0 and s * theta_h < 0.0 and s * bend_0 < 0.0 > s * bend_h:
        # a bounce: theta is concave, so one landing, at about twice the time of the peak
        crest = -c[1] / (2.0 * c[2])
        if s * c[1] * h <= peak_so_far and crest < h and s * derivatives(c, crest)[0] > 0.0:
            t = _root(c, 0, 0.0, crest, h, 2.0 * crest)
            omega = derivatives(c, t)[1]
            return LANDED, t, 0.0, omega, 0.0, 0.0, abs(omega)
    peak = 0.0
    peak_time = 0.0
    ended = ALOFT
    t = h
    theta = theta_h
    left = 0.0
    middle = _inflexion(c, h, bend_0, bend_h)
    for right in _marks(c, h, omega_0, omega_h, bend_0, middle):
        if right <= left:
            continue
        reached = derivatives(c, right)[0]
        if s * reached <= 0.0:
            # a flight that started at 0 is nearly a parabola: it lands at twice its peak's time
            guess = 2.0 * left if c[0] == 0.0 else NEVER
            ended, t, theta = LANDED, _root(c, 0, 0.0, left, right, guess), 0.0
            break
        if abs(reached) >= HALF_PI:
            ended, t, theta = FALLEN, _root(c, 0, s * HALF_PI, left, right, NEVER), s * HALF_PI
            peak, peak_time = HALF_PI, t
            break
        if abs(reached) > peak:
            peak = abs(reached)
            peak_time = right
        left = right
    omega = omega_h if ended == ALOFT else derivatives(c, t)[1]
    fastest = abs(omega)
    if middle < t:
        fastest = max(fastest, abs(derivatives(c, middle)[1]))
    return ended, t, theta, omega, peak, peak_time, fastest


@compiled
def _free_rocking(
    theta: float, omega: float, s: float, alpha: float, p_hat: float, restitution: float
) -> tuple[bool, float, float]:
    """Whether the frame overturns freely from this state; if not, the largest |theta|, |omega|.

    The exact energy verdict: E = omega^2/2 + p_hat^2 cos(alpha - |theta|) is kept between impacts,
    p_hat^2 is the barrier at |theta| = alpha, and an impact takes (1 - restitution^2) of the
    kinetic energy. What is computed is E - p_hat^2, without its cancellation near the barrier.
    """
    if s == 0.0:
        return False, 0.0, 0.0
    p2 = p_hat * p_hat
    barrier = 2.0 * p2 * math.sin(0.5 * alpha) ** 2
    excess = 0.5 * omega * omega - 2.0 * p2 * math.sin(0.5 * (alpha - abs(theta))) ** 2
    outward = s * omega >= 0.0
    if abs(theta) >= alpha and (outward or excess < 0.0):
        return True, HALF_PI, 0.0
    landing = math.sqrt(2.0 * max(0.0, excess + barrier))
    if not outward:  # over to the other side, with what the impact leaves
        excess = restitution * restitution * (excess + barrier) - barrier
    if excess >= 0.0:
        return True, HALF_PI, 0.0
    return False, alpha - 2.0 * math.asin(math.sqrt(-excess / (2.0 * p2))), landing


@compiled
def lift_off(a: Polynomial, v: Polynomial, limit: float, span: float) -> tuple[float, int]:
    """When within the span a frame at rest uplifts, and how it starts; NEVER if it does not."""
    if abs(a[0]) > limit * (1.0 + v[0]):
        return 0.0, FROM_REST
    wait = first_exceedance(a, v, limit, span)
    return (wait, FROM_UPLIFT) if wait < span else (NEVER, FROM_UPLIFT)


@compiled
def tail(
    theta: float, omega: float, s: float, alpha: float, p_hat: float, restitution: float
) -> tuple[bool, float, float, float, float, float]:
    """What comes when the ground is still, from this state.

    Returns whether the frame overturns, how long after [s], NaN if not, and the largest |theta|,
    |omega|; then when it landed before it overturned on the other side, NaN if it did not, and the
    rate just before. A frame balanced on the barrier to round-off overturns at no time, NaN.
    """
    overturns, peak, fastest = _free_rocking(theta, omega, s, alpha, p_hat, restitution)
    if not overturns:
        return False, math.nan, peak, fastest, math.nan, 0.0
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    h = MAX_STRIDE / p_hat
    landed = math.nan
    landing = 0.0
    for i in range(_MAX_TAIL):
        elapsed = 0.0
        while elapsed < h:
            c = taylor(theta, omega, s, zero, zero, alpha, p_hat * p_hat, MOVING)
            ended, t, theta, omega, _, _, fast = flight(c, s, h - elapsed, MOVING, HALF_PI)
            fastest = max(fastest, fast)
            elapsed += t
            if ended == ALOFT:
                break
            if ended == FALLEN:
                return True, i * h + elapsed, HALF_PI, fastest, landed, landing
            landed = i * h + elapsed
            landing = omega
            omega *= restitution
            s = -s
    return True, math.nan, HALF_PI, fastest, landed, landing


@compiled
def integrate(  # noqa: C901  one loop over arrays, see above
    ground: Float,
    vertical: Float,
    time_step: float,
    start_time: float,
    scale: float,
    alpha: float,
    p_hat: float,
    restitution: float,
    theta_0: float,
    omega_0: float,
    thetas: Float,
    omegas: Float,
    impacts: Float,
    summary: Float,
) -> int:
    """Integrate eq (26) with eq (43) over a ground motion and give the verdict.

    Parameters
    ----------
    ground : array, shape (intervals, degree + 1)
        Horizontal ground acceleration [g] as a polynomial, of degree 5 at most, in the time since
        each interval's start [s].
    vertical : array, shape (intervals, degree + 1) or (0, degree + 1)
        Vertical ground acceleration [g] in the same way, above -1 g; without rows there is none.
    time_step, start_time : float
        Length of an interval, time of the first node [s].
    scale : float
        What the ground accelerations are multiplied by [1].
    alpha, p_hat, restitution : float
        Slenderness [rad], frequency parameter [rad s-1], velocity ratio of an impact, sqrt(r).
    theta_0, omega_0 : float
        Rotation [rad] and its rate [rad s-1] at the start.
    thetas, omegas : array, shape (intervals + 1,) or (0,)
        Filled with the state at the nodes, if they have room; NaN after overturning.
    impacts : array, shape (kept, 2)
        Filled with the first impacts' times [s] and the rates just before them [rad s-1].
    summary : array, shape (SUMMARY_SIZE,)
        Filled with what the named slots say.

    Returns
    -------
    int
        NO_UPLIFT, SAFE or OVERTURNED.
    """
    intervals, coefficients = ground.shape
    lifts = vertical.shape[0] > 0
    keeps = thetas.shape[0] > 0
    strongest = 0.0
    for i in range(intervals):
        largest = 0.0
        for j in range(coefficients - 1, -1, -1):
            largest = largest * time_step + abs(ground[i, j])
            if lifts:
                largest += abs(vertical[i, j])
        strongest = max(strongest, largest)
    strongest *= abs(scale)
    limit = math.tan(alpha)
    p2 = p_hat * p_hat
    # each derivative of theta grows by at most about this rate
    rate = p_hat * (1.0 + strongest)
    pieces = max(1, math.ceil(rate * time_step / MAX_STRIDE))
    h = time_step / pieces

    theta = theta_0
    omega = omega_0
    s = np.sign(theta) if theta != 0.0 else np.sign(omega)
    peak = abs(theta)
    peak_time = start_time if s != 0.0 else math.nan
    uplift_time = start_time if s != 0.0 else math.nan
    overturning_time = math.nan
    fastest = abs(omega)
    count = 0
    if keeps:
        thetas[0] = theta
        omegas[0] = omega
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    v = zero
    for i in range(intervals):
        time = start_time + i * time_step
        if s == 0.0:
            largest = 0.0
            for j in range(coefficients - 1, -1, -1):
                largest = largest * time_step + abs(ground[i, j])
                if lifts:
                    largest += limit * abs(vertical[i, j])
            if abs(scale) * largest <= limit:
                if keeps:
                    thetas[i + 1] = 0.0
                    omegas[i + 1] = 0.0
                continue
        a = (
            scale * ground[i, 0],
            scale * ground[i, 1] if coefficients > 1 else 0.0,
            scale * ground[i, 2] if coefficients > 2 else 0.0,
            scale * ground[i, 3] if coefficients > 3 else 0.0,
            scale * ground[i, 4] if coefficients > 4 else 0.0,
            scale * ground[i, 5] if coefficients > 5 else 0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        )
        if lifts:
            v = (
                scale * vertical[i, 0],
                scale * vertical[i, 1] if coefficients > 1 else 0.0,
                scale * vertical[i, 2] if coefficients > 2 else 0.0,
                scale * vertical[i, 3] if coefficients > 3 else 0.0,
                scale * vertical[i, 4] if coefficients > 4 else 0.0,
                scale * vertical[i, 5] if coefficients > 5 else 0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            )
        for k in range(pieces):
            elapsed = k * h
            end = elapsed + h
            start = MOVING
            while elapsed < end:
                now = shift(a, elapsed) if elapsed > 0.0 else a
                lift = shift(v, elapsed) if lifts and elapsed > 0.0 else v
                if s == 0.0:
                    wait, start = lift_off(now, lift, limit, end - elapsed)
                    if wait == NEVER:
                        break
                    if wait > 0.0:
                        elapsed += wait
                        now = shift(a, elapsed)
                        lift = shift(v, elapsed) if lifts else v
                    s = -1.0 if now[0] > 0.0 else 1.0
                    if math.isnan(uplift_time):
                        uplift_time = time + elapsed
                c = taylor(theta, omega, s, now, lift, alpha, p2, start)
                ended, t, theta, omega, high, high_time, fast = flight(
                    c, s, end - elapsed, start, peak
                )
                fastest = max(fastest, fast)
                if high > peak:
                    peak = high
                    peak_time = time + elapsed + high_time
                elapsed += t
                if ended == ALOFT:
                    break
                if ended == FALLEN:
                    overturning_time = time + elapsed
                    break
                start = MOVING
                if count < impacts.shape[0]:
                    impacts[count, 0] = time + elapsed
                    impacts[count, 1] = omega
                count += 1
                omega *= restitution
                s = -s
                if abs(omega) < REST_VELOCITY_RATIO * p_hat:
                    needed = limit * (1.0 + derivatives(v, elapsed)[0])
                    if abs(derivatives(a, elapsed)[0]) <= needed:
                        omega = 0.0
                    if omega == 0.0:
                        s = 0.0
            if not math.isnan(overturning_time):
                break
        if not math.isnan(overturning_time):
            if keeps:
                for j in range(i + 1, intervals + 1):
                    thetas[j] = math.nan
                    omegas[j] = math.nan
            break
        if keeps:
            thetas[i + 1] = theta
            omegas[i + 1] = omega

    verdict = NO_UPLIFT if math.isnan(uplift_time) else SAFE
    if not math.isnan(overturning_time):
        verdict = OVERTURNED
    else:  # the ground is still: the energy decides
        end_time = start_time + intervals * time_step
        overturns, after, high, fast, landed, landing = tail(
            theta, omega, s, alpha, p_hat, restitution
        )
        fastest = max(fastest, fast)
        if not math.isnan(landed):
            if count < impacts.shape[0]:
                impacts[count, 0] = end_time + landed
                impacts[count, 1] = landing
            count += 1
        if high > peak:
            peak = high
            peak_time = math.nan
        if overturns:
            verdict = OVERTURNED
            overturning_time = end_time + after
            peak_time = overturning_time
    summary[PEAK] = peak
    summary[PEAK_TIME] = peak_time
    summary[UPLIFT_TIME] = uplift_time
    summary[OVERTURNING_TIME] = overturning_time
    summary[IMPACTS] = count
    summary[PEAK_VELOCITY] = fastest
    return verdict


@compiled
def integrate_many(
    ground: Float,
    vertical: Float,
    time_step: float,
    start_time: float,
    scale: Float,
    alpha: Float,
    p_hat: Float,
    restitution: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> None:
    """Integrate over one ground motion for each of several scales and frames, from rest.

    Parameters
    ----------
    ground, vertical, time_step, start_time
        As for `integrate`.
    scale, alpha, p_hat, restitution : array, shape (scenarios,)
        As for `integrate`, of each scenario.
    verdicts : array of int8, shape (scenarios,)
        Filled with the outcomes.
    summaries : array, shape (scenarios, SUMMARY_SIZE)
        Filled with what the named slots say.
    """
    none = np.empty(0)
    no_log = np.empty((0, 2))
    for k in range(scale.size):
        verdicts[k] = integrate(
            ground,
            vertical,
            time_step,
            start_time,
            scale[k],
            alpha[k],
            p_hat[k],
            restitution[k],
            0.0,
            0.0,
            none,
            none,
            no_log,
            summaries[k],
        )
