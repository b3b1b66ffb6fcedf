"""Responses: response.nc, compare.nc, spectrum.nc and rocking_spectrum.nc."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.oscillators.comparison import RIVALS, Validity
from rockframe.results.schema.declare import FileKind, Variable, optional
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO
from rockframe.rocking.margins.sensitivity import (
    AMPLITUDE_PERTURBATION,
    RESTITUTION_PERTURBATION,
    Sensitivity,
)
from rockframe.rocking.margins.sliver_search import EDGE_TOLERANCE
from rockframe.rocking.stated_verdict import Verdict
from rockframe.wavelets.family import SHAPES

#: Largest number of islands that are written; `safe_islands` counts all.
ISLANDS: Final = 64
_KEPT_ISLANDS: Final = f"the first {ISLANDS} above the critical scale; NaN beyond their number"


class _Kept(IntEnum):
    ABSENT = 0
    KEPT = 1


class FateUnderPulse(IntEnum):
    """Values of `verdict_to_pulse`: the verdicts, and "no pulse"."""

    NO_UPLIFT = 0
    SAFE = 1
    OVERTURNED = 2
    UNDECIDED = 3
    NO_PULSE = 4


# fmt: off
#: Properties of each structure.
OF_FRAME: Final = (
    Variable("height", "structure", float, "m", "height of a column", "frame", valid="finite"),
    Variable("width", "structure", float, "m", "width of a column", "frame", valid="finite"),
    Variable("top_contact_width", "structure", float, "m", "width at the top of a column, on which the beam rests", "frame", valid="finite"),
    Variable("centre_height", "structure", float, "m", "height of a column's centre of gravity above its base", "frame", valid="finite"),
    Variable("inertia_ratio", "structure", float, "1", "I_o / (m_c R^2) of a column about its base corner", "frame", valid="finite"),
    Variable("slenderness", "structure", float, "rad", "slenderness, alpha; for columns that are not prismatic, the slenderness of the equivalent column", "frame", valid="finite"),
    Variable("size", "structure", float, "m", "distance from the pivot of a column to its centre of gravity, R", "frame", valid="finite"),
    Variable("mass_ratio", "structure", float, "1", "mass of the beam over that of all columns", "frame", valid="finite"),
    Variable("frequency_parameter", "structure", float, "rad s-1", "frequency parameter of a column, p", "frame", valid="finite"),
    Variable("effective_frequency_parameter", "structure", float, "rad s-1", "frequency parameter of the frame, p-hat", "frame", valid="finite"),
    Variable("restitution", "structure", float, "1", "angular velocity after an impact over angular velocity before, sqrt(r)", "frame", valid="finite"),
    Variable("uplift_acceleration", "structure", float, "m s-2", "ground acceleration that starts uplift", "frame", valid="finite"),
)


def histories(along: str) -> tuple[Variable, ...]:
    """Declare the histories of structures on their time."""
    fallen, on_time = "NaN after overturning", {"coordinates": "time"}
    return (
        Variable("time", "obs", float, "s", "time since the record's first sample"),
        Variable("theta", along, float, "rad", "rotation of the columns", comment=fallen, attrs=on_time),
        Variable("u", along, float, "m", "horizontal displacement of the beam relative to the ground", comment=fallen, attrs=on_time),
        Variable("v", along, float, "m", "vertical lift of the beam", comment=fallen, attrs=on_time),
    )


def peaks(along: str, source: str = "") -> tuple[Variable, ...]:
    """Declare the largest rotation and displacements of scenarios."""
    return (
        Variable("peak_rotation_ratio", along, float, "1", "largest |theta| / slenderness, free rocking after the record included", source),
        Variable("peak_u", along, float, "m", "largest |u|, at the same rotation", source),
        Variable("peak_v", along, float, "m", "largest v", source),
    )


#: The robust margins, in this file and in screen.nc.
ROBUST_MARGINS: Final = tuple(
    variable
    for share in (10, 25, 50)
    for variable in (
        Variable(f"robust_scale_{share}", "record structure", float, "1", f"multiple of the motion that overturns {share} % of an ensemble of plausible structures", f"robust.s{share}", comment="the smallest such multiple, from means over multiples within 4 %; NaN if fewer overturn up to largest_scale. The ensemble is stated in parameters"),
        Variable(f"robust_error_{share}", "record structure", float, "1", f"sampling error of the multiple that overturns {share} %, relative to the multiple", f"robust.error{share}", comment="half the range of the middle 68 % of ensembles that are resampled from the members"),
    )
)
ROBUST: Final = tuple(one.name for one in ROBUST_MARGINS)


#: Demands on the joints.
OF_CONTACT: Final = optional("contact",
    Variable("base_friction_demand", "record structure", float, "1", "coefficient of friction that the base joints need", "contact", comment="largest at the samples, of all columns together; NaN where the structure overturns"),
    Variable("top_friction_demand", "record structure", float, "1", "coefficient of friction that the joints under the beam need", "contact", comment="as base_friction_demand; NaN without a beam"),
    Variable("impact_friction_demand", "record structure", float, "1", "coefficient of friction that each impact needs", "contact", comment="NaN without impacts"),
    Variable("least_base_vertical", "record structure", float, "1", "smallest vertical force at the base over the static force", "contact", comment="if not positive, the columns would lift off"),
    Variable("least_top_vertical", "record structure", float, "1", "smallest vertical force under the beam over the static force", "contact", comment="if not positive, the beam would lift off; NaN without a beam"),
    Variable("least_spacing", "record structure", float, "m", "distance between two columns above which the beam stays on both", "contact", comment="NaN without a stated depth of the beam, and for restrained structures"),
)
CONTACT: Final = tuple(one.name for one in OF_CONTACT)

#: Forces and yielding of tendons and dissipaters.
OF_RESTRAINT: Final = optional("restraint",
    Variable("peak_tendon_force", "record structure", float, "N", "largest force of a tendon", "restraint", comment="NaN without tendons"),
    Variable("tendon_force_left", "record structure", float, "N", "force of a tendon when the structure is at rest again", "restraint", comment="less than the prestress after yielding; NaN without tendons"),
    Variable("tendon_yield_time", "record structure", float, "s", "time at which a tendon first reaches its yield force", "restraint.tendon_yields", comment="NaN if never"),
    Variable("dissipater_yield_time", "record structure", float, "s", "time at which the dissipaters first yield", "restraint.dissipater_yields", comment="NaN if never"),
    Variable("residual_rotation", "record structure", float, "rad", "|theta| at which the structure comes to rest", "restraint", comment="above zero if dissipaters keep the joints open; NaN for structures that overturn or have no restraint"),
)


#: Times at which the deck reaches its abutments.
OF_ABUTMENT: Final = optional("abutment",
    Variable("gap_closed_time", "record structure", float, "s", "time at which the deck first closes the gap of its abutment", "response", comment="NaN if never during the record, or if no gap is stated; afterwards the model is no longer valid"),
    Variable("closing_velocity", "record structure", float, "m s-1", "speed of the deck when the gap closes", "response"),
    Variable("lift_exceeded_time", "record structure", float, "s", "time at which the lift of the deck first exceeds its allowance", "response", comment="NaN if never during the record, or if no allowance is stated"),
)

ABUTMENT: Final = tuple(one.name for one in OF_ABUTMENT)

#: Values of frames before their edges crush; OF_FRAME has the values after crushing.
OF_CRUSHING: Final = optional("crushing",
    Variable("slenderness_before_crushing", "structure", float, "rad", "slenderness before the edges crush", "before_crushing.slenderness", comment="NaN where edges do not crush"),
    Variable("restitution_before_crushing", "structure", float, "1", "restitution, sqrt(r), before the edges crush", "before_crushing.restitution", comment="NaN if edges do not crush; smaller than the restitution after crushing, because columns on closer pivots lose less"),
)

RESPONSE_NC: Final = FileKind(
    "response", "respond", "Rocking response of free-standing frames to records",
    (
        *histories("structure obs"),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("verdict", "record structure", Verdict, "1", "stability verdict", "response"),
        Variable("history", "record structure", _Kept, "1", "whether the history is in the file"),
        *peaks("record structure", "response"),
        Variable("uplift_time", "record structure", float, "s", "time of the first uplift", "response"),
        Variable("overturning_time", "record structure", float, "s", "time at which |theta| reaches pi/2", "response"),
        *optional("the pulse alone",
            Variable("verdict_to_pulse", "record structure", FateUnderPulse, "1", "stability verdict under the record's pulse alone", "to_pulse.verdict"),
            Variable("peak_rotation_ratio_to_pulse", "record structure", float, "1", "largest |theta| / slenderness under the record's pulse alone", "to_pulse.peak_rotation_ratio"),
            Variable("surrogate_error", "record structure", float, "1", "largest rotation under the pulse alone over that under the record, less 1", "to_pulse.error", comment="NaN if the structure overturns under either, or does not uplift under the record"),
        ),
        Variable("impacts", "record structure", np.int32, "1", "number of impacts", "response", comment=f"without the last impacts before rest, slower than {REST_VELOCITY_RATIO:g} effective_frequency_parameter"),
        *OF_CONTACT,
        *OF_RESTRAINT,
        *OF_ABUTMENT,
        *optional("margins",
            Variable("critical_scale", "record structure", float, "1", "smallest multiple of the motion that overturns", "margin", comment=f"NaN if none was found up to largest_scale. Lower edge, with a relative error of {EDGE_TOLERANCE:g}, of the lowest interval found to overturn; of the lowest intervals at least 1e-4 of the multiple wide, about 3 in 100 are missed"),
            Variable("largest_scale", "record", float, "1", "largest multiple of the motion that was searched"),
            Variable("safe_islands", "record structure", np.int32, "1", "number of islands above the critical scale, intervals in which the structure stands", "margin", comment="found with samples 0.64 to 2.56 % apart"),
            Variable("safe_island_start", "record structure island", float, "1", "multiple of the motion above which the structure stands again", comment=_KEPT_ISLANDS),
            Variable("safe_island_width", "record structure island", float, "1", "width of the island: from this multiple to the next that overturns", comment=f"{_KEPT_ISLANDS}; with an error of up to 1.3 % of the multiple; the last island may end at largest_scale"),
            Variable("undecided_by", "record structure", Sensitivity, "1", "small change that changes the verdict", "margin", comment=f"amplitude: by {AMPLITUDE_PERTURBATION:.0%} or less; restitution: velocity ratio of impacts by {RESTITUTION_PERTURBATION:.0%} or less; sampling: record sampled twice as finely; dimensions: the structure stands with robust_scale_10 at most 1, or overturns with robust_scale_50 not below 1"),
        ),
        *optional("robust margins", *ROBUST_MARGINS),
        *OF_FRAME,
        *OF_CRUSHING,
        Variable("structure", "structure", str, "1", "name of the structure", key=True),
    ),
)
# fmt: on


_EACH: Final = "record structure model"
_HISTORY: Final = "structure model obs"
_ROCKING: Final = "NaN for bridges that do not rock"

# fmt: off
COMPARE_NC: Final = FileKind(
    "compare", "compare", "Rocking bridges compared with restrained, hybrid, isolated and fixed bridges",
    (
        Variable("time", "obs", float, "s", "time since the record's first sample"),
        Variable("u", _HISTORY, float, "m", "drift of the deck relative to the ground", comment="NaN after overturning or collapse", attrs={"coordinates": "time"}),
        Variable("v", _HISTORY, float, "m", "lift of the deck", comment="NaN after overturning", attrs={"coordinates": "time"}),
        Variable("base_shear", _HISTORY, float, "1", "force of the ground on the bridge over the weight of deck and columns", comment="to the right; NaN after overturning or collapse", attrs={"coordinates": "time"}),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("peak_u", _EACH, float, "m", "largest drift of the deck", "compared", comment="infinite if the bridge overturns or collapses"),
        Variable("peak_v", _EACH, float, "m", "largest lift of the deck", "compared", comment="infinite if the bridge overturns or collapses"),
        Variable("residual_u", _EACH, float, "m", "residual drift, after the motion has decayed", "compared", comment="infinite if the bridge overturns or collapses"),
        Variable("peak_base_shear", _EACH, float, "1", "largest base shear over the weight of deck and columns", "compared", comment="at the samples; without the impulses of impacts"),
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
        Variable("wavelet", "wavelet", str, "1", "wavelet", "pulse", choices=tuple(SHAPES)),
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
