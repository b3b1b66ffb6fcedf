"""The outcome that a row of a response states: share, peaks, margin, and how severe it is."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import Cells, number
from rockframe.quantities import IN_MATRICES, QUANTITIES, Quantity
from rockframe.results.tables.rows import Row, is_computed, peak_words, rocks
from rockframe.rocking.verdict import MODEL_ENDS, SpreadVerdict, Verdict, VerdictKind

#: Margins of which a summary has the smallest.
SEARCHED: Final = {
    "robust_scale_10": "largest_robust_scale",
    "critical_scale": "largest_scale",
}


def share_overturned(row: Cells) -> float:
    """Return the share of the ensemble that overturns; without one, 0 or 1 as the stated structure.

    Examples
    --------
    >>> share_overturned({"verdict": "overturns"})
    1.0
    """
    share = number(row.get("share_overturned"))
    if not is_computed(row):
        return math.nan
    return float(_fell(row)) if math.isnan(share) else share


def _fell(row: Cells) -> bool:
    return Verdict[row["verdict"].upper()] is Verdict.OVERTURNS


def _is_nominal(row: Cells) -> bool:
    return math.isnan(number(row.get("share_overturned")))


def column_of(quantity: Quantity, row: Cells) -> str:
    """Return the column of the median of the ensemble, or of the nominal peak."""
    return quantity.column("" if _is_nominal(row) else 0.5)


def peak_of(quantity: Quantity, row: Cells) -> float:
    """Return the median of the ensemble, or the nominal peak; infinite if it overturns."""
    fallen = _is_nominal(row) and _fell(row)
    return math.inf if fallen else number(row.get(column_of(quantity, row)))


def margin(row: Cells) -> float:
    """Return the margin that a row has; NaN if it has none."""
    return number(row.get(margin_of(row)))


def margin_of(row: Cells) -> str:
    """Return the column of the margin: the robust one, where it was searched."""
    robust = math.isfinite(number(row.get("robust_scale_10")))
    robust |= math.isfinite(number(row.get("largest_robust_scale")))
    return "robust_scale_10" if robust else "critical_scale"


def severity(row: Cells) -> tuple[float, float, float]:
    """Return the key that sorts rows, the most severe first.

    The share that overturns decides, then the largest rotation (of kinds that do not rock, drift;
    the median of the ensemble, if there is one), then the margin. Not computed is the last.

    Examples
    --------
    >>> rows = [{"verdict": "stands", "peak_rotation_ratio": one} for one in (0.1, 0.4)]
    >>> min(rows, key=severity)["peak_rotation_ratio"]
    0.4
    """
    scale = margin(row)
    if math.isnan(scale):  # beyond the largest scale that was searched
        scale = number(row.get(SEARCHED[margin_of(row)]))
    if not is_computed(row):
        return math.inf, math.inf, math.inf
    largest = peak_of(QUANTITIES["peak_rotation_ratio" if rocks(row) else "peak_u"], row)
    return -share_overturned(row), -largest, math.inf if math.isnan(scale) else scale


#: Quantities whose peaks a summary needs, and the columns of rows that it reads.
_NEEDED: Final = (*IN_MATRICES, QUANTITIES["peak_rotation_ratio"], QUANTITIES["peak_u"])
OF_OUTCOMES: Final = (
    *("record_id", "record", "verdict", "kind", "not_computed", "pga_g"),
    *("share_overturned", "share_uplifted", "share_model_ends"),
    *(f"{name}_s" for name in MODEL_ENDS),
    *(*SEARCHED, *SEARCHED.values()),
    *(quantity.column(part) for quantity in _NEEDED for part in ("", 0.5)),
)


class OutcomeColumns:
    """Rows of one structure as columns, whose numbers are read as arrays.

    Parameters
    ----------
    columns : mapping of str to sequence
        Some of the columns `OF_OUTCOMES`, of equal length, with ``verdict`` among them.
    """

    def __init__(self, columns: Mapping[str, Sequence[Any]]) -> None:
        self._columns, self._count = columns, len(columns["verdict"])
        self._verdicts = [Verdict[word.upper()] for word in columns["verdict"]]
        self.computed = np.array([one is not Verdict.NOT_COMPUTED for one in self._verdicts])
        self._fell = np.array([one is Verdict.OVERTURNS for one in self._verdicts])
        share = self.numbers("share_overturned")
        self.nominal = np.isnan(share)
        self.shares = np.where(self.nominal, self._fell, share)
        self._rocks = rocks({"kind": self.texts("kind")[0]})

    def texts(self, key: str) -> list[Any]:
        """Return the values of a column; None where there is no such column."""
        return [*self._columns.get(key, [None] * self._count)]

    def numbers(self, key: str) -> NDArray[np.float64]:
        """Return the numbers of a column; NaN where they are unknown."""
        values = self._columns.get(key)
        if values is None:
            return np.full(self._count, math.nan)
        if set(map(type, values)) != {float}:  # some are unknown, or texts
            values = list(map(number, values))
        return np.array(values, dtype=np.float64)

    def peaks(self, quantity: Quantity) -> NDArray[np.float64]:
        """Return the peaks as `peak_of` does."""
        medians, stated = (self.numbers(quantity.column(part)) for part in (0.5, ""))
        return np.where(self.nominal, np.where(self._fell, math.inf, stated), medians)

    def uplifted(self) -> NDArray[np.bool_]:
        """Return where the structure or any member uplifts; nowhere if its kind does not rock."""
        if not self._rocks:
            return np.zeros(self._count, dtype=bool)
        shares = zip(
            *(self.numbers(f"share_{end}").tolist() for end in ("overturned", "uplifted")),
            strict=True,
        )
        cases = [
            (verdict, None if nominal else of_members)
            for verdict, nominal, of_members in zip(
                self._verdicts, self.nominal.tolist(), shares, strict=True
            )
        ]
        return np.array([_uplifts(*case) for case in cases])

    def shares_of_ends(self) -> NDArray[np.float64]:
        """Return the shares of the ensembles for which the model ends, or 0 or 1 without one."""
        shares = self.numbers("share_model_ends")
        times = [self.numbers(f"{name}_s") for name in MODEL_ENDS]
        return np.where(np.isfinite(shares), shares, np.isfinite(times).any(axis=0))

    def that_may_be_worst(self) -> Iterator[Row]:
        """Yield the rows with the largest share and peak, the first keys of `severity`."""
        largest = self.peaks(QUANTITIES["peak_rotation_ratio" if self._rocks else "peak_u"])
        may_be = self.shares == self.shares.max()
        may_be &= largest == np.max(largest, where=may_be, initial=-math.inf)
        if np.isnan(largest).any() or np.isnan(self.shares).any():
            may_be[:] = True
        elif np.isnan([self.numbers(key) for pair in SEARCHED.items() for key in pair]).all():
            may_be[np.argmax(may_be) + 1 :] = False  # without margins, the first of equal rows
        for k in np.flatnonzero(may_be).tolist():
            yield {key: column[k] for key, column in self._columns.items()}


@lru_cache(maxsize=4096)
def _uplifts(verdict: Verdict, shares: tuple[float, float] | None) -> bool:
    """Return True if a structure uplifts, or any of the members of which these shares are."""
    overturned, uplifted = shares or (math.nan, math.nan)
    spread = SpreadVerdict(verdict, share_overturned=overturned, share_uplifted=uplifted)
    return spread.kind is not VerdictKind.NO_UPLIFT


@lru_cache(maxsize=4096)
def peak_in_words(pga: Any) -> str:
    """Return `peak_words` of a peak acceleration [g], which is that of many rows."""
    return peak_words({"pga_g": pga})
