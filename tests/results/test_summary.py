"""Summaries of responses over all records, and records by structures in one quantity."""

from __future__ import annotations

import errno
import math
import os
import re
import sys
from collections import deque
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
import pytest

from rockframe.cli.console import show_summary
from rockframe.cli.stages.respond import show_responses
from rockframe.errors import InputError
from rockframe.results.tables import number_store
from rockframe.results.tables.entries import write_rows_as
from rockframe.results.tables.outcomes import severity
from rockframe.results.tables.rows import response_columns, spread_verdict
from rockframe.results.tables.summary import (
    MATRICES,
    Summary,
    matrix_columns,
    matrix_rows,
    summary_columns,
    summary_rows,
    tables_of,
)
from rockframe.risk.distribution import mean_share
from rockframe.rocking.verdict import VerdictKind

SHARES = (0.0, 0.25, 0.5, 1.0, 0.0)
DRIFTS = (0.1, 0.2, 0.3, math.inf, 0.05)


def nominal(
    name: str, verdict: str = "stands", u: float = 0.1, structure: str = "bent"
) -> dict[str, Any]:
    return {
        "record_id": name,
        "structure": structure,
        "verdict": verdict,
        "peak_rotation_ratio": 5.0 * u,
        "peak_u_m": u,
    }


def response(name: str, share: float, drift: float, structure: str = "bent") -> dict[str, Any]:
    """Return a row with an ensemble, whose nominal values must not matter."""
    return {
        **nominal(name, "stands", 9.9, structure),
        "share_overturned": share,
        "share_uplifted": 1.0,
        "peak_u_50_m": drift,
        "peak_rotation_ratio_50": 2.0 * drift,
        "robust_scale_10": 2.0 - share,
        "largest_robust_scale": 10.0,
    }


@pytest.fixture
def rows() -> list[dict[str, Any]]:
    return [response(f"r{k}", *both) for k, both in enumerate(zip(SHARES, DRIFTS, strict=True))]


def test_shares_are_averaged_and_medians_are_ranked_over_the_records(rows: Any) -> None:
    (row,) = summary_rows(rows)
    assert row["records"] == 5
    assert row["share_overturned"] == sum(SHARES) / 5
    # 16 % of four steps between five values is 0.64 of the first step, 84 % is 0.36 of the last
    assert row["peak_u_16_m"] == pytest.approx(0.05 + 0.64 * (0.1 - 0.05))
    assert (row["peak_u_50_m"], row["peak_u_84_m"]) == (0.2, math.inf)
    assert row["peak_rotation_ratio_50"] == 0.4
    assert row["robust_scale_10"] == 1.0
    assert row["worst_record"] == "r3"
    assert not row["nominal"]


def test_without_an_ensemble_a_record_that_overturns_is_infinite() -> None:
    """Its peak only describes the fall, so a small one must not count."""
    found = [nominal("a", "overturns", 0.01), nominal("b", "no_uplift", 0.0), nominal("c")]
    (row,) = summary_rows(found)
    assert (row["peak_u_50_m"], row["share_overturned"]) == (0.1, 1 / 3)
    assert row["peak_u_84_m"] == math.inf
    assert (row["uplifted"], row["worst_record"], row["nominal"]) == (2, "a", True)


def test_components_of_a_recording_are_not_independent(rows: Any) -> None:
    """With one recording for all records the interval is that of a single observation."""
    (alone,) = summary_rows(rows)
    (together,) = summary_rows(rows, {row["record_id"]: "station" for row in rows})
    expected = mean_share([[one] for one in SHARES], clusters=[0] * 5)
    assert together["share_overturned"] == alone["share_overturned"]
    assert together["share_overturned_low"] == expected.low[0] < alone["share_overturned_low"]


def test_the_share_decides_before_rotation_and_rotation_before_margin(rows: Any) -> None:
    order = [row["record_id"] for row in sorted(rows, key=severity)]
    assert order == ["r3", "r2", "r1", "r0", "r4"]
    margins = [response("a", 1.0, math.inf) | {"robust_scale_10": one} for one in (0.9, 0.4)]
    assert min(margins, key=severity)["robust_scale_10"] == 0.4


def test_a_margin_that_was_not_found_is_a_bound(rows: Any) -> None:
    found = [row | {"robust_scale_10": math.nan} for row in rows]
    (row,) = summary_rows(found)
    columns = {one.key: one for one in summary_columns([row])}
    assert columns["robust_scale_10"].cell(row) == "> 10"
    assert "critical_scale" not in columns


def test_a_critical_scale_that_was_not_found_is_a_bound() -> None:
    row = nominal("r", "stands", 0.1) | {"critical_scale": math.nan, "largest_scale": 10.0}
    (row,) = summary_rows([row])
    columns = {one.key: one for one in summary_columns([row])}
    assert columns["critical_scale"].cell(row) == "> 10"
    assert "robust_scale_10" not in columns


def test_each_pair_is_in_a_matrix_once(rows: Any) -> None:
    pairs = [row | {"structure": name} for row in rows for name in ("bent", "pier")]
    for quantity in MATRICES:
        matrix = matrix_rows(pairs, quantity)
        assert [row["record_id"] for row in matrix] == [f"r{k}" for k in range(5)]
        column = MATRICES[quantity].column(rows[0])
        assert {*matrix[0]} == {"record_id", f"bent {column}", f"pier {column}"}
    drifts = [row["bent peak_u_50_m"] for row in matrix_rows(pairs, "peak_u")]
    np.testing.assert_array_equal(drifts, DRIFTS)
    heads = [one.head for one in matrix_columns(matrix_rows(pairs, "peak_u"), "peak_u")]
    assert heads == ["Record", "bent>", "pier>"]


def test_a_matrix_without_an_ensemble_has_other_columns() -> None:
    (row,) = matrix_rows([nominal("a", "overturns"), nominal("a", "stands", 0.2, "pier")], "peak_u")
    assert row == {"record_id": "a", "bent peak_u_m": math.inf, "pier peak_u_m": 0.2}


def test_a_quantity_without_values_has_no_matrix() -> None:
    rows = [nominal("a"), nominal("b")]
    kinds = [
        "summary",
        "matrix share_overturned",
        "matrix peak_rotation_ratio",
        "matrix peak_u",
        "responses",
    ]
    assert list(tables_of(rows, summary_rows(rows), "responses")) == kinds
    margins = [{**row, "critical_scale": 1.5} for row in rows]
    assert "matrix margin" in tables_of(margins, summary_rows(rows), "responses")


@pytest.mark.parametrize(("count", "printed"), [(40, 40), (41, 10)])
def test_of_many_responses_the_most_severe_are_printed(
    capsys: pytest.CaptureFixture[str], count: int, printed: int
) -> None:
    many = [response(f"r{k:02}", 0.0, 0.001 * k) for k in range(count)]
    columns = response_columns(many[0], {"record_id": "Record"})
    show_responses("", columns, many, all_in="here.nc")
    show_summary(summary_rows(many))
    responses, _, summary = capsys.readouterr().out.partition("Over all records")
    assert sum(line.startswith(" r") for line in responses.splitlines()) == printed
    assert ("All 41 are in here.nc." in responses) is (count == 41)
    assert f"r{count - 1}" in responses
    assert f"r{count - 1}" in summary


def test_one_record_needs_no_summary(capsys: pytest.CaptureFixture[str]) -> None:
    show_summary(summary_rows([response("a", 0.0, 0.1)]))
    assert not capsys.readouterr().out


def test_a_margin_that_was_searched_less_far_is_not_dropped() -> None:
    found = {**nominal("a"), "critical_scale": 5.0, "largest_scale": 10.0}
    beyond = {**nominal("b"), "critical_scale": math.nan, "largest_scale": 2.8}
    columns = summary_columns(summary_rows([found]))
    margin = next(one for one in columns if one.key == "critical_scale")
    assert margin.cell(summary_rows([found, beyond])[0]) == "> 2.8"  # not 5.00
    smaller = {**found, "critical_scale": 2.5}
    assert margin.cell(summary_rows([smaller, beyond])[0]) == "2.50"
    assert severity(beyond) < severity(found)  # it may overturn at half the scale


def test_without_rows_there_is_no_summary() -> None:
    assert Summary().rows() == []


@pytest.mark.parametrize("begun", [False, True])
def test_a_full_disk_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool) -> None:
    """Before the file is made, and when the first numbers, fewer than a buffer, are written."""

    def full(*, buffering: int, **_: Any) -> Any:
        if begun and Path("/dev/full").exists():
            return Path("/dev/full").open("r+b", buffering=buffering)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(number_store, "TemporaryFile", full)
    monkeypatch.setattr(number_store, "_IN_MEMORY", 100)
    summary = Summary(tmp_path)
    deque(summary.passed(nominal(f"r{k}") for k in range(10)), maxlen=0)
    said = rf"^{re.escape(str(tmp_path))}: a temporary file in it cannot be written: No space left"
    with pytest.raises(InputError, match=said):
        summary.rows()


def test_rows_of_motions_and_their_columns_have_the_same_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With more motions than are summarised together, rows of every kind, and a file of numbers."""
    random = np.random.default_rng(6)
    words = ["no_uplift", "stands", "overturns", "not_computed"]
    files: list[Any] = []

    def temporary_file(**where: Any) -> Any:
        files.append(TemporaryFile(**where))  # noqa: SIM115
        return files[-1]

    monkeypatch.setattr(number_store, "TemporaryFile", temporary_file)
    monkeypatch.setattr(number_store, "_IN_MEMORY", 5000)
    for members, margins in ((False, False), (False, True), (True, True)):
        rows: list[dict[str, Any]] = []
        for k in range(150):
            for structure in ("bent", "pier"):
                row = nominal(f"r{k}", words[random.integers(4)], random.uniform(), structure)
                share = float(random.choice([0.0, 0.02, 0.5, 1.0]))
                margin = float(random.choice([math.nan, 1.5 if margins else math.nan]))
                largest = 3.0 if margins else math.nan
                row |= response(f"r{k}", share, row["peak_u_m"], structure) if members else {}
                row |= {"verdict": words[random.integers(4)], "pga_g": random.choice([0.3, 30.0])}
                row |= {"kind": "fixed" if structure == "pier" else "", "robust_scale_10": margin}
                row |= {
                    "share_uplifted": float(random.integers(2)),
                    "largest_robust_scale": largest,
                }
                row |= {"gap_closed_time_s": float(random.choice([math.nan, 4.0]))}
                rows.append(row)
        summary = Summary()
        blocks = [
            {key: [first[key], second[key]] for key in first}
            for first, second in zip(rows[::2], rows[1::2], strict=True)
        ]
        assert [*summary.included(blocks)] == blocks
        by_rows = summary_rows(rows)
        assert repr(summary.rows()) == repr(by_rows)
        joined = Summary(tmp_path)
        for first in range(0, len(rows), 20):  # as the parts that workers return
            part = Summary()
            deque(part.passed(rows[first : first + 20]), maxlen=0)
            joined.join(part)
        assert files.pop().seek(0, 2) > 5000
        assert not [*tmp_path.iterdir()] or sys.platform == "win32"  # it has no name
        assert repr(joined.rows()) == repr(by_rows)
        both = [{**row, "components": "a b" if k % 3 else ""} for k, row in enumerate(rows)]
        in_both = Summary()
        in_both.include({key: [value] for key, value in row.items()} for row in both)
        assert repr(in_both.rows()) == repr(summary_rows(both)) != repr(by_rows)
        for row in by_rows:
            of_it = [one for one in rows if one["structure"] == row["structure"]]
            computed = [one for one in of_it if one["verdict"] != "not_computed"]
            assert row["records"] == len(computed) == len(of_it) - row["not_computed"]
            assert row["worst_record"] == min(computed, key=severity)["record_id"]
            assert row["model_ends"] == sum(spread_verdict(one).share_ends > 0 for one in computed)
            no_uplift = [spread_verdict(one).kind is VerdictKind.NO_UPLIFT for one in computed]
            if row["structure"] == "bent":
                assert row["uplifted"] == len(computed) - sum(no_uplift)


def test_a_deck_that_does_not_rock_has_no_number_of_uplifts_in_parquet(tmp_path: Path) -> None:
    """A column of whole numbers holds no text."""
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    frames, decks = nominal("r1"), nominal("r1", structure="deck") | {"kind": "isolated"}
    write_rows_as(tmp_path / "summary.parquet", summary_rows([frames, decks]))
    write_rows_as(tmp_path / "summary.csv", summary_rows([frames, decks]))
    for table in (pandas.read_parquet(tmp_path / "summary.parquet"),
                  pandas.read_csv(tmp_path / "summary.csv")):  # fmt: skip
        uplifted = dict(zip(table["structure"], table["uplifted"], strict=True))
        assert uplifted["bent"] == 1
        assert pandas.isna(uplifted["deck"])
