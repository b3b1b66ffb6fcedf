"""Why records did not come through, of whatever stage."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from rockframe.cells import read_rows
from rockframe.errors import InputError
from rockframe.results.reading import opened
from rockframe.results.schema import PULSES, RESPONSE, SCREEN

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
    """Return why stages left records out: by the name of their file, then by the record's.

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
