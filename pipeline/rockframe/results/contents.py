"""Content of files of stages: read every value of one, and compare two."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.record import Orientation
from rockframe.results.shards import OpenShards
from rockframe.results.stored import SHARDS, Stored, alone, opened_one, sizes_of

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Described:
    """The records, inputs and structures of a file of a stage.

    Parameters
    ----------
    records : tuple of str
        Identifiers of the records.
    inputs : mapping of str to str
        Name and SHA-256 of each input of the file.
    structures : int
        Number of structures.
    left_out : tuple of str
        Identifiers of the records that the stage rejected.
    only : str
        The one record that the options ask for; empty if they ask for all.
    horizontal : tuple of str
        Identifiers of the records that are not vertical, if the file states orientations.
    pairs : mapping of str to tuple of str
        Records of both components of motions in both directions, by the name of the motion.
    shards : mapping of str to str
        Name and SHA-256 of each file that the index joins; empty if the file is no index.
    """

    records: tuple[str, ...]
    inputs: Mapping[str, str]
    structures: int = 0
    left_out: tuple[str, ...] = ()
    only: str = ""
    horizontal: tuple[str, ...] = ()
    pairs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shards: Mapping[str, str] = field(default_factory=dict)


def describe(path: Path, kind: str, workers: int | None = 1) -> Described:
    """Read every value of a file, or of an index and its shards; return its records, inputs and
    structures.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        One of `KINDS`.
    workers : int, optional
        Largest number of processes that read shards; None for one for each core.

    Raises
    ------
    InputError
        If a file is missing, of another kind or run, or corrupted: each block has a checksum.
    """
    with opened_one(path, kind, empty=True) as (attrs, stored):
        structures, own = sizes_of(stored).get("structure", 0), _read_all(stored)
        if SHARDS not in attrs:
            return _described([own], attrs, structures)
    from rockframe.engines.choice import choose_engine  # a single file is read here
    from rockframe.engines.engine import map_tasks

    shards = OpenShards(path, kind, attrs, alone).all
    tasks = [(path, kind, dict(attrs), number) for number in range(len(shards))]
    read = map_tasks(_read_shard, tasks, engine=choose_engine(workers))
    hashes = {shard.name: shard.sha256 for shard in shards}
    return replace(_described([*read], attrs, structures), shards=hashes)


def _read_shard(task: tuple[Path, str, Mapping[str, Any], int]) -> dict[str, list[Any]]:
    """Read every value of a shard of an index, and return those that tell the motions apart."""
    path, kind, attrs, number = task
    shards = OpenShards(path, kind, attrs, alone)
    try:
        return _read_all(shards.variables(number).values())
    finally:
        shards.close()


#: Variables of a file that tell its motions apart.
_TELLING: Final = ("record_id", "orientation", "components")


def _read_all(stored: Iterable[Stored]) -> dict[str, list[Any]]:
    """Read every value, and return those that tell the motions apart."""
    telling = {}
    for variable in stored:  # all samples together may not fit in memory
        for _ in variable.blocks():
            pass
        if variable.declared.name in _TELLING:
            telling[variable.declared.name] = variable.values.tolist()
    return telling


def _described(
    read: Iterable[Mapping[str, list[Any]]], attrs: Mapping[str, Any], structures: int
) -> Described:
    """Return the description of a file from what `_read_all` returned of it, or of its shards."""
    names, directions, both = (
        [*chain.from_iterable(part.get(n, ()) for part in read)] for n in _TELLING
    )
    pairs = {
        n: tuple(of.split()) for n, of in zip(names, both or [""] * len(names), strict=True) if of
    }
    horizontal = (
        n for n, to in zip(names, directions, strict=False) if not Orientation(to).upright
    )
    return Described(
        tuple(name for name in names if name not in pairs),
        json.loads(attrs["input_sha256"]),
        structures,
        tuple(json.loads(attrs["left_out"])),
        str(json.loads(attrs["parameters"]).get("record") or ""),
        tuple(horizontal),
        pairs,
    )


#: Numbers agree if they differ by at most this share of the largest value of their variable in the
#: file. Another kind of processor changes pulses by up to 4e-10 of that value, and other results in
#: the last bits.
TOLERANCE: Final = 1e-6


def differences(part: Path, whole: Path, kind: str) -> tuple[int, float, list[str]]:
    """Compare a file with another file of the same records, or of more records.

    Numbers must agree within `TOLERANCE`; verdicts, counts, names and missing values must be equal.

    Parameters
    ----------
    part, whole : Path
        Outputs of the same stage; the second contains all records of the first.
    kind : str
        Kind of both files.

    Returns
    -------
    int, float, list of str
        Number of records that were compared; largest difference between numbers that agree,
        relative to the largest value of their variable; and the differences: each a variable, with
        its record if it belongs to one.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    from rockframe.results.reading import (
        opened,
    )  # it imports xarray, which `describe` does not need

    with opened(part, kind, empty=True) as some, opened(whole, kind, empty=True) as full:
        names = [str(name) for name in some["record_id"].values] if "record_id" in some else []
        rows = {str(name): k for k, name in enumerate(full["record_id"].values)} if names else {}
        largest = {str(name): _largest(full[name]) for name in some.variables if name in full}
        pairs = {"": (_common_variables(some), _common_variables(full))}
        missing = [f"{name!r} is missing" for name in names if name not in rows]
        for k, name in enumerate(names):
            if name in rows:
                pairs[f" of {name!r}"] = _of_record(some, k), _of_record(full, rows[name])
        shares = {
            f"{v}{of}": _relative_difference(one[v], other.get(v), largest.get(v, math.nan))
            for of, (one, other) in pairs.items()
            for v in one
        }
    apart = [name for name, share in shares.items() if share > TOLERANCE]
    within = max((share for share in shares.values() if share <= TOLERANCE), default=0.0)
    return len(names), within, missing + apart


def _common_variables(dataset: xr.Dataset) -> dict[str, NDArray[Any]]:
    """Return the variables that do not belong to single records."""
    names = (n for n, v in dataset.variables.items() if not {"record", "obs"} & set(v.dims))
    return {str(name): dataset[name].values for name in names}


def _of_record(dataset: xr.Dataset, row: int) -> dict[str, NDArray[Any]]:
    """Return the values of one record, including its samples."""
    from rockframe.results.writing import slices

    record = dataset.isel(record=row)
    if "obs" in dataset.sizes and "row_size" in dataset:
        record = record.isel(obs=slices(dataset["row_size"].values)[row])
    of_records = (n for n, v in dataset.variables.items() if {"record", "obs"} & set(v.dims))
    return {str(name): record[name].values for name in of_records}


def _largest(variable: xr.DataArray) -> float:
    """Return the largest absolute value of the finite numbers."""
    values = variable.copy(deep=False).to_numpy()  # a dataset caches values that were read
    if values.dtype.kind != "f":
        return math.nan
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _relative_difference(first: NDArray[Any], other: NDArray[Any] | None, largest: float) -> float:
    """Return the largest difference over the largest value; infinite if values that must be equal
    differ.
    """
    if other is None or first.shape != other.shape or first.dtype.kind != other.dtype.kind:
        return math.inf
    if first.dtype.kind != "f":
        return 0.0 if np.array_equal(first, other) else math.inf
    unequal = ~((first == other) | (np.isnan(first) & np.isnan(other)))
    if not unequal.any():
        return 0.0
    gap = float(np.abs(first[unequal] - other[unequal]).max())
    return gap / largest if math.isfinite(gap) and largest > 0.0 else math.inf
