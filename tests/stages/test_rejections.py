"""Reasons for which records are rejected: every reason is kept, in all formats of the list."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from tests.commands import run

from rockframe.cells import TABLE_FORMATS
from rockframe.outcome import InputOutcome
from rockframe.results.tables.entries import rejected_inputs, rejections_of, write_entries


def test_each_record_of_a_file_keeps_its_reason(tmp_path: Path) -> None:
    names = ("CCC-090", "CCC-360")
    rows = [
        InputOutcome("CCC.V1", f"record {name!r}: clipped.", line, record_id=name)
        for line, name in enumerate(names, 9)
    ]
    write_entries(
        [*rows, InputOutcome("ok.csv", status="accepted", record_id="ok")], tmp_path / "records.csv"
    )
    assert rejections_of(tmp_path) == {
        "CCC.V1": "record 'CCC-090': clipped. record 'CCC-360': clipped."
    }
    assert rejected_inputs(tmp_path) == rows


@pytest.mark.parametrize("table_format", ["markdown", "latex", "xlsx", "parquet"])
def test_the_list_of_inputs_in_the_formats_of_other_tables(
    motion: Path, table_format: str, capsys: pytest.CaptureFixture[str]
) -> None:
    needed = {"xlsx": "openpyxl", "parquet": "pyarrow"}.get(table_format, "csv")
    pytest.importorskip(needed, reason="needs the extra tables")
    notes, output = motion.with_name("notes.csv"), motion.with_name("records.nc")
    notes.write_text("no numbers\n")
    stated = ("--units", "g", "--time-step", "0.01", "--format", table_format)
    assert run("ingest", motion, notes, *stated, "--pga-g", "0", "9", "--output", output) == 1
    capsys.readouterr()
    assert not output.with_suffix(".csv").exists()
    path = output.with_suffix(TABLE_FORMATS[table_format])
    if table_format == "parquet":
        table = pd.read_parquet(path)
        assert table["status"].tolist() == ["accepted", "rejected"]
        assert table["clipped_samples"].isna().tolist() == [False, True]
    elif table_format != "xlsx":
        text = path.read_text(encoding="utf-8")
        assert "accepted" in text
        assert "notes.csv" in text
