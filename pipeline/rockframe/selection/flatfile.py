"""Flatfiles: tables with the response spectra of many recordings, without their waveforms."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.flatfiles import (
    FACTS,
    number_of_cell,
    numbers_of_row,
    separator_of,
    table_rows,
)
from rockframe.ingest.identify import record_ids
from rockframe.ingest.tables import is_workbook, sheets
from rockframe.units import GRAVITY, acceleration_factor, utc_seconds

Float = NDArray[np.float64]
_Row = Mapping[str, str]
_Rows = Sequence[tuple[int, _Row]]

#: Columns of spectra of each kind of flatfile: the pattern of a name, and the acceleration of 1.
#: Its groups are the component, if it names one, and the period in two parts or in one.
_PEER: Final = re.compile(r"()t(\d+)(?:\.|pt)(\d+)s")
_ESM: Final = re.compile(r"(rotd50|rotd100|u|v)_t(\d+)_(\d+)")
_GMPROCESS: Final = re.compile(r"()p?sa\(t=(\d+)\.(\d+),\s*d=0\.050*\)")
_NGA_OF_TOOLS: Final = re.compile(r"()sa\((\d+)\.(\d+)\)")
_PATTERNS: Final = {_PEER: "g", _ESM: "cm/s2", _GMPROCESS: "%g"}
#: The column that marks the flatfile of NGA-West2.
_NUMBER: Final = "record sequence number"
_HUNDREDTH: Final = 0.01
#: Columns of peaks: component, quantity, and the value of 1 in SI units.
_PEAKS: Final = {
    "pga (g)": ("", "pga", GRAVITY),
    "pga_g": ("", "pga", GRAVITY),
    **dict.fromkeys(["pgv (cm/sec)", "pgv_cm_sec"], ("", "pgv", _HUNDREDTH)),
    **{
        f"{of}_{peak}": (of, peak, _HUNDREDTH)
        for of in ("rotd50", "rotd100", "u", "v")
        for peak in ("pga", "pgv")
    },
}
#: Columns of gmprocess, whose names state no units.
_PEAKS_OF_GMPROCESS: Final = {
    "pga": ("", "pga", GRAVITY * _HUNDREDTH),
    "pgv": ("", "pgv", _HUNDREDTH),
}
#: Columns that the user can name, besides those of spectra.
NAMED: Final = {
    "record_id": "", "event": "", "network": "", "station": "", "magnitude": "magnitude",
    "epicentral_distance_km": "epicentral_distance", "distance_rrup_km": "distance_rrup",
    "distance_rjb_km": "distance_rjb", "distance_hypocentral_km": "distance_hypocentral",
    "vs30_m_s": "vs30", "lowest_usable_frequency_hz": "lowest_usable_frequency",
    "pga_g": "pga", "pgv_m_s": "pgv",
}  # fmt: skip
#: Spectra that the user can name, and their units.
SPECTRA: Final = {"sa_g": "g", "sa_m_s2": "m/s2", "sa_cm_s2": "cm/s2", "sa_percent_g": "%g"}
_DISTANCES: Final = (
    *("epicentral_distance", "distance_rrup", "distance_rjb", "distance_hypocentral"),
)
#: A corner frequency times this is usable, as PEER states for NGA-West2.
_MARGIN: Final = 1.25
#: Period up to which a spectrum nearly equals the peak acceleration [s], and by what factor.
_STIFF, _NEARLY = 0.025, 3.0
#: Most columns of a sheet; relative difference of equal periods; characters that messages show.
_MOST_COLUMNS, _SAME, _SHOWN = 2000, 1e-6, 80


@dataclass(frozen=True)
class Recording:
    """A recording in a flatfile.

    Parameters
    ----------
    name : str
        Its identifier: the record number of PEER, or event and channel.
    event, network, station : str
        Names, or "".
    files : tuple of str
        Names of the files of its horizontals and of its vertical, as the archive names them; empty
        if unknown.
    numbers : dict of str to float
        ``magnitude``, distances [km], ``vs30`` [m s-1], ``pga`` [m s-2] and ``pgv`` [m s-1]; NaN if
        unknown.
    longest : float
        Longest usable period [s]; infinite if unknown.
    """

    name: str
    event: str
    network: str
    station: str
    files: tuple[str, ...]
    numbers: dict[str, float]
    longest: float


@dataclass(frozen=True, eq=False)
class Flatfile:
    """Recordings of a flatfile and their spectra.

    Parameters
    ----------
    recordings : list of Recording
        The recordings.
    log_sa : array, shape (recordings, periods)
        Natural logarithm of the spectra in m s-2, 5 % damped; NaN where the file states none.
    spectrum : str
        ``rotd50``, ``rotd100`` or ``geometric-mean`` of the two horizontals; "" if the file does
        not say.
    """

    recordings: list[Recording]
    log_sa: Float
    spectrum: str


@dataclass(frozen=True)
class _Spectra:
    """Columns of spectra: those of each component by period, and the acceleration of 1 [m s-2]."""

    columns: Mapping[str, Mapping[float, str]]
    factor: float
    spectrum: str = ""


def read_flatfile(
    path: Path, periods: Float, columns: Sequence[str] = (), pairs: str | None = None
) -> Flatfile:
    r"""Read a flatfile: NGA-West2, NGA-Subduction, ESM, GEM, gmprocess, or a table by its columns.

    Parameters
    ----------
    path : Path
        CSV or Excel, also as saved again by pandas. Numbers may have decimal commas where
        semicolons or tabs separate the columns.
    periods : array, shape (periods,)
        Periods of the spectra [s]. Between those of the file, ln Sa is linear in the logarithm of
        the period.
    columns : sequence of str
        Columns of any other table, such as ``record_id=ID``, ``magnitude=Mw`` (`NAMED`) and
        ``sa_g=SA_{}`` (`SPECTRA`), in which {} stands for the period in seconds.
    pairs : {"rotd50", "rotd100", "geometric-mean"}, optional
        Spectrum of the two horizontals; by default RotD50, or the only one of the file.

    Raises
    ------
    InputError
        If the file cannot be read, has no spectra or not this one, does not cover the periods, or
        names a recording twice; if a cell that is needed is neither a number nor empty, or if its
        spectra and its peaks have different units.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "flat.csv")
    ...     _ = path.write_text("Site,Sa_0.5,Sa_2\nCLC,0.4,0.1\n")
    ...     words = ("record_id=Site", "sa_g=Sa_{}")
    ...     flatfile = read_flatfile(path, np.array([1.0]), words)
    >>> flatfile.recordings[0].name, (np.exp(flatfile.log_sa) / GRAVITY).round(3).tolist()
    ('CLC', [[0.2]])
    """
    rows = list(_rows_of(path))
    if not rows:
        raise InputError(path, "no recordings. Must have one or more.")
    header = list(rows[0][1])
    named = _named(path, columns, header)
    spectra = _spectra_of(path, header, named, rows[0][1])
    spectrum, used = _chosen(path, spectra, pairs)
    recordings: dict[str, Recording] = {}
    for line, row in rows:
        recording = _recording(path, line, row, named, spectrum)
        if recording.name in recordings:
            raise InputError(path, f"recording {recording.name!r} is stated twice.", line)
        recordings[recording.name] = recording
    log_sa = np.mean([_log_sa(path, rows, of, periods) for of in used], axis=0)
    flatfile = Flatfile([*recordings.values()], log_sa + math.log(spectra.factor), spectrum)
    if len(used) == 1:
        _require_units(path, rows, used[0], spectra.factor, flatfile)
    return flatfile


def _rows_of(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield line number and cells of each row, by the names of the columns in lower case; of a
    workbook those of its first sheet with numbers.
    """
    try:
        data = path.read_bytes()
        if is_workbook(data):
            _, data = next(sheets(path, data, _MOST_COLUMNS))
        yield from table_rows(data, separator_of(data))
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (StopIteration, csv.Error) as error:
        raise InputError(path, f"not a table ({error}). Must be CSV or Excel.") from None


def _named(path: Path, columns: Sequence[str], header: Sequence[str]) -> dict[str, str]:
    """Return the columns that the user names, in lower case, by the words of this package."""
    named = {}
    for column in columns:
        name, _, own = (part.strip() for part in column.partition("="))
        allowed = ", ".join((*NAMED, *SPECTRA))
        if name not in NAMED and name not in SPECTRA:
            message = f"column {name!r} unknown. Must be one of: {allowed}, followed by = and its"
            raise InputError(path, f"{message} name in the table.")
        if name in NAMED and own.lower() not in header:
            shown = ", ".join(header[:40])
            raise InputError(path, f"no column {own!r}. Must be one of: {shown}.", 1)
        if name in SPECTRA and own.count("{}") != 1:
            must = "Must contain {} once, in place of the period in seconds"
            raise InputError(path, f"{name} {own!r}. {must}, such as SA_{{}}.")
        named[name] = own.lower()
    if named and ("record_id" not in named or not {*named} & {*SPECTRA}):
        message = "flatfile_columns need record_id and one of"
        raise InputError(path, f"{message} {', '.join(SPECTRA)}.")
    return named


def _spectra_of(
    path: Path, header: Sequence[str], named: Mapping[str, str], first: _Row
) -> _Spectra:
    """Return the columns of spectra."""
    spectrum = ""
    for name in named:
        if name in SPECTRA:
            own = re.escape(named[name]).replace(r"\{\}", r"(\d+[.,]?\d*|[.,]\d+)")
            return _matching(path, header, re.compile(own), SPECTRA[name])
    patterns = _PATTERNS | ({_NGA_OF_TOOLS: "g"} if _NUMBER in header else {})
    for pattern, units in patterns.items():
        if any(pattern.fullmatch(name) for name in header):
            if percentile := first.get("rotd percentile", ""):
                spectrum = f"rotd{percentile}"
            elif match := re.search(r"rotd\(percentile=(\d+)", path.name):
                spectrum = f"rotd{match[1]}"
            spectra = _matching(path, header, pattern, units)
            return _Spectra(spectra.columns, spectra.factor, spectrum)
    message = "no columns of spectra, such as T1.000S or rotD50_T1_000. Name them with"
    raise InputError(path, f"{message} --flatfile-columns record_id=ID sa_g=SA_{{}}.", 1)


def _matching(path: Path, header: Sequence[str], pattern: re.Pattern[str], units: str) -> _Spectra:
    columns: dict[str, dict[float, str]] = {}
    for name in header:
        match = pattern.fullmatch(name)
        if match:
            *component, last = match.groups()
            period = float(f"{component[-1]}.{last}" if component else last.replace(",", "."))
            columns.setdefault(component[0] if component else "", {})[period] = name
    columns = {
        of: {period: columns[of][period] for period in sorted(columns[of]) if period > 0.0}
        for of in columns
    }
    if not columns or min(map(len, columns.values())) < 2:
        message = "fewer than two columns of spectra. Must be two periods or more."
        raise InputError(path, message, 1)
    return _Spectra(columns, acceleration_factor(units))


def _chosen(
    path: Path, spectra: _Spectra, pairs: str | None
) -> tuple[str, list[Mapping[float, str]]]:
    """Return the spectrum, and its columns; for a geometric mean those of both horizontals."""
    if "" in spectra.columns:
        if pairs and spectra.spectrum and pairs != spectra.spectrum:
            raise InputError(
                path, f"states {spectra.spectrum}. Must be {pairs}, as --pairs states."
            )
        return spectra.spectrum or pairs or "", [spectra.columns[""]]
    wanted = pairs or "rotd50"
    components = ("u", "v") if wanted == "geometric-mean" else (wanted,)
    if not {*components} <= {*spectra.columns}:
        available = ", ".join(spectra.columns)
        raise InputError(path, f"no spectra for --pairs {wanted}. It has those of {available}.", 1)
    return wanted, [spectra.columns[of] for of in components]


def _recording(
    path: Path, line: int, row: _Row, named: Mapping[str, str], spectrum: str
) -> Recording:
    """Return the recording of a row."""
    facts, name, files = dict(FACTS), "", tuple[str, ...]()
    texts = {"event": _event(row), "network": row.get("network_code") or row.get("network", "")}
    texts["station"] = _first(row, "station_code", "stationcode", "station name", "station id")
    texts["station"] = texts["station"] or _first(row, "station_name", "ngasubssn")
    if named:
        facts = {own: NAMED[of] for of, own in named.items() if NAMED.get(of)}
        texts = {of: row.get(named.get(of, ""), "") for of in texts}
        name = row.get(named["record_id"], "")
    else:
        name, files = _archived(row)
    if not name:
        raise InputError(path, "no name of the recording. Must be stated.", line)
    unknown = ("magnitude", *_DISTANCES, "vs30", "pga", "pgv", "lowest_usable_frequency")
    numbers = dict.fromkeys(unknown, math.nan) | numbers_of_row(path, line, row, facts)
    lowest = numbers.pop("lowest_usable_frequency")
    if named:
        numbers["pga"] *= GRAVITY
        longest = 1.0 / lowest if lowest > 0.0 else math.inf
    else:
        numbers |= _peaks(path, line, row, spectrum)
        longest = _longest(path, line, row, lowest)
    name = record_ids(Path(f"{name}.x"), [""])[0]
    return Recording(name, **texts, files=files, longest=longest, numbers=numbers)


def _archived(row: _Row) -> tuple[str, tuple[str, ...]]:
    """Return the name of a recording and of its files, as its archive has them."""
    if number := row.get(_NUMBER, ""):
        paths = [row.get(f"file name ({of})", "") for of in ("horizontal 1", "horizontal 2")]
        paths.append(row.get("file name (vertical)", ""))
        files = [re.sub(r"[\\/]", "_", file) if "." in file[-5:] else "" for file in paths]
        return f"RSN{number}", tuple(file and f"RSN{number}_{file}" for file in files)
    if number := row.get("ngasubrsn", ""):
        files = [
            re.split(r"[\\/]", row.get(f"accfilepath{of}", ""))[-1] for of in ("h1", "h2", "v")
        ]
        return f"NGAsubRSN{number}", tuple(file and f"NGAsubRSN{number}_{file}" for file in files)
    if "earthquakeid" in row:
        return f"{row['earthquakeid']}-{row.get('stationid') or row.get('stationcode', '')}", ()
    place = [row.get(key, "") for key in ("network_code", "station_code", "location_code")]
    instrument = row.get("instrument_code", "")
    files = []
    time = row.get("event_time", "").replace(" ", "T")
    # ESM names a file after the time of the event, to the second
    if instrument and not math.isnan(utc_seconds(time)):
        tag = re.sub(r"[-:]", "", time)[:15].replace("T", ".")
        channels = [row.get(f"{of}_channel_code", "") for of in "uvw"]
        stem = ".".join([*place[:2], "00" if place[2] == "0" else place[2]])  # saved as a number
        files = [c and f"{stem}.{instrument}{c}.D.{tag}.C.ACC.ASC" for c in channels]
    channel = ".".join((*place, instrument or row.get("channel_code", "")))
    return f"{_event(row)}-{channel}" if any(place) else "", tuple(files)


def _event(row: _Row) -> str:
    if _NUMBER in row:
        year = row.get("year", "")
        return f"{row.get('earthquake name', '')} {year}".strip().replace("_ ", ", ")
    names = ("event_id", "esm_event_id", "earthquakeid", "earthquake_name", "ngasubeqid")
    return _first(row, *names)


def _first(row: _Row, *names: str) -> str:
    return next((row[name] for name in names if row.get(name)), "")


def _peaks(path: Path, line: int, row: _Row, spectrum: str) -> dict[str, float]:
    """Return PGA [m s-2] and PGV [m s-1] of this measure of both horizontals; NaN if unknown."""
    logs: dict[str, list[float]] = {"pga": [], "pgv": []}
    of_both = ("", "u", "v") if spectrum == "geometric-mean" else ("", spectrum)
    columns = _PEAKS_OF_GMPROCESS if "earthquakeid" in row else _PEAKS
    for name, (component, peak, factor) in columns.items():
        if name in row and component in of_both:
            value = factor * abs(number_of_cell(path, line, row, name))
            logs[peak].append(math.log(value) if value > 0.0 else math.nan)
    return {peak: math.exp(np.mean(each)) if each else math.nan for peak, each in logs.items()}


def _longest(path: Path, line: int, row: _Row, lowest: float) -> float:
    """Return the longest usable period [s], if need be from the corners of the high-pass."""
    for column in ("longest_usable_period", "longest_usable_period_for_psa_ave_component_sec"):
        value = number_of_cell(path, line, row, column)
        if value > 0.0:
            return value
    if lowest > 0.0:
        return 1.0 / lowest
    corners = [number_of_cell(path, line, row, f"{of}_hp") for of in "uv"]
    highest = max((corner for corner in corners if corner > 0.0), default=0.0)
    return 1.0 / (_MARGIN * highest) if highest else math.inf


def _log_sa(path: Path, rows: _Rows, columns: Mapping[float, str], periods: Float) -> Float:
    """Return the logarithms of spectra at the periods, shape (rows, periods), in the units of the
    file; NaN where a row states none.
    """
    available = np.array([*columns])
    for period in periods:
        if not available[0] * (1.0 - _SAME) <= period <= available[-1] * (1.0 + _SAME):
            covers = f"covers periods from {available[0]:g} to {available[-1]:g} s"
            raise InputError(path, f"{covers}, not {period:g} s. State periods within this range.")
    above = np.searchsorted(available * (1.0 + _SAME), periods).clip(0, available.size - 1)
    equal = np.isclose(available[above], periods, rtol=2.0 * _SAME, atol=0.0)
    below = np.where(equal, above, above - 1).clip(0)
    needed, places = np.unique([below, above], return_inverse=True)
    names = [columns[float(available[k])] for k in needed]
    values = np.array(
        [[number_of_cell(path, line, row, name) for name in names] for line, row in rows]
    )
    low, high = np.moveaxis(np.log(np.where(values > 0.0, values, math.nan))[:, places], 1, 0)
    width = np.where(equal, 1.0, np.log(available[above] / available[below]))
    share = np.where(equal, 0.0, np.log(periods / available[below]) / width)
    return np.asarray(low + share * (high - low))


def _require_units(
    path: Path,
    rows: _Rows,
    columns: Mapping[float, str],
    factor: float,
    flatfile: Flatfile,
) -> None:
    """Require that the spectrum of the shortest period nearly equals the peak acceleration."""
    shortest = min(columns)
    pga = np.array([recording.numbers["pga"] for recording in flatfile.recordings])
    name = columns[shortest]
    stiff = factor * np.array([number_of_cell(path, line, row, name) for line, row in rows])
    both = np.isfinite(pga) & (stiff > 0.0)
    if shortest > _STIFF or not both.any():
        return
    ratio = float(np.median(stiff[both] / pga[both]))
    if not 1.0 / _NEARLY < ratio < _NEARLY:
        message = f"Sa at {shortest:g} s is {ratio:.3g} times PGA (median). Must be nearly equal"
        raise InputError(path, f"{message}: check the units of the spectra.", 1)
