"""While nothing is compiled, another process compiles the vectorised kernel."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numba
import numpy as np
import pytest

from rockframe import Ensemble, GroundAcceleration, RockingFrame, margins
from rockframe.cli import shipped
from rockframe.engines import engine
from rockframe.rocking.kernels import lanes
from rockframe.rocking.margins.ensemble import member_peaks


@pytest.fixture(scope="module", autouse=True)
def coarse_figures() -> None:
    """Start processes here, which other tests of commands do not."""


def forms(monkeypatch: pytest.MonkeyPatch, compute: Callable[[], object]) -> set[tuple[Any, ...]]:
    """Return the types of arguments with which the kernel is called."""
    found = set()
    kind = type(cast("Any", lanes.integrate_lanes))
    call = kind.__call__

    def watched(self: Any, *arguments: Any) -> Any:
        if self is lanes.integrate_lanes:
            found.add(tuple(map(numba.typeof, arguments)))
        return call(self, *arguments)

    with monkeypatch.context() as patched:
        patched.setattr(kind, "__call__", watched)
        compute()
    return found


def test_the_other_process_compiles_the_forms_that_responses_to_records_need(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ground = GroundAcceleration.from_samples(4.0 * np.sin(np.linspace(0.0, 12.0, 100)), 0.02)
    frame = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    needed = forms(monkeypatch, lambda: margins([ground], [frame]))
    needed |= forms(monkeypatch, lambda: member_peaks([ground], [frame], Ensemble()))
    assert len(needed) == 2
    assert forms(monkeypatch, shipped._compile_kernel) == needed  # noqa: SLF001


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """Return a stand-in for the kernel, whose compilation makes a folder."""
    stand_in = SimpleNamespace(cached=lambda: False)
    monkeypatch.setattr(lanes, "integrate_lanes", stand_in)
    monkeypatch.setattr(engine, "cores", lambda: 2)
    monkeypatch.setattr(shipped, "_compile_kernel", partial(os.mkdir, tmp_path / "compiled"))
    return stand_in


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[bytes]]:
    """Return the processes that are started, in their order."""
    processes: list[subprocess.Popen[bytes]] = []
    start = subprocess.Popen

    def noted(*words: Any, **options: Any) -> subprocess.Popen[bytes]:
        processes.append(start(*words, **options))
        return processes[-1]

    monkeypatch.setattr(subprocess, "Popen", noted)
    return processes


def wait_until_one_ended(started: list[subprocess.Popen[bytes]]) -> None:
    ends = time.monotonic() + 60.0
    while not (started and started[0].poll() is not None) and time.monotonic() < ends:
        time.sleep(0.01)


@pytest.mark.usefixtures("kernel")
def test_the_first_run_compiles_in_another_process(tmp_path: Path) -> None:
    ends = time.monotonic() + 60.0
    with shipped._helped():  # noqa: SLF001
        while not (tmp_path / "compiled").exists() and time.monotonic() < ends:
            time.sleep(0.01)
    assert (tmp_path / "compiled").is_dir()


@pytest.mark.usefixtures("kernel")
def test_the_process_that_compiled_ends_before_the_command(
    started: list[subprocess.Popen[bytes]],
) -> None:
    """It holds 300 MB, which the process that draws needs."""
    with shipped._helped():  # noqa: SLF001
        wait_until_one_ended(started)
        assert [process.poll() for process in started] != [None]
    assert len(started) == 1


@pytest.mark.usefixtures("kernel")
def test_a_process_that_dies_does_not_end_the_command(
    monkeypatch: pytest.MonkeyPatch, started: list[subprocess.Popen[bytes]]
) -> None:
    monkeypatch.setattr(shipped, "_compile_kernel", os.abort)
    with shipped._helped():  # noqa: SLF001
        wait_until_one_ended(started)
    assert started[0].returncode == -signal.SIGABRT


@pytest.mark.parametrize(("cached", "cores"), [(True, 2), (False, 1)])
def test_no_process_is_started_for_a_cached_kernel_or_on_one_core(
    kernel: SimpleNamespace,
    started: list[subprocess.Popen[bytes]],
    monkeypatch: pytest.MonkeyPatch,
    cached: bool,
    cores: int,
) -> None:
    kernel.cached = lambda: cached
    monkeypatch.setattr(engine, "cores", lambda: cores)
    with shipped._helped():  # noqa: SLF001
        pass
    assert not started
