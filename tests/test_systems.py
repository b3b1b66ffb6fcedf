"""The package on other systems: without POSIX-only features, and installed from a wheel."""

from __future__ import annotations

import os
import subprocess
import sys
import venv
import zipfile
from collections.abc import Iterable
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from tests.conftest import REPOSITORY
from tests.runs.small import FEW, contents, make_study, run
from tests.test_dependencies import PROJECT

from rockframe.cli.main import _VERBS

#: Code that removes what Windows lacks from each process before anything is imported.
ELSEWHERE = """
import os, signal, sys
sys.modules.update(dict.fromkeys(["fcntl", "resource", "pwd", "grp", "termios"]))
for module, names in ((os, "fork forkpty killpg getpgid geteuid getuid"),
                      (signal, "SIGALRM setitimer alarm SIGHUP SIGUSR1 pthread_sigmask")):
    for name in names.split():
        vars(module).pop(name, None)
open(os.path.join(os.path.dirname(__file__), "loaded"), "w").close()
"""


def test_a_run_needs_nothing_that_only_posix_has(tmp_path: Path) -> None:
    """Locks, limits of workers and signals are used where available; the results do not change."""
    study = make_study(tmp_path, 3, FEW)
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(ELSEWHERE, encoding="utf-8")
    path = [str(tmp_path / "site"), os.environ.get("PYTHONPATH")]
    words = [sys.executable, "-m", "rockframe", "run", str(study), "--workers", "2"]
    done = subprocess.run(
        [*words, "--output", str(tmp_path / "there")],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, path))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert (tmp_path / "site" / "loaded").exists()
    assert run(study, tmp_path / "here") == 0
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def done(*words: str | Path, at: Path) -> str:
    """Run a program that must succeed, without this process's PYTHONPATH; return its output."""
    told = subprocess.run(
        [str(word) for word in words],
        cwd=at,
        env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 0, told.stderr
    return told.stdout


def build(source: Path, folder: Path, kind: str) -> Path:
    """Build a wheel or an sdist, without a network."""
    done(sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", folder, at=source)
    (made,) = folder.glob("*.whl" if kind == "wheel" else "*.tar.gz")
    return made


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(REPOSITORY, tmp_path_factory.mktemp("wheel"), "wheel")


@pytest.mark.faults
def test_the_sdist_is_whole_and_builds_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    archive = build(REPOSITORY, tmp_path, "sdist")
    subprocess.run(["tar", "-xf", archive, "-C", tmp_path], check=True)  # on any Python 3.11
    (source,) = (path for path in tmp_path.iterdir() if path.is_dir())
    for name in ("LICENSE", "README.md", "CHANGELOG.md", "tests/conftest.py", "docs/theory.md"):
        assert (source / name).read_bytes() == (REPOSITORY / name).read_bytes()
    again = build(source, tmp_path / "again", "wheel")
    with zipfile.ZipFile(wheel) as ours, zipfile.ZipFile(again) as theirs:
        names = sorted(ours.namelist())
        assert names == sorted(theirs.namelist())
        assert [name for name in names if ours.read(name) != theirs.read(name)] == []
        assert {"rockframe/data/ridgecrest2019/catalogue.csv", "rockframe/py.typed"} <= {*names}


@pytest.fixture(scope="module")
def bare(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command of a new environment: the wheel, and what it needs without its extras."""
    home = tmp_path_factory.mktemp("bare")
    venv.create(home, with_pip=True)
    programs = home / "bin"
    done(programs / "python", "-m", "pip", "install", "--no-deps", "--no-index", wheel, at=home)
    (site,) = home.rglob("site-packages")
    for name in needed(PROJECT["dependencies"]):
        for file in distribution(name).files or ():
            top = site / file.parts[0]
            if not top.exists() and file.parts[0] not in ("..", "__pycache__"):
                top.symlink_to(Path(np.__file__).parents[1] / file.parts[0])
    return programs / "rockframe"


def needed(dependencies: Iterable[str]) -> set[str]:
    """Return the names of all distributions that dependencies need, and their own."""
    found: dict[str, Requirement] = {}
    waiting = [*map(Requirement, dependencies)]
    while waiting:
        one = waiting.pop()
        if one.name not in found:
            found[one.name] = one
            for other in map(Requirement, distribution(one.name).requires or ()):
                extras = one.extras or {""}
                if other.marker is None or any(other.marker.evaluate({"extra": e}) for e in extras):
                    waiting.append(other)
    return set(found)


def refused(*words: str | Path, at: Path) -> str:
    """Run a command that must end with an error in one line; return it."""
    ended = subprocess.run(
        [str(word) for word in words], cwd=at, capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr.count("\n")) == (2, 1), ended.stderr
    return ended.stderr


@pytest.mark.faults
@pytest.mark.skipif(os.name != "posix", reason="links the packages of this environment")
def test_each_command_of_the_wheel_helps_and_refuses_without_extras(
    bare: Path, tmp_path: Path
) -> None:
    """A package that only an extra asks for must not be needed by another command."""
    for name in _VERBS:
        assert f"rockframe {name}" in done(bare, name, "--help", at=tmp_path)
        assert "unknown option --no-such" in refused(bare, name, "--no-such-option", at=tmp_path)
    said = refused(bare, "explore", at=tmp_path)
    assert "is not installed. Install the explorer with: pip install 'rockframe[explorer]'" in said
    assert "bridge-bent" in done(bare, "table1", at=tmp_path)
    records = tmp_path / "outputs" / "table1" / "records.nc"
    words = ("respond", records, "--output", tmp_path / "r.nc")
    assert "rockframe[dask]" in refused(bare, *words, "--scheduler", "tcp://one:1", at=tmp_path)
    assert "rockframe[tables]" in refused(bare, "table1", "--format", "xlsx", at=tmp_path)


@pytest.mark.faults
def test_the_wheel_runs_in_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    """The package comes from the installed wheel, its dependencies from this environment."""
    home, empty = tmp_path / "venv", tmp_path / "empty"
    empty.mkdir()
    venv.create(home, with_pip=True, symlinks=os.name == "posix")
    programs = home / ("bin" if os.name == "posix" else "Scripts")
    python = programs / "python"
    done(python, "-m", "pip", "install", "--no-deps", "--no-index", wheel, at=empty)
    (site,) = home.rglob("site-packages")
    packages = Path(np.__file__).parents[1]
    (site / "dependencies.pth").write_text(f"{packages}\n", encoding="utf-8")
    where = done(python, "-c", "import rockframe; print(rockframe.__file__)", at=empty)
    assert Path(where.strip()).parents[1] == site
    assert "bridge-bent" in done(programs / "rockframe", "table1", at=empty)
    done(python, "-m", "rockframe", "report", "outputs/table1", at=empty)
    assert (empty / "outputs" / "table1" / "report.html").stat().st_size > 100_000
