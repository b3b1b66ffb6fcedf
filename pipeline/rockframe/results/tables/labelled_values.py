"""Labelled values of datasets, computed on demand: a run may have a million of them."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeVar

import xarray as xr

from rockframe.results.tables.rows import flag_words

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
        self._parts = [_Part(dataset, keys) for dataset in parts]

    def __getitem__(self, key: Key) -> LabelledValues:
        """Return the values for a name, or for a pair of names."""
        first, *others = self._parts
        return sum((p.values(key) for p in others if p.has(key)), start=first.values(key))

    def __iter__(self) -> Iterator[Any]:
        """Yield the names, or the pairs of names."""
        return self._parts[0].names()

    def __len__(self) -> int:
        """Return the number of names or pairs."""
        return sum(1 for _ in self)


class _Part:
    """The columns of one dataset."""

    def __init__(self, dataset: xr.Dataset, keys: Sequence[str]) -> None:
        self._places = [
            {str(name): i for i, name in enumerate(dataset[key].values)} for key in keys
        ]
        dims = tuple(dim for key in keys for dim in dataset[key].dims)
        self._columns = [
            _Column(str(name), dataset[name])
            for name, variable in dataset.variables.items()
            if variable.dims == dims and name not in keys
        ]

    def names(self) -> Iterator[Any]:
        return iter(self._places[0]) if len(self._places) == 1 else product(*self._places)

    def has(self, key: Any) -> bool:
        parts = (key,) if len(self._places) == 1 else key
        return all(part in place for part, place in zip(parts, self._places, strict=True))

    def values(self, key: Any) -> LabelledValues:
        parts = (key,) if len(self._places) == 1 else key
        at = tuple(place[part] for part, place in zip(parts, self._places, strict=True))
        return tuple(column.value(at) for column in self._columns)


class _Column:
    """A variable, with the meanings of its flags."""

    def __init__(self, name: str, array: xr.DataArray) -> None:
        self._name, self._values = name, array.values
        self._label, self._units = str(array.attrs["long_name"]), str(array.attrs["units"])
        self._words = flag_words(array.attrs)

    def value(self, at: tuple[int, ...]) -> LabelledValue:
        value = self._values.item(*at)
        if self._words is not None:
            value = self._words(value).replace("_", " ")
        value = float(value) if isinstance(value, int | float) else str(value)
        return LabelledValue(self._name, self._label, value, self._units)
