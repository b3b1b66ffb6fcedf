"""Speed of the search for pulses, compared with PyWavelets and a grid of phases, and of commands.

To run it alone: ``python -m tests.benchmarks.pulse_search [RECORDS]``.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pywt
import scipy.fft
from numpy.typing import NDArray
from tests.benchmarks.size import sized

from rockframe.matching.record_pulses import _Surrogates as Surrogates
from rockframe.matching.search import ladder, search
from rockframe.matching.signal import prepared
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.records import write_records
from rockframe.wavelets.family import RICKERS, WAVELETS, MotherWavelet

Float = NDArray[np.float64]

STEP: Final = 0.01
PERIODS: Final = np.geomspace(0.2, 5.0, 128)
HALF_CYCLES: Final = tuple(np.linspace(1.0, 3.0, 9).tolist())
PHASES: Final = 36
FAMILY: Final = "mavroeidis_papageorgiou"


def best_of(function: Callable[[], object], repeats: int) -> float:
    """Return the least processor time of one call [s]."""
    times = []
    for _ in range(sized(repeats, 1)):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return min(times)


def motion(seed: int) -> Float:
    """Return coloured noise that swells and fades [m s-2]."""
    samples = sized(8000, 2000)
    random = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(samples, STEP)
    colour = frequency / (0.2 + frequency**2 / random.uniform(0.5, 4.0))
    noise = np.fft.irfft(colour * np.fft.rfft(random.normal(size=samples)), samples)
    top = random.uniform(4.0, 15.0)
    times = STEP * np.arange(samples)
    envelope = (times / top) ** 2 * np.exp(2.0 - 2.0 * times / top)
    return np.asarray(envelope * noise / np.abs(noise).max() * 5.0)


def family() -> dict[str, float]:
    """Measure the search of the whole family in one record, and other methods, on one core."""
    record = motion(0)
    options = PulseOptions(wavelet=(FAMILY,))
    rickers = PulseOptions(wavelet=tuple(RICKERS))

    def ours() -> object:
        signal = prepared(record, STEP, options, 5.0)
        return search(signal, PERIODS, (FAMILY,), HALF_CYCLES)

    def our_rickers() -> object:
        signal = prepared(record, STEP, rickers, 5.0)
        return search(signal, PERIODS, tuple(RICKERS), ())

    ours(), our_rickers()
    own, two = best_of(ours, 15), best_of(our_rickers, 15)
    scales = PERIODS / (math.sqrt(2.0) * math.pi * STEP)
    rival = best_of(
        lambda: [pywt.cwt(record, scales, name, method="fft") for name in ("mexh", "gaus3")], 3
    )
    every = sized(16, 128)  # of the 128 periods only some are timed; all cost the same
    grid = best_of(lambda: phase_grid(record, PERIODS[::every]), 1) * every
    return {
        "pulse_family_ms": 1e3 * own,
        "pulse_two_rickers_ms": 1e3 * two,
        "pulse_over_pywt": rival / two,
        "pulse_family_correlation_over_pywt": rival / 2.0 * 2.0 * len(HALF_CYCLES) / own,
        "pulse_over_phase_grid": grid / own,
    }


def surrogates(count: int = 10) -> dict[str, float]:
    """Measure the surrogate search, which skips what cannot be highest, and a complete one."""
    options = PulseOptions()
    signal = prepared(Surrogates(motion(0), STEP, options).draw(count), STEP, options, 5.0)
    periods, half_cycles = ladder(0.2, 5.0, 5), (1.0, 2.0, 3.0)

    def searched(nearly: float) -> object:
        return search(signal, periods, options.wavelet, half_cycles, 6, nearly=nearly)

    searched(1.0)
    own = best_of(lambda: searched(1.0), 15)
    whole = best_of(lambda: searched(0.0), 15)
    return {"pulse_surrogate_ms": 1e3 * own / count, "pulse_surrogate_over_whole": whole / own}


def phase_grid(record: Float, periods: Float) -> float:
    """Search with a grid of phases: one FFT correlation at all samples for each of them."""
    size = scipy.fft.next_fast_len(record.size + math.ceil(7.5 / STEP), real=True)
    spectrum = scipy.fft.rfft(record, size)
    best = 0.0
    for half_cycles in HALF_CYCLES:
        parts = WAVELETS[FAMILY].parts(half_cycles)
        for period in periods:
            best = max(best, _of_period(spectrum, size, parts, float(period)))
    return best


def _of_period(
    spectrum: NDArray[np.complex128], size: int, parts: tuple[MotherWavelet, ...], period: float
) -> float:
    lags = np.arange(size)
    tau = np.where(lags > size // 2, lags - size, lags) * (STEP / period)
    one, other = (scipy.fft.rfft(part.acceleration(tau)) for part in parts)
    best = 0.0
    for phase in np.linspace(0.0, math.pi, PHASES, endpoint=False):
        daughter = math.cos(phase) * one + math.sin(phase) * other
        products = scipy.fft.irfft(spectrum * np.conj(daughter), size)
        best = max(best, float(np.abs(products).max()) / math.sqrt(period))
    return best


def archive(count: int | None = None) -> dict[str, float]:
    """Measure `rockframe pulse` with its defaults on many records: time and largest memory."""
    count = count or sized(1000, 1)
    measure = "import resource, sys; from rockframe.cli.main import main; main(sys.argv[1:]); "
    measure += "print(*(resource.getrusage(who).ru_maxrss for who in "
    measure += "(resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))"
    with tempfile.TemporaryDirectory() as folder:
        records = Path(folder, "records.nc")
        made = (
            (Record(record_id=f"R{i:04d}", acceleration=motion(i), time_step=STEP), None)
            for i in range(count)
        )
        write_records(made, records, input_sha256={}, parameters={})
        words = ["pulse", str(records), "--output", f"{folder}/pulses.nc", "--json"]
        start, used = time.perf_counter(), os.times()
        done = subprocess.run(
            [sys.executable, "-c", measure, *words], check=True, capture_output=True, text=True
        )
        end = os.times()
        kilobytes = done.stdout.split()[-2:]
        return {
            f"pulse_{count}_records_s": time.perf_counter() - start,
            f"pulse_{count}_records_processor_s": end.children_user
            + end.children_system
            - used.children_user
            - used.children_system,
            f"pulse_{count}_records_peak_memory_mb": int(kilobytes[0]) / 1024.0,
            f"pulse_{count}_records_worker_memory_mb": int(kilobytes[1]) / 1024.0,
        }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("records", type=int, nargs="?", help="number of records (default: 1000)")
    records = parser.parse_args(arguments).records
    for name, value in (family() | surrogates() | archive(records)).items():
        print(f"{name:40s} {value:12.5g}")


if __name__ == "__main__":
    main()
