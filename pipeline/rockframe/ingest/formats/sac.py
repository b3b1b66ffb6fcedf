"""Reader of SAC files, binary (either byte order) or alphanumeric: one evenly sampled series.

The header states the kind of quantity (IDEP) but not its units, so the user must state the units.
The header does not state the processing either: a series with an offset counts as uncorrected.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final

import numpy as np

from rockframe.errors import InputError, OtherQuantityError, settle
from rockframe.ingest.identify import direction, record_ids, seed_letter, with_ending
from rockframe.ingest.options import ReadOptions, factor_to_si, settle_time_step
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.lines import (
    are_finite,
    head_lines,
    is_number,
    parse_numbers,
    plain_text,
    require_even_lines,
)
from rockframe.ingest.parsing.timing import even_samples
from rockframe.ingest.stationxml import find_response
from rockframe.record import Orientation, Record

DESCRIPTION = "SAC, binary or alphanumeric; needs --units"

_FLOATS, _INTEGERS = 70, 40
_HEADER_BYTES, _HEADER_LINES = 632, 30
_UNDEFINED: Final = "-12345"
#: Indices of header floats.
_DELTA, _DEPMIN, _DEPMAX, _SCALE, _B, _E, _MAGNITUDE = 0, 1, 2, 3, 5, 6, 39
_DEPMEN, _AZIMUTH, _INCIDENCE = 56, 57, 58
#: Indices of header integers; the first six are the reference time.
_VERSION, _COUNT, _FILE_TYPE, _QUANTITY, _EVEN = 6, 9, 15, 16, 35
#: Character ranges of the names within the last 192 characters of the header.
_STATION, _EVENT, _COMPONENT, _NETWORK = (0, 8), (8, 24), (160, 168), (168, 176)
_CODES: Final = (_STATION, _COMPONENT, _NETWORK, (24, 32))
_TIME_SERIES: Final = 1
#: Largest mean of a corrected record as a share of the peak; in practice it is below 0.001.
_NO_OFFSET: Final = 0.01
#: Largest relative difference of SCALE and the sensitivity in the StationXML.
_SAME_SCALE: Final = 0.01
#: Largest deviation from north or east of a component with the letter N or E [degree].
_ASKEW: Final = 5.0
_OTHER_QUANTITIES: Final = {6: "displacement", 7: "velocity", 50: "volts"}


@dataclass(frozen=True)
class _Sac:
    """A SAC file: the 70 floats, 40 integers and 192 characters of its header, and its samples.

    Uneven files also contain the time of each sample [s].
    """

    floats: Float
    integers: tuple[int, ...]
    names: str
    samples: Float
    times: Float | None = None

    def stated(self, place: int) -> float:
        """Return a header float; NaN if undefined."""
        value = float(self.floats[place])
        return value if math.isfinite(value) and value != float(_UNDEFINED) else math.nan

    def name(self, place: tuple[int, int]) -> str:
        # Some writers end a name with NUL, and leave old characters after it.
        name = self.names[slice(*place)].split("\0")[0].strip()
        return "" if name.startswith(_UNDEFINED) or not name.isprintable() else name


def sniff(head: bytes) -> bool:
    """Return True if a file begins like a SAC file, binary or alphanumeric.

    Examples
    --------
    >>> sniff(bytes(700))
    False
    """
    return _byte_order(head) is not None or _is_alphanumeric(head)


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    """Return the record of a SAC file; it is uncorrected if its mean exceeds 1 % of its peak.

    Raises
    ------
    InputError
        If units, number of samples, quantity, SCALE, evenness, extremes, mean or direction are
        missing, contradict the samples, or contradict each other.

    Examples
    --------
    >>> read(Path("a.sac"), bytes(700), ReadOptions("g"))
    Traceback (most recent call last):
    rockframe.errors.InputError: a.sac: no header of SAC, version 6, binary or alphanumeric.
    """
    order = _byte_order(data)
    if order is None and not _is_alphanumeric(data):
        raise InputError(path, "no header of SAC, version 6, binary or alphanumeric.")
    file = _binary(path, data, order) if order else _alphanumeric(path, data)
    _require_acceleration(path, file)
    file, step, note = _even(path, file, options)
    factor, instrument = _factor(path, file, options)
    component, largest = file.name(_COMPONENT), float(np.abs(file.samples).max())
    orientation, azimuth = _direction(path, file, component)
    steps = [*instrument.pop("processing", ()), *([note] if note else [])]
    return [
        Record(
            record_id=record_ids(with_ending(path, [".sac"]), [component])[0],
            acceleration=file.samples * factor,
            time_step=step,
            uncorrected=abs(float(file.samples.mean())) > _NO_OFFSET * largest,
            component=component,
            orientation=orientation,
            azimuth=azimuth,
            event=file.name(_EVENT),
            station=file.name(_STATION),
            network=file.name(_NETWORK),
            start_time=_start_time(file),
            magnitude=file.stated(_MAGNITUDE),
            processing=tuple(steps),
            **instrument,
        )
    ]


def _even(path: Path, file: _Sac, options: ReadOptions) -> tuple[_Sac, float, str]:
    """Return a file with even samples, its time step [s], and a note if they were uneven."""
    if file.times is not None:
        if not are_finite(file.times):
            raise InputError(path, "times of an uneven file. Must be finite.")
        step, samples, note = even_samples(path, file.times, file.samples, 1, options.time_step)
        return replace(file, samples=samples), step, note
    step = float(file.floats[_DELTA])
    # The header has single precision: compare the user's time step in that precision, but use all
    # its digits.
    if options.time_step is None or np.float32(options.time_step) != np.float32(step):
        step = settle_time_step(path, step, options)
    _require_end(path, file)
    return file, step, ""


def _factor(path: Path, file: _Sac, options: ReadOptions) -> tuple[float, dict[str, Any]]:
    """Return m s-2 per sample, and the instrument if the samples are counts.

    Services of data centres write counts, with the sensitivity of the instrument in SCALE.
    """
    scale = file.stated(_SCALE)
    if (math.isnan(scale) or scale in (0.0, 1.0)) and options.sensitivity is None:
        if options.units is None and options.factor is None:
            message = "acceleration units unstated, as in every SAC file. State them with --units,"
            do = "or counts per m/s2 with --sensitivity-counts-s2-m."
            raise InputError(path, f"{message} {do}")
        return factor_to_si(path, None, options), {}
    from obspy import Trace

    codes = zip(("station", "channel", "network", "location"), _CODES, strict=True)
    header = {code: file.name(place) for code, place in codes}
    trace = Trace(header={**header, "starttime": _start_time(file) or 0})
    try:
        instrument = find_response(path, trace, options)
    except InputError as error:
        return _scaled(path, scale, options, error), {}
    if options.sensitivity is not None:
        return 1.0 / instrument.counts, {"processing": (instrument.division,)}
    if abs(scale - instrument.counts) > _SAME_SCALE * instrument.counts:
        message = f"SCALE {scale:.7g}, but {instrument.counts:.7g} counts per m/s2 in "
        message += f"{instrument.source}."
        scales = {"scale": scale, "sensitivity": instrument.counts} if scale > 0.0 else {}
        instrument = replace(
            instrument, counts=settle(path, message, scales or {"sensitivity": instrument.counts})
        )
    factor_to_si(path, "m/s2", options)
    return 1.0 / instrument.counts, {**instrument.facts, "processing": (instrument.division,)}


def _scaled(path: Path, scale: float, options: ReadOptions, error: InputError) -> float:
    """Return m s-2 per sample if the user trusts SCALE, by which SAC multiplies the samples."""
    message = f"SCALE {scale:.7g}. Must be 1 or undefined, or have a StationXML: {error.reason}"
    must = "If the samples times SCALE are accelerations, state their --units also."
    factor = settle(path, message, {"scale": scale}, must=must)
    return factor * factor_to_si(path, None, options)


def _byte_order(head: bytes) -> str | None:
    """Return the byte order in which version, file type and evenness are valid, or None."""
    if len(head) < _HEADER_BYTES:
        return None
    for order in "<", ">":
        integers = struct.unpack_from(f"{order}{_INTEGERS}i", head, 4 * _FLOATS)
        if (
            1 <= integers[_VERSION] <= 7
            and integers[_EVEN] in (0, 1)
            and (integers[_FILE_TYPE] == int(_UNDEFINED) or 1 <= integers[_FILE_TYPE] <= 100)
        ):
            return order
    return None


def _is_alphanumeric(head: bytes) -> bool:
    """Return True if a file begins with 14 lines of floats (5F15.7) and 8 of integers (5I10)."""
    lines = head_lines(head)
    if len(lines) < _HEADER_LINES:
        return False
    floats, integers = lines[:14], lines[14:22]
    return all(_fields(line, 15) is not None for line in floats) and all(
        _fields(line, 10) is not None for line in integers
    )


def _fields(line: str, width: int) -> list[float] | None:
    fields = [line[start : start + width].encode("latin-1") for start in range(0, 5 * width, width)]
    good = len(line.rstrip()) == 5 * width and all(map(is_number, fields))
    return [float(field) for field in fields] if good else None


def _binary(path: Path, data: bytes, order: str) -> _Sac:
    floats = _doubles(data, order, _FLOATS, 0)
    integers = struct.unpack_from(f"{order}{_INTEGERS}i", data, 4 * _FLOATS)
    names = data[4 * (_FLOATS + _INTEGERS) : _HEADER_BYTES].decode("latin-1")
    version, count = integers[_VERSION], integers[_COUNT]
    if version != 6:
        raise InputError(path, f"SAC header version {version}. Only version 6 is read.")
    present = (len(data) - _HEADER_BYTES) / 4
    uneven = integers[_EVEN] == 0 and present == 2 * count >= 4
    if uneven:
        samples, times = _doubles(data, order, 2 * count, _HEADER_BYTES).reshape(2, count)
        return _Sac(floats, integers, names, samples, times)
    if count != present:
        message = f"NPTS {count} in the header, {present:g} samples in the file."
        if present < 2 or present % 1.0:
            raise InputError(path, message)
        count = settle(path, message, {"samples": int(present)})
    return _Sac(floats, integers, names, _doubles(data, order, count, _HEADER_BYTES))


def _doubles(data: bytes, order: str, count: int, start: int) -> Float:
    # A signalling NaN would cause a warning; NaN among the samples are rejected later.
    with np.errstate(invalid="ignore"):
        return np.frombuffer(data, f"{order}f4", count, start).astype(np.float64)


def _alphanumeric(path: Path, data: bytes) -> _Sac:
    lines = plain_text(path, data).split(b"\n", _HEADER_LINES)
    header = [line.decode("latin-1") for line in lines[:_HEADER_LINES]]
    floats = [value for line in header[:14] for value in _fields(line, 15) or []]
    integers = tuple(int(value) for line in header[14:22] for value in _fields(line, 10) or [])
    # Each line has three names of eight characters; the second name of the header has sixteen.
    names = "".join(line.ljust(24)[:24] for line in header[22:])
    body = lines[_HEADER_LINES] if len(lines) > _HEADER_LINES else b""
    samples = parse_numbers(path, body, _HEADER_LINES + 1)
    if integers[_COUNT] != samples.size:
        message = f"NPTS {integers[_COUNT]} in the header, {samples.size} samples in the file."
        settle(path, message, {"samples": samples.size}, 16)
    require_even_lines(path, body, _HEADER_LINES + 1)
    return _Sac(np.array(floats), integers, names, samples)


def _require_acceleration(path: Path, file: _Sac) -> None:
    """Reject files that are not evenly sampled acceleration, or differ from their header."""
    integers = file.integers
    if integers[_QUANTITY] in _OTHER_QUANTITIES:
        quantity = _OTHER_QUANTITIES[integers[_QUANTITY]]
        message = f"IDEP {integers[_QUANTITY]} is {quantity}, not an acceleration."
        raise OtherQuantityError(path, message)
    even = integers[_EVEN] == 1 or file.times is not None
    if not even or integers[_FILE_TYPE] not in (_TIME_SERIES, int(_UNDEFINED)):
        message = f"LEVEN {integers[_EVEN]}, IFTYPE {integers[_FILE_TYPE]}."
        raise InputError(path, f"{message} Must be 1 and 1: an evenly sampled time series.")
    if file.samples.size < 2:
        raise InputError(path, f"NPTS {file.samples.size}. Must be 2 or more.")
    if not are_finite(file.samples):
        where = int(np.flatnonzero(~(np.abs(file.samples) < 1e30))[0])
        message = f"sample {where + 1} is {file.samples[where]}. Must be finite and below 1e30."
        raise InputError(path, message)
    size = float(np.abs(file.samples).max())
    for place, name, value_there, slack in (
        (_DEPMIN, "DEPMIN", file.samples.min(), 1e-6),  # alphanumeric headers have seven digits
        (_DEPMAX, "DEPMAX", file.samples.max(), 1e-6),
        (_DEPMEN, "DEPMEN", file.samples.mean(), 1e-4),  # sums in single precision
    ):
        header_value = file.stated(place)
        if not math.isnan(header_value) and abs(header_value - value_there) > slack * max(
            size, abs(header_value)
        ):
            message = f"{name} {header_value:.7g} in the header, {value_there:.7g} in the samples."
            settle(path, message, {"values": None})


def _require_end(path: Path, file: _Sac) -> None:
    """Reject a time step that does not lead from B to E within 1.5 steps."""
    step, end = float(file.floats[_DELTA]), file.stated(_E)
    begin = file.stated(_B)
    last = begin + (file.samples.size - 1) * step
    if abs(end - last) > 1.5 * step:
        message = f"E {end:g} s in the header, but {file.samples.size} samples at {step:g} s from"
        settle(path, f"{message} {begin:g} s end at {last:g} s.", {"samples": None})


def _direction(path: Path, file: _Sac, component: str) -> tuple[Orientation, float]:
    """Return the direction from CMPINC (measured from up) and CMPAZ, otherwise from the name."""
    incidence, azimuth = file.stated(_INCIDENCE), file.stated(_AZIMUTH)
    orientation, named = direction(seed_letter(component))
    upright = incidence in (0.0, 180.0)
    if not (upright or (incidence == 90.0 and not math.isnan(azimuth))):
        return orientation, named
    # Positive motion may be in the opposite direction.
    askew = 0.0 if upright else abs((azimuth - named + 90.0) % 180.0 - 90.0)
    has_direction = orientation is not Orientation.UNSTATED
    if has_direction and (orientation.upright != upright or askew > _ASKEW):
        message = f"component {component!r}, but CMPINC {incidence:g} and CMPAZ {azimuth:g}."
        if settle(path, message, {"component": True, "azimuth": False}):
            return orientation, named
    if upright:
        return Orientation.DOWNWARD if incidence else Orientation.VERTICAL, math.nan
    # An azimuth beyond 360 stays as stated, for the warning in the passport.
    return Orientation.HORIZONTAL, azimuth if azimuth > 360.0 else azimuth % 360.0


def _start_time(file: _Sac) -> str:
    """Return reference time plus B (ISO 8601, UTC); empty if undefined."""
    year, day, hour, minute, second, millisecond = file.integers[:6]
    begin = file.stated(_B)
    try:
        start = datetime(year, 1, 1, hour, minute, second, 1000 * millisecond, tzinfo=UTC)
        start += timedelta(days=day - 1, seconds=begin)
    except (ValueError, OverflowError):
        return ""
    # strftime writes years before 1000 with three digits
    return (
        f"{start.replace(tzinfo=None).isoformat(timespec='microseconds')}Z"
        if 1 <= day <= 366
        else ""
    )
