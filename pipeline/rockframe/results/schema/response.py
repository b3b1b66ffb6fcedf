"""pulses.nc, response.nc, compare.nc, spectrum.nc, rocking_spectrum.nc and screen.nc."""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.matching.verdict import PulseVerdict
from rockframe.quantities import BANDED, LIMITED, OF_KINDS, PEAKS, QUANTITIES, Quantity
from rockframe.quantities import FORCES as FORCES_OF_RESPONSE
from rockframe.results.schema.declare import FileKind, Variable, of_all_records, optional
from rockframe.results.schema.records import RECORDS_NC
from rockframe.results.schema.structures import (
    KINDS_OF_STRUCTURES,
    OF_CRUSHING,
    OF_FRAME,
    OF_WEIGHT,
)
from rockframe.risk import FURTHER, MEASURES, POOLED, Outcome
from rockframe.rocking import DIMENSIONS
from rockframe.rocking.kernels.tails import REST_VELOCITY_RATIO
from rockframe.rocking.margins.first_overturning import EDGE_TOLERANCE
from rockframe.rocking.verdict import COMPUTED, ModelEnd, Verdict
from rockframe.structures.comparison import RIVALS
from rockframe.wavelets.family import SHAPES, WAVELETS


class _Period(IntEnum):
    WITHIN_RANGE = 0
    AT_BOUND = 1


class _Ends(IntEnum):
    WHOLE = 0
    CUT_BY_RECORD = 1


# fmt: off
PULSES_NC: Final = FileKind(
    "pulses", "pulse", "Acceleration pulses of records",
    (
        Variable("residual", "obs", float, "m s-2", "acceleration of the record without the selected pulse"),
        Variable("pulse_velocity", "obs", float, "m s-1", "velocity of the selected pulse"),
        Variable("pulse_displacement", "obs", float, "m", "displacement of the selected pulse"),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("samples_sha256", "record", str, "1", "SHA-256 of the record's time step and samples"),
        Variable("a_p", "record wavelet", float, "m s-2", "amplitude of the acceleration pulse", "match.pulse.a_p", valid="finite"),
        Variable("T_p", "record wavelet", float, "s", "period of the acceleration pulse", "match.pulse.T_p", valid="finite"),
        Variable("pulse_time", "record wavelet", float, "s", "centre of the pulse, from the record's first sample", "match.pulse.time", valid="finite"),
        Variable("phase", "record wavelet", float, "rad", "phase of the pulse; pi is the reversed wavelet", "match.pulse.phase", valid="finite"),
        Variable("half_cycles", "record wavelet", float, "1", "number of half cycles; a Ricker wavelet has none", "match.pulse.half_cycles"),
        Variable("L_p", "record wavelet", float, "m", "length scale of the pulse, a_p T_p^2", "match.pulse.length_scale", valid="finite"),
        Variable("match_index", "record wavelet", float, "1", "cosine between record and pulse, the root of the share of energy explained", "match"),
        Variable("energy_share", "record wavelet", float, "1", "share of the record's energy that the pulse explains", "match"),
        Variable("outside", "record wavelet", float, "1", "share of the pulse's energy before or after the record", "match"),
        Variable("at_period_bound", "record wavelet", _Period, "1", "whether the best period is at an end of the searched range, not at a maximum", "match"),
        Variable("at_half_cycle_bound", "record wavelet", _Period, "1", "whether the best number of half cycles is at an end of the searched range", "match"),
        Variable("cut", "record wavelet", _Ends, "1", "whether over 1 % of the pulse's energy is before or after the record", "match"),
        Variable("pulse_verdict", "record wavelet", PulseVerdict, "1", "whether the match is better than matches of similar noise, at 5 %", "likeness.verdict"),
        Variable("p_value", "record wavelet", float, "1", "share of surrogates that match as well as the record; the record counts as one", "likeness"),
        Variable("surrogates", "record wavelet", np.int32, "1", "number of surrogates drawn; drawing stops when the verdict is certain", "likeness"),
        Variable("surrogate_match_index", "record wavelet", float, "1", "match index of the record in the coarse search that is used for surrogates", "likeness.match_index"),
        Variable("surrogate_median", "record wavelet", float, "1", "median of the surrogates' match indices", "likeness.median"),
        Variable("surrogate_high", "record wavelet", float, "1", "95th percentile of the surrogates' match indices", "likeness.high"),
        Variable("pgv_ratio", "record", float, "1", "peak velocity without the velocity pulse over peak velocity of the record", "velocity.peak_ratio"),
        Variable("velocity_energy_ratio", "record", float, "1", "energy of the velocity without the velocity pulse over that of the record", "velocity.energy_ratio"),
        Variable("velocity_indicator", "record", float, "1", "velocity-pulse indicator in the style of Baker (2007)", "velocity.indicator"),
        Variable("velocity_T_p", "record", float, "s", "period of the velocity pulse", "velocity.pulse.T_p"),
        *optional("runners-up",
            Variable("runner_up_a_p", "record runner_up", float, "m s-2", "amplitude of a further pulse", "runner_up.match.pulse.a_p"),
            Variable("runner_up_T_p", "record runner_up", float, "s", "period of a further pulse", "runner_up.match.pulse.T_p"),
            Variable("runner_up_pulse_time", "record runner_up", float, "s", "centre of a further pulse, from the record's first sample", "runner_up.match.pulse.time"),
            Variable("runner_up_phase", "record runner_up", float, "rad", "phase of a further pulse; pi is the reversed wavelet", "runner_up.match.pulse.phase"),
            Variable("runner_up_half_cycles", "record runner_up", float, "1", "number of half cycles of a further pulse; a Ricker wavelet has none", "runner_up.match.pulse.half_cycles"),
            Variable("runner_up_L_p", "record runner_up", float, "m", "length scale of a further pulse, a_p T_p^2", "runner_up.match.pulse.length_scale"),
            Variable("runner_up_energy_share", "record runner_up", float, "1", "share of the record's energy that a further pulse of the selected wavelet explains", "runner_up.energy_share"),
        ),
        Variable("best_wavelet", "record", str, "1", "wavelet of the selected pulse", refers_to="wavelet"),
        Variable("a_p_best", "record", float, "m s-2", "a_p of the selected pulse", "used_match.pulse.a_p"),
        Variable("T_p_best", "record", float, "s", "T_p of the selected pulse", "used_match.pulse.T_p"),
        Variable("match_index_best", "record", float, "1", "match index of the selected pulse", "used_match.match_index"),
        Variable("pulse_verdict_best", "record", PulseVerdict, "1", "whether the selected match is a pulse, at 5 %", "used_likeness.verdict"),
        Variable("p_value_best", "record", float, "1", "share of surrogates that match as well as the record, for the selected pulse", "used_likeness.p_value"),
        Variable("shortest_period", "record", float, "s", "shortest period searched"),
        Variable("longest_period", "record", float, "s", "longest period searched"),
        Variable("wavelet", "wavelet", str, "1", "mother wavelet", key=True, choices=tuple(WAVELETS)),
    ),
)
# fmt: on


#: Largest number of islands that are written; `safe_islands` counts all.
ISLANDS: Final = 64
_KEPT_ISLANDS: Final = f"the first {ISLANDS} above the critical scale; NaN beyond their number"


class _Kept(IntEnum):
    ABSENT = 0
    KEPT = 1


class FateUnderPulse(IntEnum):
    """Values of `verdict_to_pulse`: the verdicts, and "no pulse"."""

    NO_UPLIFT = 0
    STANDS = 1
    OVERTURNS = 2
    NO_PULSE = 4


# fmt: off
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
    comment = "free rocking after the record included"
    return tuple(of_quantity(quantity, along, source, comment) for quantity in PEAKS)


def of_quantity(quantity: Quantity, along: str, source: str = "", comment: str = "") -> Variable:
    """Declare the variable of a quantity; `comment` follows that of the quantity."""
    comments = "; ".join(filter(None, (quantity.comment, comment)))
    group = quantity.name if quantity.later else ""  # files of earlier releases lack it
    return Variable(quantity.name, along, float, quantity.units, quantity.long_name, source, comment=comments, group=group)

#: Records of both horizontal components of a motion in both directions.
_COMPONENTS: Final = (
    Variable("components", "record", str, "1", "records of both horizontal components, if the motion is in both directions", comment="two identifiers with a space between them; empty if the motion is that of one record, in one plane"),
    Variable("components_remark", "record", str, "1", "how the components differ from two records of stated azimuths at right angles", comment="empty if they do not"),
)
#: Such motions, whose response is in all other variables along `record`.
OF_BOTH: Final = optional("both directions",
    *_COMPONENTS,
    Variable("phi", "structure obs", float, "rad", "direction of the tilt, from the first component towards the second", valid="any", comment="under both components; there theta is the tilt, and u the length of the vector of u_x and u_y. NaN while the columns stand upright, and in one plane", attrs={"coordinates": "time"}),
    Variable("u_x", "structure obs", float, "m", "displacement of the beam along the first component", valid="any", comment="as phi", attrs={"coordinates": "time"}),
    Variable("u_y", "structure obs", float, "m", "displacement of the beam along the second component", valid="any", comment="as phi", attrs={"coordinates": "time"}),
)


#: Envelopes of the histories of an ensemble.
ENVELOPES: Final = optional("envelopes",
    Variable("theta_low", "structure obs", float, "rad", "rotation that 16 % of an ensemble of plausible structures do not exceed at this time", valid="any", comment="a member that has overturned counts as infinite, to its side; NaN without a history", attrs={"coordinates": "time"}),
    Variable("theta_high", "structure obs", float, "rad", "rotation that 84 % of an ensemble of plausible structures do not exceed at this time", valid="any", comment="as theta_low", attrs={"coordinates": "time"}),
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
ROBUST: Final = tuple(variable.name for variable in ROBUST_MARGINS)


#: Comment on quantiles of the members of an ensemble.
_AT_RETURN_PERIOD: Final = (
    "0 if the structure uplifts more rarely, of which motions that are as weak give evidence, infinite if it overturns more often, and unknown where the motions do not determine it or the hazard curve begins with rarer ones"
)
#: Endings of the variables of demands at return periods, and their words.
_OF_RETURN_PERIOD: Final = {"": "", "_low": ", lower bound of 90 % confidence", "_high": ", upper bound of 90 % confidence"}
_OVERTURNED_MEMBER: Final = "infinite where a quantile falls on a member that overturns"


def band(quantity: Quantity, along: str, source: str = "ensemble.bands") -> Variable:
    """Declare the 16, 50 and 84 % quantiles of a quantity of the ensemble."""
    comment = "; ".join(filter(None, (_OVERTURNED_MEMBER, quantity.comment)))
    long_name = f"{quantity.long_name}, of an ensemble of plausible structures"
    holder = f"{source}.{quantity.name}" if source else ""
    return Variable(quantity.band, f"{along} quantile", float, quantity.units, long_name, holder, comment=comment)


#: Quantities that need the whole history, which only `--forces` computes; the base shear is one of the bands of peaks, too.
_OF_JOINTS, _OF_COLUMNS = (
    tuple(quantity for quantity in FORCES_OF_RESPONSE if quantity.of_joints and quantity.taken == holder)
    for holder in ("forces", "column_forces")
)
OF_FORCES: Final = optional("forces", *(
    of_quantity(quantity_at_joint, "record structure", "forces", "NaN where the structure overturns")
    for quantity_at_joint in (QUANTITIES["peak_base_shear"], *_OF_JOINTS)
))
#: Forces of each column of structures whose columns differ.
OF_COLUMN_FORCES: Final = optional("forces of each column", *(
    of_quantity(force, "record structure", force.taken, "NaN where the structure overturns, or has equal columns")
    for force in _OF_COLUMNS
))
FORCES: Final = tuple(variable.name for variable in (*OF_FORCES, *OF_COLUMN_FORCES))
#: Bands of these forces; that of the base shear is among the bands of peaks.
OF_FORCE_BANDS: Final = optional("bands of forces", *(band(joint_force, "record structure", "force_bands") for joint_force in _OF_JOINTS))
OF_COLUMN_BANDS: Final = optional("bands of forces of each column", *(band(column_force, "record structure", "column_bands") for column_force in _OF_COLUMNS))


def of_ensemble(along: str) -> tuple[Variable, ...]:
    """Declare the response of an ensemble to the motion itself."""
    shares = optional("ensemble",
        Variable("quantile", "quantile", float, "1", "quantile of the members of the ensemble", valid="finite"),
        Variable("share_overturned", along, float, "1", "share of an ensemble of plausible structures that overturn or collapse", "ensemble", comment="under the motion itself, with amplitudes as uncertain as stated in parameters; the number of members is there too"),
        Variable("share_overturned_low", along, float, "1", "lower limit of the 90 % interval of share_overturned", "ensemble", comment="of Clopper and Pearson"),
        Variable("share_overturned_high", along, float, "1", "upper limit of the 90 % interval of share_overturned", "ensemble", comment="of Clopper and Pearson"),
        Variable("share_uplifted", along, float, "1", "share of the ensemble that uplifts", "ensemble"),
        Variable("share_model_ends", along, float, "1", "share of the ensemble for which the model ends", "ensemble", comment="the gap of an abutment closes, the allowed lift is exceeded, or a tendon yields that is modelled as elastic; members that overturn included; NaN without such a limit"),
    )
    # each in a group of its own, so that files of earlier versions may lack a later quantity
    return (*shares, *(variable for quantity in BANDED for variable in optional(quantity.band, band(quantity, along))))


#: Demands on the joints.
OF_CONTACT: Final = optional("contact",
    Variable("base_friction_demand", "record structure", float, "1", "coefficient of friction that the base joints need", "contact", comment="largest at the samples, of all columns together; NaN where the structure overturns"),
    Variable("top_friction_demand", "record structure", float, "1", "coefficient of friction that the joints under the beam need", "contact", comment="as base_friction_demand; NaN without a beam"),
    Variable("impact_friction_demand", "record structure", float, "1", "coefficient of friction that each impact needs", "contact", comment="NaN without impacts"),
    Variable("least_base_vertical", "record structure", float, "1", "smallest vertical force at the base over the static force", "contact", comment="if not positive, the columns would lift off"),
    Variable("least_top_vertical", "record structure", float, "1", "smallest vertical force under the beam over the static force", "contact", comment="if not positive, the beam would lift off; NaN without a beam"),
    Variable("least_spacing", "record structure", float, "m", "distance between two columns above which the beam stays on both", "contact", comment="NaN without a stated depth of the beam, and for restrained structures"),
)
CONTACT: Final = tuple(variable.name for variable in OF_CONTACT)

#: Forces and yielding of tendons and dissipaters.
OF_RESTRAINT: Final = optional("restraint",
    of_quantity(QUANTITIES["peak_tendon_force"], "record structure", "restraint"),
    Variable("tendon_force_left", "record structure", float, "N", "force of a tendon when the structure is at rest again", "restraint", comment="less than the prestress after yielding; NaN without tendons"),
    Variable("tendon_yield_time", "record structure", float, "s", "time at which a tendon first reaches its yield force", "restraint.tendon_yields", comment="NaN if never"),
    Variable("dissipater_yield_time", "record structure", float, "s", "time at which the dissipaters first yield", "restraint.dissipater_yields", comment="NaN if never"),
    Variable("residual_rotation", "record structure", float, "rad", "|theta| at which the structure comes to rest", "restraint", comment="above zero if dissipaters keep the joints open; NaN for structures that overturn or have no restraint"),
)


_OF_PART: Final = "record structure part"
#: Response to each motion of a sequence.
OF_PARTS: Final = optional("sequences",
    Variable("parts", "record", str, "1", "motions of a sequence: record, start and end in seconds, separated by semicolons"),
    Variable("part_start_rotation_ratio", _OF_PART, float, "1", "|theta| / slenderness when a motion of a sequence begins", "part.start_rotation_ratio", comment="0 at rest; NaN after overturning, and for records that are no sequence"),
    Variable("part_peak_rotation_ratio", _OF_PART, float, "1", "largest |theta| / slenderness until the next motion of a sequence begins", "part.peak_rotation_ratio", comment="NaN after overturning, and for records that are no sequence"),
    Variable("part_peak_u", _OF_PART, float, "m", "largest |u| until the next motion of a sequence begins", "part.peak_u"),
    Variable("part_tendon_force", _OF_PART, float, "N", "force of a tendon when a motion of a sequence begins", "part.tendon_force", comment="less than the prestress after yielding; NaN without tendons"),
    Variable("part_dissipater_force", _OF_PART, float, "N", "force of the dissipaters across one joint when a motion of a sequence begins", "part.dissipater_force", comment="of the stretch that earlier motions left; NaN without dissipaters"),
)

#: Times at which the deck reaches its abutments.
OF_ABUTMENT: Final = optional("abutment",
    Variable("gap_closed_time", "record structure", float, "s", "time at which the deck first closes the gap of its abutment", "response", comment="NaN if never during the record, or if no gap is stated; afterwards the model is no longer valid"),
    Variable("closing_velocity", "record structure", float, "m s-1", "speed of the deck when the gap closes", "response"),
    Variable("lift_exceeded_time", "record structure", float, "s", "time at which the lift of the deck first exceeds its allowance", "response", comment="NaN if never during the record, or if no allowance is stated"),
)

ABUTMENT: Final = tuple(variable.name for variable in OF_ABUTMENT)

#: Responses of kinds of structures that do not rock.
OF_KIND: Final = (
    *(
        variable
        for quantity in OF_KINDS
        for variable in optional(quantity.name, of_quantity(quantity, "record structure", "response"))
    ),
    *optional("first yield",
        Variable("first_yield_time", "record structure", float, "s", "time of the first yielding or sliding", "response", comment="NaN if never"),
    ),
    *optional("limit of ductility",
        Variable("ductility_exceeded_time", "record structure", float, "s", "time at which the ductility first exceeds its limit", "response", comment="NaN if never during the record, or without such a limit; afterwards the model is no longer valid"),
    ),
)
RESPONSE_NC: Final = FileKind(
    "response", "respond", "Rocking response of free-standing frames to records",
    (
        *histories("structure obs"),
        *OF_BOTH,
        *ENVELOPES,
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("verdict", "record structure", Verdict, "1", "nominal verdict: outcome of the structure and the motion as given", "response"),
        Variable("history", "record structure", _Kept, "1", "whether the history is in the file"),
        *optional("not computed",
            Variable("not_computed", "record structure", str, "1", "why the response was not computed; empty if it was", "response.reason"),
        ),
        *peaks("record structure", "response"),
        Variable("uplift_time", "record structure", float, "s", "time of the first uplift", "response"),
        Variable("overturning_time", "record structure", float, "s", "time at which |theta| reaches pi/2", "response"),
        *optional("the pulse alone",
            Variable("verdict_to_pulse", "record structure", FateUnderPulse, "1", "nominal verdict under the record's pulse alone", "to_pulse.verdict"),
            Variable("peak_rotation_ratio_to_pulse", "record structure", float, "1", "largest |theta| / slenderness under the record's pulse alone", "to_pulse.peak_rotation_ratio"),
            Variable("surrogate_error", "record structure", float, "1", "largest rotation under the pulse alone over that under the record, less 1", "to_pulse.error", comment="NaN if the structure overturns under either, or does not uplift under the record"),
        ),
        Variable("impacts", "record structure", np.int32, "1", "number of impacts", "response", comment=f"without the last impacts before rest, slower than {REST_VELOCITY_RATIO:g} effective_frequency_parameter"),
        *OF_CONTACT,
        *OF_RESTRAINT,
        *optional("dissipater force",
            of_quantity(QUANTITIES["peak_dissipater_force"], "record structure", "restraint"),
        ),
        *OF_PARTS,
        *OF_ABUTMENT,
        *OF_KIND,
        *OF_FORCES,
        *OF_FORCE_BANDS,
        *OF_COLUMN_FORCES,
        *OF_COLUMN_BANDS,
        *optional("margins",
            Variable("critical_scale", "record structure", float, "1", "smallest multiple of the motion that overturns", "margin", comment=f"NaN if none was found up to largest_scale. Lower edge, with a relative error of {EDGE_TOLERANCE:g}, of the lowest interval found to overturn; of the lowest intervals at least 1e-4 of the multiple wide, about 3 in 100 are missed"),
            Variable("largest_scale", "record", float, "1", "largest multiple of the motion that was searched"),
            Variable("safe_islands", "record structure", np.int32, "1", "number of islands above the critical scale, intervals in which the structure stands", "margin", comment="found with samples 0.64 to 2.56 % apart; 0 for motions in both directions, for which no critical scale is searched"),
            Variable("safe_island_start", "record structure island", float, "1", "multiple of the motion above which the structure stands again", comment=_KEPT_ISLANDS),
            Variable("safe_island_width", "record structure island", float, "1", "width of the island: from this multiple to the next that overturns", comment=f"{_KEPT_ISLANDS}; with an error of up to 1.3 % of the multiple; the last island may end at largest_scale"),
        ),
        *optional("robust margins",
            *ROBUST_MARGINS,
            Variable("sampling_changes", "record structure", np.int32, "1", "number of members of the ensemble that change sides when the record is sampled twice as finely", "robust", valid="any", comment="members that stand instead of overturning, or overturn instead of standing, under the motion itself; -1: not computed, as for motions in both directions"),
        ),
        *of_ensemble("record structure"),
        *optional("model end",
            Variable("model_end", "record structure", ModelEnd, "1", "event that ends the model of most members of the ensemble", "ensemble"),
        ),
        *optional("sensitivity",
            Variable("spread", "spread", str, "1", "spread of the ensemble, its name among the options", key=True),
            Variable("rank_correlation", "record structure spread", float, "1", "rank correlation between a spread and the peak rotations of the members of the ensemble", comment="of Spearman; members that overturn have the largest ranks; NaN where the motion is not varied in the spread, or if all members have the same peak"),
            Variable("rank_correlation_by_chance", "spread", float, "1", "rank correlation, up or down, that 5 % of spreads without any effect would exceed"),
        ),
        *OF_FRAME,
        *OF_WEIGHT,
        *OF_CRUSHING,
        *KINDS_OF_STRUCTURES,
        Variable("structure", "structure", str, "1", "name of the structure", key=True),
    ),
)
# fmt: on


class Validity(IntEnum):
    """Values of `validity`: the event that first ends the model, a `ModelEnd`."""

    HOLDS = 0
    OVERTURNS = 1
    TENDON_YIELDS = 2
    GAP_CLOSES = 3
    LIFT_EXCEEDED = 4
    DUCTILITY_EXCEEDED = 5

    @classmethod
    def of(cls, end: ModelEnd) -> Validity:
        """Return the value of an event."""
        return cls[end.name] if end else cls.HOLDS


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
        of_quantity(QUANTITIES["peak_u"], _EACH, "compared", "infinite if the bridge overturns or collapses"),
        of_quantity(QUANTITIES["peak_v"], _EACH, "compared", "infinite if the bridge overturns or collapses"),
        Variable("residual_u", _EACH, float, "m", "residual drift, after the motion has decayed", "compared", comment="infinite if the bridge overturns or collapses"),
        of_quantity(QUANTITIES["peak_base_shear"], _EACH, "compared"),
        of_quantity(QUANTITIES["peak_rotation_ratio"], _EACH, "compared", _ROCKING),
        Variable("ductility", _EACH, float, "1", "largest drift over the yield drift", "compared", comment="NaN for rocking bridges and for models that do not yield"),
        of_quantity(QUANTITIES["peak_tendon_force"], _EACH, "compared"),
        of_quantity(QUANTITIES["friction_demand"], _EACH, "compared", _ROCKING),
        Variable("validity", _EACH, Validity, "1", "first reason why the model is no longer valid"),
        Variable("valid_until", _EACH, float, "s", "time at which the model is no longer valid", "compared", comment="NaN if the model stays valid, or if its validity ends after the record or between two samples"),
        Variable("gap_closed_time", _EACH, float, "s", "time at which the deck first closes the gap of an abutment", "compared", comment="NaN if the gap never closes, or if no gap is stated"),
        Variable("closing_velocity", _EACH, float, "m s-1", "speed of the deck when the gap closes", "compared"),
        *of_ensemble(_EACH),
        *optional("weight",
            Variable("weight", "structure", float, "N", "weight of a column with its share of the beam", "frame", comment="NaN if the mass is not stated"),
        ),
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


#: Which motions count.
_COUNTING: Final = "of motions in both directions alone for structures that are computed under them"
#: Outcomes with counts.
OUTCOMES: Final = tuple(outcome.name.lower() for outcome in COMPUTED)

# fmt: off
_DISTANCES: Final = ("epicentral_distance", "distance_rrup", "distance_rjb", "distance_hypocentral")
_NUMBERS: Final = (
    *(replace(RECORDS_NC[name], source="", valid="") for name in ("magnitude", *_DISTANCES, "vs30", "azimuth", "pga", "pgv")),
    Variable("a_p", "record", float, "m s-2", "amplitude of the selected pulse"),
    Variable("T_p", "record", float, "s", "period of the selected pulse"),
    Variable("L_p", "record", float, "m", "length scale of the selected pulse, a_p T_p^2"),
)
#: Peaks of the stated structure in each scenario.
_PEAKS_OF_SCENARIO: Final = (
    *peaks("record structure scale"),
    of_quantity(QUANTITIES["peak_impact_velocity"], "record structure scale", comment="free rocking after the record included; until overturning; 0 without an impact"),
)
#: Further measures of intensity, each a group of its own.
_FURTHER: Final = tuple(replace(RECORDS_NC[name], source="", group=name) for name in FURTHER)
#: Unit of each measure of intensity.
UNITS_OF_MEASURES: Final = {variable.name: variable.units for variable in (*_NUMBERS, *_FURTHER) if variable.name in {**MEASURES, **FURTHER}} | dict.fromkeys(POOLED.keys() - MEASURES.keys(), "1")
_OF_EACH_MEMBER: Final = "infinite for a member that overturns; NaN for a structure without the quantity"
#: Outcomes of members in the file of a batch, from which results of all records are computed.
_OF_BATCHES: Final = tuple(
    replace(variable, of_files="one batch")
    for variable in (
        *optional("outcomes of members",
            Variable("reached", "record structure scale limit_state", np.int32, "1", "number of members that reach the limit state"),
            *(
                Variable(f"members_{name}", "record structure member", float, QUANTITIES[name].units, f"{QUANTITIES[name].long_name} of each member, at the scale nearest to 1", comment=_OF_EACH_MEMBER)
                for name in ("peak_rotation_ratio", "peak_u")
            ),
        ),
        *optional("demands of members",
            *(
                Variable(f"members_{quantity.name}_at_scales", "record structure scale member", float, quantity.units, f"{quantity.long_name} of each member", comment=_OF_EACH_MEMBER)
                for quantity in LIMITED
            ),
        ),
    )
)
#: Fits of fragilities, and the better measure.
_FITS: Final = (
    Variable("measure_units", "measure", str, "1", "unit of the measure", choices=tuple(UNITS_OF_MEASURES.values())),
    Variable("fragility_outcome", "structure limit_state measure", Outcome, "1", "outcome of the fit", "fit.outcome", comment="undetermined: the data do not determine the curve; median, lognormal_beta and fragility are then only those of largest likelihood"),
    Variable("fragility_median", "structure limit_state measure", float, "1", "intensity at which half of the motions reach the limit state, in the unit of the measure", "fit.median"),
    Variable("fragility_logistic_scale", "structure limit_state measure", float, "1", "scale of the logistic distribution with this standard deviation, sqrt(3) / pi times lognormal_beta", "fit.logistic_scale"),
    Variable("fragility_lognormal_beta", "structure limit_state measure", float, "1", "standard deviation of the logarithm of the intensity at which the limit state is reached", "fit.lognormal_beta"),
    Variable("fragility_median_low", "structure limit_state measure", float, "1", "lower bound of the median, 90 % confidence"),
    Variable("fragility_median_high", "structure limit_state measure", float, "1", "upper bound of the median, 90 % confidence"),
    Variable("fragility_lognormal_beta_low", "structure limit_state measure", float, "1", "lower bound of lognormal_beta, 90 % confidence"),
    Variable("fragility_lognormal_beta_high", "structure limit_state measure", float, "1", "upper bound of lognormal_beta, 90 % confidence"),
    Variable("fragility_intercept", "structure limit_state measure", float, "1", "argument of the distribution (normal or logistic, see fragility_curve) at an intensity of one unit", "fit.intercept"),
    Variable("fragility_slope", "structure limit_state measure", float, "1", "slope of this argument over the logarithm of the intensity", "fit.slope"),
    Variable("fragility_pseudo_r2", "structure limit_state measure", float, "1", "McFadden's 1 - ln L / ln L_0", "fit.pseudo_r2"),
    Variable("fragility_concordance", "structure limit_state measure", float, "1", "share of pairs (one motion reaches the limit state, the other does not) in which the first is stronger", "fit.concordance"),
    Variable("fragility_brier", "structure limit_state measure", float, "1", "mean squared error of the probability", "fit.brier"),
    Variable("fragility_lowest", "structure limit_state measure", float, "1", "weakest intensity tried, in the unit of the measure", "fit.lowest"),
    Variable("fragility_highest", "structure limit_state measure", float, "1", "strongest intensity tried, in the unit of the measure", "fit.highest"),
    Variable("fragility_safe_to", "structure limit_state measure", float, "1", "strongest intensity that does not reach the limit state (in a member), in the unit of the measure", "fit.safe_to"),
    Variable("fragility_overturned_from", "structure limit_state measure", float, "1", "weakest intensity that reaches the limit state (in a member), in the unit of the measure", "fit.overturned_from"),
    Variable("fragility_motions", "structure limit_state measure", np.int64, "1", "independent motions", "fit.motions"),
    Variable("fragility_observations", "structure limit_state measure", np.int64, "1", "motions times scales", "fit.observations"),
    Variable("fragility_overturned", "structure limit_state measure", np.int64, "1", "number of observations that reach the limit state (in a member)", "fit.overturned"),
    Variable("log_likelihood", "structure limit_state measure", float, "1", "largest logarithm of the likelihood"),
    Variable("fragility_intensity", "measure point", float, "1", "intensity, in the unit of the measure"),
    Variable("fragility", "structure limit_state measure point", float, "1", "probability of reaching the limit state"),
    Variable("fragility_low", "structure limit_state measure point", float, "1", "lower bound of fragility, 90 % confidence"),
    Variable("fragility_high", "structure limit_state measure point", float, "1", "upper bound of fragility, 90 % confidence"),
)
_BETTER: Final = (
    Variable("better_measure", "structure", str, "1", "measure that predicts overturning better"),
    Variable("better_measure_reason", "structure", str, "1", "reason why a measure is better, or why none is"),
    Variable("bin_intensity", "structure measure bin", float, "1", "mean intensity of the class, in the unit of the measure"),
    Variable("bin_share", "structure limit_state measure bin", float, "1", "share of the class that reaches the limit state"),
)
#: The same for all free-standing structures together.
_POOLED: Final = optional("pooled",
    Variable("pooled", "structure", np.int8, "1", "1 for the structures of the pooled fragility, which are free-standing; 0 for the others"),
    *(replace(variable, name=f"pooled_{variable.name}", along=" ".join(f"pooled_{dim}" if dim in ("limit_state", "measure") else dim for dim in variable.dims if dim != "structure"), source="", long_name=f"{variable.long_name}, of all free-standing structures together") for variable in (*_FITS, *_BETTER)),
    Variable("pooled_measure", "pooled_measure", str, "1", "measure of intensity of the pooled fragility", key=True, choices=tuple(POOLED)),
    Variable("pooled_limit_state", "pooled_limit_state", str, "1", "limit state of the pooled fragility", key=True),
)

SCREEN_NC: Final = FileKind(
    "screen", "screen", "Screening of free-standing frames by records",
    (
        Variable("verdict", "record structure scale", Verdict, "1", "outcome at the scale"),
        *_PEAKS_OF_SCENARIO[:-1],
        *optional("impact velocity", _PEAKS_OF_SCENARIO[-1]),
        *optional("members",
            Variable("share_reached", "record structure scale limit_state", float, "1", "share of an ensemble of plausible structures that reaches the limit state", comment="that of overturning first. The number of members is in members, their spreads are in parameters; the stated structure is not one of them. NaN without the restraint of the limit state"),
            Variable("share_uplifted", "record structure scale", float, "1", "share of this ensemble that uplifts"),
            *(band(QUANTITIES[variable.name], variable.along, "") for variable in _PEAKS_OF_SCENARIO),
        ),
        *_OF_BATCHES,
        *optional("histories", *histories("obs")),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        *(replace(RECORDS_NC[name], source="") for name in ("event", "station")),
        *optional("site", replace(RECORDS_NC["site_type"], source="")),
        Variable("cluster", "record", np.int32, "1", "number of the recording to which the motion belongs, as a component or an azimuth"),
        *optional("both directions", *_COMPONENTS),
        *_NUMBERS,
        *_FURTHER,
        *OF_FRAME,
        *KINDS_OF_STRUCTURES,
        *of_all_records(
            Variable("reference_scale", "", float, "1", "scale at which ranks and distributions are computed", refers_to="scale"),
            Variable("demand_rank", "record structure", float, "1", "rank of the motion by share of members that overturn, then by median peak rotation; 1 the largest"),
            Variable("mean_relative_rank", "record", float, "1", "mean over the structures of the share of motions that are more severe; the motion itself and its ties count half", comment="among the motions that count for each structure; NaN for a motion that counts for none"),
            Variable("peak_share", "structure level", float, "1", "share of motions and members whose peak is at most the level", "band.share"),
            Variable("peak_share_low", "structure level", float, "1", "lower bound of peak_share, 90 % confidence", "band.low"),
            Variable("peak_share_high", "structure level", float, "1", "upper bound of peak_share, 90 % confidence", "band.high"),
            Variable("verdict_count", "structure scale outcome", np.int64, "1", "number of motions of each outcome", comment=_COUNTING),
        ),
        *optional("overall",
            Variable("members", "", np.int64, "1", "number of members of the ensemble that respond in each scenario", comment="1: only the stated structure responds, and all results are nominal"),
            Variable("quantile", "quantile", float, "1", "quantile of the members, or of motions and members", valid="finite"),
            Variable("overall_share_overturned", "structure scale", float, "1", "share of all motions and members that overturn", "overall.share"),
            Variable("overall_share_overturned_low", "structure scale", float, "1", "lower bound of overall_share_overturned, 90 % confidence", "overall.low", comment="recordings are drawn with replacement, with all their members"),
            Variable("overall_share_overturned_high", "structure scale", float, "1", "upper bound of overall_share_overturned, 90 % confidence", "overall.high", comment="as overall_share_overturned_low"),
            Variable("overall_peak_rotation_ratio_band", "structure quantile", float, "1", "largest |theta| / slenderness over all motions and members, at the reference scale", comment=_OVERTURNED_MEMBER),
            Variable("overall_peak_u_band", "structure quantile", float, "m", "largest |u| over all motions and members, at the reference scale", comment=_OVERTURNED_MEMBER),
        ),
        *of_all_records(*_FITS),
        *optional("fragility curve",
            Variable("fragility_curve", "", str, "1", "form of the fragility curves", choices=("lognormal", "logistic"), comment="files without this variable have logistic curves"),
        ),
        *of_all_records(*_BETTER),
        *_POOLED,
        *optional("azimuths",
            Variable("recording", "recording", str, "1", "first motion of the recording", key=True),
            Variable("rotd00_peak_rotation_ratio", "recording structure", float, "1", "largest |theta| / slenderness at the reference scale: smallest value over the azimuths", comment="infinite if the structure overturns"),
            Variable("rotd50_peak_rotation_ratio", "recording structure", float, "1", "largest |theta| / slenderness at the reference scale: median over the azimuths", comment="infinite if the structure overturns"),
            Variable("rotd100_peak_rotation_ratio", "recording structure", float, "1", "largest |theta| / slenderness at the reference scale: largest value over the azimuths", comment="infinite if the structure overturns"),
        ),
        *optional("spectral acceleration",
            Variable("spectral_acceleration", "record spectral_period", float, "m s-2", "pseudo-spectral acceleration, 5 % damped"),
            Variable("spectral_period", "spectral_period", float, "s", "period of the oscillator", key=True),
        ),
        *(replace(RECORDS_NC[f"spectral_acceleration_{end}"], group=f"spectral acceleration {end}") for end in ("rotd50", "rotd100")),
        *optional("margins",
            Variable("critical_scale", "record structure", float, "1", "smallest multiple of the motion that overturns"),
            Variable("safe_islands", "record structure", np.int32, "1", "number of intervals above the critical scale in which the structure stands", valid="any", comment="-1: no critical scale was searched, as for motions in both directions"),
        ),
        *optional("robust margins", *(replace(variable, source="") for variable in ROBUST_MARGINS)),
        *optional("hazard",
            Variable("hazard_measure", "", str, "1", "measure of intensity of the hazard curve", refers_to="measure"),
            Variable("hazard_intensity", "hazard_point", float, "1", "intensity, in the unit of the measure"),
            Variable("hazard_rate", "hazard_point", float, "year-1", "annual rate of exceedance of the intensity"),
            Variable("annual_rate", "structure limit_state", float, "year-1", "mean annual rate of reaching the limit state", "rate.rate"),
            Variable("annual_rate_low", "structure limit_state", float, "year-1", "lower bound of annual_rate, 90 % confidence", "rate.low"),
            Variable("annual_rate_high", "structure limit_state", float, "year-1", "upper bound of annual_rate, 90 % confidence", "rate.high"),
            Variable("annual_rate_extrapolated", "structure limit_state", float, "1", "share of the rate from intensities that were not tried", "rate.extrapolated", comment="above 0.1, the rate depends on the curve below fragility_lowest or above fragility_highest, where there are no motions"),
            Variable("disaggregation", "structure limit_state hazard_point", float, "year-1", "part of the rate from intensities between this point and the next; for the last point, from all above", "rate.contributions"),
        ),
        *optional("site of the hazard curve",
            Variable("hazard_site", "", str, "1", "site of the hazard curve, in words; empty if its file names none"),
        ),
        *optional("note of the hazard curve",
            Variable("hazard_note", "", str, "1", "points of the hazard curve whose rates its printed digits only bound, in words; empty without any"),
        ),
        *optional("demand at return periods",
            Variable("return_period_years", "return_period", float, "1", "return period in years", key=True),
            *(
                Variable(f"{quantity.name}_at_return_period{end}", "structure return_period", float, quantity.units, f"{quantity.long_name} that is exceeded once in the return period{words}", comment=_AT_RETURN_PERIOD)
                for quantity in LIMITED
                for end, words in _OF_RETURN_PERIOD.items()
            ),
            *(
                Variable(f"{quantity.name}_at_return_period_extrapolated", "structure return_period", float, "1", f"share of the rate at {quantity.name}_at_return_period from intensities that were not tried, or that are below the hazard curve")
                for quantity in LIMITED
            ),
        ),
        *optional("design",
            Variable("design_dimension", "", str, "1", "dimension that is searched", choices=tuple(DIMENSIONS)),
            Variable("design_quantity", "", str, "1", "limited quantity", choices=tuple(quantity.name for quantity in LIMITED)),
            Variable("design_limit", "", float, "1", "limit of the quantity", also_units="m or m s-1"),
            Variable("design_required_share", "", float, "1", "share of motions and members that must stay below the limit"),
            Variable("design_value", "design_step", float, "m", "values that were tried", also_units="1"),
            Variable("design_share", "structure design_step", float, "1", "share of motions and members below the limit"),
            Variable("design_smallest", "structure", float, "m", "smallest value tried that keeps the limit", "found.smallest", also_units="1"),
            Variable("design_sure_from", "structure", float, "m", "smallest value that keeps the limit and above which every value tried does", "found.sure_from", also_units="1"),
        ),
        *optional("design statistic",
            Variable("design_statistic", "", str, "1", "statistic of the demand that must keep the limit", choices=("share", "quantile_84")),
            Variable("design_quantile_84", "structure design_step", float, "1", "84 % quantile of the quantity over all motions and members", also_units="m or m s-1", comment=_OVERTURNED_MEMBER),
        ),
        Variable("structure", "structure", str, "1", "name of the structure", key=True),
        Variable("scale", "scale", float, "1", "factor on the motion", key=True),
        Variable("measure", "measure", str, "1", "measure of intensity; sa_1s is the spectral acceleration at 1 s", key=True, of_files="all records"),
        Variable("limit_state", "limit_state", str, "1", "overturning, or a limit of a peak", key=True),
        Variable("outcome", "outcome", str, "1", "outcome at a scale", key=True, of_files="all records", choices=OUTCOMES),
        Variable("level", "level", float, "1", "level of |theta| / slenderness", key=True, of_files="all records"),
        *optional("histories",
            Variable("history_size", "history", np.int64, "1", "number of samples of the history", attrs={"sample_dimension": "obs"}),
            Variable("history_record", "history", np.int32, "1", "position along record", refers_to="record"),
            Variable("history_structure", "history", np.int32, "1", "position along structure", refers_to="structure"),
            Variable("history_scale", "history", np.int32, "1", "position along scale", refers_to="scale"),
        ),
    ),
)
# fmt: on
