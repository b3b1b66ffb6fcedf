"""rockframe compare: a bridge that rocks beside its rivals, under each record."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from rockframe.cli.arguments import add_structures
from rockframe.cli.options import file_to_write, path

_RIVALS: Final = ("restrained", "hybrid", "isolated", "fixed")
_WORDS: Final = {
    "holds": "holds",
    "overturns": "overturns",
    "tendon_yields": "tendon yields",
    "gap_closes": "gap closes",
    "lift_exceeded": "lift exceeded",
}


def add_compare(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures with their rivals, and the file to write."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument(
        "--against",
        nargs="+",
        choices=_RIVALS,
        default=list(_RIVALS),
        help="rivals of the free frame (default: all); the tables [compare.isolated] and so on of "
        "the file of structures state them",
    )
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    parser.add_argument(
        "--figures", type=Path, metavar="FOLDER", help="draw a figure for each record there"
    )
    add_structures(parser)


def run_compare(options: argparse.Namespace) -> int:
    """Run the stage, print the table, and draw the figures."""
    from rockframe.cli.console import progress_bar, show_json, show_rejections, show_rows
    from rockframe.errors import ParameterError
    from rockframe.results.compare import comparison_rows
    from rockframe.results.tables.columns import Column
    from rockframe.stages.compare import compare_stage, draw_comparisons

    if options.structures is None:
        raise ParameterError("--structures missing. Must be a file with [compare] tables.")
    with progress_bar("comparing") as progress:
        rejections = compare_stage(
            options.records,
            options.output,
            options.structures,
            against=options.against,
            structure=options.structure,
            progress=progress,
        )
    drawn = draw_comparisons(options.output, options.figures) if options.figures else []
    rows = comparison_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        show_json({"comparison": rows, "rejected": rejected, "output": str(options.output)})
    else:
        columns = [
            Column("record", "record_id", once=True),
            Column("structure", "structure"),
            Column("bridge", "model"),
            Column("u_max [cm]>", "u_max_m", ".1f", 100.0),
            Column("v_max [cm]>", "v_max_m", ".2f", 100.0),
            Column("left [cm]>", "residual_u_m", ".1f", 100.0),
            Column("base shear/W>", "base_shear", ".3f"),
            Column("tendon [MN]>", "tendon_n", ".2f", 1e-6),
            Column("friction>", "friction_demand", ".2f"),
            Column("model", "validity", rule=lambda row, _: _until(row)),
        ]
        show_rows(f"Bridges in {options.output}", columns, rows)
    for file in drawn:
        print(file)
    show_rejections(rejections)
    return 1 if rejections else 0


def _until(row: Mapping[str, Any]) -> str:
    """What ends the validity of a model, and when."""
    when = float(str(row["valid_until_s"]))
    words = _WORDS[str(row["validity"])]
    return f"{words} {when:.2f} s" if when == when else words
