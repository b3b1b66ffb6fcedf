"""Whether what was computed again is as a file has it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.reading import opened

#: Numbers agree if they differ by at most this share of the largest of their variable in the file.
#: Another kind of processor changes pulses by up to 4e-10 of it, the rest in the last bits.
TOLERANCE: Final = 1e-6


def differences(part: Path, whole: Path, kind: str) -> tuple[int, float, list[str]]:
    """Compare one file with another of the same records or more.

    Numbers must agree within `TOLERANCE`; verdicts, counts, names and missing values must be equal.

    Parameters
    ----------
    part, whole : Path
        Outputs of the same stage; the records of the first are among those of the second.
    kind : str
        Of both.

    Returns
    -------
    int, float, list of str
        Number of records that were compared; the largest difference of numbers that agree, over
        the largest of their variable; and what differs: a variable, and a record if it is of one.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    with opened(part, kind, empty=True) as some, opened(whole, kind, empty=True) as full:
        names = [str(name) for name in some["record_id"].values] if "record_id" in some else []
        rows = {str(name): k for k, name in enumerate(full["record_id"].values)} if names else {}
        largest = {str(name): _largest(full[name]) for name in some.variables if name in full}
        pairs = {"": (_shared(some), _shared(full))}
        missing = [f"{name!r} is not in it" for name in names if name not in rows]
        for k, name in enumerate(names):
            if name in rows:
                pairs[f" of {name!r}"] = _of_record(some, k), _of_record(full, rows[name])
        shares = {
            f"{v}{of}": _apart(one[v], other.get(v), largest.get(v, math.nan))
            for of, (one, other) in pairs.items()
            for v in one
        }
    apart = [what for what, share in shares.items() if share > TOLERANCE]
    within = max((share for share in shares.values() if share <= TOLERANCE), default=0.0)
    return len(names), within, missing + apart


def _shared(dataset: xr.Dataset) -> dict[str, NDArray[Any]]:
    """What a file says of all its records together."""
    names = (n for n, v in dataset.variables.items() if not {"record", "obs"} & set(v.dims))
    return {str(name): dataset[name].values for name in names}


def _of_record(dataset: xr.Dataset, row: int) -> dict[str, NDArray[Any]]:
    """What a file says of one record, its samples included."""
    one = dataset.isel(record=row)
    if "obs" in dataset.sizes and "row_size" in dataset:
        sizes = dataset["row_size"].values
        end = int(sizes[: row + 1].sum())
        one = one.isel(obs=slice(end - int(sizes[row]), end))
    of_records = (n for n, v in dataset.variables.items() if {"record", "obs"} & set(v.dims))
    return {str(name): one[name].values for name in of_records}


def _largest(variable: xr.DataArray) -> float:
    """The largest absolute value among numbers that are finite."""
    values = variable.copy(deep=False).to_numpy()  # a dataset keeps what was read of it
    if values.dtype.kind != "f":
        return math.nan
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _apart(one: NDArray[Any], other: NDArray[Any] | None, largest: float) -> float:
    """How far two arrays are apart, over the largest value; infinite if they had to be equal."""
    if other is None or one.shape != other.shape or one.dtype.kind != other.dtype.kind:
        return math.inf
    if one.dtype.kind != "f":
        return 0.0 if np.array_equal(one, other) else math.inf
    unequal = ~((one == other) | (np.isnan(one) & np.isnan(other)))
    if not unequal.any():
        return 0.0
    gap = float(np.abs(one[unequal] - other[unequal]).max())
    return gap / largest if math.isfinite(gap) and largest > 0.0 else math.inf
