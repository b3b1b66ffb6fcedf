"""rockframe compare: bridges that rock beside restrained, hybrid, isolated and fixed ones."""

from __future__ import annotations

import argparse
from collections import ChainMap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, get_args

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, file_to_write, folder_to_write, path
from rockframe.cli.stages.respond import MOST_RESPONSES
from rockframe.errors import ParameterError
from rockframe.options.model import ExecutionOptions

if TYPE_CHECKING:
    from rockframe.results.schema.arrays import Arrays
    from rockframe.results.tables.rows import Row


def add_compare(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures with alternative systems, and the file to write."""
    from rockframe.study.structures import Rival

    parser.add_argument(
        "records",
        type=path,
        nargs="+",
        help="output of `rockframe ingest`, or several of them without common records",
    )
    parser.add_argument(
        "--against",
        nargs="+",
        choices=get_args(Rival),
        help="models to compare with the free frame, as stated in the file of structures "
        "(default: all that it states)",
    )
    arguments.add_output(parser)
    arguments.add_format(parser, default=None)
    parser.add_argument(
        "--page",
        type=file_to_write(".html"),
        metavar="FILE",
        help="page to write, with a chart of the designs over all records",
    )
    parser.add_argument(
        "--figures",
        type=folder_to_write,
        metavar="FOLDER",
        help="folder for figures of the records with the largest drifts",
    )
    arguments.add_structures(parser)
    add_options(parser, ExecutionOptions)


#: Kind of the main table of a comparison.
_COMPARISON: Final = "comparison"


def run_compare(options: argparse.Namespace) -> int:
    """Run the stage, print the tables, and write the page and the figures."""
    from rockframe.results.pulses import recordings_of
    from rockframe.results.response import comparison_rows
    from rockframe.results.tables.designs import (
        BEST_COLUMNS,
        DESIGN_COLUMNS,
        best_rows,
        design_rows,
    )
    from rockframe.results.tables.notes import comparison_note, left_out_reasons
    from rockframe.stages.compare import compare_stage, write_comparison_page
    from rockframe.stages.figures import figures_stage

    if options.structures is None:
        raise ParameterError("--structures missing. Must be a file with [compare] tables.")
    first = {"designs": DESIGN_COLUMNS, "best": BEST_COLUMNS, _COMPARISON: ("record_id",)}
    arguments.refuse_tables(options, first, _COMPARISON)
    written: list[Arrays] = []
    with console.progress_bar("comparing") as progress:
        rejections = compare_stage(
            options.records,
            options.output,
            options.structures,
            against=options.against,
            structure=options.structure,
            engine=arguments.chosen_engine(options),
            progress=progress,
            written=written.append,
        )
    drawn = figures_stage([options.output], options.figures) if options.figures else {}
    rows = comparison_rows(written[0])
    recordings = ChainMap(*(recordings_of(record) for record in options.records))
    left_out = left_out_reasons(written[0].attrs)
    note = comparison_note(written[0].attrs)
    designs = design_rows(rows, recordings)
    best = best_rows(designs)
    tables = arguments.write_tables(
        options, {"designs": designs, "best": best, _COMPARISON: rows}, _COMPARISON
    )
    if options.page:
        name = options.output.stem
        write_comparison_page(options.page, name, rows, recordings, left_out, note)
        tables.append(str(options.page))
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        said = {"comparison": rows, "designs": designs, "best": best, "rejected": rejected}
        beside = {"left_out": left_out, "output": str(options.output)}
        named = {"tables": tables} if tables else {}
        console.show_json({**said, **beside, **named})
    else:
        _show_comparison(rows, designs, best, options.output, left_out)
        if note:
            print(console.filled(note))
        print(*tables, sep="\n", end="\n" if tables else "")
    for file in drawn:
        print(options.figures / file)
    return console.show_rejections(rejections)


def _show_comparison(
    rows: Sequence[Row],
    designs: Sequence[Row],
    best: Sequence[Row],
    output: Path,
    left_out: Mapping[str, str],
) -> None:
    from rockframe.results.tables.designs import BEST, COMPARISON, DESIGN_LEGEND, design_columns
    from rockframe.results.tables.notes import left_out_words
    from rockframe.results.tables.summary import summary_title

    count = designs[0]["records"]
    if words := left_out_words(left_out, count):
        print(f"{console.filled(words)}\n")
    if len(rows) <= MOST_RESPONSES:
        console.show_rows(f"Bridges in {output}", COMPARISON, rows)
        print(
            "Values without a quantile (16, 50, 84 %) are nominal, those of the bridge exactly as "
            "given.\nOverturn: share of plausible bridges around it, with its 90 % interval. "
            "Ends in: share of them\nthat reach a limit of the model."
        )
    if count > 1:
        over = summary_title([{"records": count, "left_out": len(left_out)}])
        title = f"Designs {over.lower().replace('all', f'all {count}')} in {output}"
        console.show_rows(title, design_columns(designs), designs, group="structure")
        console.show_rows("Best designs, the less the better", BEST, best)
        print(console.filled(DESIGN_LEGEND))
