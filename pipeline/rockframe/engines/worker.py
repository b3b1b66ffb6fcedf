"""`python -m rockframe.engines.worker [SECONDS BYTES]`: calls for the pool that started it.

Requests arrive on standard input; each is pickled twice. Replies are pairs: ``DONE`` and the
result, ``REFUSED`` and an error that the user can correct, or ``FAILED`` and the traceback of any
other error. With limits, each value of the result is sent as ``VALUE`` first. The process ends when
its input ends, even during a call: the system closes the input when the parent dies.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, BinaryIO

from rockframe.engines.pool import DONE, FAILED, OUT_OF_MEMORY, REFUSED, VALUE
from rockframe.errors import RockframeError


def main() -> None:
    """Serve until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its workers
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 0.0
    requests: SimpleQueue[bytes] = SimpleQueue()
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of a function must not mix with the replies

    def reply(kind: int, value: object) -> None:
        replies.write(pickle.dumps((kind, value), pickle.HIGHEST_PROTOCOL))
        replies.flush()

    def tell(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        reply(FAILED, "".join(traceback.format_exception(kind, error, trace)))

    sys.excepthook = tell
    source = os.fdopen(os.dup(0), "rb")
    threading.Thread(target=_listen, args=(source, requests), daemon=True).start()
    limited = False
    try:
        while True:
            call = pickle.loads(requests.get())  # noqa: S301 - from our own parent
            if seconds and not limited:  # after all imports, which take memory themselves
                _limit_memory(int(sys.argv[2]))
                limited = True
            _answer(call, reply, seconds)
    except MemoryError:
        if seconds:
            os._exit(OUT_OF_MEMORY)
        raise


def _listen(source: BinaryIO, requests: SimpleQueue[bytes]) -> None:
    """Receive requests while the main thread computes, so that the parent's death is noticed."""
    while True:
        try:
            requests.put(pickle.load(source))  # noqa: S301 - from our own parent
        except (EOFError, pickle.UnpicklingError):
            os._exit(0)


def _answer(call: Callable[[], Any], reply: Callable[[int, object], None], seconds: float) -> None:
    _set_alarm(seconds)
    try:
        result = call()
        if seconds:
            for value in result:
                reply(VALUE, value)
                _set_alarm(seconds)
            result = None
    except RockframeError as error:
        reply(REFUSED, error)
    else:
        reply(DONE, result)
    _set_alarm(0.0)


def _set_alarm(seconds: float) -> None:
    """Let the system end this process after this time, even within compiled code."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _limit_memory(size: int) -> None:
    """Limit the address space to its present size plus `size` bytes, if the system supports it."""
    mapped = Path("/proc/self/statm")
    with suppress(ImportError, FileNotFoundError):
        import resource

        now = int(mapped.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = now + size if hard == resource.RLIM_INFINITY else min(now + size, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
