"""rockframe figure and paper: draw a figure; check the paper's numbers, claims and figures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, file_to_write, folder_to_write
from rockframe.errors import require_known
from rockframe.options.ingest import IngestOptions
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions
from rockframe.provenance import refuse_obstacles

if TYPE_CHECKING:
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import Captioned
    from rockframe.paper.claim import Claim
    from rockframe.results.tables.rows import Row
    from rockframe.stages.acceptance import Ingested


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
        metavar="MU",
        help="assumed coefficient of friction of the joints (default: friction_coefficient of the "
        "structure, or 0.5 if it states none)",
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
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import caption_path, save_captioned

    output: Path = options.output
    refuse_obstacles([output, caption_path(output)])
    request = FigureRequest(
        records=partial(arguments.stated_records, options),
        record=tuple(options.record or ()),
        structures=arguments.chosen_structures(options),
        **{name: getattr(options, name) for name in ("structure", "vertical", "grid", *_OF_JOINTS)},
    )
    drawn, status = FIGURES[options.figure].draw(request)
    caption_file = save_captioned(drawn, output)
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

    def draw(self, request: FigureRequest) -> tuple[Captioned, int]:
        """Return the figure and the exit status."""
        from rockframe.cli import shown

        module, _, function = self.place.partition(".")
        draw = getattr(import_module(f"rockframe.figures.{module}"), function)
        values, status = getattr(shown, self.shows)(request)
        return draw(*values, **{name: getattr(request, name) for name in self.options}), status


_OF_JOINTS: Final = ("friction", "spacing", "beam_centre")
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
    "stability-map": Drawing(
        "verdict over size and scale", "margins.draw_stability_map", "one_record", ("grid",)
    ),
}


_PAGE: Final = "paper-checked.md"


def add_paper(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the paper's records, if available, and the folder to write."""
    parser.add_argument(
        "--output",
        type=folder_to_write,
        default=Path("outputs/paper"),
        help="folder to write (default: outputs/paper)",
    )
    parser.add_argument("--claim", metavar="NAME", help="print only this claim, and write nothing")
    arguments.add_records(parser, ready=False)
    add_options(parser, PulseOptions, title="pulses")
    arguments.add_reading(parser)
    add_grid(parser)


def run_paper(options: argparse.Namespace) -> int:
    """Check the claims, draw the figures, write the page and its manifest."""
    from rockframe.cli.table1 import STAGE_FILES, finish
    from rockframe.paper.claims import all_claims
    from rockframe.paper.pulses import record_claims
    from rockframe.provenance import whole_folder
    from rockframe.study.structures import SHIPPED_STRUCTURES

    if options.claim is not None:
        claims = all_claims()
        require_known("claim", options.claim, [claim.name for claim in claims])
        _show_claims([claim for claim in claims if claim.name == options.claim], options.json)
        return 0
    folder: Path = options.output
    arguments.refuse_folder_of_records(options)
    with whole_folder(folder, (*STAGE_FILES, "records.csv", _PAGE)) as partial:
        ingested, rows, pulses = _respond_for_paper(options, partial)
        claims = all_claims() + record_claims(rows, pulses)
        _write_page(claims, _draw_all(partial, options.grid), rows, partial)
        stated = {"records": IngestOptions, "pulse": PulseOptions}
        finish(options, partial, ingested, SHIPPED_STRUCTURES, stated)
    if options.json:
        console.show_json({"claims": [_plain(claim) for claim in claims], "output": str(folder)})
    else:
        _show_claims(claims, False)
        print(f"{folder / _PAGE}")
    return console.show_rejections(ingested.rejections)


def _respond_for_paper(
    options: argparse.Namespace, folder: Path
) -> tuple[Ingested, list[Row], list[Row]]:
    """Run the stages for the paper's bridge; return the rows of the table, and of pulses."""
    from rockframe.cli.table1 import run_stages
    from rockframe.results.pulses import pulse_rows
    from rockframe.stages.table import table_rows_of

    respond = RespondOptions(structure="bridge-bent")
    ingested, _, made = run_stages(options, folder, respond)
    return ingested, list(table_rows_of(*made)), pulse_rows(made[1])


def _draw_all(folder: Path, grid: int) -> dict[str, str]:
    """Draw all figures of `rockframe figure`; return the title and caption of each by its path."""
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import save_captioned

    records = folder / "records.nc"
    # the dimensions of the bridge bent are assumed: the paper states neither
    request = FigureRequest(
        records=lambda: nullcontext((records, 0)), grid=grid, spacing=12.0, beam_centre=1.0
    )
    captions = {}
    for name, entry in FIGURES.items():
        path = folder / "figures" / f"figure-{name}.png"
        drawn, _ = entry.draw(request)
        save_captioned(drawn, path)
        captions[path.relative_to(folder).as_posix()] = f"{drawn.title}. {drawn.caption}"
    return captions


def _write_page(
    claims: Sequence[Claim], figures: dict[str, str], rows: Sequence[Row], folder: Path
) -> None:
    from rockframe.paper.claims import checked_page
    from rockframe.paper.pulses import find_paper_record, paper_records
    from rockframe.provenance import whole_file

    own = {row["record_id"] for row in rows if find_paper_record(row["source_file"])}
    records = f"{len(own)} of the paper's {len(paper_records())} records were found by name"
    if not own:
        records += ": claims about its records are not checked, and figures show other records"
    with whole_file(folder / _PAGE) as partial:
        partial.write_text(checked_page(claims, figures, f"{records}."), encoding="utf-8")


def _show_claims(claims: Sequence[Claim], json: bool) -> None:
    if json:
        console.show_json({"claims": [_plain(claim) for claim in claims]})
        return
    columns = ("claim", "paper", "ours", "finding")
    cells = ([one.name, one.printed, one.ours, one.finding.value] for one in claims)
    console.show_table("The paper, checked", columns, cells)
    if len(claims) == 1:
        (claim,) = claims
        print(f"{claim.where}: {claim.says}. {claim.remark}".rstrip())


def _plain(claim: Claim) -> dict[str, Any]:
    return {**vars(claim), "finding": claim.finding.value, "command": claim.shown_by}
