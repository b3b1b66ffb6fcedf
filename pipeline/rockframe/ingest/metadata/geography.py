"""Distances from the coordinates of an event and a station."""

from __future__ import annotations

import math
from typing import Final

#: Mean radius of the earth [km].
_RADIUS: Final = 6371.0


def distances(
    event: tuple[float, float], station: tuple[float, float], depth: float = math.nan
) -> dict[str, float]:
    """Return epicentral and hypocentral distance [km] as fields of a record.

    The earth is a sphere here, which makes errors of at most 0.5 %.

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
