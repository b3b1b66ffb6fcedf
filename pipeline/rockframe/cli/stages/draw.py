"""rockframe draw: draw the results of stages: records with their responses, and curves."""

from __future__ import annotations

import argparse

from rockframe.cli.options import add_options, chosen, folder_to_write, path
from rockframe.options.showing import FigureOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: files of stages, and a folder."""
    parser.add_argument(
        "files",
        type=path,
        nargs="+",
        metavar="FILE",
        help="outputs of stages: those of ingest, pulse and respond together draw a figure of "
        "each record; that of screen draws fragility and peaks; that of spectrum its curves",
    )
    parser.add_argument("--output", type=folder_to_write, required=True, help="folder to write")
    add_options(parser, FigureOptions)


def run(options: argparse.Namespace) -> int:
    """Draw the figures, and print their number."""
    from rockframe.cli.console import progress_bar, show_json
    from rockframe.stages.figures import figures_stage

    wanted = chosen(options, FigureOptions)
    with progress_bar("drawing") as progress:
        drawn = figures_stage(options.files, options.output, wanted, progress=progress)
    if options.json:
        show_json({"figures": drawn, "output": str(options.output)})
    else:
        print(f"{len(drawn)} figures in {options.output}")
    return 0
