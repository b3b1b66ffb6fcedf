"""Two unequal columns in OpenSees beside the package: `python -m tests.validation.bents`.

The model is that of `opensees`, which knows neither the linkage nor its impacts. Each response is a
line of bents.csv; a run that is repeated resumes after the last line. The table of the pulses and
the numbers of the motions go into docs/validation.md.
"""

from __future__ import annotations

import argparse
import csv
import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass, fields, replace
from itertools import pairwise
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.validation.cases import Motion, motions, ricker
from tests.validation.compare import brier
from tests.validation.opensees import Contact, History, require_opensees, respond_bent
from tests.validation.page import DOCS, table, write_page
from tests.validation.run import FREE_ROCKING

from rockframe.options.respond import Ensemble
from rockframe.rocking.verdict import Verdict
from rockframe.unequal import UnequalBent, bent_ensemble, bent_positions
from rockframe.unequal import respond_bent as respond

Float: TypeAlias = NDArray[np.float64]

RESULTS: Final = Path(__file__).resolve().parent / "bents.csv"
#: Bents with columns of 9 and 7 m, and of 6 and 10 m.
BENTS: Final = {
    name: UnequalBent(
        name=name, heights=heights, widths=(1.4, 1.4), spacing=12.0, mass_ratio=3.6, beam_depth=1.5
    )
    for name, heights in {"9 and 7 m": (9.0, 7.0), "6 and 10 m": (6.0, 10.0)}.items()
}
#: Acceleration [g] and period [s] of the pulses; each shakes each bent in both directions.
PULSES: Final = ((0.3, 1.5), (0.4, 1.5), (0.5, 1.2), (0.6, 1.2), (0.9, 0.8), (0.3, 2.2))
#: Shortening of the contact under the weight [m] under pulses, and under motions.
STIFF, OF_MOTIONS = 1.0e-6, 1.0e-5
#: Multiple of the motions, of which all shake the first bent.
SCALE: Final = 2.0
#: Time steps [s]: the longer ones add energy to a contact of 0.001 mm, and tell by how much
#: OpenSees differs from itself under the motions.
STEP, TWICE = 2.5e-4, 5.0e-4
#: Half cycles below this share of the rotation of balance are no rocking [1].
_LEAST: Final = 0.03


@dataclass(frozen=True)
class Task:
    """A bent and a motion, times a scale, in time steps [s]."""

    bent: str
    motion: str
    scale: float
    step: float = STEP

    @property
    def is_pulse(self) -> bool:
        """True for a pulse."""
        return self.motion.startswith("ricker-")


@dataclass(frozen=True)
class Result:
    """Numbers that are kept of a response.

    Parameters
    ----------
    peak_ratio : float
        Largest |theta| over that of the balance of the same side [1].
    overturned, converged : int
        1 if it is so.
    restitution : float
        Root of the share of energy that an impact keeps, the median over free rocking [1]; NaN
        without two half cycles of it.
    seconds : float
        Processor time [s].
    """

    peak_ratio: float
    overturned: int
    converged: int
    restitution: float
    seconds: float


def tasks() -> Iterator[Task]:
    """Yield all tasks."""
    for name in BENTS:
        for size, period in PULSES:
            for scale in (1.0, -1.0):
                yield Task(name, f"ricker-{size:g}-{period:g}", scale)
    for step in (STEP, TWICE):
        for motion in sorted(motions()):
            yield Task(next(iter(BENTS)), motion, SCALE, step)


def motion_of(task: Task, every: Mapping[str, Motion]) -> Motion:
    """Return the scaled motion of a task."""
    if task.is_pulse:
        size, period = (float(part) for part in task.motion.split("-")[1:])
        return ricker(size, period).scaled(task.scale)
    return every[task.motion].scaled(task.scale)


def ratio_to_balance(bent: UnequalBent, theta: Float) -> Float:
    """Return |theta| over that of the balance of the same side [1]."""
    right, left = bent.balance_rotations
    return np.asarray(np.maximum(theta / right, -theta / left))


def kept_in_impacts(bent: UnequalBent, history: History, end: float) -> float:
    """Return the root of the share of energy that impacts keep after a time [s], the median."""
    time_, theta = history.time, history.theta
    at = np.flatnonzero((theta[:-1] * theta[1:] < 0.0) & (time_[1:] > end))
    halves = [theta[first + 1 : last + 1] for first, last in pairwise(at)]
    peaks = np.array([half[np.abs(half).argmax()] for half in halves])
    peaks = peaks[ratio_to_balance(bent, peaks) > _LEAST] if peaks.size else peaks
    if peaks.size < 2:
        return math.nan
    energy = _risen(bent, peaks)
    return float(np.median(np.sqrt(energy[1:] / energy[:-1])))


def _risen(bent: UnequalBent, theta: Float) -> Float:
    """Return the height by which all masses have risen, over the mass of both columns [m]."""
    at = bent_positions(bent, theta)
    masses = np.array(bent.column_masses or np.multiply(bent.heights, bent.widths))
    turned = np.abs(np.stack([theta, at.theta_2]))
    columns = 0.5 * (
        np.array(bent.heights)[:, None] * (np.cos(turned) - 1.0)
        + np.array(bent.widths)[:, None] * np.sin(turned)
    )
    return np.asarray(masses @ columns / masses.sum() + bent.mass_ratio * at.v)


def read() -> dict[Task, Result]:
    """Return the results so far."""
    if not RESULTS.exists():
        return {}
    with RESULTS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return {
        Task(bent, motion, float(scale), float(step)): Result(
            float(peak), int(fallen), int(converged), float(kept), float(seconds)
        )
        for bent, motion, scale, step, peak, fallen, converged, kept, seconds in rows
    }


def pulse_rows(results: Mapping[Task, Result]) -> list[list[str]]:
    """Return a row for each bent and pulse: peak here, and how much larger it is in OpenSees."""
    rows = []
    for task, result in results.items():
        if not task.is_pulse:
            continue
        bent, motion = BENTS[task.bent], motion_of(task, {})
        ours = respond(bent, motion.ground)
        size, period = task.motion.split("-")[1:]
        words = f"{task.bent}, {size} g, {period} s, {'right' if task.scale > 0.0 else 'left'}"
        fallen = ours.verdict is Verdict.OVERTURNS
        apart = f"{100.0 * (result.peak_ratio / ours.peak_rotation_ratio - 1.0):+.1f} %"
        rows.append(
            [
                words,
                "overturns" if fallen else f"{ours.peak_rotation_ratio:.4f}",
                "overturns" if result.overturned else apart.replace("-", "−"),
                f"{math.sqrt(math.prod(bent.restitutions)):.4f}",
                f"{result.restitution:.4f}" if math.isfinite(result.restitution) else "",
            ]
        )
    return rows


def motion_rows(results: Mapping[Task, Result]) -> list[list[str]]:
    """Return rows on outcomes under motions: of OpenSees with this package, and with itself."""
    every = motions()
    shaken = [task for task in results if not task.is_pulse and task.step == STEP]
    shaken = [task for task in shaken if results[task].converged]
    theirs = [results[task] for task in shaken]
    again = [results[replace(task, step=TWICE)] for task in shaken]
    bents = [BENTS[task.bent] for task in shaken]
    grounds = [motion_of(task, every).ground for task in shaken]
    ours = [respond(bent, ground) for bent, ground in zip(bents, grounds, strict=True)]
    shares = np.array(
        [
            bent_ensemble(bent, ground, Ensemble()).share_overturned
            for bent, ground in zip(bents, grounds, strict=True)
        ]
    )
    fallen = np.array([result.overturned == 1 for result in theirs])
    nominal = np.array([response.verdict is Verdict.OVERTURNS for response in ours])
    twice = np.array([result.overturned == 1 for result in again])
    peaks = np.array([result.peak_ratio for result in theirs])
    mine = np.array([response.peak_rotation_ratio for response in ours])
    longer = np.array([result.peak_ratio for result in again])
    surest = (shares == 0.0) | (shares == 1.0)
    return [
        ["motions", f"{len(shaken)}", f"{len(shaken)}"],
        ["overturn", f"{nominal.sum()}; sum of shares {shares.sum():.1f}", f"{twice.sum()}"],
        ["of these in OpenSees", f"{fallen.sum()}", f"{fallen.sum()}"],
        ["same outcome", f"{(fallen == nominal).sum()}", f"{(fallen == twice).sum()}"],
        [
            "outcome of motions under which none or all of 64 members overturn",
            f"{(fallen == (shares == 1.0))[surest].sum()} of {surest.sum()}",
            "",
        ],
        ["Brier score of the share", f"{brier(shares, fallen):.3f}", ""],
        ["Brier score of the nominal outcome", *(
            f"{brier(other, fallen):.3f}" for other in (nominal, twice)
        )],
        ["ratio of peaks where both stand: 16, 50, 84 %", *(
            _quantiles((other / peaks)[~fallen & ~falls])
            for other, falls in ((mine, nominal), (longer, twice))
        )],
    ]  # fmt: skip


def _quantiles(ratios: Float) -> str:
    return ", ".join(f"{ratio:.2f}" for ratio in np.quantile(ratios, [0.16, 0.5, 0.84]))


def _run(task: Task, every: Mapping[str, Motion]) -> Result:
    bent, motion = BENTS[task.bent], motion_of(task, every)
    contact = Contact(shortening=STIFF if task.is_pulse else OF_MOTIONS)
    free = FREE_ROCKING if task.is_pulse else 0.0
    begun = time.process_time()
    history = respond_bent(bent, motion, contact, free_rocking=free, step=task.step)
    seconds = time.process_time() - begun
    if history is None:
        return Result(math.nan, 0, 0, math.nan, seconds)
    end = motion.time_step * (motion.acceleration.size - 1)
    standing = task.is_pulse and history.converged and not history.overturned
    kept = kept_in_impacts(bent, history, end) if standing else math.nan
    peak = float(ratio_to_balance(bent, history.theta).max())
    return Result(peak, int(history.overturned), int(history.converged), kept, seconds)


def main() -> None:
    """Run the tasks that have no result yet, and write the tables of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=math.inf, help="stop after this time")
    options = parser.parse_args()
    done = read()
    left = [task for task in tasks() if task not in done]
    begun, every = time.monotonic(), motions()
    if left:
        require_opensees()
    if not RESULTS.exists():
        names = [column.name for kind in (Task, Result) for column in fields(kind)]
        RESULTS.write_text(",".join(names) + "\n", encoding="utf-8")
    for number, task in enumerate(left):
        if time.monotonic() - begun > 60.0 * options.minutes:
            break
        done[task] = result = _run(task, every)
        row = [f"{part:.6g}" if isinstance(part, float) else part for part in astuple(result)]
        with RESULTS.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow((*astuple(task), *row))
        print(f"{number + 1} of {len(left)}: {task} {result}", flush=True)
    head = ["bent and pulse", "peak here", "in OpenSees", "restitution here", "in OpenSees"]
    tables = {"bents": table(head, pulse_rows(done))}
    if len(done) == len(list(tasks())):
        head = ["OpenSees beside", "rockframe", "OpenSees, twice the step"]
        tables["bents-motions"] = table(head, motion_rows(done))
    write_page(tables, DOCS / "validation.md")


if __name__ == "__main__":
    main()
