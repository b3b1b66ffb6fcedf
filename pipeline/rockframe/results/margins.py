"""Values of response.nc that tell how far a verdict is from another one."""

from __future__ import annotations

from typing import Any

import numpy as np

from rockframe.results.schema import RESPONSE_NC
from rockframe.results.schema.response import ISLANDS
from rockframe.rocking.margins import Margin


def margin_values(margins: list[list[Margin]]) -> dict[str, Any]:
    """Return the values of margins, by variable.

    Parameters
    ----------
    margins : list of list of Margin
        For each record those of its structures.
    """
    islands = np.full((len(margins), len(margins[0]), ISLANDS, 2), np.nan)
    for i, row in enumerate(margins):
        for k, margin in enumerate(row):
            kept = np.array(margin.islands[:ISLANDS]).reshape(-1, 2)
            islands[i, k, : len(kept)] = kept
    return {
        **RESPONSE_NC.filled("margin", margins),
        "largest_scale": [row[0].largest_scale for row in margins],
        "safe_island_start": islands[..., 0],
        "safe_island_width": islands[..., 1] - islands[..., 0],
    }
