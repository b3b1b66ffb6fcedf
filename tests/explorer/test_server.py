"""The explorer's server: it answers only this machine, its own page and its token."""

from __future__ import annotations

import argparse
import asyncio
import errno
import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.parse
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from rockframe import IsolatedDeck, RockframeWarning, RockingFrame, Tendon
from rockframe.cli.explore import _motions, _shown
from rockframe.cli.main import main
from rockframe.errors import ParameterError
from rockframe.explorer.answer import Answer, answer
from rockframe.study.structures import bundled_records

from .conftest import Address
from .test_answer import BENT, unpacked

STATED = urllib.parse.urlencode({"record": "Ridgecrest2019-CCC-360", **BENT})
COMMAND = str(Path(sys.executable).parent / "rockframe")


def ask(
    explorer: Address, path: str, headers: dict[str, str] | None = None, method: str = "GET"
) -> tuple[int, http.client.HTTPMessage, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", explorer.port)
    connection.request(method, path, headers=headers or {})
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, answer.headers, content


def test_the_page_may_ask_nobody_else(explorer: Address) -> None:
    status, headers, content = ask(explorer, f"/{explorer.token}/")
    assert status == 200
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert policy.endswith("connect-src 'self'")
    assert headers["Cache-Control"] == "no-store"
    assert b"<script>alert" not in content  # the event name of the long record
    assert b"http://" not in content.replace(b"http://www.w3.org/2000/svg", b"")


def test_an_answer_is_bytes_that_the_page_unpacks(explorer: Address) -> None:
    status, _, content = ask(explorer, f"/{explorer.token}/response?{STATED}")
    facts, series = unpacked(content)
    assert status == 200
    assert facts["verdict"] == "stands"
    assert abs(series[2]).max() / facts["slenderness"] == pytest.approx(
        facts["peak_rotation_ratio"], rel=1e-3
    )


def test_a_margin_is_a_verdict_and_its_strip(explorer: Address) -> None:
    status, _, content = ask(explorer, f"/{explorer.token}/margin?{STATED}")
    assert status == 200
    told = json.loads(content)
    assert told["words"].startswith("stands; 10 % overturn at ")
    assert set(told["envelope"]) == {"time", "low", "high"}
    assert told["strip"].startswith("<svg ")


def test_a_response_does_not_wait_for_a_margin(explorer: Address) -> None:
    with ThreadPoolExecutor() as pool:
        margin = pool.submit(ask, explorer, f"/{explorer.token}/margin?{STATED}")
        status, _, _ = ask(explorer, f"/{explorer.token}/response?{STATED}")
        assert status == 200
        assert not margin.done()
        assert margin.result()[0] == 200


def test_the_page_is_served_while_responses_are_computed_of_which_few_at_once(
    explorer: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, release = threading.Semaphore(0), threading.Event()
    at_once: list[int] = []

    def slow(*words: Any) -> Answer:
        at_once.append(1)
        begun.release()
        assert release.wait(60.0)
        try:
            return answer(*words)
        finally:
            at_once.pop()

    monkeypatch.setattr("rockframe.explorer.server.answer", slow)
    with ThreadPoolExecutor(8) as pool:
        path = f"/{explorer.token}/history.csv?{STATED}"
        asked = [pool.submit(ask, explorer, path) for _ in range(6)]
        try:
            assert begun.acquire(timeout=60.0)
            assert ask(explorer, f"/{explorer.token}/")[0] == 200  # the event loop is free
            assert len(at_once) <= 2
            assert not any(future.done() for future in asked)
        finally:
            release.set()
        assert [future.result()[0] for future in asked] == [200] * 6


def test_a_client_that_does_not_read_is_disconnected_and_one_that_does_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("uvicorn", reason="no uvicorn: make test-browser")
    from uvicorn.protocols.http.flow_control import FlowControl
    from uvicorn.server import ServerState

    from rockframe.explorer.server import _Connection, configured

    monkeypatch.setattr("rockframe.explorer.server._READING_TIME", 0.05)

    async def aborted(*, reads: bool) -> bool:
        gone = asyncio.Event()
        transport: Any = SimpleNamespace(abort=gone.set)
        connection = _Connection(configured(SimpleNamespace()), ServerState(), {})  # type: ignore[arg-type]
        connection.transport, connection.flow = transport, FlowControl(transport)
        connection.pause_writing()  # the buffers are full
        if reads:
            connection.resume_writing()
        await asyncio.wait({asyncio.create_task(gone.wait())}, timeout=0.5 if reads else 60.0)
        return gone.is_set()

    assert asyncio.run(aborted(reads=False))
    assert not asyncio.run(aborted(reads=True))


def test_a_table_can_be_had(explorer: Address) -> None:
    status, headers, content = ask(explorer, f"/{explorer.token}/history.csv?{STATED}")
    assert status == 200
    assert headers["Content-Type"].startswith("text/csv")
    assert content.count(b"\n") == 10_001


def test_a_wrong_value_is_answered_with_its_name(explorer: Address) -> None:
    wrong = STATED.replace("height=9.6", "height=tall")
    status, _, content = ask(explorer, f"/{explorer.token}/response?{wrong}")
    assert status == 400
    assert json.loads(content) == {"error": "Invalid height 'tall'. Must be a finite number."}


def test_a_setting_is_stated_once(explorer: Address) -> None:
    status, _, content = ask(explorer, f"/{explorer.token}/response?{STATED}&height=3")
    assert status == 400
    assert b"stated twice" in content


@pytest.mark.parametrize("path", ["/", "/guess/", "/guess/response", "/a-token-of-the-test/"])
def test_without_the_token_nothing_is_found(explorer: Address, path: str) -> None:
    status, _, content = ask(explorer, path)
    assert status == 404
    assert explorer.token.encode() not in content


def test_nothing_else_is_there(explorer: Address) -> None:
    assert ask(explorer, f"/{explorer.token}/../etc/passwd")[0] == 404
    assert ask(explorer, f"/{explorer.token}/other")[0] == 404
    assert ask(explorer, f"/{explorer.token}/", method="POST")[0] == 405


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/", 404),
        ("GET", "/{token}/other", 404),
        ("GET", "/{token}", 307),
        ("POST", "/{token}/", 405),
        ("GET", "/{token}/response", 400),
    ],
)
def test_whoever_answers_the_headers_are_the_same(
    explorer: Address, method: str, path: str, status: int
) -> None:
    """Starlette makes some of these answers by itself; they need the same headers."""
    page = ask(explorer, f"/{explorer.token}/")[1]
    returned, headers, _ = ask(explorer, path.format(token=explorer.token), method=method)
    assert returned == status
    assert headers["Content-Security-Policy"] == "default-src 'none'"
    for name in (
        *("Cache-Control", "Cross-Origin-Resource-Policy", "Referrer-Policy"),
        *("X-Content-Type-Options", "X-Frame-Options"),
    ):
        assert len(headers.get_all(name, [])) == 1
        assert headers[name] == page[name]


def connected(explorer: Address, sent: bytes) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", explorer.port), timeout=20)
    connection.sendall(sent)
    return connection


def ended(connection: socket.socket) -> bool:
    """Return True if the server ends the connection without an answer."""
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


@pytest.mark.parametrize("sent", [b"", b"GET / HTT", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"])
def test_a_request_that_never_ends_is_not_waited_for(
    explorer: Address, monkeypatch: pytest.MonkeyPatch, sent: bytes
) -> None:
    monkeypatch.setattr("rockframe.explorer.server._REQUEST_TIME", 0.1)
    with connected(explorer, sent) as connection:
        assert ended(connection)


def test_a_second_request_that_never_ends_is_not_waited_for(
    explorer: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{explorer.port}\r\n\r\n".encode()
    with connected(explorer, whole) as connection:
        received = b""
        while not received.endswith(b"Not Found"):
            more = connection.recv(4096)
            assert more
            received += more
        monkeypatch.setattr("rockframe.explorer.server._REQUEST_TIME", 0.1)
        connection.sendall(whole[:9])
        assert ended(connection)


def test_there_are_not_too_many_connections(
    explorer: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Connections beyond the limit are closed; once another one ends, the next is answered."""
    monkeypatch.setattr("rockframe.explorer.server._MOST_CONNECTIONS", 2)
    with connected(explorer, b""), connected(explorer, b""), connected(explorer, b"") as third:
        assert ended(third)
    assert ask_when_there_is_room(explorer) == 200


def ask_when_there_is_room(explorer: Address) -> int:
    for _ in range(200):
        try:
            return ask(explorer, f"/{explorer.token}/")[0]
        except (ConnectionError, http.client.HTTPException):
            time.sleep(0.05)
    raise AssertionError("no room")


def test_another_host_is_refused(explorer: Address) -> None:
    """A foreign host name must be refused even if it resolves to this machine (DNS rebinding)."""
    for host in ("evil.example", f"evil.example:{explorer.port}", "127.0.0.1", "127.0.0.1:1"):
        assert ask(explorer, f"/{explorer.token}/", {"Host": host})[0] == 403
    assert ask(explorer, f"/{explorer.token}/", {"Host": f"localhost:{explorer.port}"})[0] == 200


def test_another_page_is_refused(explorer: Address) -> None:
    path = f"/{explorer.token}/response?{STATED}"
    for origin in ("http://evil.example", "null", f"https://127.0.0.1:{explorer.port}"):
        assert ask(explorer, path, {"Origin": origin})[0] == 403
    assert ask(explorer, path, {"Origin": f"http://127.0.0.1:{explorer.port}"})[0] == 200


@pytest.mark.skipif(os.name == "nt", reason="no signal for one process on this system")
@pytest.mark.usefixtures("explorer")
def test_the_command_says_where_and_stops_with_one_line(motion: Path) -> None:
    records = motion.with_name("records.nc")
    stated = ["--units", "g", "--time-step", "0.01", "--output", str(records)]
    assert main(["ingest", str(motion), *stated]) == 0
    words = [COMMAND, "explore", "--no-browser", "--json", "--records", str(records)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    said = ""
    while "}" not in said:
        said += process.stdout.readline()
    address = json.loads(said)["address"]
    assert address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(address) as page:  # noqa: S310 -- our own address
        assert b"Rocking explorer" in page.read()
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20)
    assert (process.returncode, error) == (0, "rockframe: explorer stopped.\n")


@pytest.mark.usefixtures("explorer")
def test_a_port_in_use_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        assert main(["explore", "--no-browser", "--port", port]) == 2
    assert capsys.readouterr().err == (
        f"rockframe: error: port {port} cannot be opened: {os.strerror(errno.EADDRINUSE)}. "
        "Choose another with --port.\n"
    )


@pytest.mark.parametrize("package", ["h11", "starlette", "uvicorn"])
def test_without_the_extra_the_command_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], package: str
) -> None:
    for name in [module for module in sys.modules if module.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)

    def lack(name: str, *_: object) -> None:
        if name == package:
            raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(sys, "meta_path", [SimpleNamespace(find_spec=lack), *sys.meta_path])
    monkeypatch.delitem(sys.modules, "rockframe.explorer.server", raising=False)
    assert main(["explore"]) == 2
    assert capsys.readouterr().err == (
        f"rockframe: error: {package} is not installed. Install the explorer with: "
        "pip install 'rockframe[explorer]'.\n"
    )


def test_another_version_of_uvicorn_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The class of its connections is not in its documentation, and may move."""
    module = ModuleType("uvicorn.protocols.http.h11_impl")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "rockframe.explorer.server", raising=False)
    assert main(["explore"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("rockframe: error: uvicorn is of another version. Install")
    assert said.count("\n") == 1


def test_a_port_is_a_number(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(["explore", "--port", "99999"])
    assert stopped.value.code == 2
    assert "Invalid port '99999'. Must be 0 to 65535" in capsys.readouterr().err


def test_structures_that_the_page_cannot_show_are_named() -> None:
    free = RockingFrame(height=9.6, width=1.6, name="free")
    tied = replace(
        free,
        name="tied",
        column_mass=48e3,
        tendon=Tendon(area=2.8e-4, modulus=195e9, length=9.6),
    )
    with pytest.warns(RockframeWarning, match=r"only: without 'tied'\."):
        assert _shown([free, tied]) == [free]
    deck = IsolatedDeck(period=3.0, strength_ratio=0.05, yield_displacement=0.01, name="isolated")
    with pytest.warns(RockframeWarning, match=r"only: without 'isolated'\."):
        assert _shown([free, deck]) == [free]
    with pytest.raises(ParameterError, match=r"density, only\. .* 'tied' are not"):
        _shown([tied])


def test_both_components_of_a_station_follow_its_second_one() -> None:
    """They have the vertical component of the station, as each of them has."""
    options = argparse.Namespace(records=[bundled_records() / "Ridgecrest2019-CCC.V1"])
    found = _motions(options)
    names = [motion.record.record_id for motion in found]
    assert names == ["Ridgecrest2019-CCC-090", "Ridgecrest2019-CCC-360", "Ridgecrest2019-CCC-both"]
    assert [motion.in_both for motion in found] == [False, False, True]
    assert all(motion.has_vertical for motion in found)
    assert found[2].search is None
