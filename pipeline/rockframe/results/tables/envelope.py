"""The envelope of the forces over all records, and the record that governs each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from rockframe.cells import Cells, Column, in_digits
from rockframe.results.tables.forces import force_text, force_words
from rockframe.results.tables.rows import that_count

Row = dict[str, Any]


def force_envelope(rows: Iterable[Mapping[str, Any]]) -> list[Row]:
    """Return the governing value of each force of each structure over all records.

    It is the largest 84 % quantile of the ensembles, or the largest nominal value without an
    ensemble; of least forces the smallest 16 % quantile. Records under which that quantile
    overturns have no force: they are counted in ``overturns``.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of `force_rows`.

    Returns
    -------
    list of dict
        ``structure``, ``force``, ``words``, ``unit``, ``value`` in this unit (NaN if it overturns
        under all records), the governing record ``record_id``, and the numbers of ``records`` and
        of those that are ``overturns``.

    Examples
    --------
    >>> row = {"structure": "bent", "force": "base_key_force", "words": "key", "unit": "kN",
    ...        "value": 1.0, "value_16": 2.0}
    >>> (found,) = force_envelope([{**row, "record_id": "A", "value_84": 300.0},
    ...     {**row, "record_id": "B", "value_84": 500.0}, {**row, "record_id": "C",
    ...     "value_84": math.inf}])
    >>> found["value"], found["record_id"], found["records"], found["overturns"]
    (500.0, 'B', 3, 1)
    """
    of_each: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        of_each.setdefault((row["structure"], row["force"]), []).append(row)
    envelope = []
    for (structure, force), each in of_each.items():
        least = force.endswith("_least")
        values = [(_design_value(row, least=least), row) for row in each]
        finite = [pair for pair in values if math.isfinite(pair[0])]
        pick = min if least else max
        value, row = pick(finite, key=lambda pair: pair[0]) if finite else (math.nan, each[0])
        envelope.append(
            {
                "structure": structure,
                "force": force,
                **{key: row[key] for key in ("words", "unit")},
                "value": value,
                "record_id": row["record_id"] if finite else "",
                "records": len(each),
                "overturns": len(each) - len(finite),
            }
        )
    return envelope


def of_motions_that_count(
    forces: Iterable[Mapping[str, Any]], responses: Iterable[Cells]
) -> list[Mapping[str, Any]]:
    """Return the rows of forces under the motions that count, see `that_count`.

    Parameters
    ----------
    forces, responses : iterable of mapping
        Rows of `force_rows` and of `response_rows` of one file.

    Examples
    --------
    >>> stands = {"structure": "bent", "verdict": "stands"}
    >>> responses = [{**stands, "record_id": "A"}, {**stands, "record_id": "B", "components": "a"}]
    >>> forces = [{"structure": "bent", "record_id": name} for name in "AB"]
    >>> [row["record_id"] for row in of_motions_that_count(forces, responses)]
    ['B']
    """
    counted = {(row["record_id"], row["structure"]) for row in that_count(responses)}
    return [row for row in forces if (row["record_id"], row["structure"]) in counted]


def _design_value(row: Mapping[str, Any], *, least: bool) -> float:
    """Return the severe quantile of the ensemble, or the nominal value without an ensemble."""
    value = float(row["value_16" if least else "value_84"])
    return float(row["value"]) if math.isnan(value) else value


def envelope_columns() -> list[Column]:
    """Return the columns of a printed envelope."""
    return [
        Column("structure", "structure", once=True, priority=0),
        Column("force", rule=force_words, priority=0),
        Column("envelope>", "value", rule=_text, priority=0),
        Column("governing record", "record_id"),
        Column("overturns under>", "overturns", rule=_overturns),
    ]


def _text(row: Mapping[str, Any], key: str) -> str:
    value = row[key]
    return "overturns" if math.isnan(value) else force_text({**row, key: value}, key)


def _overturns(row: Mapping[str, Any], key: str) -> str:
    count = row[key]
    return f"{count} of {row['records']}" if count else in_digits(0.0, ".0f")


#: Meaning of the values, for the lines below a table.
ENVELOPE_LEGEND = (
    "Envelope: the largest 84 % quantile over all records, of least forces the smallest 16 % "
    "quantile; without an ensemble the largest nominal value. Records under which that quantile "
    "overturns have no force; they are counted."
)
