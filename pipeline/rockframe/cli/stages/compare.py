"""rockframe compare: compare a rocking bridge with its rivals under each record."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from rockframe.cli.arguments import add_structures
from rockframe.cli.options import file_to_write, path
from rockframe.study.structures import Rival


def add_compare(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures with their rivals, and the file to write."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument(
        "--against",
        nargs="+",
        choices=get_args(Rival),
        help="rivals of the free frame, as stated in the file of structures (default: all that it "
        "states)",
    )
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    parser.add_argument(
        "--figures",
        type=Path,
        metavar="FOLDER",
        help="folder for figures of the records with the largest drifts",
    )
    add_structures(parser)


def run_compare(options: argparse.Namespace) -> int:
    """Run the stage, print the table, and draw the figures."""
    from rockframe.cli.console import progress_bar, show_json, show_rejections, show_rows
    from rockframe.errors import ParameterError
    from rockframe.results.compare import COMPARISON, comparison_rows
    from rockframe.stages.compare import compare_stage
    from rockframe.stages.figures import figures_stage

    if options.structures is None:
        raise ParameterError("--structures missing. Must be a file with [compare] tables.")
    with progress_bar("comparing") as progress:
        rejections = compare_stage(
            options.records,
            options.output,
            options.structures,
            against=options.against,
            structure=options.structure,
            progress=progress,
        )
    drawn = figures_stage([options.output], options.figures) if options.figures else {}
    rows = comparison_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        show_json({"comparison": rows, "rejected": rejected, "output": str(options.output)})
    else:
        show_rows(f"Bridges in {options.output}", COMPARISON, rows)
    for file in drawn:
        print(options.figures / file)
    show_rejections(rejections)
    return 1 if rejections else 0
