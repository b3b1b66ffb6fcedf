"""rockframe spectrum: find which pulses overturn frames, or how records rock frames of any size."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli.arguments import path
from rockframe.cli.computing import add_engine
from rockframe.cli.outputs import file_to_write

if TYPE_CHECKING:
    import xarray as xr

#: 2 pi / p of columns of half a metre to fifty [s], if none are stated.
_PERIODS: Final = (1.5, 15.0, 136)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A pulse or records, frames, and where the spectrum goes."""
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--wavelet",
        nargs="+",
        metavar="NAME",
        help="form of the pulse, one or more: minimum overturning acceleration spectra",
    )
    what.add_argument(
        "--records",
        type=path,
        metavar="FILE",
        help="output of `rockframe ingest`: rocking spectra, peaks over 2 pi / p of the columns",
    )
    parser.add_argument(
        "--output", type=file_to_write(".nc"), required=True, help="netCDF file to write"
    )
    parser.add_argument(
        "--slenderness-deg",
        type=float,
        nargs="+",
        required=True,
        metavar="DEGREES",
        help="slenderness of the columns, which are rectangular; ascending",
    )
    parser.add_argument(
        "--mass-ratio",
        type=float,
        nargs="+",
        default=[0.0],
        metavar="RATIO",
        help="mass of the beam over that of all columns; ascending (default: 0, a column alone)",
    )
    _add_of_pulses(parser)
    _add_of_records(parser)
    add_engine(parser)


def _add_of_pulses(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("of pulses")
    group.add_argument(
        "--frequency-ratio",
        type=float,
        nargs="+",
        metavar="RATIO",
        help="omega_p / p, p of the column alone; ascending",
    )
    group.add_argument(
        "--max-amplitude",
        type=float,
        default=30.0,
        metavar="A",
        help="where the scan ends, a_p / (g tan slenderness) (default: 30)",
    )
    group.add_argument(
        "--amplitude-step",
        type=float,
        metavar="STEP",
        help="of the scan; edges are refined, thinner slivers may be missed (default: 0.005)",
    )
    group.add_argument(
        "--phase-deg", type=float, default=0.0, metavar="DEGREES", help="of wavelets that have one"
    )
    group.add_argument(
        "--half-cycles", type=float, metavar="NUMBER", help="of mavroeidis_papageorgiou"
    )


def _add_of_records(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("of records")
    group.add_argument("--record", metavar="ID", help="only this record")
    group.add_argument(
        "--column-period",
        type=float,
        nargs="+",
        metavar="SECONDS",
        help="2 pi / p of the columns alone; ascending (default: every 0.1 s from 1.5 to 15)",
    )


def run(options: argparse.Namespace) -> int:
    """Compute, write, print."""
    return _of_pulses(options) if options.wavelet else _of_records(options)


def _of_pulses(options: argparse.Namespace) -> int:
    import numpy as np

    from rockframe.cli.computing import engine
    from rockframe.cli.console import show_json, show_table
    from rockframe.errors import ParameterError
    from rockframe.results import read_spectrum
    from rockframe.rocking.spectra import AMPLITUDE_STEP
    from rockframe.stages import spectrum_stage
    from rockframe.wavelets import Pulse

    step = options.amplitude_step
    if not options.frequency_ratio:
        raise ParameterError("--frequency-ratio missing. Must be given with --wavelet.")
    spectrum_stage(
        options.output,
        pulses=[
            Pulse(
                wavelet=name,
                a_p=1.0,
                T_p=1.0,
                phase=math.radians(options.phase_deg),
                half_cycles=options.half_cycles,
            )
            for name in options.wavelet
        ],
        slendernesses=np.radians(options.slenderness_deg),
        mass_ratios=options.mass_ratio,
        frequency_ratios=options.frequency_ratio,
        largest_amplitude=options.max_amplitude,
        amplitude_step=AMPLITUDE_STEP if step is None else step,
        engine=engine(options),
    )
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
    """A row for each wavelet, slenderness and mass ratio."""
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
    """Each line with its intervals."""
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
    import numpy as np

    from rockframe.cli.computing import engine
    from rockframe.cli.console import show_json, show_table
    from rockframe.results import read_rocking_spectrum
    from rockframe.stages import rocking_spectrum_stage

    output: Path = options.output
    rocking_spectrum_stage(
        options.records,
        output,
        record=options.record,
        slendernesses=np.radians(options.slenderness_deg),
        mass_ratios=options.mass_ratio,
        column_periods=options.column_period or np.linspace(*_PERIODS).round(6),
        engine=engine(options),
    )
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
    """For each record and frame the least 2 pi / p from which on nothing overturns."""
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
