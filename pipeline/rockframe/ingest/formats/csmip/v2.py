"""Reader of CSMIP/CDMG volume 2 (V2): corrected acceleration in cm/s2, several channels per file.

A channel has 25 lines of text, 7 of integers (16I5), 13 of reals (8F10), blocks of acceleration,
velocity and displacement, and a line `/& ... End of data`. A heading above each block states
number, time step and units. Velocity and displacement are counted but not read. The header prints
the peak with its sign. Trigger times are not used as start times, because recorders keep samples
from before the trigger.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, OtherQuantityError
from rockframe.ingest.formats.csmip.agreement import direction_of, require_agreement
from rockframe.ingest.formats.csmip.header import (
    CHANNEL,
    CHANNEL_EXAMPLE,
    Header,
    filter_corners,
    require_channels,
    require_header,
    stated_processing,
)
from rockframe.ingest.metadata.identify import record_ids, require_distinct
from rockframe.ingest.options import ReadOptions, settle_time_step, settle_units
from rockframe.ingest.parsing.columns import Columns, read_columns, require_layout
from rockframe.ingest.parsing.lines import head_lines, is_number, text_of
from rockframe.ingest.parsing.peaks import Printed, StatedPeak, require_peak
from rockframe.record import Record
from rockframe.units import acceleration_factor

_HEADER_LINES: Final = 45
_FIRST_INTEGERS: Final = 25
_FIRST_REALS: Final = 32
_NAME: Final = 7
#: Items of the integer header with the number of samples, counted from 1.
_COUNTS: Final = (53,)
#: Item of the real header with the time step [s].
_STEP: Final = 61
_COLUMNS: Final = Columns(8, 10)  # default if the heading states no format

_TOP: Final = re.compile(r"\s*Corrected Accelerogram\b", re.I)
_SPECTRA: Final = re.compile(r"\s*Response and Fourier amplitude spectra\b", re.I)
_UNCORRECTED: Final = re.compile(r"\s*Uncorrected Accelerogram Data\b", re.I)
_BOUNDARY: Final = re.compile(rb"/&|\s*Corrected Accel|\s*\d+ points of ", re.I)
_POINTS: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+points of\b.*\baccel.*\bveloc.*\bdispl data\b", re.I
)
_INTERVAL: Final = re.compile(r"\s*At equally-spaced intervals of\s+(?P<step>[\d.]+)\s*sec", re.I)
_PEAK: Final = re.compile(
    r"\s*Peak acceleration\s*=\s*(?P<peak>[-+\d.]+)\s*(?P<units>\S+)\s+at\s+(?P<time>[\d.]+)\s*sec",
    re.I,
)
_BLOCK: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+points of (?P<quantity>accel|veloc|displ) data equally spaced at\s+"
    r"(?P<step>[\d.]+)\s*sec[.,]*\s*(?:\(units:|in)\s*(?P<units>[a-z/*^\d]+)[.)\s]*"
    r"(?:\((?P<columns>[1-9]\d?)f(?P<width>[1-9]\d?)\.(?P<places>\d+)\))?",
    re.I,
)
_CM_PER_S2: Final = frozenset(["cm/sec/sec", "cm/sec2", "cm/sec**2", "cm/sec^2", "cm/s2", "cm/s/s"])
_EVENT: Final = re.compile(r"\s*(?P<event>\S.*?\bEARTHQUAKE)\b", re.I)

_EXAMPLES: Final = {
    "accel": "12000 points of accel data equally spaced at .005 sec, in cm/sec2. (8f10.6)",
    "veloc": "12000 points of veloc data equally spaced at .005 sec, in cm/sec. (8f10.7)",
    "displ": "12000 points of displ data equally spaced at .005 sec, in cm. (8f10.7)",
}
_EXPECTED: Final = (
    (0, _TOP, "Corrected accelerogram ..."),
    (1, _UNCORRECTED, "Uncorrected accelerogram data ..."),
    (_NAME, CHANNEL, CHANNEL_EXAMPLE),
    (15, _POINTS, "12000 points of ... accel, veloc and displ data"),
    (16, _INTERVAL, "At equally-spaced intervals of .005 sec."),
    (17, _PEAK, "Peak acceleration = -267.957 cm/sec/sec at 10.940 sec."),
)


@dataclass(frozen=True)
class _Block:
    """A block of samples: its heading, the line number of the heading, and its lines."""

    heading: re.Match[str]
    line: int
    rows: list[bytes]

    @property
    def count(self) -> int:
        return int(self.heading["count"])

    @property
    def columns(self) -> Columns:
        return _columns(self.heading)


@dataclass(frozen=True)
class _Channel(Header):
    """Header of one channel, and its blocks of acceleration, velocity and displacement."""

    blocks: list[_Block]


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a CSMIP volume 2 or 3 file.

    Examples
    --------
    >>> sniff(b"Corrected accelerogram  89146\nUncorrected accelerogram data\n")
    True
    """
    lines = head_lines(head)
    if not lines:
        return False
    return bool(_SPECTRA.match(lines[0])) or bool(
        _TOP.match(lines[0]) and len(lines) > 1 and _UNCORRECTED.match(lines[1])
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read every channel of a CSMIP volume 2 file.

    Raises
    ------
    InputError
        If the file is volume 3, a header or block does not follow the format, stated numbers of
        samples, time steps or peaks differ from each other or from the samples, or a column does
        not hold a number.

    Examples
    --------
    >>> read(Path("CE89146.V3"), b"Response and Fourier amplitude spectra", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.OtherQuantityError: CE89146.V3:1: response and Fourier spectra (CSMIP ...
    """
    lines = text_of(path, data).split(b"\n")
    if _SPECTRA.match(lines[0].decode("latin-1")):
        raise OtherQuantityError(
            path,
            "response and Fourier spectra (CSMIP volume 3). Must be acceleration (volume 1 or 2).",
            line=1,
        )
    channels = _channels(path, lines)
    require_channels(path, channels[0].lines[5], len(channels), 6)
    ids = record_ids(path, [channel.component for channel in channels])
    records = [_record(one, name, options) for one, name in zip(channels, ids, strict=True)]
    require_distinct(path, records)
    return records


def _channels(path: Path, lines: list[bytes]) -> list[_Channel]:
    while lines and not lines[-1].strip():
        lines.pop()
    channels: list[_Channel] = []
    top = 0
    while top < len(lines) or not channels:
        header = [line.decode("latin-1") for line in lines[top : top + _HEADER_LINES]]
        require_header(path, header, top + 1, _HEADER_LINES, _EXPECTED)
        blocks = []
        end = top + _HEADER_LINES
        for quantity in _EXAMPLES:
            block = _block(path, lines, end, quantity)
            blocks.append(block)
            end += 1 + len(block.rows)
        channels.append(
            _Channel(path, header, top + 1, _NAME, _FIRST_INTEGERS, _FIRST_REALS, blocks)
        )
        top = end + 1 if lines[end : end + 1] and lines[end].startswith(b"/&") else end
    return channels


def _block(path: Path, lines: list[bytes], start: int, quantity: str) -> _Block:
    """Return the block that starts at a line and ends before the next heading."""
    text = lines[start].decode("latin-1") if start < len(lines) else ""
    heading = _BLOCK.match(text)
    if not heading or heading["quantity"].lower() != quantity:
        raise InputError(
            path,
            f"{text.strip()[:60]!r}. Must be as in {_EXAMPLES[quantity]!r}: "
            f"the heading of the {quantity} block.",
            line=start + 1,
        )
    end = start + 1 - (-int(heading["count"]) // _columns(heading).count)
    if end >= len(lines) or not _BOUNDARY.match(lines[end]):
        end = start + 1
        while end < len(lines) and not _BOUNDARY.match(lines[end]):
            end += 1
    return _Block(heading, start + 1, lines[start + 1 : end])


def _columns(heading: re.Match[str]) -> Columns:
    if heading["columns"] is None:
        return _COLUMNS
    return Columns(int(heading["columns"]), int(heading["width"]))


def _record(channel: _Channel, record_id: str, options: ReadOptions) -> Record:
    block = channel.blocks[0]
    units = block.heading["units"].lower()
    if units not in _CM_PER_S2:
        message = f"acceleration units {units!r}. Must be cm/sec2."
        raise InputError(channel.path, message, line=block.line)
    factor = acceleration_factor(settle_units(channel.path, "cm/s2", options, block.line))
    _require_counts(channel)
    step = settle_time_step(channel.path, _time_step(channel), options, block.line)
    require_agreement(channel, 11, block.count * step, step)
    samples = read_columns(channel.path, block.rows, block.columns, block.count, block.line)
    places = int(block.heading["places"] or 3)
    peak_ratio = require_peak(channel.path, samples, step, _peak(channel), 10.0**-places)
    orientation, azimuth = direction_of(channel)
    event = _EVENT.match(channel.lines[2])
    low, high = filter_corners(channel.lines[14])
    return Record(
        record_id=record_id,
        acceleration=factor * samples,
        time_step=step,
        component=channel.component,
        orientation=orientation,
        azimuth=azimuth,
        site_type=channel.site_type,
        event=event["event"] if event else "",
        station=channel.station,
        network=channel.network,
        start_time=channel.start_time,
        peak_ratio=peak_ratio,
        filter_low=low,
        filter_high=high,
        processing=stated_processing(channel.lines[14], channel.lines[15]),
    )


def _require_counts(channel: _Channel) -> None:
    first, *others = channel.blocks
    points = _POINTS.match(channel.lines[15])
    assert points  # noqa: S101 - the header was checked for it
    stated = {f"line {channel.line(15)}": int(points["count"])} | channel.stated_counts(_COUNTS)
    stated |= {f"the {block.heading['quantity'].lower()} block": block.count for block in others}
    channel.require_counts(first.count, stated, first.line)
    for block in others:
        require_layout(channel.path, block.rows, block.columns, block.count, block.line)


def _time_step(channel: _Channel) -> float:
    """Return the time step [s] with the most digits, after comparing all places that state it."""
    block = channel.blocks[0]
    interval = _INTERVAL.match(channel.lines[16])
    assert interval  # noqa: S101 - the header was checked for it
    step = _number(channel, block.heading["step"], "interval", block.line)
    places = {f"line {channel.line(16)}": interval["step"]}
    places |= {f"line {other.line}": other.heading["step"] for other in channel.blocks[1:]}
    stated = {
        place: _number(channel, token, "interval", block.line) for place, token in places.items()
    }
    item = channel.real(_STEP)
    if item:
        stated[f"item {_STEP} of the real header"] = item
    for place, other in stated.items():
        if abs(other.value - step.value) > 0.5 * step.unit + 1e-9:
            message = f"interval {step.value:g} s stated, but {other.value:g} s in {place}."
            raise InputError(channel.path, f"{message} Must be equal.", line=block.line)
    # Three decimals are too few for 1/240 s; the seven digits of the real header almost suffice.
    same = not item or math.isclose(item.value, step.value, rel_tol=1e-6)
    return step.value if same or not item else item.value


def _peak(channel: _Channel) -> StatedPeak:
    stated = _PEAK.match(channel.lines[17])
    assert stated  # noqa: S101 - the header was checked for it
    line = channel.line(17)
    if stated["units"].lower() not in _CM_PER_S2:
        message = f"peak in units of {stated['units']!r}. Must be cm/sec2."
        raise InputError(channel.path, message, line=line)
    return StatedPeak(
        value=_number(channel, stated["peak"], "peak", line),
        time=_number(channel, stated["time"], "time of the peak", line),
        units="cm/s2",
        line=line,
    )


def _number(channel: _Channel, token: str, quantity: str, line: int) -> Printed:
    if not is_number(token.encode()):
        raise InputError(channel.path, f"{quantity} {token!r}. Must be a number.", line=line)
    return Printed.of(token)
