"""The figure over the ratio of the heights of two columns."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from rockframe import Ensemble, GroundAcceleration, Pulse, Record, bent_ensemble
from rockframe.figures.parameters import draw_unequal_columns
from rockframe.unequal.ensemble import over_height_ratios

from .cases import BENT

PULSE = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.2, time=3.0)


def test_the_figure_shows_shares_and_medians(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rockframe.figures.parameters._HEIGHT_RATIOS", (0.6, 0.8, 1.0))
    strong = GroundAcceleration.from_samples(PULSE.acceleration(0.01 * np.arange(800)), 0.01)
    samples = 0.5 * strong.acceleration()
    record = Record(record_id="pulse", acceleration=samples, time_step=0.01)
    drawn = draw_unequal_columns([record], BENT)
    first, second, third = drawn.figure.axes
    few = Ensemble(corner=1.0)
    exact = over_height_ratios(BENT, [record], [0.6, 1.0], [1.0, 2.0, 3.0], few)
    [_, median, _] = first.get_lines()
    assert_allclose(
        np.asarray(median.get_ydata())[[0, -1]],
        exact.peak_rotation_ratio[0] / exact.peak_rotation_ratio[0, 1],
        rtol=1e-12,
    )
    assert_allclose(
        np.asarray(third.get_lines()[1].get_ydata())[[0, -1]],
        100.0 * exact.peak_level_difference[0],
        atol=1e-12,
    )
    for k, line in enumerate(second.get_lines()[:3]):
        shares = np.asarray(line.get_ydata())[[0, -1]]
        assert_allclose(shares, 100.0 * exact.share_overturned[:, k])
    equal = bent_ensemble(BENT.with_height_ratio(1.0), strong.scaled(0.5), few)
    assert_allclose(exact.share_overturned[1, 0], equal.share_overturned)
    assert "the ratio of the stated bent, 0.78" in drawn.caption
    assert "heights, under one record with 64 plausible bents." in drawn.caption
