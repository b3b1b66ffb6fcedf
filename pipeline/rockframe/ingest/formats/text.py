"""Reader of number tables (CSV or white space): times and accelerations, or one acceleration.

Optional comment lines (``#``, ``%``) come first, then an optional line of column names, which
states the units: ``time_s,acc_g``, ``t, acceleration [m/s2]``, ``acc_cm_s2``. No units are assumed.
Instead of names, a line may state the number of samples, or that and the time step: ``2500 0.01``.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
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
    require_even_lines,
    require_whole_end,
)
from rockframe.ingest.parsing.timing import even_time_step
from rockframe.ingest.parsing.unnamed_columns import are_pairs, is_series, time_column, unclear
from rockframe.record import Record
from rockframe.units import acceleration_factor

DESCRIPTION = "CSV or white-space text: time and acceleration, or acceleration alone"

#: Characters of rows of numbers; `numpy.loadtxt` treats some other characters as blanks.
_USUAL: Final = bytes({*range(ord(" "), 0x7F), *b"\t\n\v\f\r"} - {*b"_"})
_STATED_COUNT: Final = re.compile(r"\bnpts\b\s*[:=]?\s*(\d{1,12})\b", re.I)
_STATED_STEP: Final = re.compile(
    r"\bdt\b\s*[:=]\s*(?P<step>\d*\.?\d+(?:e[-+]?\d{1,2})?)\s*(?:s|sec|seconds?)?\s*(?:[,;]|$)",
    re.I,
)
#: Number of samples, and perhaps the time step, in a line of their own above the rows.
_SIZES: Final = re.compile(
    r"\s*(?P<count>[1-9]\d{0,8})(?:[\s,;]+(?P<step>\d*\.?\d+(?:e-?\d{1,2})?))?\s*", re.I
)
#: Number of rows whose decimal points are compared with the first row.
_FIRST_ROWS: Final = 20
#: Possible numbers of values per line, in a series without times.
_SERIES: Final = (8, 10)
#: Column that the user states for a series with several values per line.
ALL_COLUMNS: Final = "all"
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
    sizes: re.Match[str] | None = None

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
    table, columns, per_row = _read_columns(path, layout, options)
    stated = columns.units
    factor = factor_to_si(path, stated, options, layout.names_line or None)
    taken = f"{stated!r} in the column name" if stated else f"{options.units!r} given"
    _require_units(path, layout, factor, taken)
    if not data[-1:].isspace():
        require_whole_end(path, layout.body, layout.first_line, per_row)
    _require_count(path, layout, len(table))
    _require_sample(path, layout)
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


def _read_columns(path: Path, layout: _Layout, options: ReadOptions) -> tuple[Float, Columns, int]:
    """Return the numbers, the meaning of their columns, and the number of columns of a line."""
    count, chosen, line = layout.columns, options.column, layout.names_line or layout.first_line
    if layout.names:
        columns = read_headers(path, layout.names, count, line, chosen)
        return _parse(path, layout, columns), columns, count
    if chosen is not None and chosen.strip().lower() == ALL_COLUMNS:
        return _values(path, layout).reshape(-1, 1), Columns(None, {0: ""}, None), 1
    if count > 2 and chosen is None:
        return _many_columns(path, layout)
    columns = read_headers(path, [], count, line, chosen)
    table, [place] = _parse(path, layout, columns), [*columns.accelerations]
    if count > 2 and are_pairs(table.ravel(), count):
        message = f"each line holds {count // 2} pairs of time and acceleration, which are one"
        raise InputError(path, f"{message} series. Leave out --column.", line)
    time = time_column(path, table, place, options.time_step, line)
    if count == 2 and time is None and chosen is None and len(table) > 1:
        raise unclear(path, table.ravel(), 2, line)
    return table, replace(columns, time=time), count


def _many_columns(path: Path, layout: _Layout) -> tuple[Float, Columns, int]:
    """Return the numbers in three columns or more without names, as `_read_columns`."""
    values, count = _values(path, layout), layout.columns
    if are_pairs(values, count):
        if values.size % 2:
            last = layout.first_line + len(layout.rows) - 1
            raise InputError(path, f"time {values[-1]:g} s without an acceleration.", last)
        return values.reshape(-1, 2), Columns(0, {1: ""}, None), 2
    if (count in _SERIES or layout.sizes) and is_series(values, count):
        return values.reshape(-1, 1), Columns(None, {0: ""}, None), 1
    raise unclear(path, values, count, layout.first_line)


def _split(path: Path, data: bytes) -> _Layout:
    comments, body = _skip_comments(plain_text(path, data).rstrip())
    top, _, below = body.partition(b"\n")
    names = column_names(decoded(top))
    sizes = None if names else _sizes(decoded(top), below)
    names_line = len(comments) + 1 if names else 0
    skipped: list[str] = []
    if names or sizes:
        skipped, body = _skip_comments(below)
    if not body:
        raise InputError(path, "no rows of numbers.")
    first_row = body.partition(b"\n")[0]
    separator = b";" if b";" in first_row else b"," if b"," in first_row else None
    if separator == b";":
        body = body.replace(b",", b".")  # decimal commas
    first_line = len(comments) + bool(names or sizes) + len(skipped) + 1
    return _Layout(comments, names, names_line, body, first_line, separator, sizes)


def _sizes(line: str, below: bytes) -> re.Match[str] | None:
    """Return the match of a line that states the number of samples, and perhaps the time step.

    Unlike a row, it has another number of fields than the rows, or the number of the rows.
    """
    stated = _SIZES.fullmatch(line)
    rows = below.split(b"\n")
    row = next((decoded(one) for one in rows if one.strip()), "")
    if not stated or not is_row(row):
        return None
    if len(split_fields(row)) == len(split_fields(line)):
        return stated if int(stated["count"]) == sum(1 for one in rows if one.strip()) else None
    return stated if stated["step"] or len(split_fields(row)) > 2 else None


def _skip_comments(text: bytes) -> tuple[list[str], bytes]:
    """Return the leading comment lines and blank lines, and the text after them."""
    count = _first_content(map(decoded, io.BytesIO(text)))
    *lines, rest = text.split(b"\n", count)
    if len(lines) < count:
        lines, rest = [*lines, rest], b""
    return [decoded(line) for line in lines], rest


def _values(path: Path, layout: _Layout) -> Float:
    """Return all numbers of lines of equal length; the last line may be shorter."""
    separator = layout.separator or b" "
    rows = layout.rows
    for line, row in enumerate(rows, layout.first_line):
        count = len(row.split(layout.separator))
        last = line == layout.first_line + len(rows) - 1
        if count > layout.columns or (count < layout.columns and not last):
            message = f"{count} values in a line. Must be {layout.columns}, as in the first row."
            raise InputError(path, message, line=line)
        # A spreadsheet fills the last line with empty cells.
        filled = row.rstrip(separator + b" ") if last else row
        if not all(field.strip() for field in filled.split(layout.separator)):
            raise bad_number(path, b"", line)
    body = b"\n".join(row.replace(separator, b" ") for row in rows)
    values = parse_numbers(path, body + b"\n", layout.first_line)
    require_even_lines(path, body, layout.first_line)
    return values


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
    if layout.columns == 1:  # times become wider, and the first row may be a header
        require_even_lines(path, layout.body.partition(b"\n")[2], layout.first_line + 1)
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
    if layout.sizes and int(layout.sizes["count"]) != rows:
        message = f"{layout.sizes['count']} samples stated above {rows} rows of them."
        settle(path, message, {"samples": rows}, len(layout.comments) + 1)


def _require_sample(path: Path, layout: _Layout) -> None:
    """Reject a whole number above a column of decimals, such as a count or the number of a station.

    Zero is a sample: it adds nothing to the motion.
    """
    if layout.names or layout.columns > 1:
        return
    first, *rows = (row.strip() for row in layout.body.split(b"\n", _FIRST_ROWS)[:_FIRST_ROWS])
    if re.fullmatch(rb"[-+]?0*[1-9]\d*", first) and all(b"." in row for row in rows):
        message = f"{decoded(first)!r} is a whole number above decimals: a sample, or a header?"
        must = "Put # before a header."
        settle(path, message, {"samples": None}, layout.first_line, must)


def _require_units(path: Path, layout: _Layout, factor: float, taken: str) -> None:
    for line, comment in enumerate(layout.comments, 1):
        stated = units_in(comment)
        if stated and acceleration_factor(stated) != factor:
            message = f"acceleration units {stated!r} in the comment, {taken}."
            raise InputError(path, message, line=line)


def _agreed_step(path: Path, layout: _Layout, step: float) -> float:
    """Return the time step [s] of the samples, or of a comment that the user trusts."""
    stated = [_STATED_STEP.search(comment.strip()) for comment in layout.comments]
    for line, found in enumerate([*stated, layout.sizes], 1):
        printed = found and found["step"]
        if printed and not math.isclose(float(printed), step, rel_tol=_SAME_STEP):
            where = "comment" if line <= len(stated) else "header"
            message = f"dt {printed} s in the {where}, time step {step:g} s of the samples."
            steps = {"waveform": step, "header": float(printed)}
            return settle(
                path, message, steps if steps["header"] > 0.0 else {"waveform": step}, line
            )
    return step


def _time_step(
    path: Path, layout: _Layout, time: int | None, table: Float, options: ReadOptions
) -> float:
    if time is not None:
        pairs = layout.columns // 2 if table.shape[1] < layout.columns else 1

        def printed() -> list[bytes]:
            rows = [row.split(layout.separator) for row in layout.rows]
            return [token for row in rows for token in (row[::2] if pairs > 1 else [row[time]])]

        try:
            return even_time_step(path, table[:, time], printed, 0, options.time_step)
        except InputError as error:
            line = None if error.line is None else layout.first_line + error.line // pairs
            raise InputError(path, error.reason, line) from None
    step = options.time_step
    if step is None and layout.sizes and layout.sizes["step"]:
        step = float(layout.sizes["step"])
    if step is None or not step > 0.0:
        message = "time step unstated. State it with --time-step-s, or add a column of times"
        raise InputError(path, f"{message} before the acceleration.")
    return step


def _first_content(lines: Iterable[str]) -> int:
    """Return the number of leading comment lines and blank lines."""
    count = 0
    for line in lines:
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            break
        count += 1
    return count
