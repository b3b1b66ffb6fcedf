"""Rank correlations of spreads: known values, and those of scipy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import stats

from rockframe import Ensemble, Pulse, RockingFrame
from rockframe.rocking import (
    Versions,
    as_ground,
    corner_factors,
    correlation_by_chance,
    ensemble_responses,
    rank_correlations,
    spreads_of,
    turned_degrees,
)
from rockframe.rocking.margins.members import draws, ranks
from rockframe.units import GRAVITY

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
WEAK = Pulse(wavelet="symmetric_ricker", a_p=0.35 * GRAVITY, T_p=1.0)
#: All spreads are switched off.
OFF: dict[str, Any] = {
    **dict.fromkeys(("height", "width", "amplitude", "orientation_degree"), 0.0),
    **dict.fromkeys(("impact_loss", "corner"), 1.0),
}


@pytest.mark.parametrize(
    ("name", "spread", "expected"),
    [("amplitude", 0.01, 1.0), ("width", 0.01, -1.0), ("height", 0.01, 1.0)],
)
def test_a_spread_alone_decides_the_ranks(name: str, spread: float, expected: float) -> None:
    """Under a weak pulse, a stronger motion turns the frame further, and a slender one as well."""
    chosen = Ensemble(**{**OFF, name: spread})
    [[ensemble]] = ensemble_responses([WEAK], [BENT], chosen)
    assert ensemble.rank_correlations == {name: pytest.approx(expected, abs=0.02)}


def test_without_spreads_there_are_no_correlations() -> None:
    chosen = Ensemble(**OFF)
    assert spreads_of(chosen) == ()
    assert ensemble_responses([WEAK], [BENT], chosen)[0][0].rank_correlations == {}


def test_members_with_equal_peaks_have_no_correlation() -> None:
    for a_p in (0.01, 100.0):  # no member uplifts, and all overturn
        pulse = Pulse(wavelet="symmetric_ricker", a_p=a_p, T_p=1.5)
        [[ensemble]] = ensemble_responses([pulse], [BENT])
        assert set(ensemble.rank_correlations) == {*spreads_of(Ensemble())}
        assert all(math.isnan(correlation) for correlation in ensemble.rank_correlations.values())


@pytest.mark.parametrize("fallen", [0, 20])
def test_correlations_are_those_of_scipy(fallen: int) -> None:
    """Members that overturn share the largest ranks."""
    chosen = Ensemble(orientation_degree=3.0, seed=4)
    peaks = np.random.default_rng(2).standard_normal(64) + corner_factors(chosen)
    peaks[np.argsort(-peaks)[:fallen]] = np.inf
    ground = as_ground(WEAK)
    versions = Versions((ground,), np.zeros(64, dtype=int), ("corner", "orientation_degree"))
    drawn = (*draws(chosen).T, corner_factors(chosen), turned_degrees(chosen))
    finite = np.where(np.isinf(peaks), 1e9, peaks)
    correlations = rank_correlations(peaks, chosen, versions)
    assert [*correlations] == [*spreads_of(chosen)]
    expected = [stats.spearmanr(numbers, finite).statistic for numbers in drawn]
    assert_allclose([*correlations.values()], expected, rtol=1e-12)
    assert_allclose(ranks(peaks), stats.rankdata(finite))
    assert correlations["corner"] > correlation_by_chance(64)


def test_spreads_in_which_the_motion_is_not_varied_are_unknown() -> None:
    chosen = Ensemble(orientation_degree=3.0)
    peaks = np.arange(64.0)
    ground = as_ground(WEAK)
    only = Versions((ground,), np.zeros(64, dtype=int), ("orientation_degree",))
    for versions, unknown in ((None, {"corner", "orientation_degree"}), (only, {"corner"})):
        correlations = rank_correlations(peaks, chosen, versions)
        assert {name for name, value in correlations.items() if math.isnan(value)} == unknown


@pytest.mark.parametrize("members", [16, 17, 64, 1000])
def test_the_correlation_by_chance_is_that_of_students_t(members: int) -> None:
    t = stats.t(members - 2).ppf(0.975)
    expected = t / math.sqrt(members - 2 + t**2)
    assert_allclose(correlation_by_chance(members), expected, rtol=1e-12)


@pytest.mark.parametrize("members", [16, 64])
def test_one_in_twenty_independent_spreads_is_beyond_chance(members: int) -> None:
    rng = np.random.default_rng(5)
    drawn = np.argsort(rng.random((20_000, members)), axis=1)
    order = np.arange(members) - 0.5 * (members - 1)  # permutations of it have the same variance
    correlations = drawn @ order / (order @ order)
    beyond = (np.abs(correlations) > correlation_by_chance(members)).mean()
    assert beyond == pytest.approx(0.05, abs=0.005)
