"""Metadata of records from a `catalogue.csv` in the same folder."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, TextIO

from rockframe.cells import decimal, read_rows, write_rows
from rockframe.errors import InputError
from rockframe.ingest.parsing.lines import unreadable
from rockframe.provenance import whole_file
from rockframe.record import Record

#: Name of the catalogue in a folder of records.
CATALOGUE: Final = "catalogue.csv"
#: Required columns, in any order.
COLUMNS: Final = (
    "file",
    "event",
    "station",
    "network",
    "magnitude",
    "epicentral_distance_km",
    "source",
)
#: Optional column.
VS30: Final = "vs30_m_s"


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """Metadata of one file from a catalogue; unknown values are NaN or empty.

    Parameters
    ----------
    file : str
        Name of the file.
    event, station, network : str
        Names of event, station and network.
    magnitude : float
        Magnitude of the event [1].
    epicentral_distance : float
        Distance to the epicentre [km].
    vs30 : float
        Mean shear-wave velocity of the uppermost 30 m [m s-1].
    source : str
        Source of the metadata.

    Examples
    --------
    >>> CatalogueEntry(file="PUL164.AT2", magnitude=6.6).magnitude
    6.6
    """

    file: str
    event: str = ""
    station: str = ""
    network: str = ""
    magnitude: float = math.nan
    epicentral_distance: float = math.nan
    vs30: float = math.nan
    source: str = ""


def read_catalogue(path: str | Path) -> dict[str, CatalogueEntry]:
    r"""Return the entries of a catalogue: CSV with the columns `COLUMNS`, one row per file.

    Parameters
    ----------
    path : str or Path
        Catalogue in UTF-8.

    Returns
    -------
    dict
        Entry of each file, by file name.

    Raises
    ------
    InputError
        If the file cannot be read, a column is unknown or missing, a file is named twice, or a
        number is invalid.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "catalogue.csv")
    ...     _ = path.write_text(",".join(COLUMNS) + "\nPUL164.AT2,San Fernando,,,6.6,,NGA\n")
    ...     read_catalogue(path)["PUL164.AT2"].event
    'San Fernando'
    """
    path = Path(path)
    entries: dict[str, CatalogueEntry] = {}
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            for line, row in _rows(path, stream):
                entry = _entry(path, row, line)
                if entry.file in entries:
                    raise InputError(path, f"file {entry.file!r} is named twice.", line=line)
                entries[entry.file] = entry
    except OSError as error:
        raise unreadable(path, error) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"not a table ({error}). Must be CSV in UTF-8.") from error
    return entries


def write_catalogue(path: Path, entries: Iterable[CatalogueEntry]) -> None:
    """Write a catalogue that `read_catalogue` reads; unknown values become empty cells.

    Parameters
    ----------
    path : Path
        File to write.
    entries : iterable of CatalogueEntry
        One entry per file.

    Raises
    ------
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "catalogue.csv")
    ...     write_catalogue(path, [CatalogueEntry(file="PUL164.AT2", magnitude=6.6)])
    ...     read_catalogue(path)["PUL164.AT2"].magnitude
    6.6
    """
    stated = list(entries)
    known = any(not math.isnan(entry.vs30) for entry in stated)
    columns = (*COLUMNS, VS30) if known else COLUMNS
    names = [column.removesuffix("_km").removesuffix("_m_s") for column in columns]
    rows = ([getattr(entry, name) for name in names] for entry in stated)
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        write_rows(stream, [columns, *rows])


def with_facts(record: Record, entry: CatalogueEntry) -> Record:
    """Return a record with the metadata that a catalogue states for its file.

    A value in the catalogue overrides that of the file; empty values do not.

    Parameters
    ----------
    record : Record
        As read from the file.
    entry : CatalogueEntry
        Catalogue entry of the file.

    Examples
    --------
    >>> record = Record(record_id="shake", acceleration=[0.0, 1.0], time_step=0.01, station="PUL")
    >>> known = with_facts(record, CatalogueEntry(file="shake.csv", magnitude=6.6))
    >>> known.station, known.magnitude
    ('PUL', 6.6)
    """
    return replace(record, **stated_facts(entry))


def stated_facts(entry: CatalogueEntry | None) -> dict[str, Any]:
    """Return the fields of a record that a catalogue states for its file.

    Examples
    --------
    >>> stated_facts(CatalogueEntry(file="shake.csv", magnitude=6.6))
    {'magnitude': 6.6}
    """
    facts = dict(vars(entry)) if entry else {}
    facts |= {"facts_source": facts.pop("source", "")}
    facts.pop("file", None)
    return {name: value for name, value in facts.items() if value != "" and value == value}


def _rows(path: Path, stream: TextIO) -> Iterator[tuple[int, dict[str, str]]]:
    rows = read_rows(stream)
    header = [name.strip() for name in next(rows, (1, []))[1]]
    for name in header:
        if name not in (*COLUMNS, VS30) or header.count(name) > 1:
            raise InputError(
                path,
                f"column {name!r} unknown or repeated. Must be each of: {', '.join(COLUMNS)}; or "
                f"{VS30}.",
                line=1,
            )
    for name in COLUMNS:
        if name not in header:
            raise InputError(
                path, f"column {name!r} missing. Must be each of: {', '.join(COLUMNS)}.", line=1
            )
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(path, f"{len(row)} columns. Must be {len(header)}.", line=line)
        yield line, dict(zip(header, map(str.strip, row), strict=True))


def _entry(path: Path, row: dict[str, str], line: int) -> CatalogueEntry:
    file = row["file"]
    if not file or Path(file).name != file:
        raise InputError(path, f"file {file!r}. Must be the name of a file.", line=line)
    return CatalogueEntry(
        file=file,
        event=row["event"],
        station=row["station"],
        network=row["network"],
        magnitude=_number(path, row, "magnitude", line),
        epicentral_distance=_number(path, row, "epicentral_distance_km", line, lowest=0.0),
        vs30=_number(path, row, VS30, line, lowest=0.0),
        source=row["source"],
    )


def _number(
    path: Path, row: dict[str, str], column: str, line: int, lowest: float = -math.inf
) -> float:
    token = row.get(column, "")
    if not token:
        return math.nan
    try:
        value = decimal(token)
    except ValueError:
        value = math.nan
    if not value >= lowest:
        must = "a finite number" if lowest == -math.inf else "a finite number, zero or positive,"
        raise InputError(path, f"{column} {token!r}. Must be {must} or empty.", line=line)
    return value
