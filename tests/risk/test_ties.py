"""Equal intensities: the likelihood of a step, its bounds, and intensities equal but for digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import logistic, norm
from tests.conftest import examples

from rockframe.risk import Outcome, better_measure, fit_fragility, observed_shares
from rockframe.risk.fragility import Curve
from rockframe.risk.ties import SAME, extremes, merged

Float = NDArray[np.float64]


def tied(seed: int, motions: int = 12) -> tuple[Float, Float]:
    """Return intensities and shares that are separated by a step, with several motions at it."""
    rng = np.random.default_rng(seed)
    intensity = rng.choice([0.5, 1.0, 1.0, 1.0, 2.0, 3.0], motions)
    mixed = rng.choice([0.0, 0.25, 0.9, 1.0], motions)
    mixed[:2], intensity[:2] = [0.0, 1.0], 1.0
    return intensity, np.where(intensity == 1.0, mixed, intensity > 1.0)


@pytest.mark.parametrize("fallen", [1, 3, 4])
def test_at_a_step_equal_motions_are_so_many_trials(fallen: int) -> None:
    """With k of m at one intensity, the maximum of ln L is k ln(k/m) + (m - k) ln(1 - k/m)."""
    fell = np.arange(5) < fallen
    fit = fit_fragility([0.5, *[1.0] * 5, 2.0], [False, *fell, True])
    p = fallen / 5.0
    assert fit.outcome is Outcome.SEPARATED
    assert_allclose(fit.log_likelihood, np.log([1.0, *np.where(fell, p, 1.0 - p), 1.0]))


@pytest.mark.parametrize("curve", ["lognormal", "logistic"])
@pytest.mark.parametrize("seed", range(4))
def test_likelihood_of_a_step_is_the_limit_of_steep_curves(curve: Curve, seed: int) -> None:
    """A curve of slope 1000 that passes the step at the best probability has the same ln L."""
    intensity, shares = tied(seed)
    distribution = norm if curve == "lognormal" else logistic

    def each(at: float) -> Float:
        argument = at + 1000.0 * np.log(intensity)
        falls, stands = distribution.logcdf(argument), distribution.logsf(argument)
        return np.asarray(shares * falls + (1.0 - shares) * stands)

    best = minimize_scalar(lambda at: -each(at).sum(), bounds=(-5.0, 5.0), method="bounded")
    fit = fit_fragility(intensity, shares, curve=curve)
    assert fit.outcome is Outcome.SEPARATED
    assert_allclose(fit.log_likelihood, each(best.x), atol=1e-4)
    assert_allclose(fit.log_likelihood.sum(), -best.fun, rtol=1e-9)


def test_verdicts_without_ties_are_explained_completely() -> None:
    fit = fit_fragility([1.0, 2.0, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0])
    assert fit.log_likelihood.tolist() == [0.0, 0.0, 0.0, 0.0]


def test_at_a_step_shares_are_members_of_their_motion() -> None:
    fit = fit_fragility([1.0, 2.0, 2.0, 3.0], [0.0, 0.25, 0.75, 1.0])
    members = [[0, 0, 0, 0], [0, 0, 0, 1], [0, 1, 1, 1], [1, 1, 1, 1]]
    expected = fit_fragility([1.0, 2.0, 2.0, 3.0], [1.0] * 4, members)
    assert_allclose(4.0 * fit.log_likelihood, expected.log_likelihood)
    for name in ("stood", "fell", "safe_to", "overturned_from"):
        assert_array_equal(getattr(fit, name), getattr(expected, name))


def test_a_measure_that_mixes_verdicts_at_one_intensity_is_not_the_better_one() -> None:
    """RotD100 is the same for all twelve azimuths of a recording. One recording overturns at half
    of them, which PGA explains nearly as well as one probability for all of its azimuths.
    """
    rng = np.random.default_rng(1)
    rotd100 = np.linspace(0.5, 2.0, 12)[:, None].repeat(12, axis=1)
    fell = (rotd100 > 1.2).astype(float)
    fell[6] = [1.0, 0.0] * 6
    pga = rotd100 * rng.lognormal(0.0, 0.1, rotd100.shape)
    pga[6] = rotd100[6] * np.where(fell[6] > 0.0, 1.1, 0.9)
    clusters = np.arange(12).repeat(12)
    fits = {
        name: fit_fragility(values.ravel(), [1.0], fell.reshape(-1, 1), clusters)
        for name, values in (("rotd100", rotd100), ("pga", pga))
    }
    assert [fit.outcome for fit in fits.values()] == [Outcome.SEPARATED, Outcome.FITTED]
    assert_allclose(fits["rotd100"].log_likelihood.sum(), 12.0 * math.log(0.5))
    assert better_measure(fits).measure == ""


def test_motions_of_mixed_outcome_at_the_step_bound_neither_side() -> None:
    """Five motions of which 90 % overturn at 0.5 are not five that stand there."""
    fit = fit_fragility([0.3, *[0.5] * 5, 0.9], [0.0, *[0.9] * 5, 1.0])
    low, high = fit.band([0.29, 0.499, 0.501, 0.91])
    assert_allclose(low, [0.0, 0.0, 0.0, 0.05])
    assert_allclose(high, [0.95, 1.0, 1.0, 1.0])
    assert (fit.safe_to, fit.overturned_from) == pytest.approx((0.5, 0.5))


def test_a_mixed_motion_still_bounds_where_all_of_it_agrees() -> None:
    """One motion stands at 1, overturns in half of its members at 2, and overturns at 4."""
    fit = fit_fragility([1.0], [1.0, 2.0, 4.0], [[0.0, 0.5, 1.0]])
    assert_allclose([fit.stood, fit.fell], [[1.0], [4.0]])
    low, high = fit.band([0.9, 2.0, 4.1])
    assert_allclose([*low, *high], [0.0, 0.0, 0.05, 0.95, 1.0, 1.0])


def test_azimuths_that_disagree_at_one_intensity_are_a_mixed_motion() -> None:
    fit = fit_fragility([1.0, 2.0, 2.0, 3.0], [1.0], [[0], [0], [1], [1]], [0, 1, 1, 2])
    assert_allclose([fit.stood, fit.fell], [[1.0, 0.0, 0.0], [math.inf, math.inf, 3.0]])


@pytest.mark.parametrize("unit", [0.01, 0.3, 1.0, 9.80665])
def test_round_off_does_not_decide_which_of_two_products_is_larger(unit: float) -> None:
    """As decimal numbers, 0.1 times 1.4 and 0.2 times 0.7 are equal: the verdicts are separated."""
    fit = fit_fragility([0.1 * unit, 0.2 * unit], [0.7, 1.4], [[0, 0], [1, 1]])
    assert fit.outcome is Outcome.SEPARATED


def test_six_digits_of_scale_factors_do_not_decide() -> None:
    """Motions that are scaled to a PGV of 1.2 m/s have one intensity, not five."""
    pgv = [1.2000007, 1.1999985, 1.2000008, 1.2000014, 1.1999990]
    fit = fit_fragility(pgv, [1, 0, 0, 1, 0])
    assert fit.outcome is Outcome.UNKNOWN
    assert fit.lowest == fit.highest == pytest.approx(1.2, rel=2e-6)


@examples(50)
@given(scaled_to=st.floats(0.01, 100.0), pgv=st.lists(st.floats(0.01, 100.0), min_size=2))
def test_motions_that_are_scaled_to_one_intensity_are_tied(
    scaled_to: float, pgv: list[float]
) -> None:
    """Each factor has six digits, as in a file of scaled motions."""
    product = np.array([float(f"{scaled_to / velocity:.6g}") * velocity for velocity in pgv])
    assert np.ptp(merged(np.log(product))) == 0.0


def test_intensities_that_differ_by_more_stay_apart() -> None:
    x = np.array([0.0, 2.0 * SAME, 1.0])
    assert_array_equal(merged(x), x)


def test_many_close_intensities_are_not_one() -> None:
    """Each of 100,000 values is close to the next, but no value moves by more than 1e-5."""
    x = np.linspace(0.0, 0.1, 100_000)
    assert np.abs(merged(x) - x).max() <= SAME
    assert np.unique(merged(x)).size > 9_000


@examples(60)
@given(order=st.permutations(range(12)), seed=st.integers(0, 3))
def test_the_order_of_motions_does_not_matter(order: list[int], seed: int) -> None:
    intensity, shares = tied(seed)
    jitter = np.random.default_rng(seed).uniform(-4e-6, 4e-6, 12)
    intensity = intensity * (1.0 + jitter)
    once, again = fit_fragility(intensity, shares), fit_fragility(intensity[order], shares[order])
    assert once.outcome is again.outcome is Outcome.SEPARATED
    assert_allclose(again.log_likelihood, once.log_likelihood[order], rtol=1e-12)
    assert_array_equal([again.stood, again.fell], [once.stood[order], once.fell[order]])
    classes = [
        observed_shares(intensity[some], [1.0], shares[some][:, None], 5)
        for some in (np.arange(12), order)
    ]
    assert_allclose(classes[1], classes[0], rtol=1e-12)


def test_a_bound_holds_at_the_intensity_that_was_tried() -> None:
    """One motion that stands bounds the probability to 0.95 up to its own intensity."""
    tried = np.arange(0.1, 3.0, 0.01).round(2)
    for verdict, bounds in ((False, [0.0, 0.95]), (True, [0.05, 1.0])):
        bands = [
            np.ravel(fit_fragility([intensity], [verdict]).band(intensity)) for intensity in tried
        ]
        assert_allclose(bands, [bounds] * tried.size)


@pytest.mark.parametrize("intensity", [np.ones(8), 1.0 + 1e-6 * np.arange(8)])
def test_classes_share_motions_of_equal_intensity(intensity: Float) -> None:
    """Four of eight equal motions overturn, the first four in the file: half, in both classes."""
    centre, share = observed_shares(intensity, [1.0], [[1]] * 4 + [[0]] * 4, classes=2)
    assert share.tolist() == [0.5, 0.5]
    assert centre[0] == centre[1] == pytest.approx(1.0, rel=SAME)


@pytest.mark.parametrize("overturns", [0, 1])
def test_a_bound_holds_at_all_intensities_that_count_as_equal(overturns: int) -> None:
    """Factors of six digits scale three motions to nearly one intensity."""
    intensity = 0.37 * (1.0 + 1e-6 * np.array([-2.0, 1.0, -1.0]))
    fit = fit_fragility(intensity, [1.0], np.full((3, 1), overturns))
    low, high = fit.band([intensity.min(), 0.37, intensity.max()])
    bound = 1.0 - 0.05 ** (1.0 / 3.0)
    if overturns:
        assert_allclose(low, 1.0 - bound, rtol=1e-12)
    else:
        assert_allclose(high, bound, rtol=1e-12)


def test_a_curve_that_depends_on_one_motion_has_an_open_band() -> None:
    """Its facts say that it is not determined."""
    intensity = [0.1112, 0.1525, 1.0189, 0.1807, 0.0487]
    fit = fit_fragility(intensity, [1.0], [[0], [0], [0], [1], [0]])
    low, high = fit.median_band
    assert low < 1e-100
    assert high > 1e100
    assert fit.facts()["result"].startswith("not determined by these data: ")


def test_without_the_only_motion_of_another_intensity_no_curve_is_determined() -> None:
    intensity, verdicts = [1.0, 1.0, 1.0, 1.0, 2.0], [[0.0], [0.5], [0.2], [0.4], [0.6]]
    fit = fit_fragility(intensity, [1.0], verdicts)
    assert fit.outcome is Outcome.UNDETERMINED
    assert np.isnan(fit.covariance).all()
    assert np.isnan([*fit.median_band, *fit.lognormal_beta_band]).all()


def test_equal_values_do_not_depend_on_the_order() -> None:
    rng = np.random.default_rng(4)
    x = np.round(rng.normal(size=(30, 40)), 2) + rng.choice([0.0, 3e-6], (30, 40))
    shuffled = rng.permutation(x.size)
    for whole, part in zip(extremes(x), extremes(x.ravel()[shuffled]), strict=True):
        assert_array_equal(whole.ravel()[shuffled], part)
    least, most = extremes(x)
    assert ((least <= x) & (x <= most) & (most - least <= SAME)).all()
