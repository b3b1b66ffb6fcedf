"""Reader of CSMIP/CDMG volume 1 (V1): uncorrected acceleration in g, several channels per file.

A channel has 13 lines of text, 7 of integers (16I5), 7 of reals, one line with number, rate, units
and columns of the samples, the samples, and a line `/& ... End of Data`.
"""

from __future__ import annotations

import math
import re
from functools import partial
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, settle
from rockframe.ingest.formats.csmip.header import (
    CHANNEL,
    CHANNEL_EXAMPLE,
    Header,
    Volume,
    read_header,
    require_channels,
)
from rockframe.ingest.identify import distinct_records
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import head_lines, is_number, plain_text
from rockframe.ingest.parsing.samples import (
    Columns,
    Printed,
    StatedPeak,
    count_columns,
    read_columns,
    require_peak,
)
from rockframe.record import Record

DESCRIPTION = "CSMIP/CDMG volume 1, uncorrected acceleration in g, several channels"

#: Indices of the lines with the number of points, the peak, and the layout of the samples.
_POINTS_LINE, _PEAK_LINE, _SAMPLES_LINE = 10, 11, 27
#: Items of the integer header with the number of samples, counted from 1.
_COUNTS: Final = (28, 33)
#: Items of the real header with the largest sample [g] and its time [s].
_PEAK: Final = (7, 8)

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
_PEAK_IN_TEXT: Final = re.compile(
    r".*\bMax\s*=\s*(?P<peak>[-+\d.]+)\s*g\s*,\s*at\s+(?P<time>[\d.]+)\s*sec", re.I
)
_VOLUME: Final = Volume(
    lines=28,
    name=6,
    integers=13,
    reals=20,
    expected=(
        (6, CHANNEL, CHANNEL_EXAMPLE),
        (_POINTS_LINE, _POINTS, "No. of Points = 10000 ... at 100 Samples/sec"),
        (
            _SAMPLES_LINE,
            _SAMPLES,
            "10000 Accelerogram points at 100 pts/sec in units of g. Format: (8f9.6)",
        ),
    ),
)


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a CSMIP volume 1 file.

    Examples
    --------
    >>> sniff(b"Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg\n")
    False
    """
    lines = head_lines(head)
    # The older form has pairs of time and acceleration in g/10.
    older = any("SEC AND G/10" in line.upper() for line in lines[: _VOLUME.lines])
    return bool(lines and _TOP.match(lines[0]) and not older) and any(
        CHANNEL.match(line) or _POINTS.match(line) for line in lines[: _VOLUME.lines]
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
    rockframe.errors.InputError: CE89146.V1:1: 'Corrected accelerogram', where 'Uncorrected ...
    """
    channels = _channels(path, plain_text(path, data).split(b"\n"))
    require_channels(path, channels[0][0].lines[4], len(channels), 5)
    names = [header.component for header, _ in channels]
    return distinct_records(path, names, channels, partial(_record, options))


def _channels(path: Path, lines: list[bytes]) -> list[tuple[Header, list[bytes]]]:
    """Return the headers and samples of channels, which end with `/&` or before the next header."""
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
        first = lines[top].decode("latin-1")
        if not _TOP.match(first):
            message = (
                f"{first.strip()[:40]!r}, where 'Uncorrected Accelerogram Data ...' is expected, "
            )
            raise InputError(path, f"{message}the first line of a channel.", top + 1)
        header = read_header(path, lines, top, _VOLUME)
        start = top + _VOLUME.lines
        end = next((number for number in ends if number >= start), len(lines))
        channels.append((header, lines[start:end]))
        top = end + 1 if lines[end : end + 1] and lines[end].startswith(b"/&") else end
    return channels


def _record(options: ReadOptions, record_id: str, header: Header, rows: list[bytes]) -> Record:
    path, line, samples = header.path, header.line(_SAMPLES_LINE), header.found[_SAMPLES_LINE]
    if samples["units"].lower() != "g":
        raise InputError(path, f"acceleration units {samples['units']!r}. Must be g.", line)
    factor = factor_to_si(path, "g", options, line)
    columns = Columns(int(samples["columns"]), int(samples["width"]))
    count, rate = _count_and_rate(header, count_columns(rows, columns))
    facts = header.facts()
    step = settle_time_step(path, 1.0 / rate, options, line)
    in_g = read_columns(path, rows, columns, count, line)
    header.require_length(_POINTS_LINE, in_g.size * step, step)
    ratios = [
        require_peak(path, in_g, step, peak, 10.0 ** -int(samples["places"]))
        for peak in _peaks(header)
    ]
    return Record(
        record_id=record_id,
        acceleration=factor * in_g,
        time_step=step,
        uncorrected=True,
        peak_ratio=ratios[0] if ratios else math.nan,
        **facts,
    )


def _peaks(header: Header) -> list[StatedPeak]:
    """Return the peaks stated in the real header and in the text, if any."""
    value, time = (header.real(item) for item in _PEAK)
    extremes = [(value, time, _VOLUME.reals)] if value and time else []
    text = _PEAK_IN_TEXT.match(header.lines[_PEAK_LINE])
    if text and all(is_number(token) for token in text.groups()):
        extremes.append((Printed.of(text["peak"]), Printed.of(text["time"]), _PEAK_LINE))
    return [
        StatedPeak(value=value, time=time, units="g", line=header.line(index))
        for value, time, index in extremes
    ]


def _count_and_rate(header: Header, present: int) -> tuple[int, float]:
    """Return number of samples and sampling rate [Hz], after comparing all statements."""
    points, samples = header.found[_POINTS_LINE], header.found[_SAMPLES_LINE]
    count, line = int(samples["count"]), header.line(_SAMPLES_LINE)
    header.require_counts(count, {"'No. of Points'": int(points["count"])}, _COUNTS, line, present)
    before, rate = (_rate(header, index) for index in (_POINTS_LINE, _SAMPLES_LINE))
    if before != rate:
        place = f"line {header.line(_POINTS_LINE)}"
        message = f"{rate:g} samples a second stated, but {before:g} in {place}."
        rate = settle(header.path, message, {"waveform": rate, "header": before}, line)
    return count, rate


def _rate(header: Header, index: int) -> float:
    token = header.found[index]["rate"]
    if not (is_number(token) and float(token) > 0.0):
        raise header.error(index, f"{token!r} samples a second. Must be a positive number.")
    return float(token)
