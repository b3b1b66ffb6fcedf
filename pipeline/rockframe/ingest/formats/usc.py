"""Reader of corrected USC and Caltech files: volume 2 of Caltech, and USC's blocks in cm/s2.

Volume 2 has 23 lines of text, 7 of integers, 15 of reals, a heading, and 8 columns of 10
characters. Its header may print the peak with the opposite sign. USC's own files have three blocks
(acceleration, velocity, displacement) of 7 lines of text and 10 columns of 8 characters.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, record_ids, site_of_station
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import (
    head_lines,
    numbers_in,
    parse_number,
    plain_text,
    require_sample_count,
    required_line,
)
from rockframe.ingest.parsing.samples import (
    Columns,
    count_columns,
    read_columns,
    require_printed_peak,
)
from rockframe.record import Record

DESCRIPTION = "USC and Caltech, corrected (volume 2, and USC's blocks), in cm/s2"

_VOLUME_2: Final = re.compile(r"CORRECTED ACCELEROGRAM\s+II\w+.*?\bCOMP\s+(?P<name>\S+)")
_SECOND: Final = re.compile(r"FILE\s+\d+ OF UNCORRECTED ACCELEROGRAM DATA")
_HEADING: Final = re.compile(
    r"\s*(?P<count>\d+) POINTS OF ACC DATA EQUALLY SPACED AT\s+(?P<step>\d*\.?\d+)\s*SEC"
)
_PEAK: Final = re.compile(
    r"PEAK ACCELERATION =\s*-?(?P<peak>\d*\.?\d+)\s+CMS/SEC/SEC AT\s+(?P<time>\d*\.?\d+)\s*SEC"
)
_FACTS: Final = re.compile(
    r"^MAGNITUDE =\s*(?P<size>\d*\.?\d+)\s+EPICENTRAL DISTANCE =\s*(?P<km>\d*\.?\d+) KM"
)
_BAND: Final = re.compile(
    r".*BAND-PASS FILTERED BETWEEN\s+\d*\.?\d+-\s*(?P<low>\d*\.?\d+) AND\s+(?P<high>\d*\.?\d+)-"
)
_HEADING_LINE: Final = 45
#: Quantities of the blocks of a USC file, and the lines of the header of each.
_BLOCKS: Final = {"AC": Columns(10, 8), "VL": Columns(10, 8), "DP": Columns(10, 8)}
_BLOCK_HEADER: Final = 7
_RATE: Final = re.compile(
    r"\s*SAMPLES/SEC=\s*(?P<rate>\d+) FILTER TYPE=\S*\s+CORNER=\s*(?P<low>\d*\.?\d+).*"
    r"DATA TYPE=(?P<quantity>\w\w)\s*$"
)
_POINTS: Final = re.compile(r"\s*NO OF POINTS=\s*(?P<count>\d+), UNITS=CM/SEC\*\*2,")


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a corrected USC or Caltech file.

    Examples
    --------
    >>> second = b"FILE 1 OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:"
    >>> sniff(b"CORRECTED ACCELEROGRAM  IIBA338  87.420.0 COMP  UP\n" + second)
    True
    """
    lines = head_lines(head)
    volume = len(lines) > 1 and _VOLUME_2.match(lines[0]) and _SECOND.match(lines[1])
    return bool(volume or (len(lines) > 5 and _RATE.match(lines[5])))


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the acceleration of a corrected USC or Caltech file.

    Raises
    ------
    InputError
        If a header line is missing, or number, interval or peak disagree with the samples.

    Examples
    --------
    >>> read(Path("a.s0b"), b"CORRECTED ACCELEROGRAM", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.s0b:1: 'CORRECTED ACCELEROGRAM', where a line such as 'COR...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    words = [line.decode("latin-1") for line in lines]
    if len(words) > 5 and _RATE.match(words[5]):
        return [_usc(path, lines, words, options)]
    return [_caltech(path, lines, words, options)]


def _caltech(path: Path, lines: list[bytes], words: list[str], options: ReadOptions) -> Record:
    name = required_line(path, words, 0, _VOLUME_2, "CORRECTED ACCELEROGRAM IIBA338 ... COMP UP")[
        "name"
    ]
    peak = required_line(path, words, 17, _PEAK, "PEAK ACCELERATION = -9.492 CMS/SEC/SEC")
    heading = required_line(path, words, _HEADING_LINE, _HEADING, "574 POINTS OF ACC DATA")
    line = _HEADING_LINE + 1
    columns = Columns(8, 10)
    rows = lines[line:]
    count = require_sample_count(path, heading["count"], line, count_columns(rows, columns))
    above = re.match(r"\s*(\d+)\s+INSTRUMENT AND BASELINE", words[15])
    require_sample_count(path, above[1] if above else "", 16, count)
    samples = read_columns(path, rows, columns, count, line)
    step = parse_number(path, heading["step"], line, "interval")
    spaced = re.match(r"AT EQUALLY-SPACED INTERVALS OF\s+([\d.]+)", words[16])
    other = parse_number(path, spaced[1] if spaced else "", 17, "interval")
    if other != step:
        message = f"interval {step:g} s, but {other:g} s in line 17."
        step = settle(path, message, {"waveform": step, "header": other}, line)
    ratio = require_printed_peak(
        path, peak["peak"], samples, "cm/s2", 18, time=peak["time"], time_step=step
    )
    magnitude, distance = numbers_in(_FACTS, words[22])
    low, high = numbers_in(_BAND, words[14])
    factor = factor_to_si(path, "cm/s2", options, line)
    station = re.match(r"STATION USC#\s*(\w+)", words[5])
    return Record(
        record_id=record_ids(path, [name])[0],
        acceleration=samples * factor,
        time_step=settle_time_step(path, step, options, line),
        **directed(name),
        event=re.split(r"\s{2,}", words[2].strip())[0],
        station=station[1] if station else "",
        magnitude=magnitude,
        epicentral_distance=distance,
        peak_ratio=ratio,
        filter_low=low,
        filter_high=high,
    )


def _end_of_block(words: list[str], start: int) -> int:
    """Return the index of the line after a block: the next one begins with the same text."""
    following = range(start, len(words))
    return next((k for k in following if words[k : k + 5] == words[:5]), len(words))


def _usc(path: Path, lines: list[bytes], words: list[str], options: ReadOptions) -> Record:
    top = 0
    blocks = []
    for quantity, columns in _BLOCKS.items():
        rate = required_line(path, words, top + 5, _RATE, f"SAMPLES/SEC=200 ... TYPE={quantity}")
        points = required_line(path, words, top + 6, _POINTS, "NO OF POINTS= 5983, UNITS=CM/...")
        if rate["quantity"] != quantity or words[top : top + 5] != words[:5]:
            raise InputError(path, f"block of {rate['quantity']}. Must be {quantity}.", top + 6)
        start = top + _BLOCK_HEADER
        end = _end_of_block(words, start)
        rows = [row for row in lines[start:end] if row.strip()]
        present = count_columns(rows, columns)
        size = require_sample_count(path, points["count"], top + 7, present)
        blocks.append((rate, read_columns(path, rows, columns, size, start)))
        top = end
    if top < len(lines):
        raise InputError(path, "text after the three blocks.", line=top + 1)
    if len({rate["rate"] for rate, _ in blocks}) != 1:
        raise InputError(path, "blocks of different rates.")
    if len({samples.size for _, samples in blocks}) != 1:
        sizes = ", ".join(str(samples.size) for _, samples in blocks)
        settle(path, f"blocks of {sizes} samples.", {"samples": None}, 7)
    rate, samples = blocks[0]
    named = re.match(r"\s*(\d{1,3}|UP|DOWN)(?: DEGREES)?\s*$", words[1])
    name = named[1] if named else ""
    hertz = parse_number(path, rate["rate"], 6, "samples a second")
    factor = factor_to_si(path, "cm/s2", options, 7)
    return Record(
        record_id=record_ids(path, [name])[0],
        acceleration=samples * factor,
        time_step=settle_time_step(path, 1.0 / hertz if hertz else 0.0, options, 6),
        **directed(name),
        site_type=site_of_station(words[0]),
        event=words[2].strip(),
        station=words[0].strip(),
        filter_low=float(rate["low"]) or math.nan,
    )
