"""Options of spectra."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rockframe.errors import ParameterError
from rockframe.options.fields import (
    Finite,
    NumbersFromZero,
    Positive,
    PositiveNumbers,
    Wavelets,
)
from rockframe.options.model import RULE, Options


class SpectrumOptions(Options):
    """Minimum overturning acceleration spectra of pulses."""

    wavelet: Annotated[Wavelets, Field(examples=[("mavroeidis_papageorgiou",)])]
    """Wavelets of the pulses."""
    slenderness_degree: Annotated[PositiveNumbers, Field(examples=[(10.0, 14.0)])]
    """Slenderness of the rectangular columns [degree]."""
    mass_ratio: NumbersFromZero = (0.0,)
    """Mass of the beam over that of all columns; 0 is a column alone."""
    frequency_ratio: Annotated[
        PositiveNumbers, Field(examples=[{"from": 1.0, "to": 8.0, "count": 71}])
    ]
    """Frequency ratio omega_p / p, with p of the column alone."""
    max_amplitude: Annotated[float, Field(gt=1.0, le=1e4)] = 30.0
    """Largest amplitude a_p / (g tan slenderness) in the search."""
    amplitude_step: Positive = 0.005
    """Step of the amplitude in the search. The ends of each range of overturning are refined; a
    range narrower than the step may be missed."""
    phase_degree: Finite = 0.0
    """Phase, for wavelets that have a phase [degree]."""
    half_cycles: Annotated[Finite | None, Field(examples=[2.0])] = None
    """Number of half cycles of mavroeidis_papageorgiou."""

    @model_validator(mode="after")
    def _pulses(self) -> Self:
        """Require a phase and a number of half cycles that are valid for each wavelet."""
        from rockframe.wavelets.pulse import Pulse

        phase = math.radians(self.phase_degree)
        for name in self.wavelet:
            try:
                Pulse(wavelet=name, a_p=1.0, T_p=1.0, phase=phase, half_cycles=self.half_cycles)
            except ParameterError as error:
                stated = f"phase_degree {self.phase_degree:g}: " if phase else ""
                raise PydanticCustomError(RULE, stated + str(error).rstrip(".")) from None
        return self


class RockingSpectrumOptions(Options):
    """Rocking spectra of the records."""

    slenderness_degree: Annotated[PositiveNumbers, Field(examples=[(10.0, 14.0)])]
    """Slenderness of the columns [degree]."""
    mass_ratio: NumbersFromZero = (0.0,)
    """Mass of the beam over that of all columns; 0 is a column alone."""
    column_period_s: PositiveNumbers = tuple(round(1.5 + 0.1 * k, 1) for k in range(136))
    """2 pi / p of the columns alone [s]; by default every 0.1 s from 1.5 to 15."""
    record: Annotated[str | None, Field(examples=["Ridgecrest2019-CCC-360"])] = None
    """Only the record of this identifier."""
