"""Run the tests and `table1` as on other processors, by the switches of the libraries.

``python -m tests.recorded.processors`` (``make test-processors``) takes about twenty minutes on two
cores; with ``--table1`` alone, two. A switch that this processor lacks is skipped.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import llvmlite.binding
import numpy as np
from tests.recorded.record import HERE, differences, numbers

#: Extensions of the instruction set x86-64-v4.
_V4: Final = ("avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")


def processors() -> dict[str, dict[str, str]]:
    """Return the environment variables of each kind of processor that this one can stand for."""
    here = llvmlite.binding.get_host_cpu_features()
    vectors = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    kinds = {
        "this processor": {},
        "numba generic": {"NUMBA_CPU_NAME": "generic"},
        "numba x86-64-v3": {"NUMBA_CPU_NAME": "x86-64-v3"},
        "numba x86-64-v4": {"NUMBA_CPU_NAME": "x86-64-v4"},
        "numpy without vectors": {"NPY_DISABLE_CPU_FEATURES": " ".join(vectors)},
        "C library without FMA": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"},
        "OpenBLAS Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
        "OpenBLAS SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    }
    lacking = (
        {} if all(here.get(name) for name in _V4) else {"numba x86-64-v4", "OpenBLAS SkylakeX"}
    )
    return {kind: switches for kind, switches in kinds.items() if kind not in lacking}


def done(words: list[str], switches: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a Python module under the switches."""
    environment = {**os.environ, "COLUMNS": "166", **switches}
    command = [sys.executable, "-m", *words]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def main() -> int:
    """Print a line for each kind of processor; return 1 if a test fails or a table differs."""
    reading = argparse.ArgumentParser(description=__doc__)
    reading.add_argument("--table1", action="store_true", help="only compare the tables")
    recorded = json.loads((HERE / "numbers.json").read_text(encoding="utf-8"))
    del recorded["files"]
    alone = reading.parse_args().table1
    tables: dict[str, str] = {}
    failed = False
    for kind, switches in processors().items():
        with tempfile.TemporaryDirectory() as home:
            run = done(["rockframe", "table1", "--output", f"{home}/run"], switches)
            tables[kind] = run.stdout.replace(home, "")
            apart = differences(numbers(Path(home, "run")), recorded)
        same = run.returncode == 0 and tables[kind] == tables["this processor"] and not apart
        said = "the same table" if same else "ANOTHER TABLE"
        if not alone:
            words = ["pytest", "-q", "-rfE", "--numprocesses", "auto", "--dist", "loadfile"]
            tests = done(words, switches)
            lines = re.sub(r"\x1b\[[0-9;]*m", "", tests.stdout.strip()).splitlines() or [""]
            said += f"; {lines[-1]}"
            apart += [line for line in lines if line.startswith(("FAILED ", "ERROR "))]
            same = same and tests.returncode == 0
        print(f"{kind}: {said}", *apart, sep="\n    ", flush=True)
        failed |= not same
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
