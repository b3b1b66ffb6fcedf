"""Demands at return periods: a closed form, the rate of the limit state, and unknown ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rockframe.errors import ParameterError
from rockframe.risk import (
    HazardCurve,
    LognormalFragility,
    demand_hazard,
    demands_at,
    fit_fragility,
    overturning_rate,
)

#: Rates k x^-a over eight decades, so that the ends of the curve do not matter.
K, A = 1e-3, 2.0
CURVE = HazardCurve("pgv", np.geomspace(1e-4, 1e4, 33), K * np.geomspace(1e-4, 1e4, 33) ** -A)


@pytest.mark.parametrize("power", [1.0, 1.6])
@pytest.mark.parametrize("deviation", [0.2, 0.7])
@pytest.mark.parametrize("period", [475.0, 2475.0])
def test_a_power_law_has_the_demand_of_the_closed_form(
    power: float, deviation: float, period: float
) -> None:
    """With D about c x^b and rates k x^-a, the rate of d is k (d/c)^(-a/b) exp((a s/b)^2 / 2)."""
    c = 0.3

    def reaches(level: float) -> LognormalFragility:
        return LognormalFragility((level / c) ** (1.0 / power), deviation / power)

    demand = demand_hazard(CURVE, np.geomspace(1e-3, 1e1, 25), reaches)
    value, low, high, _ = demand.at(period)
    lasting = K * period * math.exp(0.5 * (A * deviation / power) ** 2)
    assert value == pytest.approx(c * lasting ** (power / A), rel=2e-6)
    assert low == high == value  # a stated curve has no band


def motions() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return intensities, scales, peaks (motions, scales, members) and recordings."""
    random = np.random.default_rng(5)
    intensity, scales = random.uniform(0.05, 0.6, 80), np.geomspace(0.25, 4.0, 9)
    scatter = random.normal(0.0, 0.4, (80, 1, 4))
    peaks = 0.4 * (intensity[:, None, None] * scales[:, None]) ** 1.3 * np.exp(scatter)
    return intensity, scales, np.where(peaks > 1.0, np.inf, peaks), np.arange(80)


def test_the_limit_state_at_the_demand_has_the_rate_of_its_return_period() -> None:
    intensity, scales, peaks, recordings = motions()
    found = demands_at(CURVE, [475.0, 1500.0], peaks, (intensity, scales), recordings, "lognormal")
    for period, value in zip((475.0, 1500.0), found["value"], strict=True):
        fit = fit_fragility(intensity, scales, (peaks >= value).mean(axis=-1), recordings)
        assert overturning_rate(CURVE, fit).rate * period == pytest.approx(1.0, rel=0.03)
    assert (found["low"] < found["value"]).all()
    assert (found["value"] < found["high"]).all()
    assert found["value"][0] < found["value"][1]


def test_bounds_are_those_of_the_rates_and_fewer_recordings_widen_them() -> None:
    intensity, scales, peaks, recordings = motions()
    widths = []
    for clusters in (recordings, recordings // 8):
        found = demands_at(CURVE, [475.0], peaks, (intensity, scales), clusters, "lognormal")
        widths.append(float(found["high"][0] / found["low"][0]))
    assert 1.0 < widths[0] < widths[1]


def test_overturning_more_often_than_the_return_period_is_infinite() -> None:
    intensity, scales, peaks, recordings = motions()
    found = demands_at(CURVE, [1e6], peaks, (intensity, scales), recordings, "lognormal")
    assert found["value"][0] == math.inf


def test_a_structure_that_lifts_more_rarely_has_no_demand() -> None:
    intensity, scales, peaks, recordings = motions()
    still = np.where(peaks < 0.05, 0.0, peaks)
    found = demands_at(CURVE, [3.0], still, (intensity, scales), recordings, "lognormal")
    assert found["value"][0] == 0.0


def test_motions_more_frequent_than_the_hazard_curve_are_not_known() -> None:
    curve = HazardCurve("pgv", np.array([0.1, 1.0]), np.array([1e-3, 1e-5]))
    demand = demand_hazard(curve, [0.1, 1.0], lambda level: LognormalFragility(level, 0.3))
    for period in (475.0, 1000.0):  # where the curve begins, only what all motions reach
        value, low, high, share = demand.at(period)
        assert all(map(math.isnan, (value, high, share)))
        assert low == 0.0
    assert demand.at(5000.0)[0] > 0.1


@pytest.mark.parametrize("deviation", [0.2, 0.5])
@pytest.mark.parametrize("period", [20.0, 40.0])
def test_motions_below_the_hazard_curve_are_in_the_upper_bound(
    deviation: float, period: float
) -> None:
    """The closed form of rates k x^-a over all intensities, of a curve that begins at 0.1."""
    curve = HazardCurve("pgv", np.array([0.1, 10.0]), K * np.array([0.1, 10.0]) ** -A)

    def reaches(level: float) -> LognormalFragility:
        return LognormalFragility(level / 0.3, deviation)

    demand = demand_hazard(curve, np.geomspace(1e-3, 1e1, 200), reaches)
    value, low, high, share = demand.at(period)
    closed = 0.3 * (K * period * math.exp(0.5 * (A * deviation) ** 2)) ** (1.0 / A)
    assert low == value < high == pytest.approx(closed, rel=2e-3)
    assert 1.0 - share == pytest.approx((value / closed) ** A, rel=0.05)


def test_a_demand_below_all_that_were_tried_is_no_demand_of_zero() -> None:
    """All motions rock: that none has a smaller demand does not mean that the structure rests."""
    random = np.random.default_rng(0)
    intensity, scales = np.exp(random.normal(np.log(0.4), 0.5, 60)), np.array([1.0, 2.0, 4.0])
    scatter = np.exp(random.normal(0.0, 0.3, (60, 1, 1)))
    peaks = 0.3 * (intensity[:, None, None] * scales[:, None]) ** 1.7 * scatter
    periods = np.array([2.0, 5.0, 1000.0])
    measured = (intensity, scales)
    found = demands_at(CURVE, [*periods], peaks, measured, np.arange(60), "lognormal")
    exact = 0.3 * (K * periods * math.exp(0.5 * (A * 0.3 / 1.7) ** 2)) ** (1.7 / A)
    assert exact[0] < exact[1] < peaks.min() < exact[2]
    assert np.isnan(found["value"][:2]).all()
    assert (found["low"][:2] == 0.0).all()
    assert not (found["high"][:2] < exact[:2]).any()
    assert found["value"][2] == pytest.approx(exact[2], rel=0.1)


def test_zero_is_of_motions_without_uplift_that_are_as_frequent_as_the_return_period() -> None:
    intensity, scales, peaks, recordings = motions()
    still = np.where(peaks < 0.05, 0.0, peaks)
    weakest = intensity.min() * scales[0]
    found = demands_at(
        CURVE,
        [1.01 / float(CURVE.rate_of(weakest)), 0.99 / float(CURVE.rate_of(weakest))],
        *(still, (intensity, scales), recordings, "lognormal"),
    )
    assert found["value"][0] == 0.0
    assert np.isnan(found["value"][1])


def test_a_demand_that_no_motion_has_is_not_known() -> None:
    intensity, scales, peaks, recordings = motions()
    for lacking in (np.nan, 0.0):
        none = np.full_like(peaks, lacking)
        found = demands_at(CURVE, [475.0], none, (intensity, scales), recordings, "lognormal")
        assert all(np.isnan(found[name]).all() for name in ("value", "high", "extrapolated"))
        assert found["low"][0] == pytest.approx(
            lacking, nan_ok=True
        )  # NaN: without such a quantity


def test_one_motion_determines_no_demand() -> None:
    measured, peaks = (np.array([0.3]), np.array([1.0])), np.full((1, 1, 1), 0.1)
    found = demands_at(CURVE, [475.0], peaks, measured, np.zeros(1, dtype=int), "lognormal")
    assert math.isnan(found["value"][0])
    assert found["low"][0] == 0.0


def test_levels_increase_from_above_zero() -> None:
    for levels in ([], [0.0, 1.0], [1.0, 0.5]):
        with pytest.raises(ParameterError, match="Must be positive and increasing"):
            demand_hazard(CURVE, levels, lambda level: LognormalFragility(level, 0.3))
