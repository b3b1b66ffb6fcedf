"""records.csv, and the reasons why stages rejected records."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cells import read_rows
from rockframe.errors import InputError
from rockframe.outcome import InputOutcome
from rockframe.results.reading import attributes_of
from rockframe.results.schema import PULSES, RESPONSE, SCREEN
from rockframe.results.tables.formats import columns_of, require_format, write_rows_as

if TYPE_CHECKING:
    from rockframe.signals.passport import Passport

#: First columns of records.csv.
_COLUMNS: Final = ("file", "record_id", "status", "line", "reason")


def write_entries(entries: Sequence[InputOutcome], path: Path) -> None:
    """Write the table, with value, limit and verdict of each check; unknown values are empty.

    Parameters
    ----------
    entries : sequence of InputOutcome
        Rows of the table.
    path : Path
        File to write; its extension states the format.

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
                "reason": entry.reason,
                **dict(zip_longest(heads, _cells(entry.passport))),
            }
            for entry in entries
        ),
    )


def refuse_strange_entries(path: Path) -> None:
    """Refuse to replace a file that has the name of the table but other contents.

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
    """Refuse to replace a file that has the name of a table but other contents.

    The list of inputs of an ingest without records, which wrote no netCDF file, may be replaced.

    Parameters
    ----------
    path : Path
        Path of the table.
    first : sequence of str
        First columns of the table.
    what : str
        Description of the table for the message.

    Raises
    ------
    InputError
        If there is a file with other columns.
    ParameterError
        If the format needs packages that are missing.
    """
    require_format(path)
    found = columns_of(path) if path.is_file() else list(first)
    left = found[: len(_COLUMNS)] == list(_COLUMNS) and not path.with_suffix(".nc").exists()
    if found[: len(first)] != list(first) and not left:
        raise InputError(path, f"is in the place of {what}, but is another file. Move it away.")


#: Files of stages that may reject records.
_STAGES: Final = {"pulses.nc": PULSES, "response.nc": RESPONSE, "screen.nc": SCREEN}


def rejections_of(folder: Path) -> dict[str, str]:
    """Return the reasons why records and files of a run were rejected, by their names.

    Records outside the user's filters are not included.

    Parameters
    ----------
    folder : Path
        Folder of the run.

    Raises
    ------
    InputError
        If a file of the run cannot be read.
    """
    found: dict[str, str] = {}
    for row in rows_of(folder / "records.csv"):
        if row["status"] == "rejected":  # several records of one file may be rejected
            found[row["file"]] = f"{found.get(row['file'], '')} {row['reason']}".lstrip()
    for attributes in _attributes(folder).values():
        filtered = json.loads(attributes.get("filtered", "[]"))
        reasons = json.loads(attributes["left_out"])
        found |= {record: reason for record, reason in reasons.items() if record not in filtered}
    return found


def left_out_of(folder: Path) -> dict[str, dict[str, str]]:
    """Return the reasons why stages rejected records, for each file of a stage by record.

    Raises
    ------
    InputError
        If one of the files cannot be read.
    """
    found = _attributes(folder).items()
    return {name: dict(json.loads(attributes["left_out"])) for name, attributes in found}


def _attributes(folder: Path) -> dict[str, Mapping[str, str]]:
    """Return the global attributes of the file of each stage that may reject records."""
    files = {name: folder / name for name in _STAGES}
    return {
        name: attributes_of(path, _STAGES[name]) for name, path in files.items() if path.is_file()
    }


def rows_of(path: Path) -> Iterator[dict[str, str]]:
    """Yield the rows of a list of a run; none if the list does not exist.

    Raises
    ------
    InputError
        If the list cannot be read.
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
