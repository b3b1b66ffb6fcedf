"""Catalogues of archives, and other tables of events and stations: fields of catalogue entries."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from rockframe.cells import decimal, with_point
from rockframe.errors import InputError
from rockframe.ingest.identify import site_of_depth
from rockframe.provenance import read_json
from rockframe.units import utc_seconds

#: Key and fields of each entry.
_Entries = Iterator[tuple[str, dict[str, Any]]]

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
#: NGA-West2 in both layouts: as PEER delivers it, and with the names of OpenQuake's tools.
_NGA: Final = {
    "magnitude": "magnitude",
    "earthquake magnitude": "magnitude",
    "epicentral distance (km)": "epicentral_distance",
    "epid (km)": "epicentral_distance",
    "hypocentral distance (km)": "distance_hypocentral",
    "hypd (km)": "distance_hypocentral",
    "joyner-boore distance (km)": "distance_rjb",
    "joyner-boore dist. (km)": "distance_rjb",
    "rupture distance (km)": "distance_rrup",
    "clstd (km)": "distance_rrup",
    "preferred vs30 (m/s)": "vs30",
    "vs30 (m/s) selected for analysis": "vs30",
    "lowest usable freq - ave. component (hz)": "lowest_usable_frequency",
}
_NGA_SUB: Final = {
    "earthquake_magnitude": "magnitude",
    "clstd_km": "distance_rrup",
    "rjb_km": "distance_rjb",
    "vs30_selected_for_analysis_m_s": "vs30",
}
#: ESM, its web service, and the flatfile of GEM.
_ESM: Final = {
    "ml": "magnitude",
    "mw": "magnitude",
    "epi_dist": "epicentral_distance",
    "hyp_dist": "distance_hypocentral",
    "jb_dist": "distance_rjb",
    "rup_dist": "distance_rrup",
    "vs30_m_sec": "vs30",
    "vs30_m_s": "vs30",
}
_GMPROCESS: Final = {
    "earthquakemagnitude": "magnitude",
    "epicentraldistance": "epicentral_distance",
    "hypocentraldistance": "distance_hypocentral",
    "joynerbooredistance": "distance_rjb",
    "rupturedistance": "distance_rrup",
}
#: Fields of an entry by the column of any flatfile.
FACTS: Final = {**_NGA, **_NGA_SUB, **_ESM, **_GMPROCESS}
_FAULTING: Final = {
    "S": "strike slip", "SS": "strike slip", "R": "reverse", "TF": "reverse", "N": "normal",
    "NF": "normal", "O": "oblique",
}  # fmt: skip


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
        entry = dict[str, Any](
            event=f"{_name(values['earthquake name'])} {year}".strip(),
            station=_name(values.get("station name", "")),
            mechanism=values.get("mechanism", ""),
            **numbers_of_row(path, rows.line_num, values, _PEER),
        )
        number = values.get("record sequence number", "")
        files = [value for name, value in values.items() if name.endswith("acc. filename")]
        yield from _under(files, number, entry)


def _nga(path: Path, data: bytes) -> _Entries:
    for line, row in table_rows(data, ","):
        entry = dict[str, Any](
            event=f"{_name(row['earthquake name'])} {row['year']}",
            mechanism=_FAULTING.get(row.get("style-of-faulting (s, r, n, u)", ""), ""),
            **numbers_of_row(path, line, row, _NGA),
        )
        files = [row[name] for name in row if name.startswith("file name (")]
        yield from _under(files, row["record sequence number"], entry)


def _nga_sub(path: Path, data: bytes) -> _Entries:
    for line, row in table_rows(data, separator_of(data)):
        entry = dict[str, Any](
            event=row.get("earthquake_name") or row.get("ngasubeqid", ""),
            **numbers_of_row(path, line, row, _NGA_SUB),
        )
        yield f"NGAsubRSN{int(row['ngasubrsn'])}", entry


def _esm(path: Path, data: bytes) -> _Entries:
    for line, row in table_rows(data, separator_of(data)):
        time = row["event_time"].replace(" ", "T")
        entry = dict[str, Any](
            event=row.get("event_id") or row["esm_event_id"],
            network=row["network_code"],
            station=row["station_code"],
            mechanism=_FAULTING.get(row.get("fm_type_code", ""), ""),
            origin_time=time,
            site_type=site_of_depth(_depth(row)),
            **numbers_of_row(path, line, row, _ESM),
        )
        if math.isnan(utc_seconds(time)):
            must = "Must be year-month-day hour:minute:second; spreadsheets write other times"
            raise InputError(path, f"event_time {row['event_time']!r}. {must}.", line)
        yield f"{entry['event']} {entry['network']}.{entry['station']}", entry


def _gmprocess(path: Path, data: bytes) -> _Entries:
    for line, row in table_rows(data, ","):
        entry = dict[str, Any](
            event=row["earthquakeid"],
            network=row["network"],
            station=row["stationcode"],
            origin_time=row["earthquaketime"],
            **numbers_of_row(path, line, row, _GMPROCESS),
        )
        yield f"{entry['event']} {row.get('stationid') or entry['station']}", entry


def _gmprocess_events(path: Path, data: bytes) -> _Entries:
    for line, row in table_rows(data, ","):
        magnitude = numbers_of_row(path, line, row, {"magnitude": "magnitude"})
        yield row["id"], dict[str, Any](event=row["id"], origin_time=row["time"], **magnitude)


def _comcat(path: Path, data: bytes) -> _Entries:
    feature = read_json(data)
    properties = feature["properties"]
    entry = dict[str, Any](
        event=str(properties["place"] or properties["title"]),
        magnitude=_finite(path, properties["mag"]),
        origin_time=datetime.fromtimestamp(properties["time"] / 1000.0, UTC).isoformat(),
    )
    yield str(feature["id"]), entry


def _quakeml(path: Path, data: bytes) -> _Entries:
    from rockframe.ingest.parsing.obspy_reader import quakeml_events  # few folders have one

    for event in quakeml_events(path, data):
        origin = event.preferred_origin() or (event.origins or [None])[0]
        size = event.preferred_magnitude() or (event.magnitudes or [None])[0]
        names = [description.text for description in event.event_descriptions if description.text]
        entry = dict[str, Any](
            event=names[0] if names else "",
            magnitude=_finite(path, size.mag) if size else math.nan,
            origin_time=str(origin.time) if origin else "",
        )
        yield str(event.resource_id), entry


def _shakemap(_path: Path, data: bytes) -> _Entries:
    """Yield the stations of ShakeMap's `stationlist.json`, with their distances and vs30."""
    for feature in read_json(data)["features"]:
        properties = feature["properties"]
        distances = properties.get("distances") or {}
        numbers = {
            "distance_rrup": distances.get("rrup", properties.get("distance")),
            "distance_rjb": distances.get("rjb"),
            "epicentral_distance": distances.get("repi"),
            "distance_hypocentral": distances.get("rhypo"),
            "vs30": properties.get("vs30"),
        }
        facts: dict[str, Any] = {
            name: float(value)
            for name, value in numbers.items()
            if isinstance(value, int | float) and math.isfinite(value) and value >= 0.0
        }
        if str(properties.get("station_type", "seismic")) == "seismic":
            code = str(properties["code"]).rpartition(".")[2]
            network = str(properties.get("network") or "")
            entry = dict[str, Any](station=code, network=network, by_station=True, **facts)
            yield f"{network}.{code}", entry


READERS: Final[Mapping[str, Callable[[Path, bytes], _Entries]]] = {
    "PEER search results": _peer,
    "NGA-West2 flatfile": _nga,
    "NGA-Subduction flatfile": _nga_sub,
    "ESM flatfile": _esm,
    "gmprocess flatfile": _gmprocess,
    "gmprocess events": _gmprocess_events,
    "ComCat event": _comcat,
    "QuakeML": _quakeml,
    "ShakeMap stations": _shakemap,
}


def _text(data: bytes) -> str:
    return data.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")


def table_rows(data: bytes, separator: str) -> Iterator[tuple[int, dict[str, str]]]:
    r"""Yield line number and cells of each row, by the names of the columns in lower case.

    Numbers with decimal commas are returned with points, unless commas separate the columns.

    Examples
    --------
    >>> list(table_rows(b"STA;Mw\nCLC;7,1\n", ";"))
    [(2, {'sta': 'CLC', 'mw': '7.1'})]
    """
    text = _text(data)
    first, _, _ = text.partition("\n")
    # The header of NGA-West2 is not quoted; names contain commas in brackets or before blanks.
    names = re.split(r",(?! )(?![^()]*\))", first) if '"' not in first else []
    rows = csv.reader(io.StringIO(text), delimiter=separator)
    cells = next(rows, [])
    headings = names if separator == "," and names else cells
    names = [" ".join(name.split()).lower() for name in headings]  # some have line ends
    for row in rows:
        if any(row):
            values = list(map(str.strip, row))
            if separator != ",":  # a flatfile has millions of cells
                values = [with_point(v, separator) if "," in v else v for v in values]
            yield rows.line_num, dict(zip(names, values, strict=False))


def _under(files: list[str], number: str, entry: dict[str, Any]) -> _Entries:
    if number.isdigit():
        yield f"RSN{int(number)}", entry
    for file in files:
        name = re.split(r"[/\\]", file)[-1]
        if "." in name:
            yield name, {**entry, "file": name}


def numbers_of_row(
    path: Path, line: int, row: Mapping[str, str], columns: Mapping[str, str]
) -> dict[str, Any]:
    """Return the numbers of a row by field; -, N/A, -999 and similar texts mean unknown.

    Raises
    ------
    InputError
        If another text is no number.

    Examples
    --------
    >>> numbers_of_row(Path("a.csv"), 2, {"mw": "7.1", "jb_dist": "-999"}, FACTS)
    {'magnitude': 7.1}
    """
    numbers = {}
    for column, field in columns.items():
        value = number_of_cell(path, line, row, column)
        if value >= 0.0 or (field == "magnitude" and value > -10.0):
            numbers[field] = value
    return numbers


def number_of_cell(path: Path, line: int, row: Mapping[str, str], column: str) -> float:
    """Return the number in a cell of a row; NaN if there is none, or a text for unknown values.

    Raises
    ------
    InputError
        If another text is no number.

    Examples
    --------
    >>> [number_of_cell(Path("a.csv"), 2, {"mw": cell}, "mw") for cell in ("7.1", "", "N/A")]
    [7.1, nan, nan]
    """
    token = row.get(column, "")
    if not token.strip("-") or token.upper() in _UNKNOWN:
        return math.nan
    try:
        return decimal(token)
    except ValueError:
        raise InputError(path, f"{column} {token[:_SHOWN]!r}. Must be a number.", line) from None


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


def separator_of(data: bytes) -> str:
    """Return the separator of a table: the most frequent of semicolon, tab and comma at its top.

    Examples
    --------
    >>> separator_of(b"event_id;event_time;ML"), separator_of(b",event_id,event_time")
    (';', ',')
    """
    first = _text(data).partition("\n")[0]
    return max(";\t,", key=first.count)


def mapped_rows(
    path: Path, data: bytes, columns: Sequence[str], known: Sequence[str]
) -> Iterator[tuple[int, dict[str, str]]]:
    r"""Yield line number and cells of each row of a table whose columns the user names.

    Parameters
    ----------
    columns : sequence of str
        Such as ``station=STA`` or ``magnitude=Mw``: a known column, and its name in the table.
    known : sequence of str
        Columns of a catalogue.

    Raises
    ------
    InputError
        If a column is missing or unknown, or if none says to which records a row belongs.

    Examples
    --------
    >>> table = b"STA;Mw;R\nCLC;7.1;-999\n"
    >>> [*mapped_rows(Path("a.csv"), table, ["station=STA", "vs30=R"], ["station", "vs30"])]
    [(2, {'station': 'CLC', 'vs30': '', 'file': ''})]
    """
    pairs = [column.partition("=") for column in columns]
    for name, _, column in pairs:
        if name.strip() not in known or not column.strip():
            message = f"column {name.strip()!r} unknown. Must be one of: {', '.join(known)},"
            raise InputError(path, f"{message} followed by = and its name in the table.")
    if not {"file", "station", "origin_time"} & {name.strip() for name, _, _ in pairs}:
        message = "no column says to which records a row belongs."
        raise InputError(path, f"{message} State file, station or origin_time.")
    for line, row in table_rows(data, separator_of(data)):
        cells = {}
        for name, _, column in pairs:
            wanted = column.strip().lower()
            if wanted not in row:
                shown = ", ".join(list(row)[:40])
                raise InputError(path, f"no column {column.strip()!r}. Must be one of: {shown}.", 1)
            cells[name.strip()] = "" if row[wanted].upper() in _UNKNOWN else row[wanted]
        cells["file"] = re.split(r"[/\\]", cells.get("file", ""))[-1]
        yield line, cells


#: Texts of unknown values; largest number of characters of a cell that messages show.
_UNKNOWN: Final = frozenset(["N/A", "#N/A", "NA", "NAN", "-", "-999", "-999.0", "NONE", "NULL"])
_SHOWN: Final = 80
