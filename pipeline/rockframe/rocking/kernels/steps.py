"""One step of the rocking kernel: the Taylor series of the rotation, and the events within it."""

from __future__ import annotations

import math
from typing import Final, TypeAlias

from rockframe.compiled import compiled, inlined
from rockframe.errors import InternalError

#: Coefficients of a polynomial of degree 9, the constant term first.
Polynomial: TypeAlias = tuple[float, float, float, float, float, float, float, float, float, float]

#: Largest number of events in an interval, beside bounces that die out.
_MOST_EVENTS: Final = 10_000.0
#: A bounce slows by the restitution e, so 745 / (1 - e) bounces reduce any rate to zero. This over
#: 1 - e allows for several such sequences in an interval; 1 - e counts as at least `_LEAST_LOSS`.
_MOST_BOUNCES: Final = 2_000.0
_LEAST_LOSS: Final = 1e-6
#: Most steps to a root. Each second step at least halves the bracket.
ROOT_STEPS: Final = 200
#: Returned instead of a time if there is no root.
NEVER: Final = -1.0
#: Newton's method stops at this relative step; the error is about its square, which is round-off.
_ROOT_TOLERANCE: Final = 1e-13


@compiled
def exceed_bound() -> None:
    """Report that a loop of a kernel exceeds its bound."""
    raise InternalError(
        "internal error: a loop of the rocking kernel exceeds its bound. Please report it, with "
        "the motion and the structure."
    )


@compiled
def most_events(restitution: float) -> float:
    """Return the largest number of events in an interval of the ground motion."""
    return _MOST_EVENTS + _MOST_BOUNCES / max(1.0 - restitution, _LEAST_LOSS)


@compiled
def derivatives(c: Polynomial, t: float) -> tuple[float, float, float, float]:
    """Return the value and the first three derivatives of a polynomial at t.

    Estrin's scheme is used because its products depend less on each other than in Horner's, so the
    processor waits half as long.
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
    """Return a polynomial of degree 5 at most about t (repeated synthetic division)."""
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
def root(c: Polynomial, derivative: int, level: float, a: float, b: float, guess: float) -> float:
    """Return the root in (a, b] of the derivative of this order minus level.

    The sign must change between a and b. Newton's method starts from a guess; bisection replaces
    each step that would leave the bracket or converges too slowly.
    """
    end = derivatives(c, b)[derivative] - level
    if end == 0.0:
        return b
    t = guess if a < guess < b else 0.5 * (a + b)
    last = span = b - a
    for _ in range(ROOT_STEPS):
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
    if not b - a <= _ROOT_TOLERANCE * span:
        exceed_bound()
    return t


@compiled
def inflexion(c: Polynomial, h: float, bend_0: float, bend_h: float) -> float:
    """Return where in [0, h] the second derivative changes its sign; h if nowhere.

    The interval is assumed to be so short that the sign changes at most once. `bend_0` has the sign
    of the second derivative just after 0.
    """
    return root(c, 2, 0.0, 0.0, h, NEVER) if bend_0 * bend_h < 0.0 else h


@compiled
def marks(
    c: Polynomial, h: float, slope_0: float, slope_h: float, bend_0: float, middle: float
) -> tuple[float, float, float, float]:
    """Return the ends of the pieces of [0, h] on which a polynomial is monotone.

    An empty piece ends at 0. `slope_0` and `bend_0` have the signs of the first and second
    derivatives just after 0; `middle` is the inflexion, or h.
    """
    slope_middle = slope_h if middle == h else derivatives(c, middle)[1]
    one = 0.0
    two = 0.0
    if slope_0 * slope_middle < 0.0:
        one = root(c, 1, 0.0, 0.0, middle, -slope_0 / bend_0)
    if slope_middle * slope_h < 0.0:
        two = root(c, 1, 0.0, middle, h, NEVER)
    return one, two, h, h


@compiled
def first_rise(a: Polynomial, limit: float, h: float) -> float:
    """Return the first time in [0, h] at which a polynomial exceeds limit and grows.

    If it already exceeds the limit at 0, as round-off allows, it must grow from there.
    """
    before, slope_0, bend_0, _ = derivatives(a, 0.0)
    _, slope_h, bend_h, _ = derivatives(a, h)
    left = 0.0
    middle = inflexion(a, h, bend_0, bend_h)
    for right in marks(a, h, slope_0, slope_h, bend_0, middle):
        if right > left:
            reached = derivatives(a, right)[0]
            if reached > limit and reached > before:
                return left if before > limit else root(a, 0, limit, left, right, NEVER)
            left = right
            before = reached
    return NEVER


#: A switch whose value is known at compile time: on if it is not empty.
Marker: TypeAlias = tuple[()] | tuple[int]
NO: Final = ()
YES: Final = (1,)

#: Highest degree of the ground acceleration that the series of theta can follow.
MAX_GROUND_DEGREE: Final = 5

#: Largest (rate x step) of one Taylor step; longer intervals are divided. The rate is p_hat times
#: the square root of the strongest pull [g] of gravity, ground and ties together: each derivative
#: of theta is about this rate times the one before. The truncation error of the series (degree 9)
#: matters most in the first small bounces after an uplift, because later bounces magnify their
#: relative error. With this limit the error stays below 1e-8 after 50 impacts in rough motions.
MAX_STRIDE: Final = 0.03
#: The same on ground of a degree above 1, as pulses are: with 25 intervals or more in each of its
#: periods, small bounces are few.
MAX_SMOOTH_STRIDE: Final = 0.06
HALF_PI: Final = math.pi / 2.0

# Starts of a step. They differ in which quantities are exactly zero at the first instant.
MOVING: Final = 0  # none, or only the rotation, after an impact
FROM_REST: Final = 1  # rotation and rate: the ground already exceeds the uplift acceleration
FROM_UPLIFT: Final = 2  # rate's derivative too: the ground just reaches the uplift acceleration

# Ends of a step.
ALOFT: Final = 0
LANDED: Final = 1
FALLEN: Final = 2
CHANGED: Final = 3  # a tie has left its branch


@inlined
def series(
    w0: float,
    w1: float,
    s0: float,
    k0: float,
    a: Polynomial,
    v: Polynomial,
    tie: tuple[()] | tuple[float, float, float],
) -> tuple[float, float, float, float, float, float, float]:
    """Return Taylor coefficients w2 to w8 of the rate omega = w0 + w1 t + ..., from eq (26).

    With psi = alpha s - theta: omega, sin(psi) and cos(psi) have the coefficients w, s and k, and
    omega' = -(v sin + a cos), sin' = -cos omega, cos' = sin omega. Here a is p_hat^2 times the
    horizontal ground acceleration [g], and v is p_hat^2 times one plus the vertical one. The sums
    are written out so that all numbers stay in registers. In each sum the newest terms come last,
    so that the processor does not wait for them.
    `tie` is empty, or contains p_hat^2 times the force of the ties at theta = 0, sin(theta/2) and
    cos(theta/2); the last two have the coefficients g and q.
    """
    a0, a1, a2, a3, a4, a5, _, _, _, _ = a
    v0, v1, v2, v3, v4, v5, _, _, _, _ = v
    s1 = -k0 * w0
    k1 = s0 * w0
    x = a1 * k0 + v1 * s0
    if len(tie) > 0:
        f, g0, q0 = tie
        g1 = 0.5 * q0 * w0
        q1 = -0.5 * g0 * w0
        x += f * q1
    w2 = -1.0 / 2.0 * (x + a0 * k1 + v0 * s1)
    s2 = -1.0 / 2.0 * (k0 * w1 + k1 * w0)
    k2 = 1.0 / 2.0 * (s0 * w1 + s1 * w0)
    x = a1 * k1 + v1 * s1
    x += a2 * k0 + v2 * s0
    if len(tie) > 0:
        g2 = 1.0 / 4.0 * (q0 * w1 + q1 * w0)
        q2 = -1.0 / 4.0 * (g0 * w1 + g1 * w0)
        x += f * q2
    w3 = -1.0 / 3.0 * (x + a0 * k2 + v0 * s2)
    s3 = -1.0 / 3.0 * (k1 * w1 + k0 * w2 + k2 * w0)
    k3 = 1.0 / 3.0 * (s1 * w1 + s0 * w2 + s2 * w0)
    x = a1 * k2 + v1 * s2
    x += (a3 * k0 + v3 * s0) + (a2 * k1 + v2 * s1)
    if len(tie) > 0:
        g3 = 1.0 / 6.0 * (q0 * w2 + q1 * w1 + q2 * w0)
        q3 = -1.0 / 6.0 * (g0 * w2 + g1 * w1 + g2 * w0)
        x += f * q3
    w4 = -1.0 / 4.0 * (x + a0 * k3 + v0 * s3)
    s4 = -1.0 / 4.0 * (k1 * w2 + k2 * w1 + k0 * w3 + k3 * w0)
    k4 = 1.0 / 4.0 * (s1 * w2 + s2 * w1 + s0 * w3 + s3 * w0)
    x = a1 * k3 + v1 * s3
    x += (a4 * k0 + v4 * s0) + (a3 * k1 + v3 * s1) + (a2 * k2 + v2 * s2)
    if len(tie) > 0:
        g4 = 1.0 / 8.0 * (q0 * w3 + q1 * w2 + q2 * w1 + q3 * w0)
        q4 = -1.0 / 8.0 * (g0 * w3 + g1 * w2 + g2 * w1 + g3 * w0)
        x += f * q4
    w5 = -1.0 / 5.0 * (x + a0 * k4 + v0 * s4)
    s5 = -1.0 / 5.0 * (k2 * w2 + k1 * w3 + k3 * w1 + k0 * w4 + k4 * w0)
    k5 = 1.0 / 5.0 * (s2 * w2 + s1 * w3 + s3 * w1 + s0 * w4 + s4 * w0)
    x = a1 * k4 + v1 * s4
    x += (a5 * k0 + v5 * s0) + (a4 * k1 + v4 * s1) + (a3 * k2 + v3 * s2) + (a2 * k3 + v2 * s3)
    if len(tie) > 0:
        g5 = 1.0 / 10.0 * (q0 * w4 + q1 * w3 + q2 * w2 + q3 * w1 + q4 * w0)
        q5 = -1.0 / 10.0 * (g0 * w4 + g1 * w3 + g2 * w2 + g3 * w1 + g4 * w0)
        x += f * q5
    w6 = -1.0 / 6.0 * (x + a0 * k5 + v0 * s5)
    s6 = -1.0 / 6.0 * (k2 * w3 + k3 * w2 + k1 * w4 + k4 * w1 + k0 * w5 + k5 * w0)
    k6 = 1.0 / 6.0 * (s2 * w3 + s3 * w2 + s1 * w4 + s4 * w1 + s0 * w5 + s5 * w0)
    x = a1 * k5 + v1 * s5
    x += (a5 * k1 + v5 * s1) + (a4 * k2 + v4 * s2) + (a3 * k3 + v3 * s3) + (a2 * k4 + v2 * s4)
    if len(tie) > 0:
        g6 = 1.0 / 12.0 * (q0 * w5 + q1 * w4 + q2 * w3 + q3 * w2 + q4 * w1 + q5 * w0)
        q6 = -1.0 / 12.0 * (g0 * w5 + g1 * w4 + g2 * w3 + g3 * w2 + g4 * w1 + g5 * w0)
        x += f * q6
    w7 = -1.0 / 7.0 * (x + a0 * k6 + v0 * s6)
    s7 = -1.0 / 7.0 * (k3 * w3 + k2 * w4 + k4 * w2 + k1 * w5 + k5 * w1 + k0 * w6 + k6 * w0)
    k7 = 1.0 / 7.0 * (s3 * w3 + s2 * w4 + s4 * w2 + s1 * w5 + s5 * w1 + s0 * w6 + s6 * w0)
    x = a1 * k6 + v1 * s6
    x += (a5 * k2 + v5 * s2) + (a4 * k3 + v4 * s3) + (a3 * k4 + v3 * s4) + (a2 * k5 + v2 * s5)
    if len(tie) > 0:
        x += f * (
            -1.0 / 14.0 * (g0 * w6 + g1 * w5 + g2 * w4 + g3 * w3 + g4 * w2 + g5 * w1 + g6 * w0)
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
    pull: tuple[()] | tuple[float, float],
) -> Polynomial:
    """Return Taylor coefficients of theta from eq (26) under ground accelerations a and v [g].

    `pull` is empty, or contains k and f_0 of the ties (see `ties`). The term of k is equivalent to
    a rotation of gravity.
    """
    a = (p2 * a[0], p2 * a[1], p2 * a[2], p2 * a[3], p2 * a[4], p2 * a[5], 0.0, 0.0, 0.0, 0.0)
    v = (p2 + p2 * v[0], p2 * v[1], p2 * v[2], p2 * v[3], p2 * v[4], p2 * v[5], 0.0, 0.0, 0.0, 0.0)
    s0 = math.sin(alpha * s - theta)
    k0 = math.sqrt(1.0 - s0 * s0)  # psi is within +-pi/2
    if len(pull) > 0:
        turn = p2 * pull[0]  # sin(theta) = s sin(alpha) cos(psi) - cos(alpha) sin(psi)
        a = (a[0] + turn * s * math.sin(alpha), a[1], a[2], a[3], a[4], a[5], 0.0, 0.0, 0.0, 0.0)
        v = (v[0] - turn * math.cos(alpha), v[1], v[2], v[3], v[4], v[5], 0.0, 0.0, 0.0, 0.0)
        tie = (p2 * s * pull[1], math.sin(0.5 * theta), math.cos(0.5 * theta))
        w1 = -(v[0] * s0 + a[0] * k0 + tie[0] * tie[2])
        if start == FROM_UPLIFT:
            w1 = 0.0  # exactly zero at this instant; round-off must not start the motion
        w2, w3, w4, w5, w6, w7, w8 = series(omega, w1, s0, k0, a, v, tie)
    else:
        w1 = -(v[0] * s0 + a[0] * k0)
        if start == FROM_UPLIFT:
            w1 = 0.0
        w2, w3, w4, w5, w6, w7, w8 = series(omega, w1, s0, k0, a, v, ())
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

    Returns the kind of end, its time within the step, theta and omega then, the largest |theta| and
    its time, and the largest |omega|. The largest |theta| is only reliable if it exceeds
    `peak_so_far`. Theta is monotone between `marks`, so a change of sign there has one root.
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
        # a bounce: theta is concave and lands once, at about twice the time of the peak; where a
        # dissipater has changed its branch at theta = 0, theta decreases and there is no peak
        crest = -c[1] / (2.0 * c[2])
        if s * c[1] * h <= peak_so_far and 0.0 < crest < h and s * derivatives(c, crest)[0] > 0.0:
            t = root(c, 0, 0.0, crest, h, 2.0 * crest)
            omega = derivatives(c, t)[1]
            return LANDED, t, 0.0, omega, 0.0, 0.0, abs(omega)
    peak = 0.0
    peak_time = 0.0
    ended = ALOFT
    t = h
    theta = theta_h
    left = 0.0
    middle = inflexion(c, h, bend_0, bend_h)
    for right in marks(c, h, omega_0, omega_h, bend_0, middle):
        if right <= left:
            continue
        reached = derivatives(c, right)[0]
        if s * reached <= 0.0:
            # a flight from theta = 0 is nearly a parabola: it lands at twice the time of its peak
            guess = 2.0 * left if c[0] == 0.0 else NEVER
            ended, t, theta = LANDED, root(c, 0, 0.0, left, right, guess), 0.0
            break
        if abs(reached) >= HALF_PI:
            ended, t, theta = FALLEN, root(c, 0, s * HALF_PI, left, right, NEVER), s * HALF_PI
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
def _driving(sign: float, a: Polynomial, limit: float, v: Polynomial) -> Polynomial:
    """Return sign a - limit v; the frame uplifts where it exceeds the limit."""
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
def first_exceedance(a: Polynomial, v: Polynomial, limit: float, hold: float, h: float) -> float:
    """Return the first time in [0, h] when |a| exceeds limit (1 + v) + hold and grows."""
    first = NEVER
    for sign in (1.0, -1.0):
        t = first_rise(_driving(sign, a, limit, v), limit + hold, h)
        if t != NEVER and (first == NEVER or t < first):
            first = t
    return first


@compiled
def lift_off(
    a: Polynomial,
    v: Polynomial,
    limit: float,
    hold: float,
    span: float,
    alpha: float,
    p2: float,
    pull: tuple[()] | tuple[float, float],
) -> tuple[float, int]:
    """Return when within the span a frame at rest uplifts (NEVER if not), and how it starts.

    `hold` is what ties add to the uplift acceleration [g]; zero without ties. Where the ground
    exceeds that acceleration by round-off only, the series of theta may start inwards. Such a frame
    would land at once and try again without end. It uplifts only if the ground grows.
    """
    if abs(a[0]) > limit * (1.0 + v[0]) + hold:
        s = -1.0 if a[0] > 0.0 else 1.0
        if s * taylor(0.0, 0.0, s, a, v, alpha, p2, FROM_REST, pull)[2] > 0.0:
            return 0.0, FROM_REST
    wait = first_exceedance(a, v, limit, hold, span)
    return (wait, FROM_UPLIFT) if wait < span else (NEVER, FROM_UPLIFT)
