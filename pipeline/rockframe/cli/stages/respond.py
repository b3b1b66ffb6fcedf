"""rockframe respond: responses to records."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from heapq import nsmallest
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import (
    add_options,
    chosen,
    folder_to_write,
    numbers,
    path,
)
from rockframe.errors import ParameterError, require_known
from rockframe.options.model import ExecutionOptions
from rockframe.options.respond import (
    Ensemble,
    RespondOptions,
    ScreenOptions,
)

if TYPE_CHECKING:
    from rockframe.cells import Column
    from rockframe.outcome import InputOutcome
    from rockframe.results.schema.arrays import Arrays
    from rockframe.results.tables.rows import Row


def add_respond(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records, structures, and the file to write."""
    parser.add_argument("records", type=path, help="output of `rockframe ingest`")
    arguments.add_output(parser)
    arguments.add_structures(parser, one=False)
    add_options(parser, RespondOptions)
    parser.add_argument(
        "--sensitivity",
        action="store_true",
        help="print which spread of the ensemble matters most for each record and structure",
    )
    parser.add_argument(
        "--scales",
        type=numbers,
        nargs="+",
        metavar="SCALE",
        help="also respond to the motion times these factors, such as 0.95:1.05:21, and print how "
        "peaks and the share that overturns change with the amplitude",
    )
    parser.add_argument(
        "--record",
        action="append",
        metavar="ID",
        help="only this record with --scales; may be repeated (default: all)",
    )
    parser.add_argument(
        "--figures",
        type=folder_to_write,
        metavar="FOLDER",
        help="folder for figures of each record: of the forces with --forces, and of the change "
        "with amplitude with --scales",
    )
    parser.add_argument(
        "--pulses",
        type=path,
        metavar="FILE",
        help="output of `rockframe pulse` for these records: adds the response to the pulse alone",
    )
    arguments.add_format(parser, default=None)
    arguments.add_matrix(parser)
    arguments.add_batch(parser)
    add_options(parser, ExecutionOptions)


def run_respond(options: argparse.Namespace) -> int:
    """Run the stage and print the verdicts."""
    from rockframe.results.pulses import peaks_of, recordings_of
    from rockframe.results.tables.notes import left_out_reasons, with_directions
    from rockframe.results.tables.sentences import answers
    from rockframe.results.tables.summary import summary_rows, tables_of
    from rockframe.results.tables.table import response_rows

    wanted = chosen(options, RespondOptions)
    _refuse_tables(options)
    if options.sensitivity:
        _require_spreads(wanted.ensemble)
    scales = _stated_scales(options, wanted)
    response, rejections = _respond(options, wanted)
    scaled, more = _respond_at_scales(options, wanted, scales) if scales else ([], ())
    rejections += tuple(rejection for rejection in more if rejection not in rejections)
    peaks = peaks_of(options.records)
    rows = [row | {"pga_g": _largest(peaks, row)} for row in response_rows(response)]
    left_out = left_out_reasons(response.attrs)
    summary = summary_rows(rows, recordings_of(options.records), left_out)
    summary = with_directions(summary, response.attrs)
    tables = {
        **tables_of(rows, summary, _RESPONSES[0]),
        **(_force_tables(response, rows) if wanted.forces else {}),
        **({"scales": scaled} if scaled else {}),
    }
    written = arguments.write_tables(options, tables, _RESPONSES[0])
    drawn = _draw(response, scaled, options.figures) if options.figures else []
    said: dict[str, Any] = {
        "responses": rows,
        "rejected": [vars(rejection) for rejection in rejections],
        "output": str(options.output),
        "summary": summary,
        "answers": answers(rows, wanted.ensemble.members),
    }
    if options.json:
        said |= _further(options, response, written) | ({"scales": scaled} if scales else {})
        console.show_json(said | matrices(rows, options.matrix))
    else:
        _show(options, wanted, response, said, scaled, written)
        print(*written, *drawn, sep="\n", end="\n" if written or drawn else "")
    return console.show_rejections(rejections)


def _refuse_tables(options: argparse.Namespace) -> None:
    """Refuse to replace files that have the names of the tables but other contents."""
    from rockframe.results.tables.summary import first_columns

    pairs = {
        "envelope": ("structure", "force"),
        "forces": ("record_id", "structure"),
        "scales": ("record_id", "structure"),
    }
    arguments.refuse_tables(options, first_columns(*_RESPONSES) | pairs, _RESPONSES[0])


def _further(
    options: argparse.Namespace, response: Arrays, written: Sequence[str]
) -> dict[str, Any]:
    """Return what is in the JSON only if it was asked for, or if there is any."""
    from rockframe.results.tables.sensitivity import sensitivity_rows
    from rockframe.results.tables.table import part_rows

    parts = part_rows(response)
    return {
        **({"motions": parts} if parts else {}),
        **({"sensitivity": list(sensitivity_rows(response))} if options.sensitivity else {}),
        **({"tables": written} if written else {}),
    }


def _show(
    options: argparse.Namespace,
    wanted: RespondOptions,
    response: Arrays,
    said: Mapping[str, Any],
    scaled: list[Row],
    written: Sequence[str],
) -> None:
    """Print the verdicts, and what was asked for beside them."""
    from rockframe.results.tables.table import part_rows

    rows, summary, output = said["responses"], said["summary"], str(options.output)
    console.show_first(summary)
    _show_answer(said["answers"])
    _show_responses(options, rows, summary, written)
    _show_parts(part_rows(response))
    if wanted.forces:
        _show_forces(response, rows, output, wanted)
    if options.sensitivity:
        _show_sensitivity(response, output)
    _show_scales(scaled)


def _show_answer(said_of_each: Mapping[str, str]) -> None:
    """Print the answer in a sentence, if there is one structure."""
    if len(said_of_each) == 1:
        ((name, sentence),) = said_of_each.items()
        print(f"{console.filled(f'{name} {sentence}.')}\n")


def _largest(peaks: Mapping[str, float], row: Row) -> float:
    """Return the peak acceleration [g] of a motion, or the larger one of its components."""
    return max(peaks[name] for name in row["components"].split() or [row["record_id"]])


def _respond(
    options: argparse.Namespace, wanted: RespondOptions
) -> tuple[Arrays, tuple[InputOutcome, ...]]:
    """Run the stage; return what it wrote, and the rejected records."""
    from rockframe.stages.respond import respond_stage

    written: list[Arrays] = []
    with console.progress_bar("rocking") as progress:
        rejections = respond_stage(
            options.records,
            options.output,
            wanted,
            structures_path=arguments.chosen_structures(options),
            pulses_path=options.pulses,
            batch=arguments.chosen_batch(options),
            engine=arguments.chosen_engine(options),
            progress=progress,
            written=written.append,
        )
    return written[0], rejections


def _show_responses(
    options: argparse.Namespace,
    rows: Sequence[Row],
    summary: Sequence[Row],
    tables: Sequence[str],
) -> None:
    """Print the responses, a line for each structure, and the meaning of the columns."""
    from rockframe.results.tables.rows import response_columns

    columns = response_columns(rows[0] if rows else {}, {"record_id": "Record"})
    if options.pulses:
        columns.append(console.column("Pulse alone", rule=pulse_cell))
    output: Path = options.output
    table = next((table for table in tables if Path(table).stem == output.stem), "")
    further = f" and {table}" if table else "; --format csv or xlsx writes a table"
    show_responses(f" in {output}", columns, rows, options.matrix, f"{output}{further}")
    console.show_summary(summary)
    print(verdict_notes(rows[0] if rows else {}))


def _show_parts(parts: Sequence[Row]) -> None:
    """Print a row for each motion of the sequences."""
    from rockframe.results.tables.table import part_columns

    if parts:
        console.show_rows("Motions of the sequences", part_columns(parts), parts)


#: Kind of the main table, and its first columns.
_RESPONSES: Final = ("responses", "record_id", "structure")
#: Largest number of responses that are printed one by one, and number that is printed of more.
MOST_RESPONSES, _WORST = 40, 10


def show_responses(
    where: str,
    columns: Sequence[Column],
    rows: Sequence[Row],
    quantities: Sequence[str] = (),
    all_in: str = "",
    **how: Any,
) -> None:
    """Print a row for each response, or of many the most severe; or the matrices asked for.

    `all_in` says where the other responses are, and `how` are keywords of `show_rows`.
    """
    from rockframe.results.tables.summary import MATRICES, matrix_columns

    for quantity, matrix in matrices(rows, quantities).get("matrices", {}).items():
        title = f"Responses{where}: {MATRICES[quantity].words}"
        console.show_rows(title, matrix_columns(matrix, quantity), matrix)
    if not quantities:
        rows = without_lacking_pairs(rows)
        shown = most_severe(rows)
        if len(shown) == len(rows):
            console.show_rows(f"Responses{where}", columns, shown, **how)
        else:
            title = f"The {len(shown)} most severe of {len(rows)} responses{where}"
            console.show_rows(title, columns, shown)
            print(f"All {len(rows)} are in {all_in}.\n")


def without_lacking_pairs(rows: Sequence[Row]) -> Sequence[Row]:
    """Return the rows without those in both directions that are not computed, whose structures the
    notes on the summary name.
    """
    from rockframe.results.tables.rows import is_computed

    return [row for row in rows if is_computed(row) or not row.get("components")]


def most_severe(rows: Sequence[Row]) -> Sequence[Row]:
    """Return the rows to print one by one: all of them, or the most severe of many."""
    from rockframe.results.tables.outcomes import severity

    return rows if len(rows) <= MOST_RESPONSES else nsmallest(_WORST, rows, key=severity)


def matrices(rows: Sequence[Row], quantities: Sequence[str]) -> dict[str, dict[str, list[Row]]]:
    """Return the key ``matrices`` of JSON: records by structures in each quantity, if asked for."""
    from rockframe.results.tables.summary import matrix_rows

    by_quantity = {quantity: matrix_rows(rows, quantity) for quantity in quantities}
    return {"matrices": by_quantity} if by_quantity else {}


def _require_spreads(ensemble: Ensemble) -> None:
    from rockframe.rocking import spreads_of

    if not (ensemble.members and spreads_of(ensemble)):
        lack = "all its spreads are switched off" if ensemble.members else "--ensemble-members is 0"
        raise ParameterError(f"--sensitivity without an ensemble: {lack}. State another one.")


def _force_tables(response: Arrays, responses: Sequence[Row]) -> dict[str, Sequence[Row]]:
    """Return the tables of the forces, and of their envelope over the motions that count."""
    from rockframe.results.tables.envelope import force_envelope, of_motions_that_count
    from rockframe.results.tables.forces import force_rows

    rows = list(force_rows(response))
    return {"forces": rows, "envelope": force_envelope(of_motions_that_count(rows, responses))}


def _show_forces(
    response: Arrays, responses: Sequence[Row], output: str, wanted: RespondOptions
) -> None:
    """Print the forces at the joints, and their meaning."""
    from rockframe.results.tables.envelope import (
        ENVELOPE_LEGEND,
        envelope_columns,
        force_envelope,
        of_motions_that_count,
    )
    from rockframe.results.tables.forces import (
        NO_VERTICAL,
        force_columns,
        force_rows,
        forces_in_words,
    )

    rows = list(force_rows(response))
    if rows:
        each = ({**row, "pair": (row["record_id"], row["structure"])} for row in rows)
        console.show_rows(f"Forces in {output}", force_columns(rows), each, group="pair")
        said = forces_in_words(rows)
        print(console.filled(said if wanted.vertical else f"{said} {NO_VERTICAL}"))
        if len({row["record_id"] for row in rows}) > 1:
            counted = of_motions_that_count(rows, responses)
            title = "\nEnvelope of the forces over all records"
            console.show_rows(title, envelope_columns(), force_envelope(counted))
            in_both = " Of round columns only motions in both directions count."
            print(console.filled(ENVELOPE_LEGEND + in_both * (len(counted) < len(rows))))


def _stated_scales(options: argparse.Namespace, wanted: RespondOptions) -> tuple[float, ...]:
    """Return the scales of the command line; none if they are not stated.

    Raises
    ------
    ParameterError
        If a scale is invalid, a record unknown, or an option stated without what it needs.
    """
    from rockframe.results.records import open_records
    from rockframe.stages.common import horizontal

    if options.record and not options.scales:
        raise ParameterError(
            "--record has no effect without --scales. State scales, such as 0.95:1.05:21."
        )
    if options.figures and not (wanted.forces or options.scales):
        raise ParameterError(
            "--figures has no effect without --forces or --scales: there is nothing to draw. "
            "State one of them."
        )
    if not options.scales:
        return ()
    with open_records(options.records) as file:
        for name in options.record or ():
            require_known("record", name, horizontal(file))
    return chosen(argparse.Namespace(scales=options.scales), ScreenOptions).scales


def _respond_at_scales(
    options: argparse.Namespace, wanted: RespondOptions, scales: Sequence[float]
) -> tuple[list[Row], tuple[InputOutcome, ...]]:
    """Respond to each record, or to those stated, at several scales."""
    from rockframe.stages.respond import scaled_rows

    with console.progress_bar("scaling") as progress:
        return scaled_rows(
            options.records,
            scales,
            wanted,
            structures_path=arguments.chosen_structures(options),
            records=options.record or (),
            progress=progress,
        )


#: Largest number of scales that are printed for a structure.
_MOST_SCALES: Final = 21


def _show_scales(rows: Sequence[Row]) -> None:
    """Print the change with amplitude, at the scales nearest to 1."""
    from rockframe.results.tables.rows import response_columns

    if not rows:
        return
    scales = sorted({row["scale"] for row in rows})
    near = {scales[place] for place in console.nearest_to_one(scales, _MOST_SCALES)}
    columns = [
        console.column("record", "record_id", once=True),
        console.column("structure", "structure", once=True, priority=0),
        console.column("scale>", "scale", ".4g", priority=0),
        *response_columns(rows[0], {})[1:],
    ]
    each = (
        {**row, "pair": (row["record_id"], row["structure"])}
        for row in rows
        if row["scale"] in near
    )
    console.show_rows("Change with the amplitude of the motion", columns, each, group="pair")
    if len(near) < len(scales):
        many = f"The {len(near)} of {len(scales)} scales that are nearest to 1"
        print(f"{many}; --json and --figures have all.\n")


def _draw(response: Arrays, scaled: Sequence[Row], folder: Path) -> list[Path]:
    """Draw the forces and the change with amplitude of each record; return the files."""
    from rockframe.figures.captioned import save_captioned
    from rockframe.figures.joints import draw_forces
    from rockframe.figures.margins import draw_scales
    from rockframe.results.tables.forces import force_rows

    drawn = []
    figures = (("forces", force_rows(response), draw_forces), ("scales", scaled, draw_scales))
    for kind, every, draw in figures:
        for record, rows in groupby(every, lambda row: str(row["record_id"])):
            drawn.append(folder / kind / f"{record}.png")
            save_captioned(draw(list(rows), record), drawn[-1])
    return drawn


def _show_sensitivity(response: Arrays, output: str) -> None:
    """Print the rank correlations of the spreads, and their meaning."""
    from rockframe.results.tables.sensitivity import (
        SENSITIVITY_LEGEND,
        sensitivity_columns,
        sensitivity_rows,
    )

    rows = list(sensitivity_rows(response))
    if rows:
        columns = sensitivity_columns(rows[0])
        console.show_rows(f"Sensitivity in {output}", columns, rows, group="record_id")
        said = SENSITIVITY_LEGEND.format(chance=rows[0]["by_chance"])
        print(console.filled(said))


def pulse_cell(row: Mapping[str, Any], _key: str = "") -> str:
    """Return the nominal response to the pulse alone: theta/alpha and its error, or the verdict.

    Examples
    --------
    >>> pulse_cell({"verdict_to_pulse": "stands", "peak_rotation_ratio_to_pulse": 0.3,
    ...     "surrogate_error": -0.25})
    'θ/α 0.300, -25 %'
    """
    words = str(row["verdict_to_pulse"]).replace("_", " ")
    if words != "stands":
        return words
    ratio, error = row["peak_rotation_ratio_to_pulse"], row["surrogate_error"]
    parts = [] if math.isnan(ratio) else [f"θ/α {ratio:.3f}"]
    parts += [] if math.isnan(error) else [f"{100.0 * error:+.0f} %"]
    return ", ".join(parts)


#: Explanation of the columns of the ensemble.
SPREAD_LEGEND: Final = (
    "Overturn (90 %): share of the ensemble that overturns, with its 90 % interval. 16 50 84 %: "
    "quantiles of the peaks of the ensemble."
)


def verdict_notes(row: Mapping[str, Any]) -> str:
    """Return the rule of verdicts and the meaning of the columns that `row` has, wrapped."""
    from rockframe.rocking import MARGIN_LEGEND, VERDICT_RULE

    said = VERDICT_RULE
    if math.isfinite(row.get("share_overturned", math.nan)):
        said += f" {SPREAD_LEGEND}"
    if math.isfinite(row.get("largest_robust_scale", math.nan)):
        said += f" {MARGIN_LEGEND}"
    return console.filled(said)
