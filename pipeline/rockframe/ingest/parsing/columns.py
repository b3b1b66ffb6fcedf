"""Meaning of the columns of number tables: from their names, or from their numbers.

Without names, a line may hold times and one acceleration, several pairs of them, values of several
channels at one time, or several values of one series.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from rockframe.errors import InputError, OtherQuantityError
from rockframe.ingest.identify import direction
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.timing import decimals_of_second
from rockframe.record import Orientation
from rockframe.units import ACCELERATION_UNITS

#: Quantity of a column, by the first word of its name.
_QUANTITIES: Final = {
    **dict.fromkeys(["t", "time"], "time"),
    **dict.fromkeys(["a", "acc", "accel", "acceleration"], "acceleration"),
    **dict.fromkeys(["ax", "ay", "az", "accx", "accy", "accz"], "acceleration"),
    **dict.fromkeys(["v", "vel", "velocity"], "velocity"),
    **dict.fromkeys(["d", "disp", "displacement"], "displacement"),
}
#: Labels of columns that are not directions.
_LABEL: Final = re.compile(r"[xyzlth]\d?|\d", re.I)
#: Pairs of horizontals that state no direction; beside them V is the vertical, not a velocity, and
#: T the transverse, not the time.
_SETS: Final = (frozenset(["H1", "H2"]), frozenset(["L", "T"]), frozenset(["X", "Y"]))
#: Channel codes of accelerometers, such as HNE.
_SEED: Final = re.compile(r"[HBECSG][NGL][ZNE123]")
#: Names of columns of row numbers.
_INDEX: Final = re.compile(
    r"(|index|idx|unnamed: ?\d+|no\.?|nr\.?|row|sample|samples|point|n|i|#)", re.I
)
_TIME_UNITS: Final = frozenset(["", "s", "sec", "second", "seconds"])
#: Units at the end of a name.
_BRACKET: Final = re.compile(r"[\[(]\s*([^\[\]()]*?)\s*[\])]\s*$")
#: End of the name of a column of times in any language, if the column of acceleration is chosen.
_SECONDS: Final = re.compile(r"[\[(]\s*s(ec(onds?)?)?\s*[\])]$", re.I)
_PER_SECOND_SQUARED: Final = ("s2", "/s2", "s-2", "/s/s", "/sec2", "/sec/sec", "/s/sec")
_LENGTHS: Final = {"cm": "cm", "mm": "mm", "m": "m", "in": "in", "inch": "in", "ft": "ft"}
#: Units by their spelling in column names, without blanks, underscores and carets.
_SPELLINGS: Final = {
    **{name: name for name in ("g", "gal", "mg", "%g")},
    "gals": "gal",
    "g's": "g",
    **{
        f"{length}{per}": f"{plain}/s2"
        for length, plain in _LENGTHS.items()
        for per in _PER_SECOND_SQUARED
    },
}
#: Units in a sentence, after the word "units" or "acceleration".
_IN_WORDS: Final = re.compile(
    r"\b(?:units?|acc(?:el(?:eration)?)?)\b(?:\s+(?:of|in|is|are|units?|acceleration)\b)*[\s:=.\[(]*"
    r"(?P<units>(?:cm|mm|m|in|ft)\s?/\s?s(?:ec)?(?:(?:\^|\*\*)?2|\s?/\s?s(?:ec)?)|[cm]?m\ss\^?-2"
    r"|gal|mg|%g|g)"
    r"(?![\w/^*-])",
    re.I,
)
#: Units of other columns of a table.
_OTHER_UNITS: Final = frozenset(
    ["v", "mv", "n", "kn", "-"]
    + [f"{length}{per}" for length in ("cm", "mm", "m", "in", "ft") for per in ("", "/s", "/sec")]
)
_MUST: Final = "Must be time and acceleration, as in 'time_s,acc_g', or acceleration alone."
COMMAS: Final = "If commas are decimal commas, separate the columns with semicolons."
_CHOOSE: Final = "Choose one with --column NAME, or several with --channels NAME=AZIMUTH."


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
    joined = re.sub(r"(?<!\s)\s+(?=[\[(])", "", line)
    return [name.strip().strip('"') for name in split_fields(joined)]


def is_known(name: str) -> bool:
    """Return True if a column name is a time, acceleration, velocity, displacement or direction.

    Examples
    --------
    >>> is_known("acc_g"), is_known("NS"), is_known("station")
    (True, True, False)
    """
    return bool(_column(name).quantity)


def is_index(name: str, numbers: Sequence[str]) -> bool:
    """Return True if a column has the name and the numbers of rows: whole, one after another.

    Examples
    --------
    >>> is_index("", ["0", "1", "2"]), is_index("time", ["0", "1", "2"])
    (True, False)
    """
    if not _INDEX.fullmatch(name.strip()) or not all(re.fullmatch(r"\d{1,9}", n) for n in numbers):
        return False
    first = int(numbers[0]) if len(numbers) > 1 else -1
    return first in (0, 1) and [*map(int, numbers)] == [*range(first, first + len(numbers))]


def is_unit(cell: str) -> bool:
    """Return True if a cell of a line of units is a unit of time or acceleration, or a dash.

    Examples
    --------
    >>> is_unit("(s)"), is_unit("[m/s^2]"), is_unit("NS")
    (True, True, False)
    """
    units = _spelling(cell.strip().strip("[]()"))
    known = _SPELLINGS.keys() | _OTHER_UNITS | _TIME_UNITS - {""}
    return units in known or (decimals_of_second(units) > 0 and units != "ns")  # north to south


def with_units(path: Path, names: Sequence[str], units: Sequence[str], line: int = 0) -> list[str]:
    """Return names of columns with the units that another line states for them.

    Raises
    ------
    InputError
        If a name states other units.

    Examples
    --------
    >>> with_units(Path("a.csv"), ["Time", "NS"], ["s", "(g)"])
    ['Time [s]', 'NS [g]']
    >>> with_units(Path("a.csv"), [], ["s", "g"])
    ['time [s]', 'acc [g]']
    """
    plain = [unit.strip().strip("[]()-") for unit in units]
    times = [unit.lower() in _TIME_UNITS or decimals_of_second(unit) > 0 for unit in plain]
    names = names or ["time" if is_time else "acc" for is_time in times]
    named = []
    for name, unit in zip(names, plain, strict=True):
        own, other = _column(name).units, _spelling(unit)
        is_stated = own != "" and is_unit(own)
        same = own == other or _SPELLINGS.get(own, own) == _SPELLINGS.get(other, other)
        if is_stated and unit and not (same or {own, other} <= _TIME_UNITS):
            message = f"column {name!r}, but {unit!r} in the line of units. State --skip-lines,"
            raise InputError(path, f"{message} --column and --units.", line)
        named.append(f"{name} [{unit}]" if unit and not is_stated and "[" not in name else name)
    return named


def units_in(comment: str) -> str | None:
    """Return the acceleration units stated in a comment, or None.

    Comments about a conversion are ignored: their units may apply before or after it.

    Examples
    --------
    >>> units_in("# Acceleration [cm/s^2]"), units_in("# units: GAL"), units_in("# in counts")
    ('cm/s2', 'gal', None)
    """
    comment = comment.replace("²", "2")
    if (alone := _spelling(comment.strip(" #%\t()[]"))) in _SPELLINGS:
        return _SPELLINGS[alone]
    match = None if re.search("convert|origin", comment, re.I) else _IN_WORDS.search(comment)
    return match and _SPELLINGS.get(re.sub(r"[\s^*]", "", match["units"].lower()))


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
    units_of : mapping of int to str or None
        Units of each column, where they may differ.
    """

    time: int | None
    accelerations: dict[int, str]
    units: str | None
    units_of: Mapping[int, str | None] = field(default_factory=dict, repr=False)


def read_headers(
    path: Path,
    names: list[str],
    columns: int,
    line: int,
    chosen: str | None = None,
    index: str | None = None,
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
    index : str, optional
        Name of the column of row numbers that was left out.

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
        message = f"{columns} column{'s' * (columns > 1)}, but {len(names)} in the line of names"
        hint = f" {COMMAS}" if columns == 2 * len(names) else ""
        raise InputError(path, f"{message} ({','.join(names)}).{hint}", line=line)
    headers = _columns(names)
    if chosen is not None:
        place = column_place(path, names, columns, line, chosen, index)
        times = [k for k, header in enumerate(headers) if header.quantity == "time"]
        times = times or [k for k, name in enumerate(names) if _SECONDS.search(name)]
        time = times[0] if times else None if names or not place else 0
        column = headers[place] if names else _Column("acceleration")
        if column.quantity in {"time", "velocity", "displacement"} and not column.vertical:
            message = f"column {names[place]!r} is a {column.quantity}, not an acceleration."
            raise InputError(path, message, line=line)
        return Columns(time, {place: column.component}, _units(path, [column], line))
    if not names:
        if columns > 2:
            commas = f" {COMMAS}" if columns == 4 else ""
            message = f"{columns} columns without names. {_MUST} {_CHOOSE}{commas}"
            raise InputError(path, message, line=line)
        return Columns(0 if columns == 2 else None, {columns - 1: ""}, None)
    return _read_names(path, names, headers, line)


def _read_names(path: Path, names: list[str], columns: list[_Column], line: int) -> Columns:
    directions = sum(column.quantity == "direction" for column in columns)
    meant = {
        k: column
        for k, column in enumerate(columns)
        if column.quantity in {"acceleration", "direction"} or (column.vertical and directions > 1)
    }
    for name, column in zip(names, columns, strict=True):
        if column.quantity in {"velocity", "displacement"} and not meant:
            message = f"column {name!r} is a {column.quantity}, not an acceleration."
            raise OtherQuantityError(path, message, line)
    times = [k for k, column in enumerate(columns) if column.quantity == "time"]
    shown, components = ",".join(names), [column.component for column in meant.values()]
    if len(meant) > 1 and ("" in components or len({*components}) < len(components)):
        message = f"columns {shown!r}: {len(meant)} accelerations of the same direction or of none."
        raise InputError(path, f"{message} {_CHOOSE}", line=line)
    if not meant or len(times) > 1 or len(meant) + len(times) < len(names):
        few = 2 * sum(map(is_known, names)) <= len(names)
        title = f" If it is a title, leave it out with --skip-lines {line}." if few else ""
        raise InputError(path, f"columns {shown!r}. {_MUST} {_CHOOSE}{title}", line=line)
    for k in times:
        if columns[k].units not in _TIME_UNITS and not decimals_of_second(names[k]):
            raise InputError(path, f"time in units of {columns[k].units!r}. Must be seconds.", line)
    units = _units(path, list(meant.values()), line)
    return Columns(times[0] if times else None, dict(zip(meant, components, strict=True)), units)


def column_place(
    path: Path, names: list[str], columns: int, line: int, chosen: str, index: str | None = None
) -> int:
    """Return the index of a column by its name or its number.

    A column of row numbers that was left out may be counted or not, if only one of the two is a
    column of acceleration.

    Parameters
    ----------
    names, columns, line
        As in `read_headers`.
    chosen : str
        Name or number of the column.
    index : str, optional
        Name of the column of row numbers that was left out on the left.

    Raises
    ------
    InputError
        If there is no such column, or if the number may mean two columns.

    Examples
    --------
    >>> column_place(Path("a.csv"), ["time_s", "acc_g"], 2, 1, "acc_g")
    1
    >>> column_place(Path("a.csv"), ["time_s", "acc_g"], 2, 1, "3", index="")
    1
    """
    folded = [re.sub(r"\s", "", name).casefold() for name in names]
    wanted = re.sub(r"\s", "", chosen).casefold()
    for spelt in (folded, [name.partition("[")[0] for name in folded]):
        if spelt.count(wanted) == 1:
            return spelt.index(wanted)
    if re.fullmatch(r"\d{1,4}", wanted, re.ASCII):
        counted = [int(wanted) - 1]
        if index is not None:  # without names, the numbers are those of the file
            counted = [int(wanted) - 1, int(wanted) - 2] if names else [int(wanted) - 2]
        places = [place for place in counted if 0 <= place < columns]
        if len(places) > 1:
            no_times = [k for k in places if _column(names[k]).quantity != "time"]
            places = no_times or places[:1]
        if len(places) > 1:
            both = " or ".join(repr(names[place]) for place in places)
            message = f"column {chosen} may be {both}: the first column has the numbers of rows."
            raise InputError(path, f"{message} State its name with --column NAME.", line)
        if places:
            return places[0]
    allowed = ", ".join(names) or f"1 to {columns}"
    raise InputError(path, f"no column {chosen!r}. Must be one of: {allowed}.", line=line)


def _units(path: Path, columns: list[_Column], line: int) -> str | None:
    several = sorted({column.units for column in columns})
    if len(several) > 1:
        message = f"accelerations in different units ({', '.join(several)})."
        raise InputError(path, f"{message} State the columns with --channels NAME=AZIMUTH.", line)
    [units] = several
    if units and units not in _SPELLINGS:
        allowed = ", ".join(ACCELERATION_UNITS)
        raise InputError(path, f"acceleration units {units!r}. Must be one of: {allowed}.", line)
    return _SPELLINGS.get(units)


@dataclass(frozen=True)
class _Column:
    """Quantity, component and units in the name of a column; empty if not stated."""

    quantity: str
    component: str = ""
    units: str = ""
    vertical: bool = False


@lru_cache(maxsize=1024)
def _column(name: str) -> _Column:
    """Split a column name: `acc_cm_s2`, `NS [g]`, `acc EW (gal)`."""
    words = re.sub(r"[\s_\[\]()]+", " ", name).strip().split(" ")
    quantity = _QUANTITIES.get(re.sub(r"(?<=acc)\d+$", "", words[0].lower()), "")
    # A direction is a name by itself, or follows the word for acceleration; V may be a velocity.
    rest = words[1:] if quantity else words
    component = ""
    if rest and quantity in {"", "acceleration"} and _is_direction(rest[0]):
        quantity, component, rest = quantity or "direction", rest[0], rest[1:]
    else:
        rest = rest[not quantity :]
        rest = rest[bool(rest and _LABEL.fullmatch(rest[0])) :]
    units = _spelling("".join(rest))
    bracket = _spelling(in_bracket[1]) if (in_bracket := _BRACKET.search(name)) else ""
    if bracket in _SPELLINGS and _spelling("".join(rest[:-1])) not in _SPELLINGS:
        units = bracket
    vertical = words[0] == "V"
    return _Column(quantity, component or ("V" if vertical else ""), units, vertical)


def _spelling(units: str) -> str:
    return re.sub(r"[\s^]|\*\*", "", units.lower().replace("²", "2"))


def _columns(names: list[str]) -> list[_Column]:
    """Return the columns; beside two horizontals, V is the vertical and T the transverse."""
    columns = [_column(name) for name in names]
    bare = [re.sub(r"[\s_\[\]()]+", " ", name).strip().split(" ")[0] for name in names]
    sets = [name_set for name_set in _SETS if name_set <= {word.upper() for word in bare}]
    horizontal = [
        column
        for column in columns
        if column.quantity == "direction" and column.component not in ("V", "Z")
    ]
    for k, (word, column) in enumerate(zip(bare, columns, strict=True)):
        if any(word in candidate for candidate in sets) or (sets and word in {"V", "Z"}):
            columns[k] = replace(column, quantity="direction", component=word)
        elif word == "V" and len(horizontal) > 1:
            columns[k] = replace(column, quantity="direction")
    return columns


def _is_direction(word: str) -> bool:
    """Return True if a word states a direction; a number must have three digits."""
    is_stated = direction(word)[0] is not Orientation.UNSTATED or _SEED.fullmatch(word)
    return bool(is_stated) and (not word.isdigit() or len(word) == 3)


#: Share of the steps of a column of times that rise. An acceleration rises in about half of them.
_RISING: Final = 0.9
#: Bounds of a series with several values per line, beside what 64 real records with 3 to 10 values
#: per line have. The step between neighbours, over that to the value below (records: up to 0.78).
_SMOOTH: Final = 0.85
#: The largest over the smallest step between two neighbouring places of a line (up to 1.4 in 80
#: lines, 1.3 in 300).
_EVEN: Final = 1.45
#: The step to the value below, over that to the values beside it (all records but one: 0.9 or more;
#: channels: less).
_DIP: Final = 0.9


def rises(values: Float) -> bool:
    """Return True if numbers rise like times: in at least nine of ten steps.

    Examples
    --------
    >>> rises(np.array([0.0, 0.01, 0.02])), rises(np.array([0.1, 0.3, -0.2]))
    (True, False)
    """
    return bool(values.size > 1 and (np.diff(values) > 0.0).mean() >= _RISING)


def are_pairs(values: Float, columns: int) -> bool:
    """Return True if the numbers of all lines, one after another, are times and accelerations.

    Parameters
    ----------
    values : array, shape (numbers,)
        Numbers in the order of the file.
    columns : int
        Numbers per line.

    Examples
    --------
    >>> are_pairs(np.array([0.00, 0.3, 0.01, -0.1, 0.02, 0.2, 0.03, 0.1]), 4)
    True
    """
    return columns % 2 == 0 and rises(values[::2]) and not rises(values[1::2])


def is_series(values: Float, columns: int) -> bool:
    """Return True if each line clearly continues the line before, as in one series.

    Then neighbouring values differ less than values one below the other; the steps within lines are
    as large as those from the end of a line to the next one; and values one below the other do not
    differ less than those beside them. Otherwise the columns may be channels.

    Parameters
    ----------
    values, columns
        As in `are_pairs`.

    Examples
    --------
    >>> wave = np.sin(0.3 * np.arange(800.0))
    >>> channels = np.outer(wave, np.arange(1.0, 9.0)).ravel()
    >>> is_series(wave, 8), is_series(channels, 8)
    (True, False)
    """
    whole = values[: values.size // columns * columns]
    if whole.size < 2 * columns:
        return False
    steps = np.square(np.append(np.diff(whole), 0.0)).reshape(-1, columns)[:-1]
    total = steps.sum(axis=1, keepdims=True)
    moving = total[:, 0] > 0.0
    if not moving.any() or any(rises(whole[k::columns]) for k in range(columns)):
        return False
    shares = (steps[moving] / total[moving]).mean(axis=0)
    below = _mean_square_step(whole, columns)
    beside = 0.5 * (_mean_square_step(whole, columns - 1) + _mean_square_step(whole, columns + 1))
    return bool(
        _mean_square_step(whole, 1) < _SMOOTH**2 * below
        and shares.max() < _EVEN**2 * shares.min()
        and below >= _DIP * beside
    )


def _mean_square_step(values: Float, distance: int) -> float:
    return float(np.square(values[distance:] - values[:-distance]).mean())
