"""Answers in plain sentences: whether a structure stands, how sure that is, and the margin."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Final

from rockframe.cells import Cells, number
from rockframe.results.tables.outcomes import severity, share_overturned
from rockframe.results.tables.rows import (
    in_verb_of,
    is_computed,
    spread_verdict,
    that_count,
)
from rockframe.rocking.verdict import VerdictKind

#: Kinds of verdicts under which a structure does not overturn.
_SAFE: Final = frozenset([VerdictKind.NO_UPLIFT, VerdictKind.STANDS])


def members_of(parameters: Mapping[str, Any]) -> int:
    """Return the number of members of the ensemble, from the parameters of ``response.nc``.

    Examples
    --------
    >>> members_of({"ensemble": {"members": 64}}), members_of({})
    (64, 0)
    """
    return int((parameters.get("ensemble") or {}).get("members") or 0)


def answer(row: Cells, members: int) -> str:
    """Return the verdict of one response in a sentence.

    Parameters
    ----------
    row : mapping
        A row of `response_rows` or of ``table.csv``.
    members : int
        Number of members of the ensemble.

    Examples
    --------
    >>> answer({"verdict": "stands", "share_overturned": 0.0, "robust_scale_10": 1.2165,
    ...         "largest_robust_scale": 10.0}, 64)
    'stands; none of 64 plausible structures overturns; 10 % overturn at 1.22 times the motion'
    >>> answer({"verdict": "overturns", "share_overturned": 0.3125}, 64)
    'may overturn; 20 of 64 plausible structures overturn'
    >>> answer({"verdict": "stands"}, 0)
    'stands exactly as given; how sure that is was not computed'
    """
    verdict = spread_verdict(row)
    if not verdict.is_computed:
        return "not computed"
    if verdict.is_nominal:
        unsure = "how sure that is was not computed"
        said = filter(None, (f"{verdict.kind.label} exactly as given", _end(row), unsure))
        return in_verb_of(row, "; ".join(said))
    count = _count(verdict.share_overturned, members)
    said = filter(None, (verdict.kind.label, _end(row), count, _margin(row)))
    return in_verb_of(row, "; ".join(said))


def answer_over_records(rows: Sequence[Cells], members: int) -> str:
    """Return the verdicts of one structure under several records in a sentence.

    Parameters
    ----------
    rows : sequence of mapping
        All rows of the structure, of `response_rows` or of ``table.csv``.
    members : int
        Number of members of the ensemble.

    Examples
    --------
    >>> stands = {"verdict": "stands", "share_overturned": 0.0, "robust_scale_10": 1.5,
    ...           "largest_robust_scale": 10.0}
    >>> rows = [{**stands, "record_id": "A"}, {**stands, "record_id": "B", "robust_scale_10": 1.2}]
    >>> said = answer_over_records(rows, 64).split("; ")
    >>> said[0], said[2]
    ('stands under all 2 records', '10 % overturn at 1.20 times B')
    >>> worse = {"record_id": "C", "verdict": "overturns", "share_overturned": 0.5}
    >>> for part in answer_over_records([*rows, worse], 64).split("; ")[:2]:
    ...     part
    'may overturn under 1 of 3 records'
    'under C, the worst, 32 of 64 plausible structures overturn'
    """
    computed = [row for row in rows if is_computed(row)]
    if len(computed) < 2:
        return answer((computed or rows)[0], members)
    kinds = Counter(spread_verdict(row).kind for row in computed)
    worst = min(computed, key=severity)
    both = " in both directions" if computed[0].get("components") else ""
    said = [_under_records(kinds, f"{len(computed)} {'motions' if both else 'records'}{both}")]
    share = share_overturned(worst)
    if spread_verdict(worst).is_nominal:
        said.append("each exactly as given")
    elif share:
        said.append(f"under {worst['record_id']}, the worst, {_count(share, members)}")
    else:
        said.append(_count(share, members))
    ends = sum(bool(_end(row)) for row in computed)
    said.append(f"the model ends under {ends}" if ends else "")
    nearest = min(computed, key=_scale)
    said.append(_margin(nearest, f"times {nearest['record_id']}"))
    if lacking := len(rows) - len(computed):
        said.append(f"not computed under {lacking} more")
    return in_verb_of(worst, "; ".join(filter(None, said)))


def answers(rows: Sequence[Cells], members: int) -> dict[str, str]:
    """Return the answer about each structure, by its name, over all motions that count."""
    of_each: dict[str, list[Cells]] = {}
    for row in that_count(rows):
        of_each.setdefault(str(row["structure"]), []).append(row)
    return {name: answer_over_records(each, members) for name, each in of_each.items()}


def _under_records(kinds: Mapping[VerdictKind, int], records: str) -> str:
    """Return under how many records a structure does not simply stand, or that it stands."""
    worse = [(kind.label, count) for kind, count in kinds.items() if kind not in _SAFE]
    if worse:
        worse.sort(key=lambda each: each[0], reverse=True)  # overturns, then may overturn
        first, *others = (f"{label} under {count}" for label, count in worse)
        return " and ".join([f"{first} of {records}", *others])
    lifts = kinds.get(VerdictKind.STANDS, 0) > 0
    return f"{'stands' if lifts else 'no uplift'} under all {records}"


def _count(share: float, members: int) -> str:
    """Return how many members overturn, or which share if their number is not known."""
    if not members:
        return f"{100.0 * share:.0f} % of the plausible structures overturn"
    count = round(share * members)
    if count == 0:
        return f"none of {members} plausible structures overturns"
    verb = "overturns" if count == 1 else "overturn"
    return f"{count} of {members} plausible structures {verb}"


def _end(row: Cells) -> str:
    """Return the event that ends the model, or "": the words of the verdict after its kind."""
    _, _, event = spread_verdict(row).words.partition("; ")
    return event


def _scale(row: Cells) -> float:
    """Return the margin; that beyond the largest scale is infinite, and one that is unknown too."""
    verdict = spread_verdict(row)
    scale = verdict.critical_scale if verdict.robust_scale is None else verdict.robust_scale
    return math.inf if scale is None or math.isnan(scale) else scale


def _margin(row: Cells, times: str = "times the motion") -> str:
    """Return the margin in words, or "" if it was not computed."""
    verdict, scale = spread_verdict(row), _scale(row)
    if verdict.robust_scale is None and verdict.critical_scale is None:
        return ""
    robust = verdict.robust_scale is not None
    if math.isfinite(scale):
        who = "10 % overturn" if robust else "exactly as given it overturns"
        return f"{who} at {scale:.2f} {times}"
    largest = number(row.get("largest_robust_scale" if robust else "largest_scale"))
    who = "fewer than 10 % overturn" if robust else "exactly as given it stands"
    return f"{who} at up to {largest:.3g} times the motion"
