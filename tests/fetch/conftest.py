"""Fixtures of the fetch tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import rockframe.fetch  # noqa: F401  # imports obspy without its warning
from rockframe.options.fetch import FetchOptions

from .centre import EPICENTRE, ORIGIN, DataCentre, serving


@pytest.fixture
def centre(monkeypatch: pytest.MonkeyPatch) -> Iterator[DataCentre]:
    """A data centre on loopback."""
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    with serving() as server:
        yield server


@pytest.fixture
def request_of(centre: DataCentre) -> Callable[..., FetchOptions]:
    """Return a function that makes a request, by default for one minute at station CLC."""

    def make(**changes: Any) -> FetchOptions:
        settings: dict[str, Any] = {
            "url": centre.url,
            "station": "CLC",
            "before": 10.0,
            "after": 50.0,
        }
        if "event" not in changes:
            latitude, longitude = EPICENTRE
            settings |= {"origin": ORIGIN, "latitude": latitude, "longitude": longitude}
            settings |= {"magnitude": 7.1, "event_name": "M"}
        return FetchOptions(**(settings | changes))

    return make


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """The path of a folder that does not exist yet."""
    return tmp_path / "fetched"
