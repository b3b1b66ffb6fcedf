"""Run OpenSees on structures and motions: `python -m tests.validation.run [--minutes 60]`.

Each response is a line of opensees.csv; a run that is repeated resumes after the last line. The
order of the tasks is shuffled, so that a part of them is a fair sample of all.
"""

from __future__ import annotations

import argparse
import csv
import random
import time
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.validation.cases import MAIN, SCALES, STRUCTURES, Motion, motions, ricker
from tests.validation.opensees import Contact, History, require_opensees, respond

from rockframe.frame import RockingFrame

RESULTS: Final = Path(__file__).resolve().parent / "opensees.csv"
#: Acceleration [g] and period [s] of the pulses of each main structure: large and small rotations.
PULSES: Final = {
    "bent": ((0.3, 1.5), (0.4, 1.5), (0.5, 1.5), (0.6, 1.2), (0.9, 0.8), (0.3, 2.5)),
    "column": ((0.4, 0.8), (0.6, 0.8), (0.4, 1.2), (0.5, 1.2), (1.0, 0.5), (1.3, 0.5)),
}
#: Shortenings of the contact under the weight [m].
SHORTENINGS: Final = (1.0e-6, 1.0e-5, 1.0e-4, 1.0e-3)
#: Periods of the structure with fixed columns [s]: 0 means stiff columns.
COLUMN_PERIODS: Final = (0.0, 0.1, 0.2, 0.4)
#: Damping of the contact over the critical one [1].
DAMPING: Final = 0.5
#: Time for which structures rock freely after a pulse [s].
FREE_ROCKING: Final = 12.0
#: Time steps for pulses and for motions [s]: for the bent under a pulse of 0.5 g and 1.5 s, twice
#: the step changes the peak by 0.02 % and the restitution by 0.001. A contact of 0.001 mm is too
#: stiff for the longer step: it added energy, and 11 more of 53 motions overturned the column.
PULSE_STEP, MOTION_STEP = 1.0e-3, 2.0e-3
#: One in this number of motions shakes other structures, other contacts, and two columns.
_OTHERS, _VARIANTS, _PAIRS = 6, 12, 24

Float: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Task:
    """One response: a structure, a motion at a scale, and a contact."""

    structure: str
    motion: str
    scale: float
    shortening: float = 1.0e-5
    columns: int = 1
    column_period: float = 0.0
    damping: float = 0.0
    step_factor: float = 1.0


@dataclass(frozen=True)
class Result:
    """Numbers that are kept of a response.

    Parameters
    ----------
    peak_ratio : float
        Largest |theta| over the slenderness [1].
    overturned, converged : int
        1 if it is so.
    work : float
        Work of the ground [m2 s-2], see `History`.
    free_peak_ratio, half_period, restitution : float
        After a pulse: largest rotation over the slenderness of the first half cycle that begins
        after its end, time between the two impacts around it [s], and median of the velocity
        ratios of the following impacts, from the energy of successive peaks; NaN if there are none.
    seconds : float
        Processor time [s].
    """

    peak_ratio: float
    overturned: int
    converged: int
    work: float
    free_peak_ratio: float
    half_period: float
    restitution: float
    seconds: float


def tasks() -> list[Task]:
    """Return all tasks: pulses first, then motions in random order."""
    found = [
        Task(name, f"ricker-{one:g}-{period:g}", 1.0, shortening)
        for name, pulses in PULSES.items()
        for one, period in pulses
        for shortening in SHORTENINGS
    ]
    bent = [f"ricker-{one:g}-{period:g}" for one, period in PULSES["bent"]]
    found += [Task("bent", one, 1.0, columns=2) for one in bent]
    found += [Task("bent", one, 1.0, column_period=T) for one in bent for T in COLUMN_PERIODS[1:]]
    found += [
        Task(name, f"ricker-{one:g}-{period:g}", 1.0, shortening, damping=DAMPING)
        for name, pulses in PULSES.items()
        for one, period in pulses
        for shortening in SHORTENINGS[1:]
    ]
    pairs = [(name, scale) for name in sorted(motions()) for scale in SCALES]
    random.Random(1).shuffle(pairs)  # noqa: S311  (an order, not a secret)
    for number, pair in enumerate(pairs):
        found += _tasks_of(number, *pair)
    return found


def _tasks_of(number: int, motion: str, scale: float) -> Iterator[Task]:
    for name in STRUCTURES:
        if name in MAIN or number % _OTHERS == 0:
            yield Task(name, motion, scale)
    if number % _OTHERS == 3:
        for name in MAIN:
            yield Task(name, motion, scale, step_factor=0.5)
    if number % _VARIANTS == 1:
        yield Task("bent", motion, scale, 1.0e-4)
        yield Task("bent", motion, scale, 1.0e-3)
        yield Task("bent", motion, scale, column_period=0.2)
    if number % _PAIRS == 2:
        yield Task("bent", motion, scale, columns=2)


def motion_of(task: Task, known: dict[str, Motion]) -> Motion:
    """Return the scaled motion of a task."""
    if task.motion.startswith("ricker-"):
        acceleration, period = task.motion.split("-")[1:]
        return ricker(float(acceleration), float(period)).scaled(task.scale)
    return known[task.motion].scaled(task.scale)


def read() -> dict[Task, Result]:
    """Return the results so far."""
    if not RESULTS.exists():
        return {}
    with RESULTS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    size = len(fields(Task))
    found = {}
    for row in rows:
        name, motion, scale, shortening, columns, *others = row[:size]
        period, damping, factor = (float(one) for one in others)
        contact = (float(shortening), int(columns), period, damping, factor)
        peak, fallen, converged, *numbers = row[size:]
        found[Task(name, motion, float(scale), *contact)] = Result(
            float(peak), int(fallen), int(converged), *(float(one) for one in numbers)
        )
    return found


def result_of(frame: RockingFrame, history: History, end: float, seconds: float) -> Result:
    """Return the numbers that are kept of a response to a motion that ends at a time [s]."""
    free = free_rocking(frame, history, end)
    peak = float(np.abs(history.theta).max()) / frame.slenderness
    return Result(
        _rounded(peak),
        int(history.overturned),
        int(history.converged),
        *(_rounded(one) for one in (history.work, *free, seconds)),
    )


def free_rocking(frame: RockingFrame, history: History, end: float) -> tuple[float, float, float]:
    """Return the first free peak over the slenderness, its half period [s], and the restitution."""
    time, theta = history.time, history.theta
    before, after = theta[:-1], theta[1:]
    at = np.flatnonzero((before * after < 0.0) & (time[1:] > end))
    # Small bounces near zero are no half cycles of rocking.
    crossings = time[at] + (time[at + 1] - time[at]) * before[at] / (before[at] - after[at])
    halves = [
        (np.abs(theta[first + 1 : last + 1]).max() / frame.slenderness, b - a)
        for first, last, a, b in zip(at, at[1:], crossings, crossings[1:], strict=False)
    ]
    halves = [one for one in halves if one[0] > 0.03]
    if len(halves) < 2 or history.overturned or not history.converged:
        return (np.nan,) * 3
    energy = [_energy(frame, peak * frame.slenderness) for peak, _ in halves]
    kept = np.sqrt(np.array(energy[1:]) / np.array(energy[:-1]))
    return float(halves[0][0]), float(halves[0][1]), float(np.median(kept))


def _energy(frame: RockingFrame, peak: float) -> float:
    return float(np.cos(frame.slenderness - peak) - np.cos(frame.slenderness))


def _rounded(number: float) -> float:
    return float(f"{number:.6g}")


def main() -> None:
    """Run the tasks that have no result yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after this time")
    parser.add_argument("--limit", type=int, help="stop after this number of tasks")
    options = parser.parse_args()
    require_opensees()
    known, done = motions(), read()
    left = [task for task in tasks() if task not in done][: options.limit]
    begun = time.monotonic()
    if not RESULTS.exists():
        names = [one.name for kind in (Task, Result) for one in fields(kind)]
        RESULTS.write_text(",".join(names) + "\n", encoding="utf-8")
    for number, task in enumerate(left):
        if time.monotonic() - begun > 60.0 * options.minutes:
            break
        result = _run(task, known)
        with RESULTS.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow((*astuple(task), *astuple(result)))
        print(f"{number + 1} of {len(left)}: {task} {result}", flush=True)


def _run(task: Task, known: dict[str, Motion]) -> Result:
    frame, motion = STRUCTURES[task.structure], motion_of(task, known)
    contact = Contact(
        shortening=task.shortening,
        columns=task.columns,
        column_period=task.column_period,
        damping=task.damping,
    )
    pulse = task.motion.startswith("ricker-")
    free, step = (FREE_ROCKING, PULSE_STEP) if pulse else (0.0, MOTION_STEP)
    begun = time.process_time()
    step *= task.step_factor
    history = respond(frame, motion, contact, free_rocking=free, step=step)
    seconds = time.process_time() - begun
    if history is None:
        return Result(*(np.nan, 0, 0), *(np.nan,) * 4, seconds)
    end = motion.time_step * (motion.acceleration.size - 1)
    return result_of(frame, history, end, seconds)


if __name__ == "__main__":
    main()
