"""Reader of K-NET, KiK-net and JMA (Japan): ASCII of counts with a scale factor, and CSV in gal.

The header is compared with the samples, and the stated peak with the result. A header that is not
as the centre writes it is given to the reader of obspy, which must read the same. That reader
silently accepts truncated files and NaN, and takes most of the time. The offset is not removed.
"""

from __future__ import annotations

import math
import re
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, distances, record_ids, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    KeyedHeader,
    bad_number,
    first_line,
    is_number,
    keyed_header,
    parse_numbers,
    plain_text,
    require_whole_end,
)
from rockframe.ingest.parsing.obspy_reader import read_stream
from rockframe.ingest.parsing.samples import (
    Printed,
    StatedPeak,
    require_peak,
    require_printed_peak,
)
from rockframe.ingest.parsing.timing import parse_utc
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
_TIME: Final = re.compile(r"[12]\d{3}/\d\d/\d\d \d\d:\d\d:\d\d", re.ASCII)
_FORM: Final = "%Y/%m/%d %H:%M:%S"
#: Network of both, and the time that the recorder adds to that of the first sample [s].
_NETWORK: Final = "BO"
_DELAY: Final = 15
#: Header lines that state a number alone, or a time.
_NUMBERS: Final = (
    *("Lat.", "Long.", "Depth. (km)", "Mag.", "Station Lat.", "Station Long."),
    *("Station Height(m)", "Duration Time(s)", "Max. Acc. (gal)"),
)
_TIMES_OF_HEADER: Final = ("Origin Time", "Record Time", "Last Correction")
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
    acceleration = counts * factor
    network, start_time = _NETWORK, _started(header, rate)
    if not start_time:
        trace = read_stream(path, text, "KNET")[0]
        acceleration = _same(path, np.asarray(trace.data, dtype=np.float64) * factor, acceleration)
        network, start_time = trace.stats.network, str(trace.stats.starttime)
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
            network=network,
            start_time=start_time,
            magnitude=magnitude,
            peak_ratio=peak_ratio,
            **distances(
                (header.number("Lat."), header.number("Long.")),
                (header.number("Station Lat."), header.number("Station Long.")),
                header.number("Depth. (km)"),
            ),
        )
    ]


#: Top of a CSV, the header of its columns, and the names of the columns of acceleration.
_CSV: Final = re.compile(r"#\s*K(?:iK)?-?NET\s+CSV", re.I)
_COLUMN: Final = re.compile(r"(?P<name>N-?S|E-?W|U-?D)(?P<place>[12]?)\(gal\)", re.I)
_TIMES: Final = ("Time", "RelativeTime(s)")
_OFFSET, _LARGEST = "Offset", "MaxAcceleration"
#: Rounding of a printed sample and of the offset that is subtracted from it [gal].
_CSV_DIGIT: Final = 0.02
_LONGEST_HEADER: Final = 40
_AHEAD: Final = 9
CSV: Final = "K-NET and KiK-net CSV, uncorrected, columns in gal, stated offset removed"


def sniff_csv(head: bytes) -> bool:
    """Return True if a file begins like a CSV of K-NET or KiK-net.

    Examples
    --------
    >>> sniff_csv(b"#K-NET CSV"), sniff_csv(b"#CSV")
    (True, False)
    """
    return _CSV.match(first_line(head)) is not None


def read_csv(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the components of a CSV of K-NET or KiK-net, without the offset that it states.

    Raises
    ------
    InputError
        If names of columns, rate, duration or peaks are missing or contradict the rows, if a row is
        not a time and numbers, or if the file ends within a number.

    Examples
    --------
    >>> read_csv(Path("AOM017.csv"), b"#K-NET CSV", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: AOM017.csv: no line that begins '#Time,RelativeTime(s)' in the f...
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    words = [line.decode("latin-1").strip() for line in lines[:_LONGEST_HEADER]]
    start = f"#{','.join(_TIMES)}"
    top = next((k for k, line in enumerate(words) if line.startswith(start)), -1)
    if top < 0:
        message = f"no line that begins {start!r} in the first {_LONGEST_HEADER} lines."
        raise InputError(path, message)
    header = _csv_header(path, words[: top + 1])
    printed = words[top].split(",")[len(_TIMES) :]
    columns = [_COLUMN.fullmatch(name) for name in printed]
    names = [f"{cell['name'].replace('-', '').upper()}{cell['place']}" for cell in columns if cell]
    if len(names) != len(columns) or not names:
        raise InputError(path, f"columns {words[top]!r}. Must be N-S(gal), ...", top + 1)
    table = _csv_rows(path, lines[top + 1 :], top + 2, len(names))
    rate = header.required_number("SamplingFrequency(Hz)")
    _require_csv_step(header, table[:, 0], rate)
    _require_whole_rows(path, data, lines[top + 1 :], top + 2)
    offsets = _csv_offsets(header, printed)
    gal = table[:, 1:] - np.array(offsets)
    factor = factor_to_si(path, "gal", options, top + 1)
    step = settle_time_step(path, 1.0 / rate, options)
    facts = _csv_facts(header, lines[top + 1].partition(b",")[0].decode("latin-1"))
    return [
        Record(
            record_id=record_id,
            acceleration=factor * gal[:, k],
            time_step=step,
            uncorrected=True,
            **directed(name, name.rstrip("12")),
            site_type=SiteType.BOREHOLE if name.endswith("1") else SiteType.FREE_FIELD,
            station=header.get("Code") + _PLACES.get(name[-1], ""),
            processing=(f"archive: stated offset of {offset:g} gal removed",),
            peak_ratio=_csv_peak_ratio(header, printed[k], gal[:, k]),
            **facts,
        )
        for k, (name, offset, record_id) in enumerate(
            zip(names, offsets, record_ids(path, names), strict=True)
        )
    ]


def _csv_facts(header: KeyedHeader, first: str) -> dict[str, Any]:
    """Return event, network, distances and the time of the first sample as fields of a record."""
    event = header.get("OriginTime")
    whole, point, decimals = first.partition(".")
    return {
        "start_time": parse_utc(whole, _FORM, point + decimals, _AHEAD),
        "event": f"{event} JST" if event else "",
        "network": _NETWORK,
        "magnitude": header.number("Magnitude"),
        **distances(
            (header.number("Latitude"), header.number("Longitude")),
            (header.number("Station Latitude"), header.number("Station Longitude")),
            header.number("Depth(km)"),
        ),
    }


def _csv_header(path: Path, lines: list[str]) -> KeyedHeader:
    """Return the header: lines of names, each followed by a line of values."""
    values: dict[str, str] = {}
    places: dict[str, int] = {}
    section = ""
    for number, (line, below) in enumerate(pairwise(lines), 1):
        if not line.startswith("#") or number in places.values():
            continue
        names, cells = line[1:].split(","), below[1:].split(",")
        if len(names) == 1 and names[0].isalpha() and "(" not in names[0]:
            section = names[0]
            continue
        for name, cell in zip(names, cells, strict=False):
            own = name in values or section in (_OFFSET, _LARGEST)
            key = f"{section} {name}" if own else name
            values[key], places[key] = cell.strip(), number + 1
    return KeyedHeader(path, values, places, len(lines))


def _csv_rows(path: Path, rows: list[bytes], line: int, channels: int) -> Float:
    """Return relative time [s] and samples [gal], shape (rows, 1 + channels)."""
    for number, row in enumerate(rows, line):
        if row.count(b",") != channels + 1:
            message = f"{row.count(b',') + 1} columns. Must be {channels + len(_TIMES)}."
            raise InputError(path, message, number)
    body = b"\n".join(row.partition(b",")[2].replace(b",", b" ") for row in rows)
    values = parse_numbers(path, body + b"\n", line)
    if len(rows) < 2 or values.size != len(rows) * (channels + 1):
        raise InputError(path, f"{values.size} numbers in {len(rows)} rows.", line)
    return values.reshape(len(rows), channels + 1)


def _require_csv_step(header: KeyedHeader, times: Float, rate: float) -> None:
    """Reject rows that do not follow each other at the stated rate, for the stated duration."""
    path, line = header.path, header.lines["SamplingFrequency(Hz)"]
    if not rate > 0.0:
        raise header.invalid("SamplingFrequency(Hz)", "positive")
    late = np.abs((times - times[0]) * rate - np.arange(times.size))
    if late.max() > 0.51:  # half a step, and the decimals of the printed time
        where = int((late > 0.51).argmax())
        message = f"time {times[where]:g} s of row {where + 1}, at {rate:g} samples a second."
        raise InputError(path, message, header.count + 1 + where)
    duration = header.number("DurationTime(s)")
    if not np.isnan(duration) and times.size != round(duration * rate):
        message = f"{duration:g} s at {rate:g} Hz stated, that is {round(duration * rate)} samples,"
        settle(path, f"{message} but {times.size} in the file.", {"samples": times.size}, line)


def _csv_offsets(header: KeyedHeader, columns: list[str]) -> list[float]:
    """Return the stated offset of each column [gal]; 0 if the header states none."""
    offsets = [header.number(f"{_OFFSET} {column}") for column in columns]
    return [0.0 if np.isnan(offset) else offset for offset in offsets]


def _csv_peak_ratio(header: KeyedHeader, column: str, gal: Float) -> float:
    """Return the ratio of actual to stated peak of a column; NaN if the header states none.

    The stated peak is without the offset, or without the mean.
    """
    key = f"{_LARGEST} {column}"
    printed = header.get(key)
    if not printed:
        return math.nan
    line = header.lines[key]
    if not is_number(printed):
        raise bad_number(header.path, printed.encode("latin-1", "replace"), line, "peak")
    peak = StatedPeak(value=Printed.of(printed), units="gal", line=line, signed=False)
    centred = gal - gal.mean()
    nearest = min((gal, centred), key=lambda x: abs(np.abs(x).max() - abs(peak.value.value)))
    return require_peak(header.path, nearest, 1.0, peak, _CSV_DIGIT)


def _require_whole_rows(path: Path, data: bytes, rows: list[bytes], line: int) -> None:
    """Reject a CSV that was cut within its last number; blanks separate dates from times."""
    if not data[-1:].isspace():
        body = b"\n".join(rows)
        require_whole_end(path, body, line, len(rows[0].replace(b",", b" ").split()))


JMA: Final = "JMA (Japan), CSV in Shift JIS, three columns in gal"
_JMA_CODE, _JMA_RATE, _JMA_UNIT, _JMA_START = "SITE CODE", "SAMPLING RATE", "UNIT", "INITIAL TIME"
_JMA_NAMES: Final = ("NS", "EW", "UD")
_JMA_HERTZ: Final = re.compile(r"(\d+(?:\.\d*)?)\s*Hz", re.I)
#: Largest mean of a corrected record as a share of its peak.
_NO_OFFSET: Final = 0.01


def sniff_jma(head: bytes) -> bool:
    """Return True if a file begins like a CSV of JMA.

    Examples
    --------
    >>> sniff_jma(b"SITE CODE=  47662,,"), sniff_jma(b"SITE CODE: 3,,")
    (True, False)
    """
    return bool(re.match(rf"\s*{_JMA_CODE}\s*=", first_line(head)))


def read_jma(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the three components of a CSV of JMA.

    A component counts as uncorrected if its mean exceeds 1 % of its peak.

    Raises
    ------
    InputError
        If a header line is missing or has another unit, or if a row does not have three numbers.

    Examples
    --------
    >>> head = b"SITE CODE=  47662,,\nSAMPLING RATE= 100Hz,,\nUNIT  = gal(cm/s/s),,\n"
    >>> rows = b"NS,EW,UD\n1.0,2.0,3.0\n-1.0,-2.0,-3.0\n"
    >>> [record.component for record in read_jma(Path("a.csv"), head + rows, ReadOptions())]
    ['NS', 'EW', 'UD']
    """
    lines = plain_text(path, data).rstrip().split(b"\n")
    words = [_decoded(line).rstrip(", ") for line in lines[:_LONGEST_HEADER]]
    names = [tuple(word.strip() for word in line.split(",")) for line in words]
    if _JMA_NAMES not in names:
        message = f"no line {','.join(_JMA_NAMES)!r} in the first {_LONGEST_HEADER} lines."
        raise InputError(path, message)
    top = names.index(_JMA_NAMES)
    header = keyed_header(path, words[:top], "=")
    if not header.required(_JMA_UNIT).lower().startswith("gal"):
        raise header.invalid(_JMA_UNIT, "gal(cm/s/s)")
    rate = _JMA_HERTZ.fullmatch(header.required(_JMA_RATE))
    if not rate or float(rate[1]) <= 0.0:
        raise header.invalid(_JMA_RATE, "a rate, as in '100Hz'")
    factor = factor_to_si(path, "gal", options, header.lines[_JMA_UNIT])
    step = settle_time_step(path, 1.0 / float(rate[1]), options, header.lines[_JMA_RATE])
    table = _jma_table(path, lines[top + 1 :], top + 2)
    _require_whole_rows(path, data, lines[top + 1 :], top + 2)
    code = re.match(r"(\w*?)(?=[^\x00-\x7f]|\s|$)(.*)", header.get(_JMA_CODE))
    station = " ".join(part.strip() for part in code.groups() if part.strip()) if code else ""
    return [
        Record(
            record_id=record_id,
            acceleration=factor * samples,
            time_step=step,
            uncorrected=abs(float(samples.mean())) > _NO_OFFSET * float(np.abs(samples).max()),
            **directed(name),
            site_type=SiteType.FREE_FIELD,
            station=station,
            start_time=_jma_start(header),
        )
        for name, samples, record_id in zip(
            _JMA_NAMES, table.T, record_ids(path, _JMA_NAMES), strict=True
        )
    ]


def _decoded(line: bytes) -> str:
    return line.decode("cp932", "replace")


def _jma_table(path: Path, rows: list[bytes], line: int) -> Float:
    """Return the samples [gal], shape (rows, 3)."""
    for number, row in enumerate(rows, line):
        if row.rstrip(b", ").count(b",") != len(_JMA_NAMES) - 1:
            shown = row.decode("latin-1")[:40]
            raise InputError(path, f"{shown!r}. Must be three numbers.", number)
    body = b"\n".join(row.replace(b",", b" ") for row in rows)
    values = parse_numbers(path, body + b"\n", line)
    if len(rows) < 2 or values.size != len(rows) * len(_JMA_NAMES):
        raise InputError(path, f"{values.size} numbers in {len(rows)} rows. Must be 3 each.", line)
    return values.reshape(-1, len(_JMA_NAMES))


def _jma_start(header: KeyedHeader) -> str:
    """Return the time of the first sample (ISO 8601, UTC), which is stated in Japanese time."""
    parts = header.get(_JMA_START).split()
    if len(parts) != 6:
        return ""
    second, point, rest = parts[5].partition(".")
    return parse_utc(" ".join([*parts[:5], second]), "%Y %m %d %H %M %S", point + rest, _AHEAD)


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
    match = pattern.fullmatch(header.values[key])
    if not match:
        raise header.invalid(key, f"as in {example!r}")
    return match


def _started(header: KeyedHeader, rate: int) -> str:
    """Return the time of the first sample (ISO 8601, UTC); empty if a line has an unusual form."""
    values = header.values
    plain = all(value.isascii() for value in values.values())
    plain = plain and all(is_number(values[key]) for key in _NUMBERS)
    if not (plain and rate > 0 and re.fullmatch(r"\S{1,7}", values["Station Code"])):
        return ""
    if not all(_TIME.fullmatch(values[key]) for key in _TIMES_OF_HEADER):
        return ""
    try:
        times = [datetime.strptime(values[key], _FORM) for key in _TIMES_OF_HEADER]
    except ValueError:
        return ""
    moment = times[1] - timedelta(hours=_AHEAD, seconds=_DELAY)
    return f"{moment:%Y-%m-%dT%H:%M:%S}.000000Z"


def _scale(header: KeyedHeader) -> float:
    """Return the acceleration of one count [gal]."""
    match = _matched(header, "Scale Factor", _SCALE, "3920(gal)/6182761")
    tokens = match["gal"], match["counts"]
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
    direction = header.values["Dir."]
    component = _KIK_NET.get(direction, direction.replace("-", ""))
    if component.rstrip("12") not in {"NS", "EW", "UD"}:
        raise header.invalid("Dir.", "one of N-S, E-W, U-D, or 1 to 6")
    return component
