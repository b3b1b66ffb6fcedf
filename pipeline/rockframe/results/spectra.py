"""spectrum.nc: overturning spectra of pulses, and rocking spectra of records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rockframe.results.reading import opened
from rockframe.results.schema import ROCKING_SPECTRUM, SPECTRUM
from rockframe.results.schema.response import ROCKING_SPECTRUM_NC, SPECTRUM_NC, Overturning
from rockframe.rocking.spectra.overturning import column_of
from rockframe.rocking.spectra.rocking import RockingSpectrum
from rockframe.rocking.spectra.scan import OverturningSpectrum, islands
from rockframe.rocking.stated_verdict import Verdict


def spectrum_dataset(spectrum: OverturningSpectrum) -> xr.Dataset:
    """Return the dataset of an overturning spectrum: maps, smallest amplitudes, intervals.

    Parameters
    ----------
    spectrum : OverturningSpectrum
        Result of `overturning_spectrum`.
    """
    found = spectrum.found
    maps = (*spectrum.shape, spectrum.amplitude.size)
    fallen = found.verdict == Verdict.OVERTURNED
    how = np.where(found.impacts == 0, Overturning.WITHOUT_IMPACT, Overturning.AFTER_IMPACT)
    frames = [
        [column_of(float(alpha), float(gamma)) for gamma in spectrum.mass_ratio]
        for alpha in spectrum.slenderness
    ]
    return SPECTRUM_NC.dataset(
        {
            "verdict": found.verdict.reshape(maps),
            "overturning": np.where(fallen, how, Overturning.NONE).reshape(maps),
            **SPECTRUM_NC.filled("spectrum", spectrum),
            **_intervals(spectrum),
            **SPECTRUM_NC.filled("frame", frames),
            "effective_frequency_ratio": [
                [f.effective_frequency_parameter / f.frequency_parameter for f in row]
                for row in frames
            ],
            **SPECTRUM_NC.filled("pulse", list(spectrum.pulses)),
        }
    )


def _intervals(spectrum: OverturningSpectrum) -> dict[str, Any]:
    """Return the intervals along ``interval``, padded to the largest number of intervals."""
    found = spectrum.found
    counts = np.bincount(found.line, minlength=len(found.verdict))
    rank = np.arange(found.line.size) - np.searchsorted(found.line, found.line)
    size = max(1, int(counts.max()))
    lower, upper = np.full((2, counts.size, size), np.nan)
    impacts = np.full((counts.size, size), -1, dtype=np.int32)
    lower[found.line, rank], upper[found.line, rank] = found.lower, found.upper
    impacts[found.line, rank] = found.impacts_at_lower
    end = float(spectrum.amplitude[-1])
    stand = np.array([len(islands(bounds, end)) for bounds in found.intervals()])
    shape = (*spectrum.shape, size)
    return {
        "overturning_intervals": counts.reshape(spectrum.shape),
        "safe_islands": stand.reshape(spectrum.shape),
        "interval_lower": lower.reshape(shape),
        "interval_upper": upper.reshape(shape),
        "interval_impacts": impacts.reshape(shape),
    }


def rocking_spectrum_dataset(names: Sequence[str], spectrum: RockingSpectrum) -> xr.Dataset:
    """Return the dataset of the rocking spectra of records.

    Parameters
    ----------
    names : sequence of str
        Identifiers of the records.
    spectrum : RockingSpectrum
        Result of `rocking_spectrum` for these records.
    """
    values = ROCKING_SPECTRUM_NC.filled("spectrum", spectrum)
    return ROCKING_SPECTRUM_NC.dataset({"record_id": list(names), **values})


def read_spectrum(path: str | Path) -> xr.Dataset:
    """Return the dataset of a file of overturning spectra; its variables state their units.

    Parameters
    ----------
    path : str or Path
        Output of `rockframe.spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened(Path(path), SPECTRUM) as dataset:
        return dataset.load()


def read_rocking_spectrum(path: str | Path) -> xr.Dataset:
    """Return the dataset of a file of rocking spectra; its variables state their units.

    Parameters
    ----------
    path : str or Path
        Output of `rockframe.rocking_spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.
    """
    with opened(Path(path), ROCKING_SPECTRUM) as dataset:
        return dataset.load()
