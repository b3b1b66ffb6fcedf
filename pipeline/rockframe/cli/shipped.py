"""Commands of shipped studies: table1, paper.

Each computes the stages of the study of its name in ``data/studies``, for the records and with the
options of the command line, and then writes and prints what it is for.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from rockframe.cells import TABLE_FORMATS, Column
from rockframe.cli import arguments, console
from rockframe.cli.figure import FIGURES, add_grid
from rockframe.cli.options import add_options, chosen, flag, folder_to_write
from rockframe.cli.stages.respond import (
    matrices,
    most_severe,
    show_responses,
    verdict_notes,
    without_lacking_pairs,
)
from rockframe.compiled import tell_of_compiling
from rockframe.errors import ParameterError, require_known
from rockframe.matching.record_pulses import LEVEL
from rockframe.options.ingest import IngestOptions
from rockframe.options.model import Options, ReadingOptions
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.paper.pulses import BORROWED, QUANTITIES, paper_comparisons, statements
from rockframe.results.tables.rows import (
    Row,
    pulse_mark,
    response_columns,
    titled,
    wavelet_name,
)

if TYPE_CHECKING:
    from rockframe.engines.engine import Engine
    from rockframe.paper.claim import Claim
    from rockframe.runs.performing import Computed
    from rockframe.stages.acceptance import Ingested

#: Largest number of records that two processes draw; all cores draw more.
_FEW: Final = 12
#: Outputs of ingest, pulse and respond.
STAGE_FILES: Final = ("records.nc", "pulses.nc", "response.nc")


def add_table1(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the folder to write."""
    arguments.add_records(parser, ready=False)
    parser.add_argument(
        "--output",
        "-o",
        type=folder_to_write,
        default=Path("outputs/table1"),
        help="folder to write (default: outputs/table1)",
    )
    arguments.add_format(parser)
    arguments.add_matrix(parser)
    arguments.add_structures(parser, one=False)
    add_options(parser, RespondOptions, without=_WITH_RESPOND)
    add_options(parser, PulseOptions, without=_WITH_PULSE)
    add_options(parser, IngestOptions, without=_WITH_INGEST)
    add_options(parser, ReadingOptions)


#: Options that `table1` does not have: they are keys of a study, and options of single stages.
_WITH_RESPOND: Final = [f"ensemble.{name}" for name in Ensemble.model_fields if name != "members"]
_WITH_PULSE: Final = [name for name in PulseOptions.model_fields if name != "surrogates"]
_WITH_INGEST: Final = (
    *("selection", "catalogue_columns", "limits", "sequence", "rest_s", "strict"),
    *("azimuth_degree", "strike_degree", "spectral_periods_s"),
)


def run_table1(options: argparse.Namespace) -> int:
    """Run ingest, pulse and respond; write all files; print the table."""
    from rockframe.provenance import whole_folder
    from rockframe.results.pulses import pulse_rows, recordings_of
    from rockframe.results.tables.entries import write_entries, write_rows_as
    from rockframe.results.tables.summary import left_out_reasons, summary_rows
    from rockframe.stages.figures import draw_records
    from rockframe.stages.table import table_rows_of

    folder: Path = options.output
    tables = _tables(options, "table1")
    _validate(options, tables)
    with (
        whole_folder(folder, _files(options.format)) as partial,
        _helped(drawing=True) as (first_run, helped),
    ):
        computed = _computed(options, tables, partial, first_run=first_run)
        datasets = [computed.datasets[name] for name in STAGE_FILES]
        rows = list(table_rows_of(*datasets))
        left_out = left_out_reasons(datasets[2].attrs)
        summary = summary_rows(rows, recordings_of(datasets[0]), left_out)
        comparisons, said = paper_comparisons(rows, pulse_rows(datasets[1])), statements(rows)
        write_rows_as(partial / "table.csv", rows)
        write_rows_as(partial / "summary.csv", summary)
        if comparisons:
            write_rows_as(partial / "paper.csv", comparisons)
        files = [partial / name for name in STAGE_FILES]
        if options.format != "csv":
            _write_tables(partial, options.format, rows, summary)
            write_entries(
                computed.ingested.entries, partial / f"records{TABLE_FORMATS[options.format]}"
            )
        names = list(dict.fromkeys(row["record_id"] for row in rows))
        with console.progress_bar("drawing") as progress:
            engine = helped if len(names) <= _FEW else None
            draw_records(rows, files, partial / "figures", names, progress, engine)
        models = {"records": IngestOptions, "pulse": PulseOptions, "respond": RespondOptions}
        count = _finish(options, partial, computed.ingested, models)
    if options.json:
        console.show_json(
            {
                "rows": rows,
                "summary": summary,
                "paper": comparisons,
                "statements": said,
                "rejected": [vars(rejection) for rejection in computed.rejections],
                "output": str(folder),
            }
            | matrices(rows, options.matrix)
        )
    else:
        show(rows, summary, comparisons, said, options.matrix)
        print(f"{count} files and their manifest in {folder}")
    return console.show_rejections(computed.rejections)


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


def _validate(options: argparse.Namespace, tables: Mapping[str, Any]) -> None:
    """Validate files and structures that are stated, before anything is computed."""
    from rockframe.results.tables.entries import require_format
    from rockframe.stages.common import choose_structures
    from rockframe.study.toml import read_limits

    require_format(Path("table" + TABLE_FORMATS[options.format]))
    if tables["records"].limits is not None:
        read_limits(tables["records"].limits)
    choose_structures(arguments.chosen_structures(options), tables["respond"].structure)
    arguments.refuse_folder_of_records(options)


#: Words of the progress bars of stages.
_BARS: Final = {"pulse": "matching pulses", "respond": "rocking"}


def _watch(stage: str, note: str = "") -> AbstractContextManager[Callable[..., None]]:
    if stage == "ingest":
        return console.progress_names(f"reading{note}")
    return console.progress_bar(_BARS.get(stage, stage) + note)


def _tables(options: argparse.Namespace, name: str) -> dict[str, Any]:
    """Return the tables of a shipped study, with the options of the command line."""
    from rockframe.study.study import shipped_tables

    tables = dict(shipped_tables(name))
    overlaid = {
        stage: chosen(options, type(tables[stage]), **tables[stage].model_dump(exclude_unset=True))
        for stage in ("records", "pulse", "respond")
    }
    return tables | overlaid


def _computed(
    options: argparse.Namespace, tables: Mapping[str, Any], folder: Path, *, first_run: bool
) -> Computed:
    """Compute the stages of a shipped study."""
    from rockframe.runs.performing import compute
    from rockframe.study.structures import bundled_records

    return compute(
        tables,
        options.records or [bundled_records()],
        arguments.chosen_structures(options),
        folder,
        # the threads of one process use all cores for the responses
        workers={"ingest": chosen(options, ReadingOptions).workers, "respond": 1},
        watch=partial(_watch, note=", compiling for this first run" if first_run else ""),
    )


@contextmanager
def _helped(*, drawing: bool = False) -> Iterator[tuple[bool, Engine]]:
    """Start a second process while this one reads records.

    The second process compiles the vectorised kernel, if that is not in the cache, and imports
    what drawing needs. Yields True if the kernel had to be compiled, and the engine for drawing.
    """
    from rockframe.engines.engine import cores, helped
    from rockframe.rocking.kernels import lanes

    first_run = not cast("Any", lanes.integrate_lanes).cached()
    if first_run and cores() > 1:
        tell_of_compiling()
    compiling, to_draw = [_compile_kernel] * first_run, [_prepare_drawing] * drawing
    with helped([*compiling, *to_draw]) as engine:
        yield first_run, engine


def _prepare_drawing() -> None:
    """Import and read what drawing needs: the process that starts this needs it only later."""
    from rockframe.stages.figures import prepare_drawing

    prepare_drawing()


def _compile_kernel() -> None:
    """Compute two responses to samples, so that the forms of the kernel for them are cached."""
    from rockframe.frame import RockingFrame
    from rockframe.rocking.excitation import GroundAcceleration
    from rockframe.rocking.scenarios import respond_scenarios

    ground = GroundAcceleration.from_samples([0.0, 1.0, 0.0], 0.01)
    frame = RockingFrame(height=9.6, width=1.6)
    for demands in (False, True):
        respond_scenarios([ground], [frame], [0], [0], [1.0], demands=demands)


def _finish(
    options: argparse.Namespace,
    folder: Path,
    ingested: Ingested,
    models: Mapping[str, type[Options]],
) -> int:
    """Write the manifest of a folder. Return the number of files that it lists."""
    from rockframe.provenance import sha256_of, write_manifest

    structures = arguments.chosen_structures(options)
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
    first_row = rows[0] if rows else {}
    how: dict[str, Any] = {"group": "record_id", "rules": several, "all_in": "table.csv"}
    present = [key for key in _IF_KNOWN if any(math.isfinite(row[key]) for row in rows)]
    of_record = [
        column for column in _OF_RECORD if column.key in present or column.key not in _IF_KNOWN
    ]
    console.show_first(summary)
    if console.table_width() >= _WIDE:
        show_responses("", (*of_record, *response_columns(first_row, {})), rows, quantities, **how)
    else:
        printed = most_severe(without_lacking_pairs(rows))
        first = {row["record_id"]: row for row in reversed(printed) if not row.get("components")}
        console.show_rows("Records and pulses", of_record, reversed(first.values()))
        columns = (*titled({"record": "Record"}, once=True), *response_columns(first_row, {}))
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


_PAGE: Final = "paper-checked.md"


#: Default folder and resolution of maps of `rockframe paper`.
_PAPER_FOLDER: Final = Path("outputs/paper")
_PAPER_GRID: Final = 400


def add_paper(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the paper's records, if available, and the folder to write."""
    parser.add_argument(
        "--output",
        "-o",
        type=folder_to_write,
        default=_PAPER_FOLDER,
        help="folder to write (default: outputs/paper)",
    )
    parser.add_argument("--claim", metavar="NAME", help="print only this claim, and write nothing")
    arguments.add_records(parser, ready=False)
    add_grid(parser)
    parser.set_defaults(structures=None, grid=_PAPER_GRID)


def _refuse_beside_claim(options: argparse.Namespace) -> None:
    """Raise an error if options are stated that change no claim of the paper's text."""
    unstated = {"output": _PAPER_FOLDER, "grid": _PAPER_GRID, "records": None, "structures": None}
    for name, value in vars(options).items():
        always = name in ("claim", "json", "run")
        if not always and not (name in unstated and value == unstated[name]):
            raise ParameterError(
                f"{flag(name)} has no effect with --claim, which prints one claim. Leave one of "
                "them out."
            )


def run_paper(options: argparse.Namespace) -> int:
    """Check the claims, draw the figures, write the page and its manifest."""
    from rockframe.paper.claims import all_claims
    from rockframe.paper.pulses import record_claims
    from rockframe.provenance import whole_folder
    from rockframe.results.pulses import pulse_rows
    from rockframe.stages.table import table_rows_of

    if options.claim is not None:
        _refuse_beside_claim(options)
        claims = all_claims()
        require_known("claim", options.claim, [claim.name for claim in claims])
        _show_claims([claim for claim in claims if claim.name == options.claim], options.json)
        return 0
    folder: Path = options.output
    arguments.refuse_folder_of_records(options)
    tables = _tables(options, "paper")
    with (
        whole_folder(folder, (*STAGE_FILES, "records.csv", _PAGE)) as partial,
        _helped() as (first_run, _),
    ):
        computed = _computed(options, tables, partial, first_run=first_run)
        datasets, ingested = [computed.datasets[name] for name in STAGE_FILES], computed.ingested
        rows = list(table_rows_of(*datasets))
        claims = all_claims() + record_claims(rows, pulse_rows(datasets[1]))
        _write_page(claims, _draw_all(partial, options.grid), rows, partial)
        models = {"records": IngestOptions, "pulse": PulseOptions}
        _finish(options, partial, ingested, models)
    if options.json:
        console.show_json({"claims": [_plain(claim) for claim in claims], "output": str(folder)})
    else:
        _show_claims(claims, False)
        print(f"{folder / _PAGE}")
    return console.show_rejections(ingested.rejections)


def _draw_all(folder: Path, grid: int) -> dict[str, str]:
    """Draw all figures of `rockframe figure`; return the title and caption of each by its path."""
    from rockframe.cli.shown import FigureRequest
    from rockframe.figures.captioned import save_captioned

    records = folder / "records.nc"
    # the dimensions of the bridge bent are assumed: the paper states neither
    request = FigureRequest(
        records=lambda: nullcontext((records, 0)), grid=grid, spacing=12.0, beam_centre=1.0
    )
    captions = {}
    for name, entry in FIGURES.items():
        path = folder / "figures" / f"figure-{name}.png"
        drawn, _ = entry.draw(request)
        save_captioned(drawn, path)
        captions[path.relative_to(folder).as_posix()] = f"{drawn.title}. {drawn.caption}"
    return captions


def _write_page(
    claims: Sequence[Claim], figures: dict[str, str], rows: Sequence[Row], folder: Path
) -> None:
    from rockframe.paper.claims import checked_page
    from rockframe.paper.pulses import find_paper_record, paper_records
    from rockframe.provenance import whole_file

    own = {row["record_id"] for row in rows if find_paper_record(row["source_file"])}
    records = f"{len(own)} of the paper's {len(paper_records())} records were found by name"
    if not own:
        records += ": claims about its records are not checked, and figures show other records"
    with whole_file(folder / _PAGE) as partial:
        partial.write_text(checked_page(claims, figures, f"{records}."), encoding="utf-8")


def _show_claims(claims: Sequence[Claim], json: bool) -> None:
    if json:
        console.show_json({"claims": [_plain(claim) for claim in claims]})
        return
    columns = ("claim", "paper", "ours", "finding")
    cells = ([claim.name, claim.printed, claim.ours, claim.finding.value] for claim in claims)
    console.show_table("The paper, checked", columns, cells)
    if len(claims) == 1:
        (claim,) = claims
        print(f"{claim.where}: {claim.says}. {claim.remark}".rstrip())


def _plain(claim: Claim) -> dict[str, Any]:
    return {**vars(claim), "finding": claim.finding.value, "command": claim.shown_by}
