"""Calls in worker processes: what crashes, hangs or eats memory there is a sentence here."""

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

from rockframe.engines import cores
from rockframe.errors import ParameterError

T = TypeVar("T")

#: Exit status of a worker whose memory did not suffice.
OUT_OF_MEMORY: Final = 86
_MEGABYTE: Final = 1 << 20
#: A further worker pays for its start (0.2 s) from this much text on [bytes].
_BYTES_A_WORKER: Final = 16 * _MEGABYTE
_LONGEST_REASON: Final = 200
#: How a process ends that was killed from outside, which is not the file's fault: so often it is
#: read anew before it is blamed (it may be why the system lacks memory).
_KILLED: Final = -getattr(signal, "SIGKILL", 9)
_ATTEMPTS: Final = 3
#: Calls of each worker that may be done before their values are asked for; the memory they take.
_AHEAD: Final = 4


@dataclass(frozen=True)
class Limits:
    """What a worker may take, on systems with POSIX timers and resource limits.

    Parameters
    ----------
    seconds : float
        Time for a file, or for a member of an archive [s].
    memory : int
        Memory beyond what an idle worker has [bytes].

    Raises
    ------
    ParameterError
        If one is not positive.

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
    """What a call in a worker gave: its values, and why it ended early, if it did."""

    values: Sequence[T]
    failure: str = ""


def worker_count(workers: int | None, paths: Sequence[Path]) -> int:
    """Return how many workers to start: no more than files, cores, and the bytes are worth.

    Parameters
    ----------
    workers : int or None
        Most workers; None is one for each core, 0 is none: reading in this process.
    paths : sequence of Path
        The files.

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
    """Call a function in worker processes.

    Close the iterator (`contextlib.closing`) to end the workers early.

    Parameters
    ----------
    function : callable
        Of a module that the workers can import; its values can be pickled.
    calls : sequence of tuple
        The arguments of each call.
    workers : int
        Processes, 1 or more.
    limits : Limits
        Of each call.

    Yields
    ------
    Served
        In the order of the calls.

    Examples
    --------
    >>> from contextlib import closing
    >>> with closing(serve(os._exit, [(3,)], 1, Limits())) as served:
    ...     next(served).failure
    'crashed its reader (exit status 3). Must be readable.'
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
    """A long-lived process, replaced when it dies; a class because it holds that process."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._lock = Lock()
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None
        self._said: IO[bytes] | None = None

    def call(self, function: Callable[..., Iterable[T]], arguments: tuple[Any, ...]) -> Served[T]:
        for _ in range(_ATTEMPTS - 1):
            status, served = self._once(function, arguments)
            if status != _KILLED:
                return served
        return self._once(function, arguments)[1]

    def _once(
        self, function: Callable[..., Iterable[T]], arguments: tuple[Any, ...]
    ) -> tuple[int, Served[T]]:
        """The exit status, 0 if the process lives, and what it gave."""
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
        """End the process for good; a call that waits for it returns."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
                self._forget(self._process)

    def _started(self) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._closed:
                return None
            if self._process is not None and self._process.poll() is not None:
                self._forget(self._process)
            if self._process is None:
                self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
                limits = [str(self._limits.seconds), str(self._limits.memory)]
                # -P: a module of the user's folder must not stand in for one of Python's.
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-m", "rockframe.ingest.worker", *limits],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._said,
                    # Threads of the linear algebra would cost each worker their start.
                    env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
                )
            return self._process

    def _forget(self, process: subprocess.Popen[bytes]) -> None:
        process.wait()
        for stream in (process.stdin, process.stdout, self._said):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:  # what was not sent to it is of no use any more
                    continue
        self._process = None

    def _reason(self, status: int) -> str:
        if status == -getattr(signal, "SIGALRM", 0):
            return f"took longer than {self._limits.seconds:g} s to read. Must be readable in less."
        if status == OUT_OF_MEMORY:
            megabytes = self._limits.memory // _MEGABYTE
            return f"took more than {megabytes} MB of memory to read. Must be readable in less."
        return f"crashed its reader ({self._last_words(status)}). Must be readable."

    def _last_words(self, status: int) -> str:
        if status < 0:
            return f"signal {-status}, {signal.strsignal(-status)}"
        lines: list[bytes] = []
        if self._said is not None and not self._said.closed:
            self._said.seek(0)
            lines = self._said.read().strip().splitlines()
        traceback = b"Traceback (most recent call last):" in lines
        said = lines[-1].decode("utf-8", "replace") if traceback else f"exit status {status}"
        return said[:_LONGEST_REASON]
