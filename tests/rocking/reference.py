"""An independent solver of eq (26) with eq (43): DOP853 of scipy, restarted at each jump of f.

It shares no code with the kernel and is slow: for checking only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

Float = NDArray[np.float64]

RELATIVE_TOLERANCE = 3e-14
REST_VELOCITY = 1e-10  # of p_hat; the kernel states the same cut-off
LONGEST_STEP = 0.05  # of 1/p_hat


@dataclass
class Solution:
    """State at the nodes (NaN after overturning), and the events."""

    theta: Float
    omega: Float
    impact_times: list[float] = field(default_factory=list)
    impact_velocities: list[float] = field(default_factory=list)
    uplift_time: float = math.nan
    overturning_time: float = math.nan


@dataclass(frozen=True)
class _Column:
    alpha: float
    p_hat: float
    restitution: float


def solve(
    coefficients: ArrayLike,
    time_step: float,
    *,
    alpha: float,
    p_hat: float,
    restitution: float,
    start: tuple[float, float] = (0.0, 0.0),
    start_time: float = 0.0,
    most_impacts: int = 10_000,
) -> Solution:
    """Integrate over a ground acceleration [g] that is a polynomial in each interval.

    The integration stops after `most_impacts`; later nodes are NaN.
    """
    ground = np.atleast_2d(np.asarray(coefficients, dtype=np.float64))
    column = _Column(alpha, p_hat, restitution)
    nodes = ground.shape[0] + 1
    solution = Solution(np.full(nodes, math.nan), np.full(nodes, math.nan))
    theta, omega = start
    side = math.copysign(1.0, theta or omega) if theta or omega else 0.0
    if side:
        solution.uplift_time = start_time
    solution.theta[0], solution.omega[0] = theta, omega
    for i, row in enumerate(ground):
        origin = start_time + i * time_step
        state = _interval(column, row, time_step, (theta, omega, side), solution, origin)
        if not math.isnan(solution.overturning_time) or len(solution.impact_times) > most_impacts:
            break
        theta, omega, side = state
        solution.theta[i + 1], solution.omega[i + 1] = theta, omega
    return solution


def _interval(
    column: _Column,
    row: Float,
    end: float,
    state: tuple[float, float, float],
    solution: Solution,
    origin: float,
) -> tuple[float, float, float]:
    """Integrate one interval, from one event to the next."""
    theta, omega, side = state
    now = 0.0
    while now < end:
        if side == 0.0:
            uplift = _uplift(row, math.tan(column.alpha), now, end)
            if uplift is None:
                return 0.0, 0.0, 0.0
            now, side = uplift
            if math.isnan(solution.uplift_time):
                solution.uplift_time = origin + now
        equation = _equation(column, row, side)
        if theta == 0.0:
            now, theta, omega = _depart(column, equation, now, end, omega, side)
        now, theta, omega, event = _steps(column, equation, now, end, theta, omega, side=side)
        if event == "fall":
            solution.overturning_time = origin + now
            break
        if event == "impact":
            solution.impact_times.append(origin + now)
            solution.impact_velocities.append(omega)
            theta, omega, side = 0.0, omega * column.restitution, -side
            weak = abs(polynomial.polyval(now, row)) <= math.tan(column.alpha)
            if abs(omega) < REST_VELOCITY * column.p_hat and weak:
                omega, side = 0.0, 0.0
    return theta, omega, side


def _equation(column: _Column, row: Float, side: float) -> Callable[[float, Float], list[float]]:
    """Return eq (26) on one side, as a first-order system."""
    powers = [float(c) for c in row[::-1]]
    p2 = column.p_hat**2

    def rates(t: float, y: Float) -> list[float]:
        a = 0.0
        for c in powers:
            a = a * t + c
        psi = column.alpha * side - float(y[0])
        return [float(y[1]), -p2 * (math.sin(psi) + a * math.cos(psi))]

    return rates


def _uplift(row: Float, limit: float, now: float, end: float) -> tuple[float, float] | None:
    """Return when in [now, end) |a| first exceeds the limit, and the side of the uplift."""
    candidates = [now]
    for level in (limit, -limit):
        shifted = row.copy()
        shifted[0] -= level
        roots: Float = (
            polynomial.polyroots(np.trim_zeros(shifted, "b")) if shifted.any() else np.empty(0)
        )
        candidates += [float(r.real) for r in roots if abs(r.imag) < 1e-9 and now < r.real < end]
    candidates = sorted(candidates)
    for t, after in zip(candidates, [*candidates[1:], end], strict=True):
        a = polynomial.polyval(0.5 * (t + after), row)
        if abs(a) > limit:
            return t, -math.copysign(1.0, a)
    return None


def _depart(
    column: _Column,
    equation: Callable[[float, Float], list[float]],
    now: float,
    end: float,
    omega: float,
    side: float,
) -> tuple[float, float, float]:
    """Step away from theta = 0, where the event function is zero, to find the landing."""
    span = min(end - now, 1e-3)
    if omega:
        span = min(span, 0.5 * abs(omega / equation(now, np.array([0.0, omega]))[1]))
    while True:
        _, theta, rate, _ = _steps(column, equation, now, now + span, 0.0, omega)
        if side * theta > 0.0 or now + span == now:
            return now + span, theta, rate
        span *= 0.5


def _steps(
    column: _Column,
    equation: Callable[[float, Float], list[float]],
    now: float,
    end: float,
    theta: float,
    omega: float,
    side: float = 0.0,
) -> tuple[float, float, float, str]:
    """Solve on one side to the end, or to the first event if a `side` is given."""

    def impact(_t: float, y: Float) -> float:
        return side * float(y[0])

    def fall(_t: float, y: Float) -> float:
        return side * float(y[0]) - 0.5 * math.pi

    impact.terminal = True  # type: ignore[attr-defined]
    impact.direction = -1.0  # type: ignore[attr-defined]
    fall.terminal = True  # type: ignore[attr-defined]
    fall.direction = 1.0  # type: ignore[attr-defined]
    if end <= now:
        return now, theta, omega, ""
    solution = solve_ivp(
        equation,
        (now, end),
        [theta, omega],
        method="DOP853",
        rtol=RELATIVE_TOLERANCE,
        atol=1e-22,
        max_step=LONGEST_STEP / column.p_hat,
        events=[impact, fall] if side else None,
    )
    if solution.t_events is None or not any(times.size for times in solution.t_events):
        return float(solution.t[-1]), float(solution.y[0, -1]), float(solution.y[1, -1]), ""
    landed = bool(solution.t_events[0].size)
    before, time = float(solution.t[-2]), float(solution.t[-1])
    level = 0.0 if landed else side * 0.5 * math.pi
    for _ in range(3):  # Newton on the steps, which are more exact than the dense output
        _, reached, rate, _ = _steps(
            column, equation, before, time, float(solution.y[0, -2]), float(solution.y[1, -2])
        )
        time -= (reached - level) / rate
    return time, level, rate, "impact" if landed else "fall"
