"""Sites and measures in files of hazard: which row of a table, and which quantity."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.cells import decimal
from rockframe.errors import InputError
from rockframe.risk.measures import MEASURES, Measure, spectral

Lines = list[tuple[int, list[str]]]

#: Names of measures in OpenQuake files, and in names of folders and files of the USGS.
_IMT: Final = re.compile(r"PGA|PGV|SA\((\d*\.?\d+)\)|SA(\d+)P(\d+)")
_NAMED: Final = re.compile(r"(?<![A-Za-z0-9])(?:PGA|PGV|SA\d+P\d+)(?![A-Za-z0-9])")
#: Velocities in files of OpenQuake and the USGS are in cm/s.
VELOCITY: Final = 0.01
#: Largest distance of a site from the requested place, and the earth's radius [km].
NEAR, _EARTH = 10.0, 6371.0
#: Columns that name the sites of OpenQuake and of the USGS.
_NAMES: Final = ("custom_site_id", "site_id", "name")
#: Number of characters of an invalid row that messages show.
_SHOWN: Final = 80


@dataclass(frozen=True)
class Site:
    """The requested site of a file of several: a place, or the name that the file gives it.

    Parameters
    ----------
    place : (float, float), optional
        Longitude and latitude [degree]; the nearest site is taken.
    name : str
        Name of the site; replaces the place.
    within : float
        Largest distance of the site from the place [km].

    Examples
    --------
    >>> Site((23.73, 37.98)).within
    10.0
    """

    place: tuple[float, float] | None = None
    name: str = ""
    within: float = NEAR


def nearest_site(
    path: Path, lines: Lines, header: Sequence[str], site: Site
) -> tuple[tuple[int, list[str]], str]:
    """Return the row of the requested site, or of the only one, and the site in words.

    Parameters
    ----------
    path : Path
        The file, for messages.
    lines : list of (int, list of str)
        Line numbers and cells, of the heading first.
    header : sequence of str
        Names of the columns, with ``lon`` and ``lat``.
    site : Site
        The requested site.

    Raises
    ------
    InputError
        If no site is near, none has the name, or several are there and none is requested.
    """
    if site.name:
        return _called(path, lines, header, site.name), f"site {site.name}"
    places = []
    for line, row in lines[1:]:
        try:
            places.append((decimal(row[header.index("lon")]), decimal(row[header.index("lat")])))
        except (ValueError, IndexError):
            shown = ", ".join(row)[:_SHOWN]
            raise InputError(
                path, f"row {shown!r} without longitude and latitude [degree].", line=line
            ) from None
    if site.place is None:
        if len(places) != 1:
            message = f"has {len(places)} sites. Choose one with --hazard-site LON LAT"
            raise InputError(path, f"{message} or --hazard-site-id ID.")
        return lines[1], f"the only site, at {places[0][0]:g} {places[0][1]:g}"
    away = [_distance(site.place, place) for place in places] or [math.inf]
    best = int(np.argmin(away))
    there = f"at {places[best][0]:g} {places[best][1]:g}" if places else ""
    if away[best] > site.within:
        nearest = f"the site nearest to {site.place[0]:g} {site.place[1]:g} is {away[best]:.3g} km"
        message = f"{nearest} away{there and ', '}{there}. Must be within {site.within:g} km."
        raise InputError(path, message)
    words = f"the nearest site, {there}, {away[best]:.2f} km from the requested place"
    return lines[1 + best], words


def _called(path: Path, lines: Lines, header: Sequence[str], name: str) -> tuple[int, list[str]]:
    """Return the row of the site with this name."""
    columns = [header.index(column) for column in _NAMES if column in header]
    if not columns:
        message = f"names no sites (no column {' or '.join(_NAMES)}). Choose one with"
        raise InputError(path, f"{message} --hazard-site LON LAT.")
    named = [row[columns[0]].strip() if columns[0] < len(row) else "" for _, row in lines[1:]]
    if named.count(name) != 1:
        allowed = ", ".join(named)[:_SHOWN]
        raise InputError(path, f"{named.count(name)} sites {name!r}. Must be one of: {allowed}.")
    return lines[1 + named.index(name)]


def _distance(place: tuple[float, float], other: tuple[float, float]) -> float:
    """Return the distance between two places [km], by the haversine formula."""
    (x, y), (u, v) = ((math.radians(lon), math.radians(lat)) for lon, lat in (place, other))
    share = math.sin(0.5 * (v - y)) ** 2
    share += math.cos(y) * math.cos(v) * math.sin(0.5 * (u - x)) ** 2
    return 2.0 * _EARTH * math.asin(min(1.0, math.sqrt(share)))


def measure_of_imt(path: Path, imt: str, line: int | None = None) -> Measure:
    """Return the measure with this name in files of OpenQuake and the USGS.

    Raises
    ------
    InputError
        If the name is another one.

    Examples
    --------
    >>> measure_of_imt(Path("a.csv"), "SA(0.2)").name, measure_of_imt(Path("a.csv"), "SA0P2").name
    ('sa_0.2s', 'sa_0.2s')
    """
    match = _IMT.fullmatch(imt)
    if match is None:
        raise InputError(path, f"is of imt {imt!r}. Must be PGA, PGV or SA(T).", line)
    period = match[1] or (f"{match[2]}.{match[3]}" if match[2] else "")
    if not period:
        return MEASURES[imt.lower()]
    if not float(period) > 0.0:
        raise InputError(path, f"is of {imt}. The period must be above 0 s.", line)
    return spectral(float(period))


def measure_named_by(path: Path) -> Measure:
    """Return the measure that is part of the name of the file or of its folder.

    Raises
    ------
    InputError
        If neither name has one.

    Examples
    --------
    >>> measure_named_by(Path("curves_SA1P0.csv")).name
    'sa_1s'
    """
    for name in (path.stem, path.absolute().parent.name):
        match = _NAMED.search(name.replace("_", "-"))
        if match:
            return measure_of_imt(path, match[0])
    raise InputError(
        path,
        "does not state its measure. The name of the file or of its folder must contain PGA, PGV "
        "or SA1P0 (1.0 s).",
    )
