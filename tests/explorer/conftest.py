"""Fixtures of the explorer: a server of bundled records and of a very long record."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from rockframe import PairAcceleration, UnequalBent
from rockframe.explorer.answer import ExploredMotion
from rockframe.record import Record
from rockframe.rocking import GroundAcceleration
from rockframe.study.structures import bundled_records, read_structures

#: Two unequal columns beside the structures of the package.
PIERS = UnequalBent(
    heights=(9.0, 7.0), widths=(1.4, 1.5), spacing=12.0, mass_ratio=3.6, name="piers"
)
TOKEN = "a-token-of-the-tests"  # noqa: S105 -- it opens nothing else


def motion(record: Record, vertical: Record | None = None) -> ExploredMotion:
    ground = GroundAcceleration.from_samples(record.acceleration, record.time_step)
    if vertical is not None:
        upward = GroundAcceleration.from_samples(vertical.acceleration, vertical.time_step)
        ground = ground.with_vertical(upward)
    return ExploredMotion(record, ground)


@pytest.fixture(scope="session")
def bundled() -> list[ExploredMotion]:
    """Both horizontals of one bundled station; the first one has its vertical."""
    from rockframe.ingest import read_file

    records = read_file(bundled_records() / "Ridgecrest2019-CCC.V1")
    across = [record for record in records if not record.orientation.upright]
    (upward,) = (record for record in records if record.orientation.upright)
    return [motion(across[0], upward), motion(across[1])]


@pytest.fixture(scope="session")
def both(bundled: list[ExploredMotion]) -> ExploredMotion:
    """Both components of this station and its vertical, for the strong 30 s."""
    first, second = (motion.record for motion in bundled)
    strong = slice(2400, 5400)
    ground = PairAcceleration(
        first.acceleration[strong],
        second.acceleration[strong],
        first.time_step,
        0.5 * first.acceleration[strong],
    )
    named = replace(first, record_id="CCC-both", component="both")
    return ExploredMotion(named, ground, None)


@pytest.fixture(scope="session")
def long() -> ExploredMotion:
    """A motion of ten minutes at 100 Hz, that is, 60,000 samples."""
    time = 0.01 * np.arange(60_000)
    wave = np.random.default_rng(7).normal(0.0, 1.0, time.size)
    smooth = np.convolve(wave, np.hanning(40), "same")
    envelope = np.exp(-(((time - 200.0) / 60.0) ** 2))
    strong = 4.0 * envelope * smooth / np.abs(smooth).max()
    name = "<script>alert(1)</script>"
    return motion(Record(record_id="long", acceleration=strong, time_step=0.01, event=name))


@dataclass(frozen=True)
class Address:
    """The port of a server, and the token that starts every path."""

    port: int
    token: str

    @property
    def page(self) -> str:
        """URL of the page."""
        return f"http://127.0.0.1:{self.port}/{self.token}/"


@pytest.fixture(scope="session")
def explorer(
    bundled: list[ExploredMotion], long: ExploredMotion, both: ExploredMotion
) -> Iterator[Address]:
    """The address of a server that runs in a thread."""
    pytest.importorskip("starlette", reason="no starlette: make test-browser")
    uvicorn: Any = pytest.importorskip("uvicorn", reason="no uvicorn: make test-browser")
    import socket

    from rockframe.explorer.server import application, configured

    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        app = application([*bundled, long, both], [*read_structures(), PIERS], TOKEN, port)
        server = uvicorn.Server(configured(app))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        yield Address(port, TOKEN)
        server.should_exit = True
        thread.join()
