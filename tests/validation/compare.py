"""Compare OpenSees with the package: `python -m tests.validation.compare`.

Reads opensees.csv, computes the responses of the package to the same motions, and writes tables and
figures of docs/validation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
import scipy.stats
from matplotlib.figure import Figure
from numpy.typing import NDArray
from tests.validation.cases import MAIN, STRUCTURES, motions
from tests.validation.compliant import peak_ratio
from tests.validation.run import (
    COLUMN_PERIODS,
    DAMPING,
    PULSES,
    SHORTENINGS,
    Result,
    Task,
    motion_of,
    read,
)

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking import EnsembleResponse, Response, Verdict, ensemble_responses, respond

DOCS: Final = Path(__file__).resolve().parents[2] / "docs"
#: Stands for the peak of a structure that overturns; peaks below the other count as no uplift.
_FALLEN, _STILL = 10.0, 0.01
#: Number of times that the programs are exchanged within random pairs.
_EXCHANGES: Final = 4000
_LINE: Final = "0.4"

Float: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pair:
    """A task, its result in OpenSees, and the response of the package."""

    task: Task
    theirs: Result
    ours: Response
    ensemble: EnsembleResponse

    @property
    def peaks(self) -> tuple[float, float]:
        """Peaks of |theta| over the slenderness in OpenSees and in the package [1]."""
        ours = self.ours.peak_rotation_ratio
        fallen = self.ours.verdict is Verdict.OVERTURNS
        return (
            _FALLEN if self.theirs.overturned else self.theirs.peak_ratio,
            _FALLEN if fallen else ours,
        )


def work(response: Response, acceleration: Float) -> float:
    """Return the work of the ground over the mass of the columns, as `History` has it [m2 s-2]."""
    frame, theta = response.frame, response.theta
    place = frame.centre.shift(theta) + frame.mass_ratio * frame.beam.shift(theta)
    middle = 0.5 * (acceleration[1:] + acceleration[:-1])
    return float(-(middle * np.diff(place)).sum())


def pairs_of(results: dict[Task, Result], name: str) -> list[Pair]:
    """Return the pairs of one structure under all motions that were run, at the default contact."""
    known, frame = motions(), STRUCTURES[name]
    tasks = [
        task
        for task, result in results.items()
        if task == Task(name, task.motion, task.scale)
        and not task.motion.startswith("ricker-")
        and result.converged
    ]
    grounds = [motion_of(task, known).ground for task in tasks]
    if not tasks:
        return []
    ensembles = ensemble_responses(grounds, [frame], Ensemble())
    return [
        Pair(task, results[task], respond(frame, ground), ensemble)
        for task, ground, [ensemble] in zip(tasks, grounds, ensembles, strict=True)
    ]


def brier(shares: Iterable[float], outcomes: Iterable[float]) -> float:
    """Return the mean squared difference between forecast shares and outcomes, 0 or 1."""
    return float(np.mean((np.array([*shares]) - np.array([*outcomes])) ** 2))


def exchange_test(theirs: Float, ours: Float, seed: int = 1) -> tuple[float, float]:
    """Return the distance of Kolmogorov and Smirnov between paired samples, and its p value.

    The two values of each pair are exchanged at random: if the programs were the same, the distance
    would be one of those after such exchanges.
    """
    random = np.random.default_rng(seed)
    levels = np.sort(np.concatenate([theirs, ours]))
    theirs_above = np.searchsorted(levels, theirs)
    ours_above = np.searchsorted(levels, ours)

    def distance(first: NDArray[np.intp], second: NDArray[np.intp]) -> float:
        counts = [np.bincount(one, minlength=levels.size) for one in (first, second)]
        return float(np.abs(np.cumsum(counts[0] - counts[1])).max()) / first.size

    measured = distance(theirs_above, ours_above)
    reached = 0
    for _ in range(_EXCHANGES):
        swap = random.random(theirs.size) < 0.5
        first = np.where(swap, ours_above, theirs_above)
        second = np.where(swap, theirs_above, ours_above)
        reached += distance(first, second) >= measured - 1e-12
    return measured, (1 + reached) / (1 + _EXCHANGES)


def motion_rows(pairs: Sequence[Pair]) -> dict[str, str]:
    """Return the comparison of one structure over all motions."""
    theirs, ours = np.array([pair.peaks for pair in pairs]).T
    fell, shares = theirs == _FALLEN, [pair.ensemble.share_overturned for pair in pairs]
    lifted = (theirs > _STILL) | (ours > _STILL)
    distance, by_exchange = exchange_test(theirs[lifted], ours[lifted])
    usual = scipy.stats.ks_2samp(theirs[lifted], ours[lifted], method="asymp").pvalue
    stand = lifted & ~fell & (ours != _FALLEN)
    ratio = np.log(ours[stand] / theirs[stand])
    low, high = np.array([pair.ensemble.bands.peak_rotation_ratio for pair in pairs])[:, [0, 2]].T
    held = (theirs >= low) & (theirs <= np.where(np.isfinite(high), high, np.inf))
    worked = [
        (work(pair.ours, motion_of(pair.task, motions_once()).acceleration), pair.theirs.work)
        for pair, one in zip(pairs, stand, strict=True)
        if one
    ]
    energy = np.array(worked)
    return {
        "motions": f"{len(pairs)}",
        "lift in either": f"{lifted.sum()}",
        "overturn: OpenSees": f"{fell.sum()}",
        "overturn: rockframe, nominal": f"{(ours == _FALLEN).sum()}",
        "overturn: rockframe, sum of shares": f"{sum(shares):.1f}",
        "same nominal outcome": f"{100.0 * np.mean(fell == (ours == _FALLEN)):.1f} %",
        "Brier score of the share": f"{brier(shares, fell):.4f}",
        "Brier score of the nominal outcome": f"{brier(ours == _FALLEN, fell):.4f}",
        "Brier score of the overall share": f"{brier([fell.mean()] * fell.size, fell):.4f}",
        "Kolmogorov-Smirnov distance of peaks": f"{distance:.3f}",
        "p, samples taken as independent": f"{usual:.2f}",
        "p, by exchanges within pairs": f"{by_exchange:.2f}",
        "median of peak ratios, both stand": f"{np.exp(np.median(ratio)):.3f}",
        "16 and 84 % of peak ratios": " to ".join(
            f"{one:.2f}" for one in np.exp(np.quantile(ratio, (0.16, 0.84)))
        ),
        "median peak: OpenSees, rockframe": ", ".join(
            f"{np.median(one[lifted]):.3f}" for one in (theirs, ours)
        ),
        "peaks within our 16 to 84 % band": f"{100.0 * held[lifted].mean():.0f} %",
        "energy dissipated, sum over sum": f"{energy[:, 0].sum() / energy[:, 1].sum():.3f}",
    }


@lru_cache(maxsize=1)
def motions_once() -> dict[str, object]:
    """Return the motions, computed once."""
    return dict(motions())
