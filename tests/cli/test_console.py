"""Tables in terminals that are narrower than the table."""

from __future__ import annotations

import math

import pytest

from rockframe.cells import Column
from rockframe.cli.console import show_rows, show_table

NAME = "Ridgecrest2019-CCC-090"


@pytest.fixture(autouse=True)
def _eighty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def printed(capsys: pytest.CaptureFixture[str], columns: list[str], row: list[str]) -> list[str]:
    show_table("", columns, [row])
    return capsys.readouterr().out.splitlines()


def test_a_title_longer_than_its_table_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    title = "Smallest height with impact velocity < 0.3 m/s for 90 %, at scale 1"
    show_table(title, ["structure", "smallest>"], [["bent", "9.6"]])
    assert capsys.readouterr().out.splitlines()[0] == title


def test_headings_are_broken_before_names_and_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    columns = ["record", *(f"a-long heading-{i}>" for i in range(4)), "verdict"]
    lines = printed(capsys, columns, [NAME, *["0.306"] * 4, "may-overturn, gap closes"])
    assert f"{NAME} 0.306 0.306 0.306 0.306 may-overturn," in [" ".join(s.split()) for s in lines]


def test_where_nothing_else_helps_a_name_is_folded_and_no_number_is_lost(
    capsys: pytest.CaptureFixture[str],
) -> None:
    lines = printed(capsys, ["record", *(f"n{i}>" for i in range(7))], [NAME, *["12345.6"] * 7])
    assert "".join(line.split()[0] for line in lines if "-" in line) == NAME
    assert sum(line.count("12345.6") for line in lines) == 7


def test_of_very_many_rows_the_first_are_shown_and_the_others_counted(
    capsys: pytest.CaptureFixture[str],
) -> None:
    show_table("", ["record", "PGA [g]>"], [[f"record-{k}", "0.1"] for k in range(201)])
    printed = capsys.readouterr().out
    assert "record-199" in printed
    assert "record-200" not in printed
    assert "1 more rows: the output files contain all rows." in printed


def test_a_record_is_named_once_and_ruled_off_the_next(capsys: pytest.CaptureFixture[str]) -> None:
    columns = [Column("record", "name", once=True), Column("u [cm]>", "u", ".1f", 100.0)]
    rows = [{"name": name, "u": u} for name, u in (("a", 0.125), ("a", math.nan), ("b", 0.5))]
    show_rows("", columns, rows, group="name")
    cells = [line.split() for line in capsys.readouterr().out.splitlines() if line.strip()]
    assert cells[2:] == [["a", "12.5"], ["–"], ["b", "50.0"]]


RESPONSE = ["record", "structure", "θ/α>", "u_max [cm]>", "critical scale>", "verdict"]


def test_names_are_broken_between_their_parts_and_columns_without_values_are_not_shown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    row = [NAME * 2, "slender-frame", "0.123", "5.0", "–", "stands; 0.63 of the motion"]
    text = "\n".join(printed(capsys, RESPONSE, row))
    assert "critical" not in text
    assert "left out" not in text
    assert {"slender-", "frame", "stands;"} <= set(text.split())


def test_a_share_keeps_its_percent_sign(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for width in range(50, 90):
        monkeypatch.setenv("COLUMNS", str(width))
        lines = printed(
            capsys, ["record", "verdict", "structure"], [NAME, "may overturn (67 %)", NAME]
        )
        assert any("(67 %)" in line for line in lines)


def test_columns_that_do_not_fit_are_named_and_identifiers_and_the_verdict_stay(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    lines = printed(capsys, RESPONSE, [NAME, "slender-frame", "0.12", "–", "> 10", "overturns"])
    assert lines[1].split()[:2] == ["record", "structure"]
    assert "overturns" in "\n".join(lines)
    assert max(map(len, lines[:-2])) <= 40
    assert lines[-2] == (
        "2 of 6 columns left out: θ/α, critical scale. A wider terminal or --json shows them."
    )
