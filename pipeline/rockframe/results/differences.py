"""Whether some records that were computed again are as a file has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from rockframe.results.files import opened


def differences(part: Path, whole: Path, kind: str) -> tuple[int, list[str]]:
    """Compare the records of one file with the same records in another, to the last bit.

    Parameters
    ----------
    part, whole : Path
        Outputs of the same stage; the records of the first are among those of the second.
    kind : str
        Of both.

    Returns
    -------
    int, list of str
        Number of records that were compared, and what differs: a variable and a record each.

    Raises
    ------
    InputError
        If a file cannot be read.
    """
    with opened(part, kind) as some, opened(whole, kind) as full:
        if "record_id" not in some:
            return 0, []
        rows = {str(name): k for k, name in enumerate(full["record_id"].values)}
        found = []
        names = [str(name) for name in some["record_id"].values]
        for k, name in enumerate(names):
            if name not in rows:
                found.append(f"{name!r} is not in it")
                continue
            one, other = _of_record(some, k), _of_record(full, rows[name])
            found += [f"{v} of {name!r}" for v in one if not _equal(one[v], other.get(v))]
        return len(names), found


def _of_record(dataset: xr.Dataset, row: int) -> dict[str, object]:
    """What a file says of one record, its samples included."""
    one = dataset.isel(record=row)
    if "obs" in dataset.sizes and "row_size" in dataset:
        sizes = dataset["row_size"].values
        end = int(sizes[: row + 1].sum())
        one = one.isel(obs=slice(end - int(sizes[row]), end))
    of_records = (n for n, v in dataset.variables.items() if {"record", "obs"} & set(v.dims))
    return {str(name): one[name].values for name in of_records}


def _equal(one: object, other: object) -> bool:
    a, b = np.asarray(one), np.asarray(other)
    numbers = a.dtype.kind == "f"
    return a.dtype.kind == b.dtype.kind and np.array_equal(a, b, equal_nan=numbers)
