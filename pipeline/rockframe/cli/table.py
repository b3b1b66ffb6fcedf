"""rockframe table: write the table of records, pulses and responses."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.arguments import path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.paper import Comparison
    from rockframe.results import TableRow


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Three files of stages in, one table out."""
    add_stages(parser)
    parser.add_argument("--output", type=path, required=True, help="CSV file to write")


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
    rows = rows_of(*files)
    write_table(rows, options.output)
    if options.json:
        show_json({"rows": [vars(row) for row in rows], "output": str(options.output)})
    else:
        print(f"{len(rows)} rows in {options.output}")
    return 0


def rows_of(records: Path, pulses: Path, response: Path) -> list[TableRow]:
    """Return the rows, with what the paper says of its own records."""
    from rockframe.paper import with_paper_facts
    from rockframe.results import table_rows

    return [with_paper_facts(row) for row in table_rows(records, pulses, response)]


def write_table(rows: Sequence[TableRow] | Sequence[Comparison], path: Path) -> None:
    """Write rows as CSV; what is not known is empty."""
    import csv
    import math

    from rockframe.provenance import whole_file

    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(vars(rows[0]))
        for row in rows:
            writer.writerow(
                "" if isinstance(value, float) and math.isnan(value) else value
                for value in vars(row).values()
            )
