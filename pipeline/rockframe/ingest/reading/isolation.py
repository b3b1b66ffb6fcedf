"""Read files in worker processes; a crash, timeout or lack of memory becomes a message."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from rockframe.engines.engine import in_order
from rockframe.engines.pool import Limits, WorkerDiedError, WorkerPool
from rockframe.engines.threads import cores
from rockframe.errors import ParameterError

T = TypeVar("T")

#: Amount of text per worker that makes another worker worthwhile [bytes]; a start takes 0.2 s.
_BYTES_A_WORKER: Final = 16 << 20
#: Number of calls per worker that are computed in advance; limits memory.
_AHEAD: Final = 4


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
        Time limit of each result of a call, and memory limit of a worker.

    Yields
    ------
    Served
        In the order of the calls.

    Examples
    --------
    >>> import os
    >>> from contextlib import closing
    >>> with closing(serve(os._exit, [(3,)], 1, Limits())) as served:
    ...     next(served).failure
    'the reader crashed (exit status 3).'
    """
    with WorkerPool(workers, limits) as pool:
        for future in in_order(partial(pool.submit, function), calls, workers * _AHEAD):
            try:
                yield Served(tuple(future.result()))
            except WorkerDiedError as death:
                yield Served(death.values, death.reason(limits))
