"""rockframe merge: put the files of batches of records together."""

from __future__ import annotations

import argparse

from rockframe.cli.arguments import path
from rockframe.cli.outputs import file_to_write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files of batches in, one file out."""
    parser.add_argument(
        "parts",
        nargs="+",
        type=path,
        metavar="PART",
        help="outputs of one stage with --batch 1/N, 2/N, ..., in this order",
    )
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )


def run(options: argparse.Namespace) -> int:
    """Merge, and say what was left out."""
    from rockframe.cli.console import show_json, show_rejections
    from rockframe.stages import merge_stage

    left_out = merge_stage(options.parts, options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in left_out]
        show_json({"rejected": rejected, "output": str(options.output)})
    else:
        print(f"{len(options.parts)} batches in {options.output}")
    show_rejections(left_out)
    return 1 if left_out else 0
