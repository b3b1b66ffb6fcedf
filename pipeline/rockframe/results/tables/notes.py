"""Notes on a summary: what its numbers hide, and which motions they count."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from rockframe.cells import Cells, number
from rockframe.results.tables.rows import Row

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Dataset

#: Largest number of notes on a summary, and of records that one names.
_MOST_NOTES: Final = 10
MOST_NAMED: Final = 5


def summary_notes(rows: Sequence[Cells]) -> list[str]:
    """Return what a median of all records hides: no uplift under many, and models that end.

    Examples
    --------
    >>> row = {"structure": "bent", "records": 6, "uplifted": 2, "uplifted_peak_u_50_m": 0.031,
    ...        "model_ends": 1, "largest_share_model_ends": 0.98}
    >>> summary_notes([row])[0]
    'bent uplifts under 2 of 6 records, with a median drift of 3.1 cm; the others count as 0 cm.'
    >>> summary_notes([row])[1]
    'bent: the model ends under 1 of 6 records, for up to 98 %. Verdicts hold up to that event.'
    """
    notes = []
    for row in rows:
        name, records = row["structure"], int(row["records"])
        uplifted = int(row["uplifted"] or 0)
        if 0 < uplifted < records and row.get("uplifted_peak_u_50_m"):
            drift = 100.0 * number(row["uplifted_peak_u_50_m"])
            words = "where it overturns" if math.isinf(drift) else f"of {drift:.1f} cm"
            notes.append(
                f"{name} uplifts under {uplifted} of {records} records, with a median drift {words}"
                "; the others count as 0 cm."
            )
        if missing := int(row.get("not_computed") or 0):
            notes.append(
                f"{name}: not computed under {missing} of {records + missing} records, which are "
                "in no number here."
            )
        if ends := int(row.get("model_ends") or 0):
            share = 100.0 * number(row["largest_share_model_ends"])
            notes.append(
                f"{name}: the model ends under {ends} of {records} records, for up to {share:.0f} "
                "%. Verdicts hold up to that event."
            )
    notes = [*direction_notes(rows), *notes]
    more = len(notes) - _MOST_NOTES
    return [*notes[:_MOST_NOTES], *([f"{more} more notes."] if more > 0 else [])]


#: Why structures of round columns are computed in one plane, if no motion is in both directions.
_ALONE: Final = (
    "no station has both horizontal components in one of these motions, and round columns, which "
    "follow both, may overturn where they stand in a plane"
)


def with_directions(rows: Iterable[Row], attributes: Mapping[str, str]) -> list[Row]:
    """Return rows of `summary_rows` that say which structures of round columns are in one plane,
    because no motion is in both directions.

    Parameters
    ----------
    rows : iterable of mapping
        The rows.
    attributes : mapping of str to str
        Attributes of the file of responses or of the screening.

    Examples
    --------
    >>> row = {"structure": "bent", "records": 2}
    >>> (row,) = with_directions([row], {"parameters": '{"in_one_plane": ["bent"]}'})
    >>> row["directions"], row["not_both"][:41]
    (1, 'no station has both horizontal components')
    """
    alone = set(_in_one_plane(attributes))
    if not alone:
        return list(rows)
    return [
        {
            **row,
            "directions": 1,
            "not_both": _ALONE if row["structure"] in alone else "",
            "records_in_one_plane": row["records"],
            "alone": "",
        }
        for row in rows
    ]


def comparison_note(attributes: Mapping[str, str]) -> str:
    """Return that round columns are compared in one plane; "" if there are none.

    Parameters
    ----------
    attributes : mapping of str to str
        Attributes of the file of the comparison.

    Examples
    --------
    >>> comparison_note({"parameters": '{"in_one_plane": ["bent"]}'})[:37]
    'bent: compared in one plane, in which'
    """
    names = ", ".join(_in_one_plane(attributes))
    return names and (
        f"{names}: compared in one plane, in which alone isolated and monolithic bridges are "
        "computed. Round columns follow both horizontal directions of the ground, and may overturn "
        "where they stand in a plane: rockframe respond states the share in both."
    )


def _in_one_plane(attributes: Mapping[str, str]) -> list[str]:
    """Return the structures of round columns that are in one plane alone."""
    return list(json.loads(attributes.get("parameters", "{}")).get("in_one_plane", ()))


def direction_notes(rows: Sequence[Cells]) -> list[str]:
    """Return which structures are summarised in both directions, and why others are not.

    Examples
    --------
    >>> rows = [{"structure": "bent", "directions": 2},
    ...         {"structure": "pier", "directions": 1, "not_both": "not computed for both"}]
    >>> direction_notes(rows)[1]
    'pier: in one plane; not computed for both.'
    """
    both = [row["structure"] for row in rows if str(row.get("directions")) == "2"]
    notes = []
    if both:
        notes.append(
            f"{', '.join(both)}: only motions in both directions count, because round columns "
            "follow both; rows of one record are in one plane."
        )
    notes += filter(None, [alone_note(rows)])
    reasons: dict[str, list[str]] = {}
    for row in rows:
        if row.get("not_both"):
            reasons.setdefault(str(row["not_both"]), []).append(row["structure"])
    return [
        *notes,
        *(f"{', '.join(reason)}: in one plane; {why}." for why, reason in reasons.items()),
    ]


def alone_note(rows: Sequence[Cells]) -> str:
    """Return the records that no motion in both directions has, so that round columns lack them.

    Examples
    --------
    >>> alone_note([{"alone": "A-1 B-2"}])
    'In no motion in both directions, so not counted for round columns: A-1, B-2.'
    """
    alone = next((str(row["alone"]).split() for row in rows if row.get("alone")), [])
    more = len(alone) - MOST_NAMED
    names = ", ".join(alone[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
    start = "In no motion in both directions, so not counted for round columns"
    return f"{start}: {names}." if alone else ""


#: Largest number of reasons that are stated.
_MOST_REASONS: Final = 3


def left_out_reasons(attributes: Mapping[str, str]) -> dict[str, str]:
    """Return why records have no result, by identifier, from the attributes of a dataset.

    Records outside the user's filters are not included.
    """
    filtered = json.loads(attributes.get("filtered", "[]"))
    reasons = json.loads(attributes.get("left_out", "{}"))
    return {name: reason for name, reason in reasons.items() if name not in filtered}


def left_out_words(reasons: Mapping[str, str], computed: int, what: str = "records") -> str:
    """Return how many records have no result, which ones and why; empty if all have one.

    Parameters
    ----------
    reasons : mapping of str to str
        Reason of each record that was left out, by identifier.
    computed : int
        Number of records that have results.
    what : str
        Word for records.

    Examples
    --------
    >>> left_out_words({"b": "no vertical record."}, 2)
    '1 of 3 records left out: b: no vertical record.'
    """
    if not reasons:
        return ""
    count = f"{len(reasons)} of {computed + len(reasons)} {what} left out"
    return f"{count}: {reasons_in_words(reasons)}"


def reasons_in_words(reasons: Mapping[str, str]) -> str:
    """Return the records of each reason, by identifier; of many, the first.

    Examples
    --------
    >>> reasons_in_words({"a": "too short.", "b": "too short.", "c": "no vertical record."})
    'a, b: too short. c: no vertical record.'
    """
    together: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        together.setdefault(reason.rstrip("."), []).append(name)
    said = []
    for reason, names in [*together.items()][:_MOST_REASONS]:
        more = len(names) - MOST_NAMED
        listed = ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
        said.append(f"{listed}: {reason}.")
    if len(together) > _MOST_REASONS:
        said.append(f"{len(together) - _MOST_REASONS} more reasons.")
    return " ".join(said)


def first_words(rows: Iterable[Cells], key: str) -> str:
    """Return the first words that rows have in a column, such as ``left_out_words``; or ""."""
    return next((str(row[key]) for row in rows if row.get(key)), "")


def left_out_motions(screening: Dataset) -> str:
    """Return `left_out_words` of the motions of a screening."""
    reasons = left_out_reasons(screening.attrs)
    return left_out_words(reasons, screening.sizes["record"], "motions")
