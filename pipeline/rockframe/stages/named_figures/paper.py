"""The page that compares the paper with the package: its claims, and every figure with a name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Final

from rockframe.figures.captioned import save_captioned
from rockframe.paper.claim import Claim, Finding
from rockframe.paper.claims import all_claims, checked_page
from rockframe.paper.pulses import find_paper_record, paper_records, record_claims
from rockframe.provenance import whole_file
from rockframe.results.pulses import pulse_rows
from rockframe.results.tables.entries import rows_of, write_rows_as
from rockframe.results.tables.rows import Row
from rockframe.stages.named_figures import FIGURES
from rockframe.stages.named_figures.shown import FigureRequest
from rockframe.stages.table import table_rows_of

#: Files in the folder of `paper_stage`: the page, the claims, and the figures.
PAGE: Final = "paper-checked.md"
CLAIMS: Final = "claims.csv"
FOLDER: Final = "figures/"


def paper_stage(records: Path, pulses: Path, response: Path, folder: Path, grid: int) -> None:
    """Check the claims of the paper, draw the figures, and write the page.

    Parameters
    ----------
    records, pulses, response : Path
        Outputs of `ingest_stage`, `pulse_stage` and `respond_stage` for the same records.
    folder : Path
        Folder to write: the page, ``claims.csv``, and ``figures/``.
    grid : int
        Points along each side of a map.

    Raises
    ------
    InputError
        If a file cannot be read or written.
    """
    rows = list(table_rows_of(records, pulses, response))
    claims = all_claims() + record_claims(rows, pulse_rows(pulses))
    figures = draw_all(records, folder, grid)
    write_rows_as(folder / CLAIMS, map(vars, claims))
    page = checked_page(claims, figures, f"{_of_records(rows)}.")
    with whole_file(folder / PAGE) as partial:
        partial.write_text(page, encoding="utf-8")


def draw_all(records: Path, folder: Path, grid: int) -> Mapping[str, str]:
    """Draw all figures of `rockframe figure`; return the title and caption of each by its path."""
    # the dimensions of the bridge bent are assumed: the paper states neither
    request = FigureRequest(
        records=lambda: nullcontext((records, 0)), grid=grid, spacing=12.0, beam_centre=1.0
    )
    captions = {}
    for name, entry in FIGURES.items():
        path = folder / FOLDER / f"figure-{name}.png"
        drawn, _ = entry.draw(request)
        save_captioned(drawn, path)
        captions[path.relative_to(folder).as_posix()] = f"{drawn.title}. {drawn.caption}"
    return captions


def _of_records(rows: Sequence[Row]) -> str:
    """Return how many of the paper's records are among ours."""
    own = {row["record_id"] for row in rows if find_paper_record(row["source_file"])}
    records = f"{len(own)} of the paper's {len(paper_records())} records were found by name"
    if own:
        return records
    return f"{records}: claims about its records are not checked, and figures show other records"


def read_claims(folder: Path) -> list[Claim]:
    """Return the claims that `paper_stage` checked, in the order of the page.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    claims = []
    for row in rows_of(folder / CLAIMS):
        finding = Finding(row.pop("finding"))
        claims.append(Claim(**row, finding=finding))
    return claims
