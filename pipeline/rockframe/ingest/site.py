"""Site type of a sensor, and distances, from texts, codes and coordinates in headers."""

from __future__ import annotations

import math
import re
from typing import Any, Final

from rockframe.record import SiteType

#: Depth from which a sensor is in a borehole, not in a shallow vault [m].
_DEEP: Final = 3.0
#: Mean radius of the earth [km].
_RADIUS: Final = 6371.0
#: `39.939N 77.339E`, `38.474 N 47.059 E`, `18.567 LAT. N 101.977 LONG. W`.
_PLACE: Final = re.compile(
    r"(\d+\.\d*)\s*(?:LAT\.\s*)?([NS]),?\s*(\d+\.\d*)\s*(?:LONG\.\s*)?([EW])", re.I
)

_FREE_FIELD: Final = re.compile(r"\bfree[- ]?field\b|\bFF\b", re.I)
_BOREHOLE: Final = re.compile(r"\b(bore|down) ?hole\b", re.I)
_STORY: Final = r"\b\d+(st|nd|rd|th)\s+(fl(oo)?r?|level|stor(e?y|ies))\b"
#: Words that mean a part of a structure, even in the name of a station.
_STRUCTURE: Final = re.compile(rf"{_STORY}|\b(floor|roof|penthouse|basement|deck)\b", re.I)
#: Words that mean a part of a structure only in the location of a sensor. In the name of a station,
#: "Pier" or "Crest" may be a street, and "Dam" a nearby landmark.
_PART: Final = re.compile(
    r"\b(abut(ment)?|base of|bent|building|bldg|cable|column|crest|footing|foundation|gallery|"
    r"girder|level|mezzanine|mid-?span|pier|pile|span|story|tower|wall)\b",
    re.I,
)
_GROUND: Final = re.compile(r"\s*ground\s*", re.I)

#: Station types of the COSMOS format (table 6). Free field: shelters, sensors set in the ground,
#: reference stations, free field, small vaults. Structure: base of a building, building, bridge,
#: dam, wharf, tunnel, other structures. Large vaults, the sea floor and arrays are ambiguous.
_COSMOS_TYPES: Final = dict.fromkeys((1, 2, 3, 4, 6, 8), SiteType.FREE_FIELD) | dict.fromkeys(
    (5, 10, 11, 12, 13, 14, 15, 20), SiteType.STRUCTURE
)


def site_of_station(name: str) -> SiteType:
    """Return the site type according to the name of a station.

    Examples
    --------
    >>> site_of_station("CA:Alhambra;LACPW, 12th Fl").name
    'STRUCTURE'
    >>> site_of_station("Pacoima Dam (upper left abut)").name
    'UNKNOWN'
    """
    # A name such as "Roof and free field" lists several locations, so it is ambiguous.
    stated = [
        site
        for pattern, site in (
            (_FREE_FIELD, SiteType.FREE_FIELD),
            (_BOREHOLE, SiteType.BOREHOLE),
            (_STRUCTURE, SiteType.STRUCTURE),
        )
        if pattern.search(name)
    ]
    return stated[0] if len(stated) == 1 else SiteType.UNKNOWN


def site_of_location(location: str) -> SiteType:
    """Return the site type according to the location of a sensor.

    Examples
    --------
    >>> site_of_location("Abutment 1").name, site_of_location("Ground").name
    ('STRUCTURE', 'FREE_FIELD')
    >>> site_of_location("Ground Floor").name, site_of_location("North side").name
    ('STRUCTURE', 'UNKNOWN')
    """
    site = site_of_station(location)
    if site is SiteType.UNKNOWN and _GROUND.fullmatch(location):
        return SiteType.FREE_FIELD
    if site is SiteType.UNKNOWN and _PART.search(location):
        return SiteType.STRUCTURE
    return site


def site_of_smc(
    station: str, structure: int | None, bridge: int | None, dam: int | None
) -> SiteType:
    """Return the site type according to the header of an SMC file.

    Parameters
    ----------
    station : str
        Station name.
    structure, bridge, dam : int or None
        Codes of the kind of structure and of the position on a bridge or dam, where 0 means free
        field; None if undefined.

    Examples
    --------
    >>> site_of_smc("", 2, 0, None).name, site_of_smc("", 2, 3, None).name
    ('FREE_FIELD', 'STRUCTURE')
    """
    if 0 in (bridge, dam):
        return SiteType.FREE_FIELD
    if any(code is not None and code > 0 for code in (structure, bridge, dam)):
        return SiteType.STRUCTURE
    return site_of_station(station)


def site_of_cosmos(location: str, station: str, code: int | None) -> SiteType:
    """Return the site type according to the header of a COSMOS channel.

    Parameters
    ----------
    location, station : str
        Location of the channel, and the line that names the station.
    code : int or None
        Station type; it is used last, because a station may also have channels in the free field.

    Examples
    --------
    >>> site_of_cosmos("", "", 11).name, site_of_cosmos("Free Field", "", 11).name
    ('STRUCTURE', 'FREE_FIELD')
    """
    for site in (site_of_location(location), site_of_station(station)):
        if site is not SiteType.UNKNOWN:
            return site
    return _COSMOS_TYPES.get(code or 0, SiteType.UNKNOWN)


def site_of_depth(metres: float) -> SiteType:
    """Return the site type according to the depth below the surface [m]; NaN if unknown.

    Examples
    --------
    >>> site_of_depth(100.0).name, site_of_depth(0.0).name
    ('BOREHOLE', 'UNKNOWN')
    """
    return SiteType.BOREHOLE if metres >= _DEEP else SiteType.UNKNOWN


def place_in(text: str) -> tuple[float, float]:
    """Return the first latitude and longitude in a text [degree]; (0, 0) if there are none.

    Examples
    --------
    >>> place_in("STATION NO. 14403   33.929N, 118.260W"), place_in("STATION")
    ((33.929, -118.26), (0.0, 0.0))
    """
    found = _PLACE.search(text)
    if not found:
        return 0.0, 0.0
    north, east = float(found[1]), float(found[3])
    return north * (-1 if found[2] in "sS" else 1), east * (-1 if found[4] in "wW" else 1)


def distances(
    event: tuple[float, float], station: tuple[float, float], depth: float = math.nan
) -> dict[str, Any]:
    """Return epicentral and hypocentral distance [km] as fields of a record.

    The earth is taken as a sphere, which causes errors of at most 0.5 %.

    Parameters
    ----------
    event, station : (float, float)
        Latitude and longitude [degree]; (0, 0) and impossible values are unknown.
    depth : float
        Depth of the hypocentre [km].

    Examples
    --------
    >>> distances((0.0, 1.0), (0.0, 2.0), 10.0)
    {'epicentral_distance': 111.2, 'distance_hypocentral': 111.6}
    """
    known = all(
        abs(north) <= 90.0 and abs(east) <= 360.0 and (north, east) != (0.0, 0.0)
        for north, east in (event, station)
    )
    if not known:
        return {}
    (north, east), (other_north, other_east) = (
        map(math.radians, place) for place in (event, station)
    )
    half = math.sin((north - other_north) / 2.0) ** 2
    half += math.cos(north) * math.cos(other_north) * math.sin((east - other_east) / 2.0) ** 2
    epicentral = 2.0 * _RADIUS * math.asin(min(1.0, math.sqrt(half)))
    found = {"epicentral_distance": round(epicentral, 1)}
    if depth >= 0.0:
        found["distance_hypocentral"] = round(math.hypot(epicentral, depth), 1)
    return found
