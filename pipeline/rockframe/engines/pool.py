"""A pool of worker processes behind the interface of `concurrent.futures`."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from threading import Lock
from typing import Any, Final, ParamSpec, Self, TypeVar

from rockframe.errors import ParameterError
from rockframe.interruption import raise_if_interrupted, undoing

T = TypeVar("T")
P = ParamSpec("P")

#: First item of a worker's reply: a further value, the end, a `RockframeError`, a traceback.
VALUE: Final = 0
DONE: Final = 1
REFUSED: Final = 2
FAILED: Final = 3
#: Exit status of a worker that ran out of memory.
OUT_OF_MEMORY: Final = 86
_MEGABYTE: Final = 1 << 20
_KILLED: Final = -getattr(signal, "SIGKILL", 9)
#: Number of attempts at a call whose worker dies: the cause may lie outside the call.
ATTEMPTS: Final = 3
_LONGEST_REASON: Final = 200
#: Interval at which signals are looked for while a result is awaited [s].
_PAUSE: Final = 0.1
#: Each worker uses one thread: more threads in libraries would only compete for the cores.
_ONE_THREAD: Final = {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
}


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


class WorkerDiedError(Exception):
    """A worker ended during a call.

    Parameters
    ----------
    status : int
        Its exit status.
    said : str
        Its traceback, if it could send one.
    values : sequence
        Values that the call yielded before.
    """

    def __init__(self, status: int, said: str = "", values: Iterable[Any] = ()) -> None:
        super().__init__(status, said)
        self.status, self.said, self.values = status, said, tuple(values)

    @property
    def how(self) -> str:
        """Return a description of how the process ended."""
        if self.status < 0:
            return f"signal {-self.status}, {signal.strsignal(-self.status)}"
        return f"exit status {self.status}"

    def reason(self, limits: Limits) -> str:
        """Return a description of the cause, for a call that reads a file."""
        if self.status == -getattr(signal, "SIGALRM", 0):
            return f"timed out after {limits.seconds:g} s while reading."
        if self.status == OUT_OF_MEMORY:
            return f"ran out of memory ({limits.memory // _MEGABYTE} MB) while reading."
        said = self.said.strip().splitlines()[-1] if self.said else self.how
        return f"the reader crashed ({said[:_LONGEST_REASON]})."


class WorkerPool(Executor):
    """An executor of worker processes; a call whose worker is killed is repeated in a new one.

    The workers end when this process ends, even if it is killed.

    Parameters
    ----------
    workers : int
        Number of processes; each is started when there is a call for it.
    limits : Limits, optional
        Limits of each call. With limits, functions return iterables, and the result of a call is
        the list of their values.

    Examples
    --------
    >>> import math
    >>> with WorkerPool(1) as pool:
    ...     pool.submit(math.sqrt, 9.0).result()
    3.0
    """

    def __init__(self, workers: int, limits: Limits | None = None) -> None:
        self._forced_end = undoing(self._kill)
        self._threads = ThreadPoolExecutor(workers)
        self._team = [_Worker(limits) for _ in range(workers)]
        self._idle: SimpleQueue[_Worker] = SimpleQueue()
        for worker in self._team:
            self._idle.put(worker)

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Schedule a call; function, arguments and result must be picklable.

        If the function raises a `RockframeError`, the future raises the same error. If the function
        raises anything else, or the worker ends early, the future raises `WorkerDiedError`.
        """
        return self._threads.submit(self._call, partial(fn, *args, **kwargs))

    def _call(self, call: partial[Any]) -> Any:
        worker = self._idle.get()
        try:
            for _ in range(ATTEMPTS - 1):
                try:
                    return worker.call(call)
                except WorkerDiedError as death:
                    if not worker.may_repeat(death):
                        raise
            return worker.call(call)
        finally:
            self._idle.put(worker)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; with `cancel_futures` also those that are busy."""
        self._threads.shutdown(wait=wait and not cancel_futures, cancel_futures=cancel_futures)
        for worker in self._team:
            worker.close()
        self._threads.shutdown(wait=wait)

    def __enter__(self) -> Self:
        self._forced_end.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self.shutdown(cancel_futures=True)
        self._forced_end.__exit__(*error)

    def _kill(self) -> None:
        for worker in self._team:
            worker.kill()


def awaited(future: Future[T]) -> T:
    """Return the result of a call in a worker; while it is awaited, signals are acted on."""
    while not future.done():
        raise_if_interrupted()
        wait([future], timeout=_PAUSE)
    raise_if_interrupted()
    return future.result()


class _Worker:
    """A process that is replaced when it dies."""

    def __init__(self, limits: Limits | None) -> None:
        self._limits = limits
        self._lock = Lock()
        self._closed = False
        self._process: subprocess.Popen[bytes] | None = None

    def may_repeat(self, death: WorkerDiedError) -> bool:
        """Return True if the cause may lie outside the call; when reading files, only a kill."""
        return death.status == _KILLED if self._limits else not death.said

    def call(self, function: partial[Any]) -> Any:
        """Return the result of a call; with limits, the list of its values."""
        process, values = self._started(), list[Any]()
        if process.stdin is None or process.stdout is None:
            raise WorkerDiedError(_KILLED)
        try:
            pickle.dump(pickle.dumps(function, pickle.HIGHEST_PROTOCOL), process.stdin)
            process.stdin.flush()
            while True:
                kind, value = pickle.load(process.stdout)  # noqa: S301 - from our own worker
                if kind == DONE:
                    return value if self._limits is None else values
                if kind == REFUSED:
                    raise value
                if kind == FAILED:
                    raise WorkerDiedError(process.wait(), value, values)
                values.append(value)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError):
            raise WorkerDiedError(process.wait(), values=values) from None

    def kill(self) -> None:
        """Kill the process, without waiting for anything."""
        process = self._process
        if process is not None:
            process.kill()

    def close(self) -> None:
        """End the process permanently; a call that waits for it ends."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
                _forget(self._process)
                self._process = None

    def _started(self) -> subprocess.Popen[bytes]:
        with self._lock:
            if self._closed:
                raise WorkerDiedError(_KILLED)
            if self._process is not None and self._process.poll() is not None:
                _forget(self._process)
                self._process = None
            if self._process is None:
                limits = self._limits
                words = [] if limits is None else [str(limits.seconds), str(limits.memory)]
                self._process = subprocess.Popen(
                    # -P: a module in the user's folder must not replace a standard module.
                    [sys.executable, "-P", "-m", "rockframe.engines.worker", *words],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=None if limits is None else subprocess.DEVNULL,
                    env={**os.environ, **_ONE_THREAD},
                    # The parent handles Ctrl-C and ends its workers.
                    process_group=0,
                    creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
                )
            return self._process


def _forget(process: subprocess.Popen[bytes]) -> None:
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            try:
                stream.close()
            except OSError:  # unsent data are no longer needed
                continue
