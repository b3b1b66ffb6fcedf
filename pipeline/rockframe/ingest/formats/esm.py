"""Reader of ESM and ITACA files.

DYNA 1.2 ASCII has 64 lines `KEY: value`, then samples in cm/s2. The older form of ITACA
(`.cor.acc`) has ten lines of header, then samples in m/s2.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.identify import directed, record_ids, seed_letter, site_of_depth, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    first_line,
    head_lines,
    keyed_header,
    parse_number,
    parse_numbers,
    plain_text,
    require_even_lines,
    require_sample_count,
    rows_below,
)
from rockframe.ingest.parsing.samples import (
    Columns,
    count_columns,
    read_columns,
    require_printed_peak,
)
from rockframe.ingest.parsing.timing import parse_utc
from rockframe.record import Record

OLDER = "ITACA, older form, in m/s2"

DESCRIPTION = "ESM and ITACA, DYNA 1.2 ASCII in cm/s2"

_KEY: Final = re.compile(r"(?P<key>[A-Z][A-Z0-9_^/]*):(?P<value>.*)")
_MARKS: Final = ("NDATA:", "SAMPLING_INTERVAL_S:", "HEADER_FORMAT:")
#: Largest number of header lines to read; a valid header has 64.
_LONGEST_HEADER: Final = 100
#: Boundary between two numbers without a blank: a sign directly after a digit.
_TOUCHING: Final = re.compile(rb"(?<=\d)(?=[-+])")
_NEEDED: Final = (
    "HEADER_FORMAT",
    "DATA_TYPE",
    "UNITS",
    "SAMPLING_INTERVAL_S",
    "NDATA",
    "PGA_CM/S^2",
    "PROCESSING",
)
_OLDER_LINES: Final = 10
_COLUMNS: Final = Columns(5, 14)
_STEP, _COUNT, _PEAK = "Time Increment (s)", "Number of Data", "PGA (m/s/s)"
#: Line above the samples; the archive misspells it.
_ABOVE: Final = re.compile(r"Acc?ele?a?ration time series in m/s/s\s*$")


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like an ESM or ITACA file of any quantity.

    Examples
    --------
    >>> sniff(b"EVENT_NAME: GREECE\nSAMPLING_INTERVAL_S: 0.005000\nNDATA: 3\n")
    True
    """
    lines = head_lines(head)
    return (
        bool(lines)
        and lines[0].startswith("EVENT_NAME:")
        and any(line.startswith(_MARKS) for line in lines)
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the record of an ESM or ITACA file.

    Raises
    ------
    InputError
        If the file is not DYNA 1.2 acceleration in cm/s2, a key is missing, or NDATA, duration or
        PGA differ from the samples.

    Examples
    --------
    >>> read(Path("a.VEL.ASC"), b"EVENT_NAME: GREECE\nDATA_TYPE: VELOCITY\n", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.OtherQuantityError: a.VEL.ASC:2: DATA_TYPE 'VELOCITY'. Must be ACCELERATION.
    """
    text = plain_text(path, data)
    header = _header(path, text)
    factor = factor_to_si(path, "cm/s2", options, header.lines["UNITS"])
    step = settle_time_step(
        path, header.number("SAMPLING_INTERVAL_S"), options, header.lines["SAMPLING_INTERVAL_S"]
    )
    samples = _samples(header, text)
    _require_count(header, samples.size, step)
    require_even_lines(path, rows_below(text, header.count), header.count + 1)
    line = header.lines["PGA_CM/S^2"]
    peak_ratio = require_printed_peak(
        path,
        header.get("PGA_CM/S^2"),
        samples,
        "cm/s2",
        line,
        # Headers of published files contain negative peaks.
        signed=True,
        time=header.get("TIME_PGA_S"),
        time_step=step,
    )
    component = header.get("STREAM")
    magnitude = header.number("MAGNITUDE_W")
    return [
        Record(
            record_id=record_ids(with_ending(path, [".asc"]), [component])[0],
            acceleration=samples * factor,
            time_step=step,
            uncorrected=_is_uncorrected(header),
            **directed(component, seed_letter(component)),
            site_type=site_of_depth(header.number("SENSOR_DEPTH_M")),
            event=header.get("EVENT_NAME") or header.get("EVENT_ID"),
            station=header.get("STATION_CODE"),
            network=header.get("NETWORK"),
            start_time=_start_time(header.get("DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS")),
            magnitude=header.number("MAGNITUDE_L") if math.isnan(magnitude) else magnitude,
            epicentral_distance=header.number("EPICENTRAL_DISTANCE_KM"),
            vs30=header.number("VS30_M/S"),
            peak_ratio=peak_ratio,
            filter_low=_corner(header, "LOW_CUT_FREQUENCY_HZ"),
            filter_high=_corner(header, "HIGH_CUT_FREQUENCY_HZ"),
        )
    ]


def _header(path: Path, text: bytes) -> KeyedHeader:
    values: dict[str, str] = {}
    lines: dict[str, int] = {}
    count = 0
    for number, row in enumerate(text.split(b"\n", _LONGEST_HEADER)[:_LONGEST_HEADER], 1):
        match = _KEY.match(row.decode("utf-8", "replace"))
        if not match:
            break
        if match["key"] in values:
            raise InputError(path, f"key {match['key']} is stated twice.", number)
        values[match["key"]] = match["value"].strip()
        lines[match["key"]] = count = number
    header = KeyedHeader(path, values, lines, count)
    if values.get("DATA_TYPE", "ACCELERATION").upper() != "ACCELERATION":
        error = header.invalid("DATA_TYPE", "ACCELERATION")
        raise OtherQuantityError(path, error.reason, error.line)
    for key in _NEEDED:
        if key not in values:
            raise InputError(path, f"no {key} in {count} lines of header.")
    for key, value in (("HEADER_FORMAT", "DYNA 1.2"), ("UNITS", "cm/s^2")):
        if values[key] != value:
            raise header.invalid(key, value)
    return header


def _samples(header: KeyedHeader, text: bytes) -> Float:
    """Return the samples [cm/s2]."""
    body = rows_below(text, header.count)
    if _TOUCHING.search(body):
        body = _TOUCHING.sub(b" ", body)
    return parse_numbers(header.path, body, header.count + 1)


def _require_count(header: KeyedHeader, samples: int, step: float) -> None:
    header.require_count("NDATA", samples, "samples")
    duration = header.number("DURATION_S")
    # Durations may be one step shorter, and are rounded to 5 ms.
    if abs(duration - samples * step) > 1.5 * step + 0.005:
        message = (
            f"DURATION_S {duration:g} in the header, {samples} samples at {step:g} s in the file, "
            f"that is {samples * step:g} s."
        )
        settle(header.path, message, {"samples": samples}, header.lines["DURATION_S"])


def _corner(header: KeyedHeader, key: str) -> float:
    corner = header.number(key)
    return corner if corner > 0.0 else math.nan


def _is_uncorrected(header: KeyedHeader) -> bool:
    """Return True if PROCESSING is none, or if it is empty and the baseline was not removed."""
    processing = header.get("PROCESSING").lower()
    if processing:
        return processing.startswith("none")
    return header.get("BASELINE_CORRECTION") != "BASELINE REMOVED"


def _start_time(text: str) -> str:
    """Return the start time (ISO 8601, UTC) with the stated decimals; empty if unstated."""
    day, _, time = text.partition(".")
    fraction = f".{time}" if re.fullmatch(r"\d{1,6}", time, re.ASCII) else ""
    return parse_utc(day, "%Y%m%d_%H%M%S", fraction)


def sniff_older(head: bytes) -> bool:
    r"""Return True if a file begins like an older ITACA file.

    Examples
    --------
    >>> sniff_older(b"Event Date & Time             : 2009-04-06 01:32:39\n")
    True
    """
    return first_line(head).startswith("Event Date & Time")


def read_older(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the component of an older ITACA file.

    Raises
    ------
    InputError
        If a header line is missing, or number or peak of the samples differ from the header.

    Examples
    --------
    >>> read_older(Path("1.cor.acc"), b"Event Date & Time", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: 1.cor.acc:10: '', where 'Accelaration time series in m/...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    words = [line.decode("latin-1") for line in lines[:_OLDER_LINES]]
    above = words[-1] if len(words) == _OLDER_LINES else ""
    if not _ABOVE.match(above):
        message = f"{above.strip()[:60]!r}, where 'Accelaration time series in m/s/s' is expected."
        raise InputError(path, message, line=_OLDER_LINES)
    header = keyed_header(path, words[:-1])
    values = {key: header.required(key) for key in (_STEP, _COUNT, _PEAK)}
    rows = lines[_OLDER_LINES:]
    present = count_columns(rows, _COLUMNS)
    count = require_sample_count(path, values[_COUNT], header.lines[_COUNT], present)
    samples = read_columns(path, rows, _COLUMNS, count, _OLDER_LINES)
    ratio = require_printed_peak(path, values[_PEAK], samples, "m/s2", header.lines[_PEAK])
    step = parse_number(path, values[_STEP], header.lines[_STEP], "time step")
    name = header.get("Orientation")
    # ITACA writes WE for the component that is positive to the east.
    meant = "EW" if name.strip().upper() == "WE" else name
    filtered = re.match(
        r"(\d*\.?\d+)\s*-\s*(\d*\.?\d+)\s*$", header.get("Filter Cut-off Frequency (Hz)")
    )
    low, high = (
        parse_number(path, token, 6, "filter corner") if token else float("nan")
        for token in (filtered.groups() if filtered else ("", ""))
    )
    factor = factor_to_si(path, "m/s2", options, _OLDER_LINES)
    return [
        Record(
            record_id=record_ids(with_ending(path, [".acc", ".cor.acc"]), [name])[0],
            acceleration=samples * factor,
            time_step=settle_time_step(path, step, options, header.lines[_STEP]),
            **directed(name, meant),
            event=header.get("Event Date & Time"),
            station=header.get("Station Code / Name").partition(" / ")[2],
            peak_ratio=ratio,
            filter_low=low,
            filter_high=high,
        )
    ]
