"""The time of the report of an archive: 1,000 records on four structures.

``python -m tests.benchmarks.report`` (extra ``browser``) makes a run of synthetic records and
prints the time and the size of its page, and the time to its first paint in Chromium.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright
from tests.benchmarks.size import sized

from rockframe.provenance import sha256_of, write_manifest
from rockframe.study.structures import SHIPPED_STRUCTURES

COMMAND = str(Path(sys.executable).parent / "rockframe")
#: 40 s at 100 Hz.
SAMPLES = 4_000
#: Only the paper's wavelets: other options of the search do not change the page.
PULSES = (
    *("--surrogates", "0", "--runners-up", "0"),
    *("--wavelet", "symmetric_ricker", "--wavelet", "antisymmetric_ricker"),
)
#: The first paint of content, as the browser has timed it.
PAINT = "performance.getEntriesByName('first-contentful-paint')[0].startTime"


def files(folder: Path, records: int) -> None:
    """Write records of noise under an envelope [g]."""
    folder.mkdir()
    random = np.random.default_rng(11)
    at = 0.01 * np.arange(SAMPLES)
    for number in range(records):
        noise = np.convolve(random.normal(size=SAMPLES), np.hanning(20), "same")
        strong = random.uniform(0.1, 0.6) * np.exp(-(((at - 12.0) / 5.0) ** 2))
        motion = strong * noise / np.abs(noise).max()
        np.savetxt(folder / f"record-{number:04d}.csv", motion, fmt="%.6f")


def run(home: Path, records: int) -> Path:
    """Make a run with a user's commands; return its folder."""
    files(home / "records", records)
    folder = home / "run"
    folder.mkdir()
    four = SHIPPED_STRUCTURES.read_text(encoding="utf-8").rsplit("[[structure]]", 1)[0]
    structures = home / "four.toml"
    structures.write_text(four, encoding="utf-8")
    held, pulses, response = (folder / f"{n}.nc" for n in ("records", "pulses", "response"))
    for words in (
        ["ingest", home / "records", "--units", "g", "--time-step", "0.01", "--output", held],
        ["pulse", held, *PULSES, "--output", pulses],
        ["respond", held, "--structures", structures, "--output", response],
        ["table", held, pulses, response, "--output", folder / "table.csv"],
    ):
        began = time.perf_counter()
        found = subprocess.run([COMMAND, *map(str, words)], capture_output=True, check=False)
        assert found.returncode in (0, 1), found.stderr.decode()
        print(f"{words[0]}: {time.perf_counter() - began:.1f} s", file=sys.stderr)
    write_manifest(
        folder,
        inputs={path.name: sha256_of(path) for path in (structures, *(home / "records").iterdir())},
        parameters={},
        outputs=sorted(folder.iterdir()),
    )
    return folder


def main(arguments: Sequence[str] | None = None) -> None:
    """Make, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=sized(1_000, 1))
    records = parser.parse_args(arguments).records
    with tempfile.TemporaryDirectory() as home:
        folder = run(Path(home), records)
        began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([COMMAND, "report", str(folder)], check=True, capture_output=True)
        taken, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        page = folder / "report.html"
        with sync_playwright() as playwright:
            chromium = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--headless", "--no-sandbox"]
            )
            view = chromium.new_page(viewport={"width": 1280, "height": 900})
            view.goto(page.as_uri())
            view.wait_for_selector("html[data-shown]")
            paint = view.evaluate(PAINT)
            chromium.close()
        print(
            json.dumps(
                {
                    f"report_{records}_records_s": taken,
                    f"report_{records}_records_processor_s": after.ru_utime - before.ru_utime,
                    f"report_{records}_records_mb": page.stat().st_size / 1e6,
                    f"report_{records}_records_first_paint_s": paint / 1e3,
                },
                indent=2,
            )
        )


if __name__ == "__main__":
    main()
