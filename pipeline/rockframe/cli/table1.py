"""rockframe table1: run all stages and print the paper's Table 1 for the records."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import TABLE_FORMATS, Column
from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, folder_to_write
from rockframe.cli.stages.respond import (
    matrices,
    most_severe,
    show_responses,
    verdict_notes,
)
from rockframe.matching.record_pulses import LEVEL
from rockframe.options.ingest import IngestOptions
from rockframe.options.model import Options
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions
from rockframe.paper.pulses import BORROWED, QUANTITIES, compare, statements
from rockframe.results.tables.rows import (
    Row,
    pulse_mark,
    response_columns,
    titled,
    wavelet_name,
)

if TYPE_CHECKING:
    import xarray as xr

    from rockframe.outcome import InputOutcome
    from rockframe.stages.acceptance import Ingested

#: Outputs of ingest, pulse and respond.
STAGE_FILES: Final = ("records.nc", "pulses.nc", "response.nc")


def add_table1(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the folder to write."""
    arguments.add_records(parser, ready=False)
    parser.add_argument(
        "--output",
        type=folder_to_write,
        default=Path("outputs/table1"),
        help="folder to write (default: outputs/table1)",
    )
    arguments.add_format(parser)
    arguments.add_matrix(parser)
    arguments.add_structures(parser, one=False)
    add_options(parser, RespondOptions)
    add_options(parser, PulseOptions, title="pulses")
    arguments.add_reading(parser)


def run_table1(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write all files; print the table."""
    from rockframe.provenance import whole_folder
    from rockframe.results.pulses import pulse_rows, recordings_of
    from rockframe.results.tables.entries import write_entries, write_rows_as
    from rockframe.results.tables.summary import summary_rows
    from rockframe.stages.figures import draw_records
    from rockframe.stages.table import table_rows_of

    folder: Path = options.output
    _validate(options)
    with whole_folder(folder, _files(options.format)) as partial:
        ingested, rejections, made = run_stages(
            options,
            partial,
            chosen(options, RespondOptions),
            structures_path=arguments.chosen_structures(options),
            pulses_path=partial / "pulses.nc",
        )
        rows = list(table_rows_of(*made))
        summary = summary_rows(rows, recordings_of(made[0]))
        comparisons, said = compare(rows, pulse_rows(made[1])), statements(rows)
        write_rows_as(partial / "table.csv", rows)
        write_rows_as(partial / "summary.csv", summary)
        if comparisons:
            write_rows_as(partial / "paper.csv", comparisons)
        files = [partial / name for name in STAGE_FILES]
        if options.format != "csv":
            _write_tables(partial, options.format, rows, summary)
            write_entries(ingested.entries, partial / f"records{TABLE_FORMATS[options.format]}")
        names = list(dict.fromkeys(row["record_id"] for row in rows))
        with console.progress_bar("drawing") as progress:
            draw_records(rows, files, partial / "figures", names, progress)
        stated = {"records": IngestOptions, "pulse": PulseOptions, "respond": RespondOptions}
        count = finish(options, partial, ingested, arguments.chosen_structures(options), stated)
    if options.json:
        console.show_json(
            {
                "rows": rows,
                "summary": summary,
                "paper": comparisons,
                "statements": said,
                "rejected": [vars(rejection) for rejection in rejections],
                "output": str(folder),
            }
            | matrices(rows, options.matrix)
        )
    else:
        show(rows, summary, comparisons, said, options.matrix)
        print(f"{count} files and their manifest in {folder}")
    return console.show_rejections(rejections)


def _write_tables(
    folder: Path, table_format: str, rows: Sequence[Row], summary: Sequence[Row]
) -> None:
    """Write rows and summary in a format; a workbook has both."""
    from rockframe.results.tables.entries import write_rows_as
    from rockframe.stages.table import write_table_workbook

    ending = TABLE_FORMATS[table_format]
    if table_format == "xlsx":
        files = [(folder / name, name.removesuffix(".nc")) for name in STAGE_FILES]
        write_table_workbook(folder / "table.xlsx", rows, summary, *files)
        return
    for name, content in (("table", rows), ("summary", summary)):
        write_rows_as(folder / f"{name}{ending}", content, table_format)


def _files(table_format: str) -> list[str]:
    """Return the files that the command writes, except figures."""
    tables = [
        f"{n}{e}"
        for n in ("records", "table", "summary")
        for e in {".csv", TABLE_FORMATS[table_format]}
    ]
    return [*STAGE_FILES, *tables, "paper.csv"]


def _validate(options: argparse.Namespace) -> None:
    """Validate all options and the structures before anything is computed."""
    from rockframe.results.tables.entries import require_format
    from rockframe.stages.respond import choose_structures
    from rockframe.study.toml import read_limits

    require_format(Path("table" + TABLE_FORMATS[options.format]))
    ingest = chosen(options, IngestOptions)
    chosen(options, PulseOptions)
    if ingest.limits is not None:
        read_limits(ingest.limits)
    choose_structures(
        arguments.chosen_structures(options), chosen(options, RespondOptions).structure
    )
    arguments.refuse_folder_of_records(options)


def run_stages(
    options: argparse.Namespace, folder: Path, respond: RespondOptions, **of_respond: Any
) -> tuple[Ingested, tuple[InputOutcome, ...], list[xr.Dataset]]:
    """Run ingest, pulse and respond; return what was ingested, all rejections, and what the three
    stages wrote into `STAGE_FILES`.

    `of_respond` are further arguments of `respond_stage`.
    """
    from rockframe.engines.engine import OneProcess
    from rockframe.stages.ingest import ingest_stage
    from rockframe.stages.pulse import pulse_stage
    from rockframe.stages.respond import respond_stage
    from rockframe.study.structures import bundled_records

    records, pulses, response = (folder / name for name in STAGE_FILES)
    written: list[xr.Dataset] = []
    with console.progress_names("reading") as reading:
        ingested = ingest_stage(
            options.records or [bundled_records()],
            records,
            chosen(options, IngestOptions),
            progress=reading,
            workers=arguments.reading_workers(options),
        )
    with console.progress_bar("matching pulses") as progress:
        matching = chosen(options, PulseOptions)
        without_pulse = pulse_stage(
            records, pulses, matching, progress=progress, written=written.append
        )
    with console.progress_bar("rocking") as progress:
        without_vertical = respond_stage(
            records,
            response,
            respond,
            engine=OneProcess(),  # one process; its threads use all cores
            progress=progress,
            written=written.append,
            **of_respond,
        )
    rejections = (*ingested.rejections, *without_pulse, *without_vertical)
    return ingested, rejections, [ingested.dataset, *written]


def finish(
    options: argparse.Namespace,
    folder: Path,
    ingested: Ingested,
    structures: Path,
    models: Mapping[str, type[Options]],
) -> int:
    """Write the manifest of a folder. Return the number of files that it lists."""
    from rockframe.provenance import sha256_of
    from rockframe.results.manifest import write_manifest

    outputs = sorted(file for file in folder.rglob("*") if file.is_file())
    write_manifest(
        folder,
        inputs={**ingested.inputs, structures.name: sha256_of(structures)},
        parameters={table: chosen(options, model).stated() for table, model in models.items()},
        outputs=outputs,
    )
    return len(outputs)


def _ricker(row: Mapping[str, Any], key: str) -> str:
    return wavelet_name(row, key).replace("mavroeidis_papageorgiou", "not: M.-P.")


_OF_RECORD: Final = (
    *titled({"event": "Earthquake", "record": "Record", "magnitude": "M_w>"}, once=True),
    *titled({"epicentral_distance_km": "Repi\n[km]>"}, once=True),
    *titled({"distance_rrup_km": "Rrup\n[km]>", "distance_rjb_km": "Rjb\n[km]>"}, once=True),
    *titled({"pga_g": "PGA\n[g]>", "pgv_m_s": "PGV\n[m/s]>", "a_p_g": "a_p\n[g]>"}, once=True),
    *titled({"T_p_s": "T_p\n[s]>"}, once=True, mark=("at_period_bound", "*")),
    Column("Ricker", "wavelet", rule=_ricker, once=True),
)
#: Columns that are printed only if a record has a value.
_IF_KNOWN: Final = ("distance_rrup_km", "distance_rjb_km")
_OF_PAPER: Final = (
    Column("Record", rule=lambda row, _: row["record"] if row["quantity"] == "pga_g" else ""),
    Column("", rule=lambda row, _: "{} [{}]".format(*QUANTITIES[row["quantity"]])),
    Column("paper>", "printed"),
    Column("ours>", "ours", ".3f"),
    Column("difference>", rule=lambda row, _: f"{100.0 * row['relative_difference']:+.1f} %"),
    Column("Ricker", "wavelet", rule=lambda row, key: _ricker(row, key) if row[key] else ""),
    Column("", "remark"),
)
#: Smallest width for one table of records and responses [characters]; otherwise two are printed.
_WIDE: Final = 206


def show(
    rows: Sequence[Row],
    summary: Sequence[Row],
    comparisons: Sequence[Row],
    said: Sequence[str],
    quantities: Sequence[str] = (),
) -> None:
    """Print records, pulses and responses, then the comparison with the paper."""
    several = len({row["structure"] for row in rows}) > 1
    one = rows[0] if rows else {}
    how: dict[str, Any] = {"group": "record_id", "rules": several, "all_in": "table.csv"}
    known = [key for key in _IF_KNOWN if any(math.isfinite(row[key]) for row in rows)]
    of_record = [one for one in _OF_RECORD if one.key in known or one.key not in _IF_KNOWN]
    if console.table_width() >= _WIDE:
        show_responses("", (*of_record, *response_columns(one, {})), rows, quantities, **how)
    else:
        first = {row["record_id"]: row for row in reversed(most_severe(rows))}
        console.show_rows("Records and pulses", of_record, reversed(first.values()))
        columns = (*titled({"record": "Record"}, once=True), *response_columns(one, {}))
        show_responses("", columns, rows, quantities, **how)
    console.show_summary(summary)
    _show_notes(rows)
    if comparisons:
        console.show_rows("The paper's records: its values and ours", _OF_PAPER, comparisons)
        print("T_p and a_p depend on the wavelet, which the paper does not state for each record.")
    for i, statement in enumerate(said):
        print(f"- {statement}" if i else statement)
    if comparisons:
        print()


def _show_notes(rows: Sequence[Row]) -> None:
    notes = [verdict_notes(rows[0])] if rows else []
    if any(row["at_period_bound"] for row in rows):
        notes.append("* at the end of the searched range of periods, not at a maximum")
    mark = max((pulse_mark(row) for row in rows), default="")
    if mark:
        notes.append(
            f"{mark} best match, could be noise: similar noise matches as well in\n"
            f"  more than {100.0 * LEVEL:g} % of the draws (pulse_p_value in table.csv)"
        )
    if any(BORROWED in row["facts_source"] for row in rows):
        notes.append(f"Names, M_w and Repi that are missing in the files: {BORROWED}.")
    for note in notes:
        print(note)
    if notes:
        print()
