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
from typing import Any, Final

import numpy as np
import pytest
import xarray as xr

import rockframe
from rockframe.cli.main import main, parser
from rockframe.results.schema import KINDS
from rockframe.study.study import schema

HERE = Path(__file__).parent

#: Relative tolerance of recorded sums, by the end of the name of a variable or column. The last
#: bits of sums, pulses and trigonometric functions differ between processors and libraries. A
#: rocking response amplifies them: a relative change of samples by 2e-13 changed peaks by 1e-6,
#: histories by 2e-5 of their largest value, and moved single impacts, islands of safety and members
#: of an ensemble.
TOLERANCES: Final = {
    **dict.fromkeys(("theta", "theta_low", "theta_high", ":u", ":v"), 1e-3),
    **dict.fromkeys(("peak_rotation_ratio", "peak_u", "peak_v", "peak_u_m", "peak_v_m"), 1e-4),
    **dict.fromkeys(("surrogate_error", "overturning_time", "overturning_time_s"), 1e-4),
    # noise is drawn and searched in single precision
    **dict.fromkeys(("surrogate_median", "surrogate_high"), 1e-6),
    "impacts": 1e-2,
    **dict.fromkeys((f"robust_scale_{share}" for share in (10, 25, 50)), 5e-3),
    **dict.fromkeys((f"robust_error_{share}" for share in (10, 25, 50)), 0.1),
    **dict.fromkeys(("safe_islands", "safe_island_start", "safe_island_width"), 0.2),
}
#: Relative tolerance of all other sums.
REGULAR: Final = 1e-7
#: Hashes of samples, which change with the last bit of a sample; only their number is compared.
HASHES: Final = ("samples_sha256",)


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
    """Return the names of commands, options, keys of studies, Python, and the values of flags."""
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
        "flags": sorted(
            f"{kind}.nc {variable.name}: {member.value} {member.name}"
            for kind in KINDS
            for variable in KINDS[kind].variables
            if variable.holds == "flags"
            for member in variable.dtype
        ),
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


def in_one_plane(dataset: xr.Dataset) -> xr.Dataset:
    """Return the responses without those in both directions, which are too chaotic to record: the
    last bit of a sample changes them.
    """
    if "components" not in dataset:
        return dataset
    ends = np.cumsum(dataset["row_size"].values)
    plane = dataset["components"].values == ""
    spans = zip(ends - dataset["row_size"].values, ends, plane, strict=True)
    kept = np.concatenate([np.arange(start, end) for start, end, own in spans if own])
    spreads = dataset["spread"].values != "contact_shortening"
    return dataset.isel(record=plane, obs=kept, spread=spreads)


def numbers(folder: Path) -> dict[str, Any]:
    """Return the summary of each variable and column of a run of the bundled records."""
    found: dict[str, Any] = {}
    for path in sorted(folder.glob("*.nc")):
        with xr.open_dataset(path, decode_times=False) as whole:
            dataset = in_one_plane(whole.load())  # netCDF reads scattered values slowly
            for name in sorted(map(str, dataset.variables)):
                found[f"{path.name}:{name}"] = summary(dataset[name].values)
    with (folder / "table.csv").open(newline="", encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if not row["components"]]
    for name in rows[0]:
        cells = [row[name] for row in rows]
        try:
            found[f"table.csv:{name}"] = summary([float(cell or math.nan) for cell in cells])
        except ValueError:
            found[f"table.csv:{name}"] = summary(cells)
    files = (path for path in folder.rglob("*") if path.is_file())
    found["files"] = sorted(path.relative_to(folder).as_posix() for path in files)
    return found


def differences(found: dict[str, Any], recorded: dict[str, Any]) -> list[str]:
    """Return a line for each number that differs from the recorded one by more than is allowed."""
    lines = []
    for name, before in recorded.items():
        now = found.get(name)
        if now is None:
            lines.append(f"{name} is missing")
        elif isinstance(before[1], str):
            same = now == before or (name.endswith(HASHES) and now[0] == before[0])
            lines += [] if same else [f"{name}: other text, or {now[0]} values for {before[0]}"]
        else:
            lines += _apart(name, now, before)
    return lines


def _apart(name: str, now: list[Any], before: list[Any]) -> Iterator[str]:
    allowed = next((t for end, t in TOLERANCES.items() if name.endswith(end)), REGULAR)
    if now[0] != before[0] or abs(now[1] - before[1]) > (allowed >= 0.1) * allowed * before[1]:
        yield f"{name}: {now[1]} of {now[0]} values are finite, recorded {before[1]} of {before[0]}"
    for kind, one, other in zip(("sum", "weighted sum"), now[2:], before[2:], strict=True):
        if one != pytest.approx(other, rel=allowed, abs=allowed * before[2]):
            share = abs(one - other) / max(before[2], math.ulp(0.0))
            yield (
                f"{name}: {kind} {one:.10g}, recorded {other:.10g} "
                f"({share:.1e} of the sum; allowed {allowed:g})"
            )


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
