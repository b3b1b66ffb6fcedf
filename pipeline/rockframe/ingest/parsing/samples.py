"""Samples in fixed-width columns, and the peak that a header states of them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.aligned import aligned_numbers
from rockframe.ingest.parsing.lines import are_finite, bad_number, is_number


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
    count = _present(rows, columns)  # not the stated one, if the user trusts the samples
    text = b"".join(rows)
    if count and not columns.integers and len(text) == count * columns.width:
        fields = np.frombuffer(text, dtype=np.uint8).reshape(count, columns.width)
        decimals = aligned_numbers(fields) if b"." in text[: columns.width] else None
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
    present = _present(rows, columns)
    if present != count:
        message = f"{count} samples stated, {present} in the file."
        if present < 2:
            raise InputError(path, message, line)
        settle(path, message, {"samples": present}, line)
    if len(last) % columns.width or len(last) > columns.line_width:
        raise _bad_width(path, last, columns, line + len(rows))
    return rows


def read_table(path: Path, rows: list[bytes], columns: Columns, line: int) -> Float:
    """Return the samples of several channels, shape (rows, channels): each line has one of each.

    Parameters are those of `read_columns`.

    Raises
    ------
    InputError
        If a line is incomplete, or if a column is not a number.

    Examples
    --------
    >>> read_table(Path("CANA1709.191"), [b"  1.5 -2.5", b"  0.5  0.5"], Columns(2, 5), 108)
    array([[ 1.5, -2.5],
           [ 0.5,  0.5]])
    """
    count, present = columns.count * len(rows), _present([row.rstrip() for row in rows], columns)
    if present != count:
        raise InputError(path, f"{present} samples. Must be {count} in {len(rows)} lines.", line)
    return read_columns(path, rows, columns, count, line).reshape(len(rows), columns.count)


def _present(rows: Sequence[bytes], columns: Columns) -> int:
    """Return the number of columns in lines of which all but the last are full."""
    last = len(rows[-1]) if rows else 0
    return columns.count * max(len(rows) - 1, 0) - (-last // columns.width)


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


#: Relative tolerance: header and samples may be rounded from single precision in different ways.
_SINGLE: Final = 2.0**-22


@dataclass(frozen=True)
class Printed:
    """A printed number and its resolution.

    Parameters
    ----------
    value : float
        Value of the number.
    unit : float
        One unit of its last printed digit.

    Examples
    --------
    >>> Printed.of("-267.957"), Printed.of("0.12E+03")
    (Printed(value=-267.957, unit=0.001), Printed(value=120.0, unit=10.0))
    """

    value: float
    unit: float

    @classmethod
    def of(cls, token: str) -> Printed:
        """Parse a decimal token.

        Raises
        ------
        ValueError
            If the token is not a number.
        """
        digits, _, exponent = re.sub("[dD]", "e", token.strip()).lower().partition("e")
        places = len(digits.partition(".")[2])
        power = max(-300, min(int(exponent[:6] or 0) - places, 300))
        return cls(float(token), float(10.0**power))


@dataclass(frozen=True, kw_only=True)
class StatedPeak:
    """The peak that a header states.

    Parameters
    ----------
    value : Printed
        Peak in file units.
    time : Printed, optional
        Time of the peak since the first sample [s].
    units : str
        Units as the file names them, for error messages.
    line : int
        Line number of the statement.
    signed : bool
        True if the header prints the sign of the sample. Some headers print absolute values; a plus
        then has no meaning, but a minus does.

    Examples
    --------
    >>> StatedPeak(value=Printed.of("-267.957"), units="cm/s2", line=18).signed
    True
    """

    value: Printed
    time: Printed | None = None
    units: str
    line: int
    signed: bool = True


def require_peak(
    path: Path,
    samples: Float,
    time_step: float,
    header_peak: StatedPeak,
    resolution: float,
) -> float:
    """Return the ratio of actual to stated peak; reject a file in which they differ.

    Stated value and samples may differ by one unit in the last digit of either. The time may differ
    by one step, because some archives count from the first step. If several samples are equally
    large, any of them may be the stated peak.

    Parameters
    ----------
    samples : array, shape (samples,)
        Samples in file units.
    time_step : float
        Interval between samples [s].
    resolution : float
        One unit of the last printed digit of the samples, in file units.

    Returns
    -------
    float
        Ratio of actual to stated peak [1], of absolute values if the header states no sign; NaN if
        the stated peak is zero.

    Raises
    ------
    InputError
        If absolute value, sign or time of the peak differ.

    Examples
    --------
    >>> peak = StatedPeak(value=Printed.of("-0.30"), units="g", line=8)
    >>> require_peak(Path("a.V2"), np.array([0.1, -0.3]), 0.01, peak, 0.1)
    1.0
    >>> require_peak(Path("a.V2"), np.array([0.1, -0.5]), 0.01, peak, 0.1)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.V2:8: peak -0.3 g stated, but -0.5 g in the file. Settled by ...
    """
    sizes = np.abs(samples)
    where = int(sizes.argmax())
    value, largest = header_peak.value.value, float(sizes[where])
    slack = header_peak.value.unit + resolution + _SINGLE * largest
    peaks = np.flatnonzero(sizes >= largest - slack)
    right = np.flatnonzero(np.abs(samples[peaks] - value) <= slack)
    signed = header_peak.signed or value < 0.0
    if not signed and not right.size:
        right = np.flatnonzero(np.abs(sizes[peaks] - abs(value)) <= slack)
    if not right.size:
        peak_words = f"{samples[where]:.10g} {header_peak.units} in the file"
        message = f"peak {value:.10g} {header_peak.units} stated, but {peak_words}."
        ratio = float(samples[where]) / value if value else math.nan
        return settle(path, message, {"values": ratio if signed else abs(ratio)}, header_peak.line)
    late = np.abs(peaks * time_step - header_peak.time.value) if header_peak.time else np.zeros(1)
    if header_peak.time and late.min() > time_step * (1.0 + _SINGLE) + header_peak.time.unit:
        message = (
            f"peak stated at {header_peak.time.value:.10g} s, but at {where * time_step:.10g} s"
        )
        settle(path, f"{message} in the file.", {"values": None}, header_peak.line)
    agreeing = samples[peaks[right]]
    ratio = float(agreeing[np.abs(agreeing).argmax()]) / value if value else math.nan
    return ratio if signed else abs(ratio)


def require_printed_peak(
    path: Path,
    printed: str,
    samples: Float,
    units: str,
    line: int,
    *,
    signed: bool = False,
    time: str = "",
    time_step: float = 1.0,
    first: float = 0.0,
) -> float:
    """Return the ratio of actual to printed peak; reject a file in which they differ.

    Parameters
    ----------
    printed : str
        Peak as printed in the header.
    samples : array, shape (samples,)
        Acceleration in the units of the stated peak.
    units, line, signed
        As in `StatedPeak`.
    time : str
        Printed time of the peak since the first sample [s]; empty if unstated.
    time_step, first : float
        Interval between samples, and time of the first sample as the header counts it [s].

    Raises
    ------
    InputError
        If the stated peak or its time is not a number or differs from the samples.

    Examples
    --------
    >>> require_printed_peak(Path("a.ASC"), "0.31", np.array([0.1, -0.4]), "cm/s2", 38)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ASC:38: peak 0.31 cm/s2 stated, but -0.4 cm/s2 in the file. S...
    """
    for token, quantity in ((printed, "peak acceleration"), (time or "0", "time of the peak")):
        if not is_number(token):
            raise bad_number(path, token.encode("latin-1", "replace"), line, quantity)
    late = Printed.of(time) if time else None
    peak = StatedPeak(
        value=Printed.of(printed),
        time=late and Printed(late.value - first, late.unit),
        units=units,
        line=line,
        signed=signed,
    )
    return require_peak(path, samples, time_step, peak, 0.0)
