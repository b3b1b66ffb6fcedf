"""Channels and sections of a COSMOS file (version 1.20), and the texts of their headers.

Names, times and filters in a text must agree with the channel's numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import direction, upright_sense
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import bad_number, is_number
from rockframe.ingest.parsing.samples import Columns, Printed, StatedPeak, require_peak
from rockframe.ingest.parsing.timing import utc_time
from rockframe.record import Orientation

_TEXT_LINES: Final = 13
#: First line of a channel.
TOP: Final = re.compile(
    r"\s*(?P<what>\S(?:.*?\S)?)\s*\(Format\s+v\s*(?P<version>\d{1,3}\.\d+)\s+with\s+(?P<lines>\d{1,3})\s+"
    r"text lines\)",
    re.I,
)
#: Line above the samples.
SAMPLES: Final = re.compile(
    r"\s*(?P<count>\d{1,9})\s+(?P<what>\S.*?)\s*pts\s*,.*?units\s*=\s*(?P<units>[^(]*?)\s*"
    r"\(\s*(?P<code>\d{1,3})\s*\)\s*,\s*Format\s*=\s*(?P<format>\S.*?)\s*",
    re.I,
)
_END: Final = re.compile(rb"\s*End-of-data\b|/&", re.I)
_VALUES: Final = re.compile(
    r"\s*(?P<count>\d{1,4})\s+(?P<kind>Integer|Real)-header values follow on\s+"
    r"(?P<lines>\d{1,4})\s+lines\s*,\s*Format\s*=\s*(?P<format>\S.*?)\s*",
    re.I,
)
_COMMENTS: Final = re.compile(r"\s*(?P<count>\d{1,5})\s+Comment line\(s\) follow", re.I)
_FORMAT: Final = re.compile(
    r"\(\s*(?P<count>[1-9]\d{0,2})\s*(?:1P\s*)?(?P<kind>[IFEG])(?P<width>[1-9]\d?)"
    r"(?:\.(?P<places>\d{1,2}))?(?:E\d)?\s*\)",
    re.I,
)
_UNKNOWN: Final = re.compile(r"unknown.*?:\s*(?P<integer>-?\d+)\s*,\s*(?P<real>-?\d+\.?\d*)", re.I)


@dataclass(frozen=True)
class Layout:
    """Fortran format of a section.

    Parameters
    ----------
    columns : Columns
        Number and width of the columns.
    places : int
        Digits after the decimal point.
    exponent : bool
        True if the numbers have exponents.

    Examples
    --------
    >>> Layout.of(Path("a.v2c"), "(5F15.6)", 25).columns
    Columns(count=5, width=15, integers=False)
    """

    columns: Columns
    places: int
    exponent: bool

    @classmethod
    def of(cls, path: Path, text: str, line: int) -> Layout:
        """Parse a Fortran format.

        Raises
        ------
        InputError
            If the format is not a single repeated number format.
        """
        match = _FORMAT.fullmatch(text)
        if not match:
            message = f"format {text[:40]!r}. Only formats such as '(8F10.5)' or '(10I8)' are read."
            raise InputError(path, message, line)
        kind = match["kind"].upper()
        columns = Columns(int(match["count"]), int(match["width"]), integers=kind == "I")
        return cls(columns, int(match["places"] or 0), kind in "EG")


@dataclass(frozen=True)
class Channel:
    """Sections of one channel; items are counted from 1.

    Parameters
    ----------
    path : Path
        The file.
    first_line : int
        Line number of the first line of the channel.
    text : list of str
        Text lines.
    integers, reals : list of str
        Numbers of the headers as printed.
    real_line, sample_line : int
        Line numbers of the headings of reals and samples.
    comments : list of str
        Comments without the leading bar.
    heading : re.Match
        Line above the samples.
    layout : Layout
        Format of the samples.
    rows : list of bytes
        Lines of samples.
    """

    path: Path
    first_line: int
    text: list[str]
    integers: list[str]
    reals: list[str]
    real_line: int
    comments: list[str]
    heading: re.Match[str]
    sample_line: int
    layout: Layout
    rows: list[bytes]

    @property
    def unknown(self) -> tuple[float, float]:
        """Integer and real that mean "unknown"."""
        match = _UNKNOWN.search(self.text[-1])
        return (float(match["integer"]), float(match["real"])) if match else (-999.0, -999.0)

    def integer(self, item: int) -> int | None:
        """Return an item of the integer header; None if unknown."""
        value = int(self.integers[item - 1])
        return None if value == self.unknown[0] else value

    def real(self, item: int) -> Printed | None:
        """Return an item of the real header as printed; None if unknown."""
        number = Printed.of(self.reals[item - 1])
        return None if number.value == self.unknown[1] else number

    def number(self, item: int) -> float:
        """Return an item of the real header; NaN if unknown."""
        real_value = self.real(item)
        return real_value.value if real_value else math.nan


def split_channels(path: Path, lines: list[bytes]) -> list[Channel]:
    """Return the channels of a file; the number of lines in each section is checked.

    Raises
    ------
    InputError
        If a section is missing or shorter than stated.

    Examples
    --------
    >>> split_channels(Path("a.v2c"), [b"Corrected acceleration"])
    Traceback (most recent call last):
    rockframe.errors.InputError: a.v2c:1: 'Corrected acceleration' is no heading of a ...
    """
    while lines and not lines[-1].strip():
        lines.pop()
    sections: list[Channel] = []
    top = 0
    while top < len(lines) or not sections:
        channel, top = _channel(path, lines, top)
        sections.append(channel)
    return sections


def _channel(path: Path, lines: list[bytes], top: int) -> tuple[Channel, int]:
    first = _stated(
        path, lines, top, TOP, "Corrected acceleration (Format v01.20 with 13 text lines)"
    )
    if int(first["lines"]) < _TEXT_LINES:
        message = f"{first['lines']} lines of text stated. Must be {_TEXT_LINES} or more."
        raise InputError(path, message, top + 1)
    at = top + int(first["lines"])
    text = [line.decode("latin-1") for line in lines[top:at]]
    integers, at = _values(path, lines, at, "Integer")
    real_line = at + 1
    reals, at = _values(path, lines, at, "Real")
    comments, at = _comments(path, lines, at)
    example = "20000 acceleration pts, approx 100 secs, units=cm/sec2 (04), Format=(8F10.5)"
    heading = _stated(path, lines, at, SAMPLES, example, whole=True)
    layout = Layout.of(path, heading["format"], at + 1)
    end = at + 1 - (-int(heading["count"]) // layout.columns.count)
    if end >= len(lines) or not _END.match(lines[end]):
        end = at + 1
        while end < len(lines) and not _END.match(lines[end]):
            end += 1
    rows = lines[at + 1 : end]
    channel = Channel(
        path, top + 1, text, integers, reals, real_line, comments, heading, at + 1, layout, rows
    )
    # Some files end a channel with both end lines.
    both = end + 1 < len(lines) and lines[end + 1].startswith(b"/&")
    return channel, end + 1 + both


def _stated(
    path: Path,
    lines: list[bytes],
    at: int,
    pattern: re.Pattern[str],
    example: str,
    whole: bool = False,
) -> re.Match[str]:
    text = lines[at].decode("latin-1") if at < len(lines) else ""
    match = pattern.fullmatch(text) if whole else pattern.match(text)
    if not match:
        message = f"{text.strip()[:60]!r} is no heading of a section, such as {example!r}."
        raise InputError(path, message, min(at, len(lines)) + 1)
    return match


def _values(path: Path, lines: list[bytes], at: int, kind: str) -> tuple[list[str], int]:
    example = f"100 {kind}-header values follow on 10 lines, Format= (10I8)"
    match = _stated(path, lines, at, _VALUES, example, whole=True)
    if match["kind"].lower() != kind.lower():
        raise InputError(
            path, f"{match['kind']} header in the place of the {kind} header.", line=at + 1
        )
    columns = Layout.of(path, match["format"], at + 1).columns
    if columns.integers != (kind == "Integer"):
        message = f"format {match['format']!r} of the {kind} header. Must be of {kind.lower()}s."
        raise InputError(path, message, at + 1)
    end = at + 1 + int(match["lines"])
    fields = []
    for line, row in enumerate(lines[at + 1 : end], at + 2):
        text = row.rstrip()
        for start in range(0, len(text), columns.width):
            field = text[start : start + columns.width]
            whole = re.fullmatch(rb" *-?\d{1,15}", field)
            if not (whole if columns.integers else is_number(field)):
                raise bad_number(path, field, line, "header value")
            fields.append(field.decode("latin-1"))
    if len(fields) != int(match["count"]) or len(fields) < 100:
        message = f"{match['count']} values of the {kind.lower()} header stated, {len(fields)} in "
        raise InputError(path, f"{message}the file. Both must be the same, 100 or more.", at + 1)
    return fields, end


def _comments(path: Path, lines: list[bytes], at: int) -> tuple[list[str], int]:
    match = _stated(path, lines, at, _COMMENTS, "4 Comment line(s) follow, each starting with a |")
    end = at + 1
    while end < len(lines) and lines[end].lstrip().startswith(b"|"):
        end += 1
    if end - at - 1 != int(match["count"]):
        counted = f"{end - at - 1} in the file"
        message = f"{match['count']} comment lines stated, {counted}."
        raise InputError(path, message, at + 1)
    return [line.decode("latin-1").strip().lstrip("|") for line in lines[at + 1 : end]], end


_STATION: Final = re.compile(r"\bCode:\s*(?P<network>\w{1,2})-(?P<station>\w+)")
_SEED: Final = re.compile(r"<SCNL>\s*(?P<station>\w+)\.(?P<channel>\w+)\.(?P<network>\w+)\.")
_COMPONENT: Final = re.compile(r"\s*Sta Chan\s+[^:]*:\s*(?P<label>.*?)\s*(?:\(|$)")
_DEGREES: Final = re.compile(r"(?P<azimuth>\d{1,3})\s*Deg\b", re.I)
_EVENT: Final = re.compile(
    r"\s*Record of\s+(?P<event>\S.*?)\s+of\s+(?:Sun|Mon|Tue|Wed|Thu|Fri|Sat)"
)
_START: Final = re.compile(
    r"Rcrd start time:\s*(\d{4})/(\d\d)/(\d\d)[, ]+(\d\d):(\d\d):(\d\d(?:\.\d+)?)\s*UTC", re.I
)
_FILTER: Final = re.compile(
    r"filtered below\s+(?P<low>\d+\.?\d*|\.\d+)\s*Hz.*?above\s+(?P<high>\d+\.?\d*|\.\d+)\s*Hz", re.I
)
#: Item of the integer header that states the processing stage, and the names of the stages.
_STAGE: Final = 1
_STAGES: Final = {"raw": 0, "uncorrected": 1, "corrected": 2}
#: Item of the integer header with the quantity, and the meaning of its codes.
QUANTITY: Final = 2
QUANTITIES: Final = {
    1: "acceleration",
    2: "velocity",
    3: "displacement",
    4: "relative displacement",
    10: "angular acceleration",
    11: "angular velocity",
    12: "angular displacement",
}
_QUANTITY_WORD: Final = re.compile(r"\b(accel|veloc|displ)", re.I)
#: Item of the integer header with the azimuth [degree], or a code for up or down.
_AZIMUTH: Final = 54
_UPRIGHT: Final = {400: Orientation.VERTICAL, 401: Orientation.DOWNWARD}
#: Codes of units, by their names in the line above the samples.
_GAL: Final = ("cm/sec2", "cm/sec/sec", "cm/s/s", "cm/s2", "gal", "gals")
_CODES: Final = {"g": {2}, "counts": {50}, **{name: {4, 10} for name in _GAL}}
#: Items of the real header with the corners of high-pass and low-pass [Hz].
_CORNERS: Final = (54, 57)
#: Indices of the text lines with the largest raw and the largest processed sample.
_RAW_MAX, _MAX = 9, 10
_MAXIMUM: Final = re.compile(
    r"\bmax\s*=\s*(?P<peak>[-+]?\d+\.?\d*)\s*(?P<units>[^\s,]*?)\s*,?\s+at\s+"
    r"(?P<time>\d+\.?\d*)\s*sec",
    re.I,
)


@dataclass(frozen=True)
class Name:
    """Network, station and channel codes; empty if unstated.

    Examples
    --------
    >>> Name("AK", "BMR").channel
    ''
    """

    network: str = ""
    station: str = ""
    channel: str = ""


def parse_station(line: str) -> Name | None:
    """Return the codes in the station line, or None.

    Examples
    --------
    >>> parse_station("Statn No: 37-000011 Code:AK-BMR     UAF  Bremner River, AK, USA")
    Name(network='AK', station='BMR', channel='')
    """
    named = _STATION.search(line)
    return Name(named["network"], named["station"]) if named else None


def seed_name(comments: Sequence[str]) -> Name:
    """Return the SEED codes stated in a comment.

    Examples
    --------
    >>> seed_name(["<SCNL>BMR.BNZ.AK.--    <AUTH> 2019/02/01 21:38:15.000"])
    Name(network='AK', station='BMR', channel='BNZ')
    """
    for comment in comments:
        named = _SEED.search(comment)
        if named:
            return Name(named["network"], named["station"], named["channel"])
    return Name()


def parse_component(line: str, seed: Name) -> str:
    """Return the component: three-digit azimuth, name of the vertical, SEED channel, or raw label.

    Examples
    --------
    >>> parse_component("Sta Chan   ?: 90 Deg (Rcrdr Chan  ?) Location:Ground", Name())
    '090'
    >>> parse_component("Sta Chan   ?:Other   (Rcrdr Chan  ?) Location:", Name("AK", "BMR", "BNZ"))
    'BNZ'
    """
    named = _COMPONENT.match(line)
    label = named["label"] if named else ""
    degrees = _DEGREES.search(label)
    if degrees:
        return f"{int(degrees['azimuth']):03d}"
    if direction(label)[0].upright:
        return label.upper()
    return seed.channel or label


def parse_event(line: str) -> str:
    """Return the event named in the second line.

    Examples
    --------
    >>> parse_event("Record of Point MacKenzie Earthquake of Fri Nov 30, 2018 17:29 UTC")
    'Point MacKenzie Earthquake'
    """
    named = _EVENT.match(line)
    return named["event"] if named else ""


def parse_start_time(line: str) -> str:
    """Return the start time (ISO 8601, UTC), or an empty string unless it is stated in UTC.

    Examples
    --------
    >>> parse_start_time("Rcrd start time: 2018/11/30 17:29:39.137 UTC (Q=5) RcrdId: (see comment)")
    '2018-11-30T17:29:39.137Z'
    """
    match = _START.search(line)
    if not match:
        return ""
    year, month, day, hour, minute = (int(match[group]) for group in range(1, 6))
    return utc_time((year, month, day), hour, minute, match[6])


def parse_corners(lines: Sequence[str]) -> tuple[float, float]:
    """Return the corners of the archive's filter [Hz]; NaN if unstated.

    Examples
    --------
    >>> parse_corners(["Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz"])
    (0.03, 20.0)
    """
    for line in lines:
        match = _FILTER.search(line)
        if match:
            return float(match["low"]) or math.nan, float(match["high"]) or math.nan
    return math.nan, math.nan


def filter_note(lines: Sequence[str]) -> tuple[str, ...]:
    """Return the note for `processing` about the archive's filter, if one is stated.

    Examples
    --------
    >>> filter_note(["Record filtered below  0.03 Hz (periods over 33 secs), and above 20.0 Hz"])
    ('archive: band-pass 0.03 to 20 Hz',)
    """
    low, high = parse_corners(lines)
    return () if math.isnan(low) else (f"archive: band-pass {low:g} to {high:g} Hz",)


def require_quantity(channel: Channel) -> None:
    """Reject a channel whose title or heading contradicts the quantity in the integer header.

    Raises
    ------
    InputError
        If they differ. Otherwise an acceleration that one header calls a velocity would be skipped.
    """
    code = channel.integer(QUANTITY)
    name = QUANTITIES.get(code or 0, "unknown")
    quantity = name if code is None else f"{code} ({name})"
    title = channel.text[0].partition("(")[0].strip()
    heading = channel.heading["what"]
    for words, line in ((title, channel.first_line), (heading, channel.sample_line)):
        word = _QUANTITY_WORD.search(words)
        if word and word[1].lower() not in name:
            message = (
                f"{words!r}, but quantity {quantity} in item {QUANTITY} of the integer header."
            )
            raise InputError(channel.path, message, line)


def require_agreement(channel: Channel, samples: Float, step: float, resolution: float) -> None:
    """Reject an acceleration channel whose text and numeric headers contradict each other.

    Parameters
    ----------
    samples : array, shape (samples,)
        Samples in file units.
    step : float
        Time step [s].
    resolution : float
        One unit of the last printed digit of the samples.

    Raises
    ------
    InputError
        If stage, units, filter corners, or the largest sample and its time differ.
    """
    path = channel.path
    word = channel.text[0].split()[0].lower() if channel.text[0].split() else ""
    stage = channel.integer(_STAGE)
    if _STAGES.get(word, stage) != stage:
        message = f"{word!r}, but stage {stage} in item {_STAGE} of the integer header."
        raise InputError(path, message, line=channel.first_line)
    name, code = channel.heading["units"].strip().lower(), int(channel.heading["code"])
    if code not in _CODES.get(name, {code}):
        message = f"units {channel.heading['units']!r}, but code {code}."
        raise InputError(path, message, line=channel.sample_line)
    _require_corners(channel)
    _require_maximum(channel, samples, step, resolution, raw=stage == 0)


def parse_direction(channel: Channel, component: str) -> tuple[Orientation, float]:
    """Return orientation and azimuth [degree] of a channel from its name and the integer header.

    Raises
    ------
    InputError
        If name and integer header contradict each other.
    """
    orientation, azimuth = direction(component)
    if orientation is Orientation.UNSTATED and component == seed_name(channel.comments).channel:
        # In a SEED channel code, only the letter Z states a direction for certain.
        orientation, azimuth = direction(component[-1] if component.endswith("Z") else "")
    code_of_azimuth = channel.integer(_AZIMUTH)
    sense: Orientation | None = orientation
    if code_of_azimuth in _UPRIGHT and orientation.upright:
        sense = upright_sense(component, _UPRIGHT[code_of_azimuth])
    if code_of_azimuth is not None and orientation is Orientation.HORIZONTAL:
        sense = None if (code_of_azimuth - azimuth) % 360.0 != 0.0 else orientation
    if sense is None:
        message = (
            f"component {component} stated, but {code_of_azimuth} in item {_AZIMUTH} of the integer"
        )
        angles = {"component": (orientation, azimuth)}
        if (
            orientation is Orientation.HORIZONTAL
            and code_of_azimuth is not None
            and 0 <= code_of_azimuth <= 360
        ):
            angles["azimuth"] = orientation, code_of_azimuth % 360.0
        return settle(channel.path, f"{message} header.", angles, channel.first_line + 8)
    return sense, azimuth


def _require_corners(channel: Channel) -> None:
    for item, words in zip(_CORNERS, parse_corners(channel.text), strict=True):
        corner = channel.number(item)
        if corner > 0.0 and abs(corner - words) > 0.05 * words:
            message = (
                f"filter corner {words:g} Hz in words, but {corner:g} Hz in item {item} of "
                "the real header."
            )
            raise InputError(channel.path, message, line=channel.first_line + 11)


def _require_maximum(
    channel: Channel, samples: Float, step: float, resolution: float, *, raw: bool
) -> None:
    index = _RAW_MAX if raw else _MAX
    match = _MAXIMUM.search(channel.text[index])
    if not match:
        return
    name, code = match["units"].lower(), int(channel.heading["code"])
    if code not in _CODES.get(name, set()):  # stated in other units, or without units
        return
    peak = StatedPeak(
        value=Printed.of(match["peak"]),
        time=Printed.of(match["time"]),
        units=match["units"],
        line=channel.first_line + index,
        # For raw counts the header states the absolute value.
        signed=not raw,
    )
    require_peak(channel.path, samples, step, peak, resolution)
