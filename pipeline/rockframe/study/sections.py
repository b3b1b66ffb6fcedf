"""The tables of a study file: records, filters, and what each stage is to do."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import AfterValidator, Field, WithJsonSchema, model_validator
from pydantic_core import PydanticCustomError

from rockframe.study.toml import RULE, VALUE, Strict
from rockframe.units import ACCELERATION_UNITS


def _known_units(units: str) -> str:
    if units not in ACCELERATION_UNITS:
        known = ", ".join(ACCELERATION_UNITS)
        raise PydanticCustomError(VALUE, f"{units!r}. Must be one of: {known}")
    return units


def _increasing(bounds: tuple[float, float]) -> tuple[float, float]:
    low, high = bounds
    if math.isnan(low) or math.isnan(high) or low > high:
        raise PydanticCustomError(VALUE, f"[{low:g}, {high:g}]. Must be the lower bound first")
    return bounds


def _positive(bounds: tuple[float, float]) -> tuple[float, float]:
    if not 0.0 < bounds[0] < bounds[1] < math.inf:
        low, high = bounds
        raise PydanticCustomError(VALUE, f"[{low:g}, {high:g}]. Must be two numbers that increase")
    return bounds


#: Of accelerations.
Units = Annotated[
    str,
    AfterValidator(_known_units),
    WithJsonSchema({"enum": list(ACCELERATION_UNITS), "type": "string"}),
]
#: A number that is one.
Finite = Annotated[float, Field(allow_inf_nan=False)]
#: A number above zero.
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
#: A closed interval; both ends belong to it.
Bounds = Annotated[tuple[float, float], Field(strict=False), AfterValidator(_increasing)]
#: A range of positive numbers.
Range = Annotated[tuple[float, float], Field(strict=False), AfterValidator(_positive)]


def different(texts: tuple[str, ...]) -> tuple[str, ...]:
    """Refuse a text that is stated twice."""
    for text in texts:
        if texts.count(text) > 1:
            raise PydanticCustomError(VALUE, f"{text!r}. Must not be stated twice")
    return texts


#: At least one text, none twice.
Texts = Annotated[tuple[str, ...], Field(strict=False, min_length=1), AfterValidator(different)]


class RecordsTable(Strict):
    """Which record files are read, and what they do not say of themselves."""

    paths: Texts | None = None
    """Record files and folders, relative to this file. Without it, the bundled records."""
    units: Units | None = None
    """Acceleration units of files that do not state them: g, gal, cm/s2, mm/s2 or m/s2."""
    time_step_s: Positive | None = None
    """Time step of text files that do not state it [s]."""
    station_xml: str | None = None
    """StationXML of miniSEED files; without it, the *.xml beside each file."""
    water_level_db: Positive | None = None
    """Take the full response out of miniSEED files, with this water level [dB]."""
    band_pass_hz: Range = (0.1, 40.0)
    """Corner frequencies for uncorrected records [Hz]."""
    uncorrected: bool = False
    """Take every record for uncorrected."""
    catalogue: str | None = None
    """CSV of facts about the files; without it, catalogue.csv of each folder."""
    limits: str | None = None
    """TOML file with a [passport] table: limits of the checks of each record."""
    strict: bool = False
    """Stop at the first file that is rejected."""
    azimuth_degree: Finite | None = None
    """Put the motion toward this azimuth in the place of the two horizontals of each station."""
    strike_degree: Finite | None = None
    """Put the motions normal and parallel to a fault of this strike in their place."""

    @model_validator(mode="after")
    def _turned_once(self) -> Self:
        if self.azimuth_degree is not None and self.strike_degree is not None:
            message = "records.azimuth_degree beside records.strike_degree. Must be one of them"
            raise PydanticCustomError(RULE, message)
        return self


class Filters(Strict):
    """Which of the records that were read go on; a record of which a value is unknown does not.

    Examples
    --------
    >>> Filters(magnitude=(6.0, 8.0)).refusal(magnitude=5.2)
    'magnitude 5.2. Must be from 6 to 8'
    >>> Filters(magnitude=(6.0, 8.0)).refusal(magnitude=7.1)
    ''
    """

    magnitude: Bounds | None = None
    """Magnitude of the earthquake, from and to."""
    epicentral_distance_km: Bounds | None = None
    """Epicentral distance, from and to [km]."""
    vs30_m_s: Bounds | None = None
    """Shear-wave velocity of the upper 30 m at the station, from and to [m/s]."""
    pga_g: Bounds | None = None
    """Peak ground acceleration after processing, from and to [g]."""
    pgv_m_s: Bounds | None = None
    """Peak ground velocity after processing, from and to [m/s]."""

    def stated(self) -> dict[str, list[float]]:
        """Return the bounds that are stated, as JSON has them."""
        return {name: list(bounds) for name, bounds in self.model_dump(exclude_none=True).items()}

    def refusal(self, **values: float) -> str:
        """Return the first reason why a record of these values does not go on; empty if it does."""
        for name, value in values.items():
            bounds = getattr(self, name)
            if bounds is None:
                continue
            low, high = bounds
            if math.isnan(value):
                return f"{name} unknown. Must be from {low:g} to {high:g}"
            if not low <= value <= high:
                return f"{name} {value:g}. Must be from {low:g} to {high:g}"
        return ""


class FiguresTable(Strict):
    """The figures: of single records, of screenings, of spectra."""

    most: Annotated[int, Field(ge=0)] = 24
    """Most figures of single records; of more, those under which a structure stands and turns
    furthest. 0 for no figures at all, of screenings and spectra neither."""


class ReportTable(Strict):
    """The page of the run."""

    histories: Annotated[int, Field(ge=1)] = 150
    """Most histories in the page."""
    rows: Annotated[int, Field(ge=1)] = 5000
    """Most rows of the table in the page; all are counted."""


class BatchesTable(Strict):
    """How the work is divided; results do not depend on it."""

    records: Annotated[int, Field(ge=1)] = 50
    """Record files for each batch; of more than 150 batches, the batches are larger."""
