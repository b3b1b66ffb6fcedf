"""rockframe fetch: download and verify records of an event from an FDSN data centre."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.console import progress_names, show_json, show_rows
from rockframe.cli.options import add_options, chosen, folder_to_write
from rockframe.options.fetch import FetchOptions

if TYPE_CHECKING:
    from rockframe.fetch.coverage import Coverage


def add_fetch(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: data centre, event, stations, time span, folder."""
    parser.epilog = (
        "Exit status: 0 everything was received; 1 something is missing (it is listed); 2 nothing "
        "was received, or an error that you can correct. The same command resumes an interrupted "
        "download. From archives that need a login (PEER NGA, ESM, CESMD, K-NET), download by "
        "hand, then use rockframe ingest."
    )
    add_options(parser, FetchOptions)
    parser.add_argument(
        "--output", type=folder_to_write, required=True, metavar="FOLDER", help="folder to write"
    )


def run_fetch(options: argparse.Namespace) -> int:
    """Download, and print what was requested and received."""
    from rockframe.stages.table import fetch_stage

    request = chosen(options, FetchOptions)
    with progress_names("fetching") as progress:
        fetched = fetch_stage(request, options.output, progress=progress)
    if options.json:
        rows = [asdict(row) | {"verdict": row.verdict} for row in fetched.coverage]
        event = None if fetched.event is None else asdict(fetched.event)
        show_json({"event": event, "coverage": rows, "output": str(options.output)})
    else:
        _show(fetched.coverage, options.output)
    return 0 if fetched.complete else 1


def _show(coverage: tuple[Coverage, ...], folder: Path) -> None:
    from rockframe.results.tables.columns import Column, number

    complete = sum(row.complete for row in coverage)
    columns = [
        Column("channel", "what"),
        Column("R [km]>", "distance", ".1f", rule=lambda row, key: number(row[key])),
        Column("requested from", "requested_start", rule=lambda row, key: row[key][:19]),
        Column("to", "requested_end", rule=lambda row, key: row[key][11:19]),
        Column("received from", "received_start", rule=lambda row, key: row[key][11:22]),
        Column("to", "received_end", rule=lambda row, key: row[key][11:22]),
        Column("samples>", "samples", rule=lambda row, key: str(row[key] or "–")),
        Column("coverage", "verdict"),
    ]
    rows = [vars(row) | {"verdict": row.verdict} for row in coverage]
    show_rows(f"{complete} of {len(coverage)} complete in {folder}", columns, rows)
