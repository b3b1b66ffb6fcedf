"""How pulses are looked for, and what a record allows of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import ParameterError
from rockframe.matching.signal import Signal, signal_of
from rockframe.matching.weighting import Weighting
from rockframe.wavelets import WAVELETS

Float = NDArray[np.float64]

#: Default range of periods [s]; the paper does not state its own. It is part of the method.
SHORTEST_PERIOD: Final = 0.2
LONGEST_PERIOD: Final = 5.0
#: Default of the largest number of half cycles; the match grows with it: it is part of the method.
MOST_HALF_CYCLES: Final = 3.0
#: A wavelet shorter than so many time steps is not resolved by the samples.
_STEPS_PER_PERIOD: Final = 8
#: Interval between the numbers of half cycles of the search.
_HALF_CYCLE_STEP: Final = 0.25


@dataclass(frozen=True, kw_only=True)
class MatchOptions:
    """How pulses are looked for.

    Parameters
    ----------
    wavelets : tuple of str
        Names of the wavelets.
    weighting : Weighting
        Of the transform.
    shortest_period, longest_period : float
        Range of T_p [s]; cut to what the record resolves: 8 time steps to its duration.
    most_half_cycles : float
        Numbers of half cycles are searched from 1 to this.

    Raises
    ------
    ParameterError
        If a wavelet is unknown, or a range is none.

    Examples
    --------
    >>> MatchOptions(most_half_cycles=2.0).half_cycles
    (1.0, 1.25, 1.5, 1.75, 2.0)
    """

    wavelets: tuple[str, ...] = tuple(WAVELETS)
    weighting: Weighting = Weighting.ENERGY
    shortest_period: float = SHORTEST_PERIOD
    longest_period: float = LONGEST_PERIOD
    most_half_cycles: float = MOST_HALF_CYCLES

    def __post_init__(self) -> None:
        for wavelet in self.wavelets:
            if wavelet not in WAVELETS:
                known = ", ".join(WAVELETS)
                raise ParameterError(f"Invalid wavelet {wavelet!r}. Must be one of: {known}.")
        if not self.wavelets:
            raise ParameterError("Invalid wavelets: none. Must be one or more.")
        if not (0.0 < self.shortest_period < self.longest_period < math.inf):
            raise ParameterError(
                f"Invalid range of periods from {self.shortest_period!r} to "
                f"{self.longest_period!r} s. Must be two positive numbers, the shorter one first."
            )
        if not 1.0 <= self.most_half_cycles <= 10.0:
            raise ParameterError(
                f"Invalid largest number of half cycles {self.most_half_cycles!r}. "
                "Must be from 1 to 10."
            )

    @property
    def half_cycles(self) -> tuple[float, ...]:
        """Numbers of half cycles of the search, before refinement."""
        rungs = math.ceil((self.most_half_cycles - 1.0) / _HALF_CYCLE_STEP) + 1
        return tuple(np.linspace(1.0, self.most_half_cycles, rungs).tolist())


def period_range(size: int, time_step: float, options: MatchOptions) -> tuple[float, float]:
    """Return the range of periods that a record allows [s].

    Raises
    ------
    ParameterError
        If it allows none of those that are asked for.
    """
    shortest, longest = options.shortest_period, options.longest_period
    low = max(shortest, _STEPS_PER_PERIOD * time_step)
    high = min(longest, time_step * (size - 1))
    if high <= low:
        raise ParameterError(
            f"Invalid range of periods from {shortest:g} to {longest:g} s for a record of "
            f"{time_step * (size - 1):g} s in steps of {time_step:g} s. Must overlap "
            f"with {_STEPS_PER_PERIOD} time steps to the record's duration."
        )
    return low, high


def prepared(
    samples: Float, time_step: float, options: MatchOptions, longest_period: float
) -> Signal:
    """Return the record as the wavelets meet it, with room for the longest of them."""
    parts = [
        part for name in options.wavelets for part in WAVELETS[name].parts(options.most_half_cycles)
    ]
    reach = max(part.reach for part in parts) * longest_period
    return signal_of(samples, time_step, options.weighting, reach)
