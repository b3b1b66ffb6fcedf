"""What the tests of fetching share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rockframe.fetch.request import Event, Request

from .centre import EPICENTRE, ORIGIN, DataCentre, serving


@pytest.fixture
def centre(monkeypatch: pytest.MonkeyPatch) -> Iterator[DataCentre]:
    """A data centre on loopback."""
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with serving() as made:
        yield made


@pytest.fixture
def request_of(centre: DataCentre) -> Callable[..., Request]:
    """Return a request of one minute around the event at station CLC, or as told."""

    def make(**changes: Any) -> Request:
        event = Event(
            time=ORIGIN, latitude=EPICENTRE[0], longitude=EPICENTRE[1], magnitude=7.1, name="M"
        )
        stated: dict[str, Any] = {
            "url": centre.url,
            "event": event,
            "station": "CLC",
            "before": 10.0,
            "after": 50.0,
        }
        return Request(**(stated | changes))

    return make


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """A folder that is not there yet."""
    return tmp_path / "fetched"
