"""A request to a data centre: the event, the stations and the time span."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any, Final

from rockframe.errors import ParameterError

#: Channels of accelerometers: code N, formerly also G, at high (H) and broad-band (B) rates.
ACCELEROMETERS: Final = "HN?,HG?,BN?"
#: Codes with the wild cards of the FDSN services; ``--`` is the blank location.
_CODES: Final = re.compile(r"[A-Za-z0-9?*-]{1,8}(,[A-Za-z0-9?*-]{1,8})*")


def utc(what: str, text: str) -> str:
    """Return an ISO 8601 time in UTC with microseconds; a time without a zone is in UTC.

    Raises
    ------
    ParameterError
        If it is no time.

    Examples
    --------
    >>> utc("origin", "2019-07-05T20:19:53-07:00")
    '2019-07-06T03:19:53.000000Z'
    """
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise ParameterError(
            f"Invalid {what} {text!r}. Must be a time in ISO 8601, as 2019-07-06T03:19:53Z."
        ) from None
    time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    return time.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


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
        object.__setattr__(self, "time", utc("origin", self.time))
        _require_within("latitude", self.latitude, 90.0)
        _require_within("longitude", self.longitude, 180.0)
        if math.isinf(self.magnitude):
            raise ParameterError(f"Invalid magnitude {self.magnitude!r}. Must be finite.")


def _require_within(what: str, value: float, limit: float) -> None:
    if not abs(value) <= limit:
        raise ParameterError(
            f"Invalid {what} {value!r} degree. Must be from {-limit:g} to {limit:g}."
        )


@dataclass(frozen=True, kw_only=True)
class Request:
    """The data to fetch: those of one event, or of a time span.

    Parameters
    ----------
    url : str
        Data centre: an address, or a short name that obspy knows (``SCEDC``, ``INGV``).
    event_url, station_url : str
        Addresses of the event and station services, if not at `url`.
    event_id : str
        Identifier of the event in the event service.
    event : Event, optional
        The event itself, in place of its identifier.
    start, end : str
        A time span (ISO 8601), in place of an event.
    network, station, location, channel : str
        Codes separated by commas, with ``?`` and ``*`` as wild cards; location ``--`` is blank.
    radius_km : float
        Largest distance of a station from the epicentre [km], along the WGS84 geodesic.
    min_radius, max_radius : float
        Range of distances measured by the station service [degree], in place of `radius_km`.
    before, after : float
        Time requested before and after the origin time [s].

    Raises
    ------
    ParameterError
        If it is not one event or span, a code is none, or stations are bounded neither by name
        nor by distance.

    Examples
    --------
    >>> Request(url="SCEDC", event_id="38457511", network="CI", radius_km=50.0).channel
    'HN?,HG?,BN?'
    """

    url: str
    event_url: str = ""
    station_url: str = ""
    event_id: str = ""
    event: Event | None = None
    start: str = ""
    end: str = ""
    network: str = "*"
    station: str = "*"
    location: str = "*"
    channel: str = ACCELEROMETERS
    radius_km: float = math.nan
    min_radius: float = math.nan
    max_radius: float = math.nan
    before: float = 30.0
    after: float = 300.0

    def __post_init__(self) -> None:
        self._settle_times()
        for what in ("network", "station", "location", "channel"):
            codes = getattr(self, what)
            if not _CODES.fullmatch(codes):
                raise ParameterError(
                    f"Invalid {what} {codes!r}. Must be codes of letters, digits, '?' and '*', "
                    "separated by commas ('--' for a blank location)."
                )
        self._require_bounds()

    def _settle_times(self) -> None:
        stated = [bool(self.event_id), self.event is not None, bool(self.start or self.end)]
        if sum(stated) != 1:
            raise ParameterError(
                f"{sum(stated)} of --event, --origin and --start given. Must be one of them."
            )
        if self.start or self.end:
            start, end = utc("start", self.start), utc("end", self.end)
            if not start < end:
                raise ParameterError(f"Invalid end {end}. Must be after the start {start}.")
            object.__setattr__(self, "start", start)
            object.__setattr__(self, "end", end)
        for what, value in (("before", self.before), ("after", self.after)):
            if not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"Invalid {what} {value!r} s. Must be zero or positive.")
        if self.before + self.after == 0.0:
            raise ParameterError("Invalid before and after, both 0 s. Must span some time.")

    def _require_bounds(self) -> None:
        radii = (self.radius_km, self.min_radius, self.max_radius)
        bounded = [value for value in radii if not math.isnan(value)]
        if any(value < 0.0 or math.isinf(value) for value in bounded):
            raise ParameterError(f"Invalid radius {min(bounded)!r}. Must be positive and finite.")
        if not math.isnan(self.radius_km) and len(bounded) > 1:
            raise ParameterError(
                "--radius-km given with --min-radius or --max-radius. Must be one or the other."
            )
        if bounded and self.start:
            raise ParameterError("Radius given without an event. Must be around an event.")
        far = math.isnan(self.radius_km) and math.isnan(self.max_radius)
        if far and "*" in self.station.split(","):
            raise ParameterError(
                f"Invalid station {self.station!r} without a radius. "
                "Must be bounded: names of stations, --radius-km or --max-radius."
            )

    def document(self) -> dict[str, Any]:
        """Return the request as JSON values, with None for unknown values."""
        stated = asdict(self)
        if self.event is not None:
            stated["event"] = known(asdict(self.event))
        return known(stated)


def known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with None in place of NaN.

    Examples
    --------
    >>> known({"magnitude": math.nan, "name": "Ridgecrest"})
    {'magnitude': None, 'name': 'Ridgecrest'}
    """
    return {
        key: None if isinstance(value, float) and math.isnan(value) else value
        for key, value in values.items()
    }
