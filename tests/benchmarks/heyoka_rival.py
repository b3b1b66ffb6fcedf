"""The response to a Ricker pulse by heyoka (extra `bench`): Taylor series with located events.

``python -m tests.benchmarks.heyoka_rival`` prints it beside that of rockframe.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import brentq
from tests.benchmarks.size import sized

from rockframe import Pulse, RockingFrame, respond
from rockframe.units import GRAVITY

#: Rate after an impact below which the frame is at rest [rad s-1].
REST = 1e-10


def by_heyoka(frame: RockingFrame, pulse: Pulse, *, batch: int = 1) -> tuple[float, float]:
    """Return the largest |theta| [rad] to three periods after the pulse, and a run's time [s].

    heyoka is given the instant of uplift; the peak is an event, as the impact is. Only the
    propagation is timed, not the compilation of the integrator. With `batch` above 1, that many
    runs of the same motion are propagated together in the vectors of its batch mode.
    """
    import heyoka as hy

    theta, omega = hy.make_vars("theta", "omega")
    angle = frame.slenderness * hy.par[0] - theta
    force = hy.sin(angle) + _acceleration(hy, pulse) / GRAVITY * hy.cos(angle)
    p = frame.effective_frequency_parameter
    system = [(theta, omega), (omega, -(p**2) * force)]
    end = pulse.time + 3.0 * pulse.T_p
    peaks: list[float] = []

    def landed(integrator: Any, _: int, *lane: int) -> bool:
        integrator.state[1, *lane] *= frame.restitution
        integrator.pars[0, *lane] = side = -integrator.pars[0, *lane]
        integrator.state[0, *lane] = side * 1e-20
        return bool(abs(integrator.state[1, *lane]) > REST)

    def turned(integrator: Any, when: float, _: int, *lane: int) -> None:
        integrator.update_d_output(np.full(batch, when) if lane else when)
        peaks.append(abs(float(integrator.d_output[0, *lane])))

    one, other = (hy.t_event_batch, hy.nt_event_batch) if batch > 1 else (hy.t_event, hy.nt_event)
    kind = hy.taylor_adaptive_batch if batch > 1 else hy.taylor_adaptive
    integrator = kind(
        system,
        np.zeros((2, batch) if batch > 1 else 2),
        pars=np.ones((1, batch) if batch > 1 else 1),
        t_events=[one(theta, callback=landed)],
        nt_events=[other(omega, callback=turned)],
    )
    times = []
    for _ in range(sized(50, 1)):
        now, direction = _next_uplift(frame, pulse, pulse.time - 3.0 * pulse.T_p, end)
        peaks.clear()
        start = time.process_time()
        while now < end:
            if batch > 1:
                integrator.set_time(now)
            else:
                integrator.time = now
            integrator.pars[0] = direction
            integrator.state[0] = direction * 1e-20
            integrator.state[1] = 0.0
            integrator.propagate_until(end)
            now = float(np.max(integrator.time))
            if now < end:  # at rest
                now, direction = _next_uplift(frame, pulse, now, end)
        times.append((time.process_time() - start) / batch)
        peaks.append(float(np.max(np.abs(integrator.state[0]))))
    return max(peaks), min(times)


def _acceleration(hy: Any, pulse: Pulse) -> Any:
    """Return the closed forms of eqs (44) and (45) in heyoka's expressions."""
    t = hy.time - pulse.time
    if pulse.wavelet == "symmetric_ricker":
        x2 = (math.pi / pulse.T_p) ** 2 * t**2.0
        return pulse.a_p * (1.0 - 2.0 * x2) * hy.exp(-x2)
    x = math.tau / (math.sqrt(3.0) * pulse.T_p) * t
    beta = math.sqrt(18.0 - 6.0 * math.sqrt(6.0)) * math.exp(0.5 * (math.sqrt(6.0) - 3.0))
    return pulse.a_p / beta * (x**2.0 - 3.0) * x * hy.exp(-0.5 * x**2.0)


def _next_uplift(frame: RockingFrame, pulse: Pulse, now: float, end: float) -> tuple[float, float]:
    """Return when the ground next exceeds g tan(alpha), and the side of the uplift."""

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


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the peak by heyoka and by rockframe."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    peak, seconds = by_heyoka(frame, pulse)
    print(f"heyoka: {peak:.9f} rad in {1e3 * seconds:.3f} ms")
    print(f"rockframe: {respond(frame, pulse).peak_rotation:.9f} rad")


if __name__ == "__main__":
    main()
