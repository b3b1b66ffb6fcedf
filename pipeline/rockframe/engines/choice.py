"""The engine for the options of a command: this process, a pool, or a Dask cluster."""

from __future__ import annotations

from rockframe.engines.dask import DaskScheduler
from rockframe.engines.engine import Engine, OneProcess, ProcessPool
from rockframe.errors import ParameterError


def choose_engine(
    workers: int | None = None, scheduler: str | None = None, *, shares_folder: bool = True
) -> Engine:
    """Return the engine for the options of a command.

    Parameters
    ----------
    workers : int, optional
        Number of processes; 1 uses only this process; by default one for each core.
    scheduler : str, optional
        Address of a Dask scheduler to use instead of processes.
    shares_folder : bool
        True if the workers of the scheduler can read and write the folder of a run.

    Raises
    ------
    ParameterError
        If `workers` is not positive, if both are given, or if processes are not to share a folder.

    Examples
    --------
    >>> choose_engine(1)
    OneProcess(readers=1)
    >>> choose_engine(4)
    ProcessPool(workers=4, patience=2.0)
    """
    if scheduler is not None:
        if workers is not None:
            raise ParameterError("--workers and --scheduler both given. State only one of them.")
        return DaskScheduler(scheduler, shares_folder=shares_folder)
    if not shares_folder:
        raise ParameterError("--no-shared-folder without --scheduler. State both, or neither.")
    return OneProcess() if workers == 1 else ProcessPool(workers)
