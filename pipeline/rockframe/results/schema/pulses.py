"""pulses.nc: the pulses of the records."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np

from rockframe.matching.likeness import PulseVerdict
from rockframe.results.schema.declare import FileKind, Variable, optional
from rockframe.wavelets.family import WAVELETS


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
