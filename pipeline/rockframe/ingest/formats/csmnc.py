"""Reader of CSMNC files (China): 16 lines of header, then one component in cm/s2."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from rockframe.errors import settle
from rockframe.ingest.identify import directed, distances, place_in, record_ids, site_of_location
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import (
    head_lines,
    numbers_in,
    parse_number,
    parse_numbers,
    plain_text,
    require_even_lines,
    require_sample_count,
    required_lines,
    rows_below,
)
from rockframe.ingest.parsing.samples import Printed, require_printed_peak
from rockframe.record import Record

DESCRIPTION = "CSMNC (China), one component in cm/s2"

_HEADER_LINES: Final = 16
_NUMBER: Final = r"(-?\d*\.?\d+)"
#: Indices of the header lines that are needed, their patterns, and examples.
_LINES: Final = (
    (9, re.compile(r"COMP\.\s*(?P<component>\S+)\s*$"), "COMP. EW"),
    (
        10,
        re.compile(r"(?P<un>UN|)CORRECTED ACCELERATION\s+UNIT:\s*CM/SEC/SEC"),
        "UNCORRECTED ACCELERATION UNIT: CM/SEC/SEC",
    ),
    (
        11,
        re.compile(
            r"NO\. OF POINTS:\s*(?P<count>\d+)\s+EQUALLY SPACED INTERVALS OF:\s*"
            rf"(?P<step>{_NUMBER})\s+SEC"
        ),
        "NO. OF POINTS: 12800 EQUALLY SPACED INTERVALS OF: 0.005 SEC",
    ),
    (
        12,
        re.compile(
            rf"PEAK VALUE:\s*(?P<peak>{_NUMBER})\s+AT\s+(?P<time>{_NUMBER})\s+SEC\s+"
            rf"DURATION:\s*(?P<length>{_NUMBER})\s+SEC"
        ),
        "PEAK VALUE: -16.986 AT 27.06 SEC DURATION: 64 SEC",
    ),
)
_QUANTITY: Final = re.compile(r"(UN)?CORRECTED ACCELERATION\s+UNIT:", re.M)


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a CSMNC file.

    Examples
    --------
    >>> sniff(b"065\n" + b"\n" * 9 + b"UNCORRECTED ACCELERATION          UNIT: CM/SEC/SEC\n")
    True
    """
    return any(map(_QUANTITY.match, head_lines(head)[8:13]))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the component of a CSMNC file.

    Raises
    ------
    InputError
        If a header line is missing, or if number, length or peak differ from the samples.

    Examples
    --------
    >>> read(Path("ua0001.dat"), b"065JZC120103153901", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: ua0001.dat:10: '', where a line such as 'COMP. EW' is ...
    """
    text = plain_text(path, data)
    lines = [line.decode("latin-1") for line in text.split(b"\n", _HEADER_LINES)[:_HEADER_LINES]]
    keys = required_lines(path, lines, _LINES)
    factor = factor_to_si(path, "cm/s2", options, 11)
    samples = parse_numbers(path, rows_below(text, _HEADER_LINES), _HEADER_LINES + 1)
    require_sample_count(path, keys["count"], 12, samples.size)
    require_even_lines(path, rows_below(text, _HEADER_LINES), _HEADER_LINES + 1)
    step = settle_time_step(path, parse_number(path, keys["step"], 12, "interval"), options, 12)
    length = parse_number(path, keys["length"], 13, "duration")
    if abs(samples.size * step - length) > 1.5 * step + 0.5 * Printed.of(keys["length"]).unit:
        message = f"{length:g} s stated, but {samples.size} samples at {step:g} s."
        settle(path, message, {"samples": samples.size}, 13)
    ratio = require_printed_peak(
        path, keys["peak"], samples, "cm/s2", 13,
        signed=True, time=keys["time"], time_step=step,
    )  # fmt: skip
    header = "\n".join(lines[:9])
    return [
        Record(
            record_id=record_ids(path, [keys["component"]])[0],
            acceleration=samples * factor,
            time_step=step,
            uncorrected=keys["un"] == "UN",
            **directed(keys["component"]),
            site_type=site_of_location(_text(header, r"OBSERVING POINT:\s*(.*)")),
            event=lines[2].strip(),
            station=_text(header, r"STATION:\s*(\w+)"),
            magnitude=numbers_in(r"MAGNITUDE\s+(\d+\.?\d*)", header)[0],
            peak_ratio=ratio,
            **distances(
                place_in(_text(header, r"EPICENTER\s+(.*?)\s+DEPTH")),
                place_in(_text(header, r"STATION:\s*\w+\s+(.*)")),
                numbers_in(r"DEPTH\s+(\d+\.?\d*)\s*KM", header)[0],
            ),
        )
    ]


def _text(header: str, pattern: str) -> str:
    match = re.search(pattern, header)
    return match[1].strip() if match else ""
