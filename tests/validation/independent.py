"""Compare the package with a plain integrator: `python -m tests.validation.independent`.

Each random case (`random_cases`) is computed by the package and twice, with two tolerances, by the
plain integrator (`plain`); and the package's histories of it, and of further cases, are checked for
the four invariants (`invariants`). Results are lines of independent.csv; a run that is repeated
resumes after the last line. The table goes into docs/validation.md.

Rocking is chaotic, so two correct programs differ after an impact that barely happens. The two
tolerances show where: histories and impacts are compared until the plain integrator differs from
itself, and peaks and verdicts of the cases in which it does not. The others are counted.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.validation import plain
from tests.validation.invariants import broken, ground_of
from tests.validation.page import DOCS, table, write_page
from tests.validation.random_cases import KINDS, Case, case_of

from rockframe.frame import RockingFrame
from rockframe.oscillators.response import respond_oscillator
from rockframe.rocking.response import respond

RESULTS: Final = Path(__file__).resolve().parent / "independent.csv"
#: Cases of each kind that both compute, and further ones whose invariants are checked, in blocks.
CASES, FURTHER, BLOCK = 100, 400, 100
#: Tolerances of the plain integrator.
FINE, COARSE = 1e-11, 1e-8
#: A difference of its two histories or peaks, over the slenderness, that counts as sensitive.
_SENSITIVE: Final = 1e-5
#: Impacts slower than this times the rate of the frame are not compared: those before rest.
_SLOW: Final = 1e-3

Float: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Result:
    """Numbers that are kept of a case, or of a block of cases of the package alone.

    Parameters
    ----------
    kind, seed
        The case; of a block, the first one.
    histories : int
        Number of cases.
    verdict, plain_verdict, coarse_verdict : int
        0 no uplift, 1 stands, 2 overturns or collapses, -1 undecided: of the package, and of the
        plain integrator with both tolerances.
    peak, plain_peak, coarse_peak : float
        Largest rotation over the slenderness, or displacement [m].
    history : float
        Largest difference of the histories while the plain integrator agrees with itself, over the
        slenderness, or over the peak of an oscillator.
    compared : float
        Share of the samples at which they are compared.
    impacts : int
        Impacts, or starts of yielding, compared; -1 if the programs have different ones.
    times : float
        Largest difference of their times [s].
    gap : float
        Difference of the times at which the gap closes, or the lift is exceeded [s]; infinite if
        only one program reaches it.
    broken : str
        Invariants that are violated.
    """

    kind: str
    seed: int
    histories: int = 1
    verdict: int = 0
    plain_verdict: int = 0
    coarse_verdict: int = 0
    peak: float = math.nan
    plain_peak: float = math.nan
    coarse_peak: float = math.nan
    history: float = math.nan
    compared: float = math.nan
    impacts: int = 0
    times: float = math.nan
    gap: float = math.nan
    broken: str = ""

    @property
    def sensitive(self) -> bool:
        """True if the plain integrator does not agree with itself on the peak or the verdict."""
        if -1 in (self.plain_verdict, self.coarse_verdict):
            return True
        if self.plain_verdict != self.coarse_verdict:
            return True
        return self._far(self.coarse_peak)

    @property
    def peak_difference(self) -> float:
        """Difference of the peak from that of the plain integrator, as `history`."""
        scale = 1.0 if self.kind not in ("isolated", "fixed") else self.plain_peak
        if self.peak == self.plain_peak:
            return 0.0
        return abs(self.peak - self.plain_peak) / scale

    def _far(self, peak: float) -> bool:
        scale = 1.0 if self.kind not in ("isolated", "fixed") else self.plain_peak
        return peak != self.plain_peak and abs(peak - self.plain_peak) > _SENSITIVE * scale


@dataclass(frozen=True, eq=False)
class _Ours:
    """The package's answer in the form of a plain history."""

    place: Float
    verdict: int
    peak: float
    events: list[tuple[float, float]]
    times: tuple[float, float] = (math.nan, math.nan)


def _computed(case: Case) -> tuple[_Ours, plain.History, plain.History, float]:
    """Return the answers of the package and of the plain integrator, and the scale of places."""
    ground, (fine, coarse) = ground_of(case), (FINE, COARSE)
    if isinstance(case.ours, RockingFrame):
        assert isinstance(case.plain, plain.Rocker)
        response = respond(case.ours, ground)
        events = [*zip(response.impact_times, response.impact_velocities, strict=False)]
        times = (response.gap_closed_time, response.lift_exceeded_time)
        peak = response.peak_rotation
        ours = _Ours(response.theta, int(response.verdict), peak, events, times)
        one, two = (
            plain.rock(case.plain, case.time_step, case.across, case.upwards, tolerance)
            for tolerance in (fine, coarse)
        )
        return ours, one, two, case.plain.slenderness
    assert isinstance(case.plain, plain.Oscillator)
    found = respond_oscillator(case.ours, ground)
    peak = found.peak_displacement
    verdict = plain.STANDS if math.isfinite(peak) else plain.OVERTURNS
    first = [] if math.isnan(found.first_yield_time) else [(found.first_yield_time, 1.0)]
    ours = _Ours(found.u, verdict, peak, first)
    one, two = (
        plain.oscillate(case.plain, case.time_step, case.across, tolerance)
        for tolerance in (fine, coarse)
    )
    one.events, two.events = one.events[:1], two.events[:1]
    shown = one.place[np.isfinite(found.u)]  # not beyond the collapse
    return ours, one, two, float(np.abs(shown).max()) or 1.0


def compared(kind: str, seed: int, case: Case) -> Result:
    """Compute a case with both programs, and return what is kept."""
    ours, one, two, scale = _computed(case)
    with np.errstate(invalid="ignore"):
        apart = np.abs(one.place - two.place) > _SENSITIVE * scale
        other = np.isnan(one.place) != np.isnan(two.place)
    steps = np.flatnonzero(apart | other)
    last = int(steps[0]) if steps.size else one.place.size
    missing = np.isnan(ours.place[:last]) != np.isnan(one.place[:last])
    gone = np.abs(ours.place[:last] - one.place[:last]) / scale
    history = math.inf if missing.any() and kind != "fixed" else float(np.nanmax(gone, initial=0.0))
    count, times = _impacts(case, ours, one, case.time_step * (last - 1))
    unit = scale if isinstance(case.ours, RockingFrame) else 1.0
    peaks = [float(f"{peak / unit:.12g}") for peak in (ours.peak, one.peak, two.peak)]
    return Result(
        kind,
        seed,
        verdict=ours.verdict,
        plain_verdict=one.verdict,
        coarse_verdict=two.verdict,
        peak=peaks[0],
        plain_peak=peaks[1],
        coarse_peak=peaks[2],
        history=float(f"{history:.3g}"),
        compared=float(f"{last / one.place.size:.3g}"),
        impacts=count,
        times=float(f"{times:.3g}"),
        gap=float(f"{_gap(ours, one, case.time_step * (case.across.size - 1)):.3g}"),
        broken=" ".join(broken(case)),
    )


def _impacts(case: Case, ours: _Ours, one: plain.History, end: float) -> tuple[int, float]:
    """Return the number of fast impacts until a time and the largest difference of their times."""
    slow = _SLOW * case.plain.rate if isinstance(case.ours, RockingFrame) else 0.0
    both = [
        [time for time, speed in some if abs(speed) > slow and time <= end - case.time_step]
        for some in (ours.events, one.events)
    ]
    if len(both[0]) != len(both[1]):
        return -1, math.nan
    gaps = [abs(a - b) for a, b in zip(*both, strict=True)]
    return len(gaps), max(gaps, default=0.0)


def _gap(ours: _Ours, one: plain.History, end: float) -> float:
    """Return the difference of the times of gap and lift, of those in the motion."""
    found = 0.0
    for mine, theirs in zip(ours.times, (one.gap_time, one.lift_time), strict=True):
        other = theirs if theirs <= end else math.nan
        if math.isnan(mine) != math.isnan(other):
            return math.inf
        if not math.isnan(mine):
            found = max(found, abs(mine - other))
    return found


def read() -> dict[tuple[str, int], Result]:
    """Return the results so far."""
    if not RESULTS.exists():
        return {}
    with RESULTS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    kinds = {field.name: field.type for field in fields(Result)}
    make = {"str": str, "int": int, "float": float}
    found = (
        Result(**{name: make[str(kinds[name])](text) for name, text in row.items()}) for row in rows
    )
    return {(one.kind, one.seed): one for one in found}


def rows_of(results: Iterable[Result]) -> list[list[str]]:
    """Return the rows of the table: one for each kind."""
    rows, known = [], [*results]
    for kind in KINDS:
        some = [one for one in known if one.kind == kind]
        cases = [one for one in some if one.histories == 1]
        if cases:
            rows.append([kind, *_row(cases, some)])
    return rows


def _row(cases: Sequence[Result], some: Sequence[Result]) -> list[str]:
    known = [one for one in cases if not one.sensitive]
    outcomes = [one.verdict != one.plain_verdict for one in known]
    broken_ones = [name for one in some for name in one.broken.split()]
    return [
        str(len(cases)),
        str(sum(one.plain_verdict == plain.OVERTURNS for one in cases)),
        f"{max(one.history for one in cases):.0e}",
        f"{100.0 * np.mean([one.compared for one in cases]):.1f} %",
        f"{max(one.peak_difference for one in known):.0e}",
        f"{np.max([one.times for one in cases]):.0e} s",  # NaN if impacts differ
        _gaps(cases),
        str(len(cases) - len(known)),
        str(sum(outcomes)),
        f"{len(broken_ones)} of {sum(one.histories for one in some)}",
    ]


def _gaps(cases: Sequence[Result]) -> str:
    if cases[0].kind != "abutment":
        return ""
    return f"{max(one.gap for one in cases):.0e} s"


HEAD: Final = (
    *("kind", "cases", "overturn or collapse", "histories", "of which compared", "peaks"),
    *("times of impacts", "of the gap", "sensitive", "verdicts that differ", "invariants broken"),
)


def _all() -> list[tuple[str, int]]:
    """Return what is to be done: cases of all kinds in turn, then the blocks."""
    cases = [(kind, seed) for seed in range(CASES) for kind in KINDS]
    return cases + [(kind, seed) for kind in KINDS for seed in range(CASES, CASES + FURTHER, BLOCK)]


def _block(kind: str, first: int) -> Result:
    names = [name for seed in range(first, first + BLOCK) for name in broken(case_of(kind, seed))]
    return Result(kind, first, BLOCK, broken=" ".join(names))


def main() -> None:
    """Compute the cases that have no result yet, and print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--limit", type=int, help="stop after this number of cases")
    chosen = parser.parse_args()
    done = read()
    left = [key for key in _all() if key not in done][: chosen.limit]
    if not RESULTS.exists():
        names = [field.name for field in fields(Result)]
        RESULTS.write_text(",".join(names) + "\n", encoding="utf-8")
    for number, (kind, seed) in enumerate(left):
        one = compared(kind, seed, case_of(kind, seed)) if seed < CASES else _block(kind, seed)
        with RESULTS.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(astuple(one))
        done[kind, seed] = one
        if (number + 1) % 10 == 0:
            print(f"{number + 1} of {len(left)}", flush=True)
    found = table(HEAD, rows_of(done.values()))
    print(found)
    write_page({"independent": found}, DOCS / "validation.md")


if __name__ == "__main__":
    main()
