"""Reader of CWA files (Taiwan): a header of `#Key: value`, then time and U, N, E in gal."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, distances, noted, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    head_lines,
    keyed_header,
    plain_text,
    require_sample_count,
)
from rockframe.ingest.parsing.samples import Columns, read_table, require_printed_peak
from rockframe.ingest.parsing.timing import even_time_step, parse_utc
from rockframe.record import Record

DESCRIPTION = "CWA (Taiwan), three columns in gal"

_COMPONENTS: Final = ("U", "N", "E")
_COLUMNS: Final = Columns(4, 10)
_LAST: Final = "#Data"
_UNITS: Final = "#AmplitudeUnit"


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a CWA file.

    Examples
    --------
    >>> sniff(b"#Earthquake Information\r\n#Origin Time(GMT+08): 2018/02/06-23:50:42\r\n")
    True
    """
    lines = head_lines(head)
    return len(lines) > 1 and lines[0].startswith("#Earthquake Information")


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Read the three components of a CWA file.

    Raises
    ------
    InputError
        If a header line is missing, or length, times or extremes differ from the samples.

    Examples
    --------
    >>> read(Path("2-EDH.dat"), b"#Earthquake Information\n", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: 2-EDH.dat: no '#Data' in the header.
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    end = next((i for i, line in enumerate(lines) if not line.startswith(b"#") and line.strip()), 0)
    header = keyed_header(path, [line.decode("latin-1") for line in lines[:end]])
    if header.required(_LAST) != "4F10.3":
        raise header.invalid(_LAST, "4F10.3")
    if header.required("#DataSequence") != "Time U(+); N(+); E(+)":
        raise header.invalid("#DataSequence", "Time U(+); N(+); E(+)")
    if not header.required(_UNITS).lower().startswith("gal"):
        raise header.invalid(_UNITS, "gal")
    factor = factor_to_si(path, "gal", options, header.lines[_UNITS])
    rows = lines[end:]
    table = read_table(path, rows, _COLUMNS, end)
    step = _time_step(header, table[:, 0], rows, end + 1, options)
    return [
        noted(partial(_record, header, table[:, column], factor, step, name, record_id))
        for column, (name, record_id) in enumerate(
            zip(_COMPONENTS, record_ids(path, _COMPONENTS), strict=True), 1
        )
    ]


def _time_step(
    header: KeyedHeader,
    times: Float,
    rows: list[bytes],
    first_line: int,
    options: ReadOptions,
) -> float:
    path = header.path
    length, rate = (
        header.required_number(key) for key in ("#RecordLength(sec)", "#SampleRate(Hz)")
    )
    line = header.lines["#RecordLength(sec)"]
    require_sample_count(path, f"{length * rate:.0f}", line, times.size)
    step = even_time_step(path, times, lambda: [row[:10] for row in rows], first_line)
    message = f"{rate:g} samples a second stated, but {step:g} s between those in the file."
    if not rate > 0.0 or times[0] != 0.0:
        raise InputError(path, message, line=header.lines["#SampleRate(Hz)"])
    if abs(step * rate - 1.0) < 1e-6:
        step = 1.0 / rate
    else:
        steps = {"waveform": step, "header": 1.0 / rate}
        step = settle(path, message, steps, header.lines["#SampleRate(Hz)"])
    return settle_time_step(path, step, options, line)


def _record(
    header: KeyedHeader,
    samples: Float,
    factor: float,
    step: float,
    name: str,
    record_id: str,
) -> Record:
    key = f"#AmplitudeMAX. {name}"
    extremes = header.required(key).split("~")
    if len(extremes) != 2:
        raise header.invalid(key, "two values, as in '1.615~ -1.495'")
    line = header.lines[key]
    ratios = [
        require_printed_peak(header.path, extreme.strip(), part, "gal", line, signed=True)
        for extreme, part in zip(
            extremes, (np.maximum(samples, 0.0), np.minimum(samples, 0.0)), strict=True
        )
    ]
    places = [
        (header.number(f"{key}Latitude(N)"), header.number(f"{key}Longitude(E)"))
        for key in ("#Epicenter", "#Station")
    ]
    return Record(
        record_id=record_id,
        acceleration=factor * samples,
        time_step=step,
        uncorrected=True,
        **directed(name, {"U": "UP"}.get(name, name)),
        event=f"{header.get('#Origin Time(GMT+08)')} GMT+8".strip(),
        station=header.get("#StationCode"),
        start_time=_utc(header.get("#StartTime(GMT+08)")),
        magnitude=header.number("#Magnitude(Ml)"),
        peak_ratio=ratios[0],
        **distances(places[0], places[1], header.number("#Depth(km)")),
    )


def _utc(text: str) -> str:
    """Convert a time of Taiwan to UTC (ISO 8601); empty if it is not a time."""
    match = re.fullmatch(r"(\d+/\d+/\d+-\d+:\d+:\d+)(\.\d{1,6})?", text, re.ASCII)
    form = "%Y/%m/%d-%H:%M:%S"
    return parse_utc(match[1], form, match[2] or "", hours_ahead=8) if match else ""
