"""The HTML page of a run; it contains all its data and sends no requests."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import xarray as xr
from markupsafe import Markup

from rockframe.provenance import source_code_hash
from rockframe.report.payload import checks, payload
from rockframe.report.screening import screening_content
from rockframe.results.compare import COMPARISON
from rockframe.results.motions import Ground, History
from rockframe.results.run import Run
from rockframe.results.tables.columns import (
    OVERVIEW,
    Column,
    critical_scale,
    pulse_mark,
    stated_verdict,
)
from rockframe.rocking import VerdictKind
from rockframe.web.page import render_page, strip_svg

#: Largest number of records and files that are listed with their checks.
_MOST_ENTRIES: Final = 2000
#: Largest number of records in the grid of verdicts.
_GLANCE: Final = 40


def render(
    run: Run,
    motions: Iterable[tuple[Ground, Sequence[History]]],
    screening: xr.Dataset | None = None,
    comparison: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Return the report of a run. The same run gives the same text.

    Parameters
    ----------
    run : Run
        As returned by `rockframe.results.read_run`.
    motions : iterable of (Ground, sequence of History)
        As returned by `rockframe.results.read_histories` for the histories on the page.
    screening : Dataset, optional
        As returned by `rockframe.results.read_screening`, if the run has a screening.
    comparison : sequence of mapping
        As returned by `comparison_rows`, if the run compares bridges.

    Returns
    -------
    str
        HTML. The security policy forbids all requests, and all scripts except its own.
    """
    facts, samples = payload(run, motions)
    page, _ = render_page(
        Path(__file__).parent,
        ("data", "table", "detail", "main"),
        facts=facts,
        samples=samples,
        pair_of={pair["row"]: i for i, pair in enumerate(facts["pairs"])},
        screening=None if screening is None else screening_content(screening),
        comparison=comparison,
        comparison_columns=COMPARISON,
        manifest=run.manifest,
        manifest_sha256=run.manifest_sha256,
        source=source_code_hash(),
        **_overview(run),
    )
    return page


def _overview(run: Run) -> dict[str, Any]:
    count: Counter[str] = Counter()
    for (_, kind), number in run.counts.items():
        count[kind] += number
    total = sum(count.values())
    records = list(dict.fromkeys((row["record_id"], row["record"]) for row in run.rows))
    structures = list(dict.fromkeys(structure for structure, _ in run.counts))
    place = {(row["record_id"], row["structure"]): i for i, row in enumerate(run.rows)}
    return {
        "rows": run.rows,
        "columns": shown(run.rows),
        "count": count,
        "tally": [kind for kind in VerdictKind if count[kind] or kind is VerdictKind.OVERTURNED],
        "kinds": [kind for kind in VerdictKind if count[kind]],
        "noise_mark": max((pulse_mark(row) for row in run.rows), default=""),
        "strips": _strip_of_each_row(run),
        "stated": [stated_verdict(row) for row in run.rows],
        "counts": run.counts,
        "total": total,
        "records_in_all": total // max(len(structures), 1),
        "records": records,
        "structures": structures,
        "place": place,
        "glance": len(records) <= _GLANCE and len(run.rows) == total,
        "entries": [(entry, checks(entry)) for entry in _entries_to_list(run)],
        "all_entries": len(run.entries),
    }


def shown(rows: Sequence[Mapping[str, str]]) -> list[Column]:
    """Return the columns of the overview that have a value in any row.

    Examples
    --------
    >>> [column.head for column in shown([{"record": "A", "magnitude": "", "verdict": "safe"}])]
    ['Record', 'Verdict']
    """
    return [
        column
        for column in OVERVIEW
        if any(row.get(column.key) for row in rows)
        or (column.rule is critical_scale and any(row.get("largest_scale") for row in rows))
    ]


def _strip_of_each_row(run: Run) -> list[Markup]:
    """Return the strip of each row; empty if margins were not computed."""
    found = [run.strips.get((row["record_id"], row["structure"])) for row in run.rows]
    return [Markup(strip_svg(one)) for one in found if one]  # noqa: S704 -- our own picture


def _entries_to_list(run: Run) -> list[Mapping[str, str]]:
    """Return the records and files to list; rejections and warnings first if there are many."""
    said = {"rejected": 0, "unread": 0}

    def concern(i: int) -> int:
        entry = run.entries[i]
        return said.get(entry["status"], 1 if entry["passport"] == "warn" else 2)

    first = sorted(range(len(run.entries)), key=concern)[:_MOST_ENTRIES]
    return [run.entries[i] for i in sorted(first)]


#: The last line of a page: a hash of the rest, which shows if the page was changed.
_BEFORE: Final = b"<!-- SHA-256 of all above this line: "
_AFTER: Final = b" -->\n"


def sealed(page: str) -> bytes:
    """Encode a page in UTF-8 and append the line with its hash.

    Parameters
    ----------
    page : str
        HTML.

    Examples
    --------
    >>> is_whole(sealed("<p>Whole.</p>"))
    True
    """
    content = page.rstrip().encode() + b"\n"
    return content + _line(content)


def is_whole(content: bytes) -> bool:
    """Return True if the hash in the last line of a page is correct.

    Parameters
    ----------
    content : bytes
        Content of the file.

    Examples
    --------
    >>> is_whole(sealed("<p>Whole.</p>").replace(b"Whole", b"Hole"))
    False
    """
    page, before, _ = content.rpartition(_BEFORE)
    return bool(before) and content == page + _line(page)


def _line(content: bytes) -> bytes:
    return _BEFORE + hashlib.sha256(content).hexdigest().encode() + _AFTER
