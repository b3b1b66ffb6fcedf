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
    assert all(map(math.isnan, demand.at(475.0)))
    assert demand.at(5000.0)[0] > 0.1


def test_a_demand_that_no_motion_has_is_not_known() -> None:
    intensity, scales, peaks, recordings = motions()
    for lacking in (np.nan, 0.0):
        none = np.full_like(peaks, lacking)
        found = demands_at(CURVE, [475.0], none, (intensity, scales), recordings, "lognormal")
        assert all(np.isnan(values).all() for values in found.values())


def test_levels_increase_from_above_zero() -> None:
    for levels in ([], [0.0, 1.0], [1.0, 0.5]):
        with pytest.raises(ParameterError, match="Must be positive and increasing"):
            demand_hazard(CURVE, levels, lambda level: LognormalFragility(level, 0.3))
