"""Distances from the coordinates of an event and a station."""

from __future__ import annotations

import math
import re
from typing import Any, Final

#: Mean radius of the earth [km].
_RADIUS: Final = 6371.0


#: `39.939N 77.339E`, `38.474 N 47.059 E`, `18.567 LAT. N 101.977 LONG. W`.
_PLACE: Final = re.compile(
    r"(\d+\.\d*)\s*(?:LAT\.\s*)?([NS]),?\s*(\d+\.\d*)\s*(?:LONG\.\s*)?([EW])", re.I
)


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
