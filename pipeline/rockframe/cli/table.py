"""rockframe table: write the table of records, pulses and responses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.arguments import path
from rockframe.cli.outputs import file_to_write

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rockframe.paper import Comparison
    from rockframe.results import TableRow


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Three files of stages in, one table out."""
    add_stages(parser)
    parser.add_argument(
        "--output", type=file_to_write(".csv"), required=True, help="CSV file to write"
    )


def add_stages(parser: argparse.ArgumentParser) -> None:
    """The outputs of the stages for the same records."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument("pulses", type=path, help="output of `rockframe pulse`")
    parser.add_argument("response", type=path, help="output of `rockframe respond`")


def run(options: argparse.Namespace) -> int:
    """Write the table, and say how long it is."""
    from rockframe.cli.console import show_json
    from rockframe.provenance import refuse_overwriting

    files = (options.records, options.pulses, options.response)
    refuse_overwriting([options.output], files)
    count = write_table(rows_of(*files), options.output)
    if options.json:
        rows = [vars(row) for row in rows_of(*files)]
        show_json({"rows": rows, "output": str(options.output)})
    else:
        print(f"{count} rows in {options.output}")
    return 0


def rows_of(records: Path, pulses: Path, response: Path) -> Iterator[TableRow]:
    """Give the rows, with what the paper says of its own records."""
    from rockframe.paper import with_paper_facts
    from rockframe.results import table_rows

    return map(with_paper_facts, table_rows(records, pulses, response))


def write_table(rows: Iterable[TableRow] | Iterable[Comparison], path: Path) -> int:
    """Write rows as CSV, what is not known empty; return how many there are."""
    from rockframe import cells
    from rockframe.provenance import whole_file

    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        return cells.write_table(stream, map(vars, rows))
