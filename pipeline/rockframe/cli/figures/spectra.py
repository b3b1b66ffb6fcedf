"""Figures over many responses: overturning spectra, rocking spectra, stability maps."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rockframe.cli.figures.inputs import Pair
    from rockframe.figures.captioned import Captioned

#: Slendernesses [degrees] and mass ratios of Figure 9; the last ratio stands for the limit of a
#: very heavy beam. The paper does not state its mass ratios.
_SLENDERNESSES: Final = (10.0, 14.0)
_MASS_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, 1e15)
#: Limits of its axes [1].
_FREQUENCY_RATIOS: Final = (1.0, 8.0)
_AMPLITUDES: Final = (1.0, 15.0)
#: Relative tolerance of the curves [1]: less than a hundredth of the width of a line.
_TOLERANCE: Final = 1e-6

#: Slendernesses of rocking spectra [degrees]; first, last and number of 2 pi / p [s].
_ROCKING: Final = (6.0, 10.0, 14.0, 20.0)
_PERIODS: Final = (2.0, 15.0, 261)

#: Heights of a stability map as multiples of the structure's, and its largest scale.
_HEIGHTS: Final = (0.1, 4.0)
_LARGEST_SCALE: Final = 4.0
#: Stability maps are coarser by this factor, as responses to records take longer than to pulses.
_COARSER: Final = 4


def add_grid(parser: argparse.ArgumentParser) -> None:
    """Add the option of the resolution of maps."""
    parser.add_argument(
        "--grid",
        type=int,
        default=400,
        metavar="N",
        help="points along each side of the maps of figure 9; a stability map has a quarter of "
        "them (default: 400)",
    )


def draw_9(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw Figure 9 of the paper."""
    import numpy as np

    from rockframe.figures.spectra import draw_overturning_spectra
    from rockframe.results.spectra import spectrum_dataset
    from rockframe.rocking import overturning_spectrum
    from rockframe.wavelets.family import RICKERS
    from rockframe.wavelets.pulse import Pulse

    points = _points(options)
    found = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(_SLENDERNESSES),
        _MASS_RATIOS,
        np.linspace(*_FREQUENCY_RATIOS, points),
        np.linspace(*_AMPLITUDES, points),
        tolerance=_TOLERANCE,
    )
    return draw_overturning_spectra(spectrum_dataset(found)), 0


def draw_rocking(pair: Pair) -> tuple[Captioned, int]:
    """Draw the rocking spectra of a record."""
    import numpy as np

    from rockframe.figures.spectra import draw_rocking_spectrum
    from rockframe.results.spectra import rocking_spectrum_dataset
    from rockframe.rocking import rocking_spectrum

    found = rocking_spectrum(
        [pair.motion or pair.record],
        np.radians(_ROCKING),
        [pair.frame.mass_ratio],
        np.linspace(*_PERIODS),
    )
    dataset = rocking_spectrum_dataset([pair.record.record_id], found)
    return draw_rocking_spectrum(dataset), pair.status


def draw_stability(pair: Pair, options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the stability map of a record."""
    import numpy as np

    from rockframe.figures.stability_map import draw_stability_map
    from rockframe.results.plots.stability import stability_dataset

    points = max(2, _points(options) // _COARSER)
    heights = pair.frame.height * np.geomspace(*_HEIGHTS, points)
    scales = np.linspace(_LARGEST_SCALE / points, _LARGEST_SCALE, points)
    dataset = stability_dataset(pair.record, pair.frame, heights, scales, pair.motion)
    return draw_stability_map(dataset), pair.status


def _points(options: argparse.Namespace) -> int:
    from rockframe.errors import ParameterError

    points = int(options.grid)
    if not 2 <= points <= 4000:
        raise ParameterError(f"Invalid grid {points}. Must be 2 to 4000.")
    return points
