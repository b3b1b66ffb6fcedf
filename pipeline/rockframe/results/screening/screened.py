"""What a screening says of one record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rockframe.results.reading import opened
from rockframe.results.schema import SCREEN
from rockframe.rocking.response import Verdict


def screening_of(path: Path, record: str) -> list[dict[str, Any]]:
    """Return what the screening says of the motions of a record, a row for each structure.

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
        was not looked for or there is none; none if the record is not among the motions.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with opened(path, SCREEN) as dataset:
        rows = np.flatnonzero(dataset["record_id"].values == record)
        found = dataset.isel(record=rows).drop_dims("obs", errors="ignore").load()
    critical = found.get("critical_scale")
    return [
        {
            "structure": str(structure),
            "azimuth_degree": float(found["azimuth"].values[i]),
            "verdicts": {
                f"{scale:g}": Verdict(int(verdict)).name.lower()
                for scale, verdict in zip(
                    found["scale"].values, found["verdict"].values[i, k], strict=True
                )
            },
            "critical_scale": np.nan if critical is None else float(critical.values[i, k]),
        }
        for i in range(rows.size)
        for k, structure in enumerate(found["structure"].values)
    ]
