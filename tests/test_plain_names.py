"""Names from outside reach terminal, tables, figures and pages without characters that act."""

from __future__ import annotations

import csv
import io
import re
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from openpyxl import load_workbook
from tests.conftest import examples
from tests.report.test_page import Parsed

import rockframe.web
from rockframe.cells import Column, plain, plain_values, write_rows
from rockframe.cli.console import PlainStream, show_json, show_rows
from rockframe.cli.main import main
from rockframe.figures.captioned import Captioned, label_of, save_captioned, styled
from rockframe.results.tables.workbook import write_workbook

#: Parts of harmless but odd names, which programs act on.
ODD: Final = (
    *(
        "$",
        "$$",
        "\\",
        "\\$",
        "\\frac{",
        "{",
        "}",
        "{{7*7}}",
        "^",
        "_",
        "%",
        "#",
        "&",
        "--",
        "-->",
        "<b>",
    ),
    *(
        "]]>",
        "[/x]",
        "[red]",
        "\x00",
        "\x07",
        "\x1b[31m",
        "\x1b]0;t\x07",
        "\x7f",
        "\x9b2J",
        "\r",
        "\n",
    ),
    *("\u2028", "\u202e", "\ufffe", "\ud800", "a" * 400, " ", "Kobe", "神戸"),
)
names = st.lists(st.sampled_from(ODD) | st.text(max_size=3), min_size=1, max_size=6).map("".join)
#: Controls, separators of lines, directions of text, lone surrogates.
ACTS: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]"
)


@given(names)
def test_a_plain_text_has_nothing_that_acts_and_keeps_all_else(name: str) -> None:
    shown = plain(name)
    assert not ACTS.search(shown)
    assert len(shown) == len(name)
    assert plain(shown) == shown
    kept = [first for first, other in zip(name, shown, strict=True) if first == other]
    assert kept == [
        letter for letter in name if not ACTS.match(letter) and letter not in "\ufdd0\ufdef"
    ]
    shown.encode()  # UTF-8 can write it


@given(names)
def test_a_terminal_shows_no_control_of_a_name(name: str) -> None:
    stream = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", PlainStream(stream))
        patch.setenv("COLUMNS", "80")
        show_rows(name, [Column("record", "name"), Column("event", "name", wraps=True)],
                  [{"name": name}, {"name": "b"}])  # fmt: skip
        show_json({"name": name})
    assert not ACTS.search(stream.getvalue())


@given(names)
def test_a_table_has_the_plain_name(name: str) -> None:
    stream = io.StringIO()
    write_rows(stream, [["event", "magnitude"], [name, 6.5]])
    assert not ACTS.search(stream.getvalue())
    _, (cell, _) = csv.reader(io.StringIO(stream.getvalue(), newline=""))
    assert cell.removeprefix("'") == plain(name).removeprefix("'")


@examples(20)
@given(names)
def test_a_workbook_can_be_written_and_read(tmp_path_factory: Any, name: str) -> None:
    path = tmp_path_factory.mktemp("book") / "book.xlsx"
    write_workbook(path, {name: [{"event": name}]})
    value = load_workbook(path).worksheets[0]["A2"].value
    assert not ACTS.search(str(value))


@examples(20)
@given(names)
def test_a_figure_shows_the_name_and_its_svg_is_xml(tmp_path_factory: Any, name: str) -> None:
    path = tmp_path_factory.mktemp("figure") / "figure.svg"
    with styled():
        figure = Figure(figsize=(4.0, 3.0))
        title = figure.suptitle(label_of(name))
        figure.subplots().set_title(f"{label_of(name)}\n$a_p$ = 0.3 g")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of glyphs that no font has
        save_captioned(Captioned(figure, name, f"Record {name}."), path)
    ET.parse(path)  # noqa: S314 -- our own picture
    assert not ACTS.search(path.read_text(encoding="utf-8"))
    assert not ACTS.search(path.with_suffix(".caption.txt").read_text(encoding="utf-8"))
    assert not is_math_text(title.get_text())
    first = plain(name).splitlines()[0] if plain(name) else ""
    if len(first) <= 100:
        assert title.get_text().replace("\\$", "$").startswith(first)


@given(names)
def test_a_page_has_the_name_as_text_in_its_words_and_facts(name: str) -> None:
    home = Path(rockframe.web.__file__).parents[1] / "report"
    page = rockframe.web.render_still(home, "still.html", title=name, comparison=EMPTY)
    ours = rockframe.web.render_still(home, "still.html", title="T", comparison=EMPTY)
    assert not ACTS.search(page)
    read = Parsed(page)
    assert [tag for tag, _ in read.tags] == [tag for tag, _ in Parsed(ours).tags]
    assert plain(name).strip() in read.words
    assert not ACTS.search(plain_values({"event": [name]})["event"][0])  # the facts of a page


EMPTY: Final[dict[str, Any]] = {
    "designs": [], "records": 0, "panels": [], "size": (1.0, 1.0, 1.0, 1.0), "legend": "",
    "design_columns": [], "best": [], "best_columns": [], "rows": [], "columns": [], "total": 0,
    "left_out_words": "", "note": "",
}  # fmt: skip


def test_a_run_with_an_odd_catalogue_ends_and_shows_no_control(
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    capsys: pytest.CaptureFixture[str],
) -> None:
    samples = 4.0 * np.sin(2.0 * np.pi * 0.01 * np.arange(600))
    np.savetxt(tmp_path / "shake.csv", samples, fmt="%.6f")
    event, station = "E $\\frac{1$ {{7*7}} \x1b[31mred\x07", "$S$\x01"
    (tmp_path / "catalogue.csv").write_text(
        "file,event,station,network,magnitude,epicentral_distance_km,source\n"
        f'shake.csv,"{event}","{station}",,6.0,10.0,"mine $\x1b"\n'
    )
    (tmp_path / "column.toml").write_text(
        '[[structure]]\nname = "column"\nheight_m = 3.0\nwidth_m = 0.4\n'
    )
    words = ["table1", "--records", str(tmp_path), "--structures", str(tmp_path / "column.toml")]
    words += ["--units", "m/s2", "--time-step-s", "0.01", "--workers", "0", "--margins", "first"]
    folder = tmp_path_factory.mktemp("odd") / "run"
    assert main([*words, "--output", str(folder)]) == 0
    assert main(["report", str(folder)]) == 0
    assert main(["show", str(folder), "shake"]) == 0
    told = capsys.readouterr()
    assert "$S$" in told.out
    assert not ACTS.search(told.out + told.err)
    for name in ("table.csv", "records.csv", "summary.csv", "report.html"):
        with (folder / name).open(encoding="utf-8", newline="") as stream:
            assert not ACTS.search(stream.read()), name
    assert list((folder / "figures").glob("*.png"))
