"""Files that grow along ``obs`` while they are written."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.results.files import CHUNK, COMPRESSED, as_os_error


@contextmanager
def growing(
    partial: Path, series: Mapping[str, xr.Variable], mode: Literal["w", "a"] = "w"
) -> Iterator[Callable[[Mapping[str, NDArray[np.float64]]], None]]:
    """Give a function that appends to variables along ``obs``; memory does not grow with them.

    Parameters
    ----------
    partial : Path
        A file of `named`, that this begins (in mode ``a``, goes on with); `put` adds the rest.
    series : mapping of str to Variable
        What they are like: of double precision, ``obs`` their last dimension.
    """
    file = netCDF4.Dataset(partial, mode, format="NETCDF4")
    try:
        file.createDimension("obs", None)
        for name, like in series.items():
            _begin(file, name, like)
        end = 0

        def append(samples: Mapping[str, NDArray[np.float64]]) -> None:
            nonlocal end
            start, end = end, end + next(iter(samples.values())).shape[-1]
            with as_os_error():
                for name, values in samples.items():
                    file[name][..., start:end] = values

        yield append
    finally:
        with as_os_error():
            file.close()


def _begin(file: netCDF4.Dataset, name: str, like: xr.Variable) -> None:
    for dimension, size in zip(_dims(like), like.shape, strict=True):
        if dimension not in file.dimensions:
            file.createDimension(dimension, size)
    rows = math.prod(size for dimension, size in like.sizes.items() if dimension != "obs")
    created = file.createVariable(
        name,
        np.float64,
        _dims(like),
        chunksizes=(1,) * (like.ndim - 1) + (CHUNK,),
        fill_value=np.nan,
        chunk_cache=4 * 8 * CHUNK * rows,  # of four chunks; the default may be of 64 MB
        **COMPRESSED,
    )
    created.setncatts(like.attrs)


def _dims(like: xr.Variable) -> tuple[str, ...]:
    return tuple(str(dimension) for dimension in like.dims)
