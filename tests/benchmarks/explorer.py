"""The time from a move of a slider of the explorer until its answer is drawn in Chromium.

``python -m tests.benchmarks.explorer`` (extras ``browser``, ``explorer``) prints, for a bundled
record and for one of 60,000 samples, the time of the server and that from slider to drawn frame.
"""

from __future__ import annotations

import argparse
import json
import shutil
import socket
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import uvicorn
from playwright.sync_api import sync_playwright
from tests.benchmarks.size import sized

from rockframe.explorer.answer import ExploredMotion, answer, read_settings
from rockframe.explorer.server import application, configured
from rockframe.ingest import read_file
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration
from rockframe.study.structures import bundled_records, read_structures

PORT_OF_ANY = ("127.0.0.1", 0)
#: Move a slider and wait until two frames after the answer was drawn.
MOVE = """
(to) => new Promise((resolve) => {
  const root = document.documentElement;
  const slider = document.getElementById('scale-slider');
  const began = performance.now();
  slider.value = to;
  slider.dispatchEvent(new Event('input'));
  const look = () => (root.dataset.asking === 'false'
    ? requestAnimationFrame(() => resolve(performance.now() - began)) : setTimeout(look, 1));
  look();
})
"""


def long_record() -> Record:
    """Return a record of ten minutes at 100 Hz."""
    at = 0.01 * np.arange(60_000)
    noise = np.convolve(np.random.default_rng(7).normal(size=at.size), np.hanning(40), "same")
    strong = 4.0 * np.exp(-(((at - 200.0) / 60.0) ** 2)) * noise / np.abs(noise).max()
    return Record(record_id="long", acceleration=strong, time_step=0.01)


def shakings() -> list[ExploredMotion]:
    """Return a bundled record and a long one as motions."""
    records = [read_file(bundled_records() / "Ridgecrest2019-CCC.V1")[0], long_record()]
    records = records[: sized(None, 1)]
    return [
        ExploredMotion(r, GroundAcceleration.from_samples(r.acceleration, r.time_step))
        for r in records
    ]


def moves() -> Sequence[float]:
    """Return the scales to which the slider is moved."""
    return [float(scale) for scale in np.linspace(0.1, 2.0, sized(100, 2))]


def served(held: list[ExploredMotion]) -> dict[str, float]:
    """Return the median time of an answer as bytes [ms]."""
    found = {}
    for shaking in held:
        name = shaking.record.record_id
        stated = {"record": name, "height": "9.6", "width": "1.6", "mass_ratio": "4",
                  "restitution_factor": "1", "section": "rectangular", "vertical": "0",
                  "pulse": "0", "from": "0", "to": "1000"}  # fmt: skip
        times = []
        for scale in moves():
            began = time.perf_counter()
            answer({name: shaking}, read_settings({**stated, "scale": str(scale)})).packed()
            times.append(1e3 * (time.perf_counter() - began))
        found[f"explorer_answer_{name}_ms"] = float(np.median(times[1:]))
    return found


def drawn(page: Any, name: str) -> dict[str, float]:
    """Return the times from slider to drawn frame [ms]."""
    page.select_option("#record", name)
    page.wait_for_timeout(1000)
    times = [page.evaluate(MOVE, scale) for scale in moves()]
    return {
        f"explorer_slide_{name}_median_ms": float(np.median(times)),
        f"explorer_slide_{name}_95_ms": float(np.quantile(times, 0.95)),
        f"explorer_slide_{name}_most_ms": float(max(times)),
        f"explorer_slide_{name}_over_100_ms": float(sum(t > 100.0 for t in times)),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    held = shakings()
    results = served(held)
    with socket.create_server(PORT_OF_ANY) as listening, sync_playwright() as playwright:
        port = listening.getsockname()[1]
        server = uvicorn.Server(configured(application(held, read_structures(), "bench", port)))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        chromium = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--headless", "--no-sandbox"]
        )
        page = chromium.new_page(viewport={"width": 1280, "height": 900})
        page.goto(f"http://127.0.0.1:{port}/bench/")
        for shaking in held:
            results |= drawn(page, shaking.record.record_id)
        chromium.close()
        server.should_exit = True
        thread.join()
    print(json.dumps(results, indent=2))


if __name__ == "__main__":
    main()
