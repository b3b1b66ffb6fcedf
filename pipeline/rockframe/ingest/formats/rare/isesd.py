"""Reader of corrected files (`.cor`) of ISESD, the European strong-motion database, in m/s2.

A header of keys and values is followed by references and comments, and then by acceleration,
velocity and displacement, each below a line such as `-> corrected acceleration time histories`.

Source: Ambraseys et al. 2000, CD-ROM collection, "Datafile format",
http://isesd.hi.is/ESD_Local/CdRom/cdrom5.htm. The layout of uncorrected files is not described.
"""

from __future__ import annotations

import math
import re
from datetime import datetime
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.identify import directed, record_ids
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    is_number,
    keyed_header,
    parse_numbers,
    plain_text,
    require_even_lines,
    require_sample_count,
)
from rockframe.ingest.parsing.samples import Printed
from rockframe.record import Record

_SECTION: Final = "-> corrected acceleration"
#: First line that is no key and value.
_REFERENCE: Final = "reference:"
#: Units of acceleration, before those of velocity, displacement and time.
_UNITS: Final = re.compile(r"m/s(?:[*./]s|\^?2|\*\*2)(?![\w/*^.])", re.I)
_LOW: Final = re.compile(
    r"(?:low cut filter|bandpass-?filter) *\( *(?P<low>\d+\.?\d*) *(?:Hz|-)", re.I
)
_HIGH: Final = re.compile(
    r"(?:high cut filter *\(|bandpass-?filter *\( *[\d.]+ *-) *(?P<high>\d+\.?\d*) *Hz", re.I
)
_TIME: Final = re.compile(r"(\d\d?)\. ?(\d\d?)\.(\d{4}) (\d\d):(\d\d):(\d\d(?:\.\d+)?) ?UTC")


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Read the component of a corrected ISESD file.

    Raises
    ------
    InputError
        If the file is a spectrum or uncorrected, a value of the header is missing, or if number or
        length differ from the samples.

    Examples
    --------
    >>> read(Path("a.fas"), b"file: a.fas\nwaveform code: 1\n-> FREQ, FAS\n1 2", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.OtherQuantityError: a.fas:3: is 'FREQ, FAS', not corrected acceleration.
    """
    lines = plain_text(path, data).split(b"\n")
    marks = [number for number, line in enumerate(lines) if line.startswith((b"->", b"STOP"))]
    top = _top(path, lines, marks)
    words = [line.decode("latin-1").strip() for line in lines[:top]]
    size = next((k for k, line in enumerate(words) if line.startswith(_REFERENCE)), top)
    header = keyed_header(path, words[:size])
    factor = factor_to_si(path, _units(header), options, header.lines["units"])
    end = next((number for number in marks if number > top), len(lines))
    body = b"\n".join(lines[top + 1 : end]) + (b"\n" if end < len(lines) else b"")
    samples = parse_numbers(path, body, top + 2)
    line = header.lines.get("number of samples", size)
    require_sample_count(path, header.required("number of samples"), line, samples.size)
    require_even_lines(path, body, top + 2)
    step = _step(header, samples.size, options)
    lows = [float(match["low"]) for match in map(_LOW.search, words[size:]) if match]
    highs = [float(match["high"]) for match in map(_HIGH.search, words[size:]) if match]
    return [
        Record(
            record_id=record_ids(path, [""])[0],
            acceleration=samples * factor,
            time_step=step,
            **directed(header.required("orientation of transducer")),
            event=f"ISESD {header.required('earthquake code')}",
            station=header.required("station code"),
            start_time=_start_time(header.get("time of first sample")),
            filter_low=max(lows, default=math.nan),
            filter_high=min(highs, default=math.nan),
        )
    ]


def _top(path: Path, lines: list[bytes], marks: list[int]) -> int:
    """Return the index of the line above the accelerations, of the first section of a file."""
    if not marks:
        raise InputError(path, f"no line that begins with {_SECTION!r}.")
    first = lines[marks[0]].decode("latin-1").strip()
    if not first.lower().startswith(_SECTION):
        quantity = first.removeprefix("->").strip()
        if "acceleration" in quantity.lower():
            message = f"{quantity!r}: the archive describes files of corrected acceleration only."
            raise InputError(path, f"{message} Save the samples as a table.", marks[0] + 1)
        message = f"is {quantity!r}, not corrected acceleration."
        raise OtherQuantityError(path, message, marks[0] + 1)
    return marks[0]


def _units(header: KeyedHeader) -> str:
    if not _UNITS.match(header.required("units")):
        raise header.invalid("units", "m/s*s for acceleration, or m/s2")
    return "m/s2"


def _step(header: KeyedHeader, count: int, options: ReadOptions) -> float:
    """Return the time step [s], which record length and number of samples confirm."""
    path, line = header.path, header.lines.get("sampling period", 1)
    header.required("sampling period")
    step, length = _seconds(header, "sampling period"), header.get("record length")
    if not step > 0.0:
        raise header.invalid("sampling period", "positive")
    if length:
        where, length = header.lines["record length"], length.removesuffix("s").rstrip()
        seconds = _seconds(header, "record length")
        if abs((count - 1) * step - seconds) > 1.5 * step + Printed.of(length).unit:
            message = f"{seconds:g} s stated, but {count} samples at {step:g} s."
            settle(path, message, {"samples": count}, where)
    return settle_time_step(path, step, options, line)


def _seconds(header: KeyedHeader, key: str) -> float:
    number = header.get(key).removesuffix("s").rstrip()
    if not is_number(number):
        raise header.invalid(key, "a number of seconds, as in 0.01s")
    return float(number)


def _start_time(text: str) -> str:
    """Return the time of the first sample; "" if a part of it is unknown, as in 16:57:-9.999."""
    match = _TIME.fullmatch(text)
    if not match:
        return ""
    day, month, year, hour, minute, second = match.groups()
    stamp = f"{year}-{int(month):02}-{int(day):02}T{hour}:{minute}:{float(second):06.3f}"
    try:
        datetime.fromisoformat(stamp)
    except ValueError:
        return ""
    return f"{stamp}Z"
