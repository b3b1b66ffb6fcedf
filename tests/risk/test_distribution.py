"""Distributions of peaks and ranks of motions."""

from __future__ import annotations

import math
import tracemalloc
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import rankdata
from tests.conftest import examples

from rockframe.risk import (
    demand_ranks,
    distribution,
    mean_share,
    mean_shares,
    observed_shares,
    peak_distribution,
    wilson,
)
from rockframe.risk.distribution import _kept_draws, _tails, over_azimuths


def test_share_is_that_of_the_motions() -> None:
    band = peak_distribution([0.1, 0.3, 0.3, math.inf], [0.1, 0.2, 0.3, 9.0])
    assert band.share.tolist() == [0.25, 0.25, 0.75, 0.75]


def test_ends_of_bands_are_the_quantiles_of_numpy_to_the_last_bit() -> None:
    """Ties and an odd number of draws included."""
    chance, tail = np.random.default_rng(2), 0.5 * (1.0 - 0.9)
    for drawn in (chance.random((1000, 7)), chance.integers(0, 5, (1000, 7)) / 3.0):
        for some in (drawn, drawn[:37], drawn[:2]):
            assert_array_equal(_tails(some), np.quantile(some, (tail, 1.0 - tail), axis=0))


def test_seed_decides_the_draws() -> None:
    peaks = np.random.default_rng(0).random(30)
    levels = np.linspace(0.0, 1.0, 11)
    first, again, other = (peak_distribution(peaks, levels, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(first.low, again.low)
    assert not np.array_equal(first.low, other.low)


def test_samples_in_blocks_are_the_same_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each draw follows from the one before it, whatever number of them is in memory: here 16 of
    the 1000, each of 1000 numbers of 8 bytes. Draws are kept for the next structures as one byte.
    """
    shares = np.linspace(0.0, 1.0, 1000)[:, None]
    together = mean_share(shares)
    monkeypatch.setattr("rockframe.risk.distribution._DRAWN", 16 * len(shares))
    _kept_draws.cache_clear()
    tracemalloc.start()
    apart, again = mean_share(shares), mean_share(shares)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    _kept_draws.cache_clear()
    assert peak < 2e6
    assert np.array_equal(apart.low, again.low)
    for name in ("share", "low", "high"):
        assert_allclose(getattr(apart, name), getattr(together, name), rtol=1e-13)


def test_many_motions_narrow_the_band_as_binomial_theory_says() -> None:
    """With half of n motions below the level, the band is 0.5 +- 1.645 sqrt(0.25 / n)."""
    n = 2000
    band = peak_distribution(np.arange(n) / n, [0.4999999])
    half = 1.645 * math.sqrt(0.25 / n)
    assert_allclose([band.low[0], band.high[0]], [0.5 - half, 0.5 + half], atol=0.1 * half)


def test_azimuths_of_one_record_are_not_many_records() -> None:
    peaks = np.repeat([0.1, 0.9], 50)
    alone = peak_distribution(peaks, [0.5])
    together = peak_distribution(peaks, [0.5], clusters=np.repeat([0, 1], 50))
    assert together.high[0] - together.low[0] > 3.0 * (alone.high[0] - alone.low[0])


@pytest.mark.parametrize("count", [1, 10, 1000])
def test_wilson_solves_its_equation(count: int) -> None:
    """The share p is 1.645 standard errors of q away from each bound q."""
    share = np.array([0.0, 0.2, 1.0])
    for bound in wilson(share, count):
        inside = (bound > 1e-12) & (bound < 1.0 - 1e-12)  # others are clipped to 0 or 1
        away = np.abs(share - bound)[inside]
        error = np.sqrt(bound * (1.0 - bound) / count)[inside]
        assert_allclose(away, 1.6448536 * error, rtol=1e-6)


@examples(30)
@given(st.lists(st.sampled_from([0.0, 0.1, 0.5, 2.0, math.inf]), min_size=1, max_size=9))
def test_ranks_are_those_of_scipy(peaks: list[float]) -> None:
    assert_allclose(demand_ranks(np.array(peaks)[:, None])[:, 0], rankdata(-np.array(peaks)))


def test_members_are_pooled_but_do_not_narrow_the_band() -> None:
    """Four equal members say as much as one; a motion counts with the share of its members."""
    peaks = np.random.default_rng(2).random(20)
    levels = [0.2, 0.5, 0.9]
    first, four = (peak_distribution(peaks[:, None].repeat(k, axis=1), levels) for k in (1, 4))
    for name in ("share", "low", "high"):
        assert np.array_equal(getattr(first, name), getattr(four, name))
    band = peak_distribution([[0.1, 0.3], [0.3, math.inf]], [0.2, 0.4])
    assert band.share.tolist() == [0.25, 0.75]


def test_a_motion_that_occurs_ten_times_as_one_cluster_does_not_narrow_the_band() -> None:
    shares = np.random.default_rng(3).random((6, 2))
    once = mean_share(shares)
    often = mean_share(shares.repeat(10, axis=0), clusters=np.arange(6).repeat(10))
    assert_allclose([often.low, often.high], [once.low, once.high])
    single = mean_share(shares.repeat(10, axis=0))
    assert (single.high - single.low < 0.5 * (once.high - once.low)).all()


def test_the_band_of_the_opposite_is_the_opposite_band() -> None:
    """The bootstrap decides both ends of the band where clusters have very unequal sizes."""
    clusters = np.arange(12).repeat([30, *[1] * 11])
    fell = (clusters % 2 == 0)[:, None]
    band, opposite = (mean_share(outcomes, clusters=clusters) for outcomes in (fell, ~fell))
    least, most = wilson(band.share, 12)
    assert band.low[0] < least[0] - 0.05
    assert opposite.low[0] < 1.0 - most[0]
    assert_allclose([band.low, band.high], [1.0 - opposite.high, 1.0 - opposite.low])


def test_shares_of_zero_and_one_are_outcomes() -> None:
    fell = np.random.default_rng(4).random((30, 3)) < 0.4
    intensity, scales = np.linspace(1.0, 2.0, 30), [1.0, 1.5, 2.0]
    centre, share = observed_shares(intensity, scales, fell, 5)
    again = observed_shares(intensity, scales, fell.astype(float), 5)
    assert np.array_equal((centre, share), again)


@examples(30)
@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=1, max_size=9))
def test_shares_rank_before_peaks(pairs: list[tuple[int, int]]) -> None:
    shares, peaks = np.array(pairs, dtype=float).T
    ranks = demand_ranks(peaks[:, None], shares[:, None] / 2.0)[:, 0]
    assert_allclose(ranks, rankdata(-(10.0 * shares + peaks)))


@pytest.mark.parametrize("together", [1, 4, 7, 1024])
def test_structures_that_share_draws_have_the_bands_that_each_has_alone(
    monkeypatch: pytest.MonkeyPatch, together: int
) -> None:
    """Shares of 64 members are summed without rounding, in whatever groups."""
    monkeypatch.setattr(distribution, "_COLUMNS", together)
    shares = np.random.default_rng(3).integers(0, 65, (5, 20, 3)) / 64.0
    clusters = np.arange(20) // 2
    bands = mean_shares(shares, clusters=clusters, seed=7)
    for share, band in zip(shares, bands, strict=True):
        alone = mean_share(share, clusters=clusters, seed=7)
        for name in ("share", "low", "high"):
            assert_array_equal(getattr(band, name), getattr(alone, name))


def test_percentiles_over_azimuths_are_the_least_the_middle_and_the_largest() -> None:
    """They are RotD00, RotD50 and RotD100; of four azimuths, the third is the middle."""
    percentiles = over_azimuths([[0.4], [0.1], [np.inf], [0.2]], [7, 7, 7, 7])
    assert percentiles.ravel().tolist() == [0.1, 0.4, math.inf]


def test_round_off_does_not_shift_the_rank_of_a_percentile() -> None:
    """The rank is the next above q (n - 1) / 100: of 181 azimuths, the 55th percentile is at 99."""
    percents = range(101)
    for azimuths in range(1, 182):
        peaks = np.arange(float(azimuths))[:, None]
        percentiles = over_azimuths(peaks, np.zeros(azimuths, dtype=int), percents)
        exact = [math.ceil(Fraction(percent * (azimuths - 1), 100)) for percent in percents]
        assert percentiles.ravel().tolist() == exact
