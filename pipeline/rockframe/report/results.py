"""The table of results of a page as HTML, column by column.

A page has up to thousands of rows. Jinja needs 10 us for each cell of them, this module 1 us.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Self, TypeVar

from markupsafe import Markup, escape

from rockframe.cells import DASH, Column, in_digits, number, plain
from rockframe.results.run import Run
from rockframe.results.tables.rows import OVERVIEW, band_words, critical_scale
from rockframe.rocking import SpreadVerdict
from rockframe.web import strip_svg, tone

Value = TypeVar("Value")

#: Start of a row, and of a cell that follows another cell.
_ROW: Final = "    <tr"
_CELL: Final = "      <td"


@dataclass(frozen=True)
class ResultTable:
    """The table of results of a page.

    Parameters
    ----------
    rows : sequence of mapping of str to str
        Rows of ``table.csv``.
    verdicts : sequence of SpreadVerdict
        The verdict of each row.
    tones : sequence of str
        The class of the colour of each verdict.
    columns : sequence of Column
        The columns that have a value in any row.
    strips : sequence of Markup
        The strip of each row, "" without one; empty if margins were not computed.
    """

    rows: Sequence[Mapping[str, str]]
    verdicts: Sequence[SpreadVerdict]
    tones: Sequence[str]
    columns: Sequence[Column]
    strips: Sequence[Markup]

    @classmethod
    def of(cls, run: Run) -> Self:
        """Return the table of the rows of a run."""
        tones = [tone(verdict) for verdict in run.verdicts]
        return cls(run.rows, run.verdicts, tones, shown(run.rows, run.verdicts), _strips(run))

    @property
    def margin(self) -> str:
        """Key of the column of the margin, which strips precede; "" without one."""
        return next((column.key for column in self.columns if column.rule is critical_scale), "")

    def html(self, history_of: Mapping[int, int]) -> Markup:
        """Return all rows as HTML, one on each line; their texts are plain and escaped.

        Parameters
        ----------
        history_of : mapping of int to int
            Number of the history on the page, by the number of its row.
        """
        starts = [f'{_ROW} data-verdict="{verdict.kind}">' for verdict in self.verdicts]
        for place, history in history_of.items():
            starts[place] = f'{starts[place][:-1]} data-history="{history}">'
        cells = (self._cells(column, history_of) for column in self.columns)
        rows = map("".join, zip(starts, *cells, strict=True))
        return Markup("".join(f"{row}</tr>\n" for row in rows))  # noqa: S704 -- escaped above

    def _cells(self, column: Column, history_of: Mapping[int, int]) -> Iterable[str]:
        """Return the cells of a column, those of the margin with the strips before them."""
        kind = "number" if column.form else "text" if column.wraps else ""
        start = f'{_CELL} class="{"minor" if column.minor else ""} {kind}"'
        texts = _texts(column, self.rows)
        if not column.form:
            contents = self._contents(column, map(_escaped, texts), history_of)
            return (f"{start}>{content}</td>" for content in contents)
        orders = _orders(column, self.rows, texts)
        pairs = zip(orders, map(_escaped, texts), strict=True)
        cells = (f'{start} data-order="{order}">{text}</td>' for order, text in pairs)
        if column.key != self.margin or not self.strips:
            return cells
        beside = zip(orders, self.strips, cells, strict=True)
        return (
            f'<td class="strips" data-order="{order}">{strip}</td>{cell}'
            for order, strip, cell in beside
        )

    def _contents(
        self, column: Column, texts: Iterable[str], history_of: Mapping[int, int]
    ) -> Iterable[str]:
        """Return the content of the cells of a column of texts, as HTML."""
        if column.key == "verdict":
            pairs = zip(self.tones, texts, strict=True)
            return [f'<span class="badge {name}">{text}</span>' for name, text in pairs]
        contents = [*texts]
        for place, history in history_of.items() if column.key == "structure" else ():
            words = ", ".join(_escaped(self.rows[place][key]) for key in ("record", "structure"))
            link = f'<a href="#history-{history}" aria-label="{words}">'
            contents[place] = f"{link}{contents[place]}</a>"
        return contents


def _texts(column: Column, rows: Sequence[Mapping[str, str]]) -> list[str]:
    """Return the text of each cell of a column; equal values are formatted once."""
    if column.rule is not None or column.mark is not None:
        return [column.cell(row) or DASH for row in rows]
    if not column.form:
        return [row.get(column.key) or DASH for row in rows]

    def text(value: str) -> str:
        return in_digits(column.factor * number(value), column.form)

    return _of_each_value(text, (row.get(column.key, "") for row in rows))


def _orders(
    column: Column, rows: Sequence[Mapping[str, str]], texts: Sequence[str]
) -> Sequence[str]:
    """Return the key of each cell that sorts a column of numbers.

    Unknown numbers are below all others, and lower bounds such as "> 10" above.
    """

    def order(value: str) -> str:
        of_cell = number(value)
        return str(of_cell) if math.isfinite(of_cell) else "-Infinity"

    orders = _of_each_value(order, (row[column.key] for row in rows))
    if column.rule is None:
        return orders
    pairs = zip(orders, texts, strict=True)
    return ["Infinity" if text.startswith(">") else order for order, text in pairs]


def _of_each_value(function: Callable[[str], Value], values: Iterable[str]) -> list[Value]:
    """Return the function of each value, called once for each different one."""
    return [*map(lru_cache(maxsize=None)(function), values)]


@lru_cache(maxsize=4096)  # columns repeat their names and words
def _escaped(text: str) -> str:
    return str(escape(plain(text)))


def shown(rows: Sequence[Mapping[str, str]], verdicts: Sequence[SpreadVerdict]) -> list[Column]:
    """Return the columns of the overview that have a value in any row.

    Examples
    --------
    >>> from rockframe.rocking import Verdict
    >>> rows = [{"record": "A", "magnitude": "", "verdict": "stands"}]
    >>> [column.head for column in shown(rows, [SpreadVerdict(Verdict.STANDS)])]
    ['Record', 'Nominal verdict']
    """
    heads = {*rows[0]} if rows else set()
    empty = heads
    for row in rows:
        empty = {head for head in empty if not row[head]}
    filled = heads - empty
    there = {column.key: column for column in OVERVIEW if _has_value(column, rows, filled)}
    if "robust_scale_10" in there:  # a table has one margin
        there.pop("critical_scale", None)
    if "verdict" in there and all(verdict.is_nominal for verdict in verdicts):
        there["verdict"] = replace(there["verdict"], head="Nominal verdict")
    return [*there.values()]


def _has_value(column: Column, rows: Sequence[Mapping[str, str]], filled: Collection[str]) -> bool:
    """Return True if a column has a value in any row, of which these columns are not empty."""
    if column.key in filled:
        return True
    if column.rule not in (critical_scale, band_words):
        return False
    # their values are in several columns of the table
    start = "largest_" if column.rule is critical_scale else column.key.partition("*")[0]
    some = any(head.startswith(start) for head in filled)
    return some and any(column.cell(row) != DASH for row in rows)


def _strips(run: Run) -> list[Markup]:
    """Return the strip of each row, "" without one; empty if margins were not computed."""
    strips = [run.strips.get((row["record_id"], row["structure"])) for row in run.rows]
    drawn = [Markup(strip_svg(strip) if strip else "") for strip in strips]  # noqa: S704 -- our own picture
    return drawn if any(drawn) else []
