"""Reader of number tables (CSV or white space): times and accelerations, or one acceleration.

Optional comment lines (``#``, ``%``) come first, then an optional line of column names, which
states the units: ``time_s,acc_g``, ``t, acceleration [m/s2]``, ``acc_cm_s2``. No units are assumed.
Instead of names, a line may state the number of samples, or that and the time step: ``2500 0.01``.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from rockframe.errors import InputError, settle
from rockframe.ingest.identify import directed, record_ids, seed_letter
from rockframe.ingest.options import NO_TIMES, ReadOptions, TextLayout, factor_to_si
from rockframe.ingest.parsing import Float
from rockframe.ingest.parsing.columns import (
    Columns,
    are_pairs,
    column_names,
    column_place,
    is_known,
    is_row,
    is_series,
    read_headers,
    split_fields,
    units_in,
)
from rockframe.ingest.parsing.comments import other_quantity, stated_steps
from rockframe.ingest.parsing.lines import (
    are_finite,
    bad_number,
    blocks,
    decoded,
    head_lines,
    is_number,
    parse_numbers,
    require_even_lines,
    require_whole_end,
)
from rockframe.ingest.parsing.timing import (
    are_even_steps,
    decimals_of_second,
    even_time_step,
    in_seconds,
    other_time_units,
)
from rockframe.ingest.parsing.unnamed import time_column, unclear
from rockframe.record import Record
from rockframe.units import acceleration_factor

if TYPE_CHECKING:
    from rockframe.ingest.parsing.table_layout import Table

DESCRIPTION = "CSV or white-space text: time and acceleration, or acceleration alone"

#: Characters of rows of numbers; `numpy.loadtxt` treats some other characters as blanks.
_USUAL: Final = bytes({*range(ord(" "), 0x7F), *b"\t\n\v\f\r"} - {*b"_"})
_STATED_COUNT: Final = re.compile(
    r"\b(?:npts|n(?:umber|um\.?|o\.?)\s+of\s+(?:\w{1,12}\s+)?(?:points|samples|values))\b"
    r"\s*[:=]?\s*(?P<named>\d{1,12})\b"
    r"|^\W*(?P<first>\d{2,12})\s+(?:data\s+)?(?:points|samples|values)\b"
    r"(?!\s*(?:/|(?:per|an?|in|each|every)\b))",
    re.I,
)
#: Number of rows whose decimal points are compared with the first row.
_FIRST_ROWS: Final = 20
#: Numbers of values per line of a series that `sniff` recognises.
_SERIES: Final = (8, 10)
#: Largest number of values per line of a series without times that is recognised.
_LONGEST_SERIES: Final = 12
#: Column that the user states for a series with several values per line.
ALL_COLUMNS: Final = "all"
#: Number of bytes in which the rows of a table are sought.
_TABLE_HEAD: Final = 65_536
_LEAVE_OUT: Final = " Leave lines above the rows out with --skip-lines NUMBER."
#: Longest time step that a number above a column may be [s].
_LONGEST_STEP: Final = 0.1
#: Relative tolerance between two time steps, one of which is rounded.
_SAME_STEP: Final = 1e-3


def sniff(head: bytes) -> bool:
    r"""Return True if a file begins like a table of one or two columns of numbers.

    Examples
    --------
    >>> sniff(b"0.00 0.1\n0.01 0.2\n"), sniff(b"# Records\n\nSix of them.\n")
    (True, False)
    """
    lines = _decoded_lines(head)
    start = _first_content(lines)
    # The last line of the head may be cut. One invalid line is allowed here: `read` reports it.
    content = (line for line in lines[start:-1] or lines[start:] if line.strip())
    first = next(content, None)
    if first is None:
        return False
    names = column_names(first)
    if not names:
        numeric = [is_row(first), *map(is_row, content)]
        # Three or four columns below comments may be another format, such as CWA.
        count = len(split_fields(first))
        few = count <= (2 if start else 4) or count in _SERIES
        return numeric[0] and few and 2 * sum(numeric) > len(numeric)
    # twice the columns between commas are numbers with decimal commas, which `read` reports
    return (len(names) <= 2 or any(map(is_known, names))) and any(
        is_row(row) and len(split_fields(row)) in (len(names), 2 * len(names) * ("," in row))
        for row in islice(content, 3)
    )


def _decoded_lines(head: bytes) -> Sequence[str]:
    lines = head_lines(head)
    return lines if head.isascii() else [decoded(line.encode("latin-1")) for line in lines]


def states_units(head: bytes) -> bool:
    r"""Return True if column names or comments at the head of a table state acceleration units.

    Examples
    --------
    >>> states_units(b"# units: gal\n0.1\n0.2\n"), states_units(b"0.00 0.1\n0.01 0.2\n")
    (True, False)
    """
    lines = _decoded_lines(head)
    start = _first_content(lines)
    if any(map(units_in, lines[:start])):
        return True
    names = column_names(lines[start]) if start < len(lines) else []
    try:
        return bool(names) and read_headers(Path(), names, len(names), start + 1).units is not None
    except InputError:
        return False  # other quantities, or several columns of which the user must choose one


def read(path: Path, data: bytes, options: ReadOptions) -> list[Record]:
    r"""Return the records of a number table, one for each component that its column names state.

    Raises
    ------
    InputError
        If neither file nor options state units or time step; if a comment contradicts units, time
        step or number of samples; if a column is not time or acceleration; if rows differ in
        length; if a number is invalid; or if times are uneven.

    Examples
    --------
    >>> [record] = read(Path("shake.txt"), b"0.1\n-0.2\n", ReadOptions("g", 0.01))
    >>> record.time_step, record.acceleration
    (0.01, array([ 0.981, -1.962]))
    """
    from rockframe.ingest.parsing.table_layout import counted, split  # most records are no tables

    table = split(path, data, options.layout, options.column)
    options = counted(path, table, options)
    numbers, columns, per_row, taken = _read_columns(path, table, options)
    _require_accelerations(path, table, columns, options.layout.skip_lines)
    units = {k: columns.units_of.get(k, columns.units) for k in columns.accelerations}
    factors = {k: _factor(path, table, unit, options) for k, unit in units.items()}
    for unit, factor in dict(zip(units.values(), factors.values(), strict=True)).items():
        given = f"{options.units!r} given" if options.units else f"{factor:g} m/s2 given"
        _require_units(path, table, factor, f"{unit!r} in the column name" if unit else given)
    if not data[-1:].isspace():
        require_whole_end(path, table.body, table.first_line, per_row)
    _require_count(path, table, len(numbers))
    _require_sample(path, table, options)
    step = _agreed_step(path, table, _time_step(path, table, columns.time, numbers, options))
    ids = record_ids(path, [*columns.accelerations.values()])
    words = [*filter(None, (*table.taken, taken))]
    own = {k: units[k] or options.units or f"{factors[k]:g} m/s2" for k in units}
    notes = {k: f"table: {', '.join((*words, f'{step:g} s', own[k]))}" for k in own}
    return [
        Record(
            record_id=record_id,
            acceleration=numbers[:, place] * factors[place],
            time_step=step,
            **directed(name, seed_letter(name) or name),
            processing=(notes[place],) if words else (),
        )
        for (place, name), record_id in zip(columns.accelerations.items(), ids, strict=True)
    ]


def _factor(path: Path, table: Table, stated: str | None, options: ReadOptions) -> float:
    """Return the acceleration of the number 1 [m s-2]; the error names units in the comments."""
    try:
        return factor_to_si(path, stated, options, table.names_line or None)
    except InputError as error:
        units = {units for units in map(units_in, table.comments) if units}
        if stated or options.units or len(units) != 1:
            raise
        [word] = units
        line = next(k for k, comment in enumerate(table.comments, 1) if units_in(comment))
        message = f"{error.reason} The text above the numbers states {word!r}: --units {word}."
        raise InputError(path, message, line) from None


def reads(head: bytes, options: ReadOptions) -> bool:
    r"""Return True if rows of numbers follow title lines, or are laid out as the user states.

    Examples
    --------
    >>> reads(b"Ridgecrest, 2019\n0.1\n0.2\n0.3\n", ReadOptions())
    True
    """
    from rockframe.ingest.parsing.table_layout import is_table

    return is_table(head[:_TABLE_HEAD], options.layout)


def _read_columns(
    path: Path, table: Table, options: ReadOptions
) -> tuple[Float, Columns, int, str]:
    """Return the numbers, the meaning of their columns, the number of columns of a line, and what
    was recognised of them, in words.
    """
    count, chosen, words = table.columns, options.column, options.layout
    line = table.names_line or table.first_line
    _require_one_reading(path, chosen, words)
    if words.values_per_line is not None or _is_all(chosen):
        return *_stated_series(path, table, words), 1, f"{count} values a line, as stated"
    if words.channels:
        return *_stated_channels(path, table, options), count, "channels as stated"
    if table.names:
        columns = read_headers(path, table.names, count, line, chosen, table.index)
        numbers = _parse(path, table, columns)
        time = _named_time(path, table, columns, numbers, options)
        return numbers, replace(columns, time=time), count, ""
    if count > 2 and chosen is None and words.time_column is None:
        return _many_columns(path, table)
    if chosen is None and count == 2 and words.time_column is not None:
        time = _stated_time(path, table, None, words)
        chosen = None if time is None else str(2 - time)
    columns = read_headers(path, [], count, line, chosen, table.index)
    numbers, [place] = _parse(path, table, columns), [*columns.accelerations]
    if count > 2 and are_pairs(numbers.ravel(), count):
        message = f"each line holds {count // 2} pairs of time and acceleration, which are one"
        raise InputError(path, f"{message} series. Leave out --column.", line)
    if words.time_column is not None:
        return numbers, replace(columns, time=_stated_time(path, table, None, words)), count, ""
    time = time_column(path, numbers, [place], options.time_step, line, table.numbers)
    if count == 2 and time is None and chosen is None and len(numbers) > 1:
        raise unclear(path, numbers.ravel(), table.numbers, line, commas=table.separator == b",")
    return numbers, replace(columns, time=time), count, ""


def _is_all(chosen: str | None) -> bool:
    return (chosen or "").strip().lower() == ALL_COLUMNS


def _require_one_reading(path: Path, chosen: str | None, words: TextLayout) -> None:
    """Reject options of which one would be ignored beside another."""
    series = "--column all" if _is_all(chosen) else ""
    series = "--values-per-line" if words.values_per_line is not None else series
    times = words.time_column is not None and words.time_column.strip().lower() != NO_TIMES
    given = {
        series: bool(series),
        "--column": chosen is not None and not _is_all(chosen),
        "--channels": bool(words.channels),
        "--time-column": bool(series) and times,
    }
    options = [name for name, is_given in given.items() if is_given]
    if len(options) > 1:
        raise InputError(path, f"{' and '.join(options)} are both stated. State one of them.")


def _stated_series(path: Path, table: Table, words: TextLayout) -> tuple[Float, Columns]:
    """Return the values of a series, line by line; a name above it states its units.

    Words of a title may be as many as the values of a line. A title has no names of columns.
    """
    count, names = table.columns, table.names
    if words.values_per_line not in (None, count):
        message = f"{count} value{'s' * (count != 1)} in a line. Must be {words.values_per_line},"
        raise InputError(path, f"{message} as stated.", table.first_line)
    meant = [name for name in names if len(name) > 1 and is_known(name)]
    if len(names) > 1 and (meant or all(map(is_known, names))):
        message = f"{','.join(names)!r} are names of columns, but one series is stated."
        do = "Choose one with --column NAME, or leave the names out with --skip-lines"
        raise InputError(path, f"{message} {do} {table.names_line}.", table.names_line)
    columns = Columns(None, {0: ""}, None)
    if len(names) == 1 and is_known(names[0]):
        columns = read_headers(path, names, 1, table.names_line)
    return _values(path, table).reshape(-1, 1), columns


def _stated_channels(path: Path, table: Table, options: ReadOptions) -> tuple[Float, Columns]:
    """Return the numbers, and the columns that the user states with their components and units."""
    words, line = options.layout, table.names_line or table.first_line
    accelerations: dict[int, str] = {}
    for channel in words.channels:
        column, _, component = channel.rpartition("=")
        place = column_place(path, table.names, table.columns, line, column, table.index)
        if place in accelerations:
            message = f"channel {channel!r}: the same column as {accelerations[place]!r}."
            raise InputError(path, f"{message} State each column once.", line)
        accelerations[place] = component.strip()
    columns = Columns(None, accelerations, None)
    if not table.names:
        numbers = _parse(path, table, columns)
        time = _stated_time(path, table, None, words)
        if words.time_column is None:
            time = time_column(
                path, numbers, [*accelerations], options.time_step, line, table.numbers
            )
    else:
        each = {
            place: read_headers(path, table.names, table.columns, line, str(place + 1))
            for place in accelerations
        }
        units = {place: column.units for place, column in each.items()}
        columns = replace(columns, time=each[min(each)].time, units_of=units)
        numbers = _parse(path, table, columns)
        time = _named_time(path, table, columns, numbers, options)
    if time in accelerations:
        raise InputError(path, f"column {time + 1} is both time and acceleration.", line)
    return numbers, replace(columns, time=time)


def _named_time(
    path: Path, table: Table, columns: Columns, numbers: Float, options: ReadOptions
) -> int | None:
    """Return the index of the column of times in a table with names.

    A column whose name is in another language may hold times, too: then they must agree with the
    time step that the user states, and without one the user must state which column it is.
    """
    words, line = options.layout, table.names_line
    if columns.time is not None or words.time_column is not None:
        return _stated_time(path, table, columns.time, words)
    others = [k for k, name in enumerate(table.names) if is_known(name)]
    no_times = [*columns.accelerations, *others]
    time = time_column(path, numbers, no_times, options.time_step, line, table.numbers)
    if time is not None and options.time_step is None:
        message = (
            f"time step unstated. Column {table.names[time]!r} rises like times: state it with"
        )
        raise InputError(path, f"{message} --time-column, or the step with --time-step-s.", line)
    return time


def _stated_time(path: Path, table: Table, time: int | None, words: TextLayout) -> int | None:
    """Return the index of the column of times: the stated one, none, or the recognised one."""
    if words.time_column is None:
        return time
    if words.time_column.strip().lower() == NO_TIMES:
        return None
    line = table.names_line or table.first_line
    return column_place(path, table.names, table.columns, line, words.time_column, table.index)


def _many_columns(path: Path, table: Table) -> tuple[Float, Columns, int, str]:
    """Return the numbers in three columns or more without names, as `_read_columns`."""
    values, count = _values(path, table), table.columns
    if are_pairs(values, count):
        if values.size % 2:
            last = table.first_line + len(table.rows) - 1
            raise InputError(path, f"time {values[-1]:g} s without an acceleration.", last)
        taken = f"{count // 2} pairs of time and acceleration a line"
        return values.reshape(-1, 2), Columns(0, {1: ""}, None), 2, taken
    if count <= _LONGEST_SERIES and is_series(values, count):
        return values.reshape(-1, 1), Columns(None, {0: ""}, None), 1, f"{count} values a line"
    raise unclear(path, values, table.numbers, table.first_line)


def _values(path: Path, table: Table) -> Float:
    """Return all numbers of lines of equal length; the last line may be shorter."""
    separator = table.separator or b" "
    rows = table.rows
    for line, row in enumerate(rows, table.first_line):
        count = len(row.split(table.separator))
        last = line == table.first_line + len(rows) - 1
        if count > table.columns or (count < table.columns and not last):
            message = f"{count} value{'s' * (count != 1)} in a line."
            message += f" Must be {table.columns}, as in the first row."
            if line - table.first_line < _FIRST_ROWS:
                message += _LEAVE_OUT
            raise InputError(path, message, line=line)
        # A spreadsheet fills the last line with empty cells.
        filled = row.rstrip(separator + b" ") if last else row
        if not all(field.strip() for field in filled.split(table.separator)):
            raise bad_number(path, b"", line)
    body = b"\n".join(row.replace(separator, b" ") for row in rows)
    values = parse_numbers(path, body + b"\n", table.first_line)
    require_even_lines(path, body, table.first_line)
    return values


def _parse(path: Path, table: Table, columns: Columns) -> Float:
    """Return all numbers, shape (rows, columns)."""
    quantities = ["acceleration"] * table.columns
    if columns.time is not None:
        quantities[columns.time] = "time"
    try:
        parts = [_parse_rows(block, table) for block in blocks(table.body + b"\n")]
    except ValueError:
        raise _first_bad_row(path, table, quantities) from None
    numbers = np.concatenate(parts)
    if not are_finite(numbers):
        raise _first_bad_row(path, table, quantities)
    if table.columns == 1:  # times become wider, and the first row may be a header
        require_even_lines(path, table.body.partition(b"\n")[2], table.first_line + 1)
        if not table.names and are_even_steps(numbers[:, 0]):
            message = "the only column rises by even steps, as times do."
            raise InputError(path, f"{message} Must be accelerations.", table.first_line)
    return numbers


def _parse_rows(text: bytes, table: Table) -> Float:
    from rockframe.ingest.parsing.scanned import scanned_table  # few commands read tables

    scanned = scanned_table(text, table.columns, table.separator)
    if scanned is not None:
        return scanned
    if text.translate(None, _USUAL):
        raise ValueError("characters that are in no number")
    separator = table.separator.decode() if table.separator else None
    numbers: Float = np.loadtxt(io.BytesIO(text), comments=None, delimiter=separator, ndmin=2)
    if numbers.shape != (text.count(b"\n"), table.columns):  # loadtxt skips blank lines
        raise ValueError("blank lines")
    return numbers


def _first_bad_row(path: Path, table: Table, quantities: list[str]) -> InputError:
    for line, row in enumerate(table.rows, table.first_line):
        tokens = row.split(table.separator)
        if len(tokens) != table.columns:
            shown = decoded(row).strip()[:40]
            count = f"{len(tokens)} column{'s' * (len(tokens) != 1)}"
            message = f"{count} in {shown!r}. Must be {table.columns}."
            if line == table.first_line:
                message += _LEAVE_OUT
            return InputError(path, message, line)
        for token, quantity in zip(tokens, quantities, strict=True):
            if not is_number(token):
                error = bad_number(path, token, line, quantity)
                if line == table.first_line and re.match(rb"\s*[^\W\d]", token):
                    do = f"If it is a title, leave it out with --skip-lines {line}."
                    return InputError(path, f"{error.reason} {do}", line)
                return error
    raise AssertionError("every row is sound, yet they could not be read together")


def _require_count(path: Path, table: Table, rows: int) -> None:
    if rows < 2:
        raise InputError(path, f"{rows} row of numbers. Must be 2 or more.", line=table.first_line)
    for line, comment in enumerate(table.comments, 1):
        match = _STATED_COUNT.search(comment)
        count = match and (match["named"] or match["first"])
        if count and int(count) != rows:
            message = f"npts {count} in the comment, {rows} rows in the file."
            settle(path, message, {"samples": rows}, line)
    if table.sizes and int(table.sizes["count"]) != rows:
        message = f"{table.sizes['count']} samples stated above {rows} rows of them."
        settle(path, message, {"samples": rows}, table.sizes_line)


def _require_sample(path: Path, table: Table, options: ReadOptions) -> None:
    """Reject a whole number above a column of decimals, such as a count or the number of a station,
    and one that may be a time step: of fewer decimals than all below it, or the step itself.

    Zero is a sample: it adds nothing to the motion.
    """
    if table.names or table.columns > 1:
        return
    first, *rows = (row.strip() for row in table.body.split(b"\n", _FIRST_ROWS)[:_FIRST_ROWS])
    if re.fullmatch(rb"[-+]?0*[1-9]\d*", first) and all(b"." in row for row in rows):
        message = f"{decoded(first)!r} is a whole number above decimals: a sample, or a header?"
        must = "Put # before a header."
        settle(path, message, {"samples": None}, table.first_line, must)
    if options.layout.first_line == "numbers" or not is_number(first):
        return
    printed = re.fullmatch(rb"0?\.(\d+)", first)
    forms = {len(row.partition(b".")[2]) if b"e" not in row.lower() else 0 for row in rows}
    is_shorter = printed and len(rows) > 1 and len(forms) == 1 and len(printed[1]) < min(forms)
    value, step = float(first), options.time_step
    is_step = step is not None and math.isclose(value, step, rel_tol=_SAME_STEP)
    if is_step or (is_shorter and 0.0 < value <= _LONGEST_STEP):
        reason = (
            f"equals the time step of {step:g} s"
            if is_step
            else "has fewer decimals than those below"
        )
        message = f"the first number {decoded(first)!r} {reason}: a time step?"
        do = f"State --skip-lines {table.first_line}, or --first-line numbers if it is a sample."
        raise InputError(path, f"{message} {do}", table.first_line)


def _require_accelerations(path: Path, table: Table, columns: Columns, skipped: int) -> None:
    """Reject columns that a comment or title names as another quantity.

    Numbers of columns may count a column of row numbers, or not.
    """
    ahead = (0,) if table.index is None else (0, 1)
    places = table.places or range(table.columns + len(ahead) - 1)
    places_read = {k + number for k in columns.accelerations for number in ahead}
    numbers = [number for number, place in enumerate(places, 1) if place in places_read]
    for line, comment in enumerate(table.comments[skipped:], skipped + 1):
        if words := other_quantity(comment, numbers, len(places)):
            message = f"the text above the numbers states {words[:60]!r}, which is no acceleration."
            do = f"Choose another column with --column, or state --skip-lines {line} if it is one."
            raise InputError(path, f"{message} {do}", line)


def _require_units(path: Path, table: Table, factor: float, taken: str) -> None:
    for line, comment in enumerate(table.comments, 1):
        units = units_in(comment)
        if units and acceleration_factor(units) != factor:
            message = f"acceleration units {units!r} in the comment, {taken}."
            raise InputError(path, message, line=line)


def _agreed_step(path: Path, table: Table, step: float) -> float:
    """Return the time step [s] of the samples, or of a comment that the user trusts."""
    steps = [(line, f"{words} in the comment", there) for line, words, there in _steps_above(table)]
    if printed := table.sizes and table.sizes["step"]:
        steps.append((table.sizes_line, f"dt {printed} s in the header", float(printed)))
    for line, words, step_there in steps:
        if not math.isclose(step_there, step, rel_tol=_SAME_STEP):
            values = (
                {"waveform": step, "header": step_there} if step_there > 0.0 else {"waveform": step}
            )
            message = f"{words}, time step {step:g} s of the samples."
            return settle(path, message, values, line)
    return step


def _time_step(
    path: Path, table: Table, time: int | None, numbers: Float, options: ReadOptions
) -> float:
    if time is not None:
        return _step_of_times(path, table, time, numbers, options.time_step)
    step = options.time_step
    if step is None and table.sizes and table.sizes["step"]:
        step = float(table.sizes["step"])
    if step is None or not step > 0.0:
        steps = [above for above in _steps_above(table) if above[2] > 0.0]
        if len({printed for _, _, printed in steps}) == 1:
            line, words, printed = steps[0]
            message = f"time step unstated. The text above the numbers has {words}"
            raise InputError(path, f"{message}: --time-step-s {printed:.10g}.", line)
        message = "time step unstated. State it with --time-step-s, or add a column of times"
        raise InputError(path, f"{message} before the acceleration.")
    return step


def _steps_above(table: Table) -> list[tuple[int, str, float]]:
    """Return the time steps that comments and titles state: line number, words, and step [s]."""
    return [
        (line, words, step)
        for line, comment in enumerate(table.comments, 1)
        for words, step in stated_steps(comment)
    ]


def _step_of_times(
    path: Path, table: Table, time: int, numbers: Float, given: float | None
) -> float:
    """Return the time step of a column of times [s]; its name may state parts of a second."""
    pairs = table.columns // 2 if numbers.shape[1] < table.columns else 1
    name = table.names[time] if table.names else ""
    power = decimals_of_second(name)
    do = "Leave the times out with --time-column none and --time-step-s."

    def printed() -> list[bytes]:
        rows = [row.split(table.separator) for row in table.rows]
        tokens = [token for row in rows for token in (row[::2] if pairs > 1 else [row[time]])]
        return [in_seconds(token, power) for token in tokens] if power else tokens

    if units := other_time_units(name):
        message = f"column of times {name!r} has units {units!r}. Must be s, ms, us or ns, at the"
        raise InputError(path, f"{message} end of its name. {do}", table.names_line)
    seconds = numbers[:, time] / 10.0**power
    single = power == 0 and "clock times" not in table.taken
    try:
        return even_time_step(path, seconds, printed, 0, given, single=single)
    except InputError as error:
        line = None if error.line is None else table.first_line + error.line // pairs
        raise InputError(path, f"{error.reason} {do}", line) from None


def _first_content(lines: Iterable[str]) -> int:
    """Return the number of leading comment lines and blank lines."""
    count = 0
    for line in lines:
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            break
        count += 1
    return count
