"""Column headers of number tables: quantities and units."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rockframe.errors import InputError, OtherQuantityError
from rockframe.ingest.identify import direction
from rockframe.record import Orientation
from rockframe.units import ACCELERATION_UNITS

#: Quantity of a column, by the first word of its name.
_QUANTITIES: Final = {
    **dict.fromkeys(["t", "time"], "time"),
    **dict.fromkeys(["a", "acc", "accel", "acceleration"], "acceleration"),
    **dict.fromkeys(["v", "vel", "velocity"], "velocity"),
    **dict.fromkeys(["d", "disp", "displacement"], "displacement"),
}
#: Labels of columns that are not directions.
_LABEL: Final = re.compile(r"[xyzlth]\d?|\d", re.I)
_TIME_UNITS: Final = frozenset(["", "s", "sec", "second", "seconds"])
#: End of the name of a column of times in any language, if the column of acceleration is chosen.
_SECONDS: Final = re.compile(r"[\[(]\s*s(ec(onds?)?)?\s*[\])]$", re.I)
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
COMMAS: Final = "If commas are decimal commas, separate the columns with semicolons."
_CHOOSE: Final = "Choose one with --column NAME."


def split_fields(line: str) -> list[str]:
    """Return the fields of a line, separated by semicolons, commas or blanks, in this order.

    Commas in fields between semicolons are decimal commas.

    Examples
    --------
    >>> split_fields("0.01, 0.2"), split_fields(" 0.01 0.2"), split_fields("0,01; 0,2")
    (['0.01', ' 0.2'], ['0.01', '0.2'], ['0.01', ' 0.2'])
    """
    if ";" in line:
        return line.replace(",", ".").split(";")
    return line.split(",") if "," in line else line.split()


def is_row(line: str) -> bool:
    """Return True if all fields of a line are numbers, including NaN and infinity.

    Examples
    --------
    >>> is_row("0.01,nan"), is_row("San Fernando, 164")
    (True, False)
    """
    try:
        return bool([float(field) for field in split_fields(line)])
    except ValueError:
        return False


def column_names(line: str) -> list[str]:
    """Return the column names in a line, or an empty list if it is not a line of names.

    Examples
    --------
    >>> column_names("time [s]  acc (g)"), column_names("0.00  0.1")
    (['time[s]', 'acc(g)'], [])
    """
    if is_row(line) or not re.match(r"\s*\"?[^\W\d_]", line):
        return []
    # A bracket belongs to the preceding word.
    joined = re.sub(r"\s+(?=[\[(])", "", line)
    return [name.strip().strip('"') for name in split_fields(joined)]


def is_known(name: str) -> bool:
    """Return True if a column name is a time, acceleration, velocity, displacement or direction.

    Examples
    --------
    >>> is_known("acc_g"), is_known("NS"), is_known("station")
    (True, True, False)
    """
    return bool(_column(name).quantity)


def units_in(comment: str) -> str | None:
    """Return the acceleration units stated in a comment, or None.

    Comments about a conversion are ignored: their units may apply before or after it.

    Examples
    --------
    >>> units_in("# Acceleration [cm/s^2]"), units_in("# units: GAL"), units_in("# in counts")
    ('cm/s2', 'gal', None)
    """
    comment = comment.replace("²", "2")
    found = None if re.search("convert|origin", comment, re.I) else _IN_WORDS.search(comment)
    return found and _SPELLINGS.get(re.sub(r"[\s^*]", "", found["units"].lower()))


@dataclass(frozen=True)
class Columns:
    """Meaning of the columns of a table.

    Parameters
    ----------
    time : int or None
        Index of the column of times.
    accelerations : mapping of int to str
        Name of the component of each column of acceleration; empty for a single column without
        name.
    units : str or None
        Units of the accelerations.
    """

    time: int | None
    accelerations: dict[int, str]
    units: str | None


def read_headers(
    path: Path, names: list[str], columns: int, line: int, chosen: str | None = None
) -> Columns:
    """Return the meaning of the columns of a table, and the acceleration units if stated.

    Parameters
    ----------
    names : list of str
        Column names. If empty, the columns are time and acceleration, or only acceleration.
    columns : int
        Number of columns.
    line : int
        Line number of the names, or of the first row if there are no names.
    chosen : str, optional
        Name or number of the column of acceleration.

    Raises
    ------
    InputError
        If the columns are not time and acceleration, or if their units are unknown.

    Examples
    --------
    >>> read_headers(Path("motion.csv"), ["time_s", "acc_cm_s2"], 2, 1)
    Columns(time=0, accelerations={1: ''}, units='cm/s2')
    >>> read_headers(Path("motion.csv"), ["Time", "NS [g]", "EW [g]"], 3, 1).accelerations
    {1: 'NS', 2: 'EW'}
    """
    if names and len(names) != columns:
        message = f"{columns} columns under {len(names)} names ({','.join(names)})."
        message += f" {COMMAS}" if columns == 2 * len(names) else ""
        raise InputError(path, message, line=line)
    found = [_column(name) for name in names]
    if chosen is not None:
        place = _chosen(path, names, columns, line, chosen)
        times = [k for k, one in enumerate(found) if one.quantity == "time"]
        times = times or [k for k, name in enumerate(names) if _SECONDS.search(name)]
        time = times[0] if times else None if names or not place else 0
        stated = found[place] if names else _Column("acceleration")
        if stated.quantity in {"time", "velocity", "displacement"} and not stated.vertical:
            message = f"column {names[place]!r} is a {stated.quantity}, not an acceleration."
            raise InputError(path, message, line=line)
        return Columns(time, {place: stated.component}, _units(path, [stated], line))
    if not names:
        if columns > 2:
            message = f"{columns} columns without names. {_MUST} {_CHOOSE}"
            message += f" {COMMAS}" if columns == 4 else ""
            raise InputError(path, message, line=line)
        return Columns(0 if columns == 2 else None, {columns - 1: ""}, None)
    return _read_names(path, names, found, line)


def _read_names(path: Path, names: list[str], found: list[_Column], line: int) -> Columns:
    directions = sum(one.quantity == "direction" for one in found)
    meant = {
        k: one
        for k, one in enumerate(found)
        if one.quantity in {"acceleration", "direction"} or (one.vertical and directions > 1)
    }
    for name, one in zip(names, found, strict=True):
        if one.quantity in {"velocity", "displacement"} and not meant:
            message = f"column {name!r} is a {one.quantity}, not an acceleration."
            raise OtherQuantityError(path, message, line)
    times = [k for k, one in enumerate(found) if one.quantity == "time"]
    shown, components = ",".join(names), [one.component for one in meant.values()]
    if len(meant) > 1 and ("" in components or len({*components}) < len(components)):
        message = f"columns {shown!r}: {len(meant)} accelerations of the same direction or of none."
        raise InputError(path, f"{message} {_CHOOSE}", line=line)
    if not meant or len(times) > 1 or len(meant) + len(times) < len(names):
        raise InputError(path, f"columns {shown!r}. {_MUST} {_CHOOSE}", line=line)
    for k in times:
        if found[k].units not in _TIME_UNITS:
            raise InputError(path, f"time in units of {found[k].units!r}. Must be seconds.", line)
    units = _units(path, list(meant.values()), line)
    return Columns(times[0] if times else None, dict(zip(meant, components, strict=True)), units)


def _chosen(path: Path, names: list[str], columns: int, line: int, chosen: str) -> int:
    """Return the index of the chosen column."""
    folded = [re.sub(r"\s", "", name).casefold() for name in names]
    wanted = re.sub(r"\s", "", chosen).casefold()
    if folded.count(wanted) == 1:
        return folded.index(wanted)
    if re.fullmatch(r"\d{1,4}", wanted, re.ASCII) and 1 <= int(wanted) <= columns:
        return int(wanted) - 1
    known = ", ".join(names) or f"1 to {columns}"
    raise InputError(path, f"no column {chosen!r}. Must be one of: {known}.", line=line)


def _units(path: Path, columns: list[_Column], line: int) -> str | None:
    stated = {one.units for one in columns}
    for units in sorted(stated):
        if len(stated) > 1 or (units and units not in _SPELLINGS):
            known = ", ".join(ACCELERATION_UNITS)
            message = f"acceleration units {units!r}. Must be one of: {known}."
            if len(stated) > 1:
                message = f"accelerations in different units ({', '.join(sorted(stated))})."
            raise InputError(path, message, line=line)
    return _SPELLINGS.get(min(stated))


@dataclass(frozen=True)
class _Column:
    """Quantity, component and units in the name of a column; empty if not stated."""

    quantity: str
    component: str = ""
    units: str = ""
    vertical: bool = False


def _column(name: str) -> _Column:
    """Split a column name: `acc_cm_s2`, `NS [g]`, `acc EW (gal)`."""
    words = re.sub(r"[\s_\[\]()]+", " ", name).strip().split(" ")
    quantity = _QUANTITIES.get(words[0].lower(), "")
    # A direction is a name by itself, or follows the word for acceleration; V may be a velocity.
    rest = words[1:] if quantity else words
    component = ""
    if rest and quantity in {"", "acceleration"} and _is_direction(rest[0]):
        quantity, component, rest = quantity or "direction", rest[0], rest[1:]
    elif not quantity or (rest and _LABEL.fullmatch(rest[0])):
        rest = rest[1:]
    units = re.sub(r"[\s^]|\*\*", "", "".join(rest).lower().replace("²", "2"))
    vertical = words[0] == "V"
    return _Column(quantity, component or ("V" if vertical else ""), units, vertical)


def _is_direction(word: str) -> bool:
    """Return True if a word states a direction; a number must have three digits."""
    stated = direction(word)[0] is not Orientation.UNSTATED
    return stated and (not word.isdigit() or len(word) == 3)
