"""Whole files of stages: merge the files of all batches, compare files, and describe one."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.interruption import raise_if_interrupted
from rockframe.results.reading import opened
from rockframe.results.writing import growing, named, put, slices

#: Size of the matrices that are in memory together [bytes].
_GROUP: Final = 2**27
#: Attributes that the files of all batches of a stage have in common.
_COMMON: Final = ("rockframe_kind", "source_code_hash", "input_sha256", "parameters")


def merge(parts: Sequence[Path], output: Path, kind: str) -> dict[str, str]:
    """Merge the files of all batches of a stage into one file; one batch is in memory at a time.

    Parameters
    ----------
    parts : sequence of Path
        Files of the batches, in order; at least one.
    output : Path
        The file to write, with the values that the stage writes for all records at once.
    kind : str
        Kind of the files.

    Returns
    -------
    dict of str to str
        Reasons why records were rejected, by identifier.

    Raises
    ------
    InputError
        If a file cannot be read, or was made from other inputs or with other options than the
        first; if a file is missing or out of order; or if no file contains a record.
    """
    small_variables, left_out = _small_variables(parts, kind)
    if not small_variables:
        reason = next(iter(left_out.values()), "no record")
        raise InputError(parts[0], f"no batch contains a record: {reason}")
    attrs = small_variables[0].attrs
    series = _series(parts, kind)
    small = xr.concat(
        small_variables,
        dim="record",
        data_vars="minimal",
        coords="minimal",
        compat="identical",
        join="exact",
        combine_attrs="override",
    )
    count = small.sizes["record"]
    first, *others = _groups(parts, kind, count)
    with named(output) as partial:
        if series:
            with growing(partial, series) as written:
                for samples in _samples(parts, kind, series):
                    written.append(samples)
        for group in (first, *others):
            put(
                _with_matrices(
                    small if group is first else xr.Dataset(), group, count, parts, kind
                ),
                partial,
                kind,
                input_sha256=json.loads(attrs["input_sha256"]),
                parameters=json.loads(attrs["parameters"]),
                left_out=left_out,
                mode="a" if series or group is not first else "w",
            )
    return left_out


def _is_matrix(variable: xr.Variable | xr.DataArray) -> bool:
    """Return True for numbers of records along further dimensions, such as structures."""
    numbers = variable.dtype.kind in "biuf" and variable.ndim > 1
    return numbers and variable.dims[0] == "record"


def _small_variables(parts: Sequence[Path], kind: str) -> tuple[list[xr.Dataset], dict[str, str]]:
    """Return the batches that have records, without series and matrices, and the rejected
    records.
    """
    datasets: list[xr.Dataset] = []
    left_out: dict[str, str] = {}
    first: Mapping[str, Any] = {}
    for number, path in enumerate(parts, 1):
        raise_if_interrupted()
        with opened(path, kind, empty=True) as part:
            batch, wanted = part.attrs.pop("batch", "1/1"), f"{number}/{len(parts)}"
            if batch != wanted:
                raise InputError(
                    path,
                    f"is batch {batch}. Must be batch {wanted} here: state the batches in order.",
                )
            first = first or part.attrs
            for name in _COMMON:
                if part.attrs[name] != first[name]:
                    raise InputError(
                        path,
                        f"not the {name} of {parts[0]}. Merge only batches of one run.",
                    )
            left_out |= json.loads(part.attrs["left_out"])
            if "record_id" in part:
                whole = part.drop_dims("obs", errors="ignore")
                matrices = [
                    name for name, variable in whole.variables.items() if _is_matrix(variable)
                ]
                datasets.append(whole.drop_vars(matrices).load().drop_encoding())
    return datasets, left_out


def _groups(parts: Sequence[Path], kind: str, records: int) -> list[list[str]]:
    """Return the names of the matrices, in groups that fit into `_GROUP`; at least one group."""
    groups: list[list[str]] = [[]]
    size = 0
    for name, variable in _variables(parts, kind).items():
        if _is_matrix(variable):
            own = records * math.prod(variable.shape[1:]) * variable.dtype.itemsize
            if groups[-1] and size + own > _GROUP:
                groups.append([])
                size = 0
            groups[-1].append(name)
            size += own
    return groups


def _variables(parts: Sequence[Path], kind: str) -> dict[str, xr.Variable]:
    """Return the variables of the first batch with records, except its series."""
    for path in parts:
        with opened(path, kind, empty=True) as part:
            if "record_id" in part:
                without = part.drop_dims("obs", errors="ignore")
                return {str(name): variable for name, variable in without.variables.items()}
    return {}


def _with_matrices(
    beside: xr.Dataset, names: Sequence[str], records: int, parts: Sequence[Path], kind: str
) -> xr.Dataset:
    """Return a dataset with the matrices of all batches, in the order of the variables."""
    like = _variables(parts, kind)
    values = {name: np.empty((records, *like[name].shape[1:]), like[name].dtype) for name in names}
    start = 0
    for path in parts:
        raise_if_interrupted()
        with opened(path, kind, empty=True) as part:
            end = start + part.sizes.get("record", 0)
            for name, whole in values.items() if end > start else ():
                whole[start:end] = part[name].to_numpy()
            start = end
    merged = beside.assign(
        {name: (like[name].dims, whole, like[name].attrs) for name, whole in values.items()}
    )
    return merged[[name for name in like if name in merged]]


def _series(parts: Sequence[Path], kind: str) -> dict[str, xr.Variable]:
    """Return the variables on ``obs``, without samples."""
    for path in parts:
        with opened(path, kind, empty=True) as part:
            if "record_id" in part:
                empty = part.isel(obs=slice(0, 0), missing_dims="ignore").load()
                series = {str(n): v for n, v in empty.variables.items() if "obs" in v.dims}
                beside = " ".join(sorted(name for name in series if name in empty.coords))
                for name in series:
                    if beside and name not in empty.coords:  # as xarray writes it
                        series[name] = series[name].copy()
                        series[name].attrs["coordinates"] = beside
                return series
    return {}


def _samples(
    parts: Sequence[Path], kind: str, series: Mapping[str, xr.Variable]
) -> Iterator[dict[str, Any]]:
    for path in parts:
        raise_if_interrupted()
        with opened(path, kind, empty=True) as part:
            if "record_id" in part:
                yield {name: part[name].to_numpy() for name in series}


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
