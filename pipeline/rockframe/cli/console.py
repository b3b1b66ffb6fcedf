"""What the terminal shows: tables, progress bars, rejections, JSON."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from rockframe.ingest import Rejection
    from rockframe.results import Entry

#: Width of tables where there is no terminal to ask: a log, a file, a pipe.
_PLAIN_WIDTH: Final = 150


def show_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; columns whose name ends in ``>`` are aligned to the right.

    An empty row draws a line between the rows around it.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(width=table_width(), highlight=False)
    table = Table(
        title=Text(title, style="bold"),
        title_justify="left",
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for name in columns:
        right = name.endswith(">")
        heading = Text(name.rstrip(">"))
        table.add_column(
            heading, justify="right" if right else "left", no_wrap=right, overflow="fold"
        )
    for row in rows:
        if row:
            table.add_row(*(Text(cell) for cell in row))
        else:
            table.add_section()
    console.print(table)


def table_width() -> int:
    """Return the number of columns there are for a table."""
    asked = os.environ.get("COLUMNS", "")
    if not asked.isdigit() and not sys.stdout.isatty():
        return _PLAIN_WIDTH
    return shutil.get_terminal_size().columns


def show_json(value: Any) -> None:
    """Print JSON; what is not a finite number is null."""
    print(json.dumps(_finite(value), indent=2, ensure_ascii=False, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value


def number(value: float, decimals: int) -> str:
    """Return a number with its decimals, or a dash for one that is not known."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else "–"


def show_rejections(rejections: Sequence[Rejection | Entry]) -> None:
    """Print one line for each rejected file, to the error stream."""
    for rejection in rejections:
        where = rejection.file if rejection.line is None else f"{rejection.file}:{rejection.line}"
        print(f"rockframe: rejected: {where}: {rejection.reason}", file=sys.stderr)


@contextmanager
def progress_names(what: str) -> Iterator[Callable[[str], None]]:
    """Give a callable for the name of what is being done; shown if a terminal is there."""
    if not sys.stderr.isatty():
        yield lambda _name: None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda name: status.update(f"{what} {name}")


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Give a callable for the number done and in all; it draws a bar if a terminal is there."""
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
