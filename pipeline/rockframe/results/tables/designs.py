"""Tables of comparisons: columns of their rows, designs over all records, and the best of them."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from rockframe.cells import DASH, Cells, Column, in_digits, number
from rockframe.quantities import QUANTITIES, Quantity
from rockframe.results.tables.number_store import mean_shares_of, over_records
from rockframe.results.tables.rows import Row, band_words, share_words


def validity_words(row: Mapping[str, Any], _key: str = "") -> str:
    """Return the reason why a model stops being valid, the time, and the share of the ensemble.

    Examples
    --------
    >>> row = {"validity": "gap_closes", "valid_until_s": 3.5, "share_model_ends": 0.625}
    >>> validity_words(row), validity_words({"validity": "holds", "valid_until_s": math.nan})
    ('gap closes 3.50 s; ends in 62 %', 'holds')
    """
    words = str(row["validity"]).replace("_", " ")
    when, share = float(row["valid_until_s"]), number(row.get("share_model_ends"))
    words += f" {when:.2f} s" if math.isfinite(when) else ""
    return words + (f"; ends in {100.0 * share:.0f} %" if share > 0.0 else "")


def _column(name: str) -> Column:
    """Return the column of a quantity."""
    quantity = QUANTITIES[name]
    return Column(
        f"{quantity.heading}>",
        quantity.column(),
        quantity.form,
        quantity.factor,
        priority=quantity.priority,
    )


#: Columns of a comparison table, in the terminal and on the page.
COMPARISON: Final = (
    Column("record", "record_id"),
    Column("structure", "structure", priority=0),
    Column("bridge", "model", priority=0),
    _column("peak_u"),
    Column("16 50 84 %>", QUANTITIES["peak_u"].column("*"), rule=band_words, priority=3),
    Column("overturn>", "share_overturned", rule=share_words),
    *map(_column, ("peak_v", "residual_u", "peak_base_shear", "peak_tendon_force")),
    _column("friction_demand"),
    Column("model", "validity", rule=validity_words, priority=0),
)


_SHEAR: Final = QUANTITIES["peak_base_shear"]
#: Quantities by which designs are compared; the less, the better.
DESIGN_QUANTITIES: Final = (
    QUANTITIES["peak_u"],
    QUANTITIES["residual_u"],
    _SHEAR,
    replace(_SHEAR, units="kN", shown_unit="kN", form=".0f"),
    QUANTITIES["peak_tendon_force"],
    QUANTITIES["peak_dissipater_force"],
    QUANTITIES["friction_demand"],
)


def _of_record(quantity: Quantity, row: Cells) -> float:
    """Return the median of the ensemble, or the nominal value; infinite if that overturns.

    A quantity without a median is infinite too if the median of the ensemble overturns.
    """
    ensemble = math.isfinite(number(row.get("share_overturned")))
    if ensemble and quantity.banded:
        return number(row.get(quantity.column(0.5)))
    nominal = number(row.get(quantity.column()))
    overturns = ensemble and number(row["peak_u_50_m"]) == math.inf
    return math.inf if overturns and not math.isnan(nominal) else nominal


_SHARES: Final = {"share_overturned": "overturn [%]", "share_model_ends": "model ends in [%]"}
#: First columns of the designs and of the best of them, by which earlier ones are recognised.
DESIGN_COLUMNS: Final = ("structure", "design", "records")
BEST_COLUMNS: Final = ("quantity", "best")


def design_rows(
    rows: Sequence[Cells], recordings: Mapping[str, Hashable] | None = None
) -> list[Row]:
    """Return a row for each structure and model of a comparison, over all records.

    Parameters
    ----------
    rows : sequence of mapping
        Rows of `comparison_rows`.
    recordings : mapping of str to hashable, optional
        As for `summary_rows`.

    Returns
    -------
    list of dict
        ``structure``, ``design``, the number of ``records``, ``weight_kn``; ``share_overturned``
        with its 90 % interval, and ``share_model_ends``, means over the records of the shares of
        the ensembles; and for each of `DESIGN_QUANTITIES` the 50 and 84 % quantiles over the
        records, the value of the worst record, and its name. Each record counts with the median of
        its ensemble, and as infinite if that overturns; the residual drift is nominal otherwise.

    Examples
    --------
    >>> from collections import defaultdict
    >>> rows = [defaultdict(lambda: math.nan, structure="bent", model="free", record_id=name,
    ...                     validity="holds", peak_u_m=u) for name, u in (("a", 0.1), ("b", 0.3))]
    >>> (row,) = design_rows(rows)
    >>> row["design"], row["peak_u_50_m"], row["peak_u_worst_m"], row["peak_u_record"]
    ('free', 0.2, 0.3, 'b')
    """
    of_each: dict[tuple[str, str], list[Cells]] = {}
    for row in rows:
        of_each.setdefault((row["structure"], row["model"]), []).append(row)
    return [
        {"structure": structure, "design": model, **_design(own, recordings or {})}
        for (structure, model), own in of_each.items()
    ]


def _design(rows: Sequence[Cells], recordings: Mapping[str, Hashable]) -> Row:
    shares = [_share(row, "share_overturned", _fell(row)) for row in rows]
    ends = [_share(row, "share_model_ends", row["validity"] != "holds") for row in rows]
    cells: Row = {"records": len(rows), "weight_kn": number(rows[0].get("weight_kn"))}
    cells |= mean_shares_of([shares], (row["record_id"] for row in rows), recordings)[0]
    cells["share_model_ends"] = float(np.mean(ends))
    for quantity in DESIGN_QUANTITIES:
        values = np.array([_of_record(quantity, row) for row in rows])
        places = np.flatnonzero(~np.isnan(values))
        worst = int(places[np.argmax(values[places])]) if places.size else -1
        _, middle, high = over_records(values[places])
        cells |= {
            quantity.column(0.5): middle,
            quantity.column(0.84): high,
            quantity.column("worst"): float(values[worst]) if places.size else math.nan,
            f"{quantity.name}_record": rows[worst]["record_id"] if places.size else "",
        }
    return cells


def _fell(row: Cells) -> bool:
    return number(row["peak_u_m"]) == math.inf


def _share(row: Cells, key: str, nominal: bool) -> float:
    """Return a share of the ensemble; without one, 0 or 1 as for the bridge as given.

    A bridge whose model ends only by overturning has no share of it, but one that overturns.
    """
    share = number(row.get(key))
    if math.isnan(share):
        share = number(row.get("share_overturned"))
    return float(nominal) if math.isnan(share) else share


def design_name(row: Cells, several: bool) -> str:
    """Return the name of a design; with the structure if the comparison has several."""
    return f"{row['structure']} {row['design']}" if several else str(row["design"])


def best_rows(designs: Sequence[Row]) -> list[Row]:
    """Return a row for each quantity: the best and the second best design.

    Designs are ranked by the 84 % quantile over the records, or by the share; equal ones share
    their rank. Quantities of fewer than two designs are left out.

    Parameters
    ----------
    designs : sequence of dict
        Rows of `design_rows`.

    Returns
    -------
    list of dict
        ``quantity`` (the column that decides), ``words``; ``best`` and ``second`` (names), the
        value of each, and the share ``best_model_ends`` and ``second_model_ends`` for which its
        model ends, the largest of equal ones.
    """
    several = len({row["structure"] for row in designs}) > 1
    ranked = dict(_SHARES) | {
        quantity.column(0.84): quantity.heading for quantity in DESIGN_QUANTITIES
    }
    best = []
    for key, words in ranked.items():
        candidates = [row for row in designs if not math.isnan(row[key])]
        values = sorted({row[key] for row in candidates})[:2]
        if len(candidates) < 2:
            continue
        row: Row = {"quantity": key, "words": words}
        for place, value in zip(("best", "second"), [*values, math.nan], strict=False):
            equal = [candidate for candidate in candidates if candidate[key] == value]
            row[place] = ", ".join(design_name(row, several) for row in equal)
            row[f"{place}_value"] = value
            ends = [row["share_model_ends"] for row in equal]
            row[f"{place}_model_ends"] = max(ends, default=math.nan)
        best.append(row)
    return best


#: Largest number of designs of one rank that are printed by name.
_NAMED: Final = 3


def _names(row: Cells, key: str) -> str:
    count = row[key].count(",") + 1
    return f"{count} designs" if count > _NAMED else row[key] or DASH


def _best_value(row: Cells, key: str) -> str:
    for quantity in DESIGN_QUANTITIES:
        if quantity.column(0.84) == row["quantity"]:
            return quantity.outcome(number(row[key]))
    return in_digits(100.0 * number(row[key]), ".0f")


#: Columns of `best_rows` in terminal and page.
BEST: Final = (
    Column("Quantity, 84 %", "words"),
    Column("best", "best", rule=_names, wraps=True),
    Column(">", "best_value", rule=_best_value),
    Column("model ends\nin [%]>", "best_model_ends", ".0f", 100.0),
    Column("second best", "second", rule=_names, wraps=True),
    Column(">", "second_value", rule=_best_value),
    Column("model ends\nin [%]>", "second_model_ends", ".0f", 100.0),
)
#: Explanation of the tables of designs.
DESIGN_LEGEND: Final = (
    "Over all records: 50 and 84 % quantiles and the worst record; each record counts with the "
    "median of its ensemble, and as infinite if that overturns. "
    f"{QUANTITIES['residual_u'].symbol.capitalize()}: drift that remains, nominal unless that "
    "median overturns. "
    "Model ends in: share of plausible bridges that overturn or reach a limit of the model, after "
    "which its values no longer describe the bridge. W: weight of deck and columns; kN for a "
    "column with its share of the deck. A fixed bridge without a stated strength stays elastic."
)


def _spread(row: Cells, key: str) -> str:
    """Return 50 %, 84 % and worst value of a quantity."""
    (quantity,) = (quantity for quantity in DESIGN_QUANTITIES if quantity.column("*") == key)
    words = [
        quantity.outcome(number(row.get(quantity.column(part)))) for part in (0.5, 0.84, "worst")
    ]
    return DASH if words == [DASH] * 3 else " ".join(words)


def design_columns(designs: Sequence[Row]) -> list[Column]:
    """Return the columns of printed designs; quantities that none has are left out."""
    present = [
        quantity
        for quantity in DESIGN_QUANTITIES
        if any(not math.isnan(row[quantity.column(0.84)]) for row in designs)
    ]
    quantities = [
        Column(
            f"{one.heading}\n50 84 % worst>", one.column("*"), rule=_spread, priority=one.priority
        )
        for one in present
    ]
    quantities.insert(1, Column("worst record", "peak_u_record", wraps=True, priority=2))
    return [
        Column("Structure", "structure", once=True),
        Column("design", "design", priority=0),
        Column("overturn\n(90 %)>", "share_overturned", rule=share_words),
        Column("model ends\nin [%]>", "share_model_ends", ".0f", 100.0),
        *quantities,
    ]
