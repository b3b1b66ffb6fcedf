"""Fetching from a real FDSN dataselect server with a real index, on loopback."""

from __future__ import annotations

import importlib.util
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from rockframe.fetch.run import fetch
from rockframe.options.fetch import FetchOptions

from .centre import miniseed, waveform

pytestmark = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("portable_fdsnws_dataselect", "mseedindex"))),
    reason="portable-fdsnws-dataselect and mseedindex are not installed (extra `dev`)",
)
START = "2019-07-06T03:19:00"
CONFIGURATION = """
[index_db]
path = index.sqlite
summary_table = tsindex_summary
[server]
interface = 127.0.0.1
port = {port}
"""


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _wait_for(port: int, process: subprocess.Popen[bytes]) -> None:
    for _ in range(200):
        assert process.poll() is None, "the server ended"
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    pytest.fail("the server does not listen")


@pytest.fixture(scope="module")
def dataselect(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a server with a complete HNE, an HNN with a gap, and no HNZ."""
    folder = tmp_path_factory.mktemp("archive")
    pieces = {
        "HNE": [waveform("CLC", "HNE", START, 200.0)],
        "HNN": [
            waveform("CLC", "HNN", START, 60.0),
            waveform("CLC", "HNN", "2019-07-06T03:20:10", 100.0),
        ],
    }
    for channel, traces in pieces.items():
        (folder / f"{channel}.mseed").write_bytes(miniseed(*traces))
    files = [str(path) for path in sorted(folder.glob("*.mseed"))]
    make_index = "from mseedindex.__main__ import main; main()"
    # The server (2.0.2) reads the mark at the end of an index as an offset, so a span that ends
    # after the last entry is empty. An entry every 5 s, instead of every hour, avoids this.
    options = ["-si", "5", "-sqlite", str(folder / "index.sqlite")]
    index = [sys.executable, "-c", make_index, *options, *files]
    subprocess.run(index, check=True, capture_output=True, timeout=30)
    port = _free_port()
    (folder / "server.ini").write_text(CONFIGURATION.format(port=port))
    server = [sys.executable, "-m", "portable_fdsnws_dataselect.server", "server.ini"]
    subprocess.run([*server, "--init"], cwd=folder, check=True, capture_output=True, timeout=30)
    with subprocess.Popen(
        server, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            _wait_for(port, process)
            yield f"http://127.0.0.1:{port}"
        finally:
            process.kill()


def test_what_it_holds_and_what_it_lacks(
    dataselect: str, request_of: Callable[..., FetchOptions], output: Path
) -> None:
    here = request_of()
    fetched = fetch(request_of(url=dataselect, station_url=here.url, timeout=10.0), output)
    verdicts = {row.what: row.verdict for row in fetched.coverage}
    assert verdicts["XX.CLC.--.HNE"] == "complete"
    assert verdicts["XX.CLC.--.HNN"] == "gap of 9.99 s before 2019-07-06T03:20:10.000000Z"
    assert verdicts["XX.CLC.--.HNZ"].startswith("answered 204: no data.")
    assert (output / "XX.CLC.--.HNE.mseed").stat().st_size % 512 == 0


def test_it_states_its_version(
    dataselect: str, request_of: Callable[..., FetchOptions], output: Path
) -> None:
    here = request_of()
    fetch(request_of(url=dataselect, station_url=here.url, timeout=10.0), output)
    assert (
        '"url": "' + dataselect + '",\n      "version": "1.'
        in (output / "request.json").read_text()
    )
