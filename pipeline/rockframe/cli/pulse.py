"""rockframe pulse: find the acceleration pulse (a_p, T_p) of each record."""

from __future__ import annotations

import argparse

from rockframe.cli.arguments import add_batch, add_periods, path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records in, pulses out."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    parser.add_argument("--output", type=path, required=True, help="netCDF file to write")
    add_periods(parser)
    add_batch(parser)


def run(options: argparse.Namespace) -> int:
    """Run the stage and print the pulses."""
    from rockframe.cli.arguments import chosen_batch
    from rockframe.cli.console import number, progress_bar, show_json, show_rejections, show_table
    from rockframe.results import pulse_rows
    from rockframe.stages import pulse_stage

    with progress_bar("matching pulses") as progress:
        rejections = pulse_stage(
            options.records,
            options.output,
            shortest_period=options.periods[0],
            longest_period=options.periods[1],
            batch=chosen_batch(options),
            progress=progress,
        )
    rows = pulse_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        show_json({"pulses": rows, "rejected": rejected, "output": str(options.output)})
        show_rejections(rejections)
        return 1 if rejections else 0
    cells: list[list[str]] = []
    for row in rows:
        first = not cells or row["record_id"] != rows[len(cells) - 1]["record_id"]
        cells.append(
            [
                str(row["record_id"]) if first else "",
                f"{row['wavelet']}{' (best)' if row['best'] else ''}",
                number(row["a_p_g"], 3),
                number(row["T_p_s"], 3) + (" at bound" if row["at_period_bound"] else ""),
                number(row["pulse_time_s"], 2),
                number(row["L_p_m"], 2),
                number(row["match_index"], 3),
            ]
        )
    show_table(
        f"Pulses in {options.output}",
        ["record", "wavelet", "a_p [g]>", "T_p [s]>", "at [s]>", "L_p [m]>", "match>"],
        cells,
    )
    show_rejections(rejections)
    return 1 if rejections else 0
