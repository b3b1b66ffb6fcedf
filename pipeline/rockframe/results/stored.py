"""Files of stages as they are stored, checked against the declaration of their kind.

Nothing here imports xarray, which takes long: `rockframe.results.reading` returns datasets.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from enum import IntFlag
from functools import cached_property, reduce
from operator import or_
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Final, Literal, TypeAlias, TypeVar

import netCDF4
import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.record import is_record_id
from rockframe.results.schema import KINDS, FileKind, Variable
from rockframe.units import conversion_factor

#: An open file, of the library that opens it.
File = TypeVar("File")
#: Opens a file, and yields it with a lock that is held while a variable is read.
Holder: TypeAlias = Callable[[Path], AbstractContextManager[tuple[netCDF4.Dataset, Any]]]

#: Title of the file of a batch without accepted records, which has no variables.
WITHOUT_RECORDS: Final = "Batch without records"
#: Global attribute of an index of several files: its shards, as JSON (`rockframe.results.shards`).
SHARDS: Final = "shards"
#: Number of samples in one compressed block.
CHUNK: Final = 16384
#: Errors from opening a corrupted file; netCDF4 reports an unreadable attribute as missing.
UNREADABLE: Final = (OSError, ValueError, AttributeError, RuntimeError)
#: First bytes of netCDF files; for other files the library raises several kinds of errors.
_MAGIC: Final = (b"\x89HDF", b"CDF")
#: Attributes of packed variables, whose stored numbers differ from their values.
_PACKED: Final = ("scale_factor", "add_offset", "missing_value", "_Unsigned")
#: Kinds of NumPy types that are allowed for each declared type.
_TYPES: Final = {"text": "SO", "flags": "iu", "integers": "iu", "numbers": "fiu"}
#: Attributes of flags.
_FLAGS: Final = ("flag_values", "flag_masks", "flag_meanings")
#: Largest compression ratio that netCDF can reach.
_MOST_COMPRESSED: Final = 1032
#: Longest time for which a lock is waited for, and the time between two looks [s].
_PATIENCE: Final = 1.0
_PAUSE: Final = 0.02
#: Number of values that are checked at once.
_BLOCK: Final = 2**20
#: Global attributes that contain JSON, and the required type.
_JSON: Final = {
    **dict.fromkeys(("input_sha256", "parameters", "left_out"), dict),
    **dict.fromkeys(("filtered", SHARDS), list),
}
#: Global attributes that every file of this package has.
_NEEDED: Final = ("input_sha256", "parameters", "left_out", "source_code_hash")


def require_file(path: Path, wanted: str) -> None:
    """Raise an error if there is no such file."""
    if not path.is_file():
        reason = "a folder" if path.is_dir() else "no such file"
        raise InputError(path, f"{reason}. Must be {wanted}.")


def require_netcdf(path: Path, instead: str) -> None:
    """Raise an error, with what to do instead, if a file is not a netCDF file."""
    with path.open("rb") as stream:
        if not stream.read(4).startswith(_MAGIC):
            raise InputError(path, f"is not a netCDF file. {instead}")


def open_netcdf(path: Path, mode: Literal["r", "w", "a"] = "r") -> netCDF4.Dataset:
    """Open a netCDF file; the caller closes it. See `unlocked`."""
    return unlocked(path, mode, lambda: netCDF4.Dataset(path, mode, format="NETCDF4"))


def unlocked(path: Path, mode: str, opening: Callable[[], File]) -> File:
    """Return what opens a file for HDF5, whose lock is waited for a second.

    A process that another thread starts holds the files of this process, and with them their locks,
    for a moment until its own program begins: also files that were closed here meanwhile.
    """
    end = monotonic() + _PATIENCE
    while True:
        try:
            return opening()
        except OSError:
            if monotonic() > end or not _is_locked(path, exclusive=mode != "r"):
                raise
        sleep(_PAUSE)


def kind_of(path: Path) -> str:
    """Return the kind that a file states in its attributes.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of an unknown kind.
    """
    require_file(path, "the output of a stage")
    try:
        require_netcdf(path, "Must be the output of a stage, such as `rockframe ingest`.")
        with open_netcdf(path) as file:
            kind = str(getattr(file, "rockframe_kind", "unknown"))
    except UNREADABLE as error:
        raise _unreadable(path, error, "Must be the output of a stage.") from error
    if kind not in KINDS:
        raise InputError(path, f"is of kind {kind!r}. Must be one of: {', '.join(KINDS)}.")
    return kind


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
    require_file(path, f"a {kind} file")
    try:
        require_netcdf(path, "Must be the output of a stage.")
        with open_netcdf(path) as file:
            attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    except UNREADABLE as error:
        must_be = f"Must be the output of `rockframe {KINDS[kind].stage}`."
        raise _unreadable(path, error, must_be) from error
    require_attributes(path, kind, attrs)
    return attrs


def _unreadable(path: Path, error: Exception, must_be: str) -> InputError:
    """Return the error of a file that netCDF cannot open, or that another program is writing."""
    if _is_locked(path):
        return InputError(path, "another program has it open for writing. Close it there first.")
    return InputError(path, f"cannot be read as netCDF ({error}). {must_be}")


def _is_locked(path: Path, *, exclusive: bool = False) -> bool:
    """Return True if a program holds the lock with which HDF5 writes, where the system has it.

    With `exclusive`, also if one holds the lock with which HDF5 reads.
    """
    try:
        import fcntl

        with path.open("rb") as stream:
            fcntl.flock(stream, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except (ImportError, OSError):
        return False
    return False


def not_of(path: Path, kind: str, what: str) -> InputError:
    """Return the error of a file that is not a whole file of a kind."""
    return InputError(path, f"{what} Must be the output of `rockframe {KINDS[kind].stage}`.")


def require_attributes(path: Path, kind: str, attrs: Mapping[str, Any]) -> None:
    """Raise an error if the global attributes are not those of a file of a kind."""
    kind_of_file = str(attrs.get("rockframe_kind", "unknown"))
    if kind_of_file != kind:
        raise not_of(path, kind, f"is a netCDF file of kind {kind_of_file!r}.")
    for name in (*_NEEDED, *_JSON):
        if name not in attrs and name not in _NEEDED:
            continue
        try:
            value = json.loads(attrs[name]) if name in _JSON else attrs[name]
        except (KeyError, TypeError, ValueError, RecursionError):
            value = None
        if not isinstance(value, _JSON.get(name, str)):
            raise not_of(path, kind, f"without a global attribute {name!r} that can be read.")


def require_all_records(path: Path, kind: str, attrs: Mapping[str, Any]) -> None:
    """Raise an error for the file of a batch that lacks what needs all records."""
    if "batch" in attrs and any(v.of_files == "all records" for v in KINDS[kind].variables):
        what = f"is batch {attrs['batch']} alone, without the results of all records."
        raise InputError(path, f"{what} State the file of all batches.")


@contextmanager
def alone(path: Path) -> Iterator[tuple[netCDF4.Dataset, Any]]:
    """Open a file that no other thread reads, and yield it with a lock that does nothing."""
    with open_netcdf(path) as file:
        yield file, nullcontext()


@contextmanager
def opened_one(
    path: Path, kind: str, *, empty: bool = False, held: Holder = alone
) -> Iterator[tuple[Mapping[str, Any], list[Stored]]]:
    """Open a file of one kind, and close it at the end of the block; of an index, only itself.

    Yields its global attributes, and the variables that are declared for the kind. Values that have
    to be checked are, and were read unless they are many.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        One of `KINDS`.
    empty : bool
        Accept the file of a batch without accepted records too, which has no variables.
    held : callable
        Opens the file, and yields it with a lock that is held while a variable is read.

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
            file, lock = stack.enter_context(held(path))
            attrs = {name: file.getncattr(name) for name in file.ncattrs()}
            stored = _stored(path, KINDS[kind], file, attrs, lock)
        except UNREADABLE as error:
            raise _unreadable(path, error, must_be) from error
        with damage_named(path, kind):
            if not (stored or empty):
                raise InputError(
                    path,
                    "contains no record, because all records of its batch were rejected. Join it "
                    "with the other batches.",
                )
            _require_valid(path, stored)
            yield attrs, stored


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


class Stored:
    """A declared variable of an open file.

    Its values are text as text, numbers in the declared unit, and NaN where nothing was written.
    """

    def __init__(self, declared: Variable, found: netCDF4.Variable[Any], lock: Any) -> None:
        found.set_auto_maskandscale(False)
        found.set_auto_chartostring(False)
        self.declared, self._found, self._lock = declared, found, lock
        #: Sizes of the shards of an index along the records; empty for the variable of one file.
        self.chunks: Mapping[str, tuple[int, ...]] = {}
        self.stored_attrs = {name: found.getncattr(name) for name in found.ncattrs()}
        self.stored_type = np.dtype(object if found.dtype is str else found.dtype)
        self._whole = found.shape
        self._characters = self.stored_type.kind == "S"
        self.shape = self._whole[:-1] if self._characters else self._whole
        self.dims = found.dimensions[:-1] if self._characters else found.dimensions

    @property
    def along_records(self) -> int | None:
        """Position of the dimension that grows with the records; None if there is none."""
        return next((k for k, name in enumerate(self.dims) if name in ("record", "obs")), None)

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
        variable, name_of = self.declared, f"variable {self.declared.name!r}"
        if self.stored_type.kind not in _TYPES[variable.holds]:
            raise not_of(
                path, kind.name, f"{name_of} holds {self.stored_type}, not {variable.holds}."
            )
        if self.dims != variable.dims:
            along, must = (f"({', '.join(names)})" for names in (self.dims, variable.dims))
            raise InputError(path, f"{name_of} on {along}. Must be on {must}.")
        packed = next((name for name in _PACKED if name in self.stored_attrs), "")
        if packed:
            raise InputError(path, f"{name_of} with {packed}. Must hold plain values.")
        if self._factor != 1.0 and (math.isnan(self._factor) or variable.holds != "numbers"):
            raise InputError(path, f"{name_of} in {self._stated!r}. Must be in {self.units!r}.")
        for name in () if self._fewer_flags else _FLAGS:
            here, must_be = self.stored_attrs.get(name, ()), self.attrs.get(name, ())
            if name in self.stored_attrs and not np.array_equal(here, must_be):
                raise InputError(path, f"{name_of} with {name} {here}. Must be {must_be}.")

    @property
    def _fewer_flags(self) -> bool:
        """True if some of the declared flags are stated, as in files of earlier versions."""
        meanings, declared = (_flags(attrs) for attrs in (self.stored_attrs, self.attrs))
        return bool(meanings) and meanings.items() <= declared.items()

    @property
    def is_checked(self) -> bool:
        """True if the values are checked before use; series are checked as they are read."""
        variable = self.declared
        of_any_value = variable.holds == "numbers" and not (
            variable.valid or variable.key or variable.refers_to
        )
        return "obs" not in variable.dims and not of_any_value

    @property
    def is_read(self) -> bool:
        """True if the values were read to be checked, and are kept."""
        return self.is_checked and math.prod(self.shape) <= _BLOCK

    @cached_property
    def values(self) -> NDArray[Any]:
        """All values."""
        return self.read((slice(None),) * len(self.shape))

    def read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        """Read the values at an index of each dimension."""
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

    def blocks(self) -> Iterator[NDArray[Any]]:
        """Yield all values, in blocks along the first dimension if they are many."""
        if self.is_read or not self.shape:
            yield self.values
            return
        rows = max(1, _BLOCK * self.shape[0] // max(1, math.prod(self.shape)))
        rest = (slice(None),) * (len(self.shape) - 1)
        for k in range(0, self.shape[0], rows):
            yield self.read((slice(k, k + rows), *rest))


def _flags(attrs: Mapping[str, Any]) -> dict[str, int]:
    """Return the values of flags by their meanings; none if there is not one for each."""
    values = np.atleast_1d(attrs.get("flag_values", ())).tolist()
    meanings = str(attrs.get("flag_meanings", "")).split()
    return dict(zip(meanings, values, strict=True)) if len(meanings) == len(values) else {}


def _joined(characters: NDArray[np.bytes_]) -> NDArray[np.object_]:
    """Return the texts whose characters are along the last dimension."""
    *shape, length = characters.shape
    joined = np.ascontiguousarray(characters).view(f"S{length}") if length else characters
    texts = [text.decode() for text in joined.ravel()] if length else [""] * math.prod(shape)
    return np.array(texts, dtype=object).reshape(shape)


def _stored(
    path: Path, kind: FileKind, file: netCDF4.Dataset, attrs: Mapping[str, Any], lock: Any
) -> list[Stored]:
    """Return the variables of an open file, checked against its kind before memory is allocated."""
    require_attributes(path, kind.name, attrs)
    variables = file.variables
    if attrs.get("title") == WITHOUT_RECORDS and not variables:
        return []
    groups = {
        variable.group
        for variable in kind.variables
        if variable.group and variable.name in variables
    }
    lacking = "all records" if "batch" in attrs else "one batch"
    stored = []
    for variable in kind.variables:
        if variable.name in variables:
            stored.append(Stored(variable, variables[variable.name], lock))
            stored[-1].require_declared(path, kind)
        elif (
            SHARDS not in attrs
            and variable.of_files != lacking
            and (not variable.group or variable.group in groups)
        ):
            raise _without(path, kind, variable, variables)
    claimed, present = sum(variable.bytes for variable in stored), path.stat().st_size
    if claimed > _MOST_COMPRESSED * present:
        raise not_of(path, kind.name, f"states {claimed:.3g} bytes of values, but has {present}.")
    return stored


def _without(path: Path, kind: FileKind, variable: Variable, found: Container[str]) -> InputError:
    in_group = [v.name for v in kind.variables if v.group == variable.group and v.name in found]
    beside = f", but with {in_group[0]!r}" if variable.group else ""
    must_be = f"Use a file that this version of `rockframe {kind.stage}` wrote."
    return InputError(path, f"without variable {variable.name!r}{beside}. {must_be}")


def sizes_of(stored: Sequence[Stored]) -> dict[str, int]:
    """Return the size of each dimension."""
    return {
        name: size
        for variable in stored
        for name, size in zip(variable.dims, variable.shape, strict=True)
    }


def _require_valid(path: Path, stored: Sequence[Stored]) -> None:
    """Reject values outside their declared range."""
    sizes = sizes_of(stored)
    of = {variable.declared.name: variable for variable in stored}
    for variable in stored:
        if variable.is_checked:
            _require_allowed(path, variable, of, sizes)
    _require_properties(path, of)


def _require_properties(path: Path, of: Mapping[str, Stored]) -> None:
    """Reject a frame that lacks a property that every frame has.

    Other kinds may lack properties of frames; without the variable `kind` all are frames.
    """
    from rockframe.study.kinds import declared_kind  # files of records have no structures

    kinds = of["kind"].values if "kind" in of else None
    frames = True if kinds is None else [declared_kind(str(kind)).frames for kind in kinds]
    for name, stored in of.items():
        if stored.declared.valid == "finite or absent":
            missing = np.flatnonzero(np.isnan(stored.values) & frames)
            if missing.size:
                structure = of["structure"].values[missing[0]]
                raise InputError(
                    path, f"{name} nan of structure {structure!r}. Must be finite for a frame."
                )


def _require_allowed(
    path: Path, stored: Stored, of: Mapping[str, Stored], sizes: Mapping[str, int]
) -> None:
    variable = stored.declared
    for values in stored.blocks():
        wrong = ~_allowed(variable, values, of, sizes)
        if wrong.any():
            value = values[wrong].item(0)
            raise InputError(path, f"{variable.name} {value!r}. Must be {_required(variable)}.")
    if variable.key:
        names, counts = np.unique(stored.values.astype(str), return_counts=True)
        if (counts > 1).any():
            twice = str(names[counts > 1][0])
            raise InputError(path, f"{variable.name} {twice!r} occurs twice. Must be unique.")
    if "sample_dimension" in variable.attrs and "obs" in sizes:  # an index has no samples
        claimed, present = sum(stored.values.tolist()), sizes["obs"]
        if claimed != present:
            raise InputError(
                path, f"{claimed} samples in {variable.name}, {present} along obs. Must be equal."
            )


def _allowed(
    variable: Variable, values: NDArray[Any], of: Mapping[str, Stored], sizes: Mapping[str, int]
) -> NDArray[np.bool_]:
    """Return a mask that is True where a value is allowed."""
    if variable.holds == "flags":
        if issubclass(variable.dtype, IntFlag):
            return np.asarray(values & ~reduce(or_, (bit.value for bit in variable.dtype)) == 0)
        return np.asarray(np.isin(values, [member.value for member in variable.dtype]))
    if variable.holds == "integers":
        end = sizes[variable.refers_to] if variable.refers_to else np.inf
        return np.asarray(((values >= 0) | (variable.valid == "any")) & (values < end))
    if variable.holds == "numbers":
        allowed = np.isfinite(values) & ((values > 0.0) | (variable.valid != "positive"))
        allowed |= np.isnan(values) & (variable.valid == "finite or absent")
    else:
        texts = [_is_text(variable, value) for value in values.ravel()]
        allowed = np.array(texts, dtype=bool).reshape(values.shape)
    if variable.refers_to:
        allowed &= np.isin(values, of[variable.refers_to].values)
    return np.asarray(allowed)


def _is_text(variable: Variable, value: Any) -> bool:
    if not isinstance(value, str) or (variable.choices and value not in variable.choices):
        return False
    return not variable.key or is_record_id(value)


def _required(variable: Variable) -> str:
    """Return a description of the values that a variable may have."""
    if variable.refers_to:
        return f"one of those of {variable.refers_to}"
    if variable.choices:
        return f"one of: {', '.join(map(repr, variable.choices))}"
    if variable.holds == "flags":
        return f"one of: {', '.join(f'{m.value} {m.name}'.lower() for m in variable.dtype)}"
    if variable.holds == "text":
        return "1 to 64 letters, digits, points, hyphens or underscores" if variable.key else "text"
    return (
        "positive"
        if variable.valid == "positive"
        else "0 or more"
        if variable.holds == "integers"
        else "finite"
    )
