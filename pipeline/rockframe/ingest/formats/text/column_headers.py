"""Column headers of number tables: quantities and units."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, OtherQuantityError
from rockframe.units import ACCELERATION_UNITS

#: Quantity of a column, by the first word of its name.
_QUANTITIES: Final = {
    **dict.fromkeys(["t", "time"], "time"),
    **dict.fromkeys(["a", "acc", "accel", "acceleration"], "acceleration"),
    **dict.fromkeys(["v", "vel", "velocity"], "velocity"),
    **dict.fromkeys(["d", "disp", "displacement"], "displacement"),
}
_TIME_UNITS: Final = frozenset(["", "s", "sec", "second", "seconds"])
_PER_SECOND_SQUARED: Final = ("s2", "/s2", "s-2", "/s/s", "/sec2", "/sec/sec")
#: Units by their spelling in column names, without blanks, underscores and carets.
_SPELLINGS: Final = {
    "g": "g",
    "gal": "gal",
    **{f"cm{per}": "cm/s2" for per in _PER_SECOND_SQUARED},
    **{f"mm{per}": "mm/s2" for per in _PER_SECOND_SQUARED},
    **{f"m{per}": "m/s2" for per in _PER_SECOND_SQUARED},
}
#: Units in a sentence, after the word "units" or "acceleration".
_IN_WORDS: Final = re.compile(
    r"\b(?:units?|acc(?:el(?:eration)?)?)\b(?:\s+(?:of|in|is|are|units?|acceleration)\b)*[\s:=.\[(]*"
    r"(?P<units>(?:cm|mm|m)\s?/\s?s(?:ec)?(?:(?:\^|\*\*)?2|\s?/\s?s(?:ec)?)|[cm]?m\ss\^?-2|gal|g)"
    r"(?![\w/^*-])",
    re.I,
)
_MUST: Final = "Must be time and acceleration, as in 'time_s,acc_g', or acceleration alone."


def fields_of(line: str) -> list[str]:
    """Return the fields of a line, separated by commas if it has any, otherwise by blanks.

    Examples
    --------
    >>> fields_of("0.01, 0.2"), fields_of(" 0.01 0.2")
    (['0.01', ' 0.2'], ['0.01', '0.2'])
    """
    return line.split(",") if "," in line else line.split()


def is_row(line: str) -> bool:
    """Return whether all fields of a line are numbers, including NaN and infinity.

    Examples
    --------
    >>> is_row("0.01,nan"), is_row("San Fernando, 164")
    (True, False)
    """
    try:
        return bool([float(field) for field in fields_of(line)])
    except ValueError:
        return False


def column_names(line: str) -> list[str]:
    """Return the column names in a line, or an empty list if it is not a line of names.

    Examples
    --------
    >>> column_names("time [s]  acc (g)"), column_names("0.00  0.1")
    (['time[s]', 'acc(g)'], [])
    """
    if is_row(line) or not re.match(r"\s*\"?[A-Za-z]", line):
        return []
    # A bracket belongs to the preceding word.
    joined = re.sub(r"\s+(?=[\[(])", "", line)
    return [name.strip().strip('"') for name in fields_of(joined)]


def is_known(name: str) -> bool:
    """Return whether a column name is a time, acceleration, velocity or displacement.

    Examples
    --------
    >>> is_known("acc_g"), is_known("station")
    (True, False)
    """
    return _split_name(name)[0] in _QUANTITIES


def units_in(comment: str) -> str | None:
    """Return the acceleration units stated in a comment, or None.

    Comments about a conversion are ignored, because their units may be those before or after it.

    Examples
    --------
    >>> units_in("# Acceleration [cm/s^2]"), units_in("# units: GAL"), units_in("# in counts")
    ('cm/s2', 'gal', None)
    """
    found = None if re.search("convert|origin", comment, re.I) else _IN_WORDS.search(comment)
    return found and _SPELLINGS.get(re.sub(r"[\s^*]", "", found["units"].lower()))


def read_headers(
    path: Path, names: list[str], columns: int, line: int
) -> tuple[list[str], str | None]:
    """Return the quantity of each column of a table, and the acceleration units if stated.

    Parameters
    ----------
    names : list of str
        Column names. If empty, the columns are time and acceleration, or acceleration.
    columns : int
        Number of columns.
    line : int
        Line number of the names, or of the first row if there are no names.

    Returns
    -------
    quantities : list of str
        ``time`` or ``acceleration`` for each column.
    units : str or None
        Units of acceleration.

    Raises
    ------
    InputError
        If the columns are not time and acceleration, or their units are unknown.

    Examples
    --------
    >>> read_headers(Path("motion.csv"), ["time_s", "acc_cm_s2"], 2, 1)
    (['time', 'acceleration'], 'cm/s2')
    """
    if not names:
        if columns > 2:
            raise InputError(path, f"{columns} columns without names. {_MUST}", line=line)
        return ["time", "acceleration"][-columns:], None
    shown = ",".join(names)
    if len(names) != columns:
        message = f"{columns} columns under {len(names)} names ({shown}). Must be equal."
        raise InputError(path, message, line=line)
    words = [_split_name(name) for name in names]
    found = [_QUANTITIES.get(word, word) for word, _ in words]
    for name, quantity in zip(names, found, strict=True):
        if quantity in {"velocity", "displacement"} and "acceleration" not in found:
            raise OtherQuantityError(
                path, f"column {name!r} is a {quantity}. Must be an acceleration.", line=line
            )
    if sorted(found) not in (["acceleration"], ["acceleration", "time"]):
        raise InputError(path, f"columns {shown!r}. {_MUST}", line=line)
    units = dict(zip(found, (units for _, units in words), strict=True))
    return found, _units(path, units, line)


def _units(path: Path, units: dict[str, str], line: int) -> str | None:
    if units.get("time", "") not in _TIME_UNITS:
        raise InputError(path, f"time in units of {units['time']!r}. Must be seconds.", line=line)
    stated = units["acceleration"]
    if stated and stated not in _SPELLINGS:
        known = ", ".join(ACCELERATION_UNITS)
        message = f"acceleration units {stated!r}. Must be one of: {known}."
        raise InputError(path, message, line=line)
    return _SPELLINGS.get(stated)


def _split_name(name: str) -> tuple[str, str]:
    """Split a column name into quantity and units: `acc_cm_s2` -> `acc`, `cms2`."""
    word, _, units = re.sub(r"[\s_\[\]()]+", " ", name.lower()).strip().partition(" ")
    return word, re.sub(r"[\s^]|\*\*", "", units)
