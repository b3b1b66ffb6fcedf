"""Write the outputs of the stages as one CSV table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from rockframe.paper.table1 import with_paper_facts
from rockframe.provenance import refuse_overwriting
from rockframe.results.tables.formats import write_rows_as
from rockframe.results.tables.table import TableRow, table_rows


def table_stage(
    records: Path, pulses: Path, response: Path, output: Path, table_format: str = "csv"
) -> int:
    """Write a row for each record and structure: ``table.csv``.

    Parameters
    ----------
    records, pulses, response : Path
        Outputs of `ingest_stage`, `pulse_stage` and `respond_stage` for the same records.
    output : Path
        File to write.
    table_format : str
        One of `rockframe.cells.TABLE_FORMATS`.

    Returns
    -------
    int
        Number of rows.

    Raises
    ------
    InputError
        If a file cannot be read or belongs to other records, or the table cannot be written.
    """
    refuse_overwriting([output], (records, pulses, response))
    return write_table(table_rows_of(records, pulses, response), output, table_format)


def table_rows_of(records: Path, pulses: Path, response: Path) -> Iterator[TableRow]:
    """Return the rows, with the paper's values for the paper's records."""
    return map(with_paper_facts, table_rows(records, pulses, response))


def write_table(rows: Iterable[Any], path: Path, table_format: str = "csv") -> int:
    """Write rows with unknown values blank, and return their number."""
    return write_rows_as(path, map(vars, rows), table_format)
