"""The declared dependencies are those that the package imports; other versions do not break it."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

import numba
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from tests.conftest import REPOSITORY

import rockframe.compiled as compilation
from rockframe.cli.main import _options_of
from rockframe.errors import RockframeWarning
from rockframe.fetch import service

PACKAGE: Final = REPOSITORY / "pipeline" / "rockframe"
PROJECT: Final = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
#: Distributions whose packages have another name.
NAMES: Final = {"openquake": "openquake-engine", "pywt": "pywavelets"}
#: Extras of users, and where their packages are imported.
EXTRAS: Final[dict[str, str | tuple[str, ...]]] = {
    "explorer": "explorer/server.py",
    "tables": ("results/tables", "ingest/tables.py"),
    "dask": "engines",
    "openquake": "selection/models.py",
    "pdf": "stages/report.py",
}


def declared(extra: str = "") -> set[str]:
    """Return the names of the dependencies of the package or of an extra."""
    stated = PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    return {canonicalize_name(Requirement(one).name) for one in stated}


def imported(node: ast.AST) -> Iterator[str]:
    """Yield the packages that code imports when it runs."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        nodes: list[ast.AST] = [*node.orelse]
    else:
        nodes = [*ast.iter_child_nodes(node)]
    if isinstance(node, ast.Import):
        yield from (one.name.split(".")[0] for one in node.names)
    elif isinstance(node, ast.ImportFrom) and node.level == 0:
        yield str(node.module).split(".")[0]
    for one in nodes:
        yield from imported(one)


def test_what_is_imported_is_declared() -> None:
    """A package that another one happens to need may be gone with its next version."""
    unused = declared()
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE).as_posix()
        some = [declared(extra) for extra, where in EXTRAS.items() if place.startswith(where)]
        known = declared().union(*some)
        for name in imported(ast.parse(path.read_text("utf-8"))):
            if name not in sys.stdlib_module_names and name != "rockframe":
                distribution = canonicalize_name(NAMES.get(name, name))
                assert distribution in known, f"{place} imports {name}"
                unused.discard(distribution)
    assert not unused


def test_packages_whose_internals_are_used_have_an_upper_bound() -> None:
    stated = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["explorer"]]
    bounds = {r.name: str(r.specifier) for r in map(Requirement, stated)}
    for name in ("numba", "obspy", "pydantic", "uvicorn", "xarray"):
        assert "<" in bounds[name]
        locked = (REPOSITORY / "requirements.lock").read_text("utf-8")
        (version,) = re.findall(rf"(?m)^{name}==(\S+)", locked)
        assert Requirement(f"{name}{bounds[name]}").specifier.contains(version)


def test_each_internal_of_numba_is_there() -> None:
    """The tests run with all of them, so that none is lost unnoticed."""
    compilation.has_internals.cache_clear()
    assert compilation.has_internals()


def twice(x: float) -> float:
    return 2.0 * x


def of_part(x: float) -> float:
    return part(x) + 1.0


part: Callable[[float], float] = twice


@pytest.fixture
def other_numba(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A version of numba that lacks an internal."""
    missing = ("numba.core.types", "unliteral_of_another_version")
    monkeypatch.setattr(compilation, "INTERNALS", (*compilation.INTERNALS, missing))
    compilation.has_internals.cache_clear()
    yield
    monkeypatch.undo()
    compilation.has_internals.cache_clear()


@pytest.mark.usefixtures("other_numba")
def test_without_an_internal_numba_caches_by_its_own_means(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setitem(globals(), "part", compilation.compiled(twice))
    made = cast("Any", compilation.compiled(of_part))
    said = r"numba \S+ has no numba.core.types.unliteral_of_another_version: functions are"
    with pytest.warns(RockframeWarning, match=said):
        assert made(1.0) == 3.0
    assert made(2.0) == 5.0  # and no second warning
    assert made.cached()
    assert {path.name.split("-")[0] for path in tmp_path.rglob("*.nbi")} == {
        "test_dependencies.of_part"
    }


_RESPONDS = """
import sys, warnings
import rockframe.compiled as compilation
if sys.argv[1] == "another":
    compilation.INTERNALS += (("numba.core.types", "no_such_name"),)
    warnings.simplefilter("ignore")
from rockframe import Pulse, RockingFrame, respond
bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
pulse = Pulse(wavelet="symmetric_ricker", a_p=4.0, T_p=1.0)
found = respond(bent, pulse)
print(repr(found.peak_rotation), repr(found.peak_u))
"""


@pytest.mark.faults  # compiles everything again
def test_responses_of_another_numba_are_the_same(tmp_path: Path) -> None:
    said = [
        subprocess.run(
            [sys.executable, "-c", _RESPONDS, version],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / version)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for version in ("this", "another")
    ]
    assert said[0] == said[1]


def test_options_are_found_without_the_internals_of_argparse() -> None:
    parser: Any = SimpleNamespace(format_help=lambda: "  --time-step-s S  in s\n  --json  print")
    assert _options_of(parser) == ["--time-step-s", "--json"]


def test_a_client_that_hides_its_replies_is_used_with_a_warning(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    client = SimpleNamespace(base_url="https://data.example")
    monkeypatch.setattr(service, "Client", lambda *_, **__: client)
    with pytest.warns(RockframeWarning, match="this version of obspy hides the replies"):
        assert service.open_service("event", "https://data.example").client is client
