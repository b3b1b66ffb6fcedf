"""Options of processes, clusters and batches, of figures and of the report."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from rockframe.options.model import Options

#: Largest number of processes; no machine has more cores.
_MOST_WORKERS: Final = 4096


class ReadingOptions(Options):
    """Options of the processes that read files."""

    workers: Annotated[int, Field(ge=0, le=_MOST_WORKERS)] | None = None
    """Largest number of processes that read files at once, each protected against crashes of the
    others; 0 reads in this process, without that protection. By default one for each core."""


class ExecutionOptions(Options):
    """Options of the processes or the cluster that compute a stage."""

    workers: Annotated[int, Field(ge=1, le=_MOST_WORKERS)] | None = None
    """Largest number of processes that compute at once; by default one for each core. A single
    process uses the number of threads that OMP_NUM_THREADS states."""
    scheduler: str | None = None
    """Compute on the Dask cluster of this scheduler instead, tcp://HOST:PORT (needs the extra
    `dask`)."""


class BatchOptions(Options):
    """Batches of records in a run."""

    records: Annotated[int, Field(ge=1)] = 50
    """Number of record files of each batch; larger if there would be more than 150 batches."""


class FigureOptions(Options):
    """The figures of single records, of screenings and of spectra."""

    most: Annotated[int, Field(ge=0)] = 24
    """Largest number of figures of single records; 0 for no figures at all. If there are more
    records, those with the largest rotations without overturning are drawn."""


class ReportOptions(Options):
    """The page of the run."""

    histories: Annotated[int, Field(ge=1)] = 150
    """Largest number of histories in the page. If there are more, the largest rotations without
    overturning are chosen first."""
    rows: Annotated[int, Field(ge=1)] = 5000
    """Largest number of rows of the table in the page. If there are more, they are chosen in the
    same way; the counts still include all of them."""
