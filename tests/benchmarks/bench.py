"""`make bench`: speed and memory of what a user does, and ratios to what they would use otherwise.

All ratios are of times measured in the same run on the same machine. The numbers are printed and
written as one flat JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pywt
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rockframe import Pulse, RockingFrame, bundled_records, match_pulse, read_file, respond
from rockframe.matching import _coefficient
from rockframe.rocking import GroundAcceleration
from rockframe.units import GRAVITY
from rockframe.wavelets import WAVELETS

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
COMMAND = str(Path(sys.executable).parent / "rockframe")


def best_of(function: Callable[[], object], repeats: int, calls: int = 1) -> float:
    """Least time of one call [s]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(calls):
            function()
        times.append((time.perf_counter() - start) / calls)
    return min(times)


def strong_record() -> tuple[NDArray[np.float64], float]:
    """40 s at 100 Hz around the peak of a bundled record: CI.CLC, north, 4001 samples."""
    path = bundled_records() / "Ridgecrest2019-CLC.V1"
    record = next(r for r in read_file(path) if r.component == "360")
    return record.acceleration[1200:5201] - record.acceleration.mean(), record.time_step


def by_solve_ivp(acceleration: NDArray[np.float64], time_step: float) -> float:
    """The largest |theta| / alpha as a careful user of solve_ivp gets it.

    RK45, rtol 1e-6, steps no longer than the record's, an event for the impact, uplift at the
    first sample beyond g tan(alpha), rest below 1e-4 rad/s.
    """
    alpha, p2 = BENT.slenderness, BENT.effective_frequency_parameter**2
    times = time_step * np.arange(acceleration.size)
    ground = acceleration / GRAVITY
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
            rates, (now, times[-1]), state, rtol=1e-6, max_step=time_step, events=impact
        )
        peak = max(peak, float(np.abs(found.y[0]).max()))
        now, state = float(found.t[-1]), found.y[:, -1].copy()
        if found.status == 1:
            state = np.array([0.0, BENT.restitution * state[1]])
            side = math.copysign(1.0, state[1])
            if abs(state[1]) < 1e-4:
                state, side = np.zeros(2), 0.0
    return peak / alpha


def kernel() -> dict[str, float]:
    """One response of a 40 s record at 100 Hz, against solve_ivp."""
    acceleration, step = strong_record()
    motion = GroundAcceleration.from_samples(acceleration, step)
    ours = respond(BENT, motion).peak_rotation_ratio
    own = best_of(lambda: respond(BENT, motion), repeats=7, calls=50)
    peaks: list[float] = []
    rival = best_of(lambda: peaks.append(by_solve_ivp(acceleration, step)), repeats=1)
    return {
        "response_40s_100hz_ms": 1e3 * own,
        "response_ns_per_sample": 1e9 * own / acceleration.size,
        "response_over_solve_ivp": rival / own,
        "solve_ivp_peak_error": abs(peaks[0] / ours - 1.0),
    }


def continuous_pulse() -> dict[str, float]:
    """One response to a continuous Ricker pulse."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    respond(BENT, pulse)
    return {"response_pulse_ms": 1e3 * best_of(lambda: respond(BENT, pulse), repeats=5, calls=20)}


def pulses() -> dict[str, float]:
    """Both Ricker wavelets for one record, against the same search with PyWavelets."""
    acceleration, step = strong_record()
    own = best_of(lambda: [match_pulse(acceleration, step, name) for name in WAVELETS], repeats=5)
    rungs = math.ceil(math.log(25.0) / math.log(1.025)) + 1
    scales = np.geomspace(0.2, 5.0, rungs) / (math.sqrt(2.0) * math.pi * step)
    rival = best_of(
        lambda: [pywt.cwt(acceleration, scales, name, method="fft") for name in ("mexh", "gaus3")],
        repeats=2,
    )
    mother = WAVELETS["symmetric_ricker"]
    one = best_of(lambda: _coefficient(acceleration, step, mother, 1.0, 12.0), 5, 100)
    return {
        "pulse_two_wavelets_ms": 1e3 * own,
        "pulse_over_pywt_search": rival / own,
        "pulse_one_coefficient_us": 1e6 * one,
    }


def commands() -> dict[str, float]:
    """Whole commands, as typed: wall time and largest memory."""
    results = {}
    results["help_s"] = best_of(
        lambda: subprocess.run([COMMAND, "--help"], check=True, capture_output=True), repeats=5
    )
    with tempfile.TemporaryDirectory() as folder:
        cache = {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/cache"}
        words = [COMMAND, "table1", "--output", f"{folder}/run"]

        def table1() -> None:
            subprocess.run(words, check=True, capture_output=True, env=cache)

        results["table1_cold_s"] = best_of(table1, repeats=1)
        results["table1_warm_s"] = best_of(table1, repeats=2)
    kilobytes = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    results["table1_peak_memory_mb"] = kilobytes / 1024.0
    return results


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True)
    output: Path = parser.parse_args().output
    results: dict[str, float] = {}
    for part in (commands, kernel, continuous_pulse, pulses):
        measured = part()
        results |= measured
        for name, value in measured.items():
            print(f"{name:28s} {value:12.5g}", flush=True)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    print(f"written to {output}")


if __name__ == "__main__":
    main()
