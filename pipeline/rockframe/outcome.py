"""The outcome of an input: accepted, rejected, filtered out, rotated into others, or unread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from rockframe.signals.passport import Passport

Status = Literal["accepted", "rejected", "filtered", "rotated", "unread"]
#: In the order of records.csv.
STATUSES: Final[tuple[Status, ...]] = ("accepted", "rejected", "filtered", "rotated", "unread")


@dataclass(frozen=True)
class InputOutcome:
    """Outcome of an input of a stage: of a file, or of a record.

    Parameters
    ----------
    file : str
        Name of the file; of a record in records.nc, its identifier.
    reason : str
        Why the input is not accepted, as a sentence; empty if it is.
    line : int, optional
        Line number in the file, counted from 1.
    status : str
        ``accepted``; ``rejected``; ``filtered`` (valid, but outside the user's filters);
        ``rotated`` (a component, into other records); or ``unread`` (a file without acceleration,
        such as a catalogue).
    record_id : str
        Identifier of the record; empty if the file has none.
    passport : Passport, optional
        Passport of the record, if there is one.
    corrected_here : bool
        True if this package corrected the record.

    Examples
    --------
    >>> InputOutcome("FSD172.VT2", "is a velocity time series.", line=3).status
    'rejected'
    """

    file: str
    reason: str = ""
    line: int | None = None
    status: Status = "rejected"
    record_id: str = ""
    passport: Passport | None = None
    corrected_here: bool = False
