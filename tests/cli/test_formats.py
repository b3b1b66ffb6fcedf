"""The preview of a file names what is missing, and its command reads the file."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from tests.commands import run
from tests.ingest.test_table_layout import LAYOUTS, NORTH, five_a_line, rows

#: What a user fills in for the placeholders.
FILLED = {"UNITS": "g", "SECONDS": "0.01", "NUMBER": "1", "NAME": "acc_1"}
FILES = {
    "five.txt": five_a_line(NORTH),
    "two.txt": rows(NORTH, 0.5 * NORTH),
    "title.txt": "Station A\n" + rows(NORTH),
    "named.csv": "acc_1,acc_2\n" + rows(NORTH, 0.5 * NORTH),
    "whole.csv": LAYOUTS["clock times"][0],
    "sizes.txt": LAYOUTS["title, sizes, five a line"][0],
}


@pytest.mark.parametrize("name", FILES)
def test_the_command_reads_the_file_once_its_placeholders_are_filled_in(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_text(FILES[name])
    status = run("formats", path, "--json")
    [shown] = json.loads(capsys.readouterr().out)
    assert status == bool(shown["missing"])
    assert shown["refusal"] == ""
    words = [FILLED.get(word, word) for word in shlex.split(shown["command"])]
    options = words[3 : words.index("--output")]
    assert run("formats", path, *options, "--json") == 0
    [again] = json.loads(capsys.readouterr().out)
    assert again["missing"] == []
    [record] = again["records"]
    assert (record["samples"], record["time_step_s"]) == (NORTH.size, 0.01)
    assert record["peak_g"] == pytest.approx(abs(NORTH).max(), rel=1e-6)


SHORT = NORTH[:60]
#: Values in an order that shows no series.
ROUGH = SHORT[(np.arange(60) * 23 + 7) % 60]
SECONDS = [0.01 * k for k in range(60)]
DECIDED = {
    "five values below sizes": (f"A site\n60 0.01\n{five_a_line(ROUGH)}", ["--column", "all"]),
    "times on the right": (rows(SHORT, SECONDS, separator=" "), ["--column", "1"]),
    "one acceleration of four": (
        "Time(s),Acceleration(g),Velocity(cm/s),Disp(cm)\n" + rows(SECONDS, SHORT, SHORT, SHORT),
        ["--column", "Acceleration(g)"],
    ),
    "times of another name": (
        "Zeit,Beschl\n" + rows(SECONDS, SHORT),
        ["--column", "Beschl", "--time-column", "Zeit"],
    ),
}


@pytest.mark.parametrize("name", DECIDED)
def test_of_several_columns_the_only_one_that_reads_the_file_is_shown(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.txt"
    path.write_text(DECIDED[name][0])
    run("formats", path, "--json")
    [shown] = json.loads(capsys.readouterr().out)
    words = shlex.split(shown["command"])
    given = [
        word for word in words[3 : words.index("--output")] if word not in ("--units", "UNITS")
    ]
    assert given == DECIDED[name][1]
    assert run("formats", path, *given, "--units", "g", "--json") == 0
    [again] = json.loads(capsys.readouterr().out)
    assert [record["samples"] for record in again["records"]] == [60]
    assert again["records"][0]["peak_g"] == pytest.approx(abs(SHORT).max(), rel=1e-5)


def test_other_ways_to_read_columns_are_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.txt"
    path.write_text(rows(SHORT).replace(".", ","))
    run("formats", path)
    assert "--decimal comma instead)" in capsys.readouterr().out
    path.write_text(rows(SECONDS, SHORT, SHORT, separator=" "))
    run("formats", path)
    assert "1 to 3, several with --channels" in capsys.readouterr().out


def test_a_preview_shows_first_lines_and_what_is_recognised(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "sizes.txt"
    path.write_text(FILES["sizes.txt"])
    assert run("formats", path) == 1
    printed = capsys.readouterr().out
    assert "   1 | A site\n" in printed
    assert "recognised: 1 title line, 5 values a line\n" in printed
    assert "missing: --units UNITS (g, " in printed


def test_a_file_of_no_format_has_its_reason_and_no_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "notes.dat"
    path.write_text("Two samples.\n")
    assert run("formats", path) == 1
    printed = capsys.readouterr().out
    assert "cannot be read: unknown format, begins 'Two samples.'" in printed
    assert "rockframe ingest" not in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--channels", "2=NS", "3=EW", "table.txt"], "'table.txt'. Must be a column and its"),
        (["--trust", "samples"], "--trust without a FILE. State FILE before"),
        (["--units", "g"], "--units without a FILE"),
    ],
)
def test_options_without_a_file_are_refused(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("formats", *words) == 2
    assert message in capsys.readouterr().err
    assert run("formats") == 0
