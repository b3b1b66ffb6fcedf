"""An independent solver: DOP853 from node to node, with changes of branch as events."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rockframe import FixedFrame, GroundAcceleration, IsolatedDeck

Float = NDArray[np.float64]


@dataclass
class Direct:
    """Displacements and velocities at the nodes, excursions into yielding, dissipated energy."""

    u: Float
    velocity: Float
    yields: int = 0
    first_yield: float = math.nan
    dissipated: float = 0.0

    def count(self, now: float) -> None:
        self.first_yield = now if self.yields == 0 else self.first_yield
        self.yields += 1


@dataclass(frozen=True)
class Branch:
    """One branch in one interval; `side` is +1 or -1 while yielding, `held` while sticking."""

    constants: tuple[float, float, float, float]
    row: Float
    start: float
    side: float = 0.0
    held: bool = False
    u: float = 0.0
    z: float = 0.0

    def ground(self, t: float) -> float:
        return float(np.polynomial.polynomial.polyval(t - self.start, self.row))

    def spring(self, u: float) -> float:
        """Return z at a displacement."""
        return self.z if self.side else self.z + self.constants[1] * (u - self.u)

    def rates(self, t: float, y: Float) -> list[float]:
        k, _, q, c = self.constants
        force = c * y[1] + k * y[0] + self.spring(y[0])
        return [y[1], -self.ground(t) - force, q * abs(y[1]) if self.side else 0.0]

    def end(self, _: float, y: Float) -> float:
        q = self.constants[2]
        return float(self.side * y[1] if self.side else min(q, 1e9) - abs(self.spring(y[0])))

    end.terminal = True  # type: ignore[attr-defined]
    end.direction = -1  # type: ignore[attr-defined]

    def pull(self, t: float) -> float:
        """Return the force in excess of friction."""
        k, _, q, _ = self.constants
        return abs(self.ground(t) + k * self.u) - q


def direct(model: IsolatedDeck | FixedFrame, motion: GroundAcceleration) -> Direct:
    """Integrate u, u' and the dissipated energy; z follows from the branch."""
    nodes, y = motion.time, np.zeros(3)
    branch = Branch(model.constants, motion.coefficients[0], nodes[0])
    branch = replace(branch, held=math.isinf(model.constants[1]))
    states = np.zeros((2, nodes.size))
    solution = Direct(*states)
    for i, row in enumerate(motion.coefficients):
        now = nodes[i]
        branch = replace(branch, row=row, start=now)
        while now < nodes[i + 1]:
            step = _stuck if branch.held else _moving
            now, y, branch = step(branch, y, now, nodes[i + 1], solution)
        states[:, i + 1] = y[:2]
    solution.dissipated = y[2]
    return solution


def _stuck(
    branch: Branch, y: Float, now: float, end: float, solution: Direct
) -> tuple[float, Float, Branch]:
    times = np.linspace(now, end, 201)
    beyond = np.flatnonzero([branch.pull(t) > 0.0 for t in times])
    if not beyond.size:
        return end, y, branch
    n = beyond[0]
    now = times[0] if n == 0 else brentq(branch.pull, times[n - 1], times[n], xtol=1e-15)
    side = -math.copysign(1.0, branch.ground(times[n]) + branch.constants[0] * y[0])
    solution.count(now)
    moving = np.array([y[0], side * 1e-16, y[2]])  # round-off must not end the branch
    return now, moving, replace(branch, held=False, side=side, z=side * branch.constants[2])


def _moving(
    branch: Branch, y: Float, now: float, end: float, solution: Direct
) -> tuple[float, Float, Branch]:
    branch = replace(branch, z=branch.spring(y[0]), u=y[0])
    # Without a limit on its steps, solve_ivp overlooks two events in one of them.
    span, most = (now, end), (end - branch.start) / 8.0
    done = solve_ivp(
        branch.rates, span, y, "DOP853", rtol=1e-13, atol=1e-15, max_step=most, events=branch.end
    )
    now, y = float(done.t[-1]), done.y[:, -1].copy()
    branch = replace(branch, z=branch.spring(y[0]), u=y[0])
    if done.status == 0:
        return now, y, branch
    if branch.side:
        y[1] = 0.0
        return now, y, replace(branch, side=0.0, held=math.isinf(branch.constants[1]))
    side = math.copysign(1.0, branch.z)
    solution.count(now)
    return now, y, replace(branch, side=side, z=side * branch.constants[2])
