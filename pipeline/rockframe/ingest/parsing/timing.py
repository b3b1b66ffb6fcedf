"""Time step of a printed column of times, and ISO 8601 times."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError
from rockframe.ingest.parsing import Float

#: Relative tolerance of times that were computed in single precision but printed with more digits.
_SINGLE: Final = 2.0**-23
#: Relative tolerance of times in double precision.
_DOUBLE: Final = 2.0**-50
#: Largest tolerance of times in single precision, over their step: it cannot hide a lost sample.
_FINE: Final = 0.1
#: Relative tolerance between two time steps.
_SAME_STEP: Final = 1e-9
#: Smallest time step for which a whole sampling rate is considered [s].
_SHORTEST_STEP: Final = 1e-9
#: Steps at which uneven points are interpolated, and the longest gap in steps [s].
_USUAL_STEPS: Final = (0.001, 0.002, 0.004, 0.005, 0.01, 0.02)
_LONGEST_GAP: Final = 4.0
#: Fewer uneven steps than this mean a corrupted file, not digitised film.
_FEW: Final = 4
#: Largest number of decimals of a time step.
_MOST_DECIMALS: Final = 20


#: A clock time, perhaps after a date and before a zone: `03:19:53.01`,
#: `2019-07-06T03:19:53.01Z`, `06.07.2019 03:19:53 +09`.
_CLOCK: Final = re.compile(
    r"(?:(?P<date>\d{4}[-/]\d{1,2}[-/]\d{1,2}|\d{1,2}\.\d{1,2}\.\d{4})[T ]\s*)?"
    r"(?P<hour>\d{1,2}):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)(?:\.(?P<parts>\d{1,9}))?"
    r"(?P<zone> ?(?:Z|UTC|GMT)| ?(?P<ahead>[+-](?:0\d|1[0-4]))(?::?(?P<rest>[0-5]\d))?)?",
    re.ASCII,
)
_DAY: Final = 86_400
#: Least number of numbers that are recognised as times by their steps.
_FEWEST_TIMES: Final = 10
#: Units of a column of times in parts of a second.
_PART: Final = (
    r"m(?:illi)?s(?:ec(?:ond)?s?)?|millis|[u\u00b5\u03bc]s(?:ecs?)?|micros(?:ec(?:ond)?s?)?"
    r"|nanos(?:ec(?:ond)?s?)?|ns"
)
#: The same at the end of its name.
_PARTS: Final = re.compile(rf"(?:^|[\W_])({_PART})\.?\s*[\])]?$", re.I)
#: Words of such a name that are units, but not seconds at its end.
_OTHER_TIMES: Final = re.compile(
    rf"(?:time|t|elapsed)?(?:{_PART}|min(?:s|utes?|uten)?|hrs?|hours?|days?)|h|d|std|stunden?|tage?",
    re.I,
)
#: Units in brackets, and seconds at the end of such a name.
_IN_BRACKET: Final = re.compile(r"[\[(]\s*([^\[\]()]*?)\s*[\])]")
_SECONDS: Final = re.compile(r"(?:^|[\W_])s(?:e[ckg](?:s?\.?|[ou]n\w*))?\s*[\])]?$", re.I)


def is_clock(text: str) -> bool:
    """Return True if a text is a clock time, perhaps after a date.

    Examples
    --------
    >>> is_clock("03:19:53.01"), is_clock("2019-07-06T03:19:53Z"), is_clock("19:53.0")
    (True, True, False)
    """
    return ":" in text and _CLOCK.fullmatch(text.strip()) is not None


def clock_seconds(texts: Sequence[str]) -> list[str]:
    """Return clock times as seconds after the first midnight, with their decimals.

    A time without a date that is half a day before the one above it is of the next day. Times with
    a zone are those of UTC. Texts that are no clock times, or have a zone although the first has
    none or the other way round, stay as they are.

    Examples
    --------
    >>> clock_seconds(["23:59:59.99", "00:00:00.00"])
    ['86399.99', '86400.00']
    >>> clock_seconds(["05:00:00+01:00", "06:00:01+02:00"])
    ['14400', '14401']
    """
    seconds: list[str] = []
    days, last, first_day, has_zone = 0, -1, None, None
    for text in texts:
        match = _CLOCK.fullmatch(text.strip()) if ":" in text else None
        if match and has_zone is None:
            has_zone = bool(match["zone"])
        if match and bool(match["zone"]) != has_zone:
            match = None
        try:
            day = _ordinal(match["date"]) if match and match["date"] else None
        except ValueError:
            match = None
        if match is None:
            seconds.append(text)
            continue
        whole = 3600 * int(match["hour"]) + 60 * int(match["minute"]) + int(match["second"])
        whole -= _seconds_ahead(match)
        if day is None:
            whole = whole % _DAY if match["ahead"] else whole
            days += last - whole > _DAY // 2
            last = whole
        else:
            whole += day * _DAY
            first_day = whole // _DAY if first_day is None else first_day
            days = -first_day
        parts = f".{match['parts']}" if match["parts"] else ""
        seconds.append(_joined(days * _DAY + whole, parts))
    return seconds


def _seconds_ahead(match: re.Match[str]) -> int:
    """Return the difference between the zone of a clock time and UTC [s]."""
    ahead = match["ahead"]
    minutes = 60 * int(ahead[1:]) + int(match["rest"] or 0) if ahead else 0
    return -60 * minutes if ahead and ahead[0] == "-" else 60 * minutes


def _joined(whole: int, parts: str) -> str:
    """Return whole seconds and the decimals after them as one number, also below zero."""
    return f"{whole}{parts}" if whole >= 0 else str(whole + Decimal(parts or "0"))


def _ordinal(text: str) -> int:
    parts = [int(part) for part in re.split("[-/.]", text)]
    year, month, day = parts[::-1] if "." in text else parts
    return datetime(year, month, day, tzinfo=UTC).toordinal()


def decimals_of_second(name: str) -> int:
    """Return 3, 6 or 9 if the name of a column says milli-, micro- or nanoseconds, else 0.

    Examples
    --------
    >>> [decimals_of_second(name) for name in ("timeMs", "t [us]", "millis", "time_s", "items")]
    [3, 6, 3, 0, 0]
    """
    match = _PARTS.search(_in_words(name))
    if match is None:
        return 0
    part = match[1].lower()
    if part[0] == "m" and not part.startswith("mic"):
        return 3
    return 9 if part[0] == "n" else 6


def _in_words(name: str) -> str:
    """Return a name with a blank before capital letters inside a word: `timeMs`, but not `mS`."""
    return re.sub(r"(?<=[a-z]{2})(?=[A-Z])(?!(?<=[mun])S)", " ", name.strip())


def other_time_units(name: str) -> str:
    """Return units in the name of a column of times that are not seconds or their parts, or "".

    Seconds and their parts stand at the end of the name. Anything else in brackets is taken as
    units, and so is a word for another unit of time.

    Examples
    --------
    >>> [other_time_units(name) for name in ("time_s", "Zeit (ms)", "Time [h]", "elapsed_ms_total")]
    ['', '', 'h', 'ms']
    """
    words = _in_words(name)
    end = _PARTS.search(words) or _SECONDS.search(words)
    rest = words[: end.start()] if end else words
    units = [] if end else _IN_BRACKET.findall(rest)
    units += [word for word in re.split(r"[\W_]+", rest) if _OTHER_TIMES.fullmatch(word)]
    return units[0] if units else ""


def are_even_steps(values: Float) -> bool:
    """Return True if ten numbers or more rise by steps that differ by less than a tenth.

    Examples
    --------
    >>> are_even_steps(0.01 * np.arange(10.0)), are_even_steps(np.arange(3.0))
    (True, False)
    """
    if values.size < _FEWEST_TIMES:
        return False
    steps = np.diff(values)
    return bool(steps.min() > 0.0 and steps.max() < 1.1 * steps.min())


def in_seconds(token: bytes, power: int) -> bytes:
    """Return a printed time in parts of a second as a number of seconds with as many digits.

    Examples
    --------
    >>> in_seconds(b"10.5", 3), in_seconds(b"1e4", 6)
    (b'10.5e-3', b'1e-2')
    """
    digits, _, exponent = token.strip().lower().partition(b"e")
    return b"%se%d" % (digits, int(exponent or 0) - power)


def utc_time(date: tuple[int, int, int], hour: int, minute: int, second: str) -> str:
    """Return a time (ISO 8601, UTC) with its seconds as printed; empty if the time is invalid.

    Parameters
    ----------
    date : tuple of int
        Year, month and day; month 0 means that the day is the day of the year.
    hour, minute : int
        Time of the day.
    second : str
        Seconds as printed.

    Examples
    --------
    >>> utc_time((2019, 7, 6), 3, 19, "40.04"), utc_time((1989, 0, 291), 0, 4, "5.120")
    ('2019-07-06T03:19:40.04Z', '1989-10-18T00:04:05.120Z')
    >>> utc_time((2019, 13, 6), 3, 19, "40")
    ''
    """
    whole, point, rest = second.strip().partition(".")
    year, month, day = date
    try:
        first = datetime(year, month or 1, 1, hour, minute, int(whole), tzinfo=UTC)
        start = first + timedelta(days=day - 1)
    except (ValueError, OverflowError):
        return ""
    if start.year != year or (month and start.month != month):
        return ""
    return f"{start:%Y-%m-%dT%H:%M:%S}{point}{rest}Z"


def parse_utc(text: str, form: str, fraction: str = "", hours_ahead: int = 0) -> str:
    """Return a time (ISO 8601, UTC); empty if the text does not have the form.

    Parameters
    ----------
    text, form : str
        Time to the second, and its form for `datetime.strptime`.
    fraction : str
        Decimals of the second as printed, with the point.
    hours_ahead : int
        Difference between the local time and UTC [h].

    Examples
    --------
    >>> parse_utc("2018/02/06-23:50:42", "%Y/%m/%d-%H:%M:%S", ".5", hours_ahead=8)
    '2018-02-06T15:50:42.5Z'
    """
    try:
        moment = datetime.strptime(text, form).replace(tzinfo=UTC) - timedelta(hours=hours_ahead)
    except (ValueError, OverflowError):
        return ""
    return f"{moment:%Y-%m-%dT%H:%M:%S}{fraction}Z"


def even_time_step(
    path: Path,
    times: Float,
    printed: Callable[[], list[bytes]],
    first_line: int,
    given: float | None = None,
    *,
    single: bool = True,
) -> float:
    """Return the time step of evenly spaced printed times [s].

    Each time must equal the first time plus a whole number of steps, within the printed resolution.
    The times are compared as exact values; if no step fits, as rounded values; then as truncated
    values; and otherwise as values of single precision, if that is much finer than the steps.
    Among the steps that fit, the shortest decimal is chosen. If this decimal
    needs at least two more digits than are printed, and exactly one whole sampling rate [Hz] fits,
    the step is the reciprocal of that rate (for example 1/240 s with four decimals).

    Parameters
    ----------
    times : array, shape (samples,)
        Two or more finite times [s], one per line.
    printed : callable
        Returns the times as printed; called only if the parsed times are uneven.
    first_line : int
        Line number of the first time.
    given : float, optional
        Time step stated by the user [s]; returned if it fits.
    single : bool
        False if the times are those of a clock or counter, which have no single precision.

    Raises
    ------
    InputError
        If the times do not increase, are uneven, or do not fit the user's time step.

    Examples
    --------
    >>> printed = [f"{i / 240:.4f}".encode() for i in range(4000)]
    >>> times = np.array(printed, dtype=float)
    >>> even_time_step(Path("motion.csv"), times, lambda: printed, 2) == 1 / 240
    True
    """
    _require_increase(path, times, first_line)
    largest = np.maximum(np.abs(times), abs(times[0]))
    low, high = _fitting_steps(times, _DOUBLE * largest)
    if low[-1] <= high[-1]:
        return _step(path, (float(low[-1]), float(high[-1])), _MOST_DECIMALS, given)
    places = np.array([_decimals(token) for token in printed()], dtype=np.float64)
    units = 10.0**-places
    _require_resolution(path, times, units, first_line)
    slacks = [0.5 * units, units]
    in_single = _SINGLE * largest
    if single and units.min() < 1.0 and in_single.max() < _FINE * float(np.median(np.diff(times))):
        slacks += [np.maximum(slack, in_single) for slack in slacks]
    for slack in slacks:
        low, high = _fitting_steps(times, slack + _DOUBLE * largest)
        if low[-1] <= high[-1]:
            return _step(path, (float(low[-1]), float(high[-1])), int(places.max()), given)
    where = int(np.flatnonzero(low > high)[0]) + 1
    step = 0.5 * (low[where - 2] + high[where - 2])
    raise _uneven(path, times, where, float(times[0] + where * step), first_line)


def _require_increase(path: Path, times: Float, first_line: int) -> None:
    still = np.flatnonzero(times[1:] <= times[:-1])
    if still.size:
        where = int(still[0]) + 1
        message = f"time {_shown(times[where])} s after {_shown(times[where - 1])} s."
        message = f"{message} Must increase."
        raise InputError(path, message, first_line + where)


def _require_resolution(path: Path, times: Float, units: Float, first_line: int) -> None:
    """Reject uneven times whose rounding could hide a lost sample."""
    steps = np.diff(times)
    typical = float(np.median(steps))
    odd = np.flatnonzero(np.abs(steps - typical) > 0.5 * units[1:])
    if odd.size and float(np.median(units)) > typical / 3.0:
        where = int(odd[0]) + 1
        raise _uneven(path, times, where, float(times[where - 1] + typical), first_line)


def _fitting_steps(times: Float, slack: Float) -> tuple[Float, Float]:
    """Return bounds of the steps that fit the first 2, 3, ... times, shape (times - 1,) each."""
    count = np.arange(1, times.size)
    shift = times[1:] - times[0]
    low = np.maximum.accumulate((shift - slack[1:]) / count)
    high = np.minimum.accumulate((shift + slack[1:]) / count)
    return low, high


def _step(path: Path, fitting: tuple[float, float], places: int, given: float | None) -> float:
    low, high = fitting
    if given is None:
        return _simplest(low, high, places)
    if low * (1.0 - _SAME_STEP) <= given <= high * (1.0 + _SAME_STEP):
        return given
    message = (
        f"time step {given!r} s given, but the times state {_simplest(low, high, places)!r} s."
    )
    raise InputError(path, message)


def _simplest(low: float, high: float, places: int) -> float:
    middle = 0.5 * (low + high)
    decimals, step = _shortest_decimal(low, high)
    if decimals > places + 1 and middle > _SHORTEST_STEP:
        rate = round(1.0 / middle)
        others = (rate - 1, rate + 1)
        if _fits(rate, low, high) and not any(_fits(other, low, high) for other in others):
            return 1.0 / rate
    return step


def _fits(rate: int, low: float, high: float) -> bool:
    return rate > 0 and low <= 1.0 / rate <= high


def _shortest_decimal(low: float, high: float) -> tuple[int, float]:
    """Return the shortest decimal between the bounds, as close as possible to their middle."""
    middle = 0.5 * (low + high)
    for decimals in range(_MOST_DECIMALS):
        step = round(middle, decimals)
        if low <= step <= high:
            return decimals, step
    return _MOST_DECIMALS, middle


def _uneven(path: Path, times: Float, where: int, expected: float, first_line: int) -> InputError:
    message = f"time {_shown(times[where])} s after {_shown(times[where - 1])} s."
    must = f"Must be {_shown(expected, 6)} s: even steps, printed finely enough to show them."
    return InputError(path, f"{message} {must}", first_line + where)


def _shown(time: float, digits: int = 12) -> str:
    """Return a time in words; long ones, such as seconds since 1970, with their decimals."""
    return f"{time:.{digits if abs(time) < 1e3 else 15 if abs(time) > 1e6 else 12}g}"


def _decimals(token: bytes) -> int:
    """Return the number of decimals; negative if the last printed digit is above the units."""
    digits, _, exponent = token.strip().lower().partition(b"e")
    point = digits.find(b".")
    places = len(digits) - point - 1 if point >= 0 else 0
    # A zero may be printed with any exponent.
    return max(-30, min(places - int(exponent[:6] or 0), 300))


def even_samples(
    path: Path, times: Float, samples: Float, first_line: int, given: float | None
) -> tuple[float, Float, str]:
    """Return time step [s], even samples, and a note if the times were uneven.

    Points of digitised film are uneven. They are interpolated linearly at the longest usual step
    that is not longer than the steps of the points.

    Raises
    ------
    InputError
        If the times do not increase, if a gap is longer than four steps, or if only a few times are
        uneven, as in a corrupted file.

    Examples
    --------
    >>> times = np.array([0.0, 0.01, 0.03, 0.04, 0.06, 0.07, 0.09, 0.10, 0.12, 0.13])
    >>> step, samples, note = even_samples(Path("a"), times, times, 1, None)
    >>> step, samples.size, note
    (0.01, 14, 'archive: uneven points, interpolated linearly at 0.01 s')
    """
    _require_increase(path, times, first_line)
    steps = np.diff(times)
    mean = float(times[-1] - times[0]) / (times.size - 1)
    drift = np.abs(times - times[0] - mean * np.arange(times.size))
    unit = 0.001
    if drift.max() <= unit or (np.abs(steps - np.median(steps)) > 0.5 * unit).sum() < _FEW:
        tokens = [f"{time:.3f}".encode() for time in times]
        return even_time_step(path, times, lambda: tokens, first_line, given), samples, ""
    if steps.max() > _LONGEST_GAP * mean:
        where = int(steps.argmax()) + 1
        raise _uneven(path, times, where, float(times[where - 1] + mean), first_line)
    step = max((usual for usual in _USUAL_STEPS if usual <= 1.001 * mean), default=mean)
    grid = times[0] + step * np.arange(int((times[-1] - times[0]) / step + _SAME_STEP) + 1)
    note = f"archive: uneven points, interpolated linearly at {step:g} s"
    return step, np.interp(grid, times, samples), note
