"""Write the report page of a run."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rockframe.errors import InputError
from rockframe.options.showing import ReportOptions
from rockframe.provenance import MANIFEST, refuse_overwriting, sha256_of, whole_file
from rockframe.report.page import render
from rockframe.report.payload import choose
from rockframe.report.seal import is_whole, sealed
from rockframe.results.motions import read_histories
from rockframe.results.run import read_run
from rockframe.results.screening.screen import read_screening
from rockframe.stages.verify import verify_run

#: File name of the page, in the folder of its run.
PAGE: Final = "report.html"


def report_stage(
    folder: Path, output: Path | None = None, options: ReportOptions | None = None
) -> dict[str, int]:
    """Write one page that shows a run: ``report.html``.

    Parameters
    ----------
    folder : Path
        The folder of the run.
    output : Path, optional
        The page to write; by default in the folder.
    options : ReportOptions, optional
        Number of rows and histories on the page.

    Returns
    -------
    dict of str to int
        Numbers of ``histories`` on the page, of those ``left_out``, and of ``rows``.

    Raises
    ------
    InputError
        If the run is not whole, or the page cannot be written.
    """
    limits, output = options or ReportOptions(), output or folder / PAGE
    found = verify_run(folder)
    if found.faults:
        raise InputError(folder, f"is not a whole run: {found.faults[0]}")
    content = read_run(folder, most=limits.rows)
    outputs = [folder / name for name in content.manifest["outputs"]]
    refuse_overwriting([output], [folder / MANIFEST, *outputs])
    shown = choose(content, limits.histories)
    screened = folder / "screen.nc"
    screening = read_screening(screened) if screened in outputs else None
    page = render(content, read_histories(folder, shown), screening)
    with whole_file(output) as partial:
        partial.write_bytes(sealed(page))
    total = sum(content.counts.values())
    return {"histories": len(shown), "left_out": total - len(shown), "rows": len(content.rows)}


def require_whole(folder: Path) -> None:
    """Raise an error if a run is incomplete or changed.

    Raises
    ------
    InputError
        With the first fault.
    """
    for fault in (*verify_run(folder).faults, *strange_report(folder)):
        raise InputError(folder, f"is not a whole run: {fault}")


def strange_report(folder: Path) -> Sequence[str]:
    """Return the reasons why the page in a folder does not belong to its run; empty if it does."""
    page = folder / PAGE
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
