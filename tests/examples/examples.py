"""`make test-examples`: run every example of the README and of the documentation unchanged."""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import pytest
from tests.conftest import SHARED
from tests.pictures import TOLERANCE, comparable, difference, for_page

from .blocks import Block, blocks, missing

REPOSITORY: Final = Path(__file__).resolve().parents[2]
PAGES: Final = [
    REPOSITORY / "README.md",
    *sorted(path for path in (REPOSITORY / "docs").rglob("*.md") if "generated" not in path.parts),
]
#: Files that the commands of a page may use.
BESIDE: Final = ("Makefile", "pyproject.toml", "requirements.lock")


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder like a clone that is set up: bundled records, no results."""
    for name in BESIDE:
        shutil.copy(REPOSITORY / name, tmp_path)
    shutil.copytree(REPOSITORY / "records", tmp_path / "records")
    shutil.copytree(REPOSITORY / "workflows" / "studies", tmp_path / "workflows" / "studies")
    # A folder of its own, so that `make` could never rebuild the environment of the clone.
    (tmp_path / ".venv").mkdir()
    for entry in Path(sys.prefix).iterdir():
        if entry.name != ".made":
            (tmp_path / ".venv" / entry.name).symlink_to(entry)
    (tmp_path / ".venv" / ".made").touch()
    monkeypatch.chdir(tmp_path)
    commands = Path(sys.executable).parent
    monkeypatch.setenv("PATH", f"{commands}{os.pathsep}{os.environ['PATH']}")
    # for `python -m tests.examples.downloads`, and for the package of this tree
    folders = (REPOSITORY, REPOSITORY / "pipeline")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, folders)))
    monkeypatch.setenv("SHARED", str(SHARED))  # real files of others that some pages begin with
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.setenv("COLUMNS", "150")
    return tmp_path


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(REPOSITORY).as_posix())
@pytest.mark.usefixtures("workplace")
def test_the_examples_of_a_page_run_and_print_what_is_shown(
    page: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = page.read_text(encoding="utf-8")
    if "$SHARED" in text and not SHARED.is_dir():
        pytest.skip("begins with real files, which are not beside the repository")
    names: dict[str, Any] = {"__name__": "__main__"}
    printed: str | None = None
    for block in blocks(text):
        where = f"{page.relative_to(REPOSITORY)}:{block.line}"
        if block.kind == "columns":
            monkeypatch.setenv("COLUMNS", block.body)
            continue
        if block.kind == "picture":
            shown, drawn = block.body.split()
            found = for_page(Path(drawn), Path("for-page.png"))
            assert not comparable() or difference(REPOSITORY / shown, found) <= TOLERANCE, (
                f"{where}: {shown} is not the picture that the commands draw"
            )
            continue
        if block.kind == "text" and "file" not in block.marks:
            lacking = missing(block.body, printed) if printed is not None else None
            assert lacking is None, f"{where}: not printed: {lacking!r} in\n{printed}"
            printed = None
            continue
        printed = None if "not run" in block.marks else run(block, names, where)


def run(block: Block, names: dict[str, Any], where: str) -> str | None:
    """Run a block; return what it printed, or None if it has nothing to run."""
    if "file" in block.marks:
        Path(block.marks["file"]).write_text(block.body, encoding="utf-8")
        return None
    if block.kind == "sh":
        return shell(block, where)
    if block.kind == "python":
        return python(block, names, where)
    return None


def shell(block: Block, where: str) -> str:
    words = ["bash", "-euo", "pipefail", "-c", block.body]
    found = subprocess.run(words, capture_output=True, text=True, check=False)
    printed = found.stdout + found.stderr
    wanted = int(block.marks.get("exit", "0"))
    assert found.returncode == wanted, f"{where}: exit status {found.returncode}\n{printed}"
    return printed


def python(block: Block, names: dict[str, Any], where: str) -> str:
    """Run statement by statement; a number in a comment after an expression is its value."""
    output = io.StringIO()
    lines = block.body.splitlines()
    with contextlib.redirect_stdout(output):
        for statement in ast.parse(block.body).body:
            if not isinstance(statement, ast.Expr):
                exec(compile(ast.Module([statement], []), where, "exec"), names)  # noqa: S102
                continue
            value = eval(compile(ast.Expression(statement.value), where, "eval"), names)  # noqa: S307
            assert statement.end_lineno is not None
            said = re.search(r"#\s*(-?\d+(?:\.(\d+))?)\s*$", lines[statement.end_lineno - 1])
            if said:
                shown = f"{value:.{len(said[2] or '')}f}"
                assert shown == said[1], f"{where}: {said[1]} is shown, {shown} is the value"
    return output.getvalue()
