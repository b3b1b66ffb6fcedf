"""spectrum.nc: overturning spectra of pulses, and rocking spectra of records."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path

import numpy as np
import xarray as xr

from rockframe.results.files import ROCKING_SPECTRUM, SPECTRUM, opened
from rockframe.results.variables import flags, record_ids, texts, variable
from rockframe.rocking.response import Verdict
from rockframe.rocking.rocking_spectra import RockingSpectrum
from rockframe.rocking.scan import islands
from rockframe.rocking.spectra import OverturningSpectrum, column_of

_LINE = ("wavelet", "slenderness", "mass_ratio", "frequency_ratio")
_AMPLITUDE = "a_p / (g tan(slenderness))"


class Overturning(IntEnum):
    """How a frame overturns; the values of the flag variable `overturning`."""

    NONE = 0
    AFTER_IMPACT = 1
    WITHOUT_IMPACT = 2


def spectrum_dataset(spectrum: OverturningSpectrum) -> xr.Dataset:
    """Return the dataset of an overturning spectrum: maps, least amplitudes, intervals.

    Parameters
    ----------
    spectrum : OverturningSpectrum
        What `overturning_spectrum` returned.
    """
    found = spectrum.found
    maps = (*spectrum.shape, spectrum.amplitude.size)
    fallen = found.verdict == Verdict.OVERTURNED
    how = np.where(found.impacts == 0, Overturning.WITHOUT_IMPACT, Overturning.AFTER_IMPACT)
    variables = {
        "verdict": flags(
            (*_LINE, "amplitude"), found.verdict.reshape(maps), Verdict, "stability verdict"
        ),
        "overturning": flags(
            (*_LINE, "amplitude"),
            np.where(fallen, how, Overturning.NONE).reshape(maps),
            Overturning,
            "how the frame overturns",
        ),
        "minimum_overturning_amplitude": variable(
            _LINE,
            spectrum.minimum_overturning_amplitude,
            "1",
            f"least amplitude that overturns, {_AMPLITUDE}",
            comment="NaN: none up to the largest amplitude. Slivers thinner than the step of "
            "amplitude may be missed",
        ),
        **_interval_variables(spectrum),
        **_frame_variables(spectrum),
        "phase": variable(
            "wavelet", [pulse.phase for pulse in spectrum.pulses], "rad", "phase of the pulse"
        ),
        "half_cycles": variable(
            "wavelet",
            [math.nan if p.half_cycles is None else p.half_cycles for p in spectrum.pulses],
            "1",
            "number of half cycles of the pulse",
        ),
    }
    coords = {
        "wavelet": texts("wavelet", [pulse.wavelet for pulse in spectrum.pulses], "wavelet"),
        **_of_columns(spectrum),
        "frequency_ratio": variable(
            "frequency_ratio",
            spectrum.frequency_ratio,
            "1",
            "omega_p / p, p of the column alone",
        ),
        "amplitude": variable("amplitude", spectrum.amplitude, "1", _AMPLITUDE),
    }
    title = "Overturning of free-standing frames by acceleration pulses"
    return xr.Dataset(variables, coords=coords, attrs={"title": title})


def _of_columns(spectrum: OverturningSpectrum | RockingSpectrum) -> dict[str, xr.Variable]:
    return {
        "slenderness": variable(
            "slenderness", spectrum.slenderness, "rad", "slenderness of a column, alpha"
        ),
        "mass_ratio": variable(
            "mass_ratio", spectrum.mass_ratio, "1", "mass of the beam over that of all columns"
        ),
    }


def _interval_variables(spectrum: OverturningSpectrum) -> dict[str, xr.Variable]:
    """Intervals beside each other along ``interval``, as many as the line that has most."""
    found = spectrum.found
    counts = np.bincount(found.line, minlength=len(found.verdict))
    rank = np.arange(found.line.size) - np.searchsorted(found.line, found.line)
    size = max(1, int(counts.max()))
    lower, upper = np.full((2, counts.size, size), np.nan)
    impacts = np.full((counts.size, size), -1, dtype=np.int32)
    lower[found.line, rank], upper[found.line, rank] = found.lower, found.upper
    impacts[found.line, rank] = found.impacts_at_lower
    end = float(spectrum.amplitude[-1])
    stand = np.array([len(islands(bounds, end)) for bounds in found.intervals()], dtype=np.int32)
    shape, dims = (*spectrum.shape, size), (*_LINE, "interval")
    return {
        "overturning_intervals": variable(
            _LINE,
            counts.astype(np.int32).reshape(spectrum.shape),
            "1",
            "number of intervals of amplitude that overturn",
        ),
        "safe_islands": variable(
            _LINE,
            stand.reshape(spectrum.shape),
            "1",
            "number of intervals above the least amplitude in which the frame stands",
        ),
        "interval_lower": variable(
            dims,
            lower.reshape(shape),
            "1",
            f"least amplitude of an interval that overturns, {_AMPLITUDE}",
            comment="NaN beyond overturning_intervals",
        ),
        "interval_upper": variable(
            dims,
            upper.reshape(shape),
            "1",
            f"largest amplitude of an interval that overturns, {_AMPLITUDE}",
            comment="NaN in the last interval: it goes on beyond the largest amplitude",
        ),
        "interval_impacts": variable(
            dims,
            impacts.reshape(shape),
            "1",
            "number of impacts before overturning at the interval's least amplitude",
            comment="-1 beyond overturning_intervals",
        ),
    }


def _frame_variables(spectrum: OverturningSpectrum) -> dict[str, xr.Variable]:
    frames = [
        [column_of(float(alpha), float(gamma)) for gamma in spectrum.mass_ratio]
        for alpha in spectrum.slenderness
    ]
    of_frame = ("slenderness", "mass_ratio")
    return {
        "restitution": variable(
            of_frame,
            [[frame.restitution for frame in row] for row in frames],
            "1",
            "angular velocity after an impact over that before, sqrt(r)",
        ),
        "effective_frequency_ratio": variable(
            of_frame,
            [[f.effective_frequency_parameter / f.frequency_parameter for f in r] for r in frames],
            "1",
            "frequency parameter of the frame over that of a column, p-hat / p",
        ),
    }


def rocking_spectrum_dataset(names: Sequence[str], spectrum: RockingSpectrum) -> xr.Dataset:
    """Return the dataset of the rocking spectra of records.

    Parameters
    ----------
    names : sequence of str
        Identifiers of the records.
    spectrum : RockingSpectrum
        What `rocking_spectrum` returned for them.
    """
    dims = ("record", "slenderness", "mass_ratio", "column_period")
    after = "free rocking after the record included"
    return xr.Dataset(
        {
            "record_id": record_ids(names),
            "verdict": flags(dims, spectrum.verdict, Verdict, "stability verdict"),
            "peak_rotation_ratio": variable(
                dims, spectrum.peak_rotation_ratio, "1", f"largest |theta| / slenderness, {after}"
            ),
            "peak_velocity": variable(
                dims,
                spectrum.peak_velocity,
                "rad s-1",
                f"largest angular velocity, {after}",
                comment="of what overturns until it does",
            ),
        },
        coords={
            **_of_columns(spectrum),
            "column_period": variable(
                "column_period", spectrum.column_period, "s", "2 pi / p of a column alone"
            ),
        },
        attrs={"title": "Rocking spectra of records"},
    )


def read_spectrum(path: Path) -> xr.Dataset:
    """Return the dataset of a file of overturning spectra; its variables state their units.

    Parameters
    ----------
    path : Path
        Output of `rockframe.spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    with opened(path, SPECTRUM) as dataset:
        return dataset.load()


def read_rocking_spectrum(path: Path) -> xr.Dataset:
    """Return the dataset of a file of rocking spectra; its variables state their units.

    Parameters
    ----------
    path : Path
        Output of `rockframe.rocking_spectrum_stage`.

    Raises
    ------
    InputError
        If the file is missing, damaged, or something else.
    """
    with opened(path, ROCKING_SPECTRUM) as dataset:
        return dataset.load()
