"""rockframe paper: check the paper's numbers and claims, and draw its figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rockframe.cli import arguments, console
from rockframe.cli.figure import add_grid
from rockframe.cli.options import add_options, folder_to_write
from rockframe.errors import require_known
from rockframe.options.ingest import IngestOptions
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import RespondOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rockframe.paper.claim import Claim
    from rockframe.results.tables.rows import Row
    from rockframe.stages.acceptance import Ingested

#: Assumed dimensions of the bridge bent for the figure of the joints; the paper states neither.
_BENT: Final = ("--spacing", "12", "--beam-centre", "1")
#: The paper's figures, except photographs and sketches; Figure 4 is `moment-rotation`.
_PAPER_FIGURES: Final = ("5", "7", "8", "9", "11")


def add_paper(parser: argparse.ArgumentParser) -> None:
    """Add the arguments: the paper's records, if available, and the folder to write."""
    parser.add_argument(
        "--output",
        type=folder_to_write,
        default=Path("outputs/paper"),
        help="folder to write (default: outputs/paper)",
    )
    parser.add_argument("--claim", metavar="NAME", help="print only this claim, and write nothing")
    arguments.add_records(parser)
    add_options(parser, PulseOptions, title="pulses")
    arguments.add_reading(parser)
    add_grid(parser)


def run_paper(options: argparse.Namespace) -> int:
    """Check the claims, draw the figures, write the page and its manifest."""
    from rockframe.cli.table1 import finish
    from rockframe.paper.claims import all_claims
    from rockframe.paper.pulses import record_claims
    from rockframe.provenance import whole_folder
    from rockframe.results.tables.pulse_rows import pulse_rows
    from rockframe.study.structures import SHIPPED_STRUCTURES

    if options.claim is not None:
        claims = _named(all_claims(), options.claim)
        _show(claims, options.json)
        return 0
    folder: Path = options.output
    arguments.refuse_folder_of_records(options)
    with whole_folder(folder) as partial:
        ingested, rows = _respond(options, partial)
        claims = all_claims() + record_claims(rows, pulse_rows(partial / "pulses.nc"))
        _write(claims, _draw(partial, options.grid), rows, partial)
        stated = {"records": IngestOptions, "pulse": PulseOptions}
        finish(options, partial, ingested, SHIPPED_STRUCTURES, stated)
    if options.json:
        console.show_json({"claims": [_plain(claim) for claim in claims], "output": str(folder)})
    else:
        _show(claims, False)
        print(f"{folder / 'paper-checked.md'}")
    return console.show_rejections(ingested.rejections)


def _respond(options: argparse.Namespace, folder: Path) -> tuple[Ingested, list[Row]]:
    """Run the stages for the paper's bridge; return the rows of the table."""
    from rockframe.cli.table1 import run_stages
    from rockframe.paper.table1 import with_paper_facts
    from rockframe.results.tables.table import table_rows

    respond = RespondOptions(structure="bridge-bent")
    ingested, _, files = run_stages(options, folder, respond)
    return ingested, [with_paper_facts(row) for row in table_rows(*files)]


def _draw(folder: Path, grid: int) -> dict[str, str]:
    """Draw all figures of `rockframe figure`; return the title and caption of each by its path."""
    from rockframe.cli.figure import FIGURES, add_figure
    from rockframe.figures.captioned import save_captioned

    parser = argparse.ArgumentParser()
    add_figure(parser)
    captions = {}
    for name, entry in FIGURES.items():
        path = folder / "figures" / f"figure-{name}.png"
        words = [name, "--output", str(path), "--records", str(folder / "records.nc")]
        words += ["--grid", str(grid)]
        drawn, _ = entry.draw(parser.parse_args(words + list(_BENT if name == "joints" else ())))
        save_captioned(drawn, path)
        captions[path.relative_to(folder).as_posix()] = f"{drawn.title}. {drawn.caption}"
    return captions


def _write(
    claims: Sequence[Claim], figures: dict[str, str], rows: Sequence[Row], folder: Path
) -> None:
    from rockframe.cli.figure import FIGURES
    from rockframe.paper.claims import checked_page
    from rockframe.paper.table1 import paper_record_of, paper_records
    from rockframe.provenance import whole_file

    own = {row["record_id"] for row in rows if paper_record_of(row["source_file"])}
    records = f"{len(own)} of the paper's {len(paper_records())} records were found by name" + (
        "."
        if own
        else ": claims about its records are not checked, and figures show other records."
    )
    undrawn = [name for name in _PAPER_FIGURES if name not in FIGURES]
    if undrawn:
        records += f" Figures of the paper that cannot be drawn yet: {', '.join(undrawn)}."
    with whole_file(folder / "paper-checked.md") as partial:
        partial.write_text(checked_page(claims, figures, records), encoding="utf-8")


def _named(claims: Sequence[Claim], name: str) -> list[Claim]:
    require_known("claim", name, [claim.name for claim in claims])
    return [claim for claim in claims if claim.name == name]


def _show(claims: Sequence[Claim], json: bool) -> None:
    if json:
        console.show_json({"claims": [_plain(claim) for claim in claims]})
        return
    columns = ("claim", "paper", "ours", "finding")
    cells = ([one.name, one.printed, one.ours, one.finding.value] for one in claims)
    console.show_table("The paper, checked", columns, cells)
    if len(claims) == 1:
        (claim,) = claims
        print(f"{claim.where}: {claim.says}. {claim.remark}".rstrip())


def _plain(claim: Claim) -> dict[str, Any]:
    return {**vars(claim), "finding": claim.finding.value, "command": claim.shown_by}
