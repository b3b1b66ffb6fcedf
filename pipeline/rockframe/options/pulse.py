"""Options of the search for pulses."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal, Self, get_args

from pydantic import AfterValidator, Field, model_validator

from rockframe.options.model import (
    Condition,
    Conditions,
    Options,
    Range,
    Seed,
    Wavelet,
    Wavelets,
    rule,
    value_error,
)

#: Smallest number of surrogates for which p can be as low as the significance level, 5 %.
FEWEST_SURROGATES: Final = 19
#: Largest number of surrogates: p can be as low as 1/10000, far below the significance level.
_MOST_SURROGATES: Final = 9_999
#: Step between the numbers of half cycles in the search.
_HALF_CYCLE_STEP: Final = 0.25


def _testable(surrogates: int) -> int:
    if 0 < surrogates < FEWEST_SURROGATES:
        allowed = (
            f"Must be 0, or {FEWEST_SURROGATES} to {_MOST_SURROGATES}: with fewer no p reaches 0.05"
        )
        raise value_error(f"{surrogates}. {allowed}")
    return surrogates


class PulseOptions(Options):
    """Options of the search for pulses.

    Examples
    --------
    >>> PulseOptions(surrogates=10)
    Traceback (most recent call last):
    rockframe.errors.ParameterError: surrogates 10. Must be 0, or 19 to 9999: ...
    >>> PulseOptions(most_half_cycles=2.0).half_cycles
    (1.0, 1.25, 1.5, 1.75, 2.0)
    """

    conditions: ClassVar[Conditions] = {
        **dict.fromkeys(
            ("scrambling", "seed"), Condition("surrogates", lambda options: options.surrogates > 0)
        ),
        "most_half_cycles": Condition(
            "wavelet mavroeidis_papageorgiou",
            lambda options: "mavroeidis_papageorgiou" in options.wavelet,
        ),
    }

    periods_s: Range = (0.2, 5.0)
    """Range of pulse periods that is searched [s], reduced to the periods that the record
    resolves."""
    wavelet: Wavelets = get_args(Wavelet)
    """Wavelets that are matched."""
    pulse_wavelet: Annotated[Wavelet | None, Field(examples=["symmetric_ricker"])] = None
    """Wavelet of the selected pulse; by default the symmetric or antisymmetric Ricker wavelet,
    whichever explains more of the record."""
    weighting: Literal["energy", "area", "none", "velocity"] = "energy"
    """Power of the period that weights the inner product; the paper uses energy."""
    most_half_cycles: Annotated[float, Field(ge=1.0, le=10.0)] = 3.0
    """Largest number of half cycles in the search with mavroeidis_papageorgiou."""
    runners_up: Annotated[int, Field(ge=0, le=100)] = 2
    """Number of further pulses of the selected wavelet, each found in the residual of those before
    it."""
    surrogates: Annotated[int, Field(ge=0, le=_MOST_SURROGATES), AfterValidator(_testable)] = 99
    """Largest number of surrogates that a record is compared with; 0 for no comparison."""
    scrambling: Literal["envelope", "plain"] = "envelope"
    """Surrogates with the record's envelope (envelope), or with even intensity (plain)."""
    seed: Seed = 0
    """Random seed of the surrogates."""

    @model_validator(mode="after")
    def _is_matched(self) -> Self:
        if self.pulse_wavelet is not None and self.pulse_wavelet not in self.wavelet:
            allowed = ", ".join(self.wavelet)
            raise rule(
                f"pulse_wavelet {self.pulse_wavelet!r} is not matched. Must be one of: {allowed}",
            )
        return self

    @property
    def half_cycles(self) -> tuple[float, ...]:
        """Numbers of half cycles that are searched before refinement."""
        rungs = math.ceil((self.most_half_cycles - 1.0) / _HALF_CYCLE_STEP) + 1
        step = (self.most_half_cycles - 1.0) / max(rungs - 1, 1)
        return (*(1.0 + k * step for k in range(rungs - 1)), self.most_half_cycles)

    def of_wavelets(self, *wavelets: str) -> PulseOptions:
        """Return the options of a search for some wavelets, without what has no effect on them."""
        values: dict[str, object] = {"wavelet": wavelets, "pulse_wavelet": None}
        if "mavroeidis_papageorgiou" not in wavelets:
            values["most_half_cycles"] = type(self).model_fields["most_half_cycles"].default
        return self.replaced(**values)
