"""Threads of this process, for work that releases the GIL: compiled kernels, large arrays."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

Part = TypeVar("Part")
Result = TypeVar("Result")

#: What pools, Dask's nannies and Snakemake state for each of their processes, and users do for one.
_STATED: Final = "OMP_NUM_THREADS"
#: What a thread of `on_threads` knows of itself.
_OF_THREAD: Final = threading.local()


def cores() -> int:
    """Return how many cores this process may use.

    Examples
    --------
    >>> cores() >= 1
    True
    """
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def threads() -> int:
    """Return how many threads may compute for the one that asks.

    As many as ``OMP_NUM_THREADS`` says: 1 in the workers of a pool. Where it is not set, one for
    each core. Within a thread of `on_threads` 1, for the cores are in use.

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
    """Call a function on each part, on as many threads as there may be.

    Parameters
    ----------
    function : callable
        Releases Python's lock for most of its time, and changes nothing that others see.
    parts : sequence
        As many as `threads`, or more.

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
    with ThreadPoolExecutor(count, initializer=_take) as pool:
        return list(pool.map(function, parts))


def _take() -> None:
    _OF_THREAD.taken = True
