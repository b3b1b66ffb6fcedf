"""Reading and writing whole files: compressed, checksummed, byte-identical for the same inputs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import netCDF4
import numpy as np
import xarray as xr

from rockframe.errors import InputError
from rockframe.provenance import sha256_of, source_code_hash, versions, whole_file
from rockframe.units import GRAVITY

RECORDS: Final = "records"
PULSES: Final = "pulses"
RESPONSE: Final = "response"
SCREEN: Final = "screen"
SPECTRUM: Final = "spectrum"
ROCKING_SPECTRUM: Final = "rocking_spectrum"
_STAGE_OF: Final = {
    **{RECORDS: "ingest", PULSES: "pulse", RESPONSE: "respond", SCREEN: "screen"},
    **dict.fromkeys((SPECTRUM, ROCKING_SPECTRUM), "spectrum"),
}
#: What opening a damaged file raises; netCDF4 says of an attribute that it cannot read that there
#: is none.
_UNREADABLE: Final = (OSError, ValueError, AttributeError)
#: Samples in one compressed block.
CHUNK: Final = 16384
#: How each variable is stored: a bit that flips is found.
COMPRESSED: Final[dict[str, Any]] = {
    "zlib": True,
    "complevel": 4,
    "shuffle": True,
    "fletcher32": True,
}


def write(
    dataset: xr.Dataset,
    path: Path,
    kind: str,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str] | None = None,
) -> None:
    """Write a dataset whole or not at all; the same inputs give the same bytes.

    Parameters
    ----------
    dataset : xarray.Dataset
        What one of the functions above returned.
    path : Path
        Where it goes; an older file there is replaced.
    kind : str
        One of the names above.
    input_sha256 : mapping
        Name and SHA-256 of each input.
    parameters : mapping
        The options of the stage; JSON values.
    left_out : mapping of str to str, optional
        Why records that went in did not come out, by identifier.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with named(path) as partial:
        put(
            dataset,
            partial,
            kind,
            input_sha256=input_sha256,
            parameters=parameters,
            left_out=left_out,
        )


@contextmanager
def named(path: Path) -> Iterator[Path]:
    """Give a temporary path, put in the place of `path` if the block succeeds.

    Raises
    ------
    InputError
        If the name does not end in ``.nc``, or the file cannot be written.
    """
    require_ending(path)
    with whole_file(path) as partial:
        yield partial


def require_ending(path: Path) -> None:
    """Refuse the path of a netCDF file that does not end as one.

    Raises
    ------
    InputError
        If the name does not end in ``.nc``.

    Examples
    --------
    >>> require_ending(Path("records.nc"))
    """
    if path.suffix != ".nc":
        raise InputError(path, f"ends in {path.suffix!r}. Must end in .nc.")


def is_netcdf(path: Path) -> bool:
    """Whether a file begins as netCDF 4 does; not if there is none.

    Examples
    --------
    >>> is_netcdf(Path("motion.csv"))
    False
    """
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(4) == b"\x89HDF"


def put(
    dataset: xr.Dataset,
    partial: Path,
    kind: str,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str] | None = None,
    mode: Literal["w", "a"] = "w",
) -> None:
    """Write a dataset and its origin into a file of `named`; mode ``a``: beside what it holds."""
    stage = _STAGE_OF[kind]
    version = versions()["rockframe"]
    described = dataset.assign_attrs(
        Conventions="CF-1.11",
        history=f"rockframe {stage} (rockframe {version})",
        rockframe_kind=kind,
        rockframe_version=version,
        source_code_hash=source_code_hash(),
        input_sha256=json.dumps(dict(input_sha256), sort_keys=True),
        parameters=json.dumps(dict(parameters), sort_keys=True),
        left_out=json.dumps(dict(left_out or {}), sort_keys=True),
        gravity=GRAVITY,
    )
    encoding = {name: _encoding(variable) for name, variable in described.variables.items()}
    with as_os_error():
        described.to_netcdf(
            partial, mode=mode, engine="netcdf4", format="NETCDF4", encoding=encoding
        )


@contextmanager
def as_os_error() -> Iterator[None]:
    """Let a full disk be an OSError, as it is elsewhere: netCDF raises a RuntimeError."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(str(error)) from error


def _encoding(variable: xr.Variable) -> dict[str, Any]:
    encoding: dict[str, Any] = {
        **COMPRESSED,
        "_FillValue": np.nan if variable.dtype.kind == "f" else None,
    }
    if variable.dtype.kind == "O":  # characters, not netCDF strings: those have no checksum
        encoding["dtype"] = "S1"
    elif "obs" in variable.dims:
        sizes = [min(n, CHUNK) if d == "obs" else 1 for d, n in variable.sizes.items()]
        encoding["chunksizes"] = tuple(sizes)
    return encoding


@contextmanager
def opened(path: Path, kind: str) -> Iterator[xr.Dataset]:
    """Open a dataset of one kind, and close it at the end of the block.

    Raises
    ------
    InputError
        If the file is missing, damaged, or not the output of the stage that writes this kind.
    """
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(path, f"{what}. Must be a {kind} file.")
    must_be = f"Must be the output of `rockframe {_STAGE_OF[kind]}`."
    # The default of 64 MB a variable would fill with samples that are read once.
    netCDF4.set_chunk_cache(4 * 8 * CHUNK)
    try:
        dataset = xr.open_dataset(path, engine="netcdf4")
    except _UNREADABLE as error:
        raise InputError(path, f"cannot be read as netCDF ({error}). {must_be}") from error
    with dataset:
        found = dataset.attrs.get("rockframe_kind", "unknown")
        if found != kind:
            raise InputError(path, f"is a netCDF file of kind {found!r}. {must_be}")
        with damage_named(path, kind):
            _require_whole_rows(path, dataset)
            yield dataset


def kind_of(path: Path) -> str:
    """Return the kind of a file, by what it says of itself.

    Raises
    ------
    InputError
        If the file is missing, damaged, or of no kind.
    """
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            kind = str(dataset.attrs.get("rockframe_kind", "unknown"))
    except _UNREADABLE as error:
        raise InputError(path, f"cannot be read as netCDF ({error}).") from error
    if kind not in _STAGE_OF:
        raise InputError(path, f"is of kind {kind!r}. Must be one of: {', '.join(_STAGE_OF)}.")
    return kind


@contextmanager
def damage_named(path: Path, kind: str) -> Iterator[None]:
    """Say of what netCDF finds damaged in the block, in which file it is.

    Raises
    ------
    InputError
        If something is.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:
        must_be = f"Must be the output of `rockframe {_STAGE_OF[kind]}`."
        raise InputError(path, f"is damaged ({error}). {must_be}") from error


def _require_whole_rows(path: Path, dataset: xr.Dataset) -> None:
    """Refuse a subset of the records with the samples of all: rows would be cut at wrong places."""
    # A batch in which no record came through has none.
    ids = [str(name) for name in dataset["record_id"].values] if "record_id" in dataset else []
    if len(set(ids)) < len(ids):
        twice = next(name for name in ids if ids.count(name) > 1)
        raise InputError(path, f"record_id {twice!r} occurs twice. Must be unique.")
    if "row_size" in dataset and "obs" in dataset.sizes:
        stated, present = int(dataset["row_size"].sum()), dataset.sizes["obs"]
        if stated != present:
            raise InputError(
                path, f"{stated} samples in row_size, {present} along obs. Must be equal."
            )


def input_hash(*paths: Path) -> dict[str, str]:
    """Return names and SHA-256 of inputs, as `write` wants them."""
    return {path.name: sha256_of(path) for path in paths}


@dataclass(frozen=True)
class Described:
    """What a file of one of the stages holds.

    Parameters
    ----------
    records : tuple of str
        Identifiers of its records.
    inputs : mapping of str to str
        Name and SHA-256 of what it was made from.
    structures : int
        Number of its structures.
    left_out : tuple of str
        Identifiers of the records that the stage left out, with a reason.
    """

    records: tuple[str, ...]
    inputs: Mapping[str, str]
    structures: int = 0
    left_out: tuple[str, ...] = ()


def describe(path: Path, kind: str) -> Described:
    """Read every value of a file, and return what it holds.

    Raises
    ------
    InputError
        If the file is missing, something else, or damaged: each block has a checksum.
    """
    with opened(path, kind) as dataset:
        for name in dataset.variables:  # one after the other: the samples need not fit in memory
            dataset[name].copy(deep=False).to_numpy()  # a dataset keeps what was read of it
        names = dataset["record_id"].values if "record_id" in dataset else ()
        return Described(
            tuple(str(name) for name in names),
            json.loads(dataset.attrs["input_sha256"]),
            dataset.sizes.get("structure", 0),
            tuple(json.loads(dataset.attrs["left_out"])),
        )
