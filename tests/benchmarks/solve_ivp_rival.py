"""The response as a careful user of scipy's solve_ivp would compute it, for comparison.

``python -m tests.benchmarks.solve_ivp_rival`` prints it beside that of rockframe.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from tests.benchmarks.size import sized

from rockframe import GroundAcceleration, Pulse, RockingFrame, respond
from rockframe.units import GRAVITY


def by_solve_ivp(frame: RockingFrame, motion: GroundAcceleration) -> float:
    """Return the largest |theta| / alpha.

    RK45, rtol 1e-6, steps no longer than the record's, an event for the impact, uplift at the
    first sample beyond g tan(alpha), rest below 1e-4 rad/s.
    """
    alpha, p2 = frame.slenderness, frame.effective_frequency_parameter**2
    times = motion.time
    ground = motion.acceleration() / GRAVITY
    limit = math.tan(alpha)
    now, state, peak = 0.0, np.zeros(2), 0.0
    side = 0.0

    def rates(t: float, y: NDArray[np.float64]) -> list[float]:
        a = np.interp(t, times, ground)
        psi = alpha * side - y[0]
        return [y[1], -p2 * (math.sin(psi) + a * math.cos(psi))]

    def impact(_t: float, y: NDArray[np.float64]) -> float:
        return float(side * y[0]) if abs(y[0]) + abs(y[1]) > 1e-12 else 1.0

    impact.terminal = True  # type: ignore[attr-defined]
    impact.direction = -1  # type: ignore[attr-defined]
    while now < times[-1]:
        if side == 0.0:
            later = np.flatnonzero((times >= now) & (np.abs(ground) > limit))
            if later.size == 0:
                break
            now = float(times[later[0]])
            side = -math.copysign(1.0, ground[later[0]])
        found = solve_ivp(
            rates, (now, times[-1]), state, rtol=1e-6, max_step=motion.time_step, events=impact
        )
        peak = max(peak, float(np.abs(found.y[0]).max()))
        now, state = float(found.t[-1]), found.y[:, -1].copy()
        if found.status == 1:
            state = np.array([0.0, frame.restitution * state[1]])
            side = math.copysign(1.0, state[1])
            if abs(state[1]) < 1e-4:
                state, side = np.zeros(2), 0.0
    return peak / alpha


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the peak by solve_ivp and by rockframe."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5, time=1.5)
    times = 0.01 * np.arange(sized(2000, 300))
    motion = GroundAcceleration.from_samples(pulse.acceleration(times), 0.01)
    print(f"solve_ivp: {by_solve_ivp(frame, motion):.9f} of the slenderness")
    print(f"rockframe: {respond(frame, motion).peak_rotation_ratio:.9f} of the slenderness")


if __name__ == "__main__":
    main()
