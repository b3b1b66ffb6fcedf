"""Fetch records from a data centre into a folder of files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from rockframe.ingest import CATALOGUE, CatalogueEntry, write_catalogue
from rockframe.options.fetch import FetchOptions

if TYPE_CHECKING:
    from rockframe.fetch.coverage import Fetched


def fetch_stage(
    options: FetchOptions,
    folder: Path,
    *,
    progress: Callable[[str], None] | None = None,
) -> Fetched:
    """Fetch records into a folder for `ingest_stage`, with a `catalogue.csv` of the event.

    Parameters
    ----------
    options : FetchOptions
        The data to fetch.
    folder : Path
        A new or empty folder, or that of an earlier run of the same request.
    progress : callable, optional
        Called with the name of each requested file.

    Raises
    ------
    InputError
        If the folder holds something else, or cannot be written to.
    ServiceError
        If nothing came in, or a service stays silent or refuses what it is asked.
    """
    from rockframe.fetch.run import fetch

    fetched = fetch(options, folder, progress=progress)
    entries = [CatalogueEntry(**facts) for facts in fetched.facts()]
    write_catalogue(folder / CATALOGUE, entries)
    return fetched
