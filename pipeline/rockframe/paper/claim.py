"""A claim of the paper with what the package finds."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Finding(StrEnum):
    """What became of a claim, in the word that the page prints."""

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
        What ``rockframe paper --claim`` calls it.
    where : str
        Section and equation.
    says : str
        What the paper says, in our words.
    printed, ours : str
        The paper's value as printed, and ours; empty if there is none.
    finding : Finding
        Whether they agree.
    remark : str
        What there is to add.
    command : str
        What shows our value; by default ``rockframe paper --claim NAME``.
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
    """Return whether a number is within one unit of the last digit of a printed one.

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
    """Return agrees or differs."""
    return Finding.AGREES if holds else Finding.DIFFERS


def number_claim(
    name: str, where: str, says: str, printed: str, ours: float, *, unit: str = "", remark: str = ""
) -> Claim:
    """Return the claim of a printed number: ours is shown with two more digits."""
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
