"""Range of periods that a record resolves, and the padded record."""

from __future__ import annotations

from typing import Final

from rockframe.errors import ParameterError
from rockframe.matching.signal import Samples, Signal, Weighting, signal_of
from rockframe.options.pulse import PulseOptions
from rockframe.wavelets.family import WAVELETS

#: Least number of time steps in the period of a wavelet.
_STEPS_PER_PERIOD: Final = 8


def period_range(size: int, time_step: float, options: PulseOptions) -> tuple[float, float]:
    """Return the range of periods that a record resolves [s].

    Raises
    ------
    ParameterError
        If the record resolves none of the requested periods.
    """
    shortest, longest = options.periods_s
    low = max(shortest, _STEPS_PER_PERIOD * time_step)
    high = min(longest, time_step * (size - 1))
    if high <= low:
        raise ParameterError(
            f"Invalid range of periods from {shortest:g} to {longest:g} s for a record of "
            f"{time_step * (size - 1):g} s in steps of {time_step:g} s. Must overlap with the "
            f"range from {_STEPS_PER_PERIOD} time steps to the record's duration."
        )
    return low, high


def prepared(
    samples: Samples, time_step: float, options: PulseOptions, longest_period: float
) -> Signal:
    """Return the transformed record, padded for the longest wavelet."""
    parts = [
        part for name in options.wavelet for part in WAVELETS[name].parts(options.most_half_cycles)
    ]
    reach = max(part.reach for part in parts) * longest_period
    return signal_of(samples, time_step, Weighting(options.weighting), reach)
