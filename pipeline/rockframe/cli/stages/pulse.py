"""rockframe pulse: find the acceleration pulse (a_p, T_p) of each record."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, file_to_write, path
from rockframe.errors import InputError, ParameterError
from rockframe.options.model import ExecutionOptions
from rockframe.options.pulse import PulseOptions

if TYPE_CHECKING:
    from rockframe.cells import Column
    from rockframe.record import Record
    from rockframe.results.schema.arrays import Arrays


def add_pulse(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records and the file to write."""
    parser.add_argument(
        "records", type=path, help="output of `rockframe ingest`; with --paper also record files"
    )
    parser.add_argument("--output", "-o", type=file_to_write(".nc"), help="netCDF file to write")
    parser.add_argument(
        "--paper",
        action="store_true",
        help="compare a_p and T_p of the paper's Table 1 with those of every wavelet and "
        "weighting, for records with the paper's names",
    )
    add_options(parser, PulseOptions)
    arguments.add_format(parser, default=None)
    arguments.add_batch(parser)
    add_options(parser, ExecutionOptions)


def run_pulse(options: argparse.Namespace) -> int:
    """Run the stage and print the pulses, or the comparison with the paper."""
    if options.paper:
        return show_paper(options)
    if options.output is None:
        raise ParameterError("--output is missing. Name the netCDF file to write.")
    return _find(options)


def _find(options: argparse.Namespace) -> int:
    from rockframe.results.pulses import pulse_rows
    from rockframe.stages.pulse import pulse_stage

    arguments.refuse_tables(options, {"pulses": ("record_id",)}, "pulses")
    written: list[Arrays] = []
    with console.progress_bar("matching pulses") as progress:
        rejections = pulse_stage(
            options.records,
            options.output,
            chosen(options, PulseOptions),
            batch=arguments.chosen_batch(options),
            engine=arguments.chosen_engine(options),
            progress=progress,
            written=written.append,
        )
    rows = pulse_rows(written[0])
    flat = [{key: cell for key, cell in row.items() if key != "runners_up"} for row in rows]
    tables = arguments.write_tables(options, {"pulses": flat}, "pulses")
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        said = {"pulses": rows, "rejected": rejected, "output": str(options.output)}
        console.show_json(said | ({"tables": tables} if tables else {}))
    else:
        _show(rows, str(options.output))
        print(*tables, sep="\n", end="\n" if tables else "")
    return console.show_rejections(rejections)


#: Least width for all columns of the table [characters].
_WIDE: Final = 137


def _show(rows: Sequence[Mapping[str, Any]], output: str) -> None:
    wide = console.table_width() >= _WIDE
    lines: list[Mapping[str, Any]] = []
    for row in rows:
        if not wide and (not lines or lines[-1]["record_id"] != row["record_id"]):
            lines.append({"record_id": row["record_id"], "way": row["record_id"]})
        lines.append({**row, "way": f"{'→ ' if row['best'] else '  '}{row['wavelet']}"})
        further = {"record_id": row["record_id"], "way": "  then, in what is left"}
        lines += [{**up, **further} for up in row["runners_up"]]
    columns = _columns() if wide else [column for column in _columns() if not column.minor]
    console.show_rows(f"Pulses in {output}", columns, lines, group="record_id")
    _explain(rows, output, wide=wide)


def _columns() -> list[Column]:
    """Return the columns; narrow tables contain only the main columns."""
    words = {"pulse": "pulse", "noise": "as noise", "untested": ""}

    def verdict(row: Mapping[str, Any], key: str) -> str:
        word = str(row.get(key, "untested"))
        return words.get(word, word.replace("_", " "))

    return [
        console.column("record", "record_id", once=True, priority=3),
        console.column("wavelet", "way"),
        console.column("a_p\n[g]>", "a_p_g", ".3f"),
        console.column("T_p\n[s]>", "T_p_s", ".3f", mark=("at_period_bound", "*")),
        console.column("at\n[s]>", "pulse_time_s", ".2f", mark=("cut", " cut")),
        console.column("phase\n>", "phase_rad", ".2f", priority=3),
        console.column(
            "half\ncycles>", "half_cycles", ".2f", mark=("at_half_cycle_bound", "*"), priority=3
        ),
        console.column("L_p\n[m]>", "L_p_m", ".2f"),
        console.column("match\n>", "match_index", ".3f"),
        console.column("energy\n>", "energy_share", ".2f", priority=3),
        console.column("p\n>", "p_value", ".2f"),
        console.column("", "pulse_verdict", rule=verdict),
        console.column("Baker\n>", "velocity_indicator", ".2f", once=True, priority=3),
    ]


#: Value of Baker's indicator above which a velocity is a pulse [1]; records named in a note.
_BAKER: Final = 0.85
_NAMED: Final = 5


def _disagrees(row: Mapping[str, Any]) -> bool:
    """Return True if Baker's indicator says otherwise than the test against noise.

    Examples
    --------
    >>> _disagrees({"velocity_indicator": 0.93, "pulse_verdict": "noise"})
    True
    >>> _disagrees({"velocity_indicator": 0.93, "pulse_verdict": "untested"})
    False
    """
    is_pulse = {"pulse": True, "noise": False}.get(row["pulse_verdict"])
    indicator = float(row["velocity_indicator"])
    return (
        is_pulse is not None and not math.isnan(indicator) and (indicator > _BAKER) is not is_pulse
    )


def _explain(rows: Sequence[Mapping[str, Any]], output: str, *, wide: bool) -> None:
    print("→ the selected pulse. p: share of similar noise that matches as well.")
    if wide:
        print("energy: share of the record's energy.")
        print(
            "Baker: pulse indicator of the velocity after Baker (2007); a pulse if above "
            f"{_BAKER:g}."
        )
    else:
        left_out = "Phases, half cycles, energies and Baker's indicator"
        print(f"{left_out}: in {output}, or {_WIDE} columns wide.")
    apart = [row["record_id"] for row in rows if row["best"] and _disagrees(row)]
    if apart:
        more = f" and {len(apart) - _NAMED} more" if len(apart) > _NAMED else ""
        print(
            f"Baker's indicator and the test against noise disagree for "
            f"{', '.join(apart[:_NAMED])}{more}.\nThe indicator judges the shape of the velocity "
            "alone; the test asks whether noise with the record's\nspectrum and envelope matches a "
            "wavelet of acceleration as well. What counts for a structure is how\nwell the pulse "
            "alone predicts its response: `rockframe respond --pulses`."
        )
    if any(row["at_period_bound"] or row["at_half_cycle_bound"] for row in rows):
        print("* at the end of the searched range, not at a maximum")


def show_paper(options: argparse.Namespace) -> int:
    """Match the paper's records with every wavelet and weighting, and print the comparison."""
    from rockframe.matching.signal import Weighting
    from rockframe.paper.pulses import overall_distances, paper_pulses

    records, status = _records(options)
    pulses = paper_pulses(records, list(Weighting))
    if not pulses:
        raise InputError(
            options.records,
            "contains no record named as in the paper. Include at least one.",
        )
    if options.json:
        console.show_json({"pulses": pulses, "overall": overall_distances(pulses)})
    else:
        _show_paper(pulses)
    return status


def _records(options: argparse.Namespace) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the records with their usable options, and the exit status."""
    from rockframe.results.records import open_records
    from rockframe.stages.common import horizontal
    from rockframe.stages.pulse import usable

    wanted = chosen(options, PulseOptions)
    reading = arguments.records_file([options.records])
    with reading as (path, status), open_records(path) as file:
        return [(file.read(name), usable(name, file, wanted)) for name in horizontal(file)], status


def _show_paper(pulses: Sequence[Mapping[str, Any]]) -> None:
    """Print a table for each weighting, and the overall distance of each wavelet and weighting."""
    from rockframe.paper.pulses import overall_distances

    def over(ours: str, printed: str) -> Callable[[Mapping[str, Any], str], str]:
        return lambda row, _: f"{100.0 * (row[ours] / row[printed] - 1.0):+.1f} %"

    least: dict[tuple[str, str], float] = {}
    for pulse in pulses:
        of = (pulse["record"], pulse["weighting"])
        least[of] = min(pulse["distance"], least.get(of, math.inf))

    def way(row: Mapping[str, Any], _key: str) -> str:
        nearest = row["distance"] == least[row["record"], row["weighting"]]
        return f"{'→ ' if nearest else '  '}{row['wavelet']}"

    columns = [
        console.column("record", "record", once=True),
        console.column("paper\na_p [g]>", "printed_a_p_g", ".2f", once=True),
        console.column("\nT_p [s]>", "printed_period_s", ".2f", once=True),
        console.column("wavelet", rule=way),
        console.column("ours\na_p [g]>", "a_p_g", ".3f"),
        console.column("\nT_p [s]>", "T_p_s", ".3f", mark=("at_period_bound", "*")),
        console.column("a_p\n>", rule=over("a_p_g", "printed_a_p_g")),
        console.column("T_p\n>", rule=over("T_p_s", "printed_period_s")),
        console.column("distance\n>", "distance", ".3f"),
    ]
    for weighting in dict.fromkeys(pulse["weighting"] for pulse in pulses):
        own = [row for row in pulses if row["weighting"] == weighting]
        console.show_rows(
            f"Weighting {weighting}: the paper's pulses and ours", columns, own, group="record"
        )
    ways = [console.column(name, name) for name in ("wavelet", "weighting")]
    ways.append(console.column("distance>", "distance", ".3f"))
    console.show_rows("Over all records, smallest distance first", ways, overall_distances(pulses))
    print("distance: root mean square of ln(ours / paper) of a_p and T_p. The paper states neither")
    print("wavelet nor weighting nor range of periods for its records; nothing is tuned.")
    if any(pulse["at_period_bound"] for pulse in pulses):
        print("* at the end of the searched range of periods, not at a maximum")
