"""Ctrl-C and SIGTERM: commands note the signal, and end where no file is half written.

Python would raise `KeyboardInterrupt` anywhere, also in the middle of netCDF or of a lock, where it
can be lost or wait for ever. So a command only notes the signal (`noting`), and the code calls
`raise_if_interrupted` between batches, files and steps and while it waits. If a computation does
not call it within 5 s, or a second signal comes, the process ends at once, after the partial files
are removed.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

#: Exit status of an interrupted command: 128 and the number of SIGINT.
STATUS: Final = 130
#: Longest time from a signal to the end of the process [s].
_PATIENCE: Final = 5.0
#: A signal within this time belongs to the first: shells signal a process and its group [s].
_SAME: Final = 1.0
#: The signals, and what Python does with them by default.
_DEFAULTS: Final[dict[int, Any]] = {
    signal.SIGINT: signal.default_int_handler,
    signal.SIGTERM: signal.SIG_DFL,
}
_STOP: Final = b"\0"

_noted = threading.Event()
#: Callbacks that a forced end calls, the latest first.
_undoing: list[Callable[[], object]] = []
#: What remains of an interrupted command; the last one holds.
_kept: list[str] = []


def raise_if_interrupted() -> None:
    """Raise KeyboardInterrupt if a signal was noted; call it where nothing is half done.

    Examples
    --------
    >>> raise_if_interrupted()
    """
    if _noted.is_set() and _in_main():
        raise KeyboardInterrupt(_what_remains())


def said(remains: str = "") -> str:
    """Return the message of an interrupted command.

    Examples
    --------
    >>> said("finished batches are kept")
    'rockframe: interrupted; finished batches are kept.'
    """
    return f"rockframe: interrupted; {remains or _what_remains()}."


def _in_main() -> bool:
    return threading.current_thread() is threading.main_thread()


def _what_remains() -> str:
    return _kept[-1] if _kept else "no incomplete file is left"


@contextmanager
def keeping(remains: str) -> Iterator[None]:
    """State what remains if the block is interrupted, for the message."""
    _kept.append(remains)
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(remains) from None
    finally:
        _kept.remove(remains)


@contextmanager
def undoing(action: Callable[[], object]) -> Iterator[None]:
    """Let a forced end within the block call `action`, which must not wait for a lock."""
    _undoing.append(action)
    try:
        yield
    finally:
        _undoing.remove(action)


@contextmanager
def noting() -> Iterator[Callable[[], bool]]:
    """Note SIGINT and SIGTERM in the block, for `raise_if_interrupted`.

    A signal that is ignored stays ignored.

    Yields a function that returns True if a signal was noted. Outside the main thread, nothing is
    changed.
    """
    numbers = [
        signal_number
        for signal_number, default in _DEFAULTS.items()
        if signal.getsignal(signal_number) == default
    ]
    if not (numbers and _in_main()):
        yield _noted.is_set
        return
    listening, sending = socket.socketpair()
    sending.setblocking(False)
    watch = threading.Thread(target=_watch, args=(listening,), daemon=True)
    # Python calls handlers between two of its instructions; the socket is written at once.
    former = signal.set_wakeup_fd(sending.fileno(), warn_on_full_buffer=False)
    watch.start()
    for number in numbers:
        signal.signal(number, _ignore)
    try:
        yield _noted.is_set
    finally:
        for number in numbers:
            signal.signal(number, _DEFAULTS[number])
        signal.set_wakeup_fd(former)
        sending.setblocking(True)
        sending.send(_STOP)
        watch.join()
        _noted.clear()
        listening.close()
        sending.close()


def _ignore(*_: object) -> None:
    """Do nothing: the thread of `noting` hears the signal."""


def ignore() -> None:
    """Ignore Ctrl-C from now on."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def raising() -> Iterator[None]:
    """Let signals raise KeyboardInterrupt at once: for waiting, where nothing can be half done."""
    raise_if_interrupted()
    numbers = (
        [signal_number for signal_number in _DEFAULTS if signal.getsignal(signal_number) is _ignore]
        if _in_main()
        else []
    )
    for number in numbers:
        signal.signal(number, signal.default_int_handler)
    heard = signal.set_wakeup_fd(-1) if numbers else -1
    try:
        yield
    finally:
        if numbers:
            signal.set_wakeup_fd(heard, warn_on_full_buffer=False)
        for number in numbers:
            signal.signal(number, _ignore)


def _watch(listening: socket.socket) -> None:
    first = 0.0
    while True:
        left = first + _PATIENCE - time.monotonic() if first else None
        if not select.select([listening], [], [], left and max(left, 0.0))[0]:
            _end()
        heard = listening.recv(1)
        if heard == _STOP:
            return
        if heard[0] not in _DEFAULTS:
            continue
        if not first:
            first = time.monotonic()
            _noted.set()
        elif time.monotonic() - first > _SAME:
            _end()


def _end() -> None:
    """End the process at once: remove partial files, kill the workers, and say so."""
    for action in reversed(list(_undoing)):
        with suppress(OSError):
            action()
    # the main thread may hold the lock of sys.stderr; rich hides the cursor of a terminal
    cursor = "\x1b[?25h\n" if sys.stderr is not None and sys.stderr.isatty() else ""
    with suppress(OSError):
        os.write(2, f"{cursor}{said()}\n".encode())
    os._exit(STATUS)
