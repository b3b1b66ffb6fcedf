"""Make rows of tables from datasets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import repeat
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.schema import KINDS
from rockframe.units import GRAVITY

Row = dict[str, Any]


def flag_words(attrs: Mapping[str, Any]) -> Callable[[int], str] | None:
    """Return a function from flag values to meanings; None for variables that are not flags."""
    if "flag_meanings" not in attrs:
        return None
    masks = "flag_masks" in attrs
    numbers = np.atleast_1d(attrs["flag_masks" if masks else "flag_values"]).tolist()
    pairs = list(zip(numbers, attrs["flag_meanings"].split(), strict=True))

    def words(number: int) -> str:
        return ", ".join(word for n, word in pairs if (number & n if masks else number == n))

    return words


def columns_of(*texts: str) -> dict[str, str]:
    """Return the variable of each column; ``column=variable`` if the names differ.

    Examples
    --------
    >>> columns_of("record_id pga_g=pga")
    {'record_id': 'record_id', 'pga_g': 'pga'}
    """
    words = (word.partition("=") for text in texts for word in text.split())
    return {key: name or key for key, _, name in words}


def rows_along(dataset: xr.Dataset, along: str, columns: Mapping[str, str]) -> Iterator[Row]:
    """Return an iterator over a row for each position along the dimensions.

    For optional variables that the file does not have, numbers are NaN and texts are empty.

    Parameters
    ----------
    dataset : Dataset
        A variable with fewer dimensions gives the same value in many rows.
    along : str
        The dimensions, separated by spaces; the first varies slowest.
    columns : mapping of str to str
        Variable of each column. Accelerations in columns that end in ``_g`` are in g, angles in
        columns that end in ``_deg`` in degrees. A flag with two values becomes a bool, another flag
        its meaning.
    """
    sizes = {dim: dataset.sizes[dim] for dim in along.split()}
    cells = [_cells(dataset, sizes, key, name) for key, name in columns.items()]
    return (
        dict(zip(columns, row, strict=True))
        for i in range(next(iter(sizes.values())))
        for row in zip(*(column(i) for column in cells), strict=False)
    )


def _cells(
    dataset: xr.Dataset, sizes: Mapping[str, int], key: str, name: str
) -> Callable[[int], Any]:
    """Return a function that gives the cells of a column at a position of the slowest dimension."""
    if name not in dataset.variables:
        declared = KINDS[dataset.attrs["rockframe_kind"]][name]
        unknown = "" if declared.holds in ("text", "flags") else np.nan
        return lambda _: repeat(unknown)
    variable = dataset[name].variable.to_base_variable()
    values = variable.set_dims(sizes).transpose(*sizes).values  # type: ignore[no-untyped-call]
    plain = _plain(key, variable.attrs)
    return lambda i: plain(values[i : i + 1].ravel())


def _plain(key: str, attrs: Mapping[str, Any]) -> Callable[[NDArray[Any]], list[Any]]:
    words = flag_words(attrs)
    if words is not None:
        known = np.size(attrs.get("flag_values", ())) == 2
        return lambda block: [bool(n) if known else words(n) for n in block.tolist()]
    if key.endswith("_g"):
        return lambda block: list((block / GRAVITY).tolist())
    if key.endswith("_deg"):
        return lambda block: list(np.degrees(block).tolist())
    return lambda block: list(block.tolist())
