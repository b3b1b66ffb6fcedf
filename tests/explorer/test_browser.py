"""The explorer in a real browser: moving a slider draws the kernel's answer."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

from rockframe import (
    GroundAcceleration,
    PairAcceleration,
    RockingFrame,
    bent_positions,
    respond,
    respond_bent,
    wobble,
)
from rockframe.explorer.answer import ExploredMotion

from .conftest import PIERS, Address

SCREENSHOTS: Final = Path(__file__).parents[2] / "outputs" / "explorer"
#: Script that returns the largest |theta| / alpha in the data of the plot of rotation.
PLOTTED: Final = """
() => Math.max(...document.querySelector('#plot-ratio').plot.data[1].map(Math.abs))
"""


@pytest.fixture
def own_addresses(explorer: Address) -> str:
    return f"(http://127\\.0\\.0\\.1:{explorer.port}/{explorer.token}/|blob:)"


def opened(page: Any, explorer: Address) -> None:
    page.goto(explorer.page)
    page.wait_for_selector("html[data-answered]")


def settled(page: Any, act: str, argument: Any = None) -> None:
    """Run a script in the page and wait until no request is pending."""
    page.evaluate(act, argument)
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")


def slide(page: Any, name: str, to: float) -> None:
    settled(
        page,
        """([name, to]) => {
          const slider = document.getElementById(`${name}-slider`);
          slider.value = to;
          slider.dispatchEvent(new Event('input'));
        }""",
        [name, to],
    )


def choose(page: Any, name: str, value: str) -> None:
    page.select_option(f"#{name}", value)
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")


@pytest.mark.parametrize(
    ("name", "to", "changed"),
    [
        ("height", 7.0, {"height": 7.0}),
        ("width", 1.2, {"width": 1.2}),
        ("mass_ratio", 0.0, {"mass_ratio": 0.0}),
        ("restitution_factor", 0.9, {"restitution_factor": 0.9}),
        ("scale", 1.6, {}),
    ],
)
def test_a_slider_moves_the_plotted_peak_to_that_of_the_kernel(
    page: Any,
    explorer: Address,
    bundled: list[ExploredMotion],
    name: str,
    to: float,
    changed: dict[str, Any],
) -> None:
    opened(page, explorer)
    before = page.evaluate(PLOTTED)
    slide(page, name, to)
    frame = replace(RockingFrame(height=9.6, width=1.6, mass_ratio=4.0), **changed)
    record = bundled[0].record
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    expected = respond(frame, ground.scaled(to if name == "scale" else 1.0))
    plotted = page.evaluate(PLOTTED)
    assert plotted == pytest.approx(np.abs(expected.theta).max() / frame.slenderness, rel=1e-6)
    assert plotted != before
    shown = float(page.get_attribute("#pair-facts", "data-peak"))
    assert shown == pytest.approx(expected.peak_rotation_ratio, rel=1e-12)


def test_keys_move_a_slider(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    before = float(page.get_attribute("#pair-facts", "data-peak"))
    page.focus("#scale-slider")
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert page.input_value("#scale") == "1.01"
    assert float(page.get_attribute("#pair-facts", "data-peak")) != before


def test_a_field_takes_what_the_slider_has_not(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    page.fill("#height", "45")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert page.input_value("#height-slider") == "30"
    assert page.input_value("#structure") == "own"
    assert "height_m = 45" in page.inner_text("#toml")


def test_a_wrong_value_is_named_and_mended(
    page: Any, explorer: Address, complaints: list[str]
) -> None:
    opened(page, explorer)
    rotation = page.inner_text("#verdict-line").split(". ")[1]  # the margin comes later
    page.fill("#width", "wide")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert all("400 (Bad Request)" in complaint for complaint in complaints)  # from the browser
    complaints.clear()
    assert page.inner_text("#trouble") == "Invalid width 'wide'. Must be a finite number."
    assert page.get_attribute("#width", "aria-invalid") == "true"
    answers = ("#verdict-line", "#margin", "#answer")  # they would be those of another width
    assert not any(page.locator(name).is_visible() for name in answers)
    page.fill("#width", "1.6")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert not page.locator("#trouble").is_visible()
    assert page.locator("#verdict-line").is_visible()
    assert page.locator("#answer").is_visible()
    assert page.inner_text("#verdict-line").split(". ")[1] == rotation
    page.wait_for_selector("#margin:not([hidden])")


def test_the_margin_comes_once_the_settings_rest(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    page.wait_for_selector("#margin:not([hidden]) .strip-falls")
    strip = page.inner_html("#strip")
    slide(page, "scale", 1.5)
    assert "stale" in page.get_attribute("#margin", "class")
    page.wait_for_selector("#margin:not(.stale)")
    assert page.inner_html("#strip") != strip


def test_vertical_motion_where_there_is_one(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    before = page.get_attribute("#pair-facts", "data-peak")
    page.check("#vertical")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert page.get_attribute("#pair-facts", "data-peak") != before
    choose(page, "record", "Ridgecrest2019-CCC-360")
    assert page.locator("#vertical").is_disabled()
    assert page.locator("#vertical-why").is_visible()


def test_a_structure_sets_the_sliders(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    choose(page, "structure", "slender-column")
    assert page.input_value("#height-slider") == "3"
    assert page.input_value("#mass_ratio") == "0"
    slide(page, "scale", 3.0)
    assert page.input_value("#structure") == "slender-column"
    assert "overturns " in page.inner_text("#verdict-line")
    assert page.locator("svg.frame .beam").count() == 0


def test_two_unequal_columns_have_sliders_and_rock_with_their_beam(
    page: Any, explorer: Address, bundled: list[ExploredMotion], complaints: list[str]
) -> None:
    opened(page, explorer)
    choose(page, "structure", "piers")
    assert page.locator("#height_left-slider").is_visible()
    assert not page.locator("#height-slider").is_visible()
    assert not page.locator("#section").is_visible()
    slide(page, "height_right", 6.0)
    bent = replace(PIERS, heights=(9.0, 6.0))
    record = bundled[0].record
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    expected = respond_bent(bent, ground)
    balance = np.where(expected.theta > 0.0, *bent.balance_rotations)
    plotted = page.evaluate(PLOTTED)
    assert plotted == pytest.approx(np.abs(expected.theta / balance).max(), rel=1e-6)
    assert "heights_m = [9, 6]" in page.inner_text("#toml")
    assert "height of the right column" in page.inner_text("#structure-facts")
    moment = float(page.get_attribute("#at-theta", "data-value"))
    turn = float(page.get_attribute("svg.frame", "data-turn"))
    assert turn == pytest.approx(float(bent_positions(bent, moment).psi), abs=1e-6)
    assert abs(turn) > 1e-5
    page.fill("#height_left", "none")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert page.get_attribute("#height_left", "aria-invalid") == "true"
    complaints.clear()
    choose(page, "structure", "bridge-bent")
    assert page.locator("#height-slider").is_visible()
    assert not page.locator("#height_left-slider").is_visible()


def test_the_window_follows_the_rocking_until_one_is_chosen(page: Any, explorer: Address) -> None:
    def window() -> list[float]:
        return [float(page.get_attribute("#graphs", f"data-{end}")) for end in ("from", "to")]

    opened(page, explorer)
    first = window()
    choose(page, "structure", "slender-column")
    slender = window()
    assert abs(slender[1] - first[1]) > 1.0
    slide(page, "scale", 0.5)
    page.wait_for_function(
        "to => Math.abs(document.getElementById('graphs').dataset.to - to) > 1", arg=slender[1]
    )
    fitted = window()
    page.click("#zoom-in")
    page.wait_for_function(
        "to => Number(document.getElementById('graphs').dataset.to) !== to", arg=fitted[1]
    )
    chosen = window()
    slide(page, "scale", 1.0)
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert window() == chosen


def test_the_pulse_alone_is_drawn(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    before = page.get_attribute("#pair-facts", "data-peak")
    page.check("#pulse")
    page.wait_for_function("() => document.documentElement.dataset.asking === 'false'")
    assert page.get_attribute("#pair-facts", "data-peak") != before
    assert " ricker, a_p 0." in page.inner_text("#pair-facts")


def test_both_components_turn_the_tilt_and_draw_the_path_of_the_deck(
    page: Any, explorer: Address, both: ExploredMotion, complaints: list[str]
) -> None:
    """The columns are round then, and the plot of the direction is hidden under one record."""
    opened(page, explorer)
    assert page.is_hidden("#plot-phi")
    assert page.is_hidden("#deck")
    choose(page, "record", both.record.record_id)
    slide(page, "scale", 0.6)
    assert isinstance(both.ground, PairAcceleration)
    ground = replace(both.ground, z=None).scaled(0.6)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0, section="circular")
    expected = wobble(frame, ground)
    shown = float(page.get_attribute("#pair-facts", "data-peak"))
    assert shown == pytest.approx(expected.peak_rotation_ratio, rel=1e-12)
    assert page.is_visible("#deck-path svg")
    drawn = page.evaluate("() => document.querySelector('#plot-phi').plot.data[1].filter((x) => x)")
    assert min(drawn) >= -180.0
    assert max(drawn) <= 180.0
    assert page.is_disabled("#section")
    assert page.is_disabled("#pulse")
    assert 'section = "circular"' in page.inner_text("#toml")
    assert "impacts" not in page.inner_text("#pair-facts")
    page.wait_for_selector("#margin:not([hidden])")
    choose(page, "record", explorer_first(page))
    assert page.is_hidden("#plot-phi")
    assert page.is_hidden("#deck")
    assert not complaints


def explorer_first(page: Any) -> str:
    """Return the first record of the page."""
    return str(page.evaluate("() => document.querySelector('#record option').value"))


def test_names_are_shown_and_not_run(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    choose(page, "record", "long")
    assert "<script>alert(1)</script>" in page.inner_text("#record")


def test_what_is_zoomed_into_is_fetched_in_full(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    choose(page, "record", "long")
    drawn = "() => document.querySelector('#plot-ratio').plot.data[0].length"
    inside = """() => document.querySelector('#plot-ratio').plot.data[0]
      .filter(t => t >= 200 && t <= 201).length === 101"""
    assert page.evaluate(drawn) <= 12_000
    page.evaluate("document.querySelector('#plot-ratio').plot.setScale('x', {min: 195, max: 205})")
    page.wait_for_function(inside)


def test_the_frame_rocks_with_the_cursor(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    turned = page.get_attribute("svg.frame .column", "transform")
    page.focus("#graphs")
    page.keyboard.press("Shift+ArrowRight")
    assert page.get_attribute("svg.frame .column", "transform") != turned
    page.keyboard.press("Space")
    assert page.inner_text("#play") == "Pause"
    slide(page, "scale", 1.2)
    page.keyboard.press("Space")
    assert page.inner_text("#play") == "Play"


def test_the_history_can_be_saved_whole(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    with page.expect_download() as saved:
        page.click("#save-history")
    assert saved.value.suggested_filename == "Ridgecrest2019-CCC-090-bridge-bent.csv"
    assert len(Path(saved.value.path()).read_text().splitlines()) == 10_001


def test_plots_have_a_text(page: Any, explorer: Address) -> None:
    opened(page, explorer)
    said = page.get_attribute("#plot-ratio", "aria-label")
    assert re.fullmatch(
        r"Rotation over slenderness, the structure under Ridgecrest2019-CCC-090\. "
        r"Nominally stands\. The largest rotation is 0\.\d{3} of the slenderness\.",
        said,
    )


@pytest.mark.parametrize(
    ("name", "width", "scheme"),
    [
        ("light", 1280, "light"),
        ("dark", 1280, "dark"),
        ("narrow", 400, "light"),
        ("narrow-dark", 400, "dark"),
    ],
)
def test_nothing_lies_on_anything(
    page: Any, explorer: Address, overlaps: str, name: str, width: int, scheme: str
) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    opened(page, explorer)
    page.wait_for_timeout(200)
    page.screenshot(path=SCREENSHOTS / f"{name}.png", full_page=True)
    assert page.evaluate(overlaps) == []
    assert page.evaluate("document.documentElement.scrollWidth") == width
    light = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] > 128")
    assert light == (scheme == "light")
