"""The page "the paper, checked" in Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

from rockframe.paper.claim import Claim, Finding
from rockframe.provenance import source_code_hash, versions

_HEAD: Final = """# The paper, checked

N. Makris and M. F. Vassiliou (2013), *Rocking response and stability analysis of an array of
free-standing columns capped with a free-standing rigid beam*, COMPDYN 2013, Kos.

Each number and claim that rockframe can evaluate, ours beside it. A number agrees if it is within
one unit of the last digit printed; a misprint is wrong as printed and right as it must be meant.
All of ours was computed when this page was made; nothing is tuned.
"""


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
    >>> print(checked_page([claim], {}, "").splitlines()[13])
    | `a` | eq (1): \|x\| | 1 | 2 | **differs** | |
    """
    counts = Counter(claim.finding for claim in claims)
    said = ", ".join(f"{finding.value} {counts[finding]}" for finding in Finding)
    lines = [_HEAD, f"{len(claims)} claims: {said}. {records}".strip(), "", _row(_COLUMNS), _RULE]
    lines += [_row(_cells(claim)) for claim in claims]
    lines += ["", "## Commands", "", *_commands(claims), ""]
    if figures:
        lines += ["## Figures", ""]
    for path, caption in figures.items():
        lines += [f"![{caption.partition('.')[0]}]({path})", "", f"*{caption}*", ""]
    lines += ["## Made with", "", ", ".join(f"{k} {v}" for k, v in versions().items()) + "."]
    lines += [f"Source code {source_code_hash()[:16]}.", ""]
    return "\n".join(lines)


_COLUMNS: Final = ("claim", "what the paper says", "paper", "ours", "finding", "remark")
_RULE: Final = "|---|---|---|---|---|---|"


def _cells(claim: Claim) -> tuple[str, ...]:
    finding = claim.finding.value
    return (
        f"`{claim.name}`",
        f"{claim.where}: {claim.says}",
        claim.printed,
        claim.ours,
        finding if claim.finding is Finding.AGREES else f"**{finding}**",
        claim.remark,
    )


def _row(cells: Sequence[str]) -> str:
    escaped = (cell.replace("|", "\\|").replace("<", "&lt;") for cell in cells)
    return "| " + " | ".join(escaped).rstrip() + " |"


def _commands(claims: Sequence[Claim]) -> list[str]:
    """List the commands that show our values, each with its claims."""
    found: dict[str, list[str]] = {}
    for claim in claims:
        key = claim.command or "rockframe paper --claim NAME"
        found.setdefault(key, []).append(claim.name)
    return [f"- `{command}`: {', '.join(names)}" for command, names in found.items()]
