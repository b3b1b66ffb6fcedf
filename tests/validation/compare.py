"""Compare OpenSees with the package: `python -m tests.validation.compare`.

Reads opensees.csv, computes the responses of the package to the same motions, and writes tables and
figures of docs/validation.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np
import scipy.stats
from numpy.typing import NDArray
from tests.validation.cases import MAIN, STRUCTURES, Motion, motions
from tests.validation.compliant import peak_ratio
from tests.validation.page import DOCS, table, write_page
from tests.validation.pictures import draw_contact, draw_motions
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
from rockframe.rocking import (
    EnsembleResponse,
    Response,
    Verdict,
    ensemble_responses,
    respond,
    share_interval,
)

#: Stands for the peak of a structure that overturns; peaks below the other count as no uplift.
_FALLEN, _STILL = 10.0, 0.01
#: Peaks above this are rotations far beyond those that the contact allows before uplift.
_FAR: Final = 0.1
#: Number of times that the programs are exchanged within random pairs.
_EXCHANGES: Final = 4000
#: Blocks of ElGawady, Butterworth and Ingham: aspect ratio, base, and measured velocity ratio over
#: the predicted one.
MEASURED: Final = ((5.0, "concrete", 0.95), (3.0, "concrete", 0.97), (5.0, "rubber", 0.67))
#: Classes of the period of sway over that of the pulse, and their ends.
_SWAYS: Final = {
    "below 0.05": 0.05,
    "0.05 to 0.1": 0.1,
    "0.1 to 0.2": 0.2,
    "0.2 and more": np.inf,
}
#: Classes of the share that overturns, and their words.
CLASSES: Final = (
    (0.0, 0.01, "0"),
    (0.01, 0.25, "up to 25 %"),
    (0.25, 0.75, "25 to 75 %"),
    (0.75, 0.99, "from 75 %"),
    (0.99, 1.1, "100 %"),
)

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
    return float(
        np.mean((np.array([*shares], dtype=float) - np.array([*outcomes], dtype=float)) ** 2)
    )


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
    far = (theirs > _FAR) | (ours > _FAR)
    usual = scipy.stats.ks_2samp(theirs[lifted], ours[lifted], method="asymp").pvalue
    stand = lifted & ~fell & (ours != _FALLEN)
    large = stand & (np.minimum(theirs, ours) > _STILL)
    ratio = np.log(ours[large] / theirs[large])
    low, high = np.array([pair.ensemble.bands.peak_rotation_ratio for pair in pairs])[:, [0, 2]].T
    unbounded = np.where(fell, np.inf, theirs)
    below, above = (unbounded < low)[lifted].mean(), (unbounded > high)[lifted].mean()
    worked = [
        (work(pair.ours, motion_of(pair.task, motions_once()).acceleration), pair.theirs.work)
        for pair, one in zip(pairs, stand, strict=True)
        if one
    ]
    energy = np.array(worked)
    return {
        "motions": f"{len(pairs)}",
        "of which peaks above 0.01 in either program": f"{lifted.sum()}",
        "overturn: OpenSees": f"{fell.sum()}",
        "overturn: rockframe, nominal": f"{(ours == _FALLEN).sum()}",
        "overturn: rockframe, sum of shares": f"{sum(shares):.1f}",
        "same nominal outcome": f"{100.0 * np.mean(fell == (ours == _FALLEN)):.1f} %",
        "Brier score of the share": f"{brier(shares, fell):.4f}",
        "Brier score of the nominal outcome": f"{brier(ours == _FALLEN, fell):.4f}",
        "Brier score of the overall share": f"{brier([fell.mean()] * fell.size, fell):.4f}",
        "Kolmogorov-Smirnov distance of peaks": f"{distance:.3f}",
        "p, samples taken as independent": f"{usual:.3f}",
        "p, by exchanges within pairs": f"{by_exchange:.4f}",
        "the same, peaks above 0.1 in either program": (
            f"{exchange_test(theirs[far], ours[far])[1]:.4f} ({far.sum()} motions)"
        ),
        "ours over theirs, median of peaks, both stand": f"{np.exp(np.median(ratio)):.3f}",
        "16 and 84 % quantiles of this ratio": " to ".join(
            f"{one:.2f}" for one in np.exp(np.quantile(ratio, (0.16, 0.84)))
        ),
        "median peak, both stand: OpenSees, rockframe": ", ".join(
            f"{np.median(one[stand]):.3f}" for one in (theirs, ours)
        ),
        "peaks below, within, above our 16 to 84 % band": ", ".join(
            f"{100.0 * one:.0f} %" for one in (below, 1.0 - below - above, above)
        ),
        "work of the ground, both stand: ours over theirs": (
            f"{energy[:, 0].sum() / energy[:, 1].sum():.3f}"
        ),
    }


@lru_cache(maxsize=1)
def motions_once() -> dict[str, Motion]:
    """Return the motions, computed once."""
    return motions()


def classes_of(pairs: Sequence[Pair]) -> list[tuple[str, float, int, int]]:
    """Return classes of the share here: words, mean share, how many overturn there, motions."""
    shares = np.array([pair.ensemble.share_overturned for pair in pairs])
    fell = np.array([pair.theirs.overturned for pair in pairs])
    found = []
    for low, high, words in CLASSES:
        chosen = (shares >= low) & (shares < high)
        if chosen.any():
            mean = float(shares[chosen].mean())
            found.append((words, mean, int(fell[chosen].sum()), int(chosen.sum())))
    return found


def share_rows(pairs: Sequence[Pair]) -> list[list[str]]:
    """Return, for classes of the share that overturns here, how many overturn in OpenSees."""
    rows = []
    for words, share, count, number in classes_of(pairs):
        ends = " to ".join(f"{100.0 * one:.0f}" for one in share_interval(count, number))
        overturn = f"{count}: {100.0 * count / number:.0f} % ({ends} %)"
        rows.append([words, str(number), f"{100.0 * share:.0f} %", overturn])
    return rows


@lru_cache(maxsize=256)
def half_period(name: str, peak: float) -> float:
    """Return the time between the impacts around a free peak of |theta| / slenderness [s]."""
    frame = STRUCTURES[name]
    still = Motion("still", np.zeros(3), 20.0)
    released = respond(frame, still.ground, initial_rotation=peak * frame.slenderness)
    return 2.0 * float(released.impact_times[0])


@lru_cache(maxsize=256)
def rigid_peak(name: str, motion: str) -> float:
    """Return the peak of |theta| over the slenderness in the package [1]."""
    ground = motion_of(Task(name, motion, 1.0), {}).ground
    return float(respond(STRUCTURES[name], ground).peak_rotation_ratio)


def pulses_of(name: str) -> list[str]:
    """Return the names of the pulses of a main structure."""
    return [f"ricker-{one:g}-{period:g}" for one, period in PULSES[name]]


def pulse_rows(results: dict[Task, Result]) -> list[list[str]]:
    """Return the peaks under each pulse, here and in OpenSees by shortening of the contact."""
    rows = []
    for name in MAIN:
        for motion in pulses_of(name):
            acceleration, period = motion.split("-")[1:]
            rigid = rigid_peak(name, motion)
            row = [f"{name}, {acceleration} g, {period} s", f"{rigid:.4f}"]
            for shortening in SHORTENINGS:
                found = results.get(Task(name, motion, 1.0, shortening))
                row.append("" if found is None else _change(found.peak_ratio / rigid))
            rows.append(row)
    return rows


def contact_rows(results: dict[Task, Result]) -> list[list[str]]:
    """Return how each kind of contact and column changes the response of the bent."""
    kinds = [(f"{1e3 * one:g} mm", {"shortening": one}) for one in SHORTENINGS]
    kinds += [
        (f"{1e3 * one:g} mm, damped", {"shortening": one, "damping": DAMPING})
        for one in SHORTENINGS[1:]
    ]
    kinds += [
        (f"0.01 mm, columns of {period:g} s", {"column_period": period})
        for period in COLUMN_PERIODS[1:]
    ]
    kinds.append(("0.01 mm, two columns", {"columns": 2}))
    return [[words, *_contact_row(results, changes)] for words, changes in kinds]


def _contact_row(results: dict[Task, Result], changes: dict[str, float]) -> list[str]:
    found, ratios, periods, kept = 0, [], [], []
    for motion in pulses_of("bent"):
        one = results.get(replace(Task("bent", motion, 1.0), **changes))  # type: ignore[arg-type]
        if one is None or not one.converged:
            continue
        found += 1
        ratios.append(one.peak_ratio / rigid_peak("bent", motion))
        if np.isfinite(one.restitution):
            kept.append(one.restitution)
            periods.append(one.half_period / half_period("bent", one.free_peak_ratio))
    if not found:
        return [""] * 4
    ends = " to ".join(_change(one) for one in (min(ratios), max(ratios)))
    return [
        _change(float(np.median(ratios))),
        ends,
        f"{np.median(kept):.4f}",
        _change(float(np.median(periods))),
    ]


def sway_period(frame: RockingFrame, shortening: float) -> float:
    """Return the period at which a structure sways on its contact before it lifts [s].

    The restoring moment grows linearly up to the rotation 2 s / width, see `compliant`.
    """
    stiffness = 0.5 * frame.width / shortening * np.sin(frame.slenderness)
    squared = frame.effective_frequency_parameter**2 * (stiffness - np.cos(frame.slenderness))
    return float(2.0 * np.pi / np.sqrt(squared))


def sway_rows(results: dict[Task, Result]) -> list[list[str]]:
    """Return the changes of peaks by the period of sway over that of the pulse."""
    found: dict[str, dict[float, list[float]]] = {words: {0.0: [], DAMPING: []} for words in _SWAYS}
    for task, result in results.items():
        if not task.motion.startswith("ricker-") or task.columns > 1 or task.column_period:
            continue
        period = sway_period(STRUCTURES[task.structure], task.shortening)
        over = period / float(task.motion.split("-")[2])
        words = next(words for words, end in _SWAYS.items() if over < end)
        ratio = result.peak_ratio / rigid_peak(task.structure, task.motion)
        found[words][task.damping].append(ratio)
    return [
        [
            words,
            *(
                f"{_change(float(np.median(ratios)))} ({_change(min(ratios))} to "
                f"{_change(max(ratios))}, {len(ratios)})"
                for ratios in kinds.values()
            ),
        ]
        for words, kinds in found.items()
        if all(kinds.values())
    ]


def variant_rows(results: dict[Task, Result]) -> list[list[str]]:
    """Return how contact and columns change the distribution over the motions."""
    kinds: list[tuple[str, dict[str, float]]] = [
        ("bent, 0.1 mm", {"shortening": 1.0e-4}),
        ("bent, 1 mm", {"shortening": 1.0e-3}),
        ("bent, 0.01 mm, columns of 0.2 s", {"column_period": 0.2}),
        ("bent, 0.01 mm, two columns", {"columns": 2}),
        ("bent, 0.01 mm, half the time step", {"step_factor": 0.5}),
        ("column, 0.01 mm, half the time step", {"step_factor": 0.5}),
    ]
    rows = []
    for words, changes in kinds:
        name = words.split(",")[0]
        both = [
            (results[task], results[changed])
            for task in results
            if task == Task(name, task.motion, task.scale)
            and not task.motion.startswith("ricker-")
            and (changed := replace(task, **changes)) in results  # type: ignore[arg-type]
            and results[task].converged
            and results[changed].converged
        ]
        if both:
            rows.append([words, *_variant_row(both)])
    return rows


def _variant_row(both: Sequence[tuple[Result, Result]]) -> list[str]:
    ratios = [
        two.peak_ratio / one.peak_ratio
        for one, two in both
        if not one.overturned and not two.overturned and one.peak_ratio > _STILL
    ]
    low, middle, high = np.quantile(ratios or [np.nan], (0.16, 0.5, 0.84))
    fallen = [sum(pair[k].overturned for pair in both) for k in (0, 1)]
    same = sum(one.overturned == two.overturned for one, two in both)
    return [
        str(len(both)),
        f"{fallen[0]}, {fallen[1]}",
        str(same),
        f"{middle:.2f} ({low:.2f} to {high:.2f}, {len(ratios)} motions)",
    ]


def compliant_rows(results: dict[Task, Result]) -> list[list[str]]:
    """Return the errors of the rigid model and of the simplest model of a compliant contact."""
    rows = []
    for name in MAIN:
        for damping, words in ((0.0, "undamped"), (DAMPING, "damped")):
            for shortening in SHORTENINGS[1:]:
                tasks = [
                    Task(name, motion, 1.0, shortening, damping=damping)
                    for motion in pulses_of(name)
                ]
                errors = [_errors(task, results[task]) for task in tasks if task in results]
                if errors:
                    both = [*zip(*errors, strict=True)]
                    middle = [_change(1.0 + float(np.median(one))) for one in both]
                    worst = [_change(1.0 + max(one, key=abs)) for one in both]
                    label = f"{name}, {1e3 * shortening:g} mm, {words}"
                    rows.append([label, middle[0], worst[0], middle[1], worst[1]])
    return rows


def _errors(task: Task, theirs: Result) -> tuple[float, float]:
    """Return the errors of the peak of the rigid model and of the compliant one [1]."""
    model = peak_ratio(STRUCTURES[task.structure], motion_of(task, {}), task.shortening)
    rigid = rigid_peak(task.structure, task.motion)
    return rigid / theirs.peak_ratio - 1.0, model / theirs.peak_ratio - 1.0


def measured_rows() -> list[list[str]]:
    """Return measured velocity ratios of impacts, and their losses over those of eq (43)."""
    rows = []
    for aspect, base, share in MEASURED:
        rigid = RockingFrame(height=aspect, width=1.0).restitution
        loss = np.log(share * rigid) / np.log(rigid)
        numbers = (f"{rigid:.3f}", f"{share * rigid:.3f}", f"{loss:.1f}")
        rows.append([f"aspect ratio {aspect:g} on {base}", *numbers])
    return rows


def _change(ratio: float) -> str:
    return f"{100.0 * (ratio - 1.0):+.1f} %".replace("-", "\u2212")


def tables(results: dict[Task, Result], pairs: dict[str, list[Pair]]) -> dict[str, str]:
    """Return the tables of the page by name, in Markdown."""
    rows = {name: motion_rows(some) for name, some in pairs.items()}
    first = next(iter(rows.values()))
    together = [pair for name in MAIN for pair in pairs.get(name, [])]
    shortenings = [f"{1e3 * one:g} mm" for one in SHORTENINGS]
    peaks = ["pulse", "rockframe", *shortenings]
    contact = ["contact", "peak, median", "least to largest", "restitution", "period"]
    classes = ["share here", "motions", "mean share", "overturn in OpenSees (90 % interval)"]
    variants = ["contact", "motions", "overturn: 0.01 mm, this", "same outcome", "ratio of peaks"]
    simple = ["contact", "rigid, median", "worst", "simple model, median", "worst"]
    return {
        "motions": table(
            ["", *rows], [[key, *(row[key] for row in rows.values())] for key in first]
        ),
        "shares": table(classes, share_rows(together)),
        "pulses": table(peaks, pulse_rows(results)),
        "contact": table(contact, contact_rows(results)),
        "sway": table(
            ["period of sway over that of the pulse", "undamped contact", "damped"],
            sway_rows(results),
        ),
        "periods": table(
            ["", *(f"{1e3 * one:g} mm" for one in SHORTENINGS)],
            [
                [name, *(f"{sway_period(STRUCTURES[name], one):.3f} s" for one in SHORTENINGS)]
                for name in MAIN
            ],
        ),
        "variants": table(variants, variant_rows(results)),
        "model": table(simple, compliant_rows(results)),
        "measured": table(["block", "(43)", "measured", "loss over (43)"], measured_rows()),
    }


def draw(results: dict[Task, Result], pairs: dict[str, list[Pair]]) -> None:
    """Draw the figures of the page."""
    peaks = {}
    for name in MAIN:
        values = np.array([pair.peaks for pair in pairs[name]])
        peaks[name] = values[(values > _STILL).any(axis=1)]
    together = [pair for name in MAIN for pair in pairs[name]]
    points = [
        (share, count / number, *share_interval(count, number))
        for _, share, count, number in classes_of(together)
    ]
    draw_motions(peaks, points, DOCS / "validation-motions.png")
    ratios, kept = {}, {}
    for label, damping in (("undamped", 0.0), ("damped", DAMPING)):
        rows = [
            [results.get(Task("bent", motion, 1.0, one, damping=damping)) for one in SHORTENINGS]
            for motion in pulses_of("bent")
        ]
        ratios[label] = np.array(
            [
                [one.peak_ratio / rigid_peak("bent", motion) if one else np.nan for one in row]
                for motion, row in zip(pulses_of("bent"), rows, strict=True)
            ]
        )
        kept[label] = np.array(
            [[one.restitution if one else np.nan for one in row] for row in rows]
        )
    rigid = STRUCTURES["bent"].restitution
    draw_contact(SHORTENINGS, ratios, kept, rigid, DOCS / "validation-contact.png")


def main() -> None:
    """Print the tables, and write them and the figures to the documentation."""
    results = read()
    pairs = {name: some for name in STRUCTURES if (some := pairs_of(results, name))}
    found = tables(results, pairs)
    for name, rows in found.items():
        print(f"\n{name}\n{rows}")
    print(
        f"\n{len(results)} responses, {sum(not one.converged for one in results.values())} failed"
    )
    page = DOCS / "validation.md"
    if page.exists():
        write_page(found, page)
    draw(results, pairs)


if __name__ == "__main__":
    main()
