"""Checks of the test suite itself; part of ``make check``."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import time
from pathlib import Path

from tests.conftest import LONGEST, REPOSITORY

#: Words with which no docstring begins: its first line says what a function does or a thing is.
OPENINGS = re.compile(r"(What|Whether|How|Of|That|Which|Where|Also|And|But)\b")
#: Forms that had to be read twice, or that have another name in this project.
PUZZLING = re.compile(
    r"\b(go|goes|gone|going) on with\b|\bunanswered\b|\bgone through\b|\b(is|are|be) told\b"
    r"|\bsaid (to be|so)\b|\bso many\b|\bis asked (of|otherwise)\b|\b(is|are) at work\b|\bbefall"
    r"|\bthereof\b|\bstands? in the list\b|\bcame through\b|\bused pulse\b|\bheld against\b"
)


def test_sentences_are_plain() -> None:
    """Docstrings, comments, messages and pages avoid forms that puzzled readers of this project."""
    pages = [*REPOSITORY.glob("*.md"), *REPOSITORY.glob("docs/**/*.md")]
    code = [*REPOSITORY.glob("pipeline/**/*.py"), *REPOSITORY.glob("tests/**/*.py")]
    for path in sorted({*pages, *code} - {Path(__file__)}):
        match = PUZZLING.search(path.read_text(encoding="utf-8"))
        assert not match, f"{path}: {match[0]}"
    for path in code:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                docstring = ast.get_docstring(node) or ""
                assert not OPENINGS.match(docstring), f"{path}: {docstring.splitlines()[0]}"


#: Draws that differ from run to run, and settings that are stated once, in `tests/conftest.py`.
CHANGING = re.compile(
    r"default_rng\(\)|\bRandom\(\)|np\.random\.(rand|randn|normal|uniform|seed)\("
    r"|derandomize=|deadline="
)


def test_each_run_draws_the_same_numbers() -> None:
    """A failure must be seen again: numbers come from stated seeds, and examples from a profile."""
    tests = REPOSITORY / "tests"
    for path in sorted({*tests.rglob("test_*.py"), *tests.glob("*/conftest.py")}):
        match = CHANGING.search(path.read_text(encoding="utf-8"))
        assert not match, f"{path}: {match[0]}"


def test_a_property_is_tried_with_the_same_examples_in_each_run(tmp_path: Path) -> None:
    """Whatever modules are loaded; the profile of `make test-all` draws others."""
    (tmp_path / "test_drawn.py").write_text(DRAWN, encoding="utf-8")
    drawn = []
    runs = [
        ("same", "rockframe.units"),
        ("same", "rockframe.report.page"),
        ("others", "rockframe.units"),
    ]
    for profile, loaded in runs:
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", os.devnull]
        words += [
            "-p",
            "tests.conftest",
            "-p",
            loaded,
            f"--hypothesis-profile={profile}",
            str(tmp_path),
        ]
        env = {**os.environ, "DRAWN": str(tmp_path / "drawn.txt"), "PYTHONPATH": "."}
        subprocess.run(words, cwd=REPOSITORY, env=env, check=True, capture_output=True)
        drawn.append((tmp_path / "drawn.txt").read_text())
    assert drawn[0] == drawn[1] != drawn[2]


DRAWN = """
import os
from hypothesis import given, strategies
drawn = []

@given(strategies.integers())
def test_numbers(number):
    drawn.append(number)
    with open(os.environ["DRAWN"], "w") as file:
        file.write(repr(drawn))
"""


def collected() -> subprocess.Popen[str]:
    """Start a process that lists the names of all tests."""
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    return subprocess.Popen(words, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True)


def test_two_processes_collect_the_same_tests() -> None:
    """Names must not depend on time or string hashes: pytest-xdist needs equal names everywhere."""
    first = collected()
    time.sleep(2.0)
    names_of_first, other = [process.communicate()[0] for process in (first, collected())]
    names = [line for line in names_of_first.splitlines() if "::" in line]
    assert len(names) == len(set(names)) > 1000
    assert names == [line for line in other.splitlines() if "::" in line]


def test_files_that_begin_first_exist() -> None:
    assert [name for name in LONGEST if not (REPOSITORY / "tests" / f"{name}.py").is_file()] == []


def test_shared_files_are_named_one_by_one() -> None:
    """A test that reads every file of a shared folder breaks when a file is added."""
    for path in sorted((REPOSITORY / "tests").rglob("*.py")):
        for line in path.read_text(encoding="utf-8").splitlines():
            taken = any(f".{way}(" in line for way in ("iterdir", "glob", "rglob"))
            assert not (taken and ("shared_" + "records" in line or "peer_" + "records" in line)), (
                f"{path}: {line.strip()}"
            )


#: Compiled kernels: a class or a call for each part would cost time, so that arrays are arguments.
KERNELS = ("rocking/kernels/", "oscillators/kernel.py", "wobbling/kernel.py", "unequal/kernels/")
#: Lines of other files above 600, and why.
LONG_FILES = {
    "frame.py": "one class, with the equations of the paper as its properties",
    "provenance.py": "hashes, and whole files and folders, which take their names from them",
    "report/page.py": "the page's data, in the order of the page",
    "results/response.py": "writing and reading of one file",
    "results/schema/response.py": "the declaration of each variable of these files, in their order",
    "results/screen_tables.py": "the tables of one screening",
}
#: Functions of other files with more than 40 lines: sequences that are read from top to bottom.
LONG_BODIES = {
    "cli/stages/compare.py run_compare",
    "cli/stages/select.py _show",
    *("figures/fragility.py draw_fragility", "figures/histories.py draw_comparison"),
    *("figures/moving.py draw_animation", "figures/recorded.py draw_record"),
    *("figures/joints.py draw_phase_portrait", "figures/margins.py draw_stability_map"),
    *("figures/pulses.py draw_scalogram", "figures/spectra.py draw_drift_by_size"),
    *("ingest/formats/cosmos/reader.py _record", "ingest/formats/esm.py read"),
    *("ingest/formats/unam.py _record", "quantities/__init__.py _at_joint"),
    *("report/page.py payload", "results/fragility_models.py fragility_model"),
    "rocking/response.py respond",
}
#: Functions of other files with more than 8 arguments: stages, and the dimensions of a bridge.
MANY_ARGUMENTS = {
    "ingest/parsing/samples.py require_printed_peak",
    *("rivals.py from_columns", "stages/compare.py compare_stage", "stages/ingest.py ingest_stage"),
    *("stages/respond.py respond_stage", "stages/screen.py screen_stage"),
}


def body_lines(function: ast.FunctionDef) -> int:
    """Return the number of lines of a function without its head and docstring."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def argument_count(function: ast.FunctionDef) -> int:
    """Return the number of arguments of a function besides `self` and `cls`."""
    arguments = function.args
    names = [
        argument.arg
        for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    ]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def test_files_and_functions_are_small() -> None:
    """Rule 3 of CONTRIBUTING: 600 lines a file, 40 a body, 8 arguments; exceptions are listed, and
    leave the list when they are no longer needed.
    """
    package = REPOSITORY / "pipeline" / "rockframe"
    files, bodies, arguments = set(), set(), set()
    for path in sorted(package.rglob("*.py")):
        name, text = path.relative_to(package).as_posix(), path.read_text(encoding="utf-8")
        if name.startswith(KERNELS):
            continue
        files |= {name} if len(text.splitlines()) > 600 else set()
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                bodies |= {f"{name} {node.name}"} if body_lines(node) > 40 else set()
                arguments |= {f"{name} {node.name}"} if argument_count(node) > 8 else set()
    assert files == set(LONG_FILES)
    assert bodies == LONG_BODIES
    assert arguments == MANY_ARGUMENTS
