"""The files of several batches of records put together into one."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import xarray as xr

from rockframe.errors import InputError
from rockframe.results.reading import opened
from rockframe.results.writing import WITHOUT_RECORDS, growing, named, put

#: What the files of the batches of one stage have in common.
_COMMON: Final = ("rockframe_kind", "source_code_hash", "input_sha256", "parameters")


def no_records() -> xr.Dataset:
    """Return the dataset of a batch in which no record came through."""
    return xr.Dataset(attrs={"title": WITHOUT_RECORDS})


def merge(parts: Sequence[Path], output: Path, kind: str) -> dict[str, str]:
    """Put the files of all batches of a stage into one file; holds one of them at a time.

    Parameters
    ----------
    parts : sequence of Path
        At least one, in the order of the batches.
    output : Path
        The file to write, as the stage writes it for all records at once.
    kind : str
        Of all of them.

    Returns
    -------
    dict of str to str
        Why records were left out, by identifier.

    Raises
    ------
    InputError
        If a part cannot be read, or was made from other inputs or with other options than the
        first; if one is missing, or not in its place; or there is no record in any.
    """
    known, left_out = _without_series(parts, kind)
    if not known:
        reason = next(iter(left_out.values()), "no record")
        raise InputError(parts[0], f"no batch holds a record: {reason}")
    attrs = known[0].attrs
    series = _series(parts, kind)
    with named(output) as partial:
        if series:
            with growing(partial, series) as append:
                for samples in _samples(parts, kind, series):
                    append(samples)
        put(
            xr.concat(
                known,
                dim="record",
                data_vars="minimal",
                coords="minimal",
                compat="identical",
                join="exact",
                combine_attrs="override",
            ),
            partial,
            kind,
            input_sha256=json.loads(attrs["input_sha256"]),
            parameters=json.loads(attrs["parameters"]),
            left_out=left_out,
            mode="a" if series else "w",
        )
    return left_out


def _without_series(parts: Sequence[Path], kind: str) -> tuple[list[xr.Dataset], dict[str, str]]:
    """All but the variables on ``obs`` of the parts that hold records, and what was left out."""
    known: list[xr.Dataset] = []
    left_out: dict[str, str] = {}
    first: Mapping[str, Any] = {}
    for number, path in enumerate(parts, 1):
        with opened(path, kind, empty=True) as part:
            stated, wanted = part.attrs.pop("batch", "1/1"), f"{number}/{len(parts)}"
            if stated != wanted:
                raise InputError(
                    path, f"is batch {stated}. Must be batch {wanted}, as it is given."
                )
            first = first or part.attrs
            for name in _COMMON:
                if part.attrs[name] != first[name]:
                    raise InputError(path, f"another {name} than {parts[0]}. Must be of one run.")
            left_out |= json.loads(part.attrs["left_out"])
            if "record_id" in part:
                known.append(part.drop_dims("obs", errors="ignore").load().drop_encoding())
    return known, left_out


def _series(parts: Sequence[Path], kind: str) -> dict[str, xr.Variable]:
    """The variables on ``obs``, of no samples."""
    for path in parts:
        with opened(path, kind, empty=True) as part:
            if "record_id" in part:
                empty = part.isel(obs=slice(0, 0), missing_dims="ignore").load()
                series = {str(n): v for n, v in empty.variables.items() if "obs" in v.dims}
                beside = " ".join(sorted(name for name in series if name in empty.coords))
                for name in series:
                    if beside and name not in empty.coords:  # as xarray writes it, after CF
                        series[name] = series[name].copy()
                        series[name].attrs["coordinates"] = beside
                return series
    return {}


def _samples(
    parts: Sequence[Path], kind: str, series: Mapping[str, xr.Variable]
) -> Iterator[dict[str, Any]]:
    for path in parts:
        with opened(path, kind, empty=True) as part:
            if "record_id" in part:
                yield {name: part[name].to_numpy() for name in series}
