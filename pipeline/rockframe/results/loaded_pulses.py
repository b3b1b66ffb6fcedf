"""Reading pulses.nc without its series, and refusing one that another version wrote."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import xarray as xr

from rockframe.errors import InputError
from rockframe.results.files import PULSES, opened


def loaded_pulses(path: Path, needed: Iterable[str]) -> xr.Dataset:
    """Return all of a pulse file but its series; of a batch without records there is nothing.

    Parameters
    ----------
    path : Path
        Output of `pulse_stage`.
    needed : iterable of str
        Variables that are going to be read.

    Raises
    ------
    InputError
        If the file is missing, damaged, something else, or without one of these variables.
    """
    with opened(path, PULSES) as dataset:
        pulses = dataset.drop_dims("obs", errors="ignore").load()
    missing = [name for name in ("wavelet", "best_wavelet", *needed) if name not in pulses]
    if "record_id" in pulses and missing:
        must_be = "Must be as this version of `rockframe pulse` writes it."
        raise InputError(path, f"without variable {missing[0]!r}. {must_be}")
    return pulses
