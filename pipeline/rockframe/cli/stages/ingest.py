"""rockframe fetch and ingest: download records, and read and check their files."""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cells import TABLE_FORMATS
from rockframe.cli import arguments, console
from rockframe.cli.options import add_options, chosen, folder_to_write, path
from rockframe.options.ingest import Filters, IngestOptions
from rockframe.options.model import ReadingOptions
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    from rockframe.fetch.coverage import Coverage
    from rockframe.outcome import InputOutcome
    from rockframe.signals.passport import Passport
    from rockframe.stages.ingesting.acceptance import Ingested


#: Beginning of the note of a record on the layout of its table.
_LAYOUT: Final = "table: "


def add_fetch(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: data centre, event, stations, time span, folder."""
    from rockframe.options.fetch import FetchOptions  # only this command needs it

    parser.epilog = (
        "Exit status: 0 everything was received; 1 something is missing (it is listed); 2 nothing "
        "was received, or an error that you can correct. The same command resumes an interrupted "
        "download. From archives that need a login (PEER NGA, ESM, CESMD, K-NET), download by "
        "hand, then use rockframe ingest."
    )
    add_options(parser, FetchOptions)
    parser.add_argument(
        "--output",
        "-o",
        type=folder_to_write,
        required=True,
        metavar="FOLDER",
        help="folder to write",
    )


def run_fetch(options: argparse.Namespace) -> int:
    """Download, and print what was requested and received."""
    from rockframe.options.fetch import FetchOptions
    from rockframe.stages.table import fetch_stage

    request = chosen(options, FetchOptions)
    with console.progress_names("fetching") as progress:
        fetched = fetch_stage(request, options.output, progress=progress)
    if options.json:
        rows = [asdict(row) | {"verdict": row.verdict} for row in fetched.coverage]
        event = None if fetched.event is None else asdict(fetched.event)
        console.show_json({"event": event, "coverage": rows, "output": str(options.output)})
    else:
        _show_coverage(fetched.coverage, options.output)
    return 0 if fetched.complete else 1


def _show_coverage(coverage: tuple[Coverage, ...], folder: Path) -> None:
    from rockframe.cells import number

    complete = sum(row.complete for row in coverage)
    columns = [
        console.column("channel", "what"),
        console.column("R [km]>", "distance", ".1f", rule=lambda row, key: number(row[key])),
        console.column("requested from", "requested_start", rule=lambda row, key: row[key][:19]),
        console.column("to", "requested_end", rule=lambda row, key: row[key][11:19]),
        console.column("received from", "received_start", rule=lambda row, key: row[key][11:22]),
        console.column("to", "received_end", rule=lambda row, key: row[key][11:22]),
        console.column("samples>", "samples", rule=lambda row, key: str(row[key] or "–")),
        console.column("coverage", "verdict"),
    ]
    rows = [vars(row) | {"verdict": row.verdict} for row in coverage]
    console.show_rows(f"{complete} of {len(coverage)} complete in {folder}", columns, rows)


def add_ingest(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: files, and metadata that the files do not contain."""
    parser.add_argument(
        "paths",
        nargs="*",
        type=path,
        metavar="PATH",
        help="record file or folder (default: the bundled 2019 Ridgecrest records)",
    )
    arguments.add_output(parser)
    arguments.add_format(parser)
    add_options(parser, IngestOptions)
    add_options(parser, ReadingOptions)
    add_options(parser, Filters, title=arguments.FILTERS)


def run_ingest(options: argparse.Namespace) -> int:
    """Run the stage and print the accepted records."""
    from rockframe.stages.ingest import ingest_stage

    def listed(entries: Sequence[InputOutcome]) -> None:
        """List the outcome of each file if no record was accepted."""
        rejected = [entry for entry in entries if entry.status == "rejected"]
        none = all(entry.status != "accepted" for entry in entries)
        if none and options.json:
            console.show_json({"accepted": [], **_others(entries), "output": None})
        if none and len(rejected) > 1:
            console.show_rejections(rejected)

    wanted = chosen(options, IngestOptions)
    with console.progress_names("reading") as progress:
        result = ingest_stage(
            options.paths or arguments.bundled(),
            options.output,
            wanted,
            filters=chosen(options, Filters),
            progress=progress,
            workers=chosen(options, ReadingOptions).workers,
            listed=listed,
            table_format=options.format,
        )
    accepted = _accepted(result)
    unpaired = _unpaired(result)
    if options.json:
        others = _others(result.entries)
        said = {"accepted": accepted, **others, "unpaired": unpaired}
        console.show_json({**said, "output": str(options.output)})
    else:
        _show(accepted, options.output)
        _show_unpaired(unpaired)
        _show_layouts(accepted)
        _show_trusted(accepted, wanted.trust or ())
        filtered = sum(entry.status == "filtered" for entry in result.entries)
        if filtered:
            table = options.output.with_suffix(TABLE_FORMATS[options.format])
            print(f"{filtered} filtered out: see the reasons in {table}")
    return console.show_rejections(result.rejections)


def _accepted(result: Ingested) -> list[dict[str, Any]]:
    return [
        {
            "record_id": record.record_id,
            "format": record.source_format,
            "samples": record.samples,
            "time_step_s": record.time_step,
            "pga_g": record.passport.measures.peak_acceleration / GRAVITY,
            "pgv_m_s": record.passport.measures.peak_velocity,
            "corrected_here": record.corrected_here,
            "processing": list(record.processing),
            "trusted": list(record.trusted),
            **_passport(record.passport),
        }
        for record in result.accepted
    ]


def _unpaired(result: Ingested) -> dict[str, str]:
    """Return the reason for each horizontal that has no RotD."""
    content = result.content
    named = zip(content["record_id"].values, content["unpaired"].values, strict=True)
    return {str(name): str(reason) for name, reason in named if reason}


def _show_unpaired(unpaired: Mapping[str, str]) -> None:
    """Print why the horizontals of a motion are no pair; one that is alone needs no line."""
    from rockframe.components import ALONE

    together: defaultdict[str, list[str]] = defaultdict(list)
    for name, reason in unpaired.items():
        together[reason].append(name)
    for reason, names in together.items():
        if reason != ALONE:
            print(f"no RotD: {', '.join(names)}: {reason}")


def _others(entries: Sequence[InputOutcome]) -> dict[str, list[dict[str, Any]]]:
    return {
        "rejected": [
            {key: getattr(entry, key) for key in ("file", "record_id", "line", "reason")}
            | _passport(entry.passport)
            for entry in entries
            if entry.status == "rejected"
        ],
        **{
            status: [
                {"file": entry.file, "record_id": entry.record_id, "reason": entry.reason}
                for entry in entries
                if entry.status == status
            ]
            for status in ("filtered", "rotated", "unread")
        },
    }


def _show(accepted: list[dict[str, Any]], output: Path) -> None:
    def processing(row: Mapping[str, Any], key: str) -> str:
        if not row[key]:
            return "as given"
        return f"from {row['corner_hz']:g} Hz ({row['corner_source'].replace('_', ' ')})"

    def passport(row: Mapping[str, Any], key: str) -> str:
        return str(row[key]) + (": " if row["warnings"] else "") + ", ".join(row["warnings"])

    columns = [
        console.column("record", "record_id"),
        console.column("format", "format"),
        console.column("samples>", "samples"),
        console.column("step [s]>", "time_step_s", "g"),
        console.column("PGA [g]>", "pga_g", ".3f"),
        console.column("PGV [m/s]>", "pgv_m_s", ".3f"),
        console.column("processing", "corrected_here", rule=processing),
        console.column("passport", "passport", rule=passport),
    ]
    many = "s" if len(accepted) > 1 else ""
    console.show_rows(f"{len(accepted)} record{many} in {output}", columns, accepted)


def _show_layouts(accepted: list[dict[str, Any]]) -> None:
    """Print how tables were read, where they are not plain columns; equal layouts in one line."""
    together: defaultdict[str, list[str]] = defaultdict(list)
    for row in accepted:
        for note in row["processing"]:
            if note.startswith(_LAYOUT):
                together[note.removeprefix(_LAYOUT)].append(row["record_id"])
    for note, names in together.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        print(f"{names[0]}{more}: read as {note}")


def _show_trusted(accepted: list[dict[str, Any]], words: Sequence[str]) -> None:
    """Print each settled contradiction, and the words of the option that settled none."""
    notes = [(row["record_id"], note) for row in accepted for note in row["trusted"]]
    for name, note in notes:
        print(f"{name}: trusted {note}")
    unused = [word for word in words if not any(note.startswith(f"{word}:") for _, note in notes)]
    if unused:
        print(f"--trust {' '.join(unused)}: no accepted record contradicts itself there")


def _passport(passport: Passport | None) -> dict[str, Any]:
    """Return the verdict, the names of the warnings, and all checks."""
    if passport is None:
        return {"passport": None, "warnings": [], "checks": []}
    corner, measures = passport.corner, passport.measures
    return {
        "corner_hz": corner.frequency,
        "corner_source": corner.source.name.lower(),
        "usable_periods_s": [measures.usable_period_shortest, measures.usable_period_longest],
        "passport": passport.verdict.name.lower(),
        "warnings": list(passport.warnings),
        "checks": [
            {**vars(check), "verdict": check.verdict.name.lower()} for check in passport.checks
        ],
    }
