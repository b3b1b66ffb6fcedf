"""Cached compiled code is used only while all its sources are unchanged."""

from __future__ import annotations

import errno
import gc
import hashlib
import operator
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numba
import numpy as np
import pytest
from numba.core import caching, codegen, types
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction

import rockframe.compiled as compilation
from rockframe import GroundAcceleration, Pulse, PulseOptions, RockingFrame, find_pulses, respond
from rockframe.cli.main import main
from rockframe.compiled import _allow_wide_vectors, _Lock, compiled
from rockframe.matching import loops as matching
from rockframe.matching.loops import crests
from rockframe.oscillators import kernel as oscillators
from rockframe.rocking.kernels import kernel, lanes
from rockframe.signals.processing import BandPass, correct
from rockframe.wavelets import loops as wavelets


def test_names_of_cached_files_hold_the_hash_of_every_source() -> None:
    """Numba checks the time and size of one file only, but functions are inlined from others."""
    own = Path(compiled.__code__.co_filename)
    kernels = sorted(Path(kernel.__file__).parent.glob("*.py"))
    for function, sources in (
        (kernel.integrate, kernels),
        (lanes.integrate_lanes, kernels),
        (oscillators.integrate, [Path(oscillators.__file__)]),
        (crests, [Path(matching.__file__), Path(wavelets.__file__)]),
    ):
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in (own, *sources)))
        assert digest.hexdigest()[:12] in cast("Any", function).py_func.__qualname__


@pytest.fixture
def cached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the cache folder of the functions that a test compiles."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return tmp_path


def twice(x: float) -> float:
    return 2.0 * x


def again() -> Any:
    """Return the function as a new process sees it, not compiled yet."""
    twice.__qualname__ = "twice"
    return compiled(twice)


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("left", [0, 40])
def test_a_damaged_cache_is_compiled_anew(cached: Path, ending: str, left: int) -> None:
    assert again()(1.0) == 2.0
    [file] = cached.rglob(f"*.{ending}")
    whole = file.stat().st_size
    file.write_bytes(file.read_bytes()[:left])
    assert again()(1.0) == 2.0
    assert file.stat().st_size > 0.9 * whole  # names of functions have numbers, which grow
    last = again()
    assert last(1.0) == 2.0
    assert sum(last.stats.cache_hits.values()) == 1


def plus(x: float, number: int) -> float:
    return x + number


def plus_three(x: float) -> float:
    return plus(plus(x, 1), 2)


def test_what_compiled_functions_call_is_compiled_once_and_is_part_of_their_code(
    cached: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Constants are no types of their own, and only what Python calls needs files."""
    part = cast("Any", compiled(plus))
    monkeypatch.setitem(globals(), "plus", part)
    assert compiled(plus_three)(1.0) == 4.0
    assert len(part.inner_function().signatures) == 1
    assert {file.name.split("-")[0].split(".")[1] for file in cached.rglob("*.nb?")} == {
        "plus_three"
    }


def test_code_that_another_process_compiles_is_waited_for(
    cached: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While this process waits for the lock, the other one compiles; then this one loads."""

    def wait(path: Path) -> SimpleNamespace:
        monkeypatch.undo()
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(cached))
        assert again()(1.0) == 2.0  # as the other process does
        return SimpleNamespace(release=lambda: waited.append(path))

    waited: list[Path] = []
    monkeypatch.setattr(compilation, "_Lock", wait)
    here = again()
    assert not here.cached()
    assert (here(1.0), here(2.0), here(1)) == (2.0, 4.0, 2.0)
    assert len(waited) == 1
    assert sum(here.stats.cache_hits.values()) == 1
    assert here.cached()


def test_one_process_holds_a_lock_and_another_waits(tmp_path: Path) -> None:
    """Threads that open the file each for itself lock as processes do."""
    path = tmp_path / "made" / "one.lock"
    held = [_Lock(path)]
    other = threading.Thread(target=lambda: held.append(_Lock(path)))
    other.start()
    other.join(0.2)
    assert len(held) == 1
    held[0].release()
    other.join(60.0)
    assert len(held) == 2
    held[1].release()
    assert not path.exists()


def test_the_lock_is_released_when_code_is_made_or_cannot_be_made(cached: Path) -> None:
    here = again()
    assert here(1.0) == 2.0
    with pytest.raises(numba.TypingError):
        here({})
    assert not list(cached.rglob("*.lock"))


@pytest.mark.parametrize("missing", ["folder", "fcntl"])
def test_without_a_cache_or_locks_nobody_waits(
    cached: Path, monkeypatch: pytest.MonkeyPatch, missing: str
) -> None:
    """An installation may be read-only, and Windows locks otherwise."""

    def no_folder(_function: object) -> None:
        raise RuntimeError

    if missing == "folder":
        monkeypatch.setattr(caching, "FunctionCache", no_folder)
    else:
        monkeypatch.setitem(sys.modules, "fcntl", None)
    here = again()
    assert here.cached() is (missing == "folder")
    assert here(1.0) == 2.0
    assert not list(cached.rglob("*.lock"))


def test_without_compilation_the_function_is_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """`NUMBA_DISABLE_JIT=1` lets a debugger and a measure of coverage see each line."""
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    here = again()
    assert here(2.0) == 4.0
    assert here.dispatcher() is twice
    assert here.cached()


@pytest.mark.parametrize("searches", [True, False])
def test_compiling_searches_for_no_garbage(
    cached: Path, monkeypatch: pytest.MonkeyPatch, searches: bool
) -> None:
    del cached
    seen = []
    compile_: Any = numba.core.compiler.compile_extra

    def watched(*arguments: Any, **named: Any) -> Any:
        seen.append(gc.isenabled())
        return compile_(*arguments, **named)

    monkeypatch.setattr(numba.core.compiler, "compile_extra", watched)
    (gc.enable if searches else gc.disable)()
    try:
        again()(1.0)
        assert seen[0] is False
        assert gc.isenabled() is searches
    finally:
        gc.enable()


def test_arrays_have_one_memory_layout(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba would compile a function again for each layout of its arrays."""
    called = set()
    kind = type(cast("Any", kernel.integrate))
    call = kind.__call__

    def watched(self: Any, *arguments: Any) -> Any:
        called.add(self.__name__)
        arrays = [argument for argument in arguments if isinstance(argument, np.ndarray)]
        assert all(array.flags.c_contiguous for array in arrays), self.__name__
        return call(self, *arguments)

    monkeypatch.setattr(kind, "__call__", watched)
    bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    samples = np.sin(np.linspace(0.0, 60.0, 1000))
    respond(bent, Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.0))
    respond(bent, GroundAcceleration.from_samples(samples, 0.02))
    correct(samples, 0.02, BandPass(0.5, 20.0))
    find_pulses(samples, 0.02, PulseOptions(surrogates=0))
    assert called >= {"integrate", "through_sections", "fill_lines", "tops", "crests"}


@pytest.mark.parametrize(
    ("features", "has", "used"),
    [
        (None, "+avx2,+avx512vbmi2", "+avx2,+avx512vbmi2,-prefer-256-bit"),
        (None, "+avx512f,-avx512vbmi2", None),  # its clock slows under wide vectors
        ("+avx2", "+avx512vbmi2", "+avx2"),
    ],
)
def test_wide_vectors_are_used_where_they_are_fast(
    monkeypatch: pytest.MonkeyPatch, features: str | None, has: str, used: str | None
) -> None:
    monkeypatch.setattr(numba.config, "CPU_NAME", None)
    monkeypatch.setattr(numba.config, "CPU_FEATURES", features)
    monkeypatch.setattr(codegen, "get_host_cpu_features", lambda: has)
    _allow_wide_vectors()
    assert used == cast("Any", numba.config).CPU_FEATURES


AFTER_OTHERS = """
import sys, numba

if sys.argv[1] == "others first":
    numba.njit(lambda x: x + 1)(1)  # numba then takes no further features of the processor
from rockframe.signals.loops import through_sections
import numpy as np

through_sections(np.ones((1, 6)), np.ones(3))
print(sum(through_sections.stats.cache_hits.values()))
"""


def test_code_is_compiled_once_also_by_processes_that_compiled_others_first(tmp_path: Path) -> None:
    """A notebook with a compiled function of its own compiled all kernels again."""

    def hits(order: str) -> str:
        words = [sys.executable, "-c", AFTER_OTHERS, order]
        env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
        return subprocess.run(words, env=env, check=True, capture_output=True, text=True).stdout

    orders = ("others first", "alone", "others first")
    assert [hits(order).strip() for order in orders] == ["0", "1", "1"]


def test_a_processor_that_the_user_names_is_taken_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CPU_NAME", "generic")
    monkeypatch.setattr(numba.config, "CPU_FEATURES", None)
    monkeypatch.setattr(codegen, "get_host_cpu_features", lambda: "+avx512vbmi2")
    _allow_wide_vectors()
    assert cast("Any", numba.config).CPU_FEATURES is None


def test_a_full_disk_costs_time_alone(cached: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(caching.IndexDataCacheFile, "_open_for_write", full)
    assert again()(1.0) == 2.0
    assert not list(cached.rglob("*.nb?"))


_INTERRUPTED = """
import os, signal
from numba.core import codegen

kept = codegen.JITCodeLibrary._object_compiled_hook
def hook(module, code):
    os.kill(os.getpid(), signal.SIGINT)
    kept(module, code)
codegen.JITCodeLibrary._object_compiled_hook = hook

from rockframe.compiled import compiled

def twice(x):
    return 2.0 * x

compiled(twice)(1.0)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="sends itself a signal")
def test_an_interrupt_while_code_is_made_is_not_lost(tmp_path: Path) -> None:
    """The signal arrives in a callback from C, where Python prints errors and continues."""
    script = tmp_path / "script.py"
    script.write_text(_INTERRUPTED)
    ran = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert ran.returncode in (-signal.SIGINT, 130)
    assert ran.stderr.rstrip().endswith("KeyboardInterrupt")


_SAID = """
from rockframe.compiled import before_compiling, compiled

def twice(x):
    return 2.0 * x

def thrice(x):
    return 3.0 * x

before_compiling(lambda: print("compiling", flush=True))
print(compiled(twice)(1.0), compiled(thrice)(1.0))
"""


def test_compiling_is_said_once_and_only_where_the_cache_has_no_code(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(_SAID)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for expected in ("compiling\n2.0 3.0\n", "2.0 3.0\n"):
        ran = subprocess.run(
            [sys.executable, str(script)],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert ran.stdout == expected


def test_a_command_says_that_it_compiles_on_the_error_stream(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The stream is no terminal here."""
    monkeypatch.setattr("rockframe.cli.main.before_compiling", lambda tell: tell())
    assert main(["formats"]) == 0
    assert capsys.readouterr().err.startswith("rockframe: compiling the kernels for this computer")


_PRODUCT = """
import sys
import numba, numpy
from rockframe import GroundAcceleration, RockingFrame, respond
respond(RockingFrame(height=9.6, width=1.6), GroundAcceleration.from_samples([0.0, 3.0, 0.0], 0.1))
assert "scipy.linalg" not in sys.modules
print(numba.njit(lambda a, b: a @ b)(numpy.eye(2), numpy.full((2, 2), 3.0)).tolist())
"""


def test_functions_of_others_still_find_blas() -> None:
    """Numba's check for BLAS is only put off until a function needs it."""
    words = [sys.executable, "-c", _PRODUCT]
    ran = subprocess.run(words, capture_output=True, text=True, check=True)
    assert ran.stdout == "[[3.0, 3.0], [3.0, 3.0]]\n"


@pytest.mark.faults  # compiles everything again
def test_the_bits_do_not_depend_on_the_processor(bundled_records: Path, tmp_path: Path) -> None:
    """Each operation is rounded separately on every processor: multiply-add is not fused."""
    record = bundled_records / "Ridgecrest2019-CCC.V1"
    words = ["table1", "--records", str(record), "--structure", "slender-column"]
    words += ["--surrogates", "0", "--output"]
    assert main([*words, str(tmp_path / "here")]) == 0
    other = {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    script = "import sys; from rockframe.cli.main import main; sys.exit(main(sys.argv[1:]))"
    command = [sys.executable, "-c", script, *words, str(tmp_path / "there")]
    subprocess.run(command, env=os.environ | other, capture_output=True, check=True)
    for name in ("records.nc", "pulses.nc", "response.nc"):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()


def test_numba_searches_for_the_type_of_an_operation_once(monkeypatch: pytest.MonkeyPatch) -> None:
    again()(1.0)  # numba is prepared
    search: Any = BaseFunction.get_call_type
    searched: list[tuple[Any, ...]] = []

    def counted(function: Any, context: Any, arguments: Any, named: Any) -> Any:
        searched.append(arguments)
        return search(function, context, arguments, named)

    monkeypatch.setattr(BaseFunction, "get_call_type", counted)
    compilation._remember_types_of_operators()  # noqa: SLF001
    real, whole, flag, row = types.float64, types.int64, types.boolean, types.float64[:]
    operations = {
        (operator.add, real, whole): real,
        (operator.add, whole, whole): whole,
        (operator.add, whole, cast("Any", types).literal(2)): whole,
        (operator.add, flag, flag): whole,
        (operator.truediv, whole, whole): real,
        (operator.lt, whole, real): flag,
    }
    resolve: Any = cpu_target.typing_context.resolve_function_type
    for _ in range(2):
        for (sign, *pair), expected in operations.items():
            assert resolve(sign, tuple(pair), {}).return_type == expected
    assert searched == [tuple(pair) for _, *pair in operations]
    for _ in range(2):  # there may be new forms of arrays
        assert resolve(operator.lt, (row, real), {}).return_type.dtype == flag
    assert searched[len(operations) :] == 2 * [(row, real)]
