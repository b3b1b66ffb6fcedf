"""Rooms of modules lie on floors: a module imports from its own room and from lower floors."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest
from tests.benchmarks.house import WIDEST, imports, in_circles

PACKAGE = Path(__file__).resolve().parents[1] / "pipeline" / "rockframe"
FLOORS = (
    {"errors", "interruption", "watch"},
    {
        "cells",
        "notebook",
        "units",
        "provenance",
        "parts",
        "compiled",
    },
    {"frame", "quantities", "rivals", "wavelets", "engines", "rocking.kernels"},
    {"options"},
    {"record", "study"},
    {"signals"},
    {"outcome"},
    {"ingest", "fetch", "components", "matching", "rocking", "risk"},
    {"oscillators", "selection", "unequal", "web", "wobbling"},
    {"structures"},
    {"results"},
    {"figures", "report", "paper"},
    {"stages"},
    {"assessment", "explorer", "runs"},
    {"cli"},
    {"__main__"},
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def room_of(name: str) -> str:
    """Return the room of a dotted module name below the package, or an empty text."""
    return max(
        (room for room in FLOOR_OF if f"{name}.".startswith(f"{room}.")), key=len, default=""
    )


def imports_of(path: Path) -> set[str]:
    """Return the dotted names below the package that a module imports anywhere in its file."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            base = node.module or ""
            names = [f"{base}.{alias.name}" for alias in node.names] + [base]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        found |= {
            name.removeprefix("rockframe.") for name in names if name.startswith("rockframe.")
        }
    return {name for name in found if room_of(name) in FLOOR_OF}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_imports_point_downwards(path: Path) -> None:
    name = ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__")
    room = room_of(name)
    assert room in FLOOR_OF, f"{name} has no floor: give it one in this test"
    for imported in imports_of(path):
        other = room_of(imported)
        same_room = imported.split(".")[0] == name.split(".")[0]
        assert same_room or FLOOR_OF[other] < FLOOR_OF[room], f"{name} imports {imported}"


def test_no_module_imports_itself_by_another() -> None:
    modules = {
        ".".join(("rockframe", *path.relative_to(PACKAGE).with_suffix("").parts)): path
        for path in MODULES
        if path.name != "__init__.py"
    }
    assert in_circles(imports(modules)) == []


def test_kernels_know_no_datasets() -> None:
    for path in (PACKAGE / "rocking" / "kernels").glob("*.py"):
        assert "xarray" not in path.read_text(encoding="utf-8")
        assert all(
            name.startswith(("compiled", "errors", "rocking.kernels")) for name in imports_of(path)
        )


def test_no_folder_is_wide() -> None:
    """Each format has a file of its own, so the folder of formats is as wide as their list."""
    folders = Counter(path.parent for path in MODULES if path.name != "__init__.py")
    wide = {folder.name for folder, count in folders.items() if count > WIDEST}
    assert wide <= {"formats"}


def test_only_results_knows_netcdf() -> None:
    """No other room imports netCDF4 or calls a function that opens or writes netCDF files.

    One module reads the HDF5 of other programs (ASDF) with netCDF's library.
    """

    def knows(node: ast.AST) -> bool:
        if isinstance(node, ast.Attribute):
            return node.attr in ("to_netcdf", "open_dataset", "open_mfdataset", "load_dataset")
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        return "netCDF4" in (*names, getattr(node, "module", ""))

    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in MODULES}
    knowing = {path for path, tree in trees.items() if any(map(knows, ast.walk(tree)))}
    knowing.remove(PACKAGE / "ingest" / "formats" / "asdf" / "workspace.py")
    assert {path.relative_to(PACKAGE).parts[0] for path in knowing} == {"results"}
