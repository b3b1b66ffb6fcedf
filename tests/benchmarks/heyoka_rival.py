"""The response to a Ricker pulse by heyoka (extra `bench`): Taylor series with located events."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from scipy.optimize import brentq

from rockframe import Pulse, RockingFrame
from rockframe.units import GRAVITY

#: Rate after an impact below which the frame is at rest [rad s-1].
REST = 1e-10


def by_heyoka(frame: RockingFrame, pulse: Pulse, repeats: int = 50) -> tuple[float, float]:
    """The largest |theta| [rad] until three periods after the pulse, and the time of a run [s].

    The instant of uplift is given to it; the peak is an event of its own, as the impact is. Only
    the propagation is timed, not the compilation of the integrator.
    """
    import heyoka as hy

    alpha, p = frame.slenderness, frame.effective_frequency_parameter
    theta, omega = hy.make_vars("theta", "omega")
    side = hy.par[0]
    angle = alpha * side - theta
    force = hy.sin(angle) + _acceleration(hy, pulse) / GRAVITY * hy.cos(angle)
    system = [(theta, omega), (omega, -(p**2) * force)]
    uplift = _uplift(frame, pulse)
    end = pulse.time + 3.0 * pulse.T_p
    peaks: list[float] = []

    def landed(integrator: Any, *_: Any) -> bool:
        integrator.state[1] *= frame.restitution
        integrator.pars[0] = -integrator.pars[0]
        integrator.state[0] = integrator.pars[0] * 1e-20
        return bool(abs(integrator.state[1]) > REST)

    def turned(integrator: Any, when: float, *_: Any) -> None:
        integrator.update_d_output(when)
        peaks.append(abs(float(integrator.d_output[0])))

    integrator = hy.taylor_adaptive(
        system,
        [0.0, 0.0],
        pars=[1.0],
        t_events=[hy.t_event(theta, callback=landed)],
        nt_events=[hy.nt_event(omega, callback=turned)],
    )
    times = []
    for _ in range(repeats):
        now, direction = uplift
        peaks.clear()
        start = time.process_time()
        while True:
            integrator.time = now
            integrator.pars[0] = direction
            integrator.state[:] = [direction * 1e-20, 0.0]
            outcome = integrator.propagate_until(end)[0]
            if outcome == hy.taylor_outcome.time_limit:
                break
            now, direction = _next_uplift(frame, pulse, integrator.time, end)
            if now >= end:
                break
        times.append(time.process_time() - start)
        peaks.append(abs(float(integrator.state[0])))
    return max(peaks), min(times)


def _acceleration(hy: Any, pulse: Pulse) -> Any:
    """The closed forms of eqs (44) and (45), in heyoka's expressions."""
    t = hy.time - pulse.time
    if pulse.wavelet == "symmetric_ricker":
        x2 = (math.pi / pulse.T_p) ** 2 * t**2.0
        return pulse.a_p * (1.0 - 2.0 * x2) * hy.exp(-x2)
    x = math.tau / (math.sqrt(3.0) * pulse.T_p) * t
    beta = math.sqrt(18.0 - 6.0 * math.sqrt(6.0)) * math.exp(0.5 * (math.sqrt(6.0) - 3.0))
    return pulse.a_p / beta * (x**2.0 - 3.0) * x * hy.exp(-0.5 * x**2.0)


def _uplift(frame: RockingFrame, pulse: Pulse) -> tuple[float, float]:
    return _next_uplift(frame, pulse, pulse.time - 3.0 * pulse.T_p, pulse.time + 3.0 * pulse.T_p)


def _next_uplift(frame: RockingFrame, pulse: Pulse, now: float, end: float) -> tuple[float, float]:
    """When the ground next exceeds g tan(alpha), and the side that the frame lifts to."""

    def excess(t: float) -> float:
        return abs(float(pulse.acceleration(np.array([t]))[0])) - frame.uplift_acceleration

    grid = np.linspace(now, end, 2000)
    beyond = np.abs(pulse.acceleration(grid)) > frame.uplift_acceleration
    if not beyond.any():
        return end, 0.0
    first = int(np.argmax(beyond))
    when = (
        grid[0] if first == 0 else float(brentq(excess, grid[first - 1], grid[first], xtol=1e-15))
    )
    just_after = float(pulse.acceleration(np.array([grid[first]]))[0])
    return float(when), -math.copysign(1.0, just_after)
