"""Metadata of records from a `catalogue.csv` in the same folder."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, TextIO

from rockframe.cells import decimal, read_rows, write_rows
from rockframe.errors import InputError
from rockframe.ingest.flatfiles import CatalogueEntry as CatalogueEntry
from rockframe.ingest.flatfiles import kind_of, read_entries
from rockframe.ingest.parsing.lines import HEAD, head_of, unreadable
from rockframe.provenance import whole_file
from rockframe.record import Record, SiteType

#: Name of the catalogue in a folder of records.
CATALOGUE: Final = "catalogue.csv"
#: Columns that `write_catalogue` always writes.
COLUMNS: Final = (
    "file",
    "event",
    "station",
    "network",
    "magnitude",
    "epicentral_distance_km",
    "source",
)
VS30: Final = "vs30_m_s"
#: Fields of an entry, by column; `file` is required, in any order.
_FIELDS: Final = {
    **{column: column.removesuffix("_km") for column in COLUMNS},
    "distance_rrup_km": "distance_rrup",
    "distance_rjb_km": "distance_rjb",
    "distance_hypocentral_km": "distance_hypocentral",
    VS30: "vs30",
    "site": "site_type",
    "mechanism": "mechanism",
    "lowest_usable_frequency_hz": "lowest_usable_frequency",
    "archive_pulse_period_s": "archive_pulse_period",
}
_TEXTS: Final = ("file", "event", "station", "network", "mechanism", "source")
#: Bounds of numbers that are not distances; the others are zero or positive.
_BOUNDS: Final = {"magnitude": (-2.0, 10.0), VS30: (0.0, 10_000.0)}
#: Half the circumference of the earth, rounded up: no place on it is farther away [km].
_FARTHEST: Final = 20_050.0
#: Longest time from the start of a record to its event, before and after [s].
_BEFORE, _AFTER = 120.0, 600.0


def read_catalogue(path: str | Path, data: bytes | None = None) -> dict[str, CatalogueEntry]:
    r"""Return the entries of a catalogue, in the CSV format of this package or of an archive.

    The CSV has a row for each file; only the column `file` is required. The formats of archives are
    PEER's search results, the flatfiles of NGA-West2 and ESM, a ComCat event, and QuakeML.

    Parameters
    ----------
    path : str or Path
        Catalogue in UTF-8.
    data : bytes, optional
        Contents of the file (default: they are read from `path`).

    Returns
    -------
    dict
        Entries by file name. Entries of archives also have keys such as ``RSN`` and a record
        number.

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
        data = path.read_bytes() if data is None else data
        if kind := catalogue_kind(path, data):
            return read_entries(path, kind, data)
        with io.StringIO(data.decode("utf-8-sig"), newline="") as stream:
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


def catalogue_kind(path: Path, head: bytes | None = None) -> str:
    """Return the kind of an archive's catalogue from its name and first bytes; else ""."""
    if path.suffix.lower() not in {".csv", ".json", ".geojson", ".xml", ".quakeml"}:
        return ""
    return kind_of(path.name, head_of(path) if head is None else head[:HEAD])


def is_catalogue(path: Path) -> bool:
    """Return True if a file is a catalogue, by its name or in the format of an archive."""
    return path.name == CATALOGUE or catalogue_kind(path) != ""


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
    known = {field for entry in stated for field in stated_facts(entry)}
    columns = [name for name, field in _FIELDS.items() if name in COLUMNS or field in known]
    values = ([getattr(entry, _FIELDS[name]) for name in columns] for entry in stated)
    rows = ([one.words if isinstance(one, SiteType) else one for one in row] for row in values)
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        write_rows(stream, [columns, *rows])


def stated_facts(entry: CatalogueEntry | None) -> dict[str, Any]:
    """Return the fields of a record that a catalogue states for its file.

    Examples
    --------
    >>> stated_facts(CatalogueEntry(file="shake.csv", magnitude=6.6))
    {'magnitude': 6.6}
    """
    facts = dict(vars(entry)) if entry else {}
    facts |= {"facts_source": facts.pop("source", "")}
    facts = {name: value for name, value in facts.items() if name not in {"file", "origin_time"}}
    # compare types too: a magnitude of zero is a number, but equals the unknown site
    return {
        name: one
        for name, one in facts.items()
        if one != "" and one is not SiteType.UNKNOWN and one == one
    }


def facts_of(
    catalogue: Mapping[str, CatalogueEntry],
    record: Record,
    names: Iterable[str],
    known: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the fields of a record that a catalogue states.

    Entries of the event and the station come first. Entries of the record number (``RSN77_...``)
    and of the file override them.

    Parameters
    ----------
    catalogue : mapping of str to CatalogueEntry
        Result of `read_catalogue`.
    record : Record
        As read from the file.
    names : iterable of str
        Names of the archive and of the file.
    known : mapping, optional
        Fields that replace those of the record.

    Examples
    --------
    >>> record = Record(record_id="a", acceleration=[0.0, 1.0], time_step=0.01)
    >>> facts_of({"RSN77": CatalogueEntry(file="", magnitude=6.6)}, record, ["RSN77_A.AT2"])
    {'magnitude': 6.6}
    """
    facts: dict[str, Any] = {}
    for entry in catalogue.values():
        if entry.origin_time and not entry.file and _applies(entry, record, known or {}):
            facts |= stated_facts(entry)
    for name in names:
        number = re.match(r"RSN(\d+)_", name, re.I)
        for key in (f"RSN{int(number[1])}" if number else "", name):
            facts |= stated_facts(catalogue.get(key))
    return facts


def _applies(entry: CatalogueEntry, record: Record, known: Mapping[str, Any]) -> bool:
    """Return True if a record began at the time of the event, and at its station if named."""
    station = known.get("station", record.station), known.get("network", record.network)
    if entry.station and (entry.station, entry.network) != station:
        return False
    begin, origin = _seconds(record.start_time), _seconds(entry.origin_time)
    return -_BEFORE <= begin - origin <= _AFTER


def _seconds(time: str) -> float:
    """Return a time (ISO 8601, by default UTC) in seconds; NaN if there is none."""
    try:
        moment = datetime.fromisoformat(time)
    except ValueError:
        return math.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def _rows(path: Path, stream: TextIO) -> Iterator[tuple[int, dict[str, str]]]:
    rows = read_rows(stream)
    header = [name.strip() for name in next(rows, (1, []))[1]]
    for name in header:
        if name not in _FIELDS or header.count(name) > 1:
            known = ", ".join(_FIELDS)
            message = f"column {name!r} unknown or repeated. Must be one of: {known}."
            raise InputError(path, message, 1)
    if "file" not in header:
        raise InputError(path, "column 'file' missing.", line=1)
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(path, f"{len(row)} columns. Must be {len(header)}.", line=line)
        yield line, dict(zip(header, map(str.strip, row), strict=True))


def _entry(path: Path, row: dict[str, str], line: int) -> CatalogueEntry:
    file = row["file"]
    if not file or Path(file).name != file:
        raise InputError(path, f"file {file!r}. Must be the name of a file.", line=line)
    texts = {field: row.get(field, "") for field in _TEXTS}
    numbers = {
        field: _number(path, row, column, line)
        for column, field in _FIELDS.items()
        if field not in _TEXTS and column != "site"
    }
    sites = {"": SiteType.UNKNOWN, **{site.words: site for site in SiteType}}
    site = row.get("site", "").lower().replace(" ", "-")
    if site not in sites:
        known = ", ".join(filter(None, sites))
        raise InputError(path, f"site {site!r}. Must be one of: {known}.", line=line)
    return CatalogueEntry(**texts, **numbers, site_type=sites[site])  # type: ignore[arg-type]


def _number(path: Path, row: dict[str, str], column: str, line: int) -> float:
    token = row.get(column, "")
    if not token:
        return math.nan
    try:
        value = decimal(token)
    except ValueError:
        value = math.nan
    low, high = _BOUNDS.get(column, (0.0, _FARTHEST if column.endswith("_km") else math.inf))
    if not low <= value <= high:
        must = f"from {low:g} to {high:g}," if math.isfinite(high) else "zero or positive,"
        raise InputError(path, f"{column} {token!r}. Must be {must} or empty.", line=line)
    return value
