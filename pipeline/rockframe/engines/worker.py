"""`python -m rockframe.engines.worker`: calls of functions for the pool that started it.

Requests come in on standard input, pickled: a function and its batch. Answers go out as a pair:
``DONE`` and the result, ``REFUSED`` and an error that the user can mend, or ``FAILED`` and the
traceback of what nobody foresaw. The end of the input ends the process, even in the midst of a
batch: the system closes it when the parent dies, however it dies.
"""

from __future__ import annotations

import os
import pickle
import sys
import threading
import traceback
from queue import SimpleQueue
from types import TracebackType
from typing import IO

from rockframe.engines.framing import put, take
from rockframe.engines.pool import DONE, FAILED, REFUSED
from rockframe.errors import RockframeError


def main() -> None:
    """Serve until the input ends."""
    source = os.fdopen(os.dup(0), "rb")
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a function prints must not fall among the answers

    def tell(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        text = "".join(traceback.format_exception(kind, error, trace))
        put(answers, pickle.dumps((FAILED, text)))

    sys.excepthook = tell
    requests: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(source, requests), daemon=True).start()
    while True:
        _answer(requests.get(), answers)


def _listen(source: IO[bytes], requests: SimpleQueue[bytes]) -> None:
    """Take requests while the main thread computes: only so is the parent's death noticed."""
    while True:
        try:
            requests.put(take(source))
        except EOFError:
            os._exit(0)


def _answer(request: bytes, answers: IO[bytes]) -> None:
    function, batch = pickle.loads(request)  # noqa: S301 - from our own parent
    try:
        message = pickle.dumps((DONE, function(batch)), pickle.HIGHEST_PROTOCOL)
    except RockframeError as error:
        message = pickle.dumps((REFUSED, error))
    put(answers, message)


if __name__ == "__main__":
    main()
