"""Reader of volume 1 with pairs of time [s] and acceleration [g/10]: old CSMIP, USC, RENADIC.

A channel has 13 lines of text, 7 of integers, 7 of reals, the pairs (10 columns of 7 characters),
and often a line `/& ... END OF DATA`. Digitised film has uneven times; such a channel is
interpolated linearly. In RENADIC files, the time of the peak is counted from the trigger.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.formats.csmip.header import Header, Volume, read_header, require_channels
from rockframe.ingest.identify import distances, distinct_records, place_in, site_of_station
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    head_lines,
    numbers_in,
    parse_number,
    plain_text,
    require_sample_count,
    required_line,
)
from rockframe.ingest.parsing.samples import (
    Columns,
    count_columns,
    read_columns,
    require_printed_peak,
)
from rockframe.ingest.parsing.timing import even_samples
from rockframe.record import Record

DESCRIPTION = "volume 1 with pairs of time and g/10: CSMIP (older form), USC, RENADIC"

_VOLUME: Final = Volume(lines=27, name=6, integers=13, reals=20)
_COLUMNS: Final = Columns(10, 7)
_TOP: Final = re.compile(r"\s*(FILE\s+\d+ OF )?UNCORRECTED ACCELEROGRAM DATA\b", re.I)
#: Line that states the units, below the line with the number of points; other units are rejected.
_UNITS: Final = re.compile(r"UNITS (OF UNCOR ACCEL )?ARE SEC AND G/10\b", re.I)
_POINTS: Final = re.compile(
    r"NO\. OF POINTS\s*=\s*(?P<count>\d{1,8})\s+(?:RECORD LENGTH|DURATION)\s*=\s*"
    r"(?P<length>\d+\.\d*)\s*SEC", re.I,
)  # fmt: skip
_PEAK: Final = re.compile(r"\bMAX\s*=\s*(?P<peak>[-+\d.]+)\s*G\s*,\s*AT\s+(?P<time>[\d.]+)", re.I)
_RMS: Final = re.compile(
    r"RMS ACC\w*\.? OF COMPLETE RECORD\s*=\s*(?P<rms>\d*\.\d+)\s*(?P<units>G/10|G)\b", re.I
)
#: Largest relative difference between stated and actual root mean square. Archives compute the mean
#: in different ways, and drop digits.
_SAME_RMS: Final = 0.03
_NAME: Final = re.compile(
    r"\s*(?:CHAN\s+(?P<number>\d+)\s*:|COMP)\s*(?P<name>\S.*?)\s*(\s\d+)?\s*$"
)
_CODE: Final = re.compile(r"STATION (?:NO\.|USC#)\s*(?P<code>\d+)(?=[\s,])", re.I)
_MAGNITUDE: Final = re.compile(r"\bM(?P<kind>[WL])\s*=\s*(?P<size>\d+\.\d+)", re.I)
_DEPTH: Final = re.compile(r"\bH\s*=\s*(?P<depth>\d+(?:\.\d+)?)\s*KM", re.I)
_TIMES: Final = (
    re.compile(r"\s*(\d+/\d+/\d{4}\s+\d+:\d+:\d+)\s*\(GMT\)"),
    re.compile(r"TRIGGER TIME:\s*(\d+/\d+/\d{4}\s+\d+:\d+:\d+)(\.\d+)? GMT"),
)


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a volume 1 with pairs.

    Examples
    --------
    >>> sniff(b"UNCORRECTED ACCELEROGRAM DATA\n" + b"\n" * 11 + b"UNITS ARE SEC AND G/10\n")
    True
    """
    lines = head_lines(head)
    return bool(lines and _TOP.match(lines[0])) and any(map(_UNITS.match, lines[: _VOLUME.lines]))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read every channel of a volume 1 file with pairs of time and acceleration.

    Raises
    ------
    InputError
        If a header does not follow the format, or if number of points, length, peak or root mean
        square disagree with the samples.

    Examples
    --------
    >>> read(Path("a.v1"), b"UNCORRECTED ACCELEROGRAM DATA", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.v1:1: the file ends after 1 of the 27 lines of a channel'...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    tops = [i for i, line in enumerate(lines) if _TOP.match(line.decode("latin-1"))]
    if tops[:1] != [0]:
        raise InputError(path, "no heading 'UNCORRECTED ACCELEROGRAM DATA'.", line=1)
    channels = [
        (_header(path, lines, top), lines[top + _VOLUME.lines : end])
        for top, end in zip(tops, [*tops[1:], len(lines)], strict=True)
    ]
    first = channels[0][0]
    # RENADIC counts a fourth channel, the time, which the file does not contain.
    if not (len(channels) == 3 and "RENADIC" in first.lines[7]):
        require_channels(path, first.lines[4], len(channels), 5)
    names = [header.component for header, _ in channels]
    return distinct_records(path, names, channels, partial(_record, options))


def _header(path: Path, lines: list[bytes], top: int) -> Header:
    header = read_header(path, lines, top, _VOLUME)
    words = [*[""] * top, *header.lines]
    name = required_line(path, words, top + 6, _NAME, "CHAN  1: 90 DEG")
    example = "NO. OF POINTS = 5652 RECORD LENGTH = 28.260 SEC"
    points = required_line(path, words, top + 10, _POINTS, example)
    required_line(path, words, top + 11, _UNITS, "UNITS ARE SEC AND G/10")
    # Rewrite the line so that the direction is read as in newer files.
    renamed = f"Chan {name['number'] or 1}: {name['name']}"
    return replace(
        header, lines=[*header.lines[:6], renamed, *header.lines[7:]], found={10: points}
    )


def _record(options: ReadOptions, record_id: str, header: Header, rows: list[bytes]) -> Record:
    path, line = header.path, header.line(10)
    factor = factor_to_si(path, "g", options, header.line(11))
    times, tenths = _pairs(header, rows)
    match = header.found[10]
    header.require_counts(times.size, {}, (28,), line, times.size)
    require_sample_count(path, match["count"], line, times.size)
    step, samples, note = even_samples(
        path, times, tenths, header.line(_VOLUME.lines), options.time_step
    )
    mean_step = float(times[-1] - times[0]) / (times.size - 1)
    if abs(float(match["length"]) - float(times[-1])) > 1.5 * mean_step + 0.001:
        message = f"length {match['length']} s stated, but the last time is {times[-1]:g} s."
        settle(path, message, {"samples": None}, line)
    ratio = _peak_ratio(header, times, tenths, mean_step)
    header.require_length(10, float(times[-1]) + mean_step, mean_step)
    orientation, azimuth = header.direction()
    return Record(
        record_id=record_id,
        acceleration=samples * 0.1 * factor,
        time_step=settle_time_step(path, step, options, line),
        uncorrected=True,
        component=header.component,
        orientation=orientation,
        azimuth=azimuth,
        peak_ratio=ratio,
        processing=(note,) if note else (),
        **_facts(header),
    )


def _pairs(header: Header, rows: list[bytes]) -> tuple[Float, Float]:
    """Return times [s] and accelerations [g/10]."""
    line = header.line(_VOLUME.lines - 1)
    end = next((i for i, row in enumerate(rows) if row.startswith(b"/&")), len(rows))
    for number, row in enumerate(rows[end + 1 :], line + end + 2):
        if row.strip():
            raise InputError(header.path, "text after the end of the data.", line=number)
    rows = [row.rstrip() for row in rows[:end]]
    while rows and not rows[-1]:
        rows.pop()
    # Files of USC begin each line with a blank.
    if rows and all(row[:1] == b" " for row in rows) and len(rows[0]) % _COLUMNS.width == 1:
        rows = [row[1:] for row in rows]
    count = count_columns(rows, _COLUMNS)
    if count % 2:
        message = f"{count} values of times and accelerations. Must be an even number."
        raise InputError(header.path, message, line)
    numbers = read_columns(header.path, rows, _COLUMNS, count, line)
    return numbers[::2], numbers[1::2]


def _peak_ratio(header: Header, times: Float, tenths: Float, step: float) -> float:
    """Return the ratio of actual to stated peak; raise if peak or root mean square differ."""
    rms = _RMS.match(header.lines[12])
    if rms:
        # The exact mean over time of straight lines between the points.
        earlier, other = tenths[:-1], tenths[1:]
        squares = (earlier * earlier + earlier * other + other * other) / 3.0 * np.diff(times)
        computed = math.sqrt(float(squares.sum()) / float(times[-1] - times[0]))
        computed *= 0.1 if rms["units"].upper() == "G" else 1.0
        unit = 10.0 ** -len(rms["rms"].partition(".")[2])
        if abs(computed - float(rms["rms"])) > _SAME_RMS * computed + unit:
            words = f"root mean square {rms['rms']} {rms['units']} stated"
            message = f"{words}, {computed:.4g} in the file."
            settle(header.path, message, {"values": None}, header.line(12))
    peak = _PEAK.search(header.lines[11])
    if not peak:
        return math.nan
    line, time = header.line(11), parse_number(header.path, peak["time"], header.line(11), "time")
    where = times[np.abs(tenths) >= np.abs(tenths).max() - 1e-9]
    # The time is counted from the first sample, or from the trigger.
    late = min(float(np.abs(where - first - time).min()) for first in (0.0, _trigger(header)))
    if late > step + 0.002:
        message = f"peak stated at {time:g} s, but at {where[0]:g} s in the file."
        settle(header.path, message, {"values": None}, line)
    return require_printed_peak(header.path, peak["peak"], 0.1 * tenths, "g", line, signed=True)


def _trigger(header: Header) -> float:
    """Return the time from the origin of the samples to the trigger [s]; 0 if unstated."""
    matches = [
        pattern.search(line) for pattern, line in zip(_TIMES, header.lines[2:4], strict=True)
    ]
    try:
        begin, trigger = (
            datetime.strptime(match[1], "%m/%d/%Y %H:%M:%S") for match in matches if match
        )
    except ValueError:
        return 0.0
    fraction = matches[1][2] if matches[1] and matches[1][2] else "0"
    return (trigger - begin).total_seconds() + float(fraction)


def _facts(header: Header) -> dict[str, Any]:
    """Return event, station, magnitude and distances as fields of a record."""
    lines = header.lines
    sizes = {match["kind"].upper(): float(match["size"]) for match in _MAGNITUDE.finditer(lines[8])}
    magnitude = sizes.get("W") or sizes.get("L") or math.nan
    (depth,) = numbers_in(_DEPTH, lines[8])
    distance_facts = distances(place_in(lines[8]), place_in(lines[4]), depth)
    if lines[4].startswith("STATION USC#"):
        distance, size = (header.real(item) for item in (11, 12))
        distance_facts = {"epicentral_distance": distance.value} if distance else {}
        magnitude = size.value if size else math.nan
    code = _CODE.match(lines[4])
    name = re.split(r"\s{2,}| S/N ", lines[5].strip())[0]
    return distance_facts | {
        "site_type": site_of_station(name),
        "event": re.split(r"\s{2,}", lines[1].strip())[0],
        "station": code["code"] if code else name,
        "magnitude": magnitude,
    }
