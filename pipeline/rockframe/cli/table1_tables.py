"""The tables that `rockframe table1` prints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from rockframe.cli.console import number, show_table, table_width
from rockframe.cli.respond import response_cells
from rockframe.matching import LEVEL
from rockframe.paper import BORROWED, Comparison
from rockframe.results import TableRow, pulse_mark

_SHORT: Final = {
    "symmetric_ricker": "sym",
    "antisymmetric_ricker": "antisym",
    "ricker_any_phase": "any phase",
    "mavroeidis_papageorgiou": "not: M.-P.",
    "": "–",
}
_LABELS: Final = {
    "pga_g": "PGA [g]",
    "pgv_m_s": "PGV [m/s]",
    "a_p_g": "a_p [g]",
    "T_p_s": "T_p [s]",
}
_OF_RECORD: Final = (
    *("Earthquake", "Record", "M_w>", "R\n[km]>", "PGA\n[g]>", "PGV\n[m/s]>", "a_p\n[g]>"),
    *("T_p\n[s]>", "Ricker"),
)
_OF_RESPONSE: Final = (
    "Structure",
    "θ/α\n>",
    "u_max\n[cm]>",
    "v_max\n[cm]>",
    "critical\nscale>",
    "Verdict",
)
#: Least width for one table of records and responses [characters]; in less, there are two.
_WIDE: Final = 142


def show(rows: Sequence[TableRow], comparisons: Sequence[Comparison], said: Sequence[str]) -> None:
    """Print records, pulses and responses, then the comparison with the paper."""
    if table_width() >= _WIDE:
        title = "Records, pulses and response"
        show_table(title, (*_OF_RECORD, *_OF_RESPONSE), _together(rows))
    else:
        first = {row.record_id: row for row in reversed(rows)}
        show_table("Records and pulses", _OF_RECORD, [_record(r) for r in reversed(first.values())])
        show_table("Response", ("Record", *_OF_RESPONSE), _together(rows, short=True))
    _show_notes(rows)
    if comparisons:
        show_table(
            "The paper's records: its values and ours",
            ("Record", "", "paper>", "ours>", "difference>", "Ricker", ""),
            [_comparison(comparison) for comparison in comparisons],
        )
        print("T_p and a_p depend on the wavelet; the paper does not name its own for each record.")
    for i, statement in enumerate(said):
        print(f"- {statement}" if i else statement)
    if comparisons:
        print()


def _show_notes(rows: Sequence[TableRow]) -> None:
    notes = []
    if any(row.at_period_bound for row in rows):
        notes.append("* the end of the range of periods searched, not a maximum")
    mark = max((pulse_mark(vars(row)) for row in rows), default="")
    if mark:
        notes.append(
            f"{mark} best match, not told from noise: noise like the record matches as well in\n"
            f"  more than {100.0 * LEVEL:g} % of the draws (pulse_p_value in table.csv)"
        )
    if any(BORROWED in row.facts_source for row in rows):
        notes.append(f"Names, M_w and R that the files do not state: {BORROWED}.")
    for note in notes:
        print(note)
    if notes:
        print()


def _together(rows: Sequence[TableRow], short: bool = False) -> list[list[str]]:
    """Return the cells of records and responses; a record is named only in its first row."""
    cells: list[list[str]] = []
    last = ""
    for row in rows:
        record = [row.record] if short else _record(row)
        if row.record_id == last:
            record = [""] * len(record)
        elif last and row.structure != rows[-1].structure:
            cells.append([])
        last = row.record_id
        cells.append([*record, row.structure, *response_cells(vars(row))])
    return cells


def _record(row: TableRow) -> list[str]:
    return [
        row.event,
        row.record,
        number(row.magnitude, 1),
        number(row.epicentral_distance_km, 1),
        number(row.pga_g, 2),
        number(row.pgv_m_s, 2),
        number(row.a_p_g, 2),
        number(row.T_p_s, 2) + ("*" if row.at_period_bound else ""),
        _SHORT[row.wavelet] + pulse_mark(vars(row)),
    ]


def _comparison(comparison: Comparison) -> list[str]:
    return [
        comparison.record if comparison.quantity == "pga_g" else "",
        _LABELS[comparison.quantity],
        comparison.printed,
        number(comparison.ours, 3),
        f"{100.0 * comparison.relative_difference:+.1f} %",
        _SHORT[comparison.wavelet] if comparison.wavelet else "",
        comparison.remark,
    ]
