"""Samples in fixed-width columns, as Fortran writes them, without blanks between numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import are_finite, is_number


@dataclass(frozen=True)
class Columns:
    """Layout of a line of samples.

    Parameters
    ----------
    count : int
        Numbers per line.
    width : int
        Characters per number.
    integers : bool
        True if the numbers are integers without a decimal point.

    Examples
    --------
    >>> Columns(8, 9).line_width
    72
    """

    count: int
    width: int
    integers: bool = False

    @property
    def line_width(self) -> int:
        """Number of characters of a full line."""
        return self.count * self.width


def read_columns(path: Path, rows: list[bytes], columns: Columns, count: int, line: int) -> Float:
    """Return the samples in fixed-width columns.

    Parameters
    ----------
    rows : list of bytes
        Lines of samples without line ends.
    count : int
        Number of samples that the header states.
    line : int
        Line number where the header states the number; the samples follow this line.

    Returns
    -------
    array, shape (count,)

    Raises
    ------
    InputError
        If a line has the wrong width, if the number of samples differs from the stated one, or if a
        column is not a finite number with a decimal point (an integer if `columns.integers`). A
        missing decimal point is an error, because Fortran would insert it.

    Examples
    --------
    >>> read_columns(Path("CE89146.V1"), [b"  .000010-1.234567"], Columns(8, 9), 2, 28)
    array([ 1.000000e-05, -1.234567e+00])
    """
    rows = require_layout(path, rows, columns, count, line)
    text = b"".join(rows)
    if count and not columns.integers and len(text) == count * columns.width:
        decimals = _decimals(np.frombuffer(text, dtype=np.uint8).reshape(count, columns.width))
        if decimals is not None:
            return decimals
    if b"_" not in text and text.count(b".") == (0 if columns.integers else count):
        kind = np.int64 if columns.integers else np.float64
        try:
            numbers = np.array(_fields(text, columns.width), dtype=kind)
            samples = numbers.astype(np.float64)
        except (ValueError, OverflowError):
            raise _first_bad_column(path, rows, columns, line) from None
        if samples.size == count and are_finite(samples):
            return samples
    raise _first_bad_column(path, rows, columns, line)


def header_item(lines: Sequence[str], item: int, columns: Columns) -> str:
    """Return an item of header lines, counted from 1; empty if the lines are too short.

    Examples
    --------
    >>> header_item(["  200  128", "    3    4"], 3, Columns(2, 5, integers=True))
    '    3'
    """
    row, column = divmod(item - 1, columns.count)
    line = lines[row] if row < len(lines) else ""
    return line[columns.width * column :][: columns.width]


def count_columns(rows: Iterable[bytes], columns: Columns) -> int:
    """Return the number of columns in lines of samples; an incomplete column counts.

    Examples
    --------
    >>> count_columns([b"  .000010-1.234567", b"  .1"], Columns(8, 9))
    3
    """
    return sum(-(-len(row.rstrip()) // columns.width) for row in rows)


def _decimals(rows: NDArray[np.uint8]) -> Float | None:
    """Read decimal numbers with aligned points, shape (samples,); None if they are not aligned.

    The digits before and after the point form a whole number below 1e15. Its division by a power of
    ten is rounded once, as in `float`.
    """
    places = np.ascontiguousarray(rows.T)  # all first characters, all second characters, ...
    width = len(places)
    points = np.flatnonzero(places[:, :1] == ord("."))
    if points.size != 1 or width > 16 or points[0] == width - 1:
        return None
    point = int(points[0])
    negative = np.zeros(len(rows), dtype=bool)
    begun = np.zeros(len(rows), dtype=bool)
    sizes = np.zeros(len(rows))
    for place, codes in enumerate(places):
        if place == point:
            if not (codes == ord(".")).all():
                return None
            begun[:] = True
            continue
        digits = codes - np.uint8(ord("0"))
        is_digit = digits < 10
        if place < point:
            minus = codes == ord("-")
            negative |= minus
            sign = minus | (codes == ord("+"))
            if not (is_digit | (~begun & (sign | (codes == ord(" "))))).all():
                return None
            begun |= is_digit | sign
            digits[~is_digit] = 0
        elif not is_digit.all():
            return None
        sizes = 10.0 * sizes + digits
    sizes /= 10.0 ** (width - 1 - point)
    return np.negative(sizes, out=sizes, where=negative)


def _fields(text: bytes, width: int) -> list[bytes]:
    """Return the token of each column; raise ValueError if a column is empty."""
    columns = np.frombuffer(text, dtype=np.uint8).reshape(-1, width)
    if not (columns > ord(" ")).any(axis=1).all():
        raise ValueError("an empty column")
    # Insert a blank between the columns, because numbers may touch.
    apart = np.full((len(columns), width + 1), ord(" "), dtype=np.uint8)
    apart[:, 1:] = columns
    return apart.tobytes().split()


def require_layout(
    path: Path, rows: list[bytes], columns: Columns, count: int, line: int
) -> list[bytes]:
    """Return the lines of samples without trailing blanks, after checking their number and width.

    The numbers themselves are not checked. Parameters are those of `read_columns`.

    Raises
    ------
    InputError
        If a line has the wrong width, or the number of samples differs from the stated one.

    Examples
    --------
    >>> require_layout(Path("CE89146.V2"), [b" -.0000192 -.0000193 ", b""], Columns(8, 10), 2, 1547)
    [b' -.0000192 -.0000193']
    """
    rows = [row.rstrip() for row in rows]
    while rows and not rows[-1]:
        rows.pop()
    last = rows[-1] if rows else b""
    width = columns.line_width
    for number, row in enumerate(rows[:-1], line + 1):
        if len(row) != width:
            raise _bad_width(path, row, columns, number)
    present = columns.count * max(len(rows) - 1, 0) - (-len(last) // columns.width)
    if present != count:
        message = f"{count} samples stated, {present} in the file. Must be equal."
        raise InputError(path, message, line)
    if len(last) % columns.width or len(last) > columns.line_width:
        raise _bad_width(path, last, columns, line + len(rows))
    return rows


def _bad_width(path: Path, row: bytes, columns: Columns, line: int) -> InputError:
    message = f"{len(row)} characters of samples. Must be {columns.line_width}:"
    return InputError(path, f"{message} {columns.count} columns of {columns.width}.", line)


def _first_bad_column(path: Path, rows: list[bytes], columns: Columns, line: int) -> InputError:
    for number, row in enumerate(rows, line + 1):
        for start in range(0, len(row), columns.width):
            field = row[start : start + columns.width]
            if not _is_valid(field, columns):
                shown = field.decode("latin-1").strip()
                must = "whole number" if columns.integers else "finite number with a decimal point"
                where = f"characters {start + 1} to {start + len(field)}"
                message = f"acceleration {shown!r} in {where}. Must be a {must}."
                return InputError(path, message, number)
    raise AssertionError("every column holds a number, yet they could not be read together")


def _is_valid(field: bytes, columns: Columns) -> bool:
    if columns.integers:
        return re.fullmatch(rb" *[-+]?\d{1,18} *", field) is not None
    return field.count(b".") == 1 and is_number(field)
