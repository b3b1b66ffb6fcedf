"""Commands that show the results of stages (draw, table, report), and formats."""

from __future__ import annotations

import argparse

from rockframe.cells import TABLE_FORMATS
from rockframe.cli.arguments import add_format
from rockframe.cli.console import progress_bar, show_json, show_table
from rockframe.cli.options import add_options, chosen, file_to_write, folder_to_write, path
from rockframe.options.execution import FigureOptions, ReportOptions


def add_draw(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: files of stages, and a folder."""
    parser.add_argument(
        "files",
        type=path,
        nargs="+",
        metavar="FILE",
        help="outputs of stages: ingest, pulse and respond together give a figure of each record; "
        "screen gives fragility and peaks; spectrum gives curves",
    )
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder to write")
    add_options(parser, FigureOptions)


def run_draw(options: argparse.Namespace) -> int:
    """Draw the figures, and print the number of figures."""
    from rockframe.stages.figures import figures_stage

    wanted = chosen(options, FigureOptions)
    with progress_bar("drawing") as progress:
        drawn = figures_stage(options.files, options.output, wanted, progress=progress)
    if options.json:
        show_json({"figures": drawn, "output": str(options.output)})
    else:
        print(f"{len(drawn)} figures in {options.output}")
    return 0


def add_table(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: three files of stages, and the table to write."""
    for stage, name in (("ingest", "records"), ("pulse", "pulses"), ("respond", "response")):
        parser.add_argument(name, type=path, help=f"output of `rockframe {stage}`")
    endings = tuple(TABLE_FORMATS.values())
    parser.add_argument(
        "--output", type=file_to_write(*endings), required=True, help="file to write"
    )
    add_format(parser, default=None)


def run_table(options: argparse.Namespace) -> int:
    """Write the table and print its length."""
    from rockframe.stages.table import table_rows_of, table_stage

    files = (options.records, options.pulses, options.response)
    count = table_stage(*files, options.output, options.format or "")
    if options.json:
        rows = list(table_rows_of(*files))
        show_json({"rows": rows, "output": str(options.output)})
    else:
        print(f"{count} rows in {options.output}")
    return 0


def add_report(parser: argparse.ArgumentParser) -> None:
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


def run_report(options: argparse.Namespace) -> int:
    """Verify the run, write the page, and print what it contains."""
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


def add_formats(_parser: argparse.ArgumentParser) -> None:
    """Add no arguments."""


def run_formats(options: argparse.Namespace) -> int:
    """Print the table of formats."""
    from rockframe.ingest import FORMATS

    heads = {
        "name": "name",
        "obspy_name": "obspy",
        "extensions": "usual extensions",
        "description": "description",
    }
    rows = [{key: getattr(entry, key) for key in heads} for entry in FORMATS]
    if options.json:
        show_json(rows)
        return 0
    cells = [
        [text if isinstance(text, str) else " ".join(text) for text in row.values()] for row in rows
    ]
    show_table("Formats of strong-motion records", list(heads.values()), cells)
    return 0
