"""Output of commands: tables, progress bars, rejections, JSON."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from rockframe.ingest import Rejection
    from rockframe.results.tables.columns import Column
    from rockframe.results.tables.entries import Entry

#: Width of tables that are not printed to a terminal [characters].
_PLAIN_WIDTH: Final = 150
#: Largest number of rows that are printed.
_MOST_ROWS: Final = 200
#: Space between two columns of a table [characters].
_GAP: Final = 2
#: Smallest width of a text column for which the first column stays unbroken [characters].
_SHORTEST: Final = 6


def show_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table; columns whose name ends in ``>`` are aligned to the right.

    An empty row draws a line. In a narrow terminal, headings are broken first, then cells; the
    first column and single words stay unbroken if possible. Of a very long table, only the first
    rows and the number of further rows are printed.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    rest = iter(rows)
    rows, more = list(islice(rest, _MOST_ROWS)), sum(1 for row in rest if row)
    width = table_width()
    console = Console(width=width, highlight=False)
    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for heading, right, whole in _layout(columns, [row for row in rows if row], width):
        table.add_column(
            Text(heading),
            justify="right" if right else "left",
            no_wrap=whole,
            overflow="fold",
        )
    for row in rows:
        if row:
            table.add_row(*(Text(cell) for cell in row))
        else:
            table.add_section()
    with console.capture() as table_text:  # rich would exit with 1 if the output is closed
        if title:
            console.print(Text(title, style="bold", no_wrap=True, overflow="ignore"))
        console.print(table)
    print(table_text.get(), end="")
    if more:
        print(f"{more} more rows: the output files contain all rows.\n")


def column(head: str, key: str = "", form: str = "", factor: float = 1.0, **others: Any) -> Column:
    """Return a column of a table."""
    from rockframe.results.tables.columns import (
        Column,  # slow: it is imported when tables are shown
    )

    return Column(head, key, form, factor, **others)


def show_rows(
    title: str,
    columns: Sequence[Column],
    rows: Iterable[Mapping[str, Any]],
    *,
    group: str = "",
    rules: bool = True,
) -> None:
    """Print rows as a table.

    Rows with the same value of `group` form a group: columns that are shown once are printed only
    in the first row of a group, and lines are drawn between groups.
    """

    def cells() -> Iterator[list[str]]:
        last: Any = None
        for row in rows:
            begins = not group or row[group] != last
            if group and rules and begins and last is not None:
                yield []
            last = row.get(group)
            yield ["" if column.once and not begins else column.cell(row) for column in columns]

    show_table(title, [column.head for column in columns], cells())


def _layout(
    columns: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> list[tuple[str, bool, bool]]:
    """Return for each column its heading, whether it is aligned to the right, and whether it never
    wraps.
    """
    right = [name.endswith(">") for name in columns]
    heads = [name.rstrip(">") for name in columns]
    room = width - _GAP * len(columns)
    if sum(_widths([heads, *rows], "\n")) > room:
        heads = [
            re.sub(r" |(?<=-)(?=\w)", "\n", head) if number else head
            for head, number in zip(heads, right, strict=True)
        ]
    lines, words = _widths([heads, *rows], "\n"), _widths([heads, *rows], None)
    least = [
        line if number else word for line, word, number in zip(lines, words, right, strict=True)
    ]
    first = lines[0] + sum(
        size if number else min(size, _SHORTEST)
        for size, number in zip(least[1:], right[1:], strict=True)
    )
    if first <= room:
        least[0] = lines[0]
    whole = [
        number or (line == word and sum(least) <= room)
        for line, word, number in zip(lines, words, right, strict=True)
    ]
    whole[0] = first <= room
    return list(zip(heads, right, whole, strict=True))


def _widths(rows: Sequence[Sequence[str]], apart: str | None) -> list[int]:
    """Return the length of the longest part in each column; `apart` separates parts (default:
    space).
    """
    return [
        max((len(part) for cell in column for part in cell.split(apart)), default=0)
        for column in zip(*rows, strict=True)
    ]


def table_width() -> int:
    """Return the width available for a table [characters]."""
    stated = os.environ.get("COLUMNS", "")
    if not stated.isdigit() and not sys.stdout.isatty():
        return _PLAIN_WIDTH
    return shutil.get_terminal_size().columns


def show_json(value: Any) -> None:
    """Print JSON, with null for numbers that are not finite."""
    print(json.dumps(_finite(value), indent=2, ensure_ascii=False, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value


def show_rejections(rejections: Sequence[Rejection | Entry]) -> int:
    """Print one line for each rejected file to stderr. Return the exit status."""
    for rejection in rejections:
        where = rejection.file if rejection.line is None else f"{rejection.file}:{rejection.line}"
        print(f"rockframe: rejected: {where}: {rejection.reason}", file=sys.stderr)
    return 1 if rejections else 0


@contextmanager
def progress_names(what: str) -> Iterator[Callable[[str], None]]:
    """Yield a callback that shows the name of the current item if stderr is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _name: None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda name: status.update(f"{what} {name}")


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback that takes the number done and the total, and draws a bar on a terminal."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def progress_of_steps(what: str) -> Iterator[Callable[[str, int, int], None]]:
    """Yield a callback that takes the finished step, its number and the total.

    On a terminal the callback draws a bar; elsewhere it prints a line with the time since the
    start.
    """
    began = time.monotonic()

    def line(name: str, done: int, total: int) -> None:
        passed = time.monotonic() - began
        print(f"rockframe: {done}/{total} {name}, {passed:.1f} s", file=sys.stderr, flush=True)

    with progress_bar(what) as bar:
        yield (lambda _name, *counts: bar(*counts)) if sys.stderr.isatty() else line
