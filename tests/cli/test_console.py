"""Tables in terminals that are narrower than the table."""

from __future__ import annotations

import math

import pytest

from rockframe.cells import Column
from rockframe.cli.console import progress_of_steps, show_rows, show_summary, show_table
from rockframe.results.tables.rows import response_columns, titled
from rockframe.results.tables.summary import summary_rows
from rockframe.results.tables.table import part_columns

NAME = "Ridgecrest2019-CCC-090"


@pytest.fixture(autouse=True)
def _eighty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


def printed(capsys: pytest.CaptureFixture[str], columns: list[str], row: list[str]) -> list[str]:
    show_table("", columns, [row])
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_run_shows_its_steps_and_on_a_terminal_the_parts_of_each(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], is_terminal: bool
) -> None:
    """A step of many records may take an hour."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)
    monkeypatch.setenv("TERM", "xterm")
    with progress_of_steps("mine") as (on_step, on_progress):
        on_step("ingest", 1, 7)
        on_progress("respond [x]", 2, 9)
    said = capsys.readouterr().err
    shown = ("mine 2 of 7", "respond [x] 3 of 9")
    assert [words in said for words in (*shown, "rockframe: 1/7 ingest, ")] == [
        *(is_terminal, is_terminal),
        not is_terminal,
    ]


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


def test_columns_of_the_last_priorities_are_left_out_first_and_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "48")
    priorities = {"record": 1, "structure": 0, "drift>": 1, "θ/α>": 2, "verdict": 0}
    columns = [Column(head, head, priority=number) for head, number in priorities.items()]
    row = dict(zip(priorities, [NAME, "slender-frame", "5.0", "0.12", "overturns"], strict=True))
    show_rows("", columns, [row])
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split()[:2] == ["record", "structure"]  # the first is always printed
    assert "overturns" in "\n".join(lines)
    assert max(map(len, lines[:-2])) <= 48
    assert lines[-2] == ("1 of 5 columns left out: θ/α. A wider terminal or --json shows them.")


@pytest.mark.parametrize("members", [0, 64])
def test_80_columns_have_verdict_drift_margin_and_the_worst_record(
    members: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    ensemble = {"share_overturned": 0.84, "share_overturned_low": 0.75, "peak_u_16_m": 0.115,
                "share_overturned_high": 0.91, "share_uplifted": 1.0, "peak_u_50_m": 0.132,
                "peak_u_84_m": math.inf, "peak_rotation_ratio_16": 0.073,
                "peak_rotation_ratio_50": 0.083, "peak_rotation_ratio_84": math.inf,
                "robust_scale_10": 0.66, "largest_robust_scale": 10.0}  # fmt: skip
    rows = [
        {"record": name, "record_id": name, "structure": "slender-column", "verdict": "stands",
         "peak_rotation_ratio": 0.123, "peak_u_m": 0.195, "peak_v_m": 0.0125,
         "critical_scale": 0.67, "largest_scale": 10.0, **(ensemble if members else {})}
        for name in ("CCC/090", "CCC/360")
    ]  # fmt: skip
    first = titled({"record": "Record"}, once=True)
    show_rows("", [*first, *response_columns(rows[0], {})], rows)
    verdict, margin, drift = (
        ("overturn", "0.66", "11.5 13.2") if members else ("stands", "0.67", "19.5")
    )
    table = capsys.readouterr().out.partition("columns left out")[0]
    assert all(word in table for word in (verdict, margin, drift, "CCC"))
    show_summary(summary_rows(rows))
    table = capsys.readouterr().out.partition("columns left out")[0]
    drift = "13.2 13.2 13.2" if members else "19.5 19.5 19.5"
    assert all(word in table for word in (margin, drift, "Worst", "CCC"))
    assert max(map(len, table.splitlines())) <= 80


def test_100_columns_have_all_that_a_sequence_leaves_behind(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The end of a motion, 120 s before the next one begins, is the first to go."""
    monkeypatch.setenv("COLUMNS", "100")
    row = {"record_id": f"{NAME}-then-{NAME}", "structure": "bent", "motion": 2, "motion_id": NAME,
           "start_s": 219.99, "end_s": 319.98, "start_rotation_ratio": 0.001, "peak_u_m": 0.253,
           "peak_rotation_ratio": 0.159, "tendon_force_n": 226.8e3,
           "dissipater_force_n": -100.0e3}  # fmt: skip
    show_rows("", part_columns([row]), [row])
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2].startswith("1 of 10 columns left out: to [s].")
    assert any(line.split()[-2:] == ["226.8", "-100.0"] for line in lines)
