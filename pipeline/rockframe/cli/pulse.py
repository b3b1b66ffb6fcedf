"""rockframe pulse: find the acceleration pulse (a_p, T_p) of each record."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any, Final

from rockframe.cli.arguments import add_batch, chosen_batch, chosen_engine
from rockframe.cli.options import add_options, chosen, path
from rockframe.cli.outputs import file_to_write
from rockframe.options import ExecutionOptions, PulseOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
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


def run(options: argparse.Namespace) -> int:
    """Run the stage and print the pulses, or the comparison with the paper."""
    from rockframe.errors import ParameterError

    if options.paper:
        from rockframe.cli.pulse_paper import show_paper

        return show_paper(options)
    if options.output is None:
        raise ParameterError("--output is missing. Must name the netCDF file to write.")
    return _find(options)


def _find(options: argparse.Namespace) -> int:
    from rockframe.cli.console import progress_bar, show_json, show_rejections
    from rockframe.results import pulse_rows
    from rockframe.stages import pulse_stage

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
