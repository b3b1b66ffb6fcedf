"""Reader of K-NET and KiK-net ASCII files: counts with a scale factor, one component per file.

The reader of obspy silently accepts truncated files and NaN. Therefore the header is compared with
the samples before obspy reads them, and the stated peak with the result. The offset is not removed.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, distances, record_ids, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    first_line,
    is_number,
    parse_numbers,
    plain_text,
)
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.ingest.parsing.samples import require_printed_peak
from rockframe.record import Record, SiteType
from rockframe.units import acceleration_factor

DESCRIPTION = "K-NET and KiK-net ASCII, uncorrected, one component, offset left"

#: Keys of the header lines, in order.
_KEYS: Final = (
    "Origin Time",
    "Lat.",
    "Long.",
    "Depth. (km)",
    "Mag.",
    "Station Code",
    "Station Lat.",
    "Station Long.",
    "Station Height(m)",
    "Record Time",
    "Sampling Freq(Hz)",
    "Duration Time(s)",
    "Dir.",
    "Scale Factor",
    "Max. Acc. (gal)",
    "Last Correction",
    "Memo.",
)
_LINES: Final = {key: line for line, key in enumerate(_KEYS, 1)}
#: Names of the six KiK-net directions: 1 to 3 in the borehole, 4 to 6 on the surface.
_KIK_NET: Final = {"1": "NS1", "2": "EW1", "3": "UD1", "4": "NS2", "5": "EW2", "6": "UD2"}
_PLACES: Final = {"1": " (borehole)", "2": " (surface)"}
_SCALE: Final = re.compile(r"(?P<gal>[\d.]+)\(gal\)/(?P<counts>[\d.]+)")
_RATE: Final = re.compile(r"(?P<rate>\d{1,5})\s*Hz", re.I)
#: Characters per sample, including the blank between two.
_WIDTH: Final = 9


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a K-NET or KiK-net file.

    Examples
    --------
    >>> sniff(b"Origin Time       2008/06/14 08:43:00\nLat.              39.028\n")
    True
    """
    return first_line(head).startswith(_KEYS[0])


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the record of a K-NET or KiK-net file; its offset is not removed.

    Raises
    ------
    InputError
        If a header line is missing or invalid, the number of samples contradicts duration and rate,
        a sample is not a number, or the peak without the mean differs from the stated one.

    Examples
    --------
    >>> read(Path("AOM017.EW"), b"Origin Time       2008/06/14 08:43:00", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: AOM017.EW:2: '', where 'Lat.' and its value are expected: line 2...
    """
    text = plain_text(path, data)
    header = _header(path, text)
    rate = int(_matched(header, "Sampling Freq(Hz)", _RATE, "100Hz")["rate"])
    gal = factor_to_si(path, "gal", options, header.lines["Scale Factor"])
    factor = gal * _scale(header)
    magnitude, component = header.number("Mag."), _component(header)
    body = text.split(b"\n", len(_KEYS))[-1]
    counts = parse_numbers(path, body, len(_KEYS) + 1)
    _require_columns(path, body)
    _require_count(header, counts.size, rate)
    trace = read_stream(path, text, "KNET")[0]
    acceleration = _same(path, np.asarray(trace.data, dtype=np.float64) * factor, counts * factor)
    peak_ratio = _peak_ratio(header, acceleration)
    station = header.values["Station Code"]
    return [
        Record(
            record_id=record_ids(with_ending(path, [".knet", ".txt"]), [component])[0],
            acceleration=acceleration,
            time_step=settle_time_step(path, 1.0 / rate if rate else 0.0, options, 11),
            uncorrected=True,
            **directed(component, component.rstrip("12")),
            # K-NET and the surface sensors of KiK-net are in the free field.
            site_type=SiteType.BOREHOLE if component.endswith("1") else SiteType.FREE_FIELD,
            event=f"{header.values['Origin Time']} JST",
            station=station + _PLACES.get(component[-1], ""),
            network=trace.stats.network,
            start_time=str(trace.stats.starttime),
            magnitude=magnitude,
            peak_ratio=peak_ratio,
            **distances(
                (header.number("Lat."), header.number("Long.")),
                (header.number("Station Lat."), header.number("Station Long.")),
                header.number("Depth. (km)"),
            ),
        )
    ]


def _header(path: Path, text: bytes) -> KeyedHeader:
    lines = [line.decode("latin-1") for line in text.split(b"\n", len(_KEYS))]
    values = {}
    for number, key in enumerate(_KEYS, 1):
        line = lines[number - 1] if number <= len(lines) else ""
        value = line.removeprefix(key).strip()
        if not line.startswith(key) or not (value or key == "Memo."):
            message = f"{line.strip()[:40]!r}, where {key!r} and its value are expected:"
            raise InputError(path, f"{message} line {number} of the header.", number)
        values[key] = value
    return KeyedHeader(path, values, _LINES, len(_KEYS))


def _matched(
    header: KeyedHeader, key: str, pattern: re.Pattern[str], example: str
) -> re.Match[str]:
    found = pattern.fullmatch(header.values[key])
    if not found:
        raise header.invalid(key, f"as in {example!r}")
    return found


def _scale(header: KeyedHeader) -> float:
    """Return the acceleration of one count [gal]."""
    stated = _matched(header, "Scale Factor", _SCALE, "3920(gal)/6182761")
    tokens = stated["gal"], stated["counts"]
    if not all(is_number(token) and float(token) > 0.0 for token in tokens):
        raise header.invalid("Scale Factor", "two positive numbers")
    return float(tokens[0]) / float(tokens[1])


def _require_count(header: KeyedHeader, samples: int, rate: int) -> None:
    duration = header.number("Duration Time(s)")
    if samples < 2:
        raise header.invalid("Duration Time(s)", "2 samples or more")
    if samples != round(duration * rate):
        message = f"{duration:g} s at {rate} Hz stated, that is {round(duration * rate)} samples,"
        message += f" but {samples} in the file."
        settle(header.path, message, {"samples": samples}, header.lines["Duration Time(s)"])


def _require_columns(path: Path, body: bytes) -> None:
    """Reject lines whose numbers do not fill their columns: a digit was lost."""
    rows = [row.rstrip() for row in body.rstrip().split(b"\n")]
    # The blank of a column precedes the number, or follows it (and is stripped at the line end).
    short = len(rows[0]) % _WIDTH == _WIDTH - 1
    for line, row in enumerate(rows, len(_KEYS) + 1):
        must = _WIDTH * len(row.split()) - short
        if len(row) != must:
            message = f"{len(row)} characters of samples. Must be {must}: columns of {_WIDTH}."
            raise InputError(path, message, line=line)


def _same(path: Path, read: Float, own: Float) -> Float:
    if read.shape != own.shape or not np.array_equal(read, own):
        message = f"{own.size} samples in the file, but obspy reads others."
        raise InputError(path, message)
    return read


def _peak_ratio(header: KeyedHeader, acceleration: Float) -> float:
    """Return the ratio of actual peak (without the mean) to stated peak; reject a difference."""
    key = "Max. Acc. (gal)"
    gal = (acceleration - acceleration.mean()) / acceleration_factor("gal")
    return require_printed_peak(header.path, header.values[key], gal, "gal", header.lines[key])


def _component(header: KeyedHeader) -> str:
    stated = header.values["Dir."]
    component = _KIK_NET.get(stated, stated.replace("-", ""))
    if component.rstrip("12") not in {"NS", "EW", "UD"}:
        raise header.invalid("Dir.", "one of N-S, E-W, U-D, or 1 to 6")
    return component
