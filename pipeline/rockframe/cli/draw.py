"""rockframe draw: draw what the stages found: each record with its responses, and all curves."""

from __future__ import annotations

import argparse

from rockframe.cli.options import add_options, chosen, path
from rockframe.cli.outputs import folder_to_write
from rockframe.options import FigureOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files of stages in, a folder of figures out."""
    parser.add_argument(
        "files",
        type=path,
        nargs="+",
        metavar="FILE",
        help="outputs of stages: of ingest, pulse and respond, all three, for a figure of each "
        "record; of screen for fragility and peaks; of spectrum for its curves",
    )
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder to write")
    add_options(parser, FigureOptions)


def run(options: argparse.Namespace) -> int:
    """Draw, and print how many figures there are."""
    from rockframe.cli.console import progress_bar, show_json
    from rockframe.stages import figures_stage

    wanted = chosen(options, FigureOptions)
    with progress_bar("drawing") as progress:
        drawn = figures_stage(options.files, options.output, wanted, progress=progress)
    if options.json:
        show_json({"figures": drawn, "output": str(options.output)})
    else:
        print(f"{len(drawn)} figures in {options.output}")
    return 0
