"""The rocking kernel: eq (26) with eq (43) at each impact, integrated to round-off.

With vertical ground acceleration a_v eq (26) becomes (re-derived: gravity is g + a_v)
theta'' = -p_hat^2 [(1 + a_v/g) sin(alpha s - theta) + (a_h/g) cos(alpha s - theta)].

The functions take and return plain arrays and check nothing; `rockframe.rocking.response` checks
the input. Read this kernel first: it is the reference for the vectorised kernel in `lanes`, which
calls its functions in rare cases.

Symbols are those of the paper: theta [rad], omega its rate [rad s-1], s = sgn(theta), 0 at rest;
alpha the slenderness [rad], p_hat the frequency parameter [rad s-1].

`steps` has one Taylor step, `tails` the motion after the record's end, `ties` tendons and
dissipaters. The longest function is one loop, because passing arrays to more functions costs time.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking.kernels.compiled import compiled
from rockframe.rocking.kernels.polynomials import NEVER, derivatives, shift
from rockframe.rocking.kernels.steps import (
    ALOFT,
    CHANGED,
    FALLEN,
    MAX_SMOOTH_STRIDE,
    MAX_STRIDE,
    MOVING,
    Marker,
    flight,
    lift_off,
    taylor,
)
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO, tail, tied_tail
from rockframe.rocking.kernels.ties import (
    ELASTIC,
    REST,
    TIE_LOG_SIZE,
    YIELD_TIME,
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

# Outcomes, the values of the flag variable `verdict`.
NO_UPLIFT: Final = 0
SAFE: Final = 1
OVERTURNED: Final = 2

# Slots of the summary array.
PEAK: Final = 0  # largest |theta| [rad]
PEAK_TIME: Final = 1  # when [s]; NaN if after the end of the motion
UPLIFT_TIME: Final = 2  # first uplift [s], NaN if none
OVERTURNING_TIME: Final = 3  # |theta| = pi/2 [s], NaN if never
IMPACTS: Final = 4  # number of impacts
PEAK_VELOCITY: Final = 5  # largest |omega| [rad s-1]
IMPACT_VELOCITY: Final = 6  # largest |omega| just before an impact [rad s-1], 0 if none
SUMMARY_SIZE: Final = 7


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
    most = 1.0 + strongest  # upper bound of the pull [g]
    hold = 0.0
    if len(ties) > 0:
        states = (begun(ties[0], theta_0), begun(ties[1], theta_0))
        for j in range(2):
            most += ties[j][0] + abs(ties[j][1]) + (ties[j][2] if ties[j][4] != ELASTIC else 0.0)
            for k in range(TIE_LOG_SIZE):
                tie_log[j, k] = 0.0
            tie_log[j, YIELD_TIME] = math.nan
            tie_log[j, REST] = math.nan
        hold = uplift_hold(alpha, ties, states)
    rate = p_hat * math.sqrt(most)
    stride = MAX_SMOOTH_STRIDE if ground.shape[1] > 2 else MAX_STRIDE
    pieces = max(1, math.ceil(rate * time_step / stride))
    h = time_step / pieces

    theta = theta_0
    omega = omega_0
    s = np.sign(theta) if theta != 0.0 else np.sign(omega)
    peak = abs(theta)
    peak_time = start_time if s != 0.0 else math.nan
    uplift_time = start_time if s != 0.0 else math.nan
    overturning_time = math.nan
    fastest = abs(omega)
    hardest = 0.0
    count = 0
    if keeps:
        thetas[0] = theta
        omegas[0] = omega
        if len(ties) > 0:
            for j in range(2):
                forces[0, j] = force_at(ties[j], states[j], theta)
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
            if abs(scale) * largest <= limit + hold:
                if keeps:
                    thetas[i + 1] = 0.0
                    omegas[i + 1] = 0.0
                    if len(ties) > 0:
                        for j in range(2):
                            forces[i + 1, j] = force_at(ties[j], states[j], 0.0)
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
                    wait, start = lift_off(now, lift, limit, hold, end - elapsed)
                    if wait == NEVER:
                        break
                    if wait > 0.0:
                        elapsed += wait
                        now = shift(a, elapsed)
                        lift = shift(v, elapsed) if lifts else v
                    s = -1.0 if now[0] > 0.0 else 1.0
                    if math.isnan(uplift_time):
                        uplift_time = time + elapsed
                if len(ties) > 0:
                    held = both_held(ties, states)
                    c = taylor(theta, omega, s, now, lift, alpha, p2, start, held)
                else:
                    c = taylor(theta, omega, s, now, lift, alpha, p2, start, ())
                ended, t, theta, omega, high, high_time, fast = flight(
                    c, s, end - elapsed, start, peak
                )
                if len(ties) > 0:
                    which, when, level = next_change(ties, states, c, s, t)
                    if which >= 0:
                        ended, t, theta, omega, high, high_time, fast = flight(
                            c, s, when, start, peak
                        )
                        ended = CHANGED
                        theta, omega, states = changed(
                            theta,
                            omega,
                            s,
                            level,
                            which,
                            ties,
                            states,
                            tie_log,
                            time + elapsed + t,
                        )
                        hold = uplift_hold(alpha, ties, states)
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
                if ended == CHANGED:
                    continue
                if len(ties) > 0:
                    states = landed(ties, states, tie_log)
                    hold = uplift_hold(alpha, ties, states)
                if count < impacts.shape[0]:
                    impacts[count, 0] = time + elapsed
                    impacts[count, 1] = omega
                count += 1
                hardest = max(hardest, abs(omega))
                omega *= restitution
                s = -s
                if abs(omega) < REST_VELOCITY_RATIO * p_hat:
                    needed = limit * (1.0 + derivatives(v, elapsed)[0]) + hold
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
                    if len(ties) > 0:
                        for k in range(2):
                            forces[j, k] = math.nan
            break
        if keeps:
            thetas[i + 1] = theta
            omegas[i + 1] = omega
            if len(ties) > 0:
                for j in range(2):
                    forces[i + 1, j] = force_at(ties[j], states[j], theta)

    verdict = NO_UPLIFT if math.isnan(uplift_time) else SAFE
    if not math.isnan(overturning_time):
        verdict = OVERTURNED
    else:  # the ground is still: the energy decides
        end_time = start_time + intervals * time_step
        if len(ties) > 0:
            overturns, after, high, fast, landing_time, landing = tied_tail(
                theta,
                omega,
                s,
                alpha,
                p_hat,
                restitution,
                ties,
                states,
                MAX_STRIDE / rate,
                tie_log,
                end_time,
            )
        else:
            overturns, after, high, fast, landing_time, landing = tail(
                theta, omega, s, alpha, p_hat, restitution
            )
        fastest = max(fastest, fast)
        hardest = max(hardest, abs(landing))
        if not math.isnan(landing_time):
            if count < impacts.shape[0]:
                impacts[count, 0] = end_time + landing_time
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
    summary[IMPACT_VELOCITY] = hardest
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
    no_log = np.empty((0, 2))
    tie_log = np.empty((2, TIE_LOG_SIZE))
    for k in range(scale.size):
        if len(tied) > 0:
            t = ties[k]
            pair = ((t[0], t[1], t[2], t[3], t[4]), (t[5], t[6], t[7], t[8], t[9]))
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
                pair,
                no_log,
                tie_log,
            )
        else:
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
                (),
                no_log,
                no_log,
            )
