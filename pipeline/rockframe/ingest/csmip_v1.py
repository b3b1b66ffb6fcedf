"""CSMIP/CDMG volume 1 (V1): uncorrected acceleration in g, several channels in a file.

Each channel has 13 lines of text, 7 of integers (16I5), 7 of reals, one that states number, rate,
units and columns of the samples, the samples in those columns, and a line `/& ... End of Data`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.columns import Columns, read_columns
from rockframe.ingest.identify import direction, record_ids
from rockframe.ingest.lines import head_lines, is_number, text_of
from rockframe.ingest.options import ReadOptions, settle_time_step, settle_units
from rockframe.record import Orientation, Record
from rockframe.units import acceleration_factor

_HEADER_LINES: Final = 28
_FIRST_INTEGERS: Final = 13
#: Items of the integer header, counted from 1.
_YEAR: Final = 24
_COUNTS: Final = (28, 33)

_TOP: Final = re.compile(r"\s*Uncorrected Accelerogram Data\b", re.I)
_ENDS_SAMPLES: Final = re.compile(rb"/&|\s*Uncorrected", re.I)
_CHANNEL: Final = re.compile(r"\s*Chan\s+(?P<number>\d+)\s*:\s*(?P<label>.*?)\s*$", re.I)
_DEGREES: Final = re.compile(r"(?P<azimuth>\d{1,3})\s*Deg\b", re.I)
_POINTS: Final = re.compile(
    r"No\. of Points\s*=\s*(?P<count>\d{1,9})\b.*?\bat\s+(?P<rate>[\d.]+)\s*Samples/sec", re.I
)
_SAMPLES: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+Accelerogram points at\s+(?P<rate>[\d.]+)\s+pts/sec in units of\s+"
    r"(?P<units>[^\s.]+)[\s.]+Format:\s*\((?P<columns>[1-9]\d?)f(?P<width>[1-9]\d?)\.\d+\)",
    re.I,
)
_CHANNELS: Final = re.compile(r"\(\s*(?P<count>\d{1,4})\s*Chns", re.I)
_NETWORK: Final = re.compile(r"\s*\w+\.(?P<network>\w{1,2})\.(?P<station>\w{1,5})\.[\w-]*\.\w+\s")
_STATION: Final = re.compile(r"\s*Station (?:No\.|Id\.)\s*(?P<station>\w+)", re.I)
_START: Final = re.compile(
    r"Start time:\s*(\d\d?)/\s*(\d\d?)/(\d\d),\s*(\d\d?):\s*(\d\d?):\s*(\d\d?)(\.\d+)?\s*UTC", re.I
)


@dataclass(frozen=True)
class _Channel:
    """The lines of one channel, and the number in the file of its first."""

    path: Path
    header: list[str]
    body: list[bytes]
    first_line: int

    def line(self, index: int) -> int:
        return self.first_line + index

    @property
    def component(self) -> str:
        named = _CHANNEL.match(self.header[6])
        if not named:
            return ""
        degrees = _DEGREES.match(named["label"])
        if degrees:
            return f"{int(degrees['azimuth']):03d}"
        # A structure's channels say after wide blanks where they are.
        name = re.split(r"\s{2,}", named["label"])[0]
        return name.upper() if direction(name)[0] is Orientation.VERTICAL else name

    def item(self, item: int) -> int | None:
        """One item of the integer header, counted from 1."""
        row, column = divmod(item - 1, 16)
        field = self.header[_FIRST_INTEGERS + row][5 * column : 5 * column + 5]
        return int(field) if re.fullmatch(r" *-?\d+", field) else None


def sniff(head: bytes) -> bool:
    r"""Whether a file's beginning is that of a CSMIP volume 1 file.

    Parameters
    ----------
    head : bytes
        At most the first 4096 bytes.

    Examples
    --------
    >>> sniff(b"Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg\n")
    False
    """
    lines = head_lines(head)
    return bool(lines and _TOP.match(lines[0])) and any(
        _CHANNEL.match(line) or _POINTS.match(line) for line in lines[:_HEADER_LINES]
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read every channel of a CSMIP volume 1 file.

    Parameters
    ----------
    path : Path
        The file, for names and errors.
    data : bytes
        Its contents.
    options : ReadOptions
        Must agree with the headers.

    Raises
    ------
    InputError
        If a header is not of 28 lines, its statements of the number of samples differ from each
        other or from the samples present, or a column holds no number.

    Examples
    --------
    >>> read(Path("CE89146.V1"), b"Corrected accelerogram", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: CE89146.V1:1: 'Corrected accelerogram'. Must be 'Uncorrected ...
    """
    channels = _channels(path, text_of(path, data).split(b"\n"))
    stated = _CHANNELS.search(channels[0].header[4])
    # One channel alone is a file cut up by its owner; some of several are a file cut short.
    if stated and 1 != len(channels) != int(stated["count"]):
        raise InputError(
            path,
            f"{stated['count']} channels in the header, {len(channels)} in the file. "
            "Must be equal, or one channel a file.",
            line=5,
        )
    ids = record_ids(path, [channel.component for channel in channels])
    return [
        _record(channel, record_id, options)
        for channel, record_id in zip(channels, ids, strict=True)
    ]


def _channels(path: Path, lines: list[bytes]) -> list[_Channel]:
    """Cut the file where its `/&` lines and its headers say."""
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError(path, "nothing but blank lines. Must hold a channel.")
    channels = []
    top = 0
    while top < len(lines):
        header = [line.decode("latin-1") for line in lines[top : top + _HEADER_LINES]]
        _require_header(path, header, top + 1)
        start = end = top + _HEADER_LINES
        while end < len(lines) and not _ENDS_SAMPLES.match(lines[end]):
            end += 1
        channels.append(_Channel(path, header, lines[start:end], top + 1))
        top = end + 1 if lines[end : end + 1] and lines[end].startswith(b"/&") else end
    return channels


def _require_header(path: Path, header: list[str], line: int) -> None:
    if not _TOP.match(header[0]):
        raise InputError(
            path,
            f"{header[0].strip()[:40]!r}. Must be 'Uncorrected Accelerogram Data ...', "
            "the first line of a channel.",
            line=line,
        )
    if len(header) < _HEADER_LINES:
        raise InputError(
            path,
            f"the file ends after {len(header)} lines of a channel's header. "
            f"Must be {_HEADER_LINES} lines.",
            line=line + len(header) - 1,
        )
    for index, pattern, example in (
        (6, _CHANNEL, "Chan 1: 90 Deg"),
        (10, _POINTS, "No. of Points = 10000 ... at 100 Samples/sec"),
        (27, _SAMPLES, "10000 Accelerogram points at 100 pts/sec in units of g. Format: (8f9.6)"),
    ):
        if not pattern.match(header[index]):
            raise InputError(
                path,
                f"{header[index].strip()[:60]!r}. Must be as in {example!r}: "
                f"line {index + 1} of a channel's header.",
                line=line + index,
            )


def _record(channel: _Channel, record_id: str, options: ReadOptions) -> Record:
    samples = _SAMPLES.match(channel.header[27])
    assert samples  # noqa: S101 - the header was required to have it
    line = channel.line(27)
    if samples["units"].lower() != "g":
        raise InputError(
            channel.path, f"acceleration units {samples['units']!r}. Must be g.", line=line
        )
    factor = acceleration_factor(settle_units(channel.path, "g", options, line))
    count, rate = _count_and_rate(channel, samples)
    columns = Columns(int(samples["columns"]), int(samples["width"]))
    network = _NETWORK.match(channel.header[3])
    station = network or _STATION.match(channel.header[4])
    orientation, azimuth = direction(channel.component)
    return Record(
        record_id=record_id,
        acceleration=factor * read_columns(channel.path, channel.body, columns, count, line),
        time_step=settle_time_step(channel.path, 1.0 / rate, options, line),
        uncorrected=True,
        component=channel.component,
        orientation=orientation,
        azimuth=azimuth,
        station=station["station"] if station else "",
        network=network["network"] if network else "",
        start_time=_start_time(channel),
    )


def _count_and_rate(channel: _Channel, samples: re.Match[str]) -> tuple[int, float]:
    """Number of samples and samples per second, compared wherever the header states them."""
    points = _POINTS.match(channel.header[10])
    assert points  # noqa: S101 - the header was required to have it
    line = channel.line(27)
    count = int(samples["count"])
    counts = {"'No. of Points'": int(points["count"])} | {
        # Items that are not filled in are 0 or -999.
        f"item {item} of the integer header": value
        for item in _COUNTS
        if (value := channel.item(item)) is not None and value > 0
    }
    for place, other in counts.items():
        if other != count:
            raise InputError(
                channel.path,
                f"{count} samples stated, but {other} in {place}. Must be equal.",
                line=line,
            )
    if count < 2:
        raise InputError(channel.path, f"{count} samples stated. Must be 2 or more.", line=line)
    before, rate = _rate(channel, points, 10), _rate(channel, samples, 27)
    if before != rate:
        raise InputError(
            channel.path,
            f"{rate:g} samples a second stated, but {before:g} in line "
            f"{channel.line(10)}. Must be equal.",
            line=line,
        )
    return count, rate


def _rate(channel: _Channel, stated: re.Match[str], index: int) -> float:
    token = stated["rate"]
    if not (is_number(token.encode()) and float(token) > 0.0):
        raise InputError(
            channel.path,
            f"{token!r} samples a second. Must be a positive number.",
            line=channel.line(index),
        )
    return float(token)


def _start_time(channel: _Channel) -> str:
    """Time of the first sample, ISO 8601 UTC; empty unless stated in UTC with a certain year."""
    stated = _START.search(channel.header[3])
    year = channel.item(_YEAR)
    if not stated or year is None or year % 100 != int(stated[3]):
        return ""
    month, day, hour, minute, second = (int(stated[group]) for group in (1, 2, 4, 5, 6))
    try:
        start = datetime(year, month, day, hour, minute, second, tzinfo=UTC)
    except ValueError:
        return ""
    return f"{start:%Y-%m-%dT%H:%M:%S}{stated[7] or ''}Z"
