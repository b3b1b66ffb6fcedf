"""Datasets of figures: made for a figure, and not written to a file."""

from __future__ import annotations

from typing import Final

from rockframe.results.schema.declare import FileKind, Variable
from rockframe.results.schema.response import RESPONSE_NC
from rockframe.rocking.stated_verdict import ScaleOutcome

_ROTATION: Final = "rotation of the columns"
_MOMENT: Final = "restoring moment over moment at uplift"
_HEAVY: Final = "under a very heavy beam"

# fmt: off
_RECORD: Final = (
    Variable("record_id", "", str, "1", "record identifier"),
    Variable("pga", "", float, "m s-2", "peak ground acceleration"),
)
_GAMMA: Final = Variable("mass_ratio", "mass_ratio", float, "1", "m_b / (N m_c)")

SIZE: Final = FileKind("size", "figure", "Size of the equivalent column", (
    Variable("size_ratio", "mass_ratio", float, "1", "R-hat / R"),
    Variable("frequency_ratio", "mass_ratio", float, "1", "p-hat / p"),
    Variable("size_limit", "", float, "1", f"R-hat / R {_HEAVY}"),
    Variable("frequency_limit", "", float, "1", f"p-hat / p {_HEAVY}"),
    _GAMMA,
))
RESTITUTION: Final = FileKind("restitution", "figure", "Largest restitution", (
    Variable("restitution", "mass_ratio slenderness", float, "1", RESPONSE_NC["restitution"].long_name),
    Variable("slenderness_limit", "mass_ratio", float, "rad", "slenderness at which the restitution vanishes"),
    _GAMMA,
    Variable("slenderness", "slenderness", float, "rad", "slenderness of a column"),
))
STABILITY: Final = FileKind("stability", "figure", "Stability map of a record", (
    Variable("verdict", "column_height scale", ScaleOutcome, "1", "outcome at the scale"),
    *_RECORD,
    Variable("structure", "", str, "1", "name of the structure"),
    Variable("column_height", "column_height", float, "m", "height of a column"),
    Variable("scale", "scale", float, "1", "factor on the motion"),
))
PORTRAIT: Final = FileKind("portrait", "figure", "Moment and rate over the rotation", (
    Variable("rate", "obs", float, "rad s-1", "rate of rotation"),
    Variable("restoring_moment", "obs", float, "1", _MOMENT),
    Variable("curve_moment", "curve", float, "1", _MOMENT),
    Variable("curve_barrier", "curve", float, "rad s-1", "rate that overturns on still ground"),
    Variable("impact_rate", "impact", float, "rad s-1", "rate just before an impact"),
    Variable("rotation", "obs", float, "rad", _ROTATION),
    Variable("curve_rotation", "curve", float, "rad", _ROTATION),
    *_RECORD,
))
JOINTS: Final = FileKind("joints", "figure", "Friction demand and vertical forces at the joints", (
    Variable("acceleration", "time", float, "m s-2", "ground acceleration"),
    Variable("theta", "time", float, "rad", _ROTATION),
    Variable("base_friction_demand", "time", float, "1", "base shear over vertical base reaction"),
    Variable("top_friction_demand", "time", float, "1", "shear over compression under the beam"),
    Variable("base_vertical", "time", float, "1", "vertical base reaction over the weight"),
    Variable("impact_friction_demand", "", float, "1", "friction that each impact needs"),
    Variable("uplift_friction_demand", "", float, "1", "friction that uplift needs, tan(alpha)"),
    Variable("column_base_friction_demand", "column time", float, "1", "base shear of a column over its reaction"),
    Variable("column_top_friction_demand", "column time", float, "1", "shear over compression on top of a column"),
    Variable("column_top_vertical", "column time", float, "1", "compression under the beam over its half weight"),
    Variable("spacing", "", float, "m", "distance between the axes of the columns"),
    Variable("beam_centre", "", float, "m", "height of the beam's centre of mass above its underside"),
    Variable("least_spacing", "", float, "m", "spacing at which impacts lift the beam"),
    Variable("time", "time", float, "s", "time since the record's first sample"),
    *_RECORD,
))
_PULSE: Final = (
    *_RECORD,
    Variable("wavelet", "", str, "1", "mother wavelet"),
    Variable("a_p", "", float, "m s-2", "amplitude of the pulse"),
    Variable("T_p", "", float, "s", "period of the pulse"),
    Variable("pulse_time", "", float, "s", "centre of the pulse"),
    Variable("reach", "", float, "s", "half-length of the pulse"),
    Variable("best_match", "", float, "1", "match index of the pulse"),
    Variable("tested", "", str, "1", "result of the test against noise"),
    Variable("time", "time", float, "s", "time since the first sample"),
)
PULSE: Final = FileKind("pulse", "figure", "A record and the pulse in it", (
    Variable("acceleration", "time", float, "m s-2", "ground acceleration"),
    Variable("pulse", "time", float, "m s-2", "acceleration of the pulse"),
    *_PULSE,
))
SCALOGRAM: Final = FileKind("scalogram", "figure", "Wavelet transform of a record", (
    Variable("match_index", "period time", float, "1", "cosine between record and wavelet"),
    Variable("period", "period", float, "s", "T_p"),
    *_PULSE,
))
MATCH_CURVE: Final = FileKind("match_curve", "figure", "Match index over the period", (
    Variable("match_index", "wavelet period", float, "1", "largest cosine between record and wavelet"),
    _RECORD[0],
    Variable("T_p", "wavelet", float, "s", "period of the best match"),
    Variable("best_match", "wavelet", float, "1", "match index of the best match"),
    Variable("period", "period", float, "s", "T_p"),
    Variable("wavelet", "wavelet", str, "1", "mother wavelet"),
))
# fmt: on
