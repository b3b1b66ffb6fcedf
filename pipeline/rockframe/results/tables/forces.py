"""Rows and words on the forces at the joints, in kN where the weight of the structure is known."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import repeat
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import Column, in_digits, number
from rockframe.quantities import FORCE_DURATION, FORCES, QUANTILES, QUANTITIES, Quantity
from rockframe.results.schema.arrays import only_record
from rockframe.results.tables.rows import Row, is_computed, rocks, rows_along
from rockframe.study.kinds import declared_kind

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: Meaning of the forces, for the lines below a table or figure.
FORCES_LEGEND: Final = (
    "Forces of one column, the mean of all columns: N columns have N times as much, and of two "
    "columns one carries more (rockframe figure joints --spacing). Shear key: largest horizontal "
    "force that the friction of the same instant does not carry. Forces are those until the model "
    "ends: until the gap of an abutment closes, the allowed lift is exceeded, or a tendon yields "
    "that is modelled as elastic."
)
#: The same of structures whose columns differ.
COLUMNS_LEGEND: Final = (
    "Of two columns that differ, forces are those of each column while the structure rocks, over "
    "half the weight W of columns and beam, and impulses the largest of the impacts. Quantiles are "
    "those of the members that uplift."
)
#: What forces of round columns in both directions are, while the columns move.
ROLLING_LEGEND: Final = (
    f"Forces of round columns that move in both directions are means over {FORCE_DURATION} s, not "
    "bounds for an instant: a pass near upright is shorter, only the softness of the joint limits "
    f"its force, and it counts by its impulse (the force times {FORCE_DURATION} s)."
)
#: What forces without the vertical motion lack.
NO_VERTICAL: Final = (
    "Without the vertical motion of the ground, on which vertical forces depend most: --vertical "
    "includes it."
)
#: What to state for forces in kN, and for the friction that shear keys need not carry.
STATE_MASS: Final = (
    "Over the weight W, because the mass is not known: for kN, state density_kg_m3 or "
    "column_mass_kg of the structure, or column_masses_kg of columns that differ."
)
STATE_FRICTION: Final = (
    "No friction is subtracted from the forces of shear keys: state friction_coefficient of the "
    "structure to subtract it."
)


def kilonewtons(over_weight: float, weight: float) -> float:
    """Return a force in kN, or an impulse in kN s, from that over the weight.

    Parameters
    ----------
    over_weight : float
        Force over the weight [1], or impulse over the weight [s].
    weight : float
        Weight of a column with its share of the beam [N]: `RockingFrame.weight`, and the variable
        ``weight`` of response.nc; NaN if it is not known.

    Examples
    --------
    >>> kilonewtons(0.2, 2.5e6)
    500.0
    """
    return over_weight * weight / 1000.0


def _has(force: Quantity, row: Row) -> bool:
    """Return True if the structure of a row has the joint or the restraint of a force."""
    if force.kind == "tie":
        return not math.isnan(row[force.name])
    differ = declared_kind(row["kind"]).columns_differ
    if force.taken == "column_forces":
        return differ and (row["verdict"] == "overturns" or not math.isnan(row[force.name]))
    if not is_computed(row) or (force.of_joints and (differ or not rocks(row))):
        return False
    return not force.name.startswith("top") or row["mass_ratio"] > 0.0


def _over_weight(force: Quantity, row: Row, end: str) -> float:
    """Return a force over the weight of a row; NaN for a quantile of a force without bands."""
    return float(row[f"{force.name}{end}"]) if end in _ends(force) else math.nan


def _ends(force: Quantity) -> tuple[str, ...]:
    """Return the endings of the columns of a force: that of the value, and those of quantiles."""
    return _QUANTILES if force.banded else _QUANTILES[:1]


def _in_kilonewtons(force: Quantity, row: Row, end: str) -> float:
    """Return a force [kN] or an impulse [kN s] of a row; NaN if the weight is not known.

    The column is the name of the force with an ending: empty for the nominal value, or that of a
    quantile.
    """
    value = _over_weight(force, row, end)
    if force.kind != "tie":
        return kilonewtons(value, row["weight"])
    fallen = row["verdict"] == "overturns" and not end  # the largest force is that of the fall
    return math.nan if fallen else value / 1000.0


#: Ends of the names of the nominal value and of its quantiles.
_QUANTILES: Final = ("", *(f"_{100 * quantile:.0f}" for quantile in QUANTILES))
_SHARED: Final = ("record_id", "structure", "weight", "friction_coefficient", "mass_ratio")
#: Variables of rows with all forces, over the weight or in N.
OF_FORCES: Final = {
    **{name: name for name in (*_SHARED, "verdict", "kind")},
    **{
        f"{force.name}{end}": f"{force.band}.{place - 1}" if end else force.name
        for force in FORCES
        for place, end in enumerate(_ends(force))
    },
}


def has_forces(response: Dataset) -> bool:
    """Return True if a response file has the forces at the joints."""
    return FORCES[0].name in response


def force_rows(response: Dataset, record: str | None = None) -> Iterator[Row]:
    """Yield a row for each record, structure and force; none if the file has no forces.

    A row has ``record_id``, ``structure``, ``weight_kn``, ``friction_coefficient``, ``force`` (its
    name), ``words``, ``unit``, and ``value`` with its quantiles ``value_16``, ``value_50`` and
    ``value_84`` in this unit: kN or kN s, or without a known weight that over the weight, W or W s.
    The value is NaN if the structure as given overturns; a quantile that falls on a member that
    overturns is infinite. Forces that a structure does not have, such as those of tendons, have no
    row, nor have impulses of motions in both directions.

    Parameters
    ----------
    response : Dataset
        A response file.
    record : str, optional
        Only this record.
    """
    if not has_forces(response):
        return
    response = only_record(response, record)
    rolling = _in_both_directions(response)
    for row in rows_along(response, "record structure", OF_FORCES):
        weight = row["weight"]
        for force in FORCES:
            if not _has(force, row) or (force.kind == "impulse" and row["record_id"] in rolling):
                continue
            unit = "kN" if force.kind == "tie" or not math.isnan(weight) else "W"
            yield {
                "record_id": row["record_id"],
                "structure": row["structure"],
                "weight_kn": weight / 1000.0,
                "friction_coefficient": row["friction_coefficient"],
                "force": force.name,
                "words": force.symbol,
                "unit": f"{unit} s" if force.kind == "impulse" else unit,
                **{
                    f"value{end}": _over_weight(force, row, end)
                    if unit == "W"
                    else _in_kilonewtons(force, row, end)
                    for end in _QUANTILES
                },
            }


def _in_both_directions(response: Dataset) -> set[str]:
    """Return the motions in both directions, in which columns roll and no impact has an impulse."""
    if "components" not in response:
        return set()
    columns = (map(str, response[name].values.tolist()) for name in ("record_id", "components"))
    return {record for record, components in zip(*columns, strict=True) if components}


def force_cells(response: Dataset) -> Iterator[Row]:
    """Return the columns of ``table.csv`` for each record and structure; none without forces.

    They are ``weight_kn``, and for each force its value and quantiles over the weight and in kN,
    such as ``base_key_force``, ``base_key_force_84`` and ``base_key_force_84_kn``; impulses end in
    ``_s`` and ``_kn_s``. Those in kN are NaN where the weight is not known.
    """
    if not has_forces(response):
        return repeat({})
    return map(_cells, rows_along(response, "record structure", OF_FORCES))


def _cells(row: Row) -> Row:
    cells = {"weight_kn": row["weight"] / 1000.0}
    for force in FORCES:
        second = "_s" if force.kind == "impulse" else ""
        for end in _ends(force):
            if force.kind != "tie":
                cells[f"{force.name}{end}{second}"] = float(row[f"{force.name}{end}"])
            cells[f"{force.name}{end}_kn{second}"] = _in_kilonewtons(force, row, end)
    return cells


#: Names of these columns.
FORCE_CELLS: Final = tuple(_cells(defaultdict(float)))


def forces_in_words(rows: Iterable[Mapping[str, Any]]) -> str:
    """Return the meaning of such rows, and which keys of structures to state for more."""
    rows = list(rows)
    forces = [QUANTITIES[row["force"]] for row in rows]
    differ = any(force.taken == "column_forces" for force in forces)
    alike = any(force.of_joints and force.taken == "forces" for force in forces) or not differ
    said = [*[FORCES_LEGEND] * alike, *[COLUMNS_LEGEND] * differ, *[ROLLING_LEGEND] * _roll(rows)]
    if _has_bands(rows):
        said.append(
            "16, 50, 84 %: quantiles of the ensemble; of a least force, the 16 % is the severe one."
        )
    if any(row["unit"].startswith("W") for row in rows):
        said.append(STATE_MASS)
    keys = [row for row in rows if row["force"].endswith("key_force")]
    if any(math.isnan(row["friction_coefficient"]) for row in keys):
        said.append(STATE_FRICTION)
    return " ".join(said)


def _roll(rows: Iterable[Mapping[str, Any]]) -> bool:
    """Return True if forces are of motions in both directions: those have no impulses."""
    impulses: dict[tuple[str, str], bool] = {}
    for row in rows:
        force, pair = QUANTITIES[row["force"]], (row["record_id"], row["structure"])
        if force.of_joints:
            impulses[pair] = impulses.get(pair, False) or force.kind == "impulse"
    return not all(impulses.values())


def _has_bands(rows: Iterable[Mapping[str, Any]]) -> bool:
    return any(not math.isnan(row["value_50"]) for row in rows)


def force_text(row: Mapping[str, Any], key: str) -> str:
    """Return a value or quantile of a row as text.

    Examples
    --------
    >>> row = {"unit": "kN", "value": math.nan, "value_16": 97.53, "value_84": math.inf}
    >>> [force_text(row, key) for key in ("value", "value_16", "value_84")]
    ['overturns', '98', 'overturns']
    """
    value = number(row[key])
    if math.isinf(value) or (key == "value" and math.isnan(value)):
        return "overturns"
    form = {"kN": ".0f", "kN s": ".1f", "W": ".3f"}.get(row["unit"], ".4f")
    return in_digits(value, form)


def force_words(row: Mapping[str, Any], _key: str = "") -> str:
    """Return the force of a row with its unit.

    Examples
    --------
    >>> force_words({"words": "base shear", "unit": "kN"})
    'base shear [kN]'
    """
    return f"{row['words']} [{row['unit']}]"


#: Keys of the nominal value and of the quantiles in such rows.
FORCE_VALUES: Final = tuple(f"value{end}" for end in _QUANTILES)


def force_columns(rows: Iterable[Mapping[str, Any]]) -> list[Column]:
    """Return the columns of a table of such rows; those of quantiles if there is an ensemble."""
    ends = _QUANTILES[1:] if _has_bands(rows) else ()
    return [
        Column("record", "record_id", once=True),
        Column("structure", "structure", once=True, priority=0),
        Column("force", rule=force_words, priority=0),
        Column("nominal>", "value", rule=force_text),
        *(Column(f"{end[1:]} %>", f"value{end}", rule=force_text) for end in ends),
        Column("weight W [kN]>", "weight_kn", ".0f", once=True, priority=2),
    ]
