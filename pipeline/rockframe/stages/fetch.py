"""fetch: from the data centre to a folder of files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.ingest import CATALOGUE, CatalogueEntry, write_catalogue

if TYPE_CHECKING:
    from rockframe.fetch import Fetched, Request


def fetch_stage(
    request: Request,
    folder: Path,
    *,
    timeout: float,
    progress: Callable[[str], None] | None = None,
) -> Fetched:
    """Fetch records into a folder that `ingest_stage` reads, with a `catalogue.csv` of the event.

    Parameters
    ----------
    request : Request
        What to fetch.
    folder : Path
        New, empty, or that of an earlier run of the same request.
    timeout : float
        Longest time for one answer [s].
    progress : callable, optional
        Called with the name of each file that is asked for.

    Raises
    ------
    InputError
        If the folder holds something else, or cannot be written to.
    ServiceError
        If nothing came in, or a service stays silent or refuses what it is asked.
    """
    from rockframe.fetch import fetch  # obspy's client: the other stages need not wait for it

    fetched = fetch(request, folder, timeout=timeout, progress=progress)
    entries = [CatalogueEntry(**facts) for facts in fetched.facts()]
    write_catalogue(folder / CATALOGUE, entries)
    return fetched
