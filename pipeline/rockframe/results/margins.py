"""Variables of response.nc that tell how far a verdict is from another one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr

from rockframe.results.variables import flags, variable
from rockframe.rocking.margins import Margin
from rockframe.rocking.perturbed import (
    AMPLITUDE_PERTURBATION,
    RESTITUTION_PERTURBATION,
    Sensitivity,
)
from rockframe.rocking.sliver_search import EDGE_TOLERANCE

#: So many safe islands are written with their widths; all are counted.
ISLANDS: Final = 64

_PAIRS: Final = ("record", "structure")


def margin_variables(margins: Sequence[Sequence[Margin]]) -> dict[str, xr.Variable]:
    """Return the variables of margins.

    Parameters
    ----------
    margins : sequence of sequence of Margin
        For each record those of its structures.
    """
    islands = np.full((len(margins), len(margins[0]), ISLANDS, 2), np.nan)
    for i, row in enumerate(margins):
        for k, margin in enumerate(row):
            kept = np.array(margin.islands[:ISLANDS]).reshape(-1, 2)
            islands[i, k, : len(kept)] = kept
    kept_islands = f"the first {ISLANDS} above the critical scale; NaN beyond their number"
    return {
        "critical_scale": variable(
            _PAIRS,
            np.array([[margin.critical_scale for margin in row] for row in margins]),
            "1",
            "least multiple of the motion that overturns",
            comment="NaN: none found up to largest_scale. Lower edge, to a share of "
            f"{EDGE_TOLERANCE:g}, of the lowest interval found to overturn; of intervals at least "
            "1e-4 of the multiple wide, 99 % are found",
        ),
        "largest_scale": variable(
            "record",
            np.array([row[0].largest_scale for row in margins]),
            "1",
            "largest multiple of the motion that was searched",
        ),
        "safe_islands": variable(
            _PAIRS,
            np.array([[margin.safe_islands for margin in row] for row in margins], dtype=np.int32),
            "1",
            "number of safe islands above the critical scale",
            comment="as far as samples 0.64 to 2.56 % apart show them",
        ),
        "safe_island_start": variable(
            (*_PAIRS, "island"),
            islands[..., 0],
            "1",
            "multiple of the motion from which on the structure stands again",
            comment=kept_islands,
        ),
        "safe_island_width": variable(
            (*_PAIRS, "island"),
            islands[..., 1] - islands[..., 0],
            "1",
            "how much larger the multiple is that overturns it again",
            comment=f"{kept_islands}; to 1.3 % of the multiple; the last may end at largest_scale",
        ),
        "undecided_by": flags(
            _PAIRS,
            [[margin.undecided_by for margin in row] for row in margins],
            Sensitivity,
            "small changes that turn the verdict",
            comment=f"amplitude by {AMPLITUDE_PERTURBATION:.0%} or less; velocity ratio of impacts "
            f"by {RESTITUTION_PERTURBATION:.0%}; record sampled twice as finely",
        ),
    }
