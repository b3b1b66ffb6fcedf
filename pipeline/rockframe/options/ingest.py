"""Options of reading and selecting records, filters, and limits of the passport."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rockframe.options.model import (
    OF_SITE,
    Azimuth,
    Bounds,
    Condition,
    Conditions,
    File,
    Finite,
    Motions,
    Names,
    Options,
    Positive,
    PositiveNumbers,
    Range,
    Seed,
    Sites,
    Trust,
    Units,
    require_one_site,
    rule,
    value_error,
)
from rockframe.units import GRAVITY

#: Zero or positive. Infinity disables an upper limit, and 0 a lower one.
_Limit = Annotated[float, Field(ge=0.0)]


#: Checks with a lower limit; all others have an upper one.
_AT_LEAST: Final = frozenset(
    ["signal_to_noise", "usable_period_longest", "significant_duration", "arias_intensity"]
)


Separator = Literal["comma", "semicolon", "tab", "blank"]
DecimalMark = Literal["point", "comma"]
#: Spectrum of two horizontals.
Pairs = Literal["geometric-mean", "rotd50", "rotd100"]
FirstLine = Literal["names", "sizes", "numbers"]


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise value_error("0. Must not be zero")
    return value


def _channels(channels: tuple[str, ...]) -> tuple[str, ...]:
    for channel in channels:
        if not all(part.strip() for part in channel.rpartition("=")):
            must = "Must be a column and its component, such as 2=NS or acc_x=045"
            raise value_error(f"{channel!r}. {must}")
    return channels


#: A finite number other than zero.
NotZero = Annotated[Finite, AfterValidator(_not_zero)]
#: Beginning of comment lines, and number of values of a line.
Mark = Annotated[str, Field(min_length=1)]
ValueCount = Annotated[int, Field(ge=1, le=1000)]
#: Columns and their components.
Channels = Annotated[
    tuple[Annotated[str, Field(title="COLUMN=COMPONENT")], ...],
    Field(min_length=1, strict=False),
    AfterValidator(_channels),
]

#: Range of factors on a selected motion: wider than any use, and without overflow.
LEAST_FACTOR: Final = 1e-3
LARGEST_FACTOR: Final = 1e3


def _factors(bounds: tuple[float, float]) -> tuple[float, float]:
    """Require two factors in order; equal ones scale all motions alike."""
    low, high = bounds
    if not LEAST_FACTOR <= low <= high <= LARGEST_FACTOR:
        must = f"Must be two numbers from {LEAST_FACTOR:g} to {LARGEST_FACTOR:g}"
        raise value_error(f"[{low:g}, {high:g}]. {must}, the smaller one first")
    return bounds


class PassportLimits(Options):
    """Limits of the record passport: the ``[passport]`` table.

    Each check has a limit that warns and one that rejects. By default only faults that no sound
    record of ground motion has lead to rejection: flat tops, filled gaps, a peak of 10 g or one
    that does not rise above the noise, a time step above 1 s. Other faults may be acceptable, for
    example in old records and mathematical pulses, so they only warn. Most complete and well
    processed records pass the warning limits.

    Parameters
    ----------
    peak_acceleration_warn, peak_acceleration_reject : float
        Largest peak after processing [m s-2]. Few records exceed 2 g, and no record in the archives
        exceeds 5 g; 10 g means that values in gal were read as g, or that the file contains no
        ground motion.
    time_step_warn, time_step_reject : float
        Largest interval between samples [s]. Accelerographs take ten samples per second or more;
        a step of seconds is a misread number of milliseconds, or of samples per second.
    not_free_field_warn, not_free_field_reject : float
        Largest value of the flag [1]: 1 if the header says that the sensor stood in a structure or
        a borehole, 0 on free ground. A motion amplified by a structure, or recorded at depth, is
        not the base motion of another structure. Never rejects by default; the limit 0 does.
    azimuth_warn, azimuth_reject : float
        Largest azimuth stated by the header or by the name of the component [degree]. An azimuth
        above 360 in a header is taken modulo 360; a name above 360 is not taken as an azimuth.
    stated_peak_warn, stated_peak_reject : float
        Largest difference between the peak of the samples and the peak that the header states,
        relative to the stated peak [1]; signs are compared if the header states one. Readers
        already reject a difference beyond the last printed digit. One percent more means a coarse
        header, and half means that the header belongs to another record.
    clipped_samples_warn, clipped_samples_reject : float
        Longest run of equal samples at an extreme [1]. Three or four result from rounding (few
        digits, many samples per period); a run of 25 is a flat top.
    constant_time_warn, constant_time_reject : float
        Longest time without any change within the strong motion [s]. Ground motion above the
        resolution changes with each sample; a gap of half a second can hide a whole cycle that
        matters for rocking.
    opening_share_warn, opening_share_reject : float
        Largest ratio of the peak in the first 0.1 s to the peak [1]. Above 0.1 the trigger was
        late. Never rejects by default, because most analogue records start late, and mathematical
        pulses start at once.
    closing_share_warn, closing_share_reject : float
        Largest ratio of the peak in the last 0.1 s to the peak [1]. Above 0.1 the record was cut
        or lost its end. Never rejects by default, because a record cut late is still useful.
    end_velocity_share_warn, end_velocity_share_reject : float
        Largest ratio of the final velocity to its peak [1]. The ground ends at rest; 0.1 indicates
        a drifting baseline. Never rejects by default, because a half-sine pulse ends moving.
    end_displacement_share_warn, end_displacement_share_reject : float
        Largest ratio of the final displacement to its peak [1]. Records near a fault may keep a
        true offset, so the limit is wide: above 0.9 the displacement consists only of drift, or
        only of fling. Never rejects by default.
    signal_to_noise_warn, signal_to_noise_reject : float
        Smallest ratio of the peak to the root mean square of the noise before the event [1]. Noise
        alone peaks at about 4 times its root mean square; at 20, a fifth of the peak is noise.
    usable_period_longest_warn, usable_period_longest_reject : float
        Smallest longest usable period [s]: 4 s are those of a lower corner of 0.2 Hz. With this
        corner instead of one up to 0.1 Hz, shares that overturn are 0.25 lower on average, and
        with 0.3 Hz 0.41 lower.
    significant_duration_warn, significant_duration_reject : float
        Smallest D5-95 [s]. A shorter record is a spike or a fragment.
    arias_intensity_warn, arias_intensity_reject : float
        Smallest Arias intensity [m s-1]. One second at 0.003 g gives 1e-4 m/s; weaker motion is
        recorded, but not felt.
    signal_to_noise_ratio : float
        Ratio of Fourier amplitudes above which a frequency is usable [1]; 3 is usual.

    References
    ----------
    Boore and Bommer (2005), Processing of strong-motion accelerograms, SDEE 25(2), 93-115: drift,
    corners, and the signal-to-noise ratio.

    Examples
    --------
    >>> PassportLimits(opening_share_reject=0.5).opening_share_reject
    0.5
    """

    peak_acceleration_warn: _Limit = 2.0 * GRAVITY
    peak_acceleration_reject: _Limit = 10.0 * GRAVITY
    time_step_warn: _Limit = 0.1
    time_step_reject: _Limit = 1.0
    not_free_field_warn: _Limit = 0.0
    not_free_field_reject: _Limit = math.inf
    azimuth_warn: _Limit = 360.0
    azimuth_reject: _Limit = math.inf
    stated_peak_warn: _Limit = 0.01
    stated_peak_reject: _Limit = 0.5
    clipped_samples_warn: _Limit = 4.0
    clipped_samples_reject: _Limit = 24.0
    constant_time_warn: _Limit = 0.1
    constant_time_reject: _Limit = 0.5
    opening_share_warn: _Limit = 0.1
    opening_share_reject: _Limit = math.inf
    closing_share_warn: _Limit = 0.1
    closing_share_reject: _Limit = math.inf
    end_velocity_share_warn: _Limit = 0.1
    end_velocity_share_reject: _Limit = math.inf
    end_displacement_share_warn: _Limit = 0.9
    end_displacement_share_reject: _Limit = math.inf
    signal_to_noise_warn: _Limit = 20.0
    signal_to_noise_reject: _Limit = 4.0
    usable_period_longest_warn: _Limit = 4.0
    usable_period_longest_reject: _Limit = 0.0
    significant_duration_warn: _Limit = 0.5
    significant_duration_reject: _Limit = 0.0
    arias_intensity_warn: _Limit = 1e-4
    arias_intensity_reject: _Limit = 0.0
    signal_to_noise_ratio: Annotated[float, Field(gt=1.0)] = 3.0

    def stated(self) -> dict[str, float | None]:
        """Return the limits as JSON values, with None for a limit disabled by infinity."""
        return {
            name: value if math.isfinite(value) else None
            for name, value in self.model_dump().items()
        }

    @model_validator(mode="after")
    def _warns_first(self) -> Self:
        """Require that every value that is rejected would also warn."""
        for name in type(self).model_fields:
            check, _, kind = name.rpartition("_")
            if kind != "warn":
                continue
            warn, reject = getattr(self, name), getattr(self, f"{check}_reject")
            at_least = check in _AT_LEAST
            if (reject > warn) if at_least else (reject < warn):
                bound = "at most" if at_least else "at least"
                raise rule(
                    f"{check}_reject {reject:g}. Must be {bound} {check}_warn, {warn:g}",
                )
        return self


class FileOptions(Options):
    """Metadata that files of records do not state, and the layout of text tables.

    Examples
    --------
    >>> FileOptions(units="gal", values_per_line=5).values_per_line
    5
    """

    units: Annotated[Units | None, Field(examples=["g"])] = None
    """Acceleration units of files that do not state them: g, mg, %g, gal, cm/s2, mm/s2, m/s2, in/s2
    or ft/s2 (a file that states other units is rejected)."""
    factor_m_s2: Annotated[NotZero | None, Field(examples=[0.0098])] = None
    """Acceleration of the number 1 in files that state no units [m/s2], instead of units."""
    time_step_s: Annotated[Positive | None, Field(examples=[0.01])] = None
    """Time step of text files that do not state it [s] (a file that states another time step is
    rejected)."""
    column: Annotated[str | None, Field(examples=["acc_x"])] = None
    """Name or number of the column of acceleration in text files, or `all` if the columns are one
    series, line by line; by default the columns whose names mean acceleration."""
    skip_lines: Annotated[int, Field(ge=0, le=100_000)] = 0
    """Number of lines at the top of text files that are not read."""
    comment: Annotated[Mark | None, Field(examples=["!"])] = None
    """Beginning of comment lines in text files; by default # or %."""
    separator: Annotated[Separator | None, Field(examples=["semicolon"])] = None
    """Separator of the columns of text files; by default recognised."""
    decimal: Annotated[DecimalMark | None, Field(examples=["comma"])] = None
    """Decimal mark of text files; by default recognised."""
    first_line: Annotated[FirstLine | None, Field(examples=["sizes"])] = None
    """Contents of the first line of text files below comments and skipped lines: names of the
    columns, sizes (the number of samples, and perhaps the time step), or numbers; by default
    recognised."""
    values_per_line: Annotated[ValueCount | None, Field(examples=[5])] = None
    """Number of values of one series in each line of text files; by default recognised."""
    time_column: Annotated[str | None, Field(examples=["none"])] = None
    """Name or number of the column of times in text files, in seconds or as clock times, or none to
    leave the times out; by default recognised."""
    channels: Annotated[Channels | None, Field(examples=[("2=NS", "3=EW")])] = None
    """Columns of acceleration in text files and their components: number or name of the column, and
    an azimuth of three digits, a compass name, or UP."""
    sensitivity_counts_s2_m: Annotated[NotZero | None, Field(examples=[213945.0])] = None
    """Counts per m/s2 of files with counts, instead of a StationXML; negative if the counts have
    the opposite sign."""
    streams: Annotated[str | None, Field(examples=["raw"])] = None
    """Streams of ASDF files: processed, raw, or their label; by default the processed ones that
    passed the checks of gmprocess."""
    trust: Annotated[Trust | None, Field(examples=[("samples", "sensitivity")])] = None
    """Which of two contradictory statements of a file is right: samples, values, sensitivity,
    stages, full-scale, scale, waveform, header, component or azimuth; by default a file that
    contradicts itself is rejected, and the reason names the words that settle it."""
    station_xml: Annotated[File | None, Field(examples=["station.xml"])] = None
    """StationXML of miniSEED and SAC files; by default every .xml file beside each file or in its
    archive."""
    water_level_db: Annotated[Positive | None, Field(examples=[60.0])] = None
    """Remove the full instrument response from miniSEED files, with this water level [dB]; by
    default they are divided by the sensitivity."""

    @model_validator(mode="after")
    def _one_unit(self) -> Self:
        if self.units is not None and self.factor_m_s2 is not None:
            raise rule("units and factor_m_s2 both stated. State only one of them")
        return self


class IngestOptions(FileOptions):
    """Options of reading and processing record files."""

    conditions: ClassVar[Conditions] = {
        "catalogue_columns": Condition("catalogue", lambda options: options.catalogue is not None),
        "rest_s": Condition("sequence", lambda options: options.sequence is not None),
    }

    band_pass_hz: Annotated[Range | None, Field(examples=[(0.1, 40.0)])] = None
    """Corner frequencies for uncorrected records [Hz]; by default the lower one is chosen for each
    record from its noise before the event and from its displacement, and the upper one is 40."""
    uncorrected: bool = False
    """Treat every record as uncorrected; by default text and AT2 files count as corrected."""
    selection: Annotated[File | None, Field(examples=["selected.csv"])] = None
    """CSV of record_id and scale, as `rockframe select` writes it: only these records, each scaled
    by its factor."""
    catalogue: Annotated[File | None, Field(examples=["catalogue.csv"])] = None
    """CSV of event, station, magnitude and distance of each file; by default catalogue.csv of each
    folder."""
    catalogue_columns: Annotated[
        Names | None, Field(examples=[("station=STA", "magnitude=Mw")])
    ] = None
    """Columns of a catalogue that is any other table: a column of catalogue.csv or origin_time, and
    the name of the column in the table. Rows without a file apply to the records of their station,
    and of their event if origin_time is named."""
    limits: Annotated[File | None, Field(examples=["limits.toml"])] = None
    """TOML file with a [passport] table: limits of the checks of each record."""
    sequence: Annotated[Motions | None, Field(examples=[("main", "aftershock")])] = None
    """Records that follow one another, such as a mainshock and its aftershocks: one more motion, in
    which each structure comes to rest between them and keeps its damage."""
    rest_s: Annotated[Positive, Field(le=3600.0)] = 120.0
    """Time from the end of one motion of the sequence to the start of the next one [s]."""
    strict: bool = False
    """Stop at the first rejected file, and write nothing."""
    azimuth_degree: Annotated[Azimuth | None, Field(examples=[30.0])] = None
    """Replace the two horizontals of each station by the motion toward this azimuth [degree]."""
    strike_degree: Annotated[Azimuth | None, Field(examples=[120.0])] = None
    """Replace the two horizontals of each station by the motions normal and parallel to a fault of
    this strike [degree]."""

    spectral_periods_s: Annotated[PositiveNumbers | None, Field(examples=[(0.5, 1.0)])] = None
    """Periods [s] of the spectral accelerations in records.nc, 5 % damped: of each record, and
    RotD50 and RotD100 of both horizontals. The file then has the Housner intensity, too. Computing
    them takes many times as long as reading the records."""

    @model_validator(mode="after")
    def _one_rotation(self) -> Self:
        if self.azimuth_degree is not None and self.strike_degree is not None:
            raise rule("azimuth_degree and strike_degree both stated. State only one of them")
        return self

    @model_validator(mode="after")
    def _sequence_or_selection(self) -> Self:
        if self.sequence is not None and self.selection is not None:
            raise rule("sequence and selection both stated. State only one of them")
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
    >>> Filters(not_site=("structure", "borehole")).refusal("borehole")
    'site borehole. Must not be structure or borehole'
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
    site: Annotated[Sites | None, Field(examples=[("free-field", "unknown")])] = None
    """Sites of the sensor that are kept, from headers and catalogues."""
    not_site: Annotated[Sites | None, Field(examples=[("structure", "borehole")])] = None
    """Sites of the sensor that are left out."""
    pga_g: Annotated[Bounds | None, Field(examples=[(0.1, 3.0)])] = None
    """Range of the peak ground acceleration after processing [g]."""
    pgv_m_s: Annotated[Bounds | None, Field(examples=[(0.1, 3.0)])] = None
    """Range of the peak ground velocity after processing [m/s]."""

    def bounds(self) -> dict[str, list[float | str]]:
        """Return the stated filters as JSON values."""
        return {name: list(bounds) for name, bounds in self if bounds is not None}

    def refusal(self, site: str | None = None, **values: float) -> str:
        """Return the first reason why a record with these values is filtered out, or ""."""
        if site is not None and self.site is not None and site not in self.site:
            return f"site {site}. Must be {' or '.join(self.site)}"
        if self.not_site is not None and site in self.not_site:
            return f"site {site}. Must not be {' or '.join(self.not_site)}"
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


class SelectOptions(Options):
    """The selection of motions whose response spectra match a target.

    Examples
    --------
    >>> from pathlib import Path
    >>> SelectOptions(target=Path("target.csv"), scale_bounds=(4.0, 0.25))
    Traceback (most recent call last):
    rockframe.errors.ParameterError: scale_bounds [4, 0.25]. Must be two numbers from 0.001 to \
1000, the smaller one first.
    """

    conditions: ClassVar[Conditions] = {"hazard_site_within_km": OF_SITE}

    target: File
    """Target spectrum, 5 % damped: CSV of period_s, sa_g (the median) or mean_ln_sa_g, and
    optionally sigma_ln_sa, the standard deviation of ln Sa; or uniform hazard spectra of OpenQuake
    (hazard_uhs); or TOML of the parameters of a code or of ground-motion models; or JSON of the
    design maps of the USGS."""
    motions: Annotated[int, Field(ge=1, le=1000)] = 11
    """Number of motions to select; ASCE 7 requires 11 or more."""
    pairs: Pairs | None = None
    """Select recordings with both horizontals instead of single components: the geometric mean,
    RotD50 or RotD100 of their spectra is compared, and one scale applies to both."""
    periods_s: PositiveNumbers | None = None
    """Periods that are compared [s]; by default those of the target."""
    conditioning_period_s: Positive | None = None
    """Period of a conditional spectrum [s]; the target then contains the mean and the standard
    deviation of a ground-motion model."""
    conditioning_sa_g: Positive | None = None
    """Spectral acceleration at that period [g]; all motions are scaled to it."""
    scale_bounds: Annotated[tuple[float, float], Field(strict=False), AfterValidator(_factors)] = (
        0.25,
        4.0,
    )
    """Smallest and largest scale of a motion."""
    scale_period_s: Positive | None = None
    """Scale all motions to the target at this period [s]; by default by least squares of ln Sa over
    the periods."""
    scale_pgv_m_s: Positive | None = None
    """Scale all motions to this peak ground velocity [m/s], which decides rocking more than
    accelerations do."""
    most_per_station: Annotated[int, Field(ge=1)] = 1
    """Largest number of motions of one station."""
    most_per_event: Annotated[int, Field(ge=1)] | None = None
    """Largest number of motions of one earthquake; by default any."""
    flatfile_columns: Names | None = None
    """Columns of a flatfile that is any other table: record_id, event, station, magnitude and so
    on, or sa_g with {} for the period, and the name of the column in the table, such as
    sa_g=SA_{}."""
    pulse_like: bool | None = None
    """Only records whose pulse passes the test against noise (true), or only the others (false)."""
    hazard_probability: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    """Probability of exceedance of the uniform hazard spectrum, in a file of several."""
    hazard_site: Annotated[tuple[Finite, Finite], Field(strict=False)] | None = None
    """Longitude and latitude of the site in a file of several [degree]: the nearest site is
    used, if it is within hazard_site_within_km."""
    hazard_site_within_km: Positive = 10.0
    """Largest distance of the used site from the stated place [km]."""
    hazard_site_id: str | None = None
    """Name of the site in a file of several, instead of its longitude and latitude."""
    seed: Seed = 0
    """Random seed of the spectra that are simulated from the target."""

    @model_validator(mode="after")
    def _one_scaling(self) -> Self:
        """Require one way of scaling, and a complete condition."""
        condition = (self.conditioning_period_s, self.conditioning_sa_g)
        if (condition[0] is None) != (condition[1] is None):
            raise rule(
                "Of conditioning_period_s and conditioning_sa_g only one is stated. State both"
            )
        ways = {
            "conditioning_period_s": condition[0],
            "scale_period_s": self.scale_period_s,
            "scale_pgv_m_s": self.scale_pgv_m_s,
        }
        both = [name for name, value in ways.items() if value is not None]
        if len(both) > 1:
            raise rule(f"{both[0]} and {both[1]} both stated: each scales the motions. State one")
        require_one_site(self.hazard_site, self.hazard_site_id)
        return self

    @property
    def condition(self) -> tuple[float, float] | None:
        """Period [s] and acceleration [m s-2] of a conditional spectrum; None without one."""
        if self.conditioning_period_s is None or self.conditioning_sa_g is None:
            return None
        return self.conditioning_period_s, self.conditioning_sa_g * GRAVITY
