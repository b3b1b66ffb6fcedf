"""Figures of frames, and the records and structures that figures show."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np
import xarray as xr

from rockframe.cli import arguments, console
from rockframe.components.pairing import vertical_beside
from rockframe.errors import ParameterError, require_known
from rockframe.figures import joints, parameters, spectra
from rockframe.figures.captioned import Captioned
from rockframe.figures.histories import draw_response_grid
from rockframe.figures.margins import draw_stability_map
from rockframe.frame import RockingFrame
from rockframe.options.respond import RespondOptions
from rockframe.paper.table1 import paper_record_of
from rockframe.provenance import scratch_folder
from rockframe.record import Record
from rockframe.results.plots.curves import restitution_dataset, size_dataset, stability_dataset
from rockframe.results.plots.records import joints_dataset, portrait_dataset
from rockframe.results.records import RecordsFile, open_records
from rockframe.results.response import open_response
from rockframe.results.spectra import rocking_spectrum_dataset, spectrum_dataset
from rockframe.rocking import (
    GroundAcceleration,
    Verdict,
    overturning_spectrum,
    respond,
    rocking_spectrum,
)
from rockframe.stages.common import horizontal
from rockframe.stages.respond import choose_structures, respond_stage, with_vertical
from rockframe.wavelets.family import RICKERS
from rockframe.wavelets.pulse import Pulse

#: The record, structure and motion of a figure, and the exit status.
Pair = tuple[Record, RockingFrame, GroundAcceleration | None, int]


def pair_of(options: argparse.Namespace) -> Pair:
    """Return the record and the structure of a figure that shows one record."""
    frame = structure_of(options)
    if options.record and len(options.record) > 1:
        raise ParameterError(
            f"Invalid number of records, {len(options.record)}. Must be one for this figure."
        )
    with arguments.stated_records(options) as (given, status), open_records(given) as file:
        record = _largest_rotation(file, chosen_records(options, file), frame)
        beside = vertical_beside(file) if options.vertical else {}
    motion = with_vertical(record, beside) if options.vertical else None
    return record, frame, motion, status


def chosen_records(options: argparse.Namespace, file: RecordsFile) -> list[str]:
    """Return the names of the requested records, or of all horizontal records."""
    known = horizontal(file)
    for name in options.record or ():
        require_known("record", name, known)
    return list(options.record or known)


def _largest_rotation(file: RecordsFile, names: list[str], frame: RockingFrame) -> Record:
    """Return the record with the largest rotation without overturning, or the first."""
    best, furthest = file.read(names[0]), 0.0
    for name in names if len(names) > 1 else ():
        record = file.read(name)
        response = respond(frame, record)
        if response.verdict is Verdict.SAFE and response.peak_rotation > furthest:
            best, furthest = record, response.peak_rotation
    return best


def structure_of(options: argparse.Namespace) -> RockingFrame:
    """Return the requested structure, or the first: by default the paper's bridge bent."""
    return choose_structures(arguments.chosen_structures(options), options.structure)[0]


def title_of(record: Record) -> str:
    """Return the names of event and record in two lines."""
    printed = paper_record_of(record.source_file)
    if printed is not None:
        return f"{printed.event}\n{printed.record}"
    place = "/".join(part for part in (record.station, record.component) if part)
    return "\n".join(part for part in (record.event, place or record.record_id) if part)


#: Largest number of histories on a page.
_MOST_RECORDS: Final = 12
#: Mass ratios of Figure 7, assumed: the paper does not state them.
_MASS_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, float("inf"))
#: Slendernesses [degrees] and mass ratios of Figure 9; the last ratio represents a very heavy beam.
#: The ratios are assumed: the paper does not state them.
_SLENDERNESSES: Final = (10.0, 14.0)
_SPECTRUM_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, 1e15)
#: Limits of the axes of Figure 9 [1].
_FREQUENCY_RATIOS: Final = (1.0, 8.0)
_AMPLITUDES: Final = (1.0, 15.0)
#: Relative tolerance of the curves [1]: less than a hundredth of the width of a line.
_TOLERANCE: Final = 1e-6

#: Slendernesses of rocking spectra [degrees]; first value, last value and number of 2 pi / p [s].
_ROCKING: Final = (6.0, 10.0, 14.0, 20.0)
_PERIODS: Final = (2.0, 15.0, 261)

#: Heights of a stability map, relative to the height of the structure, and the largest scale.
_HEIGHTS: Final = (0.1, 4.0)
_LARGEST_SCALE: Final = 4.0
#: Factor by which stability maps are coarser: responses to records take longer than to pulses.
_COARSER: Final = 4


def draw_5(_options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw Figure 5 of the paper."""
    return parameters.draw_equivalent_size(size_dataset(np.linspace(0.0, 10.0, 201))), 0


def draw_7(_options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw Figure 7 of the paper."""
    degrees = np.arange(0.1, 60.0, 0.1)
    return parameters.draw_restitution(restitution_dataset(np.radians(degrees), _MASS_RATIOS)), 0


def draw_11(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the histories of a structure under records, as in Figure 11 of the paper."""
    frame = structure_of(options)
    with (
        arguments.stated_records(options) as (given, status),
        scratch_folder() as folder,
    ):
        with open_records(given) as file:
            names = chosen_records(options, file)
            if len(names) > _MOST_RECORDS:
                raise ParameterError(
                    f"Invalid number of records, {len(names)}. Must be at most {_MOST_RECORDS}: "
                    "choose with --record."
                )
            records = [file.read(name) for name in names]
        response_file = folder / "response.nc"
        rejections = respond_stage(
            given,
            response_file,
            RespondOptions(structure=frame.name, vertical=options.vertical, margins="none"),
            structures_path=arguments.chosen_structures(options),
        )
        console.show_rejections(rejections)
        missing = {rejection.file for rejection in rejections}
        records = [record for record in records if record.record_id not in missing]
        with open_response(response_file) as response:
            histories = [response.sel(record=r.record_id, structure=frame.name) for r in records]
    accelerations = {record.record_id: record.acceleration for record in records}
    titles = {record.record_id: title_of(record) for record in records}
    drawn = draw_response_grid(accelerations, histories, titles, vertical=options.vertical)
    return drawn, 1 if missing else status


def _draw_portrait(
    draw: Callable[[xr.Dataset], Captioned], options: argparse.Namespace
) -> tuple[Captioned, int]:
    """Draw the rotation of a structure under a record, with its moment or its rate."""
    record, frame, motion, status = pair_of(options)
    return draw(portrait_dataset(record, frame, motion)), status


draw_moment_rotation = partial(_draw_portrait, joints.draw_moment_rotation)
draw_phase_portrait = partial(_draw_portrait, joints.draw_phase_portrait)


def draw_joints(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the friction demand and the vertical forces at the joints."""
    if not options.friction > 0.0:
        raise ParameterError(f"Invalid friction {options.friction!r}. Must be positive.")
    record, frame, motion, status = pair_of(options)
    dataset = joints_dataset(
        record, frame, motion, spacing=options.spacing, beam_centre=options.beam_centre
    )
    return joints.draw_joints(dataset, options.friction), status


def draw_9(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw Figure 9 of the paper."""
    points = _points(options)
    found = overturning_spectrum(
        [Pulse(wavelet=name, a_p=1.0, T_p=1.0) for name in RICKERS],
        np.radians(_SLENDERNESSES),
        _SPECTRUM_RATIOS,
        np.linspace(*_FREQUENCY_RATIOS, points),
        np.linspace(*_AMPLITUDES, points),
        tolerance=_TOLERANCE,
    )
    return spectra.draw_overturning_spectra(spectrum_dataset(found)), 0


def draw_rocking(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the rocking spectra of a record."""
    record, frame, motion, status = pair_of(options)

    found = rocking_spectrum(
        [motion or record],
        np.radians(_ROCKING),
        [frame.mass_ratio],
        np.linspace(*_PERIODS),
    )
    dataset = rocking_spectrum_dataset([record.record_id], found)
    return spectra.draw_rocking_spectrum(dataset), status


def draw_stability(options: argparse.Namespace) -> tuple[Captioned, int]:
    """Draw the stability map of a record."""
    record, frame, motion, status = pair_of(options)

    points = max(2, _points(options) // _COARSER)
    heights = frame.height * np.geomspace(*_HEIGHTS, points)
    scales = np.linspace(_LARGEST_SCALE / points, _LARGEST_SCALE, points)
    dataset = stability_dataset(record, frame, heights, scales, motion)
    return draw_stability_map(dataset), status


def _points(options: argparse.Namespace) -> int:
    points = int(options.grid)
    if not 2 <= points <= 4000:
        raise ParameterError(f"Invalid grid {points}. Must be 2 to 4000.")
    return points
