"""Compilation of numerical functions, and the cache of compiled code."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])

_SOURCES = sorted(Path(__file__).parent.glob("*.py"))


@cache
def _fingerprint(source: Path) -> str:
    """Hash all files compiled with one: numba misses a change of a function in another file.

    The files of this room know each other; one elsewhere calls nothing of another's.
    """
    digest = hashlib.sha256()
    for path in _SOURCES if source in _SOURCES else (Path(__file__), source):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def compiled(function: F) -> F:
    """Compile when it is first called, with numba's cache on disk where one can be written.

    The names of its files there hold the fingerprint of the sources. Each operation is rounded by
    itself: products and sums fused where the processor can do so would save 1 to 4 % of the time,
    and the last bits would depend on the processor.
    """
    return _compile(function, forceinline=False)


def inlined(function: F) -> F:
    """Compile into each caller: what a loop must contain for the compiler to make it of vectors."""
    return _compile(function, forceinline=True)


def _compile(function: F, *, forceinline: bool) -> F:
    fingerprint = _fingerprint(Path(function.__code__.co_filename))
    function.__qualname__ = f"{function.__qualname__}-{fingerprint}"
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "forceinline": forceinline,
        # nobody calls these from C, nor those within others from Python: a tenth less to compile
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": forceinline,
        # what is inlined allocates nothing; counting references to its arrays took an eighth of
        # the time
        "_nrt": not forceinline,
    }
    dispatcher = numba.njit(**options)(function)
    with suppress(RuntimeError):  # no folder to cache in: a read-only installation
        dispatcher._cache = _Cache(function)  # noqa: SLF001  where numba keeps its own
    return cast("F", dispatcher)


class _Cache:
    """Numba's cache on disk, of which a full disk or a damaged file costs nothing but time."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._files = cast("Any", FunctionCache)(function)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._files, name)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return what is kept, or nothing."""
        try:
            return self._files.load_overload(signature, target)
        except (OSError, EOFError, pickle.UnpicklingError):
            with suppress(OSError):
                self._files.flush()
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep what was compiled.

        An interrupt while it was compiled is lost in LLVM, and so is the outcome: numba then finds
        nothing to keep, and the interrupt is raised here.
        """
        try:
            self._files.save_overload(signature, compiled)
        except (OSError, EOFError, pickle.UnpicklingError):
            return
        except RuntimeError as error:
            if "no compiled object" in str(error):
                raise KeyboardInterrupt from error
            raise
