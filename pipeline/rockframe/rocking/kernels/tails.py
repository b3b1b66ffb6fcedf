"""Motion after the ground has come to rest, and distances of excursions from the separatrix."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels.steps import (
    ALOFT,
    CHANGED,
    FALLEN,
    HALF_PI,
    LANDED,
    MAX_SMOOTH_STRIDE,
    MAX_STRIDE,
    MOVING,
    ROOT_STEPS,
    exceed_bound,
    flight,
    most_events,
    taylor,
)
from rockframe.rocking.kernels.ties import (
    ELASTIC,
    PLASTIC,
    PLASTIC_STRETCH,
    REST,
    Pair,
    States,
    begun,
    both_held,
    changed,
    elastic_moment,
    landed,
    next_change,
    uplift_hold,
)

Float = NDArray[np.float64]

# Slots of an excursion.
START: Final = 0  # when it begins [s]
SIDE: Final = 1  # +1 or -1
DISTANCE: Final = 2  # D [1], minus infinity where there are fewer excursions than slots
EXCURSION_SIZE: Final = 3

#: Excursions that begin further below the separatrix are not kept.
LEAST_DISTANCE: Final = -0.5


@inlined
def keep(excursions: Float, who: int, start: float, side: float, distance: float) -> None:
    """Store an excursion in the place of the scenario's lowest one, if its distance is larger."""
    if distance > LEAST_DISTANCE:
        least = 0
        for k in range(1, excursions.shape[1]):
            if excursions[who, k, DISTANCE] < excursions[who, least, DISTANCE]:
                least = k
        if distance > excursions[who, least, DISTANCE]:
            excursions[who, least, START] = start
            excursions[who, least, SIDE] = side
            excursions[who, least, DISTANCE] = distance


@compiled
def fill_ahead(ground: Float, powers: int, rate: float, ahead: Float) -> None:
    """Compute I(t) [1] at the nodes of a ground motion, from its end backwards.

    Parameters
    ----------
    ground : array, shape (intervals, components * powers)
        Coefficients of the acceleration [g] in powers of the time over the interval's length: the
        horizontal component, then the vertical one if there is one.
    powers : int
        Number of powers.
    rate : float
        p_hat times the length of an interval.
    ahead : array, shape (intervals + 1, components)
        Filled with I of the components.
    """
    moments = np.empty(powers)  # rate times the integral of x^j exp(-rate x) over an interval
    for j in range(powers):
        term = rate
        moments[j] = term / (j + 1)
        for k in range(1, 20):
            term *= -rate / k
            moments[j] += term / (j + k + 1)
    decay = math.exp(-rate)
    for c in range(ahead.shape[1]):
        after = 0.0
        ahead[ground.shape[0], c] = 0.0
        for i in range(ground.shape[0] - 1, -1, -1):
            within = 0.0
            for j in range(powers):
                within += moments[j] * ground[i, c * powers + j]
            after = decay * after + within
            ahead[i, c] = after


@compiled
def match_excursions(
    excursions: Float, window: float, tolerance: float, alone: Float, paired: Float
) -> None:
    """Search for the counterparts of each response's excursions in the next response.

    Parameters
    ----------
    excursions : array, shape (responses, kept, EXCURSION_SIZE)
        Excursions of neighbouring responses, the largest distance first.
    window, tolerance : float
        Counterparts are on the same side; their starts differ by less than `window` [s], their
        distances by less than `tolerance` [1].
    alone : array, shape (responses - 1,)
        Filled with the largest distance among the excursions without a counterpart in the other
        response of the pair.
    paired : array, shape (responses - 1,)
        Filled with the largest sum of two numbers: an excursion's distance, and the difference
        between it and its counterpart's.
    """
    for i in range(excursions.shape[0] - 1):
        alone[i] = -math.inf
        paired[i] = -math.inf
        for turn in range(2):
            own, other = excursions[i + turn], excursions[i + 1 - turn]
            for k in range(own.shape[0]):
                distance = own[k, DISTANCE]
                if distance == -math.inf:
                    break
                nearest = math.inf
                for j in range(other.shape[0]):
                    if other[j, DISTANCE] <= distance - tolerance:
                        break
                    if (
                        other[j, SIDE] == own[k, SIDE]
                        and abs(other[j, START] - own[k, START]) < window
                    ):
                        apart = abs(other[j, DISTANCE] - distance)
                        if apart < tolerance:
                            nearest = min(nearest, apart)
                if nearest == math.inf:
                    alone[i] = max(alone[i], distance)
                else:
                    paired[i] = max(paired[i], distance + nearest)


#: The frame is at rest after an impact slower than this times p_hat, if the ground is too weak to
#: uplift it. The rates of impacts form a geometric series, so their number depends on this value.
REST_VELOCITY_RATIO: Final = 1e-10
#: Largest rotation [rad], and rate over p_hat [1], of a frame that the ground does not uplift.
_TOUCH: Final = 1e-20
#: The ties are elastic if no plastic stretch changes by more than this from turn to turn [rad].
_SETTLED: Final = 1e-12
#: Largest number of steps. A frame that still balances on the barrier then counts as overturned,
#: without a time. A frame whose ties still yield then stands, and rests between its last turns.
_MAX_TAIL: Final = 100_000
#: Largest number of events in a step without ties: one landing, and the end.
_TAIL_EVENTS: Final = 3


@inlined
def touches(theta: float, omega: float, p_hat: float) -> bool:
    """Return True if the ground only touches the uplift acceleration of a frame.

    The ground then exceeds that acceleration by round-off, and the frame is so near to rest that it
    counts as not uplifted. Otherwise the verdict would depend on how a kernel rounds.
    """
    return bool(abs(theta) < _TOUCH and abs(omega) < _TOUCH * p_hat)


@compiled
def _free_rocking(
    theta: float, omega: float, s: float, alpha: float, p_hat: float, restitution: float
) -> tuple[bool, float, float]:
    """Return whether the frame overturns freely from this state, and its largest |theta|, |omega|.

    The energy decides exactly: E = omega^2/2 + p_hat^2 cos(alpha - |theta|) is constant between
    impacts, the barrier at |theta| = alpha is p_hat^2, and an impact takes (1 - restitution^2) of
    the kinetic energy. E - p_hat^2 is computed in a form without cancellation near the barrier.
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
    if not outward:  # the frame swings to the other side with the energy left by the impact
        excess = restitution * restitution * (excess + barrier) - barrier
    if excess >= 0.0:
        return True, HALF_PI, 0.0
    return False, alpha - 2.0 * math.asin(math.sqrt(-excess / (2.0 * p2))), landing


@compiled
def tail(
    theta: float, omega: float, s: float, alpha: float, p_hat: float, restitution: float
) -> tuple[bool, float, float, float, float, float]:
    """Follow the frame from this state over still ground.

    Returns six values:

    - whether the frame overturns;
    - how long after [s]; NaN if it stands, or balances on the barrier to round-off;
    - the largest |theta|;
    - the largest |omega|;
    - when it landed before overturning on the other side; NaN if it did not;
    - the rate just before that landing; for a frame that stands, before its fastest landing.
    """
    overturns, peak, fastest = _free_rocking(theta, omega, s, alpha, p_hat, restitution)
    if not overturns:
        return False, math.nan, peak, fastest, math.nan, fastest
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    h = MAX_SMOOTH_STRIDE / p_hat
    lands = s * omega < 0.0  # once at most; again only if round-off decides
    landed = math.nan
    landing = 0.0
    for i in range(_MAX_TAIL):
        elapsed = 0.0
        for _ in range(_TAIL_EVENTS):
            if elapsed >= h:
                break
            c = taylor(theta, omega, s, zero, zero, alpha, p_hat * p_hat, MOVING, ())
            ended, t, theta, omega, _, _, fast = flight(c, s, h - elapsed, MOVING, HALF_PI)
            fastest = max(fastest, fast)
            elapsed += t
            if ended == ALOFT:
                break
            if ended == FALLEN:
                return True, i * h + elapsed, HALF_PI, fastest, landed, landing
            if not lands:
                return True, math.nan, HALF_PI, fastest, landed, landing
            lands = False
            landed = i * h + elapsed
            landing = omega
            omega *= restitution
            s = -s
    if theta != s * alpha or omega != 0.0:  # it does not balance
        exceed_bound()
    return True, math.nan, HALF_PI, fastest, landed, landing


@compiled
def tied_tail(  # noqa: C901  one loop
    theta: float,
    omega: float,
    s: float,
    alpha: float,
    p_hat: float,
    restitution: float,
    ties: Pair,
    states: States,
    stride: float,
    tie_log: Float,
    time: float,
) -> tuple[bool, float, float, float, float, float]:
    """Follow the frame over still ground as `tail` does, and fill in the log of the ties.

    Ties that do not yield conserve energy, so the first peak is the largest and the first landing
    the fastest. A frame with dissipaters is followed until it rests, or until nothing yields from
    turn to turn; a landing counts as a turn. It then swings without end, or bounces ever more
    slowly, about the rotation at which it would come to rest.
    """
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    yields = ties[0][4] == PLASTIC or ties[1][4] == PLASTIC
    peak = 0.0
    fastest = 0.0
    landing = 0.0
    hardest = 0.0
    landing_time = math.nan
    turns = 0
    stood = False
    high_turn = 0.0
    low_turn = 0.0
    settled = states
    done = 0.0
    most = most_events(restitution)
    for i in range(_MAX_TAIL):
        if s == 0.0 or turns > 3 or (stood and hardest > 0.0 and not yields):
            if s == 0.0 or not yields:
                high_turn = low_turn = 0.0
            _note_rest(alpha, ties, states, high_turn, low_turn, tie_log)
            return False, math.nan, peak, fastest, math.nan, hardest
        elapsed = 0.0
        events = 0
        while elapsed < stride and s != 0.0:
            events += 1
            if events > most:
                exceed_bound()
            pull = both_held(ties, states)
            c = taylor(theta, omega, s, zero, zero, alpha, p_hat * p_hat, MOVING, pull)
            ended, t, theta, omega, high, _, fast = flight(c, s, stride - elapsed, MOVING, peak)
            which, when, level = next_change(ties, states, c, s, t)
            if which >= 0:
                ended, t, theta, omega, high, _, fast = flight(c, s, when, MOVING, peak)
                ended = CHANGED
                theta, omega, states = changed(
                    theta, omega, s, level, which, ties, states, tie_log, time + done + elapsed + t
                )
            outwards = s * c[1] > 0.0 >= s * omega and ended != LANDED
            turned = outwards or ended == LANDED or s * c[1] < 0.0 <= s * omega
            if outwards:
                stood = True
                high_turn = abs(theta)
            elif turned:
                low_turn = abs(theta)
            peak = max(peak, high)
            fastest = max(fastest, fast)
            elapsed += t
            if ended == FALLEN:
                for k in range(2):
                    tie_log[k, PLASTIC_STRETCH] = states[k][1]
                return True, done + elapsed, HALF_PI, fastest, landing_time, landing
            if ended == LANDED:
                if math.isnan(landing_time):
                    landing_time = done + elapsed
                    landing = omega
                hardest = max(hardest, abs(omega))
                omega *= restitution
                s = -s
                states = landed(ties, states, tie_log)
                if abs(omega) < REST_VELOCITY_RATIO * p_hat and uplift_hold(
                    alpha, ties, states
                ) >= -math.tan(alpha):
                    s = 0.0
            if turned:
                turns = turns + 1 if _same_stretches(states, settled) else 0
                settled = states
            if ended == ALOFT:
                break
        done = (i + 1) * stride
    if stood:
        _note_rest(alpha, ties, states, high_turn, low_turn, tie_log)
        return False, math.nan, peak, fastest, math.nan, hardest
    if omega != 0.0:  # it does not balance
        exceed_bound()
    return True, math.nan, HALF_PI, fastest, landing_time, landing


@compiled
def _same_stretches(first: States, other: States) -> bool:
    """Return True if the plastic stretches of both ties are equal, to round-off."""
    return abs(first[0][1] - other[0][1]) <= _SETTLED and abs(first[1][1] - other[1][1]) <= _SETTLED


@compiled
def _note_rest(
    alpha: float, ties: Pair, states: States, high: float, low: float, tie_log: Float
) -> None:
    """Log the plastic stretches, and the |theta| between two turns at which the frame rests.

    The restoring moment of gravity and ties vanishes there and grows with |theta|; it is found by
    bisection. With closed joints the frame rests at 0 unless the ties push them open.
    """
    for _ in range(100):
        middle = 0.5 * (high + low)
        if math.sin(alpha - middle) + elastic_moment(ties, states, middle) > 0.0:
            high = middle
        else:
            low = middle
    if low == 0.0 and math.sin(alpha) + elastic_moment(ties, states, 0.0) >= 0.0:
        high = 0.0
    for k in range(2):
        tie_log[k, PLASTIC_STRETCH] = states[k][1]
        tie_log[k, REST] = 0.5 * (high + low)


@compiled
def elastic_tail(
    theta: float,
    omega: float,
    s: float,
    alpha: float,
    p_hat: float,
    restitution: float,
    k: float,
    f: float,
    tie_log: Float,
) -> tuple[bool, float, float, float, float, float]:
    """Follow a frame over still ground whose ties do not yield; return the values of `tail`.

    The energy over p_hat^2, zero at theta = 0, decides exactly. The barrier is the |theta| at which
    the potential energy stops growing, or pi/2.
    """
    if s == 0.0:
        return False, math.nan, 0.0, 0.0, math.nan, 0.0
    top = HALF_PI
    if math.sin(alpha - top) + k + f * math.cos(0.5 * top) < 0.0:
        top = _held_root(alpha, k, f, 0.0, top, True)
    barrier = _held_energy(top, alpha, k, f)
    energy = 0.5 * (omega / p_hat) ** 2 + _held_energy(abs(theta), alpha, k, f)
    outward = s * omega >= 0.0
    falls = abs(theta) >= top and (outward or energy < barrier)
    landing = p_hat * math.sqrt(2.0 * max(0.0, energy))
    if not falls and not outward:
        energy *= restitution * restitution
    if not falls and energy < barrier:
        peak = _held_root(alpha, k, f, energy, top, False)
        return False, math.nan, peak, landing, math.nan, landing
    tie = (k, f, math.inf, -math.inf, ELASTIC)
    none = (0.0, 0.0, math.inf, -math.inf, ELASTIC)
    stride = MAX_STRIDE / (p_hat * math.sqrt(1.0 + k + f))
    states = (begun(tie, 0.0), begun(none, 0.0))
    _, after, _, fastest, landed_at, landing = tied_tail(
        theta, omega, s, alpha, p_hat, restitution, (tie, none), states, stride, tie_log, 0.0
    )
    return True, after, HALF_PI, fastest, landed_at, landing


@compiled
def _held_energy(theta: float, alpha: float, k: float, f: float) -> float:
    """Return the potential energy of gravity and elastic ties at a rotation, over p_hat^2."""
    half = math.sin(0.5 * theta)
    return 2.0 * half * (math.sin(alpha - 0.5 * theta) + k * half + f)


@compiled
def _held_root(alpha: float, k: float, f: float, energy: float, top: float, turns: bool) -> float:
    """Return the rotation below `top` where `_held_energy` has a value or, if `turns`, a maximum.

    Newton's method, kept inside a bracket.
    """
    low = 0.0
    high = top
    theta = 0.5 * top
    for _ in range(ROOT_STEPS):
        slope = math.sin(alpha - theta) + k * math.sin(theta) + f * math.cos(0.5 * theta)
        if turns:
            bend = -math.cos(alpha - theta) + k * math.cos(theta) - 0.5 * f * math.sin(0.5 * theta)
            value = -slope
            slope = -bend
        else:
            value = _held_energy(theta, alpha, k, f) - energy
        if value > 0.0:
            high = theta
        else:
            low = theta
        new = theta - value / slope if slope > 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - theta) <= 1e-15 * top:
            return new
        theta = new
    if not high - low <= 1e-13 * top:
        exceed_bound()
    return theta
