"""The folder of a run, read back for people: its tables, its facts in words, its histories."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.errors import InputError
from rockframe.provenance import MANIFEST, sha256_of
from rockframe.results.files import PULSES, RECORDS, RESPONSE, opened
from rockframe.results.manifest import read_manifest
from rockframe.results.motions import Pair

#: Columns of ``table.csv`` without which it says nothing of a record and a structure.
_NEEDED: Final = (
    *("record_id", "event", "record", "structure", "verdict"),
    *("peak_rotation_ratio", "overturning_time_s"),
)


@dataclass(frozen=True)
class Fact:
    """A number or text of a dataset, with the words that the dataset has for it.

    Parameters
    ----------
    name : str
        Name of the variable.
    label : str
        Its long name.
    value : float or str
        A flag is the word that it means; what is not known is NaN or empty.
    units : str
        Unit as CF writes it; ``1`` for a ratio, a count or a text.
    """

    name: str
    label: str
    value: float | str
    units: str


Facts = tuple[Fact, ...]


@dataclass(frozen=True)
class Run:
    """What a run holds, but for its histories.

    Parameters
    ----------
    folder : Path
        Where it is.
    manifest : mapping
        Content of ``manifest.json``.
    manifest_sha256 : str
        Hash of that file: it stands for the run.
    table : str
        Text of ``table.csv``.
    rows : tuple of mapping of str to str
        Its rows: a record and a structure each.
    entries : tuple of mapping of str to str
        Rows of ``records.csv``: each record and each file that gave none, with the checks.
    records, structures, pairs : mapping to tuple of Fact
        What is known of each record and its pulse, each structure, and each record with each
        structure.
    """

    folder: Path
    manifest: Mapping[str, Any]
    manifest_sha256: str
    table: str
    rows: tuple[Mapping[str, str], ...]
    entries: tuple[Mapping[str, str], ...]
    records: Mapping[str, Facts]
    structures: Mapping[str, Facts]
    pairs: Mapping[Pair, Facts]

    @property
    def name(self) -> str:
        """What people call it: the study, or else the folder."""
        study = self.manifest["parameters"].get("study", {})
        return str(study.get("name") or self.folder.resolve().name)


def read_run(folder: Path) -> Run:
    """Read what a run holds, but for its histories.

    Parameters
    ----------
    folder : Path
        Output of ``rockframe table1``.

    Raises
    ------
    InputError
        If one of its files is missing, damaged, or something else.

    Examples
    --------
    >>> read_run(Path("no-such-folder"))
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-folder: no such folder. Must be the folder of a run.
    """
    manifest = read_manifest(folder)
    manifest_sha256 = sha256_of(folder / MANIFEST)
    table = _text(folder / "table.csv")
    rows = _rows_of_text(table)
    missing = [name for name in _NEEDED if not rows or name not in rows[0]]
    if missing:
        must_be = "Must be as this version of `rockframe table1` writes it."
        raise InputError(folder / "table.csv", f"without column {missing[0]!r}. {must_be}")
    with opened(folder / "records.nc", RECORDS) as dataset:
        records = _facts_of_each(dataset, "record_id")
    with opened(folder / "pulses.nc", PULSES) as dataset:
        pulses = _facts_of_each(dataset, "record_id")
    with opened(folder / "response.nc", RESPONSE) as dataset:
        structures = _facts_of_each(dataset, "structure")
        pairs = _facts_of_pairs(dataset)
    return Run(
        folder,
        manifest,
        manifest_sha256,
        table,
        rows,
        _rows_of_text(_text(folder / "records.csv")),
        {name: facts + pulses.get(name, ()) for name, facts in records.items()},
        structures,
        pairs,
    )


def _text(path: Path) -> str:
    try:
        return path.read_bytes().decode("utf-8")
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(path, "is not UTF-8. Must be as the run wrote it.") from None


def _rows_of_text(text: str) -> tuple[dict[str, str], ...]:
    return tuple(csv.DictReader(io.StringIO(text, newline="")))


def _names(dataset: xr.Dataset, variable: str) -> list[str]:
    return [str(name) for name in dataset[variable].values]


def _facts_of_each(dataset: xr.Dataset, key: str) -> dict[str, Facts]:
    """Facts of each record or structure: of the variables that have its dimension alone."""
    dims = dataset[key].dims
    chosen = [name for name, v in dataset.variables.items() if v.dims == dims and name != key]
    columns = [(str(name), dataset[name], _words(dataset[name])) for name in chosen]
    return {
        owner: tuple(_fact(name, array, values[i]) for name, array, values in columns)
        for i, owner in enumerate(_names(dataset, key))
    }


def _facts_of_pairs(dataset: xr.Dataset) -> dict[Pair, Facts]:
    chosen = [n for n, v in dataset.variables.items() if v.dims == ("record", "structure")]
    columns = [(str(name), dataset[name], _words(dataset[name])) for name in chosen]
    return {
        (record, structure): tuple(_fact(name, array, v[i][k]) for name, array, v in columns)
        for i, record in enumerate(_names(dataset, "record_id"))
        for k, structure in enumerate(_names(dataset, "structure"))
    }


def _words(array: xr.DataArray) -> list[Any]:
    """Values of a variable; of a flag what they mean."""
    values = array.values
    if "flag_meanings" not in array.attrs:
        return list(values.tolist())
    masks = "flag_masks" in array.attrs
    numbers = np.atleast_1d(array.attrs["flag_masks" if masks else "flag_values"]).tolist()
    words = [word.replace("_", " ") for word in array.attrs["flag_meanings"].split()]
    pairs = list(zip(numbers, words, strict=True))

    def meaning(number: int) -> str:
        return ", ".join(word for n, word in pairs if (number & n if masks else number == n))

    return list(np.vectorize(meaning, otypes=[object])(values))


def _fact(name: str, array: xr.DataArray, value: object) -> Fact:
    value = float(value) if isinstance(value, int | float) else str(value)
    return Fact(name, str(array.attrs["long_name"]), value, str(array.attrs["units"]))
