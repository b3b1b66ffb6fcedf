"""rockframe spectrum: compute overturning spectra of pulses, or rocking spectra of records."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rockframe.cli.arguments import chosen_engine
from rockframe.cli.options import add_options, chosen, file_to_write, flag, path
from rockframe.errors import ParameterError
from rockframe.options.execution import ExecutionOptions
from rockframe.options.spectrum import RockingSpectrumOptions, SpectrumOptions

if TYPE_CHECKING:
    import xarray as xr


def add_spectrum(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: a pulse or records, frames, and the file to write."""
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    parser.add_argument(
        "--records",
        type=path,
        metavar="FILE",
        help="output of `rockframe ingest`: compute rocking spectra of these records, the peaks "
        "against the column period 2 pi / p (default: overturning spectra of pulses)",
    )
    add_options(parser, SpectrumOptions, required=False)
    add_options(parser, RockingSpectrumOptions, title="with --records", required=False)
    add_options(parser, ExecutionOptions)


def run_spectrum(options: argparse.Namespace) -> int:
    """Run the stage and print the spectrum."""
    other = SpectrumOptions if options.records else RockingSpectrumOptions
    own = RockingSpectrumOptions if options.records else SpectrumOptions
    for name in other.model_fields:
        if name not in own.model_fields and hasattr(options, name):
            where = "with" if options.records else "without"
            raise ParameterError(f"{flag(name)} stated {where} --records. Must not be.")
    return _of_records(options) if options.records else _of_pulses(options)


def _of_pulses(options: argparse.Namespace) -> int:
    from rockframe.cli.console import show_json, show_table
    from rockframe.results.spectra import read_spectrum
    from rockframe.stages.spectrum import spectrum_stage

    stated = chosen(options, SpectrumOptions)
    spectrum_stage(options.output, stated, engine=chosen_engine(options))
    dataset = read_spectrum(options.output)
    if options.json:
        show_json({"spectrum": _lines(dataset), "output": str(options.output)})
        return 0
    ratios = [f"{ratio:g}>" for ratio in dataset["frequency_ratio"].values]
    show_table(
        "Least overturning a_p/(g tan α) over ω_p/p",
        ["wavelet", "α [deg]>", "γ>", *ratios],
        _cells(dataset),
    )
    islands = int((dataset["safe_islands"] > 0).sum())
    print(f"Islands of safety above {islands} of these {dataset['safe_islands'].size}.")
    print(options.output)
    return 0


def _cells(dataset: xr.Dataset) -> list[list[str]]:
    """Return a row for each wavelet, slenderness and mass ratio."""
    beyond = f"> {float(dataset['amplitude'][-1]):g}"
    least = dataset["minimum_overturning_amplitude"]
    rows = least.stack(row=("wavelet", "slenderness", "mass_ratio")).transpose("row", ...)
    return [
        [
            str(row["wavelet"].item()).replace("_", " "),
            f"{math.degrees(float(row['slenderness'])):.4g}",
            f"{float(row['mass_ratio']):g}",
            *(beyond if math.isnan(value) else f"{value:.4f}" for value in row.values),
        ]
        for row in rows
    ]


def _lines(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return all curves as JSON values, each point with its intervals."""
    dims = ("wavelet", "slenderness", "mass_ratio", "frequency_ratio")
    lines = dataset.drop_dims("amplitude").stack(line=dims)
    rows = []
    for i in range(lines.sizes["line"]):
        line = lines.isel(line=i)
        known = int(line["overturning_intervals"])
        rows.append(
            {
                "wavelet": str(line["wavelet"].item()),
                "slenderness_deg": math.degrees(float(line["slenderness"])),
                "mass_ratio": float(line["mass_ratio"]),
                "frequency_ratio": float(line["frequency_ratio"]),
                "minimum_overturning_amplitude": float(line["minimum_overturning_amplitude"]),
                "intervals": [
                    {
                        "lower": float(line["interval_lower"][k]),
                        "upper": float(line["interval_upper"][k]),
                        "impacts": int(line["interval_impacts"][k]),
                    }
                    for k in range(known)
                ],
                "safe_islands": int(line["safe_islands"]),
            }
        )
    return rows


def _of_records(options: argparse.Namespace) -> int:
    from rockframe.cli.console import show_json, show_table
    from rockframe.results.spectra import read_rocking_spectrum
    from rockframe.stages.spectrum import rocking_spectrum_stage

    output: Path = options.output
    stated = chosen(options, RockingSpectrumOptions)
    rocking_spectrum_stage(options.records, output, stated, engine=chosen_engine(options))
    rows = _safe_from(read_rocking_spectrum(output))
    if options.json:
        show_json({"spectra": rows, "output": str(output)})
        return 0
    show_table(
        "Rocking spectra: from which 2π/p on the frame stands",
        ["record", "α [deg]>", "γ>", "stands from [s]>", "largest θ/α from there>"],
        [
            [
                row["record_id"],
                f"{row['slenderness_deg']:.4g}",
                f"{row['mass_ratio']:g}",
                "–" if row["stands_from_s"] is None else f"{row['stands_from_s']:g}",
                "–" if row["stands_from_s"] is None else f"{row['peak_rotation_ratio']:.3f}",
            ]
            for row in rows
        ],
    )
    print(output)
    return 0


def _safe_from(dataset: xr.Dataset) -> list[dict[str, Any]]:
    """Return, for each record and frame, the least 2 pi / p above which the frame stands."""
    from rockframe.rocking import Verdict

    fallen = (dataset["verdict"] == Verdict.OVERTURNED).values
    periods = dataset["column_period"].values
    rows = []
    for i, name in enumerate(dataset["record_id"].values):
        for j, alpha in enumerate(dataset["slenderness"].values):
            for k, gamma in enumerate(dataset["mass_ratio"].values):
                where = int(fallen[i, j, k].nonzero()[0].max(initial=-1)) + 1
                peaks = dataset["peak_rotation_ratio"].values[i, j, k, where:]
                rows.append(
                    {
                        "record_id": str(name),
                        "slenderness_deg": math.degrees(float(alpha)),
                        "mass_ratio": float(gamma),
                        "stands_from_s": float(periods[where]) if peaks.size else None,
                        "peak_rotation_ratio": float(peaks.max()) if peaks.size else None,
                    }
                )
    return rows
