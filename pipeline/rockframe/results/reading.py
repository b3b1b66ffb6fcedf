"""Open files of stages, and check each against the declaration of its kind."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import IntFlag
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any, Final

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.errors import InputError, require_known
from rockframe.record import is_record_id
from rockframe.results.schema import KINDS, FileKind, Variable
from rockframe.results.writing import CHUNK, WITHOUT_RECORDS
from rockframe.units import conversion_factor

#: Errors from opening a corrupted file; netCDF4 reports an unreadable attribute as missing.
_UNREADABLE: Final = (OSError, ValueError, AttributeError, RuntimeError)
#: First bytes of netCDF files; for other files the library raises several kinds of errors.
_MAGIC: Final = (b"\x89HDF", b"CDF")
#: Global attributes that contain JSON, and the required type.
_JSON: Final = {"input_sha256": dict, "parameters": dict, "left_out": dict, "filtered": list}
#: Global attributes that every file of this package has.
_NEEDED: Final = ("input_sha256", "parameters", "left_out", "source_code_hash")
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
    _require_file(path, f"a {kind} file")
    # By default netCDF would cache 64 MB of samples per variable, although they are read once.
    netCDF4.set_chunk_cache(4 * 8 * CHUNK)
    must_be = f"Must be the output of `rockframe {KINDS[kind].stage}`."
    try:
        _require_netcdf(path, f"Run `rockframe {KINDS[kind].stage}` first and state its output.")
        store = _Declared.open(str(path), mode="r")  # type: ignore[no-untyped-call]
        store.path, store.kind = path, KINDS[kind]
        dataset = xr.open_dataset(store, decode_times=False)
    except _UNREADABLE as error:
        raise InputError(path, f"cannot be read as netCDF ({error}). {must_be}") from error
    with dataset, damage_named(path, kind):
        if not (dataset.variables or empty):
            raise InputError(
                path,
                "contains no record, because all records of its batch were rejected. Merge it with "
                "the other batches.",
            )
        for variable in KINDS[kind].variables:
            if variable.name in dataset.variables:
                _require_valid(path, variable, dataset)
        yield dataset


def _require_file(path: Path, wanted: str) -> None:
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(path, f"{what}. Must be {wanted}.")


def _require_netcdf(path: Path, instead: str) -> None:
    with path.open("rb") as stream:
        if not stream.read(4).startswith(_MAGIC):
            raise InputError(path, f"is not a netCDF file. {instead}")


def kind_of(path: Path) -> str:
    """Return the kind that a file states in its attributes.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of an unknown kind.
    """
    _require_file(path, "the output of a stage")
    try:
        _require_netcdf(path, "Must be the output of a stage, such as `rockframe ingest`.")
        with netCDF4.Dataset(path) as file:
            kind = str(getattr(file, "rockframe_kind", "unknown"))
    except _UNREADABLE as error:
        raise InputError(path, f"cannot be read as netCDF ({error}).") from error
    if kind not in KINDS:
        raise InputError(path, f"is of kind {kind!r}. Must be one of: {', '.join(KINDS)}.")
    return kind


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


def attributes_of(path: Path, kind: str) -> Mapping[str, Any]:
    """Return the global attributes of a file, without reading or checking its variables.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        One of `KINDS`.

    Raises
    ------
    InputError
        If the file is missing or corrupted, or if another stage wrote it.
    """
    _require_file(path, f"a {kind} file")
    try:
        _require_netcdf(path, "Must be the output of a stage.")
        with netCDF4.Dataset(path) as file:
            attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    except _UNREADABLE as error:
        raise _not_of(path, kind, f"cannot be read as netCDF ({error}).") from error
    _require_attributes(path, kind, attrs)
    return attrs


def _not_of(path: Path, kind: str, what: str) -> InputError:
    return InputError(path, f"{what} Must be the output of `rockframe {KINDS[kind].stage}`.")


def _require_attributes(path: Path, kind: str, attrs: Mapping[str, Any]) -> None:
    found = str(attrs.get("rockframe_kind", "unknown"))
    if found != kind:
        raise _not_of(path, kind, f"is a netCDF file of kind {found!r}.")
    for name in (*_NEEDED, *_JSON):
        if name not in attrs and name not in _NEEDED:
            continue
        try:
            value = json.loads(attrs[name]) if name in _JSON else attrs[name]
        except (KeyError, TypeError, ValueError, RecursionError):
            value = None
        if not isinstance(value, _JSON.get(name, str)):
            raise _not_of(path, kind, f"without a global attribute {name!r} that can be read.")


class _Declared(xr.backends.NetCDF4DataStore):
    """The content of a file, checked against its kind before memory is allocated."""

    path: Path
    kind: FileKind

    def load(self) -> tuple[dict[str, xr.Variable], dict[str, Any]]:
        """Return variables, not yet read, and global attributes."""
        found, attrs = super().load()  # type: ignore[no-untyped-call]
        try:
            _require_attributes(self.path, self.kind.name, attrs)
            if attrs.get("title") == WITHOUT_RECORDS and not found:
                return {}, dict(attrs)
            variables = {
                one.name: self._as_declared(one, found[one.name])
                for one in self.kind.variables
                if self._has(one, found)
            }
            self._require_room(variables)
        except InputError:
            self.close()  # type: ignore[no-untyped-call]
            raise
        return variables, dict(attrs)

    def _refuse(self, what: str) -> InputError:
        return _not_of(self.path, self.kind.name, what)

    def _has(self, one: Variable, found: Mapping[str, xr.Variable]) -> bool:
        """Return True if the file has a variable; reject the file if a required variable is
        missing.
        """
        group = [v.name for v in self.kind.variables if v.group == one.group and v.name in found]
        if one.name not in found and (group or not one.group):
            beside = f", but with {group[0]!r}" if one.group else ""
            must_be = f"Use a file that this version of `rockframe {self.kind.stage}` wrote."
            raise InputError(self.path, f"without variable {one.name!r}{beside}. {must_be}")
        return one.name in found

    def _as_declared(self, one: Variable, found: xr.Variable) -> xr.Variable:
        """Return a variable with the declared attributes and those needed for decoding."""
        what = f"variable {one.name!r}"
        kind, dims = found.dtype.kind, found.dims
        dims = dims[:-1] if kind == "S" else dims
        if kind not in _TYPES[one.holds]:
            raise self._refuse(f"{what} holds {found.dtype}, not {one.holds}.")
        if dims != one.dims:
            along, must = (f"({', '.join(map(str, names))})" for names in (dims, one.dims))
            raise InputError(self.path, f"{what} on {along}. Must be on {must}.")
        packed = next((name for name in _PACKED if name in found.attrs), "")
        if packed:
            raise InputError(self.path, f"{what} with {packed}. Must hold plain values.")
        stated = str(found.attrs.get("units", "1" if one.units == "1" else ""))
        units = stated if stated and stated in one.also_units.split(" or ") else one.units
        factor = conversion_factor(stated, units)
        if factor is None or (factor != 1.0 and one.holds != "numbers"):
            raise InputError(self.path, f"{what} in {stated!r}. Must be in {units!r}.")
        attrs = one.holding(np.zeros((0,) * len(dims)), units).attrs
        meanings = str(found.attrs.get("flag_meanings", ""))
        former = meanings != "" and meanings == one.former_meanings
        for name in () if former else ("flag_values", "flag_masks", "flag_meanings"):
            if name in found.attrs and str(found.attrs[name]) != str(attrs.get(name)):
                raise InputError(
                    self.path, f"{what} with {name} {found.attrs[name]}. Must be {attrs[name]}."
                )
        if factor != 1.0:
            attrs["scale_factor"] = factor
        if kind == "f":  # values that were not written have netCDF's own fill value, stated or not
            unwritten = netCDF4.default_fillvals[found.dtype.str[1:]]
            attrs["_FillValue"] = found.attrs.get("_FillValue", unwritten)
        if kind == "S":
            attrs["_Encoding"] = "utf-8"
        declared = found.copy(deep=False)
        declared.attrs = attrs
        return declared

    def _require_room(self, variables: Mapping[str, xr.Variable]) -> None:
        """Reject variables that are larger than the file can contain, before memory is
        allocated.
        """
        claimed = 0
        for one in variables.values():
            chunk = one.encoding.get("chunksizes") or ()
            claimed += max(math.prod(one.shape), math.prod(chunk)) * one.dtype.itemsize
        present = self.path.stat().st_size
        if claimed > _MOST_COMPRESSED * present:
            raise self._refuse(f"states {claimed:.3g} bytes of values, but has {present}.")


def _require_valid(path: Path, one: Variable, dataset: xr.Dataset) -> None:
    """Reject values outside the declared range; series are checked when they are read."""
    if "obs" in one.dims or (
        one.holds == "numbers" and not (one.valid or one.key or one.refers_to)
    ):
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
