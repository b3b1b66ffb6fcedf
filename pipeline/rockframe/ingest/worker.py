"""`python -m rockframe.ingest.worker SECONDS BYTES`: calls of functions, under limits.

Requests come in on standard input, pickled: a function and its arguments. Each value that the
function yields goes out as ``(True, value)``, its end as ``(False, None)``. The end of the input,
which the death of the parent is too, ends the process.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from pathlib import Path
from typing import BinaryIO

from rockframe.ingest.quarantine import OUT_OF_MEMORY


def main() -> None:
    """Serve until the input ends."""
    seconds, memory = float(sys.argv[1]), int(sys.argv[2])
    # Ctrl-C reaches the whole group; it is for the parent to end its workers.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a reader prints must not fall among the replies
    _limit_memory(memory)
    try:
        while requests.peek(1):
            _serve(requests, replies, seconds)
    except MemoryError:
        raise SystemExit(OUT_OF_MEMORY) from None


def _serve(requests: BinaryIO, replies: BinaryIO, seconds: float) -> None:
    function, arguments = pickle.load(requests)  # noqa: S301 - from our own parent
    _set_alarm(seconds)
    for value in function(*arguments):
        pickle.dump((True, value), replies, pickle.HIGHEST_PROTOCOL)
        replies.flush()
        _set_alarm(seconds)
    _set_alarm(0.0)
    pickle.dump((False, None), replies)
    replies.flush()


def _set_alarm(seconds: float) -> None:
    """Let the system end this process after so long, even in the midst of compiled code."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _limit_memory(size: int) -> None:
    """Limit the address space to what is mapped now and `size` bytes, where the system can."""
    mapped = Path("/proc/self/statm")
    if mapped.exists():
        import resource

        now = int(mapped.read_text(encoding="ascii").split()[0]) * resource.getpagesize()
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        limit = now + size if hard == resource.RLIM_INFINITY else min(now + size, hard)
        resource.setrlimit(resource.RLIMIT_AS, (limit, hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


if __name__ == "__main__":
    main()
