"""The engine that a command's options state."""

from __future__ import annotations

from rockframe.engines.engine import Engine, OneProcess, ProcessPool
from rockframe.engines.scheduler import DaskScheduler
from rockframe.errors import ParameterError


def choose_engine(workers: int | None = None, scheduler: str | None = None) -> Engine:
    """Return the engine that the options of a command state.

    Parameters
    ----------
    workers : int, optional
        Processes: 1 is this one alone; by default one for each core.
    scheduler : str, optional
        Address of a Dask scheduler instead.

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
            raise ParameterError("--workers given with --scheduler. Must be one of them.")
        return DaskScheduler(scheduler)
    return OneProcess() if workers == 1 else ProcessPool(workers)
