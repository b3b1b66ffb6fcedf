"""Options of processes, clusters and batches, which do not change results."""

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
    """Largest number of processes that compute at once; by default one for each core. One alone
    uses as many threads as OMP_NUM_THREADS says."""
    scheduler: str | None = None
    """Compute on the Dask cluster of this scheduler instead, tcp://HOST:PORT (needs the extra
    `dask`)."""


class BatchOptions(Options):
    """Batches of records in a run."""

    records: Annotated[int, Field(ge=1)] = 50
    """Number of record files of each batch; with more than 150 batches, the batches are larger."""
