"""Tables in terminals that are narrower than they are."""

from __future__ import annotations

import pytest

from rockframe.cli.console import show_table

NAME = "Ridgecrest2019-CCC-090"


@pytest.fixture(autouse=True)
def _eighty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def printed(capsys: pytest.CaptureFixture[str], columns: list[str], row: list[str]) -> list[str]:
    show_table("", columns, [row])
    return capsys.readouterr().out.splitlines()


def test_headings_are_broken_before_names_and_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    columns = ["record", *(f"a-long heading-{i}>" for i in range(4)), "verdict"]
    lines = printed(capsys, columns, [NAME, *["0.306"] * 4, "undecided, overturned"])
    assert f"{NAME} 0.306 0.306 0.306 0.306 undecided," in [" ".join(s.split()) for s in lines]


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
    assert "1 more rows: the files have all." in printed
