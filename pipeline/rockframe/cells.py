"""Cells of tables: decimal numbers, text that no program acts on, columns that are printed.

Every text from outside, such as the name of an event, passes `plain` on its way to terminals,
tables, figures and pages.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from operator import ne
from pathlib import Path
from types import MappingProxyType, SimpleNamespace
from typing import Any, Final, TextIO

from rockframe.errors import InputError

#: A number that all programs read in the same way: ASCII digits, no underscores, no names.
_DECIMAL: Final = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?\s*", re.ASCII | re.IGNORECASE)
_DECIMAL_COMMA: Final = re.compile(
    r"(\s*[-+]?\d*),(\d+(?:e[-+]?\d+)?\s*)", re.ASCII | re.IGNORECASE
)
#: Text that a spreadsheet treats as a formula, also after the quotes that `harmless` adds.
_FORMULA: Final = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")

#: Characters that act on a terminal, break a line or turn text around: no part of a name.
_CONTROL: Final = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")
#: Number of characters of a cell that messages show.
_SHOWN: Final = 80
#: Characters that terminals act on, XML forbids or UTF-8 cannot encode: controls except tab and
#: line feed, separators and directions of lines, lone surrogates, and what is no character.
_NOT_PLAIN: Final = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]"
)
#: Characters for which CSV quotes a cell.
_QUOTED: Final = re.compile('[",\r\n]')

#: Formats of tables, and their file extensions.
TABLE_FORMATS: Final = MappingProxyType(
    {"csv": ".csv", "xlsx": ".xlsx", "markdown": ".md", "latex": ".tex", "parquet": ".parquet"}
)


def decimal(text: str) -> float:
    """Return the finite number in a text.

    Python's `float` also accepts ``6_5``, digits of other scripts, ``nan`` and ``infinity``, which
    other programs read differently or not at all.

    Parameters
    ----------
    text : str
        A decimal number, optionally with white space around it.

    Raises
    ------
    ValueError
        If the text is anything else, or the number is too large for a float.

    Examples
    --------
    >>> decimal(" -1.5e-3")
    -0.0015
    >>> decimal("6_5")
    Traceback (most recent call last):
    ValueError: not a decimal number: '6_5'
    """
    value = float(text) if _DECIMAL.fullmatch(text) else math.nan
    if not math.isfinite(value):
        raise ValueError(f"not a decimal number: {text!r}")
    return value


def with_point(cell: str, separator: str | None) -> str:
    """Return a cell of a table with a decimal point if it is a number with a decimal comma.

    Parameters
    ----------
    cell : str
        The cell.
    separator : str or None
        What separates the columns; None for blanks. Where commas do, no comma is a decimal mark.

    Examples
    --------
    >>> with_point("-0,5", ";"), with_point("-0,5", ","), with_point("Kobe, Japan", ";")
    ('-0.5', '-0,5', 'Kobe, Japan')
    """
    number = None if separator == "," else _DECIMAL_COMMA.fullmatch(cell)
    return f"{number[1]}.{number[2]}" if number else cell


def plain(text: str) -> str:
    r"""Return a text without the characters that terminals act on or that XML forbids.

    Each becomes a replacement character; tab and line feed stay.

    Examples
    --------
    >>> plain("Kobe\x1b[2J, 神戸"), plain("a\tb")
    ('Kobe�[2J, 神戸', 'a\tb')
    """
    return _NOT_PLAIN.sub("\N{REPLACEMENT CHARACTER}", text)


def plain_values(value: Any) -> Any:
    r"""Return JSON values with all texts `plain`.

    Examples
    --------
    >>> plain_values({"name": ["a\x07", 1.0, None]})
    {'name': ['a�', 1.0, None]}
    """
    if isinstance(value, str):
        return plain(value)
    if isinstance(value, Mapping):
        return {plain_values(key): plain_values(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain_values(inner) for inner in value]
    return value


def harmless(text: str) -> str:
    """Return a text as a cell that spreadsheets show unchanged.

    A text that starts with ``=``, ``+``, ``-``, ``@``, their full-width forms, a tab or a line end
    gets a single quote in front, unless it is a decimal number.

    Examples
    --------
    >>> harmless("=1+2"), harmless("PUL164"), harmless("-0.5")
    ("'=1+2", 'PUL164', '-0.5')
    """
    return f"'{text}" if _FORMULA.match(text) and not _DECIMAL.fullmatch(text) else text


def original(cell: str) -> str:
    """Return the text from which `harmless` made a cell.

    Examples
    --------
    >>> original("'=1+2"), original("'quoted'")
    ('=1+2', "'quoted'")
    """
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def write_rows(stream: TextIO, rows: Iterable[Iterable[object]]) -> None:
    r"""Write rows as CSV, with empty cells for NaN and None and `plain`, `harmless` texts.

    Examples
    --------
    >>> import io
    >>> stream = io.StringIO()
    >>> write_rows(stream, [["event", "magnitude"], ["@home", -0.1], ["", float("nan")]])
    >>> stream.getvalue()
    "event,magnitude\n'@home,-0.1\n,\n"
    """
    write = _writer(stream)
    for row in rows:
        write(map(_cell, row))


def write_table(stream: TextIO, rows: Iterable[Mapping[str, object]]) -> int:
    r"""Write a header and rows as `write_rows` does, and return the number of rows.

    Examples
    --------
    >>> import io
    >>> stream = io.StringIO()
    >>> write_table(stream, [{"event": "@home", "magnitude": -0.1}]), stream.getvalue()
    (1, "event,magnitude\n'@home,-0.1\n")
    """
    write = _writer(stream)
    count = 0
    for count, row in enumerate(rows, 1):
        if count == 1:
            write(row)
        write(map(_cell, row.values()))
    return count


def block_lines(blocks: Iterable[Mapping[str, Sequence[object]]]) -> Iterator[str]:
    r"""Yield the header of tables with the same columns, and the lines of each, as CSV.

    Parameters
    ----------
    blocks : iterable of mapping of str to sequence
        The values of each column. Without rows, nothing is yielded.

    Examples
    --------
    >>> list(block_lines(2 * [{"event": ["@home", ""], "magnitude": [-0.1, math.nan]}]))
    ['event,magnitude\n', "'@home,-0.1\n,\n", "'@home,-0.1\n,\n"]
    """
    texts: dict[str, _Texts] = {}
    for block in blocks:
        if not texts:
            if not next(iter(block.values())):
                continue
            header = io.StringIO()
            _writer(header)(block)
            yield header.getvalue()
            texts = {name: _Texts() for name in block}
        columns = [_column_cells(block[name], kept) for name, kept in texts.items()]
        # rows of texts need half of the time of csv.writer, whose lines these are
        lines = [*map(",".join, zip(*columns, strict=True))]
        if len(columns) == 1:
            lines = [line or '""' for line in lines]
        yield "\n".join([*lines, ""])


def rows_of_columns(blocks: Iterable[Mapping[str, Sequence[Any]]]) -> Iterator[dict[str, Any]]:
    """Return an iterator over the rows of tables that are mappings of columns to values.

    Examples
    --------
    >>> list(rows_of_columns([{"event": ["a", "b"], "magnitude": [6.0, 7.1]}]))
    [{'event': 'a', 'magnitude': 6.0}, {'event': 'b', 'magnitude': 7.1}]
    """
    return (
        dict(zip(block, row, strict=True))
        for block in blocks
        for row in zip(*block.values(), strict=True)
    )


#: Largest number of texts of numbers that are kept for a column.
_KEPT: Final = 4096


class _Texts(dict[float, str]):
    """The texts of the numbers of a column, which may come again."""

    def __missing__(self, value: float) -> str:
        text = "" if value != value else repr(value)
        if value and text:  # zero has two texts, and NaN does not equal itself
            self[value] = text
        return text


def _column_cells(values: Sequence[Any], texts: _Texts) -> Iterable[str]:
    """Return the cells of a column as they are written."""
    types = set(map(type, values))
    if types == {str}:
        return map(_quoted_cell, values)
    if types != {float}:
        return (_quoted_cell(v) if isinstance(v, str) else _quoted(_cell(v)) for v in values)
    if all(map(ne, values, values)):  # NaN, as in most columns of a table
        return len(values) * [""]
    if len(texts) < _KEPT:
        return map(texts.__getitem__, values)
    return ["" if value != value else repr(value) for value in values]  # NaN


def read_rows(stream: TextIO) -> Iterator[tuple[int, list[str]]]:
    r"""Yield the line number and the `original` texts of each row of CSV that is not empty.

    If semicolons separate the columns of the first line, numbers may have decimal commas, which are
    returned as points.

    Raises
    ------
    csv.Error
        If the text is not CSV.

    Examples
    --------
    >>> import io
    >>> list(read_rows(io.StringIO("event,magnitude\n\n'@home,-0.1\n")))
    [(1, ['event', 'magnitude']), (3, ['@home', '-0.1'])]
    """
    first = stream.readline()
    bare = re.sub(r'"[^"]*"', "", first)
    semicolons = ";" in bare and "," not in bare
    reader = csv.reader(chain([first], stream), strict=True, delimiter=";" if semicolons else ",")
    while True:
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            raise csv.Error(f"line {reader.line_num}: {error}") from None
        if semicolons:
            row = [with_point(cell, ";") for cell in row]
        if row:
            quoted = "'" in "".join(row)
            yield reader.line_num, [original(cell) for cell in row] if quoted else row


def read_column(stream: TextIO, head: str) -> Iterator[str]:
    r"""Yield the `original` texts of one column of CSV that has commas between the columns.

    The columns after it are only parsed in rows with quotes, so that large tables take a third of
    the time.

    Raises
    ------
    ValueError
        If there is no such column.
    IndexError
        If a row has fewer columns.
    csv.Error
        If the text is not CSV.

    Examples
    --------
    >>> import io
    >>> list(read_column(io.StringIO('event,record,M\n"a, b",1,6\n\nc,2,7\n'), "record"))
    ['1', '2']
    """
    place = next(csv.reader(stream, strict=True), [head]).index(head)
    for line in stream:
        bare = line.rstrip("\r\n")
        if '"' in bare:  # a text may have several lines
            row = next(csv.reader(chain([line], stream), strict=True))
        else:
            row = bare.split(",", place + 1)
        if bare:
            yield original(row[place])


def table_lines(path: Path) -> list[tuple[int, list[str]]]:
    """Return the line number and the texts of each row of a CSV file that is not empty.

    Raises
    ------
    InputError
        If the file cannot be read as a table, or has control characters.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(read_rows(stream))
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(path, f"not a table ({error}). Must be CSV in UTF-8.") from None
    for line, row in lines:
        for cell in row:
            if _CONTROL.search(cell.strip()):
                message = f"control character in {cell[:_SHOWN]!r}. Must be text on one line."
                raise InputError(path, message, line=line)
    return lines


def _writer(stream: TextIO) -> Callable[[Iterable[object]], object]:
    return csv.writer(_lines(stream), lineterminator="\r\n").writerow


def _lines(stream: TextIO) -> Any:
    # Before Python 3.13 csv quotes a carriage return only if it is part of the line terminator.
    return SimpleNamespace(write=lambda line: stream.write(line.removesuffix("\r\n") + "\n"))


def _cell(value: object) -> object:
    if isinstance(value, float):
        return "" if value != value else value  # NaN, in a third of the time
    return _text_cell(value) if isinstance(value, str) else value


@lru_cache(maxsize=4096)  # columns repeat their names and words
def _text_cell(text: str) -> str:
    return harmless(plain(text))


def _quoted(cell: object) -> str:
    """Return a cell as `csv.writer` writes it."""
    text = "" if cell is None else str(cell)
    return '"' + text.replace('"', '""') + '"' if _QUOTED.search(text) else text


@lru_cache(maxsize=4096)
def _quoted_cell(text: str) -> str:
    return _quoted(_text_cell(text))


Cells = Mapping[str, Any]
#: Text of an unknown number.
DASH: Final = "–"


#: Largest priority of columns on narrow pages.
_ON_NARROW_PAGES: Final = 2


@dataclass(frozen=True)
class Column:
    """One column of a printed table.

    Parameters
    ----------
    head : str
        Heading; if it ends in ``>``, the terminal aligns the column to the right.
    key : str
        Key of the value in a row.
    form : str
        Format of numbers, such as ``.2f``; without a format, values are text.
    factor : float
        Conversion of a number to the unit of the column.
    rule : callable, optional
        Called with the row and the key; returns the value, or the text of the cell.
    once : bool
        The value is printed only in the first row of a record.
    mark : (str, str), optional
        Key of a flag, and the text that is appended to the cell if the flag is set.
    unit : str
        Unit, which a page prints smaller than the heading.
    priority : int
        Where the width does not suffice, columns with the largest number are left out first, and
        of equal ones the last. 0 is never left out.
    wraps : bool
        The text may take several lines.
    """

    head: str
    key: str = ""
    form: str = ""
    factor: float = 1.0
    rule: Callable[[Cells, str], float | str] | None = None
    once: bool = False
    mark: tuple[str, str] | None = None
    unit: str = ""
    priority: int = 1
    wraps: bool = False

    @property
    def minor(self) -> bool:
        """True if narrow pages leave the column out."""
        return self.priority > _ON_NARROW_PAGES

    def cell(self, row: Cells) -> str:
        """Return the text of a cell: a dash for an unknown number, empty if the row has no value.

        Examples
        --------
        >>> column = Column("u [cm]>", "peak_u_m", ".1f", 100.0)
        >>> [column.cell(row) for row in ({"peak_u_m": 0.135}, {"peak_u_m": ""}, {})]
        ['13.5', '–', '']
        """
        value = row.get(self.key) if self.rule is None else self.rule(row, self.key)
        if value is None or not self.form or (self.rule and isinstance(value, str)):
            return "" if value is None else str(value)
        mark = self.mark[1] if self.mark and row.get(self.mark[0]) else ""
        return in_digits(self.factor * number(value), self.form) + mark


def in_digits(value: float, form: str) -> str:
    """Return a number as text, or a dash if it is unknown."""
    return format(value, form) if math.isfinite(value) else DASH


def number(value: Any) -> float:
    """Return the number in a cell, which may be text from a CSV file; NaN if it is unknown."""
    return math.nan if value in ("", None) else float(value)
