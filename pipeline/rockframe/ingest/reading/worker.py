"""`python -m rockframe.ingest.reading.worker SECONDS BYTES`: call functions under limits.

Requests arrive on standard input, pickled: a function and its arguments. Each value that the
function yields is sent as ``(True, value)``, the end as ``(False, None)``. The process ends when
its input ends, which includes the death of the parent.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from pathlib import Path
from typing import BinaryIO

from rockframe.ingest.reading.isolation import OUT_OF_MEMORY


def main() -> None:
    """Serve until the input ends."""
    seconds, memory = float(sys.argv[1]), int(sys.argv[2])
    # Ctrl-C reaches the whole process group, but the parent ends its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # output of a reader must not mix with the replies
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
    """Let the system end this process after some time, even within compiled code."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds)


def _limit_memory(size: int) -> None:
    """Limit the address space to its present size plus `size` bytes, if the system supports it."""
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
