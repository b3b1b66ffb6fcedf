"""The size and shape of the package: ``python -m tests.benchmarks.house``.

It prints the lines of code (without docstrings, comments and blank lines), wide folders, import
cycles, the number of modules in which code runs for a record on its way from file to table, and
the time of ``rockframe --help``.
"""

from __future__ import annotations

import argparse
import ast
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from types import FrameType

from tests.benchmarks.size import sized

PACKAGE = Path(__file__).resolve().parents[2] / "pipeline" / "rockframe"
#: A folder with more modules than this counts as wide.
WIDEST = 14


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


def imports(modules: dict[str, Path]) -> dict[str, set[str]]:
    """Return which modules each module imports when it runs, without imports only for types."""
    edges: dict[str, set[str]] = {}
    for name, path in modules.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for_types = {
            id(inner)
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
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

    file = PACKAGE.parents[1] / "records" / "ridgecrest2019" / "Ridgecrest2019-CCC.V1"
    records, pulses, response = (
        folder / f"{name}.nc" for name in ("records", "pulses", "response")
    )
    search, margins = sized(
        (None, None), (PulseOptions(surrogates=0), RespondOptions(margins="none"))
    )
    threading.setprofile(note)
    sys.setprofile(note)
    ingest_stage([file], records, workers=0)
    pulse_stage(records, pulses, search)
    respond_stage(records, response, margins, pulses_path=pulses)
    table_stage(records, pulses, response, folder / "table.csv")
    sys.setprofile(None)
    threading.setprofile(None)
    return {name for name in found if not name.startswith("rockframe.ingest.formats")}


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


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the numbers."""
    argparse.ArgumentParser(description=__doc__).parse_args(arguments)
    paths = sorted(PACKAGE.rglob("*.py"))
    modules = {
        ".".join(("rockframe", *path.relative_to(PACKAGE).with_suffix("").parts)): path
        for path in paths
        if path.name != "__init__.py"
    }
    folders = Counter(path.parent.relative_to(PACKAGE).as_posix() for path in modules.values())
    wide = {name: count for name, count in folders.items() if count > WIDEST}
    total = sum(lines_of_code(path.read_text(encoding="utf-8")) for path in paths)
    print(f"lines of code: {total} in {len(paths)} files")
    print(f"folders with more than {WIDEST} modules: {wide or 'none'}")
    print(f"modules in circles of imports: {', '.join(in_circles(imports(modules))) or 'none'}")
    with tempfile.TemporaryDirectory() as folder:
        print(f"modules on the way of a record: {len(on_the_way(Path(folder)))}, besides readers")
    print(f"rockframe --help: {help_time(sized(7, 1)):.2f} s")


if __name__ == "__main__":
    main()
