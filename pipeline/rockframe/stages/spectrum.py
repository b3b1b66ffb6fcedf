"""spectrum: overturning spectra of pulses, and rocking spectra of records, as netCDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from rockframe.engines import Engine
from rockframe.errors import ParameterError
from rockframe.provenance import refuse_overwriting
from rockframe.results import (
    ROCKING_SPECTRUM,
    SPECTRUM,
    input_hash,
    open_records,
    rocking_spectrum_dataset,
    spectrum_dataset,
    write,
)
from rockframe.rocking import overturning_spectrum, rocking_spectrum
from rockframe.rocking.spectra import AMPLITUDE_STEP
from rockframe.stages.common import horizontal
from rockframe.wavelets import Pulse


def spectrum_stage(
    output: Path,
    *,
    pulses: Sequence[Pulse],
    slendernesses: ArrayLike,
    mass_ratios: ArrayLike,
    frequency_ratios: ArrayLike,
    largest_amplitude: float,
    amplitude_step: float = AMPLITUDE_STEP,
    engine: Engine | None = None,
) -> None:
    """Compute which pulses overturn which frames: ``spectrum.nc``.

    Parameters
    ----------
    output : Path
        The netCDF file to write.
    pulses : sequence of Pulse
        Forms of the pulse; amplitude, period and time of each do not matter.
    slendernesses, mass_ratios, frequency_ratios : array_like
        As `overturning_spectrum` takes them [rad], [1], [1].
    largest_amplitude, amplitude_step : float
        The scan goes from 1 to here in such steps; a_p / (g tan slenderness) [1].
    engine : Engine, optional
        Where it is computed; the file is the same.

    Raises
    ------
    ParameterError
        If the largest amplitude is not above 1, the step not positive, or as
        `overturning_spectrum` says.
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> import math, tempfile, rockframe
    >>> pulse = rockframe.Pulse(wavelet="symmetric_ricker", a_p=1.0, T_p=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     output = Path(folder, "spectrum.nc")
    ...     spectrum_stage(output, pulses=[pulse], slendernesses=[math.radians(14.0)],
    ...         mass_ratios=[0.0], frequency_ratios=[3.0], largest_amplitude=4.0)
    ...     spectrum = rockframe.read_spectrum(output)
    >>> float(spectrum["minimum_overturning_amplitude"].squeeze().round(3))
    2.704
    """
    found = overturning_spectrum(
        pulses,
        slendernesses,
        mass_ratios,
        frequency_ratios,
        amplitudes(largest_amplitude, amplitude_step),
        engine=engine,
    )
    write(
        spectrum_dataset(found),
        output,
        SPECTRUM,
        input_sha256={},
        parameters={
            "wavelets": [pulse.wavelet for pulse in pulses],
            "phase_rad": [pulse.phase for pulse in pulses],
            "half_cycles": [pulse.half_cycles for pulse in pulses],
            "largest_amplitude": largest_amplitude,
            "amplitude_step": amplitude_step,
        },
    )


def rocking_spectrum_stage(
    records_path: Path,
    output: Path,
    *,
    record: str | None = None,
    slendernesses: ArrayLike,
    mass_ratios: ArrayLike,
    column_periods: ArrayLike,
    engine: Engine | None = None,
) -> None:
    """Compute rocking spectra of the horizontal records: ``rocking_spectrum.nc``.

    Parameters
    ----------
    records_path, output : Path
        Output of `ingest_stage`, and the netCDF file to write.
    record : str, optional
        Only the record of this name.
    slendernesses, mass_ratios, column_periods : array_like
        As `rocking_spectrum` takes them [rad], [1], [s].
    engine : Engine, optional
        Where it is computed; the file is the same.

    Raises
    ------
    ParameterError
        If no record is horizontal or of that name, or as `rocking_spectrum` says.
    InputError
        If the records cannot be read, or the file not written.
    """
    refuse_overwriting([output], [records_path])
    with open_records(records_path) as file:
        names = horizontal(file)
        if record is not None and record not in names:
            raise ParameterError(f"Invalid record {record!r}. Must be one of: {', '.join(names)}.")
        names = [record] if record else names
        records = [file.read(name) for name in names]
    found = rocking_spectrum(records, slendernesses, mass_ratios, column_periods, engine=engine)
    write(
        rocking_spectrum_dataset(names, found),
        output,
        ROCKING_SPECTRUM,
        input_sha256=input_hash(records_path),
        parameters={"record": record},
    )


def amplitudes(largest: float, step: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the amplitudes of a scan from 1, where uplift begins.

    Raises
    ------
    ParameterError
        If the largest one is not above 1 and at most 1e4, or the step not positive or so fine
        that there would be more than a million.

    Examples
    --------
    >>> amplitudes(1.6, 0.25).tolist()
    [1.0, 1.25, 1.5, 1.6]
    """
    if not 1.0 < largest <= 1e4:
        raise ParameterError(f"Invalid largest amplitude {largest:g}. Must be above 1, to 10000.")
    if not (step > 0.0 and (largest - 1.0) / step <= 1e6):
        raise ParameterError(
            f"Invalid amplitude step {step:g}. Must be positive, and give a million at most."
        )
    inner = 1.0 + step * np.arange(int(np.ceil((largest - 1.0) / step - 1e-9)))
    return np.append(inner, largest)
