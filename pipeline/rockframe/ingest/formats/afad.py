"""Reader of AFAD files (Turkish network, NSMN): a header and columns N-S, E-W, U-D in gal."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.identify import directed, noted, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    first_line,
    keyed_header,
    numbers_in,
    parse_numbers,
    plain_text,
    rows_below,
)
from rockframe.ingest.parsing.samples import require_printed_peak
from rockframe.ingest.parsing.timing import parse_utc
from rockframe.record import Record

DESCRIPTION = "AFAD (Turkish network), raw, three columns in gal"

_TOP: Final = re.compile(r"STRONG GROUND MOTION RECORDS OF T.{1,2}RK", re.I)
_COMPONENTS: Final = ("N-S", "E-W", "U-D")
_LONGEST_HEADER: Final = 30
_PEAKS: Final = re.compile(r"\((?P<component>[NEU]-[SWD])\)\s*(?P<peak>[^\s()]+)")
_COUNT: Final = "NUMBER OF DATA"
_STEP: Final = "SAMPLING INTERVAL (sec)"
_PEAK: Final = "RAW PGA VALUES (gal)"
_MAGNITUDE: Final = re.compile(r"^\s*(?P<size>\d+(?:\.\d+)?)\b")


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a three-column AFAD file.

    Examples
    --------
    >>> sniff(b"STRONG GROUND MOTION RECORDS OF TURKIYE\r\nPLACE : AYDIN\r\n")
    True
    """
    return bool(_TOP.match(first_line(head).strip()))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Read the three components of an AFAD file.

    Raises
    ------
    InputError
        If a header line is missing, the number of samples or a peak differs from the header, or a
        row does not hold three numbers.

    Examples
    --------
    >>> read(Path("0921.txt"), b"STRONG GROUND MOTION RECORDS OF TURKIYE\n", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: 0921.txt: no line 'N-S E-W U-D' above the samples in the ...
    """
    text = plain_text(path, data)
    header = _header(path, text)
    factor = factor_to_si(path, "gal", options, header.lines.get(_PEAK))
    table = _table(header, text)
    step = header.required_number(_STEP)
    time_step = settle_time_step(path, step, options, header.lines[_STEP])

    def record(column: int, record_id: str) -> Record:
        return Record(
            record_id=record_id,
            acceleration=table[:, column] * factor,
            time_step=time_step,
            uncorrected=True,
            **directed(_COMPONENTS[column]),
            event=header.get("EARTHQUAKE DATE"),
            station=header.get("STATION ID"),
            start_time=_start_time(header.get("RECORD TIME")),
            magnitude=numbers_in(_MAGNITUDE, header.get("EARTHQUAKE MAGNITUDE"))[0],
            peak_ratio=_peak_ratio(header, table[:, column], _COMPONENTS[column]),
        )

    ids = record_ids(path, _COMPONENTS)
    return [noted(partial(record, column, record_id)) for column, record_id in enumerate(ids)]


def _header(path: Path, text: bytes) -> KeyedHeader:
    rows = text.split(b"\n", _LONGEST_HEADER)[:_LONGEST_HEADER]
    lines = [row.decode("latin-1") for row in rows]
    for number, line in enumerate(lines):
        if line.split() == list(_COMPONENTS):
            return keyed_header(path, lines[: number + 1])
    message = f"no line 'N-S E-W U-D' above the samples in the first {_LONGEST_HEADER} lines."
    raise InputError(path, message)


def _table(header: KeyedHeader, text: bytes) -> Float:
    """Return the samples [gal], shape (samples, 3)."""
    body = rows_below(text, header.count).rstrip()
    values = parse_numbers(header.path, body, header.count + 1)
    # A missing and an extra number together would shift all numbers between them by a column.
    lines = body.split(b"\n") if body else []
    for line, row in enumerate(lines, header.count + 1):
        tokens = row.split()
        if len(tokens) != len(_COMPONENTS):
            raise InputError(header.path, f"{len(tokens)} columns. Must be 3.", line=line)
        if (here := _places(tokens)) != (must := _places(lines[0].split())):
            message = f"{here} decimals. Must be {must}, as in the first row."
            raise InputError(header.path, message, line=line)
    rows = values.size // len(_COMPONENTS)
    header.required(_COUNT)
    header.require_count(_COUNT, rows, "rows")
    return values.reshape(rows, len(_COMPONENTS))


def _places(tokens: list[bytes]) -> list[int]:
    """Return the number of decimals of each token."""
    return [len(token.partition(b".")[2]) for token in tokens]


def _peak_ratio(header: KeyedHeader, samples: Float, component: str) -> float:
    """Return the ratio of actual to stated peak; raise an error if they differ."""
    peaks = {match["component"]: match["peak"] for match in _PEAKS.finditer(header.required(_PEAK))}
    if component not in peaks:
        raise header.invalid(_PEAK, f"three values, one for ({component})")
    units, line = f"gal {component}", header.lines[_PEAK]
    return require_printed_peak(header.path, peaks[component], samples, units, line)


def _start_time(text: str) -> str:
    """Return the start time (ISO 8601, UTC), or an empty string unless it is stated in GMT."""
    match = re.fullmatch(r"([^(]*)\.(\d{1,6}) \(GMT\)", text)
    return parse_utc(match[1], "%d/%m/%Y %H:%M:%S", f".{match[2]:0<6}") if match else ""
