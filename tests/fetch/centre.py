"""A data centre on 127.0.0.1: synthetic events and stations, and waveforms that a test can set."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
from obspy import Stream, UTCDateTime

ORIGIN = "2019-07-06T03:19:53.000000Z"
EPICENTRE = (35.77, -117.6)
STATIONS = {"CLC": (35.8157, -117.5975), "CCC": (35.5249, -117.3645)}
CHANNELS = ("HNE", "HNN", "HNZ")
XML = "application/xml"
MSEED = "application/vnd.fdsn.mseed"


@dataclass(frozen=True)
class Reply:
    """A reply of the data centre, with the faults to inject."""

    status: int = 200
    body: bytes = b""
    content_type: str = XML
    headers: dict[str, str] = field(default_factory=dict)
    keep_back: int = 0  # bytes announced but not sent
    pause: float = 0.0  # before the body [s]
    drip: float = 0.0  # before each 512 bytes of it [s]


def waveform(
    station: str, channel: str, start: str, seconds: float, amplitude: float = 1000.0
) -> Any:
    """Return a trace of synthetic counts at 100 Hz."""
    from obspy import Trace

    time = np.arange(round(seconds * 100) + 1) / 100.0
    counts = np.round(amplitude * np.sin(2.0 * np.pi * 1.3 * time)).astype(np.int32)
    header = {"network": "XX", "station": station, "location": "", "channel": channel}
    return Trace(counts, {**header, "sampling_rate": 100.0, "starttime": UTCDateTime(start)})


def miniseed(*traces: Any) -> bytes:
    """Return traces as miniSEED records of 512 bytes."""
    buffer = BytesIO()
    Stream(list(traces)).write(buffer, format="MSEED", encoding="STEIM2", reclen=512)
    return buffer.getvalue()


def quakeml() -> bytes:
    """Return QuakeML of one event with one origin and one magnitude."""
    from obspy.core.event import Catalog, EventDescription, Magnitude, Origin
    from obspy.core.event import Event as QuakeMLEvent

    origin = Origin(time=UTCDateTime(ORIGIN), latitude=EPICENTRE[0], longitude=EPICENTRE[1])
    event = QuakeMLEvent(
        origins=[origin],
        magnitudes=[Magnitude(mag=7.1, magnitude_type="Mw")],
        event_descriptions=[EventDescription(text="Made up, California")],
    )
    buffer = BytesIO()
    Catalog([event]).write(buffer, format="QUAKEML")
    return buffer.getvalue()


def stationxml(stations: dict[str, tuple[float, float]], channels: tuple[str, ...]) -> bytes:
    """Return StationXML of stations of network XX with a sensitivity in counts per m/s2."""
    from obspy.core.inventory import Channel, Inventory, Network, Response, Site, Station
    from obspy.core.inventory.response import InstrumentSensitivity

    sensitivity = InstrumentSensitivity(213500.0, 1.0, "M/S**2", "COUNTS")
    rows = [
        Station(
            code,
            *place,
            700.0,
            site=Site("made up"),
            channels=[
                Channel(
                    name,
                    "",
                    *place,
                    700.0,
                    0.0,
                    sample_rate=100.0,
                    response=Response(instrument_sensitivity=sensitivity),
                )
                for name in channels
            ],
        )
        for code, place in stations.items()
    ]
    buffer = BytesIO()
    Inventory([Network("XX", stations=rows)], source="made up", created=UTCDateTime(ORIGIN)).write(
        buffer, format="STATIONXML"
    )
    return buffer.getvalue()


Script = Callable[[str, dict[str, str]], Reply]


class _Centre(ThreadingHTTPServer):
    """A server that replies as its script says and records the requests."""

    daemon_threads = True
    script: Script
    asked: list[str]
    hush: threading.Event


class _Handler(BaseHTTPRequestHandler):
    server: _Centre

    def do_GET(self) -> None:  # the name that http.server calls
        parts = urlsplit(self.path)
        self.server.asked.append(self.path)
        _, _, service, _, method = parts.path.split("/")
        if method == "version":
            reply = Reply(body=b"1.1.2", content_type="text/plain")
        else:
            query = {key: value[0] for key, value in parse_qs(parts.query).items()}
            reply = self.server.script(service, query)
        self._send(reply)

    def _send(self, reply: Reply) -> None:
        self.send_response(reply.status)
        self.send_header("Content-Type", reply.content_type)
        for name, value in reply.headers.items():
            self.send_header(name, value)
        if reply.status != 204:
            self.send_header("Content-Length", str(len(reply.body)))
        self.end_headers()
        if reply.pause and self.server.hush.wait(reply.pause):
            return
        body = reply.body[: len(reply.body) - reply.keep_back]
        with suppress(BrokenPipeError, ConnectionResetError):  # the client may hang up
            for start in range(0, len(body), 512):
                self.wfile.write(body[start : start + 512])
                if reply.drip and self.server.hush.wait(reply.drip):
                    return

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
        """Log nothing."""


@dataclass
class DataCentre:
    """The address of the server, the requests it received, and the replies that a test sets."""

    url: str
    asked: list[str]
    waveforms: dict[tuple[str, str], list[Reply]] = field(default_factory=dict)
    stations: dict[str, tuple[float, float]] = field(default_factory=lambda: dict(STATIONS))
    responses: list[Reply] = field(default_factory=list)
    before_all: list[Reply] = field(default_factory=list)

    def answer(self, service: str, query: dict[str, str]) -> Reply:
        """Return the next reply that was set, or the normal reply of a data centre."""
        if self.before_all:
            return self.before_all.pop(0)
        if service == "event":
            return Reply(body=quakeml()) if query["eventid"] == "xx1" else Reply(204)
        if service == "station" and query["level"] == "response" and self.responses:
            return self.responses[0]
        if service == "station":
            asked = query["station"].split(",")
            requested = {k: v for k, v in self.stations.items() if k in asked or "*" in asked}
            return Reply(body=stationxml(requested, CHANNELS)) if requested else Reply(204)
        replies = self.waveforms.get((query["station"], query["channel"]))
        if replies:
            return replies.pop(0) if len(replies) > 1 else replies[0]
        trace = waveform(query["station"], query["channel"], query["starttime"], 61.0)
        return Reply(body=miniseed(trace), content_type=MSEED)

    def queries(self, service: str) -> list[str]:
        """Return the queries that a service received."""
        return [path for path in self.asked if f"/{service}/1/query" in path]


@contextmanager
def serving() -> Iterator[DataCentre]:
    """Run a data centre on loopback."""
    server = _Centre(("127.0.0.1", 0), _Handler)
    server.asked = []
    server.hush = threading.Event()
    centre = DataCentre(f"http://127.0.0.1:{server.server_port}", server.asked)
    server.script = centre.answer
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield centre
    finally:
        server.hush.set()
        server.shutdown()
        thread.join()
        server.server_close()
