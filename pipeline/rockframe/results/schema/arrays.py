"""Named variables with dimensions, without xarray, whose import takes longer than many commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import require_known

if TYPE_CHECKING:
    import xarray as xr

    #: What functions take that need only names, values, attributes and parts along a dimension.
    Dataset: TypeAlias = "Arrays | xr.Dataset"

#: An index along a dimension.
Index: TypeAlias = int | slice | Sequence[int]


class Array:
    """Values along named dimensions; those of a file are read when they are first needed.

    Parameters
    ----------
    dims : sequence of str
        The dimensions.
    shape : tuple of int
        Their sizes.
    read : callable
        Returns the values at an index of each dimension.
    attrs : mapping
        Attributes, such as the unit.
    """

    def __init__(
        self,
        dims: Sequence[str],
        shape: tuple[int, ...],
        read: Callable[[tuple[Index, ...]], Any],
        attrs: Mapping[str, Any],
    ) -> None:
        self.dims, self.shape, self.attrs, self._read = tuple(dims), shape, attrs, read

    @classmethod
    def of(cls, dims: Sequence[str], values: NDArray[Any], attrs: Mapping[str, Any]) -> Array:
        """Return the array of values in memory."""
        array = cls(dims, values.shape, values.__getitem__, attrs)
        array.values = values  # reading the text of a scalar would lose its type
        return array

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what a copy in another process is made from: the values."""
        return Array.of, (self.dims, self.values, dict(self.attrs))

    @cached_property
    def values(self) -> NDArray[Any]:
        """All values."""
        return np.asarray(self._read((slice(None),) * len(self.shape)))

    @property
    def sizes(self) -> dict[str, int]:
        """Size of each dimension."""
        return dict(zip(self.dims, self.shape, strict=True))

    def isel(self, **where: Index) -> Array:
        """Return a part, by indexes of some dimensions; a dimension of which one is chosen goes."""
        key = tuple(where.get(dimension, slice(None)) for dimension in self.dims)
        dims = [d for d, k in zip(self.dims, key, strict=True) if not isinstance(k, int)]
        shape = np.broadcast_to(False, self.shape)[key].shape
        return Array(dims, shape, lambda within: np.asarray(self._read(key))[within], self.attrs)

    def variable(self) -> xr.Variable:
        """Return the variable of xarray with these values."""
        import xarray as xr

        # the fast path does not ask if the array is one of Dask, which would import Dask
        return xr.Variable(self.dims, self.values, {**self.attrs}, fastpath=True)


class Arrays:
    """Variables by name, with attributes of all.

    Parameters
    ----------
    variables : mapping of str to Array
        The variables.
    attrs : mapping
        The attributes.

    Examples
    --------
    >>> pga = Array.of(["record"], np.array([1.0, 3.0]), {"units": "m s-2"})
    >>> Arrays({"pga": pga}, {}).isel(record=[1])["pga"].values
    array([3.])
    """

    def __init__(self, variables: Mapping[str, Array], attrs: Mapping[str, Any]) -> None:
        self.variables, self.attrs = variables, attrs

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> Array:
        """Return the variable of this name."""
        return self.variables[name]

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Size of each dimension."""
        return {d: n for variable in self.variables.values() for d, n in variable.sizes.items()}

    def isel(self, **where: Index) -> Arrays:
        """Return parts of the variables, by indexes of some dimensions."""
        return self.with_variables(
            {
                name: variable.isel(**where) if where.keys() & {*variable.dims} else variable
                for name, variable in self.variables.items()
            }
        )

    def without(self, dimension: str) -> Arrays:
        """Return the variables that do not have a dimension."""
        held = {n: v for n, v in self.variables.items() if dimension not in v.dims}
        return self.with_variables(held)

    def loaded(self) -> Arrays:
        """Return the same with all values in memory, so that their file can be closed."""
        return self.with_variables(
            {name: Array.of(v.dims, v.values, v.attrs) for name, v in self.variables.items()}
        )

    def with_variables(self, variables: Mapping[str, Array]) -> Arrays:
        """Return other variables with the same attributes."""
        return Arrays(variables, self.attrs)

    def with_attrs(self, **attrs: Any) -> Arrays:
        """Return the same variables with more attributes."""
        return Arrays(self.variables, {**self.attrs, **attrs})

    def dataset(self) -> xr.Dataset:
        """Return the dataset of xarray."""
        import xarray as xr

        variables = {name: variable.variable() for name, variable in self.variables.items()}
        return xr.Dataset(variables, attrs={**self.attrs})


def arrays_of(dataset: Dataset) -> Arrays:
    """Return the variables of a dataset of xarray, or arrays as they are."""
    if isinstance(dataset, Arrays):
        return dataset
    held = {
        str(name): Array.of([*map(str, variable.dims)], variable.values, variable.attrs)
        for name, variable in dataset.variables.items()
    }
    return Arrays(held, dataset.attrs)


def positions(dataset: Dataset, **wanted: str | float) -> dict[str, int]:
    """Return the position of a name or number along each dimension.

    Raises
    ------
    ParameterError
        If the file does not contain it.
    """
    places = {}
    for dimension, name in wanted.items():
        names = dataset["record_id" if dimension == "record" else dimension].values.tolist()
        require_known(dimension, name, names)
        places[dimension] = names.index(name)
    return places


def only_record(dataset: Dataset, record: str | None) -> Dataset:
    """Return the part of a dataset that belongs to one record; all of it for None.

    Raises
    ------
    ParameterError
        If the file does not contain it.
    """
    if record is None:
        return dataset
    return dataset.isel(record=[positions(dataset, record=record)["record"]])
