"""The table of demands at return periods, from a screening with a hazard curve."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import DASH, Column
from rockframe.quantities import LIMITED, QUANTITIES

if TYPE_CHECKING:
    import xarray as xr

#: First columns of the table, by which an earlier one is recognised.
DEMAND_COLUMNS: Final = ("structure", "quantity", "return_period_years")
#: Share of a rate from intensities that were not tried, or are not in the hazard curve, above which
#: the table says so [1].
_NOTED: Final = 0.1


def demand_rows(screening: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield a row for each structure, quantity that it has, and return period.

    A demand that is not determined has a row too, with a note that states why.

    Parameters
    ----------
    screening : Dataset
        As returned by `read_screening`, of a screening with ``return_period_years``.
    """
    periods = screening["return_period_years"].values.tolist()
    most_frequent = float(screening["hazard_rate"].values[0])
    for structure in screening["structure"].values:
        of_structure = screening.sel(structure=structure)
        for quantity in LIMITED:
            values, low, high, extrapolated = (
                of_structure[f"{quantity.name}_at_return_period{end}"].values.tolist()
                for end in ("", "_low", "_high", "_extrapolated")
            )
            for k, period in enumerate(periods):
                row = {
                    "structure": str(structure),
                    "quantity": quantity.name,
                    "return_period_years": period,
                    "unit": quantity.units,
                    **{"value": values[k], "low": low[k], "high": high[k]},
                    "extrapolated_share": extrapolated[k],
                }
                if not all(map(math.isnan, (values[k], low[k], high[k]))):
                    yield row | {"note": _note(row, most_frequent)}


def _note(row: Mapping[str, Any], most_frequent: float) -> str:
    """Return why a demand is uncertain, or ""; the hazard curve begins at the rate stated."""
    if math.isnan(row["value"]):
        begins = 1.0 / most_frequent
        if row["return_period_years"] <= begins * (1.0 + 1e-9):
            return (
                f"not determined: the hazard curve begins at a return period of {begins:.3g} years"
            )
        return "not determined by these motions: try other scales"
    share = row["extrapolated_share"]
    if share > _NOTED:
        where = "that were not tried, or that are below the hazard curve"
        return f"{100.0 * share:.0f} % of its rate is from intensities {where}"
    return ""


def demand_words(row: Mapping[str, Any]) -> str:
    """Return a demand with its bounds, in the unit for people.

    Examples
    --------
    >>> from math import nan
    >>> demand_words({"quantity": "peak_u", "value": 0.123, "low": 0.08, "high": float("inf")})
    '12.3 (8.0 to overturns)'
    >>> demand_words({"quantity": "peak_u", "value": nan, "low": 0.0, "high": nan})
    '–'
    """
    quantity = QUANTITIES[row["quantity"]]
    if math.isnan(row["value"]) and math.isnan(row["high"]):
        return DASH  # that a demand is 0 at least says nothing
    value, low, high = (quantity.outcome(row[name]) for name in ("value", "low", "high"))
    if value == low == high:
        return value
    return f"{value} ({low} to {high})"


def demand_table(rows: Sequence[Mapping[str, Any]]) -> tuple[list[Column], list[dict[str, str]]]:
    """Return the columns and rows to print: a row for each structure and quantity."""
    of_each: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        key = (row["structure"], row["quantity"])
        line = of_each.setdefault(
            key, {"structure": key[0], "quantity": QUANTITIES[key[1]].heading}
        )
        line[f"{row['return_period_years']:g}"] = demand_words(row)
    periods = sorted({row["return_period_years"] for row in rows})
    columns = [
        Column("structure", "structure"),
        Column("demand", "quantity"),
        *(Column(f"{period:g} years>", f"{period:g}") for period in periods),
    ]
    return columns, [*of_each.values()]
