"""Open files of stages, and check each against the declaration of its kind."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from enum import IntFlag
from functools import cached_property, reduce
from operator import or_
from pathlib import Path
from typing import Any, Final

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.core import indexing

from rockframe.errors import InputError, require_known
from rockframe.record import is_record_id
from rockframe.results.attributes import (
    UNREADABLE,
    not_of,
    require_attributes,
    require_file,
    require_netcdf,
)
from rockframe.results.schema import KINDS, FileKind, Variable
from rockframe.results.writing import CHUNK, WITHOUT_RECORDS
from rockframe.units import conversion_factor

#: Attributes of packed variables, whose stored numbers differ from their values.
_PACKED: Final = ("scale_factor", "add_offset", "missing_value", "_Unsigned")
#: Kinds of NumPy types that are allowed for each declared type.
_TYPES: Final = {"text": "SO", "flags": "iu", "integers": "iu", "numbers": "fiu"}
#: Largest compression ratio that netCDF can reach.
_MOST_COMPRESSED: Final = 1032
#: Number of values that are checked at once.
_BLOCK: Final = 2**20


@contextmanager
def opened(path: Path, kind: str, *, empty: bool = False) -> Iterator[xr.Dataset]:
    """Open a dataset of one kind, and close it at the end of the block.

    The dataset has exactly the variables that are declared for the kind, with their declared units
    and attributes. Series along ``obs`` are read on demand.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        One of `KINDS`.
    empty : bool
        Accept the file of a batch without accepted records too, which has no variables.

    Raises
    ------
    InputError
        If the file is missing or corrupted, if another stage wrote it, or if its content does not
        match the declaration of the kind.
    """
    require_file(path, f"a {kind} file")
    # By default netCDF would cache 64 MB of samples per variable, although they are read once.
    netCDF4.set_chunk_cache(4 * 8 * CHUNK)
    must_be = f"Must be the output of `rockframe {KINDS[kind].stage}`."
    with ExitStack() as stack:
        try:
            require_netcdf(path, f"Run `rockframe {KINDS[kind].stage}` first and state its output.")
            store = xr.backends.NetCDF4DataStore.open(str(path))  # type: ignore[no-untyped-call]
            stack.callback(store.close)
            attrs = store.get_attrs()
            stored = _stored(path, KINDS[kind], store, attrs)
        except UNREADABLE as error:
            raise InputError(path, f"cannot be read as netCDF ({error}). {must_be}") from error
        with damage_named(path, kind):
            if not (stored or empty):
                raise InputError(
                    path,
                    "contains no record, because all records of its batch were rejected. Merge it "
                    "with the other batches.",
                )
            dataset = _dataset(stored, attrs)
            for one in stored:
                _require_valid(path, one.declared, dataset)
            yield dataset


def positions(dataset: xr.Dataset, **wanted: str | float) -> dict[str, int]:
    """Return the position of a name or number along each dimension.

    Raises
    ------
    ParameterError
        If the file does not contain it.
    """
    found = {}
    for dimension, name in wanted.items():
        names = dataset["record_id" if dimension == "record" else dimension].values.tolist()
        require_known(dimension, name, names)
        found[dimension] = names.index(name)
    return found


def only_record(dataset: xr.Dataset, record: str | None) -> xr.Dataset:
    """Return the part of a dataset that belongs to one record; all of it for None.

    Raises
    ------
    ParameterError
        If the file does not contain it.
    """
    if record is None:
        return dataset
    return dataset.isel(record=[positions(dataset, record=record)["record"]])


@contextmanager
def damage_named(path: Path, kind: str) -> Iterator[None]:
    """Name the file in errors that netCDF raises within the block.

    Raises
    ------
    InputError
        If netCDF finds the file corrupted.
    """
    try:
        yield
    except (OSError, RuntimeError, UnicodeDecodeError) as error:
        must_be = f"Must be the output of `rockframe {KINDS[kind].stage}`."
        raise InputError(path, f"is corrupted ({error}). {must_be}") from error


class _Stored(xr.backends.BackendArray):
    """A declared variable of an open file.

    Its values are text as text, numbers in the declared unit, and NaN where nothing was written.
    """

    def __init__(self, declared: Variable, found: netCDF4.Variable[Any], lock: Any) -> None:
        found.set_auto_maskandscale(False)
        found.set_auto_chartostring(False)
        self.declared, self._found, self._lock = declared, found, lock
        self.stored_attrs = {name: found.getncattr(name) for name in found.ncattrs()}
        self.stored_type = np.dtype(object if found.dtype is str else found.dtype)
        self._whole = found.shape
        self._characters = self.stored_type.kind == "S"
        self.shape = self._whole[:-1] if self._characters else self._whole
        self.dims = found.dimensions[:-1] if self._characters else found.dimensions

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Type of the values that are read."""
        if self.declared.holds == "text":
            return np.dtype(object)
        return np.dtype(float) if self._factor != 1.0 else self.stored_type.newbyteorder("=")

    @cached_property
    def units(self) -> str:
        """The allowed unit in which the values are read: the stated one if it is allowed."""
        also = self.declared.also_units.split(" or ")
        return self._stated if self._stated and self._stated in also else self.declared.units

    @property
    def _stated(self) -> str:
        return str(self.stored_attrs.get("units", "1" if self.declared.units == "1" else ""))

    @cached_property
    def _factor(self) -> float:
        """Size of the stated unit in the unit of the values; NaN if they cannot be converted."""
        same = self._stated == self.units
        factor = 1.0 if same else conversion_factor(self._stated, self.units)
        return math.nan if factor is None else factor

    @cached_property
    def attrs(self) -> dict[str, Any]:
        """The declared attributes, except the names of coordinates, which the dataset has."""
        declared = self.declared.described(self.units)
        return {name: value for name, value in declared.items() if name != "coordinates"}

    @property
    def bytes(self) -> int:
        """Number of bytes that the variable may need, with a chunk that is read for one value."""
        chunk = self._found.chunking()
        of_chunk = math.prod(chunk) if isinstance(chunk, list) else 0
        return max(math.prod(self._whole), of_chunk) * int(self.stored_type.itemsize)

    def require_declared(self, path: Path, kind: FileKind) -> None:
        """Reject the file if the variable differs from its declaration."""
        one, what = self.declared, f"variable {self.declared.name!r}"
        if self.stored_type.kind not in _TYPES[one.holds]:
            raise not_of(path, kind.name, f"{what} holds {self.stored_type}, not {one.holds}.")
        if self.dims != one.dims:
            along, must = (f"({', '.join(names)})" for names in (self.dims, one.dims))
            raise InputError(path, f"{what} on {along}. Must be on {must}.")
        packed = next((name for name in _PACKED if name in self.stored_attrs), "")
        if packed:
            raise InputError(path, f"{what} with {packed}. Must hold plain values.")
        if self._factor != 1.0 and (math.isnan(self._factor) or one.holds != "numbers"):
            raise InputError(path, f"{what} in {self._stated!r}. Must be in {self.units!r}.")
        meanings = str(self.stored_attrs.get("flag_meanings", ""))
        former = meanings != "" and meanings == one.former_meanings
        for name in () if former else ("flag_values", "flag_masks", "flag_meanings"):
            stated, must_be = self.stored_attrs.get(name, ()), self.attrs.get(name, ())
            if name in self.stored_attrs and not np.array_equal(stated, must_be):
                raise InputError(path, f"{what} with {name} {stated}. Must be {must_be}.")

    def variable(self) -> xr.Variable:
        """Return the variable; values that are checked are read at once, unless they are many."""
        if _is_checked(self.declared) and math.prod(self.shape) <= _BLOCK:
            data: Any = self._read((slice(None),) * len(self.shape))
        else:
            lazy = indexing.LazilyIndexedArray(self)
            data = indexing.MemoryCachedArray(lazy)  # type: ignore[no-untyped-call]
        return xr.Variable(self.dims, data, self.attrs, fastpath=True)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Read values; xarray calls this."""
        support = indexing.IndexingSupport.OUTER
        return indexing.explicit_indexing_adapter(key, self.shape, support, self._read)

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        with self._lock:
            read = self._found[(*key, slice(None)) if self._characters else key]
        if self.declared.holds == "text":
            return _joined(read) if self._characters else np.asarray(read, dtype=object)
        values = np.array(read, dtype=self.stored_type.newbyteorder("="), copy=None)
        if values.dtype.kind == "f":  # values that were not written are netCDF's own fill value
            default = netCDF4.default_fillvals[self.stored_type.str[1:]]
            fill = self.stored_attrs.get("_FillValue", default)
            if not np.isnan(fill):
                values = np.where(values == fill, values.dtype.type(math.nan), values)
        return values if self._factor == 1.0 else values * self._factor


def _joined(characters: NDArray[np.bytes_]) -> NDArray[np.object_]:
    """Return the texts whose characters are along the last dimension."""
    *shape, length = characters.shape
    joined = np.ascontiguousarray(characters).view(f"S{length}") if length else characters
    texts = [one.decode() for one in joined.ravel()] if length else [""] * math.prod(shape)
    return np.array(texts, dtype=object).reshape(shape)


def _stored(path: Path, kind: FileKind, store: Any, attrs: Mapping[str, Any]) -> list[_Stored]:
    """Return the variables of an open file, checked against its kind before memory is allocated."""
    require_attributes(path, kind.name, attrs)
    found = store.ds.variables
    if attrs.get("title") == WITHOUT_RECORDS and not found:
        return []
    groups = {one.group for one in kind.variables if one.group and one.name in found}
    stored = []
    for one in kind.variables:
        if one.name in found:
            stored.append(_Stored(one, found[one.name], store.lock))
            stored[-1].require_declared(path, kind)
        elif not one.group or one.group in groups:
            raise _without(path, kind, one, found)
    claimed, present = sum(one.bytes for one in stored), path.stat().st_size
    if claimed > _MOST_COMPRESSED * present:
        raise not_of(path, kind.name, f"states {claimed:.3g} bytes of values, but has {present}.")
    return stored


def _dataset(stored: Sequence[_Stored], attrs: Mapping[str, Any]) -> xr.Dataset:
    """Return the dataset of variables, made without the general and slow decoding of xarray."""
    variables = {one.declared.name: one.variable() for one in stored}
    beside = {one.declared.attrs.get("coordinates", "") for one in stored}
    coords = [name for name, one in variables.items() if name in beside or one.dims == (name,)]
    return xr.Dataset(
        {name: one for name, one in variables.items() if name not in coords},
        {name: variables[name] for name in coords},
        attrs,
    )


def _without(path: Path, kind: FileKind, one: Variable, found: Container[str]) -> InputError:
    in_group = [v.name for v in kind.variables if v.group == one.group and v.name in found]
    beside = f", but with {in_group[0]!r}" if one.group else ""
    must_be = f"Use a file that this version of `rockframe {kind.stage}` wrote."
    return InputError(path, f"without variable {one.name!r}{beside}. {must_be}")


def _is_checked(one: Variable) -> bool:
    """Return True if the values have to be checked before use; series are checked as read."""
    of_any_value = one.holds == "numbers" and not (one.valid or one.key or one.refers_to)
    return "obs" not in one.dims and not of_any_value


def _require_valid(path: Path, one: Variable, dataset: xr.Dataset) -> None:
    """Reject values outside the declared range."""
    if not _is_checked(one):
        return
    array = dataset.variables[one.name]
    rows = max(1, _BLOCK * len(array) // max(1, array.size)) if array.ndim else 1
    blocks = [slice(k, k + rows) for k in range(0, len(array), rows)] if array.ndim else [()]
    for block in blocks:
        values = array.values if len(blocks) == 1 else array[block].values
        wrong = ~_allowed(one, values, dataset)
        if wrong.any():
            value = values[wrong].item(0)
            raise InputError(path, f"{one.name} {value!r}. Must be {_required(one)}.")
    if one.key:
        names, counts = np.unique(array.values.astype(str), return_counts=True)
        if (counts > 1).any():
            twice = str(names[counts > 1][0])
            raise InputError(path, f"{one.name} {twice!r} occurs twice. Must be unique.")
    if "sample_dimension" in one.attrs:
        stated, present = sum(array.values.tolist()), dataset.sizes["obs"]
        if stated != present:
            raise InputError(
                path, f"{stated} samples in {one.name}, {present} along obs. Must be equal."
            )


def _allowed(one: Variable, values: NDArray[Any], dataset: xr.Dataset) -> NDArray[np.bool_]:
    """Return a mask that is True where a value is allowed."""
    if one.holds == "flags":
        if issubclass(one.dtype, IntFlag):
            return np.asarray(values & ~reduce(or_, (bit.value for bit in one.dtype)) == 0)
        return np.asarray(np.isin(values, [member.value for member in one.dtype]))
    if one.holds == "integers":
        end = dataset.sizes[one.refers_to] if one.refers_to else np.inf
        return np.asarray(((values >= 0) | (one.valid == "any")) & (values < end))
    if one.holds == "numbers":
        allowed = np.isfinite(values) & ((values > 0.0) | (one.valid != "positive"))
    else:
        texts = [_is_text(one, value) for value in values.ravel()]
        allowed = np.array(texts, dtype=bool).reshape(values.shape)
    if one.refers_to:
        allowed &= np.isin(values, dataset.variables[one.refers_to].values)
    return np.asarray(allowed)


def _is_text(one: Variable, value: Any) -> bool:
    if not isinstance(value, str) or (one.choices and value not in one.choices):
        return False
    return not one.key or is_record_id(value)


def _required(one: Variable) -> str:
    """Return a description of the values that a variable may have."""
    if one.refers_to:
        return f"one of those of {one.refers_to}"
    if one.choices:
        return f"one of: {', '.join(map(repr, one.choices))}"
    if one.holds == "flags":
        return f"one of: {', '.join(f'{m.value} {m.name}'.lower() for m in one.dtype)}"
    if one.holds == "text":
        return "1 to 64 letters, digits, points, hyphens or underscores" if one.key else "text"
    return (
        "positive"
        if one.valid == "positive"
        else "0 or more"
        if one.holds == "integers"
        else "finite"
    )
