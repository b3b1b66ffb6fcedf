"""rockframe pulse: find the acceleration pulse (a_p, T_p) of each record."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli.arguments import add_batch, chosen_batch, chosen_engine, records_file
from rockframe.cli.options import add_options, chosen, file_to_write, path
from rockframe.options.execution import ExecutionOptions
from rockframe.options.ingest import IngestOptions
from rockframe.options.pulse import PulseOptions

if TYPE_CHECKING:
    from rockframe.paper.pulse_table import PaperPulse
    from rockframe.record import Record


def add_pulse(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: records and the file to write."""
    parser.add_argument(
        "records", type=path, help="output of `rockframe ingest`; with --paper also record files"
    )
    parser.add_argument("--output", type=file_to_write(".nc"), help="netCDF file to write")
    parser.add_argument(
        "--paper",
        action="store_true",
        help="compare a_p and T_p of the paper's Table 1 with those of every wavelet and "
        "weighting, for records with the paper's names",
    )
    add_options(parser, PulseOptions)
    add_batch(parser)
    add_options(parser, ExecutionOptions)


def run_pulse(options: argparse.Namespace) -> int:
    """Run the stage and print the pulses, or the comparison with the paper."""
    from rockframe.errors import ParameterError

    if options.paper:
        return show_paper(options)
    if options.output is None:
        raise ParameterError("--output is missing. Must name the netCDF file to write.")
    return _find(options)


def _find(options: argparse.Namespace) -> int:
    from rockframe.cli.console import progress_bar, show_json, show_rejections
    from rockframe.results.tables.pulse_rows import pulse_rows
    from rockframe.stages.pulse import pulse_stage

    with progress_bar("matching pulses") as progress:
        rejections = pulse_stage(
            options.records,
            options.output,
            chosen(options, PulseOptions),
            batch=chosen_batch(options),
            engine=chosen_engine(options),
            progress=progress,
        )
    rows = pulse_rows(options.output)
    if options.json:
        rejected = [vars(rejection) for rejection in rejections]
        show_json({"pulses": rows, "rejected": rejected, "output": str(options.output)})
    else:
        _show(rows, str(options.output))
    show_rejections(rejections)
    return 1 if rejections else 0


#: Least width for all columns of the table [characters].
_WIDE: Final = 137
#: Indices of the columns that are shown in narrower tables.
_KEPT: Final = (1, 2, 3, 4, 7, 8, 10, 11)


def _show(rows: Sequence[Mapping[str, Any]], output: str) -> None:
    from rockframe.cli.console import number, show_table, table_width

    wide = table_width() >= _WIDE
    cells: list[list[str]] = []
    for i, row in enumerate(rows):
        first = i == 0 or row["record_id"] != rows[i - 1]["record_id"]
        if first and i:
            cells.append([])
        if first and not wide:
            cells.append(["", str(row["record_id"]), *[""] * 11])
        baker = number(row["velocity_indicator"], 2) if first else ""
        cells.append([str(row["record_id"]) if first else "", *_cells(row), baker])
        cells += [["", *_further(up)] for up in row["runners_up"]]
    names: tuple[str, ...] = (
        *("record", "wavelet", "a_p\n[g]>", "T_p\n[s]>", "at\n[s]>", "phase\n>", "half\ncycles>"),
        *("L_p\n[m]>", "match\n>", "energy\n>", "p\n>", "", "Baker\n>"),
    )
    if not wide:
        names = tuple(names[i] for i in _KEPT)
        cells = [[row[i] for i in _KEPT] if row else [] for row in cells]
    show_table(f"Pulses in {output}", names, cells)
    _explain(rows, output, wide=wide)


def _explain(rows: Sequence[Mapping[str, Any]], output: str, *, wide: bool) -> None:
    print("→ the pulse that is used. p: share of noise like the record that matches as well.")
    if wide:
        print("energy: share of the record's.")
        print("Baker: indicator of the velocity in the style of Baker (2007), a pulse above 0.85.")
    else:
        left_out = "Phases, half cycles, energies and Baker's indicator"
        print(f"{left_out}: in {output}, or {_WIDE} columns wide.")
    if any(row["at_period_bound"] or row["at_half_cycle_bound"] for row in rows):
        print("* the end of the range that is searched, not a maximum")


def _cells(row: Mapping[str, Any]) -> list[str]:
    from rockframe.cli.console import number

    words = str(row["pulse_verdict"]).replace("_", " ")
    return [
        f"{'→ ' if row['best'] else '  '}{row['wavelet']}",
        number(row["a_p_g"], 3),
        number(row["T_p_s"], 3) + ("*" if row["at_period_bound"] else ""),
        number(row["pulse_time_s"], 2) + (" cut" if row["cut"] else ""),
        number(row["phase_rad"], 2),
        number(row["half_cycles"], 2) + ("*" if row["at_half_cycle_bound"] else ""),
        number(row["L_p_m"], 2),
        number(row["match_index"], 3),
        number(row["energy_share"], 2),
        number(row["p_value"], 2),
        {"pulse": "pulse", "noise": "as noise", "untested": ""}.get(words, words),
    ]


def _further(up: Mapping[str, Any]) -> list[str]:
    from rockframe.cli.console import number

    return [
        "  then, in what is left",
        number(up["a_p_g"], 3),
        number(up["T_p_s"], 3),
        number(up["pulse_time_s"], 2),
        number(up["phase_rad"], 2),
        number(up["half_cycles"], 2),
        number(up["L_p_m"], 2),
        "",
        number(up["energy_share"], 2),
        *("", "", ""),
    ]


def show_paper(options: argparse.Namespace) -> int:
    """Match the paper's records in every way and print the comparison."""
    from rockframe.cli.console import show_json
    from rockframe.errors import InputError
    from rockframe.matching.signal import Weighting
    from rockframe.paper.pulse_table import overall_distances, paper_pulses

    records, status = _records(options)
    pulses = paper_pulses(records, list(Weighting))
    if not pulses:
        raise InputError(
            options.records, "holds no record with a name of the paper's. Must hold one."
        )
    if options.json:
        rows = [{**vars(pulse), "distance": pulse.distance} for pulse in pulses]
        ways = [
            {"wavelet": wavelet, "weighting": weighting, "distance": distance}
            for wavelet, weighting, distance in overall_distances(pulses)
        ]
        show_json({"pulses": rows, "overall": ways})
    else:
        _show_paper(pulses)
    return status


def _records(options: argparse.Namespace) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the records with their usable options, and the exit status."""
    from rockframe.results.records import open_records
    from rockframe.stages.common import horizontal
    from rockframe.stages.pulse import usable

    wanted = chosen(options, PulseOptions)
    reading = records_file([options.records], IngestOptions(), None)
    with reading as (path, status), open_records(path) as file:
        return [(file.read(name), usable(name, file, wanted)) for name in horizontal(file)], status


def _show_paper(pulses: Sequence[PaperPulse]) -> None:
    """Print a table for each weighting, and the distance of each way over all records."""
    from rockframe.cli.console import number, show_table
    from rockframe.paper.pulse_table import overall_distances

    for weighting in dict.fromkeys(pulse.weighting for pulse in pulses):
        cells: list[list[str]] = []
        own = [pulse for pulse in pulses if pulse.weighting == weighting]
        for record in dict.fromkeys(pulse.record for pulse in own):
            ways = [pulse for pulse in own if pulse.record == record]
            if cells:
                cells.append([])
            for i, way in enumerate(ways):
                nearest = way.distance == min(one.distance for one in ways)
                cells.append(
                    [
                        record if i == 0 else "",
                        number(way.printed_a_p_g, 2) if i == 0 else "",
                        number(way.printed_period_s, 2) if i == 0 else "",
                        f"{'→ ' if nearest else '  '}{way.wavelet}",
                        number(way.a_p_g, 3),
                        number(way.T_p_s, 3) + ("*" if way.at_period_bound else ""),
                        f"{100.0 * (way.a_p_g / way.printed_a_p_g - 1.0):+.1f} %",
                        f"{100.0 * (way.T_p_s / way.printed_period_s - 1.0):+.1f} %",
                        number(way.distance, 3),
                    ]
                )
        names = (
            *("record", "paper\na_p [g]>", "\nT_p [s]>", "wavelet", "ours\na_p [g]>"),
            *("\nT_p [s]>", "a_p\n>", "T_p\n>", "distance\n>"),
        )
        show_table(f"Weighting {weighting}: the paper's pulses and ours", names, cells)
    show_table(
        "Over all records, the nearest first",
        ("wavelet", "weighting", "distance>"),
        [[w, weighting, number(d, 3)] for w, weighting, d in overall_distances(pulses)],
    )
    print("distance: root mean square of ln(ours / paper) of a_p and T_p. The paper names neither")
    print("wavelet nor weighting nor range of periods for its records; nothing is tuned.")
    if any(pulse.at_period_bound for pulse in pulses):
        print("* the end of the range of periods searched, not a maximum")
