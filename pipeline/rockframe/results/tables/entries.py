"""records.csv, and why records were rejected, of whatever stage."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path
from typing import Final

from rockframe.cells import read_rows
from rockframe.errors import InputError
from rockframe.results.reading import opened
from rockframe.results.schema import PULSES, RESPONSE, SCREEN
from rockframe.results.tables.formats import columns_of, require_format, write_rows_as
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
        Sound, but rejected by the user's filters.

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

    Parameters
    ----------
    entries : sequence of Entry
        Rows of the table.
    path : Path
        File to write; its ending states the format.

    Raises
    ------
    InputError
        If the file cannot be written.
    ParameterError
        If the format needs packages that are missing.
    """
    made = [entry.passport for entry in entries if entry.passport is not None]
    names = [check.name for check in made[0].checks] if made else []
    heads = [
        "passport",
        *(f"{name}{part}" for name in names for part in ("", "_limit", "_verdict")),
    ]
    write_rows_as(
        path,
        (
            {
                "file": entry.file,
                "record_id": entry.record_id,
                "status": entry.status,
                "line": entry.line,
                "reason": entry.reason or entry.note,
                **dict(zip_longest(heads, _cells(entry.passport))),
            }
            for entry in entries
        ),
    )


def refuse_strange_entries(path: Path) -> None:
    """Refuse to replace a file that has the name of the table and is something else.

    Raises
    ------
    InputError
        If there is such a file.
    ParameterError
        If the format needs packages that are missing.
    """
    refuse_other_table(path, _COLUMNS, "the list of inputs")


def _cells(passport: Passport | None) -> list[object]:
    if passport is None:
        return []
    checks = [(one.value, one.limit, one.verdict.name.lower()) for one in passport.checks]
    return [passport.verdict.name.lower(), *chain.from_iterable(checks)]


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
    ParameterError
        If the format needs packages that are missing.
    """
    require_format(path)
    if path.is_file() and columns_of(path)[: len(first)] != list(first):
        raise InputError(path, f"is in the place of {what}, but is another file. Move it away.")


#: Files of stages that may leave records out.
_STAGES: Final = {"pulses.nc": PULSES, "response.nc": RESPONSE, "screen.nc": SCREEN}


def rejections_of(folder: Path) -> dict[str, str]:
    """Return the reasons why records and files of a run were rejected, by their names.

    What the user's own filters leave out is not among them.

    Parameters
    ----------
    folder : Path
        Of the run.

    Raises
    ------
    InputError
        If one of its files cannot be read.
    """
    found: dict[str, str] = {}
    for row in rows_of(folder / "records.csv"):
        if row["status"] == "rejected":  # several records of one file may be
            found[row["file"]] = f"{found.get(row['file'], '')} {row['reason']}".lstrip()
    for name, reasons in left_out_of(folder).items():
        with opened(folder / name, _STAGES[name], empty=True) as dataset:
            filtered = json.loads(dataset.attrs.get("filtered", "[]"))
        found |= {record: reason for record, reason in reasons.items() if record not in filtered}
    return found


def left_out_of(folder: Path) -> dict[str, dict[str, str]]:
    """Return the reasons why stages rejected records, for each file of a stage by record.

    Raises
    ------
    InputError
        If one of the files cannot be read.
    """
    found = {}
    for name, kind in _STAGES.items():
        if (folder / name).is_file():
            with opened(folder / name, kind, empty=True) as dataset:
                found[name] = dict(json.loads(dataset.attrs["left_out"]))
    return found


def rows_of(path: Path) -> Iterator[dict[str, str]]:
    """Give the rows of one of the lists of a run; none if it is not there.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    if not path.is_file():
        return
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            rows = read_rows(stream)
            _, columns = next(rows, (1, []))
            for line, row in rows:
                if len(row) != len(columns):
                    message = f"{len(row)} columns. Must be {len(columns)}."
                    raise InputError(path, message, line=line)
                yield dict(zip(columns, row, strict=True))
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(path, f"cannot be read: {error}.") from None
