"""Variables of response.nc that tell how far a verdict is from another one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import xarray as xr

from rockframe.results.variables import flags, variable
from rockframe.rocking.margins import EDGE_TOLERANCE, ISLAND_TOLERANCE, SCAN_STEP, Margin
from rockframe.rocking.perturbed import (
    AMPLITUDE_PERTURBATION,
    RESTITUTION_PERTURBATION,
    Sensitivity,
)

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
            comment=f"NaN: none up to largest_scale. Found by a scan in steps of {SCAN_STEP:.1%}, "
            f"edges to a share of {EDGE_TOLERANCE:g}; thinner slivers may be missed",
        ),
        "largest_scale": variable(
            "record",
            np.array([row[0].largest_scale for row in margins]),
            "1",
            "multiple of the motion at which the scan ended",
        ),
        "safe_islands": variable(
            _PAIRS,
            np.array([[margin.safe_islands for margin in row] for row in margins], dtype=np.int32),
            "1",
            "number of safe islands above the critical scale",
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
            comment=f"{kept_islands}; to a share of {ISLAND_TOLERANCE:g} of the multiple; the last "
            "may end with the scan",
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
