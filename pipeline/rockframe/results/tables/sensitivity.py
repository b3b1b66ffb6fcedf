"""Rows and words on the spreads of the ensemble that matter most."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import DASH, Column, number
from rockframe.results.schema.arrays import only_record
from rockframe.results.tables.rows import Row, rows_along

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: Meaning of the rank correlations, for the line below a table or figure.
SENSITIVITY_LEGEND: Final = (
    "Rank correlation between each spread of the ensemble and the peak rotations of its members, "
    "from -1 to 1. Of spreads without any effect, 5 % exceed {chance:.2f} by chance."
)


def sensitivity_rows(response: Dataset, record: str | None = None) -> Iterator[Row]:
    """Yield a row for each record and structure; none if the file has no rank correlations.

    A row has ``record_id``, ``structure``, the rank correlation of each spread by its name,
    ``by_chance``, and ``matters_most``: the spread with the largest correlation that is larger than
    by chance, empty if there is none.

    Parameters
    ----------
    response : Dataset
        A response file.
    record : str, optional
        Only this record.
    """
    if "rank_correlation" not in response:
        return
    response = only_record(response, record)
    names = [str(name) for name in response["spread"].values]
    chance = float(response["rank_correlation_by_chance"].values[0])
    columns = {name: f"rank_correlation.{place}" for place, name in enumerate(names)}
    columns_of_row = {"record_id": "record_id", "structure": "structure", **columns}
    for row in rows_along(response, "record structure", columns_of_row):
        correlations = {name: float(row[name]) for name in names}
        yield {**row, "by_chance": chance, "matters_most": matters_most(correlations, chance)}


def matters_most(correlations: Mapping[str, float], chance: float) -> str:
    """Return the spread with the largest rank correlation, if that is larger than by chance.

    Examples
    --------
    >>> matters_most({"height": 0.1, "corner": -0.6, "amplitude": 0.3}, 0.25)
    'corner'
    >>> matters_most({"height": 0.1, "corner": math.nan}, 0.25)
    ''
    """
    beyond = {name: abs(item) for name, item in correlations.items() if abs(item) > chance}
    return max(beyond, key=lambda name: beyond[name], default="")


def spread_words(name: str) -> str:
    """Return the name of a spread in words.

    Examples
    --------
    >>> spread_words("impact_loss"), spread_words("orientation_degree")
    ('impact loss', 'orientation')
    """
    return name.removesuffix("_degree").replace("_", " ")


def sensitivity_words(row: Mapping[str, Any]) -> str:
    """Return a row in words: the spread that matters most, and the meaning of the numbers.

    Examples
    --------
    >>> row = {"corner": 0.6, "width": 0.1, "by_chance": 0.25, "matters_most": "corner"}
    >>> sensitivity_words(row).partition(".")[0]
    'Of the spreads of the ensemble, the corner matters most'
    """
    most = spread_words(row["matters_most"])
    first = f"the {most} matters most" if most else "none matters more than by chance"
    legend = SENSITIVITY_LEGEND.format(chance=row["by_chance"])
    return f"Of the spreads of the ensemble, {first}. {legend}"


def spreads_of_row(row: Mapping[str, Any]) -> list[str]:
    """Return the names of the spreads in a row of `sensitivity_rows`."""
    return [name for name in row if name not in _OTHERS]


def spreads_of_rows(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of the spreads of rows; that of the contact's shortening only if a row has
    it, as those of motions in both directions do.

    Examples
    --------
    >>> spreads_of_rows([{"corner": math.nan, "contact_shortening": math.nan}])
    ['corner']
    """
    measured = [row for row in rows if math.isfinite(number(row.get("contact_shortening")))]
    return [name for name in spreads_of_row(rows[0]) if measured or name != "contact_shortening"]


def sensitivity_columns(row: Mapping[str, Any]) -> list[Column]:
    """Return the columns of a table of such rows."""
    return [
        Column("record", "record_id", once=True),
        Column("structure", "structure"),
        Column("matters most", "matters_most", rule=_most),
        *(Column(f"{spread_words(name)}>", name, "+.2f") for name in spreads_of_row(row)),
    ]


_OTHERS: Final = ("record_id", "structure", "by_chance", "matters_most")


def _most(row: Mapping[str, Any], key: str) -> str:
    has_spreads = any(math.isfinite(number(row[name])) for name in spreads_of_row(row))
    return spread_words(str(row[key])) or ("none more than by chance" if has_spreads else DASH)
