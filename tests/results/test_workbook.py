"""Excel workbooks: the same tables as CSV, in named sheets with units and number formats."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import pytest
from tests.commands import STRUCTURE, ingested, run

from rockframe.errors import InputError
from rockframe.results.tables.entries import columns_of, refuse_other_tables, write_tables
from rockframe.results.tables.workbook import head_with_unit, name_of_head, write_workbook

openpyxl = pytest.importorskip("openpyxl", reason="needs the extra tables")

ROWS: list[dict[str, Any]] = [
    {"record_id": "=a", "peak_u_m": 0.125, "pga_g": math.inf, "share_overturned": 0.25, "n": 3},
    {"record_id": "b\x07", "peak_u_m": 12.0, "pga_g": math.nan, "share_overturned": 0.0, "n": 12},
]


def cells(path: Path, sheet: str) -> list[tuple[Any, ...]]:
    return list(openpyxl.load_workbook(path)[sheet].values)


def as_csv(value: object) -> str:
    """Return a cell as CSV has it."""
    return "" if value is None else str(value)


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Path:
    motion = tmp_path_factory.mktemp("records") / "shake.txt"
    motion.write_text("\n".join(str(0.4 * math.sin(0.05 * k)) for k in range(600)))
    return ingested(motion)


def test_sheets_are_the_tables_of_csv(records: Path, tmp_path: Path) -> None:
    """Each number of a sheet is that of the CSV table, and so are the names of its columns."""
    structures = tmp_path / "two.toml"
    structures.write_text(STRUCTURE + STRUCTURE.replace("portico", "other"))
    few = ("--margins", "none", "--ensemble-members", "16", "--scales", "0.9", "1.1", "--forces")
    asked = ("respond", records, "--structures", structures, *few, "--output", tmp_path / "r.nc")
    for table_format in ("xlsx", "csv"):
        assert run(*asked, "--format", table_format) == 0
    book = openpyxl.load_workbook(tmp_path / "r.xlsx")
    matrices = ["matrix share_overturned", "matrix peak_rotation_ratio", "matrix peak_u"]
    assert book.sheetnames == [
        "summary",
        *matrices,
        "responses",
        "forces",
        "envelope",
        "scales",
        "parameters",
    ]
    for sheet in book:
        name = "r" if sheet.title == "responses" else f"r-{sheet.title.replace(' ', '-')}"
        with (tmp_path / f"{name}.csv").open(newline="", encoding="utf-8") as stream:
            head, *rows = csv.reader(stream)
        assert [name_of_head(cell.value) for cell in sheet[1]] == head
        found = [[as_csv(cell) for cell in row] for row in sheet.iter_rows(2, values_only=True)]
        for there, here in zip(rows, found, strict=True):
            for one, other in zip(there, here, strict=True):
                # a workbook has 16 digits
                assert one == other or math.isclose(float(one), float(other), rel_tol=1e-15)
        assert sheet.freeze_panes == "B2"


def test_a_header_has_units_and_numbers_have_formats(tmp_path: Path) -> None:
    path = tmp_path / "t.xlsx"
    assert write_workbook(path, {"rows": ROWS}) == 2
    sheet = openpyxl.load_workbook(path)["rows"]
    heads = ["record_id", "peak_u [m]", "pga [g]", "share_overturned", "n"]
    assert [cell.value for cell in sheet[1]] == heads
    assert all(cell.font.bold for cell in sheet[1])
    assert [cell.number_format for cell in sheet[2]][1:] == ["0.000", "General", "0.0%", "General"]
    assert list(sheet.values)[1:] == [
        ("'=a", 0.125, "inf", 0.25, 3),
        ("b\N{REPLACEMENT CHARACTER}", 12.0, None, 0.0, 12),
    ]
    assert columns_of(path) == list(ROWS[0])


@pytest.mark.parametrize(
    ("largest", "form"), [(0.001, "0.000E+00"), (99.0, "0.000"), (500.0, "0.00"), (1e4, "0.0")]
)
def test_a_format_fits_the_largest_number(tmp_path: Path, largest: float, form: str) -> None:
    write_workbook(tmp_path / "t.xlsx", {"t": [{"x": largest}, {"x": 0.1 * largest}]})
    sheet = openpyxl.load_workbook(tmp_path / "t.xlsx")["t"]
    assert [sheet[place].number_format for place in ("A2", "A3")] == [form, form]


def test_columns_are_as_wide_as_their_texts_within_bounds(tmp_path: Path) -> None:
    rows = [{"n": 1, "structure": 20 * "x", "reason": 90 * "x"}]
    write_workbook(tmp_path / "t.xlsx", {"t": rows})
    widths = openpyxl.load_workbook(tmp_path / "t.xlsx")["t"].column_dimensions
    assert [widths[letter].width for letter in "ABC"] == [8, 22, 44]


def test_the_same_rows_give_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library writes the time of saving, and the archive that of each of its files."""
    write_workbook(tmp_path / "a.xlsx", {"rows": ROWS})
    monkeypatch.setattr("time.time", lambda: 1.0e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2001, 9, 9, 1, 46, 40, 0, 0, 0))
    write_workbook(tmp_path / "b.xlsx", {"rows": ROWS})
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()
    properties = openpyxl.load_workbook(tmp_path / "a.xlsx").properties
    assert {properties.created.year, properties.modified.year} == {1980}


@pytest.mark.parametrize(
    "name", ["peak_u_50_m", "pgv_m_s", "a_p_g", "T_p_s", "sa_0.5s_g", "p_value"]
)
def test_headings_name_their_columns(name: str) -> None:
    assert name_of_head(head_with_unit(name)) == name


def test_an_impulse_has_its_unit_in_the_heading() -> None:
    assert head_with_unit("base_impact_kn_s") == "base_impact [kN s]"
    assert head_with_unit("base_impact_over_weight_s") == "base_impact_over_weight [s]"


def test_a_sheet_with_too_many_rows_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rockframe.results.tables.workbook._MOST_ROWS", 1)
    with pytest.raises(InputError, match=r"t.xlsx: has 2 rows. Must be at most 1 for xlsx."):
        write_workbook(tmp_path / "t.xlsx", {"rows": ROWS})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("table_format", ["csv", "xlsx"])
def test_own_tables_are_replaced_and_others_are_not(tmp_path: Path, table_format: str) -> None:
    output, first = tmp_path / "r.nc", {"summary": ("structure",), "rows": ("record_id",)}
    tables = {"summary": [{"structure": "a"}], "rows": ROWS}
    made = write_tables(output, tables, "rows", table_format)
    refuse_other_tables(output, first, "rows", table_format)
    write_tables(made[0].with_suffix(".nc"), {"rows": [{"mine": 1}]}, "rows", table_format)
    with pytest.raises(InputError, match="is in the place of a table of this command"):
        refuse_other_tables(output, first, "rows", table_format)


def test_a_screening_prints_motions_by_structures(
    records: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    structures = tmp_path / "one.toml"
    structures.write_text(STRUCTURE)
    asked = ("screen", records, "--structures", structures, "--margins", "none", "--scales", "1")
    capsys.readouterr()
    assert run(*asked, "--output", tmp_path / "s.nc", "--matrix", "peak_u") == 0
    assert "Responses at scale 1 (nominal): u [cm]" in capsys.readouterr().out
    assert run(*asked, "--output", tmp_path / "s.nc", "--matrix", "share_overturned", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    row = {"record_id": "shake", "portico share_overturned": said["overall"][0]["share_overturned"]}
    assert said["matrices"] == {"share_overturned": [row]}


def test_every_stage_that_prints_rows_writes_a_table(records: Path, tmp_path: Path) -> None:
    structures = tmp_path / "one.toml"
    structures.write_text(STRUCTURE)
    for words in (
        ("pulse", records, "--surrogates", "0"),
        (
            "spectrum",
            "--records",
            records,
            "--slenderness-degree",
            "10",
            "--column-period-s",
            "1:4:4",
        ),
        ("screen", records, "--structures", structures, "--margins", "none", "--scales", "1"),
    ):
        output = tmp_path / f"{words[0]}.nc"
        assert run(*words, "--output", output, "--format", "xlsx") == 0
        book = openpyxl.load_workbook(output.with_suffix(".xlsx"))
        assert book.sheetnames[-1] == "parameters"
        assert ("summary" in book.sheetnames) is (words[0] == "screen")
