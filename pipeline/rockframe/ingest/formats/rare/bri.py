"""Reader of BRI files (`.ac`, Japan): all channels of an instrument, in cm/s2.

The first line states time, number of channels, rate, number of samples and station. Each channel
has a line of its label, peak, step of the peak, and the offset and coefficient that the samples
already contain, and then 8 samples of 10 characters in a line.

Source: Building Research Institute, strong motion data file, https://smo.kenken.go.jp/docs/acfile.
The page states no units; its sample, of Kushiro on 15 January 1993, has the peak of 711 cm/s2 that
was published of this record.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.identify import directed, distinct_records
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.lines import decoded, parse_number, plain_text
from rockframe.ingest.parsing.samples import Columns, read_columns, require_printed_peak
from rockframe.record import Record

_COLUMNS: Final = Columns(8, 10)
_TOP: Final = re.compile(
    r"(?P<date>\d{4}/\d\d/\d\d) (?P<time>\d\d[:/]\d\d[:/]\d\d) (?P<channels>  \d| \d\d|\d{3}) "
    r"(?P<rate>  \d| \d\d|\d{3}) (?P<count> {4}\d| {3}\d{2}|  \d{3}| \d{4}|\d{5})"
    r" +(?P<station>.*\S)\s*$"
)
_CHANNEL: Final = re.compile(
    r"(?P<label>\S.{9})(?P<peak>.{10})(?P<step>.{10})"
    r"(?P<offset>.{10})(?P<coefficient>.{1,10}) *$"
)
_EXAMPLE_TOP: Final = "1993/01/15 20:06:08   3 100 15700 KSR: Kushiro"
_EXAMPLE: Final = "063-GL      -711.403      3675     0.013   3.00e-2"


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read all channels of a BRI file.

    Times are local, of an unstated zone: `start_time` is empty, and `event` has the printed time.

    Raises
    ------
    InputError
        If a line is missing or has another form, or if number or peak differ from the samples.

    Examples
    --------
    >>> read(Path("a.ac"), b"1993/01/15 20:06:08   3 100     9 KSR: Kushiro", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: a.ac:1: 3 channels of 9 samples stated, which need 10 lines: 1 ...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    top = _matched(path, _TOP, lines, 0, _EXAMPLE_TOP)
    channels, rate, count = (int(top[key]) for key in ("channels", "rate", "count"))
    if channels < 1 or rate < 1 or count < 2:
        message = f"{channels} channels of {count} samples at {rate} Hz."
        raise InputError(path, f"{message} Must be at least 1, 2 and 1.", 1)
    size = 1 - (-count // _COLUMNS.count)  # lines of a channel
    if len(lines) != 1 + channels * size:
        message = f"{channels} channels of {count} samples stated, which need"
        raise InputError(
            path, f"{message} {1 + channels * size} lines: {len(lines)} in the file.", 1
        )
    tops = [1 + size * number for number in range(channels)]
    headers = [_matched(path, _CHANNEL, lines, line, _EXAMPLE) for line in tops]
    labels = [header["label"].strip() for header in headers]
    blocks = zip(tops, [lines[line + 1 : line + size] for line in tops], headers, strict=True)
    return distinct_records(path, labels, blocks, partial(_record, path, top, options))


def _record(
    path: Path,
    top: re.Match[str],
    options: ReadOptions,
    record_id: str,
    line: int,
    rows: list[bytes],
    header: re.Match[str],
) -> Record:
    factor = factor_to_si(path, "cm/s2", options, 1)
    samples = read_columns(path, rows, _COLUMNS, int(top["count"]), line + 1)
    step = settle_time_step(path, 1.0 / int(top["rate"]), options, 1)
    # Steps are counted from 1.
    late = (parse_number(path, header["step"], line + 1, "step of the peak") - 1.0) * step
    ratio = require_printed_peak(
        path, header["peak"].strip(), samples, "cm/s2", line + 1,
        signed=True, time=f"{late:.6f}", time_step=step,
    )  # fmt: skip
    label = header["label"].strip()
    azimuth, _, location = label.partition("-")
    station = top["station"].partition(":")[0].strip()
    return Record(
        record_id=record_id,
        acceleration=samples * factor,
        time_step=step,
        uncorrected=True,
        **directed(label, azimuth),
        event=f"{top['date']} {top['time'].replace('/', ':')} local time",
        station=f"{station} {location}".strip(),
        peak_ratio=ratio,
    )


def _matched(
    path: Path, pattern: re.Pattern[str], lines: list[bytes], line: int, example: str
) -> re.Match[str]:
    """Return the match of a whole line, counted from 0; a line of another form is an error."""
    text = decoded(lines[line])
    match = pattern.match(text)
    if not match:
        message = f"{text.strip()[:60]!r}, where a line such as {example!r} is expected."
        raise InputError(path, message, line + 1)
    return match
