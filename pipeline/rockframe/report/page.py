"""One HTML page of a run: it holds all that it shows, and may ask nobody for anything."""

from __future__ import annotations

import base64
import hashlib
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from rockframe.provenance import source_code_hash, versions
from rockframe.report.columns import shown
from rockframe.report.payload import checks, payload
from rockframe.results import Ground, History, Run

_HOME: Final = Path(__file__).parent
#: The page's script, in the order in which its parts need each other.
_PARTS: Final = ("data", "table", "frame", "plots", "detail", "main")
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
    script, style = _script(), _style()
    environment = Environment(
        loader=FileSystemLoader(_HOME),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("template.html").render(
        policy=_policy(script, style),
        script=Markup(script),  # noqa: S704 -- our own files, no text of a run
        style=Markup(style),  # noqa: S704
        facts=facts,
        samples=samples,
        pair_of={pair["row"]: i for i, pair in enumerate(facts["pairs"])},
        **_overview(run),
        **_provenance(run),
    )


def _overview(run: Run) -> dict[str, Any]:
    count = Counter(row["verdict"] for row in run.rows)
    records = list(dict.fromkeys((row["record_id"], row["record"]) for row in run.rows))
    structures = list(dict.fromkeys(row["structure"] for row in run.rows))
    place = {(row["record_id"], row["structure"]): i for i, row in enumerate(run.rows)}
    return {
        "rows": run.rows,
        "columns": shown(run.rows),
        "count": count,
        "records": records,
        "structures": structures,
        "place": place,
        "glance": len(records) <= _GLANCE,
        "entries": [(entry, checks(entry)) for entry in run.entries],
    }


def _provenance(run: Run) -> dict[str, Any]:
    return {
        "manifest": run.manifest,
        "manifest_sha256": run.manifest_sha256,
        "version": versions()["rockframe"],
        "source": source_code_hash(),
    }


def _script() -> str:
    # The licence goes with every copy, and each page is one.
    vendored = f"/*\n{_read('vendor/uPlot.LICENSE')}*/\n{_read('vendor/uPlot.iife.min.js')}"
    parts = "\n".join(_read(f"script/{name}.js") for name in _PARTS)
    return f'{vendored}\n(() => {{\n"use strict";\n{parts}}})();\n'


def _style() -> str:
    return _read("vendor/uPlot.min.css") + "\n" + _read("style.css")


def _read(name: str) -> str:
    return (_HOME / name).read_text(encoding="utf-8")


def _policy(script: str, style: str) -> str:
    """Nothing is loaded from anywhere; script and style are those of this page, by their hash."""
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src '{_hash(script)}'",
            f"style-src '{_hash(style)}'",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


def _hash(content: str) -> str:
    digest = hashlib.sha256(content.encode("utf-8")).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"
