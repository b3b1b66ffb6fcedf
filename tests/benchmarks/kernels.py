"""The kernel in lanes, in one run and on one core: against the scalar kernel, solve_ivp and heyoka.

Smooth ground is a sum of four harmonics, rough ground the bundled records with their hundreds of
bounces: a step of both is one sample interval of one scenario, at rest or rocking. Processor time,
the least of several repeats, because others may share the machine; the million is by the clock.
"""

from __future__ import annotations

import importlib.util
import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from heyoka_rival import by_heyoka
from numpy.typing import NDArray
from solve_ivp_rival import by_solve_ivp

from rockframe import (
    GroundAcceleration,
    Pulse,
    RockingFrame,
    Scenarios,
    bundled_records,
    read_file,
    respond,
    respond_scenarios,
)
from rockframe.rocking import kernel
from rockframe.rocking.response import as_ground, vertical_in_g
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
SAMPLES = 4001
#: So strong that the bent rocks and nearly always stands: shares of the record's own strength.
SCALES = (0.6, 1.2)


def processor_time(function: Callable[[], object], repeats: int) -> float:
    """Least processor time of a call [s]."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def rough_grounds() -> list[GroundAcceleration]:
    """40 s at 100 Hz around the peak of each horizontal component of the bundled records."""
    grounds = []
    for path in sorted(bundled_records().glob("*.V1")):
        for record in read_file(path):
            if record.component.lower() in ("up", "vert", "v"):
                continue
            top = int(np.abs(record.acceleration).argmax())
            first = max(0, min(top - 1200, record.acceleration.size - SAMPLES))
            window = record.acceleration[first : first + SAMPLES] - record.acceleration.mean()
            # as strong as the strongest one, so that all of them make the bent rock
            window = window * (0.5 * GRAVITY / np.abs(window).max())
            grounds.append(GroundAcceleration.from_samples(window, record.time_step))
    return grounds


def smooth_grounds() -> list[GroundAcceleration]:
    """As long and with as many samples, of periods from 0.5 to 3 s."""
    times = 0.01 * np.arange(SAMPLES)
    swell = np.minimum(1.0, times / 3.0) * np.exp(-0.03 * times)
    grounds = []
    for k in range(6):
        waves = [
            strength * np.sin(math.tau * frequency * times + 7.0 * frequency + k)
            for frequency, strength in ((0.3, 1.2), (0.7, 1.0), (1.1, 0.8), (1.9, 0.5))
        ]
        grounds.append(GroundAcceleration.from_samples(swell * np.sum(waves, axis=0), 0.01))
    return grounds


def ask(grounds: list[GroundAcceleration], count: int, offset: int = 0) -> Scenarios:
    """Respond to so many scenarios: every ground in turn, at scales that are all different."""
    number = offset + np.arange(count)
    scale = SCALES[0] + (SCALES[1] - SCALES[0]) * ((number * 0.6180339887498949) % 1.0)
    zero = np.zeros(count, dtype=np.intp)
    return respond_scenarios(grounds, [BENT], number % len(grounds), zero, scale)


def one_by_one(ground: GroundAcceleration, scales: Float) -> None:
    """The scalar kernel over the scales."""
    frame = np.ones(scales.size)
    kernel.integrate_many(
        ground.coefficients / GRAVITY,
        vertical_in_g(ground),
        ground.time_step,
        ground.start_time,
        scales,
        BENT.slenderness * frame,
        BENT.effective_frequency_parameter * frame,
        BENT.restitution * frame,
        np.empty(scales.size, dtype=np.int8),
        np.empty((scales.size, kernel.SUMMARY_SIZE)),
    )


def lanes() -> dict[str, float]:
    """Time of a step, and over the scalar kernel's, on smooth and on rough ground."""
    results = {}
    for kind, grounds in (("", smooth_grounds()), ("_rough", rough_grounds())):
        count = 300 * len(grounds)
        found = ask(grounds, count)
        own = processor_time(lambda: ask(grounds, count), repeats=5) / count
        scales = np.linspace(*SCALES, 20)
        one_by_one(grounds[0], scales[:1])
        scalar = sum(
            processor_time(lambda: one_by_one(ground, scales), repeats=2) for ground in grounds
        ) / (20 * len(grounds))
        rocking = np.mean(
            [np.mean(respond(BENT, ground.scaled(0.9)).theta != 0.0) for ground in grounds]
        )
        results[f"kernel_ns_per_step{kind}"] = 1e9 * own / (SAMPLES - 1)
        results[f"kernel_ns_per_rocking_step{kind}"] = 1e9 * own / (SAMPLES - 1) / float(rocking)
        results[f"kernel_over_scalar{kind}"] = scalar / own
        results[f"kernel_impacts{kind}"] = float(found.impacts.mean())
        start = time.process_time()
        theirs = by_solve_ivp(BENT, grounds[0])
        rival = time.process_time() - start
        right = respond(BENT, grounds[0]).peak_rotation_ratio
        mine = respond_scenarios([grounds[0]], [BENT], [0], [0], [1.0]).peak_rotation_ratio[0]
        results[f"kernel_over_solve_ivp{kind}"] = rival / own
        results[f"kernel_peak_error{kind}"] = abs(float(mine) / right - 1.0)
        results[f"solve_ivp_peak_error{kind}"] = abs(theirs / right - 1.0)
    return results


def heyoka() -> dict[str, float]:
    """The same Ricker pulses by heyoka's integrator, whose events are the impacts."""
    if importlib.util.find_spec("heyoka") is None:
        return {}
    results = {}
    for wavelet, strength in (("symmetric_ricker", 0.5), ("antisymmetric_ricker", 0.6)):
        pulse = Pulse(wavelet=wavelet, a_p=strength * GRAVITY, T_p=1.5)
        theirs, rival = by_heyoka(BENT, pulse)
        grounds = [as_ground(pulse)]
        zero = np.zeros(2000, dtype=np.intp)
        scale = 1.0 + 1e-9 * np.arange(2000)
        found = respond_scenarios(grounds, [BENT], zero, zero, scale)
        own = processor_time(
            lambda: respond_scenarios(grounds, [BENT], zero, zero, scale), repeats=5
        )
        name = wavelet.removesuffix("_ricker")
        results[f"kernel_over_heyoka_{name}"] = rival / (own / 2000)
        results[f"kernel_minus_heyoka_{name}"] = abs(float(found.peak_rotation[0]) - theirs)
    results["kernel_over_heyoka"] = min(
        value for name, value in results.items() if name.startswith("kernel_over_heyoka_")
    )
    return results


def million(most: int, picture: Path | None = None) -> dict[str, float]:
    """A thousand to a million responses of 4,000 samples on two threads, rough ground.

    The clock's time; with a picture of it over the number of scenarios.
    """
    grounds = rough_grounds()
    counts = [1000, 10_000, 100_000, 1_000_000]
    counts = [count for count in counts if count <= most]
    times = []
    with ThreadPoolExecutor(2) as pool:
        for count in counts:
            batches = [(first, min(4000, count - first)) for first in range(0, count, 4000)]
            batches = batches if count > 4000 else [(0, count // 2), (count // 2, count // 2)]
            start = time.perf_counter()
            for _ in pool.map(lambda batch: ask(grounds, batch[1], batch[0]), batches):
                pass
            times.append(time.perf_counter() - start)
    results = {
        f"responses_{count}_us_each": 1e6 * spent / count
        for count, spent in zip(counts, times, strict=True)
    }
    if counts[-1] == 1_000_000:
        results["million_responses_s"] = times[-1]
        smooth = smooth_grounds()
        start = time.perf_counter()
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda k: ask(smooth, 4000, 4000 * k), range(25)))
        results["million_responses_smooth_s"] = 10.0 * (time.perf_counter() - start)
    if picture is not None:
        draw(counts, times, picture)
    return results


def draw(counts: list[int], times: list[float], path: Path) -> None:
    """Time over the number of scenarios, and the line of proportion through the last."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.35, 2.6), layout="constrained")
    axes = figure.subplots()
    each = times[-1] / counts[-1]
    axes.loglog(counts, [each * count for count in counts], color="0.7", label="proportional")
    axes.loglog(counts, times, "o", color="black", label="measured")
    axes.set_xlabel("scenarios of 4,000 samples")
    axes.set_ylabel("time on two threads [s]")
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=200)
