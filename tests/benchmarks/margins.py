"""Count the pairs in which slivers of overturning lie below the critical scale, and the cost.

    python -m tests.benchmarks.margins [--brute PAIRS] [--random PAIRS] [--seed SEED] [--kind KIND]

The search looks only below the lowest interval that it has found. So what counts is the lowest
interval at least `WIDE` wide of each pair: it is missed if it ends below the critical scale. It is
known from `../shared/expected/slivers.json` (60 pairs), and from brute force: a response at every
1e-4 of the scale (`--step`), from where the frame begins to rock to where samples 0.32 % apart
first overturn, on another lattice than that of the search, with the edges of each interval
bisected. `--brute` does so for some of the 60 pairs, `--random` for pairs that `drawn` draws.
Thinner intervals below the critical scale are counted too; a smaller step finds more of them. Two
draws of the robust margin are compared as well.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from tests.benchmarks.size import sized

from rockframe.components import vertical_beside
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.record import Record
from rockframe.results.records import read_records
from rockframe.rocking import (
    FirstOverturning,
    GroundAcceleration,
    Verdict,
    as_ground,
    respond_scenarios,
    robust_margins,
)
from rockframe.rocking.margins.first_overturning import (
    LARGEST_SCALE,
    first_overturnings,
    largest_scale_of,
    least_scale_of,
)
from rockframe.rocking.scenarios import Prepared
from rockframe.stages.ingest import ingest_stage
from rockframe.study.structures import SHIPPED_STRUCTURES, bundled_records, read_structures
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]

SHARED: Final = Path(__file__).resolve().parents[3] / "shared"
#: Slivers at least this wide count as missed if they lie below the critical scale [1].
WIDE: Final = 1e-4
#: Distance of the samples of brute force that end its range, as a logarithm of the scale.
COARSE: Final = 3.2e-3
KINDS: Final = ("records", "slender", "vertical", "pulses", "restitution", "long", "sizes")
#: Number of samples of a long record, which repeats a shorter one, weaker each time.
LONG: Final = 60_000


@dataclass(frozen=True, eq=False)
class Pair:
    """A frame on a ground, with a name."""

    name: str
    ground: GroundAcceleration
    frame: RockingFrame

    def search(self) -> FirstOverturning:
        """Search for the first overturning of this pair."""
        return searched([self])[0]


def searched(pairs: Sequence[Pair]) -> list[FirstOverturning]:
    """Search for the first overturning of each pair."""
    grounds = list({id(pair.ground): pair.ground for pair in pairs}.values())
    order = {id(ground): k for k, ground in enumerate(grounds)}
    return first_overturnings(
        grounds,
        [pair.frame for pair in pairs],
        np.array([order[id(pair.ground)] for pair in pairs]),
        np.arange(len(pairs)),
        np.array([least_scale_of(pair.ground, pair.frame) for pair in pairs]),
        np.array([largest_scale_of(pair.ground, LARGEST_SCALE) for pair in pairs]),
    )


def shipped_records() -> dict[str, Record]:
    """Return the bundled records, and those of Table 1 if they are present."""
    table1 = SHARED / "records" / "table1"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "records.nc")
        ingest_stage([bundled_records(), *([table1] if table1.is_dir() else [])], path)
        return {record.record_id: record for record in read_records(path)}


def slivers_above_the_least(pair: Pair, step: float) -> tuple[Float, int]:
    """Find the slivers by brute force, in samples whose logarithms are a step apart.

    Returns their ends, shape (slivers, 2), and the number of responses.
    """
    ground, taken = Prepared(pair.ground), 0

    def at(scale: Float) -> tuple[NDArray[np.bool_], Float]:
        nonlocal taken
        taken += scale.size
        zero = np.zeros(scale.size, dtype=np.int64)
        found = respond_scenarios([ground], [pair.frame], zero, zero, scale)
        return found.verdict == Verdict.OVERTURNS, found.peak_rotation_ratio

    base = least_scale_of(pair.ground, pair.frame) * math.exp(0.5 * step)
    last = math.floor(math.log(largest_scale_of(pair.ground, LARGEST_SCALE) / base) / step)
    stride = round(COARSE / step)
    coarse = np.arange(0, last, stride)
    fallen, peak = at(base * np.exp(step * coarse))
    if not fallen.any():
        return np.empty((0, 2)), taken
    top = coarse[fallen.argmax()]
    start = max(0, coarse[(peak > 0.1).argmax()] - 16 * stride)
    scale = base * np.exp(step * np.arange(start, top + 1))
    fallen, _ = at(scale)
    flips = np.flatnonzero(fallen[1:-1] != fallen[:-2])
    stands = np.where(fallen[flips], scale[flips + 1], scale[flips])
    falls = np.where(fallen[flips], scale[flips], scale[flips + 1])
    for _ in range(7):
        middle = 0.5 * (stands + falls)
        hit, _ = at(middle)
        stands, falls = np.where(hit, stands, middle), np.where(hit, middle, falls)
    return falls[: falls.size // 2 * 2].reshape(-1, 2), taken


def drawn(count: int, seed: int, kind: str, records: dict[str, Record]) -> list[Pair]:
    """Draw random pairs that overturn at some scale up to ten.

    A pair has a horizontal record, all equally likely; a slenderness uniform between 0.06 and
    0.35 rad; a height between 0.4 and 40 m, uniform in its logarithm; a mass ratio of 0, 0.3, 1
    or 4. The kinds differ from this: `slender` has a slenderness uniform between 0.06 and 0.15 rad
    and a column alone; `vertical` adds the vertical record; `pulses` replaces the
    record by a Ricker pulse of either kind of 0.3 g, its period between 0.3 and 3 s uniform in
    its logarithm; `restitution` has a restitution factor uniform between 0.8 and 1; `long`
    repeats the record times 0.9, 0.81, ... to 60,000 samples; `sizes` has a height such that
    p_hat is between 0.3 and 6 rad/s, uniform in its logarithm.
    """
    rng = np.random.default_rng(seed)
    verticals = vertical_beside(records.values())
    across = [name for name in sorted(records) if not name.endswith("UP")]
    pairs: list[Pair] = []
    while len(pairs) < count:
        name = across[rng.integers(len(across))]
        slenderness, height = rng.uniform(0.06, 0.35), math.exp(rng.uniform(*np.log([0.4, 40.0])))
        ratio = float(rng.choice([0.0, 0.3, 1.0, 4.0]))
        if kind == "slender":
            slenderness, ratio = rng.uniform(0.06, 0.15), 0.0
        chosen = rng.uniform()
        if kind == "sizes":
            frame = RockingFrame(height=1.0, width=math.tan(slenderness), mass_ratio=ratio)
            height = (frame.effective_frequency_parameter / (0.3 * 20.0**chosen)) ** 2
        frame = RockingFrame(
            height=height,
            width=height * math.tan(slenderness),
            mass_ratio=ratio,
            restitution_factor=0.8 + 0.2 * chosen if kind == "restitution" else 1.0,
        )
        ground = as_ground(records[name])
        if kind == "vertical":
            if name not in verticals:
                continue
            ground = ground.with_vertical(as_ground(verticals[name]))
        if kind == "pulses":
            name = ("symmetric_ricker", "antisymmetric_ricker")[rng.integers(2)]
            ground = as_ground(Pulse(wavelet=name, a_p=0.3 * 9.81, T_p=0.3 * 10.0**chosen))
        if kind == "long":
            sample, step = records[name].acceleration, records[name].time_step
            times = math.ceil(LONG / sample.size)
            again = np.concatenate([0.9**k * sample for k in range(times)])[:LONG]
            ground = GroundAcceleration.from_samples(again, step)
        pair = Pair(f"{name} h {height:.3g} alpha {slenderness:.3f} gamma {ratio:g}", ground, frame)
        if not math.isnan(pair.search().lower):
            pairs.append(pair)
    return pairs


def against_brute_force(pairs: Sequence[Pair], step: float) -> None:
    """Print the slivers below the critical scales, and the cost of search and brute force."""
    begun = time.process_time()
    found = searched(pairs)
    taken = time.process_time() - begun
    begun = time.process_time()
    every = [slivers_above_the_least(pair, step) for pair in pairs]
    brute = time.process_time() - begun
    having, missed, thinner = 0, 0, []
    for pair, one, (slivers, _) in zip(pairs, found, every, strict=True):
        broad = slivers[:, 1] >= (1.0 + WIDE) * slivers[:, 0]
        below = slivers[:, 1] < one.lower
        having += bool(broad.any())
        if (broad & below).any():
            missed += 1
            low, high = slivers[broad & below][0]
            print(f"  missed: {pair.name}: {low:.6f} to {high:.6f}, not {one.lower:.6f}")
        elif below.any():
            thinner.append(one.lower / slivers[below][0, 0] - 1.0)
    for what, responses, seconds in (
        ("search", [one.responses for one in found], taken),
        ("brute force", [count for _, count in every], brute),
    ):
        print(
            f"  {what}: {np.mean(responses):.0f} responses a pair, at most {max(responses)}; "
            f"{1e3 * seconds / len(pairs):.1f} ms of processor time a pair"
        )
    print(
        f"  {having} of {len(pairs)} pairs have slivers {WIDE:g} wide or wider; the lowest was "
        f"missed in {missed}\n"
        f"  only thinner ones lie below the critical scale in {len(thinner)} pairs, by at most "
        f"{max(thinner, default=0.0):.1%}"
    )


def against_slivers(pairs: dict[tuple[str, str], Pair]) -> None:
    """Print in how many pairs the lowest of the stated slivers is missed."""
    stated = json.loads((SHARED / "expected" / "slivers.json").read_text(encoding="utf-8"))
    stated = [one for one in stated if (one["record"], one["structure"]) in pairs]
    chosen = [pairs[one["record"], one["structure"]] for one in stated]
    begun = time.process_time()
    found = searched(chosen)
    taken = time.process_time() - begun
    slivers = [one["slivers"] for one in stated]
    missed = [any(s[1] < f.lower for s in each) for f, each in zip(found, slivers, strict=True)]
    above = np.array([o["reported"] / f.lower for f, o in zip(found, stated, strict=True)]) - 1.0
    responses = [one.responses for one in found]
    print(
        f"slivers.json: {sum(len(each) > 0 for each in slivers)} of {len(stated)} pairs have "
        f"slivers; the lowest was missed in {sum(missed)}\n"
        f"  {np.mean(responses):.0f} responses a pair, at most {max(responses)}; "
        f"{1e3 * taken / len(chosen):.1f} ms of processor time a pair\n"
        f"  a scan of 0.5 % had reported a scale that is higher by more than 0.1, 1, 5 % in "
        f"{(above > 1e-3).sum()}, {(above > 1e-2).sum()}, {(above > 5e-2).sum()} pairs, at most "
        f"{above.max():.1%}"
    )


def robustness(pairs: Sequence[Pair]) -> None:
    """Print how far robust margins of two draws differ, and what a pair costs."""
    grounds = list({id(pair.ground): pair.ground for pair in pairs}.values())
    frames = list({id(pair.frame): pair.frame for pair in pairs}.values())
    begun = time.process_time()
    one, other = (
        [each for row in robust_margins(grounds, frames, Ensemble(seed=seed)) for each in row]
        for seed in (0, 1)
    )
    taken = 0.5 * (time.process_time() - begun)
    print(
        f"robust margins: {np.mean([each.responses for each in one]):.0f} responses a pair; "
        f"{1e3 * taken / len(pairs):.1f} ms of processor time a pair"
    )
    for name in ("s10", "s25", "s50"):
        both = np.array([[getattr(each, name) for each in draw] for draw in (one, other)])
        apart = np.exp(np.abs(np.diff(np.log(both), axis=0)[0])) - 1.0
        print(
            f"  {name} of two draws differs by more than 1.5 % in {(apart > 0.015).sum()} of "
            f"{len(pairs)} pairs, by more than 4 % in {(apart > 0.04).sum()}, at most "
            f"{np.nanmax(apart):.1%}"
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--brute", type=int, default=sized(6, 1), help="pairs of the 60 (default: 6)"
    )
    parser.add_argument("--random", type=int, default=0, help="pairs drawn at random (default: 0)")
    parser.add_argument("--seed", type=int, default=0, help="of these draws (default: 0)")
    parser.add_argument("--kind", choices=KINDS, default="records", help="what is drawn")
    parser.add_argument("--step", type=float, default=1e-4, help="of brute force (default: 1e-4)")
    parser.add_argument("--only-random", action="store_true", help="leave out the 60 pairs")
    options = parser.parse_args(arguments)
    records = shipped_records()
    frames = read_structures(SHIPPED_STRUCTURES)
    grounds = {n: as_ground(r) for n, r in records.items() if not n.endswith("UP")}
    pairs = {
        (name, frame.name): Pair(f"{name} {frame.name}", ground, frame)
        for name, ground in grounds.items()
        for frame in frames
    }
    every = list(pairs.values())[: sized(None, 1)]
    searched(every[:1])
    if not options.only_random:
        if sized(SHARED.is_dir(), False):
            against_slivers(pairs)
        robustness(every)
        print(f"against brute force, {options.brute} of these pairs:")
        chosen = every[:: max(1, len(every) // options.brute)][: options.brute]
        against_brute_force(chosen, options.step)
    if options.random:
        print(f"against brute force, {options.random} pairs drawn ({options.kind}):")
        chosen = drawn(options.random, options.seed, options.kind, records)
        against_brute_force(chosen, options.step)


if __name__ == "__main__":
    main()
