"""Identifiers of records, directions of components, site types of sensors, and distances."""

from __future__ import annotations

import math
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import dropwhile, takewhile
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, collecting_settled
from rockframe.record import LONGEST_ID, Orientation, Record, SiteType, is_record_id

_VERTICAL: Final = frozenset(["UP", "V", "VER", "VRT", "VERT", "VERTICAL", "Z", "UD"])
_DOWNWARD: Final = frozenset(["DOWN", "DWN", "DN"])
_COMPASS: Final = {
    **dict.fromkeys(["N", "NS", "NORTH"], 0.0),
    **dict.fromkeys(["E", "EW", "EAST"], 90.0),
    **dict.fromkeys(["S", "SOUTH"], 180.0),
    **dict.fromkeys(["W", "WEST"], 270.0),
}
_BEARING: Final = re.compile(r"([NS])(\d{1,2})([EW])")


def record_ids(path: Path, components: Sequence[str]) -> list[str]:
    """Return an identifier for each channel of a file.

    Parameters
    ----------
    path : Path
        The file. Its name without the suffix is the stem. Characters other than letters and digits
        of any script, points, hyphens and underscores become underscores. The stem is shortened so
        that the identifier has at most 64 characters.
    components : sequence of str
        Name of each channel. The identifier of a single channel is the stem; channels with equal
        names are numbered.

    Examples
    --------
    >>> record_ids(Path("Ridgecrest2019-CCC.V1"), ["090", "360", "UP"])
    ['Ridgecrest2019-CCC-090', 'Ridgecrest2019-CCC-360', 'Ridgecrest2019-CCC-UP']
    >>> record_ids(Path("El Centro (NS).AT2"), ["NS"])
    ['El_Centro__NS_']
    >>> record_ids(Path("Αθήνα 1.csv"), [""])
    ['Αθήνα_1']
    """
    stem = _stem(path.name)
    if len(components) == 1:
        return [_join(stem)]
    names = [_safe(component) for component in components]
    counts = Counter(name.upper() for name in names)
    ends = [
        f"-{name}"
        if name and counts[name.upper()] == 1
        else f"{'-' if name else ''}{name}-{number}"
        for number, name in enumerate(names, 1)
    ]
    return [_join(stem, end) for end in ends]


def other_ids(ids: Sequence[str], name: str) -> Iterator[list[str]]:
    """Yield alternative identifiers for the channels of a file, for when the first ones are in use.

    Parameters
    ----------
    ids : sequence of str
        Identifiers from `record_ids`.
    name : str
        Path of the file relative to the requested folder, or ``archive:member``.

    Yields
    ------
    list of str
        Identifiers with the whole file name instead of the stem, then with the folder before the
        stem, then with the folder before the whole name. An archive counts as a folder.

    Examples
    --------
    >>> list(other_ids(["CE89146-360"], "coalinga/CE89146.V2"))
    [['CE89146.V2-360'], ['coalinga-CE89146-360'], ['coalinga-CE89146.V2-360']]
    """
    folder, _, file = name.replace(":", "/").rpartition("/")
    stem = _stem(file)
    ends = [identifier[_common_length(stem, identifier) :] for identifier in ids]
    deeper = f"{folder.replace('/', '-')}-" if folder else ""
    stems = [_safe(file), *([f"{deeper}{stem}", f"{deeper}{file}"] if deeper else [])]
    for other in map(_without_leading_marks, stems):
        yield [_join(other, end) for end in ends]


def distinct_records(
    path: Path,
    components: Sequence[str],
    channels: Iterable[tuple[Any, ...]],
    read: Callable[..., Record],
) -> list[Record]:
    """Return the records of the channels of a file.

    Parameters
    ----------
    components : sequence of str
        Name of each channel, for `record_ids`.
    channels : iterable of tuple
        Arguments of `read` for each channel, after its identifier.
    read : callable
        Returns the record of a channel.

    Raises
    ------
    InputError
        If two records have the same component and samples.

    Examples
    --------
    >>> def read(name, samples):
    ...     return Record(record_id=name, acceleration=samples, time_step=0.1, component="UP")
    >>> distinct_records(Path("a.V2"), ["UP", "UP"], [([0.0, 1.0],)] * 2, read)
    Traceback (most recent call last):
    rockframe.errors.InputError: a.V2: channel 'UP' occurs twice.
    """
    ids = record_ids(path, components)
    records = [
        noted(partial(read, name, *channel)) for name, channel in zip(ids, channels, strict=True)
    ]
    seen = set()
    for record in records:
        channel = record.component, record.acceleration.tobytes()
        if channel in seen:
            raise InputError(path, f"channel {record.component!r} occurs twice.")
        seen.add(channel)
    return records


def noted(read: Callable[[], Record]) -> Record:
    """Return a record with the contradictions that the user settled while it was read.

    Examples
    --------
    >>> noted(lambda: Record(record_id="a", acceleration=[0.0, 1.0], time_step=0.1)).trusted
    ()
    """
    with collecting_settled() as settled:
        record = read()
    return with_trusted(record, settled)


def with_trusted(record: Record, settled: Iterable[str]) -> Record:
    """Return a record with further settled contradictions, each of them once."""
    every = tuple(dict.fromkeys((*record.trusted, *settled)))
    return record if every == record.trusted else replace(record, trusted=every)


def with_ending(path: Path, endings: Sequence[str]) -> Path:
    """Return a path whose stem is the file name without the usual extensions of the format.

    Other text after the last point may be a component or a day. Removing it would give several
    files the same identifier.

    Parameters
    ----------
    endings : sequence of str
        Extensions of the format, in lower case, with the point.

    Examples
    --------
    >>> with_ending(Path("AOM0170806140843.EW"), [".knet"]).stem
    'AOM0170806140843.EW'
    >>> with_ending(Path("CLC.HNE.sac"), [".sac"]).stem
    'CLC.HNE'
    """
    return path if path.suffix.lower() in endings else path.with_name(f"{path.name}{endings[0]}")


def seed_letter(code: str) -> str:
    """Return the direction in a SEED channel code such as ``HNE``: its third letter, if Z, N or E.

    Examples
    --------
    >>> seed_letter("HNE"), seed_letter("HN1")
    ('E', '')
    """
    return code[2] if len(code) == 3 and code[2] in "ZNE" else ""


def direction(component: str) -> tuple[Orientation, float]:
    """Return the direction that the name of a component states, without guessing.

    Parameters
    ----------
    component : str
        An azimuth [degree], a compass name (``N``, ``EW``, ``S74E``), or a name of the vertical.

    Returns
    -------
    orientation : Orientation
    azimuth : float
        Clockwise from north [degree]; NaN if vertical or unstated.

    Examples
    --------
    >>> direction("164"), direction("EW")
    ((<Orientation.HORIZONTAL: 0>, 164.0), (<Orientation.HORIZONTAL: 0>, 90.0))
    >>> direction("DWN"), direction("L")
    ((<Orientation.DOWNWARD: 3>, nan), (<Orientation.UNSTATED: 2>, nan))
    """
    name = component.strip().upper()
    if re.fullmatch(r"\d{1,3}", name, re.ASCII) and int(name) <= 360:
        return Orientation.HORIZONTAL, float(name)
    name = name.replace("-", "")
    if name in _VERTICAL:
        return Orientation.VERTICAL, math.nan
    if name in _DOWNWARD:
        return Orientation.DOWNWARD, math.nan
    if name in _COMPASS:
        return Orientation.HORIZONTAL, _COMPASS[name]
    bearing = _BEARING.fullmatch(name)
    if bearing and int(bearing[2]) <= 90:
        east = int(bearing[2]) if bearing[3] == "E" else -int(bearing[2])
        return Orientation.HORIZONTAL, float((east if bearing[1] == "N" else 180 - east) % 360)
    return Orientation.UNSTATED, math.nan


def directed(component: str, meant: str | None = None) -> dict[str, Any]:
    """Return name and direction of a component as fields of a record.

    Parameters
    ----------
    component : str
        Name of the component.
    meant : str, optional
        Text that states its direction (default: the name).

    Examples
    --------
    >>> directed("EW1", "EW")["azimuth"]
    90.0
    """
    orientation, azimuth = direction(component if meant is None else meant)
    return {"component": component, "orientation": orientation, "azimuth": azimuth}


def upright_sense(component: str, coded: Orientation) -> Orientation | None:
    """Return the sense of a vertical from its name and a header code for up or down.

    Parameters
    ----------
    component : str
        Name of the component. If the name states no sense, such as ``VERT``, the code decides.
    coded : Orientation
        Sense according to the code.

    Returns
    -------
    Orientation or None
        Sense of the vertical; None if name and code contradict each other.

    Examples
    --------
    >>> upright_sense("VERT", Orientation.DOWNWARD)
    <Orientation.DOWNWARD: 3>
    >>> upright_sense("UP", Orientation.DOWNWARD) is None
    True
    """
    named, _ = direction(component)
    tells = component.strip().upper() == "UP" or named is Orientation.DOWNWARD
    return None if tells and named is not coded else coded


def _common_length(first: str, other: str) -> int:
    """Return the length of the common beginning of two texts."""
    pairs = takewhile(lambda pair: pair[0] == pair[1], zip(first, other, strict=False))
    return sum(1 for _ in pairs)


def _stem(name: str) -> str:
    return _without_leading_marks(Path(name).stem) or "record"


def _safe(name: str) -> str:
    if name.isascii():
        return _UNSAFE.sub("_", name.strip())
    composed = unicodedata.normalize("NFC", name.strip())
    return "".join(c if is_record_id(f"a{c}") else "_" for c in composed)


def _without_leading_marks(name: str) -> str:
    """Return a safe name without leading points, hyphens and underscores."""
    safe = _safe(name)
    if safe.isascii():
        return safe.lstrip("._-")
    return "".join(dropwhile(lambda c: not is_record_id(c), safe))


def _join(stem: str, end: str = "") -> str:
    """Join stem and end; shorten the stem to fit both an identifier and a file name (in bytes)."""
    room = LONGEST_ID - len(end)
    return stem[:room].encode()[: 3 * room].decode(errors="ignore") + end


#: ASCII characters that no identifier has.
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9._-]")
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
    sites = [
        site
        for pattern, site in (
            (_FREE_FIELD, SiteType.FREE_FIELD),
            (_BOREHOLE, SiteType.BOREHOLE),
            (_STRUCTURE, SiteType.STRUCTURE),
        )
        if pattern.search(name)
    ]
    return sites[0] if len(sites) == 1 else SiteType.UNKNOWN


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
    match = _PLACE.search(text)
    if not match:
        return 0.0, 0.0
    north, east = float(match[1]), float(match[3])
    return north * (-1 if match[2] in "sS" else 1), east * (-1 if match[4] in "wW" else 1)


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
    is_placed = all(
        abs(north) <= 90.0 and abs(east) <= 360.0 and (north, east) != (0.0, 0.0)
        for north, east in (event, station)
    )
    if not is_placed:
        return {}
    (north, east), (other_north, other_east) = (
        map(math.radians, place) for place in (event, station)
    )
    half = math.sin((north - other_north) / 2.0) ** 2
    half += math.cos(north) * math.cos(other_north) * math.sin((east - other_east) / 2.0) ** 2
    epicentral = 2.0 * _RADIUS * math.asin(min(1.0, math.sqrt(half)))
    facts = {"epicentral_distance": round(epicentral, 1)}
    if depth >= 0.0:
        facts["distance_hypocentral"] = round(math.hypot(epicentral, depth), 1)
    return facts
