"""Engines: where batches are computed. What comes out is the same, bit for bit."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sized
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, Final, TypeVar

from rockframe.engines.pool import ATTEMPTS, WorkerDiedError, WorkerPool
from rockframe.engines.threads import cores
from rockframe.errors import EngineError, ParameterError

Batch = TypeVar("Batch")
Result = TypeVar("Result")
Submitted = TypeVar("Submitted")

#: What the start of a pool costs: Python, numba and the compiled kernels in each worker [s].
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
    """Call a function in worker processes, and give its results in the order of the batches.

    Parameters
    ----------
    function : callable
        Of a module that the workers can import.
    batches : iterable
        Taken as they are needed.
    workers : int
        Processes, 1 or more.
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
    with WorkerPool(workers) as pool:
        futures = in_order(partial(pool.submit, function), ((b,) for b in batches), 2 * workers)
        for number, future in enumerate(futures, first):
            try:
                yield future.result()
            except WorkerDiedError as death:
                if death.said:
                    failed = f"batch {number} failed in its worker:\n{death.said}"
                    raise RuntimeError(failed) from None
                raise EngineError(
                    f"batch {number} ended its worker {ATTEMPTS} times (the last: {death.how}). "
                    "Must leave it running: is there memory for so many workers?"
                ) from None


class Engine(ABC):
    """Computes batches: one of `OneProcess`, `ProcessPool`, `DaskScheduler`."""

    @abstractmethod
    def map(
        self, function: Callable[[Batch], Result], batches: Iterable[Batch]
    ) -> Generator[Result, None, None]:
        """Give the results of a function in the order of the batches."""


@dataclass(frozen=True)
class OneProcess(Engine):
    """The process that asks.

    Examples
    --------
    >>> list(OneProcess().map(abs, [-1.0, 2.0]))
    [1.0, 2.0]
    """

    def map(
        self, function: Callable[[Batch], Result], batches: Iterable[Batch]
    ) -> Generator[Result, None, None]:
        """Give the results of a function in the order of the batches."""
        for batch in batches:
            yield function(batch)


@dataclass(frozen=True)
class ProcessPool(Engine):
    """Worker processes of one thread each, started when there is enough to do for them.

    A worker that is killed costs its batch, which another one repeats; the death of this process
    ends them.

    Parameters
    ----------
    workers : int, optional
        Processes; by default one for each core that this process may use.
    patience : float
        So long this process computes by itself before it starts the others [s]; by default as long
        as their start takes.

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
        """Give the results of a function in the order of the batches."""
        workers = cores() if self.workers is None else self.workers
        total = len(batches) if isinstance(batches, Sized) else None
        rest, spent, done = iter(batches), 0.0, 0
        while workers == 1 or not self._worthwhile(spent, done, total):
            for batch in rest:
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
    """Call a function on each batch, and give its results in the order of the batches.

    Batches are taken, and results kept, a few at a time: memory does not grow with their number.

    Parameters
    ----------
    function : callable
        Of the top level of a module that every worker can import. Batches and results can be
        pickled. It opens no netCDF file: a Dask worker may run several threads.
    batches : iterable
        Each worth about 0.1 to 1 s; of a list it is known how much is left to do.
    engine : Engine, optional
        By default a `ProcessPool`.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a batch kills its workers again and again, or the scheduler is not there.

    Examples
    --------
    >>> list(map_batches(abs, [-1.0, 2.0], engine=OneProcess()))
    [1.0, 2.0]
    """
    yield from (ProcessPool() if engine is None else engine).map(function, batches)
