"""K-NET and KiK-net ASCII: counts with a scale factor, one component a file.

obspy's reader takes files that are cut, or hold NaN, without a word; so the header is held against
the samples before it, and the stated peak against the result after it. The offset is left as it is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rockframe.errors import InputError
from rockframe.ingest.identify import direction, record_ids, with_ending
from rockframe.ingest.lines import head_lines, is_number, parse_numbers, text_of
from rockframe.ingest.options import ReadOptions, settle_time_step, settle_units
from rockframe.ingest.peaks import require_printed_peak
from rockframe.ingest.through_obspy import read_stream
from rockframe.record import Record, SiteType
from rockframe.units import acceleration_factor

#: The lines of the header, in their order.
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
#: Numbers of KiK-net's six directions: 1 to 3 in the borehole, 4 to 6 on the surface.
_KIK_NET: Final = {"1": "NS1", "2": "EW1", "3": "UD1", "4": "NS2", "5": "EW2", "6": "UD2"}
_PLACES: Final = {"1": " (borehole)", "2": " (surface)"}
_SCALE: Final = re.compile(r"(?P<gal>[\d.]+)\(gal\)/(?P<counts>[\d.]+)")
_RATE: Final = re.compile(r"(?P<rate>\d{1,5})\s*Hz", re.I)
#: Characters of a sample, with the blank between two.
_WIDTH: Final = 9


@dataclass(frozen=True)
class _Header:
    """Values by key, as printed."""

    path: Path
    values: Mapping[str, str]

    def line(self, key: str) -> int:
        return _KEYS.index(key) + 1

    def number(self, key: str) -> float:
        token = self.values[key]
        if not is_number(token.encode("latin-1")):
            raise self.invalid(key, "a number")
        return float(token)

    def matched(self, key: str, pattern: re.Pattern[str], example: str) -> re.Match[str]:
        found = pattern.fullmatch(self.values[key])
        if not found:
            raise self.invalid(key, f"as in {example!r}")
        return found

    def invalid(self, key: str, must: str) -> InputError:
        message = f"{key} {self.values[key]!r}. Must be {must}."
        return InputError(self.path, message, line=self.line(key))


def sniff(head: bytes) -> bool:
    r"""Whether a file's beginning is that of a K-NET or KiK-net file.

    Parameters
    ----------
    head : bytes
        At most the first 4096 bytes.

    Examples
    --------
    >>> sniff(b"Origin Time       2008/06/14 08:43:00\nLat.              39.028\n")
    True
    """
    lines = head_lines(head)
    return bool(lines) and lines[0].startswith(_KEYS[0])


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Read the one component of a K-NET or KiK-net file, its offset left as it is.

    Parameters
    ----------
    path : Path
        The file, for names and errors.
    data : bytes
        Its contents.
    options : ReadOptions
        Must agree with the header.

    Raises
    ------
    InputError
        If a line of the header is missing or not as it must be, the samples are other in number
        than duration and rate say, one is no number, or their peak without the mean is not the
        stated one to its last printed digit.

    Examples
    --------
    >>> read(Path("AOM017.EW"), b"Origin Time       2008/06/14 08:43:00", ReadOptions())
    Traceback (most recent call last):
    rockframe.errors.InputError: AOM017.EW:2: ''. Must be 'Lat.' and its value: line 2 of the ...
    """
    text = text_of(path, data)
    header = _header(path, text)
    rate = int(header.matched("Sampling Freq(Hz)", _RATE, "100Hz")["rate"])
    units = settle_units(path, "gal", options, header.line("Scale Factor"))
    factor = acceleration_factor(units) * _scale(header)
    magnitude, component = header.number("Mag."), _component(header)
    body = text.split(b"\n", len(_KEYS))[-1]
    counts = parse_numbers(path, body, len(_KEYS) + 1)
    _require_columns(path, body)
    _require_count(header, counts.size, rate)
    trace = read_stream(path, text, "KNET")[0]
    acceleration = _same(path, np.asarray(trace.data, dtype=np.float64) * factor, counts * factor)
    peak_ratio = _peak_ratio(header, acceleration)
    orientation, azimuth = direction(component.rstrip("12"))
    station = header.values["Station Code"]
    return [
        Record(
            record_id=record_ids(with_ending(path, [".knet", ".txt"]), [component])[0],
            acceleration=acceleration,
            time_step=settle_time_step(path, 1.0 / rate if rate else 0.0, options, 11),
            uncorrected=True,
            component=component,
            orientation=orientation,
            azimuth=azimuth,
            # K-NET and the upper sensors of KiK-net stand on free ground.
            site_type=SiteType.BOREHOLE if component.endswith("1") else SiteType.FREE_FIELD,
            event=f"{header.values['Origin Time']} JST",
            station=station + _PLACES.get(component[-1], ""),
            network=trace.stats.network,
            start_time=str(trace.stats.starttime),
            magnitude=magnitude,
            peak_ratio=peak_ratio,
        )
    ]


def _header(path: Path, text: bytes) -> _Header:
    lines = [line.decode("latin-1") for line in text.split(b"\n", len(_KEYS))]
    values = {}
    for number, key in enumerate(_KEYS, 1):
        line = lines[number - 1] if number <= len(lines) else ""
        value = line.removeprefix(key).strip()
        if not line.startswith(key) or not (value or key == "Memo."):
            raise InputError(
                path,
                f"{line.strip()[:40]!r}. Must be {key!r} and its value: "
                f"line {number} of the header.",
                line=number,
            )
        values[key] = value
    return _Header(path, values)


def _scale(header: _Header) -> float:
    """Acceleration of one count [gal]."""
    stated = header.matched("Scale Factor", _SCALE, "3920(gal)/6182761")
    tokens = stated["gal"], stated["counts"]
    if not all(is_number(token.encode()) and float(token) > 0.0 for token in tokens):
        raise header.invalid("Scale Factor", "two positive numbers")
    return float(tokens[0]) / float(tokens[1])


def _require_count(header: _Header, samples: int, rate: int) -> None:
    duration = header.number("Duration Time(s)")
    if samples != round(duration * rate):
        raise InputError(
            header.path,
            f"{duration:g} s at {rate} Hz stated, that is {round(duration * rate)} samples, but "
            f"{samples} in the file. Must be equal.",
            line=header.line("Duration Time(s)"),
        )
    if samples < 2:
        raise header.invalid("Duration Time(s)", "2 samples or more")


def _require_columns(path: Path, body: bytes) -> None:
    """Refuse lines in which a number is longer or shorter than its column: a digit is lost."""
    rows = [row.rstrip() for row in body.rstrip().split(b"\n")]
    # The blank that follows each number is cut off at the end, or stands before the number.
    short = len(rows[0]) % _WIDTH == _WIDTH - 1
    for line, row in enumerate(rows, len(_KEYS) + 1):
        must = _WIDTH * len(row.split()) - short
        if len(row) != must:
            message = f"{len(row)} characters of samples. Must be {must}: columns of {_WIDTH}."
            raise InputError(path, message, line=line)


def _same(path: Path, read: NDArray[np.float64], own: NDArray[np.float64]) -> NDArray[np.float64]:
    if read.shape != own.shape or not np.array_equal(read, own):
        raise InputError(
            path, f"{own.size} samples in the file, read otherwise by obspy. Must be equal."
        )
    return read


def _peak_ratio(header: _Header, acceleration: NDArray[np.float64]) -> float:
    """The peak in the file without its mean over the stated one, which must be the same."""
    key = "Max. Acc. (gal)"
    gal = (acceleration - acceleration.mean()) / acceleration_factor("gal")
    return require_printed_peak(header.path, header.values[key], gal, "gal", header.line(key))


def _component(header: _Header) -> str:
    stated = header.values["Dir."]
    component = _KIK_NET.get(stated, stated.replace("-", ""))
    if component.rstrip("12") not in {"NS", "EW", "UD"}:
        raise header.invalid("Dir.", "one of N-S, E-W, U-D, or 1 to 6")
    return component
