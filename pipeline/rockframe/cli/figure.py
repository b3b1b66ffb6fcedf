"""rockframe figure: draw a figure with its caption."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import file_to_write, flag
from rockframe.errors import InputError, ParameterError
from rockframe.provenance import refuse_obstacles

if TYPE_CHECKING:
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import Captioned


def add_figure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the figure, its data, and the file to write."""
    numbers = "; ".join(f"{name}: {entry.summary}" for name, entry in FIGURES.items())
    parser.add_argument("figure", choices=FIGURES, metavar="FIGURE", help=numbers)
    parser.add_argument(
        "--output",
        "-o",
        type=file_to_write(".png", ".pdf", ".svg", *_MOVING),
        required=True,
        help="file to write: .png, .pdf or .svg; of animation also .gif, .apng, or .mp4, which "
        "needs ffmpeg",
    )
    arguments.add_records(parser)
    parser.add_argument(
        "--record",
        action="append",
        metavar="ID",
        help="only this record; may be repeated for figures 8, 11 and drift-by-size (default: all "
        "records for 11 and drift-by-size, those of the paper or with the best matches for figures "
        "of pulses, else the record with the largest rotation of the structure without "
        "overturning)",
    )
    parser.add_argument(
        "--vertical",
        action="store_true",
        default=argparse.SUPPRESS,
        help="include the vertical component recorded at the same station, except in figures of "
        "pulses",
    )
    add_joints(parser)
    add_grid(parser)
    arguments.add_structures(parser)


def add_grid(parser: argparse.ArgumentParser) -> None:
    """Add the option for the resolution of maps."""
    parser.add_argument(
        "--grid",
        type=int,
        default=argparse.SUPPRESS,
        metavar="N",
        help="points along each side of the maps of figure 9; stability maps have a quarter "
        "of this number (default: 400)",
    )


def add_joints(parser: argparse.ArgumentParser) -> None:
    """Add the options for the figure of the joints."""
    parser.add_argument(
        "--friction",
        type=float,
        default=argparse.SUPPRESS,
        metavar="MU",
        help="assumed coefficient of friction of the joints, in their figure (default: "
        "friction_coefficient of the structure, or 0.5 if it states none)",
    )
    parser.add_argument(
        "--spacing",
        type=float,
        default=argparse.SUPPRESS,
        metavar="METRES",
        help="distance between the axes of two columns [m]: adds the forces on each column of the "
        "figure of the joints",
    )
    parser.add_argument(
        "--beam-centre",
        type=float,
        default=argparse.SUPPRESS,
        metavar="METRES",
        help="height of the beam's centre of mass above its underside [m], with --spacing "
        "(default: 0)",
    )


def run_figure(options: argparse.Namespace) -> int:
    """Draw and write the figure, and print its caption."""
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import caption_path

    _refuse_idle(options)
    _refuse_still(options)
    output: Path = options.output
    refuse_obstacles([output, caption_path(output)])
    request = FigureRequest(
        records=partial(arguments.records_file, options.records),
        structures=arguments.chosen_structures(options),
        **_stated(options),
    )
    drawn, status = FIGURES[options.figure].draw(request)
    caption_file = _saved(drawn, output)
    if options.json:
        console.show_json(
            {
                "figure": options.figure,
                "title": drawn.title,
                "caption": drawn.caption,
                "output": str(output),
                "caption_file": str(caption_file),
            }
        )
    else:
        print(f"{drawn.title}. {drawn.caption}")
        print(f"{output}, {caption_file}")
    return status


#: Formats of figures that move.
_MOVING: Final = (".gif", ".apng", ".mp4")


def _saved(drawn: Captioned, output: Path) -> Path:
    """Write a figure in the format of its name; return the file of its caption."""
    from rockframe.figures.captioned import save_captioned

    if output.suffix.lower() not in _MOVING:
        return save_captioned(drawn, output)
    from rockframe.figures.moving import Moving, save_moving

    assert isinstance(drawn, Moving)  # noqa: S101 -- `_refuse_still` refuses the other figures
    return save_moving(drawn, output)


def _refuse_still(options: argparse.Namespace) -> None:
    """Raise an error if a moving picture is asked for of a figure that does not move."""
    if options.output.suffix.lower() in _MOVING and options.figure != "animation":
        raise InputError(
            options.output,
            f"figure {options.figure} does not move. Must end in .png, .pdf or .svg.",
        )


def _stated(options: argparse.Namespace) -> dict[str, Any]:
    """Return the stated fields of the request."""
    values = {name: getattr(options, name, None) for name in _OF_REQUEST}
    values["record"] = tuple(options.record or ())
    return {name: value for name, value in values.items() if value is not None}


def _refuse_idle(options: argparse.Namespace) -> None:
    """Raise an error if an option is stated that the figure does not take."""
    given = {name for name, value in vars(options).items() if value is not None}
    for name in sorted(given - {"run", "figure", "output", "json"}):
        if not FIGURES[options.figure].takes(name):
            taking = ", ".join(other for other, entry in FIGURES.items() if entry.takes(name))
            raise ParameterError(
                f"{flag(name)} has no effect on figure {options.figure}. Leave it out, or draw "
                f"one of: {taking}."
            )


@dataclass(frozen=True)
class Drawing:
    """A figure: its summary, the function that draws it, and what this function takes.

    Parameters
    ----------
    summary : str
        The figure in a few words, for the help.
    place : str
        Module in `rockframe.figures`, and function.
    shows : str
        Function of `rockframe.cli.shown` that returns its positional arguments.
    options : tuple of str
        Fields of `FigureRequest` that it takes as keywords.
    """

    summary: str
    place: str
    shows: str = "nothing"
    options: tuple[str, ...] = ()

    def takes(self, option: str) -> bool:
        """Return True if an option of the command changes the figure."""
        if option in _OF_REQUEST:
            return option in (*self.options, *_TAKEN[self.shows])
        if option == "structures":
            return "structure" in _TAKEN[self.shows]
        return self.shows != "nothing"  # records

    def draw(self, request: FigureRequest) -> tuple[Captioned, int]:
        """Return the figure and the exit status."""
        from rockframe.cli import shown

        module, _, function = self.place.partition(".")
        draw = getattr(import_module(f"rockframe.figures.{module}"), function)
        values, status = getattr(shown, self.shows)(request)
        return draw(*values, **{name: getattr(request, name) for name in self.options}), status


_OF_JOINTS: Final = ("friction", "spacing", "beam_centre")
#: Options of the command that are fields of `FigureRequest`.
_OF_REQUEST: Final = ("record", "structure", "vertical", "grid", *_OF_JOINTS)
_SHAKEN: Final = ("record", "structure", "vertical")
#: The fields that the functions of `rockframe.cli.shown` read.
_TAKEN: Final[Mapping[str, tuple[str, ...]]] = {
    "nothing": (),
    **dict.fromkeys(("one_record", "one_or_both", "records", "responses"), _SHAKEN),
    "unequal": ("record", "structure", "spacing"),
    **dict.fromkeys(("best_matched", "pulses", "one_recorded"), ("record",)),
}
#: All figures, by name on the command line, in the order of the help.
FIGURES: Final[Mapping[str, Drawing]] = {
    "5": Drawing("size of the equivalent column", "parameters.draw_equivalent_size"),
    "7": Drawing("largest restitution", "parameters.draw_restitution"),
    "8": Drawing("records and the pulses in them", "pulses.draw_record_and_pulse", "pulses"),
    "9": Drawing(
        "minimum overturning acceleration spectra", "spectra.draw_figure_9", options=("grid",)
    ),
    "11": Drawing(
        "histories under records", "histories.draw_response_grid", "responses", ("vertical",)
    ),
    "animation": Drawing(
        "the structure as it rocks or wobbles", "rolling.draw_either", "one_or_both"
    ),
    "record": Drawing(
        "a record: motion, build-up, response spectrum", "recorded.draw_record", "one_recorded"
    ),
    "moment-rotation": Drawing(
        "restoring moment and the part reached", "joints.draw_moment_rotation", "one_record"
    ),
    "phase-portrait": Drawing(
        "rate over rotation, impacts, barrier", "joints.draw_phase_portrait", "one_record"
    ),
    "scalogram": Drawing("wavelet transform of a record", "pulses.draw_scalogram", "best_matched"),
    "match-index": Drawing(
        "match index against period", "pulses.draw_match_curves", "best_matched"
    ),
    "joints": Drawing(
        "friction demand and vertical forces", "joints.draw_joints", "one_record", _OF_JOINTS
    ),
    "rocking-spectrum": Drawing(
        "peak rotation and rate over 2 pi / p", "spectra.draw_record_spectrum", "one_record"
    ),
    "drift-by-size": Drawing(
        "median drift over the height of columns", "spectra.draw_drift_by_size", "records"
    ),
    "unequal-columns": Drawing(
        "peak and share over the ratio of two heights",
        "parameters.draw_unequal_columns",
        "unequal",
    ),
    "stability-map": Drawing(
        "verdict over size and scale", "margins.draw_stability_map", "one_record", ("grid",)
    ),
}
