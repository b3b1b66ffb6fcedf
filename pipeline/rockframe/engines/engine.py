"""The rules of engines, which compute tasks; engines in this process and in a pool; and threads."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Any, Final, Protocol, TypeVar

from rockframe.engines.pool import ATTEMPTS, WorkerDiedError, WorkerPool, awaited
from rockframe.errors import EngineError, ParameterError
from rockframe.interruption import raise_if_interrupted
from rockframe.watch import watched

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
    setting = os.environ.get(_STATED, "").split(",")[0].strip()
    return int(setting) if setting.isdecimal() and int(setting) > 0 else cores()


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


Task = TypeVar("Task")
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
    function: Callable[..., Result], tasks: Iterable[Any], workers: int, first: int = 1
) -> Generator[Result, None, None]:
    """Call a function in worker processes, and yield its results in the order of the tasks.

    Parameters
    ----------
    function : callable
        A function of a module that the workers can import.
    tasks : iterable
        Taken one by one, when a worker needs the next.
    workers : int
        Number of processes, 1 or more.
    first : int
        Number of the first task, for error messages.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a task kills its workers.
    RuntimeError
        If the function raises anything else; the message contains the worker's traceback.

    Examples
    --------
    >>> import math
    >>> list(serve(math.sqrt, [4.0, 9.0], workers=1))
    [2.0, 3.0]
    """
    with WorkerPool(workers) as pool:
        futures = in_order(partial(pool.submit, function), ((task,) for task in tasks), 2 * workers)
        for number, future in enumerate(futures, first):
            yield _of_worker(future, number)


def _of_worker(future: Future[Result], number: int) -> Result:
    """Return the result of a task in a worker, whose death is an error that names the task."""
    try:
        return awaited(future)
    except WorkerDiedError as death:
        if death.said:
            failed = f"task {number} failed in its worker:\n{death.said}"
            raise RuntimeError(failed) from None
        raise EngineError(
            f"task {number}: its worker died {ATTEMPTS} times (last: {death.how}). "
            "Check that there is enough memory, or use fewer workers."
        ) from None


@dataclass(frozen=True)
class Resources:
    """The workers of an engine, as far as a run has to know them.

    Parameters
    ----------
    shares_folder : bool
        True if the workers can read and write the folder of a run.
    local : bool
        True if the workers are processes that the engine itself starts on this machine, of one
        thread each.
    workers : int, optional
        Number of these processes; by default one for each core. With 0, this process reads files
        too, without protection from crashes.

    Examples
    --------
    >>> resources_of(ProcessPool(4)).workers
    4
    """

    shares_folder: bool = True
    local: bool = False
    workers: int | None = None


class Engine(Protocol):
    """Anything with `map`: the engines of this module, the executors of `concurrent.futures`, or
    one of your own, which needs no base class.

    Stages, runs and commands know an engine only by the following rules.

    1. ``map(function, tasks)`` calls the function once on each task. The order and the place of the
       calls are free. If a worker is lost, its task may be repeated.
    2. It returns an iterable of the results in the order of the tasks.
    3. A result is what the function returns, bit for bit. An array is not rounded, and its type
       remains.
    4. `tasks` is an iterable of any length, also 0, and may be an iterator without a length. It is
       read in the thread that called `map` or reads the results, because it may read netCDF files.
       An engine that reads all tasks at once, as `concurrent.futures` does, holds all in memory.
    5. The function is a top-level function, or a `functools.partial` of one. Function, tasks and
       results can be pickled. The function opens no netCDF file and changes no global state, so
       that threads may call it. (A step of a run is a task too: it opens its files in a process of
       its own.)
    6. If the function raises a `RockframeError`, reading its result raises an equal error. Other
       errors end the command with their traceback. If the engine itself fails, it raises an
       `EngineError` that tells the user what to do.
    7. If the results are no longer read, the engine begins no further tasks as soon as it can.
    8. `map` may be called again, after its results were read to the end or not.
    9. An engine may have `resources`, a `Resources`. Without them, its workers are taken to share
       the folder of the run, so each step of a run is one task. If the folder is not shared, the
       run reads and writes all files itself, and the tasks of each step that computes go to the
       engine. If the workers are local, batches of records are tasks; other steps are performed by
       the run, and their tasks go to the engine.

    There is no rule for large values that all tasks share, because no task needs one: what a task
    needs is in the task.

    Examples
    --------
    >>> with ThreadPoolExecutor(2) as executor:
    ...     list(map_tasks(abs, [-1.0, 2.0], engine=executor))
    [1.0, 2.0]
    """

    def map(self, function: Callable[[Task], Result], tasks: Iterable[Task], /) -> Iterable[Result]:
        """Return the results of a function in the order of the tasks."""


def resources_of(engine: Engine) -> Resources:
    """Return the resources of an engine; without an attribute `resources`, the defaults.

    Examples
    --------
    >>> resources_of(ThreadPoolExecutor(2))
    Resources(shares_folder=True, local=False, workers=None)
    """
    resources: Resources = getattr(engine, "resources", Resources())
    return resources


@dataclass(frozen=True)
class OneProcess:
    """The current process.

    Parameters
    ----------
    readers : int, optional
        Number of processes that read and draw files, 0 for the current one only; by default one for
        each core.

    Examples
    --------
    >>> list(OneProcess().map(abs, [-1.0, 2.0]))
    [1.0, 2.0]
    """

    readers: int | None = 1

    @property
    def resources(self) -> Resources:
        """The current process, and those that read files."""
        return Resources(local=True, workers=self.readers)

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        for task in tasks:
            raise_if_interrupted()
            yield function(task)


@dataclass(frozen=True)
class ProcessPool:
    """Worker processes of one thread each, started only if there is enough work.

    If a worker is killed, another worker repeats its task. The workers end with this process.

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

    @property
    def resources(self) -> Resources:
        """Processes of this machine."""
        return Resources(local=True, workers=self.workers)

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        workers = cores() if self.workers is None else self.workers
        total = len(tasks) if isinstance(tasks, Sized) else None
        rest, spent, done = iter(tasks), 0.0, 0
        while workers == 1 or not self._worthwhile(spent, done, total):
            for task in rest:
                raise_if_interrupted()
                begin = perf_counter()
                result = function(task)
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


def at_once(engine: Engine) -> Engine:
    """Return the engine for tasks that are known to be long: processes are started at once.

    Examples
    --------
    >>> at_once(ProcessPool(2))
    ProcessPool(workers=2, patience=0.0)
    """
    return replace(engine, patience=0.0) if isinstance(engine, ProcessPool) else engine


def map_tasks(
    function: Callable[[Task], Result],
    tasks: Iterable[Task],
    *,
    engine: Engine | None = None,
    names: Sequence[str] = (),
) -> Generator[Result, None, None]:
    """Call a function on each task, and yield its results in the order of the tasks.

    The engines of this package keep only a few tasks and results at a time, so memory does not grow
    with their number.

    Parameters
    ----------
    function : callable
        A top-level function of a module that every worker can import. Tasks and results can be
        pickled. The function opens no netCDF file, because a Dask worker may run several threads.
    tasks : iterable
        Tasks of about 0.1 to 1 s each. For a list, the engine knows how much work is left.
    engine : Engine, optional
        Anything with `map` that keeps the rules of `Engine`; by default a `ProcessPool`.
    names : sequence of str, optional
        Names of the tasks in reports of those that take long, by default their numbers.

    Raises
    ------
    RockframeError
        If the function raises one.
    EngineError
        If a task kills its workers repeatedly, or the scheduler cannot be reached.

    Examples
    --------
    >>> list(map_tasks(abs, [-1.0, 2.0], engine=OneProcess()))
    [1.0, 2.0]
    """
    total = len(tasks) if isinstance(tasks, Sized) else None
    results = (ProcessPool() if engine is None else engine).map(function, tasks)
    with closing(watched(iter(results), total, names)) as awaited_results:
        for result in awaited_results:
            raise_if_interrupted()
            yield result
