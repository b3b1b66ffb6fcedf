"""Polynomials of degree 9: values, derivatives, and roots to round-off in a short interval."""

from __future__ import annotations

from typing import Final, TypeAlias

from rockframe.compiled import compiled, inlined

#: Coefficients of a polynomial of degree 9, the constant term first.
Polynomial: TypeAlias = tuple[float, float, float, float, float, float, float, float, float, float]

#: Returned instead of a time if there is no root.
NEVER: Final = -1.0
#: Newton's method stops at this relative step; the error is about its square, which is round-off.
_ROOT_TOLERANCE: Final = 1e-13


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
    """Return the first time in [0, h] at which a polynomial exceeds limit; at 0 it must not."""
    _, slope_0, bend_0, _ = derivatives(a, 0.0)
    _, slope_h, bend_h, _ = derivatives(a, h)
    left = 0.0
    middle = inflexion(a, h, bend_0, bend_h)
    for right in marks(a, h, slope_0, slope_h, bend_0, middle):
        if right > left:
            if derivatives(a, right)[0] > limit:
                return root(a, 0, limit, left, right, NEVER)
            left = right
    return NEVER
