"""Fragility: the maximum of the likelihood, cases without one, and confidence bands."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import stdtrit
from scipy.stats import bernoulli, logistic, norm
from tests.conftest import examples

from rockframe.errors import ParameterError
from rockframe.quantities import LIMITED, QUANTITIES
from rockframe.risk import Outcome, better_measure, compared_motions, fit_fragility
from rockframe.risk.fitting import _of_block
from rockframe.risk.fragility import Curve, LimitState

Float = NDArray[np.float64]
SCALES = np.geomspace(0.5, 4.0, 7)


def site(motions: int, seed: int, slope: float = 3.0) -> tuple[Float, NDArray[np.bool_]]:
    """Return intensities, and verdicts drawn from a logistic curve of median 2."""
    rng = np.random.default_rng(seed)
    intensity = rng.lognormal(0.0, 0.5, motions)
    logit = slope * (np.log(intensity)[:, None] + np.log(SCALES) - math.log(2.0))
    return intensity, rng.random(logit.shape) < 1.0 / (1.0 + np.exp(-logit))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
def test_maximum_agrees_with_a_general_optimiser(curve: Curve, seed: int) -> None:
    """The simplex method of Nelder and Mead finds the same maximum with scipy's distributions."""
    intensity, fell = site(40, seed)
    x = np.log(intensity)[:, None] + np.log(SCALES)
    distribution = norm if curve == "lognormal" else logistic

    def against(at: Float) -> float:
        argument = (x - at[0]) / math.exp(at[1])
        return -float(distribution.logcdf(np.where(fell, argument, -argument)).sum())

    optimum = minimize(against, [0.0, 0.0], method="Nelder-Mead", tol=1e-12)
    fit = fit_fragility(intensity, SCALES, fell, curve=curve)
    assert_allclose(fit.median, math.exp(optimum.x[0]), rtol=1e-5)
    assert_allclose(1.0 / fit.slope, math.exp(optimum.x[1]), rtol=1e-5)
    assert_allclose(fit.lognormal_beta, distribution.std() / fit.slope, rtol=1e-12)
    assert_allclose(fit.log_likelihood.sum(), -optimum.fun, rtol=1e-12)
    assert_allclose(fit.probability(fit.median), 0.5, rtol=1e-12)


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
@pytest.mark.parametrize("slope", [0.3, 3.0, 12.0])
def test_scores_of_the_fit_sum_to_zero(curve: Curve, slope: float) -> None:
    """The derivatives of scipy's log-likelihood by both coefficients vanish at its maximum."""
    intensity, fell = site(60, 8, slope)
    x, distribution = (
        np.log(intensity)[:, None] + np.log(SCALES),
        norm if curve == "lognormal" else logistic,
    )
    fit = fit_fragility(intensity, SCALES, fell, curve=curve)
    signed = np.where(fell, 1.0, -1.0) * (fit.intercept + fit.slope * x)
    steepness = np.exp(distribution.logpdf(signed) - distribution.logcdf(signed))
    score = np.where(fell, steepness, -steepness)
    assert abs(score.sum()) < 3e-14 * steepness.sum()
    assert abs((score * x).sum()) < 3e-14 * (steepness * abs(x)).sum()


def test_slope_and_curvature_are_exact_far_out_in_the_tail() -> None:
    """The density over the distribution is -s - 1 / s + 2 / s^3 there, its slope -1 + 1 / s^2."""
    s = -np.geomspace(1e3, 1e6, 4)
    _, slope, curvature = _of_block(s, s < 0.0, np.array([0.0, 1.0]), "lognormal")
    assert_allclose(slope, -s - 1.0 / s + 2.0 / s**3, rtol=1e-14)
    assert_allclose(curvature[0], 1.0 - 1.0 / s[0] ** 2, rtol=1e-9)


def test_an_outlier_far_from_the_others_is_in_the_tail_of_the_curve() -> None:
    """Its probability is 1e-40 or less, where the logarithm of the distribution cancels."""
    intensity, fell = site(200, 9, 8.0)
    far, stands = np.append(intensity, [1e-9, 1e9]), np.vstack([fell, SCALES < 0.0, SCALES > 0.0])
    with_far, alone = fit_fragility(far, SCALES, stands), fit_fragility(intensity, SCALES, fell)
    assert_allclose(with_far.median, alone.median, rtol=1e-10)
    assert_allclose(with_far.slope, alone.slope, rtol=1e-10)
    reversed_far = np.vstack([fell, SCALES > 0.0, SCALES < 0.0])
    assert fit_fragility(far, SCALES, reversed_far).slope < 0.1 * alone.slope


def test_measures_of_the_fit_follow_their_definitions() -> None:
    """McFadden's R2 compares with one probability for all. Pairs of equal intensity count half."""
    rng, scales = np.random.default_rng(5), np.array([0.5, 1.0, 2.0])
    intensity = rng.choice([1.0, 2.0], 40)
    scaled = np.outer(intensity, scales)
    fell = rng.random(scaled.shape) < 0.3 * scaled / scaled.max()
    fit = fit_fragility(intensity, scales, fell)
    alone = bernoulli(fell.mean()).logpmf(fell).sum()
    assert_allclose(fit.pseudo_r2, 1.0 - fit.log_likelihood.sum() / alone, rtol=1e-12)
    order = np.sign(np.subtract.outer(scaled[fell], scaled[~fell]))
    assert_allclose(fit.concordance, (0.5 + 0.5 * order).mean(), rtol=1e-12)
    assert_allclose(fit.brier, ((fit.probability(scaled) - fell) ** 2).mean(), rtol=1e-12)


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
@pytest.mark.parametrize(("motions", "seed", "near"), [(100, 7, 0.06), (20, 3, 0.2)])
def test_covariance_is_that_of_leaving_one_motion_out(
    curve: Curve, motions: int, seed: int, near: float
) -> None:
    """The jackknife fits the others again, and does not stop after Newton's first step."""
    intensity, fell = site(motions, seed)
    fit = fit_fragility(intensity, SCALES, fell, curve=curve)
    without = []
    for k in range(motions):
        left = np.delete(np.arange(motions), k)
        reduced = fit_fragility(intensity[left], SCALES, fell[left], curve=curve)
        without.append([reduced.intercept - fit.intercept, reduced.slope - fit.slope])
    jackknife = (1.0 - 1.0 / motions) * np.square(without).sum(axis=0)
    assert_allclose(np.diag(fit.covariance), jackknife, rtol=near)


def test_a_lognormal_fragility_is_recovered() -> None:
    """With 20,000 motions the standard errors of median and beta are about 1 %."""
    rng = np.random.default_rng(3)
    intensity = rng.uniform(0.3, 6.0, 20_000)
    fell = np.log(intensity) > math.log(2.0) + 0.4 * rng.normal(size=intensity.size)
    fit = fit_fragility(intensity, [1.0], fell[:, None])
    assert_allclose(fit.median, 2.0, rtol=0.03)
    assert_allclose(fit.lognormal_beta, 0.4, rtol=0.03)
    assert_allclose(fit.lognormal_beta / fit.logistic_scale, 1.8138, rtol=1e-4)


def test_a_curve_that_is_none() -> None:
    with pytest.raises(ParameterError, match=r"curve 'weibull'\. Must be lognormal or logistic"):
        fit_fragility([1.0, 2.0], [0, 1], curve="weibull")  # type: ignore[arg-type]


def test_truth_lies_within_the_band_as_often_as_it_says() -> None:
    """At the median, 80 to 97 of 100 bands of 90 % contain the true probability."""
    held = 0
    for seed in range(100):
        low, high = fit_fragility(*_ordered(*site(60, seed))).band(2.0)
        held += bool(low <= 0.5 <= high)
    assert 80 <= held <= 97


def _ordered(intensity: Float, fell: NDArray[np.bool_]) -> tuple[Float, Float, NDArray[np.bool_]]:
    return intensity, SCALES, fell


@pytest.mark.parametrize("unknown", [0.0, math.nan])
def test_motions_of_unknown_intensity_are_left_out(unknown: float) -> None:
    """A measure of a record is 0 where it could not be computed or where there is nothing."""
    intensity, fell = site(20, 3)
    fit = fit_fragility(intensity, SCALES, fell)
    more = np.append(intensity, unknown), SCALES, np.vstack([fell, fell[:1]])
    assert fit_fragility(*more).median == fit.median
    assert fit_fragility(*more).observations == fit.observations


def test_scales_repeated_are_no_more_evidence() -> None:
    """The covariance depends on the motions, not on how often each verdict is repeated."""
    intensity, fell = site(40, 1)
    once = fit_fragility(intensity, SCALES, fell)
    often = fit_fragility(intensity, np.repeat(SCALES, 5), np.repeat(fell, 5, axis=1))
    assert_allclose(often.slope, once.slope, rtol=1e-9)
    assert_allclose(often.covariance, once.covariance, rtol=1e-6)


def test_motions_of_one_cluster_are_one() -> None:
    intensity, fell = site(20, 1)
    twice = fit_fragility(
        np.repeat(intensity, 2), SCALES, np.repeat(fell, 2, axis=0), np.repeat(np.arange(20), 2)
    )
    once = fit_fragility(intensity, SCALES, fell)
    assert twice.motions == 20
    assert_allclose(twice.covariance, once.covariance, rtol=1e-6)


@examples(40)
@given(unit=st.floats(1e-3, 1e3), seed=st.integers(0, 5))
def test_unit_moves_the_median_alone(unit: float, seed: int) -> None:
    intensity, fell = site(30, seed)
    first, other = (fit_fragility(intensity * u, SCALES, fell) for u in (1.0, unit))
    assert_allclose(other.median, first.median * unit, rtol=1e-7)
    assert_allclose(other.slope, first.slope, rtol=1e-7)
    assert_allclose(other.concordance, first.concordance, rtol=1e-12)


@examples(60)
@given(
    verdicts=st.lists(st.lists(st.booleans(), min_size=3, max_size=3), min_size=1, max_size=6),
    intensity=st.lists(st.floats(1e-300, 1e300), min_size=6, max_size=6),
)
def test_any_verdicts_have_an_outcome_and_bounds(
    verdicts: list[list[bool]], intensity: list[float]
) -> None:
    fit = fit_fragility(intensity[: len(verdicts)], [0.5, 1.0, 2.0], verdicts)
    low, high = fit.band(np.geomspace(1e-200, 1e200, 9))
    assert (low >= 0.0).all()
    assert (high <= 1.0).all()
    assert (low <= high).all()


@pytest.mark.parametrize(
    ("intensity", "verdicts", "outcome"),
    [
        ([1.0, 2.0], [[0, 0], [0, 0]], Outcome.NONE_OVERTURN),
        ([1.0, 2.0], [[1, 1], [1, 1]], Outcome.ALL_OVERTURN),
        ([1.0, 2.0], [[0, 0], [1, 1]], Outcome.SEPARATED),
        ([1.0, 2.0], [[0, 1], [1, 1]], Outcome.SEPARATED),  # stands at 1, overturns at 2 and 4
        ([1.0, 4.0], [[1, 1], [0, 0]], Outcome.NOT_RISING),
        ([1.0, 1.1, 1.2], [[1, 1], [1, 0], [1, 0]], Outcome.NOT_RISING),
        ([math.nan, math.nan], [[1, 0], [0, 1]], Outcome.UNKNOWN),
        ([], [], Outcome.UNKNOWN),
    ],
)
def test_verdicts_without_a_curve(
    intensity: list[float], verdicts: list[list[int]], outcome: Outcome
) -> None:
    fit = fit_fragility(intensity, [1.0, 2.0], np.reshape(verdicts, (len(intensity), 2)))
    assert fit.outcome is outcome
    assert math.isnan(fit.median)
    assert np.isnan(fit.probability([1.0, 2.0])).all()
    assert fit.covariance.shape == (2, 2)
    assert outcome.sentence


def test_where_nothing_fell_the_bound_is_that_of_so_many_trials() -> None:
    """If 0 of n overturn, the upper bound p satisfies (1 - p)^n = 5 %."""
    fit = fit_fragility([1.0] * 9 + [1.5], [1.0], np.zeros((10, 1)))
    low, high = fit.band([1.0, 1.6])
    assert low.tolist() == [0.0, 0.0]
    assert_allclose(high, [1.0 - 0.05**0.1, 1.0])


def test_weak_motions_say_nothing_of_strong_ones() -> None:
    """Only one of ten motions that stand reaches 1: the bound there is that of one motion."""
    fit = fit_fragility([0.05] * 9 + [1.0], [1.0], np.zeros((10, 1)))
    assert_allclose(fit.band([0.05, 0.5, 1.0])[1], [1.0 - 0.05**0.1, 0.95, 0.95])


def test_where_all_fell_weak_ones_count() -> None:
    fit = fit_fragility([1.0] * 9 + [0.5], [1.0], np.ones((10, 1)))
    low, high = fit.band([0.4, 0.5, 1.0])
    assert_allclose(low, [0.0, 0.05, 0.05**0.1])
    assert high.tolist() == [1.0, 1.0, 1.0]


def test_separated_verdicts_leave_a_step_open() -> None:
    """On either side, the bound follows from the number of motions; it is not 0 or 1."""
    fit = fit_fragility([1.0, 2.0, 3.0, 4.0], [1.0], [[0], [0], [1], [1]])
    low, high = fit.band([0.9, 1.9, 2.5, 3.1, 4.1])
    assert_allclose(low, [0.0, 0.0, 0.0, 0.05, 0.05**0.5])
    assert_allclose(high, [1.0 - 0.05**0.5, 0.95, 1.0, 1.0, 1.0])
    assert (fit.safe_to, fit.overturned_from) == pytest.approx((2.0, 3.0))


def test_scales_of_one_motion_are_one_trial() -> None:
    fit = fit_fragility([1.0], SCALES, [[0, 0, 0, 0, 1, 1, 1]])
    assert fit.outcome is Outcome.SEPARATED
    low, high = fit.band([0.4, 5.0])
    assert_allclose([*low, *high], [0.0, 0.05, 0.95, 1.0])


def test_two_motions_have_no_covariance() -> None:
    """At the maximum their scores cancel, so a band from them would have no width somewhere."""
    fit = fit_fragility([1.0, 2.0], [1.0, 1.5, 2.0], [[0, 1, 0], [0, 1, 1]])
    assert fit.outcome is Outcome.UNDETERMINED
    low, high = fit.band([0.5, 2.32])
    assert (low.tolist(), high.tolist()) == ([0.0, 0.0], [1.0, 1.0])


def test_a_median_above_all_that_was_tried_is_not_determined() -> None:
    """One of 26 motions overturns: only the form of the curve says where half of them would."""
    pga = np.geomspace(0.04, 0.66, 26)
    fit = fit_fragility(pga, np.arange(26) == 22)
    assert fit.outcome is Outcome.UNDETERMINED
    assert fit.median > fit.highest == pytest.approx(0.66)
    result = fit.facts()["result"]
    assert result.startswith("not determined by these data: the fit has its median at ")
    assert result.endswith(", outside 0.04 to 0.66 as tried")


def test_a_probability_that_need_not_rise_is_not_determined() -> None:
    """Strong and weak motions overturn nearly alike, so that any steepness agrees with them."""
    fit = fit_fragility([0.3, 0.35, 0.39, 0.42, 0.46, 0.52, 0.56, 0.6], [0, 0, 1, 1, 0, 1, 0, 1])
    assert fit.outcome is Outcome.UNDETERMINED
    assert fit.lognormal_beta_band[1] == math.inf
    assert fit.lowest < fit.median < fit.highest
    assert fit.facts()["result"].endswith("β of the fit has no upper bound at 90 % confidence")


@pytest.mark.parametrize("seed", range(20))
def test_a_determined_median_has_a_bounded_interval(seed: int) -> None:
    """Fieller's set of medians, where the argument of F is 0 within its error, is an interval about
    the median if the curve is determined, and otherwise unbounded or beyond what was tried.
    """
    drawn = np.random.default_rng(seed)
    pga = np.exp(0.4 * drawn.standard_normal(8))
    capacity = 1.5 * np.exp(drawn.standard_normal(8))
    fit = fit_fragility(pga, [0.5, 1.0, 2.0], np.outer(pga, [0.5, 1.0, 2.0]) > capacity[:, None])
    t = stdtrit(7, 0.95) ** 2
    (of_intercept, both), (_, of_slope) = t * fit.covariance
    square = np.poly1d([fit.slope**2 - of_slope, 2.0 * (fit.intercept * fit.slope - both),
                        fit.intercept**2 - of_intercept])  # fmt: skip
    bounded = square.coeffs[0] > 0.0 and fit.slope > 0.0
    within = fit.lowest <= fit.median <= fit.highest
    assert (fit.outcome is Outcome.FITTED) == (bounded and within)
    if bounded:
        low, high = sorted(square.roots.real)
        assert low < math.log(fit.median) < high


def test_overturning_that_becomes_rarer_has_no_curve() -> None:
    fit = fit_fragility([1.0, 2.0, 3.0, 4.0], [1.0], [[1], [1], [0], [1]])
    assert fit.outcome is Outcome.NOT_RISING
    assert np.isnan(fit.probability([1.0, 4.0])).all()


def test_the_measure_that_decides_is_named() -> None:
    intensity, fell = site(60, 3, slope=8.0)
    noise = np.random.default_rng(1).lognormal(0.0, 0.5, 60)
    fits = {
        "a_p": fit_fragility(intensity, SCALES, fell),
        "pga": fit_fragility(intensity * noise, SCALES, fell),
    }
    assert better_measure(fits).measure == "a_p"


def test_a_tie_names_none() -> None:
    intensity, fell = site(60, 3)
    fit = fit_fragility(intensity, SCALES, fell)
    told = better_measure({"a_p": fit, "pga": fit})
    assert told.measure == ""
    assert "equally well" in told.reason


def test_measures_of_equal_worth_seldom_have_a_better_one() -> None:
    """With two noisy copies of the decisive measure, one is named in at most one of eight draws."""
    named = 0
    for seed in range(80):
        intensity, fell = site(40, seed)
        rng = np.random.default_rng(1000 + seed)
        fits = {
            name: fit_fragility(intensity * rng.lognormal(0.0, 0.4, 40), SCALES, fell)
            for name in ("pga", "pgv")
        }
        named += better_measure(fits).measure != ""
    assert named <= 10


@pytest.mark.parametrize("motions", [10, 20, 60])
def test_chance_alone_names_one_in_twenty(motions: int) -> None:
    """Either of two measures may lead by chance: the test is two-sided, also for few motions."""
    intensity, fell = site(motions, 3)
    fit = fit_fragility(intensity, SCALES, fell)
    rng = np.random.default_rng(motions)
    named = sum(
        better_measure(
            {n: replace(fit, log_likelihood=rng.standard_normal(motions)) for n in ("pga", "pgv")}
        ).measure
        != ""
        for _ in range(4000)
    )
    assert named / 4000 == pytest.approx(0.05, abs=0.012)  # 3.5 standard errors


def test_a_comparison_needs_two_fragilities() -> None:
    fit = fit_fragility(*_ordered(*site(20, 3)))
    stands = fit_fragility([1.0, 2.0], [False, False])
    assert better_measure({"pga": stands}).reason.startswith("no measure has a fragility")
    told = better_measure({"pga": fit, "pgv": stands})
    assert told.reason == "only one measure has a fragility; two are needed for a comparison"


def test_few_motions_name_none() -> None:
    intensity, fell = site(9, 3, slope=8.0)
    fits = {
        "a_p": fit_fragility(intensity, SCALES, fell),
        "pga": fit_fragility(intensity[::-1], SCALES, fell),
    }
    assert "9 recordings are too few" in better_measure(fits).reason


def test_motions_are_compared_that_have_all_measures() -> None:
    intensities = {
        "a_p": np.array([1.0, np.nan]),
        "pga": np.array([1.0, 2.0]),
        "L_p": np.full(2, np.nan),
    }
    assert compared_motions(intensities).tolist() == [True, False]


def test_shapes_must_fit() -> None:
    with pytest.raises(ParameterError, match=r"shape \(1, 2\). Must be \(2, 1\)"):
        fit_fragility([1.0, 2.0], [1.0], [[True, False]])


def test_bands_of_median_and_beta_hold_what_they_promise() -> None:
    """About 90 % of the bands of 60 sets from one lognormal distribution contain the truth."""
    drawn, scales = np.random.default_rng(0), np.geomspace(0.2, 5.0, 12)
    median, beta, hits = 0.5, 0.4, np.zeros(2)
    for _ in range(60):
        pga = drawn.uniform(0.2, 1.0, 60)
        capacity = median * np.exp(beta * drawn.standard_normal(60))
        fit = fit_fragility(pga, scales, pga[:, None] * scales > capacity[:, None])
        for k, (true, band) in enumerate(
            ((median, fit.median_band), (beta, fit.lognormal_beta_band))
        ):
            hits[k] += band[0] < true < band[1]
    assert (hits >= 48).all(), hits
    stands = fit_fragility([1.0, 2.0], [1.0], [[0], [0]])
    assert np.isnan([*stands.median_band, *stands.lognormal_beta_band]).all()


def test_a_fragility_without_range_draws_no_curve() -> None:
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    replace(fit_fragility([1.0, 2.0], [1.0], [[0], [0]]), lowest=math.nan).draw(axes)
    assert not axes.lines
    assert axes.get_ylabel() == "probability"


@pytest.mark.parametrize("quantity", [limited.name for limited in LIMITED])
def test_the_name_of_a_limit_state_has_all_of_it(quantity: str) -> None:
    state = LimitState(quantity, 0.25)
    assert LimitState.named(state.name) == state
    assert state.words.startswith(QUANTITIES[quantity].symbol)
    without_unit = not QUANTITIES[quantity].shown_unit
    assert (f"{state.words}|".endswith("0.25|")) == without_unit
