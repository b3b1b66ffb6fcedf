"""compare.nc: responses of rocking bridges and of the bridges compared with them."""

from __future__ import annotations

from typing import Final

import numpy as np

from rockframe.oscillators.comparison import RIVALS, Validity
from rockframe.results.schema.declare import FileKind, Variable

_EACH: Final = "record structure model"
_HISTORY: Final = "structure model obs"
_ROCKING: Final = "NaN for bridges that do not rock"

# fmt: off
COMPARE_NC: Final = FileKind(
    "compare", "compare", "Rocking bridges compared with restrained, hybrid, isolated and fixed bridges",
    (
        Variable("time", "obs", float, "s", "time since the record's first sample"),
        Variable("u", _HISTORY, float, "m", "drift of the deck relative to the ground", comment="NaN after overturning", attrs={"coordinates": "time"}),
        Variable("v", _HISTORY, float, "m", "lift of the deck", comment="NaN after overturning", attrs={"coordinates": "time"}),
        Variable("base_shear", _HISTORY, float, "1", "force of the ground on the bridge over the weight of deck and columns", comment="to the right; NaN after overturning", attrs={"coordinates": "time"}),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("peak_u", _EACH, float, "m", "largest drift of the deck", "compared", comment="infinite if the bridge overturns"),
        Variable("peak_v", _EACH, float, "m", "largest lift of the deck", "compared", comment="infinite if the bridge overturns"),
        Variable("residual_u", _EACH, float, "m", "residual drift, after the motion has decayed", "compared", comment="infinite if the bridge overturns"),
        Variable("peak_base_shear", _EACH, float, "1", "largest base shear over the weight of deck and columns", "compared", comment="at the samples"),
        Variable("peak_rotation_ratio", _EACH, float, "1", "largest |theta| / slenderness", "compared", comment=_ROCKING),
        Variable("ductility", _EACH, float, "1", "largest drift over the yield drift", "compared", comment="NaN for rocking bridges and for models that do not yield"),
        Variable("peak_tendon_force", _EACH, float, "N", "largest force of a tendon", "compared", comment="NaN without tendons"),
        Variable("friction_demand", _EACH, float, "1", "coefficient of friction that the joints need", "compared", comment=_ROCKING),
        Variable("validity", _EACH, Validity, "1", "first reason why the model is no longer valid", "compared"),
        Variable("valid_until", _EACH, float, "s", "time at which the model is no longer valid", "compared", comment="NaN if the model stays valid, or if its validity ends after the record or between two samples"),
        Variable("gap_closed_time", _EACH, float, "s", "time at which the deck first closes the gap of an abutment", "compared", comment="NaN if the gap never closes, or if no gap is stated"),
        Variable("closing_velocity", _EACH, float, "m s-1", "speed of the deck when the gap closes", "compared"),
        Variable("structure", "structure", str, "1", "name of the structure", key=True),
        Variable("model", "model", str, "1", "variant of the bridge", key=True, choices=("free", *RIVALS)),
    ),
)
# fmt: on
