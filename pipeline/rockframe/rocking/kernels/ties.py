"""Ties across the opening joints: tendons, and dissipaters that yield.

A tie is stretched by x = 2 sin(|theta| / 2) times its lever. It adds the moment f cos(theta / 2)
against the rotation, in units of the moment of gravity at theta = alpha + pi/2. On each branch of
its law, f is linear in x, so the equation of motion keeps its form (re-derived):
theta'' = -p_hat^2 [(1 + a_v/g) sin(alpha s - theta) + (a_h/g) cos(alpha s - theta)
                    + k sin(theta) + s f_0 cos(theta/2)],
where k is the sum of the stiffnesses of the ties, and f_0 the sum of their forces at theta = 0,
extrapolated along their branches. Branches change where |theta| crosses a level or turns. Both are
roots of the polynomial of theta.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled
from rockframe.rocking.kernels.steps import NEVER, Polynomial, first_rise

Float = NDArray[np.float64]
#: Stiffness, force at rest, highest and lowest force, kind. Forces are moments, see above.
Tie: TypeAlias = tuple[float, float, float, float, float]
#: Branch; plastic stretch; |theta| at which the tie leaves the branch upwards and downwards.
TieState: TypeAlias = tuple[float, float, float, float]
#: A tendon and a dissipater.
Pair: TypeAlias = tuple[Tie, Tie]
States: TypeAlias = tuple[TieState, TieState]
Ties: TypeAlias = tuple[()] | Pair

# Kinds.
ELASTIC: Final = 0.0  # never yields; the time of the highest force is logged
CABLE: Final = 1.0  # yields in tension, carries no compression
PLASTIC: Final = 2.0  # yields in tension and compression

# Branches.
_LINEAR: Final = 0.0
_HIGHEST: Final = 1.0
_LOWEST: Final = 2.0

# Slots of the log of each tie.
YIELD_TIME: Final = 0  # first time at its highest or lowest force [s], NaN if never
WORK: Final = 1  # energy dissipated by yielding, as a moment times an angle
PLASTIC_STRETCH: Final = 2  # at the end
REST: Final = 3  # |theta| at which the frame comes to rest [rad], NaN if it overturns
TIE_LOG_SIZE: Final = 4


@compiled
def stretch(theta: float) -> float:
    """Return the stretch of a tie over its lever [1]."""
    return 2.0 * math.sin(0.5 * abs(theta))


@compiled
def _level(x: float) -> float:
    """Return the |theta| of a stretch: infinite if above pi/2, NEVER unless it is positive.

    |theta| cannot fall below zero: the frame lands there. Round-off must not change a branch first.
    """
    if x <= 0.0:
        return NEVER
    return 2.0 * math.asin(0.5 * x) if x < math.sqrt(2.0) else math.inf


@compiled
def _linear(tie: Tie, plastic: float) -> TieState:
    """Return the linear branch about a plastic stretch."""
    stiffness, force, highest, lowest, _ = tie
    upper = _level(plastic + (highest - force) / stiffness) if highest < math.inf else math.inf
    lower = _level(plastic + (lowest - force) / stiffness) if lowest > -math.inf else NEVER
    return _LINEAR, plastic, upper, lower


@compiled
def begun(tie: Tie, theta: float) -> TieState:
    """Start a tie at theta: without plastic stretch, or with the stretch needed to reach theta."""
    stiffness, force, highest, _, kind = tie
    if stiffness == 0.0:
        return _LINEAR, 0.0, math.inf, NEVER
    plastic = stretch(theta) - (highest - force) / stiffness
    if plastic < 0.0 or kind == ELASTIC:
        return _linear(tie, 0.0)
    _, _, _, lower = _linear(tie, plastic)
    return _LINEAR, plastic, abs(theta), lower


@compiled
def _held(tie: Tie, state: TieState) -> tuple[float, float]:
    """Return the contribution of a tie to k and f_0 on its branch."""
    if state[0] == _HIGHEST:
        return 0.0, tie[2]
    if state[0] == _LOWEST:
        return 0.0, tie[3]
    return tie[0], tie[1] - tie[0] * state[1]


@compiled
def force_at(tie: Tie, state: TieState, theta: float) -> float:
    """Return the force of a tie, as a moment in units of that of gravity."""
    stiffness, force = _held(tie, state)
    return force + stiffness * stretch(theta)


@compiled
def _times(c: Polynomial, factor: float) -> Polynomial:
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = c
    return (
        *(factor * c0, factor * c1, factor * c2, factor * c3, factor * c4),
        *(factor * c5, factor * c6, factor * c7, factor * c8, factor * c9),
    )


@compiled
def _rate(c: Polynomial, factor: float) -> Polynomial:
    """Coefficients of the derivative times a factor."""
    _, c1, c2, c3, c4, c5, c6, c7, c8, c9 = c
    return (
        *(factor * c1, factor * 2.0 * c2, factor * 3.0 * c3, factor * 4.0 * c4, factor * 5.0 * c5),
        *(factor * 6.0 * c6, factor * 7.0 * c7, factor * 8.0 * c8, factor * 9.0 * c9, 0.0),
    )


@compiled
def _leaves(tie: Tie, state: TieState, c: Polynomial, s: float, h: float) -> tuple[float, float]:
    """Return when within h a tie leaves its branch, and |theta| then.

    Both are NEVER if it does not. Only |theta| is NEVER where the rotation turns.
    """
    branch, _, upper, lower = state
    if branch == _HIGHEST:
        return first_rise(_rate(c, -s), 0.0, h), NEVER
    if branch == _LOWEST and tie[4] == PLASTIC:
        return first_rise(_rate(c, s), 0.0, h), NEVER
    up = first_rise(_times(c, s), upper, h) if upper < math.inf else NEVER
    down = first_rise(_times(c, -s), -lower, h) if lower > NEVER else NEVER
    if down != NEVER and (up == NEVER or down < up):
        return down, lower
    return up, upper


@compiled
def _left(tie: Tie, state: TieState, theta: float) -> tuple[TieState, float]:
    """Return the next branch of a tie at theta, and the energy dissipated on the last one."""
    stiffness, force, highest, lowest, kind = tie
    branch, plastic, upper, lower = state
    if branch == _LINEAR:
        if abs(theta) < upper:  # a cable is slack until |theta| exceeds `lower` again
            return (_LOWEST, plastic, lower if kind == CABLE else math.inf, NEVER), 0.0
        if kind == ELASTIC:
            return (_LINEAR, plastic, math.inf, lower), 0.0
        return (_HIGHEST, plastic, math.inf, NEVER), 0.0
    if branch == _LOWEST and kind == CABLE:
        return _linear(tie, plastic), 0.0
    limit = highest if branch == _HIGHEST else lowest
    now = stretch(theta) - (limit - force) / stiffness
    _, _, upper, lower = _linear(tie, now)
    if branch == _HIGHEST:
        return (_LINEAR, now, abs(theta), lower), limit * (now - plastic)
    lower = abs(theta) if theta != 0.0 else NEVER
    return (_LINEAR, now, upper, lower), limit * (now - plastic)


@compiled
def _closed(tie: Tie, state: TieState) -> tuple[TieState, float]:
    """Return state and dissipated energy of a tie when its joint opens on the other side."""
    if state[0] == _LOWEST and tie[4] == PLASTIC:
        return _left(tie, state, 0.0)
    return state, 0.0


@compiled
def both_held(ties: Pair, states: States) -> tuple[float, float]:
    """Return k and f_0 of both ties together."""
    k_0, f_0 = _held(ties[0], states[0])
    k_1, f_1 = _held(ties[1], states[1])
    return k_0 + k_1, f_0 + f_1


@compiled
def elastic_moment(ties: Pair, states: States, theta: float) -> float:
    """Return the moment of both ties at a rotation that they reach without yielding."""
    total = 0.0
    for k in range(2):
        stiffness, force, _, lowest, _ = ties[k]
        total += max(lowest, force + stiffness * (stretch(theta) - states[k][1]))
    return total * math.cos(0.5 * theta)


@compiled
def uplift_hold(alpha: float, ties: Pair, states: States) -> float:
    """Return what both ties add to the ground acceleration that uplifts the frame [g]."""
    return both_held(ties, states)[1] / math.cos(alpha)


@compiled
def next_change(
    ties: Pair, states: States, c: Polynomial, s: float, h: float
) -> tuple[int, float, float]:
    """Return which tie first leaves its branch within h (-1 if none), when, and |theta| then."""
    when, level = _leaves(ties[0], states[0], c, s, h)
    when_1, level_1 = _leaves(ties[1], states[1], c, s, h)
    if when_1 != NEVER and (when == NEVER or when_1 < when):
        return 1, when_1, level_1
    return (0 if when != NEVER else -1), when, level


@compiled
def changed(
    theta: float,
    omega: float,
    s: float,
    level: float,
    which: int,
    ties: Pair,
    states: States,
    tie_log: Float,
    time: float,
) -> tuple[float, float, States]:
    """Move a tie to its next branch, exactly at its level or where the rotation turns."""
    if level == NEVER:
        omega = 0.0
    else:
        theta = s * level
        yields = ties[which][4] == PLASTIC or level == states[which][2]
        if yields and states[which][0] == _LINEAR and math.isnan(tie_log[which, YIELD_TIME]):
            tie_log[which, YIELD_TIME] = time
    if which == 0:
        state, work = _left(ties[0], states[0], theta)
        states = (state, states[1])
    else:
        state, work = _left(ties[1], states[1], theta)
        states = (states[0], state)
    tie_log[which, WORK] += work
    return theta, omega, states


@compiled
def landed(ties: Pair, states: States, tie_log: Float) -> States:
    """Return the states of the ties after an impact."""
    one, work_0 = _closed(ties[0], states[0])
    two, work_1 = _closed(ties[1], states[1])
    tie_log[0, WORK] += work_0
    tie_log[1, WORK] += work_1
    return one, two
