"""Read results of a screening for single scenarios and single records."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.errors import ParameterError
from rockframe.results.reading import opened
from rockframe.results.schema import SCREEN, SCREEN_NC
from rockframe.results.tables.rows import columns_of, rows_along
from rockframe.results.writing import growing, position, slices
from rockframe.rocking.response import Response

_SERIES: Final = ("time", "theta", "u", "v")
_INDICES: Final = ("history_record", "history_structure", "history_scale")


@dataclass(frozen=True, eq=False)
class KeptHistory:
    """The history of one scenario.

    Parameters
    ----------
    where : (int, int, int)
        Positions of the record, structure and scale.
    response : Response
        The response, with its nodes.
    """

    where: tuple[int, int, int]
    response: Response


def append_histories(partial: Path, kept: Iterable[KeptHistory]) -> dict[str, list[int]]:
    """Append histories to a partial file, one at a time; return the variables that locate them."""
    columns: dict[str, list[int]] = {name: [] for name in ("history_size", *_INDICES)}
    with growing(partial, {name: SCREEN_NC[name].holding([]) for name in _SERIES}, "a") as append:
        for one in kept:
            append({name: getattr(one.response, name) for name in _SERIES})
            columns["history_size"].append(one.response.time.size)
            for name, position in zip(_INDICES, one.where, strict=True):
                columns[name].append(position)
    return columns


def read_screen_history(
    path: str | Path, *, record: str, structure: str, scale: float
) -> xr.Dataset:
    """Read the history of one scenario of a screening.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe screen`` with ``--histories``.
    record, structure : str
        Identifier of the motion, name of the structure.
    scale : float
        One of the scales [1].

    Returns
    -------
    xarray.Dataset
        ``theta`` [rad], ``u`` and ``v`` [m] on ``time`` [s].

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    ParameterError
        If there is no such scenario, or if the history was not kept.
    """
    with opened(Path(path), SCREEN) as dataset:
        where = [
            position([str(name) for name in dataset["record_id"].values], record, "record"),
            position([str(name) for name in dataset["structure"].values], structure, "structure"),
            position(dataset["scale"].values.tolist(), scale, "scale"),
        ]
        found = np.empty(0, dtype=np.intp)
        if "history_size" in dataset:
            all_of = np.stack([dataset[name].values for name in _INDICES])
            found = np.flatnonzero((all_of == np.array(where)[:, None]).all(axis=0))
        if not found.size:
            raise ParameterError(
                f"no history of {structure!r} under {record!r} at scale {scale:g} was kept. "
                "Compute it with --histories selected or all."
            )
        rows = slices(dataset["history_size"].values)[found[0]]
        chosen = dataset[["theta", "u", "v"]].isel(obs=rows)
        return chosen.load().swap_dims(obs="time")


def screening_of(path: Path, record: str) -> list[dict[str, Any]]:
    """Return the results of the motions of a record, a row for each structure.

    Parameters
    ----------
    path : Path
        Output of the screen stage.
    record : str
        Identifier of the record.

    Returns
    -------
    list of dict
        ``structure``, ``azimuth_degree``, ``verdicts`` by scale, and ``critical_scale``, NaN if it
        was not searched or not found. Empty if the record is not among the motions.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with opened(path, SCREEN) as dataset:
        rows = np.flatnonzero(dataset["record_id"].values == record)
        found = dataset.isel(record=rows).drop_dims("obs", errors="ignore").load()
    scales = [f"{scale:g}" for scale in found["scale"].values]
    columns = columns_of("structure azimuth_degree=azimuth verdicts=structure critical_scale")
    verdicts = rows_along(found, "record structure scale", columns_of("verdict"))
    rows_of_it = list(rows_along(found, "record structure", columns))
    for row in rows_of_it:
        row["verdicts"] = {scale: next(verdicts)["verdict"] for scale in scales}
    return rows_of_it
