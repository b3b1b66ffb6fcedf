"""Compare responses in MuJoCo with this package: `python -m tests.validation.round_columns`.

It prints the tables of the page for the results in mujoco.csv.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from tests.validation.compare import brier
from tests.validation.mujoco import STEP, Float, Result, Task, frame_of, motions, read
from tests.validation.page import table

from rockframe import Ensemble, PairAcceleration, wobble, wobbling_ensemble
from rockframe.rocking import Verdict

#: Groups of motions, by name.
GROUPS: Final[dict[str, Callable[[Task], bool]]] = {
    "column, spin resisted": lambda task: (
        task.column == "column" and task.spin == 1 and task.step == STEP and not task.turned
    ),
    "column, spin free": lambda task: task.spin == 0,
    "column, half the step": lambda task: task.step < STEP,
    "column, turned by 45°": lambda task: task.turned > 0.0,
    "pier, spin resisted": lambda task: task.column == "pier",
}
#: Classes of the share that overturns.
CLASSES: Final = ((0.0, 0.0), (0.0, 0.25), (0.25, 0.75), (0.75, 1.0), (1.0, 1.0))


class Answer(NamedTuple):
    """Answer of this package to a motion: share, nominal outcome, band of the peak ratio."""

    share: float
    overturns: bool
    band: tuple[float, float, float]


@cache
def answer(column: str, motion: str, scale: float) -> Answer:
    """Return the response of 64 plausible columns, and of the column as given."""
    ground, frame = motions()[motion].scaled(scale), frame_of(column)
    ensemble = wobbling_ensemble(frame, ground, Ensemble())
    low, middle, high = ensemble.bands.peak_rotation_ratio
    nominal = wobble(frame, ground).verdict is Verdict.OVERTURNS
    return Answer(ensemble.share_overturned, nominal, (low, middle, high))


def shaken(group: str, results: dict[Task, Result]) -> list[Task]:
    """Return the responses to ground motions of a group."""
    return [task for task in results if task.scale and GROUPS[group](task)]


def row_of(group: str, results: dict[Task, Result]) -> list[str]:
    """Return a row of the table of a group."""
    tasks = shaken(group, results)
    answers = [answer(task.column, task.motion, task.scale) for task in tasks]
    fell = np.array([results[task].overturned for task in tasks], dtype=float)
    peak = np.array([np.inf if results[t].overturned else results[t].peak_ratio for t in tasks])
    share = np.array([own.share for own in answers])
    nominal = np.array([float(own.overturns) for own in answers])
    low, high = (np.array([own.band[k] for own in answers]) for k in (0, 2))
    places = (peak < low).mean(), ((peak >= low) & (peak <= high)).mean(), (peak > high).mean()
    return [
        group,
        f"{len(tasks)}",
        f"{fell.sum():.0f}",
        f"{share.sum():.1f}",
        f"{brier(share, fell):.3f}",
        f"{brier(nominal, fell):.3f}",
        " / ".join(f"{100.0 * place:.0f}" for place in places),
    ]


def classes(results: dict[Task, Result]) -> list[list[str]]:
    """Return rows of the outcomes of the first group in classes of the share."""
    tasks = shaken(next(iter(GROUPS)), results)
    share = np.array([answer(task.column, task.motion, task.scale).share for task in tasks])
    fell = np.array([results[task].overturned for task in tasks])
    rows = []
    for first, last in CLASSES:
        own = share == first if first == last else (share > first) & (share < last)
        own |= (share == last) & (first == 0.25)
        mean = f"{100.0 * share[own].mean():.0f}" if own.any() else "–"
        words = f"{100.0 * first:g} %" if first == last else f"{100 * first:g} to {100 * last:g} %"
        rows.append([words, f"{own.sum()}", mean, f"{fell[own].sum()}"])
    return rows


def free(results: dict[Task, Result]) -> list[list[str]]:
    """Return rows of free wobbling by step and contact: differences of the tilt, energy left."""
    differences: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for task, result in results.items():
        if task.motion == "free":
            theirs: Float = np.array(result.histories.split(), dtype=float)
            frame, nothing = frame_of(task.column), np.zeros(1001)
            still = PairAcceleration(nothing, nothing, 0.01)
            start = (task.tilt * frame.slenderness, 0.0, 0.0, task.precession)
            ours = wobble(frame, still, contact_shortening=0.0, start=start).theta[::50]
            apart = float(np.abs(theirs - ours / frame.slenderness).max())
            differences.setdefault((task.step, task.softness), []).append((apart, result.energy))
    rows = []
    for (step, softness), cases in differences.items():
        apart, energy = np.array(cases).T
        rows.append(
            [
                f"{1e3 * step:g}",
                f"{1e3 * softness:g}",
                f"{len(cases)}",
                f"{np.median(apart):.3f}",
                f"{apart.max():.3f}",
                f"{100.0 * energy.min():.1f}",
            ]
        )
    return rows


def losses(results: dict[Task, Result]) -> list[list[str]]:
    """Return rows of the energy lost near upright: measured, by the rule, and their ratio."""
    rows = []
    for task, result in results.items():
        if task.motion == "pass":
            frame = frame_of(task.column)
            near = result.least_ratio * frame.slenderness
            planar = 1.0 - frame.restitution**2
            rule = planar / (1.0 + (near / (0.45 * result.speed * task.softness)) ** 2)
            lost = 1.0 - result.energy
            numbers = (f"{1e3 * task.softness:g}", f"{task.precession:g}")
            rows.append([task.column, *numbers, f"{lost:.4f}", f"{rule:.4f}", f"{lost / rule:.2f}"])
    return rows


def main() -> None:
    """Print the tables of the page."""
    results = read()
    heads = ["group", "motions", "overturn in MuJoCo", "sum of shares here", "Brier: share"]
    heads += ["Brier: nominal", "peaks below / in / above the band [%]"]
    print(table(heads, [row_of(group, results) for group in GROUPS]), end="\n\n")
    heads = ["share here", "motions", "mean share [%]", "overturn in MuJoCo"]
    print(table(heads, classes(results)), end="\n\n")
    heads = ["step [ms]", "time constant [ms]", "cases", "median", "largest", "energy left [%]"]
    print(table(heads, free(results)), end="\n\n")
    heads = ["column", "time constant [ms]", "precession [rad/s]", "lost", "rule", "ratio"]
    print(table(heads, losses(results)))


if __name__ == "__main__":
    main()
