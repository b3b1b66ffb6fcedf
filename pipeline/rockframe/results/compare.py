"""compare.nc: histories and peaks of rocking bridges and of alternative systems."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np
import xarray as xr

from rockframe.cells import Column
from rockframe.frame import RockingFrame
from rockframe.oscillators.comparison import Compared
from rockframe.results.reading import opened, positions
from rockframe.results.schema import COMPARE
from rockframe.results.schema.response import COMPARE_NC
from rockframe.results.tables.rows import Row, columns_of, rows_along
from rockframe.results.writing import Origin, slices, write_rows

_HISTORIES: Final = ("u", "v", "base_shear")
_COLUMNS: Final = columns_of(
    "record_id structure model u_max_m=peak_u v_max_m=peak_v residual_u_m=residual_u",
    "peak_rotation_ratio ductility base_shear=peak_base_shear tendon_n=peak_tendon_force",
    "friction_demand validity valid_until_s=valid_until gap_closed_time_s=gap_closed_time",
    "closing_velocity_m_s=closing_velocity",
)


def write_comparison(
    answers: Iterable[tuple[str, Sequence[Sequence[Compared]]]],
    frames: Sequence[RockingFrame],
    path: Path,
    **origin: Unpack[Origin],
) -> None:
    """Write the output of the compare stage, complete or not at all; one record is in memory at a
    time.

    Parameters
    ----------
    answers : iterable of (str, sequence of sequence of Compared)
        For each record, its identifier and the variants of each structure.
    frames : sequence of RockingFrame
        The structures, in their order.
    path : Path
        The file to write; an older file is replaced.
    **origin
        Keywords of `Origin`.

    Raises
    ------
    InputError
        If the file cannot be written.
    """

    def row(answer: tuple[str, Sequence[Sequence[Compared]]]) -> Any:
        name, found = answer
        time = found[0][0].time
        series = {
            key: np.array([[getattr(one, key) for one in variants] for variants in found])
            for key in _HISTORIES
        }
        peaks = COMPARE_NC.filled("compared", [one for variants in found for one in variants])
        shape = len(found), len(found[0])
        values = {key: np.reshape(column, shape) for key, column in peaks.items()}
        models = [one.model for one in found[0]]
        return {"time": time, **series}, {
            "record_id": name, "row_size": time.size, "model": models, **values
        }  # fmt: skip

    write_rows(COMPARE_NC, map(row, answers), path, partial(_complete, frames=frames), **origin)


def _complete(columns: Mapping[str, list[Any]], frames: Sequence[RockingFrame]) -> dict[str, Any]:
    names = [frame.name for frame in frames]
    return {**columns, "model": columns["model"][0], "structure": names}


def comparison_rows(path: Path) -> list[Row]:
    """Return a row for each record, structure and model; units in the names of columns.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened(path, COMPARE) as dataset:
        return list(rows_along(dataset, "record structure model", _COLUMNS))


def read_histories(path: Path, record: str, structure: str) -> xr.Dataset:
    """Return the histories and peaks of all models of one structure under one record.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    ParameterError
        If there is no such record or structure.
    """
    with opened(path, COMPARE) as dataset:
        where = positions(dataset, record=record, structure=structure)
        obs = slices(dataset["row_size"].values)[where["record"]]
        chosen: xr.Dataset = dataset.isel({**where, "obs": obs}).load()
        return chosen


def furthest_pairs(path: Path, most: int) -> list[tuple[str, str]]:
    """Return all pairs of record and structure for the records with the largest drifts of free
    bridges.

    Parameters
    ----------
    path : Path
        The file.
    most : int
        Number of records.
    """
    with opened(path, COMPARE) as dataset:
        drift = dataset["peak_u"].isel(model=0).max("structure").values
        chosen = sorted(np.argsort(-drift, kind="stable")[:most].tolist())
        names = [str(dataset["record_id"].values[k]) for k in chosen]
        return [(name, str(one)) for name in names for one in dataset["structure"].values]


def validity_words(row: Mapping[str, Any], _key: str = "") -> str:
    """Return the reason why a model stops being valid, and the time.

    Examples
    --------
    >>> validity_words({"validity": "gap_closes", "valid_until_s": 3.5})
    'gap closes 3.50 s'
    """
    words = str(row["validity"]).replace("_", " ")
    when = float(row["valid_until_s"])
    return f"{words} {when:.2f} s" if np.isfinite(when) else words


#: Columns of a comparison table, in the terminal and on the page.
COMPARISON: Final = (
    Column("record", "record_id"),
    Column("structure", "structure"),
    Column("bridge", "model"),
    Column("u_max [cm]>", "u_max_m", ".1f", 100.0),
    Column("v_max [cm]>", "v_max_m", ".2f", 100.0),
    Column("left [cm]>", "residual_u_m", ".1f", 100.0),
    Column("shear / W>", "base_shear", ".3f"),
    Column("tendon [MN]>", "tendon_n", ".2f", 1e-6),
    Column("friction>", "friction_demand", ".2f"),
    Column("model", "validity", rule=validity_words),
)
