"""The rocking kernel: eq (26) with eq (43) at each impact, integrated to round-off.

With vertical ground acceleration a_v eq (26) becomes (re-derived: gravity is g + a_v)
theta'' = -p_hat^2 [(1 + a_v/g) sin(alpha s - theta) + (a_h/g) cos(alpha s - theta)].

The functions take and return plain arrays and check nothing; `rockframe.rocking.response` checks
the input. Read this kernel first: it is the reference for the vectorised kernel in `lanes`, which
calls its functions in rare cases.

Symbols are those of the paper: theta [rad], omega its rate [rad s-1], s = sgn(theta), 0 at rest;
alpha the slenderness [rad], p_hat the frequency parameter [rad s-1].

`steps` has one Taylor step, `tails` the motion after the record's end, `ties` tendons and
dissipaters. Private functions are compiled into their callers: counting references to the arrays
that they take would cost more time than they need.
"""

from __future__ import annotations

import math
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels import NO_UPLIFT, OVERTURNS, STANDS
from rockframe.rocking.kernels.steps import (
    ALOFT,
    CHANGED,
    FALLEN,
    LANDED,
    MAX_SMOOTH_STRIDE,
    MAX_STRIDE,
    MOVING,
    NEVER,
    Marker,
    Polynomial,
    derivatives,
    exceed_bound,
    flight,
    lift_off,
    most_events,
    shift,
    taylor,
)
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO, tail, tied_tail, touches
from rockframe.rocking.kernels.ties import (
    ELASTIC,
    REST,
    TIE_LOG_SIZE,
    YIELD_TIME,
    States,
    Ties,
    begun,
    both_held,
    changed,
    force_at,
    landed,
    next_change,
    uplift_hold,
)

Float = NDArray[np.float64]
#: Rotation, its rate, the side s, and what ties add to the uplift acceleration [g].
State: TypeAlias = tuple[float, float, float, float]

# Slots of the summary array.
PEAK: Final = 0  # largest |theta| [rad]
PEAK_TIME: Final = 1  # when [s]; NaN if after the end of the motion
UPLIFT_TIME: Final = 2  # first uplift [s], NaN if none
OVERTURNING_TIME: Final = 3  # |theta| = pi/2 [s], NaN if never
IMPACTS: Final = 4  # number of impacts
PEAK_VELOCITY: Final = 5  # largest |omega| [rad s-1]
IMPACT_VELOCITY: Final = 6  # largest |omega| just before an impact [rad s-1], 0 if none
# Demands at the samples of the motion while the frame rocks; only the vectorised kernel fills them.
BASE_SHEAR: Final = 7  # largest force of the ground over the weight of columns and beam [1]
FRICTION: Final = 8  # largest coefficient of friction that the base joints need [1]
TOP_MOST: Final = 9  # largest force on the beam towards the lifted side, over the vertical force
TOP_LEAST: Final = 10  # under the beam, and the least [1]; infinite if it rocks at no sample
PRESS: Final = 11  # smallest vertical force at the base over that of the weight alone [1]
PRESS_TOP: Final = 12  # the same under the beam [1]
RESTED: Final = 13  # largest |horizontal acceleration| at which it rests [g]; -1 if it never does
LIFTING: Final = 14  # |shear| over vertical force under the beam if it uplifts at a sample [1]
SUMMARY_SIZE: Final = 15


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
    coefficients = rows.shape[1]
    return (
        scale * rows[i, 0],
        scale * rows[i, 1] if coefficients > 1 else 0.0,
        scale * rows[i, 2] if coefficients > 2 else 0.0,
        scale * rows[i, 3] if coefficients > 3 else 0.0,
        scale * rows[i, 4] if coefficients > 4 else 0.0,
        scale * rows[i, 5] if coefficients > 5 else 0.0,
        0.0,
        0.0,
        0.0,
        0.0,
    )


@inlined
def _begin(
    alpha: float, ties: Ties, theta: float, pull: float, tie_log: Float
) -> tuple[float, float, States]:
    """Return the strongest pull with the ties, what they add to uplift [g], and their states."""
    if len(ties) > 0:
        for j in range(2):
            pull += ties[j][0] + ties[j][1] + (ties[j][2] if ties[j][4] != ELASTIC else 0.0)
            for k in range(TIE_LOG_SIZE):
                tie_log[j, k] = 0.0
            tie_log[j, YIELD_TIME] = math.nan
            tie_log[j, REST] = math.nan
        states = (begun(ties[0], theta), begun(ties[1], theta))
        return pull, uplift_hold(alpha, ties, states), states
    return pull, 0.0, ()  # type: ignore[return-value]  # the kernels take it as no ties


@inlined
def _keep_node(
    node: int,
    theta: float,
    omega: float,
    ties: Ties,
    states: States,
    histories: tuple[Float, Float, Float],
) -> None:
    """Store the state at a node, unless the arrays of histories are empty."""
    thetas, omegas, forces = histories
    if thetas.shape[0] > 0:
        thetas[node] = theta
        omegas[node] = omega
        if len(ties) > 0:
            for j in range(2):
                forces[node, j] = force_at(ties[j], states[j], theta)


@inlined
def _note_peaks(summary: Float, high: float, time: float, fast: float) -> None:
    summary[PEAK_VELOCITY] = max(summary[PEAK_VELOCITY], fast)
    if high > summary[PEAK]:
        summary[PEAK] = high
        summary[PEAK_TIME] = time


@inlined
def _note_impact(summary: Float, impacts: Float, time: float, omega: float) -> None:
    count = int(summary[IMPACTS])
    if count < impacts.shape[0]:
        impacts[count, 0] = time
        impacts[count, 1] = omega
    summary[IMPACTS] = count + 1
    summary[IMPACT_VELOCITY] = max(summary[IMPACT_VELOCITY], abs(omega))


@inlined
def _forget_touch(summary: Float) -> None:
    """Remove an uplift by round-off from the summary, unless the frame has rocked before."""
    if summary[IMPACTS] == 0.0:
        summary[PEAK] = summary[PEAK_VELOCITY] = summary[IMPACT_VELOCITY] = 0.0
        summary[PEAK_TIME] = summary[UPLIFT_TIME] = math.nan


@inlined
def _step(
    c: Polynomial,
    start: int,
    time: float,
    span: float,
    s: float,
    ties: Ties,
    states: States,
    summary: Float,
    tie_log: Float,
) -> tuple[int, float, float, float, States]:
    """Follow theta, a polynomial from a time on, to its first event within a span.

    Returns the kind of event, its time within the span, theta and omega then, and the states of the
    ties.
    """
    ended, t, theta, omega, high, high_time, fast = flight(c, s, span, start, summary[PEAK])
    if len(ties) > 0:
        which, when, level = next_change(ties, states, c, s, t)
        if which >= 0:
            ended, t, theta, omega, high, high_time, fast = flight(c, s, when, start, summary[PEAK])
            ended = CHANGED
            theta, omega, states = changed(
                theta, omega, s, level, which, ties, states, tie_log, time + t
            )
    _note_peaks(summary, high, time + high_time, fast)
    return ended, t, theta, omega, states


@inlined
def _follow(  # noqa: C901  one loop, event by event
    a: Polynomial,
    v: Polynomial,
    lifts: bool,
    time: float,
    span: tuple[float, float],
    frame: tuple[float, float, float],
    state: State,
    ties: Ties,
    states: States,
    impacts: Float,
    summary: Float,
    tie_log: Float,
) -> tuple[State, States]:
    """Follow the frame through a part of an interval, or until it overturns.

    `a` and `v` are the ground accelerations [g] in powers of the time since `time`; the part begins
    and ends at the times `span` after it.
    """
    alpha, p_hat, restitution = frame
    theta, omega, s, hold = state
    limit = math.tan(alpha)
    elapsed, end = span
    start = MOVING
    events = 0
    most = most_events(restitution)
    while elapsed < end:
        events += 1
        if events > most:
            exceed_bound()
        now = shift(a, elapsed) if elapsed > 0.0 else a
        lift = shift(v, elapsed) if lifts and elapsed > 0.0 else v
        held = both_held(ties, states) if len(ties) > 0 else ()
        if s == 0.0:
            span_left = end - elapsed
            wait, start = lift_off(now, lift, limit, hold, span_left, alpha, p_hat * p_hat, held)
            if wait == NEVER:
                break
            if wait > 0.0:
                elapsed += wait
                now = shift(a, elapsed)
                lift = shift(v, elapsed) if lifts else v
            s = -1.0 if now[0] > 0.0 else 1.0
            if math.isnan(summary[UPLIFT_TIME]):
                summary[UPLIFT_TIME] = time + elapsed
        c = taylor(theta, omega, s, now, lift, alpha, p_hat * p_hat, start, held)
        ended, t, theta, omega, states = _step(
            c, start, time + elapsed, end - elapsed, s, ties, states, summary, tie_log
        )
        elapsed += t
        start = MOVING
        if ended == ALOFT:
            break
        if ended == FALLEN:
            summary[OVERTURNING_TIME] = time + elapsed
            break
        if ended == LANDED:
            if touches(theta, omega, p_hat):
                _forget_touch(summary)
                omega = s = 0.0
            else:
                _note_impact(summary, impacts, time + elapsed, omega)
                omega *= restitution
                s = -s
        if len(ties) > 0:
            if ended == LANDED:
                states = landed(ties, states, tie_log)
            hold = uplift_hold(alpha, ties, states)
        if ended == LANDED and s != 0.0 and abs(omega) < REST_VELOCITY_RATIO * p_hat:
            needed = limit * (1.0 + derivatives(v, elapsed)[0]) + hold
            if omega == 0.0 or abs(derivatives(a, elapsed)[0]) <= needed:
                omega = s = 0.0
    return (theta, omega, s, hold), states


@inlined
def _finish(
    time: float,
    step: float,
    frame: tuple[float, float, float],
    state: State,
    ties: Ties,
    states: States,
    impacts: Float,
    summary: Float,
    tie_log: Float,
) -> bool:
    """Follow the frame over still ground from a time on; return True if it overturns.

    The energy decides. A frame that balances on the barrier overturns at no time.
    """
    alpha, p_hat, restitution = frame
    theta, omega, s, _ = state
    if s != 0.0 and touches(theta, omega, p_hat):
        _forget_touch(summary)
        s = 0.0
    if len(ties) > 0:
        overturns, after, high, fast, landing_time, landing = tied_tail(
            theta, omega, s, alpha, p_hat, restitution, ties, states, step, tie_log, time
        )
    else:
        overturns, after, high, fast, landing_time, landing = tail(
            theta, omega, s, alpha, p_hat, restitution
        )
    if not math.isnan(landing_time):
        _note_impact(summary, impacts, time + landing_time, landing)
    summary[IMPACT_VELOCITY] = max(summary[IMPACT_VELOCITY], abs(landing))
    _note_peaks(summary, high, math.nan, fast)
    if overturns:
        summary[OVERTURNING_TIME] = summary[PEAK_TIME] = time + after
    return bool(overturns)


@compiled
def integrate(
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
    ties: Ties,
    forces: Float,
    tie_log: Float,
) -> int:
    """Integrate eq (26) with eq (43) over a ground motion, and return the verdict.

    Parameters
    ----------
    ground : array, shape (intervals, degree + 1)
        Horizontal ground acceleration [g] as a polynomial, of degree 5 at most, in the time since
        each interval's start [s].
    vertical : array, shape (intervals, degree + 1) or (0, degree + 1)
        Vertical ground acceleration [g] in the same form, above -1 g; no rows if there is none.
    time_step, start_time : float
        Length of an interval, time of the first node [s].
    scale : float
        Factor of the ground accelerations [1].
    alpha, p_hat, restitution : float
        Slenderness [rad], frequency parameter [rad s-1], velocity ratio of an impact, sqrt(r).
    theta_0, omega_0 : float
        Rotation [rad] and its rate [rad s-1] at the start.
    thetas, omegas : array, shape (intervals + 1,) or (0,)
        Filled with the state at the nodes unless they are empty; NaN after overturning.
    impacts : array, shape (kept, 2)
        Filled with the times of the first impacts [s] and the rates just before them [rad s-1].
    summary : array, shape (SUMMARY_SIZE,)
        Filled with the values of the named slots above.
    ties : tuple
        Empty, or two ties.
    forces : array, shape (intervals + 1, ties) or (0, ties)
        Filled with the forces of the ties at the nodes unless it is empty.
    tie_log : array, shape (ties, TIE_LOG_SIZE)
        Filled with the values of the slots named in `ties`.

    Returns
    -------
    int
        NO_UPLIFT, STANDS or OVERTURNS.
    """
    intervals = ground.shape[0]
    lifts = vertical.shape[0] > 0
    frame = (alpha, p_hat, restitution)
    histories = (thetas, omegas, forces)
    strongest = 0.0
    for i in range(intervals):
        strongest = max(strongest, _bound(ground, vertical, i, time_step, 1.0))
    pull, hold, states = _begin(alpha, ties, theta_0, 1.0 + strongest * abs(scale), tie_log)
    rate = p_hat * math.sqrt(pull)
    stride = MAX_SMOOTH_STRIDE if ground.shape[1] > 2 else MAX_STRIDE
    pieces = max(1, math.ceil(rate * time_step / stride))
    h = time_step / pieces
    s = np.sign(theta_0) if theta_0 != 0.0 else np.sign(omega_0)
    summary[:] = 0.0
    summary[PEAK], summary[PEAK_VELOCITY] = abs(theta_0), abs(omega_0)
    summary[PEAK_TIME] = summary[UPLIFT_TIME] = start_time if s != 0.0 else math.nan
    summary[OVERTURNING_TIME] = math.nan
    state = (theta_0, omega_0, s, hold)
    _keep_node(0, theta_0, omega_0, ties, states, histories)
    v = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    limit = math.tan(alpha)
    for i in range(intervals):
        bound = abs(scale) * _bound(ground, vertical, i, time_step, limit) if s == 0.0 else 0.0
        if s != 0.0 or bound > limit + hold:
            a = _polynomial(ground, i, scale)
            if lifts:
                v = _polynomial(vertical, i, scale)
            for k in range(pieces):
                state, states = _follow(
                    a,
                    v,
                    lifts,
                    start_time + i * time_step,
                    (k * h, k * h + h),
                    frame,
                    state,
                    ties,
                    states,
                    impacts,
                    summary,
                    tie_log,
                )
                if not math.isnan(summary[OVERTURNING_TIME]):
                    thetas[i + 1 :] = math.nan
                    omegas[i + 1 :] = math.nan
                    forces[i + 1 :] = math.nan
                    return OVERTURNS
        _, _, s, hold = state
        _keep_node(i + 1, state[0], state[1], ties, states, histories)
    end_time = start_time + intervals * time_step
    step = MAX_STRIDE / rate
    if _finish(end_time, step, frame, state, ties, states, impacts, summary, tie_log):
        return OVERTURNS
    return NO_UPLIFT if math.isnan(summary[UPLIFT_TIME]) else STANDS


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
    tied: Marker,
    ties: Float,
) -> None:
    """Integrate scenarios of one ground motion, each with its scale and frame, from rest.

    Parameters
    ----------
    ground, vertical, time_step, start_time
        As for `integrate`.
    scale, alpha, p_hat, restitution : array, shape (scenarios,)
        As for `integrate`, of each scenario.
    verdicts : array of int8, shape (scenarios,)
        Filled with the outcomes.
    summaries : array, shape (scenarios, SUMMARY_SIZE)
        Filled with the values of the named slots above.
    tied : NO or YES
        YES if there are ties.
    ties : array, shape (scenarios, 10) or (0, 10)
        The pair of ties of each scenario.
    """
    none = np.empty(0)
    no_impacts = np.empty((0, 2))
    tie_log = np.empty((2, TIE_LOG_SIZE))
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
            no_impacts,
            summaries[k],
            _pair(tied, ties, k),
            no_impacts,
            tie_log,
        )


@inlined
def _pair(tied: Marker, ties: Float, k: int) -> Ties:
    """Return the ties of a scenario."""
    if len(tied) > 0:
        t = ties[k]
        return (t[0], t[1], t[2], t[3], t[4]), (t[5], t[6], t[7], t[8], t[9])
    return ()
