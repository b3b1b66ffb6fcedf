"""rockframe table1: run all stages and print the paper's Table 1 for the records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.arguments import add_periods, add_reading, add_structures, add_vertical, path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.ingest import Rejection
    from rockframe.paper import Comparison
    from rockframe.results import TableRow
    from rockframe.stages import Ingested


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records and structures; the bundled and shipped ones by default."""
    parser.add_argument(
        "--records",
        nargs="+",
        type=path,
        metavar="PATH",
        help="record files or folders (default: the bundled 2019 Ridgecrest records)",
    )
    parser.add_argument(
        "--output", type=path, default=Path("outputs/table1"), help="folder to write"
    )
    add_structures(parser)
    add_vertical(parser)
    add_reading(parser)
    add_periods(parser)


def run(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write files, table, figures, manifest; print."""
    from rockframe.cli.console import show_json, show_rejections
    from rockframe.cli.table1_tables import show
    from rockframe.paper import compare, statements
    from rockframe.provenance import whole_folder

    folder: Path = options.output
    _require_sound(options)
    with whole_folder(folder) as partial:
        ingested, rejections = _stages(options, partial)
        rows = _rows(partial)
        comparisons, said = compare(rows), statements(rows)
        _write_table(rows, partial / "table.csv")
        if comparisons:
            _write_table(comparisons, partial / "paper.csv")
        _draw(rows, partial)
        count = _finish(options, ingested, partial)
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
    """What can be known to be wrong is said before anything is computed."""
    from rockframe.cli.arguments import (
        band_pass,
        passport_limits,
        read_options,
        refuse_folder_of_records,
    )
    from rockframe.stages import choose_structures
    from rockframe.study import SHIPPED_STRUCTURES

    read_options(options)
    band_pass(options)
    passport_limits(options)
    choose_structures(options.structures or SHIPPED_STRUCTURES, options.structure)
    refuse_folder_of_records(options)


def _stages(options: argparse.Namespace, folder: Path) -> tuple[Ingested, tuple[Rejection, ...]]:
    from rockframe.cli.arguments import band_pass, passport_limits, read_options
    from rockframe.cli.console import progress_bar, progress_names
    from rockframe.stages import ingest_stage, pulse_stage, respond_stage
    from rockframe.study import SHIPPED_STRUCTURES, bundled_records

    records = folder / "records.nc"
    with progress_names("reading") as reading:
        ingested = ingest_stage(
            options.records or [bundled_records()],
            records,
            options=read_options(options),
            catalogue=options.catalogue,
            band=band_pass(options),
            all_uncorrected=options.uncorrected,
            passport_limits=passport_limits(options),
            progress=reading,
            workers=options.workers,
            strict=options.strict,
        )
    with progress_bar("matching pulses") as progress:
        without_pulse = pulse_stage(
            records,
            folder / "pulses.nc",
            shortest_period=options.periods[0],
            longest_period=options.periods[1],
            progress=progress,
        )
    with progress_bar("rocking") as progress:
        without_vertical = respond_stage(
            records,
            folder / "response.nc",
            structures_path=options.structures or SHIPPED_STRUCTURES,
            structure=options.structure,
            vertical=options.vertical,
            progress=progress,
        )
    return ingested, (*ingested.rejections, *without_pulse, *without_vertical)


def _rows(folder: Path) -> list[TableRow]:
    from rockframe.paper import with_paper_facts
    from rockframe.results import table_rows

    files = (folder / name for name in ("records.nc", "pulses.nc", "response.nc"))
    return [with_paper_facts(row) for row in table_rows(*files)]


def _draw(rows: Sequence[TableRow], folder: Path) -> None:
    """One figure for each record that was answered."""
    from rockframe.cli.console import progress_bar
    from rockframe.figures import draw_response_history, save
    from rockframe.results import best_pulses, open_records, open_response

    titles = {row.record_id: f"{row.event}, {row.record}".removeprefix(", ") for row in rows}
    pulses = best_pulses(folder / "pulses.nc")
    with (
        open_records(folder / "records.nc") as records,
        open_response(folder / "response.nc") as response,
        progress_bar("drawing") as progress,
    ):
        for i, name in enumerate(response.records):
            figure = draw_response_history(
                records.read(name).acceleration,
                pulses.get(name),
                [response.sel(record=name, structure=s) for s in response.structures],
                titles[name],
            )
            save(figure, folder / "figures" / f"{name}.png")
            progress(i + 1, len(response.records))


def _write_table(rows: Sequence[TableRow] | Sequence[Comparison], path: Path) -> None:
    import csv
    import math

    from rockframe.provenance import whole_file

    with whole_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(vars(rows[0]))
        for row in rows:
            writer.writerow(
                "" if isinstance(value, float) and math.isnan(value) else value
                for value in vars(row).values()
            )


def _finish(options: argparse.Namespace, ingested: Ingested, folder: Path) -> int:
    """Write the manifest; return the number of files of the run."""
    from rockframe.cli.arguments import passport_limits, read_options
    from rockframe.provenance import sha256_of, write_manifest
    from rockframe.study import SHIPPED_STRUCTURES

    structures = options.structures or SHIPPED_STRUCTURES
    outputs = sorted(file for file in folder.rglob("*") if file.is_file())
    write_manifest(
        folder,
        inputs={**ingested.inputs, structures.name: sha256_of(structures)},
        parameters={
            "all_uncorrected": options.uncorrected,
            "band_pass_hz": list(options.band_pass),
            "passport": passport_limits(options).stated(),
            "periods_s": list(options.periods),
            "structure": options.structure,
            **read_options(options).stated(),
            "vertical": options.vertical,
        },
        outputs=outputs,
    )
    return len(outputs) + 1
