"""Number tables, CSV or white space: time and acceleration, or acceleration alone.

Comment lines (``#``, ``%``) may come first, then one line of column names, which states the units:
``time_s,acc_g``, ``t, acceleration [m/s2]``, ``acc_cm_s2``. Nothing is assumed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.identify import record_ids
from rockframe.ingest.lines import bad_number, blocks, head_lines, is_number, text_of
from rockframe.ingest.options import ReadOptions, settle_units
from rockframe.ingest.timing import time_step_of
from rockframe.record import Record
from rockframe.units import ACCELERATION_UNITS, acceleration_factor

_TIME_NAMES: Final = frozenset(["t", "time"])
_TIME_UNITS: Final = frozenset(["", "s", "sec", "second", "seconds"])
_ACCELERATION_NAMES: Final = frozenset(["a", "acc", "accel", "acceleration"])
_OTHER_NAMES: Final = {
    "v": "velocity",
    "vel": "velocity",
    "velocity": "velocity",
    "d": "displacement",
    "disp": "displacement",
    "displacement": "displacement",
}
_KNOWN_NAMES: Final = _TIME_NAMES | _ACCELERATION_NAMES | _OTHER_NAMES.keys()
#: Spellings of units in column names, once blanks, underscores and carets are gone.
_SPELLINGS: Final = {
    "g": "g",
    "gal": "gal",
    **{f"cm{per}": "cm/s2" for per in ("s2", "/s2", "s-2", "/s/s", "/sec2", "/sec/sec")},
    **{f"m{per}": "m/s2" for per in ("s2", "/s2", "s-2", "/s/s", "/sec2", "/sec/sec")},
}
_STATED_COUNT: Final = re.compile(r"\bnpts\b\s*[:=]?\s*(\d+)", re.I)


@dataclass(frozen=True)
class _Layout:
    """What stands before the numbers, and how they are separated."""

    comments: list[str]
    names: list[str]
    first_line: int
    comma: bool
    columns: int


def sniff(head: bytes) -> bool:
    r"""Whether a file's beginning is that of a table of one or two columns of numbers.

    Parameters
    ----------
    head : bytes
        At most the first 4096 bytes.

    Examples
    --------
    >>> sniff(b"0.00 0.1\n0.01 0.2\n"), sniff(b"# Records\n\nSix of them.\n")
    (True, False)
    """
    lines = head_lines(head)
    start = _first_content(lines)
    if start == len(lines):
        return False
    names = _column_names(lines[start])
    if names and any(_words(name)[0] in _KNOWN_NAMES for name in names[:8]):
        return any(map(_is_row, lines[start + 1 : start + 3]))
    # The last line of the head may be cut, and one damaged line is for the reader to report.
    rows = [line for line in lines[start:-1] or lines[start:] if line.strip()]
    first = rows[1:2] if names else rows[:1]
    return all(map(_is_row, first)) and 2 * sum(map(_is_row, rows)) > len(rows)


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Read the one record of a number table.

    Parameters
    ----------
    path : Path
        The file, for names and errors.
    data : bytes
        Its contents.
    options : ReadOptions
        Units and time step, if the column names and times do not state them.

    Raises
    ------
    InputError
        If units or time step are unstated, a column is none of time and acceleration, rows differ
        in length, a number is none, or the times are uneven.

    Examples
    --------
    >>> [record] = read(Path("shake.txt"), b"0.1\n-0.2\n", ReadOptions("g", 0.01))
    >>> record.time_step, record.acceleration
    (0.01, array([ 0.981, -1.962]))
    """
    lines, body, layout = _split(path, data)
    time, acceleration, units = _roles(path, layout)
    factor = acceleration_factor(settle_units(path, units, options, _names_line(layout)))
    quantities = ["acceleration"] * layout.columns
    if time is not None:
        quantities[time] = "time"
    table = _parse(path, body, layout, quantities)
    if len(table) < 2:
        raise InputError(path, f"{len(table)} rows of numbers. Must be 2 or more.")
    _check_count(path, layout, len(table))
    if time is None:
        step = options.time_step
        if step is None:
            raise InputError(
                path,
                "time step unstated. Must be in a column of times before the acceleration "
                "or given with --time-step.",
            )
    else:
        tokens = [_tokens(line, layout.comma)[time] for line in lines]
        step = time_step_of(path, tokens, layout.first_line, options.time_step)
    return [
        Record(
            record_id=record_ids(path, [""])[0],
            acceleration=table[:, acceleration] * factor,
            time_step=step,
        )
    ]


def _split(path: Path, data: bytes) -> tuple[list[bytes], bytes, _Layout]:
    """Separate comments and column names from the rows of numbers."""
    text = text_of(path, data).rstrip()
    lines = text.split(b"\n")
    start = _first_content([line.decode("latin-1") for line in lines[:1000]])
    comments = [line.decode("latin-1") for line in lines[:start]]
    names = _column_names(lines[start].decode("latin-1")) if start < len(lines) else []
    if names:
        start += 1
        while start < len(lines) and not lines[start].strip():
            start += 1
    if start >= len(lines):
        raise InputError(path, "no rows of numbers. Must be 2 or more.")
    comma = b"," in lines[start]
    columns = len(_tokens(lines[start], comma))
    layout = _Layout(comments, names, start + 1, comma, columns)
    return lines[start:], b"\n".join(lines[start:]), layout


def _first_content(lines: list[str]) -> int:
    for number, line in enumerate(lines):
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            return number
    return len(lines)


def _column_names(line: str) -> list[str]:
    """The names in a header line; none if it is a row of numbers or prose."""
    if _is_row(line) or not re.match(r"\s*\"?[A-Za-z]", line):
        return []
    # In `time [s]  acc (g)` the brackets belong to the word before them.
    names = line.split(",") if "," in line else re.sub(r"\s+(?=[\[(])", "", line).split()
    return [name.strip().strip('"') for name in names]
