"""Datasets of figures of pulses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import xarray as xr

from rockframe.matching.curve import match_curve, scalogram
from rockframe.matching.match import PulseMatch
from rockframe.options.pulse import PulseOptions
from rockframe.record import Record
from rockframe.results.schema.plots import MATCH_CURVE, PULSE, SCALOGRAM
from rockframe.signals.processing import peak

#: Largest numbers of periods and times in the figure of a transform.
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
        Result of the pulse's test against noise, as `pulse_words` returns it.

    Examples
    --------
    >>> from rockframe import Pulse
    >>> record = Record(record_id="shake", acceleration=np.array([0.0, 3.0, 0.0]), time_step=0.1)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=3.0, T_p=0.4, time=0.1)
    >>> match = PulseMatch(pulse=pulse, match_index=0.9, at_period_bound=False)
    >>> pulse_dataset(record, match)["pulse"].values.round(3)
    array([-0.378,  3.   , -0.378])
    """
    return PULSE.dataset(
        {
            "acceleration": record.acceleration,
            "pulse": match.pulse.acceleration(record.time),
            "time": record.time,
            **_numbers(record, match, tested),
        }
    )


def scalogram_dataset(
    record: Record, match: PulseMatch, options: PulseOptions, tested: str = ""
) -> xr.Dataset:
    """Return wavelet coefficients |C| over the root of the record's energy, by period and time.

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
        If the pulse has another wavelet.
    """
    periods = np.geomspace(*options.periods_s, _PERIODS)
    step = record.time_step
    picture = np.abs(scalogram(record.acceleration, step, match.pulse.wavelet, periods))
    picture /= math.sqrt(float(record.acceleration @ record.acceleration) * step)
    stride = max(1, math.ceil(record.acceleration.size / _TIMES))
    # draw the largest of the skipped times, so that no ridge is lost
    starts = np.arange(0, record.acceleration.size, stride)
    return SCALOGRAM.dataset(
        {
            "match_index": np.maximum.reduceat(picture, starts, axis=1),
            "period": periods,
            "time": record.time[starts],
            **_numbers(record, match, tested),
        }
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
    return MATCH_CURVE.dataset(
        {
            "match_index": np.stack(list(curves.values())),
            "record_id": record.record_id,
            "T_p": [one.pulse.T_p for one in found],
            "best_match": [one.match_index for one in found],
            "period": periods,
            "wavelet": list(curves),
        }
    ).assign_attrs(weighting=options.weighting, most_half_cycles=options.most_half_cycles)


def _numbers(record: Record, match: PulseMatch, tested: str) -> dict[str, Any]:
    pulse = match.pulse
    return {
        "record_id": record.record_id,
        "wavelet": pulse.wavelet,
        "a_p": pulse.a_p,
        "T_p": pulse.T_p,
        "pulse_time": pulse.time,
        "reach": pulse.mother.reach * pulse.T_p,
        "best_match": match.match_index,
        "tested": tested,
        "pga": peak(record.acceleration),
    }
