"""Reader of CSMIP/CDMG volume 1 (V1): uncorrected acceleration in g, several channels per file.

A channel has 13 lines of text, 7 of integers (16I5), 7 of reals, one line with number, rate, units
and columns of the samples, the samples, and a line `/& ... End of Data`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.formats.csmip.agreement import direction_of, require_agreement
from rockframe.ingest.formats.csmip.header import (
    CHANNEL,
    CHANNEL_EXAMPLE,
    Header,
    require_channels,
    require_header,
)
from rockframe.ingest.metadata.identify import record_ids, require_distinct
from rockframe.ingest.options import ReadOptions, settle_time_step, settle_units
from rockframe.ingest.parsing.columns import Columns, read_columns
from rockframe.ingest.parsing.lines import head_lines, is_number, text_of
from rockframe.ingest.parsing.peaks import Printed, StatedPeak, require_peak
from rockframe.record import Record
from rockframe.units import acceleration_factor

_HEADER_LINES: Final = 28
_FIRST_INTEGERS: Final = 13
_FIRST_REALS: Final = 20
_NAME: Final = 6
_UNITS_LINE: Final = 11
#: Items of the integer header with the number of samples, counted from 1.
_COUNTS: Final = (28, 33)

_TOP: Final = re.compile(r"\s*Uncorrected Accelerogram Data\b", re.I)
_ENDS_SAMPLES: Final = re.compile(rb"/&|\s*Uncorrected", re.I)
_POINTS: Final = re.compile(
    r"No\. of Points\s*=\s*(?P<count>\d{1,9})\b.*?\bat\s+(?P<rate>[\d.]+)\s*Samples/sec", re.I
)
_SAMPLES: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+Accelerogram points at\s+(?P<rate>[\d.]+)\s+pts/sec in units of\s+"
    r"(?P<units>[^\s.]+)[\s.]+Format:\s*\((?P<columns>[1-9]\d?)f(?P<width>[1-9]\d?)"
    r"\.(?P<places>\d{1,2})\)",
    re.I,
)
#: Items of the real header with the largest sample [g] and its time [s].
_PEAK: Final = (7, 8)
_PEAK_IN_TEXT: Final = re.compile(
    r".*\bMax\s*=\s*(?P<peak>[-+\d.]+)\s*g\s*,\s*at\s+(?P<time>[\d.]+)\s*sec", re.I
)
#: Index, pattern and example of the lines that every header must have.
_EXPECTED: Final = (
    (_NAME, CHANNEL, CHANNEL_EXAMPLE),
    (10, _POINTS, "No. of Points = 10000 ... at 100 Samples/sec"),
    (27, _SAMPLES, "10000 Accelerogram points at 100 pts/sec in units of g. Format: (8f9.6)"),
)


@dataclass(frozen=True)
class _Channel(Header):
    """Header and lines of samples of one channel."""

    body: list[bytes]


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a CSMIP volume 1 file.

    Examples
    --------
    >>> sniff(b"Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg\n")
    False
    """
    lines = head_lines(head)
    # The older form has pairs of time and acceleration in g/10.
    older = any("SEC AND G/10" in line.upper() for line in lines[:_HEADER_LINES])
    return bool(lines and _TOP.match(lines[0]) and not older) and any(
        CHANNEL.match(line) or _POINTS.match(line) for line in lines[:_HEADER_LINES]
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read every channel of a CSMIP volume 1 file.

    Raises
    ------
    InputError
        If a header does not have 28 lines, stated numbers of samples or peaks differ from each
        other or from the samples, or a column does not hold a number.

    Examples
    --------
    >>> read(Path("CE89146.V1"), b"Corrected accelerogram", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: CE89146.V1:1: 'Corrected accelerogram'. Must be 'Uncorrected ...
    """
    channels = _channels(path, text_of(path, data).split(b"\n"))
    require_channels(path, channels[0].lines[4], len(channels), 5)
    ids = record_ids(path, [channel.component for channel in channels])
    records = [_record(one, name, options) for one, name in zip(channels, ids, strict=True)]
    require_distinct(path, records)
    return records


def _channels(path: Path, lines: list[bytes]) -> list[_Channel]:
    """Split a file into channels, which end with a `/&` line or before the next header."""
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise InputError(path, "the file contains only blank lines.")
    channels = []
    top = 0
    ends = [
        number
        for number, row in enumerate(lines)
        if row.lstrip()[:1] in (b"/", b"U", b"u") and _ENDS_SAMPLES.match(row)
    ]
    while top < len(lines):
        header = [line.decode("latin-1") for line in lines[top : top + _HEADER_LINES]]
        _require_header(path, header, top + 1)
        start = top + _HEADER_LINES
        end = next((number for number in ends if number >= start), len(lines))
        channels.append(
            _Channel(path, header, top + 1, _NAME, _FIRST_INTEGERS, _FIRST_REALS, lines[start:end])
        )
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
    require_header(path, header, line, _HEADER_LINES, _EXPECTED)


def _record(channel: _Channel, record_id: str, options: ReadOptions) -> Record:
    samples = _SAMPLES.match(channel.lines[27])
    assert samples  # noqa: S101 - the header was checked for it
    line = channel.line(27)
    if samples["units"].lower() != "g":
        raise InputError(
            channel.path, f"acceleration units {samples['units']!r}. Must be g.", line=line
        )
    factor = acceleration_factor(settle_units(channel.path, "g", options, line))
    count, rate = _count_and_rate(channel, samples)
    columns = Columns(int(samples["columns"]), int(samples["width"]))
    orientation, azimuth = direction_of(channel)
    step = settle_time_step(channel.path, 1.0 / rate, options, line)
    require_agreement(channel, 10, count * step, step)
    in_g = read_columns(channel.path, channel.body, columns, count, line)
    ratios = [
        require_peak(channel.path, in_g, step, peak, 10.0 ** -int(samples["places"]))
        for peak in _peaks(channel)
    ]
    return Record(
        record_id=record_id,
        acceleration=factor * in_g,
        time_step=step,
        uncorrected=True,
        component=channel.component,
        orientation=orientation,
        azimuth=azimuth,
        site_type=channel.site_type,
        station=channel.station,
        network=channel.network,
        start_time=channel.start_time,
        peak_ratio=ratios[0] if ratios else math.nan,
    )


def _peaks(channel: _Channel) -> list[StatedPeak]:
    """Return the peaks stated in the real header and in the text, if any."""
    value, time = (channel.real(item) for item in _PEAK)
    stated = [(value, time, _FIRST_REALS)] if value and time else []
    text = _PEAK_IN_TEXT.match(channel.lines[_UNITS_LINE])
    if text and all(is_number(token.encode()) for token in text.groups()):
        stated.append((Printed.of(text["peak"]), Printed.of(text["time"]), _UNITS_LINE))
    return [
        StatedPeak(value=value, time=time, units="g", line=channel.line(index))
        for value, time, index in stated
    ]


def _count_and_rate(channel: _Channel, samples: re.Match[str]) -> tuple[int, float]:
    """Return number of samples and sampling rate [Hz], after comparing all statements."""
    points = _POINTS.match(channel.lines[10])
    assert points  # noqa: S101 - the header was checked for it
    line = channel.line(27)
    count = int(samples["count"])
    others = {"'No. of Points'": int(points["count"])} | channel.stated_counts(_COUNTS)
    channel.require_counts(count, others, line)
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
