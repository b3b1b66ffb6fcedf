"""rockframe screen: screen structures by many records at many scales."""

from __future__ import annotations

import argparse
import sys

from rockframe.cli.arguments import (
    FILTERS,
    add_format,
    add_output,
    add_reading,
    add_structures,
    chosen_engine,
    chosen_structures,
    records_file,
)
from rockframe.cli.console import progress_bar, show_rejections
from rockframe.cli.options import add_options, chosen, path
from rockframe.options.execution import ExecutionOptions
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.respond import ScreenOptions


def add_screen(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, scales, filters, and the file to write."""
    parser.add_argument(
        "records",
        type=path,
        nargs="+",
        help="output of `rockframe ingest`, or record files and folders",
    )
    add_output(parser)
    parser.add_argument("--pulses", type=path, metavar="FILE", help="output of `rockframe pulse`")
    add_format(parser)
    add_structures(parser, one=False)
    add_options(parser, ScreenOptions)
    add_options(parser, Filters, title=FILTERS)
    add_reading(parser, processes=False)
    add_options(parser, ExecutionOptions)


def run_screen(options: argparse.Namespace) -> int:
    """Run the stage and print the tables."""
    from rockframe.cli.stages.screen_tables import show
    from rockframe.stages.screening.screen import screen_stage

    screening, filters = chosen(options, ScreenOptions), chosen(options, Filters)
    engine, workers = chosen_engine(options), chosen(options, ExecutionOptions).workers
    given = records_file(options.records, chosen(options, IngestOptions), workers)
    try:
        with given as (records, status), progress_bar("screening") as progress:
            done = screen_stage(
                records,
                options.output,
                screening,
                structures_path=chosen_structures(options),
                pulses_path=options.pulses,
                filters=filters,
                engine=engine,
                progress=progress,
                table_format=options.format,
            )
    except KeyboardInterrupt:
        print(
            "rockframe: interrupted; finished batches are kept, and the same command resumes.",
            file=sys.stderr,
        )
        return 130
    show(options.output, done, as_json=options.json)
    return show_rejections(done.rejections) or status
