"""Commands of shipped studies: table1, paper.

Each runs the study of its name in ``data/studies`` with the records and options of the command
line, as `rockframe run` does, and then prints what it is for.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

from rockframe.cells import TABLE_FORMATS, Column
from rockframe.cli import arguments, console
from rockframe.cli.figure import add_grid
from rockframe.cli.options import add_options, chosen, flag, folder_to_write
from rockframe.cli.run import carry_out
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
from rockframe.options.model import FigureOptions, ReadingOptions
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.outcome import InputOutcome
from rockframe.paper.pulses import BORROWED, QUANTITIES, paper_comparisons, statements
from rockframe.results.tables.rows import (
    Row,
    pulse_mark,
    response_columns,
    titled,
    wavelet_name,
)

if TYPE_CHECKING:
    from rockframe.paper.claim import Claim
    from rockframe.runs.plan import Step
    from rockframe.study.study import Study


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
    from rockframe.results.pulses import pulse_rows, recordings_of
    from rockframe.results.schema import RESPONSE
    from rockframe.results.stored import attributes_of
    from rockframe.results.tables.entries import require_format
    from rockframe.results.tables.notes import left_out_reasons, with_directions
    from rockframe.results.tables.summary import summary_rows
    from rockframe.runs.plan import OF_RECORDS
    from rockframe.stages.table import table_rows_of

    folder: Path = options.output
    require_format(Path("table" + TABLE_FORMATS[options.format]))
    rejections = _computed(options, _study(options, "table1"), _steps_of_table1(options.format))
    files = [folder / name for name in OF_RECORDS]
    rows = list(table_rows_of(*files))
    attributes = attributes_of(files[2], RESPONSE)
    summary = summary_rows(rows, recordings_of(files[0]), left_out_reasons(attributes))
    summary = with_directions(summary, attributes)
    comparisons, said = paper_comparisons(rows, pulse_rows(files[1])), statements(rows)
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
        print(f"{_count(folder)} files and their manifest in {folder}")
    return console.show_rejections(rejections)


def _steps_of_table1(table_format: str) -> list[Step]:
    """Return the steps after the stages: tables and figures."""
    from rockframe.runs.plan import OF_RECORDS, Step

    ending = TABLE_FORMATS[table_format]
    tables = ["records.csv", "table.csv", "summary.csv", "paper.csv"]
    tables += [f"{name}{ending}" for name in ("records", "table", "summary")]
    if table_format == "xlsx":
        tables.remove("summary.xlsx")  # a sheet of the workbook
    read = (*OF_RECORDS, "records.csv")
    written = tuple(name for name in dict.fromkeys(tables) if name != "records.csv")
    return [
        Step("table", "table1", read, written, {"table_format": table_format}),
        Step(
            *("draw", "draw", OF_RECORDS, ("figures/",)),
            options=FigureOptions(most=_ALL).model_dump(mode="json"),
            workers=True,
        ),
    ]


#: Largest number of files whose records one process computes.
_FEW: Final = 12
#: Largest number of records that are drawn: all.
_ALL: Final = 1_000_000


def _study(options: argparse.Namespace, name: str) -> Study:
    """Return a shipped study with the records, structures and options of the command line."""
    from rockframe.study.study import Study, shipped_study

    study = shipped_study(name)
    tables = {
        stage: chosen(options, type(table), **table.model_dump(exclude_unset=True))
        for stage, table in study.tables
        if stage in ("records", "pulse", "respond")
    }
    if options.records:
        tables["records"] = tables["records"].replaced(paths=tuple(map(str, options.records)))
    if options.structures:
        tables["structures"] = options.structures
    return Study(study.path, study.tables.replaced(**tables), study.home)


def _computed(
    options: argparse.Namespace, study: Study, then: Sequence[Step]
) -> list[InputOutcome]:
    """Run a study, unless its folder has its results already; return the rejected records."""
    from rockframe.engines.choice import choose_engine
    from rockframe.engines.engine import OneProcess
    from rockframe.results.tables.entries import rejected_inputs
    from rockframe.runs.plan import make_plan

    arguments.refuse_folder_of_records(options)
    plan = make_plan(study, options.output, then)
    workers = chosen(options, ReadingOptions).workers
    few = len(plan.inputs) <= _FEW  # the threads of one process use all cores
    with _helped():
        engine = OneProcess(workers) if few or workers == 0 else choose_engine(workers)
        carry_out(plan, options.output, engine=engine)
    return rejected_inputs(options.output)


def _count(folder: Path) -> int:
    """Return the number of files that the manifest of a folder lists."""
    from rockframe.provenance import MANIFEST, listed_outputs

    return len(listed_outputs(folder / MANIFEST))


@contextmanager
def _helped() -> Iterator[None]:
    """Compile the vectorised kernel in a second process while this one reads records, unless it is
    in the cache. That process ends when it has compiled, so that its memory is free again.
    """
    from rockframe.engines.engine import cores
    from rockframe.engines.pool import WorkerPool
    from rockframe.rocking.kernels import lanes

    if cast("Any", lanes.integrate_lanes).cached() or cores() == 1:
        yield
        return
    tell_of_compiling()
    with WorkerPool(1) as pool:
        compiling = pool.submit(_compile_kernel)
        compiling.add_done_callback(lambda _: pool.shutdown(wait=False))
        yield


def _compile_kernel() -> None:
    """Compute two responses to samples, so that the forms of the kernel for them are cached."""
    from rockframe.frame import RockingFrame
    from rockframe.rocking.excitation import GroundAcceleration
    from rockframe.rocking.scenarios import respond_scenarios

    ground = GroundAcceleration.from_samples([0.0, 1.0, 0.0], 0.01)
    frame = RockingFrame(height=9.6, width=1.6)
    for demands in (False, True):
        respond_scenarios([ground], [frame], [0], [0], [1.0], demands=demands)


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
    from rockframe.runs.plan import OF_RECORDS, Step

    if options.claim is not None:
        _refuse_beside_claim(options)
        claims = all_claims()
        require_known("claim", options.claim, [claim.name for claim in claims])
        _show_claims([claim for claim in claims if claim.name == options.claim], options.json)
        return 0
    from rockframe.stages.named_figures.paper import CLAIMS, FOLDER, PAGE, read_claims

    folder: Path = options.output
    outputs = (CLAIMS, PAGE, FOLDER)
    last = Step("paper", "paper", OF_RECORDS, outputs, {"grid": options.grid})
    rejections = _computed(options, _study(options, "paper"), [last])
    claims = read_claims(folder)
    if options.json:
        console.show_json({"claims": [_plain(claim) for claim in claims], "output": str(folder)})
    else:
        _show_claims(claims, False)
        print(f"{folder / PAGE}")
    return console.show_rejections(rejections)


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
