"""Rows of tables and labelled values, made from datasets."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product, repeat
from typing import Any, TypeVar

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


Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True)
class LabelledValue:
    """A number or text of a dataset, with its description.

    Parameters
    ----------
    name : str
        Name of the variable.
    label : str
        Long name of the variable.
    value : float or str
        Value; a flag is given by its meaning, an unknown value as NaN or an empty text.
    units : str
        Unit as CF writes it; ``1`` for a ratio, a count or a text.
    """

    name: str
    label: str
    value: float | str
    units: str


LabelledValues = tuple[LabelledValue, ...]


class LabelledValuesOf(Mapping[Key, LabelledValues]):
    """Labelled values of each record, structure or pair of them, from one or several datasets.

    Parameters
    ----------
    *parts : xarray.Dataset
        The first dataset defines the keys; the others add values for keys that they also have.
    keys : sequence of str
        Variables that contain the names: one variable, or one for each part of a pair.

    Examples
    --------
    >>> words = {"long_name": "peak ground acceleration", "units": "m s-2"}
    >>> dataset = xr.Dataset({"name": ("record", ["a", "b"]), "pga": ("record", [1.5, 2.5], words)})
    >>> LabelledValuesOf(dataset, keys=["name"])["b"][0].value
    2.5
    """

    def __init__(self, *parts: xr.Dataset, keys: Sequence[str]) -> None:
        self._parts = [
            (
                [{str(name): i for i, name in enumerate(part[key].values)} for key in keys],
                _columns_along(part, keys),
            )
            for part in parts
        ]

    def __getitem__(self, key: Key) -> LabelledValues:
        """Return the values for a name, or for a pair of names."""
        names: Any = (key,) if isinstance(key, str) else key
        values: list[LabelledValue] = []
        for number, (positions, columns) in enumerate(self._parts):
            found = [of.get(name) for of, name in zip(positions, names, strict=True)]
            if None not in found:
                values += [column(found) for column in columns]
            elif number == 0:
                raise KeyError(key)
        return tuple(values)

    def __iter__(self) -> Iterator[Any]:
        """Yield the names, or the pairs of names."""
        positions, _ = self._parts[0]
        return iter(positions[0]) if len(positions) == 1 else product(*positions)

    def __len__(self) -> int:
        """Return the number of names or pairs."""
        return sum(1 for _ in self)


def _columns_along(dataset: xr.Dataset, keys: Sequence[str]) -> list[Callable[..., LabelledValue]]:
    """Return a function from a position to the value, for each variable on the keys' dimensions."""
    dims = tuple(dim for key in keys for dim in dataset[key].dims)
    return [
        partial(
            _labelled, str(name), dataset[name], dataset[name].values, flag_words(variable.attrs)
        )
        for name, variable in dataset.variables.items()
        if variable.dims == dims and name not in keys
    ]


def _labelled(
    name: str,
    array: xr.DataArray,
    values: NDArray[Any],
    words: Callable[[int], str] | None,
    at: Sequence[int],
) -> LabelledValue:
    value = values.item(*at)
    if words is not None:
        value = words(value).replace("_", " ")
    value = float(value) if isinstance(value, int | float) else str(value)
    return LabelledValue(name, array.attrs["long_name"], value, array.attrs["units"])
