"""Engines, which compute tasks in this process, a pool or on a Dask cluster; and threads.

All of them give the same results, bit for bit. Dask needs the extra ``dask``.
"""

from __future__ import annotations

import math
import os
import socket
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Generator, Iterable, Sequence, Sized
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import count, islice
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any, Final, TypeVar
from urllib.parse import urlsplit

from rockframe.engines.pool import ATTEMPTS, WorkerDiedError, WorkerPool, awaited
from rockframe.engines.watch import watched
from rockframe.errors import EngineError, ParameterError
from rockframe.interruption import check
from rockframe.provenance import source_code_hash

if TYPE_CHECKING:
    from distributed import Client

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


class Engine(ABC):
    """Base class of `OneProcess`, `ProcessPool`, `SharedWork` and `DaskScheduler`."""

    @abstractmethod
    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""


@dataclass(frozen=True)
class OneProcess(Engine):
    """The current process.

    Examples
    --------
    >>> list(OneProcess().map(abs, [-1.0, 2.0]))
    [1.0, 2.0]
    """

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        for task in tasks:
            check()
            yield function(task)


@dataclass(frozen=True)
class ProcessPool(Engine):
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

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        workers = cores() if self.workers is None else self.workers
        total = len(tasks) if isinstance(tasks, Sized) else None
        rest, spent, done = iter(tasks), 0.0, 0
        while workers == 1 or not self._worthwhile(spent, done, total):
            for task in rest:
                check()
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


@dataclass(frozen=True)
class SharedWork(Engine):
    """One worker that was started before there were tasks, and this process, which computes too.

    Parameters
    ----------
    pool : WorkerPool
        A pool of one worker.
    ready : Future
        The call that prepares the worker. Until it has ended, this process computes alone.

    Examples
    --------
    >>> with WorkerPool(1) as pool:
    ...     list(SharedWork(pool, pool.submit(os.getpid)).map(abs, [-1.0, 2.0]))
    [1.0, 2.0]
    """

    pool: WorkerPool
    ready: Future[Any]

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        found: deque[Future[Result]] = deque()
        numbers = count(1)
        for task in tasks:
            check()
            if self.ready.done() and all(future.done() for future in found):
                found.append(self.pool.submit(function, task))
            else:
                found.append(Future())
                found[-1].set_result(function(task))
            while found and found[0].done():
                yield _of_worker(found.popleft(), next(numbers))
        for future in found:
            yield _of_worker(future, next(numbers))


def map_tasks(
    function: Callable[[Task], Result], tasks: Iterable[Task], *, engine: Engine | None = None
) -> Generator[Result, None, None]:
    """Call a function on each task, and yield its results in the order of the tasks.

    Only a few tasks and results are kept at a time, so memory does not grow with their number.

    Parameters
    ----------
    function : callable
        A top-level function of a module that every worker can import. Tasks and results can be
        pickled. The function opens no netCDF file, because a Dask worker may run several threads.
    tasks : iterable
        Tasks of about 0.1 to 1 s each. For a list, the engine knows how much work is left.
    engine : Engine, optional
        By default a `ProcessPool`.

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
    yield from watched((ProcessPool() if engine is None else engine).map(function, tasks), total)


#: Longest wait for a scheduler to answer, and to have a worker, when work begins [s].
_PATIENCE: Final = 5.0
#: Interval at which the client checks, while it waits, that the scheduler has workers [s].
_PAUSE: Final = 1.0
#: Tasks that the cluster holds at a time, for each of its threads.
_AHEAD: Final = 2
#: Time that a group of tasks should take [s], because each group costs the scheduler a few
#: milliseconds; and the largest number of tasks in a group.
_WORK: Final = 1.0
_MOST: Final = 64
_MUST_BE: Final = "Must be the address of a running Dask scheduler, tcp://HOST:PORT."


@dataclass(frozen=True)
class DaskScheduler(Engine):
    """The workers of a Dask scheduler, which get several short tasks at a time.

    Parameters
    ----------
    address : str
        The address that ``dask scheduler`` prints: ``tcp://10.0.0.1:8786``.
    patience : float
        Longest time without any worker, once work has begun [s]: a cluster may replace its workers.
    shares_folder : bool
        True if the workers can read and write the folder of a run. If not, a run performs its steps
        in its own process, and only their tasks on the cluster.

    Raises
    ------
    EngineError
        From `map`: if Dask is not installed, the address does not answer, the cluster has no
        workers or loses all of them, or a worker runs another version of this package.

    Examples
    --------
    >>> DaskScheduler("tcp://10.0.0.1:8786").address
    'tcp://10.0.0.1:8786'
    """

    address: str
    patience: float = 30.0
    shares_folder: bool = True

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        with _connected(self.address) as client:
            ahead = _AHEAD * _threads(client, self.address)
            # with pure=True Dask would hash every task, to share results of equal tasks
            submit = partial(client.submit, _timed, function, pure=False)
            groups, number = _Groups(tasks), 1
            for future in in_order(submit, groups, ahead):
                groups.seconds, results = self._result(client, number, future)
                number += len(results)
                yield from results

    def _result(self, client: Client, number: int, future: Any) -> Any:
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        try:
            self._wait(client, future)
            return future.result()
        except KilledWorker as error:
            raise EngineError(
                f"task {number}: its worker at {self.address} died repeatedly ({error}). "
                "Check the memory of the workers."
            ) from None
        except CancelledError:
            raise self._lost() from None

    def _wait(self, client: Client, future: Any) -> None:
        """Wait for a result while there are workers; without workers Dask would wait for ever."""
        seen = monotonic()
        while not future.done():
            check()
            try:
                future.exception(timeout=_PAUSE)
            except TimeoutError:
                if self._has_workers(client):
                    seen = monotonic()
                elif monotonic() - seen > self.patience:
                    raise EngineError(
                        f"scheduler {self.address} has had no workers for {self.patience:g} s. "
                        "Start workers and repeat the command."
                    ) from None

    def _has_workers(self, client: Client) -> bool:
        try:
            return bool(client.nthreads())
        except OSError:
            raise self._lost() from None

    def _lost(self) -> EngineError:
        return EngineError(f"{self.address}: lost the connection to the scheduler before the end.")


class _Groups:
    """Tasks in groups, of which each takes about `_WORK` in a worker.

    ``seconds`` is the time of the latest task [s], unknown at first.
    """

    def __init__(self, tasks: Iterable[Any]) -> None:
        self._rest = iter(tasks)
        self.seconds = math.inf

    def __iter__(self) -> Generator[tuple[tuple[Any, ...]], None, None]:
        while group := tuple(islice(self._rest, self._size)):
            yield (group,)

    @property
    def _size(self) -> int:
        return max(1, math.ceil(min(_WORK / max(self.seconds, 1e-9), _MOST)))


def _timed(function: Callable[[Any], Any], group: Sequence[Any]) -> tuple[float, list[Any]]:
    """Return the time of a task [s], and the results of the group."""
    begin = perf_counter()
    results = [function(task) for task in group]
    return (perf_counter() - begin) / len(group), results


def _connected(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise EngineError(
            "Dask is not installed. Install it with: pip install 'rockframe[dask]'."
        ) from None
    _require_listening(address)
    try:
        return Client(address, timeout=_PATIENCE, set_as_default=False)
    # another kind of server may answer: its first bytes would be read as a length
    except (OSError, ValueError, MemoryError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise EngineError(f"Invalid scheduler {address!r}: {reason}. {_MUST_BE}") from None


def _require_listening(address: str) -> None:
    """Reject an address without a server at once; Dask would retry for seconds."""
    try:
        parts = urlsplit(address)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise EngineError(f"Invalid scheduler {address!r}: {error}. {_MUST_BE}") from None
    if parts.scheme not in ("tcp", "tls") or not host or not port:
        raise EngineError(f"Invalid scheduler {address!r}. {_MUST_BE}")
    try:
        socket.create_connection((host, port), timeout=_PATIENCE).close()
    except OSError as error:
        reason = error.strerror or str(error)
        raise EngineError(f"Invalid scheduler {address!r}: {reason}. {_MUST_BE}") from None


def _threads(client: Client, address: str) -> int:
    """Return the number of threads of all workers; refuse workers of another version."""
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        raise EngineError(f"scheduler {address} has no workers. Start at least one.") from None
    for worker, found in client.run(_code_of_worker).items():
        if found != source_code_hash():
            raise EngineError(
                f"Dask worker {worker} runs another version of rockframe. Install the same "
                "version on all workers, for the same results."
            )
    threads: int = sum(client.nthreads().values())
    return max(1, threads)


def _code_of_worker() -> str:
    return source_code_hash()


def choose_engine(workers: int | None = None, scheduler: str | None = None) -> Engine:
    """Return the engine for the options of a command.

    Parameters
    ----------
    workers : int, optional
        Number of processes; 1 uses only this process; by default one for each core.
    scheduler : str, optional
        Address of a Dask scheduler to use instead of processes.

    Raises
    ------
    ParameterError
        If `workers` is not positive, or both are given.

    Examples
    --------
    >>> choose_engine(1)
    OneProcess()
    >>> choose_engine(4).workers
    4
    """
    if scheduler is not None:
        if workers is not None:
            raise ParameterError("--workers and --scheduler both given. State only one of them.")
        return DaskScheduler(scheduler)
    return OneProcess() if workers == 1 else ProcessPool(workers)
