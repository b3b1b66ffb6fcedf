"""Threads of this process, for work that releases the GIL: compiled kernels, large arrays."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

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
