"""Reader of GeoNet (New Zealand) V1A and V2A: three components per file, in mm/s2.

A component has 16 lines of text, 4 of integers (10I8), 6 of reals (10F8), and the samples (10
columns of 8): acceleration in V1A; acceleration, velocity and displacement in V2A.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import direction, noted, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    head_lines,
    header_lines,
    is_number,
    numbers_in,
    plain_text,
    required_line,
)
from rockframe.ingest.parsing.samples import (
    Columns,
    header_item,
    read_columns,
    require_printed_peak,
)
from rockframe.ingest.parsing.timing import utc_time
from rockframe.record import Orientation, Record

DESCRIPTION = "GeoNet V1A and V2A in mm/s2, three components"

_TEXT_LINES: Final = 16
_HEADER_LINES: Final = 26
_COLUMNS: Final = Columns(10, 8)
#: Indices of the first lines of integers and reals.
_INTEGERS: Final = 16
_REALS: Final = 20
#: Items of the integer header, counted from 1: start of the buffer, direction, number of prepended
#: samples, numbers of samples in the blocks.
_START: Final = (9, 10, 19, 20, 39, 40)
_DIRECTION: Final = 28
_PREPENDED: Final = 32
_COUNTS: Final = (34, 35, 36)
#: Item of the real header with the time step [s].
_STEP: Final = 26

_TOP: Final = re.compile(r"(?P<kind>Unc|C)orrected accelerogram\b", re.I)
_POINTS: Final = re.compile(
    r"Number of points\s+(?P<count>\d{1,8})\s+Duration\s+(?P<duration>[\d.]+)\s*s", re.I
)
_CORRECTED: Final = re.compile(r".*\bat\s+(?P<step>[\d.]+)\s*s(?:ec)?\s+intervals", re.I)
_RAW: Final = re.compile(
    r"Raw readings in units of\s+(?P<units>[\d.]+)\s*mm/s/s\s+at intervals of\s+(?P<step>[\d.]+)",
    re.I,
)
_COMPONENT: Final = re.compile(r"Component\s+(?P<component>\S+)", re.I)
_PEAK: Final = re.compile(
    r"Acceleration:\s+peak\s+(?P<peak>\S+)\s+mm/s/s\s+at\s+(?P<time>\S+)\s+s(?:ec)?\b", re.I
)
_FILTER: Final = re.compile(
    r"^Band-pass filter transition bands are\s+[\d.]+-(?P<low>\d*\.\d+)\s*Hz and\s+"
    r"(?P<high>\d*\.\d+)-[\d.]+\s*Hz",
    re.I,
)
_SITE: Final = re.compile(r"Site\s+(?P<station>\w+)")
_DISTANCE: Final = re.compile(r"\bDist\s+(?P<distance>\d+(?:\.\d+)?)\s*km", re.I)
_MAGNITUDE: Final = re.compile(r"\bM[A-Z]?\s+(?P<magnitude>\d+(?:\.\d+)?)\s*$", re.I)


@dataclass(frozen=True)
class _Component:
    """Lines of one component, and the line number of the first."""

    path: Path
    header: list[str]
    body: list[bytes]
    first_line: int

    @property
    def uncorrected(self) -> bool:
        return self.header[0].lower().startswith("unc")

    @property
    def name(self) -> str:
        name = self.matched(12, _COMPONENT, "Component S16W")["component"]
        return name.upper() if direction(name)[0].upright else name

    def matched(self, index: int, pattern: re.Pattern[str], example: str) -> re.Match[str]:
        return required_line(self.path, self.header, index, pattern, example, self.first_line)

    def integer(self, item: int) -> int:
        return int(self._item(item, _INTEGERS, r" *-?\d+"))

    def real(self, item: int) -> float:
        return float(self._item(item, _REALS, r" *-?\d*\.\d*"))

    def _item(self, item: int, first: int, pattern: str) -> str:
        field = header_item(self.header[first:], item, _COLUMNS)
        if not re.fullmatch(pattern, field, re.ASCII) or not any(map(str.isdigit, field)):
            row = first + (item - 1) // _COLUMNS.count
            raise self.error(row, f"item {item} {field.strip()!r}. Must be a number.")
        return field

    def error(self, index: int, message: str) -> InputError:
        return InputError(self.path, message, line=self.first_line + index)


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a GeoNet V1A or V2A file.

    Examples
    --------
    >>> sniff(b"Corrected accelerogram   89146-L2500-12044.02       Chan  1: 360 Deg\n")
    False
    """
    lines = head_lines(head)
    return len(lines) > 1 and bool(_TOP.match(lines[0]) and _SITE.match(lines[1]))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the acceleration records of the three components of a GeoNet file.

    Raises
    ------
    InputError
        If there are not three components; if counts, time steps, bearing or peak disagree with each
        other or with the samples; or if a column is not a number.

    Examples
    --------
    >>> read(Path("WPWS.V2A"), b"Corrected accelerogram", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: WPWS.V2A:1: the file ends after 1 of the 26 lines of a compone...
    """
    components = _components(path, plain_text(path, data).rstrip().split(b"\n"))
    if len(components) != 3:
        message = f"{len(components)} components. Must be 3."
        raise InputError(path, message, line=components[-1].first_line)
    ids = record_ids(path, [component.name for component in components])
    return [
        noted(partial(_record, component, record_id, options))
        for component, record_id in zip(components, ids, strict=True)
    ]


def _components(path: Path, lines: list[bytes]) -> list[_Component]:
    """Split a file into components at their headers."""
    tops = [i for i, line in enumerate(lines) if _TOP.match(line[:40].decode("latin-1"))]
    if not tops or tops[0] != 0:
        shown = lines[0].decode("latin-1").strip()[:40]
        raise InputError(
            path, f"{shown!r}, where '(Un)corrected accelerogram ...' is expected.", line=1
        )
    components = []
    for top, end in zip(tops, [*tops[1:], len(lines)], strict=True):
        header = header_lines(path, lines[:end], top, _HEADER_LINES, "a component's header")
        components.append(_Component(path, header, lines[top + _HEADER_LINES : end], top + 1))
    return components


def _record(component: _Component, record_id: str, options: ReadOptions) -> Record:
    path, line = component.path, component.first_line
    factor = factor_to_si(path, "mm/s2", options, line + 13)
    step = settle_time_step(path, _step(component), options, line + 10)
    samples = _samples(component, step)
    peak = component.matched(13, _PEAK, "Acceleration:  peak    -41.6 mm/s/s at  43.68 sec")
    ratio = require_printed_peak(
        path,
        peak["peak"],
        samples,
        "mm/s2",
        line + 13,
        signed=True,
        time=peak["time"],
        time_step=step,
        # Times are counted from the first recorded sample, which follows the prepended ones.
        first=-step * max(component.integer(_PREPENDED), 0),
    )
    low, high = numbers_in(_FILTER, component.header[11])
    orientation, azimuth = _direction(component)
    return Record(
        record_id=record_id,
        acceleration=samples * factor,
        time_step=step,
        uncorrected=component.uncorrected,
        component=component.name,
        orientation=orientation,
        azimuth=azimuth,
        event=" ".join(component.header[7].split()),
        station=component.matched(1, _SITE, "Site WPWS")["station"],
        start_time=_start_time(component),
        magnitude=numbers_in(_MAGNITUDE, component.header[8])[0],
        epicentral_distance=numbers_in(_DISTANCE, component.header[8])[0],
        peak_ratio=ratio,
        filter_low=low or math.nan,
        filter_high=high or math.nan,
    )


def _step(component: _Component) -> float:
    """Return the time step [s] after comparing text and real header."""
    if component.uncorrected:
        match = component.matched(
            10, _RAW, "Raw readings in units of 1.00 mm/s/s  at intervals of 0.005 s"
        )
        if not is_number(match["units"]) or float(match["units"]) != 1.0:
            message = f"raw readings in units of {match['units']} mm/s/s. Must be 1.00."
            raise component.error(10, message)
    else:
        match = component.matched(
            10, _CORRECTED, "Instrument corrected data at 0.020 sec intervals"
        )
    token, step = match["step"], component.real(_STEP)
    last_place = 10.0 ** -len(token.partition(".")[2])
    if not is_number(token) or abs(float(token) - step) > 0.501 * last_place:
        message = f"time step {token} s stated, but {step:g} s in the real header."
        if not is_number(token):
            raise component.error(10, message)
        steps = {"waveform": float(token), "header": step}
        return settle(component.path, message, steps, component.first_line + 10)
    return step


def _samples(component: _Component, step: float) -> Float:
    """Return the acceleration [mm/s2]; velocity and displacement are only counted."""
    counts = [component.integer(item) for item in _COUNTS]
    points = component.matched(9, _POINTS, "Number of points  5800    Duration 115.98 sec")
    message = f"{points['count']} points stated, but {counts[0]} in item 34 of the integer header."
    must = "Both must be the same, 2 or more."
    if counts[0] < 2:
        raise component.error(9, f"{message} {must}")
    if int(points["count"]) != counts[0]:
        # The lines of samples, which are counted below, show whether it is item 34.
        line = component.first_line + 9
        settle(component.path, message, {"samples": counts[0]}, line, must)
    duration = float(points["duration"]) if is_number(points["duration"]) else math.nan
    # Durations may be one step shorter, and are rounded to 10 ms.
    if not abs(duration - counts[0] * step) <= 1.5 * step + 0.01:
        message = f"{points['duration']} s stated, but {counts[0]} points at {step:g} s."
        settle(component.path, message, {"samples": counts[0]}, component.first_line + 9)
    rows = [-(-max(count, 0) // _COLUMNS.count) for count in counts]
    if not any(counts[1:]):
        rows[0] = len(component.body)  # only one series, of which the samples are counted below
    if len(component.body) != sum(rows):
        message = (
            f"{sum(rows)} lines of samples stated (of {counts[0]}, {counts[1]} and {counts[2]} "
            f"numbers), {len(component.body)} in the file."
        )
        raise component.error(_INTEGERS + 3, message)
    start, blocks = 0, []
    for count, length in zip(counts, rows, strict=True):
        block = component.body[start : start + length]
        line = component.first_line + _HEADER_LINES + start - 1
        blocks.append(read_columns(component.path, block, _COLUMNS, count, line) if count else 0)
        start += length
    return np.asarray(blocks[0], dtype=np.float64)


def _direction(component: _Component) -> tuple[Orientation, float]:
    """Return the direction from the name; for a horizontal, the integer header must agree."""
    orientation, azimuth = direction(component.name)
    degrees_stated = component.integer(_DIRECTION)
    turn = abs((azimuth - degrees_stated + 180.0) % 360.0 - 180.0)
    if orientation is Orientation.HORIZONTAL and turn > 1.0:
        message = (
            f"component {component.name!r} is {azimuth:g} degrees, but {degrees_stated} in item "
            f"{_DIRECTION} of the integer header."
        )
        angles = {"component": azimuth, "azimuth": float(degrees_stated)}
        azimuth = settle(component.path, message, angles, component.first_line + 12)
    return orientation, azimuth


def _start_time(component: _Component) -> str:
    """Return the start of the buffer (ISO 8601, UTC); "" if invalid, or with prepended samples."""
    year, month, day, hour, minute, milliseconds = (component.integer(item) for item in _START)
    # Month 0 would mean that the day is the day of the year.
    if component.integer(_PREPENDED) or month == 0:
        return ""
    second, rest = divmod(milliseconds, 1000)
    return utc_time((year, month, day), hour, minute, f"{second}.{rest:03d}")
