"""Dask clusters on this machine, for tests."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

distributed = pytest.importorskip("distributed", reason="needs the extra dask: make test-dask")


def local_cluster(workers: int, **options: Any) -> Any:
    """Start a cluster without dashboard and messages; close it with ``with``.

    Dask warns if a worker's folder takes more than a second to create. On a busy machine this says
    nothing about the package, and in the tests, where warnings are errors, no worker would start.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Creating scratch directories", UserWarning)
        return distributed.LocalCluster(
            n_workers=workers, dashboard_address=":0", silence_logs=50, **options
        )
