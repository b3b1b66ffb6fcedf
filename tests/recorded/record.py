"""Record what users rely on: names, and the numbers of the bundled run.

``python -m tests.recorded.record`` writes ``names.json`` and ``numbers.json`` beside this file.
Record again only for an intended change, and list the change in CHANGELOG.md.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import math
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import rockframe
from rockframe.cli.main import main, parser
from rockframe.study.study import schema

HERE = Path(__file__).parent


def keys(of: Any, whole: dict[str, Any], at: str = "") -> Iterator[str]:
    """Yield the keys of a study, each with the tables that contain it."""
    if isinstance(of, list):
        for inner in of:
            yield from keys(inner, whole, at)
    elif isinstance(of, dict):
        if "$ref" in of:
            yield from keys(whole["$defs"][of["$ref"].rpartition("/")[2]], whole, at)
        for name, inner in of.get("properties", {}).items():
            yield f"{at}{name}"
            yield from keys(inner, whole, f"{at}{name}.")
        for way in ("items", "anyOf", "oneOf", "allOf"):
            yield from keys(of.get(way), whole, at)


def names() -> dict[str, Any]:
    """Return the names of commands, options, keys of studies, and public Python names."""
    (verbs,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))  # noqa: SLF001
    commands = {
        verb: sorted(word for a in one._actions for word in (a.option_strings or [a.dest]))  # noqa: SLF001
        for verb, one in verbs.choices.items()
    }
    study = json.loads(schema())
    return {
        "commands": commands,
        "study": sorted(set(keys(study, study))),
        "python": sorted(dir(rockframe)),
    }


def summary(values: Any) -> list[Any]:
    """Return the size, the number of finite values and two sums; for text, the size and a hash."""
    array = np.asarray(values)
    if array.dtype.kind in "OUSMm":
        return [array.size, hashlib.sha256("\n".join(map(str, array.ravel())).encode()).hexdigest()]
    array = array.astype(float)
    known = array[np.isfinite(array)]
    weights = np.cos(np.arange(known.size))
    sums = (abs(known).sum(), weights @ known)
    return [array.size, known.size, *(float(f"{value:.10g}") for value in sums)]


def numbers(folder: Path) -> dict[str, Any]:
    """Return the summary of each variable and column of a run of the bundled records."""
    found: dict[str, Any] = {}
    for path in sorted(folder.glob("*.nc")):
        with xr.open_dataset(path, decode_times=False) as dataset:
            for name in sorted(map(str, dataset.variables)):
                found[f"{path.name}:{name}"] = summary(dataset[name].values)
    with (folder / "table.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    for name in rows[0]:
        cells = [row[name] for row in rows]
        try:
            found[f"table.csv:{name}"] = summary([float(cell or math.nan) for cell in cells])
        except ValueError:
            found[f"table.csv:{name}"] = summary(cells)
    files = (path for path in folder.rglob("*") if path.is_file())
    found["files"] = sorted(path.relative_to(folder).as_posix() for path in files)
    return found


def write(name: str, recorded: dict[str, Any]) -> None:
    """Write one line for each entry, so that a diff shows its name."""
    lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in recorded.items())
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    (HERE / f"{name}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write("names", names())
    with tempfile.TemporaryDirectory() as home:
        run = Path(home, "table1")
        assert main(["table1", "--output", str(run)]) == 0
        write("numbers", numbers(run))
