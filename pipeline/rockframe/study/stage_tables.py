"""The tables of a study file that say what the stages are to do."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from rockframe.bounds import (
    FEWEST_SURROGATES,
    LARGEST_SCALE,
    MOST_RUNNERS_UP,
    MOST_SURROGATES,
)
from rockframe.errors import ParameterError
from rockframe.study.numbers import Numbers, NumbersFromZero, PositiveNumbers
from rockframe.study.sections import Bounds, Finite, Positive, Range, different
from rockframe.study.toml import RULE, VALUE, Strict

Wavelet = Literal[
    "symmetric_ricker", "antisymmetric_ricker", "ricker_any_phase", "mavroeidis_papageorgiou"
]
#: At least one wavelet, none twice.
Wavelets = Annotated[
    tuple[Wavelet, ...], Field(strict=False, min_length=1), AfterValidator(different)
]


def _enough(surrogates: int) -> int:
    if 0 < surrogates < FEWEST_SURROGATES:
        must_be = f"Must be 0, or {FEWEST_SURROGATES} to {MOST_SURROGATES}"
        raise PydanticCustomError(VALUE, f"{surrogates}. {must_be}")
    return surrogates


def _bounded(scales: tuple[float, ...]) -> tuple[float, ...]:
    if scales[-1] > LARGEST_SCALE:
        message = f"with {scales[-1]:g}. Must be at most {LARGEST_SCALE:g}"
        raise PydanticCustomError(VALUE, message)
    return scales


class PulseTable(Strict):
    """The search for the pulse of each record."""

    periods_s: Range = (0.2, 5.0)
    """Range of pulse periods that is searched [s]."""
    wavelet: Wavelets | None = None
    """Wavelets that are matched; without it all of them."""
    pulse_wavelet: Wavelet | None = None
    """Wavelet of the pulse that is used; without it the Ricker wavelet that explains more."""
    weighting: Literal["energy", "area", "none", "velocity"] = "energy"
    """Power of the period before the inner product: energy is the paper's."""
    most_half_cycles: Annotated[float, Field(ge=1.0, le=10.0)] = 3.0
    """Most half cycles of mavroeidis_papageorgiou that are searched."""
    runners_up: Annotated[int, Field(ge=0, le=MOST_RUNNERS_UP)] = 2
    """Further pulses of the wavelet that is used."""
    surrogates: Annotated[int, Field(ge=0, le=MOST_SURROGATES), AfterValidator(_enough)] = 99
    """Most surrogates that a record is compared with; 0 for no comparison."""
    scrambling: Literal["envelope", "plain"] = "envelope"
    """Surrogates keep the record's envelope, or shake evenly."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the surrogates."""


class RespondTable(Strict):
    """The response of each structure to each record."""

    vertical: bool = False
    """Let the ground move vertically too, as the vertical record of each motion says."""
    histories: Literal["none", "selected", "all"] = "all"
    """Motions that are written at each sample: none, selected (overturned or near), all."""
    margins: bool = True
    """Find critical scales and undecided verdicts, which takes most of the time."""
    pulses: bool = False
    """Add what the pulse of each record alone does."""


class DesignTable(Strict):
    """What is looked for: the smallest dimension that keeps the rotation below a limit."""

    dimension: Literal["height", "width", "mass_ratio"]
    """What is varied: height (slenderness kept), width (height kept), or mass ratio."""
    range: Annotated[tuple[Finite, Finite], Field(strict=False)]
    """Where it is looked for, in m for height and width."""
    limit: Positive = 0.5
    """Limit of theta/alpha."""
    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    """Share of the records that must stay below it."""
    steps: Annotated[int, Field(ge=2, le=10_000)] = 41
    """Values tried in the range."""

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        low, high = self.range
        alone = self.dimension == "mass_ratio" and low == 0.0  # a column alone
        if not (low < high and (low > 0.0 or alone)):
            least = "zero or positive" if self.dimension == "mass_ratio" else "positive"
            message = f"screen.design.range [{low:g}, {high:g}]. Must be {least}, and increase"
            raise PydanticCustomError(RULE, message)
        return self


class ScreenTable(Strict):
    """The screening of the structures by the records at many scales."""

    scales: Annotated[PositiveNumbers, AfterValidator(_bounded)] = (
        0.5,
        0.75,
        1.0,
        1.25,
        1.5,
        2.0,
        2.5,
        3.0,
    )
    """Multiples of the records: a list, or { from = 0.25, to = 3.0, count = 12 }."""
    azimuths_degree: Numbers | None = None
    """Turn each pair of horizontals toward these azimuths."""
    vertical: bool = False
    """Let the ground move vertically too."""
    histories: Literal["none", "selected", "all"] = "none"
    """Motions that are written at each sample."""
    margins: bool = True
    """Find critical scales and safe islands, which take most of the time."""
    pulse_period_s: Bounds | None = None
    """Only records whose best pulse has a period from and to [s]."""
    pulse_length_m: Bounds | None = None
    """Only records whose best pulse has a length L_p = a_p T_p^2 from and to [m]."""
    pulse_like: bool | None = None
    """Only records whose pulse is more than chance, or only the others."""
    hazard: str | None = None
    """Hazard curve of the site: CSV of annual_rate and one of pga_g, pgv_m_s, a_p_g, L_p_m."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the draws of the bands."""
    design: DesignTable | None = None
    """What is looked for besides: [screen.design]."""

    @model_validator(mode="after")
    def _turned(self) -> Self:
        """Azimuths must be of different motions, of which no pulse is known."""
        azimuths = [f"{azimuth % 360.0:g}" for azimuth in self.azimuths_degree or ()]
        for azimuth in azimuths:
            if azimuths.count(azimuth) > 1:
                message = f"screen.azimuths_degree with {azimuth} twice, or 360 apart. Must differ"
                raise PydanticCustomError(RULE, message)
        for name in ("pulse_period_s", "pulse_length_m", "pulse_like"):
            if azimuths and getattr(self, name) is not None:
                message = f"screen.{name} beside screen.azimuths_degree. Must be one of them"
                raise PydanticCustomError(RULE, message)
        return self


class SpectrumTable(Strict):
    """Which pulses overturn which frames: minimum overturning acceleration spectra."""

    wavelet: Wavelets
    """Forms of the pulse."""
    slenderness_degree: PositiveNumbers
    """Slenderness of the columns [degree]."""
    mass_ratio: NumbersFromZero = (0.0,)
    """Mass of the beam over that of all columns; 0 is a column alone."""
    frequency_ratio: PositiveNumbers
    """omega_p / p, p of the column alone: a list, or evenly spaced."""
    max_amplitude: Annotated[float, Field(gt=1.0, le=1e4)] = 30.0
    """Where the scan ends, a_p / (g tan slenderness)."""
    amplitude_step: Positive | None = None
    """Step of the scan; edges are refined."""
    phase_degree: Finite = 0.0
    """Phase of wavelets that have one."""
    half_cycles: Finite | None = None
    """Half cycles of mavroeidis_papageorgiou."""

    @model_validator(mode="after")
    def _pulses(self) -> Self:
        """Each wavelet must take the phase and the half cycles that are stated."""
        from rockframe.wavelets import Pulse  # numpy, which other studies need not wait for

        phase = math.radians(self.phase_degree)
        for name in self.wavelet:
            try:
                Pulse(wavelet=name, a_p=1.0, T_p=1.0, phase=phase, half_cycles=self.half_cycles)
            except ParameterError as error:
                stated = f"spectrum.phase_degree {self.phase_degree:g}: " if phase else ""
                raise PydanticCustomError(RULE, stated + str(error).rstrip(".")) from None
        return self


class RockingSpectrumTable(Strict):
    """How the records rock columns of any size."""

    slenderness_degree: PositiveNumbers
    """Slenderness of the columns [degree]."""
    mass_ratio: NumbersFromZero = (0.0,)
    """Mass of the beam over that of all columns; 0 is a column alone."""
    column_period_s: PositiveNumbers | None = None
    """2 pi / p of the columns alone; without it every 0.1 s from 1.5 to 15."""
