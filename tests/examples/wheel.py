"""`make test-wheel`: build the release, and use it as a stranger does, outside the repository.

The wheel and the sdist are built twice, and must have the same bytes. The wheel is installed with
its dependencies into an empty environment, from the index that pip uses, and every command of the
README and of the tutorial is run there, in an empty folder.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from .blocks import Block, blocks, missing

REPOSITORY: Final = Path(__file__).resolve().parents[2]
PAGES: Final = ("README.md", "docs/tutorial.md")
#: Words of blocks that are of the repository, not of the installed package.
OF_REPOSITORY: Final = ("make ", ".venv/", "workflows/")
TWINE: Final = "twine==7.0.0"
BIN: Final = "bin" if os.name == "posix" else "Scripts"


def done(*words: str | Path, at: Path, path: str = "", status: int = 0) -> str:
    """Run a program without this process's PYTHONPATH; return all that it printed."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment |= {"MPLBACKEND": "agg", "COLUMNS": os.environ.get("COLUMNS", "150")}
    environment["PATH"] = (
        f"{path}{os.pathsep}{environment['PATH']}" if path else environment["PATH"]
    )
    ended = subprocess.run(
        [str(word) for word in words],
        cwd=at,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        check=False,
    )
    assert ended.returncode == status, f"{words}: exit status {ended.returncode}\n{ended.stdout}"
    return ended.stdout


def built(source: Path, folder: Path) -> dict[str, Path]:
    """Build a wheel and an sdist with the build backend of this environment."""
    done(sys.executable, "-m", "hatchling", "build", "-d", folder, at=source)
    return {path.suffix: path for path in folder.iterdir()}


def environment(folder: Path, *packages: str | Path) -> Path:
    """Make an environment with these packages; return the folder of its programs."""
    venv.create(folder, with_pip=True, symlinks=os.name == "posix")
    programs = folder / BIN
    done(programs / "python", "-m", "pip", "install", "--quiet", *packages, at=folder)
    return programs


@pytest.fixture(scope="module")
def release(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the wheel and the sdist, by suffix: those in the folder ROCKFRAME_RELEASE, or new."""
    if folder := os.environ.get("ROCKFRAME_RELEASE"):
        return {path.suffix: path.resolve() for path in Path(folder).iterdir()}
    return built(REPOSITORY, tmp_path_factory.mktemp("release"))


@pytest.fixture(scope="module")
def programs(release: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    return environment(tmp_path_factory.mktemp("stranger"), release[".whl"])


@pytest.mark.skipif(os.name != "posix", reason="modes of files, which a sdist states, differ")
def test_a_second_build_and_one_from_the_sdist_have_the_same_bytes(
    release: dict[str, Path], tmp_path: Path
) -> None:
    again = built(REPOSITORY, tmp_path / "again")
    archive = release[".gz"]
    subprocess.run(["tar", "-xf", archive, "-C", tmp_path], check=True)  # on any Python 3.11
    (source,) = tmp_path.glob("rockframe-*")
    from_sdist = built(source, tmp_path / "from-sdist")
    for kind, path in release.items():
        assert again[kind].read_bytes() == path.read_bytes(), path.name
    assert from_sdist[".whl"].read_bytes() == release[".whl"].read_bytes()


def test_an_index_can_show_the_description(release: dict[str, Path], tmp_path: Path) -> None:
    python = environment(tmp_path / "twine", TWINE) / "python"
    said = done(python, "-m", "twine", "check", "--strict", *release.values(), at=tmp_path)
    assert said.count("PASSED") == 2, said


def test_every_command_of_the_first_pages_runs_outside_the_repository(
    programs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`rockframe` is that of the wheel, and nothing of the repository lies beside it."""
    where = "import rockframe; print(rockframe.__file__)"
    assert programs.parent in Path(done(programs / "python", "-c", where, at=tmp_path)).parents
    commands = 0
    for page in PAGES:
        folder = tmp_path / Path(page).stem
        folder.mkdir()
        printed: str | None = None
        so_far = ""
        for block in of_stranger(page):
            if block.kind == "columns":
                monkeypatch.setenv("COLUMNS", block.body)
            elif block.kind == "text" and "file" not in block.marks:
                lacking = missing(block.body, printed) if printed is not None else None
                assert lacking is None, f"{page}:{block.line}: not printed: {lacking!r}\n{printed}"
                printed = None
            elif "file" in block.marks:
                (folder / block.marks["file"]).write_text(block.body, encoding="utf-8")
            elif block.kind == "python":
                so_far += block.body
                printed = done(programs / "python", "-c", so_far, at=folder)
            elif block.kind == "sh":
                commands += block.body.count("rockframe ")
                printed = shell(block, programs, folder)
    assert commands >= 10


def of_stranger(page: str) -> Iterator[Block]:
    """Yield the blocks of a page that need the installed package only."""
    skipped = False
    for block in blocks((REPOSITORY / page).read_text(encoding="utf-8")):
        if block.kind == "sh":
            skipped = "not run" in block.marks or any(word in block.body for word in OF_REPOSITORY)
        if block.kind != "picture" and not (skipped and block.kind in ("sh", "text")):
            yield block


def shell(block: Block, programs: Path, folder: Path) -> str:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash, in which the commands of the pages are written")
    status = int(block.marks.get("exit", "0"))
    words = (bash, "-euo", "pipefail", "-c", block.body)
    return done(*words, at=folder, path=str(programs), status=status)
