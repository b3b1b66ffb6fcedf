"""Fragility of shares of an ensemble: the fit is that of its members as single observations."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from tests.conftest import examples

from rockframe.errors import ParameterError
from rockframe.risk import Fragility, HazardCurve, Outcome, fit_fragility, overturning_rate
from rockframe.risk.fragility import Curve

Float = NDArray[np.float64]
SCALES = np.geomspace(0.5, 4.0, 7)
MEMBERS = 5
#: Numbers of a fit that do not depend on how often each observation is counted.
WEIGHTED = (
    "intercept",
    "slope",
    "covariance",
    "pseudo_r2",
    "concordance",
    "brier",
    "stood",
    "fell",
)


def members(motions: int, seed: int) -> tuple[Float, NDArray[np.bool_]]:
    """Return intensities and outcomes of members, shape (motions, scales, members)."""
    rng = np.random.default_rng(seed)
    intensity = rng.lognormal(0.0, 0.5, motions)
    capacity = rng.lognormal(np.log(2.0), 0.2, (motions, 1, MEMBERS))
    capacity = capacity * rng.lognormal(0.0, 0.4, (motions, 1, 1))
    return intensity, intensity[:, None, None] * SCALES[:, None] > capacity


def one_by_one(intensity: Float, fell: NDArray[np.bool_], **how: Curve) -> Fragility:
    """Return the fit of all members as observations of their motion."""
    scales = SCALES.repeat(fell.shape[2])
    return fit_fragility(intensity, scales, fell.reshape(len(fell), -1), **how)


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
def test_the_fit_is_that_of_the_members(curve: Curve) -> None:
    intensity, fell = members(30, 1)
    fit = fit_fragility(intensity, SCALES, fell.mean(axis=2), curve=curve)
    expected = one_by_one(intensity, fell, curve=curve)
    for name in WEIGHTED:
        value, other = getattr(fit, name), getattr(expected, name)
        assert_allclose(value, other, rtol=1e-8, err_msg=name)
    assert_allclose(MEMBERS * fit.log_likelihood, expected.log_likelihood, rtol=1e-9)
    assert (fit.safe_to, fit.overturned_from) == (expected.safe_to, expected.overturned_from)
    assert fit.observations == 30 * SCALES.size
    assert fit.overturned == fell.any(axis=2).sum()


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
def test_shares_of_zero_and_one_are_outcomes(curve: Curve) -> None:
    intensity, fell = members(30, 2)
    fits = [
        fit_fragility(intensity, SCALES, outcomes, curve=curve)
        for outcomes in (fell[..., 0], fell[..., 0].astype(np.float64))
    ]
    for field in fields(Fragility):
        assert np.array_equal(*(getattr(fit, field.name) for fit in fits)), field.name


@examples(60)
@given(st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=1, max_size=5))
def test_an_outcome_without_a_curve_is_that_of_the_members(shares: list[float]) -> None:
    intensity = np.arange(1.0, len(shares) + 1.0)
    share = np.array(shares)[:, None]
    fit = fit_fragility(intensity, [1.0], share)
    pairs = fit_fragility(intensity, [1.0, 1.0], np.hstack([share > 0.25, share > 0.75]))
    assert fit.outcome is pairs.outcome
    x = np.array([0.5, 1.5, 9.0])
    if fit.outcome is not Outcome.FITTED:
        # both fits end where a step no longer raises the likelihood, not at the same last digits
        assert_allclose(np.array(fit.band(x)), np.array(pairs.band(x)), rtol=1e-6, atol=1e-12)


def test_more_members_do_not_narrow_the_bands() -> None:
    intensity, fell = members(30, 3)
    once = fit_fragility(intensity, SCALES, fell.mean(axis=2))
    often = fit_fragility(intensity, SCALES, fell.repeat(20, axis=2).mean(axis=2))
    assert_allclose(often.covariance, once.covariance)
    assert once.motions == often.motions == 30


def test_the_rate_lies_between_those_of_the_least_and_the_largest_member() -> None:
    """If every member overturns from a known factor on, the members' rates enclose the rate."""
    intensity, fell = members(30, 4)
    ordered = np.sort(fell, axis=2)  # False first: the first overturns only if all do
    curve = HazardCurve("pga", np.array([0.05, 0.5, 5.0]), np.array([1e-1, 1e-2, 1e-4]))
    rates = [
        overturning_rate(curve, fit_fragility(intensity, SCALES, outcomes)).rate
        for outcomes in (ordered[..., 0], fell.mean(axis=2), ordered[..., -1])
    ]
    assert rates[0] < rates[1] < rates[2]


@pytest.mark.parametrize("share", [-0.1, 1.5, np.nan])
def test_a_share_lies_between_0_and_1(share: float) -> None:
    with pytest.raises(ParameterError, match=r"Invalid share .* Must be 0 to 1"):
        fit_fragility([1.0, 2.0], [1.0], [[0.0], [share]])
