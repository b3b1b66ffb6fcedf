"""rockframe table1: run all stages and print the paper's Table 1 for the records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.arguments import (
    add_reading,
    add_records,
    add_structures,
    chosen_structures,
    reading_workers,
    refuse_folder_of_records,
)
from rockframe.cli.options import add_options, chosen
from rockframe.cli.outputs import finish, folder_to_write
from rockframe.options import IngestOptions, PulseOptions, RespondOptions

if TYPE_CHECKING:
    from rockframe.ingest import Rejection
    from rockframe.stages import Ingested


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the folder to write."""
    add_records(parser)
    parser.add_argument(
        "--output",
        type=folder_to_write,
        default=Path("outputs/table1"),
        help="folder to write (default: outputs/table1)",
    )
    add_structures(parser, one=False)
    add_options(parser, RespondOptions)
    add_options(parser, PulseOptions, title="pulses")
    add_reading(parser)


def run(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write all files; print the table."""
    from rockframe.cli.console import progress_bar, show_json, show_rejections
    from rockframe.cli.table1_tables import show
    from rockframe.paper import compare, statements
    from rockframe.provenance import whole_folder
    from rockframe.results import pulse_rows
    from rockframe.stages import draw_records, table_rows_of, write_table

    folder: Path = options.output
    _require_sound(options)
    with whole_folder(folder) as partial:
        ingested, rejections = _stages(options, partial)
        files = [partial / name for name in ("records.nc", "pulses.nc", "response.nc")]
        rows = list(table_rows_of(*files))
        comparisons, said = compare(rows, pulse_rows(files[1])), statements(rows)
        write_table(rows, partial / "table.csv")
        if comparisons:
            write_table(comparisons, partial / "paper.csv")
        names = list(dict.fromkeys(row.record_id for row in rows))
        with progress_bar("drawing") as progress:
            draw_records(rows, files, partial / "figures", names, progress)
        stated = {"records": IngestOptions, "pulse": PulseOptions, "respond": RespondOptions}
        count = finish(
            partial,
            ingested,
            chosen_structures(options),
            {table: chosen(options, model) for table, model in stated.items()},
        )
    if options.json:
        show_json(
            {
                "rows": [vars(row) for row in rows],
                "paper": [vars(comparison) for comparison in comparisons],
                "statements": said,
                "rejected": [vars(rejection) for rejection in rejections],
                "output": str(folder),
            }
        )
    else:
        show(rows, comparisons, said)
        print(f"{count} files in {folder}")
    show_rejections(rejections)
    return 1 if rejections else 0


def _require_sound(options: argparse.Namespace) -> None:
    """Validate all options and the structures before anything is computed."""
    from rockframe.stages import choose_structures
    from rockframe.study import read_limits

    ingest = chosen(options, IngestOptions)
    chosen(options, PulseOptions)
    if ingest.limits is not None:
        read_limits(ingest.limits)
    choose_structures(chosen_structures(options), chosen(options, RespondOptions).structure)
    refuse_folder_of_records(options)


def _stages(options: argparse.Namespace, folder: Path) -> tuple[Ingested, tuple[Rejection, ...]]:
    from rockframe.cli.console import progress_bar, progress_names
    from rockframe.engines import OneProcess
    from rockframe.stages import ingest_stage, pulse_stage, respond_stage
    from rockframe.study import bundled_records

    records = folder / "records.nc"
    with progress_names("reading") as reading:
        ingested = ingest_stage(
            options.records or [bundled_records()],
            records,
            chosen(options, IngestOptions),
            progress=reading,
            workers=reading_workers(options),
        )
    with progress_bar("matching pulses") as progress:
        without_pulse = pulse_stage(
            records,
            folder / "pulses.nc",
            chosen(options, PulseOptions),
            progress=progress,
        )
    with progress_bar("rocking") as progress:
        without_vertical = respond_stage(
            records,
            folder / "response.nc",
            chosen(options, RespondOptions),
            structures_path=chosen_structures(options),
            pulses_path=folder / "pulses.nc",
            engine=OneProcess(),  # its threads use all cores
            progress=progress,
        )
    return ingested, (*ingested.rejections, *without_pulse, *without_vertical)
