"""Figure 9 in full, and the cost of margins: ``python -m tests.benchmarks.spectra``."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.size import sized

from rockframe.ingest import read_file
from rockframe.rocking import margins
from rockframe.study.structures import SHIPPED_STRUCTURES, bundled_records, read_structures

COMMAND = str(Path(sys.executable).parent / "rockframe")


def figure_9() -> dict[str, float]:
    """Measure the command: 4 panels and 5 mass ratios with a map of 400 x 400 responses each."""
    times = []
    with tempfile.TemporaryDirectory() as folder:
        words = [COMMAND, "figure", "9", "--output", f"{folder}/figure.png"]
        words += sized([], ["--grid", "8"])
        for _ in range(sized(2, 1)):
            start = time.perf_counter()
            subprocess.run(words, check=True, capture_output=True)
            times.append(time.perf_counter() - start)
    return {"figure9_s": min(times)}


def margins_of_bundled() -> dict[str, float]:
    """Return the processor time of a pair: 100 s at 100 Hz and one of the shipped structures."""
    records = read_file(bundled_records() / "Ridgecrest2019-CCC.V1")[:1]
    frames = read_structures(SHIPPED_STRUCTURES)[: sized(None, 1)]
    margins(records, frames)
    start = time.process_time()
    margins(records, frames)
    return {"margin_of_a_pair_cpu_s": (time.process_time() - start) / len(frames)}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    print(json.dumps(figure_9() | margins_of_bundled(), indent=2))


if __name__ == "__main__":
    main()
