"""Branch coverage of rooms: ``python -m tests.benchmarks.coverage --output outputs/coverage``.

coverage.py cannot see compiled code, so tests run twice: those that reach the rooms with compiled
kernels, and those of the rooms with plain Python in the place of numba. In the second run a test
ends after some seconds; what it reached until then counts, and whether it passes does not. A branch
is covered if either run takes it. The folder also says which test reaches which line, and how long
each takes: `tests.benchmarks.mutants` reads this.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from types import FrameType
from typing import Final

import pytest
from tests.benchmarks.size import sized

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGE: Final = Path("pipeline", "rockframe")
#: Environment of a run with plain Python in the place of numba; one thread, as a signal cannot end
#: the others.
PLAIN: Final = {"NUMBA_DISABLE_JIT": "1", "OMP_NUM_THREADS": "1"}
#: Rooms that are measured, and the smallest part of one.
OWN: Final = ("rocking", "oscillators", "matching", "risk")
#: Tests of other rooms that reach these.
REACHING: Final = (
    *("tests/stages", "tests/results", "tests/figures", "tests/selection", "tests/test_paper.py"),
    *("tests/explorer/test_answer.py", "tests/runs/test_further.py", "tests/test_notebook.py"),
)
#: Environment variables: seconds after which a test ends, and the file of `Taken`.
_LONGEST: Final = "ROCKFRAME_LONGEST_TEST"
_TAKEN: Final = "ROCKFRAME_TAKEN"
#: Seconds after which a whole run ends; what it reached until then counts.
_WHOLE: Final = 3600


@dataclass(frozen=True)
class Branches:
    """Branches of a file: their number, and the lines from and to which no test goes.

    The second line is negative where a function ends.
    """

    total: int
    missed: tuple[tuple[int, int], ...]


class _TooLongError(BaseException):
    """Ends a test; no test catches it."""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Let coverage.py note which lines a test reaches, and write how long it takes."""
    from coverage import Coverage

    measuring = Coverage.current()
    if measuring is None:
        return (yield)
    measuring.switch_context(item.nodeid)
    failures, start = item.session.testsfailed, process_time()
    try:
        return (yield)
    finally:
        measuring.switch_context("")
        passed = item.session.testsfailed == failures
        with Path(os.environ[_TAKEN]).open("a", encoding="utf-8") as file:
            file.write(json.dumps([item.nodeid, process_time() - start, passed]) + "\n")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """End the fixtures of a test after the stated processor time, if there is one."""
    with _ended(item.nodeid):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """End a test after the stated processor time, if there is one."""
    with _ended(item.nodeid):
        return (yield)


@contextmanager
def _ended(test: str) -> Iterator[None]:
    def end(_: int, frame: FrameType | None) -> None:
        if frame and frame.f_globals.get("__name__", "").startswith("coverage."):
            signal.setitimer(signal.ITIMER_PROF, 0.01)  # it may hold its lock
        else:
            raise _TooLongError(test)

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, float(os.environ.get(_LONGEST, "0")))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def run(folder: Path, rooms: Sequence[str], tests: Sequence[str], longest: float) -> None:
    """Run tests, without compilation unless `longest` [s] is 0, and store what they reach."""
    name = "plain" if longest else "compiled"
    environment = {**os.environ, "COVERAGE_FILE": str(folder / f".coverage.{name}")}
    if longest:
        environment |= {**PLAIN, _LONGEST: str(longest)}
    taken = folder / f"{name}.jsonl"
    taken.unlink(missing_ok=True)
    environment[_TAKEN] = str(taken)
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT / "pipeline"), *sys.path[1:]])
    sources = "".join(f"\n    {PACKAGE / room}" for room in rooms)
    settings = folder / "settings.ini"
    settings.write_text(
        f"[run]\nbranch = true\nsigterm = true\nsource ={sources}\n", encoding="utf-8"
    )
    words = ["-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest", "-q", "--tb=no"]
    words += ["-p", "no:cacheprovider", "-p", "tests.benchmarks.coverage", *tests]
    words += ["-W", "ignore::RuntimeWarning"] if longest else []  # of NaN, which numba leaves alone
    with (folder / f"{name}.log").open("w", encoding="utf-8") as log:
        process = subprocess.Popen([sys.executable, *words], cwd=ROOT, env=environment, stdout=log)
        try:
            process.wait(_WHOLE)
        except subprocess.TimeoutExpired:
            process.terminate()
            process.wait()


def measured(folder: Path) -> dict[str, Branches]:
    """Return the branches of each file of the rooms, from the data of both runs together."""
    import coverage

    joint = coverage.Coverage(
        data_file=str(folder / "joint"), config_file=str(folder / "settings.ini")
    )
    joint.combine([str(path) for path in sorted(folder.glob(".coverage.*"))], keep=True)
    joint.save()
    report = folder / "coverage.json"
    joint.json_report(outfile=str(report))
    files = json.loads(report.read_text(encoding="utf-8"))["files"]
    found = {}
    for path, one in files.items():
        file = (ROOT / path).relative_to(ROOT / PACKAGE).as_posix()
        missed = tuple((start, end) for start, end in one["missing_branches"])
        found[file] = Branches(one["summary"]["num_branches"], missed)
    return found


def has_kernels(file: str) -> bool:
    """Return True if a file of the package has compiled functions."""
    text = (ROOT / PACKAGE / file).read_text(encoding="utf-8")
    return any(f"\n@{mark}" in text for mark in ("compiled", "inlined"))


def show(found: dict[str, Branches]) -> None:
    """Print the branches that no test takes, and the shares by room, kernels apart."""
    groups: dict[tuple[str, str], list[Branches]] = defaultdict(list)
    for file, one in sorted(found.items()):
        places = (f"{start} to {end if end > 0 else 'the end'}" for start, end in one.missed)
        if one.missed:
            print(f"{file}: {', '.join(places)}")
        kind = "kernels" if has_kernels(file) else "other files"
        groups[kind, file.split("/")[0]].append(one)
        groups[kind, "together"].append(one)
    for (kind, room), some in sorted(groups.items()):
        total = sum(one.total for one in some)
        covered = total - sum(len(one.missed) for one in some)
        share = f", {100.0 * covered / total:.1f} %" if total else ""
        print(f"{kind}, {room}: {covered} of {total} branches{share}")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the coverage of rooms, and print it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--output", type=Path, help="folder of the data")
    parser.add_argument("--rooms", nargs="+", default=sized(OWN, ("risk",)), help="default: four")
    parser.add_argument("--seconds", type=float, default=1.5, help="longest test without numba")
    parser.add_argument("--show", action="store_true", help="only print the data of the last runs")
    chosen = parser.parse_args(arguments)
    folder = (chosen.output or Path(tempfile.mkdtemp(prefix="coverage-"))).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    if not chosen.show:
        own = [f"tests/{room}" for room in chosen.rooms]
        doctests = [str(PACKAGE / room) for room in chosen.rooms]
        smallest = ["tests/risk/test_distribution.py"]
        run(folder, chosen.rooms, sized([*own, *doctests, *REACHING], smallest), 0.0)
        run(folder, chosen.rooms, sized(own, smallest), chosen.seconds)
    show(measured(folder))


if __name__ == "__main__":
    main()
