"""The rate of overturning: closed forms, bounds, and files of hazard curves."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe.errors import InputError, ParameterError
from rockframe.risk import (
    Fragility,
    HazardCurve,
    LognormalFragility,
    Outcome,
    fit_fragility,
    overturning_rate,
    read_hazard,
)
from rockframe.risk.fragility import Curve

#: k x^-2 over eighteen decades; intensities beyond them add nothing to a rate.
POWER = HazardCurve("pga", np.array([1e-9, 1e9]), np.array([1e14, 1e-22]))


@pytest.mark.parametrize(
    ("intensity", "rate", "words"),
    [
        ([1.0], [1.0], "hazard curve of 1 points. Must have two or more"),
        ([1.0, -2.0], [1.0, 0.5], "intensity -2 of point 2 of the hazard curve. Must be positive"),
        ([1.0, 2.0], [1.0, 0.0], "rate 0 of point 2 of the hazard curve. Must be positive"),
        ([2.0, 1.0], [1.0, 0.5], "intensities of the hazard curve. Must be increasing"),
        ([1.0, 2.0], [0.5, 0.5], "rates of the hazard curve. Must be decreasing"),
    ],
)
def test_curves_that_are_none(intensity: list[float], rate: list[float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        HazardCurve("pga", np.array(intensity), np.array(rate))


def curve_of(median: float, slope: float, curve: Curve = "logistic") -> Fragility:
    return Fragility(
        Outcome.FITTED,
        motions=20,
        observations=20,
        overturned=10,
        intercept=-slope * math.log(median),
        slope=slope,
        covariance=np.zeros((2, 2)),
        lowest=1e-9,
        highest=1e9,
        curve=curve,
    )


@pytest.mark.parametrize("slope", [2.5, 4.0, 12.0])
@pytest.mark.parametrize("median", [0.3, 2.0])
def test_rate_under_a_power_law_has_a_closed_form(median: float, slope: float) -> None:
    """With P logistic in ln x, slope b: int P d(k x^-2) = k m^-2 (2 pi / b) / sin(2 pi / b)."""
    points = np.geomspace(1e-9, 1e9, 400)
    curve = HazardCurve("pga", points, 1e-4 * points**-2.0)
    angle = 2.0 * math.pi / slope
    expected = 1e-4 * median**-2.0 * angle / math.sin(angle)
    assert_allclose(overturning_rate(curve, curve_of(median, slope)).rate, expected, rtol=1e-4)


@pytest.mark.parametrize("beta", [0.2, 0.64])
@pytest.mark.parametrize("power", [1.0, 3.0])
def test_lognormal_rate_under_a_power_law_has_a_closed_form(beta: float, power: float) -> None:
    """With P lognormal: int P d(k x^-a) = k m^-a exp(a^2 beta^2 / 2) (Cornell)."""
    points = np.geomspace(1e-6, 1e6, 200)
    curve = HazardCurve("pga", points, 1e-4 * points**-power)
    expected = 1e-4 * 0.5**-power * math.exp(0.5 * (power * beta) ** 2)
    rate = overturning_rate(curve, curve_of(0.5, 1.0 / beta, "lognormal"))
    assert_allclose(rate.rate, expected, rtol=1e-6)


@pytest.mark.parametrize(
    "points",
    [[0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5], [0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1, 2]],
)
def test_a_table_of_few_points_is_straight_between_them(points: list[float]) -> None:
    """Straight in log-log, so that a power law is met; the closed form is of all intensities.

    A spline through the rates swings between the points, and gives 115 and 32 times this rate.
    """
    curve = HazardCurve("pga", np.array(points), 1e-4 * np.array(points) ** -2.5)
    rate = overturning_rate(curve, LognormalFragility(0.8, 0.4))
    expected = 1e-4 * 0.8**-2.5 * math.exp(0.5 * (2.5 * 0.4) ** 2)
    assert rate.low <= expected <= rate.high
    assert rate.rate == pytest.approx(expected, rel=0.01)


def test_the_tail_decides_the_rate_of_a_logistic_curve() -> None:
    """Its tail falls as x^(1.81 / beta), slower than x^3: the rate depends on the first point.

    The lognormal curve with the same median and beta has the same rate from 0.03 m/s and from
    0.003 m/s. Of the logistic rate most is from intensities that were not tried, and this is said.
    """
    tried = {"lowest": 0.1, "highest": 3.0}
    rates = {}
    for curve, slope in (("lognormal", 1.0 / 0.64), ("logistic", math.pi / math.sqrt(3.0) / 0.64)):
        fit = Fragility(**(vars(curve_of(0.6, slope, curve)) | tried))  # type: ignore[arg-type]
        for first in (0.003, 0.03):
            points = np.geomspace(first, 30.0, 60)
            rates[curve, first] = overturning_rate(
                HazardCurve("pgv", points, 1e-5 * points**-3), fit
            )
    assert_allclose(rates["lognormal", 0.003].rate, rates["lognormal", 0.03].rate, rtol=0.01)
    assert rates["logistic", 0.003].rate > 1.5 * rates["logistic", 0.03].rate
    assert rates["logistic", 0.003].extrapolated > 0.5


def test_a_steep_curve_is_the_rate_of_its_median() -> None:
    points = np.geomspace(0.01, 10.0, 30)
    curve = HazardCurve("pga", points, 1e-4 * points**-2.0)
    rate = overturning_rate(curve, curve_of(0.5, 1e6))
    assert_allclose(rate.rate, 1e-4 * 0.5**-2.0, rtol=1e-9)
    assert_allclose(rate.low, rate.rate, rtol=1e-12)


@pytest.mark.parametrize("beta", [0.1, 0.03, 0.01, 0.003, 1e-6])
def test_a_steep_lognormal_curve_has_the_closed_form_on_two_points(beta: float) -> None:
    """The cells of a curve of two points are wider than the rise of P."""
    curve = HazardCurve("pga", np.array([0.01, 10.0]), np.array([1.0, 1e-6]))
    rate = overturning_rate(curve, LognormalFragility(0.7, beta))
    assert_allclose(rate.rate, 1e-4 * 0.7**-2.0 * math.exp(2.0 * beta**2), rtol=1e-6)


def test_contributions_of_a_steep_curve_are_those_of_the_segments_above_its_median() -> None:
    """The rates fall with powers 1, 2 and 3; the median is in the second segment."""
    curve = HazardCurve("pga", np.array([0.1, 1.0, 10.0, 20.0]), np.array([0.1, 1e-2, 1e-4, 1e-5]))
    falls = overturning_rate(curve, LognormalFragility(2.0, 1e-3))
    rate = 1e-2 * 2.0**-2.0 * math.exp(2.0 * 1e-3**2)
    expected = [0.0, rate - 1e-4, 1e-4 - 1e-5, 1e-5]
    assert_allclose(falls.contributions, expected, rtol=1e-6, atol=1e-20)


def test_contributions_add_up_and_stay_between_the_bounds() -> None:
    points = np.geomspace(0.01, 2.0, 9)
    curve = HazardCurve("pga", points, 1e-4 * points**-1.5)
    rate = overturning_rate(curve, curve_of(0.5, 5.0))
    assert_allclose(rate.contributions.sum(), rate.rate, rtol=1e-14)
    assert rate.low <= rate.rate <= rate.high
    assert rate.contributions[-1] < curve.rate[-1]


def test_motions_above_a_curve_count_fully_in_the_upper_bound_only() -> None:
    """A frame that stands in all tried motions: above the curve it may overturn, or may not.

    Of 12 motions without overturning, the upper bound of P is well below 1 at every intensity of
    the curve. So the rate at which its end is exceeded, 1e-3, is the larger part of the bound.
    """
    curve = HazardCurve("pga", np.array([0.5, 0.6]), np.array([1.001e-3, 1e-3]))
    stands = fit_fragility(np.linspace(1.0, 2.0, 12), [1.0], np.zeros((12, 1), dtype=int))
    rate = overturning_rate(curve, stands)
    most = float(stands.band(curve.intensity)[1].max())
    assert most < 0.5
    assert rate.low == 0.0
    assert 1e-3 < rate.high <= 1e-3 + most * 1e-6 * (1.0 + 1e-9)


def test_no_overflow_over_eighteen_decades() -> None:
    rate = overturning_rate(POWER, curve_of(1.0, 500.0))
    assert math.isfinite(rate.rate)
    assert_allclose(rate.rate, 1e-4, rtol=0.1)


@pytest.mark.parametrize("count", [2, 3, 200])
def test_separated_verdicts_give_the_rates_that_so_few_motions_leave_open(count: int) -> None:
    """The lower bound of P rises at 0.6 and 0.9, the upper bound at 0.2 and 0.3 (there to 1)."""
    points = np.geomspace(0.01, 10.0, count)
    curve = HazardCurve("pga", points, 1e-4 * points**-2.0)
    fit = fit_fragility([0.2, 0.3, 0.6, 0.9], [1.0], [[0], [0], [1], [1]])
    rate = overturning_rate(curve, fit)
    assert math.isnan(rate.rate)
    first, two = 0.05, 0.05**0.5
    often = {x: 1e-4 * x**-2.0 for x in (0.01, 0.2, 0.3, 0.6, 0.9)}
    low = first * (often[0.6] - often[0.9]) + two * often[0.9]
    high = (1.0 - two) * (often[0.01] - often[0.2]) + 0.95 * (often[0.2] - often[0.3]) + often[0.3]
    assert_allclose(rate.low, low, rtol=1e-12)
    assert_allclose(rate.high, high, rtol=1e-12)


@pytest.mark.parametrize(("strength", "scale"), [(0.2, 1.2), (0.3, 1.5), (0.4, 3.0)])
def test_a_motion_that_overturns_at_the_end_of_a_curve_counts_above_it(
    strength: float, scale: float
) -> None:
    """Round-off of the scaled intensity does not decide whether it is beyond the curve."""
    curve = HazardCurve("pga", np.array([0.1, round(strength * scale, 4)]), np.array([1e-2, 1e-4]))
    falls = fit_fragility([strength], [scale], [[1]])
    assert_allclose(overturning_rate(curve, falls).low, 0.05 * 1e-4, rtol=1e-9)


def test_a_measure_that_overturning_falls_with_has_no_rate() -> None:
    curve = HazardCurve("pga", np.array([1.0, 4.0]), np.array([1e-2, 1e-4]))
    fit = fit_fragility([1.0, 2.0, 3.0, 4.0], [1.0], [[1], [1], [0], [1]])
    rate = overturning_rate(curve, fit)
    assert math.isnan(rate.rate)
    assert rate.low == 0.0
    assert rate.high == pytest.approx(1e-2)


def test_what_was_not_tried_is_said() -> None:
    points = np.array([0.1, 1.0, 10.0])
    curve = HazardCurve("pga", points, np.array([1e-2, 1e-3, 1e-4]))
    fit = Fragility(**(vars(curve_of(2.0, 8.0)) | {"lowest": 0.01, "highest": 1.0}))
    assert overturning_rate(curve, fit).extrapolated > 0.9


@pytest.mark.parametrize(("lowest", "highest"), [(0.3, 3.0), (0.5, 0.6), (1.0, 1.01), (0.12, 4.6)])
def test_the_share_of_extrapolation_is_that_of_a_fine_sum(lowest: float, highest: float) -> None:
    """Ends of the range between the points of the curve are ends of the integration."""
    curve = HazardCurve("pgv", np.array([0.01, 10.0]), np.array([1.0, 1e-6]))
    fragility = LognormalFragility(0.7, 0.4, lowest, highest)
    tried = np.geomspace(lowest, highest, 100_001)
    middle = np.sqrt(tried[1:] * tried[:-1])
    within = -(fragility.probability(middle) * np.diff(curve.rate_of(tried))).sum()
    rate = overturning_rate(curve, fragility)
    assert_allclose(rate.extrapolated, 1.0 - within / rate.rate, rtol=1e-7)


@pytest.mark.parametrize("highest", [np.nextafter(2.0, 0.0), 2.0, np.nextafter(2.0, 3.0)])
def test_motions_above_a_curve_that_ends_with_the_range_are_extrapolated(highest: float) -> None:
    """Round-off of the end of the range does not decide."""
    curve = HazardCurve("pgv", np.array([0.5, 2.0]), np.array([1e-2, 1e-3]))
    rate = overturning_rate(curve, LognormalFragility(1.0, 0.4, 0.1, highest))
    assert_allclose(rate.extrapolated, rate.contributions[-1] / rate.rate, rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "columns missing. Must be annual_rate and one of a_p_g, pga_g, pgv_m_s, L_p_m"),
        ("pga,annual_rate\n", ":1: columns pga, annual_rate. Must be"),
        ("pga_g,pgv_m_s,annual_rate\n", ":1: columns pga_g, pgv_m_s, annual_rate"),
        ("pga_g,annual_rate\n0.1,0.01\n", ":2: 1 points. Must be two or more"),
        ("pga_g,annual_rate\n", ":1: 0 points. Must be two or more"),
        ("pga_g,annual_rate\n0.1,high\n", ":2: '0.1, high'. Must be two numbers"),
        ("pga_g,annual_rate\n0.1,0.01,3\n", ":2: .*Must be two numbers"),
        ("pga_g,annual_rate\n\n0.1,0.01\n0.2,low\n", ":4: '0.2, low'. Must be two numbers"),
        ("pga_g,annual_rate\n0.2,0.01\n0.1,0.001\n", ":3: pga_g 0.1 after 0.2. Must be larger"),
        (
            "pga_g,annual_rate\n0.1,0.01\n0.2,0.02\n",
            ":3: annual_rate 0.02 after 0.01. Must be smaller",
        ),
        ("pga_g,annual_rate\n0,0.01\n0.2,0.002\n", ":2: pga_g 0. Must be above 0 and at most 50"),
        ("pga_g,annual_rate\n0.1,0.01\n0.2,-0.001\n", ":3: annual_rate -0.001. Must be above 0"),
        ("pga_g,annual_rate\n0.1,0.01\n0.2,nan\n", ":3: '0.2, nan'. Must be two numbers"),
        ("pga_g,annual_rate\n0.1,1_0\n", ":2: '0.1, 1_0'. Must be two numbers"),
        ("pga_g,annual_rate\n0.1,０.1\n", ":2: .*Must be two numbers"),
        ("pga_g,annual_rate\n98.1,0.01\n", ":2: pga_g 98.1. Must be above 0 and at most 50"),
        ("L_p_m,annual_rate\n2000,0.01\n", ":2: L_p_m 2000. Must be above 0 and at most 1000"),
        ("arias_intensity_m_s,annual_rate\n201,0.01\n", "201. Must be above 0 and at most 200."),
        ("pga_g,annual_rate\n0.1,1e9\n", ":2: annual_rate 1e.09 at pga_g 0.1. Must be at most 1:"),
    ],
)
def test_damaged_file(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "site.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_hazard(path)


def in_fifty_years(rates: list[float]) -> list[float]:
    return [-math.expm1(-50.0 * rate) for rate in rates]


#: One of the most active sites in Europe, from barely felt shaking to the strongest.
INTENSITIES = [0.005, 0.01, 0.03, 0.1, 0.3, 0.6, 1.0]
ACTIVE = [0.4, 0.2, 0.07, 0.015, 0.0015, 0.0002, 0.00003]


def read_curve(folder: Path, intensities: list[float], rates: list[float]) -> HazardCurve:
    path = folder / "site.csv"
    lines = [f"{x:g},{rate:.6g}" for x, rate in zip(intensities, rates, strict=True)]
    path.write_text("\n".join(["pga_g,annual_rate", *lines]), encoding="utf-8")
    return read_hazard(path)


@pytest.mark.parametrize("most", [1.0, 0.5, 0.25])
def test_probabilities_in_fifty_years_are_no_annual_rates(tmp_path: Path, most: float) -> None:
    """1 - exp(-50 rate) is nearly constant, just below 1, at weak intensities."""
    rates = [most * rate for rate in ACTIVE]
    assert read_curve(tmp_path, INTENSITIES, rates).rate == pytest.approx(rates, rel=1e-5)
    with pytest.raises(
        InputError, match=r"level near 1, .* name the column probability_in_50_years"
    ):
        read_curve(tmp_path, INTENSITIES, in_fifty_years(rates))


def test_probabilities_of_strong_shaking_alone_are_higher_than_any_rate(tmp_path: Path) -> None:
    """10 % in 50 years at 0.6 g occurs in California; once in ten years at 0.6 g occurs nowhere."""
    with pytest.raises(
        InputError, match=r":2: annual_rate 0.1 at pga_g 0.6. Must be at most 0.028"
    ):
        read_curve(tmp_path, [0.6, 1.0], [0.1, 0.02])


def test_a_curve_that_falls_steeply_from_once_a_year_is_one_of_rates(tmp_path: Path) -> None:
    assert read_curve(tmp_path, [0.01, 0.1, 1.0], [1.0, 0.01, 0.0001]).rate[0] == 1.0


def test_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_hazard(tmp_path / "none.csv")


def test_units_of_the_column(tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("annual_rate, pga_g\n0.01,0.1\n0.001,0.5\n", encoding="utf-8")
    curve = read_hazard(path)
    assert_allclose(curve.intensity, [0.981, 4.905])
    assert curve.rate.tolist() == [0.01, 0.001]


def test_a_point_is_no_curve() -> None:
    with pytest.raises(ParameterError, match="1 points"):
        HazardCurve("pga", np.array([1.0]), np.array([0.1]))
