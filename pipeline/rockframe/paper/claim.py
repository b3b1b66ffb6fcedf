"""A claim of the paper, and the result of checking it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final


class Finding(StrEnum):
    """Result of checking a claim, as the page prints it."""

    AGREES = "agrees"
    DIFFERS = "differs"
    MISPRINT = "misprint"
    OPEN = "cannot be checked"


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


#: Largest relative difference of a number that does not round to the printed one.
TOLERANCE: Final = 0.05


def agrees_to_last_digit(printed: str, ours: float) -> Finding:
    """Return AGREES if a number rounds to a printed number, or is one unit of its last digit off.

    Such a unit may be a fifth of a number of one digit, so the difference must also be at most 5 %.

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
    unit = 10.0 ** -len(printed.partition(".")[2])
    difference, exact = abs(ours - float(printed)), 1.0 + 1e-9
    allowed = max(0.5 * unit, min(unit, TOLERANCE * abs(float(printed))))
    return judged(difference <= allowed * exact)


def judged(holds: bool) -> Finding:
    """Return AGREES if a claim is true, otherwise DIFFERS."""
    return Finding.AGREES if holds else Finding.DIFFERS


@dataclass(frozen=True)
class Judgement:
    """The finding on a claim, and our values in the texts of the claim.

    The texts are in ``data/claims.toml``. Without a finding, the value `ours` is compared with the
    printed number.
    """

    finding: Finding | None
    values: Mapping[str, Any]


def judgement(finding: bool | Finding, /, **values: Any) -> Judgement:
    """Return the result of checking a claim; True agrees, False differs."""
    return Judgement(finding if isinstance(finding, Finding) else judged(finding), values)


def number(ours: float, /, **further: float) -> Judgement:
    """Return our value of a printed number, and other values in the texts of its claim."""
    return Judgement(None, {"ours": ours, **further})
