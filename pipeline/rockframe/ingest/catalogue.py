"""Metadata of records from `catalogue.csv`, PEER, NGA-West2, ESM, gmprocess, ComCat, QuakeML."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as default
from pathlib import Path
from typing import Any, Final, TextIO

from rockframe.cells import decimal, read_rows, write_rows
from rockframe.errors import InputError, parse_words
from rockframe.ingest.parsing.lines import HEAD, read_head, unreadable
from rockframe.provenance import whole_file
from rockframe.record import Record, SiteType
from rockframe.units import utc_seconds

#: Beginning of a list of stations of ShakeMap: features with a seismic or macroseismic type.
_SHAKEMAP: Final = re.compile(
    r'"FeatureCollection".*"(?:instrumentType|commType|station_type)"', re.S
)


@dataclass(frozen=True, kw_only=True)
class CatalogueEntry:
    """Metadata of one file from a catalogue; unknown values are NaN or empty.

    Parameters
    ----------
    file : str
        Name of the file.
    event, station, network, mechanism, source : str
        Names of event, station and network, mechanism of the event, and source of the metadata.
    magnitude, vs30 : float
        Magnitude of the event [1], and mean shear-wave velocity of the uppermost 30 m [m s-1].
    epicentral_distance, distance_rrup, distance_rjb, distance_hypocentral : float
        Distances to epicentre, rupture, its surface projection, and hypocentre [km].
    site_type : SiteType
        Free field, structure, borehole, or unknown.
    lowest_usable_frequency, archive_pulse_period : float
        Lowest usable frequency [Hz] and period of the velocity pulse [s], as the archive states.
    origin_time : str
        Time of the event (ISO 8601, UTC). An entry with this time applies to the records that began
        then, at the station of the entry if it names one.
    by_station : bool
        True if the entry applies to all records of its station, whatever their time.
    trust : tuple of str
        Words of `rockframe.errors.TRUSTED`: which of two contradictory statements is right.
    reading : mapping
        Fields of `rockframe.ReadOptions` and `rockframe.TextLayout` for the file: its units, ...

    Examples
    --------
    >>> CatalogueEntry(file="PUL164.AT2", magnitude=6.6).magnitude
    6.6
    """

    file: str = ""
    event: str = ""
    station: str = ""
    network: str = ""
    magnitude: float = math.nan
    epicentral_distance: float = math.nan
    distance_rrup: float = math.nan
    distance_rjb: float = math.nan
    distance_hypocentral: float = math.nan
    vs30: float = math.nan
    site_type: SiteType = SiteType.UNKNOWN
    mechanism: str = ""
    lowest_usable_frequency: float = math.nan
    archive_pulse_period: float = math.nan
    origin_time: str = ""
    by_station: bool = False
    source: str = ""
    trust: tuple[str, ...] = ()
    reading: Mapping[str, Any] = default(default_factory=dict)


def archive_catalogue(name: str, head: bytes) -> str:
    """Return the kind of an archive's catalogue from its name and first bytes; "" for other files.

    Examples
    --------
    >>> archive_catalogue("_SearchResults.csv", b""), archive_catalogue("notes.csv", b"a,b")
    ('PEER search results', '')
    """
    text = head.decode("utf-8-sig", "replace")
    first = text.lstrip().split("\n", 1)[0].replace('"', "").lower()
    if name.lower().endswith("searchresults.csv"):
        return "PEER search results"
    if first.startswith("record sequence number,eqid"):
        return "NGA-West2 flatfile"
    names = re.split("[;,\t]", first)  # pandas writes commas, and a column of row numbers
    if "ngasubrsn" in names:
        return "NGA-Subduction flatfile"
    wanted = {"event_time", "network_code", "station_code"} <= {*names}
    if (wanted and {"event_id", "esm_event_id"} & {*names}) or first.startswith(
        "event_id;event_time;"
    ):
        return "ESM flatfile"
    if first.startswith("earthquakeid,") and ",epicentraldistance," in first:
        return "gmprocess flatfile"
    if first.startswith("id,time,latitude,longitude,depth,magnitude"):
        return "gmprocess events"
    if first.startswith("{") and '"FeatureCollection"' in text and _SHAKEMAP.search(text):
        return "ShakeMap stations"
    if first.startswith("{") and '"Feature"' in text and "earthquake.usgs.gov" in text:
        return "ComCat event"
    return "QuakeML" if "quakeml" in text[:500].lower() and "<" in text else ""


def read_entries(path: Path, kind: str, data: bytes) -> dict[str, CatalogueEntry]:
    r"""Return the entries of a catalogue of an archive, of a kind that `archive_catalogue` returns.

    Keys are names of record files, ``RSN`` with the record number, or other unique texts.

    Raises
    ------
    InputError
        If the file cannot be read as this kind.

    Examples
    --------
    >>> names = b"Result ID,Earthquake Name,Rrup (km),Horizontal-1 Acc. Filename"
    >>> entries = read_entries(Path("a"), "PEER search results", names + b"\n1,Kobe,0.9,a.AT2")
    >>> entries["a.AT2"].distance_rrup
    0.9
    """
    from rockframe.ingest.flatfiles import READERS  # few folders have one

    try:
        entries = {key: CatalogueEntry(**fields) for key, fields in READERS[kind](path, data)}
    except (ValueError, LookupError, TypeError, OverflowError, OSError, csv.Error) as error:
        shown = " ".join(str(error).split())[:100]
        raise InputError(path, f"cannot be read as {kind}: {shown}.") from error
    if not entries:
        raise InputError(path, f"{kind} without records or events.")
    return {key: replace(entry, source=entry.source or kind) for key, entry in entries.items()}


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
TRUST: Final = "trust"
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
    TRUST: "trust",
}
#: Fields of an entry that are no field of a record.
_NO_FACTS: Final = frozenset(["file", "origin_time", "by_station", "trust", "reading"])
_TEXTS: Final = ("file", "event", "station", "network", "mechanism", "source")
#: Bounds of numbers that are not distances; the others are zero or positive.
_BOUNDS: Final = {"magnitude": (-2.0, 10.0), VS30: (0.0, 10_000.0)}
#: Beginnings of names of PEER's files, as keys of entries have them.
_PREFIXES: Final = {"rsn": "RSN", "ngasubrsn": "NGAsubRSN"}
#: Half the circumference of the earth, rounded up: no place on it is farther away [km].
_FARTHEST: Final = 20_050.0
#: Longest time from the start of a record to its event, before and after [s].
_BEFORE, _AFTER = 120.0, 600.0


def read_catalogue(
    path: str | Path, data: bytes | None = None, columns: Sequence[str] = ()
) -> dict[str, CatalogueEntry]:
    r"""Return the entries of a catalogue, in the CSV format of this package or of an archive.

    The CSV has a row for each file; only the column `file` is required. The formats of archives are
    PEER's search results, the flatfiles of NGA-West2, NGA-Subduction, ESM, GEM and gmprocess, the
    events of gmprocess, ShakeMap's stations, a ComCat event, and QuakeML.

    Parameters
    ----------
    path : str or Path
        Catalogue in UTF-8.
    data : bytes, optional
        Contents of the file (default: they are read from `path`).
    columns : sequence of str
        Columns of any other table, such as ``station=STA`` or ``magnitude=Mw``: a column of this
        package or ``origin_time``, and the name of the column in the table.

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
        if columns:
            return _mapped_entries(path, data, columns)
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
        raise InputError(path, f"not a table ({error}). Save it as CSV in UTF-8.") from error
    return entries


def catalogue_kind(path: Path, head: bytes | None = None) -> str:
    """Return the kind of an archive's catalogue from its name and first bytes; else ""."""
    if path.suffix.lower() not in {".csv", ".json", ".geojson", ".xml", ".quakeml"}:
        return ""
    return archive_catalogue(path.name, read_head(path) if head is None else head[:HEAD])


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
    listed = list(entries)
    fields = {field for entry in listed for field in stated_facts(entry)}
    fields |= {TRUST for entry in listed if entry.trust}
    columns = [name for name, field in _FIELDS.items() if name in COLUMNS or field in fields]
    values = ([getattr(entry, _FIELDS[name]) for name in columns] for entry in listed)
    rows = ([*map(_cell, row)] for row in values)
    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        write_rows(stream, [columns, *rows])


def _cell(value: Any) -> Any:
    words = value.words if isinstance(value, SiteType) else value
    return " ".join(words) if isinstance(words, tuple) else words


def stated_facts(entry: CatalogueEntry | None) -> dict[str, Any]:
    """Return the fields of a record that a catalogue states for its file.

    Examples
    --------
    >>> stated_facts(CatalogueEntry(file="shake.csv", magnitude=6.6))
    {'magnitude': 6.6}
    """
    facts = dict(vars(entry)) if entry else {}
    facts |= {"facts_source": facts.pop("source", "")}
    facts = {name: value for name, value in facts.items() if name not in _NO_FACTS}
    # compare types too: a magnitude of zero is a number, but equals the unknown site
    return {
        name: fact
        for name, fact in facts.items()
        if fact != "" and fact is not SiteType.UNKNOWN and fact == fact
    }


def facts_for_record(
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
    >>> facts_for_record({"RSN77": CatalogueEntry(file="", magnitude=6.6)}, record, ["RSN77_A.AT2"])
    {'magnitude': 6.6}
    """
    facts: dict[str, Any] = {}
    for entry in catalogue.values():
        timed = entry.origin_time or entry.by_station
        if timed and not entry.file and _applies(entry, record, known or {}):
            facts |= stated_facts(entry)
    for name in names:
        number = re.match(r"((?:NGAsub)?RSN)(\d+)_", name, re.I)
        key_of_number = number and f"{_PREFIXES[number[1].lower()]}{int(number[2])}"
        for key in (key_of_number or "", name):
            facts |= stated_facts(catalogue.get(key))
    return facts


def _applies(entry: CatalogueEntry, record: Record, facts: Mapping[str, Any]) -> bool:
    """Return True if a record began at the time of the event, and at its station if named."""
    station = facts.get("station", record.station), facts.get("network", record.network)
    if entry.station and (entry.station, entry.network or station[1]) != station:
        return False
    if entry.by_station:
        return entry.station != ""
    begin, origin = utc_seconds(record.start_time), utc_seconds(entry.origin_time)
    return -_BEFORE <= begin - origin <= _AFTER


def _rows(path: Path, stream: TextIO) -> Iterator[tuple[int, dict[str, str]]]:
    rows = read_rows(stream)
    from rockframe.ingest.options import READING  # runs that only plan read no catalogue

    header = [name.strip() for name in next(rows, (1, []))[1]]
    for name in header:
        if name not in {**_FIELDS, **READING} or header.count(name) > 1:
            allowed = ", ".join((*_FIELDS, *READING))
            message = f"column {name!r} unknown or repeated. Must be one of: {allowed}."
            raise InputError(path, message, 1)
    if "file" not in header:
        raise InputError(path, "column 'file' missing.", line=1)
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(
                path, f"{len(row)} columns, but {len(header)} in the header.", line=line
            )
        yield line, dict(zip(header, map(str.strip, row), strict=True))


def _mapped_entries(path: Path, data: bytes, columns: Sequence[str]) -> dict[str, CatalogueEntry]:
    """Return the entries of a table whose columns the user names.

    A row applies to its file; without a file, to the records of its station that begin at the time
    of its event; without a time, to all records of its station.
    """
    from rockframe.ingest.flatfiles import mapped_rows
    from rockframe.ingest.options import READING

    entries: dict[str, CatalogueEntry] = {}
    for line, row in mapped_rows(path, data, columns, (*_FIELDS, *READING, "origin_time")):
        time = row.pop("origin_time", "").replace(" ", "T")
        entry = replace(_entry_of_row(path, row, line), origin_time=time)
        entry = replace(entry, by_station=not (time or entry.file))
        key = entry.file or ".".join(filter(None, (time, entry.network, entry.station)))
        if key:
            entries[key] = replace(entry, source=entry.source or path.name)
    if not entries:
        raise InputError(path, "no rows.")
    return entries


def _entry(path: Path, row: dict[str, str], line: int) -> CatalogueEntry:
    file = row["file"]
    if not file or Path(file).name != file:
        raise InputError(path, f"file {file!r}. Must be the name of a file.", line=line)
    return _entry_of_row(path, row, line)


def _entry_of_row(path: Path, row: Mapping[str, str], line: int) -> CatalogueEntry:
    """Return the entry of a row, by the columns of a catalogue.

    Raises
    ------
    InputError
        If a value is not allowed.
    """
    from rockframe.ingest.options import parse_reading

    texts = {field: row.get(field, "") for field in _TEXTS}
    numbers = {
        field: _number(path, row, column, line)
        for column, field in _FIELDS.items()
        if field not in _TEXTS and column not in ("site", TRUST)
    }
    sites = {"": SiteType.UNKNOWN, **{site.words: site for site in SiteType}}
    site = row.get("site", "").lower().replace(" ", "-")
    if site not in sites:
        allowed = ", ".join(filter(None, sites))
        raise InputError(path, f"site {site!r}. Must be one of: {allowed}.", line=line)
    facts: dict[str, Any] = {"trust": parse_words(path, row.get(TRUST, ""), line)}
    facts |= {"reading": parse_reading(path, row, line), "site_type": sites[site]}
    return CatalogueEntry(**texts, **numbers, **facts)  # type: ignore[arg-type]


def _number(path: Path, row: Mapping[str, str], column: str, line: int) -> float:
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
