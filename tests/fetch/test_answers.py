"""Faulty replies of a data centre: each gives one line that says what to do."""

from __future__ import annotations

import math
import socket
import time
from collections.abc import Callable
from email.utils import formatdate
from pathlib import Path

import pytest

from rockframe.errors import RockframeError, ServiceError
from rockframe.fetch.coverage import Fetched
from rockframe.fetch.metadata import read_event, read_stations
from rockframe.fetch.run import fetch
from rockframe.options.fetch import FetchOptions

from .centre import MSEED, STATIONS, DataCentre, Reply, miniseed, stationxml, waveform

Make = Callable[..., FetchOptions]
START = "2019-07-06T03:19:43.000000Z"
SOUND = miniseed(waveform("CLC", "HNE", START, 61.0))


class Patience:
    """A sleep function that returns at once and records the requested pauses."""

    def __init__(self) -> None:
        self.pauses: list[float] = []

    def __call__(self, seconds: float) -> None:
        self.pauses.append(seconds)


@pytest.fixture
def run(request_of: Make, output: Path) -> Callable[..., tuple[Fetched, list[float]]]:
    """Return a function that fetches and returns the result and the pauses."""

    def fetched(timeout: float = 5.0) -> tuple[Fetched, list[float]]:
        patience = Patience()
        return fetch(request_of(timeout=timeout), output, sleep=patience), patience.pauses

    return fetched


Run = Callable[..., tuple[Fetched, list[float]]]


def reply(status: int, words: str = "", **headers: str) -> Reply:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return Reply(status, words.encode(), "text/plain", named)


def test_retry_after_is_honoured(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(429, Retry_After="7")]
    fetched, pauses = run()
    assert fetched.complete
    assert pauses == [7.0]


def test_retry_after_may_be_a_date(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(503, Retry_After=formatdate(time.time() + 30.0, usegmt=True))]
    fetched, (pause,) = run()
    assert fetched.complete
    assert pause == pytest.approx(30.0, abs=2.0)


def test_pauses_double_and_end(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(503, "too busy")] * 9
    with pytest.raises(ServiceError, match=r"answered 503 \(too busy\). Try again later"):
        run()
    assert len(centre.asked) == 4


def test_pauses_double(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(503)] * 3
    assert run()[1] == [2.0, 4.0, 8.0]


def test_a_long_wait_is_left_to_the_user(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(429, Retry_After="3600")]
    with pytest.raises(ServiceError, match=r"answered 429 and asks to wait 3600 s. Try again"):
        run()
    assert len(centre.asked) == 1


def test_bad_request_repeats_the_services_words(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(400, "Error 400: Bad request\n\nUnknown channel 'HN?'\n")]
    with pytest.raises(ServiceError, match=r"400, bad request \(Error 400: Bad request Unknown ch"):
        run()
    assert len(centre.asked) == 1


@pytest.mark.parametrize("status", [401, 403])
def test_a_login_is_explained(centre: DataCentre, run: Run, status: int) -> None:
    centre.before_all = [reply(status)]
    with pytest.raises(
        ServiceError, match=rf"answered {status}: needs a login .* by hand .*ingest"
    ):
        run()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (reply(204), "answered 204: no data. Request codes and times that the service has."),
        (reply(404), "answered 404: no data (or no such service at this address)."),
        (reply(403), "answered 403: needs a login or a permission"),
        (reply(413), "answered 413: too much at once. Request less: fewer stations"),
        (Reply(body=b"", content_type=MSEED), "answered 200 with nothing: no data."),
        (Reply(body=b"<html>", content_type="text/html"), "content type 'text/html'"),
        (Reply(body=b"{}", content_type=MSEED), "no valid miniSEED record at byte 0 of 2."),
        (Reply(body=SOUND[:700], content_type=MSEED), "truncated: the last record ends at byte"),
        (
            Reply(body=SOUND[:520], content_type=MSEED),
            "no valid miniSEED record at byte 512 of 520.",
        ),
        (
            Reply(body=SOUND, content_type=MSEED, headers={"Content-Encoding": "gzip"}),
            "answered in 'gzip', which was not requested.",
        ),
    ],
)
def test_one_channel_does_not_stop_the_others(
    centre: DataCentre, run: Run, output: Path, answer: Reply, words: str
) -> None:
    centre.waveforms["CLC", "HNE"] = [answer]
    fetched, pauses = run()
    row = fetched.coverage[0]
    assert words in row.verdict
    assert [other.complete for other in fetched.coverage] == [False, True, True]
    assert not (output / "XX.CLC.--.HNE.mseed").exists()
    assert pauses == []


@pytest.mark.parametrize(("beyond", "verdict"), [(0, "complete"), (1, "more than {} bytes. Req")])
def test_a_reply_has_a_largest_size(
    centre: DataCentre, run: Run, monkeypatch: pytest.MonkeyPatch, beyond: int, verdict: str
) -> None:
    """Without a limit, a service could fill the memory."""
    body = miniseed(waveform("CLC", "HNE", START, 3000.0))
    centre.waveforms["CLC", "HNE"] = [Reply(body=body, content_type=MSEED)]
    monkeypatch.setattr("rockframe.fetch.service._MOST_BYTES", len(body) - beyond)
    fetched, _ = run()
    assert fetched.coverage[0].verdict.startswith(verdict.format(len(body) - beyond))
    assert all(other.complete for other in fetched.coverage[1:])


def test_an_answer_cut_off_is_asked_for_again(centre: DataCentre, run: Run) -> None:
    short = Reply(body=SOUND, content_type=MSEED, keep_back=100)
    centre.waveforms["CLC", "HNE"] = [short, Reply(body=SOUND, content_type=MSEED)]
    fetched, pauses = run()
    assert fetched.complete
    assert pauses == [2.0]


def test_an_answer_always_cut_off_is_refused(centre: DataCentre, run: Run) -> None:
    short = Reply(body=SOUND, content_type=MSEED, keep_back=512)
    centre.waveforms["CLC", "HNE"] = [short]
    fetched, _ = run()
    size = len(SOUND)
    assert f"answer truncated: {size - 512} of {size} bytes" in fetched.coverage[0].verdict


def test_a_slow_answer_ends(centre: DataCentre, run: Run) -> None:
    centre.waveforms["CLC", "HNE"] = [Reply(body=SOUND, content_type=MSEED, pause=20.0)]
    with pytest.raises(ServiceError, match=r"not answered in full within 0.2 s. Try again"):
        run(timeout=0.2)
    assert len(centre.queries("dataselect")) == 4


def test_an_answer_that_drips_ends(centre: DataCentre, run: Run) -> None:
    centre.waveforms["CLC", "HNE"] = [Reply(body=SOUND, content_type=MSEED, drip=0.05)]
    with pytest.raises(ServiceError, match=r"not answered in full within 0.2 s. Try again"):
        run(timeout=0.2)


@pytest.mark.parametrize(
    ("answer", "problem", "words"),
    [
        (reply(204), "XX.CLC", "no StationXML: answered 204: no data."),
        (Reply(body=b"<html/>"), "XX.CLC", "no StationXML: answer of 7 bytes is no StationXML."),
        (Reply(body=stationxml(STATIONS, ("HNE", "HNN"))), "XX.CLC.--.HNZ", "without sensitivity"),
    ],
)
def test_waveforms_without_stationxml_are_said(
    centre: DataCentre, run: Run, answer: Reply, problem: str, words: str
) -> None:
    centre.responses = [answer]
    fetched, _ = run()
    assert len(fetched.channels) == 3
    assert fetched.coverage[-1].what == problem
    assert words in fetched.coverage[-1].verdict
    assert not fetched.complete


def test_a_silent_address(request_of: Make, output: Path) -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        request = request_of(url=f"http://127.0.0.1:{nobody.getsockname()[1]}")
    with pytest.raises(ServiceError, match=r"no answer \(.*refused.*\). Try again later"):
        fetch(request, output, sleep=Patience())


def test_nothing_at_all(centre: DataCentre, run: Run) -> None:
    for channel in ("HNE", "HNN", "HNZ"):
        centre.waveforms["CLC", channel] = [reply(204)]
    with pytest.raises(
        ServiceError, match=r"no waveform was received: XX.CLC.--.HNE: answered 204"
    ):
        run()


def test_no_such_event(centre: DataCentre, request_of: Make, output: Path) -> None:
    with pytest.raises(ServiceError, match=rf"{centre.url} \(event service\): answered 204: no da"):
        fetch(request_of(event="other"), output)


@pytest.mark.parametrize("service", ["event", "station"])
@pytest.mark.parametrize("body", [b"<html/>", b"no xml", b"<?xml version='1.0'?><quakeml/>"])
def test_xml_of_something_else(
    centre: DataCentre, request_of: Make, output: Path, service: str, body: bytes
) -> None:
    centre.before_all = [Reply(body=body)]
    request = request_of(event="xx1") if service == "event" else request_of()
    kind = "QuakeML" if service == "event" else "StationXML"
    with pytest.raises(ServiceError, match=rf"answer of {len(body)} bytes is no {kind}"):
        fetch(request, output)


def test_errors_are_one_line(centre: DataCentre, run: Run) -> None:
    centre.before_all = [reply(400, "one\r\ntwo\x1b[31m\n" + "long " * 200)]
    with pytest.raises(RockframeError) as caught:
        run()
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 600


def test_stations_asked_by_name_and_not_listed(
    centre: DataCentre, request_of: Make, output: Path
) -> None:
    fetched = fetch(request_of(station="CLC,NOPE", channel="HNE,HNX"), output)
    assert {row.what: row.reason for row in fetched.coverage if row.reason} == {
        "*.NOPE": "not listed by the station service for this span and radius",
        "XX.CLC.HNX": "not listed by the station service for this span and radius",
    }
    assert math.isfinite(fetched.channels[0].distance)
    assert centre.queries("dataselect")


def test_what_obspy_cannot_convert_is_no_warning(recwarn: pytest.WarningsRecorder) -> None:
    """obspy warns in two lines of its own; the missing value is the error, in one line."""
    event = (
        b'<q:quakeml xmlns:q="http://quakeml.org/xmlns/quakeml/1.2" '
        b'xmlns="http://quakeml.org/xmlns/bed/1.2"><eventParameters publicID="a">'
        b'<event publicID="quakeml:a/b"><origin publicID="quakeml:a/o"><time><value>noon</value>'
        b"</time><latitude><value>1,5</value></latitude><longitude><value>2</value></longitude>"
        b"</origin></event></eventParameters></q:quakeml>"
    )
    with pytest.raises(ServiceError, match="none preferred and whole"):
        read_event("https://centre.example", event, "b")
    stations = (
        b'<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">'
        b"<Source>x</Source><Created>2019-01-01T00:00:00</Created>"
        b'<Network code="CI"><Station code="CLC">'
        b"<Latitude>north</Latitude><Longitude>1</Longitude><Elevation>1</Elevation>"
        b"<Site><Name>x</Name></Site></Station></Network></FDSNStationXML>"
    )
    with pytest.raises(ServiceError, match="is no StationXML"):
        read_stations("https://centre.example", stations)
    assert not recwarn.list
