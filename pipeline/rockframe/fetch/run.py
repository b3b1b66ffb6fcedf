"""Request event, stations and waveforms, check them, and store them in the folder of a download."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from hashlib import sha256
from io import BytesIO
from itertools import groupby
from pathlib import Path
from typing import Any, Final, TypeVar

from obspy import UTCDateTime

from rockframe.errors import InputError, ServiceError
from rockframe.fetch.coverage import Coverage, Fetched, measure, read_whole
from rockframe.fetch.metadata import (
    Channel,
    Event,
    list_channels,
    read_event,
    read_stations,
    unlisted,
    without_nan,
    without_response,
)
from rockframe.fetch.service import Kind, Service, ServiceReply, Sleep, open_service
from rockframe.options.fetch import FetchOptions
from rockframe.provenance import __version__, read_json, refuse_obstacles, sha256_of, whole_file

#: File with the request and the SHA-256 of everything received.
REQUEST: Final = "request.json"
#: Files with the event and the list of channels as received; no reader treats them as records.
EVENT: Final = "event.quakeml"
CHANNELS: Final = "channels.stationxml"


@dataclass
class Ledger:
    """The received files of a request, updated after each reply so that a rerun can resume.

    Parameters
    ----------
    folder : Path
        The folder.
    request : dict
        The request as JSON values.
    files : dict
        `url`, `sha256` and `bytes` of each received file, by name.
    received_at : dict
        Time of receipt by name (ISO 8601, UTC). Nothing else in the folder depends on the clock.
    services : dict
        `url` and `version` of each service, by name.
    """

    folder: Path
    request: dict[str, Any]
    files: dict[str, dict[str, Any]] = field(default_factory=dict)
    received_at: dict[str, str] = field(default_factory=dict)
    services: dict[str, dict[str, str]] = field(default_factory=dict)

    def kept(self, name: str) -> bytes | None:
        """Return the contents of a file received earlier, or None if it is missing or changed."""
        entry = self.files.get(name)
        path = self.folder / name
        if entry is None or not path.is_file() or sha256_of(path) != entry["sha256"]:
            return None
        return path.read_bytes()

    def keep(self, name: str, reply: ServiceReply) -> None:
        """Write a file atomically, then the ledger.

        Raises
        ------
        InputError
            If the folder cannot be written to.
        """
        with whole_file(self.folder / name) as partial:
            partial.write_bytes(reply.body)
        self.files[name] = {
            "url": reply.url,
            "sha256": sha256(reply.body).hexdigest(),
            "bytes": len(reply.body),
        }
        self.received_at[name] = datetime.now(UTC).isoformat(timespec="seconds")
        self.write()

    def write(self, **results: Any) -> None:
        """Write `request.json`, with further results.

        Raises
        ------
        InputError
            If the folder cannot be written to.
        """
        document = {
            "request": self.request,
            "services": self.services,
            "files": self.files,
            "received_at": self.received_at,
            "rockframe_version": __version__,
            **results,
        }
        text = json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n"
        with whole_file(self.folder / REQUEST) as partial:
            partial.write_text(text, encoding="utf-8")


def open_folder(folder: Path, request: dict[str, Any]) -> Ledger:
    """Return the ledger of an earlier run of the same request, or a new one.

    Raises
    ------
    InputError
        If the folder contains another request, or files of unknown origin.

    Examples
    --------
    >>> open_folder(Path("no-such-folder"), {"url": "SCEDC"}).files
    {}
    """
    path = folder / REQUEST
    try:
        if not path.is_file():
            if folder.exists() and any(folder.iterdir()):
                message = f"contains files but no {REQUEST}. Choose a new or empty folder, or that"
                raise InputError(folder, f"{message} of an earlier fetch.")
            return Ledger(folder, request)
        document = read_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(folder, f"cannot be opened: {error.strerror}.") from None
    except ValueError as error:
        raise InputError(
            path, f"is not JSON ({error}). Restore the file as `fetch` wrote it."
        ) from None
    return _ledger(path, document, request)


def _ledger(path: Path, document: Any, request: dict[str, Any]) -> Ledger:
    parts = ("request", "files", "received_at", "services")
    tables = document if isinstance(document, dict) else {}
    lacking = next((part for part in parts if not isinstance(tables.get(part), dict)), None)
    if lacking:
        raise InputError(
            path,
            f"{lacking!r} is missing or invalid. Restore the file, or fetch into a new folder.",
        )
    before = document["request"]
    different = sorted(
        key for key in before.keys() | request.keys() if before.get(key) != request.get(key)
    )
    if different:
        key = different[0]
        message = f"contains another request: {key} {before.get(key)!r}, now {request.get(key)!r}."
        raise InputError(path, f"{message} Use the same request, or another folder.")
    refuse_obstacles(path.parent / name for name in (EVENT, CHANNELS, *document["files"]))
    return Ledger(path.parent, request, *(document[part] for part in parts[1:]))


#: Length of the shortest degree of latitude [km]; with it, a radius in degrees misses no station.
_SHORTEST_DEGREE: Final = 110.5
#: Problems that would affect every request; other problems affect only one file.
_OF_ALL_FILES: Final = frozenset([Kind.MISTAKE, Kind.UNAVAILABLE])
#: Codes of a channel, as `FetchOptions`, `Channel` and obspy's client name them.
_CODES: Final = ("network", "station", "location", "channel")

T = TypeVar("T")
Ask = Callable[[Any, BytesIO], None]
Check = Callable[[str, bytes], T]


@dataclass(frozen=True)
class _Session:
    """The services and the folder of one run."""

    ledger: Ledger
    services: dict[str, Service]
    progress: Callable[[str], None]

    def obtain(self, service: str, name: str, ask: Ask, check: Check[T]) -> tuple[T | None, str]:
        """Return the result of `check` for a file, stored or downloaded; or None and the reason."""
        body = self.ledger.kept(name)
        if body is not None:
            return check(self.ledger.files[name]["url"], body), ""
        self.progress(name)
        reply = self.services[service].ask(ask)
        if reply.problem is not None:
            if reply.problem.kind in _OF_ALL_FILES:
                raise ServiceError(reply.url, reply.problem.reason)
            return None, reply.problem.reason
        try:
            result = check(reply.url, reply.body)
        except (InputError, ServiceError) as error:
            return None, error.reason
        self._note_version(service)
        self.ledger.keep(name, reply)
        return result, ""

    def require(self, service: str, name: str, ask: Ask, check: Check[T]) -> T:
        """Return the result of `check` for a required file; raise an error if it is missing."""
        result, reason = self.obtain(service, name, ask, check)
        if result is None:
            raise ServiceError(f"{self.services[service].address} ({service} service)", reason)
        return result

    def _note_version(self, name: str) -> None:
        if name not in self.ledger.services:
            service = self.services[name]
            self.ledger.services[name] = {"url": service.address, "version": service.version()}


def fetch(
    request: FetchOptions,
    folder: Path,
    *,
    sleep: Sleep = time.sleep,
    progress: Callable[[str], None] | None = None,
) -> Fetched:
    """Fetch event, StationXML and waveforms into a folder; a rerun resumes an interrupted one.

    Each channel is one file, ``NET.STA.LOC.CHA.mseed``, beside the ``NET.STA.xml`` of its station,
    as received. ``request.json`` contains the request and the SHA-256 of each file.

    Parameters
    ----------
    request : FetchOptions
        The data to fetch.
    folder : Path
        A new or empty folder, or the folder of an earlier run of the same request.
    sleep : callable
        Function that waits for a number of seconds between attempts.
    progress : callable, optional
        Called with the name of each requested file.

    Returns
    -------
    Fetched
        Received and missing data.

    Raises
    ------
    InputError
        If the folder contains other files, or cannot be written to.
    ParameterError
        If an address is invalid.
    ServiceError
        If there is no such event or station, no waveform was received, or a service does not
        reply or rejects the request.

    Examples
    --------
    >>> fetch(FetchOptions(url="moon", event="1", radius_km=10.0), Path("new"))
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid address 'moon' of the dataselect service. \
Must begin with http:// or https://, or be a short name that obspy knows (as SCEDC, INGV).
    """
    ledger = open_folder(folder, request.model_dump(mode="json", exclude={"timeout"}))
    addresses = {
        "dataselect": request.url,
        "station": request.station_url or request.url,
        "event": request.event_url or request.url,
    }
    services = {n: open_service(n, url, request.timeout, sleep) for n, url in addresses.items()}
    session = _Session(ledger, services, progress or (lambda _name: None))
    event = _event(session, request)
    span = _span(request, event)
    listed = _listed(session, request, event, span)
    rows = [
        Coverage(what=code, reason="not listed by the station service for this span and radius")
        for code in unlisted(request, listed)
    ]
    for _, channels in groupby(listed, key=lambda channel: (channel.network, channel.station)):
        rows += _fetch_station(session, list(channels), span)
    received = {row.what for row in rows if row.file.endswith(".mseed")}
    if not received:
        address = services["dataselect"].address
        raise ServiceError(address, f"no waveform was received: {rows[0].what}: {rows[0].reason}")
    ledger.write(
        event=None if event is None else without_nan(asdict(event)),
        coverage=[without_nan(asdict(row)) | {"verdict": row.verdict} for row in rows],
    )
    return Fetched(event, tuple(c for c in listed if c.name in received), tuple(rows))


def _event(session: _Session, request: FetchOptions) -> Event | None:
    if request.start is not None:
        return None
    if request.origin is not None:
        return Event(
            time=request.origin,
            latitude=request.latitude or 0.0,
            longitude=request.longitude or 0.0,
            magnitude=math.nan if request.magnitude is None else request.magnitude,
            name=request.event_name,
        )

    def ask(client: Any, answer: BytesIO) -> None:
        client.get_events(eventid=request.event, filename=answer)

    return session.require(
        "event", EVENT, ask, lambda url, body: read_event(url, body, request.event)
    )


def _span(request: FetchOptions, event: Event | None) -> tuple[str, str]:
    if event is None:
        return str(request.start), str(request.end)
    origin = UTCDateTime(event.time)
    return str(origin - request.before), str(origin + request.after)


def _listed(
    session: _Session, request: FetchOptions, event: Event | None, span: tuple[str, str]
) -> list[Channel]:
    radius = {"minradius": request.min_radius, "maxradius": request.max_radius}
    if request.radius_km is not None:
        radius["maxradius"] = min(request.radius_km / _SHORTEST_DEGREE, 180.0)
    around = {name: value for name, value in radius.items() if value is not None}
    if around and event is not None:
        around |= {"latitude": event.latitude, "longitude": event.longitude}

    codes = {name: getattr(request, name) for name in _CODES}

    def check(url: str, body: bytes) -> list[Channel]:
        return list_channels(url, read_stations(url, body), event, request)

    ask = _ask_stations(span, level="channel", **codes, **around)
    listed = session.require("station", CHANNELS, ask, check)
    if not listed:
        raise ServiceError(
            session.services["station"].address,
            f"no channel {request.channel!r} within {request.largest_km:g} km. "
            "State a larger radius or other codes.",
        )
    return listed


def _ask_stations(span: tuple[str, str], **words: Any) -> Ask:
    """Return the request of StationXML for a span and codes."""

    def ask(client: Any, answer: BytesIO) -> None:
        start, end = map(UTCDateTime, span)
        client.get_stations(starttime=start, endtime=end, filename=answer, **words)

    return ask


def _fetch_station(
    session: _Session, channels: list[Channel], span: tuple[str, str]
) -> list[Coverage]:
    station = f"{channels[0].network}.{channels[0].station}"
    file = f"{station}.xml"
    codes = {
        name: ",".join(sorted({getattr(channel, name) for channel in channels})) for name in _CODES
    }
    ask = _ask_stations(span, level="response", **codes)
    rows = [_fetch_channel(session, channel, span) for channel in channels]
    inventory, reason = session.obtain("station", file, ask, read_stations)
    if inventory is None:
        return [*rows, Coverage(what=station, reason=f"no StationXML: {reason}")]
    silent = without_response(inventory, channels)
    return rows + [
        Coverage(what=name, file=file, reason="StationXML without sensitivity or response")
        for name in silent
    ]


def _fetch_channel(session: _Session, channel: Channel, span: tuple[str, str]) -> Coverage:
    file = f"{channel.name}.mseed"

    def ask(client: Any, answer: BytesIO) -> None:
        codes = [getattr(channel, name) for name in _CODES]
        client.get_waveforms(*codes, *map(UTCDateTime, span), filename=answer)

    def check(_url: str, body: bytes) -> Coverage:
        return replace(measure(channel.name, span, read_whole(file, body)), file=file)

    row, reason = session.obtain("dataselect", file, ask, check)
    distance = None if math.isnan(channel.distance) else channel.distance
    if row is None:
        row = Coverage(
            what=channel.name, requested_start=span[0], requested_end=span[1], reason=reason
        )
    return replace(row, distance=distance)
