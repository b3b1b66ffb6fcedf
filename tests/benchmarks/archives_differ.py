"""Verdicts from two files of one record: `python -m tests.benchmarks.archives_differ`.

The files are in `../shared`: pairs of archives, formats or processing that hold one record. Both
files of a pair are multiplied by one factor, so that the PGV of the first takes each value of
PGVS. Each shakes the shipped structures, with the ensemble of 64 members that a run computes. Only
scenarios count in which the members of the first file or of the second do not all agree. The last
row compares each first file with itself, with another seed: so much is sampling.

It takes a minute of processor time. More pairs are more lines of PAIRS.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.size import sized
from tests.conftest import REPOSITORY, SHARED

from rockframe import Ensemble, IngestOptions, Record, RockingFrame, read_structures
from rockframe.results.records import open_records
from rockframe.results.versions import Uncertain, VersionSources
from rockframe.rocking import Verdict, as_ground, ensemble_responses, respond_many
from rockframe.rocking.verdict import OVERTURNS_FROM, STANDS_UP_TO
from rockframe.signals.processing import integrate
from rockframe.stages.ingest import ingest_stage

Float: TypeAlias = NDArray[np.float64]
#: A record, and the data from which its other corners are computed, if this package corrected it.
Sourced: TypeAlias = tuple[Record, Uncertain | None]
#: Shares that overturn and nominal overturning, shape (factors, frames).
Outcomes: TypeAlias = tuple[Float, NDArray[np.bool_]]

#: PGV of the first file of each pair [m s-1].
PGVS: Final = tuple(np.geomspace(0.25, 4.0, sized(25, 3)).round(3).tolist())
BUNDLED: Final = REPOSITORY / "records" / "ridgecrest2019"
RAW, PROCESSED = IngestOptions(streams="raw"), IngestOptions()


class Source(NamedTuple):
    """A record of a file, and how the file is read."""

    path: Path
    name: str
    options: IngestOptions = PROCESSED


def pairs() -> dict[str, list[tuple[Source, Source]]]:
    """Return the pairs of files by what differs between them."""
    records, workspace = SHARED / "records", SHARED / "asdf" / "nc72282711_workspace.h5"
    formats, whole = records / "formats", records / "ridgecrest2019"
    trimmed = {"CCC": whole / "CICCC.RAW", "CLC": whole / "CICLC.v1", "TOW2": whole / "CITOW2.RAW"}
    return {
        "raw file, whole and cut": [
            (
                Source(BUNDLED / f"Ridgecrest2019-{name}.V1", f"Ridgecrest2019-{name}-{azimuth}"),
                Source(path, f"{path.stem}-{azimuth}"),
            )
            for name, path in trimmed.items()
            for azimuth in ("090", "360")
        ],
        "raw, CSMIP V1 and miniSEED": [
            (
                Source(whole / "CICLC.v1", f"CICLC-{azimuth}"),
                Source(formats / "miniseed" / f"CI.CLC..{name}.mseed", f"CI.CLC..{name}"),
            )
            for azimuth, name in (("090", "HNE"), ("360", "HNN"))
        ],
        "raw, and processed by the archive": [
            (
                Source(formats / "csmip" / "CE89146.V1", f"CE89146-{azimuth}"),
                Source(formats / "csmip" / "CE89146.V2", f"CE89146-{azimuth}"),
            )
            for azimuth in ("090", "360")
        ],
        "raw, and processed by gmprocess": [
            (Source(workspace, name, RAW), Source(workspace, name))
            for name in ("nc72282711-CE.68150..HNE", "nc72282711-CE.68150..HNN")
        ],
        "processed by two archives": [
            (
                Source(formats / "peer_at2" / "RSN77_SFERN_PUL164.AT2", "RSN77_SFERN_PUL164"),
                Source(
                    records / "table1" / "sanfernando1971_PacoimaDam-164.csv",
                    "sanfernando1971_PacoimaDam-164",
                ),
            )
        ],
    }


def read(source: Source) -> Sourced:
    """Return a record as a run processes it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "records.nc"
        ingest_stage([source.path], path, source.options)
        with open_records(path) as file:
            record = file.read(source.name)
            sources = VersionSources.of(file, Ensemble(), [source.name])
            return record, sources.uncertain(record)


def verdicts(
    sourced: Sourced, factors: Iterable[float], frames: Sequence[RockingFrame], seed: int
) -> Outcomes:
    """Return shares that overturn and nominal overturning, shape (factors, frames)."""
    record, uncertain = sourced
    chosen, scales = Ensemble(seed=seed), list(factors)
    grounds = [as_ground(record).scaled(scale) for scale in scales]
    versions = None
    if uncertain is not None:
        each = uncertain.versions(chosen, record)
        versions = [each.scaled(scale) for scale in scales]
    responses = ensemble_responses(grounds, frames, chosen, versions)
    shares = np.array([[each.share_overturned for each in row] for row in responses])
    nominal = respond_many([record], frames, scales).verdict[0].T == Verdict.OVERTURNS
    return shares, nominal


def words(shares: Float) -> NDArray[np.int64]:
    """Return the verdicts of shares: 0 stands, 1 may overturn, 2 overturns."""
    return (shares > STANDS_UP_TO).astype(int) + (shares >= OVERTURNS_FROM)


def row_of(title: str, first: list[Outcomes], second: list[Outcomes]) -> str:
    """Return the row of shares and nominal outcomes of both files of each pair."""
    share, other = (np.concatenate([each[0].ravel() for each in file]) for file in (first, second))
    nominal, other_nominal = (
        np.concatenate([each[1].ravel() for each in file]) for file in (first, second)
    )
    mixed = ((share > 0.0) & (share < 1.0)) | ((other > 0.0) & (other < 1.0))
    change = np.abs(share - other)[mixed]
    several = (
        (nominal != other_nominal)[mixed],
        (words(share) != words(other))[mixed],
        (np.abs(words(share) - words(other)) == 2)[mixed],
        change > 0.25,
    )
    parts = " | ".join(f"{100.0 * values.mean():.0f} %" for values in several)
    middle, most = np.quantile(change, [0.5, 1.0]) if change.size else (0.0, 0.0)
    return f"| {title} | {len(first)} | {mixed.sum()} | {parts} | {middle:.2f} | {most:.2f} |"


def rows(frames: Sequence[RockingFrame]) -> Iterator[str]:
    """Yield the rows of the table."""
    same: tuple[list[Outcomes], list[Outcomes]] = [], []
    for title, several in [*pairs().items()][: sized(5, 1)]:
        columns: tuple[list[Outcomes], list[Outcomes]] = [], []
        for first, second in several:
            files = read(first), read(second)
            record = files[0][0]
            pgv = np.abs(integrate(record.acceleration, record.time_step)).max()
            factors = [target / pgv for target in PGVS]
            for column, file in zip(columns, files, strict=True):
                column.append(verdicts(file, factors, frames, 0))
            same[0].append(columns[0][-1])
            same[1].append(verdicts(files[0], factors, frames, 1))
        yield row_of(title, *columns)
    yield row_of("the first file, with another seed", *same)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    if not SHARED.is_dir():
        print(f"not run: {SHARED} is absent, which has the files")
        return
    head = (
        "what differs",
        "pairs",
        "scenarios",
        "nominal outcomes differ",
        "verdicts differ",
        "stands, and overturns",
        "shares differ by more than 0.25",
        "median difference",
        "largest",
    )
    print("| " + " | ".join(head) + " |")
    print("|---" * len(head) + "|")
    for row in rows(read_structures()):
        print(row, flush=True)


if __name__ == "__main__":
    main()
