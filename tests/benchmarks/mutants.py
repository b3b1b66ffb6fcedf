"""Sampled mutants of the package: ``python -m tests.benchmarks.mutants --output outputs/mutants``.

A mutant is the package with one small fault: a number, comparison or sign is changed, a quantile is
moved, ``abs`` is removed, or the last element of a tuple of constants is dropped. The tests that
reach its line in the runs of `tests.benchmarks.coverage` run on it, the fastest first, and first
with plain Python in the place of numba, as compiling a kernel lasts minutes. A mutant that they all
pass has survived, and shows a threshold that no test notices, unless it computes the same. The
output folder has a copy of the repository, in which alone files are changed, and the results, one
line each; the next run with the same folder resumes.
"""

from __future__ import annotations

import argparse
import ast
import json
import math
import multiprocessing
import os
import random
import re
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from itertools import accumulate, count
from pathlib import Path
from resource import RLIMIT_CPU, setrlimit
from typing import Final

import pytest
from tests.benchmarks.coverage import PACKAGE, PLAIN, ROOT
from tests.benchmarks.size import sized

KINDS: Final = ("number", "comparison", "sign", "quantile", "abs", "tuple")
_COMPARISONS: Final[dict[type[ast.cmpop], str]] = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
}
#: Processor seconds of the tests of a mutant, by kind of run: the fastest that reach it.
_LONGEST: Final = {"plain": 10.0, "compiled": 60.0}
#: Processor seconds after which they are ended, besides their time: the mutant loops, which
#: is noticed. Kernels are compiled again.
_LOOPING: Final = {"plain": 10.0, "compiled": 400.0}
#: The same for all tests that notice a mutant, which must pass without it.
_WHOLE: Final = 3600
#: Ending of the file without the mutant, while the mutant is tried.
_ORIGINAL: Final = ".original"
#: Starts processes that have imported what takes long.
_SERVER: Final = multiprocessing.get_context("forkserver")
_SERVER.set_forkserver_preload(
    ["pytest", "numba.extending", "scipy.signal", "scipy.stats", "xarray", "pydantic"]
)


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


@dataclass(frozen=True)
class Reaching:
    """The tests that reach each line of a file, by kind of run, and what they took.

    Parameters
    ----------
    lines : dict
        Tests by kind of run and line.
    seconds : dict
        Processor time of each test that passed [s], by kind of run, the fastest first.
    """

    lines: dict[str, dict[int, list[str]]]
    seconds: dict[str, dict[str, float]]

    def tests(self, mutant: Mutant, kind: str) -> list[str]:
        """Return the fastest tests of a mutant; all that reach the file, for a constant of it.

        Tests that pass plain are not run again compiled.
        """
        data = (ROOT / PACKAGE / mutant.file).read_bytes()
        first = max(
            (
                node.lineno
                for node in ast.walk(ast.parse(data))
                if isinstance(node, ast.stmt)
                and node.lineno <= mutant.line <= (node.end_lineno or 0)
            ),
            default=mutant.line,  # of a decorator
        )
        found: set[str] = set()
        for lines in self.lines.values():
            some = {t for k in range(first, mutant.line + 1) for t in lines.get(k, ()) if t}
            found |= some or {test for tests in lines.values() for test in tests if test}
        if kind == "compiled":
            found -= self.seconds["plain"].keys()
        known = {test: taken for test, taken in self.seconds[kind].items() if test in found}
        sums = zip(known, accumulate(known.values()), strict=True)
        return [test for test, sum_ in sums if sum_ <= _LONGEST[kind] or test == next(iter(known))]


@cache
def reaching(folder: Path, file: str) -> Reaching:
    """Return the tests that reach a file, from the runs of `tests.benchmarks.coverage`."""
    from coverage import CoverageData

    lines, seconds = {}, {}
    for kind in _LONGEST:
        data = CoverageData(str(folder / f".coverage.{kind}"))
        data.read()
        own = (PACKAGE / file).as_posix()
        path = next((one for one in data.measured_files() if one.endswith(own)), "")
        lines[kind] = data.contexts_by_lineno(path)
        times = folder / f"{kind}.jsonl"
        taken = map(json.loads, times.read_text("utf-8").splitlines() if times.exists() else ())
        passed = sorted((second, test) for test, second, good in taken if good)
        seconds[kind] = {test: second for second, test in passed}
    return Reaching(lines, seconds)


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
    for kept in (copy / PACKAGE).rglob(f"*{_ORIGINAL}"):  # of a run that was killed
        kept.replace(kept.with_suffix(".py"))
    return copy


def first_failure(copy: Path, tests: Sequence[str], kind: str, seconds: float) -> str:
    """Return the first of some tests of a copy that fails; "" if all pass.

    It is the first one if they need more processor time, or if a module cannot be imported.
    """
    words = ["-q", "-x", "--tb=no", "-p", "no:cacheprovider", *tests]
    words += ["-W", "ignore::RuntimeWarning"] if kind == "plain" else []
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as log:
        process = _SERVER.Process(
            target=_test, args=(copy, words, kind, math.ceil(seconds), log.name)
        )
        process.start()
        process.join()
        said = log.read()
    named = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", said, re.MULTILINE)
    if process.exitcode == pytest.ExitCode.USAGE_ERROR and "loading conftest" not in said:
        raise SystemExit(f"{copy} lacks tests that reach a line: remove it, and make coverage")
    if process.exitcode == pytest.ExitCode.OK:
        return ""
    return named[1] if named else tests[0]


def _test(copy: Path, words: list[str], kind: str, seconds: int, log: str) -> None:
    """Run pytest in a process that has imported all but the package."""
    if kind == "plain":
        import numba

        os.environ |= PLAIN
        numba.config.reload_config()  # type: ignore[no-untyped-call]
    with Path(log).open("w", encoding="utf-8") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    setrlimit(RLIMIT_CPU, (seconds, seconds))
    os.chdir(copy)
    own = [str(copy / "pipeline"), str(copy)]
    sys.path[:0] = own
    os.environ["PYTHONPATH"] = os.pathsep.join(own)  # of the processes that tests start
    code = pytest.main(words)
    sys.stdout.flush()
    os._exit(code)


def noticed_by(
    copy: Path, mutant: Mutant, stamp: int, reached: Reaching, kinds: Sequence[str]
) -> str:
    """Return the kind of run and the first test that notices a mutant; "" if none does."""
    path = copy / PACKAGE / mutant.file
    kept = path.with_suffix(_ORIGINAL)
    whole, times = path.read_bytes(), path.stat()
    partial = kept.with_suffix(".partial")
    shutil.copy2(path, partial)
    partial.replace(kept)  # a run that is killed leaves the whole file
    try:
        path.write_bytes(whole[: mutant.start] + mutant.after.encode() + whole[mutant.end :])
        # Python compares times in whole seconds to see that a file has changed
        os.utime(path, (times.st_atime, times.st_mtime + stamp))
        for kind in kinds:
            tests = reached.tests(mutant, kind)
            longest = _LOOPING[kind] + sum(reached.seconds[kind][test] for test in tests)
            failed = first_failure(copy, tests, kind, longest) if tests else ""
            if failed:
                return f"{kind} {failed}"
        return ""
    finally:
        kept.replace(path)


def main(arguments: Sequence[str] | None = None) -> None:
    """Try the mutants of a sample, and print those that survive."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, help="folder of the copy and the results")
    parser.add_argument("--number", type=int, default=sized(30, 0), help="mutants (default: 30)")
    parser.add_argument("--seed", type=int, default=1, help="seed of the sample (default: 1)")
    parser.add_argument("--rooms", nargs="+", default=[""], help="only files below these")
    help_ = "folder of `make coverage`, which says which tests reach a line"
    parser.add_argument("--reached", type=Path, default=Path("outputs", "coverage"), help=help_)
    help_ = "only without compilation; the next run tries what survives"
    parser.add_argument("--plain", action="store_true", help=help_)
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
    if not (chosen.reached / "plain.jsonl").exists():
        raise SystemExit(f"{chosen.reached} does not say which tests reach a line: make coverage")
    copy, kinds = copied(ROOT, folder.resolve()), ("plain",) if chosen.plain else tuple(_LONGEST)
    tried(copy, sample, folder / "results.jsonl", chosen.reached.resolve(), kinds)


def tried(
    copy: Path, sample: Sequence[Mutant], results: Path, reached: Path, kinds: Sequence[str]
) -> None:
    """Try mutants that have no result yet; append each result, and print the survivors."""
    lines = results.read_text("utf-8").splitlines() if results.exists() else []
    known = {Mutant(**one["mutant"]): one for one in map(json.loads, lines)}  # the last counts
    found = {}
    for one, stamp in zip(sample, count(1), strict=False):
        before = known.get(one, {"noticed_by": "", "tried": []})
        found[one] = before["noticed_by"]
        rest = [kind for kind in kinds if kind not in before["tried"]]
        if rest and not found[one]:
            found[one] = noticed_by(copy, one, stamp, reaching(reached, one.file), rest)
            result = {"mutant": asdict(one), "noticed_by": found[one]}
            with results.open("a", encoding="utf-8") as file:
                file.write(json.dumps({**result, "tried": before["tried"] + rest}) + "\n")
        words = f"noticed by {found[one]}" if found[one] else "SURVIVES"
        print(f"{one.file}:{one.line}: {one.before} -> {one.after}: {words}", flush=True)
    for kind in kinds:
        tests = {test.removeprefix(f"{kind} ") for test in found.values() if test.startswith(kind)}
        failed = first_failure(copy, sorted(tests), kind, _WHOLE) if tests else ""
        if failed:
            raise SystemExit(f"{failed} fails without a mutant")
    rooms = sorted({one.file.split("/")[0] for one in sample})
    for room in [*rooms, ""] if len(rooms) > 1 else [""]:
        some = [one for one in sample if one.file.startswith(room)]
        where = f"{room}: " if room else ""
        print(f"{where}{sum(bool(found[one]) for one in some)} of {len(some)} mutants noticed")


if __name__ == "__main__":
    main()
