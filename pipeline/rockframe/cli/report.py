"""rockframe report: one page of a run to look at, in any browser and without a network."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from rockframe.cli.arguments import path
from rockframe.cli.outputs import file_to_write

#: The page, in the folder of its run.
_PAGE: Final = "report.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The folder of a run in, a page out."""
    parser.add_argument(
        "folder", type=path, help="folder of a run, of `rockframe table1` or `rockframe run`"
    )
    parser.add_argument(
        "--output",
        type=file_to_write(".html"),
        help="page to write (default: report.html in the folder)",
    )
    parser.add_argument(
        "--histories",
        type=_count,
        default=150,
        metavar="N",
        help="most histories in the page; of more, those that stand with the largest rotation come "
        "first (default: 150)",
    )
    parser.add_argument(
        "--rows",
        type=_count,
        default=5000,
        metavar="N",
        help="most rows of the table in the page; of more, the same come first, and all are "
        "counted (default: 5000)",
    )


def run(options: argparse.Namespace) -> int:
    """Verify the run, write the page, and say what is in it."""
    from rockframe.cli.console import show_json
    from rockframe.errors import InputError
    from rockframe.provenance import refuse_overwriting, whole_file
    from rockframe.report import choose, render, sealed
    from rockframe.results import read_histories, read_run
    from rockframe.stages import verify_run

    folder = options.folder
    output = options.output or folder / _PAGE
    found = verify_run(folder)
    if found.faults:
        raise InputError(folder, f"is not a whole run: {found.faults[0]}")
    content = read_run(folder, most=options.rows)
    outputs = [folder / name for name in content.manifest["outputs"]]
    refuse_overwriting([output], [folder / "manifest.json", *outputs])
    chosen = choose(content, options.histories)
    page = render(content, read_histories(folder, chosen))
    with whole_file(output) as partial:
        partial.write_bytes(sealed(page))
    total = sum(content.counts.values())
    if options.json:
        show_json(
            {
                "output": str(output),
                "bytes": output.stat().st_size,
                "histories": len(chosen),
                "left_out": total - len(chosen),
                "rows": len(content.rows),
            }
        )
        return 0
    size = output.stat().st_size / 1e6
    print(f"{output}: {size:.1f} MB, {len(chosen)} of {total} histories")
    return 0


def strange_report(folder: Path) -> list[str]:
    """Return why the page in the folder of a run is not that of the run; nothing if it is."""
    import json

    from rockframe.provenance import MANIFEST, sha256_of
    from rockframe.report import is_whole

    page = folder / _PAGE
    if not page.is_file():
        steps = json.loads((folder / MANIFEST).read_text(encoding="utf-8")).get("steps", {})
        missing = f"{page}: missing. Must be made by `rockframe report {folder}`."
        return [missing] if "report" in steps else []
    content = page.read_bytes()
    again = f"Must be made again, by `rockframe report {folder}`."
    if not is_whole(content):
        return [f"{page}: is damaged: not as it was written. {again}"]
    if sha256_of(folder / MANIFEST).encode() not in content:
        return [f"{page}: shows another run. {again}"]
    return []


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"Invalid number {text!r}. Must be at least 1")
    return int(text)
