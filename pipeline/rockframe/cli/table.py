"""rockframe table: write the table of records, pulses and responses."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rockframe.cli.options import path
from rockframe.cli.outputs import file_to_write

if TYPE_CHECKING:
    pass


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
    from rockframe.stages import table_rows_of, table_stage

    files = (options.records, options.pulses, options.response)
    count = table_stage(*files, options.output)
    if options.json:
        rows = [vars(row) for row in table_rows_of(*files)]
        show_json({"rows": rows, "output": str(options.output)})
    else:
        print(f"{count} rows in {options.output}")
    return 0
