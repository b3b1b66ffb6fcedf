"""Columns of the overview table of the report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from rockframe.results.tables.table import pulse_mark, stated_verdict

#: Shown as dashes for structures that overturn: they describe only the fall.
_OF_THE_FALL: Final = ("peak_rotation_ratio", "u_max_m", "v_max_m")
_DASH: Final = "–"
#: Short names of wavelets, as in the tables of the terminal.
_SHORT: Final = {"symmetric_ricker": "sym", "antisymmetric_ricker": "antisym"}


@dataclass(frozen=True)
class Column:
    """One column of the overview.

    Parameters
    ----------
    key : str
        Column of ``table.csv``.
    head, unit : str
        Heading and unit.
    decimals : int, optional
        Decimals of a number; without them the column is text.
    factor : float
        Conversion of a number to the unit of the column.
    minor : bool
        The column is hidden on narrow pages.
    wraps : bool
        The text may take several lines.
    """

    key: str
    head: str
    unit: str = ""
    decimals: int | None = None
    factor: float = 1.0
    minor: bool = False
    wraps: bool = False

    def cell(self, row: Mapping[str, str]) -> str:
        """Return the text of the cell of a row; a dash if the value is unknown.

        Examples
        --------
        >>> Column("u_max_m", "u", "cm", 1, 100.0).cell({"u_max_m": "0.135", "verdict": "safe"})
        '13.5'
        """
        text = row[self.key]
        if self.key == "verdict":
            return stated_verdict(row).words
        if self.decimals is None:
            mark = pulse_mark(row) if self.key == "wavelet" else ""
            return _SHORT.get(text, text) + mark or _DASH
        if self.key == "critical_scale" and not text and row.get("largest_scale"):
            return f"> {float(row['largest_scale']):.3g}"
        if not text or (self.key in _OF_THE_FALL and stated_verdict(row).overturns):
            return _DASH
        return f"{self.factor * float(text):.{self.decimals}f}"

    def order(self, row: Mapping[str, str]) -> str:
        """Return the key that sorts a column of numbers; unknown values come below all others."""
        text = row[self.key]
        if self.key == "critical_scale" and not text and row.get("largest_scale"):
            return "Infinity"
        return text if text and math.isfinite(float(text)) else "-Infinity"


#: All columns in their order, the results first.
COLUMNS: Final = (
    Column("record", "Record", wraps=True),
    Column("structure", "Structure"),
    Column("verdict", "Verdict", wraps=True),
    Column("critical_scale", "Critical scale", "", 2),
    Column("robust_scale_10", "10 % overturn", "", 2),
    Column("robust_scale_25", "25 %", "", 2),
    Column("robust_scale_50", "50 %", "", 2),
    Column("peak_rotation_ratio", "θ/α", "", 3),
    Column("u_max_m", "u", "cm", 1, 100.0, minor=True),
    Column("v_max_m", "v", "cm", 2, 100.0, minor=True),
    Column("event", "Earthquake", minor=True, wraps=True),
    Column("magnitude", "M", "", 1, minor=True),
    Column("epicentral_distance_km", "Repi", "km", 1, minor=True),
    Column("pga_g", "PGA", "g", 2, minor=True),
    Column("pgv_m_s", "PGV", "m/s", 2, minor=True),
    Column("a_p_g", "a_p", "g", 2, minor=True),
    Column("T_p_s", "T_p", "s", 2, minor=True),
    Column("wavelet", "Pulse", minor=True),
)


def shown(rows: Sequence[Mapping[str, str]]) -> list[Column]:
    """Return the columns that have a value in any row.

    Examples
    --------
    >>> [column.head for column in shown([{"record": "A", "magnitude": "", "verdict": "safe"}])]
    ['Record', 'Verdict']
    """
    return [
        column
        for column in COLUMNS
        if any(row.get(column.key) for row in rows)
        or (column.key == "critical_scale" and any(row.get("largest_scale") for row in rows))
    ]
