"""Figures of pulses, and of spectra and maps over many responses."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

from rockframe.options.pulse import PulseOptions

if TYPE_CHECKING:
    from rockframe.cli.figures.inputs import Pair
    from rockframe.figures.captioned import Captioned
    from rockframe.matching.match import PulseMatch
    from rockframe.record import Record


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
    from rockframe.results.plots.curves import stability_dataset

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


#: Records of the paper's Figure 8, by their names in its Table 1, and their wavelets.
_PAPER: Final = {"Erzincan/EW": "symmetric_ricker", "Pacoima Dam/164": "antisymmetric_ricker"}
#: Largest number of records on a page.
_MOST_RECORDS: Final = 6


def draw_8(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the requested records, or the paper's two, or the two that match best."""
    from rockframe.cli.figures.inputs import title_of
    from rockframe.errors import ParameterError
    from rockframe.figures.record_and_pulse import draw_record_and_pulse
    from rockframe.results.plots.pulse_pictures import pulse_dataset

    records, status = _records(options)
    if options.record and len(records) > _MOST_RECORDS:
        raise ParameterError(
            f"Invalid number of records, {len(records)}. Must be at most {_MOST_RECORDS}."
        )
    matches = [_rickers(record, matching) for record, matching in records]
    chosen = _asked(matches) if options.record else _shown([r for r, _ in records], matches)
    datasets = [
        pulse_dataset(records[i][0], matches[i][wavelet], _tested(*records[i], wavelet))
        for i, wavelet in chosen
    ]
    titles = {record.record_id: title_of(record).replace("\n", ", ") for record, _ in records}
    return draw_record_and_pulse(datasets, titles), status


def draw_scalogram(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the transform for the Ricker wavelet that matches better."""
    from rockframe.figures.pulse_search import draw_scalogram as draw
    from rockframe.matching.match import best_ricker
    from rockframe.results.plots.pulse_pictures import scalogram_dataset

    (record, matching), status = _clearest(options)
    matches = _rickers(record, matching)
    best = matches[best_ricker(matches)]
    tested = _tested(record, matching, best.pulse.wavelet)
    return draw(scalogram_dataset(record, best, matching, tested)), status


def draw_match_curves(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the match index of all wavelets over the period."""
    from rockframe.figures.pulse_search import draw_match_curves as draw
    from rockframe.matching.match import match_pulses
    from rockframe.results.plots.pulse_pictures import match_curve_dataset

    (record, matching), status = _clearest(options)
    matches = match_pulses(record.acceleration, record.time_step, matching)
    return draw(match_curve_dataset(record, matches, matching)), status


def _records(
    options: argparse.Namespace,
) -> tuple[list[tuple[Record, PulseOptions]], int]:
    """Return the requested records with their usable options, and the exit status."""
    from rockframe.cli.arguments import stated_records
    from rockframe.cli.figures.inputs import chosen_records
    from rockframe.results.records import open_records
    from rockframe.stages.pulse import usable

    with stated_records(options) as (path, status), open_records(path) as file:
        return [
            (file.read(name), usable(name, file, PulseOptions()))
            for name in chosen_records(options, file)
        ], status


def _clearest(options: argparse.Namespace) -> tuple[tuple[Record, PulseOptions], int]:
    """Return the requested record, or the one that a Ricker wavelet matches best."""
    from rockframe.errors import ParameterError
    from rockframe.matching.match import best_ricker

    records, status = _records(options)
    if options.record and len(records) > 1:
        raise ParameterError(
            f"Invalid number of records, {len(records)}. Must be one for this figure."
        )

    def index(pair: tuple[Record, PulseOptions]) -> float:
        matches = _rickers(*pair)
        return matches[best_ricker(matches)].match_index

    return max(records, key=index) if len(records) > 1 else records[0], status


def _rickers(record: Record, matching: PulseOptions) -> dict[str, PulseMatch]:
    from rockframe.matching.match import match_pulses
    from rockframe.wavelets.family import RICKERS

    alone = matching.replaced(wavelet=tuple(RICKERS))
    return match_pulses(record.acceleration, record.time_step, alone)


def _tested(record: Record, matching: PulseOptions, wavelet: str) -> str:
    """Return the result of the test against noise of the match of a wavelet."""
    from rockframe.matching.likeness import likeness, pulse_words
    from rockframe.matching.match import match_pulses

    matches = match_pulses(record.acceleration, record.time_step, matching)
    found = likeness(record.acceleration, record.time_step, matches, matching)[wavelet]
    return pulse_words(found.verdict, found.p_value)


def _asked(matches: list[dict[str, PulseMatch]]) -> list[tuple[int, str]]:
    from rockframe.matching.match import best_ricker

    return [(i, best_ricker(found)) for i, found in enumerate(matches)]


def _shown(records: list[Record], matches: list[dict[str, PulseMatch]]) -> list[tuple[int, str]]:
    """Return the paper's two records if available, else the best one for each wavelet."""
    from rockframe.paper.table1 import paper_record_of

    printed = [paper_record_of(record.source_file) for record in records]
    named = {paper.record: i for i, paper in enumerate(printed) if paper is not None}
    if all(name in named for name in _PAPER):
        return [(named[name], wavelet) for name, wavelet in _PAPER.items()]
    return [
        (max(range(len(matches)), key=lambda i: matches[i][wavelet].match_index), wavelet)
        for wavelet in _PAPER.values()
    ]
