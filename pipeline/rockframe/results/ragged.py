"""Write and slice series of several records, one after the other along ``obs``."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import chain, islice
from pathlib import Path
from typing import Any, TypeVar, Unpack

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import require_known
from rockframe.results.schema.declare import FileKind
from rockframe.results.writing import WITHOUT_RECORDS, Origin, growing, named, put

Name = TypeVar("Name", str, float)
#: The series of a record and its other values, both by variable.
Row = tuple[Mapping[str, NDArray[np.float64]], Mapping[str, Any]]


def no_records() -> xr.Dataset:
    """Return the dataset of a batch without accepted records."""
    return xr.Dataset(attrs={"title": WITHOUT_RECORDS})


def write_rows(
    kind: FileKind,
    rows: Iterable[Row],
    path: Path,
    complete: Callable[[dict[str, list[Any]]], Mapping[str, Any]],
    *,
    further: Callable[[Path], xr.Dataset] | None = None,
    batch: str = "",
    **origin: Unpack[Origin],
) -> None:
    """Write a file, complete or not at all; the series of one record are in memory at a time.

    Parameters
    ----------
    kind : FileKind
        Kind of the file.
    rows : iterable of (mapping, mapping)
        The series of each record, and its other values. If the iterable raises an error, no file is
        left.
    path : Path
        The file to write or replace.
    complete : callable
        Called with the values of all records; returns the values of all variables except the
        series.
    further : callable, optional
        Called with the partial file; returns variables to add.
    batch : str
        The batch of the records, ``2/3``; empty for all records.
    **origin
        Keywords of `Origin`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    columns: dict[str, list[Any]] = defaultdict(list)
    source = iter(rows)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    with named(path) as partial:
        for series, _ in first:
            empty = {name: kind[name].holding(s[..., :0]) for name, s in series.items()}
            with growing(partial, empty) as append:
                for samples, values in chain(first, source):
                    append(samples)
                    for name, value in values.items():
                        columns[name].append(value)
        made = kind.dataset(complete(columns)) if columns else no_records()
        made = made.assign_attrs(batch=batch) if batch else made
        put(made, partial, kind.name, mode="a" if columns else "w", **origin)
        if further is not None:
            put(further(partial), partial, kind.name, mode="a", **origin)


def slices(sizes: ArrayLike) -> list[slice]:
    """Return the slices along ``obs`` of series with these sizes.

    Examples
    --------
    >>> slices([2, 3])
    [slice(0, 2, None), slice(2, 5, None)]
    """
    lengths = np.asarray(sizes).tolist()
    ends = np.cumsum(lengths).tolist()
    return [slice(end - size, end) for size, end in zip(lengths, ends, strict=True)]


def position(known: Sequence[Name], asked: Name, what: str) -> int:
    """Return the position of a name or a number in a list from a file.

    Raises
    ------
    ParameterError
        If the list does not contain it.
    """
    require_known(what, asked, known)
    return list(known).index(asked)
