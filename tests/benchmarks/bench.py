"""`make bench`: speed and memory of what users do, and ratios to other tools for the same task.

All ratios are of times measured in the same run on the same machine. The numbers are printed and
written as one flat JSON object.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas
from numpy.typing import NDArray
from tests.benchmarks import kernels, oscillators, pulse_search, screening, spectra
from tests.benchmarks.size import sized
from tests.benchmarks.solve_ivp_rival import by_solve_ivp

from rockframe import Pulse, RockingFrame, bundled_records, read_file, respond
from rockframe.ingest import read_bytes
from rockframe.rocking import GroundAcceleration
from rockframe.units import GRAVITY

KNET_HEADER = (
    "Origin Time       2008/06/14 08:43:00",
    "Lat.              39.028",
    "Long.             140.880",
    "Depth. (km)       8",
    "Mag.              7.2",
    "Station Code      AOM000",
    "Station Lat.      40.0000",
    "Station Long.     139.0000",
    "Station Height(m) 42",
    "Record Time       2008/06/14 08:44:18",
    "Sampling Freq(Hz) 100Hz",
    "Duration Time(s)  80",
    "Dir.              E-W",
    "Scale Factor      3920(gal)/6182761",
    "Max. Acc. (gal)   100.000",
    "Last Correction   2008/06/14 08:44:03",
    "Memo.             ",
)
BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
STRONG = bundled_records() / "Ridgecrest2019-CLC.V1"
COMMAND = str(Path(sys.executable).parent / "rockframe")


def best_of(function: Callable[[], object], repeats: int, calls: int = 1) -> float:
    """Return the least time of one call [s]."""
    times = []
    repeats, calls = sized((repeats, calls), (1, 1))
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(calls):
            function()
        times.append((time.perf_counter() - start) / calls)
    return min(times)


def strong_record() -> tuple[NDArray[np.float64], float]:
    """Return 40 s at 100 Hz around the peak of a bundled record: CI.CLC, north, 4001 samples.

    Of the smallest size, it is 6 s.
    """
    record = next(r for r in read_file(STRONG) if r.component == "360")
    start, end = sized((1200, 5201), (2200, 2801))
    return record.acceleration[start:end] - record.acceleration.mean(), record.time_step


def response() -> dict[str, float]:
    """Compare one response to a 40 s record at 100 Hz with solve_ivp."""
    acceleration, step = strong_record()
    motion = GroundAcceleration.from_samples(acceleration, step)
    ours = respond(BENT, motion).peak_rotation_ratio
    own = best_of(lambda: respond(BENT, motion), repeats=7, calls=50)
    peaks: list[float] = []
    rival = best_of(lambda: peaks.append(by_solve_ivp(BENT, motion)), repeats=1)
    return {
        "response_40s_100hz_ms": 1e3 * own,
        "response_ns_per_sample": 1e9 * own / acceleration.size,
        "response_over_solve_ivp": rival / own,
        "solve_ivp_peak_error": abs(peaks[0] / ours - 1.0),
    }


def continuous_pulse() -> dict[str, float]:
    """Measure one response to a continuous Ricker pulse."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
    respond(BENT, pulse)
    return {"response_pulse_ms": 1e3 * best_of(lambda: respond(BENT, pulse), repeats=5, calls=20)}


def commands() -> dict[str, float]:
    """Measure whole commands as typed: wall time and largest memory."""
    results = {}
    results["help_s"] = best_of(
        lambda: subprocess.run([COMMAND, "--help"], check=True, capture_output=True), repeats=5
    )
    with tempfile.TemporaryDirectory() as folder:
        cache = {**os.environ, **sized({"NUMBA_CACHE_DIR": f"{folder}/cache"}, {})}
        words = [COMMAND, "table1", "--output", f"{folder}/run"]
        words += sized([], ["--records", str(STRONG), "--structure", "bridge-bent"])
        words += sized([], ["--margins", "none", "--surrogates", "0"])

        def table1() -> None:
            subprocess.run(words, check=True, capture_output=True, env=cache)

        for name, repeats in sized((("cold", 1), ("warm", 2)), (("warm", 1),)):
            results[f"table1_{name}_s"] = best_of(table1, repeats)
        kilobytes = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
        results["table1_peak_memory_mb"] = kilobytes / 1024.0
        report = [COMMAND, "report", f"{folder}/run"]
        results["report_table1_s"] = best_of(
            lambda: subprocess.run(report, check=True, capture_output=True, env=cache), repeats=2
        )
        results["report_table1_mb"] = Path(folder, "run", "report.html").stat().st_size / 1e6
    return results


def sample_files(samples: int) -> dict[str, bytes]:
    """Return one file of each kind, all with the same noise."""
    noise = np.random.default_rng(1).normal(0.0, 0.1, samples)
    scientific = [f"{a:15.7E}" for a in noise]
    at2 = ["".join(scientific[i : i + 5]) for i in range(0, samples, 5)]
    fixed = [f"{a:.6f}".replace("0.", ".", 1).rjust(9) for a in noise]
    v1 = (bundled_records() / "Ridgecrest2019-CCC.V1").read_bytes().split(b"\r\n")[:28]
    v1[10] = v1[10].replace(b"10000", b"%5d" % samples)
    v1[10] = v1[10].replace(b"Length =100.000", b"Length =%7.3f" % (samples / 100))
    v1[11] = b"Units of uncor data are sec and g."
    v1[13:20] = [b"".join([b"    0"] * 16)] * 7
    v1[20:27] = [b"      .000" * 8] * 7
    v1[27] = v1[27].replace(b"10000", b"%5d" % samples)
    v1 += ["".join(fixed[i : i + 8]).encode() for i in range(0, samples, 8)] + [b"/&", b""]
    counts = np.round(1e6 * noise)
    largest = np.abs(counts - counts.mean()).max() * 3920.0 / 6182761.0
    digits = [f"{int(count):9d}" for count in counts]
    knet = [line.replace("100.000", f"{largest:.3f}") for line in KNET_HEADER]
    knet += ["".join(digits[i : i + 8]) for i in range(0, samples, 8)]
    sizes = f"NPTS= {samples}, DT= .0050 SEC"
    units = "ACCELERATION TIME SERIES IN UNITS OF G"
    table = [f"{0.005 * i:.3f},{a:.7E}" for i, a in enumerate(noise)]
    return {
        "at2": "\n".join(
            ["PEER", "Event, 1/2/2003, Station, 090", units, sizes, *at2, ""]
        ).encode(),
        "fixed_columns": b"\r\n".join(v1),
        "text": "\n".join(["time_s,acc_g", *table, ""]).encode(),
        "knet": "\n".join([*knet, ""]).encode(),
    }


def parsing() -> dict[str, float]:
    """Measure megabytes of text read per second on one core, and ratios to other readers."""
    from obspy.io.nied.knet import _read_knet_ascii

    files = sample_files(8000)

    def speed(data: bytes, read: Callable[[bytes], object]) -> float:
        return len(data) / 1e6 / best_of(lambda: read(data), repeats=7, calls=5)

    knet = speed(files["knet"], lambda data: _read_knet_ascii(io.BytesIO(data)))
    results = {"parse_obspy_knet_mb_s": knet}
    for name in ("at2", "fixed_columns", "text", "knet"):
        own = speed(files[name], lambda data: read_bytes("noise", data))
        results[f"parse_{name}_mb_s"] = own
        results[f"parse_{name}_over_obspy_knet"] = own / knet
    for name, head, comma in (("at2", 4, None), ("fixed_columns", 28, None), ("text", 1, ",")):
        loadtxt = speed(files[name], partial(numpy_table, head=head, separator=comma))
        frame = speed(files[name], partial(pandas_table, head=head, separator=comma or r"\s+"))
        results[f"parse_{name}_over_loadtxt"] = results[f"parse_{name}_mb_s"] / loadtxt
        results[f"parse_{name}_over_pandas"] = results[f"parse_{name}_mb_s"] / frame
    return results


def numpy_table(data: bytes, head: int, separator: str | None) -> object:
    """Read the numbers with numpy.loadtxt."""
    return np.loadtxt(io.BytesIO(data), skiprows=head, delimiter=separator, comments="/")


def pandas_table(data: bytes, head: int, separator: str) -> object:
    """Read the numbers with pandas.read_csv."""
    return pandas.read_csv(
        io.BytesIO(data), skiprows=head, header=None, sep=separator, comment="/", dtype=float
    )


def ingesting() -> dict[str, float]:
    """Measure `ingest` of 100 to 3,000 AT2 files of 8,000 samples: time, memory of the parent."""
    results = {}
    data = sample_files(8000)["at2"]
    measure = "import resource, sys; from rockframe.cli.main import main; main(sys.argv[1:]); "
    measure += "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    with tempfile.TemporaryDirectory() as folder:
        records = Path(folder, "records")
        records.mkdir()
        for count in sized((100, 1000, 3000), (1,)):
            for number in range(count):
                (records / f"R{number:04d}.AT2").write_bytes(data)
            words = ["ingest", str(records), "--output", f"{folder}/records.nc"]
            start = time.perf_counter()
            done = subprocess.run(
                [sys.executable, "-c", measure, *words], check=True, capture_output=True, text=True
            )
            results[f"ingest_{count}_files_s"] = time.perf_counter() - start
            results[f"ingest_{count}_files_peak_memory_mb"] = int(done.stdout.split()[-1]) / 1024.0
    return results


#: Benchmarks of other files, which `make check` runs one by one.
_OTHERS = (
    kernels.lanes,
    kernels.against_heyoka,
    kernels.million,
    oscillators.measure,
    spectra.figure_9,
    spectra.margins_of_bundled,
    pulse_search.family,
    pulse_search.surrogates,
    pulse_search.archive,
    screening.measure,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("outputs/bench.json"))
    output: Path = parser.parse_args(arguments).output
    results: dict[str, float] = {}
    own = (commands, response, continuous_pulse, parsing, ingesting)
    for part in (*own, *sized(_OTHERS, ())):
        measured = part()
        results |= measured
        for name, value in measured.items():
            print(f"{name:34s} {value:12.5g}", flush=True)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    print(f"written to {output}")


if __name__ == "__main__":
    main()
