"""Measures of intensity that fragility is stated against."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from rockframe.units import GRAVITY


@dataclass(frozen=True)
class Measure:
    """One measure; it grows in proportion with the motion.

    Parameters
    ----------
    name : str
        Its variable in the datasets.
    column : str
        Its column in tables, unit included.
    symbol, unit : str
        As it is printed.
    printed : float
        What is printed is the value in SI units, over this.
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


#: By name.
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
