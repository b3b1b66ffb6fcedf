"""rockframe spectrum: overturning spectra of pulses, and rocking spectra of records."""

from __future__ import annotations

import argparse
import math
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, flag, path
from rockframe.errors import ParameterError
from rockframe.options.model import ExecutionOptions
from rockframe.options.respond import RockingSpectrumOptions, SpectrumOptions

if TYPE_CHECKING:
    import xarray as xr


def add_spectrum(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: a pulse or records, frames, and the file to write."""
    arguments.add_output(parser)
    parser.add_argument(
        "--records",
        type=path,
        metavar="FILE",
        help="output of `rockframe ingest`: compute rocking spectra of these records, the peaks "
        "against the column period 2 pi / p (default: overturning spectra of pulses)",
    )
    arguments.add_format(parser, default=None)
    add_options(parser, SpectrumOptions, required=False)
    add_options(parser, RockingSpectrumOptions, title="with --records", required=False)
    add_options(parser, ExecutionOptions)


def run_spectrum(options: argparse.Namespace) -> None:
    """Run the stage and print the spectrum."""
    other = SpectrumOptions if options.records else RockingSpectrumOptions
    own = RockingSpectrumOptions if options.records else SpectrumOptions
    for name in other.model_fields:
        if name not in own.model_fields and hasattr(options, name):
            where = "with" if options.records else "without"
            raise ParameterError(f"{flag(name)} stated {where} --records. Must not be.")
    first = "record_id" if options.records else "wavelet"
    arguments.refuse_tables(options, {"spectrum": (first,)}, "spectrum")
    (_spectrum_of_records if options.records else _spectrum_of_pulses)(options)


def _spectrum_of_pulses(options: argparse.Namespace) -> None:
    from rockframe.stages.spectrum import spectrum_stage

    wanted, engine = chosen(options, SpectrumOptions), arguments.chosen_engine(options)
    written: list[xr.Dataset] = []
    spectrum_stage(options.output, wanted, engine=engine, written=written.append)
    (dataset,) = written
    lines = _curves(dataset)
    flat = [{key: cell for key, cell in line.items() if key != "intervals"} for line in lines]
    tables = arguments.write_tables(options, {"spectrum": flat}, "spectrum")
    if options.json:
        said = {"spectrum": lines, "output": str(options.output)}
        console.show_json(said | ({"tables": tables} if tables else {}))
        return
    ratios = [f"{ratio:g}" for ratio in dataset["frequency_ratio"].values]
    beyond = f"> {float(dataset['amplitude'][-1]):g}"
    for i, line in enumerate(lines):
        least = line["minimum_overturning_amplitude"]
        curve = lines[i - i % len(ratios)]
        curve[ratios[i % len(ratios)]] = beyond if math.isnan(least) else least
    columns = [
        console.column("wavelet", "wavelet", rule=lambda row, key: row[key].replace("_", " ")),
        console.column("α [deg]>", "slenderness_deg", ".4g"),
        console.column("γ>", "mass_ratio", "g"),
        *(
            console.column(f"{ratio}>", ratio, ".4f", rule=lambda row, key: row[key])
            for ratio in ratios
        ),
    ]
    console.show_rows("Least overturning a_p/(g tan α) over ω_p/p", columns, lines[:: len(ratios)])
    islands = int((dataset["safe_islands"] > 0).sum())
    points = f"{islands} of these {dataset['safe_islands'].size} points"
    print(f"Above {points} are islands in which the frame stands.")
    print(options.output, *tables, sep="\n")


def _curves(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return all curves as JSON values; each point has its intervals."""
    from rockframe.results.tables.rows import columns_of, rows_along

    columns = columns_of(
        "wavelet slenderness_deg=slenderness mass_ratio frequency_ratio",
        "minimum_overturning_amplitude intervals=overturning_intervals safe_islands",
    )
    along = "wavelet slenderness mass_ratio frequency_ratio"
    parts = columns_of("lower=interval_lower upper=interval_upper impacts=interval_impacts")
    intervals = rows_along(dataset, f"{along} interval", parts)
    rows = list(rows_along(dataset, along, columns))
    for row in rows:
        each = list(islice(intervals, dataset.sizes["interval"]))
        row["intervals"] = each[: row["intervals"]]
    return rows


def _spectrum_of_records(options: argparse.Namespace) -> None:
    from rockframe.stages.spectrum import rocking_spectrum_stage

    output: Path = options.output
    wanted, engine = chosen(options, RockingSpectrumOptions), arguments.chosen_engine(options)
    written: list[xr.Dataset] = []
    rocking_spectrum_stage(options.records, output, wanted, engine=engine, written=written.append)
    rows = _periods_without_overturning(written[0])
    tables = arguments.write_tables(options, {"spectrum": rows}, "spectrum")
    if options.json:
        said = {"spectra": rows, "output": str(output)}
        console.show_json(said | ({"tables": tables} if tables else {}))
        return
    columns = [
        console.column("record", "record_id"),
        console.column("α [deg]>", "slenderness_deg", ".4g"),
        console.column("γ>", "mass_ratio", "g"),
        console.column("stands from [s]>", "stands_from_s", "g"),
        console.column("largest θ/α from there>", "peak_rotation_ratio", ".3f"),
    ]
    console.show_rows(
        "Rocking spectra: 2π/p above which the frame does not overturn", columns, rows
    )
    print(output, *tables, sep="\n")


def _periods_without_overturning(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return, for each record and frame, the smallest 2 pi / p above which it never overturns."""
    import numpy as np

    from rockframe.results.tables.rows import columns_of, rows_along
    from rockframe.rocking import Verdict

    periods, dims = dataset["column_period"].values, ("record", "slenderness", "mass_ratio")
    after = np.arange(periods.size)
    fallen = dataset["verdict"].values == Verdict.OVERTURNS
    first = np.max(np.where(fallen, after + 1, 0), axis=-1)
    peaks = np.where(after >= first[..., None], dataset["peak_rotation_ratio"].values, -np.inf)
    peaks = np.where(first < periods.size, peaks.max(axis=-1), np.nan)
    standing = dataset.assign(
        stands_from=(dims, np.append(periods, np.nan)[first]), largest=(dims, peaks)
    )
    columns = "record_id slenderness_deg=slenderness mass_ratio stands_from_s=stands_from"
    ratio = "peak_rotation_ratio=largest"
    return list(rows_along(standing, " ".join(dims), columns_of(columns, ratio)))
