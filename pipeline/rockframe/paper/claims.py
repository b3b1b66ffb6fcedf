"""All claims that need no records, and the page that lists claims."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment

from rockframe.paper.claim import Claim, Finding, Judgement, agrees_to_last_digit, judgement
from rockframe.paper.derivation import derivation_checks
from rockframe.paper.equations import (
    frame_checks,
    impact_checks,
    misprint_checks,
    motion_checks,
    number_checks,
    one_column_checks,
    scale_checks,
    stability_checks,
)
from rockframe.paper.pulses import pulse_checks
from rockframe.provenance import package_versions, source_code_hash


def all_claims() -> list[Claim]:
    """Check all claims that need no records, in the order of the page; this takes seconds."""
    texts = _texts()["claim"]
    checks = (
        {name: judgement(Finding.MISPRINT) for name in texts if name.startswith("text-")}
        | {"table1-events": judgement(Finding.OPEN)}
        | motion_checks()
        | derivation_checks()
        | misprint_checks()
        | impact_checks()
        | number_checks()
        | frame_checks()
        | one_column_checks()
        | pulse_checks()
        | stability_checks()
        | scale_checks()
    )
    return [_claim(name, text, checks[name]) for name, text in texts.items()]


def _texts() -> dict[str, Any]:
    file = Path(__file__).parents[1] / "data" / "claims.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _claim(name: str, text: Mapping[str, str], checked: Judgement) -> Claim:
    """Return a claim with our values in its texts; a number gets two digits more than printed."""
    printed, ours, finding = text["printed"], text.get("ours", ""), checked.finding
    if finding is None:
        decimals = len(printed.partition(".")[2])
        ours = f"{checked.values['ours']:.{decimals + 2}f}"
        finding = agrees_to_last_digit(printed, checked.values["ours"])
    unit = f" {text['unit']}" if "unit" in text else ""
    return Claim(
        name=name,
        where=text["where"],
        says=text["says"],
        printed=printed.format_map(checked.values) + unit,
        ours=ours.format_map(checked.values) + unit,
        finding=finding,
        remark=text.get("remark", "").format_map(checked.values),
        command=text.get("command", ""),
    )


def checked_page(claims: Sequence[Claim], figures: Mapping[str, str], records: str) -> str:
    r"""Return the page in Markdown.

    Parameters
    ----------
    claims : sequence of Claim
        Claims in the order of the page.
    figures : mapping of str to str
        Title and caption of each figure, by its path relative to the page.
    records : str
        Sentence on the records that were available.

    Examples
    --------
    >>> claim = Claim(name="a", where="eq (1)", says="|x|", printed="1", ours="2",
    ...               finding=Finding.DIFFERS)
    >>> print(checked_page([claim], {}, "").splitlines()[14])
    | `a` | eq (1): \|x\| | 1 | 2 | **differs** | |
    """
    commands: dict[str, list[str]] = {}
    for claim in claims:
        command = claim.command or "rockframe paper --claim NAME"
        commands.setdefault(command, []).append(claim.name)
    counts = Counter(claim.finding for claim in claims)
    page = Environment(trim_blocks=True, keep_trailing_newline=True)  # noqa: S701 -- Markdown
    page.filters["cell"] = lambda text: text.replace("|", "\\|").replace("<", "&lt;")
    return page.from_string(_texts()["page"]).render(
        claims=claims,
        counts=", ".join(f"{finding.value} {counts[finding]}" for finding in Finding),
        records=records,
        commands=commands,
        figures=figures,
        versions=package_versions(),
        source=source_code_hash()[:16],
    )
