"""Read the global attributes of files of stages, without xarray, which takes long to import."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import netCDF4

from rockframe.errors import InputError
from rockframe.results.schema import KINDS

#: Errors from opening a corrupted file; netCDF4 reports an unreadable attribute as missing.
UNREADABLE: Final = (OSError, ValueError, AttributeError, RuntimeError)
#: First bytes of netCDF files; for other files the library raises several kinds of errors.
_MAGIC: Final = (b"\x89HDF", b"CDF")
#: Global attributes that contain JSON, and the required type.
_JSON: Final = {"input_sha256": dict, "parameters": dict, "left_out": dict, "filtered": list}
#: Global attributes that every file of this package has.
_NEEDED: Final = ("input_sha256", "parameters", "left_out", "source_code_hash")


def require_file(path: Path, wanted: str) -> None:
    """Raise an error if there is no such file."""
    if not path.is_file():
        what = "a folder" if path.is_dir() else "no such file"
        raise InputError(path, f"{what}. Must be {wanted}.")


def require_netcdf(path: Path, instead: str) -> None:
    """Raise an error, with what to do instead, if a file is not a netCDF file."""
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
    require_file(path, "the output of a stage")
    try:
        require_netcdf(path, "Must be the output of a stage, such as `rockframe ingest`.")
        with netCDF4.Dataset(path) as file:
            kind = str(getattr(file, "rockframe_kind", "unknown"))
    except UNREADABLE as error:
        raise InputError(path, f"cannot be read as netCDF ({error}).") from error
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
        with netCDF4.Dataset(path) as file:
            attrs = {name: file.getncattr(name) for name in file.ncattrs()}
    except UNREADABLE as error:
        raise not_of(path, kind, f"cannot be read as netCDF ({error}).") from error
    require_attributes(path, kind, attrs)
    return attrs


def not_of(path: Path, kind: str, what: str) -> InputError:
    """Return the error of a file that is not a whole file of a kind."""
    return InputError(path, f"{what} Must be the output of `rockframe {KINDS[kind].stage}`.")


def require_attributes(path: Path, kind: str, attrs: Mapping[str, Any]) -> None:
    """Raise an error if the global attributes are not those of a file of a kind."""
    found = str(attrs.get("rockframe_kind", "unknown"))
    if found != kind:
        raise not_of(path, kind, f"is a netCDF file of kind {found!r}.")
    for name in (*_NEEDED, *_JSON):
        if name not in attrs and name not in _NEEDED:
            continue
        try:
            value = json.loads(attrs[name]) if name in _JSON else attrs[name]
        except (KeyError, TypeError, ValueError, RecursionError):
            value = None
        if not isinstance(value, _JSON.get(name, str)):
            raise not_of(path, kind, f"without a global attribute {name!r} that can be read.")
