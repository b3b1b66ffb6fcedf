"""rockframe figure: draw one figure with its caption."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import file_to_write

if TYPE_CHECKING:
    from rockframe.figures.captioned import Captioned


def add_figure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the figure, its data, and the file to write."""
    numbers = "; ".join(f"{name}: {entry.summary}" for name, entry in FIGURES.items())
    parser.add_argument("figure", choices=FIGURES, metavar="FIGURE", help=numbers)
    parser.add_argument(
        "--output",
        type=file_to_write(".png", ".pdf", ".svg"),
        required=True,
        help="file to write: .png, .pdf or .svg",
    )
    arguments.add_records(parser)
    parser.add_argument(
        "--record",
        action="append",
        metavar="ID",
        help="only this record; may be repeated for figure 11 (default: all records for figure 11, "
        "else the record with the largest rotation of the structure without overturning)",
    )
    parser.add_argument(
        "--vertical",
        action="store_true",
        help="include the vertical component recorded at the same station",
    )
    add_joints(parser)
    add_grid(parser)
    arguments.add_structures(parser)
    arguments.add_reading(parser)


def add_grid(parser: argparse.ArgumentParser) -> None:
    """Add the option for the resolution of maps."""
    parser.add_argument(
        "--grid",
        type=int,
        default=400,
        metavar="N",
        help="points along each side of the maps of figure 9; stability maps have a quarter "
        "of this number (default: 400)",
    )


def add_joints(parser: argparse.ArgumentParser) -> None:
    """Add the options for the figure of the joints."""
    parser.add_argument(
        "--friction",
        type=float,
        default=0.5,
        metavar="MU",
        help="assumed coefficient of friction of the joints (default: 0.5)",
    )
    parser.add_argument(
        "--spacing",
        type=float,
        metavar="METRES",
        help="distance between the axes of two columns [m]: adds the forces on each column",
    )
    parser.add_argument(
        "--beam-centre",
        type=float,
        default=0.0,
        metavar="METRES",
        help="height of the beam's centre of mass above its underside [m] (default: 0)",
    )


def run_figure(options: argparse.Namespace) -> int:
    """Draw and write the figure, and print its caption."""
    from rockframe.figures.captioned import save_captioned

    output: Path = options.output
    drawn, status = FIGURES[options.figure].draw(options)
    beside = save_captioned(drawn, output)
    if options.json:
        console.show_json(
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


@dataclass(frozen=True)
class Drawing:
    """A figure: its summary, and the module and function that draw it."""

    summary: str
    place: str

    def draw(self, options: argparse.Namespace) -> tuple[Captioned, int]:
        """Import the module, and return the figure and the exit status."""
        module, _, function = self.place.partition(".")
        found = import_module(f"rockframe.cli.figures_of_{module}")
        drawn: tuple[Captioned, int] = getattr(found, function)(options)
        return drawn


#: All figures, by name on the command line, in the order of the help.
FIGURES: Final[Mapping[str, Drawing]] = {
    "5": Drawing("size of the equivalent column", "frames.draw_5"),
    "7": Drawing("largest restitution", "frames.draw_7"),
    "8": Drawing("records and the pulses in them", "pulses.draw_8"),
    "9": Drawing("minimum overturning acceleration spectra", "frames.draw_9"),
    "11": Drawing("histories under records", "frames.draw_11"),
    "moment-rotation": Drawing(
        "restoring moment and the part reached", "frames.draw_moment_rotation"
    ),
    "phase-portrait": Drawing("rate over rotation, impacts, barrier", "frames.draw_phase_portrait"),
    "scalogram": Drawing("wavelet transform of a record", "pulses.draw_scalogram"),
    "match-index": Drawing("match index against period", "pulses.draw_match_curves"),
    "joints": Drawing("friction demand and vertical forces", "frames.draw_joints"),
    "rocking-spectrum": Drawing("peak rotation and rate over 2 pi / p", "frames.draw_rocking"),
    "stability-map": Drawing("verdict over size and scale", "frames.draw_stability"),
}
