"""rockframe ingest: read record files, checked, into records.nc."""

from __future__ import annotations

import argparse
from typing import Any

from rockframe.cli.arguments import add_reading, path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Files, and what they do not say of themselves."""
    parser.add_argument("paths", nargs="+", type=path, metavar="PATH", help="record file or folder")
    parser.add_argument("--output", type=path, required=True, help="netCDF file to write")
    add_reading(parser)


def run(options: argparse.Namespace) -> int:
    """Run the stage and print what went through."""
    from rockframe.cli.arguments import band_pass, read_options
    from rockframe.cli.console import number, progress_names, show_json, show_rejections, show_table
    from rockframe.signals import integrate, peak
    from rockframe.stages import ingest_stage
    from rockframe.units import GRAVITY

    with progress_names("reading") as progress:
        result = ingest_stage(
            options.paths,
            options.output,
            options=read_options(options),
            catalogue=options.catalogue,
            band=band_pass(options),
            all_uncorrected=options.uncorrected,
            progress=progress,
            workers=options.workers,
            strict=options.strict,
        )
    summary: list[dict[str, Any]] = [
        {
            "record_id": record.record_id,
            "format": record.source_format,
            "samples": record.acceleration.size,
            "time_step_s": record.time_step,
            "pga_g": peak(record.acceleration) / GRAVITY,
            "pgv_m_s": peak(integrate(record.acceleration, record.time_step)),
            "corrected_here": record.uncorrected or options.uncorrected,
            "processing": list(record.processing),
        }
        for record in result.records
    ]
    if options.json:
        rejected = [{"file": r.file, "line": r.line, "reason": r.reason} for r in result.rejections]
        show_json({"accepted": summary, "rejected": rejected, "output": str(options.output)})
    else:
        rows = [
            [
                str(row["record_id"]),
                str(row["format"]),
                str(row["samples"]),
                f"{row['time_step_s']:g}",
                number(row["pga_g"], 3),
                number(row["pgv_m_s"], 3),
                "corrected here" if row["corrected_here"] else "as given",
            ]
            for row in summary
        ]
        show_table(
            f"{len(summary)} record{'s' if len(summary) > 1 else ''} in {options.output}",
            ["record", "format", "samples>", "step [s]>", "PGA [g]>", "PGV [m/s]>", "processing"],
            rows,
        )
    show_rejections(result.rejections)
    return 1 if result.rejections else 0
