"""Isolated decks and monolithic frames: time of a step on one core, and ratios to two solvers.

To run it alone: ``python -m tests.benchmarks.oscillators``.

Times are the least processor time of several repeats. An elastic frame stays on its branch; a
deck on lead-rubber bearings leaves it about 80 times in 4,000 steps.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from tests.benchmarks.kernels import processor_time, smooth_grounds
from tests.benchmarks.size import sized

from rockframe import FixedFrame, GroundAcceleration, IsolatedDeck, respond_oscillators

ELASTIC = FixedFrame(period=2.0, damping_ratio=0.0)
DECK = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=2.5)


def by_solve_ivp(motion: GroundAcceleration) -> float:
    """Return the deck's largest displacement by RK45, rtol 1e-6; the rate of z switches."""
    k, k_z, q, _ = DECK.constants
    ground = motion.acceleration()

    def rates(t: float, y: NDArray[np.float64]) -> list[float]:
        yielding = abs(y[2]) >= q and y[1] * y[2] > 0.0
        a = np.interp(t, motion.time, ground)
        return [y[1], -a - k * y[0] - y[2], 0.0 if yielding else k_z * y[1]]

    span = (0.0, float(motion.time[-1]))
    found = solve_ivp(rates, span, np.zeros(3), rtol=1e-6, max_step=motion.time_step)
    return float(np.abs(found.y[0]).max())


def by_newmark(motion: GroundAcceleration) -> float:
    """Return the deck's largest displacement by Newmark's method in a numpy loop.

    The acceleration is averaged over a step, and yielding takes one return mapping a step.
    """
    k, k_z, q, _ = DECK.constants
    h, ground = motion.time_step, motion.acceleration()
    u = v = z = 0.0
    acceleration, peak = -ground[0], 0.0
    for a in ground[1:]:
        known = u + h * v + 0.25 * h * h * acceleration
        for stiffness in (k + k_z, k):
            held = z - k_z * u if stiffness > k else np.sign(z) * q
            new = (known - 0.25 * h * h * (a + held)) / (1.0 + 0.25 * h * h * stiffness)
            if stiffness > k:
                z = np.clip(z + k_z * (new - u), -q, q)
                if abs(z) < q:
                    break
        after = 4.0 / (h * h) * (new - u - h * v) - acceleration
        v += 0.5 * h * (acceleration + after)
        u, acceleration = new, after
        peak = max(peak, abs(u))
    return float(peak)


def measure() -> dict[str, float]:
    """Measure the time of a step, and the ratios of the other solvers' times to it."""
    grounds, scales = smooth_grounds(), np.linspace(0.6, 1.2, sized(40, 2))
    steps = sum(ground.coefficients.shape[0] for ground in grounds) * scales.size
    own = {}
    for name, model in (("elastic", ELASTIC), ("isolated", DECK)):
        ask = partial(respond_oscillators, [model], grounds, scales)
        ask()
        own[name] = processor_time(ask, repeats=7) / steps
    results = {f"oscillator_{name}_ns_per_step": 1e9 * each for name, each in own.items()}
    right = respond_oscillators([DECK], grounds[:1]).peak_displacement[0, 0, 0]
    for name, rival in (("solve_ivp", by_solve_ivp), ("newmark", by_newmark)):
        start = time.process_time()
        peak = rival(grounds[0])
        took = (time.process_time() - start) / grounds[0].coefficients.shape[0]
        results[f"oscillator_over_{name}"] = took / own["isolated"]
        results[f"oscillator_{name}_peak_error"] = abs(peak / right - 1.0)
    return results


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    print(json.dumps(measure(), indent=2))


if __name__ == "__main__":
    main()
