"""rockframe table1: run all stages and print the paper's Table 1 for the records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.cli.arguments import (
    add_margins,
    add_periods,
    add_reading,
    add_structures,
    add_vertical,
    path,
)
from rockframe.cli.outputs import folder_to_write
from rockframe.cli.pulse_options import add_pulse_wavelet

if TYPE_CHECKING:
    from rockframe.ingest import Rejection
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
        "--output",
        type=folder_to_write,
        default=Path("outputs/table1"),
        help="folder to write (default: outputs/table1)",
    )
    add_structures(parser)
    add_vertical(parser)
    add_margins(parser)
    add_reading(parser)
    add_periods(parser)
    add_pulse_wavelet(parser)


def run(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write files, table, figures, manifest; print."""
    from rockframe.cli.console import show_json, show_rejections
    from rockframe.cli.draw import draw
    from rockframe.cli.table import rows_of, write_table
    from rockframe.cli.table1_tables import show
    from rockframe.paper import compare, statements
    from rockframe.provenance import whole_folder
    from rockframe.results import pulse_rows

    folder: Path = options.output
    _require_sound(options)
    with whole_folder(folder) as partial:
        ingested, rejections = _stages(options, partial)
        files = [partial / name for name in ("records.nc", "pulses.nc", "response.nc")]
        rows = list(rows_of(*files))
        comparisons, said = compare(rows, pulse_rows(files[1])), statements(rows)
        write_table(rows, partial / "table.csv")
        if comparisons:
            write_table(comparisons, partial / "paper.csv")
        draw(rows, files, partial / "figures", list(dict.fromkeys(row.record_id for row in rows)))
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
    from rockframe.cli.pulse_options import find_options
    from rockframe.engines import OneProcess
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
            options=find_options(options),
            progress=progress,
        )
    with progress_bar("rocking") as progress:
        without_vertical = respond_stage(
            records,
            folder / "response.nc",
            structures_path=options.structures or SHIPPED_STRUCTURES,
            structure=options.structure,
            vertical=options.vertical,
            pulses_path=folder / "pulses.nc",
            margins=options.margins,
            engine=OneProcess(),  # its threads use all cores
            progress=progress,
        )
    return ingested, (*ingested.rejections, *without_pulse, *without_vertical)


def _finish(options: argparse.Namespace, ingested: Ingested, folder: Path) -> int:
    """Write the manifest; return the number of files of the run."""
    from rockframe.cli.arguments import passport_limits, read_options
    from rockframe.provenance import sha256_of
    from rockframe.results import write_manifest
    from rockframe.study import SHIPPED_STRUCTURES

    structures = options.structures or SHIPPED_STRUCTURES
    outputs = sorted(file for file in folder.rglob("*") if file.is_file())
    write_manifest(
        folder,
        inputs={**ingested.inputs, structures.name: sha256_of(structures)},
        parameters={
            "all_uncorrected": options.uncorrected,
            "band_pass_hz": list(options.band_pass),
            "margins": options.margins,
            "passport": passport_limits(options).stated(),
            "periods_s": list(options.periods),
            "structure": options.structure,
            **read_options(options).stated(),
            "vertical": options.vertical,
        },
        outputs=outputs,
    )
    return len(outputs) + 1
