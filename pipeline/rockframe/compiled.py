"""Compilation of numerical functions, and the cache of compiled code."""

from __future__ import annotations

import gc
import hashlib
import operator
import pickle
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache, update_wrapper
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from threading import RLock
from typing import IO, Any, Final, TypeVar, cast

from rockframe.errors import RockframeWarning

F = TypeVar("F", bound=Callable[..., Any])

#: Files whose compiled functions call each other. Those of `unequal.kernels` also call them, and
#: `matching.loops` calls `wavelets.loops`; a file elsewhere calls only its own.
_KERNELS: Final = sorted((Path(__file__).parent / "rocking" / "kernels").glob("*.py"))
_UNEQUAL: Final = sorted((Path(__file__).parent / "unequal" / "kernels").glob("*.py"))
_MATCHING: Final = [Path(__file__).parent / name / "loops.py" for name in ("matching", "wavelets")]
#: Held while a function is made.
_MAKING: Final = RLock()
#: Functions to call before the first compilation of this process.
_BEFORE_COMPILING: Final[list[Callable[[], None]]] = []


def before_compiling(tell: Callable[[], None]) -> None:
    """Call a function once, before this process first compiles instead of reading the cache."""
    _BEFORE_COMPILING[:] = [tell]


def tell_of_compiling() -> None:
    """Call the function of `before_compiling`, unless it was called before."""
    while _BEFORE_COMPILING:
        _BEFORE_COMPILING.pop()()


@cache
def _fingerprint(source: Path) -> str:
    """Hash a source file and all files whose functions it may call: numba itself misses changes
    in other files.
    """
    digest = hashlib.sha256()
    called = [source]
    if source in _KERNELS:
        called = _KERNELS
    elif source in _UNEQUAL:
        called = [*_KERNELS, *_UNEQUAL]
    elif source == _MATCHING[0]:
        called = _MATCHING
    for path in (Path(__file__), *called):
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
        # nothing calls these from C: compiling takes a tenth less
        "no_cfunc_wrapper": True,
        # inlined functions allocate nothing; reference counting of their arrays took an eighth
        # of the time
        "_nrt": not forceinline,
    }
    return cast("F", _Compiled(function, options))


#: Parts of numba that this module uses and that may change: the module of each, and its name.
INTERNALS: Final = (
    *(("numba.core.caching", f"FunctionCache.{name}") for name in ("cache_path", "flush")),
    *(("numba.core.caching", f"FunctionCache.{name}_overload") for name in ("load", "save")),
    ("numba.core.caching", "FunctionCache._index_key"),
    *(("numba.core.dispatcher", f"Dispatcher.{name}") for name in ("compile", "get_call_template")),
    *(("numba.core.options", f"DefaultOptions.{name}") for name in ("_nrt", "forceinline")),
    *(("numba.core.options", f"DefaultOptions.no_{name}_wrapper") for name in ("cfunc", "cpython")),
    *(("numba.core.config", name) for name in ("CPU_NAME", "CPU_FEATURES")),
    ("numba.core.codegen", "get_host_cpu_features"),
    ("numba.core.types", "unliteral"),
    ("numba.core.types.functions", "BaseFunction.get_call_type"),
)
#: Functions whose types numba searches for only once for each kind of numbers.
_OPERATORS: Final = frozenset(getattr(operator, name) for name in operator.__all__)
#: The feature of a processor that LLVM takes as advice against vectors of 512 bits.
_NARROW: Final = "prefer-256-bit"
#: Options that every version of numba has. They give the same results.
_PLAIN: Final[dict[str, Any]] = {"nogil": True, "error_model": "numpy"}


@cache
def has_internals() -> bool:
    """Return True if numba has all parts that this module uses; otherwise warn once."""
    for module, name in INTERNALS:
        try:
            operator.attrgetter(name)(import_module(module))
        except (ImportError, AttributeError):
            warnings.warn(
                f"numba {version('numba')} has no {module}.{name}: functions are compiled without "
                "it, which takes longer. Install the version that pip chooses for rockframe.",
                RockframeWarning,
                stacklevel=2,
            )
            return False
    return True


def _plain(function: Callable[..., Any], *, cached: bool) -> Any:
    """Return a function that numba compiles and caches by its own means."""
    import numba

    with suppress(RuntimeError):  # no folder to cache in
        return numba.njit(**_PLAIN, cache=cached)(function)
    return numba.njit(**_PLAIN)(function)


class _Compiled:
    """A function that numba compiles. The first call imports numba, which many commands need not.

    Numba makes one function that Python calls, and another one that compiled functions call. The
    latter is part of the code of its callers, so it is not cached and Python cannot call it.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        self._function, self._options = function, options
        self._dispatcher: Any = None
        self._inner: Any = None
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return (self._dispatcher or self.dispatcher())(*arguments)

    def __getattr__(self, name: str) -> Any:
        """Return a public attribute of the function that numba made, such as `py_func`."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.dispatcher(), name)

    def dispatcher(self) -> Any:
        """Return the function that Python calls, with its cache."""
        with _MAKING:  # threads may call a function at once, and it would be compiled twice
            if self._dispatcher is None:
                numba = _prepared_numba()
                if not has_internals():
                    self._dispatcher = _plain(self._function, cached=True)
                    return self._dispatcher
                dispatcher = numba.njit(**self._options)(self._function)
                if not numba.config.DISABLE_JIT:  # numba then returns the function as it is
                    dispatcher.compile = _without_collection(dispatcher.compile)
                    try:
                        dispatcher._cache = kept = _Cache(self._function)  # noqa: SLF001  numba's own
                        dispatcher.compile = kept.one_process_at_a_time(dispatcher.compile)
                    except RuntimeError:  # no folder to cache in: read-only installation
                        tell_of_compiling()
                self._dispatcher = dispatcher
            return self._dispatcher

    def cached(self) -> bool:
        """Return True if the cache has code of this function, or if there is no cache."""
        kept = getattr(self.dispatcher(), "_cache", None)
        return not isinstance(kept, _Cache) or kept.has_code()

    def inner_function(self) -> Any:
        """Return the function that compiled functions call."""
        with _MAKING:
            if self._inner is None:
                numba = _prepared_numba()
                if not has_internals():
                    self._inner = _plain(self._function, cached=False)
                    return self._inner
                compiled = numba.njit(**self._options, no_cpython_wrapper=True)(self._function)
                compiled.get_call_template = _of_any_value(compiled.get_call_template)
                self._inner = compiled
            return self._inner


def _without_collection(compile_: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a function that compiles and does not search for garbage.

    The search takes a seventh of the time and finds little: numba's many cycles live until the end.
    """

    def quicker(signature: Any) -> Any:
        searches = gc.isenabled()
        gc.disable()
        try:
            return compile_(signature)
        finally:
            if searches:
                gc.enable()

    return quicker


def _of_any_value(template: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Compile a function once for a type of argument, not again for each constant."""
    from numba.core.types import unliteral

    def general(arguments: Any, named: Any) -> Any:
        types = tuple(unliteral(argument) for argument in arguments)  # type: ignore[no-untyped-call]
        return template(types, named)

    return general


@cache
def _prepared_numba() -> Any:
    """Import numba, and let compiled functions call each other."""
    import numba
    from numba.extending import typeof_impl

    if has_internals():
        _allow_wide_vectors()
        _remember_types_of_operators()
    _put_off_check_for_blas()

    @typeof_impl.register(_Compiled)
    def _(value: _Compiled, _context: object) -> Any:
        return numba.typeof(value.inner_function())  # type: ignore[no-untyped-call]

    return numba


def _remember_types_of_operators() -> None:
    """Let numba search for the type of an operation on numbers once, not at each place in the code.

    At each place it tries the forms that an operator has for arrays, sets and so on, which takes a
    tenth of the time of compiling. An operator with new forms is another object.
    """
    from numba.core.types import Boolean, Number, functions

    search: Any = functions.BaseFunction.get_call_type
    signatures: dict[tuple[Any, ...], tuple[Any, Any]] = {}
    numbers = (Number, Boolean)

    def remembered(function: Any, context: Any, arguments: Any, named: Any) -> Any:
        remembers = not named and function.typing_key in _OPERATORS
        if not (remembers and all(isinstance(argument, numbers) for argument in arguments)):
            return search(function, context, arguments, named)
        key = (context, function.typing_key, *arguments)
        if key not in signatures or signatures[key][0] is not function:
            signatures[key] = function, search(function, context, arguments, named)
        return signatures[key][1]

    cast("Any", functions.BaseFunction).get_call_type = remembered


def _put_off_check_for_blas() -> None:
    """Import the module of numba that checks for BLAS, without the check.

    The check imports `scipy.linalg`, which takes a tenth of the time of a command. Numba repeats it
    when it compiles a function that needs BLAS.
    """
    from numba.np import linalg

    numba_linalg: Any = linalg
    check = getattr(numba_linalg, "ensure_blas", None)
    if check is None:  # another version of numba
        return
    numba_linalg.ensure_blas = lambda: None
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        numba_linalg.ensure_blas = check


def _allow_wide_vectors() -> None:
    """Let LLVM use vectors of 512 bits, unless the user states features of the processor to numba.

    LLVM avoids them because they slow the clock of the first processors that have them, which lack
    VBMI2. On Emerald Rapids the vectorised kernel takes a fifth less time, at the same bits.
    """
    from numba.core import codegen, config

    settings: Any = config
    if settings.CPU_NAME is None and settings.CPU_FEATURES is None:
        features = codegen.get_host_cpu_features()  # type: ignore[no-untyped-call]
        if "+avx512vbmi2" in features.split(","):
            settings.CPU_FEATURES = f"{features},-{_NARROW}"


def _of_any_width(key_of: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return the function of the keys of cached code, without the preferred width of vectors."""

    def key(signature: Any, codegen: Any) -> Any:
        types, (*processor, features), digests = key_of(signature, codegen)
        names = [name for name in features.split(",") if name[1:] != _NARROW]
        return types, (*processor, ",".join(names)), digests

    return key


class _Cache:
    """Numba's cache on disk. After a full disk or a corrupted file, functions compile again.

    Code that another process is compiling is waited for, not compiled twice. The key of the code
    does not say how wide its vectors are: that depends on what numba compiled before in the
    process, and only the speed depends on it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        from numba.core.caching import FunctionCache

        self._files = cast("Any", FunctionCache)(function)
        self._files._index_key = _of_any_width(self._files._index_key)  # noqa: SLF001  numba's own
        self._name = function.__qualname__
        self._lock: _Lock | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._files, name)

    def has_code(self) -> bool:
        """Return True if there is code, for whatever types of arguments."""
        return any(Path(self._files.cache_path).glob(f"*.{self._name}-*.nbi"))

    def one_process_at_a_time(self, compile_: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """Return a function that compiles, and then lets the processes that wait for it go on."""

        def alone(signature: Any) -> Any:
            try:
                return compile_(signature)
            finally:
                lock, self._lock = self._lock, None
                if lock is not None:
                    lock.release()

        return alone

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the cached code, or None: then no other process compiles it until this one has."""
        code = self._loaded(signature, target)
        if code is None and self._lock is None:
            types = hashlib.sha256(str(signature).encode()).hexdigest()[:12]
            self._lock = _Lock(Path(self._files.cache_path, f"{self._name}-{types}.lock"))
            code = self._loaded(signature, target)
        if code is None:
            tell_of_compiling()
        return code

    def _loaded(self, signature: Any, target: Any) -> Any:
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


class _Lock:
    """A file that one process at a time holds; another waits. Where files cannot be locked, as on
    Windows, nobody waits.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] | None = None
        with suppress(ImportError, OSError):
            import fcntl

            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
            fcntl.flock(self._file, fcntl.LOCK_EX)

    def release(self) -> None:
        """Let another process go on. A process that opens the file later finds the code."""
        if self._file is not None:
            with suppress(OSError):
                self._path.unlink()
            self._file.close()
