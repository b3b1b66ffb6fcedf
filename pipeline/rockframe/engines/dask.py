"""An engine that computes tasks on a Dask cluster. It needs the extra ``dask``."""

from __future__ import annotations

import logging
import math
import pickle
import socket
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from itertools import islice
from time import monotonic, perf_counter
from typing import TYPE_CHECKING, Any, Final, TypeVar
from urllib.parse import urlsplit

from rockframe.engines.engine import Resources, in_order
from rockframe.errors import EngineError
from rockframe.interruption import raise_if_interrupted
from rockframe.provenance import page_source_hash, source_code_hash

if TYPE_CHECKING:
    from distributed import Client

Task = TypeVar("Task")
Result = TypeVar("Result")

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
class DaskScheduler:
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

    @property
    def resources(self) -> Resources:
        """Workers of a cluster."""
        return Resources(shares_folder=self.shares_folder)

    def map(
        self, function: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Generator[Result, None, None]:
        """Yield the results of a function in the order of the tasks."""
        with _silent_client() as noted, noted(_connected(self.address)) as client:
            ahead = _AHEAD * _threads(client, self.address)
            # with pure=True Dask would hash every task, to share results of equal tasks
            submit = partial(client.submit, _timed, function, pure=False)
            groups, number = _Groups(tasks), 1
            for future in in_order(submit, groups, ahead):
                groups.seconds, pickled = self._result(client, number, future)
                results = pickle.loads(pickled)  # noqa: S301 -- from our own worker
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
            raise_if_interrupted()
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
        message = f"{self.address}: lost the connection to the scheduler before the end."
        return EngineError(f"{message} Start it again and repeat the command.")


#: States of a client that has lost its scheduler.
_WITHOUT_SCHEDULER: Final = ("connecting", "closing", "closed")


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


def _timed(function: Callable[[Any], Any], group: Sequence[Any]) -> tuple[float, bytes]:
    """Return the time of a task [s], and the pickled results of the group.

    Dask would send each array apart: sixty of them cost the client a millisecond.
    """
    begin = perf_counter()
    results = [function(task) for task in group]
    seconds = (perf_counter() - begin) / len(group)
    return seconds, pickle.dumps(results, pickle.HIGHEST_PROTOCOL)


@contextmanager
def _silent_client() -> Generator[Callable[[Client], Client], None, None]:
    """Drop what Dask's client logs of a lost connection: an `EngineError` says it in one line.

    Yields a function that takes the client, and returns it.
    """
    logger = logging.getLogger("distributed.client")
    clients: list[Client] = []

    def is_not_of_a_lost_connection(record: logging.LogRecord) -> bool:
        # without its scheduler the client fails in several ways
        are_lost = [client for client in clients if client.status in _WITHOUT_SCHEDULER]
        return not (are_lost or _is_of_connection(record))

    def noted(client: Client) -> Client:
        clients.append(client)
        return client

    logger.addFilter(is_not_of_a_lost_connection)
    try:
        yield noted
    finally:
        logger.removeFilter(is_not_of_a_lost_connection)


def _is_of_connection(record: logging.LogRecord) -> bool:
    from distributed.comm import CommClosedError

    error = record.exc_info[1] if record.exc_info else None
    while error is not None:
        if isinstance(error, CommClosedError | ConnectionError):
            return True
        error = error.__cause__ or error.__context__
    return False


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
    for worker, code in client.run(_code).items():
        if code != _code():
            raise EngineError(
                f"Dask worker {worker} runs another version of rockframe. Install the same "
                "version on all workers, for the same results."
            )
    threads: int = sum(client.nthreads().values())
    return max(1, threads)


def _code() -> tuple[str, str]:
    return source_code_hash(), page_source_hash()
