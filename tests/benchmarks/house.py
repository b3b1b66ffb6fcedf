"""The size and shape of the package: ``python -m tests.benchmarks.house``.

It prints lines and modules, wide folders, circles of imports, how many places one stage and one
figure take, how much a command loads, how often one record is constructed and one file is hashed,
and the time of ``rockframe --help``. Each number is defined by the function that counts it.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import io
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from types import FrameType
from typing import Any
from unittest.mock import patch

from tests.benchmarks.size import sized
from tests.commands import commands, options_of

PACKAGE = Path(__file__).resolve().parents[2] / "pipeline" / "rockframe"
#: A folder with more modules than this counts as wide.
WIDEST = 14
#: A file with the records of one instrument.
RECORDS = PACKAGE.parents[1] / "records" / "ridgecrest2019" / "Ridgecrest2019-CCC.V1"
#: Stages and a figure whose places are counted.
STAGES = ("rocking_spectrum", "compare")
FIGURE = "joints"
#: A quantity and a kind of structure whose files are counted.
QUANTITY = "peak_tendon_ratio"
STRUCTURE = "isolated_deck"
#: Names that do not say what a variable holds.
VAGUE = ("one", "found", "stated", "known", "made", "what")
#: A study without figures, surrogates and margins.
STUDY = f"""
name = "house"
[records]
paths = ["{RECORDS.as_posix()}"]
[pulse]
surrogates = 0
[respond]
margins = "none"
[figures]
most = 0
[[structure]]
name = "bent"
height_m = 9.6
width_m = 1.6
mass_ratio = 4.0
"""


def lines_of_code(text: str) -> int:
    """Return the number of lines that are neither docstring nor comment nor blank."""
    hidden: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        body = getattr(node, "body", None)
        first = body[0] if isinstance(body, list) and body else None
        if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
            hidden |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(
        bool(line.strip()) and not line.lstrip().startswith("#") and number not in hidden
        for number, line in lines
    )


def lines_of_imports(text: str) -> int:
    """Return the number of lines of import statements, wherever they stand."""
    statements = (
        n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Import | ast.ImportFrom)
    )
    return sum((one.end_lineno or one.lineno) - one.lineno + 1 for one in statements)


def names_in(text: str) -> Iterator[str]:
    """Yield the names in the code of a file, and its texts of one word; no docstrings, no prose."""
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.keyword(arg=str(name)):
                yield name
            case ast.alias(name=name) | ast.ImportFrom(module=str(name)):
                yield name
            case ast.Constant(value=str(name)) if not re.search(r"\s", name):
                yield name


def vague_names(texts: Iterable[str]) -> Counter[str]:
    """Return how often variables and parameters have a name of `VAGUE`, for each name."""
    nodes = (node for text in texts for node in ast.walk(ast.parse(text)))
    return Counter(
        name
        for node in nodes
        for name in (
            [node.id]
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
            else [node.arg]
            if isinstance(node, ast.arg)
            else []
        )
        if name in VAGUE
    )


def modules_naming(texts: Iterable[str], word: str) -> int:
    """Return the number of files whose code has a word as a name, or as part of one.

    ``compare`` is part of ``compare_stage``, ``CompareOptions`` and ``compare.nc``, not of
    ``compared``.
    """
    camel = "".join(part.title() for part in word.split("_"))
    pattern = re.compile(rf"(?<![a-z])({word}|{word.upper()})(?![a-z])|{camel}(?![a-z])")
    return sum(any(map(pattern.search, names_in(text))) for text in texts)


def layers_of_figure(texts: Iterable[str], figure: str) -> int:
    """Return the number of files whose code names a figure's function or the kind of its dataset.

    They are ``draw_NAME``, ``NAME_dataset`` and ``NAME`` in capitals.
    """
    pattern = re.compile(rf"\b(draw_{figure}|{figure}_dataset|{figure.upper()})\b")
    return sum(any(map(pattern.search, names_in(text))) for text in texts)


def used_once(texts: Sequence[str]) -> tuple[int, int]:
    """Return the number of functions, methods and classes used in one place, and of all of them.

    Places are names and attributes in the code of the package, besides the definition and imports;
    so two definitions of one name share their places. Special methods are not counted.
    """
    trees = [ast.parse(text) for text in texts]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    defined = [
        node.name
        for node in nodes
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("__")
    ]
    used = Counter(
        node.id if isinstance(node, ast.Name) else node.attr
        for node in nodes
        if isinstance(node, ast.Name | ast.Attribute)
    )
    return sum(used[name] == 1 for name in defined), len(defined)


def imports(modules: dict[str, Path], *, types: bool = False) -> dict[str, set[str]]:
    """Return which modules each module imports; with `types`, also those imported for types."""
    edges: dict[str, set[str]] = {}
    for name, path in modules.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for_types = {
            id(inner)
            for node in ast.walk(tree)
            if not types and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            for inner in ast.walk(node)
        }
        edges[name] = {
            target
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and node.module and id(node) not in for_types
            for target in (node.module, *(f"{node.module}.{alias.name}" for alias in node.names))
            if target in modules and target != name
        }
    return edges


def in_circles(edges: dict[str, set[str]]) -> list[str]:
    """Return the modules that are part of an import cycle."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        todo = [start]
        while todo:
            for name in edges[todo.pop()] - seen:
                seen.add(name)
                todo.append(name)
        return seen

    return sorted(name for name in edges if name in reached(name))


def on_the_way(folder: Path) -> set[str]:
    """Return the modules in which a function runs from a record's file to the table.

    The readers of formats are not included: a record passes through one of them.
    """
    from rockframe import ingest_stage, pulse_stage, respond_stage
    from rockframe.options.pulse import PulseOptions
    from rockframe.options.respond import RespondOptions
    from rockframe.stages.table import table_stage

    found: set[str] = set()

    def note(frame: FrameType, event: str, _argument: object) -> None:
        name = str(frame.f_globals.get("__name__"))
        if event == "call" and name.startswith("rockframe.") and frame.f_code.co_name != "<module>":
            found.add(name)

    records, pulses, response = (
        folder / f"{name}.nc" for name in ("records", "pulses", "response")
    )
    search, margins = sized(
        (None, None), (PulseOptions(surrogates=0), RespondOptions(margins="none"))
    )
    threading.setprofile(note)
    sys.setprofile(note)
    ingest_stage([RECORDS], records, workers=0)
    pulse_stage(records, pulses, search)
    respond_stage(records, response, margins, pulses_path=pulses)
    table_stage(records, pulses, response, folder / "table.csv")
    sys.setprofile(None)
    threading.setprofile(None)
    return {name for name in found if not name.startswith("rockframe.ingest.formats")}


def loaded_by(*words: str) -> tuple[int, bool]:
    """Return the number of modules of the package that a command loads, and whether numba is."""
    program = (
        "import sys\nfrom rockframe.cli.main import main\n"
        "status = main(sys.argv[1:])\n"
        "own = sum(name.split('.')[0] == 'rockframe' for name in sys.modules)\n"
        "print(status, own, 'numba' in sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=True
    )
    status, own, numba = done.stdout.split()[-3:]
    if status not in ("0", "1"):
        raise RuntimeError(done.stderr)
    return int(own), numba == "True"


def constructions(folder: Path) -> float:
    """Return how often a `Record` is constructed for each record that ingest writes."""
    from rockframe import ingest_stage
    from rockframe.record import Record
    from rockframe.results.records import read_records

    made = []
    checked = Record.__post_init__

    def counted(self: Record) -> None:
        made.append(self.record_id)
        checked(self)

    with patch.object(Record, "__post_init__", counted):
        ingest_stage([RECORDS], folder / "once.nc", workers=0)
    return len(made) / len(read_records(folder / "once.nc"))


def hashed(*words: str) -> dict[str, int]:
    """Return how often a command hashes each file, by its name."""
    from rockframe.cli.main import main as command

    files = []
    digest = hashlib.file_digest

    def noted(stream: Any, *arguments: Any) -> Any:
        files.append(Path(stream.name).name)
        return digest(stream, *arguments)

    with (
        patch.object(hashlib, "file_digest", noted),
        redirect_stdout(io.StringIO()),
        redirect_stderr(io.StringIO()),
    ):
        status = command(list(words))
    if status not in (0, 1):
        raise RuntimeError(f"{words} ended with {status}")
    return Counter(files)


def help_time(runs: int) -> float:
    """Return the shortest time of ``rockframe --help`` [s], with bytecode already compiled."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    took = []
    for _ in range(runs):
        start = time.perf_counter()
        subprocess.run(
            [sys.executable, "-m", "rockframe", "--help"],
            env=environment,
            stdout=subprocess.DEVNULL,
            check=True,
        )
        took.append(time.perf_counter() - start)
    return min(took)


def option_count() -> int:
    """Return the number of options of all commands, besides ``--help``."""
    options = (action for name in commands() for action in options_of(name))
    return sum(bool(one.option_strings) and one.dest != "help" for one in options)


def show_code(paths: Sequence[Path]) -> None:
    """Print what is counted in the code as it stands."""
    texts = [path.read_text(encoding="utf-8") for path in paths]
    modules = {
        ".".join(("rockframe", *path.relative_to(PACKAGE).with_suffix("").parts)): path
        for path in paths
        if path.name != "__init__.py"
    }
    folders = Counter(path.parent.relative_to(PACKAGE).as_posix() for path in modules.values())
    wide = {name: count for name, count in folders.items() if count > WIDEST}
    total, lines = (sum(map(count, texts)) for count in (lines_of_code, lines_of_imports))
    once, defined = used_once(texts)
    print(f"lines of code: {total} in {len(modules)} modules and {len(paths) - len(modules)} rooms")
    print(f"lines of imports: {lines}, {100.0 * lines / total:.1f} %")
    print(f"definitions used once: {once} of {defined}")
    vague = vague_names(texts)
    print(f"variables with a vague name: {vague.total()} ({dict(vague.most_common())})")
    print(f"folders with more than {WIDEST} modules: {wide or 'none'}")
    for what, types in (("", False), (", also for types", True)):
        circle = in_circles(imports(modules, types=types))
        print(f"modules in circles of imports{what}: {len(circle)} {', '.join(circle)}".rstrip())
    for stage in STAGES:
        print(f"files that name the stage {stage}: {modules_naming(texts, stage)}")
    print(f"files that the figure {FIGURE} passes: {layers_of_figure(texts, FIGURE)}")
    print(f"files that name the quantity {QUANTITY}: {modules_naming(texts, QUANTITY)}")
    print(f"files that name the structure {STRUCTURE}: {modules_naming(texts, STRUCTURE)}")


def show_runs(folder: Path) -> None:
    """Print what is counted while commands run."""
    print(f"options of all commands: {option_count()}")
    (folder / "house.toml").write_text(STUDY, encoding="utf-8")
    study = ("run", str(folder / "house.toml"), "--output", str(folder / "run"))
    hashed(*study)
    again = hashed(*study)
    ingest = ("ingest", str(RECORDS), "--output", str(folder / "alone.nc"))
    for what, words in (("ingest of one file", ingest), ("a run with nothing to do", study)):
        own, numba = loaded_by(*words)
        print(f"modules loaded by {what}: {own}, {'with' if numba else 'without'} numba")
    print(f"constructions of a record on its way to records.nc: {constructions(folder):.1f}")
    print(f"times that files are hashed when a run has nothing to do: {_times(again)}")
    print(f"modules on the way of a record: {len(on_the_way(folder))}, besides readers")


def _times(counts: Mapping[str, int]) -> str:
    most = max(counts.values(), default=0)
    names = sorted(name for name, times in counts.items() if times == most > 1)
    words = f"most {most}" + (f" ({', '.join(names)})" if names else "")
    return f"{words}, records.nc {counts.get('records.nc', 0)}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the numbers."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    show_code(sorted(PACKAGE.rglob("*.py")))
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        show_runs(Path(folder))
    print(f"rockframe --help: {help_time(sized(7, 1)):.2f} s")


if __name__ == "__main__":
    main()
