"""Cells of CSV tables: no text is a formula, every text is read back, numbers are decimal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rockframe.cells import (
    block_lines,
    decimal,
    harmless,
    original,
    plain,
    read_column,
    read_rows,
    rows_of_columns,
    write_rows,
    write_table,
)
from rockframe.errors import InputError
from rockframe.ingest import CatalogueEntry, read_catalogue
from rockframe.ingest.catalogue import write_catalogue
from rockframe.outcome import InputOutcome
from rockframe.results.tables.entries import (
    refuse_other_table,
    refuse_strange_entries,
    rejections_of,
    rows_of,
    write_entries,
)
from rockframe.risk import read_hazard
from rockframe.selection.target import read_target
from rockframe.stages.select import read_selection

#: Characters at which a spreadsheet starts a formula.
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
#: Texts that often begin like formulas, quoted or not.
TEXTS = st.text() | st.builds("".join, st.lists(st.sampled_from(["'", *FORMULA, "1", "a", " "])))
#: Printable texts only: UTF-8 cannot encode a lone surrogate.
WRITTEN = TEXTS.filter(lambda text: text.isprintable())


@given(TEXTS)
def test_no_text_begins_like_a_formula_and_each_comes_back(text: str) -> None:
    cell = harmless(text)
    assert original(cell) == text
    if cell.startswith(FORMULA):
        assert math.isfinite(decimal(cell))


@given(st.lists(st.lists(TEXTS, min_size=2, max_size=3), min_size=1))
def test_rows_come_back(rows: list[list[str]]) -> None:
    stream = io.StringIO(newline="")
    write_rows(stream, rows)
    stream.seek(0)
    assert [row for _, row in read_rows(stream)] == [[*map(plain, row)] for row in rows]


@given(rows=st.lists(st.lists(TEXTS, min_size=3, max_size=3), max_size=9), place=st.integers(0, 2))
@example(rows=[["a", 'b"', "c\n"], ["'=1", ",", ""], ["", "\r", "x"]], place=1)
def test_one_column_is_that_of_all(rows: list[list[str]], place: int) -> None:
    stream = io.StringIO(newline="")
    write_rows(stream, [["one", "two", "three"], *rows])
    stream.seek(0)
    texts = list(read_column(stream, ["one", "two", "three"][place]))
    assert texts == [plain(row[place]) for row in rows]


def test_one_column_of_a_damaged_table_is_an_error() -> None:
    for text, kind in (("a,b\n1\n", IndexError), ('a,b\n1,"2', csv.Error), ("a\n1\n", ValueError)):
        with pytest.raises(kind):
            list(read_column(io.StringIO(text, newline=""), "b"))


def test_semicolons_allow_decimal_commas() -> None:
    stream = io.StringIO("file;magnitude;event\nA.V1;6,9;Kobe, Japan\n1;,5;-1,e5\n")
    rows = [row for _, row in read_rows(stream)]
    assert rows[1:] == [["A.V1", "6.9", "Kobe, Japan"], ["1", ".5", "-1,e5"]]
    quoted = io.StringIO('"file";"magnitude"\n"A.V1";"6,9"\n')
    assert [row for _, row in read_rows(quoted)][1] == ["A.V1", "6.9"]


def test_numbers_stay_numbers_and_nan_is_empty() -> None:
    stream = io.StringIO()
    write_table(stream, [{"a": -0.5, "b": math.nan, "c": None, "d": True, "e": "-1e-05"}])
    assert stream.getvalue() == "a,b,c,d,e\n-0.5,,,True,-1e-05\n"


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_float_is_read_as_it_is_printed(number: float) -> None:
    assert decimal(repr(number)) == number


@pytest.mark.parametrize(
    "text",
    [
        "6_5",
        "６.５",
        "٣",
        "0x10",
        "infinity",
        "-inf",
        "nan",
        "1e999",
        "",
        "1,5",
        "1.2.3",
        "1 2",
        "+",
    ],
)
def test_what_only_python_or_nobody_takes_for_a_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a decimal number"):
        decimal(text)


@given(WRITTEN.map(str.strip), WRITTEN.map(str.strip))
def test_a_catalogue_comes_back(
    tmp_path_factory: pytest.TempPathFactory, event: str, two: str
) -> None:
    path = tmp_path_factory.mktemp("catalogue") / "catalogue.csv"
    entry = CatalogueEntry(file="=a.csv", event=event, station=two, magnitude=6.5)
    write_catalogue(path, [entry])
    read = read_catalogue(path)["=a.csv"]
    assert (read.file, read.event, read.station, read.magnitude) == ("=a.csv", event, two, 6.5)


def test_a_file_named_like_a_formula_is_one_in_no_list(tmp_path: Path) -> None:
    name, path = "=HYPERLINK(0).csv", tmp_path / "records.csv"
    write_entries([InputOutcome(name, "@home: no record.", record_id="-a")], path)
    with path.open(newline="", encoding="utf-8") as stream:
        (row,) = csv.DictReader(stream)
    assert [row[key] for key in ("file", "record_id", "reason")] == [
        f"'{name}", "'-a", "'@home: no record."
    ]  # fmt: skip
    assert next(rows_of(path))["record_id"] == "-a"
    assert rejections_of(tmp_path) == {name: "@home: no record."}


def test_every_table_of_the_package_is_written_in_one_place() -> None:
    """A second writer of CSV tables could forget to quote formulas."""
    package = Path(__file__).resolve().parents[1] / "pipeline" / "rockframe"
    writing = {
        path.name
        for path in package.rglob("*.py")
        if "csv.writer" in (text := path.read_text(encoding="utf-8")) or "DictWriter" in text
    }
    assert writing == {"cells.py"}


def test_the_list_of_an_ingest_without_records_may_be_replaced(tmp_path: Path) -> None:
    path = tmp_path / "z.csv"
    write_entries([InputOutcome("a.txt", reason="empty file.")], path)
    refuse_other_table(path, ("record_id",), "the table of the screening")
    path.with_suffix(".nc").touch()
    with pytest.raises(InputError, match=r"z\.csv: is in the place of the table of the screening"):
        refuse_other_table(path, ("record_id",), "the table of the screening")


def test_a_list_that_only_begins_like_the_list_of_inputs_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "records.csv"
    path.write_text("file,record_id,status,line,mine\n", encoding="utf-8")
    with pytest.raises(InputError, match="is in the place of the list of inputs"):
        refuse_strange_entries(path)


def test_an_error_of_csv_names_its_line() -> None:
    with pytest.raises(csv.Error, match=r"^line 2: unexpected end of data$"):
        list(read_rows(io.StringIO('a,b\n"1,2')))


@pytest.mark.parametrize("character", ["\x1b[31m", "\x07", "\n", "\x9b", "\u2028", "\u202e"])
@pytest.mark.parametrize("read", [read_hazard, read_target, read_selection])
def test_tables_of_others_act_on_no_terminal(
    tmp_path: Path, read: Callable[[Path], object], character: str
) -> None:
    """One line names the cell, in which the character is escaped."""
    path = tmp_path / "t.csv"
    path.write_text(f'file,record_id,scale\na.at2,"b{character}c",1\n', encoding="utf-8")
    with pytest.raises(InputError) as error:
        read(path)
    assert str(error.value).isprintable()
    assert "control character in 'b\\" in str(error.value)


def test_tables_of_columns_are_the_bytes_of_tables_of_rows() -> None:
    """Numbers that come again are written as the first time, but for zero, which has two signs."""
    numbers = [0.0, -0.0, math.nan, 0.1 + 0.2, -math.inf, 1e-300, 5e22, 1.0]
    columns: dict[str, list[object]] = {
        "numbers": [*numbers],
        "again": [*[0.0, -0.0, 0.5, math.nan], *[0.0, -0.0, 0.5, math.nan]],
        "texts": ["=1", "a,b", '"', "\r", "", "'", "@x", "é"],
        "mixed": [1, True, None, 1.0, "-", math.nan, -0.0, "0.0"],
        "many": [float(k) for k in range(8)],
    }
    blocks = [columns, {name: values[::-1] for name, values in columns.items()}]
    blocks += [{**columns, "many": [k / 7.0 for k in range(8 * n, 8 * n + 8)]} for n in range(600)]
    in_rows, in_columns = io.StringIO(), [*block_lines(blocks)]
    assert write_table(in_rows, rows_of_columns(blocks)) == 8 * len(blocks)
    assert "".join(in_columns) == in_rows.getvalue()
    assert len(in_columns) == 1 + len(blocks)
    assert [*block_lines([{"a": []}])] == []
