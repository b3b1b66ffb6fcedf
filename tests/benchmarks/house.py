"""The size and shape of the package: lines of code, modules, wide folders, circles of imports.

Lines of code are those without docstrings, comments and blank lines: ``python -m
tests.benchmarks.house``.
"""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "pipeline" / "rockframe"
#: A folder with more modules than this is wide.
WIDEST = 14


def lines_of_code(text: str) -> int:
    """Return the number of lines that are no docstring, no comment and not blank."""
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
    """Return which modules each one imports when it is run, imports for types alone left out."""
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
    """Return the modules that import themselves, by whichever way."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        todo = [start]
        while todo:
            for name in edges[todo.pop()] - seen:
                seen.add(name)
                todo.append(name)
        return seen

    return sorted(name for name in edges if name in reached(name))


def main() -> None:
    """Print the numbers."""
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


if __name__ == "__main__":
    main()
