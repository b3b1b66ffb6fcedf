"""Cells of CSV tables: decimal numbers, and text that no spreadsheet takes for a formula."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import SimpleNamespace
from typing import Final, TextIO

#: A number as every program reads it: ASCII digits, no underscores, no names.
_DECIMAL: Final = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?\s*", re.ASCII | re.IGNORECASE)
#: Text that a spreadsheet computes, and the same behind the quotes that `harmless` adds.
_FORMULA: Final = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")


def decimal(text: str) -> float:
    """Return the finite number that a text states.

    Python's own `float` also takes ``6_5``, digits of other scripts, ``nan`` and ``infinity``:
    elsewhere these are other numbers or none.

    Parameters
    ----------
    text : str
        A decimal number, with white space around it or not.

    Raises
    ------
    ValueError
        If it is anything else, or too large for a float.

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


def harmless(text: str) -> str:
    """Return a text as a cell that a spreadsheet shows instead of computing it.

    A single quote is put before ``=``, ``+``, ``-``, ``@``, their full-width forms, a tab and a
    line end. A text that is a decimal number stays as it is.

    Examples
    --------
    >>> harmless("=1+2"), harmless("PUL164"), harmless("-0.5")
    ("'=1+2", 'PUL164', '-0.5')
    """
    return f"'{text}" if _FORMULA.match(text) and not _DECIMAL.fullmatch(text) else text


def original(cell: str) -> str:
    """Return the text that `harmless` was given.

    Examples
    --------
    >>> original("'=1+2"), original("'quoted'")
    ('=1+2', "'quoted'")
    """
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def write_rows(stream: TextIO, rows: Iterable[Iterable[object]]) -> None:
    r"""Write rows of CSV: NaN and None are empty, texts are `harmless`.

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
    r"""Write rows as `write_rows` does, below the names of their columns; return their number.

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


def read_rows(stream: TextIO) -> Iterator[tuple[int, list[str]]]:
    r"""Give the rows of CSV that are not empty, with their line numbers; texts are `original`.

    Raises
    ------
    csv.Error
        If it is not CSV.

    Examples
    --------
    >>> import io
    >>> list(read_rows(io.StringIO("event,magnitude\n\n'@home,-0.1\n")))
    [(1, ['event', 'magnitude']), (3, ['@home', '-0.1'])]
    """
    reader = csv.reader(stream, strict=True)
    for row in reader:
        if row:
            yield reader.line_num, [original(cell) for cell in row]


def _writer(stream: TextIO) -> Callable[[Iterable[object]], object]:
    # Before Python 3.13 the module quotes no carriage return that is not part of its line end.
    lines = SimpleNamespace(write=lambda line: stream.write(line.removesuffix("\r\n") + "\n"))
    return csv.writer(lines, lineterminator="\r\n").writerow


def _cell(value: object) -> object:
    if isinstance(value, str):
        return harmless(value)
    return "" if isinstance(value, float) and math.isnan(value) else value
