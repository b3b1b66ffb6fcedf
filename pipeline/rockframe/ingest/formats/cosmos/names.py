"""Parse station, component, event, start time and filters from the text of a COSMOS channel."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rockframe.ingest.metadata.identify import direction
from rockframe.ingest.parsing.timing import utc_time

_STATION: Final = re.compile(r"\bCode:\s*(?P<network>\w{1,2})-(?P<station>\w+)")
_SEED: Final = re.compile(r"<SCNL>\s*(?P<station>\w+)\.(?P<channel>\w+)\.(?P<network>\w+)\.")
_COMPONENT: Final = re.compile(r"\s*Sta Chan\s+[^:]*:\s*(?P<label>.*?)\s*(?:\(|$)")
_DEGREES: Final = re.compile(r"(?P<azimuth>\d{1,3})\s*Deg\b", re.I)
_EVENT: Final = re.compile(
    r"\s*Record of\s+(?P<event>\S.*?)\s+of\s+(?:Sun|Mon|Tue|Wed|Thu|Fri|Sat)"
)
_START: Final = re.compile(
    r"Rcrd start time:\s*(\d{4})/(\d\d)/(\d\d)[, ]+(\d\d):(\d\d):(\d\d(?:\.\d+)?)\s*UTC", re.I
)
_FILTER: Final = re.compile(
    r"filtered below\s+(?P<low>\d+\.?\d*|\.\d+)\s*Hz.*?above\s+(?P<high>\d+\.?\d*|\.\d+)\s*Hz", re.I
)


@dataclass(frozen=True)
class Name:
    """Network, station and channel codes; empty if unstated.

    Examples
    --------
    >>> Name("AK", "BMR").channel
    ''
    """

    network: str = ""
    station: str = ""
    channel: str = ""


def station_of(line: str) -> Name | None:
    """Return the codes in the station line, or None.

    Examples
    --------
    >>> station_of("Statn No: 37-000011 Code:AK-BMR     UAF  Bremner River, AK, USA")
    Name(network='AK', station='BMR', channel='')
    """
    named = _STATION.search(line)
    return Name(named["network"], named["station"]) if named else None


def seed_name(comments: Sequence[str]) -> Name:
    """Return the SEED codes stated in a comment.

    Examples
    --------
    >>> seed_name(["<SCNL>BMR.BNZ.AK.--    <AUTH> 2019/02/01 21:38:15.000"])
    Name(network='AK', station='BMR', channel='BNZ')
    """
    for comment in comments:
        named = _SEED.search(comment)
        if named:
            return Name(named["network"], named["station"], named["channel"])
    return Name()


def component_of(line: str, seed: Name) -> str:
    """Return the component: three-digit azimuth, name of the vertical, SEED channel, or raw label.

    Examples
    --------
    >>> component_of("Sta Chan   ?: 90 Deg (Rcrdr Chan  ?) Location:Ground", Name())
    '090'
    >>> component_of("Sta Chan   ?:Other   (Rcrdr Chan  ?) Location:", Name("AK", "BMR", "BNZ"))
    'BNZ'
    """
    named = _COMPONENT.match(line)
    label = named["label"] if named else ""
    degrees = _DEGREES.search(label)
    if degrees:
        return f"{int(degrees['azimuth']):03d}"
    if direction(label)[0].upright:
        return label.upper()
    return seed.channel or label


def event_of(line: str) -> str:
    """Return the event named in the second line.

    Examples
    --------
    >>> event_of("Record of Point MacKenzie Earthquake of Fri Nov 30, 2018 17:29 UTC")
    'Point MacKenzie Earthquake'
    """
    named = _EVENT.match(line)
    return named["event"] if named else ""


def start_time_of(line: str) -> str:
    """Return the start time (ISO 8601, UTC), or an empty string unless it is stated in UTC.

    Examples
    --------
    >>> start_time_of("Rcrd start time: 2018/11/30 17:29:39.137 UTC (Q=5) RcrdId: (see comment)")
    '2018-11-30T17:29:39.137Z'
    """
    stated = _START.search(line)
    if not stated:
        return ""
    year, month, day, hour, minute = (int(stated[group]) for group in range(1, 6))
    return utc_time((year, month, day), hour, minute, stated[6])


def corners_of(lines: Sequence[str]) -> tuple[float, float]:
    """Return the corners of the archive's filter [Hz]; NaN if unstated.

    Examples
    --------
    >>> corners_of(["Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz"])
    (0.03, 20.0)
    """
    for line in lines:
        stated = _FILTER.search(line)
        if stated:
            return float(stated["low"]) or math.nan, float(stated["high"]) or math.nan
    return math.nan, math.nan


def filters_of(lines: Sequence[str]) -> tuple[str, ...]:
    """Return the note for `processing` about the archive's filter, if one is stated.

    Examples
    --------
    >>> filters_of(["Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz"])
    ('archive: band-pass 0.03 to 20 Hz',)
    """
    low, high = corners_of(lines)
    return () if math.isnan(low) else (f"archive: band-pass {low:g} to {high:g} Hz",)
