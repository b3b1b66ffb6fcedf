"""Response to the pulse of a record alone, compared with the response to the record."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from rockframe.rocking.response import Response, respond
from rockframe.rocking.stated_verdict import Verdict

if TYPE_CHECKING:
    from rockframe.wavelets.pulse import Pulse


@dataclass(frozen=True)
class ToPulse:
    """The response to the pulse of a record alone.

    Parameters
    ----------
    verdict : Verdict
        Verdict under the pulse alone.
    peak_rotation_ratio : float
        Largest |theta| / alpha under the pulse alone [1].
    error : float
        Relative error of the peak rotation: the peak under the pulse over the peak under the
        record, minus 1. NaN if either overturns the frame, or the record does not uplift it.
    """

    verdict: Verdict
    peak_rotation_ratio: float
    error: float


def with_pulse(response: Response, pulse: Pulse) -> Response:
    """Return a response to a record with the response to its pulse added as `to_pulse`.

    Parameters
    ----------
    response : Response
        Response to the record.
    pulse : Pulse
        The record's pulse.

    Examples
    --------
    >>> from rockframe import Pulse, Record, RockingFrame
    >>> import numpy as np
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.5 * 9.81, T_p=1.5, time=5.0)
    >>> samples = pulse.acceleration(0.005 * np.arange(2000))
    >>> record = Record(record_id="pulse", acceleration=samples, time_step=0.005)
    >>> round(abs(with_pulse(respond(bent, record), pulse).to_pulse.error), 3)
    0.0
    """
    alone = respond(response.frame, pulse)
    error = math.nan
    stands = Verdict.OVERTURNED not in (response.verdict, alone.verdict)
    if stands and response.peak_rotation > 0.0:
        error = alone.peak_rotation / response.peak_rotation - 1.0
    return replace(response, to_pulse=ToPulse(alone.verdict, alone.peak_rotation_ratio, error))
