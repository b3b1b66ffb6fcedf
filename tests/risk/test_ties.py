"""Intensities that are equal but for round-off and for the digits of scale factors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from rockframe.risk import Outcome, fit_fragility, observed_shares
from rockframe.risk.ties import SAME, merged

Float = NDArray[np.float64]


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


@settings(max_examples=50, deadline=None)
@given(scaled_to=st.floats(0.01, 100.0), pgv=st.lists(st.floats(0.01, 100.0), min_size=2))
def test_motions_that_are_scaled_to_one_intensity_are_tied(
    scaled_to: float, pgv: list[float]
) -> None:
    """Each factor has six digits, as in a file of scaled motions."""
    product = np.array([float(f"{scaled_to / one:.6g}") * one for one in pgv])
    assert np.ptp(merged(np.log(product))) == 0.0


def test_intensities_that_differ_by_more_stay_apart() -> None:
    x = np.array([0.0, 2.0 * SAME, 1.0])
    assert_array_equal(merged(x), x)


def test_many_close_intensities_are_not_one() -> None:
    """Each of 100,000 values is close to the next, but no value moves by more than 1e-5."""
    x = np.linspace(0.0, 0.1, 100_000)
    assert np.abs(merged(x) - x).max() <= SAME
    assert np.unique(merged(x)).size > 9_000


@pytest.mark.parametrize("intensity", [np.ones(8), 1.0 + 1e-6 * np.arange(8)])
def test_classes_share_motions_of_equal_intensity(intensity: Float) -> None:
    """Four of eight equal motions overturn, the first four in the file: half, in both classes."""
    centre, share = observed_shares(intensity, [1.0], [[1]] * 4 + [[0]] * 4, classes=2)
    assert share.tolist() == [0.5, 0.5]
    assert centre[0] == centre[1] == pytest.approx(1.0, rel=SAME)
