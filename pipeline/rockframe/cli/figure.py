"""rockframe figure: draw one figure, of the paper or further, with its caption."""

from __future__ import annotations

import argparse
from pathlib import Path

from rockframe.cli.arguments import add_reading, add_records, add_structures
from rockframe.cli.figure_spectra import add_grid
from rockframe.cli.figure_table import FIGURES
from rockframe.cli.outputs import file_to_write


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which figure, of what, and where it goes."""
    numbers = "; ".join(f"{name}: {entry.summary}" for name, entry in FIGURES.items())
    parser.add_argument("figure", choices=FIGURES, metavar="FIGURE", help=numbers)
    parser.add_argument(
        "--output",
        type=file_to_write(".png", ".pdf", ".svg"),
        required=True,
        help="file to write: .png, .pdf or .svg",
    )
    add_records(parser)
    parser.add_argument(
        "--record",
        action="append",
        metavar="ID",
        help="only this record; may be repeated for figure 11 (default: all of them there, else "
        "the one under which the structure turns furthest and stands)",
    )
    parser.add_argument(
        "--vertical",
        action="store_true",
        help="include the vertical component recorded at the same station",
    )
    add_joints(parser)
    add_grid(parser)
    add_structures(parser)
    add_reading(parser)


def add_joints(parser: argparse.ArgumentParser) -> None:
    """Options of what the joints are taken to be."""
    parser.add_argument(
        "--friction",
        type=float,
        default=0.5,
        metavar="MU",
        help="coefficient of friction that the joints are assumed to have (default: 0.5)",
    )
    parser.add_argument(
        "--spacing",
        type=float,
        metavar="METRES",
        help="between the axes of two columns: adds the forces on each",
    )
    parser.add_argument(
        "--beam-centre",
        type=float,
        default=0.0,
        metavar="METRES",
        help="the beam's centre of mass above its underside (default: 0)",
    )


def run(options: argparse.Namespace) -> int:
    """Draw, write, print the caption."""
    from rockframe.cli.console import show_json
    from rockframe.figures import save_captioned

    output: Path = options.output
    drawn, status = FIGURES[options.figure].draw(options)
    beside = save_captioned(drawn, output)
    if options.json:
        show_json(
            {
                "figure": options.figure,
                "title": drawn.title,
                "caption": drawn.caption,
                "output": str(output),
                "caption_file": str(beside),
            }
        )
    else:
        print(f"{drawn.title}. {drawn.caption}")
        print(f"{output}, {beside}")
    return status
