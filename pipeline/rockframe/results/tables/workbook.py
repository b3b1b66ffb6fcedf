"""Excel workbooks: named sheets with units and a fixed header; equal rows give equal bytes."""

from __future__ import annotations

import io
import math
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rockframe.cells import harmless, plain
from rockframe.errors import InputError
from rockframe.provenance import whole_file

#: Largest number of rows of a sheet below its header, and of characters of its name.
_MOST_ROWS: Final = 1_048_575
_MOST_CHARACTERS: Final = 31
#: Units at the end of names of columns, the longer ones first.
_UNITS: Final = {
    "_kn_s": "kN s",
    "_m_s": "m/s",
    "_n_m": "N/m",
    "_years": "years",
    "_rad": "rad",
    "_degree": "degree",
    "_deg": "deg",
    "_km": "km",
    "_kn": "kN",
    "_hz": "Hz",
    "_kg": "kg",
    "_pa": "Pa",
    "_g": "g",
    "_m": "m",
    "_n": "N",
    "_s": "s",
}
_SUFFIXES: Final = {unit: suffix for suffix, unit in _UNITS.items()}
#: Characters that names of sheets cannot have.
_NOT_IN_NAMES: Final = re.compile(r"[\[\]:*?/\\]")
#: Rows that decide the width of a column, and bounds of the width [characters].
_MEASURED: Final = 200
_WIDTHS: Final = (8, 44)
#: The time that all files in a workbook have: the first that a zip archive can state.
_TIME: Final = (1980, 1, 1, 0, 0, 0)
_CHANGED: Final = re.compile(rb"(<dcterms:(created|modified)[^>]*>)[^<]*")


def head_with_unit(name: str) -> str:
    """Return the heading of a column, with the unit that its name ends in.

    Examples
    --------
    >>> [head_with_unit(name) for name in ("peak_u_84_m", "pgv_m_s", "impulse_kn_s", "mass_ratio")]
    ['peak_u_84 [m]', 'pgv [m/s]', 'impulse [kN s]', 'mass_ratio']
    """
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return f"{name.removesuffix(suffix)} [{unit}]"
    return name


def name_of_head(head: str) -> str:
    """Return the name of a column from its heading.

    Examples
    --------
    >>> name_of_head("peak_u_84 [m]"), name_of_head("mass_ratio")
    ('peak_u_84_m', 'mass_ratio')
    """
    name, _, unit = head.removesuffix("]").rpartition(" [")
    return name + _SUFFIXES[unit] if unit in _SUFFIXES and name else head


def sheet_name(text: str) -> str:
    """Return a text as a name that a sheet can have.

    Examples
    --------
    >>> sheet_name("site: 1/2"), len(sheet_name(40 * "a"))
    ('site_ 1_2', 31)
    """
    return _NOT_IN_NAMES.sub("_", plain(text))[:_MOST_CHARACTERS].strip("'") or "rows"


def write_workbook(path: Path, sheets: Mapping[str, Iterable[Mapping[str, Any]]]) -> int:
    """Write tables as sheets of a workbook, complete or not at all; return the number of rows.

    The header and the first column stay in view. NaN and None are blank, infinite numbers the text
    ``inf`` as in CSV, and texts are `plain` and `harmless`.

    Parameters
    ----------
    path : Path
        File to write.
    sheets : mapping of str to iterable of mapping
        Rows of each sheet by its name; rows have the same columns.

    Raises
    ------
    InputError
        If a sheet has too many rows, or the file cannot be written.
    """
    from openpyxl import Workbook

    book, count = Workbook(write_only=True), 0
    with whole_file(path) as partial:
        for name, given in sheets.items():
            rows = list(given)
            if len(rows) > _MOST_ROWS:
                limit = f"Must be at most {_MOST_ROWS} for xlsx."
                raise InputError(path, f"has {len(rows)} rows. {limit}")
            _fill(book.create_sheet(sheet_name(name)), rows)
            count += len(rows)
        content = io.BytesIO()
        book.save(content)
        partial.write_bytes(_without_time(content))
    return count


def heads_of(path: Path) -> list[str]:
    """Return the names of the columns of the first sheet of a workbook."""
    from openpyxl import load_workbook

    book = load_workbook(path, read_only=True)
    try:
        first = next(book.worksheets[0].iter_rows(max_row=1, values_only=True), ())
    finally:
        book.close()
    return [name_of_head(str(head)) for head in first]


def _fill(sheet: Any, rows: Sequence[Mapping[str, Any]]) -> None:
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    columns = list(rows[0]) if rows else []
    forms = [_form(name, [row[name] for row in rows]) for name in columns]
    sheet.freeze_panes = "B2"
    for place, name in enumerate(columns, 1):
        texts = [head_with_unit(name), *(_shown(row[name]) for row in rows[:_MEASURED])]
        width = min(max(len(max(texts, key=len)) + 2, _WIDTHS[0]), _WIDTHS[1])
        sheet.column_dimensions[get_column_letter(place)].width = width

    def cell(value: Any, form: str = "", *, bold: bool = False) -> Any:
        written_cell = WriteOnlyCell(sheet, value=value)
        if bold:
            written_cell.font = Font(bold=True)
        if form and isinstance(value, int | float):
            written_cell.number_format = form
        return written_cell

    if columns:
        sheet.append([cell(head_with_unit(name), bold=True) for name in columns])
    for row in rows:
        values = (_value(row[name]) for name in columns)
        sheet.append([cell(value, form) for value, form in zip(values, forms, strict=True)])


def _value(value: Any) -> Any:
    """Return the content of a cell."""
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    if value is None or isinstance(value, int | float):
        return value
    return harmless(plain(str(value)))


def _shown(value: Any) -> str:
    """Return a text about as long as the cell is shown."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _form(name: str, values: Sequence[Any]) -> str:
    """Return the number format of a column: shares in percent, other numbers to fit the largest."""
    numbers = [
        value_of_cell
        for value_of_cell in values
        if isinstance(value_of_cell, float) and math.isfinite(value_of_cell)
    ]
    if not numbers:
        return ""
    if name.rpartition(" ")[2].startswith("share_"):
        return "0.0%"
    largest = max(map(abs, numbers))
    if not (largest == 0.0 or 1e-2 <= largest < 1e6):
        return "0.000E+00"
    return "0.0" if largest >= 1e3 else "0.00" if largest >= 1e2 else "0.000"


def _without_time(content: io.BytesIO) -> bytes:
    """Return a workbook without the time at which it was written."""
    packed = io.BytesIO()
    with zipfile.ZipFile(content) as source, zipfile.ZipFile(packed, "w") as target:
        for name in source.namelist():
            part = source.read(name)
            if name == "docProps/core.xml":
                part = _CHANGED.sub(rb"\g<1>1980-01-01T00:00:00Z", part)
            entry = zipfile.ZipInfo(name, _TIME)
            target.writestr(entry, part, zipfile.ZIP_DEFLATED)
    return packed.getvalue()
