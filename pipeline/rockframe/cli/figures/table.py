"""The figures that `rockframe figure` draws: one line for each."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rockframe.figures.captioned import Captioned


@dataclass(frozen=True)
class Drawing:
    """A figure: its summary, and the module and function that draw it."""

    summary: str
    place: str

    def draw(self, options: argparse.Namespace) -> tuple[Captioned, int]:
        """Import the module, and return the figure and the exit status."""
        module, _, function = self.place.partition(".")
        found = getattr(import_module(f"rockframe.cli.figures.{module}"), function)
        drawn, status = found(options)
        return drawn, int(status)


#: All figures, by name on the command line, in the order of the help.
FIGURES: Final[Mapping[str, Drawing]] = MappingProxyType(
    {
        "5": Drawing("size of the equivalent column", "frames.draw_5"),
        "7": Drawing("largest restitution", "frames.draw_7"),
        "8": Drawing("records and the pulses in them", "pulses.draw_8"),
        "9": Drawing("minimum overturning acceleration spectra", "frames.draw_9"),
        "11": Drawing("histories under records", "frames.draw_11"),
        "moment-rotation": Drawing(
            "restoring moment and the part reached", "frames.draw_moment_rotation"
        ),
        "phase-portrait": Drawing(
            "rate over rotation, impacts, barrier", "frames.draw_phase_portrait"
        ),
        "scalogram": Drawing("wavelet transform of a record", "pulses.draw_scalogram"),
        "match-index": Drawing("match index against period", "pulses.draw_match_curves"),
        "joints": Drawing("friction demand and vertical forces", "frames.draw_joints"),
        "rocking-spectrum": Drawing("peak rotation and rate over 2 pi / p", "frames.draw_rocking"),
        "stability-map": Drawing("verdict over size and scale", "frames.draw_stability"),
    }
)
