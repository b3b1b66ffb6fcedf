"""Rows of a text table in plain form: numbers that touch, numbers of lines, and end marks."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.options import SEPARATORS, TextLayout
from rockframe.ingest.parsing.columns import are_pairs, is_index
from rockframe.ingest.parsing.lines import decoded
from rockframe.ingest.parsing.timing import clock_seconds, is_clock

#: A minus after a digit, before a number with a point: fixed columns without a blank between them.
_TOUCHING: Final = re.compile(rb"-(?<=\d-)(?=\d*\.\d)")
_DATE: Final = re.compile(r"\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}\.\d{1,2}\.\d{4}", re.A)
NUMBER: Final = re.compile(
    r"[-+]?(\d+\.?\d*|\.\d+)([eEdD][-+]?\d+)?|[-+]?(nan|inf|infinity)", re.I | re.A
)
_DECIMAL_COMMA: Final = re.compile(r"[-+]?\d*,\d+([eEdD][-+]?\d+)?", re.A)
_ONLY_NUMBERS: Final = re.compile(rb"[\s\d.+\-eEdD]+")
#: Last lines of input files of programs: an end, or closed brackets.
_END_MARK: Final = re.compile(
    rb"[*$&]? ?(?:end(?: ?(?:of )?(?:file|data|record|table))?|endt|eof)[.;]?|[})\]/]{1,3};?&?",
    re.I,
)
#: The same of programs whose input begins with such a line, too.
_KEYWORD: Final = re.compile(rb"\*[A-Za-z]{3,20}(?: [A-Za-z]{2,20}){0,3}")
_FIRST_KEYWORD: Final = re.compile(rb"\s*\*[A-Za-z]")
#: Largest number of end marks, besides comments, and of those that are noted.
_MOST_MARKS: Final = 3
#: Number of rows by which numbers of lines are recognised.
_FIRST_ROWS: Final = 20
#: Least number of them.
_FEWEST: Final = 10


@dataclass(frozen=True)
class Form:
    """Separator, decimal mark, quotes and blank columns of the rows of a table.

    Parameters
    ----------
    separator : str or None
        None is any white space.
    comma : bool
        True if the decimal mark is a comma.
    trailing : bool
        True if a separator follows the last column.
    blank : tuple of int
        Columns that are blank.
    width : int
        Number of columns, with those that are blank; 0 if none is.
    date : int or None
        Column of a date, which is one with the clock time beside it.

    Examples
    --------
    >>> Form(";", comma=True).cells("0,01;0,2"), Form(",", trailing=True).cells("0.01,0.2,")
    (['0.01', '0.2'], ['0.01', '0.2'])
    """

    separator: str | None = None
    comma: bool = False
    trailing: bool = False
    blank: tuple[int, ...] = ()
    width: int = 0
    date: int | None = None

    def fields(self, line: str) -> list[str]:
        """Return the cells of a line as they are separated, without quotes."""
        if '"' in line and self.separator:
            cells = next(csv.reader([line.strip()], delimiter=self.separator), [])
        else:
            cells = line.replace('"', "").split(self.separator)
        return [cell.strip() for cell in cells]

    def cells(self, line: str) -> list[str]:
        """Return the cells of a line with decimal points; a date and its clock time are one."""
        cells = self.fields(line)
        if ":" in line and (k := date_place(cells)) is not None:
            cells[k : k + 2] = [f"{cells[k]} {cells[k + 1]}"]
        if self.trailing and len(cells) > 1 and not cells[-1]:
            cells.pop()
        return [cell.replace(",", ".") for cell in cells] if self.comma else cells

    def without_blank(self, cells: list[str]) -> list[str]:
        """Return the cells of a line of names or numbers without those of blank columns."""
        if not self.blank or len(cells) != self.width:
            return cells
        return [cell for k, cell in enumerate(cells) if k not in self.blank]

    def places(self, count: int) -> tuple[int, ...]:
        """Return the place in a row of each column of the file, of which -1 are blank.

        Empty if no column is blank and none has dates: then each column has its own place.

        Parameters
        ----------
        count : int
            Number of columns that are not blank.
        """
        if not self.blank and self.date is None:
            return ()
        later = iter(range(count))
        places = [-1 if k in self.blank else next(later) for k in range(self.width or count)]
        if self.date is not None:
            places.insert(self.date, places[self.date])
        return tuple(places)

    def notes(self, count: int) -> list[str]:
        """Return in words which columns and marks are not those of a plain table."""
        blank = [str(k) for k, place in enumerate(self.places(count), 1) if place < 0]
        notes = {
            f"blank column{'s' * (len(blank) > 1)} {', '.join(blank)} left out": bool(blank),
            "separator after the last column": self.trailing,
            "decimal commas": self.comma,
        }
        return [note for note, applies in notes.items() if applies]

    def rows(self, path: Path, body: bytes, first_line: int) -> list[list[str]]:
        """Return the cells of all rows; a value in a blank column is an error."""
        rows = [self.cells(decoded(row)) if row.strip() else [] for row in body.split(b"\n")]
        if not self.blank:
            return rows
        for line, cells in enumerate(rows, first_line):
            if cells and {*range(len(cells), self.width)} <= {*self.blank}:
                cells += [""] * (self.width - len(cells))
            number = next((k + 1 for k in self.blank if k < len(cells) and cells[k]), 0)
            if number or (cells and len(cells) != self.width):
                message = f"{cells[number - 1]!r} in column {number}, which is blank in other rows."
                if not number:
                    count = f"{len(cells)} column{'s' * (len(cells) > 1)}"
                    shown = (self.separator or " ").join(cells)[:40]
                    message = f"{count} in {shown!r}. Must be {self.width}, as above."
                raise InputError(path, message, line)
        return [self.without_blank(cells) for cells in rows]


def form_of(row: str, words: TextLayout) -> Form:
    """Return the form of a row: a semicolon, a comma, a tab or blanks between its columns.

    Examples
    --------
    >>> form_of("0.01; 0.2", TextLayout()).separator
    ';'
    """
    plain = row.replace('"', "")
    pieces = plain.split("\t" if "\t" in plain else None)
    commas = [piece for piece in pieces if _DECIMAL_COMMA.fullmatch(piece.strip())]
    if words.separator is not None:
        code = SEPARATORS[words.separator]
        separator = None if code is None else code.decode()
    elif ";" in plain:
        separator = ";"
    elif words.decimal == "comma" or (len(commas) > 1 and "." not in plain and '"' not in row):
        separator = "\t" if "\t" in plain else None
    else:
        separator = "," if "," in plain else None
    if words.decimal is not None or separator == ",":
        quoted = separator == "," and _are_quoted_commas(row)
        return Form(separator, comma=words.decimal == "comma" or quoted)
    return Form(separator, comma="," in plain)


def _are_quoted_commas(row: str) -> bool:
    """Return True if cells in quotes have decimal commas."""
    cells = next(csv.reader([row.strip()]), [])
    return any(_DECIMAL_COMMA.fullmatch(cell) for cell in cells)


def numbers_in(line: str, form: Form) -> int:
    """Return the number of cells of a row; 0 if it is no row.

    Examples
    --------
    >>> numbers_in("0.01,,0.2", Form(",")), numbers_in("0.01,Vs30", Form(","))
    (3, 0)
    """
    cells = form.cells(line)
    return len(cells) if any(cells) and all(map(is_value, filter(None, cells))) else 0


def is_value(cell: str) -> bool:
    """Return True if a cell is a number or a clock time.

    Examples
    --------
    >>> is_value("-.5d-3"), is_value("03:19:53"), is_value("1.2.3")
    (True, True, False)
    """
    return bool(NUMBER.fullmatch(cell)) or is_clock(cell)


def recognised(form: Form, rows: Sequence[str], separator: str | None) -> Form:
    r"""Return the form of rows with its dates, blank columns between tabs, and a last separator.

    Parameters
    ----------
    rows : sequence of str
        The first rows.
    separator : str or None
        Separator that the user states; then white space may be one.

    Examples
    --------
    >>> recognised(Form(), ["0.0\t\t0.1", "0.1\t\t0.2"], None).separator
    '\t'
    """
    if not rows:
        return form
    plain = [row.strip() for row in rows]
    are_even = len({row.count("\t") for row in plain}) == 1
    if separator is None and form.separator is None and are_even and "\t\t" in plain[0]:
        form = replace(form, separator="\t")
    mark = form.separator
    if mark and mark.strip():
        ends = all(row.rstrip().rstrip('"').endswith(mark) for row in rows)
        form = replace(form, trailing=ends and len(rows) > 1)
    return replace(form, date=date_place(form.fields(rows[0])))


def date_place(cells: Sequence[str]) -> int | None:
    """Return the index of a date beside its clock time, or None.

    Examples
    --------
    >>> date_place(["1", "2019-07-06", "03:19:53.0", "0.1"])
    1
    """
    for k, (cell, other) in enumerate(pairwise(cells)):
        if _DATE.fullmatch(cell) and is_clock(other):
            return k
    return None


def blank_columns(cells: Sequence[Sequence[str]]) -> tuple[int, ...]:
    """Return the indices of columns that are blank in all rows, unless all of them are.

    Examples
    --------
    >>> blank_columns([["0.0", "", "0.1"], ["0.1", "", "0.3"]])
    (1,)
    """
    width = len(cells[0]) if cells else 0
    blank = tuple(k for k in range(width) if not any(row[k] for row in cells))
    return blank if len(blank) < width else ()


def without_end_marks(text: bytes, comments: tuple[str, ...]) -> tuple[bytes, str]:
    r"""Return a text without end marks and comments below its last row, and these lines in words.

    Other words are an error: they may stand for samples that are missing.

    Parameters
    ----------
    text : bytes
        Text without white space at its end.
    comments : tuple of str
        Marks of comments.

    Examples
    --------
    >>> without_end_marks(b"0.1\n0.2\n*END", ("#",))
    (b'0.1\n0.2', "'*END' below the rows left out")
    >>> without_end_marks(b"0.1\nN/A", ("#",))
    (b'0.1\nN/A', '')
    """
    starts = tuple(mark.encode() for mark in comments)
    marks: list[str] = []
    end, ends, keyword = len(text), 0, _FIRST_KEYWORD.match(text)
    while start := text.rfind(b"\n", 0, end) + 1:
        line = text[start:end].strip()
        if line and not line.startswith(starts):
            ends += 1
            is_mark = _END_MARK.fullmatch(line) or (keyword and _KEYWORD.fullmatch(line))
            if not is_mark or ends > _MOST_MARKS:
                break
        if line:
            marks.insert(0, repr(decoded(line)[:20]))
        end = start - 1
    if not marks:
        return text, ""
    more = f" and {len(marks) - _MOST_MARKS} more" if len(marks) > _MOST_MARKS else ""
    return text[:end].rstrip(), f"{', '.join(marks[:_MOST_MARKS])}{more} below the rows left out"


def apart(text: bytes) -> tuple[bytes, str]:
    r"""Return a text with blanks between numbers that touch, and what was done in words.

    Only lines of numbers alone change, and only before a number with a point: `1.5-101`, an
    exponent without its letter, and `2019-07-06` stay as they are.

    Examples
    --------
    >>> apart(b"9.5-10.5 Hz\n 0.000340-0.000617\n")
    (b'9.5-10.5 Hz\n 0.000340 -0.000617\n', 'numbers that touch')
    """
    if not _TOUCHING.search(text):
        return text, ""
    lines = text.split(b"\n")
    changed = [
        _TOUCHING.sub(b" -", line) if _ONLY_NUMBERS.fullmatch(line) else line for line in lines
    ]
    return b"\n".join(changed), "numbers that touch" if changed != lines else ""


def are_lines_of_pairs(cells: Sequence[Sequence[str]]) -> bool:
    """Return True if each row has several pairs of time and acceleration.

    Examples
    --------
    >>> are_lines_of_pairs([["0", "0.3", ".01", "-0.1"], [".02", "0.2", ".03", "0.1"]])
    True
    """
    try:
        values = np.array([float(cell) for row in cells for cell in row])
    except ValueError:
        return False
    count = len(cells[0]) if cells else 0
    return count > 2 and len(cells) > 1 and are_pairs(values, count)


def without_line_numbers(
    path: Path, body: bytes, first_line: int, count: int, is_stated: bool
) -> tuple[bytes, int, str]:
    r"""Return rows without the numbers of lines at their end, the count of columns, and a note.

    Lines are numbered if the last column counts from 0 or 1, and all others have decimal points. A
    last row with fewer values has its number, too.

    Parameters
    ----------
    body : bytes
        Rows of columns between blanks.
    first_line : int
        Line number of the first row.
    count : int
        Number of columns.
    is_stated : bool
        True if the user states which columns are read: then a row may have another number.

    Raises
    ------
    InputError
        If a row has another number than its place.

    Examples
    --------
    >>> rows = b"\n".join(b"0.1 0.2 %d" % number for number in range(1, 12))
    >>> body, count, taken = without_line_numbers(Path("a.eq"), rows, 2, 3, False)
    >>> body[:15], count, taken
    (b'0.1 0.2\n0.1 0.2', 2, 'numbers of lines left out')
    """
    head = [row.split() for row in body.split(b"\n", _FIRST_ROWS)[:_FIRST_ROWS]]
    cells = [row for row in head if len(row) == count]
    last = [row[-1] for row in cells]
    first = int(last[0]) if last and last[0] in (b"0", b"1") else -1
    counted = [b"%d" % (first + k) for k in range(len(last))]
    decimal = all(b"." in cell for row in cells for cell in row[:-1])
    if count < 2 or len(last) < _FEWEST or first < 0 or last != counted or not decimal:
        return body, count, ""
    rows: list[bytes] = []
    for number, row in enumerate(body.split(b"\n")):
        *values, printed = row.rsplit(None, 1) or [b""]
        if printed != b"%d" % (first + number) and is_stated:
            return body, count, ""
        if printed != b"%d" % (first + number):
            message = f"number {decoded(printed)!r} of a line. Must be {first + number}, counted"
            do = "If the last column is no number of the line, state --column or --channels."
            raise InputError(path, f"{message} from the first row. {do}", first_line + number)
        rows.append(values[0] if values else b"")
    return b"\n".join(rows), count - 1, "numbers of lines left out"


def has_line_numbers(names: Sequence[str], cells: Sequence[Sequence[str]], count: int) -> bool:
    """Return True if the first column has the numbers of rows, by its name or beside times.

    Parameters
    ----------
    names : sequence of str
        Names of the columns; empty if there are none.
    cells : sequence of sequence of str
        Cells of the first rows.
    count : int
        Number of columns.

    Examples
    --------
    >>> has_line_numbers(["", "acc_g"], [["1", "0.3"], ["2", "0.1"]], 2)
    True
    """
    first, others = [row[0] for row in cells if row], [row[1] for row in cells if len(row) > 1]
    if names:
        return len(names) == count > 1 and is_index(names[0], first)
    if count < 2 or len(first) < _FEWEST or not is_index("", first):
        return False
    if count == 2:
        return not _are_times(others)
    steps = [later > earlier for earlier, later in pairwise(others)]
    return all(steps) if any(is_clock(cell) for cell in others) else _are_times(others)


def _are_times(cells: Sequence[str]) -> bool:
    """Return True if printed numbers increase evenly by steps that are not 1."""
    try:
        times = [float(cell) for cell in cells]
    except ValueError:
        return False
    steps = [later - earlier for earlier, later in pairwise(times)]
    return min(steps) > 0.0 and max(steps) < 2.0 * min(steps) and not 0.99 < min(steps) < 1.01


def rewritten(rows: list[list[str]], clocks: Iterable[int], *, from_column: int) -> bytes:
    r"""Return rows with commas between their cells, from a column on.

    Clock times become seconds since midnight, and go on after it.

    Parameters
    ----------
    rows : list of list of str
        Cells of each row; changed in place.
    clocks : iterable of int
        Columns of clock times.

    Examples
    --------
    >>> rewritten([["1", "00:00:01", "0.1"], ["2", "00:00:02", "0.2"]], [1], from_column=1)
    b'1,0.1\n2,0.2'
    """
    for k in clocks:
        times = clock_seconds([row[k] if k < len(row) else "" for row in rows])
        for row, time in zip(rows, times, strict=True):
            if k < len(row):
                row[k] = time
    return b"\n".join(",".join(row[from_column:]).encode() for row in rows)
