"""rockframe fetch: download and verify records of an event from an FDSN data centre."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

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
    from rockframe.cli.console import progress_names, show_json
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
    from rockframe.cli.console import number, show_table

    rows = [
        [
            row.what,
            number(math.nan if row.distance is None else row.distance, 1),
            row.requested_start[:19],
            row.requested_end[11:19],
            row.received_start[11:22],
            row.received_end[11:22],
            str(row.samples or "–"),
            row.verdict,
        ]
        for row in coverage
    ]
    complete = sum(row.complete for row in coverage)
    show_table(
        f"{complete} of {len(coverage)} complete in {folder}",
        ["channel", "R [km]>", "asked from", "to", "received from", "to", "samples>", "coverage"],
        rows,
    )
