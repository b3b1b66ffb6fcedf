"""A claim of the paper, with the result of checking it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Finding(StrEnum):
    """Result of checking a claim, as the page prints it."""

    AGREES = "agrees"
    DIFFERS = "differs"
    MISPRINT = "misprint"
    OPEN = "cannot be told"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A number or statement of the paper beside ours.

    Parameters
    ----------
    name : str
        Name for ``rockframe paper --claim``.
    where : str
        Section and equation of the paper.
    says : str
        The claim, in our words.
    printed, ours : str
        The paper's value as printed, and ours; empty if there is none.
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
    """Return agrees if a number is within one unit of the last digit of a printed one.

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
    """Return agrees if a claim holds, else differs."""
    return Finding.AGREES if holds else Finding.DIFFERS


def number_claim(
    name: str, where: str, says: str, printed: str, ours: float, *, unit: str = "", remark: str = ""
) -> Claim:
    """Return the claim on a printed number. Ours is shown with two more digits."""
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
