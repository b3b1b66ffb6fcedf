"""The report in a real browser: animation, readings, and no request to other addresses."""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest

import rockframe
from rockframe.cli.main import main

from .conftest import EVENT

SCREENSHOTS: Final = Path(__file__).parents[2] / "outputs" / "report"


def opened(page: Any, run: Path, history: int) -> None:
    """Open the report of a run at a history."""
    page.goto(f"{(run / 'report.html').as_uri()}#history-{history}")
    page.wait_for_selector(f"html[data-shown='{history}']")


def until(page: Any, quantity: str, bound: float) -> None:
    """Wait until a number of the page is above the bound."""
    values = {
        "time": "document.getElementById('at-time').dataset.value",
        "from": "document.getElementById('graphs').dataset.from",
    }
    page.wait_for_function(f"bound => Number({values[quantity]}) > bound", arg=bound)


def value(page: Any, name: str) -> float:
    return float(page.get_attribute(f"#at-{name}", "data-value"))


def scrub(page: Any, sample: int) -> None:
    page.locator("#scrub").evaluate(
        "(slider, to) => { slider.value = to; slider.dispatchEvent(new Event('input')); }", sample
    )


def column(page: Any, key: str) -> list[str]:
    place = page.locator("#results thead button").evaluate_all(
        "(heads, key) => heads.findIndex(head => head.dataset.key === key)", key
    )
    cells: list[str] = page.locator("#results tbody tr:not([hidden])").evaluate_all(
        "(rows, i) => rows.map(row => row.cells[i].dataset.order ?? row.cells[i].textContent)",
        place,
    )
    return cells


def test_the_table_sorts_both_ways(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 0)
    head = page.locator("#results button[data-key=peak_rotation_ratio]")
    head.click()
    ratios = [float(text) for text in column(page, "peak_rotation_ratio")]
    assert ratios == sorted(ratios)
    assert len(ratios) == 45
    head.press("Enter")
    down = [float(text) for text in column(page, "peak_rotation_ratio")]
    assert down == sorted(ratios, reverse=True)
    assert page.locator("#results th[aria-sort=descending]").count() == 1


def test_the_table_filters(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 0)
    page.fill("#filter", "clc slender")
    assert set(column(page, "structure")) == {"slender-column", "slender-frame"}
    page.select_option("#filter-verdict", "may_overturn")
    with (bundled_run / "table.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["verdict_words"].startswith("may")]
    count = sum("CLC" in row["record"] and "slender" in row["structure"] for row in rows)
    assert 1 <= count < 4
    assert column(page, "verdict") == [
        row["verdict_words"]
        for row in rows
        if "CLC" in row["record"] and "slender" in row["structure"]
    ]
    assert page.inner_text("#matches") == f"{count} of 45"


@pytest.mark.parametrize("history", [5, 8, 9])  # frame, column, overturning
def test_the_cursor_reads_what_the_file_holds(page: Any, bundled_run: Path, history: int) -> None:
    opened(page, bundled_run, history)
    with rockframe.open_response(bundled_run / "response.nc") as response:
        record = response.records[history // 5]
        expected = response.sel(record=record, structure=response.structures[history % 5])
    moving = np.flatnonzero(np.abs(expected["theta"].values) > 0.0)
    for sample in moving[:: moving.size // 5]:
        scrub(page, int(sample))
        for name in ("theta", "u", "v"):
            assert value(page, name) == float(np.float32(expected[name][sample]))
        assert value(page, "time") == pytest.approx(float(expected["time"][sample]), abs=1e-9)


@pytest.mark.parametrize("history", [5, 8])
def test_the_frame_is_drawn_where_it_is(page: Any, bundled_run: Path, history: int) -> None:
    """The drawing rotates columns about their corners; this must give u and v of the file."""
    opened(page, bundled_run, history)
    for sample in (3350, 3600, 3650):
        scrub(page, sample)
        drawn = page.locator("svg.frame").evaluate("svg => [svg.dataset.right, svg.dataset.up]")
        assert [float(x) for x in drawn] == pytest.approx(
            [value(page, "u"), value(page, "v")], abs=1e-6
        )


def test_a_fallen_frame_stays_down(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 3)
    scrub(page, 9999)
    assert page.inner_text("#at-theta") == "fallen"
    turned = page.get_attribute("svg.frame .column", "transform")
    assert abs(float(re.findall(r"rotate\((\S+) ", turned)[0])) == pytest.approx(90.0, abs=3.0)


def test_the_animation_moves_with_the_cursor(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 5)
    page.select_option("#speed", "5")
    page.select_option("#exaggeration", "5")
    turned = page.get_attribute("svg.frame .column", "transform")
    before = value(page, "time")
    page.click("#play")
    until(page, "time", before + 0.5)
    assert page.get_attribute("svg.frame .column", "transform") != turned
    page.click("#play")
    stopped = value(page, "time")
    page.wait_for_timeout(100)
    assert value(page, "time") == stopped
    assert page.input_value("#scrub") == str(round(100 * stopped))


def test_the_pointer_moves_the_cursor_and_zooms_all_plots(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 5)
    over = page.locator("#plot-u .u-over")
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    middle = box["y"] + 0.5 * box["height"]
    start, end = window(page)
    page.mouse.move(box["x"] + 0.25 * box["width"], middle)
    assert value(page, "time") == pytest.approx(start + 0.25 * (end - start), abs=0.1)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], middle, steps=5)
    page.mouse.up()
    until(page, "from", start + 1.0)
    zoomed = window(page)
    assert zoomed == pytest.approx(
        (start + 0.25 * (end - start), start + 0.5 * (end - start)), abs=0.2
    )
    page.click("#zoom-all")
    page.wait_for_selector("#graphs[data-from='0']")


def window(page: Any) -> tuple[float, float]:
    found = page.locator("#graphs").evaluate("host => [host.dataset.from, host.dataset.to]")
    return float(found[0]), float(found[1])


def test_keys_are_enough(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 5)
    page.focus("#graphs")
    before = value(page, "time")
    page.keyboard.press("ArrowRight")
    assert value(page, "time") == pytest.approx(before + 0.01)
    page.keyboard.press("Shift+ArrowLeft")
    assert value(page, "time") == pytest.approx(before - 0.49)
    start, _ = window(page)
    page.keyboard.press("+")
    until(page, "from", start + 1.0)
    page.keyboard.press("Space")
    assert page.inner_text("#play") == "Pause"
    page.keyboard.press("Space")
    page.focus("#next")
    page.keyboard.press("Enter")
    page.wait_for_selector("html[data-shown='6']")
    assert page.locator("#results tr[aria-current]").get_attribute("data-history") == "6"


def test_what_is_saved_is_what_the_run_holds(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 3)
    with page.expect_download() as table:
        page.click("#save-table")
    assert Path(table.value.path()).read_bytes() == (bundled_run / "table.csv").read_bytes()
    with page.expect_download() as history:
        page.click("#save-history")
    rows = list(csv.DictReader(io.StringIO(Path(history.value.path()).read_text())))
    with rockframe.open_response(bundled_run / "response.nc") as response:
        expected = response.sel(record=response.records[0], structure="slender-column")
    for column_name, name in (("theta_rad", "theta"), ("u_m", "u"), ("v_m", "v")):
        saved = np.array([float(row[column_name] or "nan") for row in rows], dtype="f4")
        np.testing.assert_array_equal(saved, expected[name].values.astype("f4"))


def test_names_are_shown_and_not_run(page: Any, hostile_run: Path, tmp_path: Path) -> None:
    assert main(["report", str(hostile_run), "--output", str(tmp_path / "report.html")]) == 0
    opened(page, tmp_path, 0)
    assert EVENT in page.inner_text("#verdict-line")
    assert "under <script>" in page.inner_text("#detail-title")
    assert page.locator("img").count() == 0
    assert "rejected" in page.inner_text("#inputs")


def test_a_frame_that_never_uplifts_stands_still(
    page: Any, hostile_run: Path, tmp_path: Path
) -> None:
    assert main(["report", str(hostile_run), "--output", str(tmp_path / "report.html")]) == 0
    opened(page, tmp_path, 2)
    scrub(page, 300)
    assert "No uplift; 10 % overturn at" in page.inner_text("#verdict-line")
    assert value(page, "theta") == 0.0
    assert "rotate(0 " in page.get_attribute("svg.frame .column", "transform")


def test_the_policy_stops_a_request(browser: Any, bundled_run: Path) -> None:
    page = browser.new_page()
    opened(page, bundled_run, 0)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    refused = "address => fetch(address).then(() => false, () => true)"
    assert page.evaluate(refused, "http://127.0.0.1:9/")
    assert asked == []
    page.close()


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
    page: Any, bundled_run: Path, overlaps: str, name: str, width: int, scheme: str
) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    page.emulate_media(color_scheme=scheme)
    opened(page, bundled_run, 29)
    page.wait_for_timeout(200)
    page.screenshot(path=SCREENSHOTS / f"{name}.png", full_page=True)
    assert page.evaluate(overlaps) == []
    assert page.evaluate("document.documentElement.scrollWidth") == width
    beyond = """() => [...document.querySelectorAll('.facts table')].map((table) =>
      table.getBoundingClientRect().right - table.parentElement.getBoundingClientRect().right)"""
    assert max(page.evaluate(beyond)) < 1.0
    light = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/)[0] > 128")
    assert light == (scheme == "light")


def test_the_sheet_is_light_on_paper(page: Any, bundled_run: Path) -> None:
    page.emulate_media(color_scheme="dark")
    opened(page, bundled_run, 29)
    content = page.pdf(path=SCREENSHOTS / "print.pdf", format="A4")
    assert content.startswith(b"%PDF")
    page.emulate_media(media="print", color_scheme="dark")
    ink = "getComputedStyle(document.body).color.match(/\\d+/)[0]"
    assert int(page.evaluate(ink)) < 128
    assert not page.locator("#play").is_visible()


def test_the_plots_fit_the_sheet_and_come_back(page: Any, bundled_run: Path) -> None:
    opened(page, bundled_run, 29)
    page.set_viewport_size({"width": 688, "height": 900})  # A4 without its margins
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    beyond = """() => [...document.querySelectorAll('figure:not([hidden]) > .plot')].map(
      (host) => host.firstElementChild.getBoundingClientRect().right
        - host.getBoundingClientRect().right)"""
    assert max(page.evaluate(beyond)) < 1.0
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 1280, "height": 900})
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert max(map(abs, page.evaluate(beyond))) < 1.0


@pytest.mark.parametrize("width", [1070, 390])  # where three columns are narrowest, and a phone
def test_no_word_of_a_passport_is_broken(page: Any, bundled_run: Path, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    opened(page, bundled_run, 0)
    page.locator("#checks td:last-child").evaluate_all(
        "cells => cells.forEach((cell) => { cell.textContent = 'not measured'; })"
    )
    broken = r"""() => [...document.querySelectorAll('#checks th, #checks td')].flatMap((cell) => {
      const words = [...cell.textContent.matchAll(/\S+/g)];
      return words.filter((word) => {
        const range = document.createRange();
        range.setStart(cell.firstChild, word.index);
        range.setEnd(cell.firstChild, word.index + word[0].length);
        return range.getClientRects().length > 1;
      }).map(String);
    })"""
    assert page.locator("#checks tr").count() > 5
    assert page.evaluate(broken) == []


@pytest.mark.parametrize("width", [1400, 1070, 390])
def test_values_and_limits_have_one_line(page: Any, bundled_run: Path, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    opened(page, bundled_run, 29)
    found = page.evaluate("""() => [...document.querySelectorAll(
      '#checks td:nth-child(2), #checks td:nth-child(3), .facts dl div:not(.long) dd')]
      .map((cell) => {
        const range = document.createRange();
        range.selectNodeContents(cell);
        const inside = cell.closest('section').getBoundingClientRect().right;
        const [box] = range.getClientRects();
        return [cell.textContent, range.getClientRects().length, box.right - inside];
      })""")
    assert len(found) > 50
    assert [text for text, lines, beyond in found if lines != 1 or beyond > 1.0] == []


def test_the_table_of_results_uses_the_margins_of_the_page(page: Any, bundled_run: Path) -> None:
    page.set_viewport_size({"width": 1400, "height": 900})
    opened(page, bundled_run, 0)
    ends = """(name) => { const box = document.querySelector(name).getBoundingClientRect();
      return [box.left, box.right]; }"""
    (left, right), (first, last) = (page.evaluate(ends, name) for name in (".wide.full", "main"))
    assert 0.0 < left < first - 50.0
    assert 1400.0 > right > last + 50.0


@pytest.mark.parametrize("width", [1400, 390])
def test_the_scale_of_a_strip_is_logarithmic(page: Any, bundled_run: Path, width: int) -> None:
    """Each number stands at its tick, which is at the logarithm of the number."""
    page.set_viewport_size({"width": width, "height": 900})
    opened(page, bundled_run, 5)
    strip, numbers = page.evaluate("""() => {
      const place = (one) => {
        const box = one.getBoundingClientRect();
        return [box.left, box.right];
      };
      return [place(document.querySelector('#strip svg')),
        [...document.querySelectorAll('#margin .strip-scale span')].map((one) =>
          [one.textContent, ...place(one)])];
    }""")
    assert len(numbers) == 7
    for text, left, right in numbers[1:-1]:
        wanted = strip[0] + (strip[1] - strip[0]) * (np.log10(float(text)) + 1.0) / 2.0
        assert 0.5 * (left + right) == pytest.approx(wanted, abs=1.0)
    path = page.get_attribute("#strip .strip-tick", "d")
    ticks = [float(x) for x in re.findall(r"M(\S+) ", path)]
    scales = [10.0 ** (x / 120.0 - 1.0) for x in ticks]
    assert scales == pytest.approx([float(text) for text, *_ in numbers], rel=2e-3)
