"""Header of a CSMIP/CDMG channel: the parts that volumes 1 and 2 have in common."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.metadata.identify import direction
from rockframe.ingest.metadata.site import site_of_location, site_of_station
from rockframe.ingest.parsing.lines import is_number
from rockframe.ingest.parsing.peaks import Printed
from rockframe.ingest.parsing.timing import utc_time
from rockframe.record import SiteType

#: Line that names a channel, and an example of it for error messages.
CHANNEL: Final = re.compile(r"\s*Chan\s+(?P<number>\d+)\s*:\s*(?P<label>.*?)\s*$", re.I)
CHANNEL_EXAMPLE: Final = "Chan 1: 90 Deg"
#: Number of channels that the file should hold, in the line about the station.
CHANNELS: Final = re.compile(r"\(\s*(?P<count>\d{1,4})\s*Chns", re.I)
#: Item of the integer header with the year, counted from 1.
_YEAR: Final = 24
#: Header lines relative to the line that names the channel.
_START_LINE, _STATION_LINE = -3, -2

_LOCATION: Final = re.compile(r"\bLocation:\s*(?P<location>\S.*?)\s*$", re.I)
_DEGREES: Final = re.compile(r"(?P<azimuth>\d{1,3})\s*Deg\b", re.I)
_NETWORK: Final = re.compile(r"\s*\w+\.(?P<network>\w{1,2})\.(?P<station>\w{1,5})\.[\w-]*\.\w+\s")
_STATION: Final = re.compile(r"\s*Station (?:No\.|Id\.)\s*(?P<station>\w+)", re.I)
_START: Final = re.compile(
    r"Start time:\s*(\d\d?)/\s*(\d\d?)/(\d\d),\s*(\d\d?):\s*(\d\d?):\s*(\d\d?)(\.\d+)?\s*UTC", re.I
)
_NUMBER: Final = r"(\d{1,6}\.?\d{0,6}|\.\d{1,6})"
_BETWEEN: Final = re.compile(
    rf"bandpass filtered with 3 dB pts at\s+{_NUMBER}\s+and\s+{_NUMBER}\s+cyc/sec", re.I
)
_RAMPS: Final = re.compile(
    rf"bandpass filtered with ramps at\s+{_NUMBER}\s*-\s*{_NUMBER}\s+and\s+{_NUMBER}\s*-\s*"
    rf"{_NUMBER}\s+cyc/sec",
    re.I,
)


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
    name_index : int
        Index of the line that names the channel.
    integers_index, reals_index : int
        Indices of the first lines of integers (16I5) and reals (8F10).

    Examples
    --------
    >>> lines = ["Start time:  7/06/19, 03:19:40.04 UTC", "Station Id. CCC", "", "Chan 1: Up"]
    >>> header = Header(Path("CCC.V1"), lines, 1, 3, 4, 4)
    >>> header.component, header.station, header.start_time
    ('UP', 'CCC', '')
    """

    path: Path
    lines: Sequence[str]
    first_line: int
    name_index: int
    integers_index: int
    reals_index: int

    def line(self, index: int) -> int:
        """Return the line number in the file of a header line."""
        return self.first_line + index

    @property
    def component(self) -> str:
        """Three-digit azimuth, or the name of the channel."""
        named = CHANNEL.match(self.lines[self.name_index])
        if not named:
            return ""
        degrees = _DEGREES.match(named["label"])
        if degrees:
            return f"{int(degrees['azimuth']):03d}"
        # Channels of structures state their location after two or more blanks.
        name = re.split(r"\s{2,}", named["label"])[0]
        return name.upper() if direction(name)[0].upright else name

    @property
    def network(self) -> str:
        """Network code, if the channel has a SEED name."""
        named = _NETWORK.match(self.lines[self.name_index + _START_LINE])
        return named["network"] if named else ""

    @property
    def station(self) -> str:
        """Station code or number."""
        stated = _NETWORK.match(self.lines[self.name_index + _START_LINE]) or _STATION.match(
            self.lines[self.name_index + _STATION_LINE]
        )
        return stated["station"] if stated else ""

    @property
    def site_type(self) -> SiteType:
        """Site type from the location of the channel, otherwise from the station name."""
        place = _LOCATION.search(self.lines[self.name_index])
        site = site_of_location(place["location"]) if place else SiteType.UNKNOWN
        name = self.lines[self.name_index - 1]
        return site_of_station(name) if site is SiteType.UNKNOWN else site

    @property
    def start_time(self) -> str:
        """Start time (ISO 8601, UTC); empty unless stated in UTC and the year is known."""
        stated = _START.search(self.lines[self.name_index + _START_LINE])
        year = self.item(_YEAR)
        if not stated or year is None or year % 100 != int(stated[3]):
            return ""
        month, day, hour, minute = (int(stated[group]) for group in (1, 2, 4, 5))
        return utc_time((year, month, day), hour, minute, f"{int(stated[6]):02d}{stated[7] or ''}")

    def item(self, item: int) -> int | None:
        """Return an item of the integer header; None if it is not filled in."""
        row, column = divmod(item - 1, 16)
        lines = self.lines[self.integers_index + row : self.integers_index + row + 1]
        field = lines[0][5 * column : 5 * column + 5] if lines else ""
        return int(field) if re.fullmatch(r" *-?\d+", field) else None

    def real(self, item: int) -> Printed | None:
        """Return an item of the real header as printed; None if it is not filled in."""
        row, column = divmod(item - 1, 8)
        lines = self.lines[self.reals_index + row : self.reals_index + row + 1]
        field = lines[0][10 * column : 10 * column + 10].strip() if lines else ""
        if not is_number(field.encode("latin-1", "replace")) or float(field) in (0.0, -999.0):
            return None
        return Printed.of(field)

    def require_counts(self, count: int, others: dict[str, int], line: int) -> None:
        """Reject a header that states different numbers of samples.

        Raises
        ------
        InputError
            With both numbers.
        """
        for place, other in others.items():
            if other != count:
                raise InputError(
                    self.path,
                    f"{count} samples stated, but {other} in {place}. Must be equal.",
                    line=line,
                )
        if count < 2:
            raise InputError(self.path, f"{count} samples stated. Must be 2 or more.", line=line)

    def stated_counts(self, items: Sequence[int]) -> dict[str, int]:
        """Return the numbers of samples in the integer header; 0 and -999 mean not filled in."""
        return {
            f"item {item} of the integer header": value
            for item in items
            if (value := self.item(item)) is not None and value > 0
        }


def require_channels(path: Path, stated_in: str, found: int, line: int) -> None:
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
    rockframe.errors.InputError: CCC.V1:5: 3 channels in the header, 2 in the file. Must be ...
    """
    stated = CHANNELS.search(stated_in)
    if stated and 1 != found != int(stated["count"]):
        raise InputError(
            path,
            f"{stated['count']} channels in the header, {found} in the file. "
            "Must be equal, or one channel a file.",
            line=line,
        )


def require_header(
    path: Path,
    header: Sequence[str],
    line: int,
    count: int,
    expected: Sequence[tuple[int, re.Pattern[str], str]],
) -> None:
    """Reject a channel header that is too short or lacks an expected line.

    Parameters
    ----------
    header : sequence of str
        Header lines that are present.
    line : int
        Line number of the first one.
    count : int
        Number of lines of a complete header.
    expected : sequence of tuple
        Index of a line, the pattern that its beginning must match, and an example.

    Raises
    ------
    InputError
        With the line number and the example.

    Examples
    --------
    >>> require_header(Path("CCC.V1"), ["Chan  1: Up"], 7, 1, [(0, CHANNEL, CHANNEL_EXAMPLE)])
    """
    if len(header) < count:
        raise InputError(
            path,
            f"the file ends after {len(header)} lines of a channel's header. "
            f"Must be {count} lines.",
            line=line + len(header) - 1,
        )
    for index, pattern, example in expected:
        if not pattern.match(header[index]):
            raise InputError(
                path,
                f"{header[index].strip()[:60]!r}. Must be as in {example!r}: "
                f"line {index + 1} of a channel's header.",
                line=line + index,
            )


def filter_corners(filters: str) -> tuple[float, float]:
    """Return the corners [Hz] of the archive's band-pass (inner ends of ramps); NaN if unstated.

    Examples
    --------
    >>> filter_corners("bandpass filtered with ramps at .050-.100 and 23.00-25.00 cyc/sec")
    (0.1, 23.0)
    """
    between, ramps = _BETWEEN.search(filters), _RAMPS.search(filters)
    stated = between.groups() if between else ramps.groups()[1:3] if ramps else ("0", "0")
    low, high = (float(token) or math.nan for token in stated)
    return low, high


def stated_processing(filters: str, corrections: str) -> tuple[str, ...]:
    """Return the processing steps that the header of a corrected channel states.

    Examples
    --------
    >>> stated_processing("bandpass filtered with 3 dB pts at .30 and 40.00 cyc/sec", "")
    ('archive: band-pass 0.3 to 40 Hz (3 dB)',)
    """
    done = []
    if re.search("instrument- and baseline-corrected", corrections, re.I):
        done.append("archive: instrument and baseline corrected")
    between, ramps = _BETWEEN.search(filters), _RAMPS.search(filters)
    if between:
        low, high = map(float, between.groups())
        done.append(f"archive: band-pass {low:g} to {high:g} Hz (3 dB)")
    if ramps:
        corners = [float(token) for token in ramps.groups()]
        done.append("archive: band-pass, ramps {:g} to {:g} and {:g} to {:g} Hz".format(*corners))
    return tuple(done)
