"""Output of commands: tables, progress bars, rejections, JSON."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, Literal, TextIO

if TYPE_CHECKING:
    from rockframe.cells import Column
    from rockframe.outcome import InputOutcome

#: Width of tables that are not printed to a terminal [characters].
_PLAIN_WIDTH: Final = 150
#: Largest number of rows that are printed.
_MOST_ROWS: Final = 200
#: Controls that begin and end a bold heading.
_BOLD: Final = r"(\x1b\[[01]m)"
#: Space between two columns of a table [characters].
_GAP: Final = 2
#: Width to which columns of text are narrowed if nothing else fits [characters].
_SHORTEST: Final = 6
#: Places where a text may be broken: after spaces, but not before a unit of one letter or a percent
#: sign, and after -, _ or / within a name.
_PARTS: Final = r"\n|(?<= )(?!\S$|%)|(?<=\w\w[-_/])(?=\w)"


class PlainStream:
    """The standard output with `plain` texts; of all controls, only those of bold headings pass."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text and return its length."""
        from rockframe.cells import plain

        parts = re.split(_BOLD, text)
        self._stream.write("".join(part if k % 2 else plain(part) for k, part in enumerate(parts)))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def show_table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    order: Sequence[int] | None = None,
) -> None:
    """Print a table; columns whose name ends in ``>`` are aligned to the right.

    An empty row draws a line. In a narrow terminal, headings and cells are broken, the first column
    last; if that does not suffice, columns are left out and named below the table. `order` lists
    the places of the columns that may be, the last of which is left out first (default: all but the
    first, as printed). Of a very long table, only the first rows and the number of further rows are
    printed.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    rest = iter(rows)
    rows, more = list(islice(rest, _MOST_ROWS)), sum(1 for row in rest if row)
    heads, width = [name.rstrip(">") for name in columns], table_width()
    numbers = [name.endswith(">") for name in columns]
    texts = [list(column) for column in zip(heads, *filter(None, rows), strict=True)]
    widths = _layout(texts, numbers, width, range(1, len(texts)) if order is None else order)
    console = Console(width=max(width, sum(widths.values()) + _GAP * len(widths)), highlight=False)
    table = Table(
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for i, size in widths.items():
        justify: Literal["left", "right"] = "right" if numbers[i] else "left"
        table.add_column(Text(_wrapped(heads[i], size)), justify=justify, no_wrap=True)
    for row in rows:
        if row:
            table.add_row(*(Text(_wrapped(row[i], size)) for i, size in widths.items()))
        else:
            table.add_section()
    with console.capture() as table_text:  # rich would exit with 1 if the output is closed
        if title:
            console.print(Text(title, style="bold", no_wrap=True, overflow="ignore"))
        console.print(table)
    print(table_text.get(), end="")
    left = [head for i, head in enumerate(heads) if i not in widths and not _empty(texts[i])]
    if left:
        names = ", ".join(" ".join(head.split()) for head in left)
        left_out = f"{len(left)} of {len(heads)} columns left out: {names}."
        print(f"{left_out} A wider terminal or --json shows them.\n")
    if more:
        print(f"{more} more rows: the output files contain all rows.\n")


def column(head: str, key: str = "", form: str = "", factor: float = 1.0, **others: Any) -> Column:
    """Return a column of a table."""
    from rockframe.cells import Column

    return Column(head, key, form, factor, **others)


def nearest_to_one(scales: Sequence[float], most: int) -> list[int]:
    """Return the places of the scales nearest to 1, the nearest first.

    Examples
    --------
    >>> nearest_to_one([0.5, 0.9, 1.0, 2.0, 10.0], 3)
    [2, 1, 0]
    """
    return sorted(range(len(scales)), key=lambda s: abs(math.log(scales[s])))[:most]


def show_rows(
    title: str,
    columns: Sequence[Column],
    rows: Iterable[Mapping[str, Any]],
    *,
    group: str = "",
    rules: bool = True,
) -> None:
    """Print rows as a table.

    Where the width does not suffice, columns are left out by their priority, the first one never.
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

    may = [i for i, column in enumerate(columns) if i and column.priority]
    order = sorted(may, key=lambda i: columns[i].priority)
    show_table(title, [column.head for column in columns], cells(), order=order)


def show_first(summary: Sequence[Mapping[str, Any]]) -> None:
    """Print which records have no result and why, and peaks that suggest wrong units, if any."""
    from rockframe.results.tables.notes import first_words

    for key, end in (("left_out_words", ""), ("implausible", ".")):
        if words := first_words(summary, key):
            print(f"{filled(words + end)}\n")


def show_summary(summary: Sequence[Mapping[str, Any]]) -> None:
    """Print the responses of each structure over all records, if there are several."""
    from rockframe.results.tables.notes import direction_notes, summary_notes
    from rockframe.results.tables.summary import summary_columns, summary_legend, summary_title

    if any(int(row["records"]) > 1 for row in summary):
        nominal = " (nominal)" if summary[0]["nominal"] in (True, "True") else ""
        show_rows(f"{summary_title(summary)}{nominal}", summary_columns(summary), summary)
        print(*map(filled, summary_notes(summary)), filled(summary_legend(summary)), sep="\n")
    elif notes := direction_notes(summary):
        print(*map(filled, notes), sep="\n")


def filled(said: str) -> str:
    """Return sentences wrapped to the width of tables; no line begins with a percent sign."""
    width = max(40, min(table_width(), 120))
    return textwrap.fill(said.replace(" %", "\u00a0%"), width).replace("\u00a0", " ")


def _layout(
    columns: Sequence[Sequence[str]], numbers: Sequence[bool], width: int, order: Sequence[int]
) -> dict[int, int]:
    """Return the places and widths of the columns that are printed; each begins with its heading.

    In a narrow terminal, columns without values are not printed. If the shortest parts of all cells
    do not fit, the last columns in `order` are left out.
    """
    full = {i: max(_lengths(column, "\n")) for i, column in enumerate(columns)}

    def room(widths: dict[int, int]) -> int:
        return width - _GAP * len(widths) - sum(widths.values())

    if room(full) >= 0:
        return full
    least = {
        i: max(*_lengths(column[:1]), *_lengths(column[1:], "\n" if numbers[i] else _PARTS), 0)
        for i, column in enumerate(columns)
        if i == 0 or not _empty(column)
    }
    for i in reversed(order):
        if i in least and room(least) < 0:
            del least[i]
    if room(least) < 0:
        least = {i: size if numbers[i] else min(size, _SHORTEST) for i, size in least.items()}
    for i in sorted(least, key=lambda i: (i > 0, numbers[i], full[i])):
        least[i] += min(max(room(least), 0), full[i] - least[i])
    return dict(sorted(least.items()))


def _empty(column: Sequence[str]) -> bool:
    """Return whether a column has no values below its heading."""
    return set(column[1:]) <= {"", "–"}


def _lengths(cells: Iterable[str], apart: str = _PARTS) -> list[int]:
    """Return the lengths of the parts of cells, which the pattern `apart` separates."""
    return [len(part.strip()) for cell in cells for part in re.split(apart, cell)]


def _wrapped(text: str, width: int) -> str:
    r"""Return a text in lines of this width, broken between its parts where possible.

    Examples
    --------
    >>> _wrapped("apollo-frame", 8), _wrapped("overturns 5.8 s", 14)
    ('apollo-\nframe', 'overturns\n5.8 s')
    >>> _wrapped("may overturn (67 %)", 17)
    'may overturn\n(67 %)'
    """
    lines = []
    for line in text.split("\n"):
        lines.append("")
        for part in re.split(_PARTS, line):
            if len((lines[-1] + part).rstrip()) > width and lines[-1]:
                lines.append("")
            while len(part.rstrip()) > width:
                lines[-1:], part = [part[:width], ""], part[width:]
            lines[-1] += part
    return "\n".join(line.rstrip() for line in lines)


def table_width() -> int:
    """Return the width available for a table [characters]."""
    columns = os.environ.get("COLUMNS", "")
    if not columns.isdigit() and not sys.stdout.isatty():
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


def complain(text: str) -> None:
    """Print a line to stderr."""
    from rockframe.cells import plain

    print(plain(f"rockframe: {text}"), file=sys.stderr, flush=True)


def show_rejections(rejections: Sequence[InputOutcome]) -> int:
    """Print one line for each rejected file to stderr. Return the exit status.

    Files of no known format in one archive share a line.
    """
    foreign: dict[str, list[str]] = {}
    for rejection in rejections:
        archive, inside, name = rejection.file.partition(":")
        if inside and "unknown format" in rejection.reason:
            foreign.setdefault(archive, []).append(name)
    for archive, names in foreign.items():
        if len(names) > 1:
            shown = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
            complain(f"rejected: {archive}: {len(names)} files are of no known format: {shown}")
    several = {archive for archive, names in foreign.items() if len(names) > 1}
    for rejection in rejections:
        archive, inside, _ = rejection.file.partition(":")
        if inside and archive in several and "unknown format" in rejection.reason:
            continue
        where = rejection.file if rejection.line is None else f"{rejection.file}:{rejection.line}"
        complain(f"rejected: {where}: {rejection.reason}")
    return 1 if rejections else 0


@contextmanager
def progress_names(what: str) -> Iterator[Callable[[str], None]]:
    """Yield a callback that shows the name of the current item if stderr is a terminal."""
    if not sys.stderr.isatty():
        yield lambda _name: None
        return
    from rich.console import Console
    from rich.text import Text

    from rockframe.cells import plain

    with Console(stderr=True).status(what) as status:
        yield lambda name: status.update(Text(plain(f"{what} {name}")))


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

        def update(done: int, total: int) -> None:
            now = f"{what} {min(done + 1, total)} of {total}"
            bar.update(task, completed=done, total=total, description=now)

        yield update


@contextmanager
def progress_of_steps(
    what: str,
) -> Iterator[tuple[Callable[[str, int, int], None], Callable[[str, int, int | None], None]]]:
    """Yield two callbacks, one for steps and one for the progress within a step.

    The first takes the finished step, its number and the total; the second the step under way, the
    number of its finished parts, and the total or None. On a terminal each draws a bar; elsewhere
    the first prints a line with the time since the start.
    """
    began = time.monotonic()

    def line(name: str, done: int, total: int) -> None:
        passed = time.monotonic() - began
        print(f"rockframe: {done}/{total} {name}, {passed:.1f} s", file=sys.stderr, flush=True)

    if not sys.stderr.isatty():
        yield line, lambda _name, _done, _total: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    from rockframe.cells import plain

    with Progress(console=Console(stderr=True), transient=True) as bars:
        steps, parts = bars.add_task(what, total=None), bars.add_task("", visible=False, total=None)

        def on_step(_name: str, done: int, total: int) -> None:
            now = f"{what} {min(done + 1, total)} of {total}"
            bars.update(steps, completed=done, total=total, description=now)
            bars.reset(parts, visible=False)

        def on_progress(name: str, done: int, total: int | None) -> None:
            now = escape(plain(name)) + (f" {min(done + 1, total)} of {total}" if total else "")
            bars.update(parts, completed=done, total=total, description=now, visible=True)

        yield on_step, on_progress
