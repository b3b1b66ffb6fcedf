"""rockframe respond: compute the rocking response of structures to records."""

from __future__ import annotations

import argparse
import math
import textwrap
from collections.abc import Mapping
from typing import Any, Final

from rockframe.cli.arguments import (
    add_batch,
    add_structures,
    chosen_batch,
    chosen_engine,
    chosen_structures,
)
from rockframe.cli.options import add_options, chosen, file_to_write, path
from rockframe.options.execution import ExecutionOptions
from rockframe.options.respond import RespondOptions

#: Peak quantities with their conversion factors and decimals.
_OF_MOTION: Final = (
    ("peak_rotation_ratio", 1.0, 3),
    ("u_max_m", 100.0, 1),
    ("v_max_m", 100.0, 2),
)


def add_respond(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the file to write."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    add_structures(parser, one=False)
    add_options(parser, RespondOptions)
    parser.add_argument(
        "--pulses",
        type=path,
        metavar="FILE",
        help="output of `rockframe pulse` for these records: adds the response to the pulse alone",
    )
    add_batch(parser)
    add_options(parser, ExecutionOptions)


def run_respond(options: argparse.Namespace) -> int:
    """Run the stage and print the verdicts."""
    from rockframe.cli.console import progress_bar, show_json, show_rejections, show_table
    from rockframe.results.tables.table import response_rows
    from rockframe.stages.respond import respond_stage

    with progress_bar("rocking") as progress:
        rejections = respond_stage(
            options.records,
            options.output,
            chosen(options, RespondOptions),
            structures_path=chosen_structures(options),
            pulses_path=options.pulses,
            batch=chosen_batch(options),
            engine=chosen_engine(options),
            progress=progress,
        )
    rows = response_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        show_json({"responses": list(rows), "rejected": rejected, "output": str(options.output)})
    else:
        show_table(
            f"Responses in {options.output}",
            [
                *("record", "structure", "θ/α>", "u_max [cm]>", "v_max [cm]>"),
                *("critical scale>", "10 25 50 % overturn>", "verdict"),
                *(["pulse alone"] if options.pulses else []),
            ],
            (
                [
                    *(str(row["record_id"]), str(row["structure"]), *response_cells(row)),
                    *([pulse_cell(row)] if options.pulses else []),
                ]
                for row in rows
            ),
        )
        if chosen(options, RespondOptions).margins != "none":
            print(margin_notes())
    show_rejections(rejections)
    return 1 if rejections else 0


def pulse_cell(row: Mapping[str, Any]) -> str:
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


def response_cells(row: Mapping[str, Any]) -> list[str]:
    """Return theta/alpha, u, v, critical scale, robust margin and verdict as text.

    The first three are dashes for structures that overturn.
    """
    from rockframe.cli.console import number
    from rockframe.results.tables.table import stated_verdict

    stated = stated_verdict(row)
    return [
        *(
            "–" if stated.overturns else number(factor * row[name], decimals)
            for name, factor, decimals in _OF_MOTION
        ),
        critical_scale(row),
        robust_scales(row),
        stated.words,
    ]


def critical_scale(row: Mapping[str, Any]) -> str:
    """Return the critical scale as text, or its lower bound if none was found.

    Examples
    --------
    >>> critical_scale({"critical_scale": math.nan, "largest_scale": 10.0})
    '> 10'
    """
    from rockframe.cli.console import number

    if math.isnan(row["critical_scale"]) and math.isfinite(row["largest_scale"]):
        return f"> {row['largest_scale']:.3g}"
    return number(row["critical_scale"], 2)


def robust_scales(row: Mapping[str, Any]) -> str:
    """Return the scales at which 10, 25 and 50 % of the ensemble overturn, to two decimals.

    Examples
    --------
    >>> robust_scales({f"robust_scale_{share}": 0.1043 * share for share in (10, 25)}
    ...     | {"robust_scale_50": math.nan})
    '1.04 2.61 –'
    """
    from rockframe.cli.console import number

    scales = [row[f"robust_scale_{share}"] for share in (10, 25, 50)]
    return "–" if all(map(math.isnan, scales)) else " ".join(number(one, 2) for one in scales)


def margin_notes() -> str:
    """Return what the columns of margins and verdicts mean, in lines of the table's width."""
    from rockframe.cli.console import table_width
    from rockframe.rocking import MARGIN_LEGEND, VERDICT_RULE

    width = max(40, min(table_width(), 120))
    held = (each.replace(" %", "\u00a0%") for each in (MARGIN_LEGEND, VERDICT_RULE))
    return "\n".join(textwrap.fill(each, width) for each in held).replace("\u00a0", " ")
