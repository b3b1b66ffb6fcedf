"""Write overturning spectra of pulses and rocking spectra of records as netCDF."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.engines.engine import Engine
from rockframe.errors import ParameterError, require_known
from rockframe.options.respond import RockingSpectrumOptions, SpectrumOptions
from rockframe.provenance import refuse_obstacles, refuse_overwriting
from rockframe.results.records import open_records
from rockframe.results.response import (
    read_rocking_spectrum,
    read_spectrum,
    rocking_spectrum_dataset,
    spectrum_dataset,
)
from rockframe.results.schema.response import ROCKING_SPECTRUM_NC, SPECTRUM_NC
from rockframe.results.writing import input_hash, write
from rockframe.rocking import (
    Verdict,
    columns_of,
    overturning_spectrum,
    require_scan,
    rocking_spectrum,
)
from rockframe.stages.common import NamedFigure, Written, horizontal, unseen
from rockframe.study.structures import StructureTable
from rockframe.wavelets.pulse import Pulse

Float = NDArray[np.float64]


def spectrum_stage(
    output: str | Path,
    options: SpectrumOptions,
    *,
    engine: Engine | None = None,
    written: Written = unseen,
) -> None:
    """Compute minimum overturning acceleration spectra of pulses: ``spectrum.nc``.

    Parameters
    ----------
    output : str or Path
        The netCDF file to write.
    options : SpectrumOptions
        Wavelets, frames, and amplitudes of the search.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    written : callable
        Called with the dataset of the written file.

    Raises
    ------
    ParameterError
        If the amplitude step gives more than a million amplitudes, or for the reasons given in
        `overturning_spectrum`.
    InputError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile, rockframe
    >>> options = rockframe.SpectrumOptions(wavelet=["symmetric_ricker"],
    ...     slenderness_degree=[14.0], frequency_ratio=[3.0], max_amplitude=4.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     output = Path(folder, "spectrum.nc")
    ...     spectrum_stage(output, options)
    ...     spectrum = rockframe.read_spectrum(output)
    >>> float(spectrum["minimum_overturning_amplitude"].squeeze().round(3))
    2.704
    """
    output = Path(output)
    refuse_obstacles([output])
    scan = overturning_spectrum(*_scan(options), engine=engine)
    dataset = spectrum_dataset(scan)
    write(
        dataset,
        output,
        SPECTRUM_NC.name,
        input_sha256={},
        parameters=options.stated(),
    )
    written(dataset)


def _scan(options: SpectrumOptions) -> tuple[list[Pulse], Float, Float, Float, Float]:
    """Return the pulses, and the values of each dimension of an overturning spectrum."""
    phase, half_cycles = math.radians(options.phase_degree), options.half_cycles
    pulses = [
        Pulse(wavelet=name, a_p=1.0, T_p=1.0, phase=phase, half_cycles=half_cycles)
        for name in options.wavelet
    ]
    return (
        pulses,
        np.radians(options.slenderness_degree),
        np.array(options.mass_ratio),
        np.array(options.frequency_ratio),
        amplitudes(options.max_amplitude, options.amplitude_step),
    )


def foresee_spectrum(options: SpectrumOptions, _structures: Sequence[StructureTable]) -> None:
    """Raise the errors of `spectrum_stage`, which needs no record."""
    require_scan(*_scan(options))


def foresee_rocking_spectrum(
    options: RockingSpectrumOptions, _structures: Sequence[StructureTable]
) -> None:
    """Raise the errors of `rocking_spectrum_stage` that need no record."""
    columns_of(np.radians(options.slenderness_degree), options.mass_ratio, options.column_period_s)


def rocking_spectrum_stage(
    records_path: str | Path,
    output: str | Path,
    options: RockingSpectrumOptions,
    *,
    engine: Engine | None = None,
    written: Written = unseen,
) -> None:
    """Compute rocking spectra of the horizontal records: ``rocking_spectrum.nc``.

    Parameters
    ----------
    records_path, output : str or Path
        Output of `ingest_stage`, and the netCDF file to write.
    options : RockingSpectrumOptions
        Record and columns.
    engine : Engine, optional
        Engine of the computation; the file does not depend on it.
    written : callable
        Called with the dataset of the written file.

    Raises
    ------
    ParameterError
        If no record is horizontal or has that identifier, or for the reasons given in
        `rocking_spectrum`.
    InputError
        If the records cannot be read, or the file not written.
    """
    records_path, output = Path(records_path), Path(output)
    refuse_overwriting([output], [records_path])
    record = options.record
    with open_records(records_path) as file:
        names = horizontal(file)
        if record is not None:
            require_known("record", record, names)
            names = [record]
        records = [file.read(name) for name in names]
    spectra = rocking_spectrum(
        records,
        np.radians(options.slenderness_degree),
        options.mass_ratio,
        options.column_period_s,
        engine=engine,
    )
    dataset = rocking_spectrum_dataset(names, spectra)
    write(
        dataset,
        output,
        ROCKING_SPECTRUM_NC.name,
        input_sha256=input_hash(records_path),
        parameters=options.stated(),
    )
    written(dataset)


def amplitudes(largest: float, step: float) -> Float:
    """Return the amplitudes of a scan, starting from 1, where uplift begins.

    Raises
    ------
    ParameterError
        If the largest amplitude is not above 1 and at most 1e4, or if the step is not positive or
        gives more than a million amplitudes.

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


def spectrum_figures(path: Path, _most: int) -> Iterator[NamedFigure]:
    """Yield the figure of overturning spectra."""
    from rockframe.figures.spectra import draw_overturning_spectra

    spectrum = read_spectrum(path)
    pulses = " ".join(map(str, spectrum["wavelet"].values))
    yield "overturning", pulses, draw_overturning_spectra(spectrum)


def rocking_spectrum_figures(path: Path, most: int) -> Iterator[NamedFigure]:
    """Yield a figure of each record and mass ratio, of at most `most` records."""
    from rockframe.figures.spectra import draw_rocking_spectrum

    spectrum = read_rocking_spectrum(path)
    for k in _furthest_records(spectrum, most):
        for j, gamma in enumerate(spectrum["mass_ratio"].values):
            panel = spectrum.isel(record=[k], mass_ratio=[j])
            name = str(panel["record_id"].item())
            yield f"{name}-mass-ratio-{gamma:g}", name, draw_rocking_spectrum(panel)


def _furthest_records(spectrum: xr.Dataset, most: int) -> list[int]:
    """Return positions of at most `most` records: those that rotate most without overturning."""
    stands = spectrum["verdict"] != Verdict.OVERTURNS
    peaks = spectrum["peak_rotation_ratio"].where(stands, 0.0)
    furthest = peaks.max([dim for dim in peaks.dims if dim != "record"]).values
    return sorted(sorted(range(len(furthest)), key=lambda k: -furthest[k])[:most])
