"""records.nc: samples and metadata of the records; pulses.nc: their pulses."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.matching.likeness import PulseVerdict
from rockframe.record import Orientation, SiteType
from rockframe.results.schema.declare import FileKind, Variable, optional
from rockframe.signals.passport import CheckVerdict
from rockframe.wavelets.family import WAVELETS


class _Trigger(IntEnum):
    IN_TIME = 0
    LATE = 1


# fmt: off
RECORDS_NC: Final = FileKind(
    "records", "ingest", "Strong-motion records",
    (
        Variable("acceleration", "obs", float, "m s-2", "ground acceleration, all records one after the other"),
        Variable("record_id", "record", str, "1", "record identifier", "record", key=True, attrs={"cf_role": "timeseries_id"}),
        Variable("row_size", "record", np.int64, "1", "number of samples of the record", attrs={"sample_dimension": "obs"}),
        Variable("time_step", "record", float, "s", "interval between samples", "record", valid="positive"),
        Variable("azimuth", "record", float, "degree", "direction of positive acceleration, clockwise from north", "record"),
        Variable("magnitude", "record", float, "1", "magnitude of the earthquake", "record"),
        Variable("epicentral_distance", "record", float, "km", "distance to the epicentre", "record"),
        Variable("distance_rrup", "record", float, "km", "shortest distance to the rupture", "record"),
        Variable("distance_rjb", "record", float, "km", "Joyner-Boore distance: to the surface projection of the rupture", "record"),
        Variable("distance_hypocentral", "record", float, "km", "distance to the hypocentre", "record"),
        Variable("vs30", "record", float, "m s-1", "mean velocity of shear waves in the uppermost 30 m", "record"),
        Variable("lowest_usable_frequency", "record", float, "Hz", "lowest usable frequency, as the archive states", "record"),
        Variable("archive_pulse_period", "record", float, "s", "period of the velocity pulse, as the archive states", "record"),
        Variable("peak_ratio", "record", float, "1", "peak in the file over the peak that its header states, before processing", "record"),
        Variable("filter_low", "record", float, "Hz", "highest lower corner of the stated filters", "record"),
        Variable("filter_high", "record", float, "Hz", "lowest upper corner of the stated filters", "record"),
        Variable("pga", "record", float, "m s-2", "peak ground acceleration", valid="finite"),
        Variable("pgv", "record", float, "m s-1", "peak ground velocity, with the ground at rest before the record", valid="finite"),
        *optional("passport",
            Variable("arias_intensity", "record", float, "m s-1", "Arias intensity", "measures"),
            Variable("significant_duration", "record", float, "s", "significant duration, 5 to 95 % of the Arias intensity", "measures"),
            Variable("significant_duration_75", "record", float, "s", "significant duration, 5 to 75 % of the Arias intensity", "measures"),
            Variable("strong_start", "record", float, "s", "time of 5 % of the Arias intensity, since the first sample", "measures"),
            Variable("usable_period_shortest", "record", float, "s", "shortest usable period; 0 if none is usable", "measures"),
            Variable("usable_period_longest", "record", float, "s", "longest usable period; 0 if none is usable", "measures"),
            Variable("end_velocity", "record", float, "m s-1", "velocity at the end of the record", "measures"),
            Variable("end_displacement", "record", float, "m", "displacement at the end of the record", "measures"),
            Variable("noise_level", "record", float, "m s-2", "root mean square of the acceleration before the event, as recorded", "measures"),
        ),
        Variable("event", "record", str, "1", "name of the earthquake", "record"),
        Variable("station", "record", str, "1", "code or name of the station", "record"),
        Variable("network", "record", str, "1", "code of the network", "record"),
        Variable("mechanism", "record", str, "1", "mechanism of the earthquake", "record"),
        Variable("component", "record", str, "1", "name of the component in the archive", "record"),
        Variable("start_time", "record", str, "1", "time of the first sample, UTC", "record"),
        Variable("facts_source", "record", str, "1", "source of event, magnitude and distance, from the catalogue", "record"),
        Variable("source_file", "record", str, "1", "name of the file that held the record", "record"),
        Variable("source_format", "record", str, "1", "format of that file", "record"),
        Variable("source_sha256", "record", str, "1", "SHA-256 of that file", "record"),
        Variable("instrument_file", "record", str, "1", "name of the StationXML file that turned counts into acceleration", "record"),
        Variable("instrument_sha256", "record", str, "1", "SHA-256 of that StationXML file", "record"),
        Variable("orientation", "record", Orientation, "1", "direction of the component", "record"),
        Variable("site_type", "record", SiteType, "1", "site of the sensor, if the header states it", "record"),
        *optional("passport",
            Variable("late_trigger", "record", _Trigger, "1", "trigger of the recording", "passport"),
            Variable("passport", "record", CheckVerdict, "1", "verdict of the record passport", "passport.verdict"),
        ),
        Variable("processing", "record", str, "1", "processing after reading"),
        *optional("both horizontals",
            Variable("pga_rotd50", "record", float, "m s-2", "RotD50 of the peak ground acceleration of both horizontals"),
            Variable("pga_rotd100", "record", float, "m s-2", "RotD100 of the peak ground acceleration of both horizontals"),
            Variable("pgv_rotd50", "record", float, "m s-1", "RotD50 of the peak ground velocity of both horizontals"),
            Variable("pgv_rotd100", "record", float, "m s-1", "RotD100 of the peak ground velocity of both horizontals"),
            Variable("azimuth_rotd100", "record", float, "degree", "azimuth of the largest acceleration, clockwise from north"),
        ),
    ),
)
# fmt: on


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
