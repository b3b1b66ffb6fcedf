"""Compilation of numerical functions, and the cache of compiled code."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])

#: Files whose compiled functions call each other; a file elsewhere calls only its own.
_KERNELS: Final = sorted((Path(__file__).parent / "rocking" / "kernels").glob("*.py"))


@cache
def _fingerprint(source: Path) -> str:
    """Hash a source file and all files whose functions it may call: numba itself misses changes
    in other files.
    """
    digest = hashlib.sha256()
    for path in (Path(__file__), *(_KERNELS if source in _KERNELS else [source])):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def compiled(function: F) -> F:
    """Compile a function at its first call, and cache the result on disk if possible.

    The names of the cache files contain the fingerprint of the sources. Each operation is rounded
    separately: fused multiply-add would save 1 to 4 % of the time, but the last bits would then
    depend on the processor.
    """
    return _compile(function, forceinline=False)


def inlined(function: F) -> F:
    """Compile a function into each caller, so that the compiler can vectorise the loops there."""
    return _compile(function, forceinline=True)


def _compile(function: F, *, forceinline: bool) -> F:
    fingerprint = _fingerprint(Path(function.__code__.co_filename))
    function.__qualname__ = f"{function.__qualname__}-{fingerprint}"
    options: dict[str, Any] = {
        "nogil": True,
        "error_model": "numpy",
        "forceinline": forceinline,
        # nothing calls these from C, or inlined ones from Python: compiling takes a tenth less
        "no_cfunc_wrapper": True,
        "no_cpython_wrapper": forceinline,
        # inlined functions allocate nothing; reference counting of their arrays took an eighth
        # of the time
        "_nrt": not forceinline,
    }
    dispatcher = numba.njit(**options)(function)
    with suppress(RuntimeError):  # no folder to cache in: a read-only installation
        dispatcher._cache = _Cache(function)  # noqa: SLF001  the attribute of numba's own cache
    return cast("F", dispatcher)


class _Cache:
    """Numba's cache on disk. After a full disk or a corrupted file, functions compile again."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._files = cast("Any", FunctionCache)(function)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._files, name)

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the cached code, or None."""
        try:
            return self._files.load_overload(signature, target)
        except (OSError, EOFError, pickle.UnpicklingError):
            with suppress(OSError):
                self._files.flush()
            return None

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Cache compiled code.

        LLVM swallows an interrupt during compilation and returns no code. Numba then finds nothing
        to cache, and the interrupt is raised here.
        """
        try:
            self._files.save_overload(signature, compiled)
        except (OSError, EOFError, pickle.UnpicklingError):
            return
        except RuntimeError as error:
            if "no compiled object" in str(error):
                raise KeyboardInterrupt from error
            raise
