"""The wobbling kernel: columns that roll on their rims, many members side by side.

`rockframe.wobbling.response` states the equations of motion. The variables here are tau = tan(theta
/ 2) times cos(phi) and sin(phi), and their rates. In them the equations contain no angle, so that
turning the ground motion turns all numbers, and they are smooth except at theta = 0, upright.

A member is one structure under one multiple of the motion. Each fills a lane; in a round, all lanes
take one step of the Runge-Kutta method of order 8 of Dormand and Prince, in loops that the compiler
vectorises, and then the events of each lane follow: samples, peaks, passes near upright, rest,
uplift, overturning. A lane whose member has ended takes the next one. The result of a member does
not depend on the others.

A step is at most `REACH` times the time in which the tilt could vanish, because the equations are
singular there. It ends at each sample, where the ground acceleration has a kink.

The functions check nothing; `rockframe.wobbling.response` checks the input. The file is long
because private functions are compiled into their callers, which must be in the same file.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.compiled import compiled, inlined
from rockframe.rocking.kernels import NO_UPLIFT, OVERTURNS, STANDS

Float = NDArray[np.float64]
Lanes = NDArray[np.int64]

#: Verdict of a member that needs more steps than any motion can: an internal error.
FAILED: Final = -1
#: Largest number of steps of a member: a constant, and a number for each sample of the motion.
_MOST_STEPS: Final = 1_000_000
_MOST_STEPS_PER_SAMPLE: Final = 1_000

#: Largest step over the time in which the tilt could vanish [1], at the closest point of a pass and
#: far from it, where the direction changes little. Measured: energy is then kept to 1e-12, and to
#: 1e-10 at twice these steps.
REACH: Final = 0.08
_FAR_REACH: Final = 0.3
#: Added to a divisor that can be 0.
_TINY: Final = 1e-300
#: Length of the series from rest, and time in which the tilt could vanish from which a pass is
#: computed in closed form, over 1 / sqrt(GZ) [1].
_SERIES: Final = 1e-3
_PASS: Final = 1e-9
#: Excess of the ground's pull over that of gravity up to which a column stays at rest [1]. It would
#: tilt by less than 1e-12 between two samples, in steps without number.
_LIFTS: Final = 1e-7
#: Relative error of the radial velocity at which the instant of a pass is located [1].
_LOCATED: Final = 1e-9
_LOCATING_STEPS: Final = 8

# Slots of a member. The first seven are moments and inertias over the planar inertia A of a column
# with its share of the slab; the ground accelerations are in g.
GB: Final = 0  # moment of gravity that rights an upright column [s-2]
GZ: Final = 1  # moment of gravity on a horizontal column [s-2]
K0: Final = 2  # the inertia B is sin(theta)^2 (K0 + K1 tau + K2 tau^2) [1]
K1: Final = 3
K2: Final = 4
TIE_FORCE: Final = 5  # moment of the tendon of an upright column [s-2]
TIE_STIFFNESS: Final = 6  # growth of this moment with sin(theta / 2) [s-2]
LOSS: Final = 7  # share of the energy that a planar impact loses [1]
CONTACT: Final = 8  # tilt within which the far rim touches, over the speed [s]; 0: no loss
SCALE: Final = 9  # multiple of the ground motion [1]
REST: Final = 10  # energy below which the member is put to rest [s-2]
STRIDE: Final = 11  # longest step [s]
LENGTH: Final = 12  # factor on `REACH`: longer steps are less accurate [1]
MEMBER_SIZE: Final = 13

# Slots of a summary.
PEAK: Final = 0  # largest theta, also in free motion after the end [rad]
PEAK_TIME: Final = 1  # when [s]; NaN if after the end of the motion
UPLIFT_TIME: Final = 2  # first uplift [s], NaN if none
OVERTURNING_TIME: Final = 3  # theta = pi/2 [s], NaN if never
STEPS: Final = 4  # number of steps
SUMMARY_SIZE: Final = 5

#: Number of lanes: the widest vector of current processors.
WIDTH: Final = 8
ROW4: Final = 4 * WIDTH

# Rows of the pool, one number for each lane. A state takes four: both components of the tilt, and
# their rates.
STATE: Final = 0
BEFORE: Final = ROW4  # the state before the step
SUM: Final = 2 * ROW4  # weighted sum of slopes
SLOPES: Final = 3 * ROW4  # slopes of the twelve stages
H: Final = 15 * ROW4  # length of the step [s]
LIMIT: Final = H + WIDTH  # its largest length [s]
CLOCK: Final = H + 2 * WIDTH  # time since the sample before [s]
GROUND: Final = H + 3 * WIDTH  # a_x, a_y, a_z at that sample [g]
GROWTH: Final = H + 6 * WIDTH  # their rates [g s-1]
CONST: Final = H + 9 * WIDTH  # slots of the members
_POOL_SIZE: Final = CONST + MEMBER_SIZE * WIDTH

# Rows of the counters of the lanes.
MEMBER: Final = 0  # index of the member, -1 if the lane is empty
SAMPLE: Final = 1  # index of the sample before
TRIES: Final = 2  # steps towards the instant of a pass
COUNT: Final = 3  # steps of the member
_LANE_SIZE: Final = 4


@inlined
def _stage(pool: Float, c: float, into: int, tied: bool) -> None:
    """Store the slopes at a stage of the step, at the share `c` of its length.

    The function is long because the compiler vectorises only what is written in one loop.
    """
    for k in range(WIDTH):
        h = pool[k + H]
        x = pool[k + STATE] + h * pool[k + SUM]
        y = pool[k + STATE + WIDTH] + h * pool[k + SUM + WIDTH]
        vx = pool[k + STATE + 2 * WIDTH] + h * pool[k + SUM + 2 * WIDTH]
        vy = pool[k + STATE + 3 * WIDTH] + h * pool[k + SUM + 3 * WIDTH]
        t = pool[k + CLOCK] + c * h
        ax = pool[k + GROUND] + t * pool[k + GROWTH]
        ay = pool[k + GROUND + WIDTH] + t * pool[k + GROWTH + WIDTH]
        weight = 1.0 + pool[k + GROUND + 2 * WIDTH] + t * pool[k + GROWTH + 2 * WIDTH]
        gb = pool[k + CONST + GB * WIDTH]
        gz = pool[k + CONST + GZ * WIDTH]
        k1 = pool[k + CONST + K1 * WIDTH]
        k2 = pool[k + CONST + K2 * WIDTH]
        r2 = x * x + y * y
        r = math.sqrt(r2)
        one = 1.0 + r2
        q = pool[k + CONST + K0 * WIDTH] + r * (k1 + r * k2)
        inverse = 1.0 / (r * one * q)  # one division instead of three
        turn = one * q * inverse
        half = r * q * inverse  # cos(theta / 2)^2
        ex = x * turn
        ey = y * turn
        sine = 2.0 * r * half
        cosine = (1.0 - r2) * half
        bend = cosine * q + r * (0.5 * k1 + r * k2)  # B' / (2 sin(theta))
        outward = ex * vx + ey * vy
        across = ex * vy - ey * vx
        turn = across * turn  # phi'
        omega = 2.0 * half * outward
        ar = ex * ax + ey * ay
        at = ex * ay - ey * ax
        fall = (
            sine * bend * turn * turn
            - weight * (gb * cosine - gz * sine)
            - ar * (gb * sine + gz * cosine)
        )
        radial = r * omega * outward + 0.5 * one * fall - turn * across
        sideways = 2.0 * outward * turn - 0.5 * one * (
            at * (gb * r + gz) + 2.0 * bend * omega * turn
        ) * (r * one * inverse)
        pool[k + into] = vx
        pool[k + into + WIDTH] = vy
        pool[k + into + 2 * WIDTH] = ex * radial - ey * sideways
        pool[k + into + 3 * WIDTH] = ey * radial + ex * sideways
    if tied:
        for k in range(WIDTH):
            h = pool[k + H]
            x = pool[k + STATE] + h * pool[k + SUM]
            y = pool[k + STATE + WIDTH] + h * pool[k + SUM + WIDTH]
            r2 = x * x + y * y
            root = math.sqrt(1.0 + r2)  # 1 / cos(theta / 2)
            pull = 0.5 * (
                root * pool[k + CONST + TIE_FORCE * WIDTH] / math.sqrt(r2)
                + pool[k + CONST + TIE_STIFFNESS * WIDTH]
            )
            pool[k + into + 2 * WIDTH] -= x * pull
            pool[k + into + 3 * WIDTH] -= y * pull


@inlined
def _step(pool: Float, tied: bool) -> None:  # noqa: C901  a loop for each stage
    """Take the step H in all lanes; long because the sums of the method are written out."""
    for k in range(ROW4):
        pool[k + BEFORE] = pool[k + STATE]
        pool[k + SUM] = 0.0
    _stage(pool, 0.0, SLOPES + 0 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = 0.05260015195876773 * pool[k + SLOPES + 0 * ROW4]
    _stage(pool, 0.05260015195876773, SLOPES + 1 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.0197250569845379 * pool[k + SLOPES + 0 * ROW4]
            + 0.0591751709536137 * pool[k + SLOPES + 1 * ROW4]
        )
    _stage(pool, 0.0789002279381516, SLOPES + 2 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.02958758547680685 * pool[k + SLOPES + 0 * ROW4]
            + 0.08876275643042054 * pool[k + SLOPES + 2 * ROW4]
        )
    _stage(pool, 0.1183503419072274, SLOPES + 3 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.2413651341592667 * pool[k + SLOPES + 0 * ROW4]
            + -0.8845494793282861 * pool[k + SLOPES + 2 * ROW4]
            + 0.924834003261792 * pool[k + SLOPES + 3 * ROW4]
        )
    _stage(pool, 0.2816496580927726, SLOPES + 4 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.037037037037037035 * pool[k + SLOPES + 0 * ROW4]
            + 0.17082860872947386 * pool[k + SLOPES + 3 * ROW4]
            + 0.12546768756682242 * pool[k + SLOPES + 4 * ROW4]
        )
    _stage(pool, 0.3333333333333333, SLOPES + 5 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.037109375 * pool[k + SLOPES + 0 * ROW4]
            + 0.17025221101954405 * pool[k + SLOPES + 3 * ROW4]
            + 0.06021653898045596 * pool[k + SLOPES + 4 * ROW4]
            + -0.017578125 * pool[k + SLOPES + 5 * ROW4]
        )
    _stage(pool, 0.25, SLOPES + 6 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.03709200011850479 * pool[k + SLOPES + 0 * ROW4]
            + 0.17038392571223998 * pool[k + SLOPES + 3 * ROW4]
            + 0.10726203044637328 * pool[k + SLOPES + 4 * ROW4]
            + -0.015319437748624402 * pool[k + SLOPES + 5 * ROW4]
            + 0.008273789163814023 * pool[k + SLOPES + 6 * ROW4]
        )
    _stage(pool, 0.3076923076923077, SLOPES + 7 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.6241109587160757 * pool[k + SLOPES + 0 * ROW4]
            + -3.3608926294469414 * pool[k + SLOPES + 3 * ROW4]
            + -0.868219346841726 * pool[k + SLOPES + 4 * ROW4]
            + 27.59209969944671 * pool[k + SLOPES + 5 * ROW4]
            + 20.154067550477894 * pool[k + SLOPES + 6 * ROW4]
            + -43.48988418106996 * pool[k + SLOPES + 7 * ROW4]
        )
    _stage(pool, 0.6512820512820513, SLOPES + 8 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.47766253643826434 * pool[k + SLOPES + 0 * ROW4]
            + -2.4881146199716677 * pool[k + SLOPES + 3 * ROW4]
            + -0.590290826836843 * pool[k + SLOPES + 4 * ROW4]
            + 21.230051448181193 * pool[k + SLOPES + 5 * ROW4]
            + 15.279233632882423 * pool[k + SLOPES + 6 * ROW4]
            + -33.28821096898486 * pool[k + SLOPES + 7 * ROW4]
            + -0.020331201708508627 * pool[k + SLOPES + 8 * ROW4]
        )
    _stage(pool, 0.6, SLOPES + 9 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            -0.9371424300859873 * pool[k + SLOPES + 0 * ROW4]
            + 5.186372428844064 * pool[k + SLOPES + 3 * ROW4]
            + 1.0914373489967295 * pool[k + SLOPES + 4 * ROW4]
            + -8.149787010746927 * pool[k + SLOPES + 5 * ROW4]
            + -18.52006565999696 * pool[k + SLOPES + 6 * ROW4]
            + 22.739487099350505 * pool[k + SLOPES + 7 * ROW4]
            + 2.4936055526796523 * pool[k + SLOPES + 8 * ROW4]
            + -3.0467644718982196 * pool[k + SLOPES + 9 * ROW4]
        )
    _stage(pool, 0.8571428571428571, SLOPES + 10 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            2.273310147516538 * pool[k + SLOPES + 0 * ROW4]
            + -10.53449546673725 * pool[k + SLOPES + 3 * ROW4]
            + -2.0008720582248625 * pool[k + SLOPES + 4 * ROW4]
            + -17.9589318631188 * pool[k + SLOPES + 5 * ROW4]
            + 27.94888452941996 * pool[k + SLOPES + 6 * ROW4]
            + -2.8589982771350235 * pool[k + SLOPES + 7 * ROW4]
            + -8.87285693353063 * pool[k + SLOPES + 8 * ROW4]
            + 12.360567175794303 * pool[k + SLOPES + 9 * ROW4]
            + 0.6433927460157636 * pool[k + SLOPES + 10 * ROW4]
        )
    _stage(pool, 1.0, SLOPES + 11 * ROW4, tied)
    for k in range(ROW4):
        pool[k + SUM] = (
            0.054293734116568765 * pool[k + SLOPES + 0 * ROW4]
            + 4.450312892752409 * pool[k + SLOPES + 5 * ROW4]
            + 1.8915178993145003 * pool[k + SLOPES + 6 * ROW4]
            + -5.801203960010585 * pool[k + SLOPES + 7 * ROW4]
            + 0.3111643669578199 * pool[k + SLOPES + 8 * ROW4]
            + -0.1521609496625161 * pool[k + SLOPES + 9 * ROW4]
            + 0.20136540080403034 * pool[k + SLOPES + 10 * ROW4]
            + 0.04471061572777259 * pool[k + SLOPES + 11 * ROW4]
        )
    for j in range(4):
        for k in range(WIDTH):
            pool[k + STATE + j * WIDTH] += pool[k + H] * pool[k + SUM + j * WIDTH]


@inlined
def _plan(pool: Float) -> None:
    """Choose the length of the next step in all lanes."""
    for k in range(WIDTH):
        x = pool[k + STATE]
        y = pool[k + STATE + WIDTH]
        vx = pool[k + STATE + 2 * WIDTH]
        vy = pool[k + STATE + 3 * WIDTH]
        r = math.sqrt(x * x + y * y)
        ax = pool[k + GROUND]
        ay = pool[k + GROUND + WIDTH]
        pull = (
            pool[k + CONST + GB * WIDTH] * (1.0 + pool[k + GROUND + 2 * WIDTH])
            + pool[k + CONST + GZ * WIDTH] * math.sqrt(ax * ax + ay * ay)
            + pool[k + CONST + TIE_FORCE * WIDTH]
        )
        v2 = vx * vx + vy * vy
        turning = x * vy - y * vx
        # the distance over that at the closest point of a straight line, to the power of 1/8
        farther = math.sqrt(math.sqrt(math.sqrt(r * math.sqrt(v2) / (abs(turning) + _TINY))))
        nearer = min(REACH * max(farther, 1.0), _FAR_REACH)  # farther is 0 without any speed
        reach = pool[k + CONST + LENGTH * WIDTH] * nearer
        h = reach * r / math.sqrt(v2 + 0.5 * r * pull)
        pool[k + H] = min(pool[k + LIMIT], min(h, pool[k + CONST + STRIDE * WIDTH]))


@inlined
def _size(pool: Float, k: int) -> float:
    """Return the square of the tilt tau of a lane; 0 at rest."""
    x: float = pool[k + STATE]
    y: float = pool[k + STATE + WIDTH]
    return x * x + y * y


@inlined
def _excess(pool: Float, k: int, ax: float, ay: float, az: float) -> float:
    """Return the angular acceleration with which an upright column uplifts, if positive [s-2]."""
    excess: float = (
        pool[k + CONST + GZ * WIDTH] * math.sqrt(ax * ax + ay * ay)
        - pool[k + CONST + GB * WIDTH] * (1.0 + az)
        - pool[k + CONST + TIE_FORCE * WIDTH]
    )
    return excess


@inlined
def _excess_now(pool: Float, k: int) -> float:
    t = pool[k + CLOCK]
    return _excess(
        pool,
        k,
        pool[k + GROUND] + t * pool[k + GROWTH],
        pool[k + GROUND + WIDTH] + t * pool[k + GROWTH + WIDTH],
        pool[k + GROUND + 2 * WIDTH] + t * pool[k + GROWTH + 2 * WIDTH],
    )


@inlined
def _excess_at(pool: Float, k: int, ground: Float, i: int) -> float:
    scale = pool[k + CONST + SCALE * WIDTH]
    return _excess(pool, k, scale * ground[i, 0], scale * ground[i, 1], scale * ground[i, 2])


@inlined
def _go_to(pool: Float, lanes: Lanes, k: int, ground: Float, i: int, history: Float) -> None:
    """Set the clock of a lane to sample i, and store its state; the ground is still at the end."""
    lanes[SAMPLE, k] = i
    pool[k + CLOCK] = 0.0
    scale = pool[k + CONST + SCALE * WIDTH]
    ended = i + 1 >= ground.shape[0]
    for j in range(3):
        a = 0.0 if ended else scale * ground[i, j]
        pool[k + GROUND + j * WIDTH] = a
        pool[k + GROWTH + j * WIDTH] = 0.0 if ended else scale * ground[i, 3 + j]
    if history.shape[0] > 0:
        for j in range(4):
            history[lanes[MEMBER, k], i, j] = pool[k + STATE + j * WIDTH]


@inlined
def _take(
    pool: Float, lanes: Lanes, k: int, member: int, members: Float, starts: Float, row: Float
) -> None:
    """Put a member into a lane, and clear its summary; time is still that of the record."""
    lanes[MEMBER, k] = member
    lanes[COUNT, k] = lanes[TRIES, k] = 0
    for j in range(MEMBER_SIZE):
        pool[k + CONST + j * WIDTH] = members[member, j]
    for j in range(4):
        pool[k + STATE + j * WIDTH] = starts[member, j]
    moving = _size(pool, k) > 0.0
    row[PEAK] = 2.0 * math.atan(math.sqrt(_size(pool, k)))
    row[PEAK_TIME] = row[UPLIFT_TIME] = 0.0 if moving else math.nan
    row[OVERTURNING_TIME] = math.nan
    row[STEPS] = 0.0


@inlined
def _crossing(pool: Float, k: int, time_step: float) -> float:
    """Return when the excess becomes positive [s after the sample]; at the next sample it is.

    The excess is convex between samples, so this is the larger root of a quadratic equation.
    """
    gz = pool[k + CONST + GZ * WIDTH]
    gb = pool[k + CONST + GB * WIDTH]
    ax = gz * pool[k + GROUND]
    ay = gz * pool[k + GROUND + WIDTH]
    hold = gb * (1.0 + pool[k + GROUND + 2 * WIDTH]) + pool[k + CONST + TIE_FORCE * WIDTH]
    dx = gz * pool[k + GROWTH] * time_step
    dy = gz * pool[k + GROWTH + WIDTH] * time_step
    dz = gb * pool[k + GROWTH + 2 * WIDTH] * time_step
    q0 = ax * ax + ay * ay - hold * hold
    q1 = 2.0 * (ax * dx + ay * dy - hold * dz)
    q2 = dx * dx + dy * dy - dz * dz
    root = math.sqrt(max(q1 * q1 - 4.0 * q2 * q0, 0.0))
    share: float = -2.0 * q0 / (q1 + root) if q1 > 0.0 else (root - q1) / (2.0 * q2)
    return min(max(share, 0.0), 1.0) * time_step


@inlined
def _lift_off(pool: Float, k: int, time_step: float) -> bool:
    """Follow an upright column by its series for a short time; return False if it stays at rest.

    It tilts away from the acceleration of the ground, and follows its direction: while the tilt is
    small, any other direction swings back to it at once.
    """
    t = pool[k + CLOCK]
    span = min(_SERIES / math.sqrt(pool[k + CONST + GZ * WIDTH]), time_step - t)
    dx = pool[k + GROWTH]
    dy = pool[k + GROWTH + WIDTH]
    dz = pool[k + GROWTH + 2 * WIDTH]
    ax = pool[k + GROUND] + t * dx
    ay = pool[k + GROUND + WIDTH] + t * dy
    a = math.sqrt(ax * ax + ay * ay)
    gz = pool[k + CONST + GZ * WIDTH]
    e0 = max(_excess_now(pool, k), 0.0)
    e1 = gz * (ax * dx + ay * dy) / a - pool[k + CONST + GB * WIDTH] * dz
    e2 = gz * (ax * dy - ay * dx) ** 2 / (a * a * a)
    theta = span * span * (e0 / 2.0 + span * (e1 / 6.0 + span * e2 / 24.0))
    omega = span * (e0 + span * (e1 / 2.0 + span * e2 / 6.0))
    if not (theta > 0.0 and omega > 0.0):
        return False
    ax += span * dx
    ay += span * dy
    a = math.sqrt(ax * ax + ay * ay)
    turn = (ax * dy - ay * dx) / (a * a)
    r = math.tan(0.5 * theta)
    rate = 0.5 * (1.0 + r * r) * omega
    pool[k + STATE] = -r * ax / a
    pool[k + STATE + WIDTH] = -r * ay / a
    pool[k + STATE + 2 * WIDTH] = (-rate * ax + r * turn * ay) / a
    pool[k + STATE + 3 * WIDTH] = (-rate * ay - r * turn * ax) / a
    pool[k + CLOCK] = t + span
    return True


@inlined
def _wait(
    pool: Float, lanes: Lanes, k: int, ground: Float, time_step: float, row: Float, history: Float
) -> bool:
    """Move a lane at rest to its next uplift, or to a later sample; False if nothing lifts it."""
    i = lanes[SAMPLE, k]
    intervals = ground.shape[0] - 1
    if i < intervals and _excess_now(pool, k) <= 0.0:
        first = i
        while i < intervals and _excess_at(pool, k, ground, i + 1) <= 0.0:
            i += 1
        if i > first:
            _go_to(pool, lanes, k, ground, i, history)
    if i >= intervals:
        return False
    strongest = max(_excess_now(pool, k), _excess_at(pool, k, ground, i + 1))
    if strongest <= _LIFTS * pool[k + CONST + GB * WIDTH]:
        _go_to(pool, lanes, k, ground, i + 1, history)
        return True
    if _excess_now(pool, k) <= 0.0:
        pool[k + CLOCK] = max(pool[k + CLOCK], _crossing(pool, k, time_step))
    uplift = i * time_step + pool[k + CLOCK]
    if _lift_off(pool, k, time_step):
        if math.isnan(row[UPLIFT_TIME]):
            row[UPLIFT_TIME] = uplift
        if pool[k + CLOCK] < time_step:
            return True
    _go_to(pool, lanes, k, ground, i + 1, history)
    return True


@inlined
def _energy(pool: Float, k: int) -> tuple[float, float]:
    """Return the energy of a lane [s-2], and the square of the speed of its tilt [s-2]."""
    x = pool[k + STATE]
    y = pool[k + STATE + WIDTH]
    vx = pool[k + STATE + 2 * WIDTH]
    vy = pool[k + STATE + 3 * WIDTH]
    r2 = x * x + y * y
    r = math.sqrt(r2)
    half = 1.0 / (1.0 + r2)
    outward = (x * vx + y * vy) / r
    across = (x * vy - y * vx) / r
    q = pool[k + CONST + K0 * WIDTH] + r * (
        pool[k + CONST + K1 * WIDTH] + r * pool[k + CONST + K2 * WIDTH]
    )
    speed2 = 4.0 * half * half * (outward * outward + q * across * across)
    righting = pool[k + CONST + GB * WIDTH] - r * pool[k + CONST + GZ * WIDTH]
    tie = 2.0 * pool[k + CONST + TIE_FORCE * WIDTH] * r * math.sqrt(half)
    tie += pool[k + CONST + TIE_STIFFNESS * WIDTH] * r2 * half
    return 0.5 * speed2 + 2.0 * r * half * righting + tie, speed2


@inlined
def _slow_down(pool: Float, k: int, least: float, speed2: float) -> None:
    """Take the loss of a pass from the rates, at its least theta [rad]."""
    contact = pool[k + CONST + CONTACT * WIDTH]
    if contact > 0.0:
        distance = least * least / (contact * contact * speed2)
        kept = math.sqrt(1.0 - pool[k + CONST + LOSS * WIDTH] / (1.0 + distance))
        pool[k + STATE + 2 * WIDTH] *= kept
        pool[k + STATE + 3 * WIDTH] *= kept


@inlined
def _pass(pool: Float, k: int) -> float:
    """Carry a lane past upright in closed form, and return the time that it takes [s].

    So near the apex nothing but inertia matters, and the tilt follows a straight line of the cone
    with the metric dtheta^2 + K0 theta^2 dphi^2, unrolled. Without any precession it crosses the
    apex and stays in its plane.
    """
    x = pool[k + STATE]
    y = pool[k + STATE + WIDTH]
    vx = pool[k + STATE + 2 * WIDTH]
    vy = pool[k + STATE + 3 * WIDTH]
    r = math.sqrt(x * x + y * y)
    inward: float = -(x * vx + y * vy) / r
    across = (x * vy - y * vx) / r
    cone = math.sqrt(pool[k + CONST + K0 * WIDTH])
    sideways = cone * abs(across)
    speed2: float = inward * inward + sideways * sideways
    cosine = -1.0
    sine = 0.0
    if across != 0.0:
        swing = math.copysign(2.0 * math.atan2(inward, sideways) / cone, across)
        cosine = math.cos(swing)
        sine = math.sin(swing)
    ex = (x * cosine - y * sine) / r
    ey = (x * sine + y * cosine) / r
    pool[k + STATE] = r * ex
    pool[k + STATE + WIDTH] = r * ey
    pool[k + STATE + 2 * WIDTH] = inward * ex - across * ey
    pool[k + STATE + 3 * WIDTH] = inward * ey + across * ex
    _slow_down(pool, k, 2.0 * r * sideways / math.sqrt(speed2), 4.0 * speed2)
    return 2.0 * r * inward / speed2


@inlined
def _is_near(pool: Float, k: int) -> bool:
    """Return True if a lane moves inwards so near upright that its pass has a closed form."""
    vx = pool[k + STATE + 2 * WIDTH]
    vy = pool[k + STATE + 3 * WIDTH]
    near = _PASS * _PASS * (vx * vx + vy * vy)
    if _size(pool, k) * pool[k + CONST + GZ * WIDTH] >= near:
        return False
    inward: float = pool[k + STATE] * vx + pool[k + STATE + WIDTH] * vy
    return inward < 0.0


@inlined
def _swing(pool: Float, k: int, at: int) -> tuple[float, bool]:
    """Return half the rate of tau^2 of the state in the rows `at`, and True if it is round-off."""
    x: float = pool[k + at]
    y: float = pool[k + at + WIDTH]
    vx: float = pool[k + at + 2 * WIDTH]
    vy: float = pool[k + at + 3 * WIDTH]
    rate = x * vx + y * vy
    return rate, rate * rate <= _LOCATED * _LOCATED * (x * x + y * y) * (vx * vx + vy * vy)


@inlined
def _note_top(pool: Float, k: int, before: float, after: float, time: float, row: Float) -> None:
    """Store the peak of a step during which tau^2 turns; between its ends, it is a cubic."""
    h = pool[k + H]
    q0 = pool[k + BEFORE] ** 2 + pool[k + BEFORE + WIDTH] ** 2
    q1 = _size(pool, k)
    d0 = 2.0 * h * before
    d1 = 2.0 * h * after
    c2 = 3.0 * (q1 - q0) - 2.0 * d0 - d1
    c3 = 2.0 * (q0 - q1) + d0 + d1
    share = d0 / (math.sqrt(max(c2 * c2 - 3.0 * c3 * d0, 0.0)) - c2)
    top = 2.0 * math.atan(math.sqrt(q0 + share * (d0 + share * (c2 + share * c3))))
    if top > row[PEAK]:
        row[PEAK] = top
        row[PEAK_TIME] = time + share * h


@inlined
def _note_fall(pool: Float, k: int, time: float, row: Float) -> None:
    """Store the time at which tau reaches 1, theta pi/2, by a straight line within the step."""
    before = math.sqrt(pool[k + BEFORE] ** 2 + pool[k + BEFORE + WIDTH] ** 2)
    after = math.sqrt(_size(pool, k))
    row[OVERTURNING_TIME] = time + pool[k + H] * (1.0 - before) / (after - before)
    row[PEAK] = 0.5 * math.pi
    row[PEAK_TIME] = row[OVERTURNING_TIME]


@inlined
def _finish_step(  # noqa: C901  one event after another
    pool: Float, lanes: Lanes, k: int, ground: Float, time_step: float, row: Float, history: Float
) -> int:
    """Follow the events of a step; return the verdict if the member has ended, else NO_UPLIFT.

    In free motion after the record the next peak decides: no later one is larger.
    """
    lanes[COUNT, k] += 1
    before, turned_before = _swing(pool, k, BEFORE)
    after, turning = _swing(pool, k, STATE)
    i = lanes[SAMPLE, k]
    recorded = i < ground.shape[0] - 1
    time = i * time_step + pool[k + CLOCK]
    turned = False
    passing = before < 0.0 and not turned_before and (after >= 0.0 or turning)
    if passing and pool[k + CONST + CONTACT * WIDTH] > 0.0:
        if not turning and lanes[TRIES, k] < _LOCATING_STEPS:
            lanes[TRIES, k] += 1
            pool[k + LIMIT] = pool[k + H] * before / (before - after)
            for j in range(4):
                pool[k + STATE + j * WIDTH] = pool[k + BEFORE + j * WIDTH]
            return NO_UPLIFT
        _slow_down(pool, k, 2.0 * math.atan(math.sqrt(_size(pool, k))), _energy(pool, k)[1])
        turned = True
    at_sample = recorded and lanes[TRIES, k] == 0 and pool[k + H] == pool[k + LIMIT]
    lanes[TRIES, k] = 0
    if before > 0.0 and after <= 0.0:
        _note_top(pool, k, before, after, time if recorded else math.nan, row)
        turned = True
        if not recorded:
            return STANDS
    if _size(pool, k) >= 1.0:
        _note_fall(pool, k, time, row)
        return OVERTURNS
    pool[k + CLOCK] += pool[k + H]
    if _is_near(pool, k):
        pool[k + CLOCK] += _pass(pool, k)
        turned = True
    rests = turned and _energy(pool, k)[0] < pool[k + CONST + REST * WIDTH]
    if rests and _excess_now(pool, k) <= 0.0:
        for j in range(4):
            pool[k + STATE + j * WIDTH] = 0.0
    if at_sample or (recorded and pool[k + CLOCK] >= time_step):
        _go_to(pool, lanes, k, ground, i + 1, history)
    return NO_UPLIFT


@compiled
def integrate(  # noqa: C901  one loop over the lanes
    ground: Float,
    time_step: float,
    members: Float,
    starts: Float,
    verdicts: NDArray[np.int8],
    summaries: Float,
    history: Float,
) -> None:
    """Integrate members under one ground motion, and in free motion after it.

    Parameters
    ----------
    ground : array, shape (samples, 6)
        Accelerations a_x, a_y and a_z at the samples [g], and their rates until the next one [g
        s-1]. Vertical ones are above -1 g at the scale of each member.
    time_step : float
        Time between samples [s]; the first one is at time 0.
    members : array, shape (members, MEMBER_SIZE)
        Values of the slots of members.
    starts : array, shape (members, 4)
        Components of the tilt tau at the first sample and their rates [s-1]; zeros for rest.
    verdicts : array of int8, shape (members,)
        Filled with NO_UPLIFT, STANDS or OVERTURNS, or FAILED after too many steps.
    summaries : array, shape (members, SUMMARY_SIZE)
        Filled with the values of the slots of summaries.
    history : array, shape (members, samples, 4) or (0, 0, 4)
        Filled with the states at the samples from uplift on, unless it is empty.
    """
    pool = np.zeros(_POOL_SIZE)
    lanes = np.full((_LANE_SIZE, WIDTH), -1, dtype=np.int64)
    most = _MOST_STEPS + _MOST_STEPS_PER_SAMPLE * ground.shape[0]
    tied = False
    for member in range(members.shape[0]):
        tied |= members[member, TIE_FORCE] > 0.0 or members[member, TIE_STIFFNESS] > 0.0
    following = 0
    busy = True
    while busy:  # each round counts as a step of each lane, and these are bounded
        busy = False
        for k in range(WIDTH):
            # each pass of this loop takes a member, starts a motion, or moves on by a sample
            while lanes[MEMBER, k] < 0 or _size(pool, k) == 0.0:
                member = lanes[MEMBER, k]
                if member < 0:
                    if following == members.shape[0]:
                        break
                    row = summaries[following]
                    _take(pool, lanes, k, following, members, starts, row)
                    _go_to(pool, lanes, k, ground, 0, history)
                    following += 1
                elif not _wait(pool, lanes, k, ground, time_step, summaries[member], history):
                    lifted = not math.isnan(summaries[member, UPLIFT_TIME])
                    verdicts[member] = STANDS if lifted else NO_UPLIFT
                    lanes[MEMBER, k] = -1
            if lanes[MEMBER, k] < 0:
                pool[k + LIMIT] = 0.0  # an empty lane stays where it is
                pool[k + STATE] = 1.0
                continue
            busy = True
            if lanes[TRIES, k] == 0:
                recorded = lanes[SAMPLE, k] < ground.shape[0] - 1
                pool[k + LIMIT] = time_step - pool[k + CLOCK] if recorded else math.inf
        _plan(pool)
        _step(pool, tied)
        for k in range(WIDTH):
            member = lanes[MEMBER, k]
            if member >= 0:
                row = summaries[member]
                verdict = _finish_step(pool, lanes, k, ground, time_step, row, history)
                if lanes[COUNT, k] > most:
                    verdict = FAILED
                if verdict != NO_UPLIFT:
                    verdicts[member] = verdict
                    row[STEPS] = lanes[COUNT, k]
                    lanes[MEMBER, k] = -1
