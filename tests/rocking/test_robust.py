"""Robust margins: independently counted shares of an ensemble, reproducibility, invalid input."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import Ensemble
from rockframe.rocking import (
    GroundAcceleration,
    Verdict,
    margins,
    respond_scenarios,
    robust_margins,
)
from rockframe.rocking.assessments import RobustMargin
from rockframe.rocking.margins.members import draws, members
from rockframe.rocking.margins.robust import FamilySearch
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

from .motions import BENT, SLENDER, STOCKY, noise

PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5)
ROUGH = GroundAcceleration.from_samples(noise(4, 1500, 0.6), 0.02)
SAME = Ensemble(height=0.0, width=0.0, impact_loss=1.0, amplitude=0.0)


def test_an_ensemble_of_one_structure_overturns_at_its_critical_scale() -> None:
    """At s50 half of the scales within 4 % overturn; at s10, 3.6 steps of 1 % lower, a tenth."""
    [[margin]] = margins([PULSE], [BENT])
    [[robust]] = robust_margins([PULSE], [BENT], SAME)
    assert_allclose(robust.s50, margin.critical_scale, rtol=0.006)
    assert_allclose(robust.s50 / robust.s10, 1.01**3.6, rtol=1e-9)
    assert_allclose(robust.s50 / robust.s25, 1.01**2.25, rtol=1e-9)
    assert (robust.error10, robust.error25, robust.error50) == (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Counted:
    """An ensemble on rough ground: its robust margin, and the members that overturn.

    `fallen` has shape (powers, members); the scales are the powers of 1.01 with these exponents.
    """

    robust: RobustMargin
    powers: NDArray[np.int64]
    fallen: NDArray[np.bool_]

    def scale(self, share: float, chosen: NDArray[np.int64]) -> float:
        """Return the scale at which a share of the chosen members overturns.

        Shares are averaged over nine steps of 1 %, the scale over nine shares within 0.03.
        """
        count = self.fallen[:, chosen].sum(axis=1)
        mean = np.convolve(count, np.ones(9, dtype=int), "valid") / (9 * chosen.size)
        places = []
        for level in share + np.linspace(-0.03, 0.03, 9):
            first = int(np.argmax(mean >= level))
            within = (level - mean[first - 1]) / (mean[first] - mean[first - 1])
            places.append(self.powers[4] + first - 1 + within)
        return float(1.01 ** np.mean(places))


@pytest.fixture(scope="module")
def counted() -> Counted:
    """The responses of each member, one by one.

    The scales are repeated products, because one unit in the last place can change a verdict.
    """
    ensemble = Ensemble(members=40, seed=3)
    [[robust]] = robust_margins([ROUGH], [SLENDER], ensemble)
    power = round(np.log(robust.s25) / np.log(1.01))
    powers = np.arange(power - 35, power + 35)
    family = members(ensemble, SLENDER)
    scale = (1.0 / np.cumprod(np.full(-powers.min(), 1.01))[-powers - 1])[:, None]
    scale = scale * draws(ensemble)[:, 3]
    frame = np.tile(np.arange(len(family)), powers.size)
    scenarios = respond_scenarios([ROUGH], family, 0 * frame, frame, scale.ravel())
    return Counted(robust, powers, (scenarios.verdict == Verdict.OVERTURNS).reshape(scale.shape))


def test_shares_are_those_of_the_members(counted: Counted) -> None:
    robust = counted.robust
    for scale, share in ((robust.s10, 0.10), (robust.s25, 0.25), (robust.s50, 0.50)):
        assert_allclose(scale, counted.scale(share, np.arange(40)), rtol=1e-9)


def test_errors_are_those_of_members_drawn_again(counted: Counted) -> None:
    """The central 68 % of 600 other draws; of 100 draws, such a width is uncertain by 10 %."""
    rng, robust = np.random.default_rng(8), counted.robust
    ratios = []
    for error, share in ((robust.error10, 0.10), (robust.error25, 0.25), (robust.error50, 0.50)):
        again = [counted.scale(share, rng.integers(0, 40, 40)) for _ in range(600)]
        low, high = np.quantile(np.log(again), (0.16, 0.84))
        ratios.append(np.log1p(error) / (0.5 * (high - low)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


def test_errors_are_standard_errors() -> None:
    """One of 100 members falls at each scale, so a scale is a quantile of a uniform distribution.

    The mean of the 81 places that it averages has the variance of that of a Brownian bridge. Of 100
    draws, the 16 % quantile is the 16.84th of 101 intervals.
    """
    falls = np.arange(100)[:, None] >= np.arange(100)
    drawn = [FamilySearch(np.ones(100), 0.1, 10.0, seed)._margin(0, falls) for seed in range(40)]  # noqa: SLF001
    ratios = []
    for share, name in ((0.10, "error10"), (0.25, "error25"), (0.50, "error50")):
        error = np.log1p([getattr(margin, name) for margin in drawn]).mean() / math.log(1.01)
        u = np.add.outer(share + np.linspace(-0.03, 0.03, 9), 0.01 * np.arange(-4, 5)).ravel()
        deviation = math.sqrt((np.minimum.outer(u, u) - np.outer(u, u)).mean() / 100)
        ratios.append(error / (100 * deviation * -NormalDist().inv_cdf(16.84 / 101)))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)


def test_another_draw_agrees_within_the_errors() -> None:
    first, other = (robust_margins([ROUGH], [SLENDER], Ensemble(seed=k))[0][0] for k in (1, 2))
    assert first != other
    for name in ("10", "25", "50"):
        apart = abs(np.log(getattr(first, f"s{name}") / getattr(other, f"s{name}")))
        errors = np.hypot(getattr(first, f"error{name}"), getattr(other, f"error{name}"))
        assert apart < 3.0 * errors + 0.002


def test_the_same_whatever_is_beside() -> None:
    few = Ensemble(members=16)
    together = robust_margins([PULSE, ROUGH], [BENT, SLENDER], few)
    assert robust_margins([ROUGH], [SLENDER], few) == [[together[1][1]]]


def test_nothing_overturns() -> None:
    still = Pulse(wavelet="symmetric_ricker", a_p=0.0, T_p=1.5)
    for pulse in (still, Pulse(wavelet="symmetric_ricker", a_p=0.01, T_p=1.5)):
        [[robust]] = robust_margins([pulse], [BENT])
        assert np.isnan([robust.s10, robust.s25, robust.s50, robust.error25]).all()


def test_a_vertical_acceleration_ends_the_search() -> None:
    """Near 2.5 times this motion the strongest member's ground would fall faster than gravity."""
    upwards = GroundAcceleration.from_samples(np.full(1500, -0.4 * GRAVITY), 0.02)
    [[robust]] = robust_margins([ROUGH.scaled(0.05).with_vertical(upwards)], [STOCKY])
    assert np.isnan(robust.s50)


def test_draws_are_within_their_spreads_and_stratified() -> None:
    drawn = draws(Ensemble(members=100, height=0.1, width=0.2, impact_loss=3.0, amplitude=0.4))
    assert_allclose(drawn.min(axis=0), [0.9, 0.8, 1.0 / 3.0, 0.6], rtol=0, atol=0.009)
    assert_allclose(drawn.max(axis=0), [1.1, 1.2, 3.0, 1.4], rtol=0, atol=0.07)
    strata = np.sort(np.floor(50.0 * (1.0 + np.log(drawn[:, 2]) / math.log(3.0))).astype(int))
    assert_array_equal(strata, np.arange(100))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"height": -0.01}, r"height -0\.01\. Must be zero or positive\."),
        ({"impact_loss": 0.9}, r"impact_loss 0\.9\. Must be at least 1\."),
        ({"impact_loss": 11.0}, r"impact_loss 11\.0\. Must be at most 10\."),
        ({"amplitude": float("nan")}, r"amplitude nan\. Must be below 1\."),
        ({"seed": -1}, r"seed -1\. Must be zero or positive\."),
    ],
)
def test_refused_ensembles(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Ensemble(**values)


def test_spreads_that_leave_no_rocking_frame() -> None:
    stocky = RockingFrame(height=1.0, width=1.35, name="stocky")
    words = r"Invalid spread width 0\.2 of the ensemble of frame 'stocky': .* Must"
    with pytest.raises(ParameterError, match=words):
        robust_margins([PULSE], [stocky], Ensemble(width=0.2, impact_loss=1.0))
