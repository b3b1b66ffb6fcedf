"""Options of reading record files, and filters of records."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from rockframe.options.fields import Bounds, File, Finite, Positive, Range, Site, Units
from rockframe.options.model import RULE, Options


class IngestOptions(Options):
    """Options of reading and processing record files."""

    units: Annotated[Units | None, Field(examples=["g"])] = None
    """Acceleration units of files that do not state them: g, gal, cm/s2, mm/s2 or m/s2 (a file
    that states other units is rejected)."""
    time_step_s: Annotated[Positive | None, Field(examples=[0.01])] = None
    """Time step of text files that do not state it [s] (a file that states another time step is
    rejected)."""
    column: Annotated[str | None, Field(examples=["acc_x"])] = None
    """Name or number of the column of acceleration in text files; by default the columns whose
    names mean acceleration."""
    station_xml: Annotated[File | None, Field(examples=["station.xml"])] = None
    """StationXML of miniSEED and SAC files; by default every .xml file beside each file or in its
    archive."""
    water_level_db: Annotated[Positive | None, Field(examples=[60.0])] = None
    """Remove the full instrument response from miniSEED files, with this water level [dB]; by
    default they are divided by the sensitivity."""
    band_pass_hz: Range = (0.1, 40.0)
    """Corner frequencies for uncorrected records [Hz]."""
    uncorrected: bool = False
    """Treat every record as uncorrected; by default text and AT2 files count as corrected."""
    catalogue: Annotated[File | None, Field(examples=["catalogue.csv"])] = None
    """CSV of event, station, magnitude and distance of each file; by default catalogue.csv of each
    folder."""
    limits: Annotated[File | None, Field(examples=["limits.toml"])] = None
    """TOML file with a [passport] table: limits of the checks of each record."""
    strict: bool = False
    """Stop at the first rejected file, and write nothing."""
    azimuth_degree: Annotated[Finite | None, Field(examples=[30.0])] = None
    """Replace the two horizontals of each station by the motion toward this azimuth [degree]."""
    strike_degree: Annotated[Finite | None, Field(examples=[120.0])] = None
    """Replace the two horizontals of each station by the motions normal and parallel to a fault of
    this strike [degree]."""

    @model_validator(mode="after")
    def _one_rotation(self) -> Self:
        if self.azimuth_degree is not None and self.strike_degree is not None:
            raise PydanticCustomError(
                RULE, "azimuth_degree and strike_degree both stated. State only one of them"
            )
        return self

    @property
    def azimuths(self) -> tuple[float, ...]:
        """Azimuths of the rotated motions [degree]; empty if records are not rotated.

        Examples
        --------
        >>> IngestOptions(strike_degree=320.0).azimuths
        (50.0, 320.0)
        """
        if self.strike_degree is not None:
            return ((self.strike_degree + 90.0) % 360.0, self.strike_degree)
        return () if self.azimuth_degree is None else (self.azimuth_degree,)


class Filters(Options):
    """Filters of records. A record whose value is unknown does not pass a filter of that value.

    Examples
    --------
    >>> Filters(magnitude=(6.0, 8.0)).refusal(magnitude=5.2)
    'magnitude 5.2. Must be from 6 to 8'
    >>> Filters(magnitude=(6.0, 8.0)).refusal(magnitude=7.1)
    ''
    """

    magnitude: Annotated[Bounds | None, Field(examples=[(6.0, 8.0)])] = None
    """Range of the magnitude of the earthquake."""
    epicentral_distance_km: Annotated[Bounds | None, Field(examples=[(0.0, 50.0)])] = None
    """Range of the epicentral distance [km]."""
    distance_rrup_km: Annotated[Bounds | None, Field(examples=[(0.0, 20.0)])] = None
    """Range of the shortest distance to the rupture [km]."""
    distance_rjb_km: Annotated[Bounds | None, Field(examples=[(0.0, 20.0)])] = None
    """Range of the Joyner-Boore distance [km]."""
    distance_hypocentral_km: Annotated[Bounds | None, Field(examples=[(0.0, 60.0)])] = None
    """Range of the distance to the hypocentre [km]."""
    vs30_m_s: Annotated[Bounds | None, Field(examples=[(360.0, 1500.0)])] = None
    """Range of the shear-wave velocity of the upper 30 m at the station [m/s]."""
    site: Annotated[Site | None, Field(examples=["free-field"])] = None
    """Site of the sensor, from headers and catalogues."""
    pga_g: Annotated[Bounds | None, Field(examples=[(0.1, 3.0)])] = None
    """Range of the peak ground acceleration after processing [g]."""
    pgv_m_s: Annotated[Bounds | None, Field(examples=[(0.1, 3.0)])] = None
    """Range of the peak ground velocity after processing [m/s]."""

    def bounds(self) -> dict[str, list[float] | str]:
        """Return the stated filters as JSON values."""
        return {
            name: bounds if isinstance(bounds, str) else list(bounds)
            for name, bounds in self
            if bounds is not None
        }

    def refusal(self, site: str | None = None, **values: float) -> str:
        """Return the first reason why a record with these values is filtered out, or ""."""
        if site is not None and self.site not in (None, site):
            return f"site {site}. Must be {self.site}"
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
