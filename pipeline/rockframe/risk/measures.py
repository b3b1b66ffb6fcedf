"""Intensity measures of fragility and hazard curves, and which of them predicts better."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np
import scipy  # its submodules load when they are first used
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.risk.fragility import Fragility, Outcome
from rockframe.units import GRAVITY

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Measure:
    """An intensity measure that is proportional to a power of the scale of the motion.

    Parameters
    ----------
    name : str
        Name of its variable in the datasets.
    column : str
        Name of its column in tables, with the unit.
    symbol, unit : str
        Symbol and unit as printed.
    printed : float
        Value of the printed unit in SI units.
    largest : float
        Largest plausible intensity of a hazard curve, in the printed unit.
    yearly : float
        Intensity in the printed unit that every site exceeds less than once a year on average.
    power : int
        Power of the scale: 2 for the Arias intensity, 1 for all others.

    Examples
    --------
    >>> MEASURES["pga"].column
    'pga_g'
    """

    name: str
    column: str
    symbol: str
    unit: str
    printed: float = 1.0
    largest: float = 50.0
    yearly: float = 0.1
    power: int = 1


#: The measures of every screening, by name.
MEASURES: Final = MappingProxyType(
    {
        measure.name: measure
        for measure in (
            Measure("a_p", "a_p_g", "a_p", "g", GRAVITY),
            Measure("pga", "pga_g", "PGA", "g", GRAVITY),
            Measure("pgv", "pgv_m_s", "PGV", "m/s"),
            Measure("L_p", "L_p_m", "L_p", "m", largest=1e3, yearly=1.0),
        )
    }
)

#: Measures that a screening has on request, by name; those of a pair are of both horizontals.
FURTHER: Final = MappingProxyType(
    {
        measure.name: measure
        for measure in (
            Measure("cav", "cav_m_s", "CAV", "m/s", largest=500.0, yearly=5.0),
            Measure(
                "arias_intensity",
                "arias_intensity_m_s",
                "I_A",
                "m/s",
                largest=200.0,
                yearly=0.4,
                power=2,
            ),
            Measure("housner_intensity", "housner_intensity_m", "I_H", "m", yearly=0.4),
            Measure("pga_rotd50", "pga_rotd50_g", "RotD50 PGA", "g", GRAVITY),
            Measure("pga_rotd100", "pga_rotd100_g", "RotD100 PGA", "g", GRAVITY),
            Measure("pgv_rotd50", "pgv_rotd50_m_s", "RotD50 PGV", "m/s"),
            Measure("pgv_rotd100", "pgv_rotd100_m_s", "RotD100 PGV", "m/s"),
        )
    }
)

#: Measures of fragilities of many structures together, by name: `pooled_intensities`.
POOLED: Final = MappingProxyType(
    {
        measure.name: measure
        for measure in (
            MEASURES["pga"],
            MEASURES["pgv"],
            Measure("dimensionless_pga", "dimensionless_pga", "PGA/(g tan α)", ""),
            Measure("dimensionless_pgv", "dimensionless_pgv", "p PGV/(g tan α)", ""),
        )
    }
)

#: The measures by the names of their columns.
COLUMNS: Final = MappingProxyType(
    {named.column: named for named in (*MEASURES.values(), *FURTHER.values())}
)
_SPECTRAL: Final = re.compile(r"sa_([0-9.e+-]+)s(?:_(rotd50|rotd100))?(_g)?")


def spectral(period: float, over_azimuths: str = "") -> Measure:
    """Return the measure of the spectral acceleration at a period [s], 5 % damped.

    Parameters
    ----------
    period : float
        Period of the oscillator [s].
    over_azimuths : {"", "rotd50", "rotd100"}
        Value over the azimuths of both horizontals; empty for the component itself.

    Examples
    --------
    >>> spectral(0.5).column, spectral(0.5, "rotd50").column
    ('sa_0.5s_g', 'sa_0.5s_rotd50_g')
    """
    end = over_azimuths and f"_{over_azimuths}"
    words = over_azimuths and f"{over_azimuths.replace('rotd', 'RotD')} "
    name, symbol = f"sa_{period:g}s{end}", f"{words}SA({period:g} s)"
    return Measure(name, f"{name}_g", symbol, "g", GRAVITY, yearly=0.3)


def measure_of(name: str) -> Measure:
    """Return the measure with a name: one that is declared, or a spectral acceleration.

    Examples
    --------
    >>> measure_of("sa_0.5s").symbol, measure_of("sa_0.5s_rotd50").symbol
    ('SA(0.5 s)', 'RotD50 SA(0.5 s)')
    """
    for declared in (MEASURES, FURTHER, POOLED):
        if name in declared:
            return declared[name]
    return spectral(period_of(name), over_azimuths_of(name))


def measure_of_column(column: str) -> Measure | None:
    """Return the intensity measure in a table column; None if the column has another quantity."""
    if column in COLUMNS:
        return COLUMNS[column]
    period = period_of(column) if column.endswith("_g") else 0.0
    return spectral(period, over_azimuths_of(column)) if period > 0.0 else None


def period_of(name: str) -> float:
    """Return the period of a spectral acceleration [s]; 0 for other measures."""
    match = _SPECTRAL.fullmatch(name)
    try:
        return float(match[1]) if match else 0.0
    except ValueError:
        return 0.0


def over_azimuths_of(name: str) -> str:
    """Return rotd50 or rotd100 for a spectral acceleration of both horizontals; "" for others."""
    match = _SPECTRAL.fullmatch(name)
    return (match[2] or "") if match else ""


#: Fewest independent motions, those of one recording each, for which a better measure is named.
FEWEST_MOTIONS: Final = 10
#: Probability that chance alone names one of two equally good measures. The test is two-sided,
#: because either measure may lead.
_LEVEL: Final = 0.05


@dataclass(frozen=True)
class Preference:
    """The intensity measure that predicts overturning better than the others, if one does.

    Parameters
    ----------
    measure : str
        Name of the measure; empty if none can be named.
    reason : str
        Reason in words, whether or not a measure is named.
    """

    measure: str
    reason: str


def better_measure(fits: Mapping[str, Fragility]) -> Preference:
    """Return the measure whose fragility fits the same verdicts better, by Vuong's test.

    Parameters
    ----------
    fits : mapping of str to Fragility
        Fits by the name of the measure, all to the same motions.

    Notes
    -----
    Vuong's (1989) test: the mean difference of log-likelihood over the independent motions,
    divided by its standard error, is compared with Student's t at 5 %, two-sided. All scales of a
    motion count as one observation, because more scales are not more evidence. If the differences
    are normally distributed, chance alone names a measure with a probability of 5 %. In three
    kinds of simulations with two equally noisy copies of the decisive measure, one copy was named
    in 6 to 12 % of the cases with 10 motions, 7 to 9 % with 20, and 4 to 7 % with 60. The result
    for few motions is therefore only an indication.

    Examples
    --------
    >>> from rockframe.risk import fit_fragility
    >>> overturned = [[0, 0, 1]] * 3
    >>> fit = fit_fragility([1.0, 1.1, 1.2], [1.0, 1.3, 2.0], overturned)
    >>> better_measure({"pga": fit, "pgv": fit}).reason
    '3 recordings are too few: at least 10 are needed to name a better measure'
    """
    useful = {
        name: fit
        for name, fit in fits.items()
        if fit.outcome in (Outcome.FITTED, Outcome.SEPARATED, Outcome.UNDETERMINED)
    }
    if len(useful) < 2:
        number = "only one measure has" if useful else "no measure has"
        return Preference("", f"{number} a fragility; two are needed for a comparison")
    motions = next(iter(useful.values())).motions
    if motions < FEWEST_MOTIONS:
        return Preference(
            "",
            f"{motions} recordings are too few: at least {FEWEST_MOTIONS} are needed to "
            "name a better measure",
        )
    ranked = sorted(useful, key=lambda name: -float(useful[name].log_likelihood.sum()))
    first, second = ranked[:2]
    lead = useful[first].log_likelihood - useful[second].log_likelihood
    error = math.sqrt(motions) * float(lead.std(ddof=1))
    total = float(lead.sum())
    needed = float(scipy.special.stdtrit(motions - 1, 1.0 - 0.5 * _LEVEL))
    if not total > needed * error or total < 1e-9:
        return Preference(
            "",
            f"{first} and {second} predict the outcome equally well: their difference is within "
            "chance",
        )
    return Preference(
        first,
        f"ln L of {first} is above that of {second} by {total:.3g} ± {error:.2g} over {motions} "
        "recordings",
    )


def compared_motions(intensities: Mapping[str, Float]) -> NDArray[np.bool_]:
    """Return True for each motion that has every measure that any motion has, shape (motions,).

    Examples
    --------
    >>> compared_motions({"pga": np.array([1.0, 2.0]), "a_p": np.array([np.nan, 1.0])}).tolist()
    [False, True]
    """
    useful = [values for values in intensities.values() if np.isfinite(values).any()]
    measured = [np.isfinite(values) & (values > 0.0) for values in useful]
    return np.asarray(np.logical_and.reduce(measured), dtype=bool)


def pooled_intensities(frames: Sequence[RockingFrame], pga: Float, pgv: Float) -> dict[str, Float]:
    """Return the measures of `POOLED` for the motions under each frame, one frame after the other.

    p PGV / (g tan alpha) and PGA / (g tan alpha) are those of the column that rocks like the frame:
    p is p-hat, and g tan alpha is the ground acceleration at which the frame uplifts. Both are the
    same for a frame of twice the size and a motion whose time is stretched by the root of two,
    and so is theta: the dimensionless measures contain what size and slenderness do.

    Parameters
    ----------
    frames : sequence of RockingFrame
        Frames without restraints: with them, rocking depends on more than p and alpha.
    pga, pgv : array, shape (motions,)
        Peaks of the ground acceleration [m s-2] and velocity [m s-1].

    References
    ----------
    Dimitrakopoulos and Paraskeva (2015), Dimensionless fragility curves for rocking response to
    near-fault excitations, Earthquake Engineering and Structural Dynamics 44(12), 2015-2033.

    Examples
    --------
    >>> column = RockingFrame(height=4.0, width=1.0)
    >>> found = pooled_intensities([column], np.array([2.0]), np.array([0.5]))
    >>> {name: values.round(3).tolist() for name, values in found.items()}
    {'pga': [2.0], 'pgv': [0.5], 'dimensionless_pga': [0.815], 'dimensionless_pgv': [0.385]}
    """
    uplift = np.array([[frame.uplift_acceleration] for frame in frames])
    frequency = np.array([[frame.effective_frequency_parameter] for frame in frames])
    return {
        "pga": np.tile(pga, len(frames)),
        "pgv": np.tile(pgv, len(frames)),
        "dimensionless_pga": (pga / uplift).ravel(),
        "dimensionless_pgv": (frequency * pgv / uplift).ravel(),
    }
