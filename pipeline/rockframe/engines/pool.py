"""A pool of worker processes: a worker that is killed costs its batch, which is repeated."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from queue import SimpleQueue
from threading import Lock
from typing import Any, Final, TypeVar

from rockframe.engines.framing import put, take
from rockframe.errors import EngineError

Batch = TypeVar("Batch")
Result = TypeVar("Result")

#: How an answer of a worker begins.
DONE: Final = 0
REFUSED: Final = 1
FAILED: Final = 2
#: So often a batch whose worker dies is given to a new one, before the batch is to blame.
_ATTEMPTS: Final = 3
#: Batches that may be done before their results are asked for, a worker; the memory they take.
_AHEAD: Final = 2
#: The pool is the parallel part; threads of libraries below it would only fight for the cores.
_ONE_THREAD: Final = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}


def serve(
    function: Callable[[Batch], Result], batches: Iterable[Batch], workers: int, first: int = 1
) -> Generator[Result, None, None]:
    """Call a function in worker processes, and give its results in the order of the batches.

    Parameters
    ----------
    function : callable
        Of a module that the workers can import; batches and results can be pickled.
    batches : iterable
        Taken as they are needed.
    workers : int
        Processes, 1 or more; each is started when there is a batch for it.
    first : int
        Number of the first batch, for errors.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a batch kills its workers.
    RuntimeError
        If the function raises anything else: with the worker's traceback.

    Examples
    --------
    >>> import math
    >>> list(serve(math.sqrt, [4.0, 9.0], workers=1))
    [2.0, 3.0]
    """
    idle: SimpleQueue[_Worker] = SimpleQueue()
    team = [_Worker() for _ in range(workers)]
    for worker in team:
        idle.put(worker)

    def call(number: int, batch: Batch) -> Any:
        worker = idle.get()
        try:
            return _repeated(worker, function, batch, number)
        finally:
            idle.put(worker)

    threads = ThreadPoolExecutor(workers)
    waiting: deque[Future[Any]] = deque()
    try:
        for number, batch in enumerate(batches, start=first):
            waiting.append(threads.submit(call, number, batch))
            if len(waiting) >= workers * _AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
        for worker in team:
            worker.close()
        threads.shutdown()


def _repeated(worker: _Worker, function: Callable[..., Any], batch: object, number: int) -> Any:
    status = 0
    for _ in range(_ATTEMPTS):
        try:
            kind, value = worker.call(function, batch)
        except EOFError:
            status = worker.wait()
            continue
        if kind == DONE:
            return value
        if kind == REFUSED:
            raise value
        raise RuntimeError(f"batch {number} failed in its worker:\n{value}")
    how = f"signal {-status}, {signal.strsignal(-status)}" if status < 0 else f"status {status}"
    raise EngineError(
        f"batch {number} ended its worker {_ATTEMPTS} times (the last: {how}). Must leave it "
        "running: is there memory for so many workers?"
    )


class _Worker:
    """A process that is replaced when it dies; a class because it holds that process."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None

    def call(self, function: Callable[..., Any], batch: object) -> tuple[int, Any]:
        """Return the answer to a batch; EOFError if the process ends without one."""
        message = pickle.dumps((function, batch), pickle.HIGHEST_PROTOCOL)
        process = self._started()
        if process.stdin is None or process.stdout is None:
            raise EOFError
        try:
            put(process.stdin, message)
        except OSError:
            raise EOFError from None
        kind, value = pickle.loads(take(process.stdout))  # noqa: S301 - from our own worker
        return int(kind), value

    def wait(self) -> int:
        """Return the exit status of a process that has given up its pipes; 0 if there is none."""
        with self._lock:
            process = self._process
        return 0 if process is None else process.wait()

    def close(self) -> None:
        """End the process for good; a call that waits for it ends."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
                _forget(self._process)
                self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._closed:
                raise EOFError
            if self._process is not None and self._process.poll() is not None:
                _forget(self._process)
                self._process = None
            if self._process is None:
                self._process = subprocess.Popen(
                    # -P: a module of the user's folder must not stand in for one of Python's.
                    [sys.executable, "-P", "-m", "rockframe.engines.worker"],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env={**os.environ, **_ONE_THREAD},
                    process_group=0,  # Ctrl-C is for the parent, which ends its workers
                )
            return self._process


def _forget(process: subprocess.Popen[bytes]) -> None:
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            try:
                stream.close()
            except OSError:  # what was not sent to it is of no use any more
                continue
