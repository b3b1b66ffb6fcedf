"""rockframe table: write the table of records, pulses and responses."""

from __future__ import annotations

import argparse

from rockframe.cells import TABLE_FORMATS
from rockframe.cli.arguments import add_format
from rockframe.cli.options import file_to_write, path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: three files of stages, and the table to write."""
    for stage, name in (("ingest", "records"), ("pulse", "pulses"), ("respond", "response")):
        parser.add_argument(name, type=path, help=f"output of `rockframe {stage}`")
    endings = tuple(TABLE_FORMATS.values())
    parser.add_argument(
        "--output", type=file_to_write(*endings), required=True, help="file to write"
    )
    add_format(parser, default=None)


def run(options: argparse.Namespace) -> int:
    """Write the table and print its length."""
    from rockframe.cli.console import show_json
    from rockframe.stages.table import table_rows_of, table_stage

    files = (options.records, options.pulses, options.response)
    known = {ending: name for name, ending in TABLE_FORMATS.items()}
    table_format = options.format or known[options.output.suffix.lower()]
    count = table_stage(*files, options.output, table_format)
    if options.json:
        rows = [vars(row) for row in table_rows_of(*files)]
        show_json({"rows": rows, "output": str(options.output)})
    else:
        print(f"{count} rows in {options.output}")
    return 0
