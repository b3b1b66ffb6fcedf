"""A claim of the paper, the claims about its text, and the page that lists all claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from rockframe.provenance import source_code_hash, versions


class Finding(StrEnum):
    """Result of checking a claim, as the page prints it."""

    AGREES = "agrees"
    DIFFERS = "differs"
    MISPRINT = "misprint"
    OPEN = "cannot be told"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number or statement of the paper, with our value.

    Parameters
    ----------
    name : str
        Name for ``rockframe paper --claim``.
    where : str
        Section and equation of the paper.
    says : str
        The claim, in our words.
    printed, ours : str
        The paper's value as printed, and our value; empty if missing.
    finding : Finding
        Result of the comparison.
    remark : str
        Further explanation.
    command : str
        Command that shows our value (default: ``rockframe paper --claim NAME``).
    """

    name: str
    where: str
    says: str
    printed: str
    ours: str
    finding: Finding
    remark: str = ""
    command: str = ""

    @property
    def shown_by(self) -> str:
        """The command that shows our value."""
        return self.command or f"rockframe paper --claim {self.name}"


def agrees_to_last_digit(printed: str, ours: float) -> Finding:
    """Return AGREES if a number is within one unit of the last digit of a printed number.

    Parameters
    ----------
    printed : str
        Digits with a decimal point, as printed.
    ours : float
        The number.

    Examples
    --------
    >>> agrees_to_last_digit("1.4", 1.381).value, agrees_to_last_digit("1.40", 1.381).value
    ('agrees', 'differs')
    """
    decimals = len(printed.partition(".")[2])
    near = abs(ours - float(printed)) <= 10.0**-decimals * (1.0 + 1e-9)
    return judged(near)


def judged(holds: bool) -> Finding:
    """Return AGREES if a claim is true, otherwise DIFFERS."""
    return Finding.AGREES if holds else Finding.DIFFERS


def number_claim(
    name: str, where: str, says: str, printed: str, ours: float, *, unit: str = "", remark: str = ""
) -> Claim:
    """Return the claim about a printed number; our value is shown with two more digits."""
    decimals = len(printed.partition(".")[2])
    after = f" {unit}" if unit else ""
    return Claim(
        name=name,
        where=where,
        says=says,
        printed=f"{printed}{after}",
        ours=f"{ours:.{decimals + 2}f}{after}",
        finding=agrees_to_last_digit(printed, ours),
        remark=remark,
    )


#: Misprints: name, place, printed text, correct text.
_TEXTS: Final = (
    ("text-uplift", "section 2", "uplift where the ground acceleration exceeds g tan α",
     "its magnitude does"),
    ("text-work", "eqs (13) to (15)", "W is called the work of the forces",
     "with Q = -dW/dθ it is a potential"),
    ("text-5.6", "section 5", "Equation (5.6)", "eq (43)"),
    ("text-minimum", "section 5", "minimum coefficient of restitution",
     "maximum, as the caption of Figure 7 says: eq (43) is the least loss"),
    ("text-figure-8", "section 6", "Figure 7 (Bottom)", "Figure 8 (Bottom)"),
    ("text-gaussian", "section 6", "exp(t²/2)", "exp(-t²/2)"),
    ("text-26", "references", "[26] stands for two papers", "Loh et al., and Ricker"),
)  # fmt: skip


def text_claims() -> list[Claim]:
    """Return the misprints that were found by reading.

    Examples
    --------
    >>> {claim.finding.value for claim in text_claims()}
    {'misprint'}
    """
    return [
        Claim(
            name=name,
            where=where,
            says="in words",
            printed=printed,
            ours=meant,
            finding=Finding.MISPRINT,
            remark="found by reading",
        )
        for name, where, printed, meant in _TEXTS
    ]


_HEAD: Final = """# The paper, checked

N. Makris and M. F. Vassiliou (2013), *Rocking response and stability analysis of an array of
free-standing columns capped with a free-standing rigid beam*, COMPDYN 2013, Kos.

Each number and claim of the paper that rockframe can evaluate, with our value. A number agrees if
it is within one unit of the last printed digit. A misprint is wrong as printed, and right with an
evident correction. All our values were computed when this page was made; nothing is tuned.
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
