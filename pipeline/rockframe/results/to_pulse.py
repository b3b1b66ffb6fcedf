"""What the records' pulses alone do, as variables of response.nc."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Final

import numpy as np
import xarray as xr

from rockframe.results.variables import flags, variable
from rockframe.rocking import ToPulse

_PAIR: Final = ("record", "structure")


class FateUnderPulse(IntEnum):
    """The verdicts, and that no pulse was found; the values of `verdict_to_pulse`."""

    NO_UPLIFT = 0
    SAFE = 1
    OVERTURNED = 2
    UNDECIDED = 3
    NO_PULSE = 4


def to_pulse_variables(rows: Sequence[Sequence[ToPulse | None]]) -> dict[str, xr.Variable]:
    """Return the variables, records by structures.

    Parameters
    ----------
    rows : sequence of sequence of ToPulse or None
        For each record those of its structures; None where the record has no pulse.
    """
    nothing = ToPulse(verdict=FateUnderPulse.NO_PULSE, peak_rotation_ratio=math.nan, error=math.nan)  # type: ignore[arg-type]
    filled = [[nothing if one is None else one for one in row] for row in rows]
    ratios = np.array([[one.peak_rotation_ratio for one in row] for row in filled])
    errors = np.array([[one.error for one in row] for row in filled])
    return {
        "verdict_to_pulse": flags(
            _PAIR,
            [[int(one.verdict) for one in row] for row in filled],
            FateUnderPulse,
            "stability verdict under the record's pulse alone",
        ),
        "peak_rotation_ratio_to_pulse": variable(
            _PAIR, ratios, "1", "largest |theta| / slenderness under the record's pulse alone"
        ),
        "surrogate_error": variable(
            _PAIR,
            errors,
            "1",
            "largest rotation under the pulse alone over that under the record, less 1",
            comment="NaN where either overturns or the record does not lift the structure",
        ),
    }
