"""Convergence of statistics of ensembles: `python -m tests.benchmarks.convergence`.

The pairs are those of a bundled record, times 1.5, and a shipped structure of which 10 to 90 % of
1,024 members overturn: the outcome is chaotic. For each pair and each number of members, 64 to
65,536, independent ensembles are drawn, six by default. The table has the standard deviation of
each statistic between these draws, as the root of its mean square over the pairs, and the means of
the smallest and the largest ensembles: a statistic that grows with the members describes their
number. The last row is the root of p(1 - p)/n. The Latin hypercube of an ensemble has 8,192 members
at most here: larger ensembles join several.

It takes four minutes of processor time. `--pairs 30 --draws 20` is larger.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr
from tests.benchmarks.size import sized

from rockframe import Ensemble, RockingFrame, bundled_records, read_file
from rockframe.record import Orientation
from rockframe.rocking import GroundAcceleration, as_ground
from rockframe.rocking.margins.ensemble import member_peaks, quantiles
from rockframe.rocking.margins.members import draws
from rockframe.study.structures import read_structures

Float: TypeAlias = NDArray[np.float64]
Pair: TypeAlias = tuple[GroundAcceleration, RockingFrame]

#: Multiple of the records.
SCALE: Final = 1.5
#: Numbers of members, and the largest hypercube.
MEMBERS: Final = (64, 256, 1024, 4096, 16384, 65536)
BLOCK: Final = 8192
#: The statistics of peaks theta/alpha in their order.
STATISTICS: Final = (
    "share that overturns",
    "16 % quantile",
    "median",
    "mean of those that stand",
    "standard deviation of those that stand",
    "largest of those that stand",
    "rank correlation with the impact loss",
)


def statistics_of(peaks: Float, losses: Float) -> list[float]:
    """Return the statistics of peaks [1], infinite where a member overturns, in their order."""
    stand = peaks[np.isfinite(peaks)]
    return [
        1.0 - stand.size / peaks.size,
        *quantiles(peaks)[:2],
        stand.mean(),
        stand.std(),
        stand.max(),
        spearmanr(peaks, losses).statistic,
    ]


def drawn(pair: Pair, members: int, seed: int) -> tuple[Float, Float]:
    """Return the peaks of members, and their factors of the impact loss."""
    ground, frame = pair
    parts = range(-(-members // BLOCK))
    ensembles = [Ensemble(members=min(members, BLOCK), seed=1000 * seed + part) for part in parts]
    peaks = [member_peaks([ground], [frame], each).peaks for each in ensembles]
    ratios = np.concatenate([each["peak_rotation_ratio"][0, 0] for each in peaks])
    return ratios, np.concatenate([draws(each)[:, 2] for each in ensembles])


def chaotic_pairs(most: int) -> Iterator[Pair]:
    """Yield pairs of which 10 to 90 % of the members overturn; any pair at the smallest size."""
    paths = sorted(bundled_records().glob("*.V1"))
    records = [record for path in paths for record in read_file(path)]
    across = [record for record in records if record.orientation is not Orientation.VERTICAL]
    frames = [frame for frame in read_structures() if isinstance(frame, RockingFrame)]
    for record, frame in product(across, frames):
        pair = as_ground(record).scaled(SCALE), frame
        share = np.isinf(drawn(pair, sized(1024, 16), 999)[0]).mean()
        if most and sized(0.1, 0.0) <= share <= 0.9:
            most -= 1
            print(f"{record.record_id}, {frame.name}: {100.0 * share:.0f} % overturn", flush=True)
            yield pair


def each_draw(pair: Pair, sizes: Sequence[int], number: int) -> Float:
    """Return the statistics of all draws of a pair, shape (sizes, draws, statistics)."""
    return np.array(
        [
            [statistics_of(*drawn(pair, members, seed)) for seed in range(number)]
            for members in sizes
        ]
    )


def print_table(values: Float, sizes: Sequence[int]) -> None:
    """Print the table of values of shape (pairs, sizes, draws, statistics)."""
    titles = (*(f"{size:,}" for size in sizes), f"mean of {sizes[0]:,}", f"of {sizes[-1]:,}")
    print("\n| standard deviation between draws | " + " | ".join(titles) + " |")
    print("|---" * (len(titles) + 1) + "|")
    for k, name in enumerate(STATISTICS):
        each = values[np.isfinite(values[..., k]).all(axis=(1, 2)), :, :, k]
        spread = np.sqrt(each.var(axis=2, ddof=1).mean(axis=0))
        means = each.mean(axis=(0, 2))
        few = "" if len(each) == len(values) else f" ({len(each)} pairs in which it is finite)"
        print_row(name + few, [*spread, means[0], means[-1]])
    shares = values[..., 0].mean(axis=(1, 2))
    independent = np.sqrt((shares * (1.0 - shares)).mean() / np.array(sizes))
    print_row("a share of independent members", independent)


def print_row(name: str, row: Sequence[float] | Float) -> None:
    """Print a row of the table."""
    print(f"| {name} | " + " | ".join(f"{value:.2g}" for value in row) + " |")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=sized(6, 1), help="largest number of pairs")
    parser.add_argument("--draws", type=int, default=sized(6, 2), help="independent draws")
    options = parser.parse_args(arguments)
    sizes = sized(MEMBERS, (16, 32))
    pairs = [*chaotic_pairs(options.pairs)]
    values = np.array([each_draw(pair, sizes, options.draws) for pair in pairs])
    print_table(values, sizes)


if __name__ == "__main__":
    main()
