"""records.csv: every record and every other file, with the reason and the checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.cells import write_rows
from rockframe.errors import InputError
from rockframe.provenance import whole_file
from rockframe.signals.passport import Passport

#: First columns of the table.
_COLUMNS: Final = ("file", "record_id", "status", "line", "reason")


@dataclass(frozen=True)
class Entry:
    """One row: a record, or a file that gave none.

    Parameters
    ----------
    file : str
        Name of the file.
    record_id : str
        Of the record; empty if the file gave none.
    passport : Passport, optional
        Of the record, if one was made.
    reason : str
        Why it is rejected, in words; empty if it is accepted.
    line : int, optional
        Line number in the file, counted from 1.
    note : str
        What became of a file that was not read (used beside others, or passed over), of a
        component that was rotated, or of a record that is filtered out; else empty.
    filtered : bool
        Sound, but not among the records that were asked for.

    Examples
    --------
    >>> Entry("FSD172.VT2", "", reason="is a velocity time series.", line=3).status
    'rejected'
    """

    file: str
    record_id: str
    passport: Passport | None = None
    reason: str = ""
    line: int | None = None
    note: str = ""
    filtered: bool = False

    @property
    def status(self) -> str:
        """``accepted``, ``rejected``, ``filtered``, ``rotated`` (into others), or ``unread``."""
        if self.filtered:
            return "filtered"
        if self.note and not self.reason:
            return "rotated" if self.record_id else "unread"
        return "rejected" if self.reason else "accepted"


def write_entries(entries: Sequence[Entry], path: Path) -> None:
    """Write the table: of each check its value, limit and verdict; what is not known is empty.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    made = [entry.passport for entry in entries if entry.passport is not None]
    names = [check.name for check in made[0].checks] if made else []
    heads = [f"{name}{part}" for name in names for part in ("", "_limit", "_verdict")]
    rows = (
        [
            *(entry.file, entry.record_id, entry.status, entry.line, entry.reason or entry.note),
            *_cells(entry.passport, len(heads)),
        ]
        for entry in entries
    )
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        write_rows(stream, [[*_COLUMNS, "passport", *heads], *rows])


def refuse_strange_entries(path: Path) -> None:
    """Refuse to replace a file that has the name of the table and is something else.

    Raises
    ------
    InputError
        If there is such a file.
    """
    refuse_other_table(path, _COLUMNS, "the list of inputs")


def _cells(passport: Passport | None, count: int) -> list[object]:
    if passport is None:
        return [""] * (1 + count)
    cells: list[object] = [passport.verdict.name.lower()]
    for check in passport.checks:
        cells += [check.value, check.limit, check.verdict.name.lower()]
    return cells


def refuse_other_table(path: Path, first: Sequence[str], what: str) -> None:
    """Refuse to replace a file that has the name of a table and is something else.

    Parameters
    ----------
    path : Path
        Where the table is to be.
    first : sequence of str
        Its first columns.
    what : str
        What it is, in words.

    Raises
    ------
    InputError
        If there is a file of other columns.
    """
    if not path.is_file():
        return
    with path.open("rb") as stream:
        head = stream.readline().decode("latin-1").strip()
    if head.split(",")[: len(first)] != list(first):
        raise InputError(path, f"is in the place of {what}, and is not one. Must be moved away.")
