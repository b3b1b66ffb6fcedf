"""Datasets of figures of pulses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
import xarray as xr

from rockframe.matching.curve import match_curve, scalogram
from rockframe.matching.match import PulseMatch
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.schema.declare import texts, variable
from rockframe.signals.processing import peak

#: Periods and times of the picture of a transform, at most.
_PERIODS: Final = 160
_TIMES: Final = 1500


def pulse_dataset(record: Record, match: PulseMatch, tested: str = "") -> xr.Dataset:
    """Return the accelerations of a record and its pulse on ``time``.

    Parameters
    ----------
    record : Record
        The record.
    match : PulseMatch
        A pulse in it.
    tested : str
        Result of its test against noise, as `pulse_words` returns it.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=0.4, time=0.1)
    >>> match = PulseMatch(pulse=pulse, match_index=0.9, at_period_bound=False)
    >>> pulse_dataset(record, match)["pulse"].values.round(3)
    array([-0.378,  3.   , -0.378])
    """
    samples = variable("time", record.acceleration, "m s-2", "ground acceleration")
    pulse = match.pulse.acceleration(record.time)
    return xr.Dataset(
        {
            "acceleration": samples,
            "pulse": variable("time", pulse, "m s-2", "acceleration of the pulse"),
            **_numbers(record, match, tested),
        },
        coords={"time": variable("time", record.time, "s", "time since the first sample")},
    )


def scalogram_dataset(
    record: Record, match: PulseMatch, options: PulseOptions, tested: str = ""
) -> xr.Dataset:
    """Return |C| over the root of the record's energy, on ``period`` and ``time``.

    Parameters
    ----------
    record : Record
        The record.
    match : PulseMatch
        The best pulse of one of the two Ricker wavelets.
    options : PulseOptions
        Range of periods.
    tested : str
        Result of the test against noise, as `pulse_words` returns it.

    Raises
    ------
    ParameterError
        If the pulse is of another wavelet.
    """
    periods = np.geomspace(*options.periods_s, _PERIODS)
    step = record.time_step
    picture = np.abs(scalogram(record.acceleration, step, match.pulse.wavelet, periods))
    picture /= math.sqrt(float(record.acceleration @ record.acceleration) * step)
    stride = max(1, math.ceil(record.acceleration.size / _TIMES))
    # of the times between two that are drawn the largest is: no ridge is lost
    starts = np.arange(0, record.acceleration.size, stride)
    return xr.Dataset(
        {
            "match_index": variable(
                ("period", "time"),
                np.maximum.reduceat(picture, starts, axis=1),
                "1",
                "cosine between record and wavelet",
            ),
            **_numbers(record, match, tested),
        },
        coords={
            "period": variable("period", periods, "s", "T_p"),
            "time": variable("time", record.time[starts], "s", "time since the first sample"),
        },
    )


def match_curve_dataset(
    record: Record, matches: Mapping[str, PulseMatch], options: PulseOptions
) -> xr.Dataset:
    """Return the largest match index at each period, on ``wavelet`` and ``period``.

    Parameters
    ----------
    record : Record
        The record.
    matches : mapping of str to PulseMatch
        The best pulse of each wavelet.
    options : PulseOptions
        Options of the search.

    Raises
    ------
    ParameterError
        If the record is constant or not finite, or no period is left to search.
    """
    periods, curves = match_curve(record.acceleration, record.time_step, options)
    found = [matches[name] for name in curves]

    def of_match(values: list[float], units: str, long_name: str) -> xr.Variable:
        return variable("wavelet", np.array(values), units, long_name)

    return xr.Dataset(
        {
            "match_index": variable(
                ("wavelet", "period"),
                np.stack(list(curves.values())),
                "1",
                "largest cosine between record and wavelet",
            ),
            "record_id": ((), record.record_id),
            "T_p": of_match([m.pulse.T_p for m in found], "s", "period of the best match"),
            "best_match": of_match([m.match_index for m in found], "1", "its match index"),
        },
        coords={
            "period": variable("period", periods, "s", "T_p"),
            "wavelet": texts("wavelet", list(curves), "mother wavelet"),
        },
        attrs={"weighting": options.weighting, "most_half_cycles": options.most_half_cycles},
    )


def _numbers(record: Record, match: PulseMatch, tested: str) -> dict[str, xr.Variable]:
    pulse = match.pulse
    return {
        "record_id": variable((), record.record_id, "1", "record identifier"),
        "wavelet": variable((), pulse.wavelet, "1", "mother wavelet"),
        "a_p": variable((), pulse.a_p, "m s-2", "amplitude of the pulse"),
        "T_p": variable((), pulse.T_p, "s", "period of the pulse"),
        "pulse_time": variable((), pulse.time, "s", "centre of the pulse"),
        "reach": variable((), pulse.mother.reach * pulse.T_p, "s", "half-length of the pulse"),
        "best_match": variable((), match.match_index, "1", "match index of the pulse"),
        "tested": variable((), tested, "1", "result of the test against noise"),
        "pga": variable((), peak(record.acceleration), "m s-2", "peak ground acceleration"),
    }
