"""What the headers of CSMIP/CDMG volumes 1 and 2 have in common."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.identify import direction
from rockframe.ingest.lines import is_number
from rockframe.ingest.peaks import Printed
from rockframe.ingest.site import site_of_location, site_of_station
from rockframe.ingest.timing import utc_time
from rockframe.record import SiteType

#: The line that names a channel, and an example of it for errors.
CHANNEL: Final = re.compile(r"\s*Chan\s+(?P<number>\d+)\s*:\s*(?P<label>.*?)\s*$", re.I)
CHANNEL_EXAMPLE: Final = "Chan 1: 90 Deg"
#: How a line of channels at the station says how many the file should hold.
CHANNELS: Final = re.compile(r"\(\s*(?P<count>\d{1,4})\s*Chns", re.I)
#: Item of the integer header that states the year, counted from 1.
_YEAR: Final = 24
#: Lines of a channel's header, counted from the line of its name.
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
    """The header of one channel.

    Parameters
    ----------
    path : Path
        The file, for errors.
    lines : sequence of str
        The lines of the header.
    first_line : int
        Number in the file of the first.
    name_index : int
        Index of the line that names the channel.
    integers_index, reals_index : int
        Index of the first line of integers (16I5), and of reals (8F10).

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
        """Number in the file of a line of the header."""
        return self.first_line + index

    @property
    def component(self) -> str:
        """Azimuth of three digits, or the channel's name."""
        named = CHANNEL.match(self.lines[self.name_index])
        if not named:
            return ""
        degrees = _DEGREES.match(named["label"])
        if degrees:
            return f"{int(degrees['azimuth']):03d}"
        # A structure's channels say after wide blanks where they are.
        name = re.split(r"\s{2,}", named["label"])[0]
        return name.upper() if direction(name)[0].upright else name

    @property
    def network(self) -> str:
        """Code of the network, if the channel is named as in SEED."""
        named = _NETWORK.match(self.lines[self.name_index + _START_LINE])
        return named["network"] if named else ""

    @property
    def station(self) -> str:
        """Code or number of the station."""
        stated = _NETWORK.match(self.lines[self.name_index + _START_LINE]) or _STATION.match(
            self.lines[self.name_index + _STATION_LINE]
        )
        return stated["station"] if stated else ""

    @property
    def site_type(self) -> SiteType:
        """Where the sensor stood, by the place of the channel, else by the name of the station."""
        place = _LOCATION.search(self.lines[self.name_index])
        site = site_of_location(place["location"]) if place else SiteType.UNKNOWN
        name = self.lines[self.name_index - 1]
        return site_of_station(name) if site is SiteType.UNKNOWN else site

    @property
    def start_time(self) -> str:
        """Time of the first sample, ISO 8601 UTC; empty unless in UTC with a certain year."""
        stated = _START.search(self.lines[self.name_index + _START_LINE])
        year = self.item(_YEAR)
        if not stated or year is None or year % 100 != int(stated[3]):
            return ""
        month, day, hour, minute = (int(stated[group]) for group in (1, 2, 4, 5))
        return utc_time((year, month, day), hour, minute, f"{int(stated[6]):02d}{stated[7] or ''}")

    def item(self, item: int) -> int | None:
        """One item of the integer header, counted from 1; None if it is not filled in as one."""
        row, column = divmod(item - 1, 16)
        lines = self.lines[self.integers_index + row : self.integers_index + row + 1]
        field = lines[0][5 * column : 5 * column + 5] if lines else ""
        return int(field) if re.fullmatch(r" *-?\d+", field) else None

    def real(self, item: int) -> Printed | None:
        """One item of the real header as printed, counted from 1; None if it is not filled in."""
        row, column = divmod(item - 1, 8)
        lines = self.lines[self.reals_index + row : self.reals_index + row + 1]
        field = lines[0][10 * column : 10 * column + 10].strip() if lines else ""
        if not is_number(field.encode("latin-1", "replace")) or float(field) in (0.0, -999.0):
            return None
        return Printed.of(field)

    def require_counts(self, count: int, others: dict[str, int], line: int) -> None:
        """Refuse a header whose statements of the number of samples disagree.

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
        """Numbers of samples in the integer header; items not filled in are 0 or -999."""
        return {
            f"item {item} of the integer header": value
            for item in items
            if (value := self.item(item)) is not None and value > 0
        }


def require_channels(path: Path, stated_in: str, found: int, line: int) -> None:
    """Refuse a file that holds some, but not all, of the channels that its header states.

    One channel alone is a file cut up by its owner; some of several are a file cut short.

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
    """Refuse a channel's header that is cut short or lacks a line.

    Parameters
    ----------
    path : Path
        The file.
    header : sequence of str
        Lines of the header that there are.
    line : int
        Number in the file of the first.
    count : int
        Lines that a header has.
    expected : sequence of tuple
        Index of a line, the pattern that it must match from its beginning, and an example.

    Raises
    ------
    InputError
        With the line and the example.

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
    """Return the corners [Hz] of the archive's band-pass; of ramps the inner ends. NaN if unstated.

    Parameters
    ----------
    filters : str
        The line of the band-pass.

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
    """Return what the header of a corrected channel states of the archive's processing.

    Parameters
    ----------
    filters, corrections : str
        The line of the band-pass, and that of the corrected data.

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
