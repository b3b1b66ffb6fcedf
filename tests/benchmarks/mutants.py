"""Sampled mutants of the package: ``python -m tests.benchmarks.mutants --output outputs/mutants``.

A mutant is the package with one small fault: a number, comparison or sign is changed, a quantile is
moved, ``abs`` is removed, or the last element of a tuple of constants is dropped. The tests that
reach the file run on it; a mutant that they all pass has survived, and shows a threshold that no
test notices, unless it computes the same. The output folder has a copy of the repository, in which
alone files are changed, and the results, one line each; the next run with the same folder resumes.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import count
from pathlib import Path
from typing import Final

from tests.benchmarks.size import sized

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGE: Final = Path("pipeline", "rockframe")
#: Tests that reach each room, besides the doctests of the file; the longest matching name counts.
ROOMS: Final = {
    "ingest": "tests/ingest tests/stages/test_ingest.py tests/stages/test_rejections.py",
    "record": "tests/ingest tests/stages/test_ingest.py",
    "signals": "tests/signals tests/stages tests/ingest/test_raw_and_corrected.py",
    "components": "tests/test_components.py tests/stages tests/results",
    "fetch": "tests/fetch",
    "matching": "tests/matching tests/stages tests/results tests/recorded",
    "wavelets": "tests/test_wavelets.py tests/matching tests/rocking/test_pulse_motion.py",
    "rocking/margins": "tests/rocking tests/stages tests/recorded",
    "rocking": "tests/rocking tests/stages/test_respond.py tests/stages/test_spectrum.py",
    "frame": "tests/test_frame.py tests/test_frame_numbers.py tests/test_systems.py tests/rocking",
    "column": "tests/test_column.py tests/test_frame.py tests/study",
    "restraint": "tests/test_systems.py tests/rocking tests/study",
    "rivals": "tests/test_systems.py tests/oscillators tests/study",
    "oscillators": "tests/oscillators tests/stages/test_compare.py",
    "risk": "tests/risk tests/stages",
    "selection": "tests/selection tests/stages/test_select.py",
    "results": "tests/results tests/stages tests/cli tests/runs tests/figures",
    "stages": "tests/stages tests/cli tests/results",
    "options": "tests/study tests/stages tests/cli",
    "study": "tests/study tests/cli tests/runs",
    "runs": "tests/runs tests/cli",
    "engines": "tests/engines tests/ingest/test_isolation.py tests/runs",
    "figures": "tests/figures tests/cli",
    "paper": "tests/test_paper.py",
    "report": "tests/report tests/cli",
    "web": "tests/report tests/explorer",
    "explorer": "tests/explorer",
    "cli": "tests/cli tests/stages tests/runs",
    "": "tests",
}
KINDS: Final = ("number", "comparison", "sign", "quantile", "abs", "tuple")
_COMPARISONS: Final[dict[type[ast.cmpop], str]] = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
}
#: Seconds after which the tests of a mutant are ended: it loops, which is noticed.
_LONGEST: Final = 900


@dataclass(frozen=True)
class Mutant:
    """A change of one place of one file.

    Parameters
    ----------
    file : str
        The file, below the package.
    line : int
        Number of the line, from 1.
    kind : str
        One of `KINDS`.
    start, end : int
        Bytes of the file that are replaced.
    before, after : str
        What stands there, and what replaces it.
    """

    file: str
    line: int
    kind: str
    start: int
    end: int
    before: str
    after: str


def mutants_of(file: str, text: str) -> list[Mutant]:
    """Return all mutants of a file, in the order of their places."""
    data = text.encode()
    starts = [0]
    for line in data.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    tree = ast.parse(text)
    skipped = {id(inner) for node in ast.walk(tree) for inner in _not_computed(node)}
    quantiles = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and _called(node) in ("quantile", "percentile")
        for share in node.args[1:]
        for inner in ast.walk(share)
    }
    found = []
    for node in ast.walk(tree):
        if id(node) in skipped or not isinstance(node, ast.expr):
            continue
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        before = data[start:end].decode()
        change = _change(node, in_quantile=id(node) in quantiles)
        if change:
            found.append(Mutant(file, node.lineno, change[0], start, end, before, change[1]))
    return sorted(found, key=lambda one: (one.start, one.end, one.kind, one.after))


def _not_computed(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below one that no code computes with: annotations, and texts with values."""
    parts: list[ast.AST | None] = []
    if isinstance(node, ast.arg | ast.AnnAssign):
        parts.append(node.annotation)
    elif isinstance(node, ast.FunctionDef):
        parts.append(node.returns)
    elif isinstance(node, ast.JoinedStr):
        parts.extend(node.values)
    for part in parts:
        yield from ast.walk(part) if part is not None else ()


def _change(node: ast.expr, *, in_quantile: bool) -> tuple[str, str] | None:
    """Return the kind and the source of the mutant of an expression; None if it has none."""
    match node:
        case ast.Constant(value=float() | int() as value) if not isinstance(value, bool):
            if in_quantile:
                return "quantile", repr(0.8 * value)
            return "number", repr(_other(value))
        case ast.Compare(left=left, ops=[operator], comparators=[right]):
            if type(operator) in _COMPARISONS:
                words = (ast.unparse(left), _COMPARISONS[type(operator)], ast.unparse(right))
                return "comparison", f"({' '.join(words)})"
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as operator, right=right):
            other = ast.Sub() if isinstance(operator, ast.Add) else ast.Add()
            return "sign", f"({ast.unparse(ast.BinOp(left, other, right))})"
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return "sign", f"({ast.unparse(operand)})"
        case ast.Call(args=[argument]) if _called(node) in ("abs", "fabs"):
            return "abs", f"({ast.unparse(argument)})"
        case ast.Tuple(elts=[_, _, *_] as elements, ctx=ast.Load()):
            if all(isinstance(one, ast.Constant) for one in elements):
                return "tuple", ast.unparse(ast.Tuple(elements[:-1], ast.Load()))
    return None


def _other(value: float) -> float:
    """Return another number of the same type: larger by half, or 1 for 0."""
    if isinstance(value, int):
        return value + max(1, value // 2)
    return 1.5 * value if value else 1.0


def _called(node: ast.Call) -> str:
    return ast.unparse(node.func).rpartition(".")[2]


def all_mutants(root: Path) -> list[Mutant]:
    """Return all mutants of the package."""
    files = sorted(path.relative_to(root / PACKAGE) for path in (root / PACKAGE).rglob("*.py"))
    texts = ((file.as_posix(), (root / PACKAGE / file).read_text("utf-8")) for file in files)
    return [mutant for file, text in texts for mutant in mutants_of(file, text)]


def sampled(mutants: Sequence[Mutant], number: int, seed: int) -> list[Mutant]:
    """Return a sample in which each kind is as frequent as the others, while it lasts.

    The sample of a larger number begins with that of a smaller one.
    """
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    queues = []
    for kind in KINDS:
        queue = [one for one in mutants if one.kind == kind]
        rng.shuffle(queue)
        queues.append(queue)
    longest = max(map(len, queues), default=0)
    rounds = (queue[k] for k in range(longest) for queue in queues if k < len(queue))
    return [one for one, _ in zip(rounds, range(number), strict=False)]


def tests_of(file: str, *, own: bool) -> list[str]:
    """Return the tests that reach a file of the package, those named after it first.

    They are its doctests, the tests of a file or folder of its name, and those of its room; `own`
    are those of the room's folder alone, besides the doctests.
    """
    path = Path(file)
    if own:
        return [(PACKAGE / file).as_posix(), f"tests/{path.parts[0]}"]
    names = {f"test_{path.stem}.py", f"test_{path.parent.name}.py"}
    named = sorted(test for test in (ROOT / "tests").rglob("test_*.py") if test.name in names)
    stem = file.removesuffix(".py")
    room = max((r for r in ROOMS if f"{stem}/".startswith(f"{r}/") or not r), key=len)
    first = [test.relative_to(ROOT).as_posix() for test in named]
    return [(PACKAGE / file).as_posix(), *first, *ROOMS[room].split()]


def copied(root: Path, folder: Path) -> Path:
    """Copy the repository to a folder, with a link to its neighbour ``shared``."""
    copy = folder / "repository"
    if not copy.exists():
        rest = shutil.ignore_patterns(".git", ".venv*", "outputs", ".mypy_cache", ".ruff_cache")
        shutil.copytree(root, folder / "partial", ignore=rest)
        (copy.parent / "partial").rename(copy)
        shared = root.parent / "shared"
        if shared.exists() and not (folder / "shared").exists():
            (folder / "shared").symlink_to(shared)
    return copy


@cache
def passes_whole(copy: Path, test: str) -> bool:
    """Return True if a test passes on the package as it is."""
    return not first_failure(copy, [test])


def first_failure(copy: Path, tests: Sequence[str]) -> str:
    """Return the first test of files or folders of a copy that fails; "" if all pass.

    It is the first file if they last too long, or if a module cannot be imported.
    """
    environment = {**os.environ, "PYTHONPATH": str(copy / "pipeline")}
    words = ["-m", "pytest", "-q", "-x", "--tb=no", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            [sys.executable, *words], cwd=copy, env=environment, timeout=_LONGEST,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return tests[0]
    if done.returncode in (0, 5):  # 5: the file has no doctest
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return named[1] if named else tests[0]


def noticed_by(copy: Path, mutant: Mutant, stamp: int, *, own: bool = False) -> str:
    """Return the first test that notices a mutant; "" if none does."""
    path = copy / PACKAGE / mutant.file
    whole, times = path.read_bytes(), path.stat()
    try:
        path.write_bytes(whole[: mutant.start] + mutant.after.encode() + whole[mutant.end :])
        # Python compares times in whole seconds to see that a file has changed
        os.utime(path, (times.st_atime, times.st_mtime + stamp))
        return first_failure(copy, tests_of(mutant.file, own=own))
    finally:
        path.write_bytes(whole)
        os.utime(path, (times.st_atime, times.st_mtime))


def main(arguments: Sequence[str] | None = None) -> None:
    """Try the mutants of a sample, and print those that survive."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, help="folder of the copy and the results")
    parser.add_argument("--number", type=int, default=sized(30, 0), help="mutants (default: 30)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample (default: 1)")
    parser.add_argument("--rooms", nargs="+", default=[""], help="only files below these")
    parser.add_argument("--own", action="store_true", help="only the tests of the room itself")
    parser.add_argument("--list", action="store_true", help="only list the sample")
    chosen = parser.parse_args(arguments)
    known = [one for one in all_mutants(ROOT) if one.file.startswith(tuple(chosen.rooms))]
    sample = sampled(known, chosen.number, chosen.seed)
    print(f"{len(known)} mutants: {dict(Counter(one.kind for one in known))}")
    if chosen.list or not sample:
        for one in sample:
            print(f"{one.file}:{one.line}: {one.kind}: {one.before} -> {one.after}")
        return
    folder = chosen.output or Path(tempfile.mkdtemp(prefix="mutants-"))
    folder.mkdir(parents=True, exist_ok=True)
    tried(copied(ROOT, folder.resolve()), sample, folder / "results.jsonl", own=chosen.own)


def tried(copy: Path, sample: Sequence[Mutant], results: Path, *, own: bool = False) -> None:
    """Try mutants that have no result yet; append each result, and print the survivors."""
    lines = results.read_text("utf-8").splitlines() if results.exists() else []
    found = {Mutant(**one["mutant"]): str(one["noticed_by"]) for one in map(json.loads, lines)}
    for one, stamp in zip(sample, count(1), strict=False):
        if one not in found:
            test = found[one] = noticed_by(copy, one, stamp, own=own)
            if test and not passes_whole(copy, test):
                raise SystemExit(f"{test} fails without a mutant")
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"mutant": asdict(one), "noticed_by": test}) + "\n")
        words = f"noticed by {found[one]}" if found[one] else "SURVIVES"
        print(f"{one.file}:{one.line}: {one.before} -> {one.after}: {words}", flush=True)
    rooms = sorted({one.file.split("/")[0] for one in sample})
    for room in [*rooms, ""] if len(rooms) > 1 else [""]:
        some = [one for one in sample if one.file.startswith(room)]
        where = f"{room}: " if room else ""
        print(f"{where}{sum(bool(found[one]) for one in some)} of {len(some)} mutants noticed")


if __name__ == "__main__":
    main()
