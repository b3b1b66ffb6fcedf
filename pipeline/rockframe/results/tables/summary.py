"""Summaries: structures over all records, and records by structures in one quantity."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import Cells, Column, in_digits, number, rows_of_columns
from rockframe.quantities import IN_MATRICES, QUANTITIES, Quantity
from rockframe.results.tables.notes import MOST_NAMED, left_out_words
from rockframe.results.tables.number_store import NumberStore, mean_shares_of, over_records
from rockframe.results.tables.outcomes import (
    OF_OUTCOMES,
    SEARCHED,
    OutcomeColumns,
    column_of,
    margin,
    margin_of,
    peak_in_words,
    peak_of,
    severity,
    share_overturned,
)
from rockframe.results.tables.rows import (
    Row,
    band_words,
    critical_scale,
    is_computed,
    rocks,
    share_words,
)
from rockframe.rocking.verdict import Verdict

#: Columns of a structure in a summary.
OF_STRUCTURE: Final = ("height_m", "width_m", "mass_ratio", "slenderness_deg")
#: First columns of a summary, by which an earlier one is recognised.
SUMMARY_COLUMNS: Final = ("structure", *OF_STRUCTURE, "records")
AnyRow = TypeVar("AnyRow", bound=Cells)
AnyBlock = TypeVar("AnyBlock", bound=Mapping[str, Sequence[Any]])


def _share_column(_row: Cells) -> str:
    return "share_overturned"


@dataclass(frozen=True)
class Matrix:
    """A matrix of records and structures: its heading, and its values.

    Parameters
    ----------
    words : str
        Heading, with the unit.
    column : callable
        Returns the column of the matrix for a row, after the name of the structure.
    value : callable
        Returns the value of a row.
    form : str
        Format of numbers.
    factor : float
        Conversion to the unit of the heading.
    """

    words: str
    column: Callable[[Cells], str]
    value: Callable[[Cells], float]
    form: str
    factor: float = 1.0

    def cell(self, row: Cells, key: str) -> str:
        """Return the text of a cell."""
        value = number(row.get(key))
        if value == math.inf:
            return Verdict.OVERTURNS.label
        return in_digits(self.factor * value, self.form)


def _matrix(quantity: Quantity) -> Matrix:
    """Return the matrix of a quantity."""
    column, value = partial(column_of, quantity), partial(peak_of, quantity)
    return Matrix(quantity.heading, column, value, quantity.form, quantity.factor)


#: Matrices by name.
MATRICES: Final[Mapping[str, Matrix]] = MappingProxyType(
    {
        "share_overturned": Matrix(
            "share that overturns [%]", _share_column, share_overturned, ".0f", 100.0
        ),
        **{quantity.name: _matrix(quantity) for quantity in IN_MATRICES},
        "margin": Matrix("margin", margin_of, margin, ".2f"),
    }
)


def summary_rows(
    rows: Iterable[Cells],
    recordings: Mapping[str, Hashable] | None = None,
    left_out: Mapping[str, str] | None = None,
) -> list[Row]:
    """Return a row for each structure: its responses over all records.

    Parameters
    ----------
    rows : iterable of mapping
        Rows of `response_rows`, `table_rows` or `screen_rows`.
    recordings : mapping of str to hashable, optional
        Recording of each record, by identifier: components of one recording are drawn together for
        the interval of the share. By default each record is its own recording.
    left_out : mapping of str to str, optional
        Reasons why other records have no result, by identifier.

    Returns
    -------
    list of dict
        In the order of the structures: `OF_STRUCTURE` where known; the number of ``records``, the
        number ``left_out`` and which and why, ``left_out_words``;
        ``share_overturned``, the mean over the records of the share of the ensemble that overturns,
        with its 90 % interval; ``uplifted``, the number of records with uplift, and the median of
        the drift over these; ``model_ends``, the number of records under which the model ends for a
        share of the ensemble, and the largest of these shares; 16, 50 and 84 %
        quantiles over the records of the rotation and the drift, where each record counts with the
        median of its ensemble, and as infinite if that overturns; the smallest margin, NaN if that
        of a record lies beyond a smaller scale, up to which it was searched; and the name of the
        ``worst_record`` by `severity`.
        Without an ensemble all of them are those of the stated structure.

    Examples
    --------
    >>> rows = [{"structure": "bent", "record_id": name, "verdict": verdict, "peak_u_m": u}
    ...         for name, verdict, u in (("a", "stands", 0.1), ("b", "stands", 0.3),
    ...                                  ("c", "overturns", 2.0))]
    >>> (row,) = summary_rows(rows)
    >>> row["records"], row["peak_u_50_m"], row["peak_u_84_m"], row["worst_record"]
    (3, 0.3, inf, 'c')
    """
    summary = Summary()
    deque(summary.passed(rows), maxlen=0)
    return summary.rows(recordings, left_out)


class _OfStructures:
    """The responses of structures, in one plane or in both directions."""

    def __init__(self, folder: Path | None) -> None:
        self.each: dict[str, _OverRecords] = {}
        self.numbers = NumberStore(_SERIES, folder)

    def of(self, row: Cells) -> _OverRecords:
        """Return the responses of the structure of a row."""
        structure = row["structure"]
        if structure not in self.each:
            self.each[structure] = _OverRecords(row)
        return self.each[structure]

    def keep(self) -> None:
        """Include the rows that passed by, and keep their numbers by structure."""
        of_records: dict[tuple[str, ...], dict[str, NDArray[np.float64]]] = {}
        for structure, entry in self.each.items():
            names, numbers = entry.taken()
            if names:
                of_records.setdefault(names, {})[structure] = numbers
        for names, of_structures in of_records.items():
            self.numbers.add([*of_structures], names, np.array([*of_structures.values()]))

    def join(self, other: _OfStructures) -> None:
        """Include the responses to further records."""
        self.keep()
        other.keep()
        for structure, entry in other.each.items():
            if structure in self.each:
                self.each[structure].join(entry)
            else:
                self.each[structure] = entry
        self.numbers.join(other.numbers)


class Summary:
    """The summary of rows that pass by, of which it keeps only a few numbers.

    Parameters
    ----------
    folder : Path, optional
        Folder of a temporary file for the numbers of many responses; by default in memory.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._in_one_plane, self._in_both = _OfStructures(folder), _OfStructures(folder)
        self._components: set[str] = set()
        self._passed = 0

    def passed(self, rows: Iterable[AnyRow]) -> Iterator[AnyRow]:
        """Yield the rows, and include them in the summary."""
        for row in rows:
            responses = self._in_one_plane
            if row.get("components"):
                responses = self._in_both
                self._components |= {*row["components"].split()}
            responses.of(row).include(row)
            self._passed += 1
            if self._passed % _PASSED == 0:
                self.keep()
            yield row

    def keep(self) -> None:
        """Include the last rows that passed by, which wait to be included together."""
        self._in_one_plane.keep()
        self._in_both.keep()

    def join(self, other: Summary) -> None:
        """Include the rows that another summary includes, after those of this one."""
        self._components |= other._components
        self._in_one_plane.join(other._in_one_plane)
        self._in_both.join(other._in_both)

    def included(self, blocks: Iterable[AnyBlock]) -> Iterator[AnyBlock]:
        """Yield tables of `include`, and include them in the summary at the end."""
        waiting = []
        for block in blocks:
            waiting.append({key: block[key] for key in _OF_SUMMARY if key in block})
            yield block
        self.include(waiting)

    def include(self, blocks: Iterable[Mapping[str, Sequence[Any]]]) -> None:
        """Include rows, a table for each motion with the same structures in one order."""
        remaining = iter(blocks)
        while some := list(islice(remaining, _ROWS)):
            if "components" in some[0]:  # rows in both directions are among them
                deque(self.passed(rows_of_columns(some)), maxlen=0)
                continue
            included = [key for key in OF_OUTCOMES if key in some[0]]
            firsts = rows_of_columns([some[0]])
            for k, first in enumerate(firsts):
                columns = {key: [block[key][k] for block in some] for key in included}
                self._in_one_plane.of(first).include_columns(columns)
            self.keep()

    def rows(
        self,
        recordings: Mapping[str, Hashable] | None = None,
        left_out: Mapping[str, str] | None = None,
    ) -> list[Row]:
        """Return the rows of `summary_rows` for all rows that passed by."""
        self.keep()
        each = [self._that_counts(structure) for structure in self._in_one_plane.each]
        groups = [each] if _alike(each) else [[entry] for entry in each]
        intervals = [row for group in groups for row in _mean_shares(group, recordings or {})]
        some = any(entry.not_computed for entry, _ in each)  # only then there is a column
        listed = []
        for (entry, of_all), interval in zip(each, intervals, strict=True):
            row = entry.row(of_all.numbers.of(entry.structure), interval)
            in_one_plane = self._in_one_plane.each[entry.structure].count
            row["left_out"] = len(left_out or {})
            row["left_out_words"] = left_out_words(left_out or {}, in_one_plane)
            row |= {"not_computed": entry.not_computed} if some else {}
            listed.append(row | (self._directions(entry.structure) if self._in_both.each else {}))
        return listed

    def _that_counts(self, structure: str) -> _Counted:
        """Return the responses in both directions of a structure, if there are any, or in one."""
        both = self._in_both.each.get(structure)
        if both is not None and both.count:
            return both, self._in_both
        return self._in_one_plane.each[structure], self._in_one_plane

    def _directions(self, structure: str) -> Row:
        """Return the number of directions of the motions that count, and why it is only one."""
        both, count = self._in_both.each.get(structure), self._in_one_plane.each[structure].count
        row: Row = {"directions": 1, "not_both": "", "records_in_one_plane": count, "alone": ""}
        if both is not None and both.count:
            records = self._in_one_plane.numbers.records_of(structure)
            alone = [name for name in records if name not in self._components]
            return row | {"directions": 2, "alone": " ".join(alone)}
        return row | {"not_both": "" if both is None else both.reason}


#: The responses of a structure, and those of all structures that have its numbers.
_Counted: TypeAlias = "tuple[_OverRecords, _OfStructures]"


def _alike(each: Sequence[_Counted]) -> bool:
    """Return True if several structures respond to the same records."""
    if len(each) < 2:
        return False
    groups = {(id(of_all), of_all.numbers.groups_of(entry.structure)) for entry, of_all in each}
    if len(groups) == 1 or len({entry.count for entry, _ in each}) > 1:
        return len(groups) == 1
    (first, of_first), *others = each
    records = of_first.numbers.records_of(first.structure)
    return all(of_all.numbers.records_of(e.structure) == records for e, of_all in others)


def _mean_shares(group: Sequence[_Counted], recordings: Mapping[str, Hashable]) -> list[Row]:
    """Return the mean shares of structures that respond to the same records."""
    shares = (of_all.numbers.of(entry.structure)[0].copy() for entry, of_all in group)
    first, of_first = group[0]
    return mean_shares_of(shares, of_first.numbers.records_of(first.structure), recordings)


#: Columns that a summary reads.
_OF_SUMMARY: Final = (*OF_OUTCOMES, *OF_STRUCTURE, "structure", "components")
#: Number of rows of a structure that are included in a summary together.
_ROWS: Final = 64
#: Number of rows that pass by until their numbers are kept by structure.
_PASSED: Final = 2**18
#: Number of numbers of a response: its share, its peaks, and 1 if it uplifts.
_SERIES: Final = 2 + len(IN_MATRICES)
#: Place of the drift among these.
_DRIFT: Final = 1 + IN_MATRICES.index(QUANTITIES["peak_u"])


class _OverRecords:
    """The responses of one structure to the records that were included so far."""

    def __init__(self, first: Cells) -> None:
        self.structure: str = first["structure"]
        self._facts = {key: first.get(key) for key in (*OF_STRUCTURE, "kind")}
        self._worst, self._severity = first.get("record") or first["record_id"], severity(first)
        self._waiting: list[Cells] = []
        self.count = 0
        self._names: list[str] = []
        self._numbers: list[NDArray[np.float64]] = []
        self._margins = dict.fromkeys((*SEARCHED, *SEARCHED.values()), math.nan)
        self._beyond = dict.fromkeys(SEARCHED, math.inf)
        self._uplifted, self._nominal = 0, True
        self._model_ends, self._largest_share_ends = 0, 0.0
        self._implausible: list[str] = []
        self.not_computed, self.reason = 0, ""

    def include(self, row: Cells) -> None:
        self._waiting.append({key: row[key] for key in OF_OUTCOMES if key in row})
        if len(self._waiting) >= _ROWS:
            self._include_waiting()

    def _include_waiting(self) -> None:
        if self._waiting:
            keys = dict.fromkeys(key for row in self._waiting for key in row)
            self.include_columns({key: [row.get(key) for row in self._waiting] for key in keys})
            self._waiting = []

    def taken(self) -> tuple[tuple[str, ...], NDArray[np.float64]]:
        """Return the names of the records and the numbers since the last call, which then go.

        The numbers have the shape (series, records).
        """
        self._include_waiting()
        names, numbers = tuple(self._names), [np.empty((_SERIES, 0)), *self._numbers]
        self._names, self._numbers = [], []
        return names, np.concatenate(numbers, axis=1)

    def join(self, other: _OverRecords) -> None:
        """Include the responses to further records, except the numbers that were taken."""
        self.count += other.count
        self._implausible = [*self._implausible, *other._implausible][:MOST_NAMED]
        for key, smallest in other._margins.items():
            self._margins[key] = float(np.fmin(self._margins[key], smallest))
        for key, least in other._beyond.items():
            self._beyond[key] = min(self._beyond[key], least)
        self._uplifted += other._uplifted
        self._nominal = self._nominal and other._nominal
        self._model_ends += other._model_ends
        self._largest_share_ends = max(self._largest_share_ends, other._largest_share_ends)
        if other._severity < self._severity:
            self._worst, self._severity = other._worst, other._severity
        self.not_computed += other.not_computed
        self.reason = other.reason or self.reason

    def include_columns(self, columns: Mapping[str, Sequence[Any]]) -> None:
        """Include the rows of a table of columns."""
        rows = OutcomeColumns(columns)
        missing = np.flatnonzero(~rows.computed)
        if missing.size:
            self.not_computed += missing.size
            self.reason = str(rows.texts("not_computed")[missing[-1]] or "")
            computed = np.flatnonzero(rows.computed).tolist()
            if not computed:
                return
            rows = OutcomeColumns(
                {key: [column[k] for k in computed] for key, column in columns.items()}
            )
        uplifted = rows.uplifted()
        self._names += rows.texts("record_id")
        self.count += uplifted.size
        peaks = map(rows.peaks, IN_MATRICES)
        self._numbers.append(np.stack([rows.shares, *peaks, uplifted]).astype(np.float64))
        self._uplifted += int(uplifted.sum())
        peaks_in_words = zip(rows.texts("record_id"), rows.texts("pga_g"), strict=True)
        implausible = [
            f"{name}, {words}" for name, pga in peaks_in_words if (words := peak_in_words(pga))
        ]
        self._implausible = [*self._implausible, *implausible][:MOST_NAMED]
        ends = rows.shares_of_ends()
        self._model_ends += int((ends > 0.0).sum())
        self._largest_share_ends = max(self._largest_share_ends, float(np.nanmax(ends)))
        self._nominal = self._nominal and bool(rows.nominal.all())
        for row in rows.that_may_be_worst():
            if (severe := severity(row)) < self._severity:
                self._worst, self._severity = row.get("record") or row["record_id"], severe
        self._include_margins(rows)

    def _include_margins(self, rows: OutcomeColumns) -> None:
        margins = {key: rows.numbers(key) for key in self._margins}
        for key, smallest in self._margins.items():
            self._margins[key] = float(np.fmin.reduce(margins[key], initial=smallest))
        for key, searched in SEARCHED.items():
            beyond = margins[searched][np.isnan(margins[key]) & np.isfinite(margins[searched])]
            self._beyond[key] = float(beyond.min(initial=self._beyond[key]))

    def _smallest_margins(self) -> dict[str, float]:
        """Return the smallest margins; NaN if that of a record may be smaller than those found.

        A record whose margin lies beyond the largest scale that was searched has any larger margin.
        """
        return self._margins | {
            key: math.nan for key, least in self._beyond.items() if least < self._margins[key]
        }

    def row(self, numbers: NDArray[np.float64], interval: Row) -> Row:
        """Return the row of the structure, with its mean share and the interval of that.

        Parameters
        ----------
        numbers : array, shape (series, records)
            Its numbers.
        interval : Row
            That of `mean_shares_of`.
        """
        _, *peaks, uplifted = numbers
        return {
            "structure": self.structure,
            **{key: number(self._facts[key]) for key in OF_STRUCTURE},
            "records": self.count,
            **dict.fromkeys(("left_out", "left_out_words")),  # filled for all structures at once
            **interval,
            "uplifted": self._uplifted if rocks(self._facts) else None,
            "uplifted_peak_u_50_m": over_records(numbers[_DRIFT, uplifted == 1.0])[1],
            "model_ends": self._model_ends,
            "largest_share_model_ends": self._largest_share_ends,
            **{
                column: value
                for quantity, values in zip(IN_MATRICES, peaks, strict=True)
                for column, value in zip(quantity.band_columns, over_records(values), strict=True)
            },
            **self._smallest_margins(),
            "implausible": "; ".join(self._implausible),
            "worst_record": self._worst,
            "nominal": self._nominal,
        }


#: What the numbers of a summary are, for the line below it.
_SUMMARY_LEGEND: Final = (
    "Overturn over all records: mean of their shares, with the 90 % interval from drawing "
    "recordings with replacement, at least as wide as Wilson's for their number. 16, 50, 84 % over "
    "all records: each counts with the median of its ensemble, and as infinite if that overturns. "
    "The margin is the smallest of all records. Worst record: the largest share that overturns, "
    "then the largest rotation."
)
_NOMINAL_LEGEND: Final = (
    "Overturn over all records: share of the records, with the 90 % interval from drawing "
    "recordings with replacement, at least as wide as Wilson's for their number. 16, 50, 84 % over "
    "all records: those that overturn count as infinite. Worst record: one that overturns, then "
    "the largest rotation."
)
#: Columns of a summary in terminal and page.
_SUMMARY: Final = (
    Column("Structure", "structure", priority=0),
    Column("Records>", "records", priority=2),
    Column("Overturn\n(90 %)>", "share_overturned", rule=share_words),
    Column("Uplift\nin>", "uplifted", priority=3),
    *(
        Column(
            f"{quantity.heading}\n16 50 84 %>",
            quantity.column("*"),
            rule=band_words,
            priority=quantity.priority,
        )
        for quantity in IN_MATRICES
    ),
    Column("10 %\noverturn at>", "robust_scale_10", ".2f", rule=critical_scale),
    Column("critical\nscale>", "critical_scale", ".2f", rule=critical_scale),
    Column("Worst record", "worst_record", wraps=True),
)


def summary_title(rows: Sequence[Cells], what: str = "records") -> str:
    """Return the title of a summary, which states how many of the records it covers.

    Examples
    --------
    >>> summary_title([{"records": 14, "left_out": 6}]), summary_title([{"records": "9"}])
    ('Over 14 of 20 records', 'Over all records')
    """
    counts = (row.get("records_in_one_plane") or row["records"] for row in rows)
    computed = max(map(int, counts), default=0)
    left_out = max((int(row.get("left_out") or 0) for row in rows), default=0)
    return f"Over {computed} of {computed + left_out} {what}" if left_out else f"Over all {what}"


def summary_legend(rows: Sequence[Cells]) -> str:
    """Return what the numbers of a summary are, in words."""
    nominal = any(str(row["nominal"]) == "True" for row in rows)
    return _NOMINAL_LEGEND if nominal else _SUMMARY_LEGEND


def summary_columns(rows: Sequence[Cells]) -> list[Column]:
    """Return the columns of a printed summary, with the margin that its rows have."""
    searched = ("critical_scale", "largest_scale")
    margin = ""
    if any(math.isfinite(number(row.get(key))) for row in rows for key in searched):
        margin = "critical_scale"
    if any(margin_of(row) == "robust_scale_10" for row in rows):
        margin = "robust_scale_10"
    return [
        column for column in _SUMMARY if column.rule is not critical_scale or column.key == margin
    ]


def matrix_rows(rows: Iterable[Cells], quantity: str) -> list[Row]:
    """Return a row for each record, with the value of a quantity for each structure.

    Parameters
    ----------
    rows : iterable of mapping
        As for `summary_rows`.
    quantity : str
        One of `MATRICES`: ``share_overturned``, a quantity such as ``peak_u`` (the median of the
        ensemble, or nominal; infinite if that overturns), or ``margin``.

    Examples
    --------
    >>> rows = [{"structure": name, "record_id": "a", "verdict": "stands", "peak_u_m": u}
    ...         for name, u in (("bent", 0.1), ("pier", 0.2))]
    >>> matrix_rows(rows, "peak_u")
    [{'record_id': 'a', 'bent peak_u_m': 0.1, 'pier peak_u_m': 0.2}]
    """
    quantity_of, lines, columns = MATRICES[quantity], dict[str, Row](), dict[str, str]()
    for row in rows:
        structure = row["structure"]
        if structure not in columns or is_computed(row):
            columns[structure] = f"{structure} {quantity_of.column(row)}"
        of_record = lines.setdefault(row["record_id"], {"record_id": row["record_id"]})
        of_record[columns[structure]] = quantity_of.value(row)
    return list(lines.values())


def matrix_columns(matrix: Sequence[Row], quantity: str) -> list[Column]:
    """Return the columns of a printed matrix: the records, and the structures by name."""
    quantity_of = MATRICES[quantity]
    names = [key for key in (matrix[0] if matrix else {}) if key != "record_id"]
    structures = [Column(f"{key.partition(' ')[0]}>", key, rule=quantity_of.cell) for key in names]
    return [Column("Record", "record_id"), *structures]


def tables_of(rows: Sequence[Row], summary: Sequence[Row], main: str) -> dict[str, Sequence[Row]]:
    """Return the tables of responses by kind: summary, matrices, and the rows as `main`."""
    matrices = {name: matrix_rows(rows, name) for name in MATRICES}
    filled = {
        f"matrix {name}": matrice
        for name, matrice in matrices.items()
        if any(map(_has_value, matrice))
    }
    return {"summary": summary, **filled, main: rows}


def _has_value(row: Row) -> bool:
    return any(isinstance(cell, float) and not math.isnan(cell) for cell in row.values())


def first_columns(main: str, *columns: str) -> dict[str, Sequence[str]]:
    """Return the first columns of each of these tables, by which earlier ones are recognised."""
    first = {f"matrix {name}": ("record_id",) for name in MATRICES}
    return {"summary": SUMMARY_COLUMNS, **first, main: columns}
