"""The vectorised kernel on one core, compared with the scalar kernel, solve_ivp and heyoka.

Smooth ground is a sum of four harmonics; rough ground is the bundled records, with hundreds of
bounces. On both, a step is one sample interval of one scenario, at rest or rocking, until it
overturns. Times are the least processor time of several repeats, because others may use the
machine. The million responses are also timed by the clock, on all cores.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.heyoka_rival import by_heyoka
from tests.benchmarks.size import sized
from tests.benchmarks.solve_ivp_rival import by_solve_ivp

from rockframe import (
    GroundAcceleration,
    Pulse,
    RockingFrame,
    Scenarios,
    Tendon,
    bundled_records,
    read_file,
    respond,
    respond_scenarios,
)
from rockframe.rocking.kernels import kernel
from rockframe.rocking.response import as_ground, vertical_in_g
from rockframe.units import GRAVITY

Float = NDArray[np.float64]

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
#: The bent with tendons below and above the stiffness at which gravity cannot overturn it.
TIED = [
    replace(BENT, column_mass=48e3, tendon=Tendon(area=area, modulus=195e9, length=9.6))
    for area in (2.8e-4, 1.4e-3)
]
#: Number of runs that heyoka propagates together in batch mode: a vector of the widest kind.
HEYOKA_BATCH = 8
#: Smallest and largest factor of the grounds.
SCALES = (0.6, 1.2)


def samples() -> int:
    """Return the number of samples of a ground."""
    return sized(4001, 401)


def processor_time(function: Callable[[], object], repeats: int) -> float:
    """Return the least processor time of a call [s]."""
    times = []
    for _ in range(sized(repeats, 1)):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def rough_grounds() -> list[GroundAcceleration]:
    """Return 40 s at 100 Hz around the peak of each bundled horizontal record."""
    grounds = []
    for path in sorted(bundled_records().glob("*.V1"))[: sized(None, 1)]:
        for record in read_file(path):
            if record.component.lower() in ("up", "vert", "v"):
                continue
            top = int(np.abs(record.acceleration).argmax())
            first = max(0, min(top - samples() * 3 // 10, record.acceleration.size - samples()))
            window = record.acceleration[first : first + samples()] - record.acceleration.mean()
            # All are scaled to the same peak, so that all of them make the bent rock.
            window = window * (0.5 * GRAVITY / np.abs(window).max())
            grounds.append(GroundAcceleration.from_samples(window, record.time_step))
    return grounds


def smooth_grounds() -> list[GroundAcceleration]:
    """Return motions of the same length and time step, with periods from 0.5 to 3 s."""
    times = 0.01 * np.arange(samples())
    swell = np.minimum(1.0, times / 3.0) * np.exp(-0.03 * times)
    grounds = []
    for k in range(6):
        waves = [
            strength * np.sin(math.tau * frequency * times + 7.0 * frequency + k)
            for frequency, strength in ((0.3, 1.2), (0.7, 1.0), (1.1, 0.8), (1.9, 0.5))
        ]
        grounds.append(GroundAcceleration.from_samples(swell * np.sum(waves, axis=0), 0.01))
    return grounds


def ask(
    grounds: list[GroundAcceleration], count: int, offset: int = 0, frame: RockingFrame = BENT
) -> Scenarios:
    """Respond to `count` scenarios: each ground in turn, at scales that are all different."""
    number = offset + np.arange(count)
    scale = SCALES[0] + (SCALES[1] - SCALES[0]) * ((number * 0.6180339887498949) % 1.0)
    zero = np.zeros(count, dtype=np.intp)
    return respond_scenarios(grounds, [frame], number % len(grounds), zero, scale)


def one_by_one(ground: GroundAcceleration, scales: Float) -> None:
    """Run the scalar kernel over the scales."""
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
        (),
        np.empty((0, 10)),
    )


def steps(found: Scenarios) -> float:
    """Return the mean number of sample intervals of a scenario until it overturns."""
    last = samples() - 1
    fallen = np.minimum(found.overturning_time / 0.01, last)
    return float(np.where(np.isnan(fallen), last, fallen).mean())


def on_ground(grounds: list[GroundAcceleration]) -> dict[str, float]:
    """Measure the time of a step, and the ratios of the other solvers' times to it."""
    count = sized(1000, 2) * len(grounds)
    found = ask(grounds, count)
    own = processor_time(partial(ask, grounds, count), repeats=5) / count
    scales = np.linspace(*SCALES, sized(20, 2))
    one_by_one(grounds[0], scales[:1])
    scalar = sum(processor_time(partial(one_by_one, g, scales), repeats=2) for g in grounds)
    rocking = [np.mean(respond(BENT, g.scaled(0.9)).theta != 0.0) for g in grounds]
    start = time.process_time()
    theirs = by_solve_ivp(BENT, grounds[0])
    rival = time.process_time() - start
    right = respond(BENT, grounds[0]).peak_rotation_ratio
    mine = float(respond_scenarios(grounds, [BENT], [0], [0], [1.0]).peak_rotation_ratio[0])
    each = own / steps(found)
    tied = []
    for frame in TIED:
        held = ask(grounds, count, frame=frame)
        took = processor_time(partial(ask, grounds, count, frame=frame), repeats=3) / count
        tied.append(took / steps(held) / each)
    return {
        "kernel_ns_per_step": 1e9 * each,
        "kernel_ns_per_rocking_step": 1e9 * each / float(np.mean(rocking)),
        "kernel_tied_over_free": max(tied),
        "kernel_impacts": float(found.impacts.mean()),
        "kernel_over_scalar": scalar / (scales.size * len(grounds)) / own,
        "kernel_over_solve_ivp": rival / own,
        "kernel_peak_error": abs(mine / right - 1.0),
        "solve_ivp_peak_error": abs(theirs / right - 1.0),
    }


def lanes() -> dict[str, float]:
    """Measure the kernel on smooth ground, and on rough ground under names ending in `_rough`."""
    rough = {f"{name}_rough": value for name, value in on_ground(rough_grounds()).items()}
    return on_ground(smooth_grounds()) | rough


def against_heyoka() -> dict[str, float]:
    """Compare with heyoka's integrator, whose events are the impacts, under Ricker pulses."""
    if importlib.util.find_spec("heyoka") is None:
        return {}
    results = {}
    for wavelet, strength in (("symmetric_ricker", 0.5), ("antisymmetric_ricker", 0.6)):
        pulse = Pulse(wavelet=wavelet, a_p=strength * GRAVITY, T_p=1.5)
        theirs, rival = by_heyoka(BENT, pulse)
        _, batched = by_heyoka(BENT, pulse, batch=HEYOKA_BATCH)
        count = sized(2000, 2)
        zero = np.zeros(count, dtype=np.intp)
        scale = 1.0 + 1e-9 * np.arange(count)  # practically the same scale many times
        asked = partial(respond_scenarios, [as_ground(pulse)], [BENT], zero, zero, scale)
        peak = float(asked().peak_rotation[0])
        own = processor_time(asked, repeats=5) / count
        name = wavelet.removesuffix("_ricker")
        results[f"kernel_over_heyoka_{name}"] = rival / own
        results[f"kernel_over_heyoka_batch_{name}"] = batched / own
        results[f"kernel_minus_heyoka_{name}"] = abs(peak - theirs)
    ratios = (results[f"kernel_over_heyoka_{name}"] for name in ("symmetric", "antisymmetric"))
    return results | {"kernel_over_heyoka": min(ratios)}


def timed(grounds: list[GroundAcceleration], count: int) -> tuple[float, float]:
    """Return the wall time and the processor time [s] of `count` responses."""
    size = min(32_000, count)
    start, worked = time.perf_counter(), time.process_time()
    for first in range(0, count, size):
        ask(grounds, size, first)  # results are not kept, so memory does not grow
    return time.perf_counter() - start, time.process_time() - worked


def million() -> dict[str, float]:
    """Measure a thousand to a million responses of 4,000 samples; draw outputs/bench-linear.png.

    The wall time is what a user waits; the processor time does not depend on who else uses the
    machine. The smooth million is ten times a hundred thousand.
    """
    rough, smooth = rough_grounds(), smooth_grounds()
    ask(rough, 10)  # load the compiled code
    counts = sized([1000, 10_000, 100_000, 1_000_000], [10])
    times = [timed(rough, count) for count in counts]
    draw(counts, [worked for _, worked in times], Path("outputs/bench-linear.png"))
    results = {
        f"responses_{count}_processor_us_each": 1e6 * worked / count
        for count, (_, worked) in zip(counts, times, strict=True)
    }
    if counts[-1] == 1_000_000:
        results["million_responses_s"], results["million_responses_processor_s"] = times[-1]
        clock, worked = timed(smooth, 100_000)
        results["million_responses_smooth_s"] = 10.0 * clock
        results["million_responses_smooth_processor_s"] = 10.0 * worked
    return results | {
        "million_peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    }


def draw(counts: list[int], times: list[float], path: Path) -> None:
    """Draw the time over the number of scenarios, and the line of proportion through the last."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.35, 2.6), layout="constrained")
    axes = figure.subplots()
    each = times[-1] / counts[-1]
    axes.loglog(counts, [each * count for count in counts], color="0.7", label="proportional")
    axes.loglog(counts, times, "o", color="black", label="measured")
    axes.set_xlabel("scenarios of 4,000 samples")
    axes.set_ylabel("processor time [s]")
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=200)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    print(json.dumps(lanes() | against_heyoka() | million(), indent=2))


if __name__ == "__main__":
    main()
