"""Reader of USGS SMC files: acceleration in cm/s2, one component per file.

A file has 11 lines of text, 6 of integers (8I10), 10 of reals (5E15.7), comments that begin with a
bar, and the samples: 8 columns of 10 characters (8E10.4E1), or 5 of 14 in the precise variant. The
first integer and the first real are the values that mean "undefined". An uncorrected file without
sampling rate contains pairs of time [s] and acceleration instead of samples.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.identify import direction, record_ids, site_of_smc
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import bad_number, first_line, header_lines, plain_text
from rockframe.ingest.parsing.samples import (
    Columns,
    Printed,
    StatedPeak,
    count_columns,
    read_columns,
    require_peak,
)
from rockframe.ingest.parsing.timing import even_time_step, utc_time
from rockframe.record import Orientation, Record

DESCRIPTION = "USGS SMC, acceleration in cm/s2, evenly sampled or time-acceleration pairs"

_TEXT_LINES, _INTEGER_LINES, _REAL_LINES = 11, 6, 10
_HEADER_LINES: Final = _TEXT_LINES + _INTEGER_LINES + _REAL_LINES
_INTEGERS: Final = Columns(8, 10, integers=True)
_REALS: Final = Columns(5, 15)

_PLAIN: Final = Columns(8, 10)
_PRECISE: Final = Columns(5, 14)
#: Value of item 47 of the integer header in the precise variant.
_PRECISE_CODE: Final = 8
#: Number of significant digits of the samples in each variant.
_DIGITS: Final = {_PLAIN: 5, _PRECISE: 8}

_TYPE: Final = re.compile(
    r"\s*(?P<number>[0-9])\s+(?P<quantity>(?P<un>UN)?CORRECTED ACCELEROGRAM|VELOCITY|DISPLACEMENT|"
    r"[A-Z ]*SPECTR[A-Z]*)\s*",
    re.I,
)
_STATION: Final = re.compile(
    r"\s*station\s*=\s*(?P<station>.*?)[,\s]*component\s*=\s*(?P<name>.*?)\s*", re.I
)
_EVENT: Final = re.compile(r"\s*\d{4}\s+\d{1,2}\s+\d{1,2}(?:\s+\d{4})?\s+(?P<event>\D.*?)\s*")
_INTEGER: Final = re.compile(rb" *-?\d+")
#: Not checked with `is_number`, because the value for "undefined" exceeds its limit.
_REAL: Final = re.compile(rb" *[-+]?(\d+\.\d*|\.\d+)E[-+]\d{1,2}")


@dataclass(frozen=True)
class _Header:
    """Text lines, integers and reals of the header; items are counted from 1."""

    path: Path
    text: list[str]
    integers: list[int]
    reals: list[str]

    def integer(self, item: int) -> int | None:
        """Return an item of the integer header; None if undefined."""
        value = self.integers[item - 1]
        return None if value == self.integers[0] else value

    def printed(self, item: int) -> Printed | None:
        """Return an item of the real header as printed; None if undefined."""
        number = Printed.of(self.reals[item - 1])
        return None if math.isclose(number.value, float(self.reals[0]), rel_tol=1e-6) else number

    def real(self, item: int) -> float:
        """Return an item of the real header; NaN if undefined."""
        number = self.printed(item)
        return math.nan if number is None else number.value

    def positive(self, item: int) -> float:
        """Return an item of the real header; NaN unless positive."""
        value = self.real(item)
        return value if value > 0.0 else math.nan


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like an SMC file of any quantity.

    Examples
    --------
    >>> sniff(b"2 CORRECTED ACCELEROGRAM\r\n*\r\n"), sniff(b"CORRECTED ACCELEROGRAM  89146\n")
    (True, False)
    """
    return bool(_TYPE.fullmatch(first_line(head)))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the record of an SMC file.

    Raises
    ------
    InputError
        If the file is not acceleration, its header does not follow the format, the number of
        samples or the peak differs from the header, a number is invalid, or times are uneven.

    Examples
    --------
    >>> read(Path("0111v.smc"), b"3 VELOCITY", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.OtherQuantityError: 0111v.smc:1: is a velocity file, not an accelerogram.
    """
    # Some files are padded with NUL to whole blocks.
    lines = plain_text(path, data.rstrip(b"\0\x1a")).split(b"\n")
    kind = _kind(path, lines[0].decode("latin-1"))
    header = _header(path, lines)
    line = _HEADER_LINES + _comments(header, lines)
    factor = factor_to_si(path, "cm/s2", options)
    columns = _PRECISE if header.integer(47) == _PRECISE_CODE else _PLAIN
    if math.isnan(header.real(2)):
        samples, step = _pairs(header, lines[line:], columns, line, options)
    else:
        step = settle_time_step(path, _time_step(header), options, _TEXT_LINES + _INTEGER_LINES + 1)
        samples = read_columns(path, lines[line:], columns, _count(header), line)
    ratio = _peak_ratio(header, samples, step, columns)
    return [_record(header, factor * samples, step, ratio, kind["un"] is not None)]


def _kind(path: Path, first: str) -> re.Match[str]:
    kind = _TYPE.fullmatch(first)
    if not kind:
        shown = first.strip()[:40]
        raise InputError(
            path, f"{shown!r}, where a line such as '2 CORRECTED ACCELEROGRAM' is expected.", line=1
        )
    if "ACCELEROGRAM" not in kind["quantity"].upper():
        quantity = kind["quantity"].strip().lower()
        raise OtherQuantityError(path, f"is a {quantity} file, not an accelerogram.", line=1)
    return kind


def _header(path: Path, lines: list[bytes]) -> _Header:
    text = header_lines(path, lines, 0, _HEADER_LINES)[:_TEXT_LINES]
    integers = lines[_TEXT_LINES : _TEXT_LINES + _INTEGER_LINES]
    whole = [int(field) for field in _fields(path, integers, _INTEGERS, _TEXT_LINES + 1)]
    first = _TEXT_LINES + _INTEGER_LINES + 1
    reals = lines[_TEXT_LINES + _INTEGER_LINES : _HEADER_LINES]
    return _Header(path, text, whole, _fields(path, reals, _REALS, first))


def _fields(path: Path, rows: list[bytes], columns: Columns, first_line: int) -> list[str]:
    """Return the fields of header lines; raise an error if one is not a number."""
    fields = []
    for line, row in enumerate(rows, first_line):
        for start in range(0, columns.line_width, columns.width):
            field = row[start : start + columns.width]
            if not (_INTEGER if columns.integers else _REAL).fullmatch(field):
                raise bad_number(path, field, line, "header value")
            fields.append(field.decode("latin-1"))
    return fields


def _comments(header: _Header, lines: list[bytes]) -> int:
    """Return the number of comment lines; raise an error if it differs from the stated one."""
    count = header.integer(16) or 0
    counted = sum(1 for _ in takewhile(lambda line: line.startswith(b"|"), lines[_HEADER_LINES:]))
    if count != counted:
        message = f"{count} comment lines stated, {counted} in the file."
        raise InputError(header.path, message, _TEXT_LINES + 2)
    return counted


def _count(header: _Header) -> int:
    count = header.integer(17)
    if count is None or count < 2:
        message = f"{count} samples stated. Must be 2 or more."
        raise InputError(header.path, message, line=_TEXT_LINES + 3)
    return count


def _time_step(header: _Header) -> float:
    rate = header.real(2)
    if rate <= 0.0:
        message = f"{rate:g} samples a second. Must be a positive number."
        raise InputError(header.path, message, _TEXT_LINES + _INTEGER_LINES + 1)
    return 1.0 / rate


def _pairs(
    header: _Header, rows: list[bytes], columns: Columns, line: int, options: ReadOptions
) -> tuple[Float, float]:
    """Return acceleration [cm s-2] and time step [s] from pairs of time and acceleration."""
    columns = Columns(columns.count - columns.count % 2, columns.width)
    present = count_columns(rows, columns)
    # The count is the number of pairs or, in some files, the number of values.
    count = _count(header) if _count(header) == present else 2 * _count(header)
    numbers = read_columns(header.path, rows, columns, count, line)
    if numbers.size % 2:
        raise InputError(header.path, f"{numbers.size} values of pairs. Must be even.", line)
    text = b"".join(row.rstrip() for row in rows)
    printed = [text[k : k + columns.width] for k in range(0, len(text), 2 * columns.width)]
    try:
        step = even_time_step(header.path, numbers[::2], lambda: printed, 0, options.time_step)
    except InputError as error:
        # `even_time_step` counts one time per line; here a line holds several.
        where = None if error.line is None else line + 1 + error.line // (columns.count // 2)
        raise InputError(header.path, error.reason, line=where) from None
    return numbers[1::2], step


def _peak_ratio(header: _Header, samples: Float, step: float, columns: Columns) -> float:
    """Return the ratio of actual to stated peak, the larger extreme; reject a difference."""
    extremes = [(header.printed(item), item) for item in (30, 32)]
    peaks = [(value, item) for value, item in extremes if value is not None]
    largest = float(np.abs(samples).max())
    if not peaks or largest == 0.0:
        return math.nan
    value, item = max(peaks, key=lambda pair: abs(pair[0].value))
    resolution = 10.0 ** (math.floor(math.log10(largest)) + 1 - _DIGITS[columns])
    line = _TEXT_LINES + _INTEGER_LINES + 1 + (item - 1) // _REALS.count
    # The item before an extreme states its time.
    peak = StatedPeak(value=value, time=header.printed(item - 1), units="cm/s2", line=line)
    return require_peak(header.path, samples, step, peak, resolution)


def _record(
    header: _Header, acceleration: Float, step: float, ratio: float, uncorrected: bool
) -> Record:
    match = _STATION.fullmatch(header.text[5])
    station, component = match.groups() if match else ("", "")
    component = f"{int(component):03d}" if re.fullmatch(r"\d{1,3}", component) else component
    orientation, azimuth = direction(component)
    from_up = header.integer(13)
    if from_up in (0, 180):
        orientation = Orientation.DOWNWARD if from_up else Orientation.VERTICAL
        azimuth = math.nan
    stated_azimuth = header.integer(14)
    if (
        orientation is Orientation.HORIZONTAL
        and stated_azimuth is not None
        and (stated_azimuth - azimuth) % 360.0 != 0.0
    ):
        message = f"component {component} stated, but azimuth {stated_azimuth} in the integer"
        angles = {"component": azimuth, "azimuth": float(stated_azimuth)}
        azimuth = settle(header.path, f"{message} header.", angles, 6)
    event = _EVENT.fullmatch(header.text[3])
    return Record(
        record_id=record_ids(header.path, [component])[0],
        acceleration=acceleration,
        time_step=step,
        uncorrected=uncorrected,
        component=component,
        orientation=orientation,
        azimuth=azimuth,
        site_type=site_of_smc(station, *map(header.integer, (19, 27, 28))),
        event=event["event"] if event else "",
        station=station,
        start_time=_start_time(header),
        magnitude=header.real(6),
        epicentral_distance=header.real(17),
        peak_ratio=ratio,
        # Corners in uncorrected files belong to filters that were not yet applied.
        filter_low=math.nan if uncorrected else header.positive(33),
        filter_high=math.nan if uncorrected else header.positive(35),
        processing=("archive: problem flagged",) if header.integer(18) == 1 else (),
    )


def _start_time(header: _Header) -> str:
    """Return the start time (ISO 8601, UTC); empty unless stated to the millisecond."""
    year, day, hour, minute, second, millisecond = map(header.integer, range(2, 8))
    if None in (year, day, hour, minute, second, millisecond):
        return ""
    return utc_time((year or 0, 0, day or 0), hour or 0, minute or 0, f"{second}.{millisecond:03d}")
