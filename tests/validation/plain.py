"""A plain integrator of rocking frames and of oscillators, which uses no code of the package.

The equations follow from the geometry: a column turns about its base corner, the beam moves with
its top corner without turning, and both are accelerated by the ground. Between events and samples,
scipy's DOP853 integrates; events (impacts, overturning, yielding) end a piece.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Float: TypeAlias = NDArray[np.float64]

GRAVITY: Final = 9.81
NO_UPLIFT, STANDS, OVERTURNS, UNDECIDED = 0, 1, 2, -1
#: Longest step, and time of the analytic step away from theta = 0, times the rate of the structure.
_STEP, _AWAY = 0.1, 1e-5
#: A frame rests after an impact that it leaves more slowly than this times its rate.
_REST: Final = 1e-8
#: Time over still ground until a frame is undecided, times its rate.
_TAIL: Final = 25.0
_FALLEN: Final = 0.5 * math.pi
#: Springs yield above this factor of their strength: without loss they just reach it in each cycle.
_BEYOND: Final = 1.0 + 1e-10
#: An oscillator beyond this displacement [m] has collapsed.
_FAR: Final = 1e3


@dataclass(frozen=True)
class Tie:
    """A tendon or bars: force at rest, stiffness, limits of the force, and lever of the stretch.

    The stretch is 2 lever sin(|theta| / 2); `joints` of them act. A cable carries no compression;
    small steps, not an event, follow the kink where it becomes slack.
    """

    lever: float
    stiffness: float
    prestress: float = 0.0
    highest: float = math.inf
    lowest: float = -math.inf
    joints: float = 1.0
    cable: bool = False


@dataclass(frozen=True)
class Rocker:
    """A frame, all over the mass of one column.

    Parameters
    ----------
    across, upwards : float
        Moments of the weights and of the horizontal inertia about the corner, over g [m].
    inertia : float
        Moment of inertia about the corner with the beam's [m2].
    restitution : float
        Rate after an impact over that before.
    mass : float
        Mass of a column [kg].
    reach, height : float
        Arms of the point that carries the beam, about the corner [m].
    ties : tuple of Tie
        Tendons and bars.
    gap, allowance : float
        Displacement and lift of the beam whose first times are sought [m].
    """

    across: float
    upwards: float
    inertia: float
    restitution: float
    mass: float = 1.0
    reach: float = 0.0
    height: float = 0.0
    ties: tuple[Tie, ...] = ()
    gap: float = math.inf
    allowance: float = math.inf

    @property
    def rate(self) -> float:
        """Rate at which a slender frame falls [rad s-1]."""
        return math.sqrt(GRAVITY * self.upwards / self.inertia)

    @property
    def slenderness(self) -> float:
        """Angle of the frame's centre from the vertical [rad]."""
        return math.atan2(self.across, self.upwards)


@dataclass
class History:
    """States at the samples (NaN after overturning), events and the outcome.

    A frame has theta and its rate, and impacts; an oscillator displacement and velocity, and starts
    of yielding.
    """

    place: Float
    rate: Float
    events: list[tuple[float, float]] = field(default_factory=list)
    peak: float = 0.0
    uplift_time: float = math.nan
    overturning_time: float = math.nan
    gap_time: float = math.nan
    lift_time: float = math.nan
    verdict: int = NO_UPLIFT


@dataclass(frozen=True)
class _Branch:
    """A tie: plastic stretch, and 1 or -1 while it yields at its highest or lowest force."""

    plastic: float = 0.0
    side: int = 0


@dataclass
class _Frame:
    """A frame in motion."""

    theta: float = 0.0
    omega: float = 0.0
    side: float = 0.0
    branches: list[_Branch] = field(default_factory=list)


#: Acceleration of the ground [m s-2], across and upwards, over the time in an interval.
Ground: TypeAlias = tuple[tuple[float, float], tuple[float, float]]


def _force(tie: Tie, branch: _Branch, theta: float) -> float:
    if branch.side:
        return tie.highest if branch.side > 0 else tie.lowest
    stretch = 2.0 * tie.lever * math.sin(0.5 * abs(theta))
    force = tie.prestress + tie.stiffness * (stretch - branch.plastic)
    return max(force, 0.0) if tie.cable else force


def _closing(rocker: Rocker, branches: list[_Branch], theta: float) -> float:
    """Return the moment of the ties towards theta = 0, over the mass of a column [m2 s-2]."""
    moments = (
        tie.joints * tie.lever * _force(tie, branch, theta)
        for tie, branch in zip(rocker.ties, branches, strict=True)
    )
    return sum(moments) * math.cos(0.5 * theta) / rocker.mass


def _outwards(rocker: Rocker, state: _Frame, ground: Ground, t: float, theta: float) -> float:
    """Return the acceleration of |theta| [rad s-2]."""
    (a, a_rate), (v, v_rate) = ground
    size = abs(theta)
    sine, cosine = math.sin(size), math.cos(size)
    weight = (GRAVITY + v + v_rate * t) * (rocker.across * cosine - rocker.upwards * sine)
    shake = state.side * (a + a_rate * t) * (rocker.across * sine + rocker.upwards * cosine)
    return -(weight + shake + _closing(rocker, state.branches, theta)) / rocker.inertia


def rock(
    rocker: Rocker, step: float, across: Float, upwards: Float | None, tolerance: float
) -> History:
    """Integrate a frame from rest over samples [m s-2] that straight lines join."""
    lift = np.zeros(across.size) if upwards is None else upwards
    found = History(np.zeros(across.size), np.zeros(across.size))
    state = _Frame(branches=[_Branch() for _ in rocker.ties])
    for i in range(across.size - 1):
        rows = ((across[i], across[i + 1]), (lift[i], lift[i + 1]))
        ground = tuple((float(one), float(two - one) / step) for one, two in rows)
        _interval(rocker, state, ground, i * step, step, tolerance, found)  # type: ignore[arg-type]
        if found.verdict == OVERTURNS:
            found.place[i + 1 :] = found.rate[i + 1 :] = math.nan
            return found
        found.place[i + 1], found.rate[i + 1] = state.theta, state.omega
    if state.side:
        _freely(rocker, state, (across.size - 1) * step, tolerance, found)
    return found


def _freely(rocker: Rocker, state: _Frame, now: float, tolerance: float, found: History) -> None:
    """Follow a frame over still ground until two impacts or turns have shown its largest peak."""
    piece = 0.5 / rocker.rate
    impacts, turns = len(found.events), 0
    still = ((0.0, 0.0), (0.0, 0.0))
    for k in range(math.ceil(_TAIL / 0.5)):
        before = state.omega
        _interval(rocker, state, still, now + k * piece, piece, tolerance, found)
        if found.verdict == OVERTURNS:
            return
        turns += before * state.omega < 0.0 and before * state.side > 0.0
        if not state.side or len(found.events) > impacts + 1 or turns > 2:
            return
    found.verdict = UNDECIDED


def _interval(
    rocker: Rocker,
    state: _Frame,
    ground: Ground,
    start: float,
    end: float,
    tolerance: float,
    found: History,
) -> None:
    """Follow a frame through an interval, from one event to the next; changes the state."""
    now = 0.0
    while now < end:
        if not state.side:
            now = _uplift(rocker, state, ground, now, end)
            if now >= end:
                return
            found.verdict = STANDS
            if math.isnan(found.uplift_time):
                found.uplift_time = start + now
        if state.theta == 0.0:
            now = _away(rocker, state, ground, now, end)
        now, event = _piece(rocker, state, ground, now, end, tolerance, start, found)
        if event == "falls":
            found.overturning_time, found.verdict = start + now, OVERTURNS
            found.peak = _FALLEN
            return
        if event == "lands":
            found.events.append((start + now, state.omega))
            _land(rocker, state, ground, now)
        elif event:
            _change(rocker, state, int(event))


def _uplift(rocker: Rocker, state: _Frame, ground: Ground, now: float, end: float) -> float:
    """Return when a frame at rest uplifts, and give it its side; `end` if it does not."""
    best, side = end, 0.0
    for sign in (1.0, -1.0):
        trial = replace(state, side=sign)
        first, last = (_outwards(rocker, trial, ground, t, 0.0) for t in (now, end))
        if first > 0.0 or (first == 0.0 and last > 0.0):
            when = now
        elif last > 0.0:
            when = now + (end - now) * first / (first - last)
        else:
            continue
        if when < best:
            best, side = when, sign
    state.side = side
    return best


def _away(rocker: Rocker, state: _Frame, ground: Ground, now: float, end: float) -> float:
    """Move a frame away from theta = 0 by the first terms of its series."""
    pull = _outwards(rocker, state, ground, now, 0.0)
    later = _outwards(rocker, state, ground, now + _AWAY / rocker.rate, 0.0)
    growth = (later - pull) * rocker.rate / _AWAY
    speed = state.side * state.omega
    span = min(end - now, _AWAY / rocker.rate)
    if speed > 0.0 and pull < 0.0:
        span = min(span, -0.01 * speed / pull)
    size = speed * span + 0.5 * pull * span**2 + growth * span**3 / 6.0
    state.theta = state.side * max(size, 1e-300)
    state.omega = state.side * (speed + pull * span + 0.5 * growth * span**2)
    return now + span


def _land(rocker: Rocker, state: _Frame, ground: Ground, now: float) -> None:
    state.theta, state.omega, state.side = 0.0, rocker.restitution * state.omega, -state.side
    for k, (tie, branch) in enumerate(zip(rocker.ties, state.branches, strict=True)):
        if branch.side < 0:
            state.branches[k] = _Branch(-(tie.lowest - tie.prestress) / tie.stiffness)
    if abs(state.omega) < _REST * rocker.rate:
        pulls = [
            _outwards(rocker, replace(state, side=side), ground, now, 0.0) for side in (1.0, -1.0)
        ]
        if max(pulls) <= 0.0:
            state.omega = state.side = 0.0


def _change(rocker: Rocker, state: _Frame, code: int) -> None:
    """Change the branch of a tie: codes are 3 times its number, and 0 linear, 1 high or 2 low."""
    number, kind = divmod(code, 3)
    tie, branch = rocker.ties[number], state.branches[number]
    if kind:
        state.branches[number] = _Branch(branch.plastic, 1 if kind == 1 else -1)
    elif branch.side:
        limit = tie.highest if branch.side > 0 else tie.lowest
        stretch = 2.0 * tie.lever * math.sin(0.5 * abs(state.theta))
        state.branches[number] = _Branch(stretch - (limit - tie.prestress) / tie.stiffness)
        state.omega = 0.0


Event: TypeAlias = Callable[[float, Float], float]


def _event(function: Event, direction: float, *, ends: bool = True) -> Any:
    """Return a function as solve_ivp takes events."""

    def event(t: float, y: Float) -> float:
        return function(t, y)

    event.terminal, event.direction = ends, direction  # type: ignore[attr-defined]
    return event


def _solved(
    rates: Callable[[float, Float], tuple[float, float]],
    span: tuple[float, float],
    begin: tuple[float, float],
    events: list[Any],
    tolerance: float,
    longest: float,
) -> Any:
    """Integrate to the first event that ends the piece.

    SciPy overlooks two roots of an event in one step. Between them is a turn or a dip of the rate,
    which are events themselves; where one of these lies beyond a root, the piece is solved again,
    to this time.
    """
    solution = solve_ivp(
        rates,
        span,
        begin,
        method="DOP853",
        rtol=tolerance,
        atol=1e-6 * tolerance,
        max_step=longest,
        events=events,
    )
    ends = [one for one in events if one.terminal]
    begun = np.array(begin)
    ready = [one for one in ends if one.direction * one(span[0], begun) <= 0.0]
    marks = [
        (float(t), y)
        for one, times, states in zip(events, solution.t_events, solution.y_events, strict=True)
        for t, y in zip(times, states, strict=True)
        if not one.terminal and t < solution.t[-1]
    ]
    for t, y in sorted(marks, key=lambda mark: mark[0]):
        if any(one.direction * one(t, y) > 0.0 for one in ready) and t < span[1]:
            return _solved(rates, (span[0], t), begin, events, tolerance, longest)
    return solution


def _tie_events(rocker: Rocker, state: _Frame) -> dict[str, Any]:
    """Return the events at which ties change their branches, by their codes."""
    found: dict[str, Any] = {}
    for k, (tie, branch) in enumerate(zip(rocker.ties, state.branches, strict=True)):
        if branch.side:
            found[f"{3 * k}"] = _event(partial(_growth, state.side * branch.side), -1.0)
            continue
        if math.isfinite(tie.highest):
            found[f"{3 * k + 1}"] = _event(partial(_excess, tie, branch, 1.0, tie.highest), 1.0)
        if math.isfinite(tie.lowest):
            found[f"{3 * k + 2}"] = _event(partial(_excess, tie, branch, -1.0, -tie.lowest), 1.0)
    return found


def _growth(sign: float, _: float, y: Float) -> float:
    return sign * float(y[1])


def _excess(tie: Tie, branch: _Branch, sign: float, limit: float, _: float, y: Float) -> float:
    """Return by how much the force, times a sign, exceeds a limit."""
    stretch = 2.0 * tie.lever * math.sin(0.5 * abs(float(y[0])))
    force = tie.prestress + tie.stiffness * (stretch - branch.plastic)
    return sign * force - _BEYOND * limit


def _piece(
    rocker: Rocker,
    state: _Frame,
    ground: Ground,
    now: float,
    end: float,
    tolerance: float,
    start: float,
    found: History,
) -> tuple[float, str]:
    """Integrate to the end or to the first event, and return its time and name."""
    if end <= now:
        return end, ""
    side = state.side

    def rates(t: float, y: Float) -> tuple[float, float]:
        return float(y[1]), side * _outwards(rocker, state, ground, t, float(y[0]))

    def moved(y: Float) -> float:
        size = abs(float(y[0]))
        return rocker.height * math.sin(size) + rocker.reach * (1.0 - math.cos(size))

    def risen(y: Float) -> float:
        size = abs(float(y[0]))
        return rocker.reach * math.sin(size) - rocker.height * (1.0 - math.cos(size))

    events = {
        "lands": _event(lambda _, y: side * float(y[0]), -1.0),
        "falls": _event(lambda _, y: side * float(y[0]) - _FALLEN, 1.0),
        **_tie_events(rocker, state),
        "turns": _event(lambda _, y: side * float(y[1]), 0.0, ends=False),
        "dips": _event(lambda t, y: rates(t, y)[1], 0.0, ends=False),
        "closes": _event(lambda _, y: moved(y) - min(rocker.gap, 1e9), 1.0, ends=False),
        "lifts": _event(lambda _, y: risen(y) - min(rocker.allowance, 1e9), 1.0, ends=False),
    }
    longest = _STEP / rocker.rate
    begin = (state.theta, state.omega)
    solution = _solved(rates, (now, end), begin, [*events.values()], tolerance, longest)
    times = dict(zip(events, solution.t_events, strict=True))
    turned = solution.y_events[[*events].index("turns")]
    found.peak = max(found.peak, *(abs(float(y[0])) for y in turned), abs(float(solution.y[0, -1])))
    if times["closes"].size and math.isnan(found.gap_time):
        found.gap_time = start + float(times["closes"][0])
    if times["lifts"].size and math.isnan(found.lift_time):
        found.lift_time = start + float(times["lifts"][0])
    state.theta, state.omega = (float(one) for one in solution.y[:, -1])
    ended = [name for name, one in events.items() if one.terminal and times[name].size]
    return float(solution.t[-1]), ended[0] if ended else ""


@dataclass(frozen=True)
class Oscillator:
    """A mass on a spring k, an elastic-plastic part k_z with strength q, and a damper c.

    All are over the mass. If k_z is infinite, the plastic part is friction.
    """

    k: float
    k_z: float
    q: float
    c: float

    @property
    def rate(self) -> float:
        """Largest rate of the oscillator [rad s-1]."""
        stiffness = abs(self.k) + (0.0 if math.isinf(self.k_z) else self.k_z)
        return math.sqrt(stiffness) + self.c


@dataclass
class _Mass:
    """An oscillator in motion; `side` is the direction of yielding, `held` while it sticks."""

    u: float = 0.0
    v: float = 0.0
    z: float = 0.0
    side: float = 0.0
    held: bool = False


def oscillate(one: Oscillator, step: float, samples: Float, tolerance: float) -> History:
    """Integrate an oscillator from rest over samples [m s-2] that straight lines join."""
    found = History(np.zeros(samples.size), np.zeros(samples.size), verdict=STANDS)
    state = _Mass(held=math.isinf(one.k_z))
    for i in range(samples.size - 1):
        a = (float(samples[i]), float(samples[i + 1] - samples[i]) / step)
        _advance(one, state, a, i * step, step, tolerance, found)
        if abs(state.u) > _FAR:
            break
        found.place[i + 1], found.rate[i + 1] = state.u, state.v
    longest = 2.0 * math.pi / math.sqrt(one.k if one.k > 0.0 else one.k + one.k_z)
    now = (samples.size - 1) * step
    for k in range(16):  # four of its periods, or until it collapses
        if (state.held and abs(one.k * state.u) <= one.q) or abs(state.u) > _FAR:
            break
        piece = 0.25 * longest
        _advance(one, state, (0.0, 0.0), now + k * piece, piece, tolerance, found)
    if abs(state.u) > _FAR or (one.k < 0.0 and -one.k * abs(state.u) > one.q):
        found.verdict, found.peak = OVERTURNS, math.inf
    return found


def _advance(
    one: Oscillator,
    state: _Mass,
    a: tuple[float, float],
    start: float,
    end: float,
    tolerance: float,
    found: History,
) -> None:
    now = 0.0
    while now < end and abs(state.u) <= _FAR:
        if state.held:
            now = _slide(one, state, a, now, end)
            if now >= end:
                return
            found.events.append((start + now, state.v))
        now = _branch(one, state, a, now, end, tolerance, start, found)


def _slide(one: Oscillator, state: _Mass, a: tuple[float, float], now: float, end: float) -> float:
    """Return when an oscillator that sticks starts to slide; `end` if it does not."""
    spring = one.k * state.u
    first, last = a[0] + a[1] * now + spring, a[0] + a[1] * end + spring
    if (abs(first) >= one.q and first * a[1] >= 0.0) or abs(first) > one.q:
        when, push = now, first
    elif abs(last) > one.q:
        when, push = (math.copysign(one.q, last) - spring - a[0]) / a[1], last
    else:
        return end
    state.held, state.side = False, -math.copysign(1.0, push)
    state.z, state.v = state.side * one.q, state.side * 1e-15
    return when


def _branch(
    one: Oscillator,
    state: _Mass,
    a: tuple[float, float],
    now: float,
    end: float,
    tolerance: float,
    start: float,
    found: History,
) -> float:
    """Integrate on one branch, to its end or that of the interval; return the time."""
    side, u_0, z_0 = state.side, state.u, state.z

    def spring(u: float) -> float:
        return z_0 if side else z_0 + one.k_z * (u - u_0)

    def rates(t: float, y: Float) -> tuple[float, float]:
        u, v = float(y[0]), float(y[1])
        return v, -(a[0] + a[1] * t) - one.c * v - one.k * u - spring(u)

    def changes(_: float, y: Float) -> float:
        if side:
            return side * float(y[1])
        return _BEYOND * min(one.q, 1e9) - abs(spring(float(y[0])))

    events = [
        _event(changes, -1.0),
        _event(lambda _, y: float(y[1]), 0.0, ends=False),
        _event(lambda t, y: rates(t, y)[1], 0.0, ends=False),
        _event(lambda _, y: 1.01 * _FAR - abs(float(y[0])), -1.0),
    ]
    begin = (state.u, state.v)
    solution = _solved(rates, (now, end), begin, events, tolerance, _STEP / one.rate)
    turned = solution.y_events[1]
    found.peak = max(found.peak, *(abs(float(y[0])) for y in turned), abs(float(solution.y[0, -1])))
    state.u, state.v = (float(y) for y in solution.y[:, -1])
    state.z = min(max(spring(state.u), -one.q), one.q)
    now = float(solution.t[-1])
    if solution.t_events[0].size:
        if side:
            state.v, state.side, state.held = 0.0, 0.0, math.isinf(one.k_z)
        else:
            state.side = math.copysign(1.0, state.z)
            state.z = state.side * one.q
            found.events.append((start + now, state.v))
    return now
