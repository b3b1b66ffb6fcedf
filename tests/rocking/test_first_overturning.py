"""The search for the first overturning, of structures of which the outcomes are known."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe.rocking.assessments import FirstOverturning
from rockframe.rocking.kernels.tails import EXCURSION_SIZE
from rockframe.rocking.margins.first_overturning import (
    KEPT,
    SliverSearch,
    advance,
    powers,
)

LEAST, LARGEST = 0.2, 10.0
Intervals = Sequence[tuple[float, float]]


def outcomes(intervals: Intervals, scales: np.ndarray) -> np.ndarray:
    """Return which scales overturn: those within one of some intervals."""
    within = [(low <= scales) & (scales <= high) for low, high in intervals]
    return np.asarray(np.any(within, axis=0))


def found(intervals: Intervals, largest: float = LARGEST) -> FirstOverturning:
    """Return the result of the search; no excursion hints at a sliver."""
    search = SliverSearch(LEAST, largest, 2.0).search()
    wanted: dict[int, np.ndarray] = {}
    results: dict[int, FirstOverturning] = {}
    advance(search, None, 0, wanted, results)
    asked = 0
    while wanted:
        scales = wanted[0]
        asked += scales.size
        none = np.full((scales.size, KEPT, EXCURSION_SIZE), -np.inf)
        answer = outcomes(intervals, scales), scales / intervals[0][0], none
        advance(search, answer, 0, wanted, results)
    assert results[0].responses == asked
    return results[0]


def drawn(seed: int) -> list[tuple[float, float]]:
    """Return intervals of overturning at least 10 % long, and as far apart."""
    random = np.random.default_rng(seed)
    ends = 0.6 * np.exp(np.cumsum(random.uniform(0.1, 0.7, 16)))
    ends = np.append(ends[ends < 0.9 * LARGEST], LARGEST)
    return [*zip(ends[0::2].tolist(), ends[1::2].tolist(), strict=False)]


@pytest.mark.parametrize("seed", range(12))
def test_the_summary_is_that_of_all_scales(seed: int) -> None:
    """It is compared with 100,000 scales; the search computes few, 2.56 % apart."""
    intervals = drawn(seed)
    low, high = intervals[0]
    overturning = found(intervals)
    assert low <= overturning.lower <= low * (1.0 + 2e-6)
    assert high - 0.02 * (high - low) <= overturning.upper <= high
    scales = np.geomspace(low, LARGEST, 100_001)[:-1]
    falls = outcomes(intervals, scales)
    assert overturning.standing_share == pytest.approx(1.0 - falls.mean(), abs=0.02)
    balance = np.cumsum(np.where(falls, 1.0, -1.0))
    least_after = np.minimum.accumulate(balance[::-1])[::-1]
    before = np.append(0.0, balance[:-1])
    prevails = int(np.argmax(least_after > before)) if (least_after > before).any() else None
    if prevails is None:
        assert math.isnan(overturning.prevails_from)
    else:
        assert overturning.prevails_from == pytest.approx(scales[prevails], rel=0.03)
    share = falls[:prevails].mean() if prevails != 0 else math.nan
    assert_allclose(overturning.share_before, share, atol=0.05)
    assert math.isnan(share) or (32.0 * overturning.share_before).is_integer()  # of 32 scales
    ends = [end for pair in intervals for end in pair][1:]
    ends = ends[:-1] if ends[-1] == LARGEST else [*ends, LARGEST]
    assert_allclose(np.ravel(overturning.islands), ends, rtol=0.014)
    assert overturning.islands[:1] == () or overturning.islands[0][0] == overturning.upper


def test_what_overturns_up_to_the_largest_scale_has_no_island() -> None:
    overturning = found([(1.0, LARGEST)])
    assert (overturning.upper, overturning.islands, overturning.standing_share) == (
        LARGEST,
        (),
        0.0,
    )
    assert overturning.prevails_from == overturning.lower
    assert math.isnan(overturning.share_before)


@pytest.mark.parametrize("end", [0.515, 0.519, 0.522])
def test_an_island_close_to_the_first_interval_is_located_more_closely(end: float) -> None:
    """There the scales that were sampled to find the first interval are 0.64 % apart."""
    overturning = found([(0.5, 0.505), (end, LARGEST)])
    assert overturning.islands[0][1] == pytest.approx(end, rel=0.0035)


def test_an_overturning_at_the_largest_scale_alone_leaves_no_scale_to_stand() -> None:
    """The largest scale is a multiple of the coarse step above the least, so that it is sampled."""
    largest = LEAST * math.exp(64e-4 * 300)
    overturning = found([(largest * (1.0 - 1e-8), largest)], largest)
    assert (
        overturning.lower,
        overturning.upper,
        overturning.standing_share,
        overturning.islands,
    ) == (largest, largest, 0.0, ())


def test_what_never_overturns_has_no_interval() -> None:
    overturning = found([(11.0, 12.0)])
    assert math.isnan(overturning.lower)
    assert math.isnan(overturning.standing_share)


@pytest.mark.parametrize("first", [0.21, 0.5, 1.0, 9.9])
def test_the_first_edge_is_found_wherever_it_is(first: float) -> None:
    overturning = found([(first, LARGEST)])
    assert first <= overturning.lower <= first * (1.0 + 2e-6)


def test_powers_are_repeated_products() -> None:
    exponents = np.array([0, 1, 2, 7, 8, 1000])
    assert_allclose(powers(1.001, exponents), 1.001**exponents, rtol=1e-12)
    assert powers(1.001, exponents[:3]).tolist() == [1.0, 1.001, 1.001 * 1.001]
