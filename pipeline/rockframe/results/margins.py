"""Margins in response.nc: values to write, and strips read from the file."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import xarray as xr

from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.response import ISLANDS, ROBUST
from rockframe.rocking import Margin, Strip
from rockframe.rocking.stated_verdict import strip_of


def margin_values(margins: list[list[Margin]]) -> dict[str, Any]:
    """Return the values of margins, by variable.

    Parameters
    ----------
    margins : list of list of Margin
        For each record, the margins of its structures.
    """
    islands = np.full((len(margins), len(margins[0]), ISLANDS, 2), np.nan)
    for i, row in enumerate(margins):
        for k, margin in enumerate(row):
            kept = np.array(margin.islands[:ISLANDS]).reshape(-1, 2)
            islands[i, k, : len(kept)] = kept
    robust = [[margin.robust for margin in row] for row in margins]
    return {
        **RESPONSE_NC.filled("margin", margins),
        **(RESPONSE_NC.filled("robust", robust) if robust[0][0] else {}),
        "largest_scale": [row[0].largest_scale for row in margins],
        "safe_island_start": islands[..., 0],
        "safe_island_width": islands[..., 1] - islands[..., 0],
    }


def strips_of(response: xr.Dataset, records: Collection[str]) -> dict[tuple[str, str], Strip]:
    """Return the strips by record and structure; empty if the file has no margins."""
    if "critical_scale" not in response:
        return {}
    names = [str(name) for name in response["record_id"].values]
    rows = [i for i, name in enumerate(names) if name in records]
    structures = [str(name) for name in response["structure"].values]
    wanted = ["critical_scale", "largest_scale", "safe_island_start", "safe_island_width"]
    robust = [name for name in ROBUST if name in response and "scale" in name]
    some = {name: response[name].isel(record=rows).values for name in (*wanted, *robust)}
    start, width = some["safe_island_start"], some["safe_island_width"]
    return {
        (names[row], structure): strip_of(
            float(some["critical_scale"][i, k]),
            float(some["largest_scale"][i]),
            [
                (a, a + b)
                for a, b in zip(start[i, k].tolist(), width[i, k].tolist(), strict=True)
                if a > 0.0
            ],
            tuple(float(some[name][i, k]) for name in robust),
        )
        for i, row in enumerate(rows)
        for k, structure in enumerate(structures)
    }
