"""spectrum.nc: overturning spectra of pulses; and rocking spectra of records."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.results.schema.declare import FileKind, Variable
from rockframe.rocking.response import Verdict
from rockframe.wavelets.family import WAVELETS


class Overturning(IntEnum):
    """Ways of overturning; the values of the flag variable `overturning`."""

    NONE = 0
    AFTER_IMPACT = 1
    WITHOUT_IMPACT = 2


# fmt: off
SPECTRUM_NC: Final = FileKind(
    "spectrum", "spectrum", "Overturning of free-standing frames by acceleration pulses",
    (
        Variable("verdict", "wavelet slenderness mass_ratio frequency_ratio amplitude", Verdict, "1", "stability verdict"),
        Variable("overturning", "wavelet slenderness mass_ratio frequency_ratio amplitude", Overturning, "1", "how the frame overturns"),
        Variable("minimum_overturning_amplitude", "wavelet slenderness mass_ratio frequency_ratio", float, "1", "smallest amplitude that overturns, a_p / (g tan(slenderness))", "spectrum", comment="NaN if none up to the largest amplitude. Intervals narrower than the step of amplitude may be missed"),
        Variable("overturning_intervals", "wavelet slenderness mass_ratio frequency_ratio", np.int32, "1", "number of intervals of amplitude that overturn"),
        Variable("safe_islands", "wavelet slenderness mass_ratio frequency_ratio", np.int32, "1", "number of intervals above the smallest overturning amplitude in which the frame stands"),
        Variable("interval_lower", "wavelet slenderness mass_ratio frequency_ratio interval", float, "1", "smallest amplitude of an interval that overturns, a_p / (g tan(slenderness))", comment="NaN beyond overturning_intervals"),
        Variable("interval_upper", "wavelet slenderness mass_ratio frequency_ratio interval", float, "1", "largest amplitude of an interval that overturns, a_p / (g tan(slenderness))", comment="NaN if the interval extends beyond the largest amplitude"),
        Variable("interval_impacts", "wavelet slenderness mass_ratio frequency_ratio interval", np.int32, "1", "number of impacts before overturning at the smallest amplitude of the interval", valid="any", comment="-1 beyond overturning_intervals"),
        Variable("restitution", "slenderness mass_ratio", float, "1", "angular velocity after an impact over angular velocity before, sqrt(r)", "frame"),
        Variable("effective_frequency_ratio", "slenderness mass_ratio", float, "1", "frequency parameter of the frame over that of a column, p-hat / p"),
        Variable("phase", "wavelet", float, "rad", "phase of the pulse", "pulse"),
        Variable("half_cycles", "wavelet", float, "1", "number of half cycles of the pulse", "pulse"),
        Variable("wavelet", "wavelet", str, "1", "wavelet", "pulse", choices=tuple(WAVELETS)),
        Variable("slenderness", "slenderness", float, "rad", "slenderness of a column, alpha", "spectrum", key=True),
        Variable("mass_ratio", "mass_ratio", float, "1", "mass of the beam over that of all columns", "spectrum", key=True),
        Variable("frequency_ratio", "frequency_ratio", float, "1", "omega_p / p, with p of the column alone", "spectrum", key=True),
        Variable("amplitude", "amplitude", float, "1", "a_p / (g tan(slenderness))", "spectrum", key=True),
    ),
)
# fmt: on

# fmt: off
ROCKING_SPECTRUM_NC: Final = FileKind(
    "rocking_spectrum", "spectrum", "Rocking spectra of records",
    (
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("verdict", "record slenderness mass_ratio column_period", Verdict, "1", "stability verdict", "spectrum"),
        Variable("peak_rotation_ratio", "record slenderness mass_ratio column_period", float, "1", "largest |theta| / slenderness, including free rocking after the record", "spectrum"),
        Variable("peak_velocity", "record slenderness mass_ratio column_period", float, "rad s-1", "largest angular velocity, including free rocking after the record", "spectrum", comment="for frames that overturn, until overturning"),
        Variable("slenderness", "slenderness", float, "rad", "slenderness of a column, alpha", "spectrum", key=True),
        Variable("mass_ratio", "mass_ratio", float, "1", "mass of the beam over that of all columns", "spectrum", key=True),
        Variable("column_period", "column_period", float, "s", "2 pi / p of a column alone", "spectrum", key=True),

    ),
)
# fmt: on
