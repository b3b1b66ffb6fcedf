"""Cached compiled code is used only while all its sources are unchanged."""

from __future__ import annotations

import errno
import hashlib
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import numba
import pytest
from numba.core import caching

from rockframe.cli.main import main
from rockframe.compiled import compiled
from rockframe.oscillators import kernel as oscillators
from rockframe.rocking.kernels import kernel, lanes


def test_names_of_cached_files_hold_the_hash_of_every_source() -> None:
    """Numba checks the time and size of one file only, but functions are inlined from others."""
    own = Path(compiled.__code__.co_filename)
    kernels = sorted(Path(kernel.__file__).parent.glob("*.py"))
    for function, sources in (
        (kernel.integrate, kernels),
        (lanes.integrate_lanes, kernels),
        (oscillators.integrate, [Path(oscillators.__file__)]),
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
    assert file.stat().st_size == whole
    last = again()
    assert last(1.0) == 2.0
    assert sum(last.stats.cache_hits.values()) == 1


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
