"""Engines, which compute batches, and threads; all of them give the same results, bit for bit."""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence, Sized
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, Final, TypeVar

from rockframe.engines.pool import ATTEMPTS, WorkerDiedError, WorkerPool, awaited
from rockframe.errors import EngineError, ParameterError
from rockframe.interruption import check

Part = TypeVar("Part")
Result = TypeVar("Result")

#: Variable by which pools, Dask, Snakemake and users limit the threads of a process.
_STATED: Final = "OMP_NUM_THREADS"
#: Marks the threads of `on_threads`.
_OF_THREAD: Final = threading.local()


def cores() -> int:
    """Return the number of cores that this process may use.

    Examples
    --------
    >>> cores() >= 1
    True
    """
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def threads() -> int:
    """Return the number of threads that the caller may use.

    This is the value of ``OMP_NUM_THREADS``, which is 1 in the workers of a pool; if it is not set,
    the number of cores. Within a thread of `on_threads` it is 1, because the cores are in use.

    Examples
    --------
    >>> threads() >= 1
    True
    """
    if getattr(_OF_THREAD, "taken", False):
        return 1
    stated = os.environ.get(_STATED, "").split(",")[0].strip()
    return int(stated) if stated.isdecimal() and int(stated) > 0 else cores()


def on_threads(function: Callable[[Part], Result], parts: Sequence[Part]) -> list[Result]:
    """Call a function on each part, on the available threads.

    Parameters
    ----------
    function : callable
        Releases Python's global lock for most of its time, and has no side effects.
    parts : sequence
        Arguments of the calls; to use all threads, at least `threads()` of them.

    Returns
    -------
    list
        The results, in the order of the parts.

    Examples
    --------
    >>> on_threads(abs, [-1.0, 2.0])
    [1.0, 2.0]
    """
    count = min(threads(), len(parts))
    if count <= 1:
        return [function(part) for part in parts]
    with ThreadPoolExecutor(count, initializer=_mark_thread) as pool:
        return list(pool.map(function, parts))


def _mark_thread() -> None:
    _OF_THREAD.taken = True


Batch = TypeVar("Batch")
Submitted = TypeVar("Submitted")

#: Time that a pool needs to start: Python, numba and compiled kernels in each worker [s].
_START: Final = 2.0


def in_order(
    submit: Callable[..., Submitted], calls: Iterable[tuple[Any, ...]], ahead: int
) -> Generator[Submitted, None, None]:
    """Submit calls as they are needed, and yield their futures in order.

    Parameters
    ----------
    submit : callable
        Takes the arguments of a call, and returns its future.
    calls : iterable of tuple
        The arguments of each call.
    ahead : int
        Number of calls that may be submitted before their results are used.
    """
    waiting: deque[Submitted] = deque()
    for arguments in calls:
        waiting.append(submit(*arguments))
        if len(waiting) >= ahead:
            yield waiting.popleft()
    while waiting:
        yield waiting.popleft()


def serve(
    function: Callable[..., Result], batches: Iterable[Any], workers: int, first: int = 1
) -> Generator[Result, None, None]:
    """Call a function in worker processes, and yield its results in the order of the batches.

    Parameters
    ----------
    function : callable
        A function of a module that the workers can import.
    batches : iterable
        Taken one by one, when a worker needs the next.
    workers : int
        Number of processes, 1 or more.
    first : int
        Number of the first batch, for error messages.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a batch kills its workers.
    RuntimeError
        If the function raises anything else; the message contains the worker's traceback.

    Examples
    --------
    >>> import math
    >>> list(serve(math.sqrt, [4.0, 9.0], workers=1))
    [2.0, 3.0]
    """
    with WorkerPool(workers) as pool:
        futures = in_order(partial(pool.submit, function), ((b,) for b in batches), 2 * workers)
        for number, future in enumerate(futures, first):
            try:
                yield awaited(future)
            except WorkerDiedError as death:
                if death.said:
                    failed = f"batch {number} failed in its worker:\n{death.said}"
                    raise RuntimeError(failed) from None
                raise EngineError(
                    f"batch {number}: its worker died {ATTEMPTS} times (last: {death.how}). "
                    "Check that there is enough memory, or use fewer workers."
                ) from None


class Engine(ABC):
    """Base class of `OneProcess`, `ProcessPool` and `DaskScheduler`."""

    @abstractmethod
    def map(
        self, function: Callable[[Batch], Result], batches: Iterable[Batch]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the batches."""


@dataclass(frozen=True)
class OneProcess(Engine):
    """The current process.

    Examples
    --------
    >>> list(OneProcess().map(abs, [-1.0, 2.0]))
    [1.0, 2.0]
    """

    def map(
        self, function: Callable[[Batch], Result], batches: Iterable[Batch]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the batches."""
        for batch in batches:
            check()
            yield function(batch)


@dataclass(frozen=True)
class ProcessPool(Engine):
    """Worker processes of one thread each, started only if there is enough work.

    If a worker is killed, another worker repeats its batch. The workers end with this process.

    Parameters
    ----------
    workers : int, optional
        Number of processes; by default one for each core that this process may use.
    patience : float
        Time that this process computes alone before it starts workers [s]; by default the time that
        their start takes.

    Raises
    ------
    ParameterError
        If `workers` is not positive.

    Examples
    --------
    >>> list(ProcessPool(2).map(abs, [-1.0, 2.0]))  # too small a job: no process is started
    [1.0, 2.0]
    """

    workers: int | None = None
    patience: float = _START

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise ParameterError(f"Invalid number of workers {self.workers}. Must be 1 or more.")

    def map(
        self, function: Callable[[Batch], Result], batches: Iterable[Batch]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the batches."""
        workers = cores() if self.workers is None else self.workers
        total = len(batches) if isinstance(batches, Sized) else None
        rest, spent, done = iter(batches), 0.0, 0
        while workers == 1 or not self._worthwhile(spent, done, total):
            for batch in rest:
                check()
                begin = perf_counter()
                result = function(batch)
                spent, done = spent + perf_counter() - begin, done + 1
                break
            else:
                return
            yield result
        yield from serve(function, rest, workers, first=done + 1)

    def _worthwhile(self, spent: float, done: int, total: int | None) -> bool:
        """Return True if the rest probably takes longer than starting the workers."""
        if spent < self.patience:
            return False
        return total is None or done == 0 or spent / done * (total - done) > self.patience


def map_batches(
    function: Callable[[Batch], Result], batches: Iterable[Batch], *, engine: Engine | None = None
) -> Generator[Result, None, None]:
    """Call a function on each batch, and yield its results in the order of the batches.

    Only a few batches and results are kept at a time, so memory does not grow with their number.

    Parameters
    ----------
    function : callable
        A top-level function of a module that every worker can import. Batches and results can be
        pickled. The function opens no netCDF file, because a Dask worker may run several threads.
    batches : iterable
        Batches of about 0.1 to 1 s each. For a list, the engine knows how much work is left.
    engine : Engine, optional
        By default a `ProcessPool`.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a batch kills its workers repeatedly, or the scheduler cannot be reached.

    Examples
    --------
    >>> list(map_batches(abs, [-1.0, 2.0], engine=OneProcess()))
    [1.0, 2.0]
    """
    yield from (ProcessPool() if engine is None else engine).map(function, batches)
