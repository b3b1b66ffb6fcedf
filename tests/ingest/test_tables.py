"""Workbooks and MATLAB files are read as the text tables that they hold, within the same limits."""

from __future__ import annotations

import io
import sys
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.io import savemat

from rockframe.cli.main import main
from rockframe.errors import InputError, RockframeWarning
from rockframe.ingest.containers import contents
from rockframe.ingest.files import read_file
from rockframe.ingest.options import ReadOptions
from rockframe.ingest.parsing.matlab import numeric_arrays
from rockframe.ingest.tables import arrays
from rockframe.units import GRAVITY

STEP = 0.01
SHAKE: NDArray[np.float64] = 0.2 * np.sin(np.arange(50) ** 1.1)


def matlab(**variables: Any) -> bytes:
    stream = io.BytesIO()
    savemat(stream, variables, do_compression=True)
    return stream.getvalue()


def workbook(**sheets: list[list[Any]]) -> bytes:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


@given(
    values=st.lists(st.floats(-1e3, 1e3, allow_subnormal=False), min_size=2, max_size=20),
    wide=st.booleans(),
)
def test_values_of_matlab_keep_all_bits(values: list[float], wide: bool) -> None:
    column = np.array(values)
    [(_, text)] = arrays(Path("a.mat"), matlab(acc=column if wide else column[:, None]))
    heading, *lines = text.decode().splitlines()
    assert heading == "acc"
    assert [float(line) for line in lines] == values


def test_a_matlab_file_is_the_record_of_its_arrays(tmp_path: Path) -> None:
    """Arrays of one length are columns of one table; text, numbers and structures are none."""
    data = matlab(time_s=STEP * np.arange(50), acc_g=SHAKE, name="shake", dt=0.5, more={"a": 1.0})
    [record] = read_file(written(tmp_path, "shake.mat", data))
    assert record.record_id == "shake"
    assert record.time_step == pytest.approx(STEP)
    np.testing.assert_allclose(record.acceleration, SHAKE * GRAVITY)


def test_a_matrix_is_a_table_of_its_columns() -> None:
    [(name, text)] = arrays(Path("a.mat"), matlab(acc=np.arange(12.0).reshape(2, 6)))
    assert (name, text.splitlines()[:2]) == ("6-values", [b"acc_1,acc_2", b"0.0,6.0"])


def test_a_workbook_is_the_records_of_its_sheets(tmp_path: Path) -> None:
    rows: list[list[Any]] = [
        ["time_s", "acc_g"],
        *([STEP * k, float(a)] for k, a in enumerate(SHAKE)),
    ]
    path = written(tmp_path, "tests.xlsx", workbook(north=rows, east=rows, empty=[]))
    north, east = read_file(path)
    assert (north.record_id, east.record_id) == ("tests-north", "tests-east")
    np.testing.assert_allclose(north.acceleration, SHAKE * GRAVITY)
    [alone] = read_file(written(tmp_path, "alone.xlsx", workbook(Sheet1=rows)))
    assert alone.record_id == "alone"


def test_words_of_the_user_hold_for_them_too(tmp_path: Path, capsys: Any) -> None:
    rows: list[list[Any]] = [
        ["test 7"],
        ["sample", "table"],
        *([k, float(a)] for k, a in enumerate(SHAKE)),
    ]
    path = written(tmp_path, "table.xlsx", workbook(Sheet1=rows))
    words = ["--units", "g", "--time-step-s", "0.01", "--column", "2", "--skip-lines", "2"]
    command = ["ingest", str(path), *words, "--workers", "0", "--output", f"{tmp_path}/a.nc"]
    assert main(command) == 0, capsys.readouterr().err


def test_they_are_read_inside_archives() -> None:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.mat", matlab(time_s=STEP * np.arange(50), acc_g=SHAKE))
        archive.writestr("b.mat", b"MATLAB 5.0 MAT-file" + bytes(109))
    good, bad = contents(Path("both.zip"), stream.getvalue())
    assert good.name == "both.zip:a.mat:50-values"
    assert bad.refusal.startswith("corrupted MATLAB file")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (
            b"MATLAB 7.3 MAT-file, Platform: GLNXA64",
            "is of MATLAB 7.3. Save it by `save(name, '-v7')`",
        ),
        (matlab(name="text", one=1.0), "no table. Must have a numeric array of two values or more"),
        (matlab(acc=np.arange(900.0) ** 1.5)[:-200], "corrupted MATLAB file"),
    ],
)
def test_what_has_no_table_is_refused_in_one_line(tmp_path: Path, data: bytes, words: str) -> None:
    with pytest.raises(InputError) as refused:
        read_file(written(tmp_path, "a.mat", data))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_arrays_beyond_the_limit_of_size_are_not_expanded(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("rockframe.ingest.tables._LARGEST", 1000)
    with pytest.raises(InputError, match=r"arrays of more than 1000 bytes\. Must be at most 1000"):
        read_file(written(tmp_path, "a.mat", matlab(acc=np.zeros(1000))))


def test_damaged_workbooks_are_refused(tmp_path: Path) -> None:
    data = workbook(Sheet1=[[1.0, 2.0]])
    with zipfile.ZipFile(io.BytesIO(data)) as whole:
        names = {name: whole.read(name) for name in whole.namelist()}
    names["xl/worksheets/sheet1.xml"] = names["xl/worksheets/sheet1.xml"][:-40]
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in names.items():
            archive.writestr(name, content)
    with pytest.raises(InputError, match="corrupted workbook"):
        read_file(written(tmp_path, "a.xlsx", stream.getvalue()))
    with pytest.raises(InputError, match="workbook without numbers"):
        read_file(written(tmp_path, "b.xlsx", workbook(Sheet1=[])))


def test_without_openpyxl_the_way_out_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = written(tmp_path, "a.xlsx", workbook(Sheet1=[[1.0, 2.0]]))
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(InputError, match=r"needs openpyxl.*Or save the sheet as CSV"):
        read_file(path)


def table(*rows: list[Any]) -> list[list[Any]]:
    return [["time_s", "acc_g"], *([STEP * k, float(a)] for k, a in enumerate(SHAKE)), *rows]


def test_an_empty_row_within_a_series_is_refused_as_in_text(tmp_path: Path) -> None:
    """Without it, all later samples would be early by a step."""
    rows: list[list[Any]] = [["acc_g"], *([float(a)] for a in SHAKE)]
    whole = read_file(written(tmp_path, "a.xlsx", workbook(S=[*rows, [], []])), time_step=STEP)
    assert whole[0].acceleration.size == 50  # rows at the end are none
    with pytest.raises(InputError, match=r":21: "):
        read_file(
            written(tmp_path, "b.xlsx", workbook(S=[*rows[:20], [], *rows[20:]])), time_step=STEP
        )


def test_a_table_may_begin_in_any_column_and_have_formatted_empty_cells(tmp_path: Path) -> None:
    shifted = [[None, None, *row] for row in table()]
    shifted[0] += [None] * 300
    [record] = read_file(written(tmp_path, "a.xlsx", workbook(S=shifted)))
    np.testing.assert_allclose(record.acceleration, SHAKE * GRAVITY)


def test_notes_and_parameters_beside_a_table_are_no_records(tmp_path: Path) -> None:
    book = workbook(S=table(), notes=[["station", "A"], ["units", "g"], ["mass", 12.0]])
    assert len(read_file(written(tmp_path, "a.xlsx", book))) == 1
    data = matlab(time_s=STEP * np.arange(50), acc_g=SHAKE, corners=np.array([0.1, 25.0]))
    assert len(read_file(written(tmp_path, "a.mat", data))) == 1


def test_two_columns_of_one_name_are_refused() -> None:
    """A matrix names its columns by numbers, which may be the name of a vector."""
    data = matlab(a_1=np.arange(20.0), a=np.arange(40.0).reshape(20, 2))
    with pytest.raises(InputError, match="two columns named 'a_1'"):
        list(arrays(Path("a.mat"), data))


NUMBERS = st.sampled_from(["f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"])


@given(
    dtype=NUMBERS,
    rows=st.integers(1, 5),
    columns=st.integers(1, 5),
    compressed=st.booleans(),
    seed=st.integers(0, 99),
)
def test_arrays_are_those_that_scipy_writes(
    dtype: str, rows: int, columns: int, compressed: bool, seed: int
) -> None:
    """Each type of number, alone and beside what has no numbers; MATLAB writes small arrays of
    integers in fewer bytes, as scipy reads them.
    """
    values = np.random.default_rng(seed).integers(0, 100, (rows, columns)).astype(dtype)
    stream = io.BytesIO()
    others = {"text": "north", "complex": np.array([1j]), "inner": {"a": 1.0}}
    savemat(stream, {"a": values, **others}, do_compression=compressed)
    read = numeric_arrays(stream.getvalue(), 10_000)
    assert read.keys() == {"a"}
    np.testing.assert_array_equal(read["a"], values)


@given(data=st.data(), compressed=st.booleans())
def test_damaged_files_of_matlab_are_read_or_refused(data: st.DataObject, compressed: bool) -> None:
    stream = io.BytesIO()
    savemat(stream, {"t": STEP * np.arange(30), "a": SHAKE[:30]}, do_compression=compressed)
    content = bytearray(stream.getvalue())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(124, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(130, len(content)))
    with suppress(InputError):
        assert list(arrays(Path("a.mat"), bytes(content[:cut])))


def test_an_array_that_is_no_record_does_not_cost_the_others(tmp_path: Path) -> None:
    """Coefficients of a filter beside a record: `ingest` lists them, and `read_file` warns."""
    data = matlab(acc=SHAKE, time=STEP * np.arange(50), filter=np.linspace(0.0, 1.0, 20))
    path = written(tmp_path, "shake.mat", data)
    options = ReadOptions(units="g")
    with pytest.warns(RockframeWarning, match=r"20-values.*columns 'filter'.* is left out"):
        [record] = read_file(path, options)
    assert record.acceleration == pytest.approx(9.81 * SHAKE)
    with pytest.raises(InputError, match=r"a\.mat:20-values:1: columns 'filter'"):
        read_file(written(tmp_path, "a.mat", matlab(filter=np.linspace(0.0, 1.0, 20))))
