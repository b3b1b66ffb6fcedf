"""Reader of PEER strong-motion database files (AT2): a few header lines, then acceleration in g.

The last header line states NPTS and DT. Style and columns differ between releases of the database,
so numbers are read one by one, independent of the line layout.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.identify import directed, record_ids, site_of_station
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    head_lines,
    is_number,
    parse_numbers,
    plain_text,
    require_even_lines,
    rows_below,
)
from rockframe.ingest.parsing.samples import require_printed_peak
from rockframe.record import Record
from rockframe.units import ACCELERATION_UNITS, GRAVITY, acceleration_factor, plain_units

DESCRIPTION = "PEER strong-motion database, acceleration in g (all header styles)"

#: First line of the files that this package writes.
WRITTEN: Final = "STRONG-MOTION RECORD IN THE FORMAT OF THE PEER DATABASE"
#: Larger numbers are azimuths.
_LARGEST_CHANNEL: Final = 9
#: Largest number of header lines; all known releases have four.
_LONGEST_HEADER: Final = 12
#: `NPTS=   5093, DT=   .0100 SEC,` and `4096    0.0100    NPTS, DT`.
_SIZES: Final = re.compile(
    r"NPTS\s*=\s*(?P<count>[^,\s]*)\s*,?\s*DT\s*=\s*(?P<step>[^,\s]*)\s*(?P<unit>[A-Z]*)", re.I
)
_SIZES_BEFORE: Final = re.compile(
    r"^\s*(?P<count>[^,\s]+)[,\s]+(?P<step>[^,\s]+)[,\s]+NPTS\s*,\s*DT\b(?P<unit>)", re.I
)
_UNITS: Final = re.compile(r"\bUNITS\s+(?:OF|ARE)\s+\(?(?P<units>[^\s,()]+)", re.I)
_SERIES: Final = re.compile(r"\bTIME\s+(?:SERIES|HISTORY)\s+IN\s+UNITS\b", re.I)
_OTHER_QUANTITY: Final = re.compile(r"\b(?P<quantity>VELOCITY|DISPLACEMENT)\s+TIME\b", re.I)
_PEAK: Final = re.compile(r"\bPGA\s*=\s*(?P<peak>[^\s,]+)\s*(?P<units>[^\s,]*)", re.I)
_NUMBER: Final = r"(?P<hertz>\d{1,6}\.?\d{0,9}|\.\d{1,9})\s*HZ"
#: `FILTER POINTS: HP=0.1 Hz LP=40.0 Hz`, and `0 POLE @ 40. HZ, -5 POLE @ .05 HZ`: negative poles
#: belong to the high-pass, and 0 poles mean no filter.
_POINTS: Final = re.compile(rf"\b(?P<kind>HP|LP)\s*=\s*{_NUMBER}", re.I)
_POLES: Final = re.compile(rf"(?P<poles>-?\d{{1,3}})\s+POLES?\s*@\s*{_NUMBER}", re.I)
_DATE: Final = re.compile(r"\b\d{1,2}/\d{1,2}/(?:\d{4}|\d{2})\b")
_REMARK: Final = re.compile(r"\s*\([^()]*\)$")
_COMPONENT: Final = re.compile(r"[A-Za-z0-9-]{1,6}")


@dataclass(frozen=True)
class Title:
    """Unambiguous contents of the title line; ambiguous parts are empty.

    Parameters
    ----------
    event, station, component : str
        Names as printed; the event includes its date.

    Examples
    --------
    >>> read_title("Chi-Chi- Taiwan, 9/20/1999, TCU052, E")
    Title(event='Chi-Chi- Taiwan, 9/20/1999', station='TCU052', component='E')
    """

    event: str = ""
    station: str = ""
    component: str = ""


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a PEER file of any quantity.

    Examples
    --------
    >>> sniff(b"PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 3, DT= .01 SEC\n")
    True
    """
    return any(
        _sizes(line) or _SERIES.search(line)
        for line in head_lines(head)[:_LONGEST_HEADER]
        if not line.lstrip().startswith(("#", "%"))
    )


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the record of a PEER AT2 file.

    Raises
    ------
    InputError
        If the file is velocity or displacement, does not state g, its number of samples or peak
        differs from the header, or a number is invalid.

    Examples
    --------
    >>> header = b"PEER\nTITLE\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 3, DT= .01 SEC\n"
    >>> [record] = read(Path("RSN1.AT2"), header + b" .1 .2 -.3", ReadOptions())
    >>> record.record_id, record.time_step, record.acceleration
    ('RSN1', 0.01, array([ 0.981,  1.962, -2.943]))
    """
    text = plain_text(path, data)
    header = _header(path, text)
    last = len(header)
    _refuse_other_quantities(path, header)
    factor = _factor(path, header, options)
    count, step = _count_and_step(path, header[-1], last)
    step = settle_time_step(path, step, options, last)
    rows = rows_below(text, last)
    samples = parse_numbers(path, rows, last + 1)
    if samples.size != count:
        message = f"NPTS {count} in the header, {samples.size} samples in the file."
        if samples.size < 2:
            raise InputError(path, message, last)
        settle(path, message, {"samples": samples.size}, last)
    require_even_lines(path, rows, last + 1)
    peak_ratio = _peak_ratio(path, header, samples, factor)
    low, high = filter_corners(header)
    title = read_title(header[1]) if last > 1 else Title()
    return [
        Record(
            record_id=record_ids(path, [title.component])[0],
            acceleration=samples * factor,
            time_step=step,
            **_direction(path, title.component, header[0]),
            site_type=site_of_station(title.station),
            event=title.event,
            station=title.station,
            peak_ratio=peak_ratio,
            filter_low=low,
            filter_high=high,
        )
    ]


def read_title(line: str) -> Title:
    """Return event, station and component of a title line, if they are unambiguous.

    The line is `event, date, station, component` or `event date time, station, component`,
    optionally with a remark in parentheses at the end. Event and station may contain commas.

    Examples
    --------
    >>> read_title("KOBE 01/16/95 2046, NISHI-AKASHI, 090 (CUE)")
    Title(event='KOBE 01/16/95 2046', station='NISHI-AKASHI', component='090')
    >>> read_title("1559 points at equal spacing of 0.02 sec")
    Title(event='', station='', component='')
    """
    fields = [field.strip() for field in line.split(",")]
    dated = [number for number, field in enumerate(fields) if _DATE.search(field)]
    if len(dated) != 1:
        return Title()
    event = ", ".join(fields[: dated[0] + 1])
    rest = fields[dated[0] + 1 :]
    component = _REMARK.sub("", rest[-1]) if rest else ""
    if len(rest) < 2 or not _COMPONENT.fullmatch(component):
        return Title(event)
    return Title(event, ", ".join(rest[:-1]), component)


def _direction(path: Path, component: str, top: str) -> dict[str, Any]:
    """Return name and direction of a component; a note says if it may be the number of a channel.

    Azimuths have three digits. PEER prints some of them with fewer; the name of the file ends with
    all three (`AGR003`) or with those printed (`ELC0`). Of other short numbers, those above 9 are
    azimuths too, but not below `WRITTEN`, where an azimuth always has three digits.
    """
    stem = path.stem.upper()
    is_short = re.fullmatch(r"\d{1,2}", component, re.ASCII)
    if not is_short or stem.endswith(component.zfill(3)):
        return directed(component)
    is_named = re.search(rf"(?<=[A-Z])(?<!CH){component}$", stem)
    if top.strip() != WRITTEN and (int(component) > _LARGEST_CHANNEL or is_named):
        return directed(component)
    note = f"component {component!r} may be the number of a channel and is not read as an azimuth"
    return {**directed(component, ""), "processing": (note,)}


def filter_corners(header: Sequence[str]) -> tuple[float, float]:
    """Return the filter corners [Hz] stated in the header lines; NaN if unstated.

    Examples
    --------
    >>> filter_corners(["ACCELERATION IN UNITS OF G. FILTER POINTS: HP=0.1 Hz LP=40.0 Hz"])
    (0.1, 40.0)
    >>> filter_corners(["DT= .0050 SEC,   0 POLE @    40.00000 HZ,  -5 POLE @      .05000 HZ"])
    (0.05, nan)
    """
    low = high = math.nan
    for line in header:
        corners = [(match["kind"].upper(), match["hertz"]) for match in _POINTS.finditer(line)]
        corners += [
            ("HP" if match["poles"].startswith("-") else "LP", match["hertz"])
            for match in _POLES.finditer(line)
            if int(match["poles"])
        ]
        for kind, hertz in corners:
            if float(hertz) > 0.0:
                low, high = (float(hertz), high) if kind == "HP" else (low, float(hertz))
    return low, high


def _peak_ratio(path: Path, header: list[str], samples: Float, factor: float) -> float:
    """Return the ratio of actual to stated peak; raise an error if they differ; NaN if unstated.

    The factor is that of the samples [m s-2]; in files of other units than g, the peak may be in
    those units, or in g.
    """
    for number, line in enumerate(header, 1):
        match = _PEAK.search(line)
        if match:
            units = plain_units(match["units"].rstrip(".;"))
            allowed = units in ACCELERATION_UNITS and acceleration_factor(units) == factor
            if units != "g" and not allowed:
                raise InputError(path, f"PGA in units of {match['units']!r}. Must be g.", number)
            inside = samples if allowed else samples * factor / GRAVITY
            return require_printed_peak(path, match["peak"], inside, units, number)
    return math.nan


def _sizes(line: str) -> re.Match[str] | None:
    return _SIZES.search(line) or _SIZES_BEFORE.search(line)


def _header(path: Path, text: bytes) -> list[str]:
    """Return the lines up to the one that states NPTS and DT."""
    lines = [line.decode("latin-1") for line in text.split(b"\n", _LONGEST_HEADER)]
    for number, line in enumerate(lines[:_LONGEST_HEADER], 1):
        if _sizes(line):
            return lines[:number]
    forms = "'NPTS= 4000, DT= .0050 SEC' or '4000 0.0050 NPTS, DT'"
    raise InputError(path, f"no NPTS and DT, as in {forms}, in the first {_LONGEST_HEADER} lines.")


def _refuse_other_quantities(path: Path, header: list[str]) -> None:
    for number, line in enumerate(header, 1):
        other = _OTHER_QUANTITY.search(line)
        if other:
            quantity = other["quantity"].lower()
            message = f"is a {quantity} time series, not an acceleration."
            raise OtherQuantityError(path, message, number)


def _factor(path: Path, header: list[str], options: ReadOptions) -> float:
    """Return m s-2 per number; programs that write AT2 files also use other units than PEER's g."""
    for number, line in enumerate(header, 1):
        match = _UNITS.search(line)
        if match:
            units = plain_units(match["units"].rstrip(".;"))
            if units not in ACCELERATION_UNITS:
                message = f"acceleration units {match['units']!r}. Must be g, or one of: "
                raise InputError(path, f"{message}{', '.join(ACCELERATION_UNITS)}.", number)
            return factor_to_si(path, units, options, number)
    if options.units is not None or options.factor is not None:
        return factor_to_si(path, None, options)
    message = "acceleration units unstated. The header must state them:"
    do = "Otherwise state them with --units."
    raise InputError(path, f"{message} 'ACCELERATION TIME SERIES IN UNITS OF G'. {do}")


def _count_and_step(path: Path, line: str, number: int) -> tuple[int, float]:
    sizes = _sizes(line)
    assert sizes  # noqa: S101 - the header ends with the line that matches
    count, step, unit = sizes["count"], sizes["step"], sizes["unit"].upper()
    if not (re.fullmatch(r"\d{1,12}", count, re.ASCII) and int(count) >= 2):
        raise InputError(path, f"NPTS {count!r}. Must be a whole number of 2 or more.", line=number)
    if unit not in {"", "S", "SEC", "SECS", "SECOND", "SECONDS"}:
        raise InputError(path, f"DT in units of {unit!r}. Must be seconds.", line=number)
    plain = re.sub(r"(?<=[\d.])[dD](?=[-+]?\d)", "e", step)  # as Fortran prints it
    seconds = float(plain) if is_number(plain) else math.nan
    if not seconds > 0.0:
        raise InputError(path, f"time step {step!r} s. Must be a positive number.", line=number)
    return int(count), seconds
