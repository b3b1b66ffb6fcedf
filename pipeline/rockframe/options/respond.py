"""Options of responses, screenings and spectra."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rockframe.errors import ParameterError
from rockframe.options.model import (
    OF_SITE,
    Bounds,
    Condition,
    Conditions,
    File,
    Finite,
    FurtherMeasures,
    Kept,
    Margins,
    Names,
    Numbers,
    NumbersFromZero,
    Options,
    Positive,
    PositiveNumbers,
    Seed,
    Shapes,
    Texts,
    require_one_site,
    rule,
    value_error,
    warn_beyond_turn,
)
from rockframe.quantities import LIMITED


def _enough(members: int) -> int:
    if 0 < members < LEAST_MEMBERS:
        fault = f"{members}. Must be 0, or at least {LEAST_MEMBERS}: fewer say little of a share"
        raise value_error(fault)
    return members


#: Least number of members of an ensemble.
LEAST_MEMBERS: Final = 16
#: Largest number of members in each scenario of a screening.
_MOST_SCENARIO_MEMBERS: Final = 1000
_Spread = Annotated[float, Field(ge=0.0, lt=1.0)]
_Factor = Annotated[float, Field(ge=1.0, le=10.0)]
_Softness = Annotated[float, Field(ge=1.0, le=1000.0)]


class Ensemble(Options):
    """Plausible structures and motions close to the stated ones.

    The members are drawn uniformly within the spreads, and uniformly in the logarithm of factors,
    stratified in each (a Latin hypercube).

    Examples
    --------
    >>> Ensemble(height=0.02).members
    64
    """

    members: Annotated[int, Field(ge=0, le=10_000), AfterValidator(_enough)] = 64
    """Number of members, at least 16; or 0 for no ensemble, and no robust margins."""
    height: _Spread = 0.01
    """Largest deviation of the columns' height, as a fraction of the height. Default: chosen."""
    width: _Spread = 0.01
    """Largest deviation of the columns' width, as a fraction of the width. Default: chosen; 1 cm of
    a section of 1 m."""
    impact_loss: _Factor = 2.0
    """Largest factor, up or down, on the loss of an impact, the logarithm of its velocity ratio; 1
    switches the spread off. Default: between half and twice the loss, chosen because measurements
    lie on both sides of eq (43): 1.9 and 1.2 times its loss on concrete (ElGawady and others), and
    less than its loss (Kalliontzis and others, 2016)."""
    amplitude: _Spread = 0.01
    """Largest deviation of the motion's amplitude, as a fraction of the amplitude. Default: no
    seismic sensor in the field is to be trusted to better than about 1 % (J. R. Evans, U.S.
    Geological Survey, 2009)."""
    contact_shortening: _Softness = 10.0
    """Largest factor, up or down, on the shortening of the contact of round columns under their
    weight, 0.1 mm, by which they lose energy close to upright in both directions; 1 switches the
    spread off. Default: 0.01 to 1 mm, chosen, because only its order is known: a stone column of
    7.5 m shortens its joint so much if that has a stiffness of 0.2 to 20 GPa/m. Shares hardly
    depend on it, in a contact engine neither (page Both directions)."""
    corner: _Factor = 2.0
    """Largest factor, up or down, on the lower corner of the band-pass of records that this package
    corrected; 1 switches the spread off. Default: between half and twice the corner, chosen. It
    concerns responses to the motion and scenarios of screenings, not robust margins."""
    orientation_degree: Annotated[float, Field(ge=0.0, le=45.0)] = 0.0
    """Largest misorientation of the sensor, each way [degree]; 0 switches the spread off. Of 1075
    stations, 34 to 44 % were oriented to within 3 degrees (Ojo and others, 2019). Both horizontals
    of a station are needed. As the corner, it does not concern robust margins."""
    seed: Seed = 0
    """Random seed of the members."""


class BridgeEnsemble(Ensemble):
    """Plausible bridges and motions close to the stated ones, for comparisons.

    Rocking bridges have the spreads of height, width and impact loss; all bridges that of the
    amplitude.

    Examples
    --------
    >>> BridgeEnsemble().cracked_stiffness
    0.4
    """

    conditions: ClassVar[Conditions] = {
        "contact_shortening": Condition(
            "motions in both directions, which comparisons do not have", lambda _: False
        )
    }

    friction: _Spread = 0.15
    """Largest deviation of the friction of pendulums, as a fraction. Default: chosen for bearings
    as delivered; ageing, contamination and temperature are not in it."""
    isolator_strength: _Spread = 0.15
    """Largest deviation of the characteristic strength of lead-rubber bearings, as a fraction.
    Default: as for friction."""
    isolator_stiffness: _Spread = 0.15
    """Largest deviation of the stiffness of lead-rubber bearings after yielding, as a fraction.
    Default: as for friction."""
    cracked_stiffness: _Spread = 0.4
    """Largest deviation of the stiffness of monolithic columns, as a fraction. Default: Elwood and
    Eberhard (ACI Structural Journal 106-S45, 2009) report coefficients of variation of 22 and 25 %
    for measured over computed stiffness; a uniform spread of 0.4 has 23 %."""
    yield_strength: _Spread = 0.15
    """Largest deviation of the strength of monolithic columns at first yield, as a fraction.
    Default: chosen; its coefficient of variation of 9 % is below the 12 % that Nowak and Collins
    state for the yield strength of steel. State the expected strength, not the nominal one."""


#: Spreads of the members of an ensemble, and their seed.
_OF_MEMBERS: Final = tuple(
    f"ensemble.{name}" for name in Ensemble.model_fields if name != "members"
)


class RespondOptions(Options):
    """The response of each structure to each record."""

    conditions: ClassVar[Conditions] = {
        **dict.fromkeys(
            _OF_MEMBERS, Condition("members", lambda options: options.ensemble.members > 0)
        ),
        "ensemble.contact_shortening": Condition(
            "members and both_directions",
            lambda options: options.ensemble.members > 0 and options.both_directions,
        ),
    }

    structure: Annotated[str | None, Field(examples=["bridge-bent"])] = None
    """Only the structure of this name."""
    vertical: bool = False
    """Include the vertical component recorded at the same station."""
    both_directions: bool = True
    """Also respond to both horizontal components of a station together, where structures have round
    columns and both are recorded; the other rows are in one plane."""
    histories: Kept = "all"
    """Responses whose histories are written: none, selected (those that overturn or reach half the
    slenderness), or all."""
    margins: Margins = "robust"
    """Margins of the verdicts: none; first (nominal critical scales; some 50 ms for each record and
    structure); or robust (also the scales at which 10, 25 and 50 % of an ensemble of plausible
    structures overturn; some 150 ms)."""
    forces: bool = False
    """Compute the largest forces at the joints: of base and top joints, shear keys, tendons and
    dissipaters, the base shear, and the impulses of impacts, with their bands over the ensemble; in
    kN where column_mass_kg or density_kg_m3 is stated."""
    ensemble: Ensemble = Ensemble()


class DesignOptions(Options):
    """The smallest dimension that keeps a quantity below a limit."""

    conditions: ClassVar[Conditions] = {
        "share": Condition("statistic share", lambda options: options.statistic == "share"),
    }

    dimension: Annotated[Literal["height", "width", "mass_ratio"], Field(examples=["height"])]
    """Varied dimension: height (at constant slenderness), width (at constant height), or mass
    ratio. All values are tried, because demand is not monotone in size."""
    range: Annotated[tuple[Finite, Finite], Field(strict=False, examples=[(4.0, 12.0)])]
    """Range that is searched, in m for height and width."""
    quantity: Literal[
        "peak_rotation_ratio",
        "peak_u",
        "peak_v",
        "peak_impact_velocity",
        "peak_tendon_ratio",
        "peak_gap_ratio",
    ] = "peak_rotation_ratio"
    """Limited quantity: theta/alpha, the drift u, the lift v, the impact velocity, the force of a
    tendon over its yield force, or the drift over the gap at the abutment."""
    limit: Positive = 0.5
    """Limit of a ratio, of u or v in m, or of the impact velocity in m/s."""
    statistic: Literal["share", "quantile_84"] = "share"
    """What must keep the limit: a share of the records and members, or the 84 % quantile of the
    quantity over all of them."""
    share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    """Share of the records and members that must stay below the limit, for the statistic share."""
    steps: Annotated[int, Field(ge=2, le=10_000)] = 41
    """Number of values tried in the range."""

    @model_validator(mode="after")
    def _sound_range(self) -> Self:
        low, high = self.range
        alone = self.dimension == "mass_ratio" and low == 0.0  # a column alone
        if not (low < high and (low > 0.0 or alone)):
            least = "zero or positive" if self.dimension == "mass_ratio" else "positive"
            message = f"design range [{low:g}, {high:g}]. Must be {least}, and increase"
            raise rule(message)
        return self


def _at_most_thousand(scales: tuple[float, ...]) -> tuple[float, ...]:
    if scales[-1] > 1e3:
        raise value_error(f"with {scales[-1]:g}. Must be at most 1000")
    return scales


def _has_scenario_members(options: ScreenOptions) -> bool:
    return options.scenario_members > 1


def _has_robust_margins(options: ScreenOptions) -> bool:
    return options.margins == "robust" and options.ensemble.members > 0


def _in_both_directions(options: ScreenOptions) -> bool:
    return options.both_directions and not options.azimuths_degree


class ScreenOptions(Options):
    """The screening of the structures by the records at many scales."""

    conditions: ClassVar[Conditions] = {
        **dict.fromkeys(
            _OF_MEMBERS,
            Condition(
                "scenario_members above 1, or margins robust",
                lambda options: _has_scenario_members(options) or _has_robust_margins(options),
            ),
        ),
        **dict.fromkeys(
            ("ensemble.corner", "ensemble.orientation_degree"),
            Condition("scenario_members above 1", _has_scenario_members),
        ),
        "ensemble.members": Condition(
            "margins robust", lambda options: options.margins == "robust"
        ),
        "ensemble.contact_shortening": Condition(
            "both_directions and members (scenario_members above 1, or margins robust)",
            lambda options: (
                _in_both_directions(options)
                and (_has_scenario_members(options) or _has_robust_margins(options))
            ),
        ),
        "hazard_site_within_km": OF_SITE,
    }

    structure: Annotated[str | None, Field(examples=["bridge-bent"])] = None
    """Only the structure of this name."""
    scales: Annotated[PositiveNumbers, AfterValidator(_at_most_thousand)] = (
        *(0.5, 0.75, 1.0, 1.25),
        *(1.5, 2.0, 2.5, 3.0),
    )
    """Factors on the accelerations of the records, increasing."""
    azimuths_degree: Annotated[
        Numbers | None, Field(examples=[{"from": 0.0, "to": 170.0, "count": 18}])
    ] = None
    """Rotate each pair of horizontals toward these azimuths [degree]."""
    both_directions: bool = True
    """Also respond to both horizontal components of a station together, where structures have round
    columns and both are recorded. For these structures only such motions count in ranks,
    fragilities, rates and designs. Their PGA, PGV and spectral accelerations are RotD50."""
    vertical: bool = False
    """Include the vertical component recorded at the same station."""
    histories: Kept = "none"
    """Scenarios whose histories are written: none, selected (those that overturn or reach half the
    slenderness), or all."""
    margins: Margins = "first"
    """Margins under the unscaled records: none; first (critical scales, and the islands above them
    in which the structure stands; some 50 ms for each record and structure); or robust (also the
    scales at which 10, 25, 50 % of an ensemble of plausible structures overturn; some 150 ms)."""
    ensemble: Ensemble = Ensemble()
    scenario_members: Annotated[int, Field(ge=1, le=_MOST_SCENARIO_MEMBERS)] = 1
    """Number of members of the ensemble that respond in each scenario. With 1, only the stated
    structure responds, and all results are nominal. From 2 on, ranks, fragilities, rates and
    designs are computed from shares of the members, and nominal results are stored beside them.
    Pairs that are rotated toward azimuths keep their corners and orientations."""
    pulse_period_s: Annotated[Bounds | None, Field(examples=[(0.5, 5.0)])] = None
    """Only records whose selected pulse has a period in this range [s]."""
    pulse_length_m: Annotated[Bounds | None, Field(examples=[(0.1, 9.0)])] = None
    """Only records whose selected pulse has a length L_p = a_p T_p^2 in this range [m]."""
    pulse_like: Annotated[bool | None, Field(examples=[True])] = None
    """Only records whose pulse passes the test against noise (true), or only the others (false)."""
    spectral_periods_s: Annotated[PositiveNumbers | None, Field(examples=[(0.5, 1.0)])] = None
    """Periods of spectral accelerations, 5 % damped, as further measures of intensity [s]."""
    measures: Annotated[FurtherMeasures | None, Field(examples=[("cav", "pgv_rotd50")])] = None
    """Further measures of intensity: cav (the cumulative absolute velocity), arias_intensity,
    housner_intensity, and RotD50 and RotD100 of both horizontals, pga_rotd50, pga_rotd100,
    pgv_rotd50, pgv_rotd100, and sa_rotd50 and sa_rotd100 at spectral_periods_s."""
    limit_peak_rotation_ratio: Annotated[PositiveNumbers | None, Field(examples=[(0.25, 0.5)])] = (
        None
    )
    """Limits of theta/alpha: damage states that get fragilities and rates in addition to
    overturning."""
    limit_peak_u_m: Annotated[PositiveNumbers | None, Field(examples=[(0.2,)])] = None
    """Limits of the drift u, such as the width of a seat or a joint [m]."""
    limit_peak_v_m: Annotated[PositiveNumbers | None, Field(examples=[(0.05,)])] = None
    """Limits of the lift v [m]."""
    limit_peak_impact_velocity_m_s: Annotated[PositiveNumbers | None, Field(examples=[(0.5,)])] = (
        None
    )
    """Limits of the velocity 2 b |theta'| at which the base of a column hits the ground [m/s]."""
    limit_peak_tendon_ratio: Annotated[PositiveNumbers | None, Field(examples=[(1.0,)])] = None
    """Limits of the force of a tendon over its yield force: at 1 it yields."""
    limit_ductility: Annotated[PositiveNumbers | None, Field(examples=[(4.0,)])] = None
    """Largest drift over the yield drift of isolated and fixed bridges: further limit states."""
    limit_peak_gap_ratio: Annotated[PositiveNumbers | None, Field(examples=[(1.0,)])] = None
    """Limits of the drift over the gap at the abutment: at 1 the gap closes."""
    fragility_curve: Literal["lognormal", "logistic"] = "lognormal"
    """Form of the fragility curves: lognormal, or logistic over the logarithm of the intensity. The
    tails of the logistic curve are longer and can decide the annual rate."""
    pooled: bool = False
    """Fit one fragility over all free-standing structures, too, over p PGV / (g tan alpha), and say
    how much better it predicts than PGA. Structures with tendons or dissipaters are left out."""
    hazard: Annotated[File | None, Field(examples=["hazard.csv"])] = None
    """Hazard curve of the site: CSV of annual_rate (or probability_in_50_years) and one of pga_g,
    pgv_m_s, a_p_g, L_p_m, sa_1s_g; a file of OpenQuake (CSV, NRML) or of the USGS (CSV, JSON); or a
    folder of OpenQuake."""
    return_period_years: Annotated[PositiveNumbers | None, Field(examples=[(475.0, 2475.0)])] = None
    """Return periods at which the demand of each structure is stated [years]: rotation, drift, lift
    and the other quantities that can be limited. It needs a hazard curve."""
    hazard_curve: Annotated[str | None, Field(examples=["quantile-0.84"])] = None
    """Kind of the hazard curve of OpenQuake: mean, max, quantile-0.84 or another that its files
    state; by default mean in a folder, and that of the file otherwise."""
    hazard_measure: Annotated[str | None, Field(examples=["sa_1s"])] = None
    """Measure of the hazard curve in a file of several, such as pga or sa_1s; sa_1s_rotd50 states
    that the curve of sa_1s is of this measure of both horizontals."""
    hazard_columns: Annotated[
        Names | None, Field(examples=[("pga_g=PGA", "return_period_years=TR")])
    ] = None
    """Columns of a hazard curve that is any other table: a measure, such as pga_g, pgv_cm_s or
    sa_1s_m_s2, and annual_rate, probability_in_50_years or return_period_years, each with the name
    or number of the column in the table."""
    hazard_site: Annotated[
        tuple[Finite, Finite] | None, Field(strict=False, examples=[(23.73, 37.98)])
    ] = None
    """Longitude and latitude of the site in a file of several [degree]: the nearest site is
    used, if it is within hazard_site_within_km."""
    hazard_site_within_km: Positive = 10.0
    """Largest distance of the used site from the stated place [km]."""
    hazard_site_id: Annotated[str | None, Field(examples=["athens"])] = None
    """Name of the site in a file of several, instead of its longitude and latitude."""
    seed: Seed = 0
    """Random seed of the bootstrap."""
    design: DesignOptions | None = None

    @model_validator(mode="after")
    def _azimuths(self) -> Self:
        """Require different azimuths, without filters by pulse: rotated motions have no pulse."""
        azimuths = [f"{azimuth % 360.0:g}" for azimuth in self.azimuths_degree or ()]
        for azimuth in azimuths:
            if azimuths.count(azimuth) > 1:
                message = f"azimuths_degree states {azimuth} twice, or 360 apart"
                raise rule(message)
        for name in self.pulse_filters():
            if azimuths:
                message = f"{name} and azimuths_degree both stated. State only one of them"
                raise rule(message)
        if azimuths and not self.both_directions:
            message = (
                "both_directions false has no effect with azimuths_degree: all motions are in "
            )
            raise rule(message + "one plane. State only one of them")
        for degrees in self.azimuths_degree or ():
            warn_beyond_turn(degrees)
        return self

    @model_validator(mode="after")
    def _periods_of_measures(self) -> Self:
        """Require periods for spectral accelerations of both horizontals."""
        for name in self.measures or ():
            if name.startswith("sa_") and self.spectral_periods_s is None:
                raise rule(f"measures {name} without spectral_periods_s. State the periods")
        return self

    @model_validator(mode="after")
    def _site_of_hazard(self) -> Self:
        """Require a hazard curve for a site, and valid coordinates of the site."""
        for name in (
            *("hazard_site", "hazard_site_id", "hazard_curve", "hazard_measure"),
            *("hazard_columns", "return_period_years"),
        ):
            if self.hazard is None and getattr(self, name) is not None:
                raise rule(f"{name} without hazard. State the file of hazard curves")
        require_one_site(self.hazard_site, self.hazard_site_id)
        return self

    def scenario_ensemble(self) -> Ensemble | None:
        """Return the ensemble that responds in each scenario; None for the stated structure alone.

        Examples
        --------
        >>> found = ScreenOptions(scenario_members=4).scenario_ensemble()
        >>> None if found is None else found.members
        4
        """
        if self.scenario_members == 1:
            return None
        # Not validated: `LEAST_MEMBERS` is for the interval of the share of a single scenario.
        return self.ensemble.model_copy(update={"members": self.scenario_members})

    def limits(self) -> tuple[tuple[str, float], ...]:
        """Return the stated limits of the response as pairs of quantity and value [SI]."""
        limits_of = {
            quantity.name: getattr(self, f"limit_{quantity.column()}") for quantity in LIMITED
        }
        return tuple((name, value) for name, values in limits_of.items() for value in values or ())

    def pulse_filters(self) -> dict[str, object]:
        """Return the stated filters by the pulse."""
        names = ("pulse_period_s", "pulse_length_m", "pulse_like")
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}


class SpectrumOptions(Options):
    """Minimum overturning acceleration spectra of pulses."""

    wavelet: Annotated[Shapes, Field(examples=[("mavroeidis_papageorgiou",)])]
    """Wavelets of the pulses, or sines and cosines of one lobe or period."""
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
                where = f"phase_degree {self.phase_degree:g}: " if phase else ""
                raise rule(where + str(error).rstrip(".")) from None
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


class ExportOptions(Options):
    """The fragilities of a screening for other programs.

    Examples
    --------
    >>> ExportOptions().measure
    'pga'
    """

    measure: str = "pga"
    """Intensity measure: pga, pgv, or a spectral acceleration of the screening such as sa_1s."""
    structure: Annotated[str | None, Field(examples=["bridge-bent"])] = None
    """Only the structure of this name."""
    limit_state: Annotated[Texts | None, Field(examples=[("peak_u_0.2m", "overturning")])] = None
    """Limit states, as the screening names them; by default all, which must be of one quantity."""
    taxonomy: Annotated[Texts | None, Field(examples=[("bridge-bent=CR/LFM",)])] = None
    """Taxonomy of each structure, as STRUCTURE=TAXONOMY, or the taxonomy alone for a single
    structure; by default the name of the structure."""
    levels: Annotated[int, Field(ge=2, le=1000)] = 40
    """Number of intensities, evenly spaced in their logarithm over the range tried."""
    undetermined: bool = False
    """Also export curves that the data do not determine; the files then say so."""
