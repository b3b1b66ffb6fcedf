"""Layout of a text table: title lines, names, units and sizes above rows, in one plain form.

What the user states is used. The rest is recognised where only one reading is possible, and noted:
names or units in a line above the rows, a column of row numbers, a separator after the last column,
quotes, clock times, and title lines that state neither a scale nor another quantity.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.ingest.options import NO_TIMES, ReadOptions, TextLayout
from rockframe.ingest.parsing.columns import (
    is_index,
    is_known,
    is_unit,
    split_fields,
    with_units,
)
from rockframe.ingest.parsing.comments import (
    names_acceleration,
    word_of_other,
    word_of_scale,
)
from rockframe.ingest.parsing.lines import decoded, is_utf16, plain_text, unify_line_ends
from rockframe.ingest.parsing.rows import (
    NUMBER,
    Form,
    apart,
    are_lines_of_pairs,
    blank_columns,
    form_of,
    has_line_numbers,
    is_value,
    numbers_in,
    recognised,
    rewritten,
    without_end_marks,
    without_line_numbers,
)
from rockframe.ingest.parsing.timing import is_clock

#: Number of lines at the top in which the first row is sought, below skipped lines.
_TOP: Final = 200
#: Number of rows from which the form of all rows is recognised.
_FIRST_ROWS: Final = 20
#: Number of rows that must follow the first one.
_FOLLOWING: Final = 2
_MARKS: Final = ("#", "%")
#: Exponents of double precision as Fortran prints them.
_FORTRAN: Final = re.compile(rb"\d\.?\d*[Dd][-+]?\d")
_LIKE_NUMBER: Final = re.compile(r"\s*[\"']?[-+.]?\d", re.A)
#: Number of samples, and perhaps the time step, in a line of their own above the rows.
_SIZES: Final = re.compile(
    r"\s*(?P<count>[1-9]\d{0,8})(?:[\s,;]+(?P<step>\d*\.?\d+(?:e-?\d{1,2})?))?\s*", re.I
)
#: The same before further whole numbers, which programs of spectral matching print. A fraction, a
#: power of ten or g in other units may be a scale.
_SIZES_AND_MORE: Final = re.compile(
    rf"{_SIZES.pattern}(?P<more>(?:\s+(?!10+\b|98\d\d?\b|38[56]\b)\d+){{1,3}})\s*", re.I
)
_UNITS_OF_COLUMNS: Final = re.compile(r"[^:=]*\bunits?\s*[:=]\s*(.+)", re.I)


@dataclass(frozen=True)
class Table:
    """Lines above a table, names of its columns, and its rows in one plain form.

    Parameters
    ----------
    comments : list of str
        All lines above names and rows: comments, and titles.
    names : list of str
        Names of the columns with their units; empty if there are none.
    names_line : int
        Line number of the names; 0 without names.
    body : bytes
        Rows of numbers with decimal points.
    first_line : int
        Line number of the first row.
    separator : bytes or None
        Separator of the columns in `body`; None is any white space.
    columns : int
        Number of columns of the rows.
    sizes : re.Match or None
        Number of samples (``count``), and perhaps time step (``step``), of a line above the rows.
    sizes_line : int
        Line number of that line.
    taken : tuple of str
        What was recognised, in words.
    index : str
        Name of the column of row numbers that was left out; None if there is none.
    places : tuple of int
        Place of each column of the file, with the numbers of rows, where some are blank (-1) or
        have dates beside clock times; empty elsewhere.
    clocks : tuple of int
        Places of the columns of clock times, counted with the numbers of rows.
    """

    comments: list[str]
    names: list[str]
    names_line: int
    body: bytes
    first_line: int
    separator: bytes | None
    columns: int
    sizes: re.Match[str] | None = None
    sizes_line: int = 0
    taken: tuple[str, ...] = ()
    index: str | None = None
    places: tuple[int, ...] = ()
    clocks: tuple[int, ...] = ()

    @property
    def rows(self) -> list[bytes]:
        """Rows as they are read."""
        return self.body.split(b"\n")

    @property
    def numbers(self) -> list[int]:
        """Number in the file of each column of the rows."""
        in_file = {place: number for number, place in reversed([*enumerate(self.places, 1)])}
        first = 0 if self.index is None else 1  # numbers of rows count, too
        return [in_file.get(k, k + 1) for k in range(first, first + self.columns)]


@dataclass
class _Top:
    """Lines above the rows, and what they mean."""

    lines: list[str]
    names: list[str] = field(default_factory=list)
    names_line: int = 0
    units: list[str] = field(default_factory=list)
    sizes: re.Match[str] | None = None
    sizes_line: int = 0
    titles: list[int] = field(default_factory=list)
    taken: list[str] = field(default_factory=list)


def is_table(head: bytes, words: TextLayout) -> bool:
    r"""Return True if rows of numbers follow at most 200 lines at the top of a text.

    Examples
    --------
    >>> is_table(b"Ridgecrest\n3 0.01\n0.1\n0.2\n0.3\n", TextLayout())
    True
    >>> is_table(b"Ridgecrest, 2019\nTwo stations.\n", TextLayout())
    False
    """
    if is_utf16(head) or b"\0" in head:
        return False
    lines = unify_line_ends(head).rstrip().split(b"\n")[: words.skip_lines + _TOP]
    rows = _first_row([decoded(line) for line in lines], words)
    return rows is not None and rows[0] + 1 < len(lines)


def split(path: Path, data: bytes, words: TextLayout, chosen: str | None) -> Table:
    r"""Return the lines above a table, and its rows in one plain form.

    Parameters
    ----------
    data : bytes
        Contents of the file.
    words : TextLayout
        Layout as the user states it.
    chosen : str, optional
        Name or number of the column of acceleration.

    Raises
    ------
    InputError
        If there are no rows, if a title states a scale or another quantity, or if numbers stand
        above a title.

    Examples
    --------
    >>> table = split(Path("a.csv"), b"t,acc_g,\n0.0,0.1,\n0.1,0.2,", TextLayout(), None)
    >>> table.names, table.rows, table.taken
    (['t', 'acc_g'], [b'0.0,0.1', b'0.1,0.2'], ('separator after the last column',))
    """
    text, marks = without_end_marks(plain_text(path, data).rstrip(), _marks(words))
    text, touching = apart(text)
    pieces = text.split(b"\n", words.skip_lines + _TOP)
    lines = [decoded(line) for line in pieces[: words.skip_lines + _TOP]]
    place = _first_row(lines, words) or _any_row(lines, words)
    if place is None:
        raise InputError(path, "no rows of numbers.")
    start, form, count = place
    _require_no_words(path, lines[start], start + 1, form, words)
    body = text.split(b"\n", start)[start]
    first_rows = [line for line in lines[start:] if line.strip()][:_FIRST_ROWS]
    sizes = _stated_sizes(path, lines, start, body, words)
    if sizes:
        start, body, first_rows = start + 1, body.partition(b"\n")[2], first_rows[1:]
        below = _skip(path, body, words)
        start, body = start + below[0], below[1]
        form = form_of(decoded(body.partition(b"\n")[0]), words)
        count = len(form.cells(decoded(body.partition(b"\n")[0])))
    separator, form = form.separator, recognised(form, first_rows, words.separator)
    count = count - form.trailing if form.separator == separator else len(form.cells(first_rows[0]))
    numbered = ""
    if form.separator is None and not _is_last_stated(
        lines[words.skip_lines : start], form, first_rows, words, chosen
    ):
        is_stated = bool(words.channels) or (chosen or "all").strip().lower() != "all"
        body, count, numbered = without_line_numbers(path, body, start + 1, count, is_stated)
    width = count + bool(numbered)
    cells = [row[:count] for row in map(form.cells, first_rows) if len(row) == width]
    if form.separator is not None and (blank := blank_columns(cells)):
        form, count = replace(form, blank=blank, width=count), count - len(blank)
        cells = [*map(form.without_blank, cells)]
    top = _Top(lines[:start], taken=[*filter(None, (touching, numbered, marks))])
    if sizes:
        top.sizes, top.sizes_line = sizes, place[0] + 1
        if more := sizes.groupdict().get("more"):
            top.taken.append(f"{more.strip()!r} after the sizes left out")
    _read_top(path, top, form, cells, words, chosen)
    return _plain(path, top, form, cells, body, start, count)


def _require_no_words(path: Path, line: str, number: int, form: Form, words: TextLayout) -> None:
    """Reject a line above the rows that has words and numbers in as many cells."""
    is_title = any(re.match(r"(?!nan|inf)[^\W\d]{2}", cell, re.I) for cell in form.cells(line))
    if is_title and words.first_line is None:
        message = f"{line.strip()[:40]!r} has words in place of numbers. If it is a title, leave"
        raise InputError(path, f"{message} it out with --skip-lines {number}.", number)


def _is_last_stated(
    lines: list[str], form: Form, rows: list[str], words: TextLayout, chosen: str | None
) -> bool:
    """Return True if options or names say what the last column is, or its numbers have commas."""
    cells = [*map(form.cells, rows)]
    count = len(cells[0]) if cells else 0
    columns = [chosen or "", *(channel.rpartition("=")[0] for channel in words.channels)]
    is_chosen = str(count) in map(str.strip, columns) or words.values_per_line == count
    is_time = (words.time_column or NO_TIMES).strip().lower() != NO_TIMES
    texts = [line.strip().lstrip("".join(_MARKS)).strip() for line in lines]
    above = [_names(text, form, cells, is_first=False) for text in texts]
    named = any(len(names) == count and any(map(is_known, names)) for names in above)
    return form.comma or is_chosen or is_time or named or words.first_line == "names"


def counted(path: Path, table: Table, options: ReadOptions) -> ReadOptions:
    r"""Return options that number the columns of a table which numbered those of its file.

    Blank columns, dates and clock times are counted in a file.

    Raises
    ------
    InputError
        If there is no such column, it is blank, or a stated acceleration is a clock time.

    Examples
    --------
    >>> table = split(Path("a.csv"), b"0.0,,0.1\n0.1,,0.2", TextLayout(), "3")
    >>> counted(Path("a.csv"), table, ReadOptions(column="3")).column
    '2'
    """
    names = [name.partition("[")[0].strip() for name in table.names]
    line = table.names_line or table.first_line
    places = dict(enumerate(table.places, 1))

    def place(column: str, *, is_time: bool = False) -> str:
        wanted = column.strip()
        if wanted in names or not re.fullmatch(r"\d{1,4}", wanted, re.A):
            return column
        own = places.get(int(wanted), -1) if places else int(wanted) - 1
        if places and own < 0:
            allowed = ", ".join(str(number) for number, k in places.items() if k >= 0)
            message = f"no column {wanted} with values. Must be one of: {allowed}."
            raise InputError(path, message, line)
        if own in table.clocks and not is_time and not names:
            message = f"column {wanted} has clock times. Must be accelerations."
            raise InputError(path, message, line)
        return str(own + 1) if places else column

    pairs = [channel.rpartition("=") for channel in options.layout.channels]
    channels = tuple(f"{place(column)}={component}" for column, _, component in pairs)
    times = options.layout.time_column
    times = times and place(times, is_time=True)
    layout = replace(options.layout, channels=channels, time_column=times)
    return replace(options, column=options.column and place(options.column), layout=layout)


def _first_row(lines: list[str], words: TextLayout) -> tuple[int, Form, int] | None:
    """Return the index of the first row, form and number of columns; None if there are no rows."""
    content = [
        k
        for k in range(words.skip_lines, len(lines))
        if lines[k].strip() and not _is_comment(lines[k], words)
    ]
    if words.first_line == "numbers" or words.first_line == "sizes":
        form = form_of(lines[content[0]], words) if content else Form()
        return (content[0], form, len(form.cells(lines[content[0]]))) if content else None
    if words.first_line == "names":
        content = content[1:]
    for order, place in enumerate(content):
        form = form_of(lines[place], words)
        count = numbers_in(lines[place], form)
        following = content[order + 1 : order + 1 + _FOLLOWING]
        counts = [numbers_in(lines[k], form) for k in following]
        # the last line of a series may be shorter
        shorter = bool(counts) and following[-1] == content[-1] and 0 < counts[-1] <= count
        if count and all(other == count for other in counts[: len(counts) - shorter]):
            while order and _is_broken_row(lines[content[order - 1]], form):
                order -= 1
            return content[order], form, count
    return None


def _any_row(lines: list[str], words: TextLayout) -> tuple[int, Form, int] | None:
    """Return what `_first_row` does, of the first line of numbers, whatever follows it."""
    for k in range(words.skip_lines, len(lines)):
        form = form_of(lines[k], words)
        if not _is_comment(lines[k], words) and numbers_in(lines[k], form):
            return k, form, len(form.cells(lines[k]))
    return None


def _marks(words: TextLayout) -> tuple[str, ...]:
    return (words.comment,) if words.comment else _MARKS


def _is_comment(line: str, words: TextLayout) -> bool:
    return line.lstrip().startswith(_marks(words))


def _is_broken_row(line: str, form: Form) -> bool:
    """Return True if half of the cells of a line are numbers, or it begins like a number."""
    cells = form.cells(line)
    numbers = sum(map(is_value, filter(None, cells)))
    if numbers < len(cells) and _SIZES.fullmatch(line):
        return False
    if len(cells) == 1:
        return bool(_LIKE_NUMBER.match(line))
    return 2 * numbers >= len(cells)


def _stated_sizes(
    path: Path, lines: list[str], start: int, body: bytes, words: TextLayout
) -> re.Match[str] | None:
    """Return what `_sizes_as_row` does, unless names stand above; the user may require it."""
    above = [line for line in lines[words.skip_lines : start] if line.strip()]
    named = bool(above) and all(map(is_known, split_fields(above[-1])))
    sizes = None if named else _sizes_as_row(lines[start], body, words)
    if words.first_line == "sizes" and not sizes:
        message = f"first line {lines[start].strip()[:40]!r}. Must be the number of samples, and"
        raise InputError(
            path, f"{message} perhaps the time step, as --first-line states.", start + 1
        )
    return sizes


def _sizes_as_row(line: str, body: bytes, words: TextLayout) -> re.Match[str] | None:
    """Return the match of a line that states the number of samples, above the rows of numbers.

    Unlike a row, it has another number of fields than the rows, or the number of the rows.
    """
    sizes = _SIZES.fullmatch(line)
    if not sizes and (more := _SIZES_AND_MORE.fullmatch(line)):
        values = len(body.partition(b"\n")[2].split())
        return more if int(more["count"]) == values else None
    rows = body.split(b"\n")[1:]
    row = next((decoded(other) for other in rows if other.strip()), "")
    if words.first_line == "sizes" and sizes:
        return sizes
    if not sizes or words.first_line is not None or not numbers_in(row, form_of(row, words)):
        return None
    fields, of_row = len(split_fields(line)), len(form_of(row, words).cells(row))
    if fields == of_row:
        return sizes if int(sizes["count"]) == sum(1 for other in rows if other.strip()) else None
    return sizes if sizes["step"] or of_row > 2 else None


def _skip(path: Path, body: bytes, words: TextLayout) -> tuple[int, bytes]:
    """Return the number of comments and blank lines at the beginning, and the rest."""
    count = 0
    while body:
        line, _, rest = body.partition(b"\n")
        if line.strip() and not _is_comment(decoded(line), words):
            break
        count, body = count + 1, rest
    if not body:
        raise InputError(path, "no rows of numbers.")
    return count, body


def _read_top(
    path: Path,
    top: _Top,
    form: Form,
    cells: list[list[str]],
    words: TextLayout,
    chosen: str | None,
) -> None:
    """Fill in names, units, sizes and titles from the lines above the rows, from the last one."""
    count = len(cells[0]) if cells else 0
    content = [k for k in range(words.skip_lines, len(top.lines)) if top.lines[k].strip()]
    if top.sizes:
        content = [k for k in content if k != top.sizes_line - 1]
    own = [k for k in content if not _is_comment(top.lines[k], words)]
    for k in reversed(content):
        line, is_comment = top.lines[k], k not in own
        text = line.strip().lstrip("".join(_MARKS)).strip() if is_comment else line
        names = _names(text, form, cells, is_first=k == own[0] if own else False)
        if not top.names and not top.units and _are_units(names, count):
            top.units = names
            top.taken.append(f"units in line {k + 1}")
        elif not top.names and _is_names(names, cells, chosen, words, is_comment=is_comment):
            top.names, top.names_line = names, k + 1
            if is_comment:
                top.taken.append(f"names in the comment of line {k + 1}")
        elif not is_comment and not top.sizes and (sizes := _SIZES.fullmatch(line)):
            top.sizes, top.sizes_line = sizes, k + 1
        elif not is_comment:
            break
    _read_titles(path, top, content, words, count, form)


def _names(text: str, form: Form, cells: list[list[str]], *, is_first: bool) -> list[str]:
    """Return the cells of a line of names or units; a bracket belongs to the word before it."""
    count = len(cells[0]) if cells else 0
    joined = re.sub(r"(?<!\s)\s+(?=[\[(])", "", text)
    if form.separator in (",", ";") and count > 1 and not re.search(r"[,;\t]", text):
        words = joined.split()
        return words if all(map(is_known, words)) else []
    separator = "\t" if text.rstrip().count("\t") == count - 1 > 0 else form.separator
    if separator and separator in text:
        names = Form(separator).cells(text)
    else:
        names = [name.strip().strip('"') for name in split_fields(joined)]
    width = form.width or count
    while len(names) > width and not names[-1]:
        names.pop()
    if form.date is not None and len(names) == width + 1:  # names of a date and of a clock time
        names[form.date : form.date + 2] = ["time"]
    if form.trailing and len(names) == width + 1:  # the name of a last column, which is blank
        names.pop()
    names = form.without_blank(names)
    if len(names) == count - 1 and is_first and is_index("", [row[0] for row in cells]):
        names.insert(0, "")  # R writes no name above the numbers of rows
    return [re.sub(r"(?<!\s)\s+(?=[\[(])", "", name) for name in names]


def _is_names(
    names: list[str],
    cells: list[list[str]],
    chosen: str | None,
    words: TextLayout,
    *,
    is_comment: bool,
) -> bool:
    count = len(cells[0]) if cells else 0
    recognised = [is_known(name) for name in names if name]
    if is_comment:
        wanted = chosen is not None and chosen.strip().casefold() in map(str.casefold, names)
        return len(names) == count and bool(recognised) and (all(recognised) or wanted)
    if words.first_line == "names":
        return True
    if all(is_value(name) for name in names if name):
        return False
    if names and names[0].endswith(":"):
        return False
    begins = next(filter(None, names), "")[:1]
    if bool(recognised) and all(recognised):
        return True
    # Words of a title may be as many as the numbers of a line of pairs.
    alike = begins.isalpha() and len(names) == count
    return alike and (2 * sum(recognised) >= count or not are_lines_of_pairs(cells))


def _are_units(cells: list[str], count: int) -> bool:
    filled = [cell for cell in cells if cell.strip("-")]
    return len(cells) == count and bool(filled) and all(map(is_unit, filled))


def _read_titles(
    path: Path, top: _Top, content: list[int], words: TextLayout, count: int, form: Form
) -> None:
    """Note the title lines; reject those without which the numbers cannot be understood."""
    units = {int(note.rpartition(" ")[2]) - 1 for note in top.taken if "units in" in note}
    others = [k for k in content if k not in units | {top.names_line - 1, top.sizes_line - 1}]
    comments = [k for k in others if _is_comment(top.lines[k], words)]
    titles = [k for k in others if k not in comments]
    for k in titles:
        line = top.lines[k]
        match = _UNITS_OF_COLUMNS.fullmatch(line)
        cells = re.split(r"\s*[,;\t]\s*", match[1].strip()) if match else []
        if not top.units and _are_units(cells, count) and count > 1:
            top.units = cells
            top.taken.append(f"units in line {k + 1}")
        is_row = numbers_in(line, form) == (form.width or count)
        parts = re.split(r"[\s,;]+", line.strip())
        if is_row or (all(map(is_value, parts)) and any(map(NUMBER.fullmatch, parts))):
            message = f"numbers in {line.strip()[:40]!r} above the table, which may scale it."
            if is_row:
                message = f"numbers in {line.strip()[:40]!r}, with text between them and the table."
            raise InputError(path, f"{message} Leave lines out with --skip-lines NUMBER.", k + 1)
    _require_understood(path, top, titles, comments)
    if titles:
        top.taken.append(f"{len(titles)} title line{'s' * (len(titles) > 1)}")


def _require_understood(path: Path, top: _Top, titles: list[int], comments: list[int]) -> None:
    """Reject titles and comments that state a scale of the numbers, or another quantity."""
    above = [top.lines[k] for k in (*titles, *comments)]
    named = any(map(names_acceleration, (*above, *top.names)))
    for k in sorted((*titles, *comments)):
        line, is_title = top.lines[k], k in titles
        if word := word_of_scale(line, is_title) or (not named and word_of_other(line, is_title)):
            kind = "title" if is_title else "comment"
            message = f"the {kind} {line.strip()[:60]!r} states {word!r}, which is not understood."
            last = max(titles) if is_title else k
            do = f"If the numbers below are accelerations, state --skip-lines {last + 1}"
            raise InputError(path, f"{message} {do} and their --units or --factor-m-s2.", k + 1)


def _plain(
    path: Path,
    top: _Top,
    form: Form,
    cells: list[list[str]],
    body: bytes,
    start: int,
    count: int,
) -> Table:
    """Return the table with its rows in one plain form."""
    names, taken = top.names, list(top.taken)
    if top.units and len(names) in (0, len(top.units)):
        names = with_units(path, names, top.units, top.names_line or start)
    index = None
    if has_line_numbers(names, cells, count):
        index, names = (names[0], names[1:]) if names else ("", [])
        taken.append("column of row numbers left out")
    code = form.separator.encode() if form.separator else None
    first = body.partition(b"\n")[0]
    clocks = [k for k in range(count) if any(is_clock(row[k]) for row in cells if k < len(row))]
    if clocks:
        taken.append("clock times")
        places = [k - (index is not None) for k in clocks]
        names = ["time" if k in places else name for k, name in enumerate(names)]
    taken.extend(form.notes(count))
    if index is not None or clocks or form.trailing or form.blank or b'"' in first:
        every = form.rows(path, body, start + 1)
        body, code = rewritten(every, clocks, from_column=int(index is not None)), b","
    elif form.comma:
        body = body.replace(b",", b".")
    if _FORTRAN.search(first):
        body = body.replace(b"D", b"E").replace(b"d", b"e")
    return Table(
        comments=top.lines[: max(top.names_line - 1, 0) if names else start],
        names=names,
        names_line=top.names_line or (start if names else 0),
        body=body,
        first_line=start + 1,
        separator=code,
        columns=count - (index is not None),
        sizes=top.sizes,
        sizes_line=top.sizes_line,
        taken=tuple(taken),
        index=index,
        places=form.places(count),
        clocks=tuple(clocks),
    )
