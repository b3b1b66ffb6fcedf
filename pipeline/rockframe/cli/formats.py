"""rockframe formats: list the formats of records, or show how files would be read."""

from __future__ import annotations

import argparse
import shlex
from typing import TYPE_CHECKING, Any

from rockframe.cells import plain
from rockframe.cli import console
from rockframe.cli.options import add_options, chosen, flag, path
from rockframe.errors import ParameterError
from rockframe.options.ingest import FileOptions
from rockframe.units import GRAVITY

if TYPE_CHECKING:
    from rockframe.ingest.preview import Preview


def add_formats(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: files, and what they do not state."""
    parser.add_argument(
        "paths",
        nargs="*",
        type=path,
        metavar="FILE",
        help="show the first lines of this file, what is recognised, what is missing, and the "
        "command that would read it (default: list the formats)",
    )
    add_options(parser, FileOptions)


def run_formats(options: argparse.Namespace) -> int:
    """Print the table of formats, or the previews. Return 1 if a file cannot be read so."""
    given = chosen(options, FileOptions)
    words = _words(given)
    if not options.paths:
        if words:
            message = f"{words[0]} without a FILE. State FILE before options of several words."
            raise ParameterError(message)
        _list_formats(as_json=options.json)
        return 0
    from rockframe.ingest.options import read_options
    from rockframe.ingest.preview import preview

    previews = [preview(file, read_options(given)) for file in options.paths]
    if options.json:
        console.show_json(
            [
                _said(shown, command=_command(str(file), words, shown))
                for file, shown in zip(options.paths, previews, strict=True)
            ]
        )
    else:
        for file, shown in zip(options.paths, previews, strict=True):
            _show(str(file), words, shown)
    return int(any(not shown.records for shown in previews))


def _list_formats(*, as_json: bool) -> None:
    from rockframe.ingest import FORMATS

    heads = {
        "name": "name",
        "obspy_name": "obspy",
        "extensions": "usual extensions",
        "description": "description",
    }
    rows = [{key: getattr(entry, key) for key in heads} for entry in FORMATS]
    if as_json:
        console.show_json(rows)
        return
    cells = [
        [text if isinstance(text, str) else " ".join(text) for text in row.values()] for row in rows
    ]
    console.show_table("Formats of strong-motion records", list(heads.values()), cells)


def _words(options: FileOptions) -> list[str]:
    """Return the words of the command line for the options that differ from their defaults."""
    words: list[str] = []
    for name, field in type(options).model_fields.items():
        value = getattr(options, name)
        if value != field.default:
            values = value if isinstance(value, tuple) else (value,)
            words += [flag(name), *map(str, values)]
    return words


def _command(file: str, words: list[str], shown: Preview) -> str:
    """Return the command that would read the file; empty if none would."""
    if shown.refusal:
        return ""
    missing = [word for option in shown.missing for word in (option.option, option.value)]
    return shlex.join(["rockframe", "ingest", file, *words, *missing, "--output", "records.nc"])


def _said(shown: Preview, *, command: str) -> dict[str, Any]:
    return {
        "file": shown.file,
        "first_lines": list(shown.lines),
        "format": shown.format,
        "recognised": shown.recognised,
        "records": _rows(shown),
        "missing": [vars(option) for option in shown.missing],
        "refusal": shown.refusal,
        "command": command,
    }


def _rows(shown: Preview) -> list[dict[str, Any]]:
    return [
        {
            "record_id": record.record_id,
            "component": record.component,
            "azimuth_degree": record.azimuth,
            "samples": record.acceleration.size,
            "time_step_s": record.time_step,
            "peak_g": float(abs(record.acceleration).max()) / GRAVITY,
            "uncorrected": record.uncorrected,
        }
        for record in shown.records
    ]


def _show(file: str, words: list[str], shown: Preview) -> None:
    """Print a preview."""
    print(f"{shown.file}: {shown.format or 'format not recognised'}")
    for number, line in enumerate(shown.lines, 1):
        print(plain(f"{number:4} | {line}".rstrip()))
    if shown.recognised:
        print(f"recognised: {shown.recognised}")
    for option in shown.missing:
        print(f"missing: {option.option} {option.value} ({option.allowed})")
    if shown.refusal:
        print(f"cannot be read: {shown.refusal}")
    if shown.records:
        columns = [
            console.column("record", "record_id"),
            console.column("component", "component"),
            console.column("azimuth>", "azimuth_degree", "g"),
            console.column("samples>", "samples"),
            console.column("step [s]>", "time_step_s", "g"),
            console.column("peak [g]>", "peak_g", ".4f"),
        ]
        many = "s" if len(shown.records) > 1 else ""
        console.show_rows(f"{len(shown.records)} record{many}", columns, _rows(shown))
    if command := _command(file, words, shown):
        print(command)
