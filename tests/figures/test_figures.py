"""Figures: curves compared with formulas in this file, captions, reproducible bytes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from rockframe.errors import InputError, ParameterError
from rockframe.figures.captioned import Captioned, caption_path, save, save_captioned, styled
from rockframe.figures.histories import draw_response_grid, draw_response_history
from rockframe.figures.joints import draw_joints, draw_moment_rotation, draw_phase_portrait
from rockframe.figures.parameters import draw_equivalent_size, draw_restitution
from rockframe.frame import RockingFrame
from rockframe.matching.match import PulseMatch
from rockframe.parts import Abutment, Tendon
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration, Response, column_forces, reactions, respond
from rockframe.rocking.contact import uplift_friction_demand, with_contact
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse

BENT = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, name="bent")
COLUMN = RockingFrame(height=3.0, width=0.4, name="column")


def shake(a_p: float = 0.5) -> Record:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=a_p * GRAVITY, T_p=1.5, time=5.0)
    time = 0.01 * np.arange(1500)
    return Record(record_id="shake", acceleration=pulse.acceleration(time), time_step=0.01)


def axes_of(drawn: Captioned) -> list[Axes]:
    return list(drawn.figure.axes)


def curve(axes: Axes, number: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = axes.get_lines()[number].get_data()
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)


# Curves


def test_figure_5_is_eqs_27_to_29() -> None:
    (axes,) = axes_of(draw_equivalent_size())
    gamma, size = curve(axes, 0)
    assert_allclose(size, (1.0 + 3.0 * gamma) / (1.0 + 2.0 * gamma), rtol=1e-14)
    assert_allclose(curve(axes, 1)[1], 1.5, rtol=1e-14)
    assert_allclose(curve(axes, 2)[1], size**-0.5, rtol=1e-14)
    assert "gamma" in axes.get_xlabel()


def test_figure_7_is_eq_43_and_ends_at_zero() -> None:
    (axes,) = axes_of(draw_restitution())
    for number, gamma in enumerate((0.0, 0.25, 1.0, 4.0, 1e12)):
        degrees, restitution = curve(axes, number)
        alpha = np.radians(degrees)
        printed = 1.0 - 1.5 * np.sin(alpha) ** 2 + 3.0 * gamma * np.cos(2.0 * alpha)
        assert_allclose(restitution, printed / (1.0 + 3.0 * gamma), atol=1e-11)
        assert restitution[-1] == 0.0
    assert "degrees" in axes.get_xlabel()


def test_figure_11_has_a_column_for_each_record() -> None:
    records = [Record(**(vars(shake(a)) | {"record_id": f"r{a}"})) for a in (0.3, 0.5, 0.6, 0.4)]
    responses = [respond(BENT, record) for record in records]
    drawn = draw_response_grid(records, responses, [record.record_id for record in records])
    shown = [axes for axes in axes_of(drawn) if axes.get_visible() and axes.get_lines()]
    assert len(shown) == 4 * len(records)
    assert_allclose(curve(shown[0], 0)[1], records[0].acceleration / GRAVITY, rtol=1e-14)
    peak = f"{responses[1].peak_rotation_ratio:.3f}"
    assert f"r0.5: stands, θ/α {peak}" in drawn.caption


def test_figure_11_draws_a_falling_frame_no_further() -> None:
    record = shake(1.5)
    response = respond(COLUMN, record)
    drawn = draw_response_grid([record], [response], [""])
    assert "shake: overturns " in drawn.caption
    ratio = curve(axes_of(drawn)[1], 0)[1]
    assert 1.0 < np.abs(ratio).max() <= 1.3
    whole = response.theta / COLUMN.slenderness
    assert_allclose(ratio, whole[: ratio.size], rtol=1e-12)
    assert not abs(whole[ratio.size]) <= 1.3  # the next sample is beyond, or not computed


def test_figure_11_says_when_a_bridge_reaches_its_abutment() -> None:
    """Until the deck moves by the gap, the response is that without an abutment."""
    record, free = shake(), respond(BENT, shake())
    gap = 0.5 * free.peak_u
    bridge = replace(BENT, abutment=Abutment(gap=gap))
    drawn = draw_response_grid([record], [respond(bridge, record)], [""])
    reached = free.time[np.argmax(np.abs(free.u) >= gap)]
    assert f"shake: stands; gap closes {reached:.1f} s" in drawn.caption


def test_figure_11_says_when_a_tendon_yields_and_the_lift_is_exceeded() -> None:
    """The first of the events is stated."""
    tendon = Tendon(area=1e-4, modulus=195e9, length=9.6, prestress=1e5)
    tied = respond(replace(BENT, column_mass=48e3, tendon=tendon), shake())
    assert tied.restraint is not None
    yielding = replace(tied, restraint=replace(tied.restraint, tendon_yields=5.0))
    for response, end in (
        (tied, ""),
        (yielding, "; tendon yields 5.0 s"),
        (replace(yielding, lift_exceeded_time=4.0), "; lift exceeded 4.0 s"),
    ):
        drawn = draw_response_grid([shake()], [response], [""])
        assert f"shake: stands{end}, θ/α" in drawn.caption


def test_moment_falls_from_one_at_uplift_to_zero_at_the_slenderness() -> None:
    (axes,) = axes_of(draw_moment_rotation(shake(), BENT))
    rotation, moment = curve(axes, 1)
    alpha = BENT.slenderness
    right = rotation > 1e-9
    expected = np.sin(alpha * (1.0 - rotation[right])) / np.sin(alpha)
    assert_allclose(moment[right], expected, atol=1e-12)


def test_portrait_marks_each_impact_and_the_barrier() -> None:
    (axes,) = axes_of(draw_phase_portrait(shake(), BENT))
    _, before = curve(axes, 3)
    _, after = curve(axes, 4)
    assert before.size == respond(BENT, shake()).impacts
    assert_allclose(after, BENT.restitution * before, rtol=1e-14)
    rotation, barrier = curve(axes, 1)
    upright = 2.0 * np.sin(0.5 * BENT.slenderness) / BENT.slenderness
    assert_allclose(barrier[np.argmin(np.abs(rotation))], upright, rtol=1e-12)
    assert np.isnan(barrier[np.abs(rotation) > 1.0]).all()


def test_a_fall_does_not_flatten_what_came_before() -> None:
    strong = shake(1.5)
    assert respond(COLUMN, strong).peak_rotation_ratio > 5.0
    for drawn in (draw_phase_portrait(strong, COLUMN), draw_moment_rotation(strong, COLUMN)):
        assert max(axes_of(drawn)[0].get_xlim()) <= 1.5
        assert "it overturns at" in drawn.caption


def test_joints_show_both_bounds_and_say_whether_they_hold() -> None:
    drawn = draw_joints(shake(), BENT, friction=0.5, spacing=12.0, beam_centre=1.0)
    levels = [curve(axes, i)[1] for axes in axes_of(drawn)[1:] for i in range(len(axes.lines))]
    constant = {float(y[0]) for y in levels if np.ptp(y) == 0.0}
    for bound in (0.5, 1.0 / 6.0, 0.0):
        assert any(np.isclose(level, bound, atol=1e-15) for level in constant)
    assert "the assumption of no sliding holds" in drawn.caption
    assert "the assumption of no lift-off holds" in drawn.caption
    each = column_forces(respond(BENT, shake()), shake(), spacing=12.0, beam_centre=1.0)
    most = np.nanmax(each.top_friction_demand)
    assert f"one joint under the beam {most:.3f}" in drawn.caption
    least = np.nanmin(each.top_vertical) / BENT.mass_ratio
    assert f"the beam on one column {least:.3f}" in drawn.caption
    assert "no sliding does not hold" in draw_joints(shake(), BENT, friction=0.18).caption


@pytest.mark.parametrize("spacing", [None, 12.0])
def test_legends_of_joints_are_above_their_panels_and_no_wider(spacing: float | None) -> None:
    """Forces on each column add names to the legend."""
    drawn = draw_joints(shake(), BENT, spacing=spacing)
    drawn.figure.draw_without_rendering()
    legends = [(axes, axes.get_legend()) for axes in axes_of(drawn) if axes.get_legend()]
    assert len(legends) == 2
    for axes, legend in legends:
        assert legend is not None
        box, panel = legend.get_window_extent(), axes.get_window_extent()
        assert box.y0 >= panel.y1
        for text in legend.get_texts():
            assert text.get_window_extent().x1 <= panel.x1


def test_joints_of_columns_too_close_say_that_the_beam_lifts() -> None:
    close = draw_joints(shake(), BENT, spacing=1.7, beam_centre=3.0)
    assert "no lift-off does not hold" in close.caption


def test_joints_of_a_column_alone_have_no_top() -> None:
    drawn = draw_joints(shake(0.2), COLUMN)
    assert "under the beam" not in drawn.caption.split(";")[0]
    with pytest.raises(ParameterError, match="is a column alone"):
        draw_joints(shake(0.2), COLUMN, spacing=5.0)


def test_a_joint_that_nothing_presses_slides_whatever_its_friction() -> None:
    falls = Record(
        record_id="drop",
        acceleration=np.concatenate([[0.0], np.full(300, 20.0)]),
        time_step=0.01,
    )
    demand = reactions(respond(COLUMN, falls), falls).base_friction_demand
    assert np.isinf(np.nanmax(demand))
    drawn = draw_joints(falls, COLUMN, friction=100.0)
    assert "no sliding does not hold" in drawn.caption
    assert "no lift-off does not hold" in drawn.caption
    assert "it overturns at" in drawn.caption


def test_a_frame_at_rest_can_be_drawn() -> None:
    quiet = shake(0.01)
    assert "0 impacts, no uplift" in draw_phase_portrait(quiet, BENT).caption
    assert "0 impacts, no uplift" in draw_joints(quiet, BENT).caption


def test_a_frame_at_rest_needs_the_friction_of_neither_uplift_nor_impacts() -> None:
    """A body fixed to the ground needs a / g; at uplift it would need b / h = 1 / 6."""
    quiet = shake(0.1)
    caption = draw_joints(quiet, BENT, friction=0.12).caption
    at_most = np.abs(quiet.acceleration).max() / GRAVITY
    assert f"all base joints together {at_most:.3f}" in caption
    assert "no sliding holds" in caption
    assert "uplift, tan" not in caption
    assert "each impact" not in caption


def test_joints_say_where_the_friction_is_from() -> None:
    rough = replace(BENT, friction_coefficient=0.4)
    said = "coefficient of 0.4, stated by the structure, the assumption"
    assert said in draw_joints(shake(), rough).caption
    assert "coefficient of 0.3, assumed, the" in draw_joints(shake(), rough, friction=0.3).caption
    assert "coefficient of 0.5, assumed and not measured" in draw_joints(shake(), BENT).caption


def test_forces_of_joints_over_the_static_ones_include_the_prestress() -> None:
    """They are those of `response.nc` and the tables; in kN, the joint carries the prestress."""
    tendon = Tendon(area=1e-4, modulus=195e9, prestress=1e5)
    tied = replace(BENT, column_mass=48e3, tendon=tendon)
    drawn = draw_joints(shake(), tied)
    contact = with_contact(respond(tied, shake()), shake()).contact
    assert contact is not None
    least = f"all base joints together {contact.least_base_vertical:.3f}"
    assert f"with the prestress of tendons: {least}" in drawn.caption
    at_rest = (5.0 * 48e3 * GRAVITY + 1e5) / 1000.0
    assert_allclose(curve(axes_of(drawn)[2], 0)[1][0], at_rest, rtol=1e-12)


def test_the_friction_at_uplift_is_that_of_a_prestressed_joint() -> None:
    """It is the largest demand of a ramp that ends at the uplift acceleration."""
    tied = replace(BENT, column_mass=48e3, tendon=Tendon(area=1e-4, modulus=195e9, prestress=1e6))
    ramp = np.linspace(0.0, tied.uplift_acceleration, 101)
    still = Record(record_id="ramp", acceleration=0.999999 * ramp, time_step=0.01)
    response = respond(tied, still)
    demand = np.nanmax(reactions(response, still).base_friction_demand[:101])
    assert uplift_friction_demand(tied) == pytest.approx(demand, rel=1e-5)
    assert uplift_friction_demand(BENT) == pytest.approx(1.0 / 6.0, rel=1e-14)


def test_vertical_motion_presses_the_joints() -> None:
    ground = GroundAcceleration.from_samples(shake().acceleration, 0.01)
    upwards = GroundAcceleration.from_samples(shake(0.3).acceleration, 0.01)
    without = draw_joints(shake(), BENT)
    lifted = draw_joints(shake(), BENT, ground.with_vertical(upwards))
    least = [curve(axes_of(drawn)[2], 0)[1].min() for drawn in (lifted, without)]
    assert least[0] < least[1]
    assert "shake, with its vertical motion" in lifted.caption
    assert "shake, without its vertical motion" in without.caption


def history(name: str, lift: float, response: Response) -> xr.Dataset:
    """Return the history of a structure with a multiple of the uplift of a response."""
    return xr.Dataset(
        {
            "theta": ("time", response.theta),
            "u": ("time", response.u),
            "v": ("time", lift * response.v),
            "verdict": 1.0,
            "peak_rotation_ratio": response.peak_rotation_ratio,
            "slenderness": response.frame.slenderness,
            "overturning_time": np.nan,
            "structure": name,
        },
        coords={"time": response.time},
    )


def test_structures_that_lift_off_have_panels_of_one_scale_for_their_uplift() -> None:
    response = respond(BENT, shake())
    histories = [history(f"s{k}", lift, response) for k, lift in enumerate((1.0, 0.0, 3.0))]
    figure = draw_response_history(shake().acceleration, None, histories, "Shake")
    _, rotation, *uplift, drift = figure.axes
    assert len(rotation.get_legend_handles_labels()[0]) == 3
    assert len(drift.get_lines()) == 3
    assert [panel.texts[0].get_text() for panel in uplift] == ["uplift of s0", "uplift of s2"]
    for panel, k in zip(uplift, (0, 2), strict=True):
        (line,) = panel.get_lines()
        assert_allclose(curve(panel, 0)[1], 100.0 * histories[k]["v"].values)
        assert line.get_color() == drift.get_lines()[k].get_color()
        assert panel.get_ylim() == uplift[0].get_ylim()
    assert uplift[0].get_ylim()[1] >= 300.0 * response.peak_v


@pytest.mark.parametrize("lifts", [(1.0,), (0.0, 0.0), (1.0, 0.0)])
def test_one_uplift_has_one_panel(lifts: tuple[float, ...]) -> None:
    response = respond(BENT, shake())
    histories = [history(f"s{k}", lift, response) for k, lift in enumerate(lifts)]
    figure = draw_response_history(shake().acceleration, None, histories, "Shake")
    assert len(figure.axes) == 4
    assert len(figure.axes[2].get_lines()) == len(lifts)


@pytest.mark.parametrize("size", [1e-5, 1.0, 30.0])
def test_numbers_do_not_reach_the_labels_of_their_axes(size: float) -> None:
    response = respond(BENT, shake())
    drawn = history("s", size, response).assign({"u": ("time", size * response.u)})
    figure = draw_response_history(size * shake().acceleration, None, [drawn], "Shake")
    figure.draw_without_rendering()
    lefts = [panel.yaxis.label.get_window_extent().x1 for panel in figure.axes]
    assert max(lefts) == pytest.approx(min(lefts), abs=0.5)  # the labels are aligned
    for panel, left in zip(figure.axes, lefts, strict=True):
        assert left < min(label.get_window_extent().x0 for label in panel.get_yticklabels())


@pytest.mark.parametrize("a_p", [0.1, 9.0])
def test_zero_is_in_the_middle_of_the_ground(a_p: float) -> None:
    """Both the record and the pulse are within the panel, whichever is stronger."""
    record, pulse = shake(), Pulse(wavelet="symmetric_ricker", a_p=a_p, T_p=1.5, time=5.0)
    match = PulseMatch(pulse=pulse, match_index=0.9, at_period_bound=False)
    histories = [history("s", 1.0, respond(BENT, record))]
    panel = draw_response_history(record.acceleration, match, histories, "").axes[0]
    low, high = panel.get_ylim()
    largest = max(a_p, float(np.abs(record.acceleration).max())) / GRAVITY
    assert -low == high
    assert largest < high < 1.5 * largest
    time, drawn = curve(panel, 1)  # the whole pulse
    assert (time[0] + time[-1], np.abs(drawn).max()) == pytest.approx(
        (10.0, a_p / GRAVITY), rel=1e-3
    )
    assert np.abs(drawn[[0, -1]]).max() < 0.01 * a_p / GRAVITY


def test_the_legend_of_the_ground_covers_no_trace() -> None:
    pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * GRAVITY, T_p=1.5, time=5.0)
    match = PulseMatch(pulse=pulse, match_index=0.9, at_period_bound=False)
    figure = draw_response_history(
        shake().acceleration, match, [history("s", 1.0, respond(BENT, shake()))], "A title",
        tested="best match, could be noise (p = 0.32)",
    )  # fmt: skip
    figure.draw_without_rendering()
    legend = figure.axes[0].get_legend()
    assert legend is not None
    box = legend.get_window_extent()
    assert box.y0 >= figure.axes[0].get_window_extent().y1
    title = next(text for text in figure.texts if text.get_text() == "A title")
    assert not box.overlaps(title.get_window_extent())


# Files

ENDINGS = ("png", "pdf", "svg")
formats = pytest.mark.parametrize("ending", ENDINGS)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a subfolder for each format: a figure and its caption."""
    folder = tmp_path_factory.mktemp("figures")
    for ending in ENDINGS:
        (folder / ending).mkdir()
        save_captioned(draw_restitution(), folder / ending / f"one.{ending}")
    return folder


@formats
def test_the_same_figure_has_the_same_bytes(folder: Path, tmp_path: Path, ending: str) -> None:
    written = (folder / ending / f"one.{ending}").read_bytes()
    path = tmp_path / f"two.{ending}"
    assert save_captioned(draw_restitution(), path) == caption_path(path)
    assert path.read_bytes() == written
    assert b"Matplotlib v" not in written


@formats
def test_the_caption_is_in_the_file_and_beside_it(folder: Path, ending: str) -> None:
    drawn, path = draw_restitution(), folder / ending / f"one.{ending}"
    beside = caption_path(path)
    assert beside.read_text(encoding="utf-8") == f"{drawn.title}. {drawn.caption}\n"
    assert drawn.title.encode() in path.read_bytes()
    if ending == "svg":
        assert drawn.caption in path.read_text(encoding="utf-8")


def test_another_format_is_refused(tmp_path: Path) -> None:
    drawn = draw_equivalent_size()
    with pytest.raises(InputError, match=r"Must end in \.png, \.pdf or \.svg"):
        save_captioned(drawn, tmp_path / "figure.bmp")
    assert not list(tmp_path.iterdir())


def test_a_saved_figure_is_that_of_matplotlib_drawn_once_instead_of_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Matplotlib draws a figure with a layout once more to find the layout."""
    drawings: list[Figure] = []
    draw = Figure.draw

    def noted(self: Figure, renderer: RendererBase) -> None:
        drawings.append(self)
        draw(self, renderer)

    monkeypatch.setattr(Figure, "draw", noted)
    figure = draw_restitution().figure
    save(figure, tmp_path / "ours.png")
    ours = len(drawings)
    with styled():
        figure.savefig(tmp_path / "theirs.png", dpi=150, metadata={"Software": None})
    assert (ours, len(drawings) - ours) == (1, 2)
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "theirs.png").read_bytes()
