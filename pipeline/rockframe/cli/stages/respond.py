"""rockframe respond and compare: the response of structures, and of other systems, to records."""

from __future__ import annotations

import argparse
import math
import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, get_args

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, folder_to_write, path
from rockframe.errors import ParameterError
from rockframe.options.execution import ExecutionOptions
from rockframe.options.respond import RespondOptions

if TYPE_CHECKING:
    from rockframe.results.tables.columns import Column
#: Headings of the table of responses, by column of the overview.
_HEADS: Final = {
    "peak_rotation_ratio": "θ/α>",
    "u_max_m": "u_max [cm]>",
    "v_max_m": "v_max [cm]>",
    "critical_scale": "critical scale>",
    "robust_scales": "10 25 50 % overturn>",
    "verdict": "verdict",
}


def add_respond(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the file to write."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    arguments.add_output(parser)
    arguments.add_structures(parser, one=False)
    add_options(parser, RespondOptions)
    parser.add_argument(
        "--pulses",
        type=path,
        metavar="FILE",
        help="output of `rockframe pulse` for these records: adds the response to the pulse alone",
    )
    arguments.add_batch(parser)
    add_options(parser, ExecutionOptions)


def run_respond(options: argparse.Namespace) -> int:
    """Run the stage and print the verdicts."""
    from rockframe.results.tables.table import response_rows
    from rockframe.stages.respond import respond_stage

    with console.progress_bar("rocking") as progress:
        rejections = respond_stage(
            options.records,
            options.output,
            chosen(options, RespondOptions),
            structures_path=arguments.chosen_structures(options),
            pulses_path=options.pulses,
            batch=arguments.chosen_batch(options),
            engine=arguments.chosen_engine(options),
            progress=progress,
        )
    rows = response_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        console.show_json(
            {"responses": list(rows), "rejected": rejected, "output": str(options.output)}
        )
    else:
        columns = response_columns({"record_id": "record"})
        if options.pulses:
            columns.append(console.column("pulse alone", rule=pulse_cell))
        console.show_rows(f"Responses in {options.output}", columns, rows)
        if chosen(options, RespondOptions).margins != "none":
            print(margin_notes())
    return console.show_rejections(rejections)


def response_columns(first: Mapping[str, str]) -> list[Column]:
    """Return the columns of responses, after the columns in `first`."""
    from rockframe.results.tables.columns import titled

    return titled({**first, "structure": "structure", **_HEADS})


def pulse_cell(row: Mapping[str, Any], _key: str = "") -> str:
    """Return the response to the pulse alone: theta/alpha and its error, or the verdict.

    Examples
    --------
    >>> pulse_cell({"verdict_to_pulse": "safe", "peak_rotation_ratio_to_pulse": 0.3,
    ...     "surrogate_error": -0.25})
    'θ/α 0.300, -25 %'
    """
    words = str(row["verdict_to_pulse"]).replace("_", " ")
    if words != "safe":
        return words
    told = f"θ/α {row['peak_rotation_ratio_to_pulse']:.3f}"
    error = row["surrogate_error"]
    return told if math.isnan(error) else f"{told}, {100.0 * error:+.0f} %"


def margin_notes() -> str:
    """Return the explanation of margins and verdicts, wrapped to the width of the table."""
    from rockframe.rocking import MARGIN_LEGEND, VERDICT_RULE

    width = max(40, min(console.table_width(), 120))
    held = (each.replace(" %", "\u00a0%") for each in (MARGIN_LEGEND, VERDICT_RULE))
    return "\n".join(textwrap.fill(each, width) for each in held).replace("\u00a0", " ")


def add_compare(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures with their rivals, and the file to write."""
    from rockframe.study.structures import Rival

    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument(
        "--against",
        nargs="+",
        choices=get_args(Rival),
        help="rivals of the free frame, as stated in the file of structures (default: all that it "
        "states)",
    )
    arguments.add_output(parser)
    parser.add_argument(
        "--figures",
        type=folder_to_write,
        metavar="FOLDER",
        help="folder for figures of the records with the largest drifts",
    )
    arguments.add_structures(parser)


def run_compare(options: argparse.Namespace) -> int:
    """Run the stage, print the table, and draw the figures."""
    from rockframe.results.compare import COMPARISON, comparison_rows
    from rockframe.stages.compare import compare_stage
    from rockframe.stages.figures import figures_stage

    if options.structures is None:
        raise ParameterError("--structures missing. Must be a file with [compare] tables.")
    with console.progress_bar("comparing") as progress:
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
        console.show_json({"comparison": rows, "rejected": rejected, "output": str(options.output)})
    else:
        console.show_rows(f"Bridges in {options.output}", COMPARISON, rows)
    for file in drawn:
        print(options.figures / file)
    return console.show_rejections(rejections)
