"""Shares and bands of the ensemble: `python -m tests.benchmarks.spread`.

First the table of all bundled records and structures: the nominal peak and outcome, the bands of
the ensemble, and the share that overturns. Then the coverage over 60 pairs of a bundled record, a
shipped structure and a multiple of the motion: how often the interval of the share from 64 members
contains the share of 2,000 members with another seed, and how often the bands of pairs that never
overturn are within 10 % of those of the 2,000 members.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.size import sized

from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.results.records import open_records
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    MemberPeaks,
    Verdict,
    Versions,
    as_ground,
    ensemble_responses,
    member_peaks,
    respond,
)
from rockframe.rocking.assessments import share_interval
from rockframe.rocking.margins.ensemble import quantiles
from rockframe.stages.common import horizontal
from rockframe.stages.ingest import ingest_stage
from rockframe.study.structures import bundled_records, read_structures

#: Multiples of the bundled motions: with 6 records and 5 structures, 60 pairs.
SCALES: Final = (1.0, 1.5)
#: Bands agree within this share of the value [1].
CLOSE: Final = 0.10
#: Motions, and a function that returns their versions for the members of an ensemble.
Shaken: TypeAlias = tuple[list[GroundAcceleration], Callable[[Ensemble], list[Versions]]]


def horizontal_records() -> list[Uncertain]:
    """Return the bundled horizontal records, as a run processes them, with their versions."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "records.nc"
        ingest_stage([bundled_records()], path)
        with open_records(path) as file:
            names = horizontal(file)
            sources = VersionSources.of(file, Ensemble(), names)
            found = [sources.uncertain(file.read(name)) for name in names]
            return [one for one in found if one is not None]


def shaken(records: Sequence[Uncertain], scales: Sequence[float]) -> Shaken:
    """Return the motions at these scales, and a function of an ensemble that returns versions."""
    grounds = [as_ground(one.record).scaled(scale) for one in records for scale in scales]

    def versions(ensemble: Ensemble) -> list[Versions]:
        several = [one.versions(ensemble, one.record) for one in records]
        return [one.scaled(scale) for one in several for scale in scales]

    return grounds, versions


def print_table(records: Sequence[Uncertain], frames: Sequence[RockingFrame]) -> None:
    """Print the nominal response and that of the ensemble of each pair."""
    head = ("record, structure", "theta/alpha", "16 %", "50 %", "84 %", "overturn", "90 % interval")
    print(f"{head[0]:42}{head[1]:>12}" + "".join(f"{one:>11}" for one in head[2:6]), head[6])
    grounds, versions = shaken(records, [1.0])
    found = ensemble_responses(grounds, frames, Ensemble(), versions(Ensemble()))
    for record, row in zip((one.record for one in records), found, strict=True):
        for frame, ensemble in zip(frames, row, strict=True):
            response = respond(frame, record)
            fallen = response.verdict is Verdict.OVERTURNS
            nominal = "overturns" if fallen else f"{response.peak_rotation_ratio:.3f}"
            print(f"{record.record_id + ', ' + frame.name:42}{nominal:>12}{_row(ensemble)}")


def _row(found: EnsembleResponse) -> str:
    bands = [
        f"{one:.3f}" if np.isfinite(one) else "overturns" for one in found.bands.peak_rotation_ratio
    ]
    share = f"{100.0 * found.share_overturned:.0f} %"
    low, high = 100.0 * found.share_overturned_low, 100.0 * found.share_overturned_high
    return "".join(f"{one:>11}" for one in (*bands, share)) + f" {low:.0f} to {high:.0f} %"


def print_coverage(
    motions: Shaken, frames: Sequence[RockingFrame], members: int, seeds: int
) -> None:
    """Print how well 64 members represent many."""
    grounds, versions = motions

    def peaks(ensemble: Ensemble) -> MemberPeaks:
        return member_peaks(grounds, frames, ensemble, versions(ensemble))

    many = peaks(Ensemble(members=members, seed=2_000_000))
    shares = (many.verdict == Verdict.OVERTURNS).mean(axis=2)
    stand, between = shares == 0.0, (shares > 0.05) & (shares < 0.95)
    some = [peaks(Ensemble(seed=seed)) for seed in range(seeds)]
    held = np.array([_holds(one.verdict, shares) for one in some])
    count = Ensemble().members
    print(f"\n{shares.size} pairs, {seeds} draws of {count} members against {members} members")
    print(f"interval of the share holds: {_percent(held)} of 100, all pairs")
    print(
        f"interval of the share holds: {_percent(held[:, between])} of 100, {between.sum()} pairs "
        "of which 5 to 95 % overturn"
    )
    for name in many.peaks:
        expected = quantiles(many.peaks[name])[stand]
        if np.isfinite(expected).all():
            apart = [
                np.abs(quantiles(one.peaks[name])[stand] / expected - 1.0) <= CLOSE for one in some
            ]
            print(
                f"band of {name} within 10 %: {_percent(apart)} of 100 values, {stand.sum()} pairs "
                "that never overturn"
            )


def _holds(verdicts: NDArray[np.int8], shares: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where the interval of the members' share contains a share."""
    count = (verdicts == Verdict.OVERTURNS).sum(axis=2)
    limits = [share_interval(int(one), verdicts.shape[2]) for one in count.ravel()]
    low, high = np.reshape(limits, (*shares.shape, 2)).transpose(2, 0, 1)
    return np.asarray((low <= shares) & (shares <= high))


def _percent(held: object) -> str:
    values = np.asarray(held)
    return f"{100.0 * values.mean():.1f}" if values.size else "none"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and the coverage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--members", type=int, default=sized(2000, 16), help="of the many")
    parser.add_argument("--seeds", type=int, default=sized(10, 1), help="draws of 64 members")
    options = parser.parse_args(arguments)
    records, frames = horizontal_records(), read_structures()
    records, frames = sized((records, frames), (records[:1], frames[:1]))
    print_table(records, frames)
    print_coverage(shaken(records, SCALES), frames, options.members, options.seeds)


if __name__ == "__main__":
    main()
