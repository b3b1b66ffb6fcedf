"""Reader of number tables (CSV or white space): times and accelerations, or one acceleration.

Optional comment lines (``#``, ``%``) come first, then an optional line of column names, which
states the units: ``time_s,acc_g``, ``t, acceleration [m/s2]``, ``acc_cm_s2``. No units are assumed.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.column_headers import (
    Columns,
    column_names,
    is_known,
    is_row,
    read_headers,
    split_fields,
    units_in,
)
from rockframe.ingest.parsing.lines import (
    are_finite,
    bad_number,
    blocks,
    decoded,
    head_lines,
    is_number,
    parse_numbers,
    plain_text,
    require_whole_end,
)
from rockframe.ingest.parsing.timing import even_time_step
from rockframe.record import Record
from rockframe.units import acceleration_factor

DESCRIPTION = "CSV or white-space text: time and acceleration, or acceleration alone"

#: Characters of rows of numbers; `numpy.loadtxt` treats some other characters as blanks.
_USUAL: Final = bytes({*range(ord(" "), 0x7F), *b"\t\n\v\f\r"} - {*b"_"})
#: Number of rows whose number of digits is compared with that of the last row.
_ROWS_OF_END: Final = 20
_STATED_COUNT: Final = re.compile(r"\bnpts\b\s*[:=]?\s*(\d{1,12})\b", re.I)
_STATED_STEP: Final = re.compile(
    r"\bdt\b\s*[:=]\s*(?P<step>\d*\.?\d+(?:e[-+]?\d{1,2})?)\s*(?:s|sec|seconds?)?\s*(?:[,;]|$)",
    re.I,
)
#: Possible numbers of values per line, in a series without times.
_SERIES: Final = (8, 10)
#: Relative tolerance between two time steps, one of which is rounded.
_SAME_STEP: Final = 1e-3


@dataclass(frozen=True)
class _Layout:
    """Comments and column names, and the rows of numbers with their separator."""

    comments: list[str]
    names: list[str]
    names_line: int
    body: bytes
    first_line: int
    separator: bytes | None

    @property
    def rows(self) -> list[bytes]:
        return self.body.split(b"\n")

    @property
    def columns(self) -> int:
        return len(self.body.partition(b"\n")[0].split(self.separator))


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a table of one or two columns of numbers.

    Examples
    --------
    >>> sniff(b"0.00 0.1\n0.01 0.2\n"), sniff(b"# Records\n\nSix of them.\n")
    (True, False)
    """
    lines = [decoded(line.encode("latin-1")) for line in head_lines(head)]
    start = _first_content(lines)
    # The last line of the head may be cut. One invalid line is allowed here: `read` reports it.
    rows = [line for line in lines[start:-1] or lines[start:] if line.strip()]
    if not rows:
        return False
    names = column_names(rows[0])
    if not names:
        numeric = [is_row(row) for row in rows]
        # Three or four columns below comments may be another format, such as CWA.
        count = len(split_fields(rows[0]))
        few = count <= (2 if start else 4) or count in _SERIES
        return numeric[0] and few and 2 * sum(numeric) > len(rows)
    # twice the columns between commas are numbers with decimal commas, which `read` reports
    return (len(names) <= 2 or any(map(is_known, names))) and any(
        is_row(row) and len(split_fields(row)) in (len(names), 2 * len(names) * ("," in row))
        for row in rows[1:4]
    )


def states_units(head: bytes) -> bool:
    r"""Return True if column names or comments at the head of a table state acceleration units.

    Examples
    --------
    >>> states_units(b"# units: gal\n0.1\n0.2\n"), states_units(b"0.00 0.1\n0.01 0.2\n")
    (True, False)
    """
    lines = [decoded(line.encode("latin-1")) for line in head_lines(head)]
    start = _first_content(lines)
    if any(map(units_in, lines[:start])):
        return True
    names = column_names(lines[start]) if start < len(lines) else []
    try:
        return bool(names) and read_headers(Path(), names, len(names), start + 1).units is not None
    except InputError:
        return False  # other quantities, or several columns of which the user must choose one


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the records of a number table, one for each component that its column names state.

    Raises
    ------
    InputError
        If neither file nor options state units or time step; if a comment contradicts units, time
        step or number of samples; if a column is not time or acceleration; if rows differ in
        length; if a number is invalid; or if times are uneven.

    Examples
    --------
    >>> [record] = read(Path("shake.txt"), b"0.1\n-0.2\n", ReadOptions("g", 0.01))
    >>> record.time_step, record.acceleration
    (0.01, array([ 0.981, -1.962]))
    """
    layout = _split(path, data)
    names_line = layout.names_line or layout.first_line
    is_series = not layout.names and layout.columns in _SERIES and options.column is None
    # Eight or ten values per line, without times, are one series.
    columns = (
        Columns(None, {0: ""}, None)
        if is_series
        else read_headers(path, layout.names, layout.columns, names_line, options.column)
    )
    stated = columns.units
    factor = factor_to_si(path, stated, options, layout.names_line or None)
    taken = f"{stated!r} in the column name" if stated else f"{options.units!r} given"
    _require_units(path, layout, factor, taken)
    table = _series(path, layout) if is_series else _parse(path, layout, columns)
    if not data[-1:].isspace():
        end = layout.body.rsplit(b"\n", _ROWS_OF_END)[-_ROWS_OF_END:]
        line = layout.first_line + layout.body.count(b"\n") + 1 - len(end)
        require_whole_end(path, b"\n".join(end), line, 1 if is_series else layout.columns)
    _require_count(path, layout, len(table))
    step = _agreed_step(path, layout, _time_step(path, layout, columns.time, table, options))
    ids = record_ids(path, [*columns.accelerations.values()])
    return [
        Record(
            record_id=record_id,
            acceleration=table[:, place] * factor,
            time_step=step,
            **directed(name),
        )
        for (place, name), record_id in zip(columns.accelerations.items(), ids, strict=True)
    ]


def _split(path: Path, data: bytes) -> _Layout:
    comments, body = _skip_comments(plain_text(path, data).rstrip())
    names = column_names(decoded(body.partition(b"\n")[0]))
    names_line = len(comments) + 1 if names else 0
    skipped: list[str] = []
    if names:
        skipped, body = _skip_comments(body.partition(b"\n")[2])
    if not body:
        raise InputError(path, "no rows of numbers.")
    first_row = body.partition(b"\n")[0]
    separator = b";" if b";" in first_row else b"," if b"," in first_row else None
    if separator == b";":
        body = body.replace(b",", b".")  # decimal commas
    first_line = len(comments) + bool(names) + len(skipped) + 1
    return _Layout(comments, names, names_line, body, first_line, separator)


def _skip_comments(text: bytes) -> tuple[list[str], bytes]:
    """Return the leading comment lines and blank lines, and the text after them."""
    count = _first_content(map(decoded, io.BytesIO(text)))
    *lines, rest = text.split(b"\n", count)
    if len(lines) < count:
        lines, rest = [*lines, rest], b""
    return [decoded(line) for line in lines], rest


def _series(path: Path, layout: _Layout) -> Float:
    """Return all numbers of a series with several values per line, shape (samples, 1)."""
    separator = layout.separator or b" "
    rows = layout.rows
    for line, row in enumerate(rows, layout.first_line):
        count = len(row.split(layout.separator))
        last = line == layout.first_line + len(rows) - 1
        if count > layout.columns or (count < layout.columns and not last):
            message = f"{count} values in a line. Must be {layout.columns}, as in the first row."
            raise InputError(path, message, line=line)
    body = b"\n".join(row.replace(separator, b" ") for row in rows)
    return parse_numbers(path, body, layout.first_line).reshape(-1, 1)


def _parse(path: Path, layout: _Layout, columns: Columns) -> Float:
    """Return all numbers, shape (rows, columns)."""
    quantities = ["acceleration"] * layout.columns
    if columns.time is not None:
        quantities[columns.time] = "time"
    try:
        parts = [_parse_rows(block, layout) for block in blocks(layout.body + b"\n")]
    except ValueError:
        raise _first_bad_row(path, layout, quantities) from None
    table = np.concatenate(parts)
    if not are_finite(table):
        raise _first_bad_row(path, layout, quantities)
    return table


def _parse_rows(text: bytes, layout: _Layout) -> Float:
    if text.translate(None, _USUAL):
        raise ValueError("characters that are in no number")
    separator = layout.separator.decode() if layout.separator else None
    table: Float = np.loadtxt(io.BytesIO(text), comments=None, delimiter=separator, ndmin=2)
    if table.shape != (text.count(b"\n"), layout.columns):  # loadtxt skips blank lines
        raise ValueError("blank lines")
    return table


def _first_bad_row(path: Path, layout: _Layout, quantities: list[str]) -> InputError:
    for line, row in enumerate(layout.rows, layout.first_line):
        tokens = row.split(layout.separator)
        if len(tokens) != layout.columns:
            shown = decoded(row).strip()[:40]
            count = f"{len(tokens)} column{'s' * (len(tokens) != 1)}"
            return InputError(path, f"{count} in {shown!r}. Must be {layout.columns}.", line)
        for token, quantity in zip(tokens, quantities, strict=True):
            if not is_number(token):
                return bad_number(path, token, line, quantity)
    raise AssertionError("every row is sound, yet they could not be read together")


def _require_count(path: Path, layout: _Layout, rows: int) -> None:
    if rows < 2:
        raise InputError(path, f"{rows} row of numbers. Must be 2 or more.", line=layout.first_line)
    for line, comment in enumerate(layout.comments, 1):
        stated = _STATED_COUNT.search(comment)
        if stated and int(stated[1]) != rows:
            message = f"npts {stated[1]} in the comment, {rows} rows in the file."
            settle(path, message, {"samples": rows}, line)


def _require_units(path: Path, layout: _Layout, factor: float, taken: str) -> None:
    for line, comment in enumerate(layout.comments, 1):
        stated = units_in(comment)
        if stated and acceleration_factor(stated) != factor:
            message = f"acceleration units {stated!r} in the comment, {taken}."
            raise InputError(path, message, line=line)


def _agreed_step(path: Path, layout: _Layout, step: float) -> float:
    """Return the time step [s] of the samples, or of a comment that the user trusts."""
    for line, comment in enumerate(layout.comments, 1):
        stated = _STATED_STEP.search(comment.strip())
        if stated and not math.isclose(float(stated["step"]), step, rel_tol=_SAME_STEP):
            message = f"dt {stated['step']} s in the comment, time step {step:g} s of the samples."
            steps = {"waveform": step, "header": float(stated["step"])}
            return settle(
                path, message, steps if steps["header"] > 0.0 else {"waveform": step}, line
            )
    return step


def _time_step(
    path: Path, layout: _Layout, time: int | None, table: Float, options: ReadOptions
) -> float:
    if time is not None:

        def printed() -> list[bytes]:
            return [row.split(layout.separator)[time] for row in layout.rows]

        return even_time_step(path, table[:, time], printed, layout.first_line, options.time_step)
    if options.time_step is None:
        message = "time step unstated. State it with --time-step-s, or add a column of times"
        raise InputError(path, f"{message} before the acceleration.")
    return options.time_step


def _first_content(lines: Iterable[str]) -> int:
    """Return the number of leading comment lines and blank lines."""
    count = 0
    for line in lines:
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            break
        count += 1
    return count
