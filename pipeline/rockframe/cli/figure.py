"""rockframe figure: draw a figure by its name, or the figures of outputs of stages."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import (
    add_options,
    chosen,
    file_to_write,
    flag,
    folder_to_write,
    path,
)
from rockframe.errors import InputError, ParameterError, meant
from rockframe.options.model import FigureOptions
from rockframe.provenance import refuse_obstacles
from rockframe.stages.named_figures import FIGURES, OF_REQUEST

if TYPE_CHECKING:
    from rockframe.figures.captioned import Captioned


def add_figure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the figure or files of stages, its data, and what to write."""
    names = "; ".join(f"{name}: {entry.summary}" for name, entry in FIGURES.items())
    figure: Any = parser.add_argument(
        "figure",
        nargs="+",
        metavar="FIGURE",
        help="outputs of stages, for a folder of figures (ingest, pulse and respond together: a "
        "figure of each record; screen: fragility and peaks; spectrum and compare: curves); or the "
        f"name of one figure. {names}",
    )
    figure.completer = _completed
    parser.add_argument(
        "--output",
        "-o",
        type=_named,
        required=True,
        help="folder to write for outputs of stages, else the file: .png, .pdf or .svg; of "
        "animation also .gif, .apng, or .mp4, which needs ffmpeg",
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
    add_options(parser, FigureOptions)


def _completed(prefix: str, **_parsed: object) -> list[str]:
    """Return the names of figures and the files with which a word can go on at the Tab key."""
    from argcomplete.completers import FilesCompleter

    files = FilesCompleter(["nc"])(prefix)
    return [*(name for name in FIGURES if name.startswith(prefix)), *files]


def _named(text: str) -> Path:
    """Return the file of a figure, or the folder, in a command-line argument."""
    named = path(text)
    return named if named.suffix.lower() in _ENDINGS else folder_to_write(text)


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
    """Draw the figures of files, or one figure by its name."""
    first, *others = options.figure
    if not others and first in FIGURES:
        return _draw_named(options, first)
    for word in options.figure:
        if Path(word).suffix != ".nc" and not Path(word).is_file():
            said = "is the name of one figure" if word in FIGURES else "is no figure"
            near = meant(word, FIGURES) or f" Names are: {', '.join(FIGURES)}."
            advice = "" if word in FIGURES else near
            raise ParameterError(f"{word!r} {said}, and no output of a stage (.nc).{advice}")
    _draw_results(options)
    return 0


def _draw_results(options: argparse.Namespace) -> None:
    """Draw the figures of outputs of stages, and print their number."""
    from rockframe.stages.figures import figures_stage

    for name in _given(options):
        if name != "most":
            raise ParameterError(
                f"{flag(name)} has no effect on outputs of stages. Leave it out, or name a figure."
            )
    output = _checked(options.output, folder_to_write)
    files, wanted = list(map(Path, options.figure)), chosen(options, FigureOptions)
    with console.progress_bar("drawing") as progress:
        drawn = figures_stage(files, output, wanted, progress=progress)
    if options.json:
        console.show_json({"figures": drawn, "output": str(output)})
    else:
        print(f"{len(drawn)} figures in {output}")


def _checked(output: Path, check: Callable[[str], Path]) -> Path:
    """Return the path of ``--output`` after a check."""
    try:
        return check(str(output))
    except argparse.ArgumentTypeError as error:
        raise ParameterError(f"--output {error}.") from None


def _draw_named(options: argparse.Namespace, name: str) -> int:
    """Draw and write a figure, and print its caption. Return 1 if records were rejected."""
    from rockframe.figures.captioned import caption_path
    from rockframe.stages.named_figures.shown import FigureRequest

    _refuse_idle(options, name)
    output = _checked(options.output, file_to_write(*_ENDINGS))
    _refuse_still(output, name)
    refuse_obstacles([output, caption_path(output)])
    request = FigureRequest(
        records=partial(arguments.records_file, options.records),
        report=console.show_rejections,
        structures=arguments.chosen_structures(options),
        **_stated(options),
    )
    drawn, status = FIGURES[name].draw(request)
    caption_file = _saved(drawn, output)
    if options.json:
        console.show_json(
            {
                "figure": name,
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


#: Formats of figures that move, and of all figures.
_MOVING: Final = (".gif", ".apng", ".mp4")
_ENDINGS: Final = (".png", ".pdf", ".svg", *_MOVING)


def _saved(drawn: Captioned, output: Path) -> Path:
    """Write a figure in the format of its name; return the file of its caption."""
    from rockframe.figures.captioned import save_captioned

    if output.suffix.lower() not in _MOVING:
        return save_captioned(drawn, output)
    from rockframe.figures.moving import Moving, save_moving

    assert isinstance(drawn, Moving)  # noqa: S101 -- `_refuse_still` refuses the other figures
    return save_moving(drawn, output)


def _refuse_still(output: Path, name: str) -> None:
    """Raise an error if a moving picture is asked for of a figure that does not move."""
    if output.suffix.lower() in _MOVING and name != "animation":
        raise InputError(output, f"figure {name} does not move. Must end in .png, .pdf or .svg.")


def _stated(options: argparse.Namespace) -> dict[str, Any]:
    """Return the stated fields of the request."""
    values = {name: getattr(options, name, None) for name in OF_REQUEST}
    values["record"] = tuple(options.record or ())
    return {name: value for name, value in values.items() if value is not None}


def _given(options: argparse.Namespace) -> list[str]:
    """Return the stated options, besides those of all figures."""
    given = {name for name, value in vars(options).items() if value is not None}
    return sorted(given - {"run", "figure", "output", "json"})


def _refuse_idle(options: argparse.Namespace, figure: str) -> None:
    """Raise an error if an option is stated that the figure does not take."""
    for name in _given(options):
        if not FIGURES[figure].takes(name):
            taking = ", ".join(other for other, entry in FIGURES.items() if entry.takes(name))
            instead = f"one of: {taking}" if taking else "outputs of stages"
            raise ParameterError(
                f"{flag(name)} has no effect on figure {figure}. Leave it out, or draw {instead}."
            )
