"""Call functions in worker processes; a crash, timeout or lack of memory becomes a message."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Lock
from typing import IO, Any, Final, Generic, TypeVar

from rockframe.engines.threads import cores
from rockframe.errors import ParameterError

T = TypeVar("T")

#: Exit status of a worker that ran out of memory.
OUT_OF_MEMORY: Final = 86
_MEGABYTE: Final = 1 << 20
#: Text per worker for which starting another one (0.2 s) is worthwhile [bytes].
_BYTES_A_WORKER: Final = 16 * _MEGABYTE
_LONGEST_REASON: Final = 200
#: Exit status of a process killed from outside. The file is then read again before it is rejected,
#: up to this number of attempts, because it may still be the cause (the system may lack memory).
_KILLED: Final = -getattr(signal, "SIGKILL", 9)
_ATTEMPTS: Final = 3
#: Number of calls per worker that are computed ahead of their use; limits memory.
_AHEAD: Final = 4


@dataclass(frozen=True)
class Limits:
    """Limits of a worker; they need POSIX timers and resource limits.

    Parameters
    ----------
    seconds : float
        Time for a file or an archive member [s].
    memory : int
        Memory in addition to that of an idle worker [bytes].

    Raises
    ------
    ParameterError
        If a limit is not positive.

    Examples
    --------
    >>> Limits(seconds=10.0).seconds
    10.0
    """

    seconds: float = 60.0
    memory: int = 2048 * _MEGABYTE

    def __post_init__(self) -> None:
        if not (self.seconds > 0.0 and self.memory > 0):
            raise ParameterError(
                f"Invalid limits {self.seconds!r} s, {self.memory!r} bytes. Must be positive."
            )


@dataclass(frozen=True)
class Served(Generic[T]):
    """Values of a call in a worker, and the reason if it ended early."""

    values: Sequence[T]
    failure: str = ""


def worker_count(workers: int | None, paths: Sequence[Path]) -> int:
    """Return the number of workers to start, limited by the number and size of the files.

    Parameters
    ----------
    workers : int or None
        Largest number of workers; None is one per core, 0 is none (read in this process).
    paths : sequence of Path
        Files to read.

    Raises
    ------
    ParameterError
        If `workers` is negative.

    Examples
    --------
    >>> worker_count(4, [Path("one.AT2"), Path("two.AT2")])
    1
    """
    if workers is None:
        workers = cores()
    if workers < 0:
        raise ParameterError(f"Invalid number of workers {workers}. Must be 0 or more.")
    size = sum(path.stat().st_size for path in paths if path.is_file())
    return min(workers, len(paths), 1 + size // _BYTES_A_WORKER)


def serve(
    function: Callable[..., Iterable[T]],
    calls: Sequence[tuple[Any, ...]],
    workers: int,
    limits: Limits,
) -> Generator[Served[T], None, None]:
    """Yield the results of calling a function in worker processes.

    Close the iterator (`contextlib.closing`) to end the workers early.

    Parameters
    ----------
    function : callable
        Function that the workers can import and whose values can be pickled.
    calls : sequence of tuple
        Arguments of each call.
    workers : int
        Number of processes, 1 or more.
    limits : Limits
        Limits of each value of a call.

    Yields
    ------
    Served
        In the order of the calls.

    Examples
    --------
    >>> from contextlib import closing
    >>> with closing(serve(os._exit, [(3,)], 1, Limits())) as served:
    ...     next(served).failure
    'the reader crashed (exit status 3).'
    """
    idle: SimpleQueue[_Worker] = SimpleQueue()
    team = [_Worker(limits) for _ in range(workers)]
    for worker in team:
        idle.put(worker)

    def call(arguments: tuple[Any, ...]) -> Served[T]:
        worker = idle.get()
        try:
            return worker.call(function, arguments)
        finally:
            idle.put(worker)

    threads = ThreadPoolExecutor(workers)
    waiting: deque[Future[Served[T]]] = deque()
    try:
        for arguments in calls:
            waiting.append(threads.submit(call, arguments))
            if len(waiting) > workers * _AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
        for worker in team:
            worker.close()
        threads.shutdown()


class _Worker:
    """A long-lived worker process, which is replaced when it dies."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._lock = Lock()
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None
        self._stderr: IO[bytes] | None = None

    def call(self, function: Callable[..., Iterable[T]], arguments: tuple[Any, ...]) -> Served[T]:
        for _ in range(_ATTEMPTS - 1):
            status, served = self._call_once(function, arguments)
            if status != _KILLED:
                return served
        return self._call_once(function, arguments)[1]

    def _call_once(
        self, function: Callable[..., Iterable[T]], arguments: tuple[Any, ...]
    ) -> tuple[int, Served[T]]:
        """Return the exit status (0 if the process is alive) and the values."""
        process = self._started()
        values: list[T] = []
        if process is None or process.stdin is None or process.stdout is None:
            return 0, Served(values, "not read: the run was ended.")
        try:
            pickle.dump((function, arguments), process.stdin)
            process.stdin.flush()
            while True:
                more, value = pickle.load(process.stdout)  # noqa: S301 - from our own worker
                if not more:
                    return 0, Served(values)
                values.append(value)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            status = process.wait()
            return status, Served(values, self._reason(status))

    def close(self) -> None:
        """End the process permanently; a call that waits for it returns."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
                self._close_streams(self._process)

    def _started(self) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._closed:
                return None
            if self._process is not None and self._process.poll() is not None:
                self._close_streams(self._process)
            if self._process is None:
                self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
                limits = [str(self._limits.seconds), str(self._limits.memory)]
                # -P: a module in the user's folder must not shadow the standard library.
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "rockframe.ingest.reading.worker", *limits],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._stderr,
                    # Starting linear-algebra threads in each worker would cost time.
                    env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                )
            return self._process

    def _close_streams(self, process: subprocess.Popen[bytes]) -> None:
        process.wait()
        for stream in (process.stdin, process.stdout, self._stderr):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:  # unsent data are no longer needed
                    continue
        self._process = None

    def _reason(self, status: int) -> str:
        if status == -getattr(signal, "SIGALRM", 0):
            return f"timed out after {self._limits.seconds:g} s while reading."
        if status == OUT_OF_MEMORY:
            megabytes = self._limits.memory // _MEGABYTE
            return f"ran out of memory ({megabytes} MB) while reading."
        return f"the reader crashed ({self._last_line(status)})."

    def _last_line(self, status: int) -> str:
        if status < 0:
            return f"signal {-status}, {signal.strsignal(-status)}"
        lines: list[bytes] = []
        if self._stderr is not None and not self._stderr.closed:
            self._stderr.seek(0)
            lines = self._stderr.read().strip().splitlines()
        traceback = b"Traceback (most recent call last):" in lines
        said = lines[-1].decode("utf-8", "replace") if traceback else f"exit status {status}"
        return said[:_LONGEST_REASON]
