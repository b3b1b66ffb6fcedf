"""The vectorised kernel of two unequal columns: many scenarios side by side, one in each lane.

It works in the rounds of `rocking.kernels.lanes`, and uses the strides and hops of its vectors. A
lane also contains the polynomials of the piece of the course in which it is. It leaves the vectors
to change to another piece, as it does at an impact, at uplift, and at the end of its motion.

Private functions are compiled into their callers.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels import NO_UPLIFT, OVERTURNS, STANDS
from rockframe.rocking.kernels.lanes import COARSE
from rockframe.rocking.kernels.steps import (
    ALOFT,
    FALLEN,
    FROM_UPLIFT,
    HALF_PI,
    MOVING,
    NEVER,
    Marker,
    Polynomial,
    exceed_bound,
    flight,
    most_events,
    shift,
)
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO, touches
from rockframe.rocking.kernels.vectors import (
    AT,
    ELAPSED,
    END,
    FASTEST,
    HOP_ALOFT,
    HOP_LANDED,
    KIND,
    OMEGA,
    OMEGA_AFTER,
    PACK_SIZE,
    PEAK,
    PENDING,
    SEEN,
    SERIES,
    START,
    TAU,
    THETA,
    THETA_AFTER,
    WIDTH,
    A,
    V,
    advance,
    close_block,
    locate,
    take_off,
    zeros,
)
from rockframe.unequal.kernels import kernel
from rockframe.unequal.kernels.steps import (
    BOUNCE,
    DEGREE,
    LIMIT,
    PIECE_SIZE,
    PIECE_WIDTH,
    PIECES_FROM,
    PULL,
    PUSH,
    SIDE_SIZE,
    Bends,
    Curve,
    bends,
    lift_off,
    middle_of,
    piece_of,
    pull_at_rest,
    tail,
)

Float = NDArray[np.float64]

# Slots of a requested scenario.
FIRST: Final = 0  # first row of its ground motion
INTERVALS: Final = 1  # number of rows, one for each interval
TIME_STEP: Final = 2  # length of an interval [s]
START_TIME: Final = 3  # time of the first node [s]
SCALE: Final = 4
TABLE: Final = 5  # where the numbers of its bent begin
FREQUENCY: Final = 6  # largest rate at which the motion changes [s-1]
ASKED_SIZE: Final = 7

#: As in the kernel of equal columns: largest change of the pull within bounces that are summed.
_EVEN_PULL: Final = 1e-2
_BLOCKS: Final = 9
_LANES: Final = _BLOCKS * WIDTH

# Rows of a block beside those of `vectors`; a pack has the first ones, too.
_PULL: Final = PACK_SIZE  # polynomial of G in the piece, times the square of the interval
_PUSH: Final = _PULL + (DEGREE + 1) * WIDTH  # the same of H
_MIDDLE: Final = _PUSH + (DEGREE + 1) * WIDTH  # middle of the piece
_FLOOR: Final = _MIDDLE + WIDTH  # start of the piece
_TOP: Final = _FLOOR + WIDTH  # its end
_PACK: Final = _TOP + WIDTH
_SIDE: Final = _PACK  # +1 right, -1 left, 0 at rest
_SCALE: Final = _SIDE + WIDTH  # factor of the ground acceleration
_OTHER: Final = _SCALE + WIDTH  # largest course of the other side
_SLOWEST: Final = _OTHER + WIDTH  # rate below which the bent comes to rest
_CALM: Final = _SLOWEST + WIDTH  # rate below which `_dies_out` is tried
_UPLIFT: Final = _CALM + WIDTH  # time of the first uplift
_COUNT: Final = _UPLIFT + WIDTH  # number of impacts
_WHO: Final = _COUNT + WIDTH  # the scenario, -1 if none
_EVENTFUL: Final = _WHO + WIDTH  # row of the ground of the last impact
_EVENTS: Final = _EVENTFUL + WIDTH  # number of impacts that this row may still have
_LAST_SIDE: Final = _EVENTS + WIDTH  # side that the row PEAK belongs to
_BLOCK: Final = _LAST_SIDE + WIDTH

# What a lane needs after a hop.
_STRIDE: Final = 0
_HOP: Final = 1
_ATTENTION: Final = 2

# Counts of scenarios: those that have begun, and those that are in lanes.
_BEGUN: Final = 0
_LIVE: Final = 1


@inlined
def _index(number: float | np.uint32) -> int:
    """Return a non-negative whole number as an index that the compiler knows is not negative."""
    return int(np.int64(np.uint32(number)))


@inlined
def _row(at: float, curved: Marker, lifts: Marker) -> np.uint64:
    """Return the index at which a row of the ground begins."""
    return np.uint64(at) * np.uint64((6 if len(curved) > 0 else 2) * (2 if len(lifts) > 0 else 1))


@inlined
def _load(pool: Float, q: int, ground: Float, curved: Marker, lifts: Marker) -> None:
    """Fill the rows A and V of a lane with the ground motion in its interval."""
    scale = pool[q + _SCALE]
    push = pool[q + _SIDE] * scale
    powers = 6 if len(curved) > 0 else 2
    row = _row(pool[q + AT], curved, lifts)
    for k in range(powers):
        pool[q + A + k * WIDTH] = push * ground[row + np.uint64(k)]
    if len(lifts) > 0:
        pool[q + V] = 1.0 + scale * ground[row + np.uint64(powers)]
        for k in range(1, powers):
            pool[q + V + k * WIDTH] = scale * ground[row + np.uint64(powers + k)]


@inlined
def _rows(pool: Float, at: int, curved: Marker) -> Polynomial:
    """Return a polynomial of the ground from the rows of a lane."""
    if len(curved) == 0:
        return pool[at], pool[at + WIDTH], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return (
        pool[at],
        pool[at + WIDTH],
        pool[at + 2 * WIDTH],
        pool[at + 3 * WIDTH],
        pool[at + 4 * WIDTH],
        pool[at + 5 * WIDTH],
        0.0,
        0.0,
        0.0,
        0.0,
    )


@inlined
def _curve(pool: Float, at: int) -> Curve:
    return (
        pool[at],
        pool[at + WIDTH],
        pool[at + 2 * WIDTH],
        pool[at + 3 * WIDTH],
        pool[at + 4 * WIDTH],
        pool[at + 5 * WIDTH],
        pool[at + 6 * WIDTH],
        pool[at + 7 * WIDTH],
    )


@inlined
def _lane_bends(
    pool: Float, j: int, elapsed: float, pushed: float, curved: Marker, lifts: Marker
) -> Bends:
    """Return the Taylor coefficients of -s'' of a lane, `elapsed` after the interval's start."""
    a = _rows(pool, j + A, curved)
    v = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if len(lifts) > 0:
        v = _rows(pool, j + V, curved)
    if len(curved) > 0:
        a = shift(a, elapsed)
        if len(lifts) > 0:
            v = shift(v, elapsed)
    else:
        a = (a[0] + elapsed * a[1], a[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if len(lifts) > 0:
            v = (v[0] + elapsed * v[1], v[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return bends(
        pool[j + THETA] - pool[j + _MIDDLE],
        pool[j + OMEGA],
        a,
        v,
        pushed,
        _curve(pool, j + _PULL),
        _curve(pool, j + _PUSH),
        curved,
        lifts,
    )


@inlined
def _stride(pool: Float, b: int, curved: Marker, lifts: Marker) -> None:
    """Take each lane of a block to the end of its interval, if no event happens in it."""
    for j in range(b, b + WIDTH):
        a = _rows(pool, j + A, curved)
        v = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if len(lifts) > 0:
            v = _rows(pool, j + V, curved)
        s, rate = pool[j + THETA], pool[j + OMEGA]
        pull, push = _curve(pool, j + _PULL), _curve(pool, j + _PUSH)
        bent = bends(s - pool[j + _MIDDLE], rate, a, v, 1.0, pull, push, curved, lifts)
        advance(pool, j, s, rate, bent, pool[j + _FLOOR], pool[j + _TOP])


@inlined
def _hop(pack: Float, curved: Marker, lifts: Marker) -> None:
    """Take each lane of a pack from within its interval to its landing or the interval's end."""
    for j in range(WIDTH):
        pushed = 0.0 if pack[j + START] == FROM_UPLIFT else 1.0
        take_off(pack, j, _lane_bends(pack, j, pack[j + ELAPSED], pushed, curved, lifts))
    locate(pack)


@inlined
def _here(pool: Float, q: int, asked: Float) -> int:
    """Return where the numbers of a lane's side begin."""
    table = _index(asked[_index(pool[q + _WHO]), TABLE])
    return table if pool[q + _SIDE] > 0.0 else table + SIDE_SIZE


@inlined
def _place(pool: Float, q: int, asked: Float, tables: Float) -> None:
    """Give a lane the polynomials of the piece of the course in which it is."""
    unit = asked[_index(pool[q + _WHO]), TIME_STEP] ** 2
    piece = piece_of(pool[q + THETA])
    at = _here(pool, q, asked) + PIECES_FROM + piece * PIECE_SIZE
    for k in range(DEGREE + 1):
        pool[q + _PULL + k * WIDTH] = unit * tables[at + PULL + k]
        pool[q + _PUSH + k * WIDTH] = unit * tables[at + PUSH + k]
    pool[q + _MIDDLE] = middle_of(piece)
    pool[q + _FLOOR] = piece * PIECE_WIDTH
    pool[q + _TOP] = min((piece + 1) * PIECE_WIDTH, HALF_PI)


@inlined
def _take_side(pool: Float, q: int, side: float) -> None:
    """Let a lane rock on a side (+1 or -1), with the peak of that side."""
    if pool[q + _LAST_SIDE] != side:
        pool[q + PEAK], pool[q + _OTHER] = pool[q + _OTHER], pool[q + PEAK]
    pool[q + _LAST_SIDE] = side
    pool[q + _SIDE] = side


@inlined
def _seat(pool: Float, q: int, who: int, asked: Float, tables: Float) -> None:
    """Put a scenario into a lane, at rest at the start of its motion."""
    h = asked[who, TIME_STEP]
    table = _index(asked[who, TABLE])
    kept = math.sqrt(tables[table + BOUNCE] * tables[table + SIDE_SIZE + BOUNCE])
    pull = min(
        pull_at_rest(tables, table, h * h, 0.0, 0.0),
        pull_at_rest(tables, table + SIDE_SIZE, h * h, 0.0, 0.0),
    )
    for row in (THETA, OMEGA, PEAK, ELAPSED, _SIDE, _OTHER, _COUNT):
        pool[q + row] = 0.0
    pool[q + FASTEST] = math.inf  # not computed
    pool[q + AT] = asked[who, FIRST]
    pool[q + END] = asked[who, FIRST] + asked[who, INTERVALS]
    pool[q + PENDING] = 1.0
    pool[q + _LAST_SIDE] = 1.0
    pool[q + _SCALE] = asked[who, SCALE]
    pool[q + _SLOWEST] = REST_VELOCITY_RATIO * asked[who, FREQUENCY] * h
    pool[q + _CALM] = _EVEN_PULL * pull * (1.0 - kept)
    pool[q + _UPLIFT] = math.nan
    pool[q + _EVENTFUL] = -1.0
    pool[q + _WHO] = who


@inlined
def _empty(pool: Float, q: int) -> None:
    """Remove the scenario of a lane; an empty lane is never advanced."""
    for row in (THETA, OMEGA, AT, END, _SIDE, _SCALE):
        pool[q + row] = 0.0
    pool[q + PENDING] = 1.0
    pool[q + _WHO] = -1.0


@inlined
def _still(bounds: Float, i: int, factor: float, limit: float, lifts: Marker) -> bool:
    """Return True if no ground motion within these bounds uplifts the bent."""
    if len(lifts) > 0:
        return bool(factor * (bounds[i, 0] + limit * bounds[i, 1]) <= limit)
    return bool(factor * bounds[i, 0] <= limit)


@inlined
def _ground_of(
    pool: Float, q: int, ground: Float, curved: Marker, lifts: Marker
) -> tuple[Polynomial, Polynomial]:
    """Return the scaled ground accelerations [g] about a lane's present time."""
    scale = pool[q + _SCALE]
    row = _row(pool[q + AT], curved, lifts)
    powers = np.uint64(6 if len(curved) > 0 else 2)
    a = shift(_scaled(ground, row, scale, curved), pool[q + ELAPSED])
    v = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if len(lifts) > 0:
        v = shift(_scaled(ground, row + powers, scale, curved), pool[q + ELAPSED])
    return a, v


@inlined
def _scaled(ground: Float, row: np.uint64, factor: float, curved: Marker) -> Polynomial:
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
def _wait_for_uplift(
    pool: Float,
    q: int,
    ground: Float,
    bounds: Float,
    coarse: Float,
    curved: Marker,
    lifts: Marker,
    asked: Float,
    tables: Float,
) -> None:
    """Advance a lane at rest to its next uplift, or to the end of its motion."""
    who = _index(pool[q + _WHO])
    table = _index(asked[who, TABLE])
    limit = min(tables[table + LIMIT], tables[table + SIDE_SIZE + LIMIT])
    factor = abs(asked[who, SCALE])
    unit = asked[who, TIME_STEP] ** 2
    at = _index(pool[q + AT])
    end = _index(pool[q + END])
    waits = True
    while waits and at < end:
        if pool[q + ELAPSED] == 0.0:
            while at < end and _still(bounds, at, factor, limit, lifts):
                at += 1
                while (
                    at % COARSE == 0
                    and at + COARSE <= end
                    and _still(coarse, at // COARSE, factor, limit, lifts)
                ):
                    at += COARSE
        pool[q + AT] = at
        if at < end:
            a, v = _ground_of(pool, q, ground, curved, lifts)
            span = 1.0 - pool[q + ELAPSED]
            wait, start, side = lift_off(a, v, tables, table, unit, span)
            waits = wait == NEVER
            if waits:
                pool[q + ELAPSED] = 0.0
                at += 1
                pool[q + AT] = at
            else:
                pool[q + ELAPSED] += wait
                pool[q + START] = start
                _take_side(pool, q, 1.0 - 2.0 * side)
                _place(pool, q, asked, tables)
                if math.isnan(pool[q + _UPLIFT]):
                    interval = at - asked[who, FIRST] + pool[q + ELAPSED]
                    pool[q + _UPLIFT] = asked[who, START_TIME] + interval * asked[who, TIME_STEP]
                _load(pool, q, ground, curved, lifts)


@inlined
def _file(pool: Float, q: int, asked: Float, summaries: Float, fallen: float) -> None:
    """Store a lane's results; `fallen` is the time of overturning [intervals], or NaN."""
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    right = pool[q + _LAST_SIDE] > 0.0
    summaries[who, kernel.PEAK_RIGHT] = pool[q + PEAK] if right else pool[q + _OTHER]
    summaries[who, kernel.PEAK_LEFT] = pool[q + _OTHER] if right else pool[q + PEAK]
    summaries[who, kernel.PEAK_TIME] = math.nan
    summaries[who, kernel.UPLIFT_TIME] = pool[q + _UPLIFT]
    summaries[who, kernel.OVERTURNING_TIME] = asked[who, START_TIME] + fallen * h
    summaries[who, kernel.IMPACTS] = pool[q + _COUNT]


@inlined
def _end(
    pool: Float,
    q: int,
    asked: Float,
    tables: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> None:
    """Decide the outcome of a lane from its energy at the end of its motion, and empty the lane."""
    who = _index(pool[q + _WHO])
    h = asked[who, TIME_STEP]
    frequency = asked[who, FREQUENCY]
    after = math.nan
    if pool[q + _SIDE] != 0.0 and touches(pool[q + THETA], pool[q + OMEGA], frequency * h):
        _forget_touch(pool, q)
        pool[q + _SIDE] = 0.0
    falls = False
    if pool[q + _SIDE] != 0.0:
        side = 0 if pool[q + _SIDE] > 0.0 else 1
        table = _index(asked[who, TABLE])
        falls, after, right, left, landings = tail(
            tables, table, side, pool[q + THETA], pool[q + OMEGA] / h, frequency
        )
        own, other = (right, left) if side == 0 else (left, right)
        pool[q + PEAK] = max(pool[q + PEAK], own)
        pool[q + _OTHER] = max(pool[q + _OTHER], other)
        pool[q + _COUNT] += landings
    if falls:
        verdicts[who] = OVERTURNS
    else:
        verdicts[who] = NO_UPLIFT if math.isnan(pool[q + _UPLIFT]) else STANDS
    _file(pool, q, asked, summaries, asked[who, INTERVALS] + after / h)
    _empty(pool, q)


@inlined
def _forget_touch(pool: Float, q: int) -> None:
    """Remove an uplift by round-off from the results, unless the bent has rocked before."""
    if pool[q + _COUNT] == 0.0:
        pool[q + PEAK] = 0.0
        pool[q + _OTHER] = 0.0
        pool[q + _UPLIFT] = math.nan


@inlined
def _dies_out(
    pool: Float, q: int, table: int, unit: float, tables: Float, a: Polynomial, v: Polynomial
) -> tuple[float, float, float, float]:
    """Return duration, number and both largest courses of the bounces after a landing.

    The duration is NaN where the closed forms are not valid. As for equal columns: a flight that
    starts at the rate w against a pull f takes 2 w / f; here pull and share of the speed that an
    impact keeps alternate between the sides.
    """
    right = pool[q + _SIDE] > 0.0
    own = table if right else table + SIDE_SIZE
    opposite = table + SIDE_SIZE if right else table
    across = pool[q + _SIDE] * a[0]
    here = pull_at_rest(tables, own, unit, across, v[0])
    there = pull_at_rest(tables, opposite, unit, -across, v[0])
    first, second = tables[own + BOUNCE], tables[opposite + BOUNCE]
    kept = first * second
    pull = pull_at_rest(tables, own, unit, 0.0, 0.0)
    push = pull_at_rest(tables, own, unit, 1.0, 0.0) - pull
    steep = abs(pull * v[1]) + abs(push * a[1])
    for k in range(2, 6):
        steep += k * (abs(pull * v[k]) + abs(push * a[k]))
    rate = pool[q + OMEGA]
    least = min(here, there)
    lasts = 2.0 * rate / (1.0 - kept) * (1.0 / here + first / there)
    if least <= 0.0 or lasts * steep > _EVEN_PULL * least or pool[q + ELAPSED] + lasts >= 1.0:
        return math.nan, 0.0, 0.0, 0.0
    bounces = max(
        1.0, math.floor(2.0 * math.log(rate / pool[q + _SLOWEST]) / -math.log(kept)) + 1.0
    )
    high = 0.5 * rate * rate / here
    return lasts, bounces, high, 0.5 * (first * rate) ** 2 / there


@inlined
def _count_event(pool: Float, q: int, kept: float) -> None:
    """Report an internal error if a lane lands too often within an interval."""
    if pool[q + _EVENTFUL] != pool[q + AT]:
        pool[q + _EVENTFUL] = pool[q + AT]
        pool[q + _EVENTS] = most_events(kept)
    pool[q + _EVENTS] -= 1.0
    if pool[q + _EVENTS] < 0.0:
        exceed_bound()


@inlined
def _rebound(
    pool: Float,
    q: int,
    t: float,
    rate: float,
    ground: Float,
    curved: Marker,
    lifts: Marker,
    asked: Float,
    tables: Float,
) -> bool:
    """Apply the impact of a lane after time t, and start its rotation to the other side.

    Returns True if the lane needs attention: it now rests, or its interval has ended.
    """
    who = _index(pool[q + _WHO])
    table = _index(asked[who, TABLE])
    h = asked[who, TIME_STEP]
    kept = math.sqrt(tables[table + BOUNCE] * tables[table + SIDE_SIZE + BOUNCE])
    _count_event(pool, q, kept)
    own = _here(pool, q, asked)
    touched = touches(0.0, rate, asked[who, FREQUENCY] * h)
    if touched:
        _forget_touch(pool, q)
    else:
        pool[q + _COUNT] += 1.0
    pool[q + START] = MOVING
    pool[q + THETA] = 0.0
    pool[q + OMEGA] = -tables[own + BOUNCE] * rate
    pool[q + ELAPSED] += t
    _take_side(pool, q, -pool[q + _SIDE])
    rests = touched
    if not touched and pool[q + OMEGA] < max(pool[q + _SLOWEST], pool[q + _CALM]):
        a, v = _ground_of(pool, q, ground, curved, lifts)
        if pool[q + OMEGA] < pool[q + _SLOWEST]:
            up = 1.0 + v[0]
            right = -a[0] <= tables[table + LIMIT] * up
            rests = (right and a[0] <= tables[table + SIDE_SIZE + LIMIT] * up) or rate == 0.0
        else:
            lasts, bounces, high, other = _dies_out(pool, q, table, h * h, tables, a, v)
            if not math.isnan(lasts):
                pool[q + PEAK] = max(pool[q + PEAK], high)
                pool[q + _OTHER] = max(pool[q + _OTHER], other)
                pool[q + _COUNT] += bounces
                pool[q + ELAPSED] += lasts
                rests = True
    if rests:
        pool[q + OMEGA] = 0.0
        pool[q + _SIDE] = 0.0
    whole = pool[q + ELAPSED] >= 1.0
    if whole:
        pool[q + ELAPSED] = 0.0
        pool[q + AT] += 1.0
    if not rests:
        _place(pool, q, asked, tables)
        _load(pool, q, ground, curved, lifts)
    return bool(whole or rests)


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
    asked: Float,
    tables: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> bool:
    """Prepare a lane for a hop, with the next scenario if its own has ended.

    Returns False if no scenario is left for it.
    """
    while True:
        if pool[q + _WHO] < 0.0:
            if counts[_BEGUN] == asked.shape[0]:
                return False
            _seat(pool, q, counts[_BEGUN], asked, tables)
            counts[_BEGUN] += 1
            counts[_LIVE] += 1
        if pool[q + _SIDE] == 0.0:
            _wait_for_uplift(pool, q, ground, bounds, coarse, curved, lifts, asked, tables)
        if pool[q + AT] < pool[q + END]:
            pool[q + PENDING] = 1.0
            return True
        _end(pool, q, asked, tables, verdicts, summaries)
        counts[_LIVE] -= 1


@inlined
def _join(pack: Float, k: int, pool: Float, q: int, curved: Marker, lifts: Marker) -> None:
    """Copy a lane to a place in a pack."""
    for r in range(0, A, WIDTH):
        pack[k + r] = pool[q + r]
    for r in range(0, (6 if len(curved) > 0 else 2) * WIDTH, WIDTH):
        pack[k + A + r] = pool[q + A + r]
        if len(lifts) > 0:
            pack[k + V + r] = pool[q + V + r]
    for r in range(_PULL, _FLOOR, WIDTH):
        pack[k + r] = pool[q + r]


@inlined
def _flown(pack: Float, k: int) -> Polynomial:
    """Return the series of a hop."""
    return (
        pack[k + THETA],
        pack[k + OMEGA],
        pack[k + SERIES + 2 * WIDTH],
        pack[k + SERIES + 3 * WIDTH],
        pack[k + SERIES + 4 * WIDTH],
        pack[k + SERIES + 5 * WIDTH],
        pack[k + SERIES + 6 * WIDTH],
        pack[k + SERIES + 7 * WIDTH],
        pack[k + SERIES + 8 * WIDTH],
        pack[k + SERIES + 9 * WIDTH],
    )


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
    asked: Float,
    tables: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> int:
    """Move a lane to the end of its hop; return what it needs next."""
    pool[q + PEAK] = pack[k + PEAK]
    kind, t = pack[k + KIND], pack[k + TAU]
    s, rate = pack[k + THETA_AFTER], pack[k + OMEGA_AFTER]
    aloft = kind == HOP_ALOFT
    if kind != HOP_ALOFT and kind != HOP_LANDED:
        start = int(pool[q + START])
        span = 1.0 - pool[q + ELAPSED]
        ended, t, s, rate, high, _, _ = flight(_flown(pack, k), 1.0, span, start, pool[q + PEAK])
        pool[q + PEAK] = max(high, pool[q + PEAK])
        if ended == FALLEN:
            who = _index(pool[q + _WHO])
            verdicts[who] = OVERTURNS
            fallen = pool[q + AT] - asked[who, FIRST] + pool[q + ELAPSED] + t
            _file(pool, q, asked, summaries, fallen)
            _empty(pool, q)
            counts[_LIVE] -= 1
            return _ATTENTION
        aloft = ended == ALOFT
    if aloft:
        pool[q + THETA] = s
        pool[q + OMEGA] = rate
        pool[q + ELAPSED] = 0.0
        pool[q + START] = MOVING
        pool[q + AT] += 1.0
        pool[q + PENDING] = 0.0
        if not pool[q + _FLOOR] < s < pool[q + _TOP]:
            _place(pool, q, asked, tables)
        return _STRIDE
    attention = _rebound(pool, q, t, rate, ground, curved, lifts, asked, tables)
    return _ATTENTION if attention else _HOP


@inlined
def _advance(
    pool: Float,
    used: int,
    fresh: NDArray[np.uint32],
    ground: Float,
    curved: Marker,
    lifts: Marker,
) -> int:
    """Let all lanes stride; return the number of those that need attention, listed in `fresh`."""
    freshes = 0
    for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
        if b >= used:
            break
        for q in range(b, b + WIDTH):
            _load(pool, q, ground, curved, lifts)
    for b in range(0, _BLOCKS * _BLOCK, _BLOCK):
        if b >= used:
            break
        _stride(pool, b, curved, lifts)
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
    asked: Float,
    tables: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
) -> None:
    """Integrate scenarios from rest.

    Parameters
    ----------
    ground, bounds, coarse, curved, lifts
        As in `rocking.kernels.lanes.integrate_lanes`.
    asked : array, shape (scenarios, ASKED_SIZE)
        Values of the named slots of each scenario.
    tables : array, shape (numbers,)
        Numbers of the bents (`kernel`).
    verdicts : array of int8, shape (scenarios,)
        Filled with the outcomes.
    summaries : array, shape (scenarios, kernel.SUMMARY_SIZE)
        Filled with the kernel's named slots, except the time of the peak (NaN).
    """
    pool = zeros(_BLOCKS * _BLOCK)
    used = min(_BLOCKS, (asked.shape[0] + WIDTH - 1) // WIDTH) * _BLOCK
    pack = zeros(_PACK)
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
                    asked,
                    tables,
                    verdicts,
                    summaries,
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
                _join(pack, k, pool, _index(pending[back + k]), curved, lifts)
            _hop(pack, curved, lifts)
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
                    asked,
                    tables,
                    verdicts,
                    summaries,
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
        freshes = _advance(pool, used, fresh, ground, curved, lifts)
