"""Split a COSMOS file (version 1.20) into channels and their sections.

A channel has text lines (the first line states their number), integers, reals, comments, samples
and an end line. The line above each section states its number of values or lines and, for numbers,
the Fortran format.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.parsing.columns import Columns
from rockframe.ingest.parsing.lines import bad_number, is_number
from rockframe.ingest.parsing.peaks import Printed

_TEXT_LINES: Final = 13
#: First line of a channel.
TOP: Final = re.compile(
    r"\s*(?P<what>\S.*?)\s*\(Format\s+v\s*(?P<version>\d{1,3}\.\d+)\s+with\s+(?P<lines>\d{1,3})\s+"
    r"text lines\)",
    re.I,
)
#: Line above the samples.
SAMPLES: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+(?P<what>\S.*?)\s*pts\s*,.*?units\s*=\s*(?P<units>[^(]*?)\s*"
    r"\(\s*(?P<code>\d{1,3})\s*\)\s*,\s*Format\s*=\s*(?P<format>\S.*?)\s*",
    re.I,
)
_END: Final = re.compile(rb"\s*End-of-data\b|/&", re.I)
_VALUES: Final = re.compile(
    r"\s*(?P<count>\d{1,4})\s+(?P<kind>Integer|Real)-header values follow on\s+"
    r"(?P<lines>\d{1,4})\s+lines\s*,\s*Format\s*=\s*(?P<format>\S.*?)\s*",
    re.I,
)
_COMMENTS: Final = re.compile(r"\s*(?P<count>\d{1,5})\s+Comment line\(s\) follow", re.I)
_FORMAT: Final = re.compile(
    r"\(\s*(?P<count>[1-9]\d{0,2})\s*(?:1P\s*)?(?P<kind>[IFEG])(?P<width>[1-9]\d?)"
    r"(?:\.(?P<places>\d{1,2}))?(?:E\d)?\s*\)",
    re.I,
)
_UNKNOWN: Final = re.compile(r"unknown.*?:\s*(?P<integer>-?\d+)\s*,\s*(?P<real>-?\d+\.?\d*)", re.I)


@dataclass(frozen=True)
class Layout:
    """Fortran format of a section.

    Parameters
    ----------
    columns : Columns
        Number and width of the columns.
    places : int
        Digits after the decimal point.
    exponent : bool
        True if the numbers have exponents.

    Examples
    --------
    >>> Layout.of(Path("a.v2c"), "(5F15.6)", 25).columns
    Columns(count=5, width=15, integers=False)
    """

    columns: Columns
    places: int
    exponent: bool

    @classmethod
    def of(cls, path: Path, text: str, line: int) -> Layout:
        """Parse a Fortran format.

        Raises
        ------
        InputError
            If the format is not a single repeated number format.
        """
        stated = _FORMAT.fullmatch(text)
        if not stated:
            message = f"format {text[:40]!r}. Must be as in '(8F10.5)' or '(10I8)'."
            raise InputError(path, message, line)
        kind = stated["kind"].upper()
        columns = Columns(int(stated["count"]), int(stated["width"]), integers=kind == "I")
        return cls(columns, int(stated["places"] or 0), kind in "EG")


@dataclass(frozen=True)
class Channel:
    """Sections of one channel; items are counted from 1.

    Parameters
    ----------
    path : Path
        The file.
    first_line : int
        Line number of the first line of the channel.
    text : list of str
        Text lines.
    integers, reals : list of str
        Numbers of the headers as printed.
    real_line, sample_line : int
        Line numbers of the headings of reals and samples.
    comments : list of str
        Comments without the leading bar.
    heading : re.Match
        Line above the samples.
    layout : Layout
        Format of the samples.
    rows : list of bytes
        Lines of samples.
    """

    path: Path
    first_line: int
    text: list[str]
    integers: list[str]
    reals: list[str]
    real_line: int
    comments: list[str]
    heading: re.Match[str]
    sample_line: int
    layout: Layout
    rows: list[bytes]

    @property
    def unknown(self) -> tuple[float, float]:
        """Integer and real that mean "unknown"."""
        stated = _UNKNOWN.search(self.text[-1])
        return (float(stated["integer"]), float(stated["real"])) if stated else (-999.0, -999.0)

    def integer(self, item: int) -> int | None:
        """Return an item of the integer header; None if unknown."""
        value = int(self.integers[item - 1])
        return None if value == self.unknown[0] else value

    def real(self, item: int) -> Printed | None:
        """Return an item of the real header as printed; None if unknown."""
        number = Printed.of(self.reals[item - 1])
        return None if number.value == self.unknown[1] else number

    def number(self, item: int) -> float:
        """Return an item of the real header; NaN if unknown."""
        known = self.real(item)
        return known.value if known else math.nan


def channels_of(path: Path, lines: list[bytes]) -> list[Channel]:
    """Return the channels of a file; the number of lines in each section is checked.

    Raises
    ------
    InputError
        If a section is missing or shorter than stated.

    Examples
    --------
    >>> channels_of(Path("a.v2c"), [b"Corrected acceleration"])
    Traceback (most recent call last):
    rockframe.errors.InputError: a.v2c:1: 'Corrected acceleration' is no heading of a ...
    """
    while lines and not lines[-1].strip():
        lines.pop()
    found: list[Channel] = []
    top = 0
    while top < len(lines) or not found:
        channel, top = _channel(path, lines, top)
        found.append(channel)
    return found


def _channel(path: Path, lines: list[bytes], top: int) -> tuple[Channel, int]:
    first = _stated(
        path, lines, top, TOP, "Corrected acceleration (Format v01.20 with 13 text lines)"
    )
    if int(first["lines"]) < _TEXT_LINES:
        message = f"{first['lines']} lines of text stated. Must be {_TEXT_LINES} or more."
        raise InputError(path, message, top + 1)
    at = top + int(first["lines"])
    text = [line.decode("latin-1") for line in lines[top:at]]
    integers, at = _values(path, lines, at, "Integer")
    real_line = at + 1
    reals, at = _values(path, lines, at, "Real")
    comments, at = _comments(path, lines, at)
    example = "20000 acceleration pts, approx 100 secs, units=cm/sec2 (04), Format=(8F10.5)"
    heading = _stated(path, lines, at, SAMPLES, example, whole=True)
    layout = Layout.of(path, heading["format"], at + 1)
    end = at + 1 - (-int(heading["count"]) // layout.columns.count)
    if end >= len(lines) or not _END.match(lines[end]):
        end = at + 1
        while end < len(lines) and not _END.match(lines[end]):
            end += 1
    rows = lines[at + 1 : end]
    channel = Channel(
        path, top + 1, text, integers, reals, real_line, comments, heading, at + 1, layout, rows
    )
    # Some files end a channel with both end lines.
    both = end + 1 < len(lines) and lines[end + 1].startswith(b"/&")
    return channel, end + 1 + both


def _stated(
    path: Path,
    lines: list[bytes],
    at: int,
    pattern: re.Pattern[str],
    example: str,
    whole: bool = False,
) -> re.Match[str]:
    text = lines[at].decode("latin-1") if at < len(lines) else ""
    stated = pattern.fullmatch(text) if whole else pattern.match(text)
    if not stated:
        message = f"{text.strip()[:60]!r} is no heading of a section. Must be as in {example!r}."
        raise InputError(path, message, min(at, len(lines)) + 1)
    return stated


def _values(path: Path, lines: list[bytes], at: int, kind: str) -> tuple[list[str], int]:
    example = f"100 {kind}-header values follow on 10 lines, Format= (10I8)"
    stated = _stated(path, lines, at, _VALUES, example, whole=True)
    if stated["kind"].lower() != kind.lower():
        raise InputError(path, f"{stated['kind']} header. Must be the {kind} header.", line=at + 1)
    columns = Layout.of(path, stated["format"], at + 1).columns
    if columns.integers != (kind == "Integer"):
        message = f"format {stated['format']!r} of the {kind} header. Must be of {kind.lower()}s."
        raise InputError(path, message, at + 1)
    end = at + 1 + int(stated["lines"])
    fields = []
    for line, row in enumerate(lines[at + 1 : end], at + 2):
        text = row.rstrip()
        for start in range(0, len(text), columns.width):
            field = text[start : start + columns.width]
            whole = re.fullmatch(rb" *-?\d{1,15}", field)
            if not (whole if columns.integers else is_number(field)):
                raise bad_number(path, field, line, "header value")
            fields.append(field.decode("latin-1"))
    if len(fields) != int(stated["count"]) or len(fields) < 100:
        message = f"{stated['count']} values of the {kind.lower()} header stated, {len(fields)} in "
        raise InputError(path, f"{message}the file. Must be equal, and 100 or more.", at + 1)
    return fields, end


def _comments(path: Path, lines: list[bytes], at: int) -> tuple[list[str], int]:
    stated = _stated(path, lines, at, _COMMENTS, "4 Comment line(s) follow, each starting with a |")
    end = at + 1
    while end < len(lines) and lines[end].lstrip().startswith(b"|"):
        end += 1
    if end - at - 1 != int(stated["count"]):
        found = f"{end - at - 1} in the file"
        message = f"{stated['count']} comment lines stated, {found}. Must be equal."
        raise InputError(path, message, at + 1)
    return [line.decode("latin-1").strip().lstrip("|") for line in lines[at + 1 : end]], end
