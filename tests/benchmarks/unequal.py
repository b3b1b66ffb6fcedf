"""The vectorised kernel of unequal columns beside that of equal ones, under the same motions.

The motions are the bundled records, which are rough, at many scales. Bents of equal columns have
the motions of the frame, so both kernels compute the same; those of unequal columns (9 and 7 m)
are timed beside it, both in the kernel of unequal columns, although the package computes equal ones
as frames. Times are the least processor time of several repeats, taken in turns.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.size import sized

from rockframe import (
    GroundAcceleration,
    RockingFrame,
    UnequalBent,
    bundled_records,
    read_file,
    respond_many,
)
from rockframe.rocking.response import as_ground
from rockframe.unequal.bent import tables
from rockframe.unequal.scenarios import outcomes

FRAME = RockingFrame(height=8.0, width=1.4, mass_ratio=3.6)
EQUAL = UnequalBent(heights=(8.0, 8.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)
UNEQUAL = UnequalBent(heights=(9.0, 7.0), widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6)


def least_times(calls: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the least processor time of each call [s]; the calls take turns."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()  # compile
    for _ in range(repeats):
        for name, call in calls.items():
            start = time.process_time()
            call()
            times[name].append(time.process_time() - start)
    return {name: min(each) for name, each in times.items()}


def through_linkage(
    bent: UnequalBent, grounds: Sequence[GroundAcceleration], scales: NDArray[np.float64]
) -> tuple[NDArray[np.int8], NDArray[np.float64]]:
    """Return verdicts and summaries of a bent by the kernel of unequal columns."""
    ground, scale = np.indices((len(grounds), scales.size)).reshape(2, -1)
    return outcomes(grounds, [tables(bent)], ground, 0 * ground, scales[scale])


def measure() -> dict[str, float]:
    """Measure times of scenarios, their ratios to the frame, and the time of a bent's table."""
    paths = sorted(bundled_records().glob("*.V1"))[: sized(None, 1)]
    grounds = [as_ground(record) for path in paths for record in read_file(path)]
    scales = np.geomspace(0.3, 3.0, sized(400, 20))
    calls: dict[str, Callable[[], object]] = {
        "frame": partial(respond_many, grounds, [FRAME], scales),
        "equal_columns": partial(through_linkage, EQUAL, grounds, scales),
        "unequal_columns": partial(through_linkage, UNEQUAL, grounds, scales),
        "table": partial(tables.__wrapped__, UNEQUAL),
    }
    taken = least_times(calls, sized(7, 1))
    scenarios = len(grounds) * scales.size
    results = {f"{name}_s": seconds for name, seconds in taken.items()}
    results |= {"scenarios": scenarios, "frame_us_per_scenario": 1e6 * taken["frame"] / scenarios}
    for name in ("equal_columns", "unequal_columns"):
        results[f"{name}_over_frame"] = taken[name] / taken["frame"]
    frame, bent = calls["frame"](), calls["equal_columns"]()
    results["verdicts_that_differ"] = int((frame.verdict.ravel() != bent[0]).sum())  # type: ignore[attr-defined,index]
    return results


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    print(json.dumps(measure(), indent=2))


if __name__ == "__main__":
    main()
