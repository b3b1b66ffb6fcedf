"""The kernel in lanes: many scenarios side by side, as fast as the machine's vectors allow.

The scalar kernel is the reference, and its functions follow rare cases; the strides and hops of
`vectors` do the rest. A pool of lanes is filled with scenarios and computed in rounds. In a round,
all lanes take a stride. Those in which an event happened wait, and hop together; those at rest are
moved to the next uplift, and those at the end of their motion take the next scenario. So no lane
waits for another one's motion, and the numbers of a scenario have the same bits whatever the other
lanes contain.

The longest function is one loop over one set of arrays, for the reason given in the scalar kernel;
the functions that this loop calls make the file long.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.rocking.kernels.compiled import compiled, inlined
from rockframe.rocking.kernels.excursions import keep
from rockframe.rocking.kernels.kernel import (
    IMPACT_VELOCITY,
    IMPACTS,
    NO_UPLIFT,
    OVERTURNED,
    OVERTURNING_TIME,
    PEAK_TIME,
    PEAK_VELOCITY,
    SAFE,
    UPLIFT_TIME,
)
from rockframe.rocking.kernels.kernel import PEAK as PEAK_ROTATION
from rockframe.rocking.kernels.polynomials import NEVER, Polynomial, derivatives, shift
from rockframe.rocking.kernels.steps import (
    ALOFT,
    FALLEN,
    HALF_PI,
    MOVING,
    Marker,
    flight,
    lift_off,
    taylor,
)
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO, elastic_tail, tail
from rockframe.rocking.kernels.ties import TIE_LOG_SIZE
from rockframe.rocking.kernels.vectors import (
    ALPHA,
    AT,
    ELAPSED,
    END,
    FASTEST,
    HOP_ALOFT,
    HOP_LANDED,
    HOT_ROWS,
    KIND,
    OMEGA,
    OMEGA_AFTER,
    P2,
    PACK_SIZE,
    PEAK,
    PENDING,
    SEEN,
    START,
    TAU,
    THETA,
    THETA_AFTER,
    TIE,
    WIDTH,
    A,
    V,
    hop,
    stride,
)

Float = NDArray[np.float64]

# Slots of a scenario that is asked for.
FIRST: Final = 0  # its first row of the ground
INTERVALS: Final = 1  # their number
TIME_STEP: Final = 2  # their length [s]
START_TIME: Final = 3  # [s]
SCALE: Final = 4
SLENDERNESS: Final = 5
P_HAT: Final = 6
RESTITUTION: Final = 7
AHEAD: Final = 8  # from a row of the ground to its node in what is ahead
TIE_STIFFNESS: Final = 9  # of ties that do not yield, and their force at theta = 0
TIE_FORCE: Final = 10
ASKED_SIZE: Final = 11

#: Rest is skipped so many intervals at a time.
COARSE: Final = 16

#: Bounces that die out within an interval are summed up, not followed, if the pull of gravity and
#: ground changes by no more than this share of itself until then: so their number stays right.
_EVEN_PULL: Final = 1e-2

#: Number of lanes: enough to fill packs while most fly, few enough for the nearest cache.
_BLOCKS: Final = 6
_LANES: Final = _BLOCKS * WIDTH

# Further rows of a block, of no concern to the vectors.
_SIDE: Final = HOT_ROWS * WIDTH  # +1 or -1, 0 at rest
_PUSH: Final = (HOT_ROWS + 1) * WIDTH  # what the horizontal acceleration is multiplied by
_LIFT: Final = (HOT_ROWS + 2) * WIDTH  # and the vertical one
_LIMIT: Final = (HOT_ROWS + 3) * WIDTH  # tan(alpha)
_SLOWEST: Final = (HOT_ROWS + 4) * WIDTH  # rate at which it comes to rest
_UPLIFT: Final = (HOT_ROWS + 5) * WIDTH
_COUNT: Final = (HOT_ROWS + 6) * WIDTH
_WHO: Final = (HOT_ROWS + 7) * WIDTH  # the scenario, -1 if none
_TURNED: Final = (HOT_ROWS + 8) * WIDTH  # what the ties add to the push of the ground
_HOLD: Final = (HOT_ROWS + 9) * WIDTH  # and to the acceleration that uplifts
_HARDEST: Final = (HOT_ROWS + 10) * WIDTH  # largest |omega| just before an impact
_CALM: Final = (HOT_ROWS + 11) * WIDTH  # rate below which its bounces may die out at once
_BLOCK: Final = (HOT_ROWS + 12) * WIDTH  # not a power of two, which caches dislike


@inlined
def _index(number: float | np.uint32) -> int:
    """A whole number, not negative, as an index: the compiler need not look for negative ones."""
    return int(np.int64(np.uint32(number)))


@inlined
def _row(at: float, curved: Marker, lifts: Marker) -> np.uint64:
    """Return the place at which a row of the ground begins."""
    return np.uint64(at) * np.uint64((6 if len(curved) > 0 else 2) * (2 if len(lifts) > 0 else 1))


@inlined
def _load(pool: Float, q: int, ground: Float, curved: Marker, lifts: Marker, tied: Marker) -> None:
    """Fill the rows A and V of a lane with its interval of the ground."""
    push = pool[q + _PUSH]
    powers = 6 if len(curved) > 0 else 2
    row = _row(pool[q + AT], curved, lifts)
    for k in range(powers):
        pool[q + A + k * WIDTH] = push * ground[row + np.uint64(k)]
    if len(tied) > 0:
        pool[q + A] += pool[q + _TURNED]
    if len(lifts) > 0:
        lift = pool[q + _LIFT]
        pool[q + V] = pool[q + P2] + lift * ground[row + np.uint64(powers)]
        for k in range(1, powers):
            pool[q + V + k * WIDTH] = lift * ground[row + np.uint64(powers + k)]


@inlined
def _coefficients(ground: Float, row: np.uint64, factor: float, curved: Marker) -> Polynomial:
    """Coefficients of the ground from a row on, times a factor."""
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
    """Ground accelerations [g] about where a lane is in its interval, the horizontal times side."""
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
def _seat(pool: Float, q: int, who: int, asked: Float) -> None:
    """Give a lane to a scenario, at rest at the start of its motion."""
    h = asked[who, TIME_STEP]
    p_hat = asked[who, P_HAT] * h
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = 0.0
    pool[q + ALPHA] = asked[who, SLENDERNESS]
    # sin(theta) = sin(alpha) cos(psi) - cos(alpha) sin(psi) on this side: ties turn gravity
    turned = p_hat * p_hat * asked[who, TIE_STIFFNESS]
    pool[q + P2] = p_hat * p_hat - turned * math.cos(asked[who, SLENDERNESS])
    pool[q + TIE] = p_hat * p_hat * asked[who, TIE_FORCE]
    pool[q + _TURNED] = turned * math.sin(asked[who, SLENDERNESS])
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
    pool[q + _WHO] = who


@inlined
def _empty(pool: Float, q: int) -> None:
    """Take a lane's scenario away; what is left is never flown."""
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = 0.0
    pool[q + AT] = 0.0
    pool[q + END] = 0.0
    pool[q + PENDING] = 1.0
    pool[q + _WHO] = -1.0


@inlined
def _still(bounds: Float, i: int, factor: float, limit: float, hold: float, lifts: Marker) -> bool:
    """Say if no ground within these bounds uplifts."""
    if len(lifts) > 0:
        return bool(factor * (bounds[i, 0] + limit * bounds[i, 1]) <= limit + hold)
    return bool(factor * bounds[i, 0] <= limit + hold)


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
) -> None:
    """Take a lane at rest to its uplift, or to the end of its motion."""
    who = _index(pool[q + _WHO])
    limit = pool[q + _LIMIT]
    hold = pool[q + _HOLD]
    factor = abs(asked[who, SCALE])
    at = _index(pool[q + AT])
    end = _index(pool[q + END])
    waits = True
    while waits and at < end:
        if pool[q + ELAPSED] == 0.0:
            while at < end and _still(bounds, at, factor, limit, hold, lifts):
                at += 1
                while (
                    at % COARSE == 0
                    and at + COARSE <= end
                    and _still(coarse, at // COARSE, factor, limit, hold, lifts)
                ):
                    at += COARSE
        pool[q + AT] = at
        if at < end:
            a, v = _ground_of(pool, q, ground, asked, 1.0, curved, lifts)
            wait, start = lift_off(a, v, limit, hold, 1.0 - pool[q + ELAPSED])
            waits = wait == NEVER
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


@inlined
def _file(
    pool: Float, q: int, asked: Float, summaries: Float, peak: float, fast: float, interval: float
) -> None:
    """Store the results of a lane's scenario; `interval` is when it overturned, or NaN."""
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    summaries[who, PEAK_ROTATION] = peak
    summaries[who, PEAK_TIME] = math.nan
    summaries[who, UPLIFT_TIME] = pool[q + _UPLIFT]
    summaries[who, OVERTURNING_TIME] = asked[who, START_TIME] + interval * h
    summaries[who, IMPACTS] = pool[q + _COUNT]
    summaries[who, PEAK_VELOCITY] = fast / h
    summaries[who, IMPACT_VELOCITY] = pool[q + _HARDEST] / h


@inlined
def _end(
    pool: Float,
    q: int,
    asked: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    tied: Marker,
    tie_log: Float,
) -> None:
    """Decide the outcome of a lane at the end of its motion by its energy, and empty it."""
    who = _index(pool[q + _WHO])
    side = 0.0 if pool[q + _SIDE] == 0.0 else 1.0
    if len(tied) > 0:
        overturns, after, peak, fast, landed, landing = elastic_tail(
            pool[q + THETA],
            pool[q + OMEGA],
            side,
            pool[q + ALPHA],
            asked[who, P_HAT] * asked[who, TIME_STEP],
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
            asked[who, P_HAT] * asked[who, TIME_STEP],
            asked[who, RESTITUTION],
        )
    if overturns:
        verdicts[who] = OVERTURNED
    else:
        verdicts[who] = NO_UPLIFT if math.isnan(pool[q + _UPLIFT]) else SAFE
    if not math.isnan(landed):
        pool[q + _COUNT] += 1.0
    pool[q + _HARDEST] = max(pool[q + _HARDEST], abs(landing))
    peak = max(peak, pool[q + PEAK], pool[q + THETA])
    fast = max(fast, pool[q + FASTEST], abs(pool[q + OMEGA]))
    _file(pool, q, asked, summaries, peak, fast, asked[who, INTERVALS] + after)
    _empty(pool, q)


@inlined
def _dies_out(
    pool: Float, q: int, who: int, asked: Float, a: Polynomial, v: Polynomial
) -> tuple[float, float, float]:
    """Return how long, how often and how high a lane that just landed still bounces.

    How long is NaN where the sums below do not hold.


    A flight at the rate omega against a pull f takes 2 omega / f, and lands faster by a share of
    2 omega f' / (3 f^2); the next begins slower by the restitution e, against the other side's
    pull. Both are sums of powers of e^2, as long as f and f' change little and the ground lifts
    neither side.
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
    """Land a lane after t at a rate, and start it on the other side; whether it now rests.

    Or whether it landed with the end of its interval, which needs the same attention.
    """
    who = _index(pool[q + _WHO])
    pool[q + _COUNT] += 1.0
    pool[q + _HARDEST] = max(pool[q + _HARDEST], abs(omega))
    pool[q + START] = MOVING
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = -asked[who, RESTITUTION] * omega
    pool[q + ELAPSED] += t
    pool[q + _SIDE] = -pool[q + _SIDE]
    pool[q + _PUSH] = -pool[q + _PUSH]
    if pool[q + OMEGA] < max(pool[q + _SLOWEST], pool[q + _CALM]):
        a, v = _ground_of(pool, q, ground, asked, 1.0, curved, lifts)
        if pool[q + OMEGA] < pool[q + _SLOWEST]:
            needed = pool[q + _LIMIT] * (1.0 + v[0]) + pool[q + _HOLD]
            if abs(a[0]) <= needed or omega == 0.0:
                pool[q + OMEGA] = 0.0
                pool[q + _SIDE] = 0.0
        else:
            lasts, bounces, highest = _dies_out(pool, q, who, asked, a, v)
            if not math.isnan(lasts):
                pool[q + PEAK] = max(pool[q + PEAK], highest)
                pool[q + _COUNT] += bounces
                pool[q + ELAPSED] += lasts
                pool[q + OMEGA] = 0.0
                pool[q + _SIDE] = 0.0
    whole = pool[q + ELAPSED] >= 1.0
    if whole:
        pool[q + ELAPSED] = 0.0
        pool[q + AT] += 1.0
        _load(pool, q, ground, curved, lifts, tied)
    else:
        for k in range(6 if len(curved) > 0 else 2):
            pool[q + A + k * WIDTH] = -pool[q + A + k * WIDTH]
        if len(tied) > 0:
            pool[q + A] += 2.0 * pool[q + _TURNED]
    return bool(whole or pool[q + _SIDE] == 0.0)


@inlined
def _note(
    pool: Float,
    q: int,
    asked: Float,
    ahead: Float,
    excursions: Float,
    curved: Marker,
    lifts: Marker,
) -> None:
    """Keep the excursion that a lane begins, if it is one of the highest."""
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    alpha = asked[who, SLENDERNESS]
    elapsed = pool[q + ELAPSED]
    node = _index(pool[q + AT] + asked[who, AHEAD])
    side = pool[q + _SIDE]
    rate = asked[who, P_HAT] * h
    at_node = side * ahead[node, 0]
    on = side * ahead[node + 1, 0] - at_node
    slope = pool[q + A + WIDTH]  # of the ground, scaled and times the square of the rate
    if len(lifts) > 0:
        at_node += alpha * ahead[node, 1]
        on += alpha * (ahead[node + 1, 1] - ahead[node, 1])
        slope += alpha * pool[q + V + WIDTH]
    if len(curved) > 0:
        for k in range(2, 6):
            slope += pool[q + A + k * WIDTH]
            if len(lifts) > 0:
                slope += alpha * pool[q + V + k * WIDTH]
    # its second derivative is the rate times what its slope exceeds that of the ground by
    bend = rate * asked[who, SCALE] * on - slope / rate
    still = asked[who, SCALE] * (at_node + elapsed * on) - 0.5 * elapsed * (1.0 - elapsed) * bend
    outwards = pool[q + OMEGA] / rate - still
    start = asked[who, START_TIME] + (pool[q + AT] - asked[who, FIRST] + elapsed) * h
    keep(excursions, who, start, side, outwards / alpha - 1.0)


@inlined
def _fly_on(pool: Float, q: int, theta: float, omega: float) -> None:
    """Put a lane at the end of its interval, aloft."""
    pool[q + THETA] = theta
    pool[q + OMEGA] = omega
    pool[q + ELAPSED] = 0.0
    pool[q + START] = MOVING
    pool[q + AT] += 1.0
    pool[q + PENDING] = 0.0


@compiled
def integrate_lanes(  # noqa: C901  one loop, see above
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
) -> None:
    """Integrate scenarios from rest.

    Parameters
    ----------
    ground : array, shape (coefficients,)
        Rows of the ground motions, one after the other: the coefficients of the horizontal
        acceleration [g] in powers of the time since each interval's start over its length, two, or
        six where the ground is `curved`; then, if it `lifts`, those of the vertical one. At least
        one row follows the last motion.
    bounds : array, shape (rows, 1 or 2)
        Largest |acceleration| [g] in each interval, or more; then of the vertical one.
    coarse : array, shape (rows / COARSE, rounded down, 1 or 2)
        The largest of each COARSE of them, from the first row on.
    curved, lifts : NO or YES
        What form the rows have.
    tied : NO or YES
        Whether the frames have ties; none of these yields.
    asked : array, shape (scenarios, ASKED_SIZE)
        Values of the named slots of each scenario.
    verdicts : array of int8, shape (scenarios,)
        Filled with the outcomes.
    summaries : array, shape (scenarios, SUMMARY_SIZE)
        Filled with the values of the kernel's named slots; the time of the peak is not kept.
    ahead : array, shape (nodes, 1 or 2)
        What `fill_ahead` tells of the ground motions for each frequency parameter.
    excursions : array, shape (scenarios, kept, EXCURSION_SIZE)
        Holds distances of minus infinity; filled, in no order, with those excursions that begin
        highest. Without scenarios if they are not asked for.
    """
    total = asked.shape[0]
    notes = excursions.shape[0] > 0
    pool = np.zeros(_BLOCKS * _BLOCK)
    # a round takes as long for empty lanes as for others: a few scenarios have but a few blocks;
    # the loops below keep their constant bounds, without which they are not made of vectors
    used = min(_BLOCKS, (total + WIDTH - 1) // WIDTH) * _BLOCK
    pack = np.zeros(PACK_SIZE)
    tie_log = np.zeros((2, TIE_LOG_SIZE))
    # unsigned, so that no index can be negative, which would have to be looked for
    fresh = np.zeros(_LANES, dtype=np.uint32)  # lanes that need attention
    pending = np.zeros(_LANES, dtype=np.uint32)  # lanes that wait for a hop
    freshes = 0
    waiting = 0
    live = 0
    following = 0
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
                while True:
                    if pool[q + _WHO] < 0.0:
                        if following == total:
                            break
                        _seat(pool, q, following, asked)
                        following += 1
                        live += 1
                    if pool[q + _SIDE] == 0.0:
                        _wait_for_uplift(
                            pool, q, ground, bounds, coarse, asked, curved, lifts, tied
                        )
                        if notes and pool[q + AT] < pool[q + END]:
                            _note(pool, q, asked, ahead, excursions, curved, lifts)
                    if pool[q + AT] < pool[q + END]:
                        pool[q + PENDING] = 1.0
                        pending[waiting] = q
                        waiting += 1
                        break
                    _end(pool, q, asked, verdicts, summaries, tied, tie_log)
                    live -= 1
            freshes = 0
            # a pack that is not full waits too, as long as others fly
            if waiting == 0 or (waiting < WIDTH and waiting < live):
                break
            taken = min(waiting, WIDTH)
            waiting -= taken
            back = waiting
            for k in range(taken):
                q = _index(pending[back + k])
                for r in range(0, A, WIDTH):
                    pack[k + r] = pool[q + r]
                for r in range(0, (6 if len(curved) > 0 else 2) * WIDTH, WIDTH):
                    pack[k + A + r] = pool[q + A + r]
                    if len(lifts) > 0:
                        pack[k + V + r] = pool[q + V + r]
                if len(tied) > 0:
                    pack[k + TIE] = pool[q + TIE]
            hop(pack, curved, lifts, tied)
            for k in range(taken):
                q = _index(pending[back + k])
                pool[q + PEAK] = pack[k + PEAK]
                pool[q + FASTEST] = pack[k + FASTEST]
                if pack[k + KIND] == HOP_ALOFT:
                    _fly_on(pool, q, pack[k + THETA_AFTER], pack[k + OMEGA_AFTER])
                    continue
                if pack[k + KIND] == HOP_LANDED:
                    t = pack[k + TAU]
                    omega = pack[k + OMEGA_AFTER]
                else:
                    a, v = _ground_of(pool, q, ground, asked, pool[q + _SIDE], curved, lifts)
                    start = int(pool[q + START])
                    if len(tied) > 0:
                        who = _index(pool[q + _WHO])
                        c = taylor(
                            pool[q + THETA],
                            pool[q + OMEGA],
                            1.0,
                            a,
                            v,
                            pool[q + ALPHA],
                            (asked[who, P_HAT] * asked[who, TIME_STEP]) ** 2,
                            start,
                            (asked[who, TIE_STIFFNESS], asked[who, TIE_FORCE]),
                        )
                    else:
                        c = taylor(
                            pool[q + THETA],
                            pool[q + OMEGA],
                            1.0,
                            a,
                            v,
                            pool[q + ALPHA],
                            pool[q + P2],
                            start,
                            (),
                        )
                    ended, t, theta, omega, high, _, fast = flight(
                        c, 1.0, 1.0 - pool[q + ELAPSED], start, pool[q + PEAK]
                    )
                    pool[q + PEAK] = max(high, pool[q + PEAK])
                    pool[q + FASTEST] = max(fast, pool[q + FASTEST])
                    if ended == ALOFT:
                        _fly_on(pool, q, theta, omega)
                        continue
                    if ended == FALLEN:
                        who = _index(pool[q + _WHO])
                        verdicts[who] = OVERTURNED
                        fallen = pool[q + AT] - asked[who, FIRST] + pool[q + ELAPSED] + t
                        _file(pool, q, asked, summaries, HALF_PI, pool[q + FASTEST], fallen)
                        _empty(pool, q)
                        live -= 1
                        fresh[freshes] = q
                        freshes += 1
                        continue
                attention = _rebound(pool, q, t, omega, ground, asked, curved, lifts, tied)
                if notes and pool[q + _SIDE] != 0.0 and pool[q + AT] < pool[q + END]:
                    _note(pool, q, asked, ahead, excursions, curved, lifts)
                if attention:
                    fresh[freshes] = q
                    freshes += 1
                else:
                    pending[waiting] = q
                    waiting += 1
        if live == 0:
            break
        # loads of all blocks before the first stride: a vector cannot read what was just written
        for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
            if b >= used:
                break
            for q in range(b, b + WIDTH):
                _load(pool, q, ground, curved, lifts, tied)
        for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
            if b >= used:
                break
            stride(pool, b, curved, lifts, tied)
            for q in range(b, b + WIDTH):
                if pool[q + SEEN] == 0.0:
                    fresh[freshes] = q
                    freshes += 1
