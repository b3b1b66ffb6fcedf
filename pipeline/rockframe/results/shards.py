"""Results of a stage in several files, its shards, and an index that opens them as one file."""

from __future__ import annotations

import json
import os
import shutil
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import astuple, dataclass, replace
from functools import cached_property, partial
from itertools import accumulate
from pathlib import Path
from threading import RLock, get_ident
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.interruption import raise_if_interrupted
from rockframe.provenance import sha256_of
from rockframe.results.schema import KINDS, RECORDS
from rockframe.results.schema.arrays import Array, Arrays, Index
from rockframe.results.stored import (
    SHARDS,
    Holder,
    Stored,
    alone,
    not_of,
    open_netcdf,
    opened_one,
    require_all_records,
)

#: Attributes that the shards of an index have in common with it; records have some of its inputs.
_COMMON: Final = ("rockframe_kind", "source_code_hash", "input_sha256", "parameters")
#: Attribute of a batch of records: the outcomes of its files, as JSON, which its index needs.
INGESTED: Final = "ingested"
#: Size of open shards beyond which all but the last two are closed [bytes].
_MOST_OPEN: Final = 2**26
#: Memory that netCDF needs for an open file, whatever its size: 3.0 MB for one of 37 variables.
_OPEN_FILE: Final = 3 * 2**20
#: Largest size of a variable that is read whole when a part of it is needed [bytes].
_SMALL: Final = 2**16


@dataclass(frozen=True)
class Shard:
    """One of the files that an index joins: the results of a batch.

    Parameters
    ----------
    name : str
        Path from the folder of the index.
    sha256 : str
        Hash of the file.
    records, samples : int
        Sizes along ``record`` and ``obs``; zero if all records of the batch were rejected.

    Examples
    --------
    >>> Shard("shards/response-001.nc", "", 50, 0).records
    50
    """

    name: str
    sha256: str
    records: int
    samples: int


def shards_of(attrs: Mapping[str, Any]) -> list[Shard]:
    """Return the shards that the global attributes of an index name; none for another file.

    Examples
    --------
    >>> shards_of({"shards": '[["shards/response-001.nc", "", 50, 0]]'})
    [Shard(name='shards/response-001.nc', sha256='', records=50, samples=0)]
    >>> shards_of({})
    []
    """
    return [Shard(*values) for values in json.loads(attrs.get(SHARDS, "[]"))]


@dataclass(frozen=True)
class _Batch:
    """The file of a batch, as far as an index needs it: its attributes, the names of its variables
    and records, and the values that all batches share.
    """

    path: Path
    attrs: Mapping[str, Any]
    variables: Sequence[str]
    names: Sequence[str]
    samples: int
    shared: Mapping[str, Array]


@dataclass(frozen=True)
class BatchFiles:
    """The files of all batches of a stage, in order, which an index opens as one file.

    Parameters
    ----------
    paths : sequence of Path
        The files.
    index : Arrays
        The names of the records, and what all batches share: the structures. Its attributes name
        the shards by their paths from the folder of the index.
    left_out : mapping of str to str
        Reasons why records were rejected, by identifier.
    """

    paths: Sequence[Path]
    index: Arrays
    left_out: Mapping[str, str]

    @classmethod
    def of(cls, parts: Sequence[Path], output: Path, kind: str) -> Self:
        """Return the batches in these files, at least one, for an index to write.

        Raises
        ------
        InputError
            If a file cannot be read, or was made from other inputs or with other options than the
            first; if a file is missing or out of order; if a record is in two of them; or if no
            file contains a record.
        """
        batches = [_batch(path, kind, f"{k}/{len(parts)}") for k, path in enumerate(parts, 1)]
        left_out = {n: why for b in batches for n, why in json.loads(b.attrs["left_out"]).items()}
        first = next((batch for batch in batches if batch.variables), None)
        if first is None:
            reasons = [f"; {name!r}: {reason}" for name, reason in left_out.items()]
            raise InputError(parts[0], "no batch contains a record" + next(iter(reasons), "."))
        others = batches if kind == RECORDS else []  # each has read other files
        inputs = {name: h for b in (first, *others) for name, h in _inputs(b.attrs).items()}
        attrs = {**first.attrs, "input_sha256": json.dumps(inputs, sort_keys=True)}
        for batch in batches:
            _require_same_run(batch.path, batch.attrs, attrs, first.path)
            if batch.variables:
                _require_alike(batch, first)
        names = [name for batch in batches for name in batch.names]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError(output, f"record {twice!r} is in two batches. Must be in one.")
        shards = [
            Shard(_from(output.parent, b.path), sha256_of(b.path), len(b.names), b.samples)
            for b in batches
        ]
        attrs = {name: value for name, value in attrs.items() if name not in ("batch", INGESTED)}
        index = Arrays(
            {"record_id": KINDS[kind]["record_id"].holding(names), **first.shared},
            {**attrs, SHARDS: json.dumps([astuple(shard) for shard in shards])},
        )
        return cls(parts, index, left_out)

    def require_of(
        self, output: Path, input_sha256: Mapping[str, str], parameters: Mapping[str, Any]
    ) -> None:
        """Require that an index with these inputs and options may have these batches.

        Raises
        ------
        InputError
            If they were made from other inputs or with other options.
        """
        attrs = self.index.attrs
        stated = {"input_sha256": input_sha256, "parameters": parameters}
        texts = {name: json.dumps(value, sort_keys=True) for name, value in stated.items()}
        _require_same_run(self.paths[0], attrs, {**attrs, **texts}, output)


def copy_file(path: Path, to: Path) -> None:
    """Copy a file of a stage; the copy of an index names links to the shards, beside the copy."""
    shutil.copyfile(path, to)
    with open_netcdf(to, "a") as file:
        shards = shards_of({name: file.getncattr(name) for name in file.ncattrs()})
        if not shards:
            return
        folder = to.parent / "shards"
        folder.mkdir(exist_ok=True)
        named = []
        for number, shard in enumerate(shards, 1):
            link = folder / f"{to.stem}-{number:03d}.nc"
            link.symlink_to((path.parent / shard.name).resolve())
            named.append(replace(shard, name=_from(to.parent, link)))
        file.setncattr(SHARDS, json.dumps([astuple(shard) for shard in named]))


def _batch(path: Path, kind: str, wanted: str) -> _Batch:
    """Read what an index needs of the file of a batch."""
    raise_if_interrupted()
    with opened_one(path, kind, empty=True) as (attrs, stored):
        if SHARDS in attrs:
            raise InputError(path, "is an index of batches. Must be the file of one batch.")
        number = attrs.get("batch", "1/1")
        if number != wanted:
            must_be = f"Must be batch {wanted} here: state the batches in order."
            raise InputError(path, f"is batch {number}. {must_be}")
        variables = {variable.declared.name: variable for variable in stored}
        shared = {
            name: KINDS[kind][name].holding(variable.values, variable.units)
            for name, variable in variables.items()
            if variable.along_records is None
        }
        sizes = {n: size for v in stored for n, size in zip(v.dims, v.shape, strict=True)}
        names = variables["record_id"].values.tolist() if variables else []
        return _Batch(path, attrs, [*variables], names, sizes.get("obs", 0), shared)


def _from(folder: Path, path: Path) -> str:
    return Path(os.path.relpath(path, folder)).as_posix()


def _inputs(attrs: Mapping[str, Any]) -> dict[str, str]:
    """Return name and SHA-256 of the inputs that a file states."""
    return dict(json.loads(attrs["input_sha256"]))


def _require_same_run(
    path: Path, attrs: Mapping[str, Any], others: Mapping[str, Any], other: Path
) -> None:
    """Reject the file of a batch that was not computed as another file says.

    An index may state more parameters: those of the results of all records.
    """
    for name in _COMMON:
        if _as_in_batch(name, attrs, others) != attrs[name]:
            raise InputError(path, f"not the {name} of {other}. Must be batches of one run.")


def _as_in_batch(name: str, of_batch: Mapping[str, Any], of_run: Mapping[str, Any]) -> Any:
    """Return an attribute of a run; of parameters and files of records, what the batch states."""
    of_records = name == "input_sha256" and of_run["rockframe_kind"] == RECORDS
    if name != "parameters" and not of_records:
        return of_run[name]
    stated = json.loads(of_run[name])
    some = {key: stated[key] for key in json.loads(of_batch[name]) if key in stated}
    return json.dumps(some, sort_keys=True)


def _require_alike(batch: _Batch, first: _Batch) -> None:
    """Reject the file of a batch whose variables, or the values that all share, differ."""
    differing = {*batch.variables} ^ {*first.variables}
    differing |= {
        name
        for name, variable in first.shared.items()
        if not differing and not _equal(batch.shared[name].values, variable.values)
    }
    if differing:
        raise InputError(batch.path, f"not the {min(differing)} of {first.path}. Must be equal.")


def _equal(values: NDArray[Any], others: NDArray[Any]) -> bool:
    numbers = values.dtype.kind == others.dtype.kind == "f"
    return np.array_equal(values, others, equal_nan=numbers)


def _required_shards(path: Path, kind: str, attrs: Mapping[str, Any]) -> list[Shard]:
    """Return the shards of an index; reject an attribute that does not name any."""
    try:
        shards = shards_of(attrs)
        forms = {tuple(map(type, astuple(shard))) for shard in shards}
    except TypeError:
        forms = set()
    if forms != {(str, str, int, int)}:
        raise not_of(path, kind, f"with a global attribute {SHARDS!r} that does not name shards.")
    return shards


class OpenShards:
    """The shards of an index, opened and checked when they are needed.

    Parameters
    ----------
    path : Path
        The index.
    kind : str
        Kind of the files.
    attrs : mapping
        Global attributes of the index.
    held : callable
        Opens a shard, and yields it with a lock that is held while a variable is read.
    """

    def __init__(self, path: Path, kind: str, attrs: Mapping[str, Any], held: Holder) -> None:
        self._path, self._kind, self._attrs, self._held = path, kind, attrs, held
        self._open: OrderedDict[int, tuple[ExitStack, dict[str, Stored], int]] = OrderedDict()
        self._small: OrderedDict[int, dict[str, NDArray[Any]]] = OrderedDict()
        self._small_size = 0
        self._threads: set[int] = set()  # that read
        self.all = _required_shards(path, kind, attrs)
        self.lock = RLock()

    def __len__(self) -> int:
        """Return the number of shards that are open."""
        return len(self._open)

    def ends(self, dimension: str) -> NDArray[np.int64]:
        """Return the end of each shard along ``record`` or ``obs``."""
        sizes = [shard.records if dimension == "record" else shard.samples for shard in self.all]
        return np.array([*accumulate(sizes)], dtype=np.int64)

    def chunks(self, dimension: str) -> dict[str, tuple[int, ...]]:
        """Return the sizes along ``record`` or ``obs`` of the shards that have any, or one 0."""
        sizes = np.diff(self.ends(dimension), prepend=0).tolist()
        return {dimension: tuple(size for size in sizes if size) or (0,)}

    @cached_property
    def first(self) -> int:
        """Number of the first shard with a record, whose variables are those of all."""
        return next(number for number, shard in enumerate(self.all) if shard.records)

    def _path_of(self, number: int) -> Path:
        """Return the path of a shard, which must be there."""
        path = self._path.parent / self.all[number].name
        if not path.is_file():
            batch = f"batch {number + 1} of {len(self.all)}"
            again = "Restore the file, or run again: only this batch is computed."
            raise InputError(path, f"missing: {self._path.name} names it as {batch}. {again}")
        return path

    def variables(self, number: int, together: int = 1) -> dict[str, Stored]:
        """Return the variables of a shard, by name.

        Parameters
        ----------
        number : int
            Number of the shard.
        together : int
            Number of shards that are read together, and stay open for the next variable. At least
            one stays open for each thread that reads.

        Raises
        ------
        InputError
            If the shard is missing, corrupted, or of another run.
        """
        if number not in self._open:
            path, shard = self._path_of(number), self.all[number]
            with ExitStack() as stack:
                opening = opened_one(path, self._kind, empty=True, held=self._held)
                attrs, stored = stack.enter_context(opening)
                _require_same_run(path, attrs, self._attrs, self._path)
                variables = {variable.declared.name: variable for variable in stored}
                records = variables["record_id"].shape[0] if variables else 0
                batch = attrs.get("batch", "1/1"), records
                wanted = f"{number + 1}/{len(self.all)}", shard.records
                if batch != wanted:
                    states = f"batch {batch[0]} of {batch[1]} records"
                    must = f"Must be batch {wanted[0]} of {wanted[1]}, as {self._path.name} says."
                    raise InputError(path, f"is {states}. {must}")
                size = _OPEN_FILE + sum(v.bytes for v in stored if "obs" not in v.dims)
                self._open[number] = stack.pop_all(), variables, size
        self._open.move_to_end(number)
        self._threads.add(get_ident())
        most = max(2, together, len(self._threads))
        while len(self._open) > most or (len(self._open) > 2 and self._are_large()):
            first, (opened, variables, _) = self._open.popitem(last=False)
            if together > len(self._open):  # the next variable is read from this shard, too
                self.keep_small(first, variables)
            opened.close()
        return self._open[number][1]

    def _are_large(self) -> bool:
        return sum(size for *_, size in self._open.values()) > _MOST_OPEN

    def keep_small(self, number: int, variables: Mapping[str, Stored]) -> None:
        """Keep the small variables of a shard that is closed, so that it is not opened for each."""
        if number not in self._small:
            along = ((n, v) for n, v in variables.items() if v.along_records is not None)
            small = {n: v.values for n, v in along if v.bytes <= _SMALL and read_whole(v)}
            self._small[number] = small
            self._small_size += sum(values.nbytes for values in small.values())
        while self._small_size > _MOST_OPEN:
            _, small = self._small.popitem(last=False)
            self._small_size -= sum(values.nbytes for values in small.values())

    def small_values(self, number: int, name: str) -> NDArray[Any] | None:
        """Return all values of a variable of a shard, if they were kept when it was closed."""
        return self._small.get(number, {}).get(name)

    def close(self) -> None:
        """Close all shards."""
        while self._open:
            self._open.popitem()[1][0].close()


class Joined(Stored):
    """A variable of an index whose values are in its shards, one after another.

    Parameters
    ----------
    like : Stored
        The variable of a shard that has records.
    shards : OpenShards
        The shards of the index.
    """

    def __init__(self, like: Stored, shards: OpenShards) -> None:
        vars(self).update(vars(like))
        self._axis, self._shards = like.along_records or 0, shards
        self._ends = shards.ends(self.dims[self._axis])
        self.chunks = shards.chunks(self.dims[self._axis])
        self._shard_bytes = like.bytes
        self.shape = tuple(
            int(self._ends[-1]) if axis == self._axis else size
            for axis, size in enumerate(like.shape)
        )

    @property
    def is_read(self) -> bool:
        """False: values are read on demand."""
        return False

    @property
    def is_checked(self) -> bool:
        """False: each shard is checked when it is opened."""
        return False

    @property
    def bytes(self) -> int:
        """Number of bytes of all shards, at most."""
        return self._shard_bytes * len(self._ends)

    def read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        """Read the values at an index of each dimension; only the shards that have them."""
        before, wanted, after = key[: self._axis], key[self._axis], key[self._axis + 1 :]
        pieces = [*_pieces(wanted, self._ends)]
        parts = [
            self._of_shard(number, (*before, inside, *after), len(pieces))
            for number, inside in pieces
        ]
        if not parts:
            parts = [self._of_shard(self._shards.first, (*before, slice(0, 0), *after))]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=_dimensions(before))

    def _of_shard(self, number: int, key: tuple[Any, ...], together: int = 1) -> NDArray[Any]:
        with self._shards.lock:
            wanted, small = key[self._axis], self._shards.small_values(number, self.declared.name)
            if small is not None:
                return np.asarray(small[key])
            stored = self._shards.variables(number, together)[self.declared.name]
            if not isinstance(wanted, np.ndarray) or wanted.size < 2:
                return stored.read(key)
            # netCDF reads scattered places one by one, so all places between them are read
            between = slice(int(wanted.min()), int(wanted.max()) + 1)
            values = stored.read((*key[: self._axis], between, *key[self._axis + 1 :]))
        return values.take(wanted - between.start, axis=_dimensions(key[: self._axis]))


def _dimensions(key: Sequence[Any]) -> int:
    """Return the number of dimensions that remain of those that have these indexes."""
    return sum(not isinstance(index, int | np.integer) for index in key)


def _pieces(wanted: Any, ends: NDArray[np.int64]) -> Iterator[tuple[int, Any]]:
    """Yield the number of each shard with some of the wanted places, and the places inside it.

    Examples
    --------
    >>> list(_pieces(slice(1, 4), np.array([2, 5])))
    [(0, slice(1, 2, 1)), (1, slice(0, 2, 1))]
    >>> list(_pieces(-1, np.array([2, 5])))
    [(1, 2)]
    """
    total = int(ends[-1])
    starts = np.concatenate([[0], ends[:-1]])
    if isinstance(wanted, slice) and wanted.indices(total)[2] == 1:
        first, last, _ = wanted.indices(total)
        for number, (start, end) in enumerate(zip(starts.tolist(), ends.tolist(), strict=True)):
            low, high = max(first, start), min(last, end)
            if low < high:
                yield number, slice(low - start, high - start, 1)
        return
    places = np.arange(total)[wanted]
    owners = np.searchsorted(ends, places, side="right")
    if places.ndim == 0:
        yield int(owners), int(places - starts[owners])
        return
    for piece in np.split(np.arange(len(places)), np.flatnonzero(np.diff(owners)) + 1):
        if piece.size:
            number = int(owners[piece[0]])
            yield number, places[piece] - starts[number]


@contextmanager
def opened_file(
    path: Path, kind: str, *, empty: bool = False, held: Holder = alone
) -> Iterator[tuple[Mapping[str, Any], list[Stored]]]:
    """Open a file as `opened_one` does, or an index, whose shards are opened when they are needed.

    The parameters and errors are those of `opened_one`.
    """
    with ExitStack() as stack:
        attrs, stored = stack.enter_context(opened_one(path, kind, empty=empty, held=held))
        require_all_records(path, kind, attrs)
        if SHARDS in attrs:
            shards = OpenShards(path, kind, attrs, held)
            if not _are_of(shards, stored, kind):
                raise not_of(path, kind, "names shards of other records than its own.")
            stack.callback(shards.close)
            stored = _with_shards(stored, shards, kind)
        yield attrs, stored


def _are_of(shards: OpenShards, stored: Sequence[Stored], kind: str) -> bool:
    """Return True if shards have as many records, and samples of records, as their index states."""
    own = {variable.declared.name: variable for variable in stored}
    ends = [int(shards.ends(dimension)[-1]) for dimension in ("record", "obs")]
    records = own["record_id"].shape[0] if "record_id" in own else 0
    of_records = kind == RECORDS and "row_size" in own
    return ends == [records, own["row_size"].values.sum() if of_records else ends[1]]


def _with_shards(stored: Sequence[Stored], shards: OpenShards, kind: str) -> list[Stored]:
    """Return the variables of an index and of its shards, in the order of the kind."""
    own = {variable.declared.name: variable for variable in stored}
    for variable in stored:
        if "record" in variable.dims:
            variable.chunks = shards.chunks("record")
    further = shards.variables(shards.first)
    joined = {
        name: Joined(v, shards)
        for name, v in further.items()
        if name not in own and v.declared.of_files != "one batch"
    }
    return [
        own.get(declared.name) or joined[declared.name]
        for declared in KINDS[kind].variables
        if declared.name in own or declared.name in joined
    ]


@contextmanager
def opened_arrays(path: Path, kind: str, *, empty: bool = False) -> Iterator[Arrays]:
    """Open a file or an index as `rockframe.results.reading.opened` does, without xarray.

    The parameters and errors are those of `opened_file`.
    """
    with opened_file(path, kind, empty=empty) as (attrs, stored):
        yield Arrays(
            {
                variable.declared.name: Array(
                    variable.dims, variable.shape, partial(_read, variable), variable.attrs
                )
                for variable in stored
            },
            attrs,
        )


def read_whole(stored: Stored) -> bool:
    """Return True for a small variable: netCDF takes 0.2 ms for each part, so all is read once."""
    small = "obs" not in stored.dims and stored.bytes <= _SMALL and not isinstance(stored, Joined)
    return stored.is_read or small


def _read(stored: Stored, key: tuple[Index, ...]) -> Any:
    # netCDF reads scattered values slowly
    scattered = any(isinstance(index, Sequence) for index in key) and not isinstance(stored, Joined)
    return stored.values[key] if scattered or read_whole(stored) else stored.read(key)
