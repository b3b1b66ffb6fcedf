"""Each benchmark works at its smallest size; part of ``make test-all``."""

from __future__ import annotations

import importlib
import shutil
from pathlib import Path
from typing import Final

import pytest
from tests.benchmarks.size import SMALLEST
from tests.conftest import REPOSITORY

FOLDER: Final = REPOSITORY / "tests" / "benchmarks"
NAMES: Final = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "size")
#: Modules of extras that a benchmark needs, and the extra.
EXTRAS: Final = {
    "coverage": (("coverage", "bench"),),
    "explorer": (("playwright", "browser"), ("uvicorn", "explorer")),
    "heyoka_rival": (("heyoka", "bench"),),
    "peers": (("eqsig", "bench"), ("pystrata", "bench")),
    "report": (("playwright", "browser"),),
}
#: Programs that a benchmark needs.
PROGRAMS: Final = {"before": "git", "explorer": "chromium", "report": "chromium"}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of the programs that are compared
@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_works_at_its_smallest_size(
    name: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Its numbers say nothing, but no change of the package can break it unnoticed."""
    for module, extra in EXTRAS.get(name, ()):
        pytest.importorskip(module, reason=f"needs the extra {extra}: make bench")
    program = PROGRAMS.get(name)
    if program and shutil.which(program) is None:
        pytest.skip(f"needs the program {program}")
    if name == "before" and not (REPOSITORY / ".git").exists():
        pytest.skip("needs a clone with its commits")
    monkeypatch.setenv(SMALLEST, "1")
    monkeypatch.chdir(tmp_path)
    importlib.import_module(f"tests.benchmarks.{name}").main([])
    assert capsys.readouterr().out or name == "flame"  # it draws a picture and prints nothing
