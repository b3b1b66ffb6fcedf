"""Metadata of events and channels as the event and station services state them."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any, Final

from obspy import Inventory, read_events, read_inventory
from obspy.core.util.obspy_types import ObsPyException
from obspy.geodetics import gps2dist_azimuth

from rockframe.errors import ParameterError, ServiceError
from rockframe.options.fetch import FetchOptions, utc


@dataclass(frozen=True, kw_only=True)
class Event:
    """Place and time of an earthquake. Unknown values are NaN or empty.

    Parameters
    ----------
    time : str
        Origin time (ISO 8601, UTC).
    latitude, longitude : float
        Epicentre [degree], north and east positive.
    magnitude : float
        Magnitude [1].
    name : str
        Name of the earthquake.
    source : str
        Source of these values.

    Raises
    ------
    ParameterError
        If the time or the coordinates are invalid.

    Examples
    --------
    >>> Event(time="2019-07-06T03:19:53", latitude=35.77, longitude=-117.599).time
    '2019-07-06T03:19:53.000000Z'
    """

    time: str
    latitude: float
    longitude: float
    magnitude: float = math.nan
    name: str = ""
    source: str = "as given"

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "time", utc(self.time))
        except ValueError:
            raise ParameterError(f"Invalid origin time {self.time!r}.") from None
        for name, value, limit in (
            ("latitude", self.latitude, 90.0),
            ("longitude", self.longitude, 180.0),
            ("magnitude", 0.0 if math.isnan(self.magnitude) else self.magnitude, 100.0),
        ):
            if not abs(value) <= limit:
                raise ParameterError(
                    f"Invalid {name} {value!r}. Must be from {-limit:g} to {limit:g}."
                )


def without_nan(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with None in place of NaN.

    Examples
    --------
    >>> without_nan({"magnitude": math.nan, "name": "Ridgecrest"})
    {'magnitude': None, 'name': 'Ridgecrest'}
    """
    return {
        key: None if isinstance(value, float) and math.isnan(value) else value
        for key, value in values.items()
    }


#: Errors that obspy's XML readers raise for files of other formats.
_UNREADABLE: Final = (
    SyntaxError,  # from lxml, if a file is not XML
    ObsPyException,
    ValueError,
    TypeError,
    AttributeError,
    KeyError,
)
_QUAKEML: Final = re.compile(rb"<(\w+:)?quakeml[\s>].*<(\w+:)?eventParameters[\s>]", re.DOTALL)
#: Codes that are safe in file names.
_CODE: Final = re.compile(r"[A-Za-z0-9]{1,8}")


@dataclass(frozen=True, order=True)
class Channel:
    """One channel that the station service lists.

    Parameters
    ----------
    network, station, location, channel : str
        Codes; the location is ``--`` if it is blank.
    distance : float
        Distance from the epicentre [km], along the WGS84 geodesic; NaN without an event.

    Examples
    --------
    >>> Channel("CI", "CLC", "--", "HNE", 5.1).name
    'CI.CLC.--.HNE'
    """

    network: str
    station: str
    location: str
    channel: str
    distance: float = math.nan

    @property
    def name(self) -> str:
        """``NET.STA.LOC.CHA``."""
        return f"{self.network}.{self.station}.{self.location}.{self.channel}"


def read_event(url: str, body: bytes, event_id: str) -> Event:
    """Read the preferred, or the only, origin and magnitude of one event from QuakeML.

    Raises
    ------
    ServiceError
        If the reply is not QuakeML, does not contain exactly one event, or prefers none of several
        origins.

    Examples
    --------
    >>> read_event("http://127.0.0.1", b"<html/>", "1")
    Traceback (most recent call last):
    rockframe.errors.ServiceError: http://127.0.0.1: answer of 7 bytes is no QuakeML event.
    """
    message = f"answer of {len(body)} bytes is no QuakeML event."
    if not _QUAKEML.search(body):  # obspy would raise a bare Exception
        raise ServiceError(url, message)
    try:
        with warnings.catch_warnings(action="ignore"):  # of values that are checked below
            events = read_events(BytesIO(body), format="QUAKEML")
    except _UNREADABLE:
        raise ServiceError(url, message) from None
    if len(events) != 1:
        raise ServiceError(url, f"{len(events)} events {event_id!r}, but one was requested.")
    origin = _preferred(events[0].preferred_origin(), events[0].origins)
    magnitude = _preferred(events[0].preferred_magnitude(), events[0].magnitudes)
    if magnitude is not None and magnitude.mag is None:
        magnitude = None
    if origin is None or None in (origin.time, origin.latitude, origin.longitude):
        raise ServiceError(
            url,
            f"event {event_id!r} with {len(events[0].origins)} origins, none preferred and whole. "
            "State --origin, --latitude and --longitude.",
        )
    names = [text.text for text in events[0].event_descriptions if text.text]
    event_name = " ".join((names or [event_id])[0].split())
    kind = f" ({magnitude.magnitude_type})" if magnitude and magnitude.magnitude_type else ""
    try:
        return Event(
            time=str(origin.time),
            latitude=float(origin.latitude),
            longitude=float(origin.longitude),
            magnitude=math.nan if magnitude is None else float(magnitude.mag),
            name=event_name,
            source=f"event {event_id} of {url.split('/fdsnws/')[0]}: origin, magnitude{kind}",
        )
    except ParameterError as error:
        raise ServiceError(url, f"event {event_id!r}: {error}") from None


def _preferred(preferred: Any, choices: list[Any]) -> Any:
    if preferred is not None:
        return preferred
    return choices[0] if len(choices) == 1 else None


def read_stations(url: str, body: bytes) -> Inventory:
    """Read StationXML.

    Raises
    ------
    ServiceError
        If the reply is not StationXML.

    Examples
    --------
    >>> read_stations("http://127.0.0.1", b"<html/>")
    Traceback (most recent call last):
    rockframe.errors.ServiceError: http://127.0.0.1: answer of 7 bytes is no StationXML.
    """
    try:
        with warnings.catch_warnings(action="ignore"):  # of single entries; stations lack them
            return read_inventory(BytesIO(body), format="STATIONXML")
    except _UNREADABLE:
        message = f"answer of {len(body)} bytes is no StationXML."
        raise ServiceError(url, message) from None


def list_channels(
    url: str, inventory: Inventory, event: Event | None, request: FetchOptions
) -> list[Channel]:
    """Return the channels within the requested radius, sorted by distance and name, each once.

    Raises
    ------
    ServiceError
        If a code cannot be part of the name of a file.
    """
    channels: set[Channel] = set()
    for each, station, _ in _walk(inventory):
        for code in (each.network, each.station, each.channel, each.location.replace("--", "0")):
            if not _CODE.fullmatch(code):
                raise ServiceError(url, f"code {code!r}. Must be 1 to 8 letters and digits.")
        distance = _distance(event, station)
        if not distance > request.largest_km:
            channels.add(replace(each, distance=distance))
    by_distance = sorted(channels, key=lambda c: (math.isnan(c.distance), c.distance, c.name))
    return list({channel.name: channel for channel in by_distance}.values())


def _walk(inventory: Inventory) -> Iterator[tuple[Channel, Any, Any]]:
    """Yield each channel of StationXML, with the station and the channel of obspy."""
    for network in inventory:
        for station in network:
            for channel in station:
                location = channel.location_code.strip() or "--"
                yield Channel(network.code, station.code, location, channel.code), station, channel


def _distance(event: Event | None, station: Any) -> float:
    if event is None:
        return math.nan
    metres, _, _ = gps2dist_azimuth(
        event.latitude, event.longitude, float(station.latitude), float(station.longitude)
    )
    return float(metres) / 1000.0


def unlisted(request: FetchOptions, channels: list[Channel]) -> list[str]:
    """Return the requested codes without wild cards that the station service does not list.

    Examples
    --------
    >>> request = FetchOptions(url="SCEDC", event="1", station="CLC,CCC", channel="HNE,HNN")
    >>> unlisted(request, [Channel("CI", "CLC", "--", "HNE")])
    ['*.CCC', 'CI.CLC.HNN']
    """
    stations = sorted({(channel.network, channel.station) for channel in channels})
    absent = [
        f"*.{code}" for code in _plain(request.station) if code not in {s for _, s in stations}
    ]
    absent += [
        f"{code}.*" for code in _plain(request.network) if code not in {n for n, _ in stations}
    ]
    listed = {(c.network, c.station, c.channel) for c in channels}
    absent += [
        f"{network}.{station}.{code}"
        for network, station in stations
        for code in _plain(request.channel)
        if (network, station, code) not in listed
    ]
    return absent


def _plain(codes: str) -> list[str]:
    return [code for code in codes.split(",") if not set(code) & set("?*")]


def without_response(inventory: Inventory, channels: list[Channel]) -> list[str]:
    """Return the names of the channels whose StationXML states no sensitivity and no response.

    Examples
    --------
    >>> without_response(Inventory([]), [Channel("CI", "CLC", "--", "HNE")])
    ['CI.CLC.--.HNE']
    """
    with_response = {
        listed.name
        for listed, _, channel in _walk(inventory)
        if channel.response is not None
        and (channel.response.instrument_sensitivity or channel.response.response_stages)
    }
    return [channel.name for channel in channels if channel.name not in with_response]
