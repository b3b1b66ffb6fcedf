"""Reader of BHRC files (Iran, VOL1DS): three components in g/10, at even times.

A component has 27 lines of header, samples (10 columns of 13 characters), and a line `/&`. The
header states number and length, its real numbers state the rate; no peak is stated.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, distances, distinct_records, place_in
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import (
    first_line,
    numbers_in,
    parse_number,
    plain_text,
    require_sample_count,
    required_lines,
)
from rockframe.ingest.parsing.samples import Columns, count_columns, read_columns
from rockframe.record import Record

DESCRIPTION = "BHRC (Iran), VOL1DS, three components in g/10"

_HEADER_LINES: Final = 27
_COLUMNS: Final = Columns(10, 13)
_TOP: Final = re.compile(r"\* VOL1DS FILE:")
#: Indices of the header lines that are needed, their patterns, and examples.
_LINES: Final = (
    (0, _TOP, "* VOL1DS FILE:  5520/01"),
    (6, re.compile(r"COMP\s+(?P<component>[LVT])(?P<number>\d)\s*$"), "COMP L1"),
    (
        10,
        re.compile(r"NO\. OF POINTS\s*=\s*(?P<count>\d+)\s+DURATION\s*=\s*(?P<length>[\d.]+)\s*$"),
        "NO. OF POINTS =  15616      DURATION =  78.080",
    ),
    (11, re.compile(r"UNITS ARE SECONDS AND G/10\s*$"), "UNITS ARE SECONDS AND G/10"),
    (21, re.compile(r" *(?P<rate>\.\d{6}E[-+]\d\d)"), "  .200000E+03"),
)
_STATION: Final = re.compile(r"(?P<name>.*?)\s+Station\b.*?Azimuth L\s*(?P<L>\d+)\s+T\s*(?P<T>\d+)")
_DEPTH: Final = re.compile(r".*\bFD\s*(\d+)")
_MAGNITUDE: Final = re.compile(r"\bM[wsbL]?\s*(\d+\.\d+)")


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a BHRC file.

    Examples
    --------
    >>> sniff(b"* VOL1DS FILE:  5520/01\r\nInst Type = SSA-2\r\n")
    True
    """
    return bool(_TOP.match(first_line(head)))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the three components of a BHRC file.

    Raises
    ------
    InputError
        If a component or a header line is missing, or if number, length and rate disagree.

    Examples
    --------
    >>> read(Path("5520-1.V1"), b"* VOL1DS FILE:  5520/01", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: 5520-1.V1: 0 ends of data (/&). Must be 3: one per component.
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    ends = [number for number, line in enumerate(lines) if line.startswith(b"/&")]
    if len(ends) != 3 or ends[-1] != len(lines) - 1:
        raise InputError(path, f"{len(ends)} ends of data (/&). Must be 3: one per component.")
    tops = [0, *(end + 1 for end in ends[:-1])]
    words = [line.decode("latin-1") for line in lines]
    headers = [required_lines(path, words[top:], _LINES, top + 1) for top in tops]
    names = [header["component"] for header in headers]
    if names != ["L", "V", "T"] or [header["number"] for header in headers] != ["1", "2", "3"]:
        raise InputError(path, f"components {', '.join(names)}. Must be L1, V2, T3.")
    blocks = zip(tops, ends, headers, strict=True)
    return distinct_records(path, names, blocks, partial(_record, path, lines, options))


def _record(
    path: Path,
    lines: list[bytes],
    options: ReadOptions,
    record_id: str,
    top: int,
    end: int,
    header: dict[str, str],
) -> Record:
    line = top + 11
    factor = factor_to_si(path, "g", options, line + 1)
    rows = lines[top + _HEADER_LINES : end]
    count = require_sample_count(path, header["count"], line, count_columns(rows, _COLUMNS))
    tenths = read_columns(path, rows, _COLUMNS, count, top + _HEADER_LINES)
    rate = parse_number(path, header["rate"], top + 22, "rate")
    length = parse_number(path, header["length"], line, "duration")
    if not rate > 0.0 or abs(length * rate - count) > 1.0:
        message = f"{length:g} s at {rate:g} samples a second stated, but {count} samples."
        if not rate > 0.0:
            raise InputError(path, message, line=line)
        settle(path, message, {"samples": count}, line)
    about, quake = (lines[top + k].decode("latin-1") for k in (7, 8))
    place, name = _STATION.match(about), header["component"]
    (depth,), (size,) = numbers_in(_DEPTH, quake), numbers_in(_MAGNITUDE, quake)
    return Record(
        record_id=record_id,
        acceleration=tenths * 0.1 * factor,
        time_step=settle_time_step(path, 1.0 / rate, options, top + 22),
        uncorrected=True,
        **directed(name, place[name] if place and name != "V" else name),
        event=lines[top + 2].decode("latin-1").partition(":")[2].strip(),
        station=place["name"].strip() if place else "",
        magnitude=size,
        **distances(place_in(quake), place_in(about), depth),
    )
