"""rockframe table1: run all stages and print the paper's Table 1 for the records."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockframe.cli.arguments import add_periods, add_reading, add_structures

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.paper import Comparison
    from rockframe.results import TableRow
    from rockframe.stages import Ingested

_SHORT = {"symmetric_ricker": "sym.", "antisymmetric_ricker": "antisym."}
_LABELS = {"pga_g": "PGA [g]", "pgv_m_s": "PGV [m/s]", "a_p_g": "a_p [g]", "T_p_s": "T_p [s]"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Records and structures; the bundled and shipped ones by default."""
    parser.add_argument(
        "--records",
        nargs="+",
        type=Path,
        metavar="PATH",
        help="record files or folders (default: the bundled 2019 Ridgecrest records)",
    )
    parser.add_argument(
        "--output", type=Path, default=Path("outputs/table1"), help="folder to write"
    )
    add_structures(parser)
    add_reading(parser)
    add_periods(parser)


def run(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write files, table, figures, manifest; print."""
    from rockframe.cli.console import show_json, show_rejections
    from rockframe.paper import compare, statements, with_paper_facts
    from rockframe.results import table_rows

    folder: Path = options.output
    (folder / "manifest.json").unlink(missing_ok=True)  # the run is not complete until its end
    ingested = _stages(options, folder)
    files = [folder / name for name in ("records.nc", "pulses.nc", "response.nc")]
    rows = [with_paper_facts(row) for row in table_rows(*files)]
    comparisons, said = compare(rows), statements(rows)
    _write_table(rows, folder / "table.csv")
    outputs = [*files, folder / "records.csv", folder / "table.csv", *_figures(ingested, folder)]
    _finish(options, ingested, folder, outputs)
    if options.json:
        show_json(
            {
                "rows": [vars(row) for row in rows],
                "paper": [vars(comparison) for comparison in comparisons],
                "statements": said,
                "rejected": [vars(rejection) for rejection in ingested.rejections],
                "output": str(folder),
            }
        )
    else:
        _show(rows, comparisons, said)
        print(f"{len(outputs) + 1} files in {folder}")
    show_rejections(ingested.rejections)
    return 1 if ingested.rejections else 0


def _stages(options: argparse.Namespace, folder: Path) -> Ingested:
    from rockframe.cli.arguments import band_pass, passport_limits, read_options
    from rockframe.cli.console import progress_bar, progress_names
    from rockframe.ingest import read_catalogue
    from rockframe.stages import ingest_stage, pulse_stage, respond_stage
    from rockframe.study import SHIPPED_STRUCTURES, bundled_records

    records = folder / "records.nc"
    with progress_names("reading") as reading:
        ingested = ingest_stage(
            options.records or [bundled_records()],
            records,
            options=read_options(options),
            catalogue=read_catalogue(options.catalogue) if options.catalogue else None,
            band=band_pass(options),
            limits=passport_limits(options),
            progress=reading,
        )
    with progress_bar("matching pulses") as progress:
        pulse_stage(
            records,
            folder / "pulses.nc",
            shortest_period=options.periods[0],
            longest_period=options.periods[1],
            progress=progress,
        )
    with progress_bar("rocking") as progress:
        respond_stage(
            records,
            folder / "response.nc",
            structures_path=options.structures or SHIPPED_STRUCTURES,
            structure=options.structure,
            progress=progress,
        )
    return ingested


def _figures(ingested: Ingested, folder: Path) -> list[Path]:
    """One figure for each record that was answered."""
    from rockframe.cli.console import progress_bar
    from rockframe.figures import draw_response_history, save
    from rockframe.paper import paper_record_of
    from rockframe.results import best_pulses, open_response

    records = {record.record_id: record for record in ingested.records}
    pulses = best_pulses(folder / "pulses.nc")
    paths = []
    with open_response(folder / "response.nc") as response, progress_bar("drawing") as progress:
        for i, name in enumerate(response.records):
            record = records[name]
            paper = paper_record_of(record.source_file)
            parts = [record.event, "/".join(p for p in (record.station, record.component) if p)]
            known = ", ".join(part for part in parts if part)
            if not known:
                known = f"{paper.event}, {paper.record}" if paper else name
            figure = draw_response_history(
                record.acceleration,
                pulses[name],
                [response.sel(record=name, structure=s) for s in response.structures],
                known,
            )
            paths.append(folder / "figures" / f"{name}.png")
            save(figure, paths[-1])
            progress(i + 1, len(response.records))
    return paths


def _write_table(rows: Sequence[TableRow], path: Path) -> None:
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


def _finish(
    options: argparse.Namespace, ingested: Ingested, folder: Path, outputs: Sequence[Path]
) -> None:
    from rockframe.cli.arguments import passport_limits
    from rockframe.provenance import sha256_of, write_manifest
    from rockframe.study import SHIPPED_STRUCTURES

    structures = options.structures or SHIPPED_STRUCTURES
    inputs = {record.source_file: record.source_sha256 for record in ingested.records}
    write_manifest(
        folder,
        inputs=inputs | {structures.name: sha256_of(structures)},
        parameters={
            "band_pass_hz": list(options.band_pass),
            "passport": passport_limits(options).stated(),
            "periods_s": list(options.periods),
            "structure": options.structure,
            "time_step_s": options.time_step,
            "units": options.units,
        },
        outputs=outputs,
    )


def _show(rows: Sequence[TableRow], comparisons: Sequence[Comparison], said: Sequence[str]) -> None:
    from rockframe.cli.console import show_table

    show_table(
        "Records, pulses and response",
        [
            *("Earthquake", "Record", "M_w>", "R\n[km]>", "PGA\n[g]>", "PGV\n[m/s]>", "a_p\n[g]>"),
            *("T_p\n[s]>", "Ricker", "Structure", "θ/α\n>", "u_max\n[cm]>", "v_max\n[cm]>"),
            "Verdict",
        ],
        list(_cells(rows)),
    )
    if comparisons:
        show_table(
            "The paper's records: its values and ours",
            ["Record", "", "paper>", "ours>", "difference>", ""],
            [_comparison_cells(comparison) for comparison in comparisons],
        )
    for statement in said:
        print(f"- {statement}")
    if said:
        print()


def _cells(rows: Sequence[TableRow]) -> list[list[str]]:
    from rockframe.cli.console import number
    from rockframe.cli.respond import verdict_text

    cells: list[list[str]] = []
    last = ""
    for row in rows:
        record: list[str] = [""] * 9
        if row.record_id != last:
            if last and row.structure != rows[-1].structure:
                cells.append([])
            record = [
                row.event,
                row.record,
                number(row.magnitude, 1),
                number(row.epicentral_distance_km, 1),
                number(row.pga_g, 2),
                number(row.pgv_m_s, 2),
                number(row.a_p_g, 2),
                number(row.T_p_s, 2),
                _SHORT[row.wavelet],
            ]
            last = row.record_id
        stands = row.verdict != "overturned"
        peaks = (row.peak_rotation_ratio, 3), (100.0 * row.u_max_m, 1), (100.0 * row.v_max_m, 2)
        response = [number(value, decimals) if stands else "–" for value, decimals in peaks]
        verdict = verdict_text(row.verdict, row.overturning_time_s)
        cells.append([*record, row.structure, *response, verdict])
    return cells


def _comparison_cells(comparison: Comparison) -> list[Any]:
    from rockframe.cli.console import number

    return [
        comparison.record if comparison.quantity == "pga_g" else "",
        _LABELS[comparison.quantity],
        number(comparison.paper, 2),
        number(comparison.ours, 3),
        f"{100.0 * comparison.relative_difference:+.1f} %",
        comparison.remark,
    ]
