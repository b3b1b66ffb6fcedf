"""Options of downloading records."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from typing import Annotated, ClassVar, Final, Self

from pydantic import AfterValidator, Field, model_validator

from rockframe.options.model import Condition, Conditions, Options, Positive, rule, value_error

#: Codes with the wild cards of the FDSN services; ``--`` is the blank location.
_CODES: Final = re.compile(r"[A-Za-z0-9?*-]{1,8}(,[A-Za-z0-9?*-]{1,8})*")


def utc(text: str) -> str:
    """Convert an ISO 8601 time to UTC, with microseconds; a time without a zone is already UTC.

    Raises
    ------
    ValueError
        If the text is not an ISO 8601 time.

    Examples
    --------
    >>> utc("2019-07-05T20:19:53-07:00")
    '2019-07-06T03:19:53.000000Z'
    """
    time = datetime.fromisoformat(text)
    time = time.replace(tzinfo=UTC) if time.tzinfo is None else time.astimezone(UTC)
    return time.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _time(text: str) -> str:
    try:
        return utc(text)
    except ValueError:
        must = "Must be a time in ISO 8601, such as 2019-07-06T03:19:53Z"
        raise value_error(f"{text!r}. {must}") from None


def _codes(codes: str) -> str:
    if not _CODES.fullmatch(codes):
        must = "letters, digits, '?' and '*', separated by commas ('--' for a blank location)"
        raise value_error(f"{codes!r}. Must be codes of {must}")
    return codes


Codes = Annotated[str, Field(title="CODES"), AfterValidator(_codes)]
Time = Annotated[str, Field(title="TIME"), AfterValidator(_time)]
Url = Annotated[str, Field(title="URL")]
Seconds = Annotated[float, Field(ge=0.0, title="SECONDS", allow_inf_nan=False)]
Degrees = Annotated[float, Field(title="DEGREES", allow_inf_nan=False)]


class FetchOptions(Options):
    """The records to download: those of one event, or of a time span.

    Examples
    --------
    >>> FetchOptions(url="SCEDC", event="38457511", network="CI", radius_km=50.0).channel
    'HN?,HG?,BN?'
    """

    conditions: ClassVar[Conditions] = dict.fromkeys(
        ("before", "after"), Condition("event or origin", lambda options: options.start is None)
    )

    url: Url
    """Data centre: URL, or a short name known to obspy (SCEDC, INGV, GEONET...)."""
    event_url: Url = ""
    """URL of the event service, if different."""
    station_url: Url = ""
    """URL of the station service, if different."""
    event: Annotated[str, Field(title="ID")] = ""
    """Event identifier of the service."""
    origin: Time | None = None
    """Origin time (UTC), such as 2019-07-06T03:19:53, with latitude and longitude; replaces the
    event identifier."""
    latitude: Annotated[Degrees, Field(ge=-90.0, le=90.0)] | None = None
    """Latitude of the epicentre [degree], with origin."""
    longitude: Annotated[Degrees, Field(ge=-180.0, le=180.0)] | None = None
    """Longitude of the epicentre [degree], with origin."""
    magnitude: Annotated[float, Field(allow_inf_nan=False)] | None = None
    """Magnitude of the event, with origin."""
    event_name: str = ""
    """Name of the event, with origin."""
    start: Time | None = None
    """Start of a time span (UTC); replaces the event."""
    end: Time | None = None
    """End of the time span (UTC)."""
    network: Codes = "*"
    """Codes with ? and *, separated by commas."""
    station: Codes = "*"
    """Codes with ? and *, separated by commas."""
    location: Codes = "*"
    """Codes with ? and *, separated by commas; -- is a blank location."""
    channel: Codes = "HN?,HG?,BN?"
    """Codes with ? and *, separated by commas; by default those of accelerometers."""
    radius_km: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] | None = None
    """Largest epicentral distance [km], along the WGS84 geodesic."""
    min_radius: Annotated[Degrees, Field(ge=0.0)] | None = None
    """Smallest epicentral distance in degrees of arc; replaces the radius in kilometres."""
    max_radius: Annotated[Degrees, Field(ge=0.0)] | None = None
    """Largest epicentral distance in degrees of arc; replaces the radius in kilometres."""
    before: Seconds = 30.0
    """Length of the requested records before the origin time [s]."""
    after: Seconds = 300.0
    """Length of the requested records after the origin time [s]."""
    timeout: Positive = 120.0
    """Longest wait for one response [s]."""

    @model_validator(mode="after")
    def _states_one_source(self) -> Self:
        sources = sum(map(bool, (self.event, self.origin, self.start or self.end)))
        if sources != 1:
            raise rule(f"{sources} of event, origin and start are given. Give exactly one of them")
        for name in ("latitude", "longitude", "magnitude", "event_name"):
            given = getattr(self, name) not in (None, "")
            if given and self.origin is None:
                raise rule(f"{name} is given without origin")
            if self.origin and not given and name in ("latitude", "longitude"):
                raise rule(f"origin is given without {name}")
        if not self.origin and not self.event and not (self.start or "") < (self.end or ""):
            raise rule(f"Invalid end {self.end}. Must be after the start {self.start}")
        if self.before + self.after == 0.0:
            raise rule("before and after are both 0 s: nothing is requested")
        return self

    @model_validator(mode="after")
    def _is_bounded(self) -> Self:
        degrees = [radius for radius in (self.min_radius, self.max_radius) if radius is not None]
        if self.radius_km is not None and degrees:
            raise rule("radius_km is given with min_radius or max_radius. Give one or the other")
        if self.start and (degrees or self.radius_km is not None):
            raise rule("A radius is given without an event")
        near = self.radius_km is not None or self.max_radius is not None
        if not near and "*" in self.station.split(","):
            raise rule(
                f"Invalid station {self.station!r} without a radius. Name stations, or state "
                "radius_km or max_radius"
            )
        return self

    @property
    def largest_km(self) -> float:
        """Largest epicentral distance [km]; infinite if not stated."""
        return math.inf if self.radius_km is None else self.radius_km
