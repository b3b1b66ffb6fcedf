"""Reading pulses.nc without its series."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from rockframe.results.reading import opened
from rockframe.results.schema import PULSES


def loaded_pulses(path: Path) -> xr.Dataset:
    """Return all of a pulse file but its series; of a batch without records there is nothing.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    with opened(path, PULSES, empty=True) as dataset:
        return dataset.drop_dims("obs", errors="ignore").load()
