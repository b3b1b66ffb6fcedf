"""Metadata from the catalogues of archives: PEER, NGA-West2 and ESM tables, ComCat and QuakeML."""

from __future__ import annotations

import csv
import io
import math
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rockframe.cells import decimal
from rockframe.errors import InputError
from rockframe.ingest.site import site_of_depth
from rockframe.provenance import read_json
from rockframe.record import SiteType

_Entries = Iterator[tuple[str, "CatalogueEntry"]]

#: Fields of an entry, by the column of each table in lower case.
_PEER: Final = {
    "magnitude": "magnitude",
    "rjb (km)": "distance_rjb",
    "rrup (km)": "distance_rrup",
    "vs30 (m/sec)": "vs30",
    "lowest useable frequency (hz)": "lowest_usable_frequency",
    "lowest usable frequency (hz)": "lowest_usable_frequency",
    "tp-pulse period (sec)": "archive_pulse_period",
}
_NGA: Final = {
    "magnitude": "magnitude",
    "epicentral distance (km)": "epicentral_distance",
    "hypocentral distance (km)": "distance_hypocentral",
    "joyner-boore distance (km)": "distance_rjb",
    "rupture distance (km)": "distance_rrup",
    "preferred vs30 (m/s)": "vs30",
    "lowest usable freq - ave. component (hz)": "lowest_usable_frequency",
}
_ESM: Final = {
    "ml": "magnitude",
    "mw": "magnitude",
    "epi_dist": "epicentral_distance",
    "jb_dist": "distance_rjb",
    "rup_dist": "distance_rrup",
    "vs30_m_sec": "vs30",
}
_FAULTING: Final = {
    "S": "strike slip", "SS": "strike slip", "R": "reverse", "TF": "reverse", "N": "normal",
    "NF": "normal", "O": "oblique",
}  # fmt: skip


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
    source: str = ""


def kind_of(name: str, head: bytes) -> str:
    """Return the kind of an archive's catalogue from its name and first bytes; "" for other files.

    Examples
    --------
    >>> kind_of("_SearchResults.csv", b""), kind_of("notes.csv", b"a,b")
    ('PEER search results', '')
    """
    text = head.decode("utf-8-sig", "replace")
    first = text.lstrip().split("\n", 1)[0].replace('"', "").lower()
    if name.lower().endswith("searchresults.csv"):
        return "PEER search results"
    if first.startswith("record sequence number,eqid"):
        return "NGA-West2 flatfile"
    if first.startswith("event_id;event_time;"):
        return "ESM flatfile"
    if first.startswith("{") and '"Feature"' in text and "earthquake.usgs.gov" in text:
        return "ComCat event"
    return "QuakeML" if "quakeml" in text[:500].lower() and "<" in text else ""


def read_entries(path: Path, kind: str, data: bytes) -> dict[str, CatalogueEntry]:
    r"""Return the entries of a catalogue of an archive, of a kind that `kind_of` returns.

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
    try:
        found = dict(_READERS[kind](path, data))
    except (ValueError, LookupError, TypeError, OverflowError, OSError, csv.Error) as error:
        shown = " ".join(str(error).split())[:100]
        raise InputError(path, f"cannot be read as {kind}: {shown}.") from error
    if not found:
        raise InputError(path, f"{kind} without records or events.")
    return {key: replace(entry, source=entry.source or kind) for key, entry in found.items()}


def _peer(path: Path, data: bytes) -> _Entries:
    rows = csv.reader(io.StringIO(_text(data)), skipinitialspace=True)
    names: list[str] = []
    for cells in rows:
        row = [cell.strip().strip('"').strip() for cell in cells]
        if not names:
            lower = [cell.lower() for cell in row]
            names = lower if lower[:1] == ["result id"] and "earthquake name" in lower else []
            continue
        if not row[:1] or not row[0].isdigit():
            return
        values = dict(zip(names, row, strict=False))
        year = values.get("year", "")
        entry = CatalogueEntry(
            event=f"{_name(values['earthquake name'])} {year}".strip(),
            station=_name(values.get("station name", "")),
            mechanism=values.get("mechanism", ""),
            **_numbers(path, rows.line_num, values, _PEER),
        )
        number = values.get("record sequence number", "")
        files = [value for name, value in values.items() if name.endswith("acc. filename")]
        yield from _under(files, number, entry)


def _nga(path: Path, data: bytes) -> _Entries:
    for line, row in _table(data, ","):
        entry = CatalogueEntry(
            event=f"{_name(row['earthquake name'])} {row['year']}",
            mechanism=_FAULTING.get(row["style-of-faulting (s, r, n, u)"], ""),
            **_numbers(path, line, row, _NGA),
        )
        files = [row[name] for name in row if name.startswith("file name (")]
        yield from _under(files, row["record sequence number"], entry)


def _esm(path: Path, data: bytes) -> _Entries:
    for line, row in _table(data, ";"):
        entry = CatalogueEntry(
            event=row["event_id"],
            network=row["network_code"],
            station=row["station_code"],
            mechanism=_FAULTING.get(row.get("fm_type_code", ""), ""),
            origin_time=row["event_time"].replace(" ", "T"),
            site_type=site_of_depth(_depth(row)),
            **_numbers(path, line, row, _ESM),
        )
        yield f"{entry.event} {entry.network}.{entry.station}", entry


def _comcat(path: Path, data: bytes) -> _Entries:
    feature = read_json(data)
    properties = feature["properties"]
    entry = CatalogueEntry(
        event=str(properties["place"] or properties["title"]),
        magnitude=_finite(path, properties["mag"]),
        origin_time=datetime.fromtimestamp(properties["time"] / 1000.0, UTC).isoformat(),
    )
    yield str(feature["id"]), entry


def _quakeml(path: Path, data: bytes) -> _Entries:
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InputError(path, "XML with a document type. Must be plain QuakeML.")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from obspy import read_events

        try:
            events = read_events(io.BytesIO(data), format="QUAKEML")
        except Exception as error:  # lxml and obspy raise classes of their own
            raise ValueError(str(error)) from error
    for event in events:
        origin = event.preferred_origin() or (event.origins or [None])[0]
        size = event.preferred_magnitude() or (event.magnitudes or [None])[0]
        names = [one.text for one in event.event_descriptions if one.text]
        entry = CatalogueEntry(
            event=names[0] if names else "",
            magnitude=_finite(path, size.mag) if size else math.nan,
            origin_time=str(origin.time) if origin else "",
        )
        yield str(event.resource_id), entry


_READERS: Final[Mapping[str, Callable[[Path, bytes], _Entries]]] = {
    "PEER search results": _peer,
    "NGA-West2 flatfile": _nga,
    "ESM flatfile": _esm,
    "ComCat event": _comcat,
    "QuakeML": _quakeml,
}


def _text(data: bytes) -> str:
    return data.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")


def _table(data: bytes, separator: str) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line number and cells of each row, by the names of the columns in lower case."""
    text = _text(data)
    first, _, _ = text.partition("\n")
    # The header of NGA-West2 is not quoted; names contain commas in brackets or before blanks.
    names = re.split(r",(?! )(?![^()]*\))", first) if '"' not in first else []
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    cells = next(rows)
    names = [name.strip().lower() for name in (names if separator == "," and names else cells)]
    for row in rows:
        if any(row):
            yield rows.line_num, dict(zip(names, map(str.strip, row), strict=False))


def _under(files: list[str], number: str, entry: CatalogueEntry) -> _Entries:
    if number.isdigit():
        yield f"RSN{int(number)}", entry
    for file in files:
        name = re.split(r"[/\\]", file)[-1]
        if "." in name:
            yield name, replace(entry, file=name)


def _numbers(path: Path, line: int, row: Mapping[str, str], columns: Mapping[str, str]) -> Any:
    """Return the numbers of a row by field; -, N/A, -999 and similar texts mean unknown."""
    found = {}
    for column, field in columns.items():
        token = row.get(column, "")
        if token.strip("-") and token.upper() not in {"N/A", "NA", "NAN"}:
            try:
                value = decimal(token)
            except ValueError:
                raise InputError(path, f"{column} {token!r}. Must be a number.", line) from None
            if value >= 0.0 or (field == "magnitude" and value > -10.0):
                found[field] = value
    return found


def _depth(row: Mapping[str, str]) -> float:
    try:
        return decimal(row.get("sensor_depth_m", ""))
    except ValueError:
        return math.nan


def _finite(path: Path, value: object) -> float:
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(path, f"magnitude {value!r}. Must be a number.")
    return float(value)


def _name(text: str) -> str:
    # PEER writes underscores for commas.
    return text.replace("_ ", ", ")
