"""The figures that `rockframe figure` draws. FIGURES has one line for each."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from rockframe.cli.arguments import chosen_structures, stated_records
from rockframe.cli.figures import pulses as pulse_figures
from rockframe.cli.figures.inputs import (
    chosen_records,
    pair_of,
    structure_of,
    title_of,
)
from rockframe.cli.figures.pulses import draw_9, draw_rocking, draw_stability
from rockframe.options.respond import RespondOptions

if TYPE_CHECKING:
    from rockframe.figures.captioned import Captioned

#: Largest number of histories on a page.
_MOST_RECORDS: Final = 12
#: Mass ratios of Figure 7; the paper does not state its own.
_MASS_RATIOS: Final = (0.0, 0.25, 1.0, 4.0, float("inf"))


@dataclass(frozen=True)
class Entry:
    """A figure: its summary, and the function that returns the figure and the exit status."""

    summary: str
    draw: Callable[[argparse.Namespace], tuple[Captioned, int]]


def _draw_5(_options: argparse.Namespace) -> tuple[Captioned, int]:
    import numpy as np

    from rockframe.figures.parameters import draw_equivalent_size
    from rockframe.results.plots.curves import size_dataset

    return draw_equivalent_size(size_dataset(np.linspace(0.0, 10.0, 201))), 0


def _draw_7(_options: argparse.Namespace) -> tuple[Captioned, int]:
    import numpy as np

    from rockframe.figures.parameters import draw_restitution
    from rockframe.results.plots.curves import restitution_dataset

    degrees = np.arange(0.1, 60.0, 0.1)
    return draw_restitution(restitution_dataset(np.radians(degrees), _MASS_RATIOS)), 0


def _draw_11(options: argparse.Namespace) -> tuple[Captioned, int]:
    from rockframe.cli.console import show_rejections
    from rockframe.errors import ParameterError
    from rockframe.figures.response_grid import draw_response_grid
    from rockframe.results.records import open_records
    from rockframe.results.response import open_response
    from rockframe.stages.respond import respond_stage

    frame = structure_of(options)
    with stated_records(options) as (given, status), tempfile.TemporaryDirectory() as folder:
        with open_records(given) as file:
            names = chosen_records(options, file)
            if len(names) > _MOST_RECORDS:
                raise ParameterError(
                    f"Invalid number of records, {len(names)}. Must be at most {_MOST_RECORDS}: "
                    "choose with --record."
                )
            records = [file.read(name) for name in names]
        response_file = Path(folder) / "response.nc"
        unanswered = respond_stage(
            given,
            response_file,
            RespondOptions(structure=frame.name, vertical=options.vertical, margins="none"),
            structures_path=chosen_structures(options),
        )
        show_rejections(unanswered)
        missing = {rejection.file for rejection in unanswered}
        records = [record for record in records if record.record_id not in missing]
        with open_response(response_file) as response:
            histories = [response.sel(record=r.record_id, structure=frame.name) for r in records]
    accelerations = {record.record_id: record.acceleration for record in records}
    titles = {record.record_id: title_of(record) for record in records}
    drawn = draw_response_grid(accelerations, histories, titles, vertical=options.vertical)
    return drawn, 1 if missing else status


def _draw_moment_rotation(options: argparse.Namespace) -> tuple[Captioned, int]:
    from rockframe.figures.portraits import draw_moment_rotation
    from rockframe.results.plots.joints import portrait_dataset

    pair = pair_of(options)
    return draw_moment_rotation(portrait_dataset(pair.record, pair.frame, pair.motion)), pair.status


def _draw_phase_portrait(options: argparse.Namespace) -> tuple[Captioned, int]:
    from rockframe.figures.portraits import draw_phase_portrait
    from rockframe.results.plots.joints import portrait_dataset

    pair = pair_of(options)
    return draw_phase_portrait(portrait_dataset(pair.record, pair.frame, pair.motion)), pair.status


def _draw_joints(options: argparse.Namespace) -> tuple[Captioned, int]:
    from rockframe.errors import ParameterError
    from rockframe.figures.joints import draw_joints
    from rockframe.results.plots.joints import joints_dataset

    if not options.friction > 0.0:
        raise ParameterError(f"Invalid friction {options.friction!r}. Must be positive.")
    pair = pair_of(options)
    joints = joints_dataset(
        pair.record,
        pair.frame,
        pair.motion,
        spacing=options.spacing,
        beam_centre=options.beam_centre,
    )
    return draw_joints(joints, options.friction), pair.status


#: All figures by their names on the command line, in the order of the help.
FIGURES: Final[Mapping[str, Entry]] = MappingProxyType(
    {
        "5": Entry("size of the equivalent column", _draw_5),
        "7": Entry("largest restitution", _draw_7),
        "8": Entry("records and the pulses in them", pulse_figures.draw_8),
        "9": Entry("minimum overturning acceleration spectra", draw_9),
        "11": Entry("histories under records", _draw_11),
        "moment-rotation": Entry("restoring moment and the part reached", _draw_moment_rotation),
        "phase-portrait": Entry("rate over rotation, impacts, barrier", _draw_phase_portrait),
        "scalogram": Entry("wavelet transform of a record", pulse_figures.draw_scalogram),
        "match-index": Entry("match index against period", pulse_figures.draw_match_curves),
        "joints": Entry("friction demand and vertical forces", _draw_joints),
        "rocking-spectrum": Entry(
            "peak rotation and rate over 2 pi / p", lambda options: draw_rocking(pair_of(options))
        ),
        "stability-map": Entry(
            "verdict over size and scale", lambda options: draw_stability(pair_of(options), options)
        ),
    }
)
