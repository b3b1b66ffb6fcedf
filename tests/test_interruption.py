"""Signals are noted, and commands end where nothing is half done: no test depends on a time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from rockframe.engines.engine import OneProcess, ProcessPool, map_tasks
from rockframe.interruption import keeping, noting, raise_if_interrupted, raising
from rockframe.provenance import whole_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="sends itself a signal")
SIGNALS = [signal.SIGINT, signal.SIGTERM]


def signalled(one: int) -> None:
    """Send this process a signal, and wait until it is noted."""
    os.kill(os.getpid(), one)
    for _ in range(10_000):
        try:
            raise_if_interrupted()
        except KeyboardInterrupt:
            return
        threading.Event().wait(0.001)
    raise AssertionError("not noted")


@pytest.mark.parametrize("one", SIGNALS)
def test_a_signal_is_only_noted(one: int) -> None:
    """Code is not interrupted before its next call of `raise_if_interrupted`."""
    with noting() as noted:
        assert not noted()
        raise_if_interrupted()
        signalled(one)
        assert noted()
        with keeping("batches are kept"), pytest.raises(KeyboardInterrupt, match="batches are"):
            raise_if_interrupted()
    raise_if_interrupted()
    assert signal.getsignal(one) in (signal.default_int_handler, signal.SIG_DFL)


@pytest.mark.parametrize("engine", [OneProcess(), ProcessPool(2), ProcessPool(2, patience=0.0)])
def test_no_engine_begins_a_further_batch(engine: Any) -> None:
    results = map_tasks(abs, iter([-1, -2, -3]), engine=engine)
    with noting():
        assert next(results) == 1
        signalled(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            list(results)


def test_a_file_that_is_begun_is_finished(tmp_path: Path) -> None:
    """The signal comes while the file is written: it appears whole, and no further file."""
    with noting():
        with whole_file(tmp_path / "a.txt") as partial:
            signalled(signal.SIGINT)
            partial.write_text("whole")
        with pytest.raises(KeyboardInterrupt), whole_file(tmp_path / "b.txt"):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_other_threads_are_not_interrupted() -> None:
    """Only the main thread can end a command; a thread that writes a file goes on."""
    raised: list[BaseException] = []

    def elsewhere() -> None:
        try:
            raise_if_interrupted()
        except BaseException as error:  # noqa: BLE001
            raised.append(error)

    with noting():
        signalled(signal.SIGINT)
        thread = threading.Thread(target=elsewhere)
        thread.start()
        thread.join()
    assert raised == []


def wait_for_ever() -> None:
    os.kill(os.getpid(), signal.SIGTERM)
    while True:
        threading.Event().wait(1.0)


def test_while_a_command_waits_signals_raise_at_once() -> None:
    with noting() as noted:
        with pytest.raises(KeyboardInterrupt), raising():
            wait_for_ever()
        assert not noted()
        signalled(signal.SIGINT)


def test_an_ignored_signal_stays_ignored() -> None:
    """`nohup` and shells start background jobs so."""
    former = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with noting():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, former)


_STUCK = """
import sys
from pathlib import Path
from rockframe import interruption
from rockframe.provenance import whole_file

folder, how = Path(sys.argv[1]), sys.argv[2]
interruption._PATIENCE, interruption._SAME = (0.2, 60.0) if how == "waits" else (600.0, 0.0)
stuck = "__import__('time').sleep(600)"
with interruption.noting(), whole_file(folder / "a.txt") as partial:

    print(partial.name, flush=True)
    eval(stuck)
"""


@pytest.mark.parametrize("how", ["waits", "second signal"])
def test_a_computation_that_does_not_end_is_ended(tmp_path: Path, how: str) -> None:
    """It never calls `raise_if_interrupted`: the process ends all the same, and leaves no file."""
    script = tmp_path / "script.py"
    script.write_text(_STUCK)
    folder = tmp_path / "folder"
    folder.mkdir()
    process = subprocess.Popen(
        [sys.executable, str(script), str(folder), how],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    partial = process.stdout.readline().strip()
    assert [path.name for path in folder.iterdir()] == [partial]
    while process.poll() is None:
        process.send_signal(signal.SIGINT)
        if how == "waits":
            break
        threading.Event().wait(0.05)
    said = process.communicate()[1]
    assert process.returncode == 130
    assert said == "rockframe: interrupted; no incomplete file is left.\n"
    assert list(folder.iterdir()) == []


_TOO_LATE = """
import os, signal, sys, time
from rockframe.cli import formats
from rockframe.cli.main import main

run_formats = formats.run_formats
def late(options):
    run_formats(options)
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(0.5)
formats.run_formats = late
sys.exit(main(["formats"]))
"""


def test_a_signal_after_the_work_is_not_swallowed(tmp_path: Path) -> None:
    """A loop of a shell ends with status 130, although this command was already done."""
    script = tmp_path / "script.py"
    script.write_text(_TOO_LATE)
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert ran.returncode == 130
    assert ran.stderr == "rockframe: interrupted; the command had finished.\n"
    assert "AT2" in ran.stdout
