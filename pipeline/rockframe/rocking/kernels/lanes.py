"""The vectorised kernel: many scenarios side by side, each in one lane of the vectors.

The scalar kernel is the reference, and its functions compute rare cases; the strides and hops of
`vectors` compute the rest. A pool of lanes is filled with scenarios and computed in rounds. In a
round, all lanes take a stride to the end of their interval. Lanes in which an event happens wait
until a pack of them can hop. Lanes at rest are moved to their next uplift. Lanes at the end of
their motion take the next scenario; when none is left, the last ones move together, and blocks of
empty lanes are closed. So no lane waits for another one's motion, and the result of a scenario has
the same bits whatever the other lanes contain.

Private functions are compiled into their callers, as in the scalar kernel; they make the file long.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels import NO_UPLIFT, OVERTURNS, STANDS
from rockframe.rocking.kernels.kernel import (
    BASE_SHEAR,
    IMPACT_VELOCITY,
    IMPACTS,
    LIFTING,
    OVERTURNING_TIME,
    PEAK_TIME,
    PEAK_VELOCITY,
    RESTED,
    UPLIFT_TIME,
)
from rockframe.rocking.kernels.kernel import FRICTION as FRICTION_DEMAND
from rockframe.rocking.kernels.kernel import PEAK as PEAK_ROTATION
from rockframe.rocking.kernels.kernel import PRESS as LEAST_PRESS
from rockframe.rocking.kernels.kernel import PRESS_TOP as LEAST_PRESS_TOP
from rockframe.rocking.kernels.kernel import TOP_LEAST as LEAST_OF_TOP
from rockframe.rocking.kernels.kernel import TOP_MOST as MOST_OF_TOP
from rockframe.rocking.kernels.steps import (
    ALOFT,
    FALLEN,
    HALF_PI,
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
from rockframe.rocking.kernels.tails import (
    REST_VELOCITY_RATIO,
    elastic_tail,
    keep,
    tail,
    touches,
)
from rockframe.rocking.kernels.ties import TIE_LOG_SIZE
from rockframe.rocking.kernels.vectors import (
    ALPHA,
    AT,
    COSINE_TOP,
    ELAPSED,
    END,
    FASTEST,
    FRICTION,
    HOP_ALOFT,
    HOP_LANDED,
    HOT_ROWS,
    KIND,
    LIGHTER,
    OMEGA,
    OMEGA_AFTER,
    P2,
    PACK_SIZE,
    PEAK,
    PENDING,
    PRESS,
    PRESS_TOP,
    SEEN,
    SHARE,
    SHEAR,
    SINE_TOP,
    START,
    STIFF,
    SWING,
    SWING_TOP,
    TAU,
    THETA,
    THETA_AFTER,
    TIE,
    TIED,
    TIED_TOP,
    TOP_LEAST,
    TOP_MOST,
    TURN,
    TURNED,
    WIDTH,
    A,
    V,
    close_block,
    demands,
    hop,
    stride,
    zeros,
)

Float = NDArray[np.float64]

# Slots of a requested scenario.
FIRST: Final = 0  # first row of its ground motion
INTERVALS: Final = 1  # number of rows, one for each interval
TIME_STEP: Final = 2  # length of an interval [s]
START_TIME: Final = 3  # time of the first node [s]
SCALE: Final = 4
SLENDERNESS: Final = 5
P_HAT: Final = 6
RESTITUTION: Final = 7
AHEAD: Final = 8  # offset from a row of the ground to its node in the array `ahead`
TIE_STIFFNESS: Final = 9  # stiffness of ties that do not yield
TIE_FORCE: Final = 10  # force of these ties at theta = 0
# Slots for the demands on the joints.
ASKED_SWING: Final = 11  # p_hat^2 / g times the lever of the moment of gravity, over 1 + mass_ratio
ASKED_SWING_TOP: Final = 12  # p_hat^2 / g times the length of the beam's lever
TOP_ANGLE: Final = 13  # angle of the beam's lever less the slenderness [rad]
PIECES: Final = 14  # number of rows between two samples
ASKED_TIED: Final = 15  # force of the ties over their moment, over the weight on the base
ASKED_TIED_TOP: Final = 16  # force of the ties over their moment, over the weight of the beam
#: Slots of the numbers of `reactions.levers_of`.
SWINGS: Final = (ASKED_SWING, ASKED_SWING_TOP, TOP_ANGLE, ASKED_TIED, ASKED_TIED_TOP)
ASKED_SIZE: Final = 17

#: Number of intervals in one entry of the array `coarse`, by which rest is skipped.
COARSE: Final = 16
#: Bounces that die out within an interval are summed in closed form, not followed, if until then
#: the pull of gravity and ground changes by at most this share [1]: then their number is exact.
_EVEN_PULL: Final = 1e-2
#: Number of blocks. With more lanes, a smaller share of them waits for a pack; but the rows that a
#: stride reads must fit into the first-level cache.
_BLOCKS: Final = 9
_LANES: Final = _BLOCKS * WIDTH

# Further rows of a block, which `vectors` does not use.
_SIDE: Final = HOT_ROWS * WIDTH  # +1 or -1, 0 at rest
_PUSH: Final = (HOT_ROWS + 1) * WIDTH  # factor of the horizontal acceleration
_LIFT: Final = (HOT_ROWS + 2) * WIDTH  # factor of the vertical acceleration
_LIMIT: Final = (HOT_ROWS + 3) * WIDTH  # tan(alpha)
_SLOWEST: Final = (HOT_ROWS + 4) * WIDTH  # rate below which the frame comes to rest
_UPLIFT: Final = (HOT_ROWS + 5) * WIDTH  # time of the first uplift
_COUNT: Final = (HOT_ROWS + 6) * WIDTH  # number of impacts
_WHO: Final = (HOT_ROWS + 7) * WIDTH  # the scenario, -1 if none
_HOLD: Final = (HOT_ROWS + 8) * WIDTH  # term that the ties add to the uplift acceleration
_HARDEST: Final = (HOT_ROWS + 9) * WIDTH  # largest |omega| just before an impact
_CALM: Final = (HOT_ROWS + 10) * WIDTH  # rate below which `_dies_out` is tried
_EVENTFUL: Final = (HOT_ROWS + 11) * WIDTH  # row of the ground of the last impact
_EVENTS: Final = (HOT_ROWS + 12) * WIDTH  # number of impacts that this row may still have
_PEAK_AT: Final = (HOT_ROWS + 13) * WIDTH  # when the row PEAK was reached, in intervals
_RESTED: Final = (HOT_ROWS + 14) * WIDTH  # largest |acceleration| of the ground while it rests [g]
_LIFTING: Final = (HOT_ROWS + 15) * WIDTH  # demand under the beam if it uplifts at a sample
_BLOCK: Final = (HOT_ROWS + 16) * WIDTH  # not a power of two: those cause cache conflicts

# What a lane needs after a hop.
_STRIDE: Final = 0
_HOP: Final = 1
_ATTENTION: Final = 2  # it rests, its interval or its scenario has ended

# Counts of scenarios: those that have begun, and those that are in lanes.
_BEGUN: Final = 0
_LIVE: Final = 1


def shear_and_friction(summaries: Float) -> Float:
    """Return base shear and friction demand of scenarios from their summaries.

    The friction demand is the largest of base and top joints while the frames rock.
    """
    most = summaries[:, [FRICTION_DEMAND, MOST_OF_TOP, LIFTING]].max(axis=1)
    friction = np.maximum(most, -summaries[:, LEAST_OF_TOP])
    return np.stack([summaries[:, BASE_SHEAR], friction], axis=1)


@inlined
def _index(number: float | np.uint32) -> int:
    """Return a non-negative whole number as an index that the compiler knows is not negative."""
    return int(np.int64(np.uint32(number)))


@inlined
def _row(at: float, curved: Marker, lifts: Marker) -> np.uint64:
    """Return the index at which a row of the ground begins."""
    return np.uint64(at) * np.uint64((6 if len(curved) > 0 else 2) * (2 if len(lifts) > 0 else 1))


@inlined
def _load(pool: Float, q: int, ground: Float, curved: Marker, lifts: Marker, tied: Marker) -> None:
    """Fill the rows A and V of a lane with the ground motion in its interval."""
    push = pool[q + _PUSH]
    powers = 6 if len(curved) > 0 else 2
    row = _row(pool[q + AT], curved, lifts)
    for k in range(powers):
        pool[q + A + k * WIDTH] = push * ground[row + np.uint64(k)]
    if len(tied) > 0:
        pool[q + A] += pool[q + TURNED]
    if len(lifts) > 0:
        lift = pool[q + _LIFT]
        pool[q + V] = pool[q + P2] + lift * ground[row + np.uint64(powers)]
        for k in range(1, powers):
            pool[q + V + k * WIDTH] = lift * ground[row + np.uint64(powers + k)]


@inlined
def _coefficients(ground: Float, row: np.uint64, factor: float, curved: Marker) -> Polynomial:
    """Return the coefficients of a row of the ground, times a factor."""
    a0 = factor * ground[row]
    a1 = factor * ground[row + np.uint64(1)]
    if len(curved) == 0:
        return a0, a1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return (
        a0,
        a1,
        factor * ground[row + np.uint64(2)],
        factor * ground[row + np.uint64(3)],
        factor * ground[row + np.uint64(4)],
        factor * ground[row + np.uint64(5)],
        0.0,
        0.0,
        0.0,
        0.0,
    )


@inlined
def _ground_of(
    pool: Float, q: int, ground: Float, asked: Float, side: float, curved: Marker, lifts: Marker
) -> tuple[Polynomial, Polynomial]:
    """Return ground accelerations [g] about a lane's present time, the horizontal times side."""
    scale = asked[_index(pool[q + _WHO]), SCALE]
    row = _row(pool[q + AT], curved, lifts)
    elapsed = pool[q + ELAPSED]
    a = shift(_coefficients(ground, row, side * scale, curved), elapsed)
    v = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if len(lifts) > 0:
        powers = np.uint64(6 if len(curved) > 0 else 2)
        v = shift(_coefficients(ground, row + powers, scale, curved), elapsed)
    return a, v


@inlined
def _elastic(asked: Float, who: int) -> tuple[float, float]:
    """Return k and f_0 of a scenario's ties, as `taylor` takes them."""
    return asked[who, TIE_STIFFNESS], asked[who, TIE_FORCE]


@inlined
def _seat(pool: Float, q: int, who: int, asked: Float) -> None:
    """Put a scenario into a lane, at rest at the start of its motion."""
    h = asked[who, TIME_STEP]
    p_hat = asked[who, P_HAT] * h
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = 0.0
    pool[q + ALPHA] = asked[who, SLENDERNESS]
    # sin(theta) = sin(alpha) cos(psi) - cos(alpha) sin(psi): stiffness acts like rotated gravity
    turned = p_hat * p_hat * asked[who, TIE_STIFFNESS]
    pool[q + P2] = p_hat * p_hat - turned * math.cos(asked[who, SLENDERNESS])
    pool[q + TIE] = p_hat * p_hat * asked[who, TIE_FORCE]
    pool[q + TURNED] = turned * math.sin(asked[who, SLENDERNESS])
    pool[q + LIGHTER] = turned * math.cos(asked[who, SLENDERNESS])
    pool[q + STIFF] = 2.0 * turned
    pool[q + TIED] = asked[who, ASKED_TIED]
    pool[q + TIED_TOP] = asked[who, ASKED_TIED_TOP]
    pool[q + SHEAR] = 0.0
    pool[q + FRICTION] = 0.0
    pool[q + TOP_MOST] = -math.inf
    pool[q + TOP_LEAST] = math.inf
    pool[q + PRESS] = math.inf
    pool[q + PRESS_TOP] = math.inf
    pool[q + _RESTED] = -1.0
    pool[q + _LIFTING] = 0.0
    pool[q + _PEAK_AT] = math.nan
    pool[q + SWING] = asked[who, ASKED_SWING]
    pool[q + SWING_TOP] = asked[who, ASKED_SWING_TOP]
    pool[q + COSINE_TOP] = math.cos(asked[who, TOP_ANGLE])
    pool[q + SINE_TOP] = math.sin(asked[who, TOP_ANGLE])
    pool[q + SHARE] = 1.0 / asked[who, PIECES]
    pool[q + _HOLD] = asked[who, TIE_FORCE] / math.cos(asked[who, SLENDERNESS])
    pool[q + PEAK] = 0.0
    pool[q + FASTEST] = 0.0
    pool[q + _HARDEST] = 0.0
    pool[q + ELAPSED] = 0.0
    pool[q + AT] = asked[who, FIRST]
    pool[q + END] = asked[who, FIRST] + asked[who, INTERVALS]
    pool[q + PENDING] = 1.0
    pool[q + _SIDE] = 0.0
    pool[q + _LIFT] = p_hat * p_hat * asked[who, SCALE]
    pool[q + _LIMIT] = math.tan(asked[who, SLENDERNESS])
    pool[q + _SLOWEST] = REST_VELOCITY_RATIO * p_hat
    tie = asked[who, TIE_FORCE]
    pull = p_hat * p_hat * (math.sin(asked[who, SLENDERNESS]) + tie)
    pool[q + _CALM] = _EVEN_PULL * pull * (1.0 - asked[who, RESTITUTION])
    pool[q + _UPLIFT] = math.nan
    pool[q + _COUNT] = 0.0
    pool[q + _EVENTFUL] = -1.0
    pool[q + _WHO] = who


@inlined
def _empty(pool: Float, q: int) -> None:
    """Remove the scenario of a lane; an empty lane is never advanced."""
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = 0.0
    pool[q + AT] = 0.0
    pool[q + END] = 0.0
    pool[q + PENDING] = 1.0
    pool[q + _WHO] = -1.0


@inlined
def _still(bounds: Float, i: int, factor: float, limit: float, hold: float, lifts: Marker) -> bool:
    """Return True if no ground motion within these bounds uplifts the frame."""
    if len(lifts) > 0:
        return bool(factor * (bounds[i, 0] + limit * bounds[i, 1]) <= limit + hold)
    return bool(factor * bounds[i, 0] <= limit + hold)


@inlined
def _begins_at_sample(pool: Float, q: int, at: int) -> bool:
    """Return True if a row of the motion of a lane begins at a sample."""
    left = (pool[q + END] - at) * pool[q + SHARE]
    return bool(math.floor(left) == left)


@inlined
def _wait_for_uplift(
    pool: Float,
    q: int,
    ground: Float,
    bounds: Float,
    coarse: Float,
    asked: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
) -> float:
    """Advance a lane at rest to its next uplift, or to the end of its motion.

    Returns the largest horizontal |acceleration| of the ground until then [g], at the samples if it
    is piecewise linear, or -1 if the lane rests at none.
    """
    who = _index(pool[q + _WHO])
    limit = pool[q + _LIMIT]
    hold = pool[q + _HOLD]
    factor = abs(asked[who, SCALE])
    at = _index(pool[q + AT])
    end = _index(pool[q + END])
    resting = -1.0
    whole = pool[q + SHARE] == 1.0  # each row begins and ends at a sample
    waits = True
    while waits and at < end:
        if pool[q + ELAPSED] == 0.0:
            while at < end and _still(bounds, at, factor, limit, hold, lifts):
                level = bounds[at, 0] if whole else abs(ground[_row(at, curved, lifts)])
                counts = whole or _begins_at_sample(pool, q, at)
                resting = max(resting, factor * level if counts else -1.0)
                at += 1
                while (
                    whole
                    and at % COARSE == 0
                    and at + COARSE <= end
                    and _still(coarse, at // COARSE, factor, limit, hold, lifts)
                ):
                    resting = max(resting, factor * coarse[at // COARSE, 0])
                    at += COARSE
        pool[q + AT] = at
        if at < end:
            a, v = _ground_of(pool, q, ground, asked, 1.0, curved, lifts)
            sampled = pool[q + ELAPSED] == 0.0 and _begins_at_sample(pool, q, at)
            span = 1.0 - pool[q + ELAPSED]
            p2 = (asked[who, P_HAT] * asked[who, TIME_STEP]) ** 2
            held = _elastic(asked, who) if len(tied) > 0 else ()
            wait, start = lift_off(a, v, limit, hold, span, pool[q + ALPHA], p2, held)
            waits = wait == NEVER
            resting = max(resting, abs(a[0]) if sampled and wait != 0.0 else -1.0)
            if waits:
                pool[q + ELAPSED] = 0.0
                at += 1
                pool[q + AT] = at
            else:
                pool[q + ELAPSED] += wait
                pool[q + START] = start
                pool[q + _SIDE] = -1.0 if derivatives(a, wait)[0] > 0.0 else 1.0
                pool[q + _PUSH] = pool[q + _SIDE] * pool[q + _LIFT]
                if math.isnan(pool[q + _UPLIFT]):
                    interval = at - asked[who, FIRST] + pool[q + ELAPSED]
                    pool[q + _UPLIFT] = asked[who, START_TIME] + interval * asked[who, TIME_STEP]
                _load(pool, q, ground, curved, lifts, tied)
    return resting


@inlined
def _file(
    pool: Float,
    q: int,
    asked: Float,
    summaries: Float,
    peak: float,
    fast: float,
    interval: float,
    peak_at: float,
) -> None:
    """Store a lane's results.

    `interval` and `peak_at` are the times of overturning and of the peak [intervals], or NaN.
    """
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    summaries[who, PEAK_ROTATION] = peak
    summaries[who, PEAK_TIME] = asked[who, START_TIME] + peak_at * h
    summaries[who, UPLIFT_TIME] = pool[q + _UPLIFT]
    summaries[who, OVERTURNING_TIME] = asked[who, START_TIME] + interval * h
    summaries[who, IMPACTS] = pool[q + _COUNT]
    summaries[who, PEAK_VELOCITY] = fast / h
    summaries[who, IMPACT_VELOCITY] = pool[q + _HARDEST] / h
    weight = (asked[who, P_HAT] * h) ** 2
    summaries[who, BASE_SHEAR] = pool[q + SHEAR] / weight
    summaries[who, FRICTION_DEMAND] = pool[q + FRICTION]
    summaries[who, MOST_OF_TOP] = pool[q + TOP_MOST]
    summaries[who, LEAST_OF_TOP] = pool[q + TOP_LEAST]
    summaries[who, LEAST_PRESS] = pool[q + PRESS] / weight
    summaries[who, LEAST_PRESS_TOP] = pool[q + PRESS_TOP] / weight
    summaries[who, RESTED] = pool[q + _RESTED]
    summaries[who, LIFTING] = pool[q + _LIFTING]


@inlined
def _weigh(pool: Float, q: int, a0: float, v0: float, rocks: bool, tied: Marker) -> None:
    """Note the demands of a lane under these pulls; `rocks` is false if it uplifts now."""
    psi = pool[q + ALPHA] - pool[q + THETA]
    held = 0.0
    if len(tied) > 0:
        held = pool[q + TIE] * math.cos(0.5 * pool[q + THETA])
    f0 = v0 * math.sin(psi) + a0 * math.cos(psi) + held
    force, friction, top, down, down_top = demands(
        pool, q, psi, pool[q + OMEGA], f0, a0, v0, tied, pool[q + THETA]
    )
    pool[q + SHEAR] = max(pool[q + SHEAR], force)
    pool[q + FRICTION] = max(pool[q + FRICTION], friction)
    pool[q + PRESS] = min(pool[q + PRESS], down)
    pool[q + PRESS_TOP] = min(pool[q + PRESS_TOP], down_top)
    if rocks:
        pool[q + TOP_MOST] = max(pool[q + TOP_MOST], top)
        pool[q + TOP_LEAST] = min(pool[q + TOP_LEAST], top)
    else:
        pool[q + _LIFTING] = max(pool[q + _LIFTING], abs(top))


@inlined
def _weigh_last(
    pool: Float,
    q: int,
    ground: Float,
    scale: float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
) -> None:
    """Note the demands at the end of the motion of a lane."""
    powers = 6 if len(curved) > 0 else 2
    row = _row(pool[q + END] - 1.0, curved, lifts)
    across, upwards = 0.0, 0.0
    for k in range(powers):
        across += ground[row + np.uint64(k)]
        if len(lifts) > 0:
            upwards += ground[row + np.uint64(powers + k)]
    if pool[q + _SIDE] == 0.0:
        pool[q + SHEAR] = max(pool[q + SHEAR], abs(pool[q + _LIFT] * across))
        pool[q + _RESTED] = max(pool[q + _RESTED], abs(scale * across))
        return
    a0 = pool[q + _SIDE] * pool[q + _LIFT] * across
    v0 = pool[q + P2] + pool[q + _LIFT] * upwards
    if len(tied) > 0:
        a0 += pool[q + TURNED]
    _weigh(pool, q, a0, v0, True, tied)


@inlined
def _end(
    pool: Float,
    q: int,
    ground: Float,
    asked: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
    tie_log: Float,
    weighed: Marker,
) -> None:
    """Decide the outcome of a lane from its energy at the end of its motion, and empty the lane."""
    who = _index(pool[q + _WHO])
    if len(weighed) > 0:
        _weigh_last(pool, q, ground, asked[who, SCALE], curved, lifts, tied)
    p_hat = asked[who, P_HAT] * asked[who, TIME_STEP]
    side = 0.0 if pool[q + _SIDE] == 0.0 else 1.0
    if side != 0.0 and touches(pool[q + THETA], pool[q + OMEGA], p_hat):
        _forget_touch(pool, q)
        pool[q + THETA] = 0.0
        pool[q + OMEGA] = 0.0
        side = 0.0
    if len(tied) > 0:
        overturns, after, peak, fast, landed, landing = elastic_tail(
            pool[q + THETA],
            pool[q + OMEGA],
            side,
            pool[q + ALPHA],
            p_hat,
            asked[who, RESTITUTION],
            asked[who, TIE_STIFFNESS],
            asked[who, TIE_FORCE],
            tie_log,
        )
    else:
        overturns, after, peak, fast, landed, landing = tail(
            pool[q + THETA],
            pool[q + OMEGA],
            side,
            pool[q + ALPHA],
            p_hat,
            asked[who, RESTITUTION],
        )
    if overturns:
        verdicts[who] = OVERTURNS
    else:
        verdicts[who] = NO_UPLIFT if math.isnan(pool[q + _UPLIFT]) else STANDS
    if not math.isnan(landed):
        pool[q + _COUNT] += 1.0
    pool[q + _HARDEST] = max(pool[q + _HARDEST], abs(landing))
    fallen = asked[who, INTERVALS] + after
    peak_at = fallen
    if not overturns and pool[q + PEAK] >= max(peak, pool[q + THETA]):
        peak_at = pool[q + _PEAK_AT]
    peak = max(peak, pool[q + PEAK], pool[q + THETA])
    fast = max(fast, pool[q + FASTEST], abs(pool[q + OMEGA]))
    _file(pool, q, asked, summaries, peak, fast, fallen, peak_at)
    _empty(pool, q)


@inlined
def _dies_out(
    pool: Float, q: int, who: int, asked: Float, a: Polynomial, v: Polynomial
) -> tuple[float, float, float]:
    """Return duration, number and largest height of the bounces after a landing.

    The duration is NaN where the closed forms below are not valid.
    A flight that starts at the rate omega against a pull f takes 2 omega / f, and lands faster by a
    share of 2 omega f' / (3 f^2). The next flight starts slower by the restitution e, against the
    pull on the other side. The sums over all flights are geometric series in e^2, as long as f and
    f' change little and the ground uplifts neither side.
    """
    e = asked[who, RESTITUTION]
    omega = pool[q + OMEGA]
    p2 = (asked[who, P_HAT] * asked[who, TIME_STEP]) ** 2
    sine = p2 * math.sin(pool[q + ALPHA])
    cosine = p2 * pool[q + _SIDE] * math.cos(pool[q + ALPHA])
    held = sine * (1.0 + v[0]) + p2 * asked[who, TIE_FORCE]
    one = held + cosine * a[0]
    other = held - cosine * a[0]
    least = min(one, other)
    steep = abs(sine * v[1]) + abs(cosine * a[1])
    for k in range(2, 6):
        steep += k * (abs(sine * v[k]) + abs(cosine * a[k]))
    flights = 2.0 * omega / (1.0 - e * e)
    lasts = flights * (1.0 / one + e / other)
    if least <= 0.0 or lasts * steep > _EVEN_PULL * least or pool[q + ELAPSED] + lasts >= 1.0:
        return math.nan, 0.0, 0.0
    faster = (sine * v[1] + cosine * a[1]) / (one * one)
    faster += e * (sine * v[1] - cosine * a[1]) / (other * other)
    left = math.log(omega / pool[q + _SLOWEST]) + flights / 3.0 * faster
    highest = 0.5 * omega * omega * max(1.0 / one, e * e / other)
    return lasts, max(1.0, math.floor(left / -math.log(e)) + 1.0), highest


@inlined
def _note_peak(pool: Float, q: int, asked: Float, high: float, t: float) -> None:
    """Note the height of a peak of a lane after time t, if none before was as high."""
    if high > pool[q + PEAK]:
        begun = pool[q + AT] - asked[_index(pool[q + _WHO]), FIRST]
        pool[q + PEAK] = high
        pool[q + _PEAK_AT] = begun + pool[q + ELAPSED] + t


@inlined
def _forget_touch(pool: Float, q: int) -> None:
    """Remove an uplift by round-off from the results, unless the frame has rocked before."""
    if pool[q + _COUNT] == 0.0:
        pool[q + PEAK] = 0.0
        pool[q + _PEAK_AT] = math.nan
        pool[q + FASTEST] = 0.0
        pool[q + _UPLIFT] = math.nan


@inlined
def _count_event(pool: Float, q: int, restitution: float) -> None:
    """Report an internal error if a lane lands too often within an interval."""
    if pool[q + _EVENTFUL] != pool[q + AT]:
        pool[q + _EVENTFUL] = pool[q + AT]
        pool[q + _EVENTS] = most_events(restitution)
    pool[q + _EVENTS] -= 1.0
    if pool[q + _EVENTS] < 0.0:
        exceed_bound()


@inlined
def _rebound(
    pool: Float,
    q: int,
    t: float,
    omega: float,
    ground: Float,
    asked: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
) -> bool:
    """Apply the impact of a lane after time t, and start its rotation to the other side.

    Returns True if the lane needs attention: it now rests, or its interval has ended.
    """
    who = _index(pool[q + _WHO])
    _count_event(pool, q, asked[who, RESTITUTION])
    touched = touches(0.0, omega, asked[who, P_HAT] * asked[who, TIME_STEP])
    if touched:
        _forget_touch(pool, q)
    else:
        pool[q + _COUNT] += 1.0
        pool[q + _HARDEST] = max(pool[q + _HARDEST], abs(omega))
    pool[q + START] = MOVING
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = -asked[who, RESTITUTION] * omega
    pool[q + ELAPSED] += t
    pool[q + _SIDE] = -pool[q + _SIDE]
    pool[q + _PUSH] = -pool[q + _PUSH]
    if touched:
        pool[q + OMEGA] = 0.0
        pool[q + _SIDE] = 0.0
    elif pool[q + OMEGA] < max(pool[q + _SLOWEST], pool[q + _CALM]):
        a, v = _ground_of(pool, q, ground, asked, 1.0, curved, lifts)
        if pool[q + OMEGA] < pool[q + _SLOWEST]:
            needed = pool[q + _LIMIT] * (1.0 + v[0]) + pool[q + _HOLD]
            if abs(a[0]) <= needed or omega == 0.0:
                pool[q + OMEGA] = 0.0
                pool[q + _SIDE] = 0.0
        else:
            lasts, bounces, highest = _dies_out(pool, q, who, asked, a, v)
            if not math.isnan(lasts):
                _note_peak(pool, q, asked, highest, 0.0)
                pool[q + _COUNT] += bounces
                pool[q + ELAPSED] += lasts
                pool[q + OMEGA] = 0.0
                pool[q + _SIDE] = 0.0
    whole = pool[q + ELAPSED] >= 1.0
    if whole:
        pool[q + ELAPSED] = 0.0
        pool[q + AT] += 1.0
    if whole or len(tied) > 0:  # as each stride loads it: the term of the ties would be rounded
        _load(pool, q, ground, curved, lifts, tied)
    else:
        for k in range(6 if len(curved) > 0 else 2):
            pool[q + A + k * WIDTH] = -pool[q + A + k * WIDTH]
    return bool(whole or pool[q + _SIDE] == 0.0)


@inlined
def _keep_excursion(
    pool: Float,
    q: int,
    asked: Float,
    ahead: Float,
    excursions: Float,
    curved: Marker,
    lifts: Marker,
) -> None:
    """Store the excursion that a lane begins, if it is one of the highest."""
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    alpha = asked[who, SLENDERNESS]
    elapsed = pool[q + ELAPSED]
    node = _index(pool[q + AT] + asked[who, AHEAD])
    side = pool[q + _SIDE]
    rate = asked[who, P_HAT] * h
    scale = asked[who, SCALE]
    first = scale * side * ahead[node, 0]
    last = scale * side * ahead[node + 1, 0]
    push = pool[q + A] - pool[q + TURNED]  # the scaled ground acceleration, times rate^2
    slope = pool[q + A + WIDTH]
    if len(lifts) > 0:
        first += scale * alpha * ahead[node, 1]
        last += scale * alpha * ahead[node + 1, 1]
        push += alpha * (pool[q + V] - pool[q + P2])
        slope += alpha * pool[q + V + WIDTH]
    if len(curved) > 0:
        for k in range(2, 6):
            slope += pool[q + A + k * WIDTH]
            if len(lifts) > 0:
                slope += alpha * pool[q + V + k * WIDTH]
    # I(t) is the cubic with its values and slopes, rate times (I - ground), at both nodes
    on = last - first
    begins = rate * first - push / rate - on
    ends = rate * last - (push + slope) / rate - on
    rest = 1.0 - elapsed
    still = first + elapsed * (on + rest * (rest * begins - elapsed * ends))
    outwards = pool[q + OMEGA] / rate - still
    start = asked[who, START_TIME] + (pool[q + AT] - asked[who, FIRST] + elapsed) * h
    keep(excursions, who, start, side, outwards / alpha - 1.0)


@inlined
def _fly_on(pool: Float, q: int, theta: float, omega: float) -> None:
    """Move a lane to the end of its interval, still uplifted."""
    pool[q + THETA] = theta
    pool[q + OMEGA] = omega
    pool[q + ELAPSED] = 0.0
    pool[q + START] = MOVING
    pool[q + AT] += 1.0
    pool[q + PENDING] = 0.0


@inlined
def _ready(
    pool: Float,
    q: int,
    counts: NDArray[np.int64],
    ground: Float,
    bounds: Float,
    coarse: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
    asked: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    ahead: Float,
    excursions: Float,
    tie_log: Float,
    weighed: Marker,
) -> bool:
    """Prepare a lane for a hop, with the next scenario if its own has ended.

    Returns False if no scenario is left for it.
    """
    while True:
        if pool[q + _WHO] < 0.0:
            if counts[_BEGUN] == asked.shape[0]:
                return False
            _seat(pool, q, counts[_BEGUN], asked)
            counts[_BEGUN] += 1
            counts[_LIVE] += 1
        if pool[q + _SIDE] == 0.0:
            resting = _wait_for_uplift(pool, q, ground, bounds, coarse, asked, curved, lifts, tied)
            if len(weighed) > 0:
                p_hat = asked[_index(pool[q + _WHO]), P_HAT]
                step = asked[_index(pool[q + _WHO]), TIME_STEP]
                pool[q + SHEAR] = max(pool[q + SHEAR], resting * (p_hat * step) ** 2)
                pool[q + _RESTED] = max(pool[q + _RESTED], resting)
                uplifts = pool[q + ELAPSED] == 0.0 and pool[q + AT] < pool[q + END]
                if uplifts and _begins_at_sample(pool, q, _index(pool[q + AT])):
                    _weigh(
                        pool,
                        q,
                        pool[q + A],
                        pool[q + V] if len(lifts) > 0 else pool[q + P2],
                        False,
                        tied,
                    )
            if excursions.shape[0] > 0 and pool[q + AT] < pool[q + END]:
                _keep_excursion(pool, q, asked, ahead, excursions, curved, lifts)
        if pool[q + AT] < pool[q + END]:
            pool[q + PENDING] = 1.0
            return True
        _end(
            pool,
            q,
            ground,
            asked,
            verdicts,
            summaries,
            curved,
            lifts,
            tied,
            tie_log,
            weighed,
        )
        counts[_LIVE] -= 1


@inlined
def _join(
    pack: Float, k: int, pool: Float, q: int, curved: Marker, lifts: Marker, tied: Marker
) -> None:
    """Copy a lane to a place in a pack."""
    for r in range(0, A, WIDTH):
        pack[k + r] = pool[q + r]
    for r in range(0, (6 if len(curved) > 0 else 2) * WIDTH, WIDTH):
        pack[k + A + r] = pool[q + A + r]
        if len(lifts) > 0:
            pack[k + V + r] = pool[q + V + r]
    if len(tied) > 0:
        pack[k + TIE] = pool[q + TIE]


@inlined
def _scalar_flight(
    pool: Float,
    q: int,
    ground: Float,
    asked: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
) -> tuple[int, float, float, float]:
    """Compute a lane's flight as the scalar kernel does; return its end, and the state then."""
    a, v = _ground_of(pool, q, ground, asked, pool[q + _SIDE], curved, lifts)
    who = _index(pool[q + _WHO])
    start = int(pool[q + START])
    theta, omega, alpha = pool[q + THETA], pool[q + OMEGA], pool[q + ALPHA]
    p2 = (asked[who, P_HAT] * asked[who, TIME_STEP]) ** 2
    held = _elastic(asked, who) if len(tied) > 0 else ()
    c = taylor(theta, omega, 1.0, a, v, alpha, p2, start, held)
    ended, t, theta, omega, high, high_time, fast = flight(
        c, 1.0, 1.0 - pool[q + ELAPSED], start, pool[q + PEAK]
    )
    _note_peak(pool, q, asked, high, high_time)
    pool[q + FASTEST] = max(fast, pool[q + FASTEST])
    return ended, t, theta, omega


@inlined
def _after_hop(
    pack: Float,
    k: int,
    pool: Float,
    q: int,
    counts: NDArray[np.int64],
    ground: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
    asked: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    ahead: Float,
    excursions: Float,
) -> int:
    """Move a lane to the end of its hop; return what it needs next."""
    _note_peak(pool, q, asked, pack[k + PEAK], pack[k + TURN])
    pool[q + FASTEST] = pack[k + FASTEST]
    kind, t = pack[k + KIND], pack[k + TAU]
    theta, omega = pack[k + THETA_AFTER], pack[k + OMEGA_AFTER]
    aloft = kind == HOP_ALOFT
    if kind != HOP_ALOFT and kind != HOP_LANDED:
        ended, t, theta, omega = _scalar_flight(pool, q, ground, asked, curved, lifts, tied)
        if ended == FALLEN:
            who = _index(pool[q + _WHO])
            verdicts[who] = OVERTURNS
            fallen = pool[q + AT] - asked[who, FIRST] + pool[q + ELAPSED] + t
            _file(pool, q, asked, summaries, HALF_PI, pool[q + FASTEST], fallen, fallen)
            _empty(pool, q)
            counts[_LIVE] -= 1
            return _ATTENTION
        aloft = ended == ALOFT
    if aloft:
        _fly_on(pool, q, theta, omega)
        return _STRIDE
    attention = _rebound(pool, q, t, omega, ground, asked, curved, lifts, tied)
    if excursions.shape[0] > 0 and pool[q + _SIDE] != 0.0 and pool[q + AT] < pool[q + END]:
        _keep_excursion(pool, q, asked, ahead, excursions, curved, lifts)
    return _ATTENTION if attention else _HOP


@inlined
def _advance(
    pool: Float,
    used: int,
    fresh: NDArray[np.uint32],
    ground: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
    weighed: Marker,
) -> int:
    """Let all lanes stride; return the number of those that need attention, listed in `fresh`.

    All blocks are loaded before the first stride: reading just-written numbers as a vector stalls.
    """
    freshes = 0
    for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
        if b >= used:
            break
        for q in range(b, b + WIDTH):
            _load(pool, q, ground, curved, lifts, tied)
    for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
        if b >= used:
            break
        stride(pool, b, curved, lifts, tied, weighed)
        for q in range(b, b + WIDTH):
            if pool[q + SEEN] == 0.0:
                fresh[freshes] = q
                freshes += 1
    return freshes


@compiled
def integrate_lanes(  # noqa: C901  rounds, as described above
    ground: Float,
    bounds: Float,
    coarse: Float,
    curved: Marker,
    lifts: Marker,
    tied: Marker,
    asked: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    ahead: Float,
    excursions: Float,
    weighed: Marker,
) -> None:
    """Integrate scenarios from rest.

    Parameters
    ----------
    ground : array, shape (coefficients,)
        Rows of all ground motions, one row for each interval. A row has the coefficients of the
        horizontal acceleration [g] in powers of the time since the interval's start over its
        length: two, or six if `curved`. If `lifts`, those of the vertical acceleration follow. At
        least one row must follow the last motion.
    bounds : array, shape (rows, 1 or 2)
        Upper bounds of the horizontal |acceleration| [g] in each interval, then of the vertical.
    coarse : array, shape (rows / COARSE, rounded down, 1 or 2)
        Largest of the bounds of each COARSE rows, from the first row on.
    curved, lifts : NO or YES
        Form of the rows.
    tied : NO or YES
        YES if the frames have ties; these must not yield.
    asked : array, shape (scenarios, ASKED_SIZE)
        Values of the named slots of each scenario.
    verdicts : array of int8, shape (scenarios,)
        Filled with the outcomes.
    summaries : array, shape (scenarios, SUMMARY_SIZE)
        Filled with the values of the kernel's named slots; demands only if `weighed`.
    ahead : array, shape (nodes, 1 or 2)
        Results of `fill_ahead` for the ground motions and each frequency parameter.
    excursions : array, shape (scenarios, kept, EXCURSION_SIZE)
        Distances must be minus infinity. Filled with the excursions of the largest distances, in no
        particular order. Shape (0, ...) if excursions are not requested.
    weighed : NO or YES
        YES to compute the demands on the joints, which takes a tenth longer.
    """
    pool = zeros(_BLOCKS * _BLOCK)
    # empty lanes take as long as others, so a few scenarios use only a few blocks; the loops below
    # keep constant bounds, because the compiler vectorises them only then
    used = min(_BLOCKS, (asked.shape[0] + WIDTH - 1) // WIDTH) * _BLOCK
    pack = zeros(PACK_SIZE)
    tie_log = np.zeros((2, TIE_LOG_SIZE))
    # unsigned, so that the compiler need not check for negative indices
    fresh = np.zeros(_LANES, dtype=np.uint32)  # lanes that need attention
    pending = np.zeros(_LANES, dtype=np.uint32)  # lanes that wait for a hop
    counts = np.zeros(2, dtype=np.int64)
    freshes = 0
    waiting = 0
    for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
        for q in range(b, b + WIDTH):
            _empty(pool, q)
            if b < used:
                fresh[freshes] = q
                freshes += 1
    while True:
        while True:
            for e in range(freshes):
                q = _index(fresh[e])
                if _ready(
                    pool,
                    q,
                    counts,
                    ground,
                    bounds,
                    coarse,
                    curved,
                    lifts,
                    tied,
                    asked,
                    verdicts,
                    summaries,
                    ahead,
                    excursions,
                    tie_log,
                    weighed,
                ):
                    pending[waiting] = q
                    waiting += 1
            freshes = 0
            # a pack that is not full waits until it is, or until half of the lanes wait
            if waiting == 0 or (waiting < WIDTH and 2 * waiting < counts[_LIVE]):
                break
            taken = min(waiting, WIDTH)
            waiting -= taken
            back = waiting
            for k in range(taken):
                _join(pack, k, pool, _index(pending[back + k]), curved, lifts, tied)
            hop(pack, curved, lifts, tied)
            for k in range(taken):
                q = _index(pending[back + k])
                needs = _after_hop(
                    pack,
                    k,
                    pool,
                    q,
                    counts,
                    ground,
                    curved,
                    lifts,
                    tied,
                    asked,
                    verdicts,
                    summaries,
                    ahead,
                    excursions,
                )
                if needs == _ATTENTION:
                    fresh[freshes] = q
                    freshes += 1
                elif needs == _HOP:
                    pending[waiting] = q
                    waiting += 1
        if counts[_LIVE] == 0:
            break
        if counts[_BEGUN] == asked.shape[0]:
            while counts[_LIVE] <= (used // _BLOCK - 1) * WIDTH:
                used -= _BLOCK
                close_block(pool, used, _BLOCK, _WHO, pending, waiting)
        freshes = _advance(pool, used, fresh, ground, curved, lifts, tied, weighed)
