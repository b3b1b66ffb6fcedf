"""Open files of stages as datasets of xarray."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final
from weakref import finalize

import netCDF4
import numpy as np
import xarray as xr
from xarray.core import indexing

from rockframe.results.shards import opened_file, read_whole
from rockframe.results.stored import Stored, kind_of, unlocked

#: Parts of xarray that read on demand; its documentation names most of them.
_INTERNALS: Final = (
    *("IndexingSupport", "LazilyIndexedArray", "MemoryCachedArray"),
    "explicit_indexing_adapter",
)


@contextmanager
def opened(path: Path, kind: str, *, empty: bool = False) -> Iterator[xr.Dataset]:
    """Open a dataset of one kind, and close it at the end of the block.

    The dataset has exactly the variables that are declared for the kind, with their declared units
    and attributes. Series along ``obs`` are read on demand. The parameters and errors are those of
    `opened_file`.
    """
    with opened_file(path, kind, empty=empty, held=_shared) as (attrs, stored):
        yield _dataset(stored, attrs, (path.absolute(), kind))


@contextmanager
def _shared(path: Path) -> Iterator[tuple[netCDF4.Dataset, Any]]:
    """Open a file beside others that the caller reads by xarray."""
    store = unlocked(path, "r", partial(xr.backends.NetCDF4DataStore.open, str(path)))
    try:
        yield store.ds, store.lock
    finally:
        store.close()


class RockframeBackend(xr.backends.BackendEntrypoint):
    """The engine ``rockframe`` of `xarray.open_dataset`, for the output of any stage.

    Variables have the declared units and attributes, and `record` and `structure` are indexes.
    Series along ``obs`` are read on demand.
    """

    description = "Open the output of a stage of rockframe, checked against its declaration"
    open_dataset_parameters = ("filename_or_obj", "drop_variables")

    def open_dataset(  # type: ignore[override]  # the options of other engines do not apply
        self, filename_or_obj: str | Path, *, drop_variables: str | Iterable[str] | None = None
    ) -> xr.Dataset:
        """Open a file; the dataset closes it.

        Raises
        ------
        InputError
            If the file is missing or corrupted, or not the output of a stage.
        """
        path = Path(filename_or_obj)
        with ExitStack() as stack:
            dataset = indexed(stack.enter_context(opened(path, kind_of(path))))
            dropped = [drop_variables] if isinstance(drop_variables, str) else drop_variables or ()
            dataset = dataset.drop_vars(dropped)
            dataset.set_close(stack.pop_all().close)
        return dataset


def indexed(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset in which `record` is an index, as names of other dimensions are.

    Examples
    --------
    >>> peaks = xr.Dataset({"record_id": ("record", ["a", "b"]), "peak_u": ("record", [0.1, 0.2])})
    >>> float(indexed(peaks)["peak_u"].sel(record="b"))
    0.2
    """
    if "record_id" not in dataset or "record" not in dataset["record_id"].dims:
        return dataset
    names = dataset["record_id"].values.astype(str)
    return dataset.assign_coords(record=("record", names, dataset["record_id"].attrs))


class _Lazy(xr.backends.BackendArray):
    """A variable of an open file, read on demand."""

    def __init__(
        self, stored: Stored, file: tuple[Path, str], holder: _OpenFile | None = None
    ) -> None:
        self._stored, self.shape, self.dtype, self._file = stored, stored.shape, stored.dtype, file
        self._holder = holder  # the file is open as long as this object

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how another process, such as a worker of Dask, opens the variable."""
        return _reopened, (*self._file, self._stored.declared.name)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Read values; xarray calls this. A small variable is read once, whatever part is needed,
        because netCDF takes 0.2 ms for each part.
        """
        stored = self._stored
        if read_whole(stored):
            support, read = indexing.IndexingSupport.BASIC, self._part
        else:
            support, read = indexing.IndexingSupport.OUTER, stored.read
        return indexing.explicit_indexing_adapter(key, self.shape, support, read)

    def _part(self, key: tuple[int | slice, ...]) -> Any:
        return np.array(self._stored.values[key], dtype=self.dtype)


class _OpenFile:
    """The variables of a file, which is closed with this object, or by ``close``."""

    def __init__(self, path: Path, kind: str) -> None:
        stack = ExitStack()
        _, stored = stack.enter_context(opened_file(path, kind, held=_shared))
        self.variables = {variable.declared.name: variable for variable in stored}
        self.close = finalize(self, stack.close)


@lru_cache(maxsize=8)
def _open_in_worker(path: Path, kind: str, _changed: int) -> _OpenFile:
    """Return a file that a worker of Dask holds open for its next tasks, until it changes."""
    return _OpenFile(path, kind)


def _reopened(path: Path, kind: str, name: str) -> _Lazy:
    """Return a variable of a file that another process opened."""
    holder = _open_in_worker(path, kind, path.stat().st_mtime_ns)
    return _Lazy(holder.variables[name], (path, kind), holder)


def on_demand(
    path: Path, kind: str, names: Iterable[str]
) -> tuple[dict[str, xr.Variable], Callable[[], Any]]:
    """Return variables of a file, of which each part is read when it is needed, and not kept.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Its kind.
    names : iterable of str
        The variables.

    Returns
    -------
    dict of str to Variable, callable
        The variables, and what closes the file; it is also closed when none of them remains.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    path = path.absolute()
    holder = _OpenFile(path, kind)
    variables = {}
    for name in names:
        stored = holder.variables[name]
        data: Any = stored.values if not _has_internals() else _lazy(stored, (path, kind), holder)
        variables[name] = xr.Variable(stored.dims, data, stored.attrs, fastpath=True)
    return variables, holder.close


def _has_internals() -> bool:
    """Return False if this xarray has no arrays that are read on demand."""
    return all(hasattr(indexing, name) for name in _INTERNALS)


def _lazy(stored: Stored, file: tuple[Path, str], holder: _OpenFile | None = None) -> Any:
    return indexing.LazilyIndexedArray(_Lazy(stored, file, holder))


def _variable(stored: Stored, file: tuple[Path, str]) -> xr.Variable:
    """Return a variable; values that were checked are read already, unless they are many."""
    data: Any = stored.values if stored.is_read else _lazily(stored, file)
    encoding = {"preferred_chunks": stored.chunks} if stored.chunks else None
    return xr.Variable(stored.dims, data, stored.attrs, encoding, fastpath=True)


def _lazily(stored: Stored, file: tuple[Path, str]) -> Any:
    """Return an array that is read on demand, or the values if this xarray has no such arrays."""
    if not _has_internals():
        return stored.values
    return indexing.MemoryCachedArray(_lazy(stored, file))  # type: ignore[no-untyped-call]


def _dataset(
    stored: Sequence[Stored], attrs: Mapping[str, Any], file: tuple[Path, str]
) -> xr.Dataset:
    """Return the dataset of variables, made without the general and slow decoding of xarray."""
    variables = {variable.declared.name: _variable(variable, file) for variable in stored}
    beside = {variable.declared.attrs.get("coordinates", "") for variable in stored}
    coords = [
        name for name, variable in variables.items() if name in beside or variable.dims == (name,)
    ]
    return xr.Dataset(
        {name: variable for name, variable in variables.items() if name not in coords},
        {name: variables[name] for name in coords},
        attrs,
    )
