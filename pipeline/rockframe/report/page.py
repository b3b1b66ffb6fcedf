"""One HTML page of a run: it holds all that it shows, and may ask nobody for anything."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from markupsafe import Markup

from rockframe.provenance import source_code_hash, versions
from rockframe.report.columns import shown
from rockframe.report.payload import checks, payload
from rockframe.results import Ground, History, Run, pulse_mark, stated_verdict
from rockframe.rocking import VerdictKind
from rockframe.web import UPLOT, environment, policy, script, style

_HOME: Final = Path(__file__).parent
#: The page's own script, in the order in which its parts need each other.
_PARTS: Final = ("data", "table", "detail", "main")
#: So many records and files are listed with their checks.
_MOST_ENTRIES: Final = 2000
#: Above this number of records the verdicts at a glance are no longer one.
_GLANCE: Final = 40


def render(run: Run, motions: Iterable[tuple[Ground, Sequence[History]]]) -> str:
    """Return the report of a run; the same run gives the same text.

    Parameters
    ----------
    run : Run
        What `rockframe.results.read_run` gives.
    motions : iterable of (Ground, sequence of History)
        What `rockframe.results.read_histories` gives of it for what is to be looked at closely.

    Returns
    -------
    str
        HTML. Its policy lets no request leave the page, and runs no script but its own.
    """
    facts, samples = payload(run, motions)
    code, look = script(_HOME, _PARTS), style(_HOME)
    return (
        environment(_HOME)
        .get_template("template.html")
        .render(
            policy=policy(code, look),
            script=Markup(code),  # noqa: S704 -- our own files, no text of a run
            style=Markup(look),  # noqa: S704
            plotter=UPLOT,
            facts=facts,
            samples=samples,
            pair_of={pair["row"]: i for i, pair in enumerate(facts["pairs"])},
            **_overview(run),
            **_provenance(run),
        )
    )


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
        "stated": [stated_verdict(row) for row in run.rows],
        "counts": run.counts,
        "total": total,
        "records_in_all": total // max(len(structures), 1),
        "records": records,
        "structures": structures,
        "place": place,
        "glance": len(records) <= _GLANCE and len(run.rows) == total,
        "entries": [(entry, checks(entry)) for entry in _looked_at_first(run)],
        "all_entries": len(run.entries),
    }


def _looked_at_first(run: Run) -> list[Mapping[str, str]]:
    """Records and files in their order; of very many, those of which something is to be said."""
    said = {"rejected": 0, "unread": 0}

    def concern(i: int) -> int:
        entry = run.entries[i]
        return said.get(entry["status"], 1 if entry["passport"] == "warn" else 2)

    first = sorted(range(len(run.entries)), key=concern)[:_MOST_ENTRIES]
    return [run.entries[i] for i in sorted(first)]


def _provenance(run: Run) -> dict[str, Any]:
    return {
        "manifest": run.manifest,
        "manifest_sha256": run.manifest_sha256,
        "version": versions()["rockframe"],
        "source": source_code_hash(),
    }
