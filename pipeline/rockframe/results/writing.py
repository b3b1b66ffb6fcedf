"""Write datasets, at once or row by row."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, Required, TypedDict, Unpack

import netCDF4
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rockframe.errors import InputError
from rockframe.provenance import package_versions, sha256_of, source_code_hash, whole_file
from rockframe.results.schema import KINDS
from rockframe.results.schema.arrays import Array, Arrays
from rockframe.results.schema.declare import FileKind
from rockframe.results.shards import BatchFiles
from rockframe.results.stored import CHUNK, WITHOUT_RECORDS, open_netcdf
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.results.schema.arrays import Dataset

#: The series of a record and its other values, both by variable.
Row = tuple[Mapping[str, NDArray[np.float64]], Mapping[str, Any]]

#: Largest size of values of records that are one compressed block [bytes]; more are in several.
_ONE_BLOCK: Final = 2**20
#: Encoding of each variable, with checksums that detect a flipped bit.
COMPRESSED: Final[dict[str, Any]] = {
    "zlib": True,
    "complevel": 4,
    "shuffle": True,
    "fletcher32": True,
}


class Origin(TypedDict, total=False):
    """The origin of a file: keywords of the functions that write files.

    ``input_sha256`` has the name and SHA-256 of each input, ``parameters`` the options of the stage
    as JSON values, and ``left_out`` the reasons for rejected records, by identifier. ``left_out``
    is read last, so that it can be filled during writing.
    """

    input_sha256: Required[Mapping[str, str]]
    parameters: Required[Mapping[str, Any]]
    left_out: Mapping[str, str] | None


def write(dataset: Dataset, path: Path, kind: str, **origin: Unpack[Origin]) -> None:
    """Write a dataset, complete or not at all; the same inputs give the same bytes.

    Parameters
    ----------
    dataset : Arrays or xarray.Dataset
        The variables to write.
    path : Path
        The file to write; an older file is replaced.
    kind : str
        Kind of the file, one of `KINDS`.
    **origin
        Keywords of `Origin`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with named(path) as partial:
        put(dataset, partial, kind, **origin)


@contextmanager
def named(path: Path) -> Iterator[Path]:
    """Yield a temporary path, which replaces `path` if the block succeeds.

    Raises
    ------
    InputError
        If the name does not end in ``.nc``, or the file cannot be written.
    """
    require_ending(path)
    with whole_file(path) as partial:
        yield partial


def require_ending(path: Path) -> None:
    """Reject the path of a netCDF file that does not end in ``.nc``.

    Raises
    ------
    InputError
        If the name does not end in ``.nc``.
    """
    if path.suffix != ".nc":
        raise InputError(path, f"ends in {path.suffix!r}. Must end in .nc.")


def put(
    dataset: Dataset,
    partial: Path,
    kind: str,
    *,
    mode: Literal["w", "a"] = "w",
    **origin: Unpack[Origin],
) -> None:
    """Write a dataset and its origin into a file of `named`; mode ``a`` adds to the file."""
    stage = KINDS[kind].stage
    version = package_versions()["rockframe"]
    of_all = {
        "Conventions": "CF-1.11",
        "history": f"rockframe {stage} (rockframe {version})",
        "rockframe_kind": kind,
        "rockframe_version": version,
        "source_code_hash": source_code_hash(),
        "input_sha256": json.dumps(dict(origin["input_sha256"]), sort_keys=True),
        "parameters": json.dumps(dict(origin["parameters"]), sort_keys=True),
        "left_out": json.dumps(dict(origin.get("left_out") or {}), sort_keys=True),
        "gravity": GRAVITY,
    }
    stored = {
        str(name): _as_stored(one, KINDS[kind][str(name)].attrs.get("coordinates", ""))
        for name, one in dataset.variables.items()
    }
    with as_os_error(), open_netcdf(partial, mode) as file:
        file.setncatts({**dataset.attrs, **of_all})
        for one in stored.values():
            for dimension, size in one.sizes.items():
                if dimension not in file.dimensions:
                    file.createDimension(str(dimension), size)
        # netCDF writes the structure of the file again for each variable that follows values
        created = [create_variable(file, name, one) for name, one in stored.items()]
        for variable, one in zip(created, stored.values(), strict=True):
            variable[...] = one.values


def _as_stored(variable: Array | xr.Variable, coordinates: str) -> Array:
    """Return a variable as it is stored: with the names of its coordinates, and with texts as
    characters, because netCDF strings have no checksum.
    """
    attrs = {**variable.attrs, **({"coordinates": coordinates} if coordinates else {})}
    dimensions, values = [str(dimension) for dimension in variable.dims], variable.values
    if values.dtype.kind != "O":
        return Array.of(dimensions, values, attrs)
    texts = [str(text).encode() for text in values.ravel()]
    length = max(1, max(map(len, texts), default=1))
    characters = np.array(texts, dtype=f"S{length}").view("S1").reshape(*values.shape, length)
    dimensions.append(f"string{length}")
    return Array.of(dimensions, characters, {**attrs, "_Encoding": "utf-8"})


@contextmanager
def as_os_error() -> Iterator[None]:
    """Raise netCDF's RuntimeError, such as for a full disk, as an OSError."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(str(error)) from error


def input_hash(*paths: Path) -> dict[str, str]:
    """Return names and SHA-256 of inputs, as `Origin` needs them; equal names are numbered."""
    hashes: dict[str, str] = {}
    for path in paths:
        name, number = path.name, 1
        while name in hashes:
            number += 1
            name = f"{path.name} ({number})"
        hashes[name] = sha256_of(path)
    return hashes


class Growing:
    """Variables of an open file that grow along ``obs``."""

    def __init__(self, file: netCDF4.Dataset) -> None:
        self._file = file
        self._end = 0

    def append(self, samples: Mapping[str, NDArray[np.float64]]) -> None:
        """Append samples to the variables, by name."""
        start, self._end = self._end, self._end + next(iter(samples.values())).shape[-1]
        with as_os_error():
            for name, values in samples.items():
                self._file[name][..., start : self._end] = values

    def appended(self, name: str, where: slice) -> NDArray[np.float64]:
        """Return samples that were appended to a variable."""
        with as_os_error():
            return np.asarray(self._file[name][..., where], dtype=np.float64)


@contextmanager
def growing(
    partial: Path, series: Mapping[str, Array], mode: Literal["w", "a"] = "w"
) -> Iterator[Growing]:
    """Yield variables that grow along ``obs`` in a file; memory does not grow with them.

    Parameters
    ----------
    partial : Path
        A file of `named`, which is created (in mode ``a``, extended); `put` adds the rest.
    series : mapping of str to Array
        Templates of the variables, of double precision with ``obs`` as their last dimension.
    """
    file = open_netcdf(partial, mode)
    try:
        file.createDimension("obs", None)
        for name, like in series.items():
            for dimension, size in like.sizes.items():
                if dimension not in file.dimensions:
                    file.createDimension(str(dimension), size)
            rows = math.prod(like.shape[:-1])
            chunk = (*(1,) * (len(like.dims) - 1), CHUNK)
            create_variable(file, name, like, chunk, chunks=4 * rows)
        yield Growing(file)
    finally:
        with as_os_error():
            file.close()


def create_variable(
    file: netCDF4.Dataset,
    name: str,
    like: Array,
    chunk: tuple[int, ...] | None = None,
    *,
    chunks: int | None = None,
) -> netCDF4.Variable[Any]:
    """Create a compressed variable in a file, with the type, dimensions and attributes of another.

    Parameters
    ----------
    file : netCDF4.Dataset
        The open file, which has the dimensions.
    name : str
        Name of the variable.
    like : Array
        The other one.
    chunk : tuple of int, optional
        Size of one compressed block; by default of one row, for series along ``obs``.
    chunks : int, optional
        Number of chunks to keep in memory; by default netCDF may use 64 MB for each variable.
    """
    if chunk is None and "obs" in like.dims:
        chunk = tuple(min(n, CHUNK) if d == "obs" else 1 for d, n in like.sizes.items())
    elif chunk is None and like.values.nbytes > _ONE_BLOCK and like.dims[0] == "record":
        # by default netCDF makes chunks of several MB, and keeps one of each variable in memory
        rows = max(1, 8 * CHUNK * like.shape[0] // like.values.nbytes)
        chunk = min(rows, like.shape[0]), *like.shape[1:]
    created = file.createVariable(
        name,
        like.values.dtype,
        [str(dimension) for dimension in like.dims],
        chunksizes=chunk,
        fill_value=np.nan if like.values.dtype.kind == "f" else None,
        chunk_cache=None if chunks is None else chunks * 8 * math.prod(chunk or ()),
        **COMPRESSED,
    )
    created.set_auto_maskandscale(False)
    created.set_auto_chartostring(False)
    created.setncatts(like.attrs)
    return created


def write_rows(
    kind: FileKind,
    rows: Iterable[Row],
    path: Path,
    complete: Callable[[dict[str, list[Any]]], Mapping[str, Any]],
    *,
    further: Callable[[Mapping[str, list[Any]], Growing], Mapping[str, Any]] | None = None,
    batch: str = "",
    attrs: Mapping[str, str] | None = None,
    **origin: Unpack[Origin],
) -> Arrays:
    """Write a file, complete or not at all; the series of one record are in memory at a time.

    Returns what was written, without the series, so that nobody has to read it again.

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
        Called with the values of all records and with the series that were written; returns the
        values of more variables.
    batch : str
        The batch of the records, ``2/3``; empty for all records.
    attrs : mapping of str to str, optional
        Further global attributes; it is read last, so that it can be filled during writing.
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
        dataset = Arrays({}, {"title": WITHOUT_RECORDS})
        for series, _ in first:
            empty = {name: kind[name].holding(s[..., :0]) for name, s in series.items()}
            with growing(partial, empty) as written:
                for samples, values in chain(first, source):
                    written.append(samples)
                    for name, value in values.items():
                        columns[name].append(value)
                more = {} if further is None else further(columns, written)
            dataset = kind.holding({**complete(columns), **more})
        if batch:
            dataset = dataset.with_attrs(batch=batch, **(attrs or {}))
        put(dataset, partial, kind.name, mode="a" if columns else "w", **origin)
    left_out = json.dumps(dict(origin.get("left_out") or {}), sort_keys=True)
    parameters = json.dumps(dict(origin["parameters"]))
    return dataset.with_attrs(rockframe_kind=kind.name, left_out=left_out, parameters=parameters)


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


def write_index(
    parts: Sequence[Path], output: Path, kind: str, own: Mapping[str, Array] | None = None
) -> Mapping[str, str]:
    """Write the index of all batches of a stage, whose files stay where they are.

    It has the names of the records and what all batches share; that of records all but the samples.

    Parameters
    ----------
    parts : sequence of Path
        Files of the batches, in order; at least one.
    output : Path
        The file to write. It names the shards by their paths from its folder.
    kind : str
        Kind of the files.
    own : mapping of str to Array, optional
        Further variables of the index itself, in place of those of the shards.

    Returns
    -------
    mapping of str to str
        Reasons why records were rejected, by identifier.

    Raises
    ------
    InputError
        As `BatchFiles.of`, or if the index cannot be written.
    """
    batches = BatchFiles.of(parts, output, kind)
    attrs, left_out = batches.index.attrs, batches.left_out
    inputs, parameters = (json.loads(attrs[name]) for name in ("input_sha256", "parameters"))
    with named(output) as partial:
        put(
            batches.index.with_variables({**batches.index.variables, **(own or {})}),
            *(partial, kind),
            input_sha256=inputs,
            parameters=parameters,
            left_out=left_out,
        )
    return left_out
