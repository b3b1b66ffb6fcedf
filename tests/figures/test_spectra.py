"""Figures of many responses: their curves and captions agree with the datasets."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr
from matplotlib.backend_bases import MouseEvent
from matplotlib.collections import QuadMesh
from numpy.testing import assert_allclose, assert_array_equal
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.figures import spectra
from rockframe.figures.captioned import Captioned
from rockframe.figures.margins import draw_stability_map
from rockframe.figures.spectra import (
    draw_drift_by_size,
    draw_overturning_spectra,
    draw_record_spectrum,
    draw_rocking_spectrum,
    draw_selection,
)
from rockframe.frame import RockingFrame
from rockframe.parts import Tendon, inertia_ratio_of
from rockframe.record import Record
from rockframe.results.response import rocking_spectrum_dataset, spectrum_dataset
from rockframe.rocking import (
    GroundAcceleration,
    Verdict,
    overturning_spectrum,
    respond,
    rocking_spectrum,
)
from rockframe.selection.target import TargetSpectrum
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")


@pytest.fixture(scope="module")
def spectrum() -> xr.Dataset:
    pulses = [
        Pulse(wavelet=name, a_p=1.0, T_p=1.0)
        for name in ("symmetric_ricker", "antisymmetric_ricker")
    ]
    ratios, amplitudes = np.linspace(2.0, 8.0, 7), np.linspace(1.0, 12.0, 45)
    asked = (np.radians([10.0, 14.0]), [0.0, 1e15], ratios, amplitudes)
    return spectrum_dataset(overturning_spectrum(pulses, *asked))


def test_figure_9_has_a_panel_for_each_pulse_and_slenderness(spectrum: xr.Dataset) -> None:
    drawn = draw_overturning_spectra(spectrum)
    titles = [axes.get_title(loc="left") for axes in drawn.figure.axes]
    assert titles == [
        "symmetric, 10°",
        "antisymmetric, 10°",
        "symmetric, 14°",
        "antisymmetric, 14°",
    ]
    for axes, place in zip(drawn.figure.axes, [(0, 0), (1, 0), (0, 1), (1, 1)], strict=True):
        for k, line in enumerate(axes.get_lines()):
            least = spectrum["minimum_overturning_amplitude"].values[(*place, k)]
            assert_array_equal(line.get_ydata(), least)
        (image,) = axes.get_images()
        overturning = spectrum["overturning"].values[(*place, 0)]
        assert_array_equal(image.get_array(), overturning.T)


@pytest.fixture(scope="module")
def column() -> xr.Dataset:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
    asked = (np.radians([10.0]), [0.0], np.linspace(2.0, 8.0, 80), np.linspace(1.0, 12.0, 12))
    return spectrum_dataset(overturning_spectrum([pulse], *asked))


def test_a_curve_of_many_points_leaves_its_panel_at_the_top(column: xr.Dataset) -> None:
    """Unless the pulse overturns the column at the last ratio too."""
    ratio, least = column["frequency_ratio"].values, column["minimum_overturning_amplitude"]
    above = int(np.argmin(np.isfinite(least.values)))  # the first ratio at which nothing overturns
    for last, leaves in ((80, True), (above + 1, True), (above, False)):
        (axes,) = draw_overturning_spectra(column.isel(frequency_ratio=slice(last))).figure.axes
        (line,) = axes.get_lines()
        x, y = (np.asarray(data) for data in line.get_data())
        assert_array_equal(y[:above], least.values.ravel()[:above])
        assert x.size == above + leaves
        if leaves:
            assert y[-1] == axes.get_ylim()[1] == 12.0
            assert ratio[above - 1] < x[-1] < ratio[above]


def test_fewer_than_thirty_points_are_marked(column: xr.Dataset) -> None:
    """They are far apart, and their curve is not drawn beyond the last of them."""
    for number, mark in ((29, "."), (30, "")):
        some = column.isel(frequency_ratio=slice(80 - number, 80))
        (axes,) = draw_overturning_spectra(some).figure.axes
        (line,) = axes.get_lines()
        assert line.get_marker() == mark
        assert np.isfinite(np.asarray(line.get_ydata())[-1]) == (mark == "")


def test_map_of_unevenly_spaced_points_has_its_cells_around_them() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
    ratios = np.asarray([1.0, 2.0, 2.5, 7.0])
    asked = ([pulse], np.radians([14.0]), [0.0], ratios, np.linspace(1.0, 12.0, 23))
    drawn = draw_overturning_spectra(spectrum_dataset(overturning_spectrum(*asked)))
    axes = drawn.figure.axes[0]
    (image,) = axes.get_images()
    for x, column in ((1.49, 0), (1.51, 1), (2.26, 2), (4.7, 2), (4.8, 3)):
        pointed = cast(MouseEvent, SimpleNamespace(xdata=x, ydata=6.0))
        assert image.get_cursor_data(pointed) == np.asarray(image.get_array())[10, column]
    assert axes.get_xlim() == (0.5, 9.25)


def test_figure_9_names_the_limit_and_what_may_be_missed(spectrum: xr.Dataset) -> None:
    drawn = draw_overturning_spectra(spectrum)
    labels = [text.get_text() for text in drawn.figure.legends[0].get_texts()]
    assert labels[:2] == ["γ = 0", "γ → ∞"]
    assert "map of 7 x 45 responses" in drawn.caption
    assert "thinner than 0.25 may be missed" in drawn.caption


def shaking() -> Record:
    time = 0.02 * np.arange(400)
    wave = 3.0 * np.sin(4.0 * time) * np.exp(-((time - 4.0) ** 2))
    return Record(record_id="shaking", acceleration=wave, time_step=0.02)


def test_rocking_spectra_have_gaps_where_the_frame_overturns() -> None:
    spectra = rocking_spectrum([shaking()], [0.1, 0.2], [0.0], np.linspace(1.0, 12.0, 12))
    drawn = draw_rocking_spectrum(rocking_spectrum_dataset(["shaking"], spectra))
    fallen = spectra.verdict[0, :, 0] == Verdict.OVERTURNS
    assert fallen.any()
    assert not fallen.all()
    for axes, peaks in zip(
        drawn.figure.axes, (spectra.peak_rotation_ratio, spectra.peak_velocity), strict=True
    ):
        for k in range(2):
            values = np.asarray(axes.get_lines()[k].get_ydata(), dtype=np.float64)
            assert_array_equal(np.isnan(values), fallen[k])
            assert_array_equal(values[~fallen[k]], peaks[0, k, 0][~fallen[k]])
    assert "record shaking" in drawn.caption


def stability(grid: int) -> tuple[Captioned, NDArray[np.float64]]:
    """Return the map of the bent, and the verdicts that it shows: scales by heights."""
    drawn = draw_stability_map(shaking(), BENT, grid=grid)
    (mesh,) = (c for c in drawn.figure.axes[0].collections if isinstance(c, QuadMesh))
    return drawn, np.asarray(mesh.get_array())


def test_the_stability_map_is_that_of_single_responses() -> None:
    drawn, shown = stability(16)
    heights = 9.6 * np.geomspace(0.1, 4.0, 4)
    for i, height in enumerate(heights.tolist()):
        frame = RockingFrame(height=height, width=height / 6.0, mass_ratio=4.0)
        for k, scale in enumerate((1.0, 2.0, 3.0, 4.0)):
            samples = scale * shaking().acceleration
            alone = respond(frame, GroundAcceleration.from_samples(samples, 0.02))
            assert shown[k, i] == alone.verdict
    assert "Structure bent" in drawn.caption
    assert len(np.unique(shown)) > 1


def test_the_stability_map_of_round_columns_is_that_of_stated_ones() -> None:
    """The mass of a column four times as high is 64 times as large, beside an equal prestress."""
    tendon = Tendon(area=1e-4, modulus=195e9, prestress=4e6)
    inertia = inertia_ratio_of("circular", 9.6, 1.6)
    column = RockingFrame(height=9.6, width=1.6, inertia_ratio=inertia, column_mass=48e3,
                          section="circular", tendon=tendon)  # fmt: skip
    drawn = draw_stability_map(shaking(), column, grid=8)
    (mesh,) = (c for c in drawn.figure.axes[0].collections if isinstance(c, QuadMesh))
    equivalent = replace(column, height=38.4, width=6.4, column_mass=64.0 * 48e3,
                     tendon=replace(tendon, length=38.4))  # fmt: skip
    for scale, verdict in zip((2.0, 4.0), np.asarray(mesh.get_array())[:, -1], strict=True):
        samples = scale * shaking().acceleration
        assert (
            verdict == respond(equivalent, GroundAcceleration.from_samples(samples, 0.02)).verdict
        )
    assert "tendons and dissipaters keep their sections and forces" in drawn.caption


def test_small_sizes_with_too_strong_tendons_are_left_out_of_the_map() -> None:
    tendon = Tendon(area=1e-4, modulus=195e9, prestress=2e9)
    tied = replace(BENT, column_mass=48e3, tendon=tendon)
    drawn = draw_stability_map(shaking(), tied, grid=16)
    assert "smaller heights (1) are left out" in drawn.caption
    assert "columns from 3.28 to 38.4 m (3 heights)" in drawn.caption


@pytest.mark.parametrize("draw", [draw_record_spectrum, draw_drift_by_size])
def test_figures_of_free_frames_refuse_tendons_that_they_would_ignore(draw: Any) -> None:
    tendon = Tendon(area=1e-4, modulus=195e9)
    tied = replace(BENT, column_mass=48e3, tendon=tendon)
    with pytest.raises(ParameterError, match="has tendons or dissipaters"):
        draw(shaking(), tied)


def test_a_marked_frame_that_is_not_on_the_curves_is_said() -> None:
    losing = replace(BENT, restitution_factor=0.9)
    caption = draw_record_spectrum(shaking(), losing).caption
    assert "not those of bent itself: they have the restitution of eq (43)." in caption
    assert "itself" not in draw_record_spectrum(shaking(), BENT).caption


def test_similar_frames_lie_on_one_line_of_the_map() -> None:
    """A column six times as high as wide uplifts at g / 6, at any height."""
    uplift = GRAVITY / 6.0 / np.abs(shaking().acceleration).max()
    _, shown = stability(64)
    below = np.linspace(0.25, 4.0, 16) < uplift
    assert 0 < below.sum() < 16
    assert_array_equal(shown == Verdict.NO_UPLIFT, np.broadcast_to(below[:, None], (16, 16)))


def test_a_rocking_spectrum_has_the_slenderness_of_the_structure() -> None:
    """A frame of 2 m by 0.3 m has a slenderness of atan(0.15); p^2 = 3 g / (4 R), eq (3)."""
    frame = RockingFrame(height=2.0, width=0.3, mass_ratio=1.0, name="post")
    drawn = draw_record_spectrum(shaking(), frame)
    panel = drawn.figure.axes[0]
    (curve,) = (line for line in panel.get_lines() if str(line.get_label()).endswith(", post"))
    assert curve.get_label() == f"α = {np.degrees(np.arctan(0.15)):.3g}°, post"
    spectra = rocking_spectrum([shaking()], [frame.slenderness], [1.0], np.linspace(2.0, 15.0, 261))
    peaks = rocking_spectrum_dataset(["shaking"], spectra)["peak_rotation_ratio"].squeeze()
    heights = np.asarray(curve.get_ydata(), dtype=np.float64)
    stands = np.isfinite(heights)
    assert stands.sum() > 10
    assert_allclose(heights[stands], peaks.values[stands])
    radius = np.hypot(1.0, 0.15)
    period = 2.0 * np.pi / np.sqrt(0.75 * 9.81 / radius)
    marked = [np.asarray(line.get_xdata(), dtype=np.float64) for line in panel.get_lines()]
    assert any(x.size == 2 and np.allclose(x, period) for x in marked)
    assert f"{period:.3g} s" in drawn.caption


def test_a_slenderness_of_the_figure_is_drawn_once() -> None:
    frame = RockingFrame(height=2.0, width=2.0 * np.tan(np.radians(10.0)), mass_ratio=1.0)
    labels = draw_record_spectrum(shaking(), frame).figure.axes[0].get_legend_handles_labels()[1]
    assert [label.split("°")[0] for label in labels] == ["α = 6", "α = 10", "α = 14", "α = 20"]


def test_drift_of_large_columns_depends_on_the_slenderness_alone() -> None:
    """As theta/alpha vanishes, u'' = -(3/2) cos(alpha) (g sin(alpha) sgn(u) + a_g cos(alpha))."""
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.6 * GRAVITY, T_p=0.5, time=1.0)
    drifts = [respond(RockingFrame(height=h, width=h / 4.0), pulse).peak_u for h in (200.0, 800.0)]
    assert drifts[0] == pytest.approx(drifts[1], rel=1e-3)
    assert drifts[1] > 0.05


def test_drift_by_size_is_the_median_over_records_and_scales(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(spectra, "_HEIGHTS", np.array([2.5, 80.0]))
    monkeypatch.setattr(spectra, "_SCALES", np.array([0.8, 1.0, 1.25]))
    samples = Pulse(wavelet="symmetric_ricker", a_p=0.4 * GRAVITY, T_p=1.0, time=1.0).acceleration(
        0.01 * np.arange(300)
    )
    records = [
        Record(record_id=name, acceleration=factor * samples, time_step=0.01)
        for name, factor in (("one", 1.0), ("two", 1.3))
    ]
    drawn = draw_drift_by_size(records, BENT)
    above, below = drawn.figure.axes
    labels = [line.get_label() for line in above.get_lines()]
    assert labels[:4] == ["α = 8°", "α = 9.46°, bent", "α = 11°", "α = 14°"]
    for k, height in enumerate((2.5, 80.0)):
        frame = RockingFrame(height=height, width=height * 1.6 / 9.6, mass_ratio=4.0)
        responses = [
            respond(frame, record.scaled(scale)) for record in records for scale in (0.8, 1.0, 1.25)
        ]
        fell = [response.verdict is Verdict.OVERTURNS for response in responses]
        drifts = [
            np.inf if f else response.peak_u for f, response in zip(fell, responses, strict=True)
        ]
        expected = np.median(drifts) if np.isfinite(np.median(drifts)) else np.nan
        assert_allclose(np.asarray(above.get_lines()[1].get_ydata())[k], expected)
        assert_allclose(np.asarray(below.get_lines()[1].get_ydata())[k], np.mean(fell))
    assert np.mean(np.asarray(below.get_lines()[1].get_ydata())) > 0.0
    assert "α = 8°: from 80 m on, where at most 10 % overturn, the median is within 0 %" in (
        drawn.caption
    )


def test_selected_spectra_are_drawn_with_their_median_and_the_target() -> None:
    """Two motions a factor e above and below the target: the median is the target, and one standard
    deviation of the two is sqrt(2) in ln Sa.
    """
    period, mean = np.array([0.2, 1.0, 2.0]), np.log(np.array([6.0, 3.0, 1.0]))
    target = TargetSpectrum(period, mean, np.diag([0.25, 0.0, 0.25]), "mine.csv", 1.0, 1.0)
    drawn = draw_selection(target, np.stack([mean - 1.0, mean + 1.0]))
    (panel,) = drawn.figure.axes
    curves = [np.asarray(line.get_ydata()) for line in panel.get_lines()]
    medians = [curve for curve in curves if curve.shape == mean.shape][-2:]
    assert_allclose(medians, np.exp([mean, mean]) / GRAVITY)
    spreads = {np.round(np.log(curve * GRAVITY) - mean, 6)[0] for curve in curves[2:6]}
    assert spreads == {-1.414214, 1.414214, -0.5, 0.5}
    assert drawn.caption.startswith("Pseudo-spectral acceleration, 5 % damped, of 2 scaled motions")
    assert "mine.csv. The dotted line marks 1 s" in drawn.caption


def test_labelled_ticks_are_a_factor_of_at_most_two_and_a_half_apart() -> None:
    """Few periods and accelerations are near a power of ten."""
    period, sa = np.array([0.2, 1.0, 6.0]), GRAVITY * np.array([1.5, 0.4, 0.03])
    target = TargetSpectrum(period, np.log(sa), None, "mine.csv")
    (panel,) = draw_selection(target, np.log([sa, sa])).figure.axes
    for axis in (panel.xaxis, panel.yaxis):
        assert np.diff(np.log(axis.get_majorticklocs())).max() < np.log(2.51)
