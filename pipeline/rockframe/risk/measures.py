"""Intensity measures of fragility and hazard curves."""

from __future__ import annotations

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
        Printed unit in SI units.
    largest : float
        Largest intensity of a hazard curve, as printed.
    yearly : float
        Intensity that no site exceeds more than once a year in the long run, as printed.

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
