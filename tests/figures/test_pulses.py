"""Figures of pulses: the curves agree with the formulas."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import QuadMesh

from rockframe.figures.histories import draw_response_history
from rockframe.figures.pulses import draw_match_curves, draw_record_and_pulse, draw_scalogram
from rockframe.matching.match import PulseMatch, match_pulses
from rockframe.matching.record_pulses import Likeness, likeness
from rockframe.matching.verdict import PulseVerdict, pulse_words
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.wavelets.pulse import Pulse

TIME = 0.01 * np.arange(1200, dtype=np.float64)
PLANTED = Pulse(wavelet="antisymmetric_ricker", a_p=3.0, T_p=0.9, time=5.0)
OPTIONS = PulseOptions()
NOISE = Likeness(
    verdict=PulseVerdict.NOISE,
    p_value=0.32,
    surrogates=24,
    match_index=0.8,
    median=0.7,
    high=0.9,
)


@pytest.fixture(scope="module")
def record() -> Record:
    noise = 0.2 * np.sin(25.0 * TIME) * np.exp(-(((TIME - 6.0) / 2.0) ** 2))
    return Record(
        record_id="shake", acceleration=PLANTED.acceleration(TIME) + noise, time_step=0.01
    )


@pytest.fixture(scope="module")
def matches(record: Record) -> dict[str, PulseMatch]:
    return match_pulses(record.acceleration, record.time_step, OPTIONS)


def test_figure_8_draws_the_record_and_its_pulse(
    record: Record, matches: dict[str, PulseMatch]
) -> None:
    match = matches["antisymmetric_ricker"]
    drawn = draw_record_and_pulse([(record, match, NOISE)], ["Shake"])
    thin, heavy = drawn.figure.axes[0].get_lines()
    seen = np.isin(record.time, np.asarray(thin.get_xdata()))
    np.testing.assert_array_equal(thin.get_ydata(), record.acceleration[seen] / 9.81)
    x = 2.0 * np.pi * (np.asarray(heavy.get_xdata()) - match.pulse.time)
    x /= np.sqrt(3.0) * match.pulse.T_p
    formula = match.pulse.a_p / 1.380119 * (x**2 - 3.0) * x * np.exp(-0.5 * x**2) / 9.81
    np.testing.assert_allclose(np.asarray(heavy.get_ydata()), formula, atol=1e-6)
    assert f"T_p = {match.pulse.T_p:.3f} s" in drawn.caption


def test_figures_of_a_pulse_say_if_it_is_not_told_from_noise(
    record: Record, matches: dict[str, PulseMatch]
) -> None:
    match = matches["antisymmetric_ricker"]
    words = pulse_words(NOISE.verdict, NOISE.p_value)
    assert words == "best match, could be noise (p = 0.32)"
    drawn = draw_record_and_pulse([(record, match, NOISE)], ["Shake"])
    legend = drawn.figure.axes[0].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [words]
    assert words in drawn.caption
    history = xr.Dataset(
        {
            "theta": ("time", np.zeros(TIME.size)),
            "u": ("time", np.zeros(TIME.size)),
            "v": ("time", np.zeros(TIME.size)),
            **dict.fromkeys(("peak_rotation_ratio", "verdict"), 0.0),
            "slenderness": 0.2,
            "overturning_time": np.nan,
            "structure": "column",
        },
        coords={"time": TIME},
    )
    figure = draw_response_history(record.acceleration, match, [history], "Shake", tested=words)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    assert words in legend.get_texts()[-1].get_text().splitlines()


def test_scalogram_is_darkest_where_the_cross_is(
    record: Record, matches: dict[str, PulseMatch]
) -> None:
    drawn = draw_scalogram(record, OPTIONS)
    axes = drawn.figure.axes[0]
    (mesh,) = (c for c in axes.collections if isinstance(c, QuadMesh))
    picture = np.asarray(mesh.get_array())
    row, column = np.unravel_index(picture.argmax(), picture.shape)
    cell = np.asarray(mesh.get_coordinates())[row : row + 2, column : column + 2]
    x, y = np.asarray(axes.get_lines()[0].get_xydata())[0]
    assert x == pytest.approx(cell[..., 0].mean(), abs=0.02)
    assert y == pytest.approx(cell[..., 1].mean(), rel=0.03)
    match = matches["antisymmetric_ricker"]
    assert picture.max() == pytest.approx(match.match_index, rel=0.01)
    likeness_of_record = likeness(
        record.acceleration, record.time_step, matches, OPTIONS, record.record_id
    )
    tested = likeness_of_record["antisymmetric_ricker"]
    assert f"{pulse_words(tested.verdict, tested.p_value)}, match index" in drawn.caption


def test_best_matches_lie_on_top_of_their_curves(record: Record) -> None:
    lines = draw_match_curves(record, OPTIONS).figure.axes[0].get_lines()
    assert len(lines) == 8
    for curve, dot in zip(lines[::2], lines[1::2], strict=True):
        heights = np.asarray(curve.get_ydata())
        assert heights.max() == pytest.approx(float(np.asarray(dot.get_ydata())[0]), rel=2e-3)
        best = np.asarray(curve.get_xdata())[heights.argmax()]
        assert best == pytest.approx(float(np.asarray(dot.get_xdata())[0]), rel=0.08)
