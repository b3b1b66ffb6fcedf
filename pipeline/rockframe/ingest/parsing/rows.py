"""Rows of a text table in plain form: numbers that touch, numbers of lines, and end marks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.parsing.columns import are_pairs, is_index
from rockframe.ingest.parsing.lines import decoded
from rockframe.ingest.parsing.timing import clock_seconds, is_clock

#: A minus after a digit, before a number with a point: fixed columns without a blank between them.
_TOUCHING: Final = re.compile(rb"-(?<=\d-)(?=\d*\.\d)")
#: Number of bytes in which such numbers are sought.
_HEAD: Final = 1 << 14
_ONLY_NUMBERS: Final = re.compile(rb"[\s\d.+\-eEdD]+")
#: Last lines of input files of programs: a word, perhaps after an asterisk, or closed brackets.
_END_MARK: Final = re.compile(rb"\*? ?[A-Za-z][A-Za-z &*/]{2,40}|[})\]/]{1,3};?&?|[#%].*")
_VALUES: Final = frozenset([b"nan", b"inf", b"infinity"])
#: Largest number of end marks.
_MOST_MARKS: Final = 3
#: Number of rows by which numbers of lines are recognised.
_FIRST_ROWS: Final = 20
#: Least number of them.
_FEWEST: Final = 10


def without_end_marks(text: bytes) -> tuple[bytes, str]:
    r"""Return a text without the lines at its end that hold no number, and these lines in words.

    Examples
    --------
    >>> without_end_marks(b"0.1\n0.2\n*END")
    (b'0.1\n0.2', "'*END' below the rows left out")
    >>> without_end_marks(b"0.1\nnan")
    (b'0.1\nnan', '')
    """
    marks: list[str] = []
    while len(marks) < _MOST_MARKS:
        before, _, last = text.rpartition(b"\n")
        mark = last.strip()
        is_value = any(word.lower() in _VALUES for word in mark.split())
        if not before or is_value or not _END_MARK.fullmatch(mark):
            break
        text = before.rstrip()
        marks.insert(0, repr(decoded(mark)[:20]))
    return text, f"{', '.join(marks)} below the rows left out" if marks else ""


def apart(text: bytes) -> tuple[bytes, str]:
    r"""Return a text with blanks between numbers that touch, and what was done in words.

    Only lines of numbers alone change, and only before a number with a point: `1.5-101`, an
    exponent without its letter, and `2019-07-06` stay as they are.

    Examples
    --------
    >>> apart(b"9.5-10.5 Hz\n 0.000340-0.000617\n")
    (b'9.5-10.5 Hz\n 0.000340 -0.000617\n', 'numbers that touch')
    """
    if not _TOUCHING.search(text, 0, _HEAD):
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
    path: Path, body: bytes, first_line: int, count: int
) -> tuple[bytes, int, str]:
    r"""Return rows without the number of the line at their end, their columns, and words for it.

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

    Raises
    ------
    InputError
        If a row has another number than its place.

    Examples
    --------
    >>> rows = b"\n".join(b"0.1 0.2 %d" % number for number in range(1, 12))
    >>> body, count, taken = without_line_numbers(Path("a.eq"), rows, 2, 3)
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
        values, _, printed = row.rstrip().rpartition(b" ")
        if printed != b"%d" % (first + number):
            message = f"number {decoded(printed)!r} of a line. Must be {first + number}, counted"
            raise InputError(path, f"{message} from the first row.", first_line + number)
        rows.append(values.rstrip())
    return b"\n".join(rows), count - 1, "numbers of lines left out"


def without_blank_columns(
    text: bytes, cells: Sequence[Sequence[str]], separator: str
) -> tuple[bytes, str]:
    """Return a text without columns that are blank in the first rows, and words for it.

    A line with anything in such a column stays as it is, and then has too many columns.

    Parameters
    ----------
    text : bytes
        Lines of a table, with its names.
    cells : sequence of sequence of str
        Cells of the first rows.

    Examples
    --------
    >>> without_blank_columns(b"t,acc,,vel", [["0.0", "0.1", "", "3"]], ",")
    (b't,acc,vel', '1 blank column left out')
    """
    width = len(cells[0]) if cells else 0
    blank = [k for k in range(width) if not any(row[k] for row in cells)]
    if not blank or len(blank) == width:
        return text, ""
    mark, lines = separator.encode(), []
    for line in text.split(b"\n"):
        fields = line.split(mark)
        if width <= len(fields) <= width + 1 and not any(fields[k].strip() for k in blank):
            line = mark.join(field for k, field in enumerate(fields) if k not in blank)
        lines.append(line)
    taken = f"{len(blank)} blank column{'s' * (len(blank) > 1)} left out"
    return b"\n".join(lines), taken


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
