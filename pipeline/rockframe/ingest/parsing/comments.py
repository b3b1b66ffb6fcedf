"""Statements in comments and titles above the numbers of a text: time steps, other quantities."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final

_UNIT: Final = (
    r"(?P<unit>(?:m|[u\u00b5\u03bcn])s(?:ecs?)?|(?:milli|micro|nano)?sec(?:onds?|s)?|s)(?!\w)"
)
#: A number, also `0,01` and `1/200`; no part of a longer one, such as `1,000` or `3/400`.
_STEP: Final = (
    r"(?P<step>1\s?/\s?\d{1,5}(?:\.\d+)?|0,\d+|\d*\.?\d+(?:e[-+]?\d{1,2})?)"
    r"(?!\d|[.,]\d|\s?/\s?[\d.])"
)
#: Words after a number that is no time step in seconds.
_NO_STEP: Final = (
    r"(?:%|(?:min(?:utes?)?|h|hrs?|hours?|days?|[cmk]?m|[km]?hz|of|samples?|points?|deg\w*)\b)"
)
#: Time steps in a comment or title: by a name of the step, or as the interval of even points.
_STATED_STEPS: Final = (
    re.compile(
        r"\b(?:dt|\u0394t|delta[ _-]?t|(?:time|fixed|sampl(?:e|ing))[ _-]?(?:step|interval"
        rf"|increment|period|spacing))\b\s*(?:[\[(]\s*{_UNIT.replace('unit', 'before')}\s*[\])])?"
        rf"\s*(?:[:=]|\bis\b|\bof\b)?\s*{_STEP}(?:\s*{_UNIT}|(?!\w|\s*{_NO_STEP}))",
        re.I,
    ),
    re.compile(rf"\b(?:spaced|intervals?|every)\s+(?:(?:at|of|by|is)\s+)?{_STEP}\s*{_UNIT}", re.I),
)
_RATE: Final = (
    r"(?<!\d)(?<!\d[.,/])(?P<rate>\d{1,5}(?:\.\d{1,6})?)(?!\d|[.,]\d|\s?/\s?[\d.])"
    r"(?!\s*(?:[kmg]hz|bits?|m?s(?:ec(?:onds?)?)?|min(?:utes?)?)\b)"
)
_STATED_RATES: Final = (
    re.compile(
        rf"\bsampl(?:e|ing)[ _]?(?:rate|freq\w*)\b[^\d\n]{{0,14}}{_RATE}(?=\s|$|[,;]|Hz)", re.I
    ),
    re.compile(rf"\bfs\s*[:=]\s*{_RATE}(?=\s*(?:Hz|$|[,;]))"),
    re.compile(rf"\b{_RATE}\s*(?:sps|samples?\s*(?:per|/)\s*s(?:ec(?:ond)?)?)\b", re.I),
    re.compile(
        r"\b(?:points|samples|data|values|recorded|sampled|digiti[sz]ed)\s+at\s+"
        rf"{_RATE}\s*Hz",
        re.I,
    ),
)
#: Beginnings of units of time, with their short names and sizes [s].
_SIZES_OF_UNITS: Final = (
    *((mark, "us", 1e-6) for mark in ("mic", "u", "\u00b5", "\u03bc")),
    ("m", "ms", 1e-3),
    ("n", "ns", 1e-9),
    ("s", "s", 1.0),
)
#: Words of steps that the samples no longer have.
_FORMER: Final = re.compile(r"\b(?:original|raw)\b|resampl|decimat|interpolat", re.I)

_ORDERS: Final = ("first", "second", "third", "fourth", "fifth")
#: A column with its number, and what it holds.
_NUMBER: Final = (
    r"(?:\bcol(?:umn)?\b\.?\s*#?(?P<number>\d{1,3})"
    rf"|\b(?P<order>\d{{1,3}}(?=st|nd|rd|th)|{'|'.join(_ORDERS)})(?:st|nd|rd|th)?\s+col(?:umn)?)"
    r"\s*(?:[:=]|-\s|\bis\b)"
)
_COLUMN: Final = re.compile(rf"{_NUMBER}(?P<holds>.*)", re.I)
_NEXT: Final = re.compile(rf"(?={re.sub('[?]P<[a-z]+>', '?:', _NUMBER)})", re.I)
_COLUMNS: Final = re.compile(r"^\W*col(?:umn)?s\s*[:=](?P<holds>.+)$", re.I)
_VELOCITY: Final = r"vel(?:ocit(?:y|ies))?|displ?(?:acements?)?"
_ITS_UNITS: Final = (
    r"\b(?:cm|mm|m|in|ft)/s(?:ec)?(?!\s?[/^*\d\u00b2]|\w)|[\[(](?:cm|mm|m|in|ft)[\])]"
)
_NO_ACCELERATION: Final = re.compile(rf"\b(?:{_VELOCITY})\b|{_ITS_UNITS}", re.I)
_ACCELERATION: Final = re.compile(r"\bacc", re.I)
#: Words of a title without which the numbers below it cannot be understood.
_POWER: Final = r"[x\u00d7*]\s?1(?:0(?:\s?(?:\^|\*\*)\s?|(?=[-+]))|(?:\.0*)?e)[-+]?\d"
_SCALE_IN_TITLE: Final = re.compile(
    r"\b(scal(?:e|ing)|calibration|conversion|factors?|sensitivity|gain|counts?|lsb|volts?"
    rf"|multipl(?:y|ier))\b|\bsf\W{{0,3}}\d|{_POWER}",
    re.I,
)
_OTHER_IN_TITLE: Final = re.compile(rf"\b(?:{_VELOCITY}|spectr(?:um|a|al))\b|{_ITS_UNITS}", re.I)
#: Words for accelerations whose spectrum fits another one.
_MATCHED: Final = re.compile(r"\bmatched to (?:\w+ ){0,3}spectr(?:um|a)\b", re.I)
#: The same in comments, which more often describe how the numbers came about.
_SCALE_IN_COMMENT: Final = re.compile(
    rf"\b(scal(?:e|ing)|factors?|multipl(?:y|ier))\b|\bsf\s?[:=]\s?\d|{_POWER}", re.I
)
_OTHER_IN_COMMENT: Final = re.compile(
    rf"^\W*(?:(?:units?|time|s(?:ec)?)\W+){{0,3}}(?:{_VELOCITY})\b"
    r"(?:\s+(?:time\s+history|in|of)\b)?\W*(?:(?:cm|mm|m|in|ft)\b.*)?$",
    re.I,
)
_PAST: Final = re.compile(r"convert|origin|applied|divided|multiplied|correct", re.I)
#: Units of a velocity or a displacement, perhaps after that of time.
_UNITS: Final = re.compile(
    r"^\W*units?\b\s*(?:[:=]|\bin\b|\bare\b|\bis\b)?\s*(?:s(?:ec)?\W+)?"
    r"(?:cm|mm|m|in|ft)(?:/s(?:ec)?)?\W*$",
    re.I,
)


def stated_steps(text: str) -> list[tuple[str, float]]:
    """Return the time steps that a comment or title states, in words and in seconds.

    A step that is 0, or at a rate of 0, is 0.

    Examples
    --------
    >>> stated_steps("# 60 points at 50 Hz, DT = 20 ms"), stated_steps("# filtered at 50 Hz")
    ([('dt 20 ms', 0.02), ("'points at 50 Hz'", 0.02)], [])
    >>> stated_steps("Sampling interval: 1/200 s"), stated_steps("Sampling rate: 1,000 Hz")
    ([('dt 1/200 s', 0.005)], [])
    """
    if _FORMER.search(text):
        return []
    steps = []
    for match in filter(None, (pattern.search(text) for pattern in _STATED_STEPS)):
        unit = (match["unit"] or match.groupdict().get("before") or "s").lower()
        unit, size = next(
            (name, size) for mark, name, size in _SIZES_OF_UNITS if unit.startswith(mark)
        )
        numerator, _, divisor = match["step"].replace(",", ".").partition("/")
        rate = float(divisor or 1.0)
        step = float(numerator) / rate * size if rate > 0.0 else 0.0
        steps.append((f"dt {match['step']} {unit}", step))
    for match in filter(None, (pattern.search(text) for pattern in _STATED_RATES)):
        rate = float(match["rate"])
        steps.append((repr(match[0].strip()), 1.0 / rate if rate > 0.0 else 0.0))
    return steps


def other_quantity(comment: str, columns: Collection[int], width: int) -> str:
    """Return the words that state another quantity than accelerations of columns, or "".

    Parameters
    ----------
    comment : str
        A comment or title.
    columns : collection of int
        Numbers of the columns that are read, as the file counts them.
    width : int
        Number of columns in the file.

    Examples
    --------
    >>> lines = ("# Column 3: velocity (m/s)", "# Columns: time acc vel", "# units: cm/s")
    >>> [other_quantity(line, [3], 3) for line in lines]
    ['Column 3: velocity (m/s)', 'vel', 'units: cm/s']
    >>> other_quantity(lines[0], [2], 3), other_quantity("# Column 3 of a velocity array", [3], 3)
    ('', '')
    """
    if _UNITS.search(comment):
        return comment.strip().lstrip("#%").strip()
    for match in filter(None, map(_COLUMN.match, _NEXT.split(comment))):
        order = (match["number"] or match["order"]).lower()
        number = int(order) if order.isdigit() else _ORDERS.index(order) + 1
        if number in columns and _is_other(match["holds"]):
            return match[0].strip(" ,;")
    listed = _COLUMNS.search(comment)
    if not listed:
        return ""
    holds = [word for word in re.split(r"[\s,;|]+", listed["holds"]) if word]
    if len(holds) == width:
        return next((holds[k - 1] for k in columns if _is_other(holds[k - 1])), "")
    return comment.strip() if _is_other(listed["holds"]) else ""


def names_acceleration(text: str) -> bool:
    """Return True if a text has a word that begins with `acc`."""
    return bool(_ACCELERATION.search(text))


def word_of_scale(line: str, is_title: bool) -> str:
    """Return the word of a title or comment that states a scale of the numbers, or "".

    Examples
    --------
    >>> word_of_scale("# scale 0.5", False), word_of_scale("# scaled; scale 0.5 applied", False)
    ('scale', '')
    """
    match = (_SCALE_IN_TITLE if is_title else _SCALE_IN_COMMENT).search(line)
    if not match or not re.search(r"\d", line) or (not is_title and _PAST.search(line)):
        return ""
    return match[0].strip()


def word_of_other(line: str, is_title: bool) -> str:
    """Return the word of a title or comment that states another quantity, of all columns, or "".

    Examples
    --------
    >>> word_of_other("Velocity of the table", True), word_of_other("matched to a spectrum", True)
    ('Velocity', '')
    """
    pattern = _OTHER_IN_TITLE if is_title else _OTHER_IN_COMMENT
    match = pattern.search(_MATCHED.sub("", line))
    return match[0].strip() if match else ""


def _is_other(words: str) -> bool:
    return bool(_NO_ACCELERATION.search(words)) and not names_acceleration(words)
