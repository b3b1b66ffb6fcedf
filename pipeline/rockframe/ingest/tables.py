"""Workbooks of Excel and files of MATLAB as the text tables that they hold."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import write_rows
from rockframe.errors import InputError
from rockframe.ingest.parsing.matlab import numeric_arrays

#: A table: its name, and its lines as CSV.
Table = tuple[str, bytes]

#: Size limit of the arrays of a file together [bytes].
_LARGEST: Final = 256_000_000
_WORKBOOK: Final = "xl/workbook.xml"
_MATLAB: Final = b"MATLAB 5.0 MAT-file"
_HDF5_MATLAB: Final = b"MATLAB 7.3 MAT-file"
#: Exceptions that openpyxl raises on damaged files.
_DAMAGE: Final = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    NotImplementedError,
    OSError,
    SyntaxError,  # of XML
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)
#: Arrays of so few values are parameters, such as corners of filters, beside longer ones.
_FEW: Final = 10
#: Most rows and columns of a sheet of Excel.
_MOST_ROWS, _MOST_COLUMNS = 1_048_576, 200


def is_workbook(data: bytes) -> bool:
    """Return True if a ZIP archive is a workbook of Excel (.xlsx).

    Examples
    --------
    >>> is_workbook(b"time_s,acc_g")
    False
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _WORKBOOK in archive.namelist()
    except (zipfile.BadZipFile, OSError, ValueError):
        return False


def is_matlab(head: bytes) -> bool:
    """Return True if a file begins like one of MATLAB, of any version that has a header."""
    return head.startswith((_MATLAB, _HDF5_MATLAB))


def sheets(where: Path, data: bytes, most_columns: int = _MOST_COLUMNS) -> Iterator[Table]:
    """Yield the sheets of a workbook that have two rows with numbers or more, as CSV.

    Parameters
    ----------
    where : Path
        The file, for error messages.
    data : bytes
        The workbook.
    most_columns : int
        Largest number of columns of a sheet.

    Raises
    ------
    InputError
        If openpyxl is not installed, the workbook is damaged, or a sheet is too large.

    Notes
    -----
    Of formulas, the values are read that the program that saved the workbook had computed. Numbers
    keep all digits.
    """
    try:
        from openpyxl import load_workbook
    except ImportError:
        message = "is a workbook, which needs openpyxl: pip install 'rockframe[tables]'."
        raise InputError(where, f"{message} Or save the sheet as CSV.") from None
    try:
        book = load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        tables = [(sheet.title, _rows(where, sheet, most_columns)) for sheet in book.worksheets]
    except InputError:
        raise
    except _DAMAGE as error:
        raise InputError(where, f"corrupted workbook: {type(error).__name__}.") from None
    written = [(name, _as_csv(rows)) for name, rows in tables if _has_numbers(rows)]
    if not written:
        raise InputError(where, "workbook without numbers. Must have two rows of them or more.")
    yield from written


def _rows(where: Path, sheet: Any, most_columns: int) -> list[list[Any]]:
    """Return the rows of a sheet, without columns that are empty and without rows at its end.

    Empty rows between others stay: what reads the text counts them as lines.
    """
    rows: list[list[Any]] = []
    for cells in sheet.iter_rows(values_only=True):
        row = list(cells)
        while row and row[-1] is None:
            row.pop()
        rows.append(row)
        if len(rows) > _MOST_ROWS or len(row) > most_columns:
            size = f"{len(rows)} rows, the last of {len(row)} columns"
            allowed = f"at most {_MOST_ROWS} rows and {most_columns} columns"
            raise InputError(where, f"sheet of {size}. Must be {allowed}.")
    while rows and not rows[-1]:
        rows.pop()
    first = min((_first_cell(row) for row in rows if row), default=0)
    return [row[first:] for row in rows]


def _has_numbers(rows: list[list[Any]]) -> bool:
    numeric = (row for row in rows if any(isinstance(cell, int | float) for cell in row))
    return len(list(islice(numeric, 2))) == 2


def _first_cell(row: list[Any]) -> int:
    return next(k for k, cell in enumerate(row) if cell is not None)


def _as_csv(rows: list[list[Any]]) -> bytes:
    stream = io.StringIO()
    write_rows(stream, [["" if cell is None else _cell(cell) for cell in row] for row in rows])
    return stream.getvalue().encode()


def _cell(cell: Any) -> Any:
    return cell.isoformat() if hasattr(cell, "isoformat") else cell


def arrays(where: Path, data: bytes) -> Iterator[Table]:
    """Yield the numeric arrays of a MATLAB file as CSV: those of one length are a table together.

    Parameters
    ----------
    where : Path
        The file, for error messages.
    data : bytes
        The file, of version 5 to 7.

    Raises
    ------
    InputError
        If the file is of version 7.3, is damaged, too large, or has no numeric array of two values.

    Notes
    -----
    A vector is a column with the name of its variable; a matrix has one column for each of its
    columns, or rows if it is wider than long. Structures and cells, and arrays of ten values or
    fewer beside longer ones, are not read.
    """
    if data.startswith(_HDF5_MATLAB):
        raise InputError(where, "is of MATLAB 7.3. Save it by `save(name, '-v7')`.")
    try:
        variables = numeric_arrays(data, _LARGEST)
    except (ValueError, zlib.error) as error:
        raise InputError(where, f"corrupted MATLAB file: {error}.") from None
    tables = _by_length(where, variables)
    if not tables:
        raise InputError(where, "no table. Must have a numeric array of two values or more.")
    longest = max(tables)
    for length, columns_of in sorted(tables.items(), reverse=True):
        if length <= _FEW < longest:
            continue
        rows = np.stack([column.astype(np.float64) for column in columns_of.values()], axis=1)
        yield f"{length}-values", _as_csv([list(columns_of), *rows.tolist()])


def _by_length(
    where: Path, variables: Mapping[str, NDArray[Any]]
) -> dict[int, dict[str, NDArray[Any]]]:
    """Return the columns of the tables by their length, and by their names."""
    tables: dict[int, dict[str, NDArray[Any]]] = {}
    for name, values in variables.items():
        array = np.squeeze(np.asarray(values))
        if array.ndim == 2 and array.shape[0] < array.shape[1]:
            array = array.T
        if array.dtype.kind not in "fiu" or array.ndim not in (1, 2) or len(array) < 2:
            continue
        columns = array[:, None] if array.ndim == 1 else array
        names = [name] if array.ndim == 1 else [f"{name}_{k + 1}" for k in range(columns.shape[1])]
        table = tables.setdefault(len(columns), {})
        for own, column in zip(names, columns.T, strict=True):
            if own in table:
                message = f"two columns named {own!r}, of a vector and of a matrix."
                raise InputError(where, f"{message} Rename one of these variables.")
            table[own] = column
    return tables
