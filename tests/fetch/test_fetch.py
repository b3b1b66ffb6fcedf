"""What a sound data centre sends is kept as received, and fetched once."""

from __future__ import annotations

import json
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from rockframe.cli.main import main
from rockframe.errors import InputError
from rockframe.fetch import Request, fetch
from rockframe.ingest import collect, read_catalogue
from rockframe.stages import fetch_stage
from tests.fetch.conftest import DataCentre

Make = Callable[..., Request]


def test_all_of_one_station(centre: DataCentre, request_of: Make, output: Path) -> None:
    fetched = fetch(request_of(event=None, event_id="xx1"), output)
    assert fetched.complete
    assert fetched.event is not None
    assert (fetched.event.name, fetched.event.magnitude) == ("Made up, California", 7.1)
    assert sorted(path.name for path in output.iterdir()) == [
        "XX.CLC.--.HNE.mseed",
        "XX.CLC.--.HNN.mseed",
        "XX.CLC.--.HNZ.mseed",
        "XX.CLC.xml",
        "channels.stationxml",
        "event.quakeml",
        "request.json",
    ]
    assert len(centre.queries("dataselect")) == 3
