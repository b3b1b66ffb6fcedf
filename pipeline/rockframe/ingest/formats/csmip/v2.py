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
from functools import partial
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, OtherQuantityError, settle
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
    require_layout,
    require_peak,
)
from rockframe.record import Record

DESCRIPTION = "CSMIP/CDMG volume 2, corrected acceleration in cm/s2, several channels"

#: Indices of the lines with the filters, the number of points, the interval and the peak.
_FILTER_LINE, _POINTS_LINE, _INTERVAL_LINE, _PEAK_LINE = 14, 15, 16, 17
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
_NUMBER: Final = r"(\d{1,6}\.?\d{0,6}|\.\d{1,6})"
_BETWEEN: Final = re.compile(
    rf"bandpass filtered with 3 dB pts at\s+{_NUMBER}\s+and\s+{_NUMBER}\s+cyc/sec", re.I
)
_RAMPS: Final = re.compile(
    rf"bandpass filtered with ramps at\s+{_NUMBER}\s*-\s*{_NUMBER}\s+and\s+{_NUMBER}\s*-\s*"
    rf"{_NUMBER}\s+cyc/sec",
    re.I,
)
_VOLUME: Final = Volume(
    lines=45,
    name=7,
    integers=25,
    reals=32,
    expected=(
        (0, _TOP, "Corrected accelerogram ..."),
        (1, _UNCORRECTED, "Uncorrected accelerogram data ..."),
        (7, CHANNEL, CHANNEL_EXAMPLE),
        (_POINTS_LINE, _POINTS, "12000 points of ... accel, veloc and displ data"),
        (_INTERVAL_LINE, _INTERVAL, "At equally-spaced intervals of .005 sec."),
        (_PEAK_LINE, _PEAK, "Peak acceleration = -267.957 cm/sec/sec at 10.940 sec."),
    ),
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
    lines = plain_text(path, data).split(b"\n")
    if _SPECTRA.match(lines[0].decode("latin-1")):
        message = "response and Fourier spectra (CSMIP volume 3)."
        raise OtherQuantityError(
            path, f"{message} Only accelerations (volumes 1 and 2) are read.", 1
        )
    channels = _channels(path, lines)
    require_channels(path, channels[0][0].lines[5], len(channels), 6)
    names = [header.component for header, _ in channels]
    return distinct_records(path, names, channels, partial(_record, options))


def _channels(path: Path, lines: list[bytes]) -> list[tuple[Header, list[_Block]]]:
    """Return the headers of channels and their blocks: acceleration, velocity, displacement."""
    while lines and not lines[-1].strip():
        lines.pop()
    channels: list[tuple[Header, list[_Block]]] = []
    top = 0
    while top < len(lines) or not channels:
        header = read_header(path, lines, top, _VOLUME)
        blocks = []
        end = top + _VOLUME.lines
        for quantity in _EXAMPLES:
            block = _block(path, lines, end, quantity)
            blocks.append(block)
            end += 1 + len(block.rows)
        channels.append((header, blocks))
        top = end + 1 if lines[end : end + 1] and lines[end].startswith(b"/&") else end
    return channels


def _block(path: Path, lines: list[bytes], start: int, quantity: str) -> _Block:
    """Return the block that starts at a line and ends before the next heading."""
    text = lines[start].decode("latin-1") if start < len(lines) else ""
    heading = _BLOCK.match(text)
    if not heading or heading["quantity"].lower() != quantity:
        message = (
            f"{text.strip()[:60]!r}, where a line such as {_EXAMPLES[quantity]!r} is expected: "
        )
        raise InputError(path, f"{message}the heading of the {quantity} block.", start + 1)
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


def _record(options: ReadOptions, record_id: str, header: Header, blocks: list[_Block]) -> Record:
    path, block = header.path, blocks[0]
    units = block.heading["units"].lower()
    if units not in _CM_PER_S2:
        raise InputError(path, f"acceleration units {units!r}. Must be cm/sec2.", block.line)
    factor = factor_to_si(path, "cm/s2", options, block.line)
    _require_counts(header, blocks)
    step = settle_time_step(path, _time_step(header, blocks), options, block.line)
    samples = read_columns(path, block.rows, block.columns, block.count, block.line)
    header.require_length(11, samples.size * step, step)
    places = int(block.heading["places"] or 3)
    peak_ratio = require_peak(path, samples, step, _peak(header), 10.0**-places)
    event = _EVENT.match(header.lines[2])
    return Record(
        record_id=record_id,
        acceleration=factor * samples,
        time_step=step,
        event=event["event"] if event else "",
        peak_ratio=peak_ratio,
        **header.facts(),
        **_processing(header.lines[_FILTER_LINE], header.lines[_FILTER_LINE + 1]),
    )


def _processing(filters: str, corrections: str) -> dict[str, Any]:
    """Return the corners [Hz] of the archive's band-pass, and its processing, as record fields.

    Examples
    --------
    >>> _processing("bandpass filtered with 3 dB pts at .30 and 40.00 cyc/sec", "")["processing"]
    ('archive: band-pass 0.3 to 40 Hz (3 dB)',)
    >>> _processing("bandpass filtered with ramps at .05-.1 and 23-25 cyc/sec", "")["filter_low"]
    0.1
    """
    done = []
    low = high = math.nan
    if re.search("instrument- and baseline-corrected", corrections, re.I):
        done.append("archive: instrument and baseline corrected")
    if ramps := _RAMPS.search(filters):
        corners = [float(token) for token in ramps.groups()]
        low, high = corners[1:3]  # the inner ends
        done.append("archive: band-pass, ramps {:g} to {:g} and {:g} to {:g} Hz".format(*corners))
    if between := _BETWEEN.search(filters):
        low, high = map(float, between.groups())
        done.append(f"archive: band-pass {low:g} to {high:g} Hz (3 dB)")
    return {
        "filter_low": low or math.nan,
        "filter_high": high or math.nan,
        "processing": tuple(done),
    }


def _require_counts(header: Header, blocks: list[_Block]) -> None:
    first, *others = blocks
    place = f"line {header.line(_POINTS_LINE)}"
    counts = {place: int(header.found[_POINTS_LINE]["count"])}
    counts |= {f"the {block.heading['quantity'].lower()} block": block.count for block in others}
    present = count_columns(first.rows, first.columns)
    header.require_counts(first.count, counts, _COUNTS, first.line, present)
    for block in others:
        require_layout(header.path, block.rows, block.columns, block.count, block.line)


def _time_step(header: Header, blocks: list[_Block]) -> float:
    """Return the time step [s] with the most digits, after comparing all places that state it."""
    line = blocks[0].line
    step = _number(header, blocks[0].heading["step"], "interval", line)
    places = {header.line(_INTERVAL_LINE): header.found[_INTERVAL_LINE]["step"]}
    places |= {other.line: other.heading["step"] for other in blocks[1:]}
    step_texts = {
        f"line {place}": _number(header, token, "interval", line) for place, token in places.items()
    }
    item = header.real(_STEP)
    if item:
        step_texts[f"item {_STEP} of the real header"] = item
    for place, other in step_texts.items():
        if abs(other.value - step.value) > 0.5 * step.unit + 1e-9:
            message = f"interval {step.value:g} s stated, but {other.value:g} s in {place}."
            steps = {"waveform": step.value, "header": other.value}
            return settle(header.path, message, steps, line)
    # Three decimals are too few for 1/240 s; the seven digits of the real header almost suffice.
    same = not item or math.isclose(item.value, step.value, rel_tol=1e-6)
    return step.value if same or not item else item.value


def _peak(header: Header) -> StatedPeak:
    match, line = header.found[_PEAK_LINE], header.line(_PEAK_LINE)
    if match["units"].lower() not in _CM_PER_S2:
        message = f"peak in units of {match['units']!r}. Must be cm/sec2."
        raise InputError(header.path, message, line)
    return StatedPeak(
        value=_number(header, match["peak"], "peak", line),
        time=_number(header, match["time"], "time of the peak", line),
        units="cm/s2",
        line=line,
    )


def _number(header: Header, token: str, quantity: str, line: int) -> Printed:
    if not is_number(token):
        raise InputError(header.path, f"{quantity} {token!r}. Must be a number.", line)
    return Printed.of(token)
