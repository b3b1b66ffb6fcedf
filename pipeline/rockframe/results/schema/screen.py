"""screen.nc: verdicts and peaks by record, structure and scale, and statistics of them."""

from __future__ import annotations

from dataclasses import replace
from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.results.schema.declare import FileKind, Variable, optional
from rockframe.results.schema.records import RECORDS_NC
from rockframe.results.schema.response import OF_FRAME, ROBUST_MARGINS, histories, peaks
from rockframe.risk import MEASURES, Outcome
from rockframe.risk.limits import QUANTITIES
from rockframe.rocking import DIMENSIONS
from rockframe.rocking.stated_verdict import ScaleOutcome


class _Known(IntEnum):
    DECIDED = 0
    UNDECIDED = 1


#: Outcomes with counts, and the words for them in files of earlier versions.
OUTCOMES: Final = tuple(outcome.name.lower() for outcome in ScaleOutcome)
_FORMER: Final = ("no_uplift", "safe", "overturned")

# fmt: off
_DISTANCES: Final = ("epicentral_distance", "distance_rrup", "distance_rjb", "distance_hypocentral")
_NUMBERS: Final = (
    *(replace(RECORDS_NC[name], source="", valid="") for name in ("magnitude", *_DISTANCES, "vs30", "azimuth", "pga", "pgv")),
    Variable("a_p", "record", float, "m s-2", "amplitude of the selected pulse"),
    Variable("T_p", "record", float, "s", "period of the selected pulse"),
    Variable("L_p", "record", float, "m", "length scale of the selected pulse, a_p T_p^2"),
)
#: Unit of each measure of intensity.
UNITS_OF_MEASURES: Final = {one.name: one.units for one in _NUMBERS if one.name in MEASURES}

SCREEN_NC: Final = FileKind(
    "screen", "screen", "Screening of free-standing frames by records",
    (
        Variable("verdict", "record structure scale", ScaleOutcome, "1", "outcome at the scale", former_meanings=" ".join((*_FORMER, "undecided"))),
        *peaks("record structure scale"),
        *optional("impact velocity",
            Variable("peak_impact_velocity", "record structure scale", float, "m s-1", "largest velocity at which the lifted corner of a column's base meets the ground, 2 b |theta'|", comment="free rocking after the record included; until overturning; 0 without an impact"),
        ),
        *optional("histories", *histories("obs")),
        Variable("record_id", "record", str, "1", "record identifier", key=True, attrs={"cf_role": "timeseries_id"}),
        *(replace(RECORDS_NC[name], source="") for name in ("event", "station")),
        Variable("cluster", "record", np.int32, "1", "number of the recording to which the motion belongs, as a component or an azimuth"),
        *_NUMBERS,
        *OF_FRAME,
        Variable("reference_scale", "", float, "1", "scale at which ranks and distributions are computed", refers_to="scale"),
        Variable("demand_rank", "record structure", float, "1", "rank of the motion by peak rotation, 1 the largest"),
        Variable("mean_rank", "record", float, "1", "mean rank over the structures"),
        Variable("peak_share", "structure level", float, "1", "share of motions whose peak is at most the level", "band.share"),
        Variable("peak_share_low", "structure level", float, "1", "lower bound of peak_share, 90 % confidence", "band.low"),
        Variable("peak_share_high", "structure level", float, "1", "upper bound of peak_share, 90 % confidence", "band.high"),
        Variable("verdict_count", "structure scale outcome", np.int64, "1", "number of motions of each outcome"),
        Variable("measure_units", "measure", str, "1", "unit of the measure", choices=tuple(UNITS_OF_MEASURES.values())),
        Variable("fragility_outcome", "structure limit_state measure", Outcome, "1", "outcome of the fit", "fit.outcome"),
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
        Variable("fragility_safe_to", "structure limit_state measure", float, "1", "strongest intensity that does not reach the limit state, in the unit of the measure", "fit.safe_to"),
        Variable("fragility_overturned_from", "structure limit_state measure", float, "1", "weakest intensity that reaches the limit state, in the unit of the measure", "fit.overturned_from"),
        Variable("fragility_motions", "structure limit_state measure", np.int64, "1", "independent motions", "fit.motions"),
        Variable("fragility_observations", "structure limit_state measure", np.int64, "1", "motions times scales", "fit.observations"),
        Variable("fragility_overturned", "structure limit_state measure", np.int64, "1", "number of observations that reach the limit state", "fit.overturned"),
        Variable("log_likelihood", "structure limit_state measure", float, "1", "largest logarithm of the likelihood"),
        Variable("fragility_intensity", "measure point", float, "1", "intensity, in the unit of the measure"),
        Variable("fragility", "structure limit_state measure point", float, "1", "probability of reaching the limit state"),
        Variable("fragility_low", "structure limit_state measure point", float, "1", "lower bound of fragility, 90 % confidence"),
        Variable("fragility_high", "structure limit_state measure point", float, "1", "upper bound of fragility, 90 % confidence"),
        *optional("fragility curve",
            Variable("fragility_curve", "", str, "1", "form of the fragility curves", choices=("lognormal", "logistic"), comment="files without this variable have logistic curves"),
        ),
        Variable("better_measure", "structure", str, "1", "measure that predicts overturning better"),
        Variable("better_measure_reason", "structure", str, "1", "reason why a measure is better, or why none is"),
        Variable("bin_intensity", "structure measure bin", float, "1", "mean intensity of the class, in the unit of the measure"),
        Variable("bin_share", "structure limit_state measure bin", float, "1", "share of the class that reaches the limit state"),
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
        *optional("margins",
            Variable("critical_scale", "record structure", float, "1", "smallest multiple of the motion that overturns"),
            Variable("safe_islands", "record structure", np.int32, "1", "number of intervals above the critical scale in which the structure stands"),
            Variable("undecided", "record structure", _Known, "1", "whether the verdict under the unscaled motion changes with small perturbations, or is contradicted by an ensemble of plausible structures"),
        ),
        *optional("robust margins", *(replace(one, source="") for one in ROBUST_MARGINS)),
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
        *optional("design",
            Variable("design_dimension", "", str, "1", "dimension that is searched", choices=tuple(DIMENSIONS)),
            Variable("design_quantity", "", str, "1", "limited quantity", choices=tuple(QUANTITIES)),
            Variable("design_limit", "", float, "1", "limit of the quantity", also_units="m or m s-1"),
            Variable("design_required_share", "", float, "1", "share of motions that must stay below the limit"),
            Variable("design_value", "design_step", float, "m", "values that were tried", also_units="1"),
            Variable("design_share", "structure design_step", float, "1", "share of motions below the limit"),
            Variable("design_smallest", "structure", float, "m", "smallest value tried that meets the share", "found.smallest", also_units="1"),
            Variable("design_sure_from", "structure", float, "m", "smallest value that meets the share and above which every value tried does", "found.sure_from", also_units="1"),
        ),
        Variable("structure", "structure", str, "1", "name of the structure", key=True),
        Variable("scale", "scale", float, "1", "factor on the motion", key=True),
        Variable("measure", "measure", str, "1", "measure of intensity; sa_1s is the spectral acceleration at 1 s", key=True),
        Variable("limit_state", "limit_state", str, "1", "overturning, or a limit of a peak", key=True),
        Variable("outcome", "outcome", str, "1", "outcome at a scale", key=True, choices=(*OUTCOMES, *_FORMER[1:])),
        Variable("level", "level", float, "1", "level of |theta| / slenderness", key=True),
        *optional("histories",
            Variable("history_size", "history", np.int64, "1", "number of samples of the history", attrs={"sample_dimension": "obs"}),
            Variable("history_record", "history", np.int32, "1", "position along record", refers_to="record"),
            Variable("history_structure", "history", np.int32, "1", "position along structure", refers_to="structure"),
            Variable("history_scale", "history", np.int32, "1", "position along scale", refers_to="scale"),
        ),
    ),
)
# fmt: on
