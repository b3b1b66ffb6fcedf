"""Header of a CSMIP/CDMG channel: what volumes 1 and 2 have in common, and state twice."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import direction, site_of_location, site_of_station, upright_sense
from rockframe.ingest.parsing.lines import header_lines, is_number
from rockframe.ingest.parsing.samples import Columns, Printed, header_item
from rockframe.ingest.parsing.timing import utc_time
from rockframe.record import Orientation, SiteType

#: Line that names a channel, and an example of it for error messages.
CHANNEL: Final = re.compile(r"\s*Chan\s+(?P<number>\d+)\s*:\s*(?P<label>.*?)\s*$", re.I)
CHANNEL_EXAMPLE: Final = "Chan 1: 90 Deg"
#: Number of channels that the file should hold, in the line about the station.
CHANNELS: Final = re.compile(r"\(\s*(?P<count>\d{1,4})\s*Chns", re.I)
_INTEGERS, _REALS = Columns(16, 5, integers=True), Columns(8, 10)
#: Items of the integer header, counted from 1: year; azimuth [degree], or a code above 360 for a
#: vertical.
_YEAR, _DIRECTION = 24, 27
_UPRIGHT: Final = {500: Orientation.VERTICAL, 600: Orientation.DOWNWARD}
#: Header lines relative to the line that names the channel.
_START_LINE, _STATION_LINE = -3, -2

_LENGTH: Final = re.compile(r"Record Length\s*=\s*(?P<length>[\d.]+)\s*sec", re.I)
_CHANNEL_IN_LINE: Final = re.compile(r"\bChan\s+(?P<number>\d+)\s*:", re.I)
_LOCATION: Final = re.compile(r"\bLocation:\s*(?P<location>\S.*?)\s*$", re.I)
_DEGREES: Final = re.compile(r"(?P<azimuth>\d{1,3})\s*Deg\b", re.I)
_NETWORK: Final = re.compile(r"\s*\w+\.(?P<network>\w{1,2})\.(?P<station>\w{1,5})\.[\w-]*\.\w+\s")
_STATION: Final = re.compile(r"\s*Station (?:No\.|Id\.)\s*(?P<station>\w+)", re.I)
_START: Final = re.compile(
    r"Start time:\s*(\d\d?)/\s*(\d\d?)/(\d\d),\s*(\d\d?):\s*(\d\d?):\s*(\d\d?)(\.\d+)?\s*UTC", re.I
)


@dataclass(frozen=True)
class Volume:
    """Form of the header of a channel.

    Parameters
    ----------
    lines : int
        Number of lines.
    name, integers, reals : int
        Indices of the line that names the channel, and of the first lines of integers (16I5) and
        reals (8F10).
    expected : sequence of tuple
        Index of a line, the pattern that its beginning must match, and an example.
    """

    lines: int
    name: int
    integers: int
    reals: int
    expected: Sequence[tuple[int, re.Pattern[str], str]] = ()


@dataclass(frozen=True)
class Header:
    """Header of one channel; items are counted from 1.

    Parameters
    ----------
    path : Path
        The file, for error messages.
    lines : sequence of str
        Header lines.
    first_line : int
        Line number of the first header line.
    volume : Volume
        Form of the header.
    found : mapping of int to re.Match
        Matches of the expected lines, by their index.

    Examples
    --------
    >>> lines = ["Start time:  7/06/19, 03:19:40.04 UTC", "Station Id. CCC", "", "Chan 1: Up"]
    >>> header = Header(Path("CCC.V1"), lines, 1, Volume(4, 3, 4, 4), {})
    >>> header.component, header.station, header.start_time
    ('UP', 'CCC', '')
    """

    path: Path
    lines: Sequence[str]
    first_line: int
    volume: Volume
    found: Mapping[int, re.Match[str]]

    def error(self, index: int, message: str) -> InputError:
        """Return an error that states the line number of a header line."""
        return InputError(self.path, message, self.line(index))

    def line(self, index: int) -> int:
        """Return the line number in the file of a header line."""
        return self.first_line + index

    @property
    def component(self) -> str:
        """Three-digit azimuth, or the name of the channel."""
        named = CHANNEL.match(self.lines[self.volume.name])
        if not named:
            return ""
        degrees = _DEGREES.match(named["label"])
        if degrees:
            return f"{int(degrees['azimuth']):03d}"
        # Channels of structures state their location after two or more blanks.
        name = re.split(r"\s{2,}", named["label"])[0]
        return name.upper() if direction(name)[0].upright else name

    @property
    def station(self) -> str:
        """Station code or number."""
        return self._codes[1]

    @property
    def _codes(self) -> tuple[str, str]:
        """Network code, if the channel has a SEED name, and station code or number."""
        seed = _NETWORK.match(self.lines[self.volume.name + _START_LINE])
        if seed:
            return seed["network"], seed["station"]
        match = _STATION.match(self.lines[self.volume.name + _STATION_LINE])
        return "", match["station"] if match else ""

    @property
    def start_time(self) -> str:
        """Start time (ISO 8601, UTC); empty unless stated in UTC and the year is known."""
        match = _START.search(self.lines[self.volume.name + _START_LINE])
        year = self.item(_YEAR)
        if not match or year is None or year % 100 != int(match[3]):
            return ""
        month, day, hour, minute = (int(match[group]) for group in (1, 2, 4, 5))
        return utc_time((year, month, day), hour, minute, f"{int(match[6]):02d}{match[7] or ''}")

    def item(self, item: int) -> int | None:
        """Return an item of the integer header; None if it is not filled in."""
        field = header_item(self.lines[self.volume.integers :], item, _INTEGERS)
        return int(field) if re.fullmatch(r" *-?\d+", field) else None

    def real(self, item: int) -> Printed | None:
        """Return an item of the real header as printed; None if it is not filled in."""
        field = header_item(self.lines[self.volume.reals :], item, _REALS).strip()
        if not is_number(field) or float(field) in (0.0, -999.0):
            return None
        return Printed.of(field)

    def direction(self) -> tuple[Orientation, float]:
        """Return orientation and azimuth [degree]; name and integer header must not contradict."""
        code = self.item(_DIRECTION)
        orientation, azimuth = direction(self.component)
        # 0 and -999 mean that the item is not filled in.
        if code is None or code <= 0 or orientation is Orientation.UNSTATED:
            return orientation, azimuth
        sense: Orientation | None = orientation
        if code in _UPRIGHT and orientation.upright:
            sense = upright_sense(self.component, _UPRIGHT[code])
        elif code <= 360 if orientation.upright else (code - azimuth) % 360.0 != 0.0:
            sense = None
        if sense is None:
            message = f"channel {self.component!r}, but {code} in item {_DIRECTION} of the "
            message += "integer header."
            angles = {"component": (orientation, azimuth)}
            if code <= 360:
                angles["azimuth"] = Orientation.HORIZONTAL, code % 360.0
            return settle(self.path, message, angles, self.line(self.volume.name))
        return sense, azimuth

    def facts(self) -> dict[str, Any]:
        """Return the fields of a record that headers of both volumes state."""
        orientation, azimuth = self.direction()
        place = _LOCATION.search(self.lines[self.volume.name])
        site = site_of_location(place["location"]) if place else SiteType.UNKNOWN
        if site is SiteType.UNKNOWN:
            site = site_of_station(self.lines[self.volume.name - 1])
        network, station = self._codes
        return {
            "component": self.component,
            "orientation": orientation,
            "azimuth": azimuth,
            "site_type": site,
            "station": station,
            "network": network,
            "start_time": self.start_time,
        }

    def require_length(self, index: int, length: float, step: float) -> None:
        """Reject a header with two channel numbers, or another length [s] than its samples."""
        first = _CHANNEL_IN_LINE.search(self.lines[0])
        named = CHANNEL.match(self.lines[self.volume.name])
        if first and named and first["number"] != named["number"]:
            message = f"channel {named['number']}, but channel {first['number']} in line "
            raise self.error(self.volume.name, f"{message}{self.first_line}.")
        match = _LENGTH.search(self.lines[index])
        token = match["length"] if match else ""
        if is_number(token) and abs(float(token) - length) > 2.0 * step + 0.001:
            message = f"record length {token} s stated, but {length:g} s of samples."
            settle(self.path, message, {"samples": None}, self.line(index))

    def require_counts(
        self, count: int, others: dict[str, int], items: Sequence[int], line: int, present: int
    ) -> None:
        """Reject a header that states different numbers of samples.

        The items of the integer header state them too; 0 and -999 mean not filled in. `present` is
        the number of samples in the file.
        """
        counts = {f"item {item} of the integer header": self.item(item) or 0 for item in items}
        for place, other in {**others, **counts}.items():
            if other != count and (place in others or other > 0):
                message = f"{count} samples stated, but {other} in {place}."
                settle(self.path, message, {"samples": present}, line)
        if count < 2:
            raise InputError(self.path, f"{count} samples stated. Must be 2 or more.", line)


def read_header(path: Path, lines: Sequence[bytes], top: int, volume: Volume) -> Header:
    """Return the header of a channel that begins at index `top` of the lines of a file.

    Raises
    ------
    InputError
        If it is too short or lacks an expected line.

    Examples
    --------
    >>> volume = Volume(1, 0, 1, 1, [(0, CHANNEL, CHANNEL_EXAMPLE)])
    >>> read_header(Path("CCC.V1"), [b"Chan  1: Up"], 0, volume).component
    'UP'
    """
    header = header_lines(path, lines, top, volume.lines, "a channel's header")
    matches: dict[int, re.Match[str]] = {}
    for index, pattern, example in volume.expected:
        match = pattern.match(header[index])
        if not match:
            shown = header[index].strip()[:60]
            message = (
                f"{shown!r}, where a line such as {example!r} is expected: line {index + 1} of a "
                "channel's header."
            )
            raise InputError(path, message, top + 1 + index)
        matches[index] = match
    return Header(path, header, top + 1, volume, matches)


def require_channels(path: Path, stated_in: str, count: int, line: int) -> None:
    """Reject a file that holds several but not all of the channels in its header.

    A single channel is accepted, because archives are often split into one file per channel.

    Raises
    ------
    InputError
        With both numbers.

    Examples
    --------
    >>> require_channels(Path("CCC.V1"), "s/n 2500  (3 Chns of  3 at Sta)", 2, 5)
    Traceback (most recent call last):
    rockframe.errors.InputError: CCC.V1:5: 3 channels in the header, 2 in the file. Expected...
    """
    match = CHANNELS.search(stated_in)
    if match and 1 != count != int(match["count"]):
        message = f"{match['count']} channels in the header, {count} in the file."
        raise InputError(path, f"{message} Expected all of them, or one channel per file.", line)
