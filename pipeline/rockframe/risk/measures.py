"""Intensity measures of fragility and hazard curves."""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from rockframe.units import GRAVITY


@dataclass(frozen=True)
class Measure:
    """An intensity measure that is proportional to the scale of the motion.

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


#: The measures by name.
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

#: The measures by the names of their columns.
COLUMNS: Final = MappingProxyType({one.column: one for one in MEASURES.values()})
_SPECTRAL: Final = re.compile(r"sa_([0-9.e+-]+)s(_g)?")


def spectral(period: float) -> Measure:
    """Return the measure of the spectral acceleration at a period [s], 5 % damped.

    Examples
    --------
    >>> spectral(0.5).column
    'sa_0.5s_g'
    """
    name = f"sa_{period:g}s"
    return Measure(name, f"{name}_g", f"SA({period:g} s)", "g", GRAVITY, yearly=0.3)


def measure_of(name: str) -> Measure:
    """Return the measure with a name: one of `MEASURES`, or a spectral acceleration.

    Examples
    --------
    >>> measure_of("sa_0.5s").symbol
    'SA(0.5 s)'
    """
    return MEASURES[name] if name in MEASURES else spectral(period_of(name))


def measure_of_column(column: str) -> Measure | None:
    """Return the intensity measure in a table column; None if the column has another quantity."""
    if column in COLUMNS:
        return COLUMNS[column]
    period = period_of(column) if column.endswith("_g") else 0.0
    return spectral(period) if period > 0.0 else None


def period_of(name: str) -> float:
    """Return the period of a spectral acceleration [s]; 0 for other measures."""
    stated = _SPECTRAL.fullmatch(name)
    try:
        return float(stated[1]) if stated else 0.0
    except ValueError:
        return 0.0
