"""Reader of the older form of ITACA files (`.cor.acc`): ten lines of header, samples in m/s2."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.metadata.identify import directed, record_ids, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing.columns import Columns, read_columns
from rockframe.ingest.parsing.headers import count_of, keyed_header, number_of
from rockframe.ingest.parsing.lines import head_lines, text_of
from rockframe.ingest.parsing.peaks import require_printed_peak
from rockframe.record import Record

_HEADER_LINES: Final = 10
_COLUMNS: Final = Columns(5, 14)
_STEP, _COUNT, _PEAK = "Time Increment (s)", "Number of Data", "PGA (m/s/s)"
#: Line above the samples; the archive misspells it.
_ABOVE: Final = re.compile(r"Acc?ele?a?ration time series in m/s/s\s*$")


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like an older ITACA file.

    Examples
    --------
    >>> sniff(b"Event Date & Time             : 2009-04-06 01:32:39\n")
    True
    """
    lines = head_lines(head)
    return bool(lines) and lines[0].startswith("Event Date & Time")


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the component of an older ITACA file.

    Raises
    ------
    InputError
        If a header line is missing, or number or peak of the samples differ from the header.

    Examples
    --------
    >>> read(Path("1.cor.acc"), b"Event Date & Time", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: 1.cor.acc:10: ''. Must be 'Accelaration time series in m/s/s'.
    """
    lines = text_of(path, data).rstrip().split(b"\n")
    words = [line.decode("latin-1") for line in lines[:_HEADER_LINES]]
    above = words[-1] if len(words) == _HEADER_LINES else ""
    if not _ABOVE.match(above):
        message = f"{above.strip()[:60]!r}. Must be 'Accelaration time series in m/s/s'."
        raise InputError(path, message, line=_HEADER_LINES)
    header = keyed_header(path, words[:-1])
    stated = {key: header.required(key) for key in (_STEP, _COUNT, _PEAK)}
    rows = lines[_HEADER_LINES:]
    found = sum(-(-len(row.rstrip()) // _COLUMNS.width) for row in rows)
    count = count_of(path, stated[_COUNT], header.lines[_COUNT], found)
    samples = read_columns(path, rows, _COLUMNS, count, _HEADER_LINES)
    ratio = require_printed_peak(path, stated[_PEAK], samples, "m/s2", header.lines[_PEAK])
    step = number_of(path, stated[_STEP], header.lines[_STEP], "time step")
    name = header.get("Orientation")
    filtered = re.match(
        r"(\d*\.?\d+)\s*-\s*(\d*\.?\d+)\s*$", header.get("Filter Cut-off Frequency (Hz)")
    )
    low, high = (
        number_of(path, token, 6, "filter corner") if token else float("nan")
        for token in (filtered.groups() if filtered else ("", ""))
    )
    factor = factor_to_si(path, "m/s2", options, _HEADER_LINES)
    return [
        Record(
            record_id=record_ids(with_ending(path, [".acc", ".cor.acc"]), [name])[0],
            acceleration=samples * factor,
            time_step=settle_time_step(path, step, options, header.lines[_STEP]),
            **directed(name),
            event=header.get("Event Date & Time"),
            station=header.get("Station Code / Name").partition(" / ")[2],
            peak_ratio=ratio,
            filter_low=low,
            filter_high=high,
        )
    ]
