"""rockframe report: write an HTML page of a run that works without a network."""

from __future__ import annotations

import argparse

from rockframe.cli.options import add_options, chosen, file_to_write, path
from rockframe.options.showing import ReportOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the folder of a run, and the page to write."""
    parser.add_argument(
        "folder",
        type=path,
        help="folder of a run, written by `rockframe table1` or `rockframe run`",
    )
    parser.add_argument(
        "--output",
        type=file_to_write(".html"),
        help="page to write (default: report.html in the folder)",
    )
    add_options(parser, ReportOptions)


def run(options: argparse.Namespace) -> int:
    """Verify the run, write the page, and print what it contains."""
    from rockframe.cli.console import show_json
    from rockframe.stages.report import PAGE, report_stage

    output = options.output or options.folder / PAGE
    counts = report_stage(options.folder, output, chosen(options, ReportOptions))
    size = output.stat().st_size
    if options.json:
        show_json({"output": str(output), "bytes": size, **counts})
    else:
        total = counts["histories"] + counts["left_out"]
        print(f"{output}: {size / 1e6:.1f} MB, {counts['histories']} of {total} histories")
    return 0
