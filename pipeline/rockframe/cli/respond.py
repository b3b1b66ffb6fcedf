"""rockframe respond: compute the rocking response of structures to records."""

from __future__ import annotations

import argparse
from pathlib import Path

from rockframe.cli.arguments import add_structures


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records and structures in, histories and verdicts out."""
    parser.add_argument("records", type=Path, help="output of `rockframe ingest`")
    parser.add_argument("--output", type=Path, required=True, help="netCDF file to write")
    add_structures(parser)


def run(options: argparse.Namespace) -> int:
    """Run the stage and print the verdicts."""
    from rockframe.cli.console import number, progress_bar, show_json, show_table
    from rockframe.results import response_rows
    from rockframe.stages import respond_stage
    from rockframe.study import SHIPPED_STRUCTURES

    with progress_bar("rocking") as progress:
        respond_stage(
            options.records,
            options.output,
            structures_path=options.structures or SHIPPED_STRUCTURES,
            structure=options.structure,
            progress=progress,
        )
    rows = response_rows(options.output)
    if options.json:
        show_json({"responses": rows, "output": str(options.output)})
        return 0
    show_table(
        f"Responses in {options.output}",
        ["record", "structure", "θ/α>", "u_max [m]>", "v_max [m]>", "impacts>", "verdict"],
        [
            [
                str(row["record_id"]),
                str(row["structure"]),
                number(row["peak_rotation_ratio"], 3),
                number(row["u_max_m"], 3),
                number(row["v_max_m"], 3),
                str(row["impacts"]),
                verdict_text(row["verdict"], row["overturning_time_s"]),
            ]
            for row in rows
        ],
    )
    return 0


def verdict_text(verdict: str, overturning_time: float) -> str:
    """Return the verdict as people read it."""
    words = verdict.replace("_", " ")
    return f"{words} {overturning_time:.1f} s" if verdict == "overturned" else words
