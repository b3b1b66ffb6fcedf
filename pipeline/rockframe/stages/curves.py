"""Figures of screenings and spectra."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Final

import xarray as xr

from rockframe.figures.captioned import Captioned, save_captioned
from rockframe.figures.comparison import draw_comparison
from rockframe.figures.fragility import draw_fragility, draw_peak_distribution
from rockframe.figures.spectra import draw_overturning_spectra, draw_rocking_spectrum
from rockframe.results.compare import furthest_pairs, read_histories
from rockframe.results.screening.screen import read_screening
from rockframe.results.spectra import read_rocking_spectrum, read_spectrum
from rockframe.rocking import Verdict

#: Name of a figure (without suffix), its description, and the figure.
_Named = tuple[str, str, Captioned]


def draw_curves(given: Mapping[str, Path], folder: Path, most: int) -> dict[str, str]:
    """Draw the curves of files; each kind of file has its own folder.

    Parameters
    ----------
    given : mapping of str to Path
        Files by kind; kinds without curves are ignored.
    folder : Path
        Folder for the new folders.
    most : int
        Largest number of figures of single records.

    Returns
    -------
    dict of str to str
        Description of each figure by its file, relative to the folder.
    """
    drawn: dict[str, str] = {}
    for kind, figures in _FIGURES.items():
        if kind in given:
            for name, shows, figure in figures(given[kind], most):
                file = f"{kind}/{name}.png"
                save_captioned(figure, folder / file)
                drawn[file] = shows
    return drawn


def _of_screening(path: Path, _most: int) -> Iterator[_Named]:
    screening = read_screening(path, every_scale=False)
    for structure in map(str, screening["structure"].values):
        one = screening.sel(structure=structure)
        yield f"fragility-{structure}", structure, draw_fragility(one)
        yield f"peaks-{structure}", structure, draw_peak_distribution(one)


def _of_spectrum(path: Path, _most: int) -> Iterator[_Named]:
    spectrum = read_spectrum(path)
    pulses = " ".join(map(str, spectrum["wavelet"].values))
    yield "overturning", pulses, draw_overturning_spectra(spectrum)


def _of_rocking_spectrum(path: Path, most: int) -> Iterator[_Named]:
    spectrum = read_rocking_spectrum(path)
    for k in _most_rotated(spectrum, most):
        for j, gamma in enumerate(spectrum["mass_ratio"].values):
            one = spectrum.isel(record=[k], mass_ratio=[j])
            name = str(one["record_id"].item())
            yield f"{name}-mass-ratio-{gamma:g}", name, draw_rocking_spectrum(one)


def _most_rotated(spectrum: xr.Dataset, most: int) -> list[int]:
    """Return positions of at most `most` records, with the largest rotations without
    overturning.
    """
    stands = spectrum["verdict"] != Verdict.OVERTURNED
    peaks = spectrum["peak_rotation_ratio"].where(stands, 0.0)
    furthest = peaks.max([dim for dim in peaks.dims if dim != "record"]).values
    return sorted(sorted(range(len(furthest)), key=lambda k: -furthest[k])[:most])


def _of_comparison(path: Path, most: int) -> Iterator[_Named]:
    for record, structure in furthest_pairs(path, most):
        one = read_histories(path, record, structure)
        yield f"{record}-{structure}", f"{record} {structure}", draw_comparison(one)


_FIGURES: Final[Mapping[str, Callable[[Path, int], Iterator[_Named]]]] = {
    "screen": _of_screening,
    "spectrum": _of_spectrum,
    "rocking_spectrum": _of_rocking_spectrum,
    "compare": _of_comparison,
}
